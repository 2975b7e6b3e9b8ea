// SPDX-License-Identifier: Apache-2.0
#include "motion/front_end.hpp"

#include <cstring>
#include <limits>

#include "math/elementary.hpp"
#include "motion/event_time.hpp"

namespace wm {
namespace {

constexpr double kFlicker_ticks = 3.0;      // of the wheels' difference at rest: each encoder may sit on an edge
constexpr double kRoadWheelMost_rad = 1.5;  // tan is finite; no wheel is turned across

// Sensors without a sign give zero errors of either; the largest seen is 0.05 m/s. Not swept.
constexpr double kSignedBelow_mps = -0.1;
// What the errors of a sensor beside the gyro make of a turn: a part of it (track, slip), an offset of the steering
// angle.
constexpr double kOtherTurnScale = 0.2, kOtherSteeringOffset_rad = 0.02;

// The best first: increments have a covariance of their own; a gyro's turn is better than the wheels' difference, which
// is then its second source (wheel_heading); steering knows less of the turn than the rear wheels' ticks.
constexpr uint8_t kPreferred[] = {WM_MOTION_INCREMENTS, WM_MOTION_SPEED_YAW_RATE, WM_MOTION_TICKS, WM_MOTION_ACKERMANN,
                                  WM_MOTION_TWIST};

wm_status check_value(double value, double limit) {
  if (!finite(value)) return WM_NOT_FINITE;
  return std::fabs(value) <= limit ? WM_OK : WM_OUT_OF_RANGE;
}

}  // namespace

void motion_front_end::init(const wm_motion_params *params, const wm_wheels *wheels, const wm_rig *rig) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  params_ = params;
  wheels_ = *wheels;
  commands_ = are_commands(*params) || params->twist == WM_TWIST_COMMANDS ? kStated : 0;
  if (params->model == WM_MOTION_CONSTANT_VELOCITY) model_ = WM_MOTION_CONSTANT_VELOCITY;
  hold_max_ns_ = wm_ns_from_seconds(params->hold_max_s);
  position_m2_ = std::numeric_limits<double>::infinity();
  now_ns_ = newest_ns_ = fed_ns_ = wrapped_ns_ = still_since_ns_ = WM_TIME_NONE;
  still_apart_m_ = 0.0;
  refused_since_ns_ = last_refusal_ns_ = yaw_watch_.since_ns = yaw_watch_.moved_ns = WM_TIME_NONE;
  for (wm_time_ns &stamp : stamp_ns_) stamp = WM_TIME_NONE;
  for (wm_time_ns &stamp : message_ns_) stamp = WM_TIME_NONE;
  for (tick_wheel &wheel : wheel_) wheel.t_ns = WM_TIME_NONE;
  increment_ns_ = twist_ns_ = twist_sample_ns_ = sampled_ns_[0] = sampled_ns_[1] = WM_TIME_NONE;
  noise_factors_ = {1.0, 1.0};
  for (int i = 0; i < 3; i++) {
    off_plane_since_ns_[i] = WM_TIME_NONE;
    stated_v_mps_[i] = rig ? rig->twist6_sigma_v_mps[i] : std::numeric_limits<double>::quiet_NaN();
    stated_w_radps_[i] = rig ? rig->twist6_sigma_w_radps[i] : std::numeric_limits<double>::quiet_NaN();
  }
}

