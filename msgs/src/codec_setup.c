// SPDX-License-Identifier: Apache-2.0
#include <math.h>

#include "waymark/bytes.h"
#include "waymark/codec.h"

#define WHEELS_VERSION 1
#define SENSOR_VERSION 1
#define LANDMARK_VERSION 3
#define LANDMARK_ZERO_IS_ABSENT 2  // read, too: zeros stand for absent numbers; hashes are of this version
#define START_VERSION 1

#define LANDMARK_ENCODED_BYTES 77

size_t wm_wheels_encode(const wm_wheels *v, void *out, size_t capacity) {
  uint32_t count = v->steering_table_count < WM_STEERING_TABLE_MAX ? v->steering_table_count : WM_STEERING_TABLE_MAX;
  wm_writer w = wm_writer_of(out, capacity);
  wm_put_u8(&w, WHEELS_VERSION);
  wm_put_f64(&w, v->radius_m);
  wm_put_f64(&w, v->ticks_per_turn);
  wm_put_f64(&w, v->track_m);
  wm_put_f64(&w, v->wheelbase_m);
  wm_put_f64(&w, v->steering_ratio);
  wm_put_f64(&w, v->encoder_offset_m);
  wm_put_u32(&w, count);
  wm_put_f64s(&w, v->actuator_m, count);
  wm_put_f64s(&w, v->road_wheel_rad, count);
  return w.full ? 0 : w.used;
}

wm_status wm_wheels_decode(const void *data, size_t size, wm_wheels *out, size_t *used) {
  memset(out, 0, sizeof *out);
  wm_reader r = wm_reader_of(data, size);
  if (wm_get_u8(&r) != WHEELS_VERSION) r.bad = 1;
  out->radius_m = wm_get_f64(&r);
  out->ticks_per_turn = wm_get_f64(&r);
  out->track_m = wm_get_f64(&r);
  out->wheelbase_m = wm_get_f64(&r);
  out->steering_ratio = wm_get_f64(&r);
  out->encoder_offset_m = wm_get_f64(&r);
  uint32_t count = wm_get_u32(&r);
  if (count > WM_STEERING_TABLE_MAX) r.bad = 1;
  if (!r.bad) {
    out->steering_table_count = count;
    wm_get_f64s(&r, out->actuator_m, count);
    wm_get_f64s(&r, out->road_wheel_rad, count);
  }
  *used = r.used;
  return r.bad ? WM_BAD_DATA : WM_OK;
}

size_t wm_sensor_encode(const wm_sensor *v, void *out, size_t capacity) {
  wm_writer w = wm_writer_of(out, capacity);
  wm_put_u8(&w, SENSOR_VERSION);
  wm_put_bytes(&w, v->name, sizeof v->name);
  wm_put_f64s(&w, v->mounting.xyz_m, 3);
  wm_put_f64s(&w, v->mounting.rpy_rad, 3);
  wm_put_f64(&w, v->bearing_sigma_rad);
  wm_put_f64(&w, v->range_sigma_m);
  wm_put_f64(&w, v->max_range_m);
  wm_put_i32(&w, v->range_is_depth);
  return w.full ? 0 : w.used;
}

wm_status wm_sensor_decode(const void *data, size_t size, wm_sensor *out, size_t *used) {
  memset(out, 0, sizeof *out);
  wm_reader r = wm_reader_of(data, size);
  if (wm_get_u8(&r) != SENSOR_VERSION) r.bad = 1;
  wm_get_bytes(&r, out->name, sizeof out->name);
  out->name[sizeof out->name - 1] = '\0';
  wm_get_f64s(&r, out->mounting.xyz_m, 3);
  wm_get_f64s(&r, out->mounting.rpy_rad, 3);
  out->bearing_sigma_rad = wm_get_f64(&r);
  out->range_sigma_m = wm_get_f64(&r);
  out->max_range_m = wm_get_f64(&r);
  out->range_is_depth = wm_get_i32(&r);
  *used = r.used;
  return r.bad ? WM_BAD_DATA : WM_OK;
}

