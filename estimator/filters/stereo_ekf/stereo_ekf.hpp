// SPDX-License-Identifier: Apache-2.0
// System 3 of the papers: a stereo camera, acoustic ranges, depth, heading and a velocity log in six degrees of
// freedom; known points, points found on the way, or both. docs/estimators/stereo_ekf.md has the model.
#ifndef WAYMARK_ESTIMATOR_STEREO_EKF_HPP
#define WAYMARK_ESTIMATOR_STEREO_EKF_HPP

#include "filters/core/calibration_list.hpp"
#include "filters/core/landmark_evidence.hpp"
#include "filters/core/lifecycle.hpp"
#include "filters/core/receiver_error.hpp"
#include "filters/core/record_list.hpp"
#include "filters/core/rollback.hpp"
#include "filters/relocalize/pose_consensus.hpp"
#include "filters/stereo_ekf/gravity.hpp"
#include "filters/stereo_ekf/map_search.hpp"
#include "filters/stereo_ekf/params.h"
#include "filters/stereo_ekf/picture_motion.hpp"
#include "filters/stereo_ekf/space_filter.hpp"
#include "maps/landmark_index.hpp"
#include "sensors/sighting_params.h"
#include "sensors/stereo_rig.hpp"
#include "waymark/estimator.h"
#include "waymark/internal/memory/layout.hpp"

namespace wm {

class stereo_ekf {
 public:
  static size_t bytes(const wm_stereo_ekf_params &params, const wm_setup &setup, const char **why);
  void init(const wm_stereo_ekf_params &params, const wm_setup &setup);

  wm_status predict(const wm_event &motion);
  wm_status correct(const wm_event &event, record_list records);
  void estimate(wm_estimate *out) const;
  void list_calibration(calibration_list *list) const;
  size_t list_counters(wm_counter *out, size_t capacity) const;
  size_t list_landmarks(wm_landmark *out, double (*covariance)[4], size_t capacity) const;
  wm_motion_calibration motion_calibration() const;
  uint32_t motion_health() const { return motion_.health(); }

  // keep.cpp: wm_keeper's functions
  static size_t kept_bytes_max(const wm_stereo_ekf_params &params, const wm_setup &setup);
  size_t keep(void *out, size_t capacity) const;
  static const char *why_not_kept(const wm_stereo_ekf_params &params, const wm_setup &setup, const void *image,
                                  size_t bytes);
  void take_kept(const void *image);
  // The parameters with what the setup decides.
  static wm_stereo_ekf_params used_params(const wm_stereo_ekf_params &params, const wm_setup &setup);

 private:
  static constexpr int32_t kOfMap = -1;  // point_info::unseen of a point of the map, which is not removed
  // Observations of the last seconds are used to find the pose; odometry relates them. Not swept.
  static constexpr double kWindow_s = 3.0;
  // At a disparity below this a point's distance is too uncertain to be linearised: at 0.5 px, one sixth of it. Not
  // swept.
  static constexpr double kDisparityLeast_px = 3.0;
  // A track becomes a point of the state where one picture gives its distance to this share; of a farther one the
  // error is not Gaussian in place. 0.05 costs one car 9.7 instead of 8.6 m; at the sea floor 0.03 is met below 5 m.
  static constexpr double kNearShare = 0.03;
  // A track follows its patch without drift while the patch hardly changes: it grows by way / depth in each picture.
  // A car at 10 m/s has 0.08 and more, and drift of a pixel in each picture; the sea floor 0.01 to 0.05. At 0.04,
  // 0.05 and 0.06 the error there is 4.2, 3.9 and 3.5 mm; the cars' are the same.
  static constexpr double kGrowthMost = 0.06;
  // Drift of a track by the growth of its patch, px: it counts as noise of a distance, whatever the detector states.
  // Three drives of cars with a sigma of 0.5 px stated: with 14 one is 11.3 m off, from 16 on each is as with 1 px
  // (8.4), and without another has 5.7 in place of 1.1 m. seabed-a: 0.024 m with 12.5, 0.028 with 16, 0.035 with 20.
  static constexpr double kDrift_px = 16.0;
  static constexpr int kDepthKey = -4;  // beside core/landmark_evidence.hpp's keys
  // A point of the state.
  struct point_info {
    wm_time_ns begun_ns, seen_ns, misfit_ns;  // first and last fused, last outlier
    int32_t id;                               // below 0: a corner of a key frame
    int32_t unseen;                           // kOfMap, or pictures in which it was missed or was an outlier
    int64_t frame;  // of the own map, in which it will lie; kNoFrame: none yet; kFoundAgain: it lies there already
    uint64_t seen_as[kAppearanceWords], kept_as[kAppearanceWords];  // by the newest picture, and by its frame's
  };
  static constexpr int kFramesMost = 200;  // slam.key_frames' limit
  static constexpr int64_t kNoFrame = -1, kFoundAgain = -2;
  // A point of the present picture, for the own map.
  struct looked_point {
    wm_stereo seen;
    vec3 in_body;
    double sigma_m;
    int64_t found;  // number of its point of the own map; -1: none
  };
  static constexpr int kLookedMost = matched_points::kCapacity;
  // The pose at the time of measurement, and the twist about then, in body axes.
  struct past_pose {
    pose3 at;
    mat3 R;
    vec3 v_mps, w_radps;
  };
  // A point in the left camera's axes, its derivatives by the states (three rows) and by the point's own place.
  struct point_view {
    vec3 x;
    row_block by;
    mat3 A;
  };

