// SPDX-License-Identifier: Apache-2.0
#include "vision/landmarks/recognise.hpp"

#include <initializer_list>

#include "math/elementary.hpp"

namespace wm {
namespace {

constexpr double kAreaFirst = 400;  // px of the picture in which a place that is roughly right is found
constexpr int kReach_px = 4;        // of a level
// What is known of distance (in parts of it), facing and azimuth by one landmark's shape.
constexpr double kDistanceSigma = 0.03, kFacingSigma = 0.03, kAzimuthSigma_rad = 0.005;

double azimuth_of(const looker &self, const pixel &at) {
  const vec3 ray = self.camera.R_base_optical * self.rays.at(at.u, at.v);
  return atan2(ray.y, ray.x);
}

}  // namespace

bool recognise(looker *self, const appearance &what, const possible_place &where, int side, recognised *out) {
  double distance = where.distance_m, azimuth = where.azimuth_rad, facing = sincos(where.slant_rad).cos;
  const auto guess_there = [&] {
    // Seen from the front, its width hardly says how slanted it is.
    const double across = std::sqrt(1 - facing * facing),
                 slant_sigma = kFacingSigma / std::sqrt(square(across) + kFacingSigma);
    return guess_from(self->camera, what, azimuth, distance, side * atan2(across, facing), kDistanceSigma, slant_sigma,
                      kAzimuthSigma_rad);
  };
  for (const double area : {kAreaFirst, kAreaMax}) {
    candidate one;
    sight seen;
    if (expect_landmark(*self, guess_there(), what, area, &one) != WM_LOOK_FOUND) return false;
    const double reach = kReach_px << one.level;
    if (look_for(self, one, reach, reach, &seen) != WM_LOOK_FOUND) return false;
    azimuth = azimuth_of(*self, seen.at);
    distance /= seen.taller;
    facing *= seen.wider / seen.taller;
    facing = facing < 0.999 ? facing : 0.999;
    out->likeness = seen.likeness;
  }
  out->guess = guess_there();
  return facing >= self->params.facing_min && finite(out->guess.base_m);
}

}  // namespace wm
