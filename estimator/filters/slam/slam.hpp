// SPDX-License-Identifier: Apache-2.0
// Planar SLAM on sightings of landmarks at unknown places. docs/estimators.md has the model.
#ifndef WAYMARK_ESTIMATOR_SLAM_SLAM_HPP
#define WAYMARK_ESTIMATOR_SLAM_SLAM_HPP

#include "filters/core/gate.hpp"
#include "filters/core/landmark_evidence.hpp"
#include "filters/core/record_list.hpp"
#include "filters/core/sensor_slots.hpp"
#include "filters/core/state_pool.hpp"
#include "filters/planar/past_pose.hpp"
#include "filters/relocalize/line_search.hpp"
#include "filters/relocalize/pose_search.hpp"
#include "filters/slam/bearing_tracks.hpp"
#include "filters/slam/joint_state.hpp"
#include "filters/slam/params.h"
#include "sensors/sighting.hpp"

namespace wm {

inline constexpr int kSlamSensors = 8;

// What is known of a landmark beside its place.
struct landmark_note {
  int32_t id;
  uint32_t seen;                 // sightings fused
  wm_time_ns first_ns, last_ns;  // seen; with bearings alone, also before it joined
  double z_m;
  int32_t misfits;        // in a row
  int32_t surveyed;       // from the map that was given: it doesn't leave
  int32_t sensor;         // that saw it last
  int32_t levelled_by;    // the sensor whose sightings `levelled_m` is of
  wm_time_ns doubted_ns;  // a sighting that would have moved much was kept back
  // Of a coded marker, with states for tilt: where it was in one camera's levelled axes, the mean of so many sightings.
  double levelled_m[3], levelled;
  bool revisited;  // seen again where it was, after it was out of sight
  landmark_record record;
  uint8_t unused[5];  // no padding: the same events must give the same bytes
};

struct slam_counts {
  uint64_t joined, left, moved, doubled, no_room, rejoined, jolts, relocalized;
};

// What one look's bearings, of landmarks that are known, differed by where they were refused.
struct look_record {
  static constexpr int kMost = 32;
  wm_time_ns t_ns;
  int fused, refused, before;  // before: of both, in the look before
  bool of_prints;
  double by_rad[kMost];
};

// The last identities of which something is to be remembered.
struct identity_list {
  static constexpr int kMost = 16;
  int32_t id[kMost];
  int count;
  bool has(int32_t one) const {
    for (int i = 0; i < count && i < kMost; i++)
      if (id[i] == one) return true;
    return false;
  }
  void add(int32_t one) { id[count++ % kMost] = one; }
};

class slam {
 public:
  static size_t bytes(const wm_slam_params &params, const wm_setup &setup, const char **why);
  void init(const wm_slam_params &params, const wm_setup &setup);

  wm_status predict(const wm_event &motion);
  wm_status correct(const wm_event &event, record_list records);
  void estimate(wm_estimate *out) const;
  size_t list_calibration(wm_calibration_value *out, size_t capacity) const;
  size_t list_counters(wm_counter *out, size_t capacity) const;
  size_t list_landmarks(wm_landmark *out, double (*covariance)[4], size_t capacity) const;
  const wm_motion_calibration &motion_calibration() const { return joint_.calibration(); }
  uint32_t motion_health() const { return joint_.motion_health(); }

 private:
  // A sighting as rows: what is expected, derivatives by the state (the landmark's apart), noise.
  struct view {
    int count;
    wm_residual kind[2];
    joint_row row[2];
    double observed[2], expected[2], innovation[2], noise[2];
    double by_landmark[2][2];
    bool possible;
    double distance_m;
  };
  // An observation of a landmark in the sensor's frame, for the search of the pose; NaN where it has none. The heading
  // is the landmark's own in base_link.
  struct sighted {
    double bearing_rad, range_m, heading_rad;
    double sigma_rad, sigma_m, heading_sigma_rad;
  };
  using reading = sighting_reading;

