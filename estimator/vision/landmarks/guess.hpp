// SPDX-License-Identifier: Apache-2.0
// Predicted pose of the camera at the time of a picture, by the filter's newest state, with covariance.
#ifndef WAYMARK_ESTIMATOR_VISION_GUESS_HPP
#define WAYMARK_ESTIMATOR_VISION_GUESS_HPP

#include "vision/landmarks/appearance.hpp"
#include "waymark/internal/sensors/lens.hpp"
#include "waymark/pose.h"

namespace wm {

inline constexpr double kCarry_s = 1;  // longest prediction by a constant twist

struct camera_guess {
  vec3 base_m, eye_m;  // in map
  mat3 R_map_base, R_map_optical;
  double cov[3][3];  // of x, y (m) and heading (rad)
};

// Predicts the state to t_ns by its own twist. False without a usable state: none, searching, lost, or too old.
bool guess_camera(const mounted_camera &camera, const wm_estimate *prediction, wm_time_ns t_ns, camera_guess *out);

// Moves the guess by a constant twist (base_link's axes, m/s and rad/s) over dt_s and inflates its covariance by the
// twist's errors.
void carry_guess(const mounted_camera &camera, const vec3 &v_mps, const vec3 &w_radps, double dt_s,
                 camera_guess *guess);

// Sigmas in pixels of a landmark's middle: by the pose, the landmark's place and the mounting's three angles.
void expected_spread(const mounted_camera &camera, const camera_guess &guess, const appearance &what,
                     double mounting_sigma_rad, double *across_px, double *down_px);

}  // namespace wm

#endif
