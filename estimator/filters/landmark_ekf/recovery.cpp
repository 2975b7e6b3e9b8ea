// SPDX-License-Identifier: Apache-2.0
// Evidence and relocalization: detects that observations contradict the pose, and finds the pose again.
#include "filters/core/recovery.hpp"
#include "filters/landmark_ekf/landmark_ekf.hpp"
#include "math/arc.hpp"
#include "math/elementary.hpp"

namespace wm {
namespace {

// Constants were chosen on drawn crossings (waymark-montecarlo --trials, seeds 1 to 100, easy and hard) and not swept.
constexpr double kTestStartEvery_s = 0.1;
constexpr double kFoundWrongly_s = 60.0;  // lost again within this time: the remembered calibration is wrong, too
// Numbers that must agree with a pose that is found, two more than it has: three bearings always fit some pose. A pose
// that contradicts the tracked one needs one more; one near a vague pose, whose three numbers count, that many more.
constexpr int kNumbers = 5, kNumbersElsewhere = 6, kPoseNumbers = 3;
constexpr double kRecent_s = 2.0;  // a kidnapped robot's observations fit by chance in between
// Kidnapped: the tracked pose explains less than one in so many observations, and the other pose is at least so far.
constexpr int kFewOf = 3;                                   // one in three
constexpr double kElsewhere_m = 0.5, kElsewhere_rad = 0.2;  // added to 3 sigma
// Sigma of a vague place over that of one anywhere among the landmarks and the robot. A vague pose is searched for
// kVagueFor_s, and then updated nevertheless.
constexpr double kVaguePlace = 0.5, kVagueFor_s = 5.0;
// Largest sigma of a found place: where only bearings find it, and the least limit by accurate ranges. Not swept; 0.3 m
// with bearings loses crossing-laps.
constexpr double kFoundByBearings_m = 1.0, kFoundLeast_m = 0.3;

}  // namespace

// From before a fault: a wrong pose falsifies the calibration.
sensor_errors landmark_ekf::remembered_errors_of(int sensor) const {
  const auto generation = trusted_generation();
  return aid_.slots().errors(sensor, [&](int slot) { return rollback_.value(generation, slot); });
}

void landmark_ekf::note(wm_time_ns t_ns, int key, double log_bayes, double angle_rad, double normalised) {
  if (!params_.recover) return;
  evidence_.note(t_ns, key, log_bayes, angle_rad, normalised, key >= 0 ? &records_[static_cast<size_t>(key)] : nullptr);
  if (key >= 0) update_moved(key);
  if (life_.tracking()) {
    const wm_time_ns since = elsewhere_since(t_ns);
    if (since != WM_TIME_NONE) evidence_.contradict(since);
  }
  if (life_.tracking() && evidence_.contradicted()) life_.lose(t_ns);
  test_start(t_ns);
  if (life_.tracking() && evidence_.fits()) rollback_.remember(filter_, t_ns);
  if (life_.lost())
    recover_pose(&life_, evidence_, &filter_, t_ns, params_.recover_window_s,
                 [this](wm_time_ns since_ns) { search(since_ns, prior_, prior_count_); });
}

// Test for a kidnapped robot: a different pose explains the recent observations and the tracked one explains less than
// a third. False detections and moved landmarks do not agree on a pose. "Recent" is since the last accepted update, or
// kRecent_s, since some observations fit by chance. Returns since when; WM_TIME_NONE: not kidnapped.
wm_time_ns landmark_ekf::elsewhere_since(wm_time_ns t_ns) {
  if (!life_.search_due(t_ns)) return WM_TIME_NONE;
  const wm_time_ns recently = t_ns - wm_ns_from_seconds(kRecent_s);
  const wm_time_ns window = t_ns - wm_ns_from_seconds(params_.recover_window_s);
  const wm_time_ns fused = life_.fused_ns();
  const wm_time_ns unfit = fused != WM_TIME_NONE && fused > window ? fused + 1 : window;
  if (is_elsewhere(unfit, t_ns)) return unfit;
  return is_elsewhere(recently, t_ns) ? recently : WM_TIME_NONE;
}

bool landmark_ekf::is_elsewhere(wm_time_ns since_ns, wm_time_ns t_ns) {
  const int recent = observations_.count_since(since_ns);
  if (recent < kNumbersElsewhere) return false;
  life_.searched(t_ns);
  const wm_pose2 pose = filter_.pose();
  wm_pose2 mounting[kMaxSensors] = {};
  for (int i = 0; i < static_cast<int>(setup_->sensor_count); i++) {
    const sensor_errors buffered = remembered_errors_of(i), now = aid_.errors_of(filter_, i);
    mounting[i] =
        between({buffered[kMountX], buffered[kMountY], buffered[kYaw]}, {now[kMountX], now[kMountY], now[kYaw]});
  }
  const int fitting = observations_.agreeing(since_ns, pose, odometry(), mounting);
  if (kFewOf * fitting > recent) return false;
  const search_result other =
      observations_.find(since_ns, odometry(), nullptr, 0,
                         {found_sigma_m(since_ns), params_.recover_sigma_heading_rad, kNumbersElsewhere});
  if (!other.found || kFewOf * fitting > other.agreeing) return false;
  const double place = filter_.variance(kX) + filter_.variance(kY) + other.covariance[0][0] + other.covariance[1][1];
  const double heading = filter_.variance(kHeading) + other.covariance[2][2];
  const double away_m2 = square(other.pose.x_m - pose.x_m) + square(other.pose.y_m - pose.y_m);
  const double turned_rad = wrap(other.pose.heading_rad - pose.heading_rad);
  return away_m2 > square(kElsewhere_m) + 9.0 * place || square(turned_rad) > square(kElsewhere_rad) + 9.0 * heading;
}

// A landmark that moved is counted once, and again only after it fitted in between.
void landmark_ekf::update_moved(int landmark) {
  landmark_record &record = records_[static_cast<size_t>(landmark)];
  if (!record.moved && life_.tracking() && evidence_.moved(landmark)) {
    record.moved = 1;
    record.confirmed = 0;
    moved_++;
    moved_id_ = setup_->landmarks[landmark].id;
  } else if (record.moved && record.confirmed) {
    record.moved = 0;
  }
}

// Of all sensors.
static double most_correlated_bearing(const wm_setup &setup) {
  const double by_default = setup.sightings->bearing_sigma_default_rad;
  double most = correlated_bearing(*setup.sightings, setup.sensor_count > 0 ? 0.0 : by_default);
  for (size_t i = 0; i < setup.sensor_count; i++) {
    const double sigma = first_number(setup.sensors[i].bearing_sigma_rad, by_default, by_default);
    if (const double own = correlated_bearing(*setup.sightings, sigma); own > most) most = own;
  }
  return most;
}

void landmark_ekf::begin_start_test() {
  double covariance[3][3];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) covariance[i][j] = filter_.covariance(i, j);
  start_.begin(filter_.pose(), covariance, odometry());
}