static size_t encode_landmark(const wm_landmark *v, unsigned version, void *out, size_t capacity) {
  wm_writer w = wm_writer_of(out, capacity);
  wm_put_u8(&w, (uint8_t)version);
  wm_put_i32(&w, v->id);
  wm_put_f64s(&w, v->p_m, 3);
  wm_put_f64(&w, v->sigma_m);
  wm_put_f64(&w, v->yaw_rad);
  wm_put_f64s(&w, v->cov_m2, 3);
  wm_put_f64(&w, v->yaw_sigma_rad);
  return w.full ? 0 : w.used;
}

size_t wm_landmark_encode(const wm_landmark *v, void *out, size_t capacity) {
  return encode_landmark(v, LANDMARK_VERSION, out, capacity);
}

wm_status wm_landmark_decode(const void *data, size_t size, wm_landmark *out, size_t *used) {
  memset(out, 0, sizeof *out);
  wm_reader r = wm_reader_of(data, size);
  const unsigned version = wm_get_u8(&r);
  if (version != LANDMARK_VERSION && version != LANDMARK_ZERO_IS_ABSENT) r.bad = 1;
  out->id = wm_get_i32(&r);
  wm_get_f64s(&r, out->p_m, 3);
  out->sigma_m = wm_get_f64(&r);
  out->yaw_rad = wm_get_f64(&r);
  wm_get_f64s(&r, out->cov_m2, 3);
  out->yaw_sigma_rad = wm_get_f64(&r);
  if (version == LANDMARK_ZERO_IS_ABSENT) {
    if (out->sigma_m == 0.0) out->sigma_m = (double)NAN;
    if (out->yaw_sigma_rad == 0.0) out->yaw_sigma_rad = (double)NAN;
    if (out->cov_m2[0] == 0.0) out->cov_m2[0] = out->cov_m2[1] = out->cov_m2[2] = (double)NAN;
  }
  *used = r.used;
  return r.bad ? WM_BAD_DATA : WM_OK;
}

size_t wm_start_encode(const wm_start *v, void *out, size_t capacity) {
  wm_writer w = wm_writer_of(out, capacity);
  wm_put_u8(&w, START_VERSION);
  wm_put_i64(&w, v->t_ns);
  wm_put_f64s(&w, v->p_m, 3);
  wm_put_f64s(&w, v->q_xyzw, 4);
  wm_put_f64(&w, v->heading_rad);
  wm_put_f64(&w, v->sigma_xy_m);
  wm_put_f64(&w, v->sigma_heading_rad);
  return w.full ? 0 : w.used;
}

wm_status wm_start_decode(const void *data, size_t size, wm_start *out, size_t *used) {
  memset(out, 0, sizeof *out);
  wm_reader r = wm_reader_of(data, size);
  if (wm_get_u8(&r) != START_VERSION) r.bad = 1;
  out->t_ns = wm_get_i64(&r);
  wm_get_f64s(&r, out->p_m, 3);
  wm_get_f64s(&r, out->q_xyzw, 4);
  out->heading_rad = wm_get_f64(&r);
  out->sigma_xy_m = wm_get_f64(&r);
  out->sigma_heading_rad = wm_get_f64(&r);
  *used = r.used;
  return r.bad ? WM_BAD_DATA : WM_OK;
}

uint64_t wm_hash(uint64_t hash, const void *bytes, size_t count) {
  const uint8_t *b = bytes;
  for (size_t i = 0; i < count; i++) hash = (hash ^ b[i]) * UINT64_C(0x100000001b3);
  return hash;
}

// Absent numbers are hashed as zeros, so that maps in logs of before keep their hash.
uint64_t wm_landmarks_hash(const wm_landmark *landmarks, size_t count) {
  uint64_t hash = WM_HASH_START;
  for (size_t i = 0; i < count; i++) {
    uint8_t bytes[LANDMARK_ENCODED_BYTES];
    wm_landmark v = landmarks[i];
    double *const optional[] = {&v.sigma_m, &v.cov_m2[0], &v.cov_m2[1], &v.cov_m2[2], &v.yaw_sigma_rad};
    for (size_t k = 0; k < sizeof optional / sizeof *optional; k++)
      if (isnan(*optional[k])) *optional[k] = 0.0;
    hash = wm_hash(hash, bytes, encode_landmark(&v, LANDMARK_ZERO_IS_ABSENT, bytes, sizeof bytes));
  }
  return hash;
}
