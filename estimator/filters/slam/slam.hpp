// SPDX-License-Identifier: Apache-2.0
// Planar EKF-SLAM on sightings of landmarks at unknown places. docs/estimators/slam.md has the model. One observation's
// way: correct() -> fuse_sighting() -> associate() -> fuse_known() -> expect_sighting() -> prepare() -> weigh() ->
// fuse_rows() -> note_fused().
#ifndef WAYMARK_ESTIMATOR_SLAM_SLAM_HPP
#define WAYMARK_ESTIMATOR_SLAM_SLAM_HPP

#include "aid/frame_fit.hpp"
#include "aid/localizer.hpp"
#include "aid/position.hpp"
#include "aid/tag.hpp"
#include "filters/core/gate.hpp"
#include "filters/core/landmark_evidence.hpp"
#include "filters/core/lifecycle.hpp"
#include "filters/core/record_list.hpp"
#include "filters/core/recovery.hpp"
#include "filters/core/rollback.hpp"
#include "filters/core/sensor_slots.hpp"
#include "filters/core/state_pool.hpp"
#include "filters/relocalize/line_search.hpp"
#include "filters/slam/bearing_tracks.hpp"
#include "filters/slam/joint_state.hpp"
#include "filters/slam/params.h"
#include "filters/slam/slip_search.hpp"
#include "sensors/sighting.hpp"
#include "waymark/internal/memory/layout.hpp"

namespace wm {

inline constexpr int kSlamSensors = 8;  // capacity
// Observations of each of two lines that may be one (lines.rejoin): a false line rarely lasts a second. Not swept.
inline constexpr uint32_t kMergeSeen = 10;
// An identity that was unseen for so long and comes back is the landmark's own: a tracker bridges a few pictures. Two
// of them decide, since one may be a number that began anew. Not swept.
inline constexpr double kUnseen_s = 5.0;
inline constexpr int kReturned = 2;
// Bearings in a picture: fewer have no majority, and state little together. Not swept.
inline constexpr int kManyBearings = 5;
// Log odds that a pose is wrong which defines the map's frame: as of a proven one.
inline constexpr double kOwnFramePrior = -5.0;

// What is known of a landmark beside its place.
struct landmark_note {
  int32_t id;
  uint32_t seen;                 // observations fused
  wm_time_ns first_ns, last_ns;  // seen; with bearings alone, also before it joined
  double z_m;
  int32_t misfits;          // in a row
  int32_t surveyed;         // from the given map: never removed
  int32_t sensor;           // that saw it last
  int32_t tilt_sensor;      // the sensor whose observations `mean_m` averages; -1: none
  wm_time_ns deferred_ns;   // when a surprising observation was deferred (trust.cpp)
  double weight;            // of a place that a landmark seen by ranges alone may be at (annulus.cpp); 0: decided
  double mean_m[3], means;  // of a coded marker: its mean place in that sensor's levelled axes, of so many observations
  wm_pose2 first_view;      // base_link in the odometry's frame when it joined
  int32_t apart_from;       // a landmark that was seen in one stamp with this one, though it stands here; -1: none
  bool revisited;           // seen again where it was, after it was out of sight
  bool level;               // a coded marker without a second pose
  landmark_record record;
  // Of a sighting with a range, whose identity may be misread: a line is seen from several places before it joins, and
  // a marker's code has a check.
  bool may_be_misread;
  bool viewed_twice;  // from two places, or for some seconds
  bool is_double;     // it stands where another one does that is seen more often: probably that one, misread
  uint8_t unused[5];  // no padding: the same events must give the same bytes
};

struct slam_counts {
  uint64_t joined, left, moved, ambiguous, no_room, merged, rotation_outliers;
};

// Innovations of one picture's outliers: of bearings to known landmarks, and of markers' headings.
struct picture_outliers {
  static constexpr int kCapacity = 32;  // further ones are not looked at
  enum kind { kBearings, kMarkers, kKinds };
  struct of_kind {
    double innovation_rad[kCapacity];
    int fused, rejected;
  };
  wm_time_ns t_ns;
  of_kind of[kKinds];
  int before[kKinds];  // fused and rejected in the picture before
};

// Of a landmark that is seen for the first time.
landmark_note note_of(int32_t id, int sensor, wm_time_ns t_ns);

// Bearings at the beginning of a picture, of which none agrees with another one (first_bearings.cpp).
struct first_bearings {
  static constexpr int kCapacity = 4;
  struct one {
    int32_t id, sensor;
    double bearing_rad, given_sigma_rad;
    double innovation, variance;
    joint_row row;
  };
  one waiting[kCapacity];
  int count, settled;  // settled: two agree, or none will
};

// The last identities with a property.
struct identity_list {
  static constexpr int kCapacity = 16;  // a further one replaces the oldest
  int32_t id[kCapacity];
  int count, last;  // last: the newest one; -1: none
  void clear() { count = 0, last = -1; }
  bool has(int32_t one) const {
    for (int i = 0; i < count && i < kCapacity; i++)
      if (id[i] == one) return true;
    return false;
  }
  void add(int32_t one) { id[count++ % kCapacity] = last = one; }
};

class slam {
 public:
  static size_t bytes(const wm_slam_params &params, const wm_setup &setup, const char **why);
  void init(const wm_slam_params &params, const wm_setup &setup);

