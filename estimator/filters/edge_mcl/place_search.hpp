// SPDX-License-Identifier: Apache-2.0
// Search for the pose on the whole map, by the keyframes of the last metres: a sweep over a grid, then the best places
// are aligned and compared. Work is counted in poses that the sweep scores by its first 24 points.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_PLACE_SEARCH_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_PLACE_SEARCH_HPP

#include "filters/edge_mcl/align.hpp"
#include "filters/edge_mcl/grid_sweep.hpp"
#include "filters/edge_mcl/params.h"
#include "waymark/frames.h"

namespace wm {

struct place {
  wm_pose2 pose;               // base_link in map when the sweep began
  double explained;            // fraction of the points, aligned
  double error[kMountingAll];  // of the cameras' mountings, aligned with it, in sigmas
};

class place_search {
 public:
  static constexpr int kPlaces = 24;  // best places of a sweep; not swept
  // Work of explained(), 2 poses a point and look-up, and of a place that step() aligns, 4 a point (as measured: wider
  // gates, colder memory). step() needs the latter at once.
  static constexpr int kWeighingCost = 2 * (4 * WM_POINTS_MAX / 2 + WM_POINTS_MAX);
  static constexpr int kAligningCost = 4 * (5 * WM_POINTS_MAX / 4 + 4 * WM_POINTS_MAX / 2 + WM_POINTS_MAX);

  static size_t bytes(const wm_raster &raster) { return search_field::bytes(raster); }
  // `memory` keeps its distance from this object when both are copied.
  void init(const edge_map &map, void *memory);
  // Forgets all keyframes.
  void clear();
  // Keeps a scan (points in base_link, odometry) as a keyframe if the robot has moved since the last one; then true.
  bool add_keyframe(const floor_points &scan, const wm_pose2 &odom);
  // Remembers this time; begin_at_mark() drops the keyframes from before it and begins the sweep anew.
  void mark() { marked_ = seen_; }
  void begin_at_mark();
  // The same for keyframes older than about this distance.
  void begin_ago(double way_m);
  // Goes on by work of at most `poses`. True when a sweep has ended: places() are then sorted by `explained`.
  bool step(const edge_map &map, int poses, const wm_pose2 &odom);
  uint64_t spent() const { return spent_; }  // work of step() and explained() since init(), in poses
  const place *places(int *count) const {
    *count = place_count_;
    return places_;
  }
  // Fraction of the keyframes' points that the map explains about `pose` (base_link in map now) and the mountings'
  // `error`, both of which are aligned. With `reflections`, points before an edge count by their weight.
  double explained(const edge_map &map, const wm_pose2 &odom, wm_pose2 *pose, double error[kMountingAll],
                   bool reflections);
  wm_pose2 odom_of_places() const { return odom_; }
  const search_field &field() const { return field_; }
  double information() const;  // sum of the keyframes' information weights
  int keyframes() const { return (int)(seen_ - oldest()); }

 private:
  // 16 keyframes are 6.4 m; 72 headings are 5 degrees apart, 0.35 m at 4 m. Not swept.
  static constexpr int kKeyframes = 16, kPointsEach = 32, kSweepPoints = 96, kFirstPoints = 24, kHeadings = 72;
  using sweep = grid_sweep<kHeadings, kSweepPoints, kPlaces, 1>;
  static_assert(sweep::kRunCostMax <= kAligningCost);

  uint64_t oldest() const {
    const uint64_t kept = seen_ > kKeyframes ? seen_ - kKeyframes : 0;
    return from_ > kept ? from_ : kept;
  }
  void gather(const wm_pose2 &odom, floor_points *out) const;
  void begin(const edge_map &map, const wm_pose2 &odom);
  int list_sure_points(int *out) const;
  void refine(const edge_map &map, int poses);
  void sort_places();

  struct keyframe {
    wm_pose2 odom;
    double information;
    int64_t count;  // 64 bits: no padding
    floor_edge of[kPointsEach];
  };
  keyframe keyframes_[kKeyframes];
  uint64_t seen_, marked_, from_;
  search_field field_;
  floor_points all_;  // of all keyframes, in base_link at odom_
  floor_points now_;  // work space
  sweep sweep_;
  wm_pose2 odom_;
  uint64_t spent_;
  int refined_;
  place places_[kPlaces];
  int place_count_;
};

}  // namespace wm

#endif
