// SPDX-License-Identifier: Apache-2.0
#include "motion/front_end.hpp"

#include <cstring>

#include "math/elementary.hpp"
#include "motion/event_time.hpp"

namespace wm {
namespace {

// Beyond these, as beyond kSpeedMost_mps and kRateMost_radps, a value is a decoding fault.
constexpr double kMaxAngle = 200.0;    // rad, of a steering wheel
constexpr double kMaxActuator = 10.0;  // m
constexpr double kMaxTicks = 1e15;     // doubles still count singly there

constexpr double kPeriodGain = 1.0 / 16.0;  // of the usual time between counts
constexpr double kSignedBelow = -0.1;       // m/s: more than a sensor's zero error
constexpr double kYawStuckAlone_s = 30.0;   // the same bits for so long while driving
constexpr double kYawStuckAgainst_s = 3.0;  // ... while another sensor sees turning
constexpr double kYawStuckRate = 0.1;       // rad/s, that turning
constexpr double kDrivingSpeed = 0.5;       // m/s, for these rules
constexpr double kDeadEncoderCar_m = 1.0;   // a car's inner wheel never rests while the outer drives so far
constexpr double kDeadEncoderTurns = 1.0;   // a differential robot may pivot about one wheel, but not on and on
// A message whose counter skips n frames comes after n + 1 periods. Earlier than this fraction of them, its counter is
// wrong, and so may be the rest of it. Halfway between the stamps of one lost frame and of none.
constexpr double kSkipFraction = 0.75;

constexpr uint32_t bit(int slot) { return UINT32_C(1) << slot; }
constexpr uint32_t kCountSlots = bit(WM_Q_WHEEL_TICKS_LEFT) | bit(WM_Q_WHEEL_TICKS_RIGHT);

bool is_speed(int id) { return id >= WM_Q_WHEEL_SPEED_FRONT_LEFT && id <= WM_Q_VEHICLE_SPEED; }

double limit_of(int quantity) {
  switch (quantity) {
    case WM_Q_WHEEL_TICKS_LEFT:
    case WM_Q_WHEEL_TICKS_RIGHT: return kMaxTicks;
    case WM_Q_YAW_RATE: return kRateMost_radps;
    case WM_Q_STEERING_WHEEL:
    case WM_Q_ROAD_WHEEL: return kMaxAngle;
    case WM_Q_STEERING_ACTUATOR: return kMaxActuator;
    case WM_Q_GEAR: return 1.0;
    default: return kSpeedMost_mps;
  }
}

wm_status check_value(double value, double limit) {
  if (!finite(value)) return WM_NOT_FINITE;
  return std::fabs(value) <= limit ? WM_OK : WM_OUT_OF_RANGE;
}

}  // namespace

void motion_front_end::init(const wm_motion_params *params, const wm_wheels *wheels) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  params_ = params;
  wheels_ = *wheels;
  commands_ = are_commands(*params);
  hold_max_ns_ = wm_ns_from_seconds(params->hold_max_s);
  now_ns_ = newest_ns_ = fed_ns_ = still_since_ns_ = yaw_same_since_ns_ = WM_TIME_NONE;
  refused_since_ns_ = last_refusal_ns_ = WM_TIME_NONE;
  for (wm_time_ns &stamp : stamp_ns_) stamp = WM_TIME_NONE;
  for (wm_time_ns &stamp : message_ns_) stamp = WM_TIME_NONE;
  for (tick_wheel &wheel : wheel_) wheel.t_ns = WM_TIME_NONE;
}