  static constexpr int kError = 6;  // numbers of a motion's error
  // The derivatives of a measured motion by the states.
  struct increment_view {
    int columns, index[kError + 4];
    matrix<kError, kError + 4> by;
  };

  bool constant_velocity() const { return params_.prediction == WM_PREDICT_CONSTANT_VELOCITY; }
  wm_status check_time(wm_time_ns t_ns) const;
  void move_to(wm_time_ns t_ns);

  // fuse.cpp
  wm_status fuse_stereo(const wm_event &event, record_list records);
  wm_status fuse_known_point(const wm_event &event, int known, const wm_innovation &blank, record_list records);
  wm_status fuse_sighting(const wm_event &event, record_list records);
  wm_status fuse_marker(const wm_event &event, record_list records);
  wm_status fuse_position(const wm_event &event, record_list records);
  wm_status fuse_heading(const wm_event &event, record_list records);
  void fuse_twist(const wm_event &motion);
  void fuse_gravity();
  void follow_rates();
  row_verdict fuse_point(const wm_stereo &seen, const vec3 &place, double place_sigma_m, int slot,
                         const wm_innovation &blank, record_list records);
  row_verdict fuse_rows(const row_block &block, const wm_innovation &blank, record_list records);

  // rows.cpp
  past_pose state_before(double age_s) const;
  past_pose state_at_picture() const;
  stereo_rig rig() const;
  void add_lens_columns(const vec3 &x, row_block *out) const;
  mat3 camera_axes() const;  // of the left camera in base_link, with the state of its rotation
  vec3 in_camera(const vec3 &place, const past_pose &past) const;
  point_view view_point(const vec3 &place, const past_pose &past) const;
  bool point_rows(const wm_stereo &seen, const vec3 &place, double place_sigma_m, int slot, const past_pose &past,
                  row_block *out) const;
  bool sighting_rows(const wm_sighting &s, int landmark, int slot, row_block *out) const;
  bool marker_rows(const wm_marker &m, int landmark, int slot, row_block *out) const;
  void depth_rows(const wm_position &p, row_block *out) const;
  void position_rows(const wm_position &p, int last, row_block *out) const;
  bool heading_rows(const wm_heading &h, row_block *out) const;
  row_block twist_rows(head_state which, const vec3 &measured, const vec3 &slope_per_s, const vec3 &variance,
                       uint32_t axes) const;
  row_block gravity_rows(const vec3 &force, const double variance[3]) const;
  void add_pose_columns(row_block *block, const past_pose &past, const vec3 &arm, const double (*by_end)[3],
                        const double (*by_turn)[3]) const;
  void add_bias_column(row_block *block, int row, head_state which) const;

  // points.cpp
  int slot_of_known(int landmark);
  void begin_picture(wm_time_ns t_ns);
  void end_picture();
  int find_slot(int32_t id) const;
  void add_point(const wm_stereo &seen, const wm_innovation &blank, record_list records);
  void contradict_point(int slot, const wm_stereo &seen, const wm_innovation &blank, record_list records);
  int oldest_point() const;
  int free_slots() const;
  bool has_room() const;
  bool make_room();
  bool is_landmark(const wm_stereo &seen) const;
  bool grows_fast(double depth_m) const;
  bool matches_itself(const wm_stereo &seen, wm_innovation *record) const;
  void remove_point(int slot);
  void forget_points();