  // A marker, levelled: along the sensor's yaw, on the floor.
  struct marker_reading {
    double level[3], along[2];  // place; unit vector towards it on the floor
    double told[3];             // the place as calibration.yaml has the camera's roll and pitch
    double yaw_rad, z_m;
    double noise[3];  // along, across, heading
    double z_noise;   // of its height
    double length_m;
    bool turned;  // its heading is one, not one of two
  };
  // On a map, from a robot that doesn't know where it is.
  struct seen_marker {
    int64_t id;
    double variance_m2, turn_variance;  // of its distance and of its heading
    wm_pose2 seen, odom;                // in base_link; where that was
  };
  // One marker by whose turn alone the robot may find itself, as its first sighting of those that agree had it.
  struct lone_marker {
    int32_t id;
    int seen;          // sightings that agree
    wm_pose2 odom;     // the marker in odom
    double sight_rad;  // there, from the sensor to it
    double variance_m2, turn_variance;
  };
  struct marker_view {
    joint_row row[3];
    double observed[3], expected[3], innovation[3];
    double by_landmark[3][3];
    double noise[3];
  };

  // Two landmarks that may be one line: their states, how far apart they are, and the covariance of that.
  struct pair {
    int fresh, lost;
    double apart[2], s[2][2];
  };

  past_pose look_back(int sensor) const;  // by the sensor's time offset
  void begin_picture(int sensor, wm_time_ns t_ns);
  sensor_errors errors_of(int sensor) const;
  wm_pose2 sensor_pose(int sensor, const past_pose &past) const;

  wm_status fuse_sighting(const wm_event &event, record_list records);
  sighted sighted_of(const wm_sighting &s, const reading &r) const;
  wm_status take_pose(const wm_event &event);
  void see(const wm_sighting &s, const reading &r, const past_pose &past, const double place[2], int lasting,
           view *out) const;
  // A known landmark: gate, update, records.
  void fuse_known(int landmark, const wm_sighting &s, const reading &r, const past_pose &past, wm_innovation blank,
                  record_list records);
  // A new one, from bearing and range.
  void join_seen(int32_t id, const wm_sighting &s, const reading &r, const past_pose &past, wm_innovation blank,
                 record_list records);
  // A new one that is seen by bearings alone.
  void track_bearing(int32_t id, const wm_sighting &s, const reading &r, const past_pose &past, wm_innovation blank,
                     record_list records);
  void begin_ray(int32_t id, const wm_sighting &s, const reading &r, const past_pose &past);
  void follow_ray(int32_t id, const wm_sighting &s, const reading &r, const past_pose &past, wm_innovation blank,
                  record_list records);
  void settle_ray(bearing_tracks::track *track, const wm_pose2 &from);
  void end_ray(bearing_tracks::track *track);
  int ray_state(const bearing_tracks::track &track) const { return first_ray_ + 2 * tracks_.index(track); }
  wm_status fuse_marker(const wm_event &event, record_list records);
  marker_reading read_marker(const wm_marker &m, const double p_m[3], double yaw_rad) const;
  sighted sighted_of(const wm_marker &m, const marker_reading &r) const;
  double marker_nis(int landmark, const wm_marker &m, const marker_reading &r, const past_pose &past);
  void see_marker(int sensor, const marker_reading &r, const past_pose &past, const double place[3], int lasting,
                  marker_view *out) const;
  void fuse_known_marker(int landmark, const wm_marker &m, const marker_reading &r, const past_pose &past,
                         wm_innovation blank, record_list records);
  void join_marker(const wm_marker &m, const marker_reading &r, const past_pose &past, wm_innovation blank,
                   record_list records);
  void level_camera(int landmark, int sensor, const marker_reading &r);
  bool find_start(int landmark, const wm_marker &m, const marker_reading &r, bool two);
  wm_pose2 on_map(int landmark) const;
  void start_at(const wm_pose2 &marker, const wm_pose2 &seen, double heading_rad);
  bool start_by_two(int landmark, const seen_marker &now);
  bool start_by_one(int landmark, const wm_marker &m, const marker_reading &r, const seen_marker &now);
  void doubt_start(int misfits);
  void note_fused(int landmark, int sensor);
  bool believable(int landmark, const joint_state::innovation_block &block, double noise, double scale);
  // Is this identity not one landmark's: seen twice in a picture, or at two places in turn?
  bool doubled(int32_t id, int landmark, int sensor);
  bool join_line(const bearing_tracks::track &track);
  void misfit(int landmark, bool ranged);
  int clone_state(int clone) const { return first_clone_ + 3 * clone; }
  int keep_clone(int sensor, const past_pose &past, wm_time_ns t_ns);
  int associate(const wm_sighting &s, const reading &r, const past_pose &past, bool *fresh) const;

