// SPDX-License-Identifier: Apache-2.0
// What is known of cameras: nothing, by name, as bytes.
#include <math.h>
#include <string.h>

#include "waymark/bytes.h"
#include "waymark/codec.h"

#define RIG_VERSION 2
#define RIG_WITHOUT_ANTENNA 1  // read, too

static void fill_nan(double *values, size_t count) {
  for (size_t i = 0; i < count; i++) values[i] = (double)NAN;
}

void wm_rig_init(wm_rig *out) {
  memset(out, 0, sizeof *out);
  out->stereo.left = out->stereo.right = -1;
  out->stereo.baseline_m = out->marker_size_m = (double)NAN;
  fill_nan(out->stereo.rectified_px, 4);
  fill_nan(out->stereo.sigma_px, 4);
  fill_nan(out->twist6_sigma_v_mps, 3);
  fill_nan(out->twist6_sigma_w_radps, 3);
  fill_nan(out->antenna_m, 3);
}

int wm_rig_find_camera(const wm_rig *rig, const char *name) {
  for (uint32_t i = 0; i < rig->camera_count; i++)
    if (strcmp(rig->cameras[i].name, name) == 0) return (int)i;
  return -1;
}

static void put_camera(wm_writer *w, const wm_camera *v) {
  wm_put_bytes(w, v->name, sizeof v->name);
  wm_put_i32(w, v->model);
  wm_put_u32(w, v->width_px);
  wm_put_u32(w, v->height_px);
  wm_put_u32(w, v->intrinsics_count);
  wm_put_f64s(w, v->intrinsics, v->intrinsics_count);
  wm_put_u32(w, v->distortion_count);
  wm_put_f64s(w, v->distortion, v->distortion_count);
  wm_put_i64(w, v->readout_ns);
  wm_put_f64s(w, v->mounting.xyz_m, 3);
  wm_put_f64s(w, v->mounting.rpy_rad, 3);
}

static uint32_t get_count(wm_reader *r, uint32_t max) {
  uint32_t count = wm_get_u32(r);
  if (count > max) r->bad = 1;
  return r->bad ? 0 : count;
}

static void get_name(wm_reader *r, char name[WM_NAME_MAX]) {
  wm_get_bytes(r, name, WM_NAME_MAX);
  name[WM_NAME_MAX - 1] = '\0';
}

static void get_camera(wm_reader *r, wm_camera *v) {
  get_name(r, v->name);
  v->model = wm_get_i32(r);
  if (v->model < 0 || v->model >= WM_CAMERA_MODEL_COUNT) r->bad = 1;
  v->width_px = wm_get_u32(r);
  v->height_px = wm_get_u32(r);
  v->intrinsics_count = get_count(r, WM_INTRINSICS_MAX);
  wm_get_f64s(r, v->intrinsics, v->intrinsics_count);
  v->distortion_count = get_count(r, WM_INTRINSICS_MAX);
  wm_get_f64s(r, v->distortion, v->distortion_count);
  v->readout_ns = wm_get_i64(r);
  wm_get_f64s(r, v->mounting.xyz_m, 3);
  wm_get_f64s(r, v->mounting.rpy_rad, 3);
}

size_t wm_rig_encode(const wm_rig *v, void *out, size_t capacity) {
  wm_writer w = wm_writer_of(out, capacity);
  wm_put_u8(&w, RIG_VERSION);
  wm_put_u32(&w, v->camera_count);
  for (uint32_t i = 0; i < v->camera_count; i++) put_camera(&w, &v->cameras[i]);
  wm_put_i32(&w, v->stereo.left);
  wm_put_i32(&w, v->stereo.right);
  wm_put_f64(&w, v->stereo.baseline_m);
  wm_put_f64s(&w, v->stereo.rectified_px, 4);
  wm_put_f64s(&w, v->stereo.sigma_px, 4);
  wm_put_f64s(&w, v->twist6_sigma_v_mps, 3);
  wm_put_f64s(&w, v->twist6_sigma_w_radps, 3);
  wm_put_bytes(&w, v->marker_family, sizeof v->marker_family);
  wm_put_f64(&w, v->marker_size_m);
  wm_put_f64s(&w, v->antenna_m, 3);
  return w.full ? 0 : w.used;
}

static void check_pair(wm_reader *r, const wm_rig *v) {
  int32_t count = (int32_t)v->camera_count;
  if (v->stereo.left < -1 || v->stereo.left >= count || v->stereo.right < -1 || v->stereo.right >= count) r->bad = 1;
}

wm_status wm_rig_decode(const void *data, size_t size, wm_rig *out, size_t *used) {
  memset(out, 0, sizeof *out);
  wm_reader r = wm_reader_of(data, size);
  const unsigned version = wm_get_u8(&r);
  if (version != RIG_VERSION && version != RIG_WITHOUT_ANTENNA) r.bad = 1;
  out->camera_count = get_count(&r, WM_CAMERAS_MAX);
  for (uint32_t i = 0; i < out->camera_count && !r.bad; i++) get_camera(&r, &out->cameras[i]);
  out->stereo.left = wm_get_i32(&r);
  out->stereo.right = wm_get_i32(&r);
  check_pair(&r, out);
  out->stereo.baseline_m = wm_get_f64(&r);
  wm_get_f64s(&r, out->stereo.rectified_px, 4);
  wm_get_f64s(&r, out->stereo.sigma_px, 4);
  wm_get_f64s(&r, out->twist6_sigma_v_mps, 3);
  wm_get_f64s(&r, out->twist6_sigma_w_radps, 3);
  get_name(&r, out->marker_family);
  out->marker_size_m = wm_get_f64(&r);
  if (version == RIG_WITHOUT_ANTENNA)
    fill_nan(out->antenna_m, 3);
  else
    wm_get_f64s(&r, out->antenna_m, 3);
  *used = r.used;
  return r.bad ? WM_BAD_DATA : WM_OK;
}
