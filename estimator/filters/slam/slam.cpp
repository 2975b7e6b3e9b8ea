// SPDX-License-Identifier: Apache-2.0
#include "filters/slam/slam.hpp"

#include <cstring>

#include "filters/core/contract.hpp"
#include "filters/planar/set_pose.hpp"
#include "filters/registry.h"
#include "math/arc.hpp"
#include "waymark/health.h"

namespace wm {
namespace {

constexpr double kOwnFrame_m = 1e-3, kOwnFrame_rad = 1e-3;  // sigmas of a start that defines the map's frame
constexpr double kStart_m = 0.05, kStart_rad = 0.05;        // of a start without sigmas, as in landmark_ekf
constexpr double kSurveyed_m = 1e-4, kSurveyed_rad = 0.01;  // no map is better; headings come without a sigma
// What a calibration leaves of a mounting's yaw, 0.3 degrees, and of stamps. On dlr-a with covariances, whose truth
// takes the mounting as exact, a yaw of 0 / 0.0025 / 0.005 / 0.0087 / 0.05 gives 0.38, 0.49, 0.67, 0.77, 0.94 m,
// and 7.9, 3.1, 1.7, 1.1, 0.94 m where the stated mounting is off by 3 degrees. An offset of 0 / 0.01 / 0.02 / 0.03 /
// 0.1 s gives 7, 5, 5, 5, 15 mm on hall-a, and 0.03 s 15 mm where stamps are 0.1 s off, 0.02 s 6 mm.
constexpr double kCalibratedYaw_rad = 0.005, kCalibratedOffset_s = 0.02;
// Growth of the heading's variance in one step, a silence of all sources: with a sigma of 1 rad the sine of an error
// differs from it by 16 %. Not swept.
constexpr double kUnknownHeading_rad2 = 1.0;

const char *const kReads[] = {"!motion.states.wheel_difference",
                              "!motion.noise.adapt",
                              "motion.",
                              "!sightings.use.elevation",
                              "!sightings.noise.map_min",
                              "!sightings.states.tilt",
                              "!sightings.states.map_slots",
                              "sightings.",
                              "positions.",
                              "markers.",
                              "localizer.",
                              nullptr};

// Markers' errors take two states: along the line of sight, and of the heading.
correlated_slot error_slot_of(const wm_setup &setup) {
  correlated_slot out = correlated_slot_of(*setup.sightings);
  if (setup.sightings->correlated_slots > 0 && marker_params_of(setup).correlated > 0.0) out.width = 2;
  return out;
}

joint_state::wheel_slip slip_of(const wm_slam_params &p) { return {p.wheel_slip_sigma, p.wheel_slip_tau_s}; }

int states_that_last(const wm_slam_params &p, const wm_setup &setup) {
  return kPoseStates + joint_state::count_motion_states(setup.motion->states, setup.motion->model, slip_of(p)) +
         sensor_slots::count(setup);
}

int states_before_clones(const wm_slam_params &p, const wm_setup &setup) {
  return states_that_last(p, setup) + (p.sensor_stamp_sigma_s > 0.0) * (int)setup.sensor_count +
         setup.sightings->correlated_slots * error_slot_of(setup).width + position_aid::count_states(setup) +
         localizer_aid::count_states(setup);
}

// Azimuth and inverse distance of a ray, of which there are as many as clones.
int states_of_ray(const wm_slam_params &p) { return p.line_method == WM_SLAM_LINE_INVERSE_DISTANCE ? 2 : 0; }

// As many as lines.clones allows and the robot's states have room for.
int clones_of(const wm_slam_params &p, const wm_setup &setup) {
  const int room = (joint_state::kMaxRobot - states_before_clones(p, setup)) / (states_of_ray(p) + 3);
  return p.line_clones < room ? p.line_clones : room;
}

// With clones, and with headings of landmarks, or without.
joint_layout layout_of(const wm_slam_params &p, const wm_setup &setup, bool lines, bool headings) {
  joint_layout out{};
  out.clones = lines ? clones_of(p, setup) : 0;
  out.first_clone = states_before_clones(p, setup) + states_of_ray(p) * out.clones;
  out.robot_states = out.first_clone + 3 * out.clones;
  out.landmark_width = headings ? 3 : 2;
  out.landmarks = p.landmark_capacity;
  out.invariant = p.consistency == WM_SLAM_INVARIANT;
  return out;
}

// The same with room for what grows during the drive.
joint_layout first_layout(const wm_slam_params &p, const wm_setup &setup, bool headings) {
  const joint_layout most = layout_of(p, setup, true, true);
  joint_layout out = layout_of(p, setup, false, headings);
  out.capacity = even(most.robot_states) + most.landmarks * most.landmark_width;
  return out;
}

bool map_has_headings(const wm_slam_params &p, const wm_setup &setup) {
  for (size_t i = 0; p.map != WM_SLAM_MAP_NONE && i < setup.landmark_count; i++)
    if (finite(setup.landmarks[i].yaw_rad)) return true;
  return false;
}

}  // namespace

landmark_note note_of(int32_t id, int sensor, wm_time_ns t_ns) {
  landmark_note out{};
  out.id = id;
  out.first_ns = out.last_ns = t_ns;
  out.sensor = sensor;
  out.tilt_sensor = -1;
  out.deferred_ns = WM_TIME_NONE;
  out.apart_from = -1;
  return out;
}

int slam::lasting_states(const wm_slam_params &params, const wm_setup &setup) {
  return states_that_last(params, setup);
}

slam::arrays slam::place(memory_layout *out, const wm_slam_params &params, const wm_setup &setup) {
  return {out->take<landmark_note>(static_cast<size_t>(params.landmark_capacity)),
          out->take<double>(joint_state::doubles(first_layout(params, setup, false)))};
}

size_t slam::bytes(const wm_slam_params &params, const wm_setup &setup, const char **why) {
  if (setup.sensor_count > kSlamSensors) {
    *why = "slam takes at most 8 sensors";
    return 0;
  }
  if (states_before_clones(params, setup) > joint_state::kMaxRobot) {
    *why =
        "slam holds at most 192 states beside the landmarks: pose 3, one for each states.*_sigma that is not 0 (those "
        "of sensors once for each sensor), one or two for each of sightings.correlated.slots; lower that";
    return 0;
  }
  if (params.map != WM_SLAM_MAP_NONE && setup.landmark_count > static_cast<size_t>(params.landmark_capacity)) {
    *why = "landmarks.csv has more landmarks than landmarks.capacity; raise it";
    return 0;
  }
  memory_layout layout(nullptr, sizeof(slam));
  place(&layout, params, setup);
  return layout.bytes();
}

void slam::init(const wm_slam_params &params, const wm_setup &setup) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  setup_ = &setup;
  params_ = params;
  memory_layout memory(this, sizeof *this);
  const arrays behind = place(&memory, params, setup);
  notes_.set(behind.notes);
  std::memset(static_cast<void *>(behind.notes), 0,
              static_cast<size_t>(params.landmark_capacity) * sizeof(landmark_note));
  const joint_layout layout = first_layout(params, setup, map_has_headings(params, setup));
  joint_.init(setup, layout, behind.joint);
  first_ray_ = first_clone_ = layout.first_clone;
  rejoins_ = params.line_rejoin == WM_SLAM_REJOIN_ON;
  int next = kPoseStates;
  joint_.set_motion_states(setup.motion->states, setup.motion->model, slip_of(params), next);
  next += joint_state::count_motion_states(setup.motion->states, setup.motion->model, slip_of(params));
  for (size_t i = 0; i < setup.sensor_count; i++) sensor_[i].init(setup.sensors[i]);
  slots_.init(setup, params.map != WM_SLAM_MAP_NONE,
              [&](double value, double sigma, double walk, double low, double high) {
                joint_.begin_sensor_state(next, value, sigma, walk, low, high);
                return next++;
              });
  components_ = sightings().states.sigma[WM_SENSOR_ROW_kAngleScale] > 0.0 ? kAngleScaled : 0u;
  rollback_.begin(joint_, kPoseStates, next);
  for (int i = 0; i < kSlamSensors; i++) {
    const bool on = i < static_cast<int>(setup.sensor_count) && params.sensor_stamp_sigma_s > 0.0;
    stamp_state_[i] = on ? next++ : -1;  // its variance is set with each picture
    picture_ns_[i] = WM_TIME_NONE;
    bloom_px_[i] = std::nan("");
  }
  error_ = error_slot_of(setup);
  for (int i = 0; i < sightings().correlated_slots && error_.width > 0; i++, next += error_.width) errors_.add(next);
  markers_ = marker_params_of(setup);
  positions_.init(setup, &joint_, [&next](double, double) { return next++; });
  localizer_.init(setup, &joint_, [&next](double, double) { return next++; });
  follow_scale();
  life_ = {};
  start_again();
}

