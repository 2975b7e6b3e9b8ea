// SPDX-License-Identifier: Apache-2.0
#include "motion/step.hpp"

#include "math/elementary.hpp"
#include "motion/commands.hpp"

namespace wm {
namespace {

constexpr double kUnknownRate_radps = 0.3;  // per square root of a second
constexpr double kCatchUp_mps = 30.0;       // faster is no robot that counts, but what remains of a count

// v = (l + r)/2, w = (r - l)/b, with l and r each by its own scale and b by the track's.
motion_twist from_wheels(double left, double right, const wm_motion_calibration &c, double track_m) {
  motion_twist t{};
  const double inverse_track = 1.0 / (track_m * c.value[kTrackScale]);
  const double l = left * c.value[kLeftScale];
  const double r = right * c.value[kRightScale];
  t.v = 0.5 * (l + r);
  t.w = (r - l) * inverse_track;
  t.add(kLeftScale, 0.5 * left, -left * inverse_track);
  t.add(kRightScale, 0.5 * right, right * inverse_track);
  t.add(kTrackScale, 0.0, -t.w / c.value[kTrackScale]);
  return t;
}

motion_twist from_speed_and_rate(double speed, double rate, const wm_motion_calibration &c) {
  motion_twist t{};
  t.v = c.value[kSpeedScale] * speed;
  t.w = c.value[kYawRateScale] * (rate - c.value[kYawRateBias]);
  t.add(kSpeedScale, speed, 0.0);
  t.add(kYawRateScale, 0.0, rate - c.value[kYawRateBias]);
  t.add(kYawRateBias, 0.0, -c.value[kYawRateScale]);
  return t;
}

// w = v tan(phi)/L (paper, system 1). An encoder on one side, `offset` to the left of the middle, sees v - w offset.
motion_twist from_steering(double speed, double road_wheel, const wm_motion_calibration &c, const wm_wheels &wheels) {
  motion_twist t{};
  const double tangent = tan(road_wheel + c.value[kSteeringOffset]);
  const double curvature = tangent / wheels.wheelbase_m;
  const double offset = finite(wheels.encoder_offset_m) ? wheels.encoder_offset_m : 0.0;
  const double share = 1.0 - curvature * offset;
  const double middle = share > 0.2 ? speed / share : speed;
  t.v = c.value[kSpeedScale] * middle;
  t.w = t.v * curvature;
  t.add(kSpeedScale, middle, middle * curvature);
  const double curvature_by = (1.0 + tangent * tangent) / wheels.wheelbase_m;
  const double v_by = share > 0.2 ? t.v * offset / share * curvature_by : 0.0;
  t.add(kSteeringOffset, v_by, v_by * curvature + t.v * curvature_by);
  return t;
}

double least(double a, double b) { return a < b ? a : b; }

}  // namespace

motion_twist twist_of_sample(double speed, double rate, const wm_motion_calibration &c, double track_m) {
  motion_twist t = finite(track_m) ? from_wheels(speed - 0.5 * track_m * rate, speed + 0.5 * track_m * rate, c, track_m)
                                   : motion_twist{};
  if (!finite(track_m)) {
    t.v = speed;
    t.w = rate;
  }
  const double v = t.v, w = t.w;
  for (int i = 0; i < t.count; i++) {
    t.v_by[i] *= c.value[kSpeedScale];
    t.w_by[i] *= c.value[kYawRateScale];
  }
  t.v = c.value[kSpeedScale] * v;
  t.w = c.value[kYawRateScale] * (w - c.value[kYawRateBias]);
  t.add(kSpeedScale, v, 0.0);
  t.add(kYawRateScale, 0.0, w - c.value[kYawRateBias]);
  t.add(kYawRateBias, 0.0, -c.value[kYawRateScale]);
  return t;
}

motion_twist twist_of(const motion_input &input, const wm_motion_calibration &c, const wm_wheels &wheels) {
  if (input.standing || input.stale) return motion_twist{};
  switch (input.model) {
    case WM_MOTION_TICKS: return from_wheels(input.a, input.b, c, wheels.track_m);
    case WM_MOTION_SPEED_YAW_RATE: return from_speed_and_rate(input.a, input.b, c);
    case WM_MOTION_ACKERMANN: return from_steering(input.a, input.b, c, wheels);
    case WM_MOTION_TWIST:
      return input.command ? twist_of_command(input.a, input.b, c, wheels.track_m)
                           : twist_of_sample(input.a, input.b, c, wheels.track_m);
    default: return motion_twist{};
  }
}

motion_noise noise_of(const motion_input &input, const motion_twist &twist, double dt_s, const wm_motion_params &p,
                      const wm_wheels &wheels, const wm_motion_calibration &c) {
  motion_noise n{};
  const bool doubtful = input.stale || input.doubtful || input.model == WM_MOTION_AUTO;
  const bool unknown = doubtful || input.refused;
  if (input.model == WM_MOTION_TICKS && !unknown) {
    // Paper, system 2: by way, not by time. k^2 |d| instead of (k d)^2, so that it does not depend on the step's
    // length.
    const double k2 = square(p.noise_ticks_per_sqrt_m) * dt_s;
    const double left = k2 * std::fabs(input.a * c.value[kLeftScale]);
    const double right = k2 * std::fabs(input.b * c.value[kRightScale]);
    const double track = wheels.track_m * c.value[kTrackScale];
    n.way_m2 = 0.25 * (left + right);
    n.turn_rad2 = (left + right) / (track * track);
    n.way_turn = 0.5 * (right - left) / track;
  } else {
    const bool slow = std::fabs(input.a) < p.standstill_speed_mps;
    const bool at_rest =
        input.standing || (input.model == WM_MOTION_TWIST && slow && std::fabs(input.b) < p.standstill_yaw_rate_radps);
    const double rest = square(p.noise_rest_factor);
    const double speed_share = slow && !unknown ? rest : 1.0;
    const double rate_share = at_rest && !unknown ? rest : 1.0;
    n.way_m2 = (square(p.noise_speed_mps) * speed_share + square(p.noise_speed_rel * twist.v)) * dt_s;
    n.turn_rad2 = (square(p.noise_yaw_rate_radps) * rate_share + square(p.noise_yaw_rate_rel * twist.w) +
                   square(p.noise_yaw_rate_per_mps * twist.v)) *
                  dt_s;
    if (input.model == WM_MOTION_ACKERMANN && !unknown) {
      const double tangent = std::fabs(twist.v) > 1e-9 ? twist.w * wheels.wheelbase_m / twist.v : 0.0;
      const double curvature = tangent / wheels.wheelbase_m;
      const double turn_by_angle = twist.v * (1.0 + tangent * tangent) / wheels.wheelbase_m;
      n.turn_rad2 = square(turn_by_angle * p.noise_steering_rad) * dt_s + curvature * curvature * n.way_m2;
      n.way_turn = curvature * n.way_m2;
    }
  }
  // By the way where a count's stamp lies nanoseconds behind another event's, and brings millimetres at 1e6 m/s.
  const double driven_mps = std::fabs(twist.v);
  n.side_m2 = driven_mps > kCatchUp_mps ? square(p.noise_side_rel) * kCatchUp_mps * driven_mps * dt_s
                                        : square(p.noise_side_rel * twist.v) * dt_s;
  if (unknown) {
    // The robot may go on as it did, or not: as unsure as the motion that was last believed is large.
    // That it went straight when it was last heard of doesn't say that it hasn't begun to turn.
    const double speed = std::fabs(input.a), rate = input.model == WM_MOTION_ACKERMANN ? 0.1 : std::fabs(input.b);
    const bool any = input.model == WM_MOTION_TICKS || input.refused || (input.stale && rate < kUnknownRate_radps);
    // Counted, the way is known, whatever the turn was. Stale: add_silence() has it.
    if (!input.stale && !input.counted && (doubtful || (input.refused & kRefusedSpeed)))
      n.way_m2 += square(speed) * dt_s;
    if (doubtful || (input.refused & kRefusedTurn)) n.turn_rad2 += square(any ? kUnknownRate_radps : rate) * dt_s;
  }
  return n;
}

void add_silence(const motion_stretch &stretch, const wm_motion_params &p, bool is_counted, motion_noise *noise) {
  if (stretch.input.stale) {
    // It may have gone on all the while, in whatever direction: as it last did, or as it may have begun to while the
    // last input was held.
    const double left = std::fabs(stretch.input.a), right = std::fabs(stretch.input.b);
    const double last_mps = stretch.input.model == WM_MOTION_TICKS && right > left ? right : left;
    const double begun_mps = 0.5 * p.noise_hold_mps2 * p.hold_max_s;
    const double speed_mps = last_mps > begun_mps ? last_mps : begun_mps;
    const double unknown_to_s = stretch.unknown_s + stretch.dt_s;
    const double gone_m2 = square(speed_mps) * (square(unknown_to_s) - square(stretch.unknown_s));
    noise->way_m2 += gone_m2;
    noise->side_m2 += gone_m2;
    return;
  }
  const double from_s = stretch.silent_s > 0.0 ? stretch.silent_s : 0.0, to_s = stretch.silent_s + stretch.dt_s;
  if (to_s <= from_s) return;
  // Variances that add up to the square of the whole, however the time is cut.
  const double held_from_s = from_s < p.hold_max_s ? from_s : p.hold_max_s;
  const double held_to_s = to_s < p.hold_max_s ? to_s : p.hold_max_s;
  const double grown_s4 = square(square(held_to_s)) - square(square(held_from_s));
  if (!is_counted) noise->way_m2 += square(0.5 * p.noise_hold_mps2) * grown_s4;
  if (is_counted && stretch.input.model == WM_MOTION_TICKS) return;
  const double turn_rad2 = square(0.5 * p.noise_hold_radps2) * grown_s4 +
                           square(kUnknownRate_radps) * (to_s - from_s - (held_to_s - held_from_s));
  noise->turn_rad2 += turn_rad2;
  if (!is_counted) return;
  // How far is known, not by which way: a heading that walks at random to that variance, at most any heading at all.
  const double way_m2 = square(stretch.input.a * stretch.dt_s);
  noise->side_m2 += way_m2 * least(turn_rad2 / 3.0, 0.5);
  noise->way_m2 += way_m2 * least(square(turn_rad2) / 8.0, 0.5);
}

void add_refused(const motion_stretch &stretch, const wm_motion_params &p, motion_noise *noise) {
  if (!stretch.input.refused) return;
  const double from_s = least(stretch.refused_s, p.hold_max_s);
  const double to_s = least(stretch.refused_s + stretch.dt_s, p.hold_max_s);
  const double grown_s4 = (square(square(to_s)) - square(square(from_s))) / 12.0;
  if (stretch.input.refused & kRefusedSpeed) noise->way_m2 += square(p.limits_mps2) * grown_s4;
  if (stretch.input.refused & kRefusedTurn) noise->turn_rad2 += square(p.limits_radps2) * grown_s4;
}

}  // namespace wm
