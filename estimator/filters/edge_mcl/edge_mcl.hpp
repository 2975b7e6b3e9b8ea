// SPDX-License-Identifier: Apache-2.0
// Localization by edges on the floor against a raster map: an iterated Kalman filter that aligns each scan with the
// map's lines and calibrates motion sensors and cameras, beside hypotheses of other poses. docs/estimators.md has the
// model; pf_edges is the particle filter for the same map and points.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_HPP

#include "aid/localizer.hpp"
#include "aid/position.hpp"
#include "aid/sighting.hpp"
#include "filters/core/landmark_evidence.hpp"
#include "filters/core/lifecycle.hpp"
#include "filters/core/record_list.hpp"
#include "filters/core/rollback.hpp"
#include "filters/core/state_slots.hpp"
#include "filters/edge_mcl/align.hpp"
#include "filters/edge_mcl/fit_evidence.hpp"
#include "filters/edge_mcl/hypotheses.hpp"
#include "filters/edge_mcl/odometry_check.hpp"
#include "filters/edge_mcl/params.h"
#include "filters/edge_mcl/place_search.hpp"
#include "filters/planar/planar_filter.hpp"
#include "waymark/estimator.h"
#include "waymark/internal/memory/layout.hpp"

namespace wm {

// Motion, the table's (all but the last row for each camera), and sensors of landmarks.
inline constexpr int kMaxEdgeCalibration =
    kCalibrationCount + 2 + kMountingCameras * (kCameraStates - 1) + 1 + kMaxSensors * kSensorStates;
static_assert(kMaxSensors * kSensorStates <= kMaxSensorStates);

class edge_mcl {
 public:
  static constexpr int kCamerasMax = kMountingCameras;

  static size_t bytes(const wm_edge_mcl_params &params, const wm_setup &setup, const char **why);
  void init(const wm_edge_mcl_params &params, const wm_setup &setup);

  wm_status predict(const wm_event &motion);
  wm_status correct(const wm_event &event, record_list records);
  void estimate(wm_estimate *out) const;
  void list_calibration(calibration_list *list) const;
  size_t list_counters(wm_counter *out, size_t capacity) const;
  size_t list_hypotheses(wm_hypothesis *out, size_t capacity) const;
  const wm_motion_calibration &motion_calibration() const { return filter_.calibration(); }
  uint32_t motion_health() const { return filter_.motion_health(); }

 private:
  // The unknowns of an alignment: their states in the filter (-1: off) and values.
  struct alignment {
    int camera;
    int state[kAlignStates];
    double value[kAlignStates];
  };
  // The prediction before a scan. Rows of unknowns that are off are 0.
  struct prediction {
    alignment mean;
    align_matrix covariance, inverse;
  };
  // Local minima of an alignment's cost; the best comes first.
  struct minima {
    static constexpr int kCapacity = 16;
    int count;
    alignment at[kCapacity];
    double cost[kCapacity];
    normal_equations best;
    void take(const alignment &a, double its_cost, const normal_equations &e);
  };
  // Passes of a descent: the first weighs whether each point is on an edge of the map, the last counts.
  enum class descent_pass { kFirst, kNext, kLast };
  // The robot when the picture was taken.
  struct capture {
    wm_pose2 pose;            // base_link in map
    wm_pose2 from_now;        // the same, seen from now's base_link
    sin_cos turn;             // of the pose's heading
    double eye_x_m, eye_y_m;  // under the camera, in map
    planar_twist twist;
  };
  // What an alignment reads of a point of the scan and does not change.
  struct scan_point {
    double normal_cos, normal_sin;  // of its edge, in base_link; 0 where the detector gives none
    double own2;                    // variance of its own, m2
    int64_t on_line;                // 64 bits: no padding
  };
  struct matched_point {
    floor_point floor;          // in base_link
    double from_x_m, from_y_m;  // from base_link, in the map's axes
    double x_m, y_m;            // in map
    edge_line line;             // next to it, its normal away from the camera
    double residual_m, sigma2;  // sigma2: with the wall's common error
    bool same_side;
  };

  wm_status take_points(const wm_event &event, record_list records);
  // edge_landmarks.cpp: sightings and coded markers of a given map's landmarks, where the robot has one.
  wm_status take_landmark(const wm_event &event, record_list records);
  void note_landmark(const sighting_aid::view &at, double log_bayes, const residual *bearing);
  fuse_policy landmark_policy(bool usable) const;
  double landmark_log_bayes() const;
  void begin_landmarks();
  bool search_by_landmarks();
  wm_time_ns searched_since(wm_time_ns now_ns) const;
  int landmarks_that_fit(wm_time_ns since_ns) const;
  void adopt_found(const search_result &found);
  travelled_pose2 odometry() const { return {filter_.odom(), filter_.travelled_m(), filter_.turned_rad()}; }
  wm_status take_pose(const wm_event &event);
  // edge_positions.cpp
  wm_status take_position(const wm_event &event, record_list records);
  wm_status take_heading(const wm_event &event, record_list records);
  wm_status take_localized(const wm_event &event, record_list records);
  bool is_found_by(const observation &seen);
  void fuse_given(residual *rows, int count, int key, double clutter_volume, record_list records);
  void start_again(bool known);

