// SPDX-License-Identifier: Apache-2.0
#include "motion/spatial_source.hpp"

#include <cstring>

#include "math/elementary.hpp"

namespace wm {
namespace {

// An IMU whose values are older is silent: its period is 0.02 s or less. A twist is overdue after as long, or after one
// of its own periods. Not swept.
constexpr double kAlive_s = 0.25, kOverdue_s = 0.2;
// A stuck axis: the same bits for so long, while the twist's own rate turns away from it by so much; or, for so long,
// while another axis gives other bits. A gyro's noise moves its last bits within seconds. Not swept.
constexpr double kStuckAgainst_s = 3.0, kStuckAgainst_rad = 0.3, kStuckAlone_s = 10.0;
constexpr double kPeriodGain = 1.0 / 16.0;  // of the average of the twists' period

}  // namespace

void spatial_source::init(double hold_max_s) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  hold_max_s_ = hold_max_s;
  twist_ns_ = WM_TIME_NONE;
  for (wm_time_ns &t_ns : imu_ns_) t_ns = WM_TIME_NONE;
  for (axis_watch &w : watch_) w.since_ns = WM_TIME_NONE;
}

bool spatial_source::are_alive(int first, wm_time_ns t_ns) const {
  for (int i = first; i < first + 3; i++)
    if (imu_ns_[i] == WM_TIME_NONE || wm_seconds_between(imu_ns_[i], t_ns) > kAlive_s) return false;
  return true;
}

// A stuck axis keeps its bits; the others go on.
void spatial_source::watch_axis(int axis, wm_time_ns t_ns, double rate_radps) {
  axis_watch &w = watch_[axis];
  const uint32_t bit = 1u << axis;
  if (w.since_ns == WM_TIME_NONE || rate_radps != imu_[axis]) {
    w = {t_ns, t_ns, 0.0};
    stuck_ &= ~bit;
    return;
  }
  if (twist_has_rates_) w.apart_rad += (twist_.w[axis] - rate_radps) * wm_seconds_between(w.until_ns, t_ns);
  w.until_ns = t_ns;
  const double same_s = wm_seconds_between(w.since_ns, t_ns);
  bool others_move = false;
  for (int i = 0; i < 3; i++)
    others_move |=
        i != axis && watch_[i].since_ns != WM_TIME_NONE && wm_seconds_between(watch_[i].since_ns, t_ns) < kAlive_s;
  const bool against = same_s > kStuckAgainst_s && std::fabs(w.apart_rad) > kStuckAgainst_rad;
  if (against || (same_s > kStuckAlone_s && others_move)) stuck_ |= bit;
}

void spatial_source::note_imu(const wm_event &event) {
  static constexpr int kOf[kImu] = {WM_Q_ROLL_RATE,      WM_Q_PITCH_RATE,     WM_Q_YAW_RATE,
                                    WM_Q_ACCELERATION_X, WM_Q_ACCELERATION_Y, WM_Q_ACCELERATION_Z};
  const wm_quantities &q = event.as.quantities;
  uint32_t came = 0;
  for (int i = 0; i < q.count; i++)
    for (int k = 0; k < kImu; k++) {
      if (q.id[i] != kOf[k]) continue;
      if (k < 3) watch_axis(k, event.t_ns, q.value[i]);
      imu_[k] = q.value[i];
      imu_ns_[k] = event.t_ns;
      came |= 1u << k;
    }
  if ((came & 7u) && are_alive(0, event.t_ns)) fresh_ |= kFreshRates;
  if ((came & 32u) && are_alive(3, event.t_ns)) fresh_ |= kFreshForce;
}

void spatial_source::note_twist(wm_time_ns t_ns, const spatial_twist &twist) {
  if (twist_ns_ != WM_TIME_NONE && t_ns > twist_ns_) {
    const double dt = wm_seconds_between(twist_ns_, t_ns);
    const bool follows = dt <= hold_max_s_;
    velocity_change_ = follows ? twist.v - twist_.v : vec3{0, 0, 0};
    if (follows) twist_period_s_ += twist_period_s_ > 0.0 ? kPeriodGain * (dt - twist_period_s_) : dt;
  }
  twist_has_rates_ |= twist.w.x != 0.0 || twist.w.y != 0.0 || twist.w.z != 0.0;
  twist_ns_ = t_ns;
  twist_ = twist;
}

bool spatial_source::take(const wm_event &event, spatial_twist *now) {
  fresh_ = 0;
  const bool quantities = event.kind == WM_EVENT_QUANTITIES;
  if (quantities)
    note_imu(event);
  else if (event.kind != WM_EVENT_INCREMENT)
    note_twist(event.t_ns, *now);
  by_gyro_ = are_alive(0, event.t_ns);
  if (!by_gyro_) return true;
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