// The default's scale of ranges acts from the first range on whose sigma is not complete. A marker has a printed size,
// and complete sigmas are of a calibrated sensor: these are standards of length, at the neutral scale.
void slam::note_range(int sensor, bool is_standard) {
  const unsigned bit = 1u << sensor;
  const int slot = slots_.at(sensor, kRangeScale);
  const unsigned before = standards_ | scaled_;
  if (before & (is_standard ? standards_ & bit : bit)) return;
  if (slot < 0 || !slots_.is_by_default(kRangeScale) || params_.map != WM_SLAM_MAP_NONE) return;
  if (is_standard) {
    standards_ |= bit;
    scaled_ &= ~bit;
    joint_.forget(slot, 1.0, 0.0);
  } else {
    scaled_ |= bit;
  }
  follow_scale();
}

// A calibrated sensor is nearly as stated. Taken as exact, a yaw that is 3 degrees off would bend the whole map.
void slam::note_calibrated(int sensor, unsigned exact) {
  const auto narrow = [&](int state, double sigma) {
    const int slot = slots_.at(sensor, state, exact);
    if (slot < 0 || !slots_.is_by_default(state)) return;
    const double start = absolute_sigma(sightings().states.sigma[kSensorStateSpecs[state].row], 1.0);
    if (joint_.variance(slot) >= square(start)) joint_.forget(slot, 0.0, square(sigma));
  };
  narrow(kYaw, kCalibratedYaw_rad);
  narrow(kTimeOffset, kCalibratedOffset_s);
}

