// SPDX-License-Identifier: Apache-2.0
// The motion front end's sensors that are silent while others go on: what stands in for them, and how unsure what holds
// has become.
#include "math/elementary.hpp"
#include "motion/front_end.hpp"

namespace wm {
namespace {

constexpr double kNeverSeen_s = 1e9;

}  // namespace

sample_age motion_front_end::age_of(int first, int last, wm_time_ns t_ns) const {
  const int slot = stamp_ns_[last] > stamp_ns_[first] ? last : first;
  const double periods_s = motion_history::kOverduePeriods * period_s_[slot];
  const double usual_s = periods_s > motion_history::kOverdueS ? periods_s : motion_history::kOverdueS;
  const double most_s = params_->hold_max_s;
  return {wm_seconds_between(stamp_ns_[slot], t_ns), usual_s < most_s ? usual_s : most_s};
}

sample_age motion_front_end::age_of_speed(wm_time_ns t_ns) const {
  switch (speed_source_) {
    case kRearWheels: return age_of(WM_Q_WHEEL_SPEED_REAR_LEFT, WM_Q_WHEEL_SPEED_REAR_RIGHT, t_ns);
    case kTicksMean: return age_of(WM_Q_WHEEL_TICKS_LEFT, WM_Q_WHEEL_TICKS_RIGHT, t_ns);
    case kVehicleSpeed: return age_of(WM_Q_VEHICLE_SPEED, WM_Q_VEHICLE_SPEED, t_ns);
    case kFrontWheels: return age_of(WM_Q_WHEEL_SPEED_FRONT_LEFT, WM_Q_WHEEL_SPEED_FRONT_RIGHT, t_ns);
    case kOfTwist: return age_of(kTwistSpeed, kTwistSpeed, t_ns);
    default: return {0.0, 0.0};
  }
}

// A gyro that is silent or stuck yields to the wheels' difference, to the twist's turn rate or to the steering, until
// it is back.
bool motion_front_end::gyro_is_alive() const {
  return seen(WM_Q_YAW_RATE) && !age_of(WM_Q_YAW_RATE, WM_Q_YAW_RATE, now_ns_).is_overdue() &&
         !(health_ & WM_MOTION_HEALTH_YAW_RATE_STUCK);
}

// Some senders give the angle only when it changes. So it is not overdue before hold_max.
sample_age motion_front_end::age_of_steering(wm_time_ns t_ns) const {
  sample_age out = {kNeverSeen_s, params_->hold_max_s};
  for (int id = WM_Q_STEERING_WHEEL; id <= WM_Q_STEERING_ACTUATOR; id++) {
    const double age_s = seen(id) ? wm_seconds_between(stamp_ns_[id], t_ns) : kNeverSeen_s;
    if (age_s < out.age_s) out.age_s = age_s;
  }
  return out;
}

// Whether the rear wheels' speeds give the turn while the gyro does not: where neither counts nor a twist nor a
// `steering` that comes as usual do.
bool motion_front_end::wheels_stand_in(bool steering) const {
  double ignored;
  if (params_->model != WM_MOTION_AUTO || !seen(WM_Q_YAW_RATE) || speed_source_ == kOfTwist || counts_ticks())
    return false;
  bool steers = false;
  for (int id = WM_Q_STEERING_WHEEL; id <= WM_Q_STEERING_ACTUATOR && steering; id++)
    steers |= seen(id) && !age_of(id, id, now_ns_).is_overdue();
  return !steers && read_rear_turn_rate(&ignored);
}

// Where the speed and the turn come from different sensors.
void motion_front_end::note_ages(motion_input *input) const {
  if (input->model != WM_MOTION_SPEED_YAW_RATE && input->model != WM_MOTION_ACKERMANN) return;
  const wm_time_ns t_ns = input->t_ns;
  const bool steered = input->model == WM_MOTION_ACKERMANN;
  const sample_age turn = steered ? age_of_steering(t_ns) : age_of(WM_Q_YAW_RATE, WM_Q_YAW_RATE, t_ns);
  const sample_age age[2] = {age_of_speed(t_ns), input->beside_gyro ? sample_age{} : turn};
  for (int part = 0; part < 2; part++) {
    if (!age[part].is_overdue()) continue;
    input->age_s[part] = static_cast<float>(age[part].age_s);
    input->due_s[part] = static_cast<float>(age[part].due_s);
  }
}

void motion_front_end::note_silence(wm_time_ns t_ns) {
  health_ &= ~(WM_MOTION_HEALTH_SPEED_SILENT | WM_MOTION_HEALTH_TURN_SILENT);
  const int wanted = params_->model;
  const bool takes_gyro = wanted == WM_MOTION_AUTO || wanted == WM_MOTION_SPEED_YAW_RATE;
  const bool parts = model_ == WM_MOTION_SPEED_YAW_RATE || model_ == WM_MOTION_ACKERMANN;
  if (model_ == WM_MOTION_INCREMENTS || model_ == WM_MOTION_CONSTANT_VELOCITY) return;
  if (parts && age_of_speed(t_ns).is_overdue()) health_ |= WM_MOTION_HEALTH_SPEED_SILENT;
  const bool gyro = takes_gyro && seen(WM_Q_YAW_RATE), steering = !gyro && model_ == WM_MOTION_ACKERMANN;
  if ((!gyro && model_ == WM_MOTION_TWIST && lacks_rate_) ||
      (gyro && age_of(WM_Q_YAW_RATE, WM_Q_YAW_RATE, t_ns).is_overdue()) ||
      (steering && age_of_steering(t_ns).is_overdue()))
    health_ |= WM_MOTION_HEALTH_TURN_SILENT;
}

// Turn rate of base_link by the rear wheels' speeds.
bool motion_front_end::read_rear_turn_rate(double *rate_radps) const {
  const int left = WM_Q_WHEEL_SPEED_REAR_LEFT, right = WM_Q_WHEEL_SPEED_REAR_RIGHT;
  if (!finite(wheels_.track_m) || !seen(left) || !seen(right) || silent(left, now_ns_) || silent(right, now_ns_))
    return false;
  *rate_radps = by_gear(value_[right] - value_[left], speed_is_signed_) / wheels_.track_m;
  return true;
}

// The errors of the wheels' difference are constant: an angle that grows by the way and the turn. Its square's growth
// is the variance of the next input.
void motion_front_end::stand_in(wm_time_ns t_ns, double speed_mps, double turn_radps) {
  const double dt_s = newest_ns_ == WM_TIME_NONE ? 0.0 : wm_seconds_between(newest_ns_, t_ns);
  const double sigma_radps = params_->states.wheel_difference_sigma * std::fabs(speed_mps) / wheels_.track_m +
                             std::fabs(params_->states.sigma[WM_TRACK_SCALE]) * std::fabs(turn_radps);
  const double before_rad2 = square(stand_in_rad_);
  stand_in_rad_ += sigma_radps * dt_s;
  missed_turn_rad2_ += square(stand_in_rad_) - before_rad2;
}

}  // namespace wm
