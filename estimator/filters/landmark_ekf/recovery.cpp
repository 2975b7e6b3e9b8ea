// SPDX-License-Identifier: Apache-2.0
// Lost and found: notices that observations keep contradicting the pose, says so, and mends it.
#include "filters/landmark_ekf/landmark_ekf.hpp"
#include "math/arc.hpp"
#include "math/elementary.hpp"

namespace wm {
namespace {

constexpr double kSearchEvery_s = 0.25;  // bounds the cost: one search over 64 observations is about half a millisecond
constexpr double kWeighEvery_s = 0.1;    // for the first metres after a start
constexpr double kSayLost_s = 0.2;       // lost is lost for at least so long: whoever listens must hear it
constexpr double kInflateAfter_s = 3.0;  // lost for so long and not found: open the gates
constexpr double kInflateEvery_s = 1.0;
constexpr double kFoundWrongly_s = 60.0;
constexpr double kRememberEvery_s = 10.0;
constexpr double kFoundWrong = -2.5;  // a pose found anew is wrong in one of twelve cases, as log odds
constexpr double kInflate_m = 0.5, kInflate_rad = 0.2;
constexpr double kInflateUpTo_m = 30.0;
constexpr int kNumbers = 5;           // two more than a pose has: three bearings fit some pose, whatever they say
constexpr int kNumbersElsewhere = 6;  // of a pose that contradicts the one that is tracked
constexpr double kLately_s = 2.0;
constexpr int kFewOf = 3;  // a pose that explains less than one in so many of them is not where they are seen
constexpr double kElsewhere_m = 0.5, kElsewhere_rad = 0.2;
constexpr int kPoseNumbers = 3;      // of a pose that says next to nothing
constexpr double kVague_rad = 0.5;   // sigma of a heading about which a Kalman update is no longer nearly straight
constexpr double kVaguePlace = 0.5;  // sigma of a place, in those of one anywhere among the landmarks: the same
constexpr double kVagueFor_s = 5.0;  // of looking for it; then it is corrected as well as can be

}  // namespace

void landmark_ekf::buffer_observation(const observation &seen) {
  if (!params_.recover) return;
  observation kept = seen;
  kept.travelled_m = filter_.travelled_m();
  kept.turned_rad = filter_.turned_rad();
  observations_.add(kept);
}

void landmark_ekf::note(wm_time_ns t_ns, int witness, double against, double angle_rad, double normalised) {
  if (!params_.recover) return;
  evidence_.note(t_ns, witness, against, angle_rad, normalised, witness >= 0 ? landmark_records() + witness : nullptr);
  if (witness >= 0) tell_moved(witness);
  if (state_ == WM_STATE_TRACKING) {
    const wm_time_ns since = elsewhere_since(t_ns);
    if (since != WM_TIME_NONE) evidence_.contradict(since);
  }
  if (state_ == WM_STATE_TRACKING && evidence_.contradicted()) {
    state_ = WM_STATE_LOST;
    lost_ns_ = inflated_ns_ = t_ns;
  }
  weigh_start(t_ns);
  if (state_ == WM_STATE_TRACKING && evidence_.fits()) remember_calibration(t_ns);
  if (state_ != WM_STATE_LOST) return;
  if (evidence_.fits()) {
    state_ = WM_STATE_TRACKING;
    return;
  }
  if (wm_seconds_between(lost_ns_, t_ns) < kSayLost_s) return;
  const wm_time_ns window = t_ns - wm_ns_from_seconds(params_.recover_window_s);
  const wm_time_ns bad_since = evidence_.doubted_since_ns();
  search(bad_since > window ? bad_since : window, prior_, prior_count_);
  if (state_ != WM_STATE_LOST || wm_seconds_between(lost_ns_, t_ns) < kInflateAfter_s) return;
  if (wm_seconds_between(inflated_ns_, t_ns) >= kInflateEvery_s && filter_.variance(kX) < square(kInflateUpTo_m)) {
    filter_.inflate_pose(square(kInflate_m), square(kInflate_rad));
    inflated_ns_ = t_ns;
  }
}

// Does another pose explain what was seen lately, and this one next to nothing of it? Then it was carried off, however
// well all fitted before; false detections and moved landmarks don't agree on a pose. Lately is since the last fit, or
// kLately_s: some fit by chance, the more so where a detector looks where the pose says. None: WM_TIME_NONE.
wm_time_ns landmark_ekf::elsewhere_since(wm_time_ns t_ns) {
  if (searched_ns_ != WM_TIME_NONE && wm_seconds_between(searched_ns_, t_ns) < kSearchEvery_s) return WM_TIME_NONE;
  const wm_time_ns lately = t_ns - wm_ns_from_seconds(kLately_s);
  const wm_time_ns window = t_ns - wm_ns_from_seconds(params_.recover_window_s);
  const wm_time_ns unfit = fused_ns_ != WM_TIME_NONE && fused_ns_ > window ? fused_ns_ + 1 : window;
  if (is_elsewhere(unfit, t_ns)) return unfit;
  return is_elsewhere(lately, t_ns) ? lately : WM_TIME_NONE;
}

bool landmark_ekf::is_elsewhere(wm_time_ns since_ns, wm_time_ns t_ns) {
  const int clues = observations_.count_since(since_ns);
  if (clues < kNumbersElsewhere) return false;
  searched_ns_ = t_ns;
  const wm_pose2 pose = filter_.pose(), odom = filter_.odom();
  wm_pose2 mounting[kMaxSensors] = {};
  for (size_t i = 0; i < setup_->sensor_count && i < kMaxSensors; i++) {
    const sensor_errors told = remembered_errors_of((int)i), known = errors_of((int)i);
    mounting[i] = between({told.x_m, told.y_m, told.yaw_rad}, {known.x_m, known.y_m, known.yaw_rad});
  }
  const int fitting =
      observations_.agreeing(since_ns, pose, odom, filter_.travelled_m(), filter_.turned_rad(), mounting);
  if (kFewOf * fitting > clues) return false;
  const search_result other =
      observations_.find(since_ns, odom, filter_.travelled_m(), filter_.turned_rad(), nullptr, 0,
                         {params_.recover_sigma_xy_m, params_.recover_sigma_heading_rad, kNumbersElsewhere});
  if (!other.found || kFewOf * fitting > other.agreeing) return false;
  const double place = filter_.variance(kX) + filter_.variance(kY) + other.covariance[0][0] + other.covariance[1][1];
  const double heading = filter_.variance(kHeading) + other.covariance[2][2];
  const double away_m2 = square(other.pose.x_m - pose.x_m) + square(other.pose.y_m - pose.y_m);
  const double turned_rad = wrap(other.pose.heading_rad - pose.heading_rad);
  return away_m2 > square(kElsewhere_m) + 9.0 * place || square(turned_rad) > square(kElsewhere_rad) + 9.0 * heading;
}

// Counted once, and again only after it fitted in between.
void landmark_ekf::tell_moved(int landmark) {
  landmark_record &record = landmark_records()[landmark];
  if (!record.moved && state_ == WM_STATE_TRACKING && evidence_.moved(landmark)) {
    record.moved = 1;
    record.confirmed = 0;
    moved_++;
    moved_id_ = setup_->landmarks[landmark].id;
  } else if (record.moved && record.confirmed) {
    record.moved = 0;
  }
}

void landmark_ekf::try_start() {
  double covariance[3][3];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) covariance[i][j] = filter_.covariance(i, j);
  start_trial_.begin(filter_.pose(), covariance, filter_.odom(), filter_.travelled_m(), filter_.turned_rad());
}