wm_status motion_front_end::check(const wm_event &event) const {
  if (event.t_ns > kMaxTime || event.t_ns < -kMaxTime) return WM_OUT_OF_RANGE;
  wm_status status = WM_OK;
  switch (event.kind) {
    case WM_EVENT_QUANTITIES: {
      const wm_quantities &q = event.as.quantities;
      if (q.count > WM_QUANTITIES_MAX) return WM_OUT_OF_RANGE;
      for (int i = 0; i < q.count && status == WM_OK; i++)
        status = q.id[i] < WM_Q_COUNT ? check_value(q.value[i], limit_of(q.id[i])) : WM_OUT_OF_RANGE;
      break;
    }
    case WM_EVENT_TWIST2:
      status = check_value(event.as.twist2.v_mps, kSpeedMost_mps);
      if (status == WM_OK) status = check_value(event.as.twist2.w_radps, kRateMost_radps);
      break;
    case WM_EVENT_TWIST6:
      for (int i = 0; i < 3 && status == WM_OK; i++) {
        status = check_value(event.as.twist6.v_mps[i], kSpeedMost_mps);
        if (status == WM_OK) status = check_value(event.as.twist6.w_radps[i], kRateMost_radps);
      }
      break;
    default: return WM_UNSUPPORTED;
  }
  if (status == WM_OK && now_ns_ != WM_TIME_NONE && event.t_ns < now_ns_) return WM_TIME_RAN_BACK;
  return status;
}

void motion_front_end::feed(const wm_event &event) {
  if (now_ns_ == WM_TIME_NONE) now_ns_ = event.t_ns;
  yaw_fresh_ = 0;
  if (now_ns_ > fed_ns_ && history_.is_overdue(now_ns_)) went_on_without_ = 3;
  fed_ns_ = event.t_ns;
  if (event.kind == WM_EVENT_QUANTITIES) {
    take_quantities(event);
    return;
  }
  const bool planar = event.kind == WM_EVENT_TWIST2;
  const double v = planar ? event.as.twist2.v_mps : event.as.twist6.v_mps[0];
  const double rate = planar ? event.as.twist2.w_radps : event.as.twist6.w_radps[2];
  const double w = commands_ ? driven_rate(*params_, v, rate) : rate;
  choose_model(true);
  if (model_ != WM_MOTION_TWIST) return;
  const bool v_plausible = is_plausible_level(kTwistSpeed, event.t_ns, v);
  const bool w_plausible = is_plausible_level(kTwistRate, event.t_ns, w);
  const bool plausible = v_plausible && w_plausible;
  note_plausibility(event.t_ns, bit(kTwistSpeed), v_plausible);
  note_plausibility(event.t_ns, bit(kTwistRate), w_plausible);
  watch_standstill(event.t_ns, plausible && std::fabs(v) < params_->standstill_speed_mps &&
                                   std::fabs(w) < params_->standstill_yaw_rate_radps);
  const motion_input held = history_.empty() ? motion_input{} : history_.newest();
  if (plausible)
    push_input(event.t_ns, v, w, false, false);
  else
    push_input(event.t_ns, held.a, held.b, true, false);
}

