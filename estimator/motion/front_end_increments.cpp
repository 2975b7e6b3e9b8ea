// SPDX-License-Identifier: Apache-2.0
// The motion front end's increments (poses seen from poses before), and what twists in space have besides the plane's
// motion.
#include <limits>

#include "math/arc.hpp"
#include "math/elementary.hpp"
#include "motion/event_time.hpp"
#include "motion/front_end.hpp"

namespace wm {
namespace {

// Off the plane for so long, alike, is no vibration and no bump.
constexpr double kOffPlane_s = 2.0;
constexpr double kOffPlaneSigmas = 3.0;
// A covariance that was written with four digits may have a determinant below zero by this share of its diagonal's
// product.
constexpr double kRounding = 1e-3;
// A cheap gyro's bias, rad/s, which every rate has besides its noise (motion.states.yaw_rate_bias_sigma_radps).
constexpr double kGyroBias_radps = 0.02;

// [d pose / d (way, side, turn)]^-1 Q its transpose, per s: a pose's covariance as noise of the twist that makes it.
void noise_of_twist(const double q[6], const ways &whole, double dt_s, float out[6]) {
  const arc a = make_arc(whole.way_m, whole.side_m, whole.turn_rad);
  const double inverse = 1.0 / (a.x_by_way * a.x_by_way + a.y_by_way * a.y_by_way);
  const double c = a.x_by_way * inverse, s = a.y_by_way * inverse;
  // The inverse's rows: (c, s, f), (-s, c, g), (0, 0, 1).
  const double f = -(c * a.x_by_turn + s * a.y_by_turn), g = s * a.x_by_turn - c * a.y_by_turn;
  const double row[3][3] = {{c, s, f}, {-s, c, g}, {0.0, 0.0, 1.0}};
  const double full[3][3] = {{q[0], q[1], q[3]}, {q[1], q[2], q[4]}, {q[3], q[4], q[5]}};
  const int from[6] = {0, 0, 1, 0, 1, 2}, to[6] = {0, 1, 1, 2, 2, 2};
  for (int k = 0; k < 6; k++) {
    double sum = 0.0;
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) sum += row[from[k]][i] * full[i][j] * row[to[k]][j];
    out[k] = static_cast<float>(sum / dt_s);
  }
}

}  // namespace

wm_status motion_front_end::check_increment(const wm_event &event) const {
  const wm_increment &step = event.as.increment;
  if (step.from_ns >= event.t_ns || step.from_ns < -kMaxTime) return WM_OUT_OF_RANGE;
  const double values[3] = {step.dx_m, step.dy_m, step.dheading_rad};
  for (double value : values)
    if (!finite(value)) return WM_NOT_FINITE;
  const double dt = wm_seconds_between(step.from_ns, event.t_ns);
  const double most_m = kSpeedMost_mps * dt;
  if (!(square(step.dx_m) + square(step.dy_m) <= square(most_m)) || !(std::fabs(step.dheading_rad) <= kPi))
    return WM_OUT_OF_RANGE;
  const double *q = step.covariance;
  if (std::isnan(q[0])) return WM_OK;
  for (int i = 0; i < 6; i++)
    if (!finite(q[i])) return WM_NOT_FINITE;
  const double minor = q[0] * q[2] - q[1] * q[1];
  const double determinant = q[5] * minor - q[4] * (q[0] * q[4] - q[1] * q[3]) + q[3] * (q[1] * q[4] - q[2] * q[3]);
  const double most = q[0] * q[2] * q[5];
  const bool positive = q[0] >= 0.0 && q[2] >= 0.0 && q[5] >= 0.0 && minor >= -kRounding * q[0] * q[2] &&
                        determinant >= -kRounding * most;
  return positive ? WM_OK : WM_OUT_OF_RANGE;
}

