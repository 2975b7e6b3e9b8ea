// SPDX-License-Identifier: Apache-2.0
// Localization by edges on the floor against a raster map: an iterated Kalman filter that aligns each scan with the
// map's lines and calibrates motion sensors and cameras, beside hypotheses of other poses. docs/estimators.md has the
// model. pf_edges is the particle filter of the paper.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_HPP

#include "filters/core/record_list.hpp"
#include "filters/edge_mcl/align.hpp"
#include "filters/edge_mcl/hypotheses.hpp"
#include "filters/edge_mcl/lookalikes.hpp"
#include "filters/edge_mcl/params.h"
#include "filters/edge_mcl/place_search.hpp"
#include "filters/planar/planar_filter.hpp"
#include "waymark/estimator.h"

namespace wm {

// Pose, motion, the edges' common offset, and five errors of each of two cameras.
inline constexpr int kMaxEdgeStates = kPoseStates + kCalibrationCount + 2 + 1 + 2 * 5;

class edge_mcl {
 public:
  static constexpr int kCamerasMax = 2;

  static size_t bytes(const wm_edge_mcl_params &params, const wm_setup &setup, const char **why);
  void init(const wm_edge_mcl_params &params, const wm_setup &setup);

  wm_status predict(const wm_event &motion);
  wm_status correct(const wm_event &event, record_list records);
  void estimate(wm_estimate *out) const;
  size_t list_calibration(wm_calibration_value *out, size_t capacity) const;
  size_t list_counters(wm_counter *out, size_t capacity) const;
  size_t list_hypotheses(wm_hypothesis *out, size_t capacity) const;
  const wm_motion_calibration &motion_calibration() const { return filter_.calibration(); }
  uint32_t motion_health() const { return filter_.motion_health(); }

 private:
  // What an alignment changes, and where the scan was taken by the newest guess of the time offset.
  struct alignment {
    int camera, count;
    int state[kAlignStates];  // of the filter; -1: not one
    double value[kAlignStates];
  };
  // The alignment before a scan: the states that it has, in order; their covariance's inverse, and its root by number
  // of align_state.
  struct belief {
    alignment mean;
    int index[kAlignStates], n;
    double inverse[kAlignStates][kAlignStates], root[kAlignStates][kAlignStates];
  };
  // Where a scan fits, and how well: the best comes first.
  struct ends {
    static constexpr int kMost = 16;
    int count;
    alignment at[kMost];
    double cost[kMost];
    normal_equations best;
    void take(const alignment &a, double its_cost, const normal_equations &e);
  };
  struct taken_from {
    wm_pose2 pose;      // base_link in map when the picture was taken
    wm_pose2 from_now;  // the same as seen from now's base_link
    double v_mps, w_radps;
  };

  wm_status take_points(const wm_event &event, record_list records);
  wm_status take_pose(const wm_event &event);
  void start_again(bool known);

  int camera_of(const wm_points &points) const;
  double point_sigma(const wm_points &points, uint32_t i, int camera) const;
  void prepare(const wm_points &points, int camera);
  // What of a scan of so many points one counts that lies before an edge: of few most may be images, of many few.
  double image_counts(int seen) const;
  // Share of a scan of so many points that can be edges of the map.
  double can_be_edges(int seen) const;
  alignment alignment_of(int camera) const;
  taken_from look_back(const alignment &a) const;
  bool belief_of(int camera, belief *out) const;
  // `prior`: each point may be off by what this leaves open of its place, too. Null: by its own error alone.
  void accumulate(const wm_points &points, const alignment &a, double gate_m, const belief *prior,
                  normal_equations *out) const;
  double descend(const wm_points &points, const belief &prior, double slack_m, alignment *a, normal_equations *e) const;
  void descend_from_several(const wm_points &points, const belief &prior, ends *out) const;
  void allow_for(const ends &found, const belief &prior, double off[ends::kMost][kMaxStates], double *chance) const;
  // Whether the scan was taken in; how many of its points say something and how many of these the map explains.
  bool align(const wm_points &points, int camera, normal_equations *scan, wm_innovation *record);
  void describe(const normal_equations &scan, const belief &prior, const alignment &a, wm_innovation *record) const;
  double speaks_for_lost(const normal_equations &scan, double explained) const;
  void watch(const normal_equations &scan, double dt_s);
  // Logarithm of the odds of being lost: what is seen is not explained here, or better elsewhere.
  double odds_lost() const;
  void doubt_motion();
  void ponder();
  void look_for_lookalikes(double dt_s);
  void take_place(int hypothesis);
  void spread_over_hypotheses(wm_estimate *out) const;
  void remember_calibration();
  void restore_calibration();

  const wm_setup *setup_;
  wm_edge_mcl_params params_;
  planar_filter_of<kMaxEdgeStates> filter_;
  edge_map map_;
  slack_points lined_;  // those that lie on a line with their neighbours
  place_search search_;
  hypotheses others_;
  lookalikes alike_;
  floor_camera camera_[kCamerasMax];
  int camera_count_;
  int camera_state_[kCamerasMax][kCameraErrors + 1];  // and the time offset
  int edge_state_;
  int calibration_states_;
  // What was known of sensors and camera while the scans still fitted: two generations, of which the older is safe.
  struct calibration_memory {
    double value[kMaxStates], variance[kMaxStates];
  };
  calibration_memory memory_[2];
  wm_time_ns remembered_ns_;
  wm_pose2 scan_odom_;  // odometry at the last scan
  wm_time_ns fused_ns_, watched_ns_, driven_ns_;
  // Of each camera, and of points that are none's: when a scan was taken in last, and the way till then.
  wm_time_ns aligned_ns_[kCamerasMax + 1];
  double aligned_m_[kCamerasMax + 1];
  double fresh_;                  // how much of a scan isn't what the last one said
  double lost_odds_;              // logarithm of
  double explained_;              // share, smoothed
  double usual_;                  // the same of what can be edges, over a longer time, while the pose is trusted
  double expected_, expected_s_;  // the same over a drive's last minute, and over how long
  double usual_through_;          // share of the points that seemed to be seen through edges, in that time
  double shortfall_;              // what scans were short of what is usual, in that time, on average
  double alike_m_;                // way when look-alikes were last weighed
  double watched_m_;              // way when the last scan was judged
  uint32_t resets_, relocalizations_;
  uint8_t state_;
  bool at_ease_;   // what is seen is what was to be expected
  bool in_doubt_;  // of the pose: what was seen lately is looked for elsewhere
  bool swept_;     // the whole map has been looked at for what was seen since then
  bool on_trial_;  // a place was taken, the scans have not confirmed it yet
};

}  // namespace wm

#endif