wm_status motion_front_end::check(const wm_event &event) const {
  if (event.t_ns > kMaxTime || event.t_ns < -kMaxTime) return WM_OUT_OF_RANGE;
  wm_status status = WM_OK;
  switch (event.kind) {
    case WM_EVENT_QUANTITIES: {
      const wm_quantities &q = event.as.quantities;
      if (q.count > WM_QUANTITIES_MAX) return WM_OUT_OF_RANGE;
      for (int i = 0; i < q.count && status == WM_OK; i++)
        status = q.id[i] < WM_Q_COUNT ? check_value(q.value[i], wm_quantity_most(q.id[i])) : WM_OUT_OF_RANGE;
      break;
    }
    case WM_EVENT_TWIST2:
      status = check_value(event.as.twist2.v_mps, kSpeedMost_mps);
      if (status == WM_OK) status = check_value(event.as.twist2.w_radps, kRateMost_radps);
      break;
    case WM_EVENT_TWIST6:
      for (int i = 0; i < 3 && status == WM_OK; i++) {
        status = check_value(event.as.twist6.v_mps[i], kSpeedMost_mps);
        if (status == WM_OK && has_rates(event.as.twist6))
          status = check_value(event.as.twist6.w_radps[i], kRateMost_radps);
      }
      break;
    case WM_EVENT_INCREMENT: status = check_increment(event); break;
    default: return WM_UNSUPPORTED;
  }
  if (status == WM_OK && now_ns_ != WM_TIME_NONE && event.t_ns < now_ns_) return WM_TIME_RAN_BACK;
  return status;
}

void motion_front_end::feed(const wm_event &event) {
  if (now_ns_ == WM_TIME_NONE) set_now(event.kind == WM_EVENT_INCREMENT ? event.as.increment.from_ns : event.t_ns);
  yaw_fresh_ = 0;
  const bool uncounted = ticks_drive() && age_of_speed(now_ns_).is_overdue();
  if (now_ns_ > fed_ns_ && (uncounted || history_.is_overdue(now_ns_))) observed_without_ = 3;
  fed_ns_ = event.t_ns;
  if (event.kind == WM_EVENT_QUANTITIES)
    take_quantities(event);
  else if (event.kind == WM_EVENT_INCREMENT)
    take_increment(event);
  else
    take_twist(event);
  note_silence(event.t_ns);
}

// Of a velocity log without rates the turn is the gyro's.
planar_twist motion_front_end::measured_twist(const wm_event &event) const {
  if (event.kind == WM_EVENT_TWIST2) return {event.as.twist2.v_mps, 0.0, event.as.twist2.w_radps};
  const double by_gyro = gyro_is_alive() ? value_[WM_Q_YAW_RATE] : 0.0;
  const double rate = has_rates(event.as.twist6) ? event.as.twist6.w_radps[2] : by_gyro;
  const vec3 base = velocity_of_base(event.as.twist6, {0, 0, rate});
  return {base.x, base.y, rate};
}

void motion_front_end::take_twist(const wm_event &event) {
  const bool planar = event.kind == WM_EVENT_TWIST2;
  lacks_rate_ = !planar && !has_rates(event.as.twist6);
  const auto [v, u, rate] = measured_twist(event);
  const double w = commands_ ? driven_rate(*params_, v, rate) : rate;
  if (!planar) watch_plane(event.t_ns, event.as.twist6);
  note_period(kTwistSpeed, event.t_ns, 1);
  stamp_ns_[kTwistSpeed] = twist_sample_ns_ = event.t_ns;
  choose_model(WM_EVENT_BIT(event.kind));
  twists_.note(v, rate,
               std::fabs(v) > params_->standstill_speed_mps || std::fabs(rate) > params_->standstill_yaw_rate_radps);
  if (params_->twist == WM_TWIST_AUTO)
    commands_ = (uint8_t)((commands_ & ~kDetected) | (twists_.kind() == kKindCommands ? kDetected : 0));
  if (model_ == WM_MOTION_SPEED_YAW_RATE && speed_source_ == kOfTwist) {
    take_twist_beside_gyro(event.t_ns, {v, u, rate});
    return;
  }
  twist_ = {v, u, rate};
  if (model_ != WM_MOTION_TWIST) return;
  twists_in_space_ = !planar;
  if (twist_ns_ != WM_TIME_NONE && event.t_ns > twist_ns_ && !is_overdue(event.t_ns)) {
    const double dt = wm_seconds_between(twist_ns_, event.t_ns);
    if (lacks_rate_) missed_turn_rad2_ += square(kUnknownRate_radps) * dt;
    twist_period_s_ += twist_period_s_ > 0.0 ? kPeriodGain * (dt - twist_period_s_) : dt;
  }
  twist_ns_ = event.t_ns;
  const bool v_plausible = is_plausible_level(kTwistSpeed, event.t_ns, v);
  const bool w_plausible = is_plausible_level(kTwistRate, event.t_ns, w);
  const bool u_plausible = planar || is_plausible_level(kTwistSide, event.t_ns, u);
  const bool plausible = v_plausible && u_plausible && w_plausible;
  note_plausibility(event.t_ns, quantity_bit(kTwistSpeed), v_plausible);
  if (!planar) note_plausibility(event.t_ns, quantity_bit(kTwistSide), u_plausible);
  note_plausibility(event.t_ns, quantity_bit(kTwistRate), w_plausible);
  const bool still =
      watch_standstill(event.t_ns, plausible && !lacks_rate_ && speed_of({v, u, w}) < params_->standstill_speed_mps &&
                                       std::fabs(w) < params_->standstill_yaw_rate_radps);
  if (still && !commands_ && rate != 0.0) {  // a measured rate; a rate of exactly 0 is one that was set to it
    value_[WM_Q_YAW_RATE] = rate;
    yaw_fresh_ = 1;
  }
  const motion_input held = history_.empty() ? motion_input{} : history_.newest();
  if (plausible)
    push_input(event.t_ns, v, w, false, false, u);
  else
    push_input(event.t_ns, held.a, held.b, true, false, held.side_mps);
}