  // find_again.cpp: the own map
  static int32_t corner_id(int frame, int corner) { return -2 - own_map::kCorners * frame - corner; }
  double corner_variance(double depth_m) const;
  void look(const wm_stereo &seen);
  void bound_reach(double *reach_m) const;
  void note_appearance(int slot, const wm_stereo &seen);
  frame_triangle triangle_of(int frame) const;
  void triangle_block(int frame, const vec3 &coordinates, row_block *out) const;
  mat3 covariance_by(const row_block &block) const;
  bool map_point_of(int slot, own_point *out) const;
  void leave_points();
  void leave_point(int slot);
  void find_again();
  bool take_filtered(const past_pose &past, looked_point *look) const;
  double match(const pose3 &body, const double *reach_m, matched_points *out);
  int keep_agreeing(const matched_points &all, const pose3 &at);
  bool fuse_match(const looked_point &looked, const gates &limits);
  int fuse_matches(const gates &limits);
  int agreeing_frame() const;
  bool is_expected(const pose3 &body_at_picture, int frame, double noise_m2) const;
  void weak_prior(int frame, double *sigma_m, double *sigma_rad) const;
  void begin_again(const pose3 &body_at_picture, int frame);
  bool close_loop(const pose3 &body, const double *reach_m, bool elsewhere);
  void begin_search();
  void search_on();
  void extend_map();
  void begin_frame(int frame, double depth_m);
  void forget_frame(int frame);
  void forget_map();
  int kept_state(int i, const int *frames) const;
  int64_t put_points(int frame, uint8_t *bytes, size_t *at, size_t capacity) const;

  // increments.cpp
  pair_view pair() const;
  void add_track(const wm_stereo &seen, const wm_innovation &blank, record_list records);
  void view_increment(increment_view *out) const;
  matrix<kError> predicted_variance(const increment_view &at) const;
  bool shows_scene(const matrix<kError> &predicted, const motion_error &seen);
  bool increment_rows(const pair_view &view, row_block out[2]);
  void fuse_increment();

  // recovery.cpp
  wm_status take_pose(const wm_event &event);
  void start_pose();
  void set_pose(const pose3 &pose, double sigma_m, double sigma_rad);
  void buffer_observation(const wm_stereo &seen, const wm_landmark &landmark, wm_time_ns t_ns);
  void note(wm_time_ns t_ns, int key, const row_verdict &result, double clutter_volume, landmark_record *record);
  double clutter_volume_of(const wm_stereo &seen) const;
  double clutter_volume_of(const wm_sighting &seen) const;
  void begin_pose(bool known, double log_odds_wrong);
  void search(wm_time_ns since_ns);

  double map_sigma(const wm_landmark &landmark) const {
    const double least = setup_->sightings->map_sigma_min_m;
    return landmark.sigma_m > least ? landmark.sigma_m : least;
  }
  // Arrays behind the struct.
  struct arrays {
    int *order;
    landmark_record *records;
    point_info *info;
    double *filter;
    looked_point *looked;
    map_search *search;
    own_frame *frame;
    own_point *map_point;
    vec3 *places;
  };
  static arrays place(memory_layout *layout, const wm_stereo_ekf_params &params, const wm_setup &setup);
  gates limits() const { return {params_.gate_soft, params_.gate_hard}; }

  space_filter filter_;
  spatial_motion motion_;
  gravity_window gravity_;
  receiver_error receiver_;
  vec3 antenna_m_;  // in base_link, without the state of its error
  // Of the gyro, as it was when an axis was lost.
  struct kept_bias {
    wm_time_ns t_ns;
    double radps, variance;
  } gyro_bias_[3];
  uint32_t lost_rates_;  // axes, a bit each
  stereo_rig rig_;
  wm_stereo_ekf_params params_;
  wm_position_params gnss_;
  wm_marker_params markers_;
  const wm_setup *setup_;
  landmark_index index_;
  relative_array<landmark_record> records_;  // by landmark
  relative_array<point_info> info_;          // by slot of the state
  own_map map_;
  relative_array<looked_point> looked_;
  relative_array<map_search> search_;  // one, where there is a map
  int64_t looked_count_;
  pose3 frame_pose_;          // where the newest key frame was made, or the map was found again
  wm_time_ns frame_ns_;       // then; NONE: never
  wm_time_ns everywhere_ns_;  // when the newest search of the whole map began; NONE: never
  wm_time_ns elsewhere_ns_;   // when that search contradicted the pose; NONE: it does not
  double sigma_px_[4];
  wm_time_ns now_ns_, start_ns_;
  wm_time_ns last_picture_ns_;  // whose tracks `tracks_` has
  int64_t other_scene_;         // evidence of another scene (increments.cpp), pictures
  wm_time_ns picture_ns_;       // the present picture; NONE between pictures
  picture_motion tracks_;
  travelled_pose odometry_;  // motion alone
  landmark_evidence evidence_;
  pose_consensus observations_;
  lifecycle life_;
  rollback<kHeadMax> remembered_;  // calibration states from before a fault
};

}  // namespace wm

#endif