void motion_front_end::take_quantities(const wm_event &event) {
  const wm_quantities &q = event.as.quantities;
  const bool frozen = (q.doubt & WM_DOUBT_FROZEN_COUNTER) != 0;
  health_ = frozen ? health_ | WM_MOTION_HEALTH_COUNTER_FROZEN : health_ & ~WM_MOTION_HEALTH_COUNTER_FROZEN;
  const bool doubt = frozen || !is_plausible(q, event.t_ns);
  uint32_t fresh = 0;
  for (int i = 0; i < q.count; i++) {
    const int id = q.id[i];
    fresh |= UINT32_C(1) << id;
    if (doubt) continue;  // what the message said before still holds; its noise grows
    if (id == WM_Q_WHEEL_TICKS_LEFT || id == WM_Q_WHEEL_TICKS_RIGHT) take_count(id, event.t_ns, q.value[i]);
    value_[id] = q.value[i];
    stamp_ns_[id] = event.t_ns;
  }
  choose_model(false);
  const auto has = [fresh](int first, int last) { return (fresh >> first & ((2u << (last - first)) - 1u)) != 0; };
  const bool ticks = has(WM_Q_WHEEL_TICKS_LEFT, WM_Q_WHEEL_TICKS_RIGHT);
  const bool speed = has(WM_Q_WHEEL_SPEED_FRONT_LEFT, WM_Q_VEHICLE_SPEED) || ticks;
  const bool steering = has(WM_Q_STEERING_WHEEL, WM_Q_STEERING_ACTUATOR);
  const bool rate = has(WM_Q_YAW_RATE, WM_Q_YAW_RATE);
  if (ticks && !doubt) watch_encoders();

  if (model_ == WM_MOTION_TICKS) {
    if (ticks) push_ticks(event.t_ns, frozen, doubt);
    return;
  }
  double v = 0.0;
  if (!read_speed(&v)) return;
  const bool still = watch_standstill(event.t_ns, std::fabs(v) < params_->standstill_speed_mps && !doubt);
  if (model_ == WM_MOTION_SPEED_YAW_RATE && (speed || rate)) {
    watch_yaw_rate(event.t_ns, v, rate && !doubt);
    yaw_fresh_ = rate && !doubt && still;
    const bool unsure = frozen || silent(WM_Q_YAW_RATE, event.t_ns) || (health_ & WM_MOTION_HEALTH_YAW_RATE_STUCK);
    push_input(event.t_ns, v, value_[WM_Q_YAW_RATE], unsure, doubt);
  } else if (model_ == WM_MOTION_ACKERMANN && (speed || steering)) {
    double angle = 0.0;
    if (read_road_wheel(&angle)) push_input(event.t_ns, v, angle, frozen, doubt);
  }
}

// Whether a message's values are plausible after those before them, and its counter against its stamp.
bool motion_front_end::is_plausible(const wm_quantities &q, wm_time_ns t_ns) {
  const bool wrong_counter = counter_is_wrong(q, t_ns);
  bool plausible = !wrong_counter;
  uint32_t slots = 0;
  for (int i = 0; i < q.count; i++) {
    const int id = q.id[i];
    const bool count = id == WM_Q_WHEEL_TICKS_LEFT || id == WM_Q_WHEEL_TICKS_RIGHT;
    note_period(id, t_ns, q.lost_before + 1);
    if (!count && !is_speed(id) && id != WM_Q_YAW_RATE) continue;
    slots |= bit(id);
    if (wrong_counter) continue;
    plausible &= count ? is_plausible_count(id, t_ns, q.value[i]) : is_plausible_level(id, t_ns, q.value[i]);
  }
  note_plausibility(t_ns, slots, plausible);
  return plausible;
}

bool motion_front_end::counter_is_wrong(const wm_quantities &q, wm_time_ns t_ns) const {
  if (q.lost_before == 0) return false;
  for (int i = 0; i < q.count; i++) {
    const int id = q.id[i];
    if (message_ns_[id] == WM_TIME_NONE || !(period_s_[id] > 0.0)) continue;
    const double due_s = kSkipFraction * (q.lost_before + 1) * period_s_[id];
    if (wm_seconds_between(message_ns_[id], t_ns) < due_s) return true;
  }
  return false;
}

void motion_front_end::note_period(int id, wm_time_ns t_ns, int frames) {
  const wm_time_ns last_ns = message_ns_[id];
  message_ns_[id] = t_ns;
  if (last_ns == WM_TIME_NONE) return;
  double &period_s = period_s_[id];
  const double each_s = wm_seconds_between(last_ns, t_ns) / frames;
  const double counted_s = period_s > 0.0 && each_s > 2.0 * period_s ? 2.0 * period_s : each_s;
  period_s += period_s > 0.0 ? kPeriodGain * (counted_s - period_s) : counted_s;
}