  wm_status predict(const wm_event &motion);
  wm_status correct(const wm_event &event, record_list records);
  void estimate(wm_estimate *out) const;
  void list_calibration(calibration_list *list) const;
  size_t list_counters(wm_counter *out, size_t capacity) const;
  size_t list_landmarks(wm_landmark *out, double (*covariance)[4], size_t capacity) const;
  const wm_motion_calibration &motion_calibration() const { return joint_.calibration(); }
  uint32_t motion_health() const { return joint_.motion_health(); }
  // keep.cpp: wm_keeper's functions
  static size_t kept_bytes_max(const wm_slam_params &params, const wm_setup &setup);
  size_t keep(void *out, size_t capacity) const;
  static const char *why_not_kept(const wm_slam_params &params, const wm_setup &setup, const void *image, size_t bytes);
  void take_kept(const void *image);

 private:
  static constexpr int kMaxCalibration = kCalibrationCount + 2 + kSlamSensors * kSensorStates;  // 2: means of the slip
  using reading = sighting_reading;

  // An observation of a landmark on its way to the update.
  struct context {
    int sensor;
    int32_t id;
    past_pose past;        // at its time
    wm_innovation record;  // as far as it is known
    record_list records;
  };
  // The rows of an observation: Jacobian by the state, and by the landmark's own states apart.
  struct landmark_rows {
    int count = 0;
    wm_residual kind[3];
    joint_row row[3];
    double observed[3], expected[3], innovation[3], noise[3];
    double by_landmark[3][3];
  };
  // An observation of a landmark in the sensor's frame, for the search of the pose; NaN: absent. The heading is the
  // landmark's own in base_link.
  struct planar_observation {
    double bearing_rad, range_m, heading_rad;
    double bearing_sigma_rad, range_sigma_m, heading_sigma_rad;
  };
  // A bearing without a range. Its sigma as it came, and as it counts.
  struct line_bearing {
    double bearing_rad, given_sigma_rad, sigma_rad, correlated_rad;
    unsigned exact;  // states of the sensor, as sensor_slots::at()
  };
  // A landmark as seen from the sensor: its distance, and the variances along and across the line of sight.
  struct relative_place {
    double distance_m, along_m2, across_m2, along_across_m2;
    double heading_rad2, heading_along, heading_across;  // covariances of the robot's heading with itself and these
  };
  // Two landmarks that may be one line: their states, the difference of their places and its covariance.
  struct landmark_pair {
    int fresh, lost;
    double apart[2], s[2][2];
  };