// Is the stated pose borne out by what is seen? If not, it is forgotten.
void landmark_ekf::weigh_start(wm_time_ns t_ns) {
  if (!start_trial_.open() || state_ != WM_STATE_TRACKING) return;
  if (weighed_ns_ != WM_TIME_NONE && wm_seconds_between(weighed_ns_, t_ns) < kWeighEvery_s) return;
  weighed_ns_ = t_ns;
  const start_trial::lasting sigma = {params_.sensor_yaw_sigma_rad, params_.lasting_bearing_rad,
                                      params_.lasting_lateral_m};
  start_trial_.weigh(observations_, sigma, filter_.pose(), filter_.odom(), filter_.travelled_m(), filter_.turned_rad(),
                     t_ns);
  if (!start_trial_.surely_off()) return;
  restore_calibration();
  filter_.set_pose(start_trial_.pose(), start_trial_.covariance());
  start_trial_.close();
  evidence_.begin(kFoundWrong);
  resets_++;
  fused_ns_ = t_ns;
}

double landmark_ekf::lost_probability() const {
  if (state_ == WM_STATE_SEARCHING) return 1.0;
  const double now = evidence_.probability(), start = start_trial_.off();
  return now > start ? now : start;
}

void landmark_ekf::remember_calibration(wm_time_ns t_ns) {
  const bool first = remembered_ns_ == WM_TIME_NONE;
  if (t_ns != WM_TIME_NONE && !first && wm_seconds_between(remembered_ns_, t_ns) < kRememberEvery_s) return;
  remembered_ns_ = t_ns;
  memory_[1] = memory_[0];
  for (int i = kPoseStates; i < calibration_states_; i++) {
    memory_[0].value[i] = filter_.value(i);
    memory_[0].variance[i] = filter_.variance(i);
  }
  if (t_ns == WM_TIME_NONE) memory_[1] = memory_[2] = memory_[0];
}