bool motion_front_end::is_plausible_count(int side, wm_time_ns t_ns, double count) {
  const double tick_m = kTwoPi * wheels_.radius_m / wheels_.ticks_per_turn;
  if (!(params_->limits_mps2 > 0.0) || !finite(tick_m)) return true;
  const plausibility verdict =
      check_[side].check_position(t_ns, count * tick_m, params_->limits_mps2, wheel_[side].period_s, tick_m);
  if (verdict == plausibility::new_run) wheel_[side].is_new_run = true;
  return verdict != plausibility::refused;
}

bool motion_front_end::is_plausible_level(int slot, wm_time_ns t_ns, double value) {
  const bool turn = slot == WM_Q_YAW_RATE || slot == kTwistRate;
  const double per_s = turn ? params_->limits_radps2 : params_->limits_mps2;
  if (!(per_s > 0.0)) return true;
  return check_[slot].check_level(t_ns, value, turn ? kRateStep_radps : kSpeedStep_mps, per_s) != plausibility::refused;
}

void motion_front_end::note_plausibility(wm_time_ns t_ns, uint32_t slots, bool plausible) {
  // A sensor that fell silent after a refusal is no longer refused, but silent.
  if (last_refusal_ns_ != WM_TIME_NONE && t_ns - last_refusal_ns_ > hold_max_ns_) refused_slots_ = 0;
  if (!plausible) {
    if (refused_slots_ == 0) refused_since_ns_ = newest_ns_ == WM_TIME_NONE ? t_ns : newest_ns_;
    refused_slots_ |= slots;
    last_refusal_ns_ = t_ns;
    health_ |= WM_MOTION_HEALTH_IMPLAUSIBLE;
    return;
  }
  refused_slots_ &= ~slots;
  if ((health_ & WM_MOTION_HEALTH_IMPLAUSIBLE) && wm_seconds_between(last_refusal_ns_, t_ns) > kShowRefusal_s)
    health_ &= ~WM_MOTION_HEALTH_IMPLAUSIBLE;
}

void motion_front_end::mark_refused(motion_input *input) const {
  if (refused_slots_ == 0) return;
  const uint32_t turn = bit(WM_Q_YAW_RATE) | bit(kTwistRate) | (model_ == WM_MOTION_TICKS ? kCountSlots : 0);
  const uint32_t speed = ~(bit(WM_Q_YAW_RATE) | bit(kTwistRate));
  input->refused = (uint8_t)((refused_slots_ & speed ? kRefusedSpeed : 0) | (refused_slots_ & turn ? kRefusedTurn : 0));
  input->refused_s = wm_seconds_between(refused_since_ns_, input->t_ns);
}

// The best model that the quantities seen so far allow, or the one that the config names.
void motion_front_end::choose_model(bool twist) {
  double ignored;
  const bool speed = read_speed(&ignored);
  const bool possible[] = {false, counts_ticks() && finite(wheels_.track_m), speed && seen(WM_Q_YAW_RATE),
                           speed && finite(wheels_.wheelbase_m) && read_road_wheel(&ignored), twist};
  const int wanted = params_->model;
  if (wanted != WM_MOTION_AUTO) {
    if (possible[wanted]) model_ = (uint8_t)wanted;
    return;
  }
  const int last = model_ == WM_MOTION_AUTO ? (int)WM_MOTION_TWIST : model_;
  for (int model = WM_MOTION_TICKS; model <= last; model++) {
    if (!possible[model]) continue;
    model_ = (uint8_t)model;
    return;
  }
}

double motion_front_end::by_gear(double value, bool is_signed) const {
  const bool reverse = seen(WM_Q_GEAR) && value_[WM_Q_GEAR] < 0.0;
  return reverse && !is_signed ? -value : value;
}

