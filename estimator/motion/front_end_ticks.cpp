// SPDX-License-Identifier: Apache-2.0
// The motion front end's wheel counters: counts as positions, dead encoders, counts after a gap.
#include "math/elementary.hpp"
#include "motion/front_end.hpp"

namespace wm {
namespace {

// A differential robot may pivot about one wheel, but not for more than a turn; a car's inner wheel never rests while
// the outer one rolls so far. Not swept.
constexpr double kDeadEncoderCar_m = 1.0;
constexpr double kDeadEncoderTurns = 1.0;
// A count that comes earlier than this fraction of the usual time is one of a burst.
constexpr double kBurstFraction = 0.5;
// Later than so many periods it ends a gap.
constexpr double kGapPeriods = 2.0;
// A distance below this is rounding, not one that is still to be given out.
constexpr double kRounding_m = 1e-9;

}  // namespace

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
  double moved_m = (count - wheel.ticks) * metres_per_tick;
  wheel.ticks = count;
  wheel.t_ns = t_ns;
  if (moved_m < 0.0 && !wheel.is_new_run) wheel.is_signed = true;
  moved_m = by_gear(moved_m, wheel.is_signed);
  // A late count and the next one right behind it: the interval between their stamps gives no speed.
  const bool burst = dt < kBurstFraction * wheel.period_s;
  const double least_s = burst ? wheel.period_s : dt;
  // The counter began anew: the last speed holds.
  if (wheel.is_new_run || !(std::fabs(moved_m) <= kSpeedMost_mps * least_s)) moved_m = wheel.speed_mps * dt;
  wheel.is_new_run = false;
  const uint32_t dead = side == 0 ? WM_MOTION_HEALTH_ENCODER_LEFT_DEAD : WM_MOTION_HEALTH_ENCODER_RIGHT_DEAD;
  if (moved_m != 0.0 && (health_ & dead)) wheel.integrated_m = wheel.position_m;  // the other one has filled in
  const double from_m = wheel.position_m;
  wheel.position_m += moved_m;
  if (!burst)
    wheel.speed_mps = moved_m / dt;
  else if (wheel.before_ns != WM_TIME_NONE)
    wheel.speed_mps = (wheel.position_m - wheel.before_m) / wm_seconds_between(wheel.before_ns, t_ns);
  wheel.before_ns = last_ns;
  wheel.before_m = from_m;
  const bool gap = wheel.period_s > 0.0 && dt > kGapPeriods * wheel.period_s;
  wheel.note_steady(gap);
  const double counted_s = gap ? kGapPeriods * wheel.period_s : dt;
  wheel.period_s += wheel.period_s > 0.0 ? kPeriodGain * (counted_s - wheel.period_s) : counted_s;
  tick_wheel &other = wheel_[1 - side];
  if (moved_m != 0.0) {
    wheel.still_m = 0.0;
    if (!gap) other.still_m += std::fabs(moved_m);  // both may have rolled in a gap
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

// The segment that ends here gets the counted distances; from here on the last speeds hold. A dead encoder's wheel is
// taken to roll like the other one, and the turn is doubtful.
void motion_front_end::push_ticks(wm_time_ns t_ns, bool doubtful, bool miscounted) {
  const double dt = wm_seconds_between(now_ns_, t_ns);
  drop_silent_distance(t_ns, dt);
  const bool dead[2] = {(health_ & WM_MOTION_HEALTH_ENCODER_LEFT_DEAD) != 0,
                        (health_ & WM_MOTION_HEALTH_ENCODER_RIGHT_DEAD) != 0};
  motion_input done{}, next{};
  double done_mps[2], next_mps[2];
  for (int side = 0; side < 2; side++) {
    const tick_wheel &wheel = wheel_[side];
    const double left_m = wheel.position_m - wheel.integrated_m;
    const bool counted = wheel.t_ns == t_ns && dt > 0.0 && !miscounted;
    // Its count came at the stamp of the other wheel's, in an event of its own: nothing was left of that segment.
    const bool owed = wheel.t_ns == now_ns_ && dt > 0.0 && !miscounted && std::fabs(left_m) > kRounding_m;
    done_mps[side] = counted ? left_m / dt : owed ? wheel.speed_mps + left_m / dt : wheel.speed_mps;
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
  note_steady(&next);
  done = next;
  done.steady_after_s = 0.0F;
  done.t_ns = now_ns_;
  done.a = done_mps[0];
  done.b = done_mps[1];
  done.counted = wheel_[0].t_ns == t_ns && wheel_[1].t_ns == t_ns && !miscounted;
  if (dt > 0.0 && !counts_wrapped()) history_.push(done);
  history_.push(next);
  newest_ns_ = t_ns;
}

// Drops the distance counted over a gap in which the pose was carried on without counts: observations have corrected it
// since, and its covariance has grown by the possible motion. What is left is the distance of the segment that ends
// here, at the mean speed since the last count.
void motion_front_end::drop_silent_distance(wm_time_ns t_ns, double dt_s) {
  for (int side = 0; side < 2; side++) {
    tick_wheel &wheel = wheel_[side];
    if (wheel.t_ns != t_ns || !(observed_without_ >> side & 1)) continue;
    wheel.integrated_m = wheel.position_m - wheel.speed_mps * dt_s;
    observed_without_ &= (uint8_t) ~(1 << side);
  }
}

// How far the wheels turned in a silence is unknown: the speeds before hold, then the motion is unknown, and the
// covariance has it. The counts go on from here.
void motion_front_end::take_wrapped(const wm_quantities &q, wm_time_ns t_ns) {
  wrapped_ns_ = t_ns;
  observed_without_ = 3;
  for (int i = 0; i < q.count; i++) {
    const int side = q.id[i];
    if (!is_count(side)) continue;
    check_[side] = {};
    if (wheel_[side].t_ns == WM_TIME_NONE)
      wheel_[side].restart(t_ns, q.value[i]);
    else
      wheel_[side].go_on_from(t_ns, q.value[i]);
    observed_without_ &= (uint8_t) ~(1 << side);
  }
  history_.uncount_newest();
}

void motion_front_end::drop_wrapped_distance() {
  for (tick_wheel &wheel : wheel_)
    if (wheel.t_ns == wrapped_ns_) wheel.integrated_m = wheel.position_m;
}

// The wheels drive singly from here on: what is left of their mean distance is left of each.
void motion_front_end::leave_gyro() {
  const double left_m =
      mean_of_wheels(wheel_[0].position_m - wheel_[0].integrated_m, wheel_[1].position_m - wheel_[1].integrated_m);
  for (tick_wheel &wheel : wheel_) wheel.integrated_m = wheel.position_m - left_m;
}

// A count is a position whose error is evenly distributed over a step, variance step^2 / 12; a speed is a difference of
// two.
void motion_front_end::count_noise(double *speed_mps, double *turn_rate_radps) const {
  *speed_mps = *turn_rate_radps = 0.0;
  if (!ticks_drive() || !(wheel_[0].period_s > 0.0)) return;
  const double wheel_mps = kTwoPi * wheels_.radius_m / wheels_.ticks_per_turn / (std::sqrt(6.0) * wheel_[0].period_s);
  *speed_mps = wheel_mps / std::sqrt(2.0);
  if (model_ == WM_MOTION_TICKS) *turn_rate_radps = wheel_mps * std::sqrt(2.0) / wheels_.track_m;
}

// Of the newest count, carried on by the speed, which is its difference to the one before: e1 + u (e1 - e0) after u
// periods. The error does not grow with the way: the next count replaces it. Before the newest count: that of a count.
void motion_front_end::count_variances(wm_time_ns t_ns, double *way_m2, double *turn_rad2) const {
  double speed_mps, turn_rate_radps;
  count_noise(&speed_mps, &turn_rate_radps);
  *way_m2 = *turn_rad2 = 0.0;
  if (!(speed_mps > 0.0) || wheel_[0].t_ns == WM_TIME_NONE) return;
  const double period_s = wheel_[0].period_s, since = wm_seconds_between(wheel_[0].t_ns, t_ns) / period_s;
  // Counts that are missing for longer are a silence, whose noise is the motion's own
  // (planar_motion::add_overdue_noise).
  const double u = since < 0.0 ? 0.0 : since > kCarriedPeriods ? kCarriedPeriods : since;
  const double share = 0.5 * (square(1.0 + u) + square(u));
  *way_m2 = share * square(speed_mps * period_s);
  *turn_rad2 = share * square(turn_rate_radps * period_s);
}

// The counts' own speed holds for some periods, then the steady one.
void motion_front_end::note_steady(motion_input *input) const {
  if (!ticks_drive() || input->doubtful || input->refused || wheel_[0].t_ns == WM_TIME_NONE) return;
  if (!(wheel_[0].period_s > 0.0)) return;
  const double left = wheel_[0].steady_mps, right = wheel_[1].steady_mps;
  const bool both = model_ == WM_MOTION_TICKS;
  const double steady[2] = {both ? left : mean_of_wheels(left, right), both ? right : input->b};
  const double after_s = kCarriedPeriods * wheel_[0].period_s - wm_seconds_between(wheel_[0].t_ns, input->t_ns);
  if (after_s > 0.0) {
    input->steady_after_s = static_cast<float>(after_s);
    for (int i = 0; i < 2; i++) input->steady[i] = steady[i];
  } else {
    input->a = steady[0];
    input->b = steady[1];
  }
}

void motion_front_end::note_integrated(const motion_segment &segment) {
  const bool both = segment.input.model == WM_MOTION_TICKS;
  wheel_[0].integrated_m += segment.input.a * segment.dt_s;
  wheel_[1].integrated_m += (both ? segment.input.b : segment.input.a) * segment.dt_s;
}

// Turn rate between the last two counts by the wheels' difference; 0 where it is not known.
double motion_front_end::counted_turn_rate() const {
  const uint32_t dead = WM_MOTION_HEALTH_ENCODER_LEFT_DEAD | WM_MOTION_HEALTH_ENCODER_RIGHT_DEAD;
  const tick_wheel &left = wheel_[0], &right = wheel_[1];
  if (!finite(wheels_.track_m) || (health_ & dead) || left.t_ns != right.t_ns || left.before_ns == WM_TIME_NONE ||
      left.before_ns != right.before_ns)
    return 0.0;
  const double more_m = right.position_m - right.before_m - (left.position_m - left.before_m);
  return more_m / wheels_.track_m / wm_seconds_between(left.before_ns, left.t_ns);
}

}  // namespace wm
