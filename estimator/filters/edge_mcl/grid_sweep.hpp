// SPDX-License-Identifier: Apache-2.0
// Correlative search over the map: the score of each place of a grid in each of some headings, by table look-up
// (E. Olson, "Real-time correlative scan matching", 2009). It goes on over many scans; its work is counted, never
// timed, so that a replay finds the same places. It serves the search of a lost robot and that for perceptually aliased
// poses.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_GRID_SWEEP_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_GRID_SWEEP_HPP

#include <bit>

#include "maps/search_field.hpp"
#include "math/arc.hpp"

namespace wm {

inline double distance2(const wm_pose2 &a, const wm_pose2 &b) { return square(a.x_m - b.x_m) + square(a.y_m - b.y_m); }
inline bool same_pose(const wm_pose2 &a, const wm_pose2 &b, double most_m, double most_rad) {
  return distance2(a, b) < square(most_m) && std::fabs(wrap(a.heading_rad - b.heading_rad)) < most_rad;
}

// Two places of a sweep nearer than this are one: three steps of its grid. Not swept.
inline constexpr double kSweepApart_m = 0.6, kSweepApart_rad = 0.3;

struct swept_place {
  wm_pose2 pose;  // base_link in map when the sweep began
  int64_t score;  // 64 bits: no padding
};

// At most kHeadings headings, kPoints points, and the kBest best places. kPlacesAPose: places whose score is counted as
// the work of one pose (vectors score 16 at a time).
template <int kHeadings, int kPoints, int kBest, int kPlacesAPose>
class grid_sweep {
 public:
  // Work of a run of 16 places, in poses: itself, each heading, each place that is offered.
  static constexpr int kRunCost = 1, kOfferCost = 6;
  static constexpr int kRunCostMax =
      kRunCost + kHeadings * (search_field::kRun / kPlacesAPose + 1 + search_field::kRun * kOfferCost);

  void stop() { running_ = swept_ = false; }
  bool running() const { return running_; }
  bool swept() const { return swept_; }  // all of the map
  int count() const { return count_; }
  const swept_place &operator[](int i) const { return best_[i]; }

  // Begins anew, without points. Of n points the first `first` are looked at everywhere, the others where these score
  // well enough to come among the best, if a point of them is better by `hopeful` (in scores) than one of the first.
  void begin(int headings, double hopeful) {
    running_ = true;
    swept_ = excludes_ = false;
    headings_ = headings;
    points_ = first_ = count_ = 0;
    next_ = 0;
    least_ = 0;
    hopeful_ = hopeful;
  }
  // `turn`: of this heading against the map's rows; the heading in the map is heading_rad.
  void set_heading(int heading, double heading_rad) { heading_rad_[heading] = heading_rad; }
  // The next point in base_link. O(headings).
  void add_point(const search_field &field, double map_yaw_rad, double x, double y) {
    for (int k = 0; k < headings_; k++) {
      const sin_cos h = sincos(heading_rad_[k] - map_yaw_rad);
      steps_[k][points_] = field.step(h.cos * x - h.sin * y, -(h.sin * x + h.cos * y));
    }
    points_++;
  }
  void set_first(int first) { first_ = first; }
  // After begin(): places are offered from this score on, and not near `own`.
  void set_least(int least) { least_ = least; }
  void exclude(const wm_pose2 &own) { own_ = own, excludes_ = true; }
  int points() const { return points_; }
  // Score in heading 0 from the corner nearest to a place.
  int score_at(const search_field &field, const edge_map &map, double x_m, double y_m) const {
    return field.sum(field.nearest(map, x_m, y_m), steps_[0], points_);
  }

  // Goes on by work of at most `poses`. Returns the rest of it.
  int step(const edge_map &map, const search_field &field, int poses) {
    const int64_t all = points_ > 0 ? field.runs() * field.rows() : 0;
    for (; next_ < all && poses >= kRunCostMax; next_++)
      poses -= look_from(map, field, next_ % field.runs(), next_ / field.runs());
    swept_ = next_ >= all;
    return poses;
  }

 private:
  // Keeps the best, the best first; of places that are one the better.
  void offer(const wm_pose2 &pose, int score) {
    if (count_ == kBest && score <= best_[kBest - 1].score) return;
    if (excludes_ && same_pose(pose, own_, kSweepApart_m, kSweepApart_rad)) return;
    int at = count_;
    for (int i = 0; i < count_ && at == count_; i++)
      if (same_pose(best_[i].pose, pose, kSweepApart_m, kSweepApart_rad)) at = i;
    if (at < count_ && best_[at].score >= score) return;
    if (at == count_) {
      if (count_ < kBest)
        count_++;
      else
        at = kBest - 1;
    }
    for (; at > 0 && best_[at - 1].score < score; at--) best_[at] = best_[at - 1];
    best_[at] = {pose, score};
  }
  // Score of the first points from which on the others may bring a place among the best.
  int least_of_first() const {
    double least = least_;
    if (count_ == kBest) {
      const double worst = (double)best_[kBest - 1].score;
      if (worst > least) least = worst;
    }
    if (first_ == points_) return (int)least;
    least = (least / points_ - hopeful_) * first_;
    return least > 0.0 ? (int)least : 0;
  }
  // Where the points fit from the places of a run, in each heading. Returns the work.
  int look_from(const edge_map &map, const search_field &field, int64_t run, int64_t row) {
    const uint32_t standing = field.standing(run, row);
    if (standing == 0) return kRunCost;
    const ptrdiff_t corner = field.corner_of(run, row);
    uint16_t sums[kHeadings][search_field::kRun], rest[1][search_field::kRun] = {};
    bool reached[kHeadings], more[1];
    int least = least_of_first();
    field.sum_run(corner, steps_[0], kPoints, headings_, first_, least, sums, reached);
    int cost = kRunCost + (headings_ * std::popcount(standing) + kPlacesAPose - 1) / kPlacesAPose;
    for (int k = 0; k < headings_; k++) {
      if (!reached[k]) continue;
      const uint16_t *sum = sums[k];
      if (first_ < points_) field.sum_run(corner, steps_[k] + first_, kPoints, 1, points_ - first_, 0, rest, more);
      for (int i = 0; i < search_field::kRun; i++) {
        if (!(standing >> i & 1) || sum[i] <= least) continue;
        // Where all points are in the sum, of neighbours only the best is offered.
        if (first_ == points_ &&
            ((i > 0 && sum[i - 1] > sum[i]) || (i + 1 < search_field::kRun && sum[i + 1] > sum[i])))
          continue;
        wm_pose2 pose;
        field.place_of(map, run, row, i, &pose.x_m, &pose.y_m);
        pose.heading_rad = wrap(heading_rad_[k]);
        offer(pose, sum[i] + rest[0][i]);
        cost += kOfferCost;
        least = least_of_first();
      }
    }
    return cost;
  }

  int32_t steps_[kHeadings][kPoints];  // of each point in each heading, in the field
  double heading_rad_[kHeadings], hopeful_;
  int headings_, points_, first_, least_;
  int64_t next_;  // run
  bool running_, swept_, excludes_;
  wm_pose2 own_;
  swept_place best_[kBest];
  int count_;
};

}  // namespace wm

#endif
