// SPDX-License-Identifier: Apache-2.0
#include "simulate/features.h"

#include <algorithm>
#include <cmath>

#include "simulate/angle.h"
#include "simulate/motion.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

using Kind = Sensor::Kind;

bool wants(const Sensor &s, int32_t id) { return id >= s.ids[0] && id <= s.ids[1]; }

}  // namespace

uint16_t sensor_index(const Scenario &sc, size_t number) {
  size_t index = sc.cameras.size();
  for (size_t i = 0; i < number; i++) {
    const Kind kind = sc.sensors[i].kind;
    index += kind == Kind::landmarks || kind == Kind::markers || kind == Kind::compass;
  }
  return static_cast<uint16_t>(index);
}

uint64_t camera_number(const Scenario &sc, size_t number) { return sc.cameras.size() + number; }

bool is_covered(const Sensor &s, const Recording &r, double t_s) {
  if (s.areas.empty()) return true;
  const Eigen::Vector3d p = true_pose(r, t_s).translation();
  return std::any_of(s.areas.begin(), s.areas.end(), [&](const Area &a) { return a.holds(p.x(), p.y()); });
}

bool by_pictures(const Scenario &sc, const Sensor &s) {
  return sc.world.pictured() &&
         (s.kind == Kind::markers || s.kind == Kind::edges || s.kind == Kind::stereo || !s.camera.empty());
}

void see_landmark(const Scenario &sc, size_t number, const Seen &seen, const Eigen::Vector3d &p, Recording &out) {
  const Sensor &s = sc.sensors[number];
  const double level_m = std::sqrt(p.x() * p.x() + p.y() * p.y());
  const double bearing = wm::atan2(p.y(), p.x()), range = s.range_is_depth ? p.x() : p.norm();
  if (!wants(s, seen.id) || std::fabs(bearing) > 0.5 * s.field_of_view_rad || level_m > s.range_m || range <= 0) return;
  const FeatureDice dice(out.seed, number, seen.k, seen.landmark);
  if (dice.missed() < s.missed_fraction) return;
  Sighting row{
      seen.t_ns, seen.arrival_ns, sensor_index(sc, number), seen.id, NAN, NAN, dice.outlier() < s.outlier_fraction};
  if (s.gives_bearing)
    row.bearing_rad = row.outlier ? (dice.anything(0) - 0.5) * s.field_of_view_rad
                                  : wrap(bearing + s.bearing_sigma_rad * dice.noise(0));
  if (s.gives_range) {
    // An outlier is an echo: a way round, or anything.
    const double echo = s.outlier_m > 0 ? range + s.outlier_m * dice.anything(1) : s.range_m * dice.anything(1);
    row.range_m = row.outlier ? echo : range + (s.range_sigma_m + s.range_sigma * range) * dice.noise(1);
    row.range_m = std::max(row.range_m, 1e-3);
  }
  out.sightings.push_back(row);
}

void see_marker(const Scenario &sc, size_t number, const Seen &seen, const Eigen::Vector3d &p,
                const Eigen::Vector3d &print, Recording &out) {
  const Sensor &s = sc.sensors[number];
  const double level_m = std::sqrt(p.x() * p.x() + p.y() * p.y());
  double bearing = wm::atan2(p.y(), p.x());
  if (!wants(s, seen.id) || std::fabs(bearing) > 0.5 * s.field_of_view_rad || level_m > s.range_m) return;
  const FeatureDice dice(out.seed, number, seen.k, seen.landmark);
  if (dice.missed() < s.missed_fraction) return;
  MarkerSeen row{};
  row.t_ns = seen.t_ns;
  row.arrival_ns = seen.arrival_ns;
  row.sensor = sensor_index(sc, number);
  row.id = seen.id;
  row.outlier = dice.outlier() < s.outlier_fraction;
  double range = level_m + (s.range_sigma_m + s.range_sigma * level_m) * dice.noise(1);
  bearing += s.bearing_sigma_rad * dice.noise(0);
  row.yaw_rad = wrap(wm::atan2(print.y(), print.x()) + s.heading_sigma_rad * dice.noise(2));
  row.p_m[2] = p.z() + (s.range_sigma_m + s.range_sigma * std::fabs(p.z())) * dice.noise(3);
  if (row.outlier) {  // another one's print, misread
    range = std::min(s.range_m, 100.0) * dice.anything(1);
    bearing = (dice.anything(0) - 0.5) * s.field_of_view_rad;
    row.yaw_rad = wrap(2 * kPi * dice.anything(2));
  }
  row.p_m[0] = range * wm::cos(bearing);
  row.p_m[1] = range * wm::sin(bearing);
  out.markers.push_back(row);
}

namespace {

// The 256 bits of a point's patch at one look: its own, or those of one of sixteen sorts of points that are everywhere,
// with wrong ones.
void look_at_patch(const Sensor &s, uint64_t seed, const FeatureDice &dice, uint64_t landmark, uint64_t out[4]) {
  constexpr uint64_t kSorts = 16, kSort = UINT64_C(1) << 32, kBits = 256;
  const Random random(seed);
  const bool alike = random.uniform(Stream::appearance, landmark, kBits) < s.alike_fraction;
  const uint64_t whose = alike ? kSort + landmark % kSorts : landmark;
  for (uint64_t bit = 0; bit < kBits; bit++) {
    const bool own = (alike ? Random(0) : random).uniform(Stream::appearance, whose, bit) < 0.5;
    const bool wrong = dice.patch(bit) < s.appearance_noise;
    out[bit / 64] = out[bit / 64] << 1 | static_cast<uint64_t>(own != wrong);
  }
}

}  // namespace

void see_stereo(const Scenario &sc, size_t number, const Seen &seen, const double left[2], const double right[2],
                Recording &out) {
  const Sensor &s = sc.sensors[number];
  const FeatureDice dice(out.seed, number, seen.k, seen.landmark);
  if (!wants(s, seen.id) || dice.missed() < s.missed_fraction) return;
  StereoSeen row{seen.t_ns,          seen.arrival_ns,      static_cast<uint16_t>(64 + number), seen.id,
                 {left[0], left[1]}, {right[0], right[1]}, dice.outlier() < s.outlier_fraction};
  if (dice.one_side() < s.one_side_fraction && !std::isnan(left[0]) && !std::isnan(right[0])) {
    double *lost = dice.one_side() < 0.5 * s.one_side_fraction ? row.left_px : row.right_px;
    lost[0] = lost[1] = NAN;
  }
  for (uint64_t i = 0; i < 2; i++) {  // NaN stays NaN
    row.left_px[i] += s.sigma_px * dice.noise(i);
    row.right_px[i] += s.sigma_px * dice.noise(2 + i);
  }
  // A wrong match lies on the epipolar line, a wrong track anywhere.
  if (row.outlier && !std::isnan(row.right_px[0])) {
    row.right_px[0] = s.size_px[0] * dice.anything(0);
    if (dice.anything(2) < 0.5) row.right_px[1] = s.size_px[1] * dice.anything(1);
  } else if (row.outlier) {
    row.left_px[0] = s.size_px[0] * dice.anything(0);
    row.left_px[1] = s.size_px[1] * dice.anything(1);
  }
  if (s.tracks) look_at_patch(s, sc.scatter.seed ? sc.scatter.seed : out.seed, dice, seen.landmark, row.appearance);
  out.stereo.push_back(row);
}

}  // namespace wm::sim