// Tests the stated pose by the first observations; where another one is accepted, the filter takes it.
void landmark_ekf::test_start(wm_time_ns t_ns) {
  if (!start_.open() || !life_.tracking()) return;
  if (start_tested_ns_ != WM_TIME_NONE && wm_seconds_between(start_tested_ns_, t_ns) < kTestStartEvery_s) return;
  start_tested_ns_ = t_ns;
  start_.test(observations_,
              {std::fabs(sightings().states.sigma[WM_SENSOR_ROW_kYaw]), most_correlated_bearing(*setup_),
               sightings().correlated_lateral_m},
              filter_.pose(), odometry(), t_ns);
  if (!start_.rejected()) return;
  restore_calibration();
  filter_.set_pose(start_.pose(), start_.covariance());
  start_.close();
  evidence_.begin(kFoundWrong);
  life_.corrected(t_ns);
}

double landmark_ekf::lost_probability() const {
  if (life_.searching()) return 1.0;
  const double now = evidence_.probability(), start = start_.wrong_probability();
  return now > start ? now : start;
}

// Lost again soon after being found, the remembered calibration is wrong, too: errors of a mounting's yaw and of the
// heading cannot be distinguished before the robot has driven a while. Then calibration.yaml's counts.
rollback<landmark_ekf::kMaxCalibration>::generation landmark_ekf::trusted_generation() const {
  const wm_time_ns found = life_.found_ns();
  const bool again = found != WM_TIME_NONE && wm_seconds_between(found, filter_.now_ns()) < kFoundWrongly_s;
  return again ? rollback_.kStart : rollback_.kSafe;
}