// Whether lengths are measured by a scale that is no state. A default's scale that no range has used yet is none.
bool slam::has_standard() const {
  bool is_scaled = false;
  for (int i = 0; i < static_cast<int>(setup_->sensor_count); i++) {
    const bool by_default = slots_.is_by_default(kRangeScale);
    if (slots_.at(i, kRangeScale) < 0 || (standards_ >> i & 1u)) return true;
    is_scaled |= !by_default || (scaled_ >> i & 1u);
  }
  return !is_scaled;
}

// The map's scale is unobservable where the way's scale and the ranges' are both states, or no ranges come. With
// markers, far more accurate than wheels, the filter hardly gains false certainty, so the covariance is not
// transported from the first one on.
void slam::follow_scale() {
  joint_.leave_scale();
  const bool by_positions = is_placed_ && (positions_.has_position() || localizer_.places());
  const bool is_observed = by_positions || (!by_bearings_ && sightings().use_range && has_standard());
  if (is_observed || params_.map != WM_SLAM_MAP_NONE || !joint_.find_scale(!has_headings())) return;
  for (int i = 0; i < static_cast<int>(setup_->sensor_count); i++) {
    const bool is_scaled = !slots_.is_by_default(kRangeScale) || (scaled_ >> i & 1u);
    if (is_scaled) joint_.follow_scale(slots_.at(i, kRangeScale), -1.0, true);
    joint_.follow_scale(slots_.at(i, kMountX), 1.0, false);
    joint_.follow_scale(slots_.at(i, kMountY), 1.0, false);
  }
  for (int k = first_ray_; k < first_clone_; k += 2) joint_.follow_scale(k + 1, -1.0, false);
}