  int lend(int sensor, int32_t id, wm_time_ns t_ns);
  int find_landmark(int32_t id) const;
  int note_landmark(int32_t id, int landmark, int sensor, wm_time_ns t_ns);
  int note_line(const bearing_tracks::track &track, int landmark);
  void drop_landmark(int landmark);
  bool make_room();
  void look_after(wm_time_ns t_ns);
  void begin_look(wm_time_ns t_ns);
  void note_turn(bool fused, double innovation_rad, bool of_print, wm_time_ns last_ns);
  void rejoin(int fresh);
  bool may_be_one(int fresh, int lost) const;
  pair make_pair(int fresh, int lost) const;
  void covariance_of_pairs(const pair &p, const pair &q, double out[2][2]) const;
  bool borne_out(const pair &p) const;
  int32_t own_id();
  void start_again();
  // recovery.cpp
  void begin_evidence(bool own_frame);
  bool map_is_held() const;
  joint_state::scope scope_now() const;
  bool is_witness(const landmark_note &note) const;
  bool weigh(int landmark, const joint_state::innovation_block &block, bool passed, double clutter_volume,
             double angle_rad);
  static double clutter_volume(bool bearing, bool range);
  void lose();
  void keep_observation(int landmark, int sensor, const past_pose &past, const sighted &seen);
  int landmarks_fitting(const wm_pose2 &pose, wm_time_ns since_ns) const;
  bool relocalize();
  void take_found();
  void open_gates();
  void widen(wm_estimate *out) const;
  // pattern.cpp
  landmark_places places() const;
  void collect_bearing(const wm_sighting &s, const past_pose &past);
  void end_bearings(wm_time_ns t_ns);
  void weigh_pattern(wm_time_ns t_ns);
  void search_pattern();
  void follow_scale();
  void load_map();
  void forget_tracks();
  void forget_lines();

  landmark_note *notes() { return reinterpret_cast<landmark_note *>(this + 1); }
  const landmark_note *notes() const { return reinterpret_cast<const landmark_note *>(this + 1); }

  joint_state joint_;
  const wm_setup *setup_;
  wm_slam_params params_;
  mounted_sensor sensor_[kSlamSensors];
  sensor_slots slots_;
  unsigned components_;                  // of expect(): whether the angle scale is a state
  int stamp_state_[kSlamSensors];        // error of the newest picture's stamp; -1: off
  wm_time_ns picture_ns_[kSlamSensors];  // that stamp
  state_pool<24> lasting_;
  int lasting_bearing_offset_, lasting_range_offset_;  // within a slot; -1: not carried
  int lasting_width_;                                  // states of a slot
  bearing_tracks tracks_;
  int first_ray_, first_clone_;
  slam_counts counts_;
  double edge_shift_px_[kSlamSensors];  // of the last marker that has one; NaN: none has
  wm_time_ns fused_ns_;
  int32_t next_id_;
  int cursor_;                    // of look_after
  wm_time_ns other_fused_ns_[2];  // when the last two different landmarks were fused
  int32_t other_fused_id_[2];
  identity_list moved_, doubled_;
  look_record look_;
  uint32_t resets_;
  wm_state state_;  // SEARCHING: started on a given map without a pose; TRACKING; LOST
  landmark_evidence evidence_;
  pose_search observations_;  // since the map is held
  wm_time_ns fit_ns_;         // when a witness fitted last
  wm_time_ns lost_ns_, searched_ns_, inflated_ns_;
  bearing_look bearings_;  // of the newest look, where lines have no identity
  wm_pose2 bearings_odom_;
  int bearings_sensor_;
  line_search line_search_;
  evidence pattern_odds_;
  double usual_share_;  // of a look's bearings that the map explains
  wm_time_ns pattern_ns_;
  seen_marker candidate_;  // the one that was seen first; its id is -1: none
  lone_marker lone_;       // its id is -1: none
  int32_t rests_on_;       // the one marker by which the pose was found, until another is fused; else -1
  bool one_refuted_;       // by the others: it takes two
};

}  // namespace wm

#endif
