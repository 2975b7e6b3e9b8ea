// SPDX-License-Identifier: Apache-2.0
// SLAM's start, its poses from outside, its landmarks' coming and going, and the contract.
#include "filters/slam/slam.hpp"

#include <cstring>
#include <limits>

#include "filters/core/contract.hpp"
#include "filters/planar/set_pose.hpp"
#include "filters/registry.h"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kOwnFrame_m = 1e-3, kOwnFrame_rad = 1e-3;  // the map begins where the robot starts
constexpr double kSurveyed_m = 1e-4, kSurveyed_rad = 0.01;  // no map is better; headings come without a sigma
const double kAbsent = std::numeric_limits<double>::quiet_NaN();

landmark_note note_of(int32_t id, int sensor, wm_time_ns t_ns) {
  landmark_note out{};
  out.id = id;
  out.first_ns = out.last_ns = t_ns;
  out.sensor = sensor;
  out.levelled_by = -1;
  out.doubted_ns = WM_TIME_NONE;
  return out;
}

int lasting_states(const wm_slam_params &p) {
  if (p.lasting_slots == 0) return 0;
  if (p.markers && p.marker_lasting > 0.0) return 2;
  return (p.lasting_bearing_rad > 0.0 || p.lasting_lateral_m > 0.0) +
         (p.lasting_range_m > 0.0 || p.lasting_range_rel > 0.0);
}

joint_state::wheel_slip slip_of(const wm_slam_params &p) { return {p.wheel_slip_sigma, p.wheel_slip_tau_s}; }

int states_before_clones(const wm_slam_params &p, const wm_setup &setup) {
  return kPoseStates + joint_state::count_motion_states(p.motion, slip_of(p)) +
         sensor_slots::count(p.sensor_states, setup.sensor_count) +
         (p.sensor_stamp_sigma_s > 0.0) * (int)setup.sensor_count + p.lasting_slots * lasting_states(p);
}

// Azimuth and inverse distance for each ray, of which there are as many as clones.
int ray_states(const wm_slam_params &p) {
  return p.line_method == WM_SLAM_LINE_INVERSE_DISTANCE ? 2 * p.line_clones : 0;
}

joint_layout layout_of(const wm_slam_params &p, const wm_setup &setup) {
  joint_layout out{};
  out.first_clone = states_before_clones(p, setup) + ray_states(p);
  out.clones = p.line_clones;
  out.robot_states = out.first_clone + 3 * p.line_clones;
  out.landmark_width = p.markers ? 3 : 2;
  out.landmarks = p.landmark_capacity;
  out.invariant = p.consistency == WM_SLAM_INVARIANT;
  return out;
}

size_t aligned(size_t bytes) { return (bytes + 15) / 16 * 16; }

size_t arrays_at(const wm_slam_params &p) {
  return aligned(sizeof(slam) + (size_t)p.landmark_capacity * sizeof(landmark_note));
}

}  // namespace

size_t slam::bytes(const wm_slam_params &params, const wm_setup &setup, const char **why) {
  if (setup.sensor_count > kSlamSensors) {
    *why = "slam takes at most 8 sensors";
    return 0;
  }
  const joint_layout layout = layout_of(params, setup);
  if (layout.robot_states > joint_state::kMaxRobot) {
    *why =
        "slam holds at most 192 states beside the landmarks: pose 3, one for each states.*_sigma that is not 0 (those "
        "of sensors once for each sensor), one or two for each of lasting.slots, three for each of lines.clones; lower "
        "lasting.slots or lines.clones";
    return 0;
  }
  if (params.map != WM_SLAM_MAP_NONE && setup.landmark_count > (size_t)params.landmark_capacity) {
    *why = "landmarks.csv has more landmarks than landmarks.capacity; raise it";
    return 0;
  }
  return arrays_at(params) + joint_state::doubles(layout) * sizeof(double);
}