// Lost again soon after being found: then what was remembered is wrong, too (a mounting's yaw and a heading that are
// off by the same angle look alike until the robot has driven a while). Begin from calibration.yaml.
const landmark_ekf::calibration_memory &landmark_ekf::memory_to_trust() const {
  const bool again = found_ns_ != WM_TIME_NONE && wm_seconds_between(found_ns_, filter_.now_ns()) < kFoundWrongly_s;
  return memory_[again ? 2 : 1];
}

// A wrong pose teaches wrong things of the sensors.
void landmark_ekf::restore_calibration() {
  for (int i = kPoseStates; i < calibration_states_; i++)
    filter_.forget(i, memory_[1].value[i], memory_[1].variance[i]);
  lasting_.release_all();
  map_.release_all();
  if (tilt_state_ >= 0)
    for (int k = 0; k < 2; k++) filter_.forget(tilt_state_ + k, 0.0, square(params_.tilt_sigma_rad));
}

// Is the pose unknown, or so vague (a robot that stood blind for seconds while it turned) that what is seen should find
// it rather than correct it? A range says nothing of the heading, which its motion shows in time. While nobody knows
// how the robot moves, what is seen can't be carried together, and corrects as well as it can.
bool landmark_ekf::is_sought(wm_time_ns t_ns, bool by_bearing) {
  if (state_ == WM_STATE_SEARCHING) return true;
  const double heading = filter_.variance(kHeading), spread = 0.5 * (filter_.variance(kX) + filter_.variance(kY));
  const bool vague = (by_bearing && heading > square(kVague_rad)) || spread > square(kVaguePlace) * map_variance_m2_;
  if (!params_.recover || state_ != WM_STATE_TRACKING || !vague || filter_.is_overdue()) {
    vague_ns_ = WM_TIME_NONE;
    return false;
  }
  if (vague_ns_ == WM_TIME_NONE) {
    vague_ns_ = t_ns;
    observation &place = vague_[0] = {};
    place.t_ns = t_ns;
    place.key = -1;
    place.sensor = filter_.odom();
    place.travelled_m = filter_.travelled_m();
    place.turned_rad = filter_.turned_rad();
    observation &toward = vague_[1] = place;
    place.kind = kObservedPosition;
    place.place_m[0] = filter_.value(kX);
    place.place_m[1] = filter_.value(kY);
    place.sigma_length_m = std::sqrt(spread);
    toward.kind = kObservedHeading;
    toward.bearing_rad = filter_.value(kHeading);
    toward.sigma_angle_rad = std::sqrt(heading);
  }
  return wm_seconds_between(vague_ns_, t_ns) < kVagueFor_s;
}

void landmark_ekf::seek(wm_time_ns t_ns) {
  const wm_time_ns window = t_ns - wm_ns_from_seconds(params_.recover_window_s);
  if (state_ == WM_STATE_SEARCHING) return search(window, prior_, prior_count_);
  search(vague_ns_ > window ? vague_ns_ : window, vague_, 2);
}

// Looks for the pose among the clues since `since_ns`; takes it where it is sure.
void landmark_ekf::search(wm_time_ns since_ns, const observation *prior, int prior_count) {
  const wm_time_ns now = filter_.now_ns();
  if (!params_.recover) return;
  if (searched_ns_ != WM_TIME_NONE && wm_seconds_between(searched_ns_, now) < kSearchEvery_s) return;
  searched_ns_ = now;
  const search_limits limits = {params_.recover_sigma_xy_m, params_.recover_sigma_heading_rad,
                                kNumbers + (prior == vague_ ? kPoseNumbers : 0)};
  search_result result = observations_.find(since_ns, filter_.odom(), filter_.travelled_m(), filter_.turned_rad(),
                                            prior, prior_count, limits);
  if (!result.found) return;
  restore_calibration();
  // What the mounting's yaw may still be off by, the heading found is off by, too.
  for (size_t i = 0; i < setup_->sensor_count; i++) {
    const int yaw = sensor_state_[i][kYaw];
    if (yaw >= 0) result.covariance[2][2] += filter_.variance(yaw);
  }
  found_ns_ = now;
  filter_.set_pose(result.pose, result.covariance);
  start_trial_.begin_found(result.pose, result.covariance, filter_.odom(), filter_.travelled_m(), filter_.turned_rad(),
                           since_ns);
  evidence_.begin(kFoundWrong);
  resets_++;
  fused_ns_ = now;
  state_ = WM_STATE_TRACKING;
}

}  // namespace wm