// The speeds of a twist and the turn rate of a gyro, as of a car's speed and yaw rate.
void motion_front_end::take_twist_beside_gyro(wm_time_ns t_ns, const planar_twist &sample) {
  const bool v_plausible = is_plausible_level(kTwistSpeed, t_ns, sample.v);
  const bool plausible = is_plausible_level(kTwistSide, t_ns, sample.u) && v_plausible;
  note_plausibility(t_ns, quantity_bit(kTwistSpeed) | quantity_bit(kTwistSide), plausible);
  if (plausible) twist_ = sample;
  watch_standstill(t_ns, plausible && is_still(twist_.v));
  push_input(t_ns, twist_.v, value_[WM_Q_YAW_RATE], (health_ & WM_MOTION_HEALTH_YAW_RATE_STUCK) != 0, !plausible,
             twist_.u);
}

// Only beside a gyro: a twist alone has a model of its own. A command is obeyed later and in part.
bool motion_front_end::twist_gives_speed() const {
  return seen(WM_Q_YAW_RATE) && !commands_ && twist_sample_ns_ != WM_TIME_NONE &&
         now_ns_ - twist_sample_ns_ <= hold_max_ns_;
}

// The newest speed is below the threshold, and that of each wheel; of a twist also its turn rate: a robot that turns on
// the spot does not stand.
bool motion_front_end::is_still(double speed_mps) const {
  if (speed_source_ != kOfTwist)
    return std::fabs(speed_mps) < params_->standstill_speed_mps && wheel_mps_ < params_->standstill_speed_mps;
  return speed_of(twist_) < params_->standstill_speed_mps && std::fabs(twist_.w) < params_->standstill_yaw_rate_radps;
}

// Holds for good: the states move the velocity.
void motion_front_end::begin_velocity() {
  motion_input input{};
  input.t_ns = now_ns_;
  input.model = WM_MOTION_CONSTANT_VELOCITY;
  input.counted = 1;
  history_.push(input);
}

