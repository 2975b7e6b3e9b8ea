// SPDX-License-Identifier: Apache-2.0
#include "sensors/stereo_rig.hpp"

#include <cstring>

namespace wm {
namespace {

constexpr double kNearest_m = 0.02;  // along the optical axis; nearer points have no useful pixel

bool positive(double x) { return finite(x) && x > 0.0; }

}  // namespace

bool stereo_rig::init(const wm_rig *rig, const char **why) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  if (!rig || rig->stereo.left < 0) return true;
  const wm_stereo_pair &pair = rig->stereo;
  const wm_camera &left = rig->cameras[pair.left];
  const double *px = pair.rectified_px;
  if (!positive(pair.baseline_m) || !positive(px[0]) || !positive(px[1]) || !finite(px[2]) || !finite(px[3])) {
    *why = "calibration.yaml: stereo needs baseline_m and rectified: [fu, fv, cu, cv]";
    return false;
  }
  there = true;
  fu = px[0];
  fv = px[1];
  cu = px[2];
  cv = px[3];
  baseline_m = pair.baseline_m;
  for (int i = 0; i < 4; i++) sigma_px[i] = positive(pair.sigma_px[i]) ? pair.sigma_px[i] : 0.0;
  width_px = left.width_px;
  height_px = left.height_px;
  // The optical axes lie along (-y, -z, x) of the camera's body.
  const mat3 body_optical = {{{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}}};
  R_base_optical = matrix_of_rpy(left.mounting.rpy_rad) * body_optical;
  place = vec_of(left.mounting.xyz_m);
  return true;
}

// [BorisovND]: u = u_0 + f x / z, v = v_0 + f y / z, with axes right, down, ahead (the print's signs are those of
// axes left and up).
void stereo_rig::see(const vec3 &x, double px[4], double by[4][3]) const {
  const double inverse = 1.0 / x.z;
  for (int side = 0; side < 2; side++) {
    const double across = x.x - (side ? baseline_m : 0.0);
    px[2 * side] = cu + fu * across * inverse;
    px[2 * side + 1] = cv + fv * x.y * inverse;
    double(&u)[3] = by[2 * side], (&v)[3] = by[2 * side + 1];
    u[0] = fu * inverse;
    u[1] = 0.0;
    u[2] = -fu * across * inverse * inverse;
    v[0] = 0.0;
    v[1] = fv * inverse;
    v[2] = -fv * x.y * inverse * inverse;
  }
}

bool stereo_rig::triangulate(const double px[4], double disparity_min_px, vec3 *x, double by[3][4]) const {
  const double disparity = px[0] - px[2];
  if (!(disparity >= disparity_min_px)) return false;
  const double z = fu * baseline_m / disparity, z_by = -z / disparity;
  const double u = (px[0] - cu) / fu, v = (0.5 * (px[1] + px[3]) - cv) / fv;
  *x = {z * u, z * v, z};
  const double rows[3][4] = {
      {z_by * u + z / fu, 0, -z_by * u, 0}, {z_by * v, 0.5 * z / fv, -z_by * v, 0.5 * z / fv}, {z_by, 0, -z_by, 0}};
  std::memcpy(by, rows, sizeof rows);
  return true;
}

bool stereo_rig::in_view(const vec3 &x, double margin_px) const {
  if (!(x.z > kNearest_m)) return false;
  double px[4], by[4][3];
  see(x, px, by);
  for (int side = 0; side < 2; side++)
    if (!(px[2 * side] > margin_px && px[2 * side] < width_px - 1 - margin_px && px[2 * side + 1] > margin_px &&
          px[2 * side + 1] < height_px - 1 - margin_px))
      return false;
  return true;
}

}  // namespace wm