  // slam.cpp: memory, start, landmarks
  struct arrays {
    landmark_note *notes;
    double *joint;
  };
  static arrays place(memory_layout *out, const wm_slam_params &params, const wm_setup &setup);
  static int lasting_states(const wm_slam_params &params, const wm_setup &setup);  // pose and calibration
  void note_range(int sensor, bool is_standard);
  void note_calibrated(int sensor, unsigned exact);
  bool has_standard() const;
  void follow_scale();
  // In the picture before.
  bool sees_many() const { return outliers_.before[0] + outliers_.before[1] >= kManyBearings; }
  bool has_headings() const { return joint_.layout().landmark_width == 3; }
  bool has_lines() const { return joint_.layout().clones > 0; }
  void take_headings();
  void take_lines();
  void note_return(double unseen_s);
  void load_map();
  void start_again();
  wm_status take_pose(const wm_event &event);
  wm_status begin_observation(wm_time_ns t_ns);
  int find_landmark(int32_t id) const;
  int32_t own_id();
  bool make_room();
  void maintain_map(wm_time_ns t_ns);
  void drop_landmark(int landmark);
  int note_landmark(int32_t id, int landmark, int sensor);
  bool is_member(const landmark_note &note) const { return note.weight > 0.0; }
  bool is_seen_enough(const landmark_note &note) const {
    return note.surveyed || note.seen >= static_cast<uint32_t>(params_.confirm_seen);
  }
  // A landmark seen from one place alone stays, but its identity may be misread, so that it is not confirmed.
  bool is_confirmed(const landmark_note &note) const {
    return is_seen_enough(note) && (!note.may_be_misread || (note.viewed_twice && !note.is_double));
  }
  wm_pose2 pose_of(int landmark) const;

  // keep.cpp
  void take_kept_landmark(const void *image, int from);
  void place_in_kept();
  void age_kept(wm_time_ns t_ns);

  // update.cpp: rows of an observation
  void begin_picture(int sensor, wm_time_ns t_ns);
  past_pose look_back(int sensor) const;  // by the sensor's time offset
  sensor_errors errors_of(int sensor) const;
  wm_pose2 sensor_pose(int sensor, const past_pose &past) const;
  int lend(const context &at);
  relative_place relative_place_of(const context &at, int landmark) const;
  gate_limits gates() const { return {sightings().gate_soft, sightings().gate_hard}; }
  innovation prepare(int landmark, landmark_rows *v);
  wm_verdict fuse_rows(const context &at, const landmark_rows &v, const gate_result &g, innovation *block,
                       int unknown = -1);
  int join(const context &at, const landmark_rows &v, const double inverse[3][3], const double place[3],
           double heading_variance);

  // sightings.cpp
  reading reading_of(const wm_sighting &s) const;
  static unsigned exact_states(const reading &r);
  double distance_of(const wm_sighting &s) const;
  wm_status fuse_sighting(const wm_event &event, record_list records);
  bool takes_unidentified(int sensor) const;
  void note_identity(int sensor, bool named);
  wm_verdict identify(const wm_sighting &s, const reading &r, context *at, int *landmark);
  int associate(const wm_sighting &s, const reading &r, const past_pose &past, bool *fresh) const;
  planar_observation observation_of(const wm_sighting &s, const reading &r) const;
  wm_verdict expect_sighting(const wm_sighting &s, const reading &r, const past_pose &past, const wm_pose2 &place,
                             int error_state, landmark_rows *out) const;
  wm_status take_sighting(const context &at, const wm_sighting &s, const reading &r, int landmark);
  line_bearing line_bearing_of(const wm_sighting &s, const reading &r) const;
  bool weigh_identified(int landmark, const context &at, const wm_sighting &s, const reading &r, const landmark_rows &v,
                        const innovation &block, bool passed);
  void expect_point(const context &at, const planar_observation &seen, int landmark, landmark_rows *out) const;
  bool add_bend(const context &at, int landmark, landmark_rows *v) const;
  void fuse_known(const context &at, const wm_sighting &s, const reading &r, int landmark);
  wm_status begin_landmark(context at, const wm_sighting &s, const reading &r);
  wm_verdict join_seen(const context &at, const wm_sighting &s, const reading &r);

