// SPDX-License-Identifier: Apache-2.0
// Evidence that the pose is wrong, by the fraction of a scan that the map explains from it. Scans are held against what
// the drive's own number of false points leaves of them, and its shortfalls: glare and tape are on every floor of some
// buildings, and on none of others.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_FIT_EVIDENCE_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_FIT_EVIDENCE_HPP

#include "filters/core/evidence.hpp"
#include "filters/edge_mcl/align.hpp"
#include "filters/edge_mcl/params.h"

namespace wm {

inline constexpr double kKidnapped_per_s = 1e-4;  // prior rate of kidnapping, and of aliased poses
// Of n points of a scan about kFalsePoints are no edge of the map, wherever it was taken: the fraction of true edges,
// and the weight as explained of a point that lies before an edge. Chosen on corridor-hard drives; not swept.
inline constexpr double kFalsePoints = 60.0;
inline double expected_edges(int points) { return points > 0 ? points / (points + kFalsePoints) : 0.0; }
inline double reflection_weight(int points) { return points > 0 ? kFalsePoints / (points + kFalsePoints) : 0.0; }

class fit_evidence {
 public:
  static constexpr int kPointsMin = 8;  // of a scan that is judged

  void init(const wm_edge_mcl_params &params);
  // `known`: the pose was given; otherwise it is wrong.
  void reset(bool known);
  // Adds a scan, of which the robot has moved by `way` (m + rad) since the last one. Returns its log Bayes factor.
  double add(const normal_equations &scan, double dt_s, double way);
  // Takes a scan of a trusted pose into the means.
  void learn(const normal_equations &scan, double dt_s);

  double log_odds() const { return odds_.value(); }
  void set_log_odds(double value) { odds_.set(value); }
  double explained() const { return explained_; }            // fraction of the last scans' points, smoothed
  double mean_explained() const { return mean_explained_; }  // over the last minute

 private:
  double explained_by(const normal_equations &scan) const;
  // The fraction of so many points that the map usually explains.
  double usual(int points) const { return points / (points + false_points_ / true_share_); }
  double log_bayes_factor(const normal_equations &scan, double explained) const;

  evidence odds_;
  double lost_explained_, lost_margin_, lost_beyond_;
  double explained_;
  double false_points_, true_share_;     // unexplained points of a scan, and its fraction explained, over 10 s
  double mean_explained_, averaged_s_;   // over the last minute, and over how much of it
  double mean_beyond_, mean_shortfall_;  // fraction of points beyond an edge; lack against usual()
};

}  // namespace wm

#endif