void motion_front_end::take_quantities(const wm_event &event) {
  const wm_quantities &q = event.as.quantities;
  const bool frozen = (q.doubt & WM_DOUBT_FROZEN_COUNTER) != 0;
  health_ = frozen ? health_ | WM_MOTION_HEALTH_COUNTER_FROZEN : health_ & ~WM_MOTION_HEALTH_COUNTER_FROZEN;
  const bool wrapped = (q.doubt & WM_DOUBT_COUNTS_WRAPPED) != 0 && !frozen;
  if (wrapped) take_wrapped(q, event.t_ns);
  const bool refused = frozen || !is_plausible(q, event.t_ns);
  uint32_t fresh = 0;
  for (int i = 0; i < q.count; i++) {
    const int id = q.id[i];
    fresh |= quantity_bit(id);
    if (refused) continue;  // the value before still holds; its noise grows
    if (is_count(id) && !wrapped) take_count(id, event.t_ns, q.value[i]);
    value_[id] = q.value[i];
    stamp_ns_[id] = event.t_ns;
  }
  choose_model(WM_EVENT_BIT(WM_EVENT_QUANTITIES));
  if ((fresh & kCounts) && !refused) watch_encoders();
  if (model_ != WM_MOTION_TICKS) {
    push_quantities(event.t_ns, fresh, frozen, refused || wrapped);
    return;
  }
  double v = 0.0;
  if ((fresh & quantity_bit(WM_Q_YAW_RATE)) && !refused && read_speed(&v)) watch_yaw_rate(event.t_ns, v, true);
  if (fresh & kCounts) push_ticks(event.t_ns, frozen, refused || wrapped);
}

// `fresh`: the quantities of this message, a bit each.
void motion_front_end::push_quantities(wm_time_ns t_ns, uint32_t fresh, bool frozen, bool refused) {
  double v = 0.0;
  if (!read_speed(&v)) return;
  const bool known = !refused && !age_of_speed(t_ns).is_overdue();
  const bool still = watch_standstill(t_ns, is_still(v) && known);
  const bool speed = (fresh & (kSpeeds | kCounts)) != 0, rate = (fresh & quantity_bit(WM_Q_YAW_RATE)) != 0;
  if (model_ == WM_MOTION_SPEED_YAW_RATE && (speed || rate)) {
    watch_yaw_rate(t_ns, v, rate && !refused);
    yaw_fresh_ = rate && !refused && still;
    push_speed_and_rate(t_ns, v, frozen, refused);
  } else if (model_ == WM_MOTION_ACKERMANN && (speed || (fresh & kSteering))) {
    double angle = 0.0;
    watch_yaw_rate(t_ns, v, rate && !refused);
    if (read_road_wheel(&angle)) push_input(t_ns, v, angle, frozen, refused);
  } else if (twist_stands_in()) {
    watch_yaw_rate(t_ns, v, rate && !refused);  // stuck until now: does it move again?
  }
}

// The turn rate is the gyro's; while that is silent or stuck, that of the rear wheels' speeds; without them it holds.
void motion_front_end::push_speed_and_rate(wm_time_ns t_ns, double speed_mps, bool frozen, bool refused) {
  const double side_mps = speed_source_ == kOfTwist ? twist_.u : 0.0;
  double rate = 0.0;
  if (!gyro_is_alive() && wheels_stand_in(false) && read_rear_turn_rate(&rate)) {
    stand_in(t_ns, speed_mps, rate);
    push_input(t_ns, speed_mps, rate, frozen, refused, side_mps, true);
    return;
  }
  stand_in_rad_ = 0.0;
  if (!silent(WM_Q_YAW_RATE, t_ns)) rate = value_[WM_Q_YAW_RATE];
  push_input(t_ns, speed_mps, rate, frozen || (health_ & WM_MOTION_HEALTH_YAW_RATE_STUCK), refused, side_mps);
}

// The best model that the data seen so far allow, or the one that the config names. `kinds`: of the newest event.
void motion_front_end::choose_model(uint32_t kinds) {
  double ignored;
  const bool speed = read_speed(&ignored);
  const bool ticks = counts_ticks() && finite(wheels_.track_m);
  const bool steering = speed && finite(wheels_.wheelbase_m) && read_road_wheel(&ignored);
  // A log without rates does not stand in for the gyro.
  const bool has_other =
      ticks || (speed_source_ == kOfTwist && !lacks_rate_) || (steering && !age_of_steering(now_ns_).is_overdue());
  const bool possible[] = {false,
                           ticks,
                           speed && (gyro_is_alive() || wheels_stand_in(steering)),
                           steering,
                           (kinds & WM_TWIST_EVENTS) != 0,
                           (kinds & WM_EVENT_BIT(WM_EVENT_INCREMENT)) != 0};
  const int wanted = params_->model;
  if (wanted == WM_MOTION_CONSTANT_VELOCITY) return;
  if (wanted != WM_MOTION_AUTO) {
    if (possible[wanted]) model_ = (uint8_t)wanted;
    return;
  }
  for (uint8_t model : kPreferred) {
    if (possible[model] && model_ == WM_MOTION_SPEED_YAW_RATE && model == WM_MOTION_TICKS) leave_gyro();
    if (possible[model]) model_ = model;
    if (model_ == model && (possible[model] || model != WM_MOTION_SPEED_YAW_RATE || !has_other)) return;
  }
}

