// SPDX-License-Identifier: Apache-2.0
// Perceptually aliased poses: other places of the map from which the scans look as from the tracked pose. A robot that
// was set down at one of them sees no difference, so they are listed with their odds. A sweep by the newest scan finds
// them; odometry carries them on; some of them are aligned and weighed with each scan. Work is counted as in
// place_search.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_ALIASED_POSES_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_ALIASED_POSES_HPP

#include "filters/edge_mcl/align.hpp"
#include "filters/edge_mcl/grid_sweep.hpp"

namespace wm {

struct aliased_pose {
  wm_pose2 pose;         // base_link in map now
  double covariance[6];  // xx, xy, yy, x heading, y heading, heading heading
  double odds;           // against the tracked pose, 50 at most
  double explained;      // fraction of the points, less that at the tracked pose; smoothed
  double weighed_m;      // travelled distance when it was weighed last
  double hazard;         // sum until then of the probability of having been carried off
  double began_m;        // travelled distance when its odds last were none
};

// Covariance (xx, xy, yy, x heading, y heading, heading heading) of a place of which a scan's points leave
// `information` (1/m2, of points of 1 m): its inverse beside a weak prior, and the error that all its points share.
// False, and `out` stays, where it can't be inverted.
[[nodiscard]] bool place_covariance(const matrix<3> &information, double out[6]);

class aliased_poses {
 public:
  static constexpr int kCapacity = 128, kWeighed = 24;  // of them with each scan

  // Finds the rotations under which the map's walls are parallel to themselves. At most 100000 places are looked up.
  void init(const edge_map &map);
  void clear(const wm_pose2 &odom);
  void carry(const wm_pose2 &odom);
  // Weighs some of them by a scan in base_link, taken from `own` if the tracked pose is right, `new_m` of travelled
  // distance after the last one. `expected`: fraction of the points that the map explains as a rule; `hazard`:
  // probability of having been carried off since. Then the sweep goes on; `poses`: work at most of all this. Without
  // enough of it poses are weighed only, by work of at most kWeighingCost.
  void update(const edge_map &map, const search_field &field, const floor_points &scan, const wm_pose2 &own,
              double new_m, double expected, double hazard, int poses);
  // The sweep begins anew, with the next scan.
  void restart_sweep() { sweep_.stop(); }

  int count() const { return count_; }
  double odds() const;  // sum
  // The one that explains the most; -1: there is none.
  int best() const;
  // Travelled distance since the likeliest began to be likelier.
  double likelier_for_m() const;
  void forget_odds();
  const aliased_pose &operator[](int i) const { return of_[i]; }

  static constexpr int kPoints = 32, kLookUpCost = 2, kHeadingsMax = 30;
  static constexpr int kWeighingCost = (2 * kWeighed + 1) * kPoints * kLookUpCost;
  static constexpr int kTakingCost = kLookUpCost * (7 * kPoints / 2 + kPoints);

 private:
  using sweep = grid_sweep<kHeadingsMax, kPoints, kCapacity, 4>;
  struct fit {
    double explained = 0.0, known = 0.0;        // fraction of the points; the same with reflections
    matrix<3> information = matrix<3>::Zero();  // in 1/m2, of points of 1 m
  };

 public:
  static constexpr int kPosesMin = kWeighingCost + sweep::kRunCostMax;

 private:
  fit fit_at(const edge_map &map, const wm_pose2 &pose) const;
  void choose_points(const floor_points &scan);
  void weigh_some(const edge_map &map, const wm_pose2 &own);
  int most_promising() const;
  [[nodiscard]] bool weigh(const edge_map &map, const wm_pose2 &own, aliased_pose *a) const;
  bool listed_before(int end, const wm_pose2 &pose) const;
  void begin_sweep(const search_field &field, const edge_map &map, const wm_pose2 &own);
  void take(const edge_map &map, const wm_pose2 &own, const wm_pose2 &pose);

  double rotation_rad_[kHeadingsMax];  // under which the map's walls are parallel to themselves
  int rotations_;
  aliased_pose of_[kCapacity];
  int count_;
  wm_pose2 odom_;
  // Of the newest scan.
  float x_m_[kPoints], y_m_[kPoints], ray_x_m_[kPoints], ray_y_m_[kPoints];
  int points_;
  double reflection_;  // weight as explained of a point before an edge
  double nats_;        // log likelihood difference between all and none explained
  double expected_, own_explained_, own_known_, way_m_, hazard_;
  int next_weighed_;
  sweep sweep_;
  wm_pose2 swept_odom_;
  int taken_;  // of the sweep's places: looked at already
};

}  // namespace wm

#endif
