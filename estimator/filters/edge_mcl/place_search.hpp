// SPDX-License-Identifier: Apache-2.0
// Where on the map could this be? The points of the last metres, put together by odometry, against every place where
// the robot may stand: a sweep over a grid, some ten thousand poses a scan, then the best are aligned and compared.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_PLACE_SEARCH_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_PLACE_SEARCH_HPP

#include "filters/edge_mcl/likelihood.hpp"
#include "filters/edge_mcl/params.h"
#include "waymark/frames.h"

namespace wm {

struct place {
  wm_pose2 pose;     // base_link in map when the sweep began
  int32_t score;     // on the grid
  double explained;  // share of the points, aligned
};

class place_search {
 public:
  static constexpr int kPlaces = 24;

  void init(const edge_map &map);
  // Forgets what was seen.
  void clear();
  // A scan in base_link and where odometry says it was taken; kept if the robot has moved since the last one kept, and
  // then true.
  bool see(const scan_points &scan, const wm_pose2 &odom);
  // From here on is looked at: what was kept before belongs elsewhere. A sweep that runs begins anew.
  void mark() { marked_ = seen_; }
  void begin_at_mark();
  // All that is kept is looked at again.
  void unmark() { from_ = 0; }
  // Goes on by about `poses` poses. True when a sweep has ended: places() are then sorted by what they explain.
  bool step(const edge_map &map, int poses, const wm_pose2 &odom);
  const place *places(int *count) const {
    *count = place_count_;
    return places_;
  }
  // Share of what was seen lately that the map explains about `pose` (base_link in map now, which is aligned).
  double explained(const edge_map &map, const wm_pose2 &odom, wm_pose2 *pose);
  wm_pose2 odom_of_places() const { return odom_; }
  int keyframes() const { return (int)(seen_ - oldest()); }  // that are looked at together

 private:
  static constexpr int kKeyframes = 16, kPointsEach = 32, kSweepPoints = 96, kFirstPoints = 24;

  uint64_t oldest() const {
    const uint64_t kept = seen_ > kKeyframes ? seen_ - kKeyframes : 0;
    return from_ > kept ? from_ : kept;
  }
  void begin(const wm_pose2 &odom);
  // Points of all keyframes in base_link at `odom`.
  void gather(const wm_pose2 &odom, scan_points *out) const;
  void offer(const wm_pose2 &pose, int32_t score);
  void refine(const edge_map &map);

  struct keyframe {
    wm_pose2 odom;
    int count;
    float x_m[kPointsEach], y_m[kPointsEach];
  };
  keyframe keyframes_[kKeyframes];
  uint64_t seen_, marked_, from_;
  score_table wide_;
  scan_points all_, few_, fewer_;  // in base_link at odom_
  scan_points now_;                // work space
  wm_pose2 odom_;
  bool running_;
  int64_t next_;  // pose of the sweep
  int refined_;
  place places_[kPlaces];
  int place_count_;
};

}  // namespace wm

#endif