motion_kind motion_front_end::kind() const {
  switch (model_) {
    case WM_MOTION_TICKS: return kKindTicks;
    case WM_MOTION_SPEED_YAW_RATE: return kKindGyro;
    case WM_MOTION_ACKERMANN: return kKindSteering;
    case WM_MOTION_INCREMENTS: return increments_are_calibrated_ ? kKindCalibrated : kKindMeasured;
    case WM_MOTION_TWIST: break;
    default: return kKindUnknown;
  }
  if (commands_) return kKindCommands;
  return params_->twist == WM_TWIST_MEASURED || twists_.kind() == kKindMeasured ? kKindMeasured : kKindTwist;
}

double motion_front_end::by_gear(double value, bool is_signed) const {
  const bool reverse = seen(WM_Q_GEAR) && value_[WM_Q_GEAR] < 0.0;
  return reverse && !is_signed ? -value : value;
}

// Of base_link, by the speed of the front axle's middle, which is along the road wheels: v = v_f cos(angle). By the
// gyro v^2 = v_f^2 - (w L)^2. Wheels that do not steer measure v.
double motion_front_end::behind_front_wheels(double front_mps) const {
  double angle;
  if (params_->states.drive == WM_DRIVE_SKID_STEER) return front_mps;
  if (read_road_wheel(&angle)) return front_mps * cos(angle);
  if (!finite(wheels_.wheelbase_m) || !gyro_is_alive()) return front_mps;
  const double square_mps2 = square(front_mps) - square(value_[WM_Q_YAW_RATE] * wheels_.wheelbase_m);
  return square_mps2 > 0.0 ? std::copysign(std::sqrt(square_mps2), front_mps) : 0.0;
}

// The rear wheels' mean is base_link's own speed; ticks come next (no rounding), then the dashboard's speed, then the
// front wheels. A source that fell silent yields to the next.
bool motion_front_end::read_speed(double *speed_mps) {
  double wheel_mps = 0.0;
  const auto mean_of = [&](int left, int right, double *out) {
    const bool l = seen(left) && !silent(left, now_ns_), r = seen(right) && !silent(right, now_ns_);
    if (!l && !r) return false;
    const double one = value_[l ? left : right], other = value_[r ? right : left];
    *out = 0.5 * (one + other);
    wheel_mps = larger(std::fabs(one), std::fabs(other));
    return true;
  };
  double speed = 0.0;
  uint8_t source = kNone;
  if (mean_of(WM_Q_WHEEL_SPEED_REAR_LEFT, WM_Q_WHEEL_SPEED_REAR_RIGHT, &speed)) {
    source = kRearWheels;
  } else if (counts_ticks() && !(silent(WM_Q_WHEEL_TICKS_LEFT, now_ns_) && silent(WM_Q_WHEEL_TICKS_RIGHT, now_ns_))) {
    speed = mean_of_wheels(wheel_[0].speed_mps, wheel_[1].speed_mps);
    wheel_mps = larger(std::fabs(wheel_[0].speed_mps), std::fabs(wheel_[1].speed_mps));
    source = kTicksMean;
  } else if (mean_of(WM_Q_VEHICLE_SPEED, WM_Q_VEHICLE_SPEED, &speed)) {
    source = kVehicleSpeed;
  } else if (mean_of(WM_Q_WHEEL_SPEED_FRONT_LEFT, WM_Q_WHEEL_SPEED_FRONT_RIGHT, &speed)) {
    source = kFrontWheels;
  } else if (twist_gives_speed()) {
    speed = twist_.v;
    source = kOfTwist;
  }
  if (source == kNone) return false;
  if (source != speed_source_) {
    speed_source_changed_ |= speed_source_ != kNone;
    speed_source_ = source;
  }
  if (source != kTicksMean && source != kOfTwist) {
    speed_is_signed_ |= speed < kSignedBelow_mps;
    speed = by_gear(speed, speed_is_signed_);
  }
  wheel_mps_ = wheel_mps;
  if (source == kFrontWheels) speed = behind_front_wheels(speed);
  *speed_mps = speed;
  return true;
}