// The increment as the constant twist that makes it. Between increments the last twist holds; what was moved by it
// since the increment's beginning is taken off, so that the whole is the increment.
void motion_front_end::take_increment(const wm_event &event) {
  choose_model(WM_EVENT_BIT(event.kind));
  if (model_ != WM_MOTION_INCREMENTS) return;
  const wm_increment &step = event.as.increment;
  wm_pose2 whole = {step.dx_m, step.dy_m, step.dheading_rad};
  wm_time_ns from_ns = step.from_ns;
  const double whole_s = wm_seconds_between(from_ns, event.t_ns);
  motion_input done{};
  increments_are_calibrated_ = !std::isnan(step.covariance[0]);
  done.model = model_;
  done.kind = kind();
  if (std::isnan(step.covariance[0]))
    done.increment_noise[0] = std::numeric_limits<float>::quiet_NaN();
  else
    noise_of_twist(step.covariance, ways_of(whole), whole_s, done.increment_noise);
  if (increment_ns_ != WM_TIME_NONE && from_ns < increment_ns_) {  // it overlaps with the one before
    if (event.t_ns <= increment_ns_) return;
    whole = part_of(whole, wm_seconds_between(increment_ns_, event.t_ns) / whole_s);
    from_ns = increment_ns_;
  }
  if (from_ns < now_ns_ && history_.empty()) {  // it began before the state did
    whole = part_of(whole, wm_seconds_between(now_ns_, event.t_ns) / whole_s);
    from_ns = now_ns_;
  }
  history_.walk(from_ns, now_ns_, hold_max_ns_, [&](const motion_segment &s) {
    if (s.input.stale) return;
    const arc moved = make_arc(s.input.a * s.dt_s, s.input.side_mps * s.dt_s, s.input.b * s.dt_s);
    whole = between({moved.x_m, moved.y_m, moved.turn_rad}, whole);
  });
  const wm_time_ns begin_ns = now_ns_ > from_ns ? now_ns_ : from_ns;
  const double left_s = wm_seconds_between(begin_ns, event.t_ns);
  increment_ns_ = newest_ns_ = event.t_ns;
  if (!(left_s > 0.0)) return;
  const auto take = [&done](const wm_pose2 &pose, double dt) {
    const ways of = ways_of(pose);
    done.a = of.way_m / dt;
    done.side_mps = of.side_m / dt;
    done.b = of.turn_rad / dt;
  };
  motion_input next = done;
  take({step.dx_m, step.dy_m, step.dheading_rad}, whole_s);
  next.a = done.a, next.side_mps = done.side_mps, next.b = done.b;
  next.t_ns = event.t_ns;
  next.period_s = static_cast<float>(whole_s);
  take(whole, left_s);
  done.t_ns = begin_ns;
  done.counted = 1;
  history_.push(done);
  history_.push(next);
}

stated_noise motion_front_end::stated_noise_now() const {
  if (!twists_in_space_ || model_ != WM_MOTION_TWIST) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    return {none, none, none};
  }
  // A sample's error holds until the next sample: a white density of its variance times the period.
  return {square(stated_v_mps_[0]) * twist_period_s_, square(stated_v_mps_[1]) * twist_period_s_,
          square(stated_w_radps_[2]) * twist_period_s_};
}

// A planar estimator has no place for a climb, a roll or a pitch that lasts.
void motion_front_end::watch_plane(wm_time_ns t_ns, const wm_twist6 &twist) {
  const double speed = speed_of({twist.v_mps[0], twist.v_mps[1], 0.0});
  const double stated = finite(stated_v_mps_[2]) ? stated_v_mps_[2] : params_->noise_speed_mps;
  const rate_noise white = rate_noise_of(*params_, kind());
  const double rise = square(stated) + square(white.speed_rel * speed);
  const double value[3] = {twist.v_mps[2], twist.w_radps[0], twist.w_radps[1]};
  bool lasts = false;
  for (int i = 0; i < 3; i++) {
    const double w = i > 0 && finite(stated_w_radps_[i - 1]) ? stated_w_radps_[i - 1] : white.yaw_rate_radps;
    const double variance = i == 0 ? rise : square(w) + square(kGyroBias_radps);
    const bool off = square(value[i]) > square(kOffPlaneSigmas) * variance;
    if (!off || value[i] * off_plane_[i] < 0.0) off_plane_since_ns_[i] = off ? t_ns : WM_TIME_NONE;
    if (off && off_plane_since_ns_[i] == WM_TIME_NONE) off_plane_since_ns_[i] = t_ns;
    off_plane_[i] = value[i];
    lasts |= off && wm_seconds_between(off_plane_since_ns_[i], t_ns) >= kOffPlane_s;
  }
  if (lasts) health_ |= WM_MOTION_HEALTH_NOT_PLANAR;  // for good: the pose is wrong from there on
}

}  // namespace wm
