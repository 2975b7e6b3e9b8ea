// SPDX-License-Identifier: Apache-2.0
#include "motion/spatial_source.hpp"

#include <cstring>

#include "math/elementary.hpp"
#include "motion/event_time.hpp"

namespace wm {
namespace {

// An IMU whose values are older is silent: its period is 0.02 s or less. A twist is overdue after as long, or after one
// of its own periods. Not swept.
constexpr double kAlive_s = 0.25, kOverdue_s = 0.2;
// A stuck axis repeats its value so many times as often as ever before. A run of r repeats has the probability p^r, and
// the longest of n runs is about log n / -log p: four times as many repeats come with n^-4, 2e-10 for the least n here.
constexpr int64_t kTimesLongest = 4, kValuesLeast = 256;
// One that repeats from the beginning: for so long, while another axis of its sensor gives other bits. Not swept.
constexpr double kStuckBeside_s = 10.0;
constexpr double kPeriodGain = 1.0 / 16.0;  // of the average of the twists' period
constexpr double kMean_s = 1.0;             // of the twist by which a body stands: a log's noise is below a third then

}  // namespace

void spatial_source::init(double hold_max_s, const spatial_rest &rest) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  hold_max_s_ = hold_max_s;
  rest_ = rest;
  twist_ns_ = WM_TIME_NONE;
  for (wm_time_ns &t_ns : imu_ns_) t_ns = WM_TIME_NONE;
  for (axis_watch &w : watch_) w.since_ns = WM_TIME_NONE;
}

bool spatial_source::are_alive(int first, wm_time_ns t_ns) const {
  for (int i = first; i < first + 3; i++)
    if (imu_ns_[i] == WM_TIME_NONE || wm_seconds_between(imu_ns_[i], t_ns) > kAlive_s) return false;
  return true;
}

// A constant value is no fault of a sensor whose steps are coarse, or that shows zero below a threshold, while the body
// stands. A gyro that shows a turn does not stand.
bool spatial_source::may_stand(int axis, double value) const {
  if (axis < 3 && std::fabs(value) > rest_.w_radps) return false;
  if (twist_ns_ == WM_TIME_NONE) return stands_ != 0;
  const auto rests = [this](const spatial_twist &t) {
    return length(t.v) < rest_.v_mps && length(t.w) < rest_.w_radps;
  };
  return rests(twist_) || rests(mean_);  // the mean follows a stop late, and one sample may lie beside it
}

void spatial_source::watch_axis(int axis, wm_time_ns t_ns, double value) {
  axis_watch &w = watch_[axis];
  const uint32_t bit = 1u << axis;
  const bool changed = !w.repeats(value), gyro = axis < 3;
  if (changed) {
    if (!(stuck_ & bit) && w.samples > w.longest) w.longest = w.samples;
    w.values++;
    w.samples = 0;
    stuck_ &= ~bit;
  }
  w.samples++;
  if (changed || (may_stand(axis, value) && !(stuck_ & bit))) {
    w.begin(value, t_ns);
    w.in_motion = 0;
    return;
  }
  w.in_motion++;
  const double dt_s = w.go_on(t_ns, length(twist_.v));
  if (gyro && twist_has_rates_) w.apart_rad += (twist_.w[axis] - value) * dt_s;
  if ((stuck_ & bit) || !is_stuck(axis, t_ns)) return;
  stuck_ |= bit;
  if (gyro) note_missed(axis, t_ns);
}

bool spatial_source::is_stuck(int axis, wm_time_ns t_ns) const {
  const axis_watch &w = watch_[axis];
  const bool improbable = w.same_s() > kAlive_s && w.values >= kValuesLeast && w.in_motion > kTimesLongest * w.longest;
  const int first = axis < 3 ? 0 : 3;
  bool others_move = false;
  for (int i = first; i < first + 3; i++)
    others_move |= i != axis && watch_[i].since_ns != WM_TIME_NONE && watch_[i].samples < kTimesLongest &&
                   wm_seconds_between(watch_[i].since_ns, t_ns) < kAlive_s;
  return improbable || w.is_stuck_against(0.0) || w.is_stuck_alone() || (w.same_s() > kStuckBeside_s && others_move);
}

// Since its last new value the axis measured nothing: the turn by the twist differs from its own by `apart_rad`, and by
// what the twist does not show; without a twist's rate it is unknown.
void spatial_source::note_missed(int axis, wm_time_ns t_ns) {
  const axis_watch &w = watch_[axis];
  const double since_s = wm_seconds_between(w.since_ns, t_ns);
  missed_rad2_[axis] +=
      twist_has_rates_ ? square(w.apart_rad) + square(rest_.w_radps * since_s) : square(kUnmeasured_radps) * since_s;
  if (since_s > missed_since_s_) missed_since_s_ = since_s;
}

bool spatial_source::take_missed(double turn_rad2[3], double *since_s) {
  if (!(missed_since_s_ > 0.0)) return false;
  *since_s = missed_since_s_;
  missed_since_s_ = 0.0;
  for (int i = 0; i < 3; i++) {
    turn_rad2[i] = missed_rad2_[i];
    missed_rad2_[i] = 0.0;
  }
  return true;
}