  // bearing_only.cpp
  int clone_state(int clone) const { return first_clone_ + 3 * clone; }
  int ray_state(const bearing_tracks::track &track) const { return first_ray_ + 2 * tracks_.index(track); }
  int keep_clone(const context &at, unsigned exact);
  wm_verdict track_bearing(const context &at, const line_bearing &seen);
  bool join_line(const context &at, const bearing_tracks::track &track);
  bearing_tracks::track *current_ray(const context &at);
  wm_verdict begin_ray(const context &at, const line_bearing &seen);
  wm_verdict expect_ray(const context &at, const bearing_tracks::track &track, const line_bearing &seen, double inverse,
                        landmark_rows *out);
  wm_verdict prepare_ray(const context &at, const bearing_tracks::track &track, const line_bearing &seen,
                         landmark_rows *v, innovation *block);
  wm_status follow_ray(const context &at, bearing_tracks::track *track, const line_bearing &seen);
  void settle_ray(const context &at, const wm_pose2 &from, bearing_tracks::track *track);
  void end_ray(bearing_tracks::track *track);
  void forget_lines();
  void forget_tracks();

  // annulus.cpp
  wm_verdict follow_annulus(const context &at, const wm_sighting &s, const reading &r);
  wm_verdict begin_annulus(const context &at, const wm_sighting &s, const reading &r);
  void weigh_members(const context &at, const wm_sighting &s, const reading &r, int first);
  double curvature_variance(const context &at, int landmark, const landmark_rows &v) const;
  void merge_members(int32_t id, int first, double range_variance);
  void decide_member(const context &at, int first);

  // markers.cpp
  wm_status fuse_marker(const wm_event &event, record_list records);
  tag_reading read_marker(const wm_marker &m, bool second) const {
    return read_tag(m, second, sensor_[m.sensor], errors_of(m.sensor), sightings(), markers_);
  }
  planar_observation observation_of(const wm_marker &m, const tag_reading &r) const;
  void expect_known_marker(const context &at, const tag_reading &r, int landmark, int count, landmark_rows *out);
  double marker_nis(const context &at, int landmark, const tag_reading &r);
  void expect_marker(const context &at, const tag_reading &r, const wm_pose2 &place, int error_state,
                     landmark_rows *out) const;
  void carry_marker_errors(const tag_reading &r, int error_state, landmark_rows *out) const;
  void fuse_known_marker(const context &at, const wm_marker &m, const tag_reading &r, int landmark);
  wm_verdict join_marker(const context &at, const tag_reading &r);
  void fuse_height(int landmark, int sensor, const tag_reading &r);

  // positions.cpp
  void begin_frame();
  void place_map(const wm_pose2 &by, const double about_m[2], double turn_sigma_rad, double white_m, double lasting_m);
  bool is_placing(const wm_position &p, const position_aid::view &at);
  void fuse_given(const residual *rows, int count, int key, double clutter_volume, record_list records);
  bool search_by(const observation &seen);
  wm_status fuse_position(const wm_event &event, record_list records);
  wm_status fuse_heading(const wm_event &event, record_list records);
  bool is_placing(const localizer_aid::view &at);
  wm_status fuse_localized(const wm_event &event, record_list records);
  bool is_frame_unknown() const { return !is_placed_ && positions_.has_position(); }

  // trust.cpp
  bool is_plausible(int landmark, const innovation &block, double noise);
  bool is_ambiguous(int32_t id, int landmark, int sensor);
  void note_rotation(bool fused, double innovation_rad, picture_outliers::kind kind, wm_time_ns last_ns);
  bool is_turned(picture_outliers::kind kind, double *turn_rad) const;
  void end_picture(wm_time_ns t_ns);
  void note_fused(int landmark, int sensor);
  void note_misfit(int landmark, bool ranged);
  int most_misfits(const landmark_note &seen) const;
  bool do_others_fit(const landmark_note &seen) const;
  bool stands_with(int one, int other) const;
  void find_double(int landmark);

  // first_bearings.cpp
  bool waits_for_another(const context &at, const line_bearing &seen, const landmark_rows &v, const innovation &block);
  void take_waiting(const context &newest);

  // rejoin.cpp
  void merge_if_one(int fresh);
  bool may_be_one(int fresh, int lost) const;
  landmark_pair pair_of(int fresh, int lost) const;
  void covariance_of_pairs(const landmark_pair &p, const landmark_pair &q, double out[2][2]) const;
  bool is_compatible_with_another(const landmark_pair &p) const;

