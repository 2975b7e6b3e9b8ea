// SPDX-License-Identifier: Apache-2.0
#include <float.h>
#include <math.h>

#include "calibration.h"

const char *const wm_start_keys[] = {
    "t_ns", "x_m", "y_m", "z_m",        "heading_rad",       "heading_deg",       "qx",
    "qy",   "qz",  "qw",  "sigma_xy_m", "sigma_heading_rad", "sigma_heading_deg", NULL};

void wm_start_init(wm_start *out) {
  const double nan = (double)NAN;
  *out = (wm_start){WM_TIME_NONE, {nan, nan, nan}, {nan, nan, nan, nan}, nan, 0.05, 0.05};
}

// Heading of a unit quaternion, rounded to 1e-12 rad: the C library's arctangent differs in its last bit between
// machines.
static double heading_of(const double q[4]) {
  double heading_rad = atan2(2.0 * (q[3] * q[2] + q[0] * q[1]), 1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2]));
  return round(heading_rad * 1e12) * 1e-12;
}

static wm_status read_quaternion(const wm_yaml_node *map, wm_start *out, wm_error *err) {
  static const char *const kKeys[] = {"qx", "qy", "qz", "qw"};
  double q[4], norm = 0.0;
  int there = 0;
  for (int i = 0; i < 4; i++) {
    wm_yaml_node node = wm_yaml_get(map, kKeys[i]);
    if (!wm_yaml_there(&node)) continue;
    wm_status status = wm_yaml_f64(&node, -1.01, 1.01, &q[i], err);
    if (status != WM_OK) return status;
    norm += q[i] * q[i];
    there++;
  }
  if (there == 0) return WM_OK;
  if (there < 4) return wm_yaml_fail(map, err, "a part of qx, qy, qz, qw is missing: all four are needed, or none");
  norm = sqrt(norm);
  if (fabs(norm - 1.0) > 0.01) return wm_yaml_fail(map, err, "the quaternion's length is %.4g; 1 is needed", norm);
  for (int i = 0; i < 4; i++) out->q_xyzw[i] = q[i] / norm;
  if (isnan(out->heading_rad)) out->heading_rad = heading_of(out->q_xyzw);
  return WM_OK;
}

wm_status wm_start_read(const wm_yaml_node *map, wm_start *out, wm_error *err) {
  static const char *const kPlace[] = {"x_m", "y_m", "z_m"};
  wm_start_init(out);
  if (!wm_yaml_is_map(map)) return wm_yaml_fail(map, err, "a map {t_ns, x_m, y_m, heading_rad} is needed");
  wm_yaml_node t = wm_yaml_get(map, "t_ns"), sigma = wm_yaml_get(map, "sigma_xy_m");
  wm_status status = WM_OK;
  int64_t limit = INT64_C(4000000000000000000);
  if (wm_yaml_there(&t)) status = wm_yaml_i64(&t, -limit, limit, &out->t_ns, err);
  for (int i = 0; status == WM_OK && i < 3; i++) {
    wm_yaml_node node = wm_yaml_get(map, kPlace[i]);
    if (wm_yaml_there(&node)) status = wm_yaml_f64(&node, -1e8, 1e8, &out->p_m[i], err);
  }
  if (status == WM_OK) status = calibration_angle(map, "heading", -2 * M_PI, 2 * M_PI, &out->heading_rad, err);
  if (status == WM_OK) status = read_quaternion(map, out, err);
  if (status == WM_OK && wm_yaml_there(&sigma)) status = wm_yaml_f64(&sigma, DBL_MIN, 1e6, &out->sigma_xy_m, err);
  if (status == WM_OK) status = calibration_angle(map, "sigma_heading", DBL_MIN, 10, &out->sigma_heading_rad, err);
  if (out->heading_rad > M_PI) out->heading_rad -= 2 * M_PI;
  if (out->heading_rad <= -M_PI) out->heading_rad += 2 * M_PI;
  return status;
}