// The first marker: from now on landmarks have a heading, too.
void slam::take_headings() {
  if (has_headings()) return;
  joint_layout to = joint_.layout();
  to.landmark_width = 3;
  joint_.grow(to);
  joint_.carry_scale_no_more();
}

// The first bearing without a range: from now on there are clones, which landmarks wait in. Identities are taken for
// numbers of a tracker until two come back (note_return); those of a given map are not.
void slam::take_lines() {
  if (has_lines() || clones_of(params_, *setup_) == 0 || params_.map == WM_SLAM_MAP_FROZEN) return;
  joint_layout to = layout_of(params_, *setup_, true, has_headings());
  to.capacity = joint_.layout().capacity;
  joint_.grow(to);
  first_clone_ = to.first_clone;
  by_bearings_ |= joint_.landmarks() == 0;
  follow_scale();
  if (params_.line_rejoin == WM_SLAM_REJOIN_AUTO) rejoins_ = params_.map == WM_SLAM_MAP_NONE && returned_ < kReturned;
  forget_tracks();
}

// An identity that was out of sight and is seen again is the landmark's own, not a tracker's.
void slam::note_return(double unseen_s) {
  if (unseen_s < kUnseen_s || params_.line_rejoin != WM_SLAM_REJOIN_AUTO) return;
  if (++returned_ == kReturned) rejoins_ = false;
}

// The map's frame is that of the start pose, unless a start or a map is given.
void slam::start_again() {
  const wm_start &start = setup_->start;
  const bool place = finite(start.p_m[0]) && finite(start.p_m[1]), heading = finite(start.heading_rad);
  const double stated_m = finite(start.sigma_xy_m) ? start.sigma_xy_m : kStart_m;
  const double stated_rad = finite(start.sigma_heading_rad) ? start.sigma_heading_rad : kStart_rad;
  const double xy = square(place ? stated_m : kOwnFrame_m), turn = square(heading ? stated_rad : kOwnFrame_rad);
  const double covariance[3][3] = {{xy, 0, 0}, {0, xy, 0}, {0, 0, turn}};
  while (joint_.landmarks() > 0) joint_.remove_landmark(joint_.landmarks() - 1);
  joint_.set_pose({place ? start.p_m[0] : 0.0, place ? start.p_m[1] : 0.0, heading ? start.heading_rad : 0.0},
                  covariance);
  begin_frame();
  localizer_.release();
  forget_lines();
  errors_.release_all();
  next_id_ = members_ = 0;
  cursor_ = 0;
  for (int i = 0; i < 2; i++) {
    other_fused_ns_[i] = WM_TIME_NONE;
    other_fused_id_[i] = -1;
  }
  slips_.begin();
  moved_.clear();
  ambiguous_.clear();
  outliers_ = {};
  outliers_.t_ns = WM_TIME_NONE;
  const bool given = params_.map != WM_SLAM_MAP_NONE;
  life_.begin(!given || !params_.recover || (place && heading));
  begin_evidence(given ? kStartWrong : kOwnFramePrior);
  bearings_.count = 0;
  usual_share_ = 0.0;
  by_one_ = one_refuted_ = by_slip_ = false;
  if (given) load_map();
}

namespace {

// The variance that all headings share is that of the map's own axes, which is no error on the map.
double common_yaw_variance(const wm_setup &setup) {
  double least = square(kPi);
  for (size_t i = 0; i < setup.landmark_count; i++)
    if (const double variance = square(setup.landmarks[i].yaw_sigma_rad); variance < least) least = variance;
  return least;
}

}  // namespace

