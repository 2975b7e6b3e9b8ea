// SPDX-License-Identifier: Apache-2.0
// Relocalization by bearings of landmarks without identity: the pose that explains their pattern. In each cell of a
// grid over the map, all pairs of a bearing and a landmark vote for a heading (a Hough transform). The best cells are
// refined by Gauss-Newton on nearest azimuths. The sweep is spread over several looks, so that the cost of each is
// bounded; the result is verified with the newest look.
#ifndef WAYMARK_ESTIMATOR_LINE_SEARCH_HPP
#define WAYMARK_ESTIMATOR_LINE_SEARCH_HPP

#include "filters/relocalize/shortlist.hpp"
#include "math/elementary.hpp"
#include "waymark/frames.h"

namespace wm {

// The bearings of one look, in the sensor's frame.
struct bearing_look {
  static constexpr int kCapacity = 32;  // bits of a vote
  int count;
  double bearing_rad[kCapacity];
  wm_pose2 sensor;  // in base_link
};

// Places of landmarks: x, y at data[i * stride].
struct landmark_places {
  const double *data;
  int count, stride;
};

struct line_search_result {
  bool found;
  wm_pose2 pose;  // base_link in map
  double covariance[3][3];
};

class line_search {
 public:
  void clear() { cell_ = 0; }
  // Goes on with the sweep of the look with which it began; once all cells are swept, the candidates are verified with
  // `now`, and the next sweep begins. `odom`: base_link in the odometry's frame.
  line_search_result step(const bearing_look &now, const wm_pose2 &odom, const landmark_places &map);
  // How many of a look's bearings a landmark explains within gate_rad from a pose.
  static int explained(const bearing_look &look, const wm_pose2 &pose, const landmark_places &map, double gate_rad);

 private:
  struct candidate {
    wm_pose2 pose;
    int votes, unused;  // no padding: the same events must give the same bytes

    bool is_near(const candidate &o) const { return are_near(pose, o.pose); }
    bool is_better(const candidate &o) const { return votes > o.votes; }
  };
  // Two poses nearer than this are one candidate.
  static constexpr double kApart_m = 0.6, kApart_rad = 0.2;
  static bool are_near(const wm_pose2 &a, const wm_pose2 &b) {
    return std::fabs(a.x_m - b.x_m) + std::fabs(a.y_m - b.y_m) < kApart_m &&
           std::fabs(wrap(a.heading_rad - b.heading_rad)) < kApart_rad;
  }
  static constexpr int kCandidates = 12;  // that are refined; not swept
  void begin(const bearing_look &look, const wm_pose2 &odom, const landmark_places &map);
  void vote(const wm_pose2 &place, const landmark_places &map);
  line_search_result verify(const bearing_look &now, const wm_pose2 &odom, const landmark_places &map);

  bearing_look look_;
  wm_pose2 odom_;
  double corner_m_[2], step_m_;
  int cells_[2], cell_;  // cell_: the next one; 0: nothing begun
  shortlist<candidate, kCandidates> candidates_;
};

}  // namespace wm

#endif