void spatial_source::note_imu(const wm_event &event) {
  static constexpr int kOf[kImu] = {WM_Q_ROLL_RATE,      WM_Q_PITCH_RATE,     WM_Q_YAW_RATE,
                                    WM_Q_ACCELERATION_X, WM_Q_ACCELERATION_Y, WM_Q_ACCELERATION_Z};
  const wm_quantities &q = event.as.quantities;
  uint32_t came = 0;
  for (int i = 0; i < q.count; i++)
    for (int k = 0; k < kImu; k++) {
      if (q.id[i] != kOf[k]) continue;
      watch_axis(k, event.t_ns, q.value[i]);
      imu_[k] = q.value[i];
      imu_ns_[k] = event.t_ns;
      came |= 1u << k;
    }
  if ((came & 7u) && are_alive(0, event.t_ns)) fresh_ |= kFreshRates;
  if ((came & 32u) && are_alive(3, event.t_ns) && stuck_forces() == 0) fresh_ |= kFreshForce;
}

// Of a log without rates the turn is the gyro's, or unknown.
spatial_twist spatial_source::twist_of(const wm_event &event) const {
  const wm_twist6 &twist = event.as.twist6;
  const vec3 own = has_rates(twist) ? vec_of(twist.w_radps) : vec3{0, 0, 0};
  vec3 w = own;
  if (are_alive(0, event.t_ns))
    for (int i = 0; i < 3; i++) w[i] = stuck_ & (1u << i) ? own[i] : imu_[i];
  return {velocity_of_base(twist, w), own};
}

void spatial_source::note_twist(wm_time_ns t_ns, const spatial_twist &twist) {
  if (twist_ns_ != WM_TIME_NONE && t_ns > twist_ns_) {
    const double dt = wm_seconds_between(twist_ns_, t_ns);
    const bool follows = dt <= hold_max_s_;
    velocity_change_ = follows ? twist.v - twist_.v : vec3{0, 0, 0};
    rate_change_ = follows ? twist.w - twist_.w : vec3{0, 0, 0};
    const double share = dt / (dt + kMean_s);
    mean_ = {mean_.v + share * (twist.v - mean_.v), mean_.w + share * (twist.w - mean_.w)};
    if (follows) twist_period_s_ += twist_period_s_ > 0.0 ? kPeriodGain * (dt - twist_period_s_) : dt;
  }
  if (twist_ns_ == WM_TIME_NONE) mean_ = twist;
  if (lacks_rates_) twist_has_rates_ = 0;
  twist_has_rates_ |= twist.w.x != 0.0 || twist.w.y != 0.0 || twist.w.z != 0.0;
  twist_ns_ = t_ns;
  twist_ = twist;
}

bool spatial_source::take(const wm_event &event, spatial_twist *now) {
  fresh_ = 0;
  const bool quantities = event.kind == WM_EVENT_QUANTITIES, in_space = event.kind == WM_EVENT_TWIST6;
  if (in_space) *now = twist_of(event);
  if (quantities) {
    note_imu(event);
  } else if (event.kind != WM_EVENT_INCREMENT) {
    lacks_rates_ = in_space && !has_rates(event.as.twist6);
    v_sigma_mps_[1] = v_sigma_mps_[0];
    v_sigma_mps_[0] = in_space && event.as.twist6.v_sigma_mps > 0.0 ? event.as.twist6.v_sigma_mps : 0.0;
    note_twist(event.t_ns, *now);
  }
  by_gyro_ = are_alive(0, event.t_ns);
  if (!by_gyro_) return true;
  had_gyro_ = 1;
  if (quantities && !rates_are_fresh()) return false;
  if (quantities && twist_ns_ != WM_TIME_NONE)
    now->v = wm_seconds_between(twist_ns_, event.t_ns) > hold_max_s_ ? vec3{0, 0, 0} : twist_.v;
  for (int i = 0; i < 3; i++) now->w[i] = stuck_ & (1u << i) ? twist_.w[i] : imu_[i];
  return true;
}

double spatial_source::overdue_s() const { return twist_period_s_ > kOverdue_s ? twist_period_s_ : kOverdue_s; }

bool spatial_source::velocity_is_known(wm_time_ns t_ns) const {
  return twist_ns_ != WM_TIME_NONE && wm_seconds_between(twist_ns_, t_ns) <= overdue_s();
}

double spatial_source::unmeasured_s3(double dt_s, wm_time_ns end_ns) const {
  if (!is_held()) return 0.0;
  const double overdue = overdue_s(), hold = hold_max_s_ > overdue ? hold_max_s_ : overdue;
  const double end = wm_seconds_between(twist_ns_, end_ns), begin = end - dt_s;
  const double from = begin > overdue ? begin : overdue, to = end < hold ? end : hold;
  double s3 = to > from ? (to * to * to - from * from * from) / 3.0 : 0.0;
  if (end > hold) s3 += square(hold) * (end - (begin > hold ? begin : hold));
  return s3;
}

}  // namespace wm