void slam::load_map() {
  const double common = common_yaw_variance(*setup_);
  for (size_t i = 0; i < setup_->landmark_count; i++) {
    const wm_landmark &l = setup_->landmarks[i];
    if (!finite(l.p_m[0]) || !finite(l.p_m[1])) continue;
    const double least = square(kSurveyed_m);
    double xx = larger(square(finite(l.sigma_m) ? l.sigma_m : 0.0), least), xy = 0.0, yy = xx;
    const double *c = l.cov_m2;
    if (c[0] > 0.0 && c[2] > 0.0 && square(c[1]) < c[0] * c[2] && finite(c[0] + c[2])) {
      xx = c[0] + least;
      xy = c[1];
      yy = c[2] + least;
    }
    const bool turned = finite(l.yaw_rad), sure = l.yaw_sigma_rad > 0.0 && l.yaw_sigma_rad < kPi;
    const double turn = !turned ? square(kPi) : square(kSurveyed_rad) + (sure ? square(l.yaw_sigma_rad) - common : 0.0);
    const double noise[3][3] = {{xx, xy, 0}, {xy, yy, 0}, {0, 0, turn}};
    const double place[3] = {l.p_m[0], l.p_m[1], turned ? wrap(l.yaw_rad) : 0.0};
    const joint_row rows[3] = {};
    const int landmark = joint_.add_landmark(rows, noise, place);
    note(landmark) = note_of(l.id, -1, WM_TIME_NONE);
    note(landmark).z_m = l.p_m[2];
    note(landmark).surveyed = 1;
  }
}

wm_status slam::predict(const wm_event &motion) {
  const wm_status status = joint_.check_motion(motion);
  if (status != WM_OK) return status;
  const int scaled_by = joint_.way_scale();
  const double heading_rad2 = joint_.variance(kHeading);
  if (joint_.move(motion)) slots_.begin_lag(*setup_, &joint_);
  // Beyond that a correction's linearization is wrong: the pose is to be found in the map.
  if (params_.recover && life_.tracking() && joint_.variance(kHeading) > heading_rad2 + kUnknownHeading_rad2) lose();
  if (joint_.way_scale() != scaled_by) follow_scale();
  return status;
}

wm_status slam::correct(const wm_event &event, record_list records) {
  switch (event.kind) {
    case WM_EVENT_SIGHTING: return fuse_sighting(event, records);
    case WM_EVENT_MARKER: return fuse_marker(event, records);
    case WM_EVENT_POSITION: return fuse_position(event, records);
    case WM_EVENT_HEADING: return fuse_heading(event, records);
    case WM_EVENT_LOCALIZED: return fuse_localized(event, records);
    case WM_EVENT_SET_POSE:
    case WM_EVENT_RESET: return take_pose(event);
    case WM_EVENT_LOOKED: {
      const wm_status status = joint_.check_time(event.t_ns);
      if (status == WM_OK) joint_.move_to(event.t_ns);
      return status;
    }
    default: return WM_UNSUPPORTED;
  }
}

// RESET begins a new map. SET_POSE moves the robot within this one.
wm_status slam::take_pose(const wm_event &event) {
  const bool reset = event.kind == WM_EVENT_RESET;
  given_pose given;
  wm_status status = reset ? WM_OK : read_set_pose(event, &given);
  if (status == WM_OK) status = joint_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  joint_.move_to(event.t_ns);
  if (reset) {
    start_again();
    return WM_OK;
  }
  const double xy = square(given.sigma_xy_m);
  const double covariance[3][3] = {{xy, 0, 0}, {0, xy, 0}, {0, 0, square(given.sigma_heading_rad)}};
  joint_.set_pose(given.pose, covariance);
  localizer_.release();
  forget_tracks();
  life_.begin(true);
  begin_evidence(kStartWrong);
  by_one_ = by_slip_ = false;
  slips_.begin();
  return WM_OK;
}