void landmark_ekf::restore_calibration() {
  rollback_.restore(&filter_);
  filter_.noise().restart(true);
  aid_.release(&filter_);
  positions_.release(&filter_);
  localizer_.release();
}

// Is the pose unknown, or so vague (after seconds of blind turning) that observations should find it rather than
// correct it? A range contains no information about the heading, which motion reveals in time. While the motion is
// unknown, odometry cannot relate observations, and the update is as good.
bool landmark_ekf::needs_search(wm_time_ns t_ns, bool by_bearing) {
  if (life_.searching()) return true;
  const double heading = filter_.variance(kHeading), spread = 0.5 * (filter_.variance(kX) + filter_.variance(kY));
  const bool vague =
      (by_bearing && heading > square(kVague_rad)) || spread > square(kVaguePlace) * box_.anywhere_m2(filter_.pose());
  if (!params_.recover || !life_.tracking() || !vague || filter_.is_overdue()) {
    vague_ns_ = WM_TIME_NONE;
    return false;
  }
  if (vague_ns_ == WM_TIME_NONE) {
    vague_ns_ = t_ns;
    observation &place = vague_[0] = observation_now(filter_, -1);
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

// The largest sigma with which a place is accepted that is found by the observations since then.
double landmark_ekf::found_sigma_m(wm_time_ns since_ns) const {
  if (params_.recover_sigma_xy_m >= 0.0) return params_.recover_sigma_xy_m;
  double least_m = INFINITY;
  for (int i = 0; i < observations_.kept(); i++) {
    const observation &o = observations_.at(i);
    const bool has_length = (o.kind & (kObservedRange | kObservedPosition)) != 0 && o.t_ns >= since_ns;
    if (has_length && o.sigma_length_m < least_m) least_m = o.sigma_length_m;
  }
  if (!finite(least_m)) return kFoundByBearings_m;
  const double limit_m = absolute_sigma(params_.recover_sigma_xy_m, least_m);
  return limit_m > kFoundLeast_m ? limit_m : kFoundLeast_m;
}

void landmark_ekf::search_now(wm_time_ns t_ns) {
  const wm_time_ns window = t_ns - wm_ns_from_seconds(params_.recover_window_s);
  if (life_.searching()) return search(window, prior_, prior_count_);
  search(vague_ns_ > window ? vague_ns_ : window, vague_, 2);
}

// Searches the pose by the observations since `since_ns`, and takes it where it is certain.
void landmark_ekf::search(wm_time_ns since_ns, const observation *prior, int prior_count) {
  const wm_time_ns now = filter_.now_ns();
  if (!params_.recover || !life_.search_due(now)) return;
  life_.searched(now);
  const search_limits limits = {found_sigma_m(since_ns), params_.recover_sigma_heading_rad,
                                kNumbers + (prior == vague_ ? kPoseNumbers : 0)};
  search_result result = observations_.find(since_ns, odometry(), prior, prior_count, limits);
  if (!result.found) return;
  restore_calibration();
  // The found heading has the error of the mounting's yaw.
  for (int i = 0; i < static_cast<int>(setup_->sensor_count); i++)
    if (const int yaw = aid_.slots().at(i, kYaw); yaw >= 0) result.covariance[2][2] += filter_.variance(yaw);
  filter_.set_pose(result.pose, result.covariance);
  start_.begin_found(result.pose, result.covariance, odometry(), since_ns);
  evidence_.begin(kFoundWrong);
  life_.relocalized(now);
}

}  // namespace wm
