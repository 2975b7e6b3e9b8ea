// SPDX-License-Identifier: Apache-2.0
#include <math.h>

#include "waymark/bytes.h"
#include "waymark/codec.h"

#define EVENT_VERSION 5
// Older versions, which are read, too. Up to version 4, zeros stand for some absent numbers.
#define WITHOUT_ELEVATION 3
#define ZERO_IS_ABSENT 4

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

static void put_sighting(wm_writer *w, const wm_sighting *s) {
  wm_put_u16(w, s->sensor);
  wm_put_i32(w, s->landmark_id);
  wm_put_f64(w, s->bearing_rad);
  wm_put_f64(w, s->range_m);
  wm_put_f64(w, s->bearing_sigma_rad);
  wm_put_f64(w, s->range_sigma_m);
  wm_put_f64(w, s->elevation_rad);
  wm_put_f64(w, s->elevation_sigma_rad);
}

static void put_marker(wm_writer *w, const wm_marker *m) {
  wm_put_u16(w, m->sensor);
  wm_put_u16(w, m->poses);
  wm_put_i32(w, m->id);
  wm_put_f64s(w, m->p_m, 3);
  wm_put_f64(w, m->yaw_rad);
  wm_put_f64s(w, m->other_p_m, 3);
  wm_put_f64(w, m->other_yaw_rad);
  wm_put_f64(w, m->along_sigma_m);
  wm_put_f64(w, m->yaw_sigma_rad);
  wm_put_f64(w, m->bloom_px);
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

static void put_payload(wm_writer *w, const wm_event *e) {
  switch ((wm_event_kind)e->kind) {
    case WM_EVENT_QUANTITIES: put_quantities(w, &e->as.quantities); break;
    case WM_EVENT_TWIST2:
      wm_put_f64(w, e->as.twist2.v_mps);
      wm_put_f64(w, e->as.twist2.w_radps);
      break;
    case WM_EVENT_TWIST6:
      wm_put_f64s(w, e->as.twist6.v_mps, 3);
      wm_put_f64s(w, e->as.twist6.w_radps, 3);
      break;
    case WM_EVENT_INCREMENT:
      wm_put_i64(w, e->as.increment.from_ns);
      wm_put_f64(w, e->as.increment.dx_m);
      wm_put_f64(w, e->as.increment.dy_m);
      wm_put_f64(w, e->as.increment.dheading_rad);
      wm_put_f64s(w, e->as.increment.covariance, 6);
      break;
    case WM_EVENT_SIGHTING: put_sighting(w, &e->as.sighting); break;
    case WM_EVENT_POSITION:
      wm_put_f64s(w, e->as.position.p_m, 3);
      wm_put_f64(w, e->as.position.sigma_xy_m);
      wm_put_f64(w, e->as.position.sigma_z_m);
      break;
    case WM_EVENT_HEADING:
      wm_put_f64(w, e->as.heading.heading_rad);
      wm_put_f64(w, e->as.heading.sigma_rad);
      break;
    case WM_EVENT_MARKER: put_marker(w, &e->as.marker); break;
    case WM_EVENT_STEREO:
      wm_put_i32(w, e->as.stereo.id);
      wm_put_f64s(w, e->as.stereo.left_px, 2);
      wm_put_f64s(w, e->as.stereo.right_px, 2);
      break;
    case WM_EVENT_POINTS: put_points(w, &e->as.points); break;
    case WM_EVENT_LOOKED: wm_put_u16(w, e->as.looked.sensor); break;
    case WM_EVENT_SET_POSE:
      wm_put_f64s(w, e->as.set_pose.pose_map_base.p_m, 3);
      wm_put_f64s(w, e->as.set_pose.pose_map_base.q_xyzw, 4);
      wm_put_f64(w, e->as.set_pose.sigma_xy_m);
      wm_put_f64(w, e->as.set_pose.sigma_heading_rad);
      break;
    case WM_EVENT_NONE:
    case WM_EVENT_RESET:
    case WM_EVENT_KIND_COUNT: break;
  }
}

size_t wm_event_encode(const wm_event *event, void *out, size_t capacity) {
  wm_writer w = wm_writer_of(out, capacity);
  wm_put_u8(&w, EVENT_VERSION);
  wm_put_u8(&w, event->kind);
  wm_put_u16(&w, event->source);
  wm_put_u32(&w, event->seq);
  wm_put_i64(&w, event->t_ns);
  wm_put_i64(&w, event->arrival_ns);
  put_payload(&w, event);
  return w.full ? 0 : w.used;
}

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

// A number that zero stood for where it was absent, in versions up to ZERO_IS_ABSENT.
static double get_optional(wm_reader *r, unsigned version) {
  const double value = wm_get_f64(r);
  return version <= ZERO_IS_ABSENT && value == 0.0 ? (double)NAN : value;
}

static void get_sighting(wm_reader *r, unsigned version, wm_sighting *s) {
  const int has_elevation = version > WITHOUT_ELEVATION;
  s->sensor = wm_get_u16(r);
  s->landmark_id = wm_get_i32(r);
  s->bearing_rad = wm_get_f64(r);
  s->range_m = wm_get_f64(r);
  s->bearing_sigma_rad = wm_get_f64(r);
  s->range_sigma_m = wm_get_f64(r);
  s->elevation_rad = has_elevation ? wm_get_f64(r) : (double)NAN;
  s->elevation_sigma_rad = has_elevation ? get_optional(r, version) : (double)NAN;
}

static void get_marker(wm_reader *r, unsigned version, wm_marker *m) {
  m->sensor = wm_get_u16(r);
  m->poses = wm_get_u16(r);
  m->id = wm_get_i32(r);
  wm_get_f64s(r, m->p_m, 3);
  m->yaw_rad = wm_get_f64(r);
  wm_get_f64s(r, m->other_p_m, 3);
  m->other_yaw_rad = wm_get_f64(r);
  m->along_sigma_m = get_optional(r, version);
  m->yaw_sigma_rad = get_optional(r, version);
  m->bloom_px = get_optional(r, version);
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

static void get_payload(wm_reader *r, unsigned version, wm_event *e) {
  switch ((wm_event_kind)e->kind) {
    case WM_EVENT_QUANTITIES: get_quantities(r, &e->as.quantities); break;
    case WM_EVENT_TWIST2:
      e->as.twist2.v_mps = wm_get_f64(r);
      e->as.twist2.w_radps = wm_get_f64(r);
      break;
    case WM_EVENT_TWIST6:
      wm_get_f64s(r, e->as.twist6.v_mps, 3);
      wm_get_f64s(r, e->as.twist6.w_radps, 3);
      break;
    case WM_EVENT_INCREMENT:
      e->as.increment.from_ns = wm_get_i64(r);
      e->as.increment.dx_m = wm_get_f64(r);
      e->as.increment.dy_m = wm_get_f64(r);
      e->as.increment.dheading_rad = wm_get_f64(r);
      wm_get_f64s(r, e->as.increment.covariance, 6);
      break;
    case WM_EVENT_SIGHTING: get_sighting(r, version, &e->as.sighting); break;
    case WM_EVENT_POSITION:
      wm_get_f64s(r, e->as.position.p_m, 3);
      e->as.position.sigma_xy_m = wm_get_f64(r);
      e->as.position.sigma_z_m = wm_get_f64(r);
      break;
    case WM_EVENT_HEADING:
      e->as.heading.heading_rad = wm_get_f64(r);
      e->as.heading.sigma_rad = wm_get_f64(r);
      break;
    case WM_EVENT_MARKER: get_marker(r, version, &e->as.marker); break;
    case WM_EVENT_STEREO:
      e->as.stereo.id = wm_get_i32(r);
      wm_get_f64s(r, e->as.stereo.left_px, 2);
      wm_get_f64s(r, e->as.stereo.right_px, 2);
      break;
    case WM_EVENT_POINTS: get_points(r, &e->as.points); break;
    case WM_EVENT_LOOKED: e->as.looked.sensor = wm_get_u16(r); break;
    case WM_EVENT_SET_POSE:
      wm_get_f64s(r, e->as.set_pose.pose_map_base.p_m, 3);
      wm_get_f64s(r, e->as.set_pose.pose_map_base.q_xyzw, 4);
      e->as.set_pose.sigma_xy_m = wm_get_f64(r);
      e->as.set_pose.sigma_heading_rad = wm_get_f64(r);
      break;
    case WM_EVENT_NONE:
    case WM_EVENT_RESET:
    case WM_EVENT_KIND_COUNT: break;
  }
}

wm_status wm_event_decode(const void *data, size_t size, wm_event *out, size_t *used) {
  memset(out, 0, WM_EVENT_SMALL_BYTES);
  wm_reader r = wm_reader_of(data, size);
  const unsigned version = wm_get_u8(&r);
  if (version < WITHOUT_ELEVATION || version > EVENT_VERSION) r.bad = 1;
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