void slam::estimate(wm_estimate *out) const {
  joint_.estimate(out);
  out->resets = life_.resets();
  out->state = life_.state(joint_.now_ns(), params_.dead_reckoning_after_s);
  if (is_frame_unknown() && life_.tracking()) out->state = WM_STATE_SEARCHING;
  out->lost_probability = out->state == WM_STATE_SEARCHING ? 1.0
                          : rejoins_                       ? pattern_odds_.probability()
                                                           : evidence_.probability();
  if (!life_.tracking()) widen(out);
}

void slam::list_calibration(calibration_list *list) const {
  static_assert(kMaxSensors * kSensorStates <= kMaxSensorStates);
  // Motion, means of the wheels' scales; of each sensor its states and the bloom.
  static_assert(kMotionStates + 2 + kMaxSensors * (kSensorStates + 1) <= 2 * WM_HEALTH_CALIBRATION_MAX);
  joint_.list_motion_states(list);
  slots_.list(*setup_, joint_, list);
  if (positions_.is_awake()) positions_.list(joint_, list);
  localizer_.list(list);
  for (size_t i = 0; i < setup_->sensor_count; i++)
    if (finite(bloom_px_[i])) list->add(setup_->sensors[i].name, "bloom_px", bloom_px_[i], std::nan(""));
}

size_t slam::list_counters(wm_counter *out, size_t capacity) const {
  counter_list list(out, capacity);
  list.add(WM_COUNTER_LANDMARKS, static_cast<uint64_t>(joint_.landmarks() - members_));
  list.add(WM_COUNTER_LANDMARKS_ADDED, counts_.joined);
  list.add(WM_COUNTER_LANDMARKS_REMOVED, counts_.left);
  list.add(WM_COUNTER_LANDMARKS_MOVED, counts_.moved, moved_.last);
  list.add(WM_COUNTER_IDENTITIES_AMBIGUOUS, counts_.ambiguous, ambiguous_.last);
  list.add(WM_COUNTER_ROTATION_OUTLIERS, counts_.rotation_outliers);
  if (rejoins_ || counts_.merged > 0) list.add(WM_COUNTER_LANDMARKS_MERGED, counts_.merged);
  list.add(WM_COUNTER_MAP_FULL, counts_.no_room);
  list.add(WM_COUNTER_MOTION_OUTLIERS, joint_.motion_outliers());
  list.add(WM_COUNTER_RELOCALIZATIONS, life_.relocalizations());
  return list.count();
}

size_t slam::list_landmarks(wm_landmark *out, double (*covariance)[4], size_t capacity) const {
  size_t count = 0;
  for (int i = 0; i < joint_.landmarks(); i++) {
    if (!is_confirmed(note(i))) continue;
    if (count < capacity) {
      const int s = joint_.landmark_state(i);
      const double xx = joint_.variance(s), xy = joint_.covariance(s, s + 1), yy = joint_.variance(s + 1);
      const double largest = 0.5 * (xx + yy) + std::sqrt(square(0.5 * (xx - yy)) + square(xy));
      const double turn = has_headings() ? joint_.variance(s + 2) : std::nan("");
      out[count] = {.id = note(i).id,
                    .p_m = {joint_.value(s), joint_.value(s + 1), note(i).z_m},
                    .sigma_m = std::sqrt(largest),
                    .yaw_rad = has_headings() ? joint_.value(s + 2) : std::nan(""),
                    .cov_m2 = {xx, xy, yy},
                    .yaw_sigma_rad = std::sqrt(turn)};
      if (covariance) {
        const double c[4] = {xx, xy, yy, turn};
        std::memcpy(covariance[count], c, sizeof c);
      }
    }
    count++;
  }
  return count;
}

// ---- landmarks ----

