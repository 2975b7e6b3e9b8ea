// SPDX-License-Identifier: Apache-2.0
// A search of the whole own map for the points of one picture, spread over cycles: each compares so many pairs at most.
// It ends with a pose, which a later picture confirms near the places that it expects.
#ifndef WAYMARK_ESTIMATOR_STEREO_EKF_MAP_SEARCH_HPP
#define WAYMARK_ESTIMATOR_STEREO_EKF_MAP_SEARCH_HPP

#include "filters/relocalize/pose_consensus.hpp"
#include "filters/stereo_ekf/own_map.hpp"

namespace wm {

// Share of wrong matches that agree with a wrong pose, at least and at most.
inline constexpr double kShareLeast = 0.02, kShareMost = 0.99;
// A match agrees within so many sigmas of its place.
inline constexpr double kAgree_sigmas = 3.4;

class map_search {
 public:
  // Points that are looked for. It bounds the time of a search; it was not swept.
  static constexpr int kPointsMost = 48;
  // Pairs of a cycle: those of a key frame, and of more while they are fewer. A pair takes 60 instructions, so a cycle
  // less than the points of one picture. 200 full key frames take 50 cycles, a second.
  static constexpr int kPairsEnough = 12288;

  void cancel() { stage_ = kIdle; }
  // For the points of a picture at this odometry; add() gives them.
  void begin(const pose3 &odometry);
  void add(const uint64_t appearance[kAppearanceWords], const vec3 &in_body, double sigma_m);
  int points() const { return static_cast<int>(points_); }
  bool is_idle() const { return stage_ == kIdle; }
  bool has_pose() const { return stage_ == kFound; }
  // A cycle's share of the work. True: all are compared; matches() has them, and found() or cancel() ends the search.
  bool step(const own_map &map);
  // Matches, their places in map axes by `place(frame, point)`, and the share of wrong ones that agree by chance.
  template <class Place>
  double matches(const own_map &map, Place place, matched_points *out) const;
  void found(const pose3 &body);
  // The pose that was found, carried on by odometry.
  pose3 pose(const pose3 &odometry) const;

 private:
  enum stage : int64_t { kIdle, kComparing, kFound };
  struct one {
    uint64_t appearance[kAppearanceWords];
    vec3 in_body;
    double sigma_m;
    alike_point alike;
  };
  int64_t stage_, points_, frame_;
  pose3 odometry_, body_;
  one point_[kPointsMost];
};

double trace_of(const double symmetric[6]);

template <class Place>
double map_search::matches(const own_map &map, Place place, matched_points *out) const {
  double areas_m2 = 0.0;
  vec3 low = {0, 0, 0}, high = {0, 0, 0};
  for (int64_t i = 0; i < points_; i++) {
    const one &seen = point_[i];
    const auto number = static_cast<int>(seen.alike.number);
    if (!seen.alike.is_clear()) continue;
    const int frame = own_map::frame_of(number), point = own_map::index_of(number);
    if (!map.is_used(frame) || point >= map.points_of(frame)) continue;  // given up meanwhile
    const vec3 there = place(frame, point);
    const double variance = square(seen.sigma_m) + trace_of(map.point(frame, point).noise) / 3.0;
    areas_m2 += square(kAgree_sigmas) * variance;
    for (int k = 0; k < 3; k++) {
      low[k] = out->count == 0 || there[k] < low[k] ? there[k] : low[k];
      high[k] = out->count == 0 || there[k] > high[k] ? there[k] : high[k];
    }
    out->from[out->count] = seen.in_body;
    out->to[out->count] = there;
    out->weight[out->count] = 1.0 / variance;
    out->id[out->count++] = number;
  }
  if (out->count == 0) return kShareMost;
  // Wrong matches are spread over the places that were found.
  const vec3 spread = high - low;
  const double share = areas_m2 / (out->count * (0.25 * dot(spread, spread) + square(kAgree_sigmas) * 1e-4));
  return share < kShareLeast ? kShareLeast : share < kShareMost ? share : kShareMost;
}

}  // namespace wm

#endif