// The rear wheels' mean is base_link's own speed; ticks come next (no rounding), then what the dashboard is told, then
// the front wheels, which go a longer way in turns. A source that fell silent yields to the next.
bool motion_front_end::read_speed(double *speed_mps) {
  const auto mean_of = [this](int left, int right, double *out) {
    const wm_time_ns now = now_ns_;
    const bool l = seen(left) && !silent(left, now), r = seen(right) && !silent(right, now);
    if (l || r) *out = l && r ? 0.5 * (value_[left] + value_[right]) : value_[l ? left : right];
    return l || r;
  };
  double speed = 0.0;
  uint8_t source = kNone;
  if (mean_of(WM_Q_WHEEL_SPEED_REAR_LEFT, WM_Q_WHEEL_SPEED_REAR_RIGHT, &speed)) {
    source = kRearWheels;
  } else if (counts_ticks()) {
    speed = mean_of_wheels(wheel_[0].speed_mps, wheel_[1].speed_mps);
    source = kTicksMean;
  } else if (mean_of(WM_Q_VEHICLE_SPEED, WM_Q_VEHICLE_SPEED, &speed)) {
    source = kVehicleSpeed;
  } else if (mean_of(WM_Q_WHEEL_SPEED_FRONT_LEFT, WM_Q_WHEEL_SPEED_FRONT_RIGHT, &speed)) {
    source = kFrontWheels;
  }
  if (source == kNone) return false;
  if (source != speed_source_) {
    speed_source_changed_ |= speed_source_ != kNone;
    speed_source_ = source;
  }
  if (source != kTicksMean) {
    speed_is_signed_ |= speed < kSignedBelow;
    speed = by_gear(speed, speed_is_signed_);
  }
  *speed_mps = speed;
  return true;
}

bool motion_front_end::read_road_wheel(double *angle_rad) const {
  if (seen(WM_Q_ROAD_WHEEL)) {
    *angle_rad = value_[WM_Q_ROAD_WHEEL];
    return std::fabs(*angle_rad) < 1.5;
  }
  if (seen(WM_Q_STEERING_ACTUATOR) && wheels_.steering_table_count >= 2) {
    const double *x = wheels_.actuator_m;
    const double *y = wheels_.road_wheel_rad;
    const double position = value_[WM_Q_STEERING_ACTUATOR];
    uint32_t i = 0;
    while (i + 2 < wheels_.steering_table_count && position > x[i + 1]) i++;
    double share = (position - x[i]) / (x[i + 1] - x[i]);
    share = share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;  // the actuator has an end at either side
    *angle_rad = y[i] + share * (y[i + 1] - y[i]);
    return finite(*angle_rad);
  }
  if (seen(WM_Q_STEERING_WHEEL) && finite(wheels_.steering_ratio)) {
    *angle_rad = value_[WM_Q_STEERING_WHEEL] / wheels_.steering_ratio;
    return std::fabs(*angle_rad) < 1.5;
  }
  return false;
}

bool motion_front_end::watch_standstill(wm_time_ns t_ns, bool still) {
  if (!still) {
    still_since_ns_ = WM_TIME_NONE;
    return false;
  }
  if (still_since_ns_ == WM_TIME_NONE) still_since_ns_ = t_ns;
  return wm_seconds_between(still_since_ns_, t_ns) >= params_->standstill_after_s;
}

// `doubtful`: what holds from here on; `miscounted`: the counts of the stretch that ends here.
void motion_front_end::push_input(wm_time_ns t_ns, double a, double b, bool doubtful, bool miscounted) {
  motion_input input{};
  input.t_ns = t_ns;
  input.a = a;
  input.b = b;
  input.model = model_;
  input.command = model_ == WM_MOTION_TWIST && commands_;
  input.doubtful = doubtful;
  mark_refused(&input);
  input.standing = still_since_ns_ != WM_TIME_NONE && !doubtful && !input.refused &&
                   wm_seconds_between(still_since_ns_, t_ns) >= params_->standstill_after_s;
  if (ticks_drive()) {
    // The stretch that ends here gets what the counts say, before the last speed carries on.
    const double dt = wm_seconds_between(now_ns_, t_ns);
    const bool counted = wheel_[0].t_ns == t_ns || wheel_[1].t_ns == t_ns;
    forget_silent_way(t_ns, dt);
    if (dt > 0.0 && !miscounted) {
      motion_input done = input;
      done.t_ns = now_ns_;
      done.a =
          mean_of_wheels(wheel_[0].position_m - wheel_[0].integrated_m, wheel_[1].position_m - wheel_[1].integrated_m) /
          dt;
      if (counted) {
        done.b = history_.empty() ? b : history_.newest().b;
        if (history_.is_overdue(t_ns)) done.b = counted_turn_rate();  // a gyro's rate of long ago says less
        done.standing = input.standing && !history_.empty() && history_.newest().standing;
        done.counted = 1;
        history_.push(done);
      }
    }
  }
  history_.push(input);
  newest_ns_ = t_ns;
}