  // recovery.cpp
  void begin_evidence(double log_prior);
  bool map_is_held() const;
  joint_state::scope scope_now() const;
  bool is_witness(const landmark_note &note) const;
  bool weigh(int landmark, bool passed, double log_bayes, double angle_rad, double normalised);
  bool weigh_source(int key, landmark_record *record, bool passed, bool witness, double log_bayes, double angle_rad,
                    double normalised);
  void lose();
  observation observation_from(int landmark, const context &at, const planar_observation &seen) const;
  bool keep_observation(int landmark, const context &at, const planar_observation &seen);
  int landmarks_fitting(const wm_pose2 &pose, wm_time_ns since_ns, int32_t *id) const;
  bool is_found_by_one(const search_result &found, wm_time_ns since_ns, int32_t id) const;
  bool relocalize();
  void take_found(double log_prior);
  void inflate_while_lost();
  void widen(wm_estimate *out) const;

  // slips.cpp
  travelled_pose2 odometry() const;
  bool weigh_slip(int landmark, const context &at, const planar_observation &seen, bool fits);
  void end_doubt();
  void take_slip(const slip_hypothesis &found);

  // pattern.cpp
  void collect_bearing(const wm_sighting &s, const past_pose &past);
  void end_bearings(wm_time_ns t_ns);
  void weigh_pattern(wm_time_ns t_ns);
  void search_pattern();

  joint_state joint_;
  relative_array<landmark_note> notes_;
  landmark_note &note(int landmark) { return notes_[static_cast<size_t>(landmark)]; }
  const landmark_note &note(int landmark) const { return notes_[static_cast<size_t>(landmark)]; }
  const wm_sighting_params &sightings() const { return *setup_->sightings; }

  const wm_setup *setup_;
  wm_slam_params params_;
  wm_marker_params markers_;
  mounted_sensor sensor_[kSlamSensors];
  int32_t nameless_[kSlamSensors];  // sightings, none of them with an identity; -1: one had
  sensor_slots slots_;
  unsigned components_;                  // of expect(): whether the angle scale is a state
  unsigned standards_, scaled_;          // sensors, by bit, whose ranges came: without a scale, with the default's
  int stamp_state_[kSlamSensors];        // error of the newest picture's stamp; -1: off
  wm_time_ns picture_ns_[kSlamSensors];  // that stamp
  state_pool<24> errors_;                // time-correlated errors of a sensor on a landmark
  correlated_slot error_;                // a slot of these
  position_aid positions_;
  localizer_aid localizer_;
  frame_fit frame_;
  bearing_tracks tracks_;
  int first_ray_, first_clone_;
  int returned_;      // identities of bearings alone that came back
  bool by_bearings_;  // the map began with bearings alone
  bool rejoins_;      // identities of bearings alone are numbers of a tracker
  slam_counts counts_;
  double bloom_px_[kSlamSensors];  // of the last marker that has one; NaN: none has
  int32_t next_id_;
  int members_;                   // landmarks that are places of undecided ones
  int cursor_;                    // of maintain_map
  wm_time_ns other_fused_ns_[2];  // when the last two different landmarks were fused
  int32_t other_fused_id_[2];
  identity_list moved_, ambiguous_;
  picture_outliers outliers_;
  first_bearings first_;
  lifecycle life_;
  rollback<kMaxCalibration> rollback_;
  landmark_evidence evidence_;
  pose_search observations_;  // since the map is held
  pose_search found_by_;      // those by which the pose was found last
  slip_search slips_;
  wm_time_ns fit_ns_;      // when a witness fitted last
  bearing_look bearings_;  // of the newest picture, where lines have no identity
  wm_pose2 bearings_odom_;
  int bearings_sensor_;
  line_search line_search_;
  evidence pattern_odds_;
  double usual_share_;  // of a picture's bearings that the map explains
  wm_time_ns pattern_ns_;
  bool by_slip_;                // LOST by a slip, which more sightings confirm
  bool by_one_;                 // the pose was found by one marker and is not proven yet
  bool one_refuted_;            // by others; since then it takes two
  bool is_kept_;                // the map is that of a run before, and nothing was observed yet
  bool is_placed_, is_turned_;  // the map lies in the frame of positions, and of headings
};

}  // namespace wm

#endif
