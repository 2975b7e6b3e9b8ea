// SPDX-License-Identifier: Apache-2.0
#include "vision/landmarks/guess.hpp"

namespace wm {
namespace {

constexpr double kStep_m = 0.01, kStep_rad = 1e-3;     // of numerical derivatives: below a pixel
constexpr double kOff_m = 0.03, kOff_rad = 0.01;       // sigma of any prediction: stamps, an uneven floor. Not swept
constexpr double kOffOfWay = 0.05, kOffOfTurn = 0.05;  // relative: uncalibrated wheels, changing speeds. Not swept

constexpr double kUnknown_px = 1e9;  // spread of a landmark that cannot be projected

void place_camera(const mounted_camera &camera, camera_guess *guess) {
  guess->R_map_optical = guess->R_map_base * camera.R_base_optical;
  guess->eye_m = guess->base_m + guess->R_map_base * camera.centre_m;
}

}  // namespace

bool guess_camera(const mounted_camera &camera, const wm_estimate *prediction, wm_time_ns t_ns, camera_guess *out) {
  if (!prediction || (prediction->state != WM_STATE_TRACKING && prediction->state != WM_STATE_DEAD_RECKONING))
    return false;
  const double dt_s = wm_seconds_between(prediction->t_ns, t_ns);
  if (!(std::fabs(dt_s) < kCarry_s)) return false;
  const vec3 v = vec_of(prediction->v_mps), w = vec_of(prediction->w_radps);
  const quat q = quat_of(prediction->pose_map_base.q_xyzw);
  out->R_map_base = matrix_of(q * turn_by(dt_s * w));
  out->base_m = vec_of(prediction->pose_map_base.p_m) + dt_s * (matrix_of(q * turn_by(0.5 * dt_s * w)) * v);
  place_camera(camera, out);
  constexpr int kOf[3] = {0, 1, 5};
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) out->cov[i][k] = prediction->covariance[wm_cov_index(kOf[i], kOf[k])];
  return finite(out->eye_m) && finite(out->cov[0][0]) && finite(out->cov[1][1]) && finite(out->cov[2][2]);
}

void carry_guess(const mounted_camera &camera, const vec3 &v_mps, const vec3 &w_radps, double dt_s,
                 camera_guess *guess) {
  const vec3 moved = dt_s * (guess->R_map_base * (matrix_of(turn_by(0.5 * dt_s * w_radps)) * v_mps)),
             turn = dt_s * w_radps;
  guess->base_m = guess->base_m + moved;
  guess->R_map_base = guess->R_map_base * matrix_of(turn_by(turn));
  place_camera(camera, guess);
  // Derivative of the displacement by the heading.
  const double swing[2] = {-moved.y, moved.x};
  double(*cov)[3] = guess->cov;
  const double by_heading[2] = {cov[0][2], cov[1][2]};
  for (int i = 0; i < 2; i++)
    for (int k = 0; k < 2; k++)
      cov[i][k] += swing[i] * by_heading[k] + by_heading[i] * swing[k] + swing[i] * cov[2][2] * swing[k];
  for (int i = 0; i < 2; i++) cov[i][2] = cov[2][i] = by_heading[i] + swing[i] * cov[2][2];
  const double off_m2 = square(kOff_m) + square(kOffOfWay) * (square(moved.x) + square(moved.y));
  cov[0][0] += off_m2;
  cov[1][1] += off_m2;
  cov[2][2] += square(kOff_rad) + square(kOffOfTurn * turn.z);
}

namespace {

// Derivatives of a point's pixel by small changes of the point, by forward differences.
struct pixel_slope {
  const lens &optics;
  vec3 point;
  pixel at;

  bool by(const vec3 &change, double step, double out[2]) const {
    pixel moved;
    if (!project(optics, point + change, &moved)) return false;
    out[0] = (moved.u - at.u) / step;
    out[1] = (moved.v - at.v) / step;
    return true;
  }
};

}  // namespace

void expected_spread(const mounted_camera &camera, const camera_guess &guess, const appearance &what,
                     double mounting_sigma_rad, double *across_px, double *down_px) {
  *across_px = *down_px = kUnknown_px;
  pixel_slope slope = {camera.optics, transposed_times(guess.R_map_optical, what.place_m - guess.eye_m), {}};
  const vec3 &m = slope.point;
  if (!project(camera.optics, m, &slope.at)) return;
  double variance[2] = {0, 0}, by_pose[3][2];
  for (int i = 0; i < 3; i++) {
    // Along the map's axes: the landmark's place and the robot's; and the mounting's angles about the optical axes.
    const vec3 unit = {i == 0 ? 1.0 : 0, i == 1 ? 1.0 : 0, i == 2 ? 1.0 : 0};
    double shift[2], turn[2];
    if (!slope.by(transposed_times(guess.R_map_optical, kStep_m * unit), kStep_m, shift) ||
        !slope.by(cross(kStep_rad * unit, m), kStep_rad, turn))
      return;
    for (int k = 0; k < 2; k++) {
      variance[k] += square(shift[k] * what.sigma_m);
      by_pose[i][k] = -shift[k];
      variance[k] += square(turn[k] * mounting_sigma_rad);
    }
  }
  const vec3 from_base = transposed_times(guess.R_map_base, what.place_m - guess.base_m);
  const vec3 by_heading = {kStep_rad * from_base.y, -kStep_rad * from_base.x, 0};
  if (!slope.by(transposed_times(camera.R_base_optical, by_heading), kStep_rad, by_pose[2])) return;
  for (int k = 0; k < 2; k++) {
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) variance[k] += by_pose[i][k] * guess.cov[i][j] * by_pose[j][k];
    variance[k] = larger(variance[k], 0);
  }
  *across_px = std::sqrt(variance[0]);
  *down_px = std::sqrt(variance[1]);
}

}  // namespace wm