  int camera_of(const wm_points &points) const;
  double point_sigma(const wm_points &points, uint32_t i, int camera) const;
  void place_scan(const wm_points &points, int camera);
  void prepare_points(const wm_points &points, int camera);

  alignment alignment_of(int camera) const;
  capture capture_of(const alignment &a) const;
  bool predict_scan(int camera, prediction *out) const;
  bool match(const wm_points &points, uint32_t i, const alignment &a, const capture &from, matched_point *out) const;
  void count_point(const matched_point &p, const scan_point &own, bool near, double mapped, const capture &from,
                   double correlated, normal_equations *out) const;
  void count_unexplained(const matched_point &p, const capture &from, normal_equations *out) const;
  void jacobian_of(const matched_point &p, const alignment &a, const capture &from, point_vector *row) const;
  int wall_of(const alignment &a, int guess, matched_point *p) const;
  void linearize(const wm_points &points, const alignment &a, double gate_m, const prediction *open, descent_pass pass,
                 double mapped[WM_POINTS_MAX], normal_equations *out) const;
  static align_vector difference_of(const alignment &a, const alignment &b);
  double descend(const wm_points &points, const prediction &whole, const prediction &part, double slack_m, alignment *a,
                 normal_equations *e) const;
  static void narrow(const sin_cos &axis, const align_vector &shared, double variance, double to, prediction *part);
  void find_minima(const wm_points &points, const prediction &prior, minima *out) const;
  void compare_minima(const minima &found, const prediction &prior, double *off, double *probability) const;
  void describe(const normal_equations &scan, const alignment &a, wm_innovation *record) const;
  bool fuse_information(const normal_equations &e, const alignment &a);
  void update_walls(const wm_points &points, int camera);
  void forget_walls();
  bool align(const wm_points &points, int camera, normal_equations *scan, wm_innovation *record);

  // Log odds that the pose is wrong: the scans' fit, and what other poses explain.
  double lost_log_odds() const;
  void update_lost(const normal_equations &scan, double dt_s);
  void update_state(double log_bayes_factor);
  void update_suspicion();
  void check_odometry();
  void on_motion_gap();
  void relocalize();
  void decide();
  void update_aliases(double dt_s);
  void adopt(int hypothesis);
  void begin_tentative(const wm_pose2 &pose);
  void add_hypotheses_spread(wm_estimate *out) const;
  void lose();

  struct arrays {
    double *filter, *off;
    landmark_record *records;
    sighting_aid::arrays landmarks;
    uint8_t *map, *search;
  };
  static arrays place(memory_layout *layout, const wm_edge_mcl_params &params, const wm_setup &setup);

  const wm_setup *setup_;
  wm_edge_mcl_params params_;
  planar_filter filter_;
  relative_array<double> off_;  // by how much each state differs at each minimum
  edge_map map_;
  floor_points scan_;  // those on a line with their neighbours, in now's base_link
  scan_point points_[WM_POINTS_MAX];
  place_search search_;
  hypotheses others_;
  fit_evidence fit_;
  odometry_check odometry_;
  wall_list walls_;
  floor_camera camera_[kCamerasMax];
  int camera_count_;
  state_slots<kCamerasMax, kCameraTime + 1> slots_;
  int edge_state_;
  int64_t wall_state_;                         // the first of them, -1: off; 64 bits: no padding
  rollback<kMaxEdgeCalibration, 2> rollback_;  // calibration while the scans fitted: being lost is noticed within 2 s
  sighting_aid landmarks_;
  relative_array<landmark_record> records_;
  position_aid positions_;
  localizer_aid localizer_;
  landmark_evidence landmark_fit_;
  pose_search landmarks_seen_;
  wm_time_ns refuted_ns_;       // when scans refuted a pose that landmarks found
  int64_t has_landmarks_;       // 64 bits: no padding
  int64_t calibration_states_;  // pose and calibration; walls and lent states come behind
  lifecycle life_;
  wm_pose2 scan_odom_;  // odometry at the last scan
  wm_time_ns watched_ns_, driven_ns_;
  // Of each camera, and of points without one: time and travelled distance when a scan was fused last.
  wm_time_ns aligned_ns_[kCamerasMax + 1];
  double aligned_m_[kCamerasMax + 1];
  double unmapped_per_m_;  // density of edges that the map does not have, across a wall
  double independence_;    // of a scan's errors from the last one's: 0 to 1
  double walls_m_;         // travelled distance and rotation when the walls were listed last
  double aliases_m_;       // travelled distance when aliases were weighed last
  double watched_m_;       // the same, plus rotation, when the last scan was judged
  bool nominal_;           // no doubt at all: aliases get their smaller budget
  bool suspicious_;        // recent scans are looked for elsewhere
  bool map_searched_;      // the whole map, since then
  bool tentative_;         // a pose was adopted that scans have not confirmed yet
};

}  // namespace wm

#endif