// How fast the robot turned between the last two counts by the wheels' difference; 0 if that can't be told.
double motion_front_end::counted_turn_rate() const {
  const uint32_t dead = WM_MOTION_HEALTH_ENCODER_LEFT_DEAD | WM_MOTION_HEALTH_ENCODER_RIGHT_DEAD;
  const tick_wheel &left = wheel_[0], &right = wheel_[1];
  if (!finite(wheels_.track_m) || (health_ & dead) || left.t_ns != right.t_ns || left.before_ns == WM_TIME_NONE ||
      left.before_ns != right.before_ns)
    return 0.0;
  const double more_m = right.position_m - right.before_m - (left.position_m - left.before_m);
  return more_m / wheels_.track_m / wm_seconds_between(left.before_ns, left.t_ns);
}

bool motion_front_end::standstill_yaw_rate(double *yaw_rate_radps) const {
  *yaw_rate_radps = value_[WM_Q_YAW_RATE];
  return yaw_fresh_ != 0;
}

bool motion_front_end::speed_source_changed() {
  const bool changed = speed_source_changed_ != 0;
  speed_source_changed_ = 0;
  return changed;
}

wm_time_ns motion_front_end::lag_of(const wm_motion_calibration &calibration) const {
  return ticks_drive() ? 0 : wm_ns_from_seconds(calibration.value[kLag]);
}

motion_twist motion_front_end::twist_at(wm_time_ns t_ns, const wm_motion_calibration &calibration) const {
  motion_twist out{};
  walk(t_ns, t_ns + 1, calibration,
       [&out](const motion_stretch &, const motion_twist &twist, const motion_noise &) { out = twist; });
  return out;
}

// The same bits for long while driving: a gyro's noise never stands still. Sooner where steering or wheels see a turn.
void motion_front_end::watch_yaw_rate(wm_time_ns t_ns, double speed_mps, bool fresh) {
  if (!fresh) return;
  double other = 0.0;
  const bool compare = read_other_turn_rate(speed_mps, &other);
  const double yaw = value_[WM_Q_YAW_RATE];
  if (yaw != yaw_last_ || std::fabs(speed_mps) < kDrivingSpeed || yaw_same_since_ns_ == WM_TIME_NONE) {
    yaw_last_ = yaw;
    yaw_same_since_ns_ = t_ns;
    yaw_other_min_ = yaw_other_max_ = other;
    health_ &= ~WM_MOTION_HEALTH_YAW_RATE_STUCK;
    return;
  }
  if (other < yaw_other_min_) yaw_other_min_ = other;
  if (other > yaw_other_max_) yaw_other_max_ = other;
  const double same_s = wm_seconds_between(yaw_same_since_ns_, t_ns);
  const bool turned = compare && yaw_other_max_ - yaw_other_min_ > kYawStuckRate;
  if (same_s > kYawStuckAlone_s || (turned && same_s > kYawStuckAgainst_s)) health_ |= WM_MOTION_HEALTH_YAW_RATE_STUCK;
}

