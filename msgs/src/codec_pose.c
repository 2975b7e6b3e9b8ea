// SPDX-License-Identifier: Apache-2.0
#include <math.h>

#include "waymark/bytes.h"
#include "waymark/codec.h"

#define PUBLISHED_VERSION 2
#define WITHOUT_LOST_PROBABILITY 1  // the version before, which is read, too
#define INNOVATION_VERSION 1

static void put_estimate(wm_writer *w, const wm_estimate *e) {
  wm_put_i64(w, e->t_ns);
  wm_put_f64s(w, e->pose_map_base.p_m, 3);
  wm_put_f64s(w, e->pose_map_base.q_xyzw, 4);
  wm_put_f64(w, e->heading_rad);
  wm_put_f64s(w, e->covariance, 36);
  wm_put_f64s(w, e->v_mps, 3);
  wm_put_f64s(w, e->w_radps, 3);
  wm_put_u32(w, e->resets);
  wm_put_u8(w, e->dof);
  wm_put_u8(w, e->state);
  wm_put_f64(w, e->lost_probability);
}

static void get_estimate(wm_reader *r, unsigned version, wm_estimate *e) {
  e->t_ns = wm_get_i64(r);
  wm_get_f64s(r, e->pose_map_base.p_m, 3);
  wm_get_f64s(r, e->pose_map_base.q_xyzw, 4);
  e->heading_rad = wm_get_f64(r);
  wm_get_f64s(r, e->covariance, 36);
  wm_get_f64s(r, e->v_mps, 3);
  wm_get_f64s(r, e->w_radps, 3);
  e->resets = wm_get_u32(r);
  e->dof = wm_get_u8(r);
  e->state = wm_get_u8(r);
  e->lost_probability = version > WITHOUT_LOST_PROBABILITY ? wm_get_f64(r) : (double)NAN;
}

size_t wm_published_encode(const wm_published *p, void *out, size_t capacity) {
  wm_writer w = wm_writer_of(out, capacity);
  wm_put_u8(&w, PUBLISHED_VERSION);
  put_estimate(&w, &p->now);
  wm_put_i64(&w, p->made_ns);
  wm_put_i64(&w, p->fused_until_ns);
  wm_put_f64(&w, p->pose_odom_base.x_m);
  wm_put_f64(&w, p->pose_odom_base.y_m);
  wm_put_f64(&w, p->pose_odom_base.heading_rad);
  wm_put_u32(&w, p->jumps);
  wm_put_f64(&w, p->last_jump_m);
  wm_put_f64(&w, p->last_jump_rad);
  wm_put_u32(&w, p->status_flags);
  wm_put_u32(&w, p->deadlines_missed);
  wm_put_i64(&w, p->utc_offset_ns);
  wm_put_i64(&w, p->utc_uncertainty_ns);
  return w.full ? 0 : w.used;
}

wm_status wm_published_decode(const void *data, size_t size, wm_published *out, size_t *used) {
  memset(out, 0, sizeof *out);
  wm_reader r = wm_reader_of(data, size);
  const unsigned version = wm_get_u8(&r);
  if (version < WITHOUT_LOST_PROBABILITY || version > PUBLISHED_VERSION) r.bad = 1;
  get_estimate(&r, version, &out->now);
  out->made_ns = wm_get_i64(&r);
  out->fused_until_ns = wm_get_i64(&r);
  out->pose_odom_base.x_m = wm_get_f64(&r);
  out->pose_odom_base.y_m = wm_get_f64(&r);
  out->pose_odom_base.heading_rad = wm_get_f64(&r);
  out->jumps = wm_get_u32(&r);
  out->last_jump_m = wm_get_f64(&r);
  out->last_jump_rad = wm_get_f64(&r);
  out->status_flags = wm_get_u32(&r);
  out->now.cause = (uint8_t)WM_PUB_CAUSE(out->status_flags);
  out->now.cause_source = -1;
  out->deadlines_missed = wm_get_u32(&r);
  out->utc_offset_ns = wm_get_i64(&r);
  out->utc_uncertainty_ns = wm_get_i64(&r);
  *used = r.used;
  return r.bad ? WM_BAD_DATA : WM_OK;
}

size_t wm_innovation_encode(const wm_innovation *i, void *out, size_t capacity) {
  wm_writer w = wm_writer_of(out, capacity);
  wm_put_u8(&w, INNOVATION_VERSION);
  wm_put_i64(&w, i->t_ns);
  wm_put_u16(&w, i->source);
  wm_put_u16(&w, i->sensor);
  wm_put_i32(&w, i->landmark_id);
  wm_put_u8(&w, i->residual);
  wm_put_u8(&w, i->verdict);
  wm_put_u8(&w, i->gate_dof);
  wm_put_f64(&w, i->observed);
  wm_put_f64(&w, i->expected);
  wm_put_f64(&w, i->variance);
  wm_put_f64(&w, i->nis);
  wm_put_f64(&w, i->gate);
  return w.full ? 0 : w.used;
}

wm_status wm_innovation_decode(const void *data, size_t size, wm_innovation *out, size_t *used) {
  memset(out, 0, sizeof *out);
  wm_reader r = wm_reader_of(data, size);
  if (wm_get_u8(&r) != INNOVATION_VERSION) r.bad = 1;
  out->t_ns = wm_get_i64(&r);
  out->source = wm_get_u16(&r);
  out->sensor = wm_get_u16(&r);
  out->landmark_id = wm_get_i32(&r);
  out->residual = wm_get_u8(&r);
  out->verdict = wm_get_u8(&r);
  out->gate_dof = wm_get_u8(&r);
  out->observed = wm_get_f64(&r);
  out->expected = wm_get_f64(&r);
  out->variance = wm_get_f64(&r);
  out->nis = wm_get_f64(&r);
  out->gate = wm_get_f64(&r);
  if (out->residual >= WM_RESIDUAL_COUNT || out->verdict >= WM_VERDICT_COUNT) r.bad = 1;
  *used = r.used;
  return r.bad ? WM_BAD_DATA : WM_OK;
}