void slam::init(const wm_slam_params &params, const wm_setup &setup) {
  std::memset(static_cast<void *>(this), 0, arrays_at(params));
  for (double &shift_px : edge_shift_px_) shift_px = kAbsent;
  setup_ = &setup;
  params_ = params;
  const joint_layout layout = layout_of(params, setup);
  joint_.init(setup, layout, reinterpret_cast<double *>(reinterpret_cast<char *>(this) + arrays_at(params)));
  first_clone_ = layout.first_clone;
  first_ray_ = first_clone_ - ray_states(params);
  int next = kPoseStates;
  joint_.set_motion_states(params.motion, slip_of(params), next);
  next += joint_state::count_motion_states(params.motion, slip_of(params));
  const auto add = [&](double value, double sigma) {
    if (!(sigma > 0.0)) return -1;
    joint_.forget(next, value, square(sigma));
    return next++;
  };
  for (size_t i = 0; i < setup.sensor_count; i++) sensor_[i].init(setup.sensors[i]);
  slots_.init(params.sensor_states, setup.sensor_count,
              [&](double value, double sigma, double walk, double low, double high) {
                joint_.begin_sensor_state(next, value, sigma, walk, low, high);
                return next++;
              });
  components_ = params.sensor_states.sigma[WM_SENSOR_ROW_kAngleScale] > 0.0 ? kAngleScaled : 0u;
  for (size_t i = 0; i < kSlamSensors; i++) {
    stamp_state_[i] = i < setup.sensor_count ? add(0.0, params.sensor_stamp_sigma_s) : -1;
    picture_ns_[i] = WM_TIME_NONE;
  }
  lasting_bearing_offset_ = params.lasting_bearing_rad > 0.0 || params.lasting_lateral_m > 0.0 ? 0 : -1;
  lasting_range_offset_ =
      params.lasting_range_m > 0.0 || params.lasting_range_rel > 0.0 ? (lasting_bearing_offset_ >= 0 ? 1 : 0) : -1;
  lasting_width_ = lasting_states(params);
  lasting_.clear();
  for (int i = 0; i < params.lasting_slots && lasting_width_ > 0; i++) {
    lasting_.add(next);
    for (int k = 0; k < lasting_width_; k++) add(0.0, 1.0);
  }
  follow_scale();
  start_again();
}

// Nothing measures how large the map is where the way's scale and the ranges' are both states, or no ranges are used.
// Prints are known so much better than wheels that a filter learns next to nothing where it should learn nothing.
void slam::follow_scale() {
  const bool ranges_tell = params_.use_range && !(params_.sensor_states.sigma[WM_SENSOR_ROW_kRangeScale] > 0.0);
  if (ranges_tell || params_.map != WM_SLAM_MAP_NONE || !joint_.find_scale(!params_.markers)) return;
  for (int i = 0; i < static_cast<int>(setup_->sensor_count); i++) {
    joint_.follow_scale(slots_.at(i, kRangeScale), -1.0, true);
    joint_.follow_scale(slots_.at(i, kMountX), 1.0, false);
    joint_.follow_scale(slots_.at(i, kMountY), 1.0, false);
  }
  for (int k = first_ray_; k < first_clone_; k += 2) joint_.follow_scale(k + 1, -1.0, false);
}

// The map begins where the robot starts, unless a start or a map says otherwise.
void slam::start_again() {
  const wm_start &start = setup_->start;
  const bool place = finite(start.p_m[0]) && finite(start.p_m[1]), heading = finite(start.heading_rad);
  const double sigma_xy = place ? (finite(start.sigma_xy_m) ? start.sigma_xy_m : 0.05) : kOwnFrame_m;
  const double sigma_heading =
      heading ? (finite(start.sigma_heading_rad) ? start.sigma_heading_rad : 0.05) : kOwnFrame_rad;
  while (joint_.landmarks() > 0) joint_.remove_landmark(joint_.landmarks() - 1);
  const double xy = square(sigma_xy);
  const double covariance[3][3] = {{xy, 0, 0}, {0, xy, 0}, {0, 0, square(sigma_heading)}};
  joint_.set_pose({place ? start.p_m[0] : 0.0, place ? start.p_m[1] : 0.0, heading ? start.heading_rad : 0.0},
                  covariance);
  forget_lines();
  lasting_.release_all();
  fused_ns_ = WM_TIME_NONE;
  next_id_ = 0;
  cursor_ = 0;
  for (int i = 0; i < 2; i++) {
    other_fused_ns_[i] = WM_TIME_NONE;
    other_fused_id_[i] = -1;
  }
  moved_.count = doubled_.count = 0;
  look_.t_ns = WM_TIME_NONE;
  look_.fused = look_.refused = look_.before = 0;
  resets_++;
  const bool given = params_.map != WM_SLAM_MAP_NONE;
  state_ = given && params_.recover && !(place && heading) ? WM_STATE_SEARCHING : WM_STATE_TRACKING;
  begin_evidence(!given);
  bearings_.count = 0;
  usual_share_ = 0.0;
  searched_ns_ = WM_TIME_NONE;
  candidate_.id = lone_.id = rests_on_ = -1;
  one_refuted_ = false;
  if (given) load_map();
}