bool motion_front_end::read_other_turn_rate(double speed_mps, double *rate_radps) const {
  double angle;
  if (finite(wheels_.wheelbase_m) && read_road_wheel(&angle)) {
    *rate_radps = speed_mps * tan(angle) / wheels_.wheelbase_m;
    return true;
  }
  if (finite(wheels_.track_m) && seen(WM_Q_WHEEL_SPEED_REAR_LEFT) && seen(WM_Q_WHEEL_SPEED_REAR_RIGHT)) {
    *rate_radps = (value_[WM_Q_WHEEL_SPEED_REAR_RIGHT] - value_[WM_Q_WHEEL_SPEED_REAR_LEFT]) / wheels_.track_m;
    return true;
  }
  return false;
}

// ---- ticks ----

bool motion_front_end::counts_ticks() const {
  return wheel_[0].t_ns != WM_TIME_NONE && wheel_[1].t_ns != WM_TIME_NONE && finite(wheels_.radius_m) &&
         finite(wheels_.ticks_per_turn) && wheels_.ticks_per_turn > 0.0;
}

double motion_front_end::mean_of_wheels(double left, double right) const {
  const bool left_dead = health_ & WM_MOTION_HEALTH_ENCODER_LEFT_DEAD;
  const bool right_dead = health_ & WM_MOTION_HEALTH_ENCODER_RIGHT_DEAD;
  if (left_dead != right_dead) return left_dead ? right : left;
  return 0.5 * (left + right);
}

bool motion_front_end::ticks_drive() const {
  return model_ == WM_MOTION_TICKS ||
         (speed_source_ == kTicksMean && (model_ == WM_MOTION_SPEED_YAW_RATE || model_ == WM_MOTION_ACKERMANN));
}

void motion_front_end::take_count(int side, wm_time_ns t_ns, double count) {
  tick_wheel &wheel = wheel_[side];
  if (wheel.t_ns == WM_TIME_NONE) {
    wheel.restart(t_ns, count);
    return;
  }
  const wm_time_ns last_ns = wheel.t_ns;
  const double dt = wm_seconds_between(last_ns, t_ns);
  if (dt <= 0.0) return;
  const double metres_per_tick = kTwoPi * wheels_.radius_m / wheels_.ticks_per_turn;
  double way = (count - wheel.ticks) * metres_per_tick;
  wheel.ticks = count;
  wheel.t_ns = t_ns;
  if (way < 0.0 && !wheel.is_new_run) wheel.is_signed = true;
  way = by_gear(way, wheel.is_signed);
  // A count that was late and the next one right behind it: their stamps tell nothing of the speed between them.
  const bool hasty = dt < 0.5 * wheel.period_s;
  const double least_s = hasty ? wheel.period_s : dt;
  // The counter began anew: go on as before.
  if (wheel.is_new_run || !(std::fabs(way) <= kSpeedMost_mps * least_s)) way = wheel.speed_mps * dt;
  wheel.is_new_run = false;
  const uint32_t dead = side == 0 ? WM_MOTION_HEALTH_ENCODER_LEFT_DEAD : WM_MOTION_HEALTH_ENCODER_RIGHT_DEAD;
  if (way != 0.0 && (health_ & dead)) wheel.integrated_m = wheel.position_m;  // what it missed, the other one told
  const double from_m = wheel.position_m;
  wheel.position_m += way;
  if (!hasty)
    wheel.speed_mps = way / dt;
  else if (wheel.before_ns != WM_TIME_NONE)
    wheel.speed_mps = (wheel.position_m - wheel.before_m) / wm_seconds_between(wheel.before_ns, t_ns);
  wheel.before_ns = last_ns;
  wheel.before_m = from_m;
  const bool was_silent = wheel.period_s > 0.0 && dt > 2.0 * wheel.period_s;
  const double counted_s = was_silent ? 2.0 * wheel.period_s : dt;
  wheel.period_s += wheel.period_s > 0.0 ? kPeriodGain * (counted_s - wheel.period_s) : counted_s;
  tick_wheel &other = wheel_[1 - side];
  if (way != 0.0) {
    wheel.still_m = 0.0;
    if (!was_silent) other.still_m += std::fabs(way);  // the way of a silence, which both may have driven
  }
}

