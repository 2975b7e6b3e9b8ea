// SPDX-License-Identifier: Apache-2.0
// Places of the map that look as the one where the robot is being tracked. If somebody has just set it down at one of
// them, nothing that it sees says so: they are what else is possible, with the odds that it was carried off. Each sweep
// looks with one scan for where it fits as well as at the tracked place; what it finds is carried on by odometry,
// aligned and weighed, some of them with each scan in turn. What a scan may cost is counted, in poses as place_search
// has them.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_LOOKALIKES_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_LOOKALIKES_HPP

#include "filters/edge_mcl/align.hpp"
#include "maps/search_field.hpp"
#include "waymark/frames.h"

namespace wm {

struct lookalike {
  wm_pose2 pose;         // base_link in map now
  double covariance[6];  // xx, xy, yy, x heading, y heading, heading heading
  double weight;         // odds against the tracked place, 50 at most
  double explained;      // share of the points, more than at the tracked place; smoothed
  double weighed_m;      // way when it was weighed last
  double hazard;         // sum of all until then
  double began_m;        // way when its odds last were none
};

// Covariance (xx, xy, yy, x heading, y heading, heading heading) of a place of which a scan's points leave
// `information` (1/m2, of points of 1 m): its inverse beside a weak prior, and the error that all its points share.
// False, and `out` stays, where it can't be inverted.
[[nodiscard]] bool place_covariance(const double information[3][3], double out[6]);

class lookalikes {
 public:
  static constexpr int kMost = 128, kWeighed = 24;  // of them with each scan

  // Headings at which the map's walls run as they do at 0: these are swept. At most 100000 places are looked up.
  void init(const edge_map &map);
  void clear(const wm_pose2 &odom);
  void carry(const wm_pose2 &odom);
  // A scan in base_link, which the robot took at `own` if it is where it believes; `new_m`: way since the last one.
  // `expected`: share of the points that the map usually explains; `hazard`: probability of having been carried off
  // since. Goes on looking by work worth `poses` at most; none: what
  // is known is weighed alone, at most kWeighingCost.
  void look(const edge_map &map, const search_field &field, const slack_points &scan, const wm_pose2 &own, double new_m,
            double expected, double hazard, int poses);

  // The sweep begins anew, by the next scan.
  void begin_again() { running_ = false; }

  static constexpr int kPoints = 32, kLookUpCost = 2;
  static constexpr int kWeighingCost = (2 * kWeighed + 1) * kPoints * kLookUpCost;
  // Of a sweep, in poses: a run of places where none can stand; of 16 places in one heading all points; a place that is
  // held against those kept. look() needs so much to come to an end some day.
  static constexpr int kRunCost = 1, kHeadingCost = 4, kOfferCost = 6, kHeadingsMost = 30;
  static constexpr int kRunCostMost = kRunCost + kHeadingsMost * (kHeadingCost + search_field::kRun * kOfferCost);
  static constexpr int kPosesLeast = kWeighingCost + kRunCostMost;

  int count() const { return count_; }
  double odds() const;  // of all of them together against the tracked place
  // The one that explains the most; -1: there is none.
  int best() const;
  // Way since the likeliest began to be likelier.
  double likelier_for_m() const;
  // What was seen until now has been judged otherwise.
  void forget_odds();
  const lookalike &operator[](int i) const { return of_[i]; }

 private:
  struct candidate {
    wm_pose2 pose;  // base_link in map when the sweep began
    int64_t score;  // as wide as the rest: a copy has no bytes that nobody wrote
  };
  struct fit {
    double explained, known;   // share of the points; the same and what lies before an edge
    double information[3][3];  // in 1/m2, of points of 1 m
  };
  fit fit_at(const edge_map &map, const wm_pose2 &pose) const;
  void choose_points(const slack_points &scan);
  void weigh(const edge_map &map, const wm_pose2 &own);
  int likeliest_unweighed() const;
  // Whether it stays.
  bool weigh(const edge_map &map, const wm_pose2 &own, lookalike *l) const;
  bool listed_before(int end, const wm_pose2 &pose) const;
  void begin(const search_field &field, const edge_map &map, const wm_pose2 &own);
  int sweep(const edge_map &map, const search_field &field, int poses);
  int look_from(const edge_map &map, const search_field &field, int64_t run, int64_t row);
  void take(const edge_map &map, const wm_pose2 &own, const wm_pose2 &pose);

  double relative_[kHeadingsMost];  // headings at which the map looks like itself
  int relative_count_;
  lookalike of_[kMost];
  int count_;
  wm_pose2 odom_;
  float x_m_[kPoints], y_m_[kPoints], ray_x_m_[kPoints], ray_y_m_[kPoints];  // of the newest scan
  int points_;
  double image_;     // what one of them counts if it lies before an edge
  double nats_;      // what this scan says where it is explained as a whole
  double expected_;  // share of the points that is usually explained
  double own_explained_, own_known_, way_m_, hazard_;
  int next_weighed_;

  int32_t steps_[kHeadingsMost][kPoints];
  int swept_points_, least_;
  wm_pose2 swept_from_, swept_odom_;
  int64_t next_;  // run of the sweep
  bool running_;
  candidate found_[kMost];
  int found_count_, taken_;  // of them: looked at already
};

}  // namespace wm

#endif