void slam::forget_lines() {
  for (int state = first_ray_; state < first_clone_ + 3 * params_.line_clones; state++) joint_.forget(state, 0.0, 0.0);
  forget_tracks();
}

void slam::forget_tracks() {
  const bool rays = params_.line_method == WM_SLAM_LINE_INVERSE_DISTANCE;
  tracks_.clear(params_.line_clones, rays ? params_.line_clones : bearing_tracks::kTracks);
}

namespace {

// What all landmarks are unsure of alike is where the map's own axes lie, which is no error on the map.
double common_yaw_variance(const wm_setup &setup) {
  double least = square(kPi);
  for (size_t i = 0; i < setup.landmark_count; i++) {
    const double variance = square(setup.landmarks[i].yaw_sigma_rad);
    if (variance < least) least = variance;
  }
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
    notes()[landmark] = note_of(l.id, -1, WM_TIME_NONE);
    notes()[landmark].z_m = l.p_m[2];
    notes()[landmark].surveyed = 1;
  }
}

wm_status slam::predict(const wm_event &motion) {
  const wm_status status = joint_.check_motion(motion);
  if (status == WM_OK) joint_.move(motion);
  return status;
}

wm_status slam::correct(const wm_event &event, record_list records) {
  switch (event.kind) {
    case WM_EVENT_SIGHTING: return fuse_sighting(event, records);
    case WM_EVENT_MARKER: return fuse_marker(event, records);
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
  if (event.kind == WM_EVENT_RESET) {
    const wm_status status = joint_.check_time(event.t_ns);
    if (status != WM_OK) return status;
    joint_.move_to(event.t_ns);
    start_again();
    return WM_OK;
  }
  given_pose given;
  wm_status status = read_set_pose(event, &given);
  if (status == WM_OK) status = joint_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  joint_.move_to(event.t_ns);
  const double xy = square(given.sigma_xy_m);
  const double covariance[3][3] = {{xy, 0, 0}, {0, xy, 0}, {0, 0, square(given.sigma_heading_rad)}};
  joint_.set_pose(given.pose, covariance);
  forget_tracks();
  state_ = WM_STATE_TRACKING;
  begin_evidence(false);
  rests_on_ = -1;
  resets_++;
  return WM_OK;
}

void slam::estimate(wm_estimate *out) const {
  joint_.estimate(out);
  out->resets = resets_;
  const bool fresh =
      fused_ns_ != WM_TIME_NONE && wm_seconds_between(fused_ns_, joint_.now_ns()) <= params_.dead_reckoning_after_s;
  out->state = (uint8_t)(state_ != WM_STATE_TRACKING ? state_ : fresh ? WM_STATE_TRACKING : WM_STATE_DEAD_RECKONING);
  out->lost_probability = state_ == WM_STATE_SEARCHING ? 1.0
                          : params_.line_rejoin        ? pattern_odds_.probability()
                                                       : evidence_.probability();
  if (state_ != WM_STATE_TRACKING) widen(out);
}

size_t slam::list_calibration(wm_calibration_value *out, size_t capacity) const {
  calibration_list list(out, capacity);
  joint_.list_motion_states(&list);
  slots_.list(*setup_, joint_, &list);
  for (size_t i = 0; i < setup_->sensor_count; i++)
    if (finite(edge_shift_px_[i])) list.add(setup_->sensors[i].name, "edge_shift_px", edge_shift_px_[i], kAbsent);
  return list.count();
}

size_t slam::list_counters(wm_counter *out, size_t capacity) const {
  counter_list list(out, capacity);
  list.add(WM_COUNTER_LANDMARKS, (uint64_t)joint_.landmarks());
  list.add(WM_COUNTER_LANDMARKS_ADDED, counts_.joined);
  list.add(WM_COUNTER_LANDMARKS_REMOVED, counts_.left);
  list.add(WM_COUNTER_LANDMARKS_MOVED, counts_.moved);
  list.add(WM_COUNTER_IDENTITIES_AMBIGUOUS, counts_.doubled);
  list.add(WM_COUNTER_ROTATION_OUTLIERS, counts_.jolts);
  if (params_.line_rejoin) list.add(WM_COUNTER_LANDMARKS_MERGED, counts_.rejoined);
  list.add(WM_COUNTER_MAP_FULL, counts_.no_room);
  list.add(WM_COUNTER_MOTION_OUTLIERS, joint_.motion_outliers());
  list.add(WM_COUNTER_RELOCALIZATIONS, counts_.relocalized);
  return list.count();
}

size_t slam::list_landmarks(wm_landmark *out, double (*covariance)[4], size_t capacity) const {
  size_t count = 0;
  for (int i = 0; i < joint_.landmarks(); i++) {
    const landmark_note &note = notes()[i];
    if (!note.surveyed && note.seen < (uint32_t)params_.confirm_seen) continue;
    if (count < capacity) {
      const int s = joint_.landmark_state(i);
      const double xx = joint_.variance(s), xy = joint_.covariance(s, s + 1), yy = joint_.variance(s + 1);
      const double most = 0.5 * (xx + yy) + std::sqrt(square(0.5 * (xx - yy)) + square(xy));
      const double turn = params_.markers ? joint_.variance(s + 2) : kAbsent;
      out[count] = {note.id,         {joint_.value(s), joint_.value(s + 1), note.z_m},
                    std::sqrt(most), params_.markers ? joint_.value(s + 2) : kAbsent,
                    {xx, xy, yy},    params_.markers ? std::sqrt(turn) : 0.0};
      if (covariance) {
        const double c[4] = {xx, xy, yy, turn};
        std::memcpy(covariance[count], c, sizeof c);
      }
    }
    count++;
  }
  return count;
}

// ---- landmarks come and go ----

int slam::find_landmark(int32_t id) const {
  for (int i = 0; i < joint_.landmarks(); i++)
    if (notes()[i].id == id) return i;
  return -1;
}

int32_t slam::own_id() {
  while (find_landmark(next_id_) >= 0) next_id_++;
  return next_id_++;
}

void slam::drop_landmark(int landmark) {
  joint_.remove_landmark(landmark);
  notes()[landmark] = notes()[joint_.landmarks()];
  counts_.left++;
}

// Room for one more: the unconfirmed landmark that wasn't seen for longest leaves. False: all are confirmed.
bool slam::make_room() {
  if (joint_.landmarks() < joint_.landmark_capacity()) return true;
  int oldest = -1;
  for (int i = 0; i < joint_.landmarks(); i++) {
    const landmark_note &note = notes()[i];
    if (note.surveyed || note.seen >= (uint32_t)params_.confirm_seen) continue;
    if (oldest < 0 || note.last_ns < notes()[oldest].last_ns) oldest = i;
  }
  if (oldest < 0) {
    counts_.no_room++;
    return false;
  }
  drop_landmark(oldest);
  return true;
}

// One landmark at a time, so that the cost stays bounded.
void slam::look_after(wm_time_ns t_ns) {
  if (joint_.landmarks() == 0 || params_.map == WM_SLAM_MAP_FROZEN || map_is_held()) return;
  cursor_ = (cursor_ + 1) % joint_.landmarks();
  const landmark_note &note = notes()[cursor_];
  const bool unconfirmed = !note.surveyed && note.seen < (uint32_t)params_.confirm_seen;
  if (unconfirmed && wm_seconds_between(note.last_ns, t_ns) > params_.leave_after_s)
    drop_landmark(cursor_);
  else if (params_.line_rejoin)
    rejoin(cursor_);
}

int slam::note_landmark(int32_t id, int landmark, int sensor, wm_time_ns t_ns) {
  notes()[landmark] = note_of(id, sensor, t_ns);
  notes()[landmark].seen = 1;
  counts_.joined++;
  return landmark;
}

int slam::note_line(const bearing_tracks::track &track, int landmark) {
  note_landmark(track.id, landmark, track.sensor, joint_.now_ns());
  notes()[landmark].first_ns = track.first_ns;
  return landmark;
}

}  // namespace wm

const wm_estimator wm_slam_estimator = wm::estimator_of<wm::slam, wm_slam_params>(
    "slam",
    "EKF-SLAM in the plane, right-invariant: the robot, its sensors' errors and "
    "landmarks whose places nobody measured, "
    "from coded markers, bearings and ranges, or bearings alone, with or without identities.",
    WM_EVENT_BIT(WM_EVENT_SIGHTING) | WM_EVENT_BIT(WM_EVENT_MARKER) | WM_EVENT_BIT(WM_EVENT_LOOKED) |
        WM_EVENT_BIT(WM_EVENT_SET_POSE) | WM_EVENT_BIT(WM_EVENT_RESET),
    wm_slam_params_table);
