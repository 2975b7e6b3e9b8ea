// SPDX-License-Identifier: Apache-2.0
#include <math.h>

#include "waymark/bytes.h"
#include "waymark/codec.h"
#include "waymark/event_fields.h"

static void put_quantities(wm_writer *w, const wm_quantities *q) {
  size_t count = q->count < WM_QUANTITIES_MAX ? q->count : WM_QUANTITIES_MAX;
  wm_put_u8(w, (uint8_t)count);
  wm_put_u8(w, q->doubt);
  wm_put_u16(w, q->lost_before);
  for (size_t i = 0; i < count; i++) {
    wm_put_u8(w, q->id[i]);
    wm_put_f64(w, q->value[i]);
  }
}

static void put_points(wm_writer *w, const wm_points *p) {
  uint32_t count = p->count < WM_POINTS_MAX ? p->count : WM_POINTS_MAX;
  wm_put_u32(w, count);
  wm_put_u32(w, p->dropped);
  wm_put_i32(w, p->camera);
  for (uint32_t i = 0; i < count; i++) {
    wm_put_f32(w, p->x_m[i]);
    wm_put_f32(w, p->y_m[i]);
    wm_put_f32(w, p->normal_rad[i]);
    wm_put_f32(w, p->sigma_m[i]);
  }
}

static void put_field(wm_writer *w, const wm_event *e, const wm_event_field *field) {
  const void *at = (const char *)e + field->offset;
  switch ((wm_field_type)field->type) {
    case WM_FIELD_F64: wm_put_f64s(w, at, field->count); break;
    case WM_FIELD_I64: wm_put_i64(w, *(const int64_t *)at); break;
    case WM_FIELD_U64:
      for (size_t i = 0; i < field->count; i++) wm_put_u64(w, ((const uint64_t *)at)[i]);
      break;
    case WM_FIELD_I32: wm_put_i32(w, *(const int32_t *)at); break;
    case WM_FIELD_U16: wm_put_u16(w, *(const uint16_t *)at); break;
  }
}

static void put_payload(wm_writer *w, const wm_event *e) {
  size_t count;
  const wm_event_field *fields = wm_event_fields(e->kind, &count);
  if (e->kind == WM_EVENT_QUANTITIES) put_quantities(w, &e->as.quantities);
  if (e->kind == WM_EVENT_POINTS) put_points(w, &e->as.points);
  for (size_t i = 0; i < count; i++) put_field(w, e, &fields[i]);
}

size_t wm_event_encode(const wm_event *event, void *out, size_t capacity) {
  wm_writer w = wm_writer_of(out, capacity);
  wm_put_u8(&w, WM_EVENT_VERSION);
  wm_put_u8(&w, event->kind);
  wm_put_u16(&w, event->source);
  wm_put_u32(&w, event->seq);
  wm_put_i64(&w, event->t_ns);
  wm_put_i64(&w, event->arrival_ns);
  put_payload(&w, event);
  return w.full ? 0 : w.used;
}

// ── hash ────────────────────────────────────────────────────────────────────────────────────────────────────────────

static uint64_t hash_quantities(uint64_t hash, const wm_quantities *q) {
  const size_t count = q->count < WM_QUANTITIES_MAX ? q->count : WM_QUANTITIES_MAX;
  hash = wm_hash(hash, &q->doubt, sizeof q->doubt);
  hash = wm_hash(hash, &q->lost_before, sizeof q->lost_before);
  hash = wm_hash(hash, q->id, count * sizeof q->id[0]);
  return wm_hash(hash, q->value, count * sizeof q->value[0]);
}

static uint64_t hash_points(uint64_t hash, const wm_points *p) {
  const size_t bytes = (p->count < WM_POINTS_MAX ? p->count : WM_POINTS_MAX) * sizeof p->x_m[0];
  hash = wm_hash(hash, &p->dropped, sizeof p->dropped);
  hash = wm_hash(hash, &p->camera, sizeof p->camera);
  hash = wm_hash(hash, p->x_m, bytes);
  hash = wm_hash(hash, p->y_m, bytes);
  hash = wm_hash(hash, p->normal_rad, bytes);
  return wm_hash(hash, p->sigma_m, bytes);
}