bool motion_front_end::read_road_wheel(double *angle_rad) const {
  if (seen(WM_Q_ROAD_WHEEL)) {
    *angle_rad = value_[WM_Q_ROAD_WHEEL];
    return std::fabs(*angle_rad) < kRoadWheelMost_rad;
  }
  if (seen(WM_Q_STEERING_ACTUATOR) && wheels_.steering_table_count >= 2) {
    const double *x = wheels_.actuator_m;
    const double *y = wheels_.road_wheel_rad;
    const double position = value_[WM_Q_STEERING_ACTUATOR];
    uint32_t i = 0;
    while (i + 2 < wheels_.steering_table_count && position > x[i + 1]) i++;
    double fraction = (position - x[i]) / (x[i + 1] - x[i]);
    fraction = fraction < 0.0 ? 0.0 : fraction > 1.0 ? 1.0 : fraction;  // the actuator has an end at either side
    *angle_rad = y[i] + fraction * (y[i + 1] - y[i]);
    return finite(*angle_rad);
  }
  if (seen(WM_Q_STEERING_WHEEL) && finite(wheels_.steering_ratio)) {
    *angle_rad = value_[WM_Q_STEERING_WHEEL] / wheels_.steering_ratio;
    return std::fabs(*angle_rad) < kRoadWheelMost_rad;
  }
  return false;
}

bool motion_front_end::watch_standstill(wm_time_ns t_ns, bool still) {
  if (!still) {
    still_since_ns_ = WM_TIME_NONE;
    return false;
  }
  const double apart_m = counts_ticks() ? wheel_[1].position_m - wheel_[0].position_m : 0.0;
  const double tick_m = kTwoPi * wheels_.radius_m / wheels_.ticks_per_turn;
  // A slow turn adds up.
  const bool turned = counts_ticks() && std::fabs(apart_m - still_apart_m_) > kFlicker_ticks * tick_m;
  if (still_since_ns_ == WM_TIME_NONE || turned) {
    still_since_ns_ = t_ns;
    still_apart_m_ = apart_m;
  }
  return stands(t_ns);
}

// `doubtful`: the input that holds from here on; `miscounted`: the counts of the segment that ends here.
void motion_front_end::push_input(wm_time_ns t_ns, double a, double b, bool doubtful, bool miscounted, double side_mps,
                                  bool beside_gyro) {
  motion_input input{};
  input.t_ns = t_ns;
  input.a = a;
  input.b = b;
  input.side_mps = side_mps;
  input.model = model_;
  input.holonomic = drives_sideways();
  input.command = model_ == WM_MOTION_TWIST && commands_ != 0;
  if (input.command) begin_response(*params_, history_.empty() ? nullptr : &history_.newest(), &input);
  input.kind = beside_gyro ? kKindSteering : kind();
  input.beside_gyro = beside_gyro || twist_stands_in();
  input.doubtful = doubtful;
  input.by_counts = ticks_drive();
  mark_refused(&input);
  note_ages(&input);
  note_steady(&input);
  note_samples(&input);
  input.sampling[1] += static_cast<float>(missed_turn_rad2_);
  missed_turn_rad2_ = 0.0;
  input.standing = !doubtful && !input.refused && stands(t_ns);
  if (ticks_drive() && !counts_wrapped()) {
    // The segment that ends here gets the counted distance; from here on the last speed holds.
    const double dt = wm_seconds_between(now_ns_, t_ns);
    const bool counted = wheel_[0].t_ns == t_ns || wheel_[1].t_ns == t_ns;
    drop_silent_distance(t_ns, dt);
    if (dt > 0.0 && !miscounted) {
      motion_input done = input;
      done.t_ns = now_ns_;
      done.steady_after_s = 0.0F;
      done.a =
          mean_of_wheels(wheel_[0].position_m - wheel_[0].integrated_m, wheel_[1].position_m - wheel_[1].integrated_m) /
          dt;
      if (counted) {
        done.b = history_.empty() ? b : history_.newest().b;
        if (history_.is_overdue(t_ns)) done.b = counted_turn_rate();  // a gyro's rate of long ago is worse
        done.standing = input.standing && !history_.empty() && history_.newest().standing;
        done.counted = 1;
        history_.push(done);
      }
    }
  }
  history_.push(input);
  newest_ns_ = t_ns;
}

