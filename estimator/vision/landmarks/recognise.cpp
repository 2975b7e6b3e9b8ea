// SPDX-License-Identifier: Apache-2.0
#include "vision/landmarks/recognise.hpp"

#include <initializer_list>

#include "math/elementary.hpp"

namespace wm {
namespace {

constexpr double kFirstArea_px2 = 400;  // of the drawn landmark: tolerates the search's coarse steps
constexpr int kReach_px = 4;            // of a level: half a step of the search
// Sigmas of distance (relative), cosine of the slant and azimuth by one landmark's shape. Not swept.
constexpr double kDistanceSigma = 0.03, kFacingSigma = 0.03, kAzimuthSigma_rad = 0.005;
constexpr double kFacingMax = 0.999;  // cosine: the slant's direction must stay defined
constexpr double kFound_px = 3;       // sigma of a matched landmark when the guess is corrected: mounting and lens
constexpr double kStep[3] = {0.01, 0.01, 0.001};  // of numerical derivatives: m, m, rad

double azimuth_of(const matcher &self, const pixel &at) {
  const vec3 ray = self.camera.R_base_optical * self.rays.at(at.u, at.v);
  return atan2(ray.y, ray.x);
}

}  // namespace

bool recognise(matcher *self, const appearance &what, const place_hypothesis &where, int side, recognised *out) {
  double distance = where.distance_m, azimuth = where.azimuth_rad, facing = sincos(where.slant_rad).cos;
  const auto guess_there = [&] {
    // Seen from the front, the width hardly depends on the slant.
    const double across = std::sqrt(1 - facing * facing),
                 slant_sigma = kFacingSigma / std::sqrt(square(across) + kFacingSigma);
    return guess_from(self->camera, what, azimuth, distance, side * atan2(across, facing), kDistanceSigma, slant_sigma,
                      kAzimuthSigma_rad);
  };
  for (const double area : {kFirstArea_px2, kAreaMax_px2}) {
    expected_view one;
    landmark_match seen;
    if (expect_landmark(*self, guess_there(), what, area, &one) != WM_LOOK_FOUND) return false;
    if (one.area_px2 < self->params.search_area_px2) return false;
    const double reach = kReach_px << one.level;
    if (match_landmark(self, one, reach, reach, false, &seen) != WM_LOOK_FOUND) return false;
    azimuth = azimuth_of(*self, seen.at);
    distance /= seen.taller;
    facing *= seen.wider / seen.taller;
    facing = facing < kFacingMax ? facing : kFacingMax;
    out->likeness = seen.likeness;
  }
  out->guess = guess_there();
  return facing >= kFacingMin && finite(out->guess.base_m);
}

void correct_guess(const matcher &self, const appearance *known, const wm_looked_for *looks, int count,
                   camera_guess *guess) {
  const mat3 first = guess->R_map_base;
  double pose[3] = {guess->base_m.x, guess->base_m.y, atan2(first.m[1][0], first.m[0][0])};
  const auto place = [&](const double at[3]) {
    camera_guess out = *guess;
    const sin_cos h = sincos(at[2]);
    out.base_m = {at[0], at[1], guess->base_m.z};
    out.R_map_base = {{{h.cos, -h.sin, 0}, {h.sin, h.cos, 0}, {0, 0, 1}}};
    out.R_map_optical = out.R_map_base * self.camera.R_base_optical;
    out.eye_m = out.base_m + out.R_map_base * self.camera.centre_m;
    return out;
  };
  const auto column_of = [&](const appearance &what, const double at[3], double *u) {
    const camera_guess from = place(at);
    pixel there;
    if (!project(self.camera.optics, transposed_times(from.R_map_optical, what.place_m - from.eye_m), &there))
      return false;
    *u = there.u;
    return true;
  };
  for (int i = 0; i < count; i++) {
    double u = 0, moved_u = 0, by[3], gain[3];
    if (looks[i].look != WM_LOOK_FOUND || !column_of(known[i], pose, &u)) continue;
    bool possible = true;
    for (int k = 0; k < 3; k++) {
      double moved[3] = {pose[0], pose[1], pose[2]};
      moved[k] += kStep[k];
      possible = possible && column_of(known[i], moved, &moved_u);
      by[k] = (moved_u - u) / kStep[k];
    }
    if (!possible) continue;
    double variance = kFound_px * kFound_px;
    for (int k = 0; k < 3; k++) {
      gain[k] = 0;
      for (int j = 0; j < 3; j++) gain[k] += guess->cov[k][j] * by[j];
      variance += by[k] * gain[k];
    }
    for (int k = 0; k < 3; k++) {
      pose[k] += gain[k] * (looks[i].found_px[0] - u) / variance;
      for (int j = 0; j < 3; j++) guess->cov[k][j] -= gain[k] * gain[j] / variance;
    }
  }
  *guess = place(pose);
}

}  // namespace wm