uint64_t wm_event_hash(const wm_event *event) {
  static const uint8_t kBytes[] = {
      [WM_FIELD_F64] = 8, [WM_FIELD_I64] = 8, [WM_FIELD_U64] = 8, [WM_FIELD_I32] = 4, [WM_FIELD_U16] = 2};
  size_t count;
  const wm_event_field *fields = wm_event_fields(event->kind, &count);
  uint64_t hash = wm_hash(WM_HASH_START + event->kind, &event->t_ns, sizeof event->t_ns);
  if (event->kind == WM_EVENT_QUANTITIES) hash = hash_quantities(hash, &event->as.quantities);
  if (event->kind == WM_EVENT_POINTS) hash = hash_points(hash, &event->as.points);
  for (size_t i = 0; i < count; i++)
    hash = wm_hash(hash, (const char *)event + fields[i].offset, (size_t)kBytes[fields[i].type] * fields[i].count);
  return hash;
}

// ── from bytes ──────────────────────────────────────────────────────────────────────────────────────────────────────

static void get_quantities(wm_reader *r, wm_quantities *q) {
  q->count = wm_get_u8(r);
  q->doubt = wm_get_u8(r);
  q->lost_before = wm_get_u16(r);
  if (q->count > WM_QUANTITIES_MAX) r->bad = 1;
  for (size_t i = 0; i < q->count && !r->bad; i++) {
    q->id[i] = wm_get_u8(r);
    q->value[i] = wm_get_f64(r);
    if (q->id[i] >= WM_Q_COUNT) r->bad = 1;
  }
}

static void get_points(wm_reader *r, wm_points *p) {
  p->count = wm_get_u32(r);
  p->dropped = wm_get_u32(r);
  p->camera = wm_get_i32(r);
  if (p->count > WM_POINTS_MAX) r->bad = 1;
  for (uint32_t i = 0; i < p->count && !r->bad; i++) {
    p->x_m[i] = wm_get_f32(r);
    p->y_m[i] = wm_get_f32(r);
    p->normal_rad[i] = wm_get_f32(r);
    p->sigma_m[i] = wm_get_f32(r);
  }
}

static void get_numbers(wm_reader *r, unsigned version, const wm_event_field *field, double *out) {
  for (size_t i = 0; i < field->count; i++) {
    out[i] = version < field->since ? (double)NAN : wm_get_f64(r);
    if (version <= field->zero_until && out[i] == 0.0) out[i] = (double)NAN;
  }
}

static void get_field(wm_reader *r, unsigned version, const wm_event_field *field, wm_event *e) {
  void *at = (char *)e + field->offset;
  switch ((wm_field_type)field->type) {
    case WM_FIELD_F64: get_numbers(r, version, field, at); break;
    case WM_FIELD_I64: *(int64_t *)at = wm_get_i64(r); break;
    case WM_FIELD_U64:
      for (size_t i = 0; i < field->count; i++) ((uint64_t *)at)[i] = version < field->since ? 0 : wm_get_u64(r);
      break;
    case WM_FIELD_I32: *(int32_t *)at = wm_get_i32(r); break;
    case WM_FIELD_U16: *(uint16_t *)at = wm_get_u16(r); break;
  }
}

static void get_payload(wm_reader *r, unsigned version, wm_event *e) {
  size_t count;
  const wm_event_field *fields = wm_event_fields(e->kind, &count);
  if (e->kind == WM_EVENT_QUANTITIES) get_quantities(r, &e->as.quantities);
  if (e->kind == WM_EVENT_POINTS) get_points(r, &e->as.points);
  for (size_t i = 0; i < count; i++) get_field(r, version, &fields[i], e);
}

wm_status wm_event_decode(const void *data, size_t size, wm_event *out, size_t *used) {
  memset(out, 0, WM_EVENT_SMALL_BYTES);
  wm_reader r = wm_reader_of(data, size);
  const unsigned version = wm_get_u8(&r);
  if (version < WM_EVENT_VERSION_OLDEST || version > WM_EVENT_VERSION) r.bad = 1;
  out->kind = wm_get_u8(&r);
  if (out->kind == WM_EVENT_NONE || out->kind >= WM_EVENT_KIND_COUNT) r.bad = 1;
  out->source = wm_get_u16(&r);
  out->seq = wm_get_u32(&r);
  out->t_ns = wm_get_i64(&r);
  out->arrival_ns = wm_get_i64(&r);
  if (!r.bad) get_payload(&r, version, out);
  *used = r.used;
  return r.bad ? WM_BAD_DATA : WM_OK;
}