// Commands change when they come, and counts are of the whole time. A steering angle's changes are small between two
// samples. After a gap add_overdue_noise() has the error.
void motion_front_end::note_samples(motion_input *input) {
  const bool twist = model_ == WM_MOTION_TWIST, known = !input->doubtful && !input->refused && !input->command;
  bool speed = twist || (speed_source_ == kOfTwist && twist_sample_ns_ == input->t_ns);
  for (int id = WM_Q_WHEEL_SPEED_FRONT_LEFT; id <= WM_Q_VEHICLE_SPEED && !speed; id++)
    speed = (kSpeeds & quantity_bit(id)) && stamp_ns_[id] == input->t_ns;
  const bool fresh[2] = {known && speed && !ticks_drive(),
                         known && (twist || stamp_ns_[WM_Q_YAW_RATE] == input->t_ns) && model_ != WM_MOTION_ACKERMANN};
  const bool follows = !history_.empty() && history_.newest().model == model_ && !history_.is_overdue(input->t_ns);
  if (!follows) sampled_ns_[0] = sampled_ns_[1] = WM_TIME_NONE;  // both: the first one after a gap may be the other one
  if (input->holonomic && twist && fresh[0]) return note_holonomic(input);
  for (int k = 0; k < 2; k++) {
    if (!fresh[k]) continue;
    const double changed = k ? input->b - history_.newest().b : input->a - history_.newest().a;
    const double aside = k || !input->holonomic ? 0.0 : input->side_mps - history_.newest().side_mps;
    if (sampled_ns_[k] != WM_TIME_NONE)
      input->sampling[k] = static_cast<float>((square(changed) + square(aside)) *
                                              square(wm_seconds_between(sampled_ns_[k], input->t_ns)) / 12.0);
    if (k == 0) input->side_sampling = input->sampling[0];
    sampled_ns_[k] = input->t_ns;
  }
}

// Twists of a holonomic drive: each axis on its own, and of a change only what the samples' own noise does not explain,
// two of which are in it. The mean of the squares over some samples, since one alone is weak evidence.
void motion_front_end::note_holonomic(motion_input *input) {
  const double dt_s = sampled_ns_[0] == WM_TIME_NONE ? 0.0 : wm_seconds_between(sampled_ns_[0], input->t_ns);
  sampled_ns_[0] = sampled_ns_[1] = input->t_ns;
  if (!(dt_s > 0.0)) {
    for (double &mean : change2_) mean = 0.0;
    return;
  }
  const motion_input &before = history_.newest();
  const planar_twist now = {input->a, input->side_mps, input->b};
  const double changed[3] = {now.v - before.a, now.u - before.side_mps, now.w - before.b};
  const stated_noise stated = stated_noise_now();
  const rate_noise white = rate_noise_of(*params_, kind());
  const double own[3] = {(finite(stated.distance_m2) ? stated.distance_m2 : square(params_->noise_speed_mps)) +
                             square(white.speed_rel * now.v),
                         (finite(stated.lateral_m2) ? stated.lateral_m2 : square(params_->noise_sideways_mps)) +
                             square(params_->noise_sideways_rel * now.u),
                         (finite(stated.rotation_rad2) ? stated.rotation_rad2 : square(white.yaw_rate_radps)) +
                             square(white.yaw_rate_rel * now.w)};
  for (int k = 0; k < 3; k++) {
    change2_[k] += kPeriodGain * (square(changed[k]) - 2.0 * own[k] / dt_s - change2_[k]);
    const double real2 = change2_[k] > 0.0 ? change2_[k] : 0.0;
    (k == 1 ? input->side_sampling : input->sampling[k / 2]) = static_cast<float>(real2 * square(dt_s) / 12.0);
  }
}