// Of an observation: predicts to its stamp.
wm_status slam::begin_observation(wm_time_ns t_ns) {
  const wm_status status = joint_.check_time(t_ns);
  if (status != WM_OK) return status;
  joint_.move_to(t_ns);
  if (is_kept_) age_kept(t_ns);
  end_picture(t_ns);
  end_doubt();
  maintain_map(t_ns);
  return WM_OK;
}

// In map; without markers there is no heading.
wm_pose2 slam::pose_of(int landmark) const {
  const int state = joint_.landmark_state(landmark);
  return {joint_.value(state), joint_.value(state + 1), has_headings() ? joint_.value(state + 2) : 0.0};
}

int slam::find_landmark(int32_t id) const {
  for (int i = 0; i < joint_.landmarks(); i++)
    if (note(i).id == id && !is_member(note(i))) return i;
  return -1;
}

// An identity for a landmark that was observed without one.
int32_t slam::own_id() {
  while (find_landmark(next_id_) >= 0) next_id_++;
  return next_id_++;
}

void slam::drop_landmark(int landmark) {
  const bool member = is_member(note(landmark));
  joint_.remove_landmark(landmark);
  note(landmark) = note(joint_.landmarks());
  if (member)
    members_--;
  else
    counts_.left++;
}

// Room for one more: the unconfirmed landmark that was not seen for longest leaves. False: all are confirmed.
bool slam::make_room() {
  if (joint_.landmarks() < joint_.landmark_capacity()) return true;
  int oldest = -1;
  for (int i = 0; i < joint_.landmarks(); i++)
    if (!is_confirmed(note(i)) && !is_member(note(i)) && (oldest < 0 || note(i).last_ns < note(oldest).last_ns))
      oldest = i;
  if (oldest < 0) {
    counts_.no_room++;
    return false;
  }
  drop_landmark(oldest);
  return true;
}

// One landmark at a time, so that the cost stays bounded.
void slam::maintain_map(wm_time_ns t_ns) {
  if (joint_.landmarks() == 0 || params_.map == WM_SLAM_MAP_FROZEN || map_is_held()) return;
  cursor_ = (cursor_ + 1) % joint_.landmarks();
  if (is_member(note(cursor_))) return;
  find_double(cursor_);
  const landmark_note &n = note(cursor_);
  // A tracker's number does not come back: a line that was seen too rarely to be merged is never found again.
  const bool is_kept = is_seen_enough(n) && !n.is_double && (!rejoins_ || n.surveyed || n.seen >= kMergeSeen);
  if (!is_kept && wm_seconds_between(n.last_ns, t_ns) > params_.leave_after_s)
    drop_landmark(cursor_);
  else if (rejoins_)
    merge_if_one(cursor_);
}

int slam::note_landmark(int32_t id, int landmark, int sensor) {
  note(landmark) = note_of(id, sensor, joint_.now_ns());
  note(landmark).seen = 1;
  note(landmark).first_view = joint_.odom();
  counts_.joined++;
  return landmark;
}

}  // namespace wm

const wm_estimator wm_slam_estimator = wm::estimator_of<wm::slam, wm_slam_params>(
    "slam",
    "EKF-SLAM in the plane, right-invariant: the robot, its sensors' errors and landmarks at unknown places, "
    "from coded markers, bearings and ranges, or bearings alone, with or without identities; with positions and "
    "headings.",
    WM_EVENT_BIT(WM_EVENT_SIGHTING) | WM_EVENT_BIT(WM_EVENT_MARKER) | WM_EVENT_BIT(WM_EVENT_POSITION) |
        WM_EVENT_BIT(WM_EVENT_HEADING) | WM_EVENT_BIT(WM_EVENT_LOCALIZED) | WM_EVENT_BIT(WM_EVENT_LOOKED) |
        WM_EVENT_BIT(WM_EVENT_SET_POSE) | WM_EVENT_BIT(WM_EVENT_RESET),
    wm_slam_params_table, wm::kReads);
