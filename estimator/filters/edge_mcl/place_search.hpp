// SPDX-License-Identifier: Apache-2.0
// Where on the map could this be? The points of the last metres, put together by odometry, against every place where
// the robot may stand: a sweep over a grid, some ten thousand poses a scan, then the best are aligned and compared.
// What a scan may cost is counted, never timed, so that a replay finds what the robot found. The unit is a pose that
// the sweep scores by its first 24 points.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_PLACE_SEARCH_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_PLACE_SEARCH_HPP

#include "filters/edge_mcl/align.hpp"
#include "filters/edge_mcl/params.h"
#include "maps/search_field.hpp"
#include "waymark/frames.h"

namespace wm {

struct place {
  wm_pose2 pose;             // base_link in map when the sweep began
  int64_t score;             // on the grid. As wide as the rest: a copy has no bytes that nobody wrote
  double explained;          // share of the points, aligned
  double error[kSlackMost];  // of the cameras, aligned with it
};

class place_search {
 public:
  static constexpr int kPlaces = 24;
  // What explained() costs, 2 poses a point looked up, and what a place costs that step() aligns, 4 a point (about as
  // measured: wider gates, colder memory). step() needs the latter to come to an end some day.
  static constexpr int kWeighingCost = 2 * (4 * WM_POINTS_MAX / 2 + WM_POINTS_MAX);
  static constexpr int kAligningCost = 4 * (5 * WM_POINTS_MAX / 4 + 4 * WM_POINTS_MAX / 2 + WM_POINTS_MAX);

  static size_t bytes(const wm_raster &raster) { return search_field::bytes(raster); }
  // `memory` keeps its distance from this object when both are copied.
  void init(const edge_map &map, void *memory);
  // Forgets what was seen.
  void clear();
  // A scan in base_link and where odometry says it was taken; kept if the robot has moved since the last one kept, and
  // then true.
  bool see(const slack_points &scan, const wm_pose2 &odom);
  // From here on is looked at: what was kept before belongs elsewhere. A sweep that runs begins anew.
  void mark() { marked_ = seen_; }
  void begin_at_mark();
  // The same from so long a way ago on, about.
  void begin_ago(double way_m);
  // All that is kept is looked at again.
  void unmark() { from_ = 0; }
  // Goes on by work worth `poses` poses at most. True when a sweep has ended: places() are then sorted by what they
  // explain.
  bool step(const edge_map &map, int poses, const wm_pose2 &odom);
  uint64_t spent() const { return spent_; }  // by step() and explained(), in poses, since init()
  const place *places(int *count) const {
    *count = place_count_;
    return places_;
  }
  // Share of what was seen lately that the map explains about `pose` (base_link in map now) and by the cameras'
  // `error`, which are aligned. With `images`, what lies before an edge counts for what it may.
  double explained(const edge_map &map, const wm_pose2 &odom, wm_pose2 *pose, double error[kSlackMost], bool images);
  wm_pose2 odom_of_places() const { return odom_; }
  const search_field &field() const { return field_; }
  // What these say, in scans of usual points.
  double telling() const;
  int keyframes() const { return (int)(seen_ - oldest()); }  // that are looked at together

 private:
  static constexpr int kKeyframes = 16, kPointsEach = 32, kSweepPoints = 96, kFirstPoints = 24, kHeadings = 72;

  uint64_t oldest() const {
    const uint64_t kept = seen_ > kKeyframes ? seen_ - kKeyframes : 0;
    return from_ > kept ? from_ : kept;
  }
  void begin(const wm_pose2 &odom);
  // Points of all keyframes in base_link at `odom`.
  void gather(const wm_pose2 &odom, slack_points *out) const;
  int list_near(int *out) const;
  void turn_points(const edge_map &map);
  int sweep(const edge_map &map, int poses);                     // returns what is left of `poses`
  int look_from(const edge_map &map, int64_t run, int64_t row);  // returns what it cost
  void offer(const wm_pose2 &pose, int32_t score);
  void refine(const edge_map &map, int poses);
  double least_first() const;
  void sort_places();

  struct keyframe {
    wm_pose2 odom;
    double telling;
    int count, camera[kPointsEach];
    float x_m[kPointsEach], y_m[kPointsEach];
    float x_by[kSlackErrors][kPointsEach], y_by[kSlackErrors][kPointsEach];
    float ray_x_m[kPointsEach], ray_y_m[kPointsEach], image[kPointsEach];
  };
  keyframe keyframes_[kKeyframes];
  uint64_t seen_, marked_, from_;
  search_field field_;
  slack_points all_;  // in base_link at odom_
  slack_points now_;  // work space
  // Of each heading the steps in the field of some of all_, which are the same from everywhere: first those that are
  // looked at first.
  int32_t steps_[kHeadings][kSweepPoints];
  int first_, some_;
  wm_pose2 odom_;
  bool running_;
  int64_t next_;  // run of the sweep
  uint64_t spent_;
  int refined_;
  place places_[kPlaces];
  int place_count_;
};

}  // namespace wm

#endif