bool motion_front_end::standstill_yaw_rate(double *yaw_rate_radps) const {
  *yaw_rate_radps = value_[WM_Q_YAW_RATE];
  return yaw_fresh_ != 0 && !distrusted_;
}

bool motion_front_end::speed_source_changed() {
  const bool changed = speed_source_changed_ != 0;
  speed_source_changed_ = 0;
  return changed;
}

wm_time_ns motion_front_end::lag_of(const wm_motion_calibration &calibration) const {
  return ticks_drive() || model_ == WM_MOTION_INCREMENTS ? 0 : wm_ns_from_seconds(calibration.value[kLag]);
}

motion_twist motion_front_end::twist_at(wm_time_ns t_ns, const wm_motion_calibration &calibration) const {
  motion_twist out{};
  walk(t_ns, t_ns + 1, calibration,
       [&out](const motion_segment &, const motion_twist &twist, const motion_noise &) { out = twist; });
  return out;
}

// The same bits for long while the robot moves: a gyro's noise never stands still. Sooner where steering or wheels
// state another turn than these bits, however slow the robot is.
void motion_front_end::watch_yaw_rate(wm_time_ns t_ns, double speed_mps, bool fresh) {
  if (!fresh) return;
  yaw_watch &w = yaw_watch_;
  double other = 0.0;
  const bool compare = read_other_turn_rate(speed_mps, &other);
  const bool turns = compare && std::fabs(other) >= params_->standstill_yaw_rate_radps;
  if (!is_still(speed_mps) || turns) w.moved_ns = t_ns;
  const bool moves = w.moved_ns != WM_TIME_NONE && wm_seconds_between(w.moved_ns, t_ns) < params_->standstill_after_s;
  const double yaw = value_[WM_Q_YAW_RATE];
  const bool changed = !w.repeats(yaw);
  if (changed || !moves) {
    w.begin(yaw, t_ns);
    w.explained_rad = 0.0;
    if (changed) health_ &= ~WM_MOTION_HEALTH_YAW_RATE_STUCK;  // a stop alone shows nothing of it
    return;
  }
  const double dt = w.go_on(t_ns, speed_mps), way = std::fabs(speed_mps) * dt;
  if (compare) {
    w.apart_rad += (other - yaw) * dt;
    w.explained_rad += kOtherTurnScale * std::fabs(other) * dt;
    if (finite(wheels_.wheelbase_m)) w.explained_rad += kOtherSteeringOffset_rad * way / wheels_.wheelbase_m;
  }
  if (!w.is_stuck_alone() && !w.is_stuck_against(w.explained_rad)) return;
  // Until now the heading lacks the turn that the other sensor measured.
  if (!(health_ & WM_MOTION_HEALTH_YAW_RATE_STUCK)) missed_turn_rad2_ = square(w.apart_rad);
  health_ |= WM_MOTION_HEALTH_YAW_RATE_STUCK;
}

bool motion_front_end::read_other_turn_rate(double speed_mps, double *rate_radps) const {
  if (speed_source_ == kOfTwist) {
    *rate_radps = twist_.w;
    return true;
  }
  double angle;
  if (finite(wheels_.wheelbase_m) && read_road_wheel(&angle)) {
    *rate_radps = speed_mps * tan(angle) / wheels_.wheelbase_m;
    return true;
  }
  if (finite(wheels_.track_m) && counts_ticks()) {
    *rate_radps = counted_turn_rate();
    return true;
  }
  return read_rear_turn_rate(rate_radps);
}

}  // namespace wm