void motion_front_end::watch_encoders() {
  const bool car = finite(wheels_.wheelbase_m);
  const double pivot = kTwoPi * (finite(wheels_.track_m) ? wheels_.track_m : 1.0);
  const double limit = car ? kDeadEncoderCar_m : kDeadEncoderTurns * pivot;
  const uint32_t flags[2] = {WM_MOTION_HEALTH_ENCODER_LEFT_DEAD, WM_MOTION_HEALTH_ENCODER_RIGHT_DEAD};
  for (int side = 0; side < 2; side++) {
    const bool dead = wheel_[side].still_m > limit;
    health_ = dead ? health_ | flags[side] : health_ & ~flags[side];
  }
}

// The stretch that ends here gets what the counts say; from here on the last speeds carry on. A dead encoder's wheel is
// taken to go with the other one, and the turn is not to be believed.
void motion_front_end::push_ticks(wm_time_ns t_ns, bool doubtful, bool miscounted) {
  const double dt = wm_seconds_between(now_ns_, t_ns);
  forget_silent_way(t_ns, dt);
  const bool dead[2] = {(health_ & WM_MOTION_HEALTH_ENCODER_LEFT_DEAD) != 0,
                        (health_ & WM_MOTION_HEALTH_ENCODER_RIGHT_DEAD) != 0};
  motion_input done{}, next{};
  double done_mps[2], next_mps[2];
  for (int side = 0; side < 2; side++) {
    const tick_wheel &wheel = wheel_[side];
    const bool counted = wheel.t_ns == t_ns && dt > 0.0 && !miscounted;
    done_mps[side] = counted ? (wheel.position_m - wheel.integrated_m) / dt : wheel.speed_mps;
    next_mps[side] = wheel.speed_mps;
  }
  for (int side = 0; side < 2; side++) {
    if (!dead[side] || dead[1 - side]) continue;
    done_mps[side] = done_mps[1 - side];
    next_mps[side] = next_mps[1 - side];
  }
  next.t_ns = t_ns;
  next.a = next_mps[0];
  next.b = next_mps[1];
  next.model = model_;
  next.doubtful = doubtful || dead[0] || dead[1];
  mark_refused(&next);
  done = next;
  done.t_ns = now_ns_;
  done.a = done_mps[0];
  done.b = done_mps[1];
  done.counted = wheel_[0].t_ns == t_ns && wheel_[1].t_ns == t_ns && !miscounted;
  if (dt > 0.0) history_.push(done);
  history_.push(next);
  newest_ns_ = t_ns;
}

// What the counts say of a silence that the pose went through without them: it has been corrected since by what was
// seen, and as unsure as the robot may have moved. The way once more, at the end, would move it twice. What is left is
// the way of the stretch that ends here, at the mean speed since the last count.
void motion_front_end::forget_silent_way(wm_time_ns t_ns, double dt_s) {
  for (int side = 0; side < 2; side++) {
    tick_wheel &wheel = wheel_[side];
    if (wheel.t_ns != t_ns || !(went_on_without_ >> side & 1)) continue;
    wheel.integrated_m = wheel.position_m - wheel.speed_mps * dt_s;
    went_on_without_ &= (uint8_t) ~(1 << side);
  }
}

void motion_front_end::hand_out_ticks(const motion_stretch &piece) {
  const bool both = piece.input.model == WM_MOTION_TICKS;
  wheel_[0].integrated_m += piece.input.a * piece.dt_s;
  wheel_[1].integrated_m += (both ? piece.input.b : piece.input.a) * piece.dt_s;
}

}  // namespace wm
