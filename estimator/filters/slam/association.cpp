// SPDX-License-Identifier: Apache-2.0
// Sightings without an identity: which landmark is it?
#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {

// Individual nearest neighbour, held both ways: the landmark is the sighting's nearest, with no other one near, and the
// sighting is the only one of its stamp that is that landmark's. *fresh: no landmark is anywhere near, it is a new one.
int slam::associate(const wm_sighting &s, const reading &r, const past_pose &past, bool *fresh) const {
  const wm_pose2 from = sensor_pose(s.sensor, past);
  const sin_cos ray = sincos(from.heading_rad + s.bearing_rad);
  const double x = from.x_m + s.range_m * ray.cos, y = from.y_m + s.range_m * ray.sin;
  int best = -1;
  double least = params_.new_gate, second = params_.new_gate;
  for (int i = 0; i < joint_.landmarks(); i++) {
    const int state = joint_.landmark_state(i);
    const double place[2] = {joint_.value(state), joint_.value(state + 1)};
    if (std::fabs(place[0] - x) > params_.associate_near_m || std::fabs(place[1] - y) > params_.associate_near_m)
      continue;
    view v;
    see(s, r, past, place, -1, &v);
    if (!v.possible) continue;
    for (int k = 0; k < 2; k++) {
      v.row[k].add(state, v.by_landmark[k][0]);
      v.row[k].add(state + 1, v.by_landmark[k][1]);
    }
    const double s00 = joint_.variance_of(v.row[0]) + v.noise[0], s11 = joint_.variance_of(v.row[1]) + v.noise[1];
    const double s01 = joint_.covariance_of(v.row[0], v.row[1]);
    const double nis = (s11 * square(v.innovation[0]) - 2.0 * s01 * v.innovation[0] * v.innovation[1] +
                        s00 * square(v.innovation[1])) /
                       (s00 * s11 - s01 * s01);
    if (nis < least) {
      second = least;
      least = nis;
      best = i;
    } else if (nis < second) {
      second = nis;
    }
  }
  *fresh = best < 0;
  const bool taken = best >= 0 && notes()[best].last_ns == joint_.now_ns();
  return best >= 0 && !taken && least < params_.associate_gate && second > 2.0 * least ? best : -1;
}

}  // namespace wm
