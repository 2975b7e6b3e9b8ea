// SPDX-License-Identifier: Apache-2.0
// Hypotheses of the robot's pose: the tracked one, those that searches found, and perceptually aliased ones: places
// from which the newest scans look as from the tracked pose. Odometry carries all of them on. Searched ones are aligned
// and weighed with the keyframes of the last metres. Aliased ones are aligned and weighed with each scan; a sweep by
// the newest scan finds them. Work is counted as in place_search.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_HYPOTHESES_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_HYPOTHESES_HPP

#include "filters/edge_mcl/place_search.hpp"

namespace wm {

enum hypothesis_origin : int64_t { kTracked, kSearched, kAliased };  // 64 bits: no padding

struct hypothesis {
  wm_pose2 pose;  // base_link in map now
  hypothesis_origin origin;
  double covariance[6];  // xx, xy, yy, x heading, y heading, heading heading
  // Fraction of the keyframes' points; of an aliased pose that of the newest scans', less the tracked pose's.
  double explained;
  // Tracked and searched ones, by keyframes.
  int64_t weighed;  // 0: not yet
  double probability, log_weight;
  double error[kMountingAll];  // of the cameras' mountings if it is there, in sigmas
  // Aliased ones, by scans.
  double odds;       // against the tracked pose, 50 at most
  double weighed_m;  // travelled distance when it was weighed last
  double hazard;     // sum until then of the probability of having been carried off
  double began_m;    // travelled distance when its odds last were none
};

// Covariance (xx, xy, yy, x heading, y heading, heading heading) of a place of which a scan's points leave
// `information` (1/m2, of points of 1 m): its inverse beside a weak prior, and the error that all its points share.
// False, and `out` stays, where it can't be inverted.
[[nodiscard]] bool place_covariance(const matrix<3> &information, double out[6]);

class hypotheses {
 public:
  static constexpr int kSearchedMax = place_search::kPlaces + 1, kAliasedMax = 128;
  static constexpr int kWeighed = 24;  // aliased poses with each scan, at most

  // Finds the rotations under which the map's walls are parallel to themselves. At most 100000 places are looked up.
  void init(const edge_map &map);
  // Drops all but the tracked pose, number 0; drop_searched() keeps the aliased ones.
  void clear(const wm_pose2 &own, const wm_pose2 &odom);
  void drop_searched(const wm_pose2 &own);
  void carry(const wm_pose2 &own, const wm_pose2 &odom);

  int count() const { return searched_ + aliased_; }
  const hypothesis &operator[](int i) const { return of_[i < searched_ ? i : kSearchedMax + i - searched_]; }
  int searched() const { return searched_; }  // these come first, with the tracked one
  int aliased() const { return aliased_; }
  const hypothesis &alias(int i) const { return of_[kSearchedMax + i]; }

  void offer(const place_search &search);
  // Base_link in map now, and the fraction of points that it explains.
  void offer(const wm_pose2 &pose, double explained, const double error[kMountingAll]);
  // Aligns and weighs `some` of the searched ones, in turn. `own_prior`: log prior odds of the tracked pose against
  // another one; `own_least`: fraction that it explains at least; `information`: of the keyframes.
  void weigh(const edge_map &map, place_search *search, double own_prior, double own_least, double information,
             int some);
  // Number `i` becomes the tracked pose, and that one of the searched ones.
  void adopt(int i);
  int best() const;  // tracked or searched, by probability
  // Odds of the searched ones that were weighed against the tracked pose.
  double searched_odds() const;

  // Weighs some aliased poses by a scan in base_link, taken from the tracked pose if that is right, `new_m` of
  // travelled distance after the last one. `expected`: fraction of the points that the map explains as a rule;
  // `hazard`: probability of having been carried off since. Then the sweep goes on; `poses`: work at most of all this.
  // Without enough of it poses are weighed only, by work of at most kWeighingCost.
  void update_aliased(const edge_map &map, const search_field &field, const floor_points &scan, double new_m,
                      double expected, double hazard, int poses);
  // The sweep begins anew, with the next scan.
  void restart_sweep() { sweep_.stop(); }
  double aliased_odds() const;  // sum
  void forget_aliased_odds();
  // The aliased pose that explains the most; -1: there is none.
  int best_aliased() const;
  // Travelled distance since the likeliest aliased pose began to be likelier.
  double likelier_for_m() const;

  static constexpr int kPoints = 32, kLookUpCost = 2, kHeadingsMax = 30;
  static constexpr int kWeighingCost = (2 * kWeighed + 1) * kPoints * kLookUpCost;
  static constexpr int kTakingCost = kLookUpCost * (7 * kPoints / 2 + kPoints);

 private:
  using sweep = grid_sweep<kHeadingsMax, kPoints, kAliasedMax, 4>;

 public:
  static constexpr int kPosesMin = kWeighingCost + sweep::kRunCostMax;

 private:
  struct fit {
    double explained = 0.0, known = 0.0;        // fraction of the points; the same with reflections
    matrix<3> information = matrix<3>::Zero();  // in 1/m2, of points of 1 m
  };
  void drop_unlikely(double best);
  fit fit_at(const edge_map &map, const wm_pose2 &pose) const;
  void weigh_aliased(const edge_map &map);
  int most_promising() const;
  [[nodiscard]] bool weigh_alias(const edge_map &map, hypothesis *a) const;
  bool listed_before(int end, const wm_pose2 &pose) const;
  void begin_sweep(const search_field &field, const edge_map &map);
  void take_alias(const edge_map &map, const wm_pose2 &pose);

  hypothesis of_[kSearchedMax + kAliasedMax];
  int searched_, aliased_, next_searched_, next_aliased_;  // counts; which are weighed next
  wm_pose2 odom_;
  double rotation_rad_[kHeadingsMax];  // under which the map's walls are parallel to themselves
  // Of the newest scan.
  floor_edge points_[kPoints];
  double nats_;  // log likelihood difference between all and none explained
  double expected_, own_explained_, own_known_, way_m_, hazard_;
  wm_pose2 swept_odom_;
  int rotations_, point_count_;
  sweep sweep_;
  int64_t taken_;  // of the sweep's places: looked at already
};

}  // namespace wm

#endif
