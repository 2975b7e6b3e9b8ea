// SPDX-License-Identifier: Apache-2.0
#include "motion/step.hpp"

#include <limits>

#include "math/elementary.hpp"
#include "motion/commands.hpp"
#include "motion/motion_kind.hpp"

namespace wm {
namespace {

// The same where the steering is not trusted: a car on a road turns less. Not swept.
constexpr double kUnknownSteeringRate_radps = 0.1;
// Speed of a robot that is pushed or carried, m/s: walking pace.
constexpr double kPushed_mps = 0.5;
// Above this the speed is an artefact of two counts with nearly equal stamps; robots with counters are slower.
constexpr double kCatchUp_mps = 30.0;
// Below this fraction of the middle's speed (a turn about the encoder's wheel) the encoder does not measure the speed.
constexpr double kEncoderFractionLeast = 0.2;

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

// v = s_v v_m, u = s_v s_u u_m with their derivatives; `w_by`: of the turn rate by the speed's scale.
void add_scales(double speed, double side, double w_by, const wm_motion_calibration &c, motion_twist *t) {
  t->v = c.value[kSpeedScale] * speed;
  t->u = c.value[kSpeedScale] * c.value[kSideScale] * side;
  t->add(kSpeedScale, speed, w_by, c.value[kSideScale] * side);
  if (side != 0.0) t->add(kSideScale, 0.0, 0.0, c.value[kSpeedScale] * side);
}

motion_twist from_speed_and_rate(double speed, double side, double rate, const wm_motion_calibration &c) {
  motion_twist t{};
  t.w = c.value[kYawRateScale] * (rate - c.value[kYawRateBias]);
  add_scales(speed, side, 0.0, c, &t);
  t.add(kYawRateScale, 0.0, rate - c.value[kYawRateBias]);
  t.add(kYawRateBias, 0.0, -c.value[kYawRateScale]);
  return t;
}

// While the gyro is silent or stuck: the states of the turn rate are the gyro's, and this rate is another sensor's.
motion_twist without_gyro(const motion_input &input, const wm_motion_calibration &c) {
  motion_twist t{};
  t.w = input.b;
  add_scales(input.a, input.side_mps, 0.0, c, &t);
  return t;
}

// w = v tan(phi)/L [Stepanov2017]. An encoder on one side, `offset` to the left of the middle, sees v - w offset.
motion_twist from_steering(double speed, double road_wheel, const wm_motion_calibration &c, const wm_wheels &wheels) {
  motion_twist t{};
  const double tangent = tan(road_wheel + c.value[kSteeringOffset]);
  const double curvature = tangent / wheels.wheelbase_m;
  const double offset = finite(wheels.encoder_offset_m) ? wheels.encoder_offset_m : 0.0;
  const double fraction = 1.0 - curvature * offset;
  const double middle = fraction > kEncoderFractionLeast ? speed / fraction : speed;
  t.v = c.value[kSpeedScale] * middle;
  t.w = t.v * curvature;
  t.add(kSpeedScale, middle, middle * curvature);
  const double curvature_by = (1.0 + tangent * tangent) / wheels.wheelbase_m;
  const double v_by = fraction > kEncoderFractionLeast ? t.v * offset / fraction * curvature_by : 0.0;
  t.add(kSteeringOffset, v_by, v_by * curvature + t.v * curvature_by);
  return t;
}

double least(double a, double b) { return a < b ? a : b; }

}  // namespace

motion_twist twist_of_sample(double speed, double side, double rate, const wm_motion_calibration &c, double track_m) {
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
  t.w = c.value[kYawRateScale] * (w - c.value[kYawRateBias]);
  add_scales(v, side, 0.0, c, &t);
  t.add(kYawRateScale, 0.0, w - c.value[kYawRateBias]);
  t.add(kYawRateBias, 0.0, -c.value[kYawRateScale]);
  return t;
}

namespace {

// u = -x w [Mandow2007]: skid steer turns about a centre that is x ahead of base_link.
motion_twist about_center(motion_twist t, const wm_motion_calibration &c) {
  const double x = c.value[kRotationCenter];
  if (x != 0.0) {
    for (int i = 0; i < t.count; i++) t.u_by[i] -= x * t.w_by[i];
    t.u -= x * t.w;
  }
  if (t.w != 0.0) t.add(kRotationCenter, 0.0, 0.0, -t.w);
  return t;
}

motion_twist twist_of_moving(const motion_input &input, const wm_motion_calibration &c, const wm_wheels &wheels,
                             const drive_terms &drive) {
  if (input.beside_gyro) return without_gyro(input, c);
  switch (input.model) {
    case WM_MOTION_TICKS: return from_wheels(input.a, input.b, c, wheels.track_m);
    case WM_MOTION_SPEED_YAW_RATE: return from_speed_and_rate(input.a, input.side_mps, input.b, c);
    case WM_MOTION_ACKERMANN: return from_steering(input.a, input.b, c, wheels);
    case WM_MOTION_TWIST:
      return input.command ? twist_of_command({input.a, input.side_mps, input.b}, drive, c, wheels.track_m)
                           : twist_of_sample(input.a, input.side_mps, input.b, c, wheels.track_m);
    case WM_MOTION_INCREMENTS:
      return twist_of_sample(input.a, input.side_mps, input.b, c, std::numeric_limits<double>::quiet_NaN());
    default: return motion_twist{};
  }
}

}  // namespace

motion_twist twist_of(const motion_input &input, const wm_motion_calibration &c, const wm_wheels &wheels,
                      const drive_terms &drive) {
  if (input.standing || input.stale) return motion_twist{};
  return about_center(twist_of_moving(input, c, wheels, drive), c);
}

namespace {

// By distance, not by time [FengND]. k^2 |d| instead of (k d)^2: independent of the step's length.
motion_noise noise_of_ticks(const motion_input &input, double dt_s, const wm_motion_params &p, const wm_wheels &wheels,
                            const wm_motion_calibration &c) {
  motion_noise n{};
  const double k2 = square(p.noise_ticks_per_sqrt_m) * dt_s;
  const double left = k2 * std::fabs(input.a * c.value[kLeftScale]);
  const double right = k2 * std::fabs(input.b * c.value[kRightScale]);
  const double track = wheels.track_m * c.value[kTrackScale];
  n.distance_m2 = 0.25 * (left + right);
  n.rotation_rad2 = (left + right) / (track * track);
  n.distance_rotation = 0.5 * (right - left) / track;
  return n;
}

motion_noise noise_of_increment(const motion_input &input, double dt_s) {
  const float *of = input.increment_noise;
  motion_noise n{};
  n.distance_m2 = static_cast<double>(of[0]) * dt_s;
  n.distance_lateral = static_cast<double>(of[1]) * dt_s;
  n.lateral_m2 = static_cast<double>(of[2]) * dt_s;
  n.distance_rotation = static_cast<double>(of[3]) * dt_s;
  n.lateral_rotation = static_cast<double>(of[4]) * dt_s;
  n.rotation_rad2 = static_cast<double>(of[5]) * dt_s;
  return n;
}

// Slip of wheels that lasts for seconds, as white noise of the speed relative to it, per sqrt(s). hall-easy and
// hall-hard need at most 0.007 (0.0165 and 0.0266 m; 0.01: 0.0238 and 0.0259 m; 0.014: 0.052 and 0.077 m), cars with
// slip of 1 % at least that (two of 29 random ones: 4 times the error without).
constexpr double kCountedSlip = 0.007;

// Counts have the whole distance, so their noise grows by it, as of wheels that drive singly, and by the slip.
double counted_distance_m2(const wm_motion_params &p, double speed_mps, double dt_s) {
  const double slip = p.noise_speed_rel < 0.0 ? kCountedSlip : p.noise_speed_rel;
  return (0.5 * square(p.noise_ticks_per_sqrt_m) + square(slip) * least(speed_mps, kCatchUp_mps)) * speed_mps * dt_s;
}

// White noise of speed and turn rate; with steering, of the angle in place of the turn rate's.
motion_noise noise_of_rates(const motion_input &input, const motion_twist &twist, double dt_s,
                            const wm_motion_params &p, const wm_wheels &wheels, const stated_noise &stated,
                            bool unknown) {
  motion_noise n{};
  const double speed = speed_of(twist);
  const bool slow = speed_of({input.a, input.side_mps, 0.0}) < p.standstill_speed_mps;
  const bool no_turn = input.model >= WM_MOTION_TWIST && std::fabs(input.b) < p.standstill_yaw_rate_radps;
  const bool at_rest = input.standing || (slow && no_turn);
  const double rest = square(p.noise_rest_factor);
  const double speed_factor = slow && !unknown ? rest : 1.0;
  const double rate_factor = at_rest && !unknown ? rest : 1.0;
  const rate_noise white = rate_noise_of(p, static_cast<motion_kind>(input.kind));
  const bool states = finite(stated.distance_m2), states_turn = finite(stated.rotation_rad2);
  const double speed2 = states ? stated.distance_m2 : square(p.noise_speed_mps);
  const double rate2 = states_turn ? stated.rotation_rad2 : square(white.yaw_rate_radps);
  n.distance_m2 = (speed2 * speed_factor + square(white.speed_rel * speed)) * dt_s;
  n.rotation_rad2 =
      (rate2 * rate_factor + square(white.yaw_rate_rel * twist.w) + square(p.noise_yaw_rate_per_mps * speed)) * dt_s;
  if (input.by_counts && !unknown) n.distance_m2 = counted_distance_m2(p, speed, dt_s);
  if (states) n.lateral_m2 = stated.lateral_m2 * speed_factor * dt_s;
  if (has_own_axes(input)) {
    const double side2 = states ? stated.lateral_m2 : square(p.noise_sideways_mps);
    n.distance_m2 =
        (speed2 * speed_factor + square(white.speed_rel * twist.v) + square(p.noise_side_rel * twist.u)) * dt_s;
    n.lateral_m2 =
        (side2 * speed_factor + square(p.noise_sideways_rel * twist.u) + square(p.noise_side_rel * twist.v)) * dt_s;
  }
  if (input.model != WM_MOTION_ACKERMANN || unknown) return n;
  const double tangent = std::fabs(twist.v) > 1e-9 ? twist.w * wheels.wheelbase_m / twist.v : 0.0;
  const double curvature = tangent / wheels.wheelbase_m;
  const double turn_by_angle = twist.v * (1.0 + tangent * tangent) / wheels.wheelbase_m;
  n.rotation_rad2 = square(turn_by_angle * p.noise_steering_rad) * dt_s + curvature * curvature * n.distance_m2;
  n.distance_rotation = curvature * n.distance_m2;
  return n;
}

// The robot may go on as it did, or not: sigma is the motion that was last trusted. A straight drive may have begun to
// turn since, which `turns` takes for granted.
void add_unknown_noise(const motion_input &input, bool doubtful, double dt_s, motion_noise *n) {
  const double speed = speed_of({input.a, input.side_mps, 0.0});
  const double rate = input.model == WM_MOTION_ACKERMANN ? kUnknownSteeringRate_radps : std::fabs(input.b);
  const bool turns = input.model == WM_MOTION_TICKS || input.refused || (input.stale && rate < kUnknownRate_radps);
  const bool speed_unknown = doubtful || (input.refused & kRefusedSpeed);
  // Counted: the distance is known, whatever the turn was. Stale: add_overdue_noise() has it.
  if (speed_unknown && !input.stale && !input.counted) n->distance_m2 += square(speed) * dt_s;
  if (doubtful || (input.refused & kRefusedTurn)) n->rotation_rad2 += square(turns ? kUnknownRate_radps : rate) * dt_s;
}

void apply(const noise_factors &factors, motion_noise *n) {
  if (factors.way != 1.0 || factors.turn != 1.0) {
    n->distance_m2 *= factors.way;
    n->lateral_m2 *= factors.way;
    n->rotation_rad2 *= factors.turn;
    n->distance_rotation *= std::sqrt(factors.way * factors.turn);
  }
  n->adapted_distance_m2 = n->distance_m2;
  n->adapted_lateral_m2 = n->lateral_m2;
  n->adapted_rotation_rad2 = n->rotation_rad2;
}

}  // namespace

motion_noise noise_of(const motion_input &input, const motion_twist &twist, double dt_s, const wm_motion_params &p,
                      const wm_wheels &wheels, const wm_motion_calibration &c, const stated_noise &stated,
                      const noise_factors &factors) {
  const bool doubtful = input.stale || input.doubtful || input.model == WM_MOTION_AUTO;
  const bool unknown = doubtful || input.refused;
  if (input.model == WM_MOTION_CONSTANT_VELOCITY) {
    // Integral of a velocity that walks.
    motion_noise walked{};
    walked.distance_m2 = walked.lateral_m2 = square(p.velocity_speed_walk) * dt_s * dt_s * dt_s / 3.0;
    walked.rotation_rad2 = square(p.velocity_turn_walk) * dt_s * dt_s * dt_s / 3.0;
    return walked;
  }
  if (input.model == WM_MOTION_INCREMENTS && !unknown && finite(input.increment_noise[0]))
    return noise_of_increment(input, dt_s);
  motion_noise n = input.model == WM_MOTION_TICKS && !unknown
                       ? noise_of_ticks(input, dt_s, p, wheels, c)
                       : noise_of_rates(input, twist, dt_s, p, wheels, stated, unknown);
  // Sideways, by the speed; by the distance where a count's stamp is nanoseconds behind another event's.
  const double speed_mps = has_own_axes(input) ? 0.0 : speed_of(twist);
  n.lateral_m2 += speed_mps > kCatchUp_mps ? square(p.noise_side_rel) * kCatchUp_mps * speed_mps * dt_s
                                           : square(p.noise_side_rel * speed_mps) * dt_s;
  if (unknown)
    add_unknown_noise(input, doubtful, dt_s, &n);
  else
    apply(factors, &n);
  return n;
}

void turn_to_axes(const planar_twist &twist, motion_noise *noise) {
  const double speed = speed_of(twist);
  if (!(speed > 0.0)) return;
  const double forwards = twist.v / speed, left = twist.u / speed;
  const double along = noise->distance_m2, across = noise->lateral_m2;
  noise->distance_m2 = along * forwards * forwards + across * left * left;
  noise->lateral_m2 = along * left * left + across * forwards * forwards;
  noise->distance_lateral = (along - across) * forwards * left;
}

namespace {

// Of a segment: the growth of t^4, t seconds after a sample was overdue, and the time for which it is unknown.
struct held_time {
  double grown_s4, unknown_s;
};

held_time held_time_of(double overdue_s, double dt_s, double hold_max_s) {
  const double from_s = overdue_s > 0.0 ? overdue_s : 0.0, to_s = overdue_s + dt_s;
  if (to_s <= from_s) return {0.0, 0.0};
  const double held_from_s = least(from_s, hold_max_s), held_to_s = least(to_s, hold_max_s);
  return {square(square(held_to_s)) - square(square(held_from_s)), to_s - from_s - (held_to_s - held_from_s)};
}

}  // namespace

void add_overdue_noise(const motion_segment &segment, const wm_motion_params &p, bool is_counted, double position_m2,
                       motion_noise *noise) {
  if (segment.input.model >= WM_MOTION_INCREMENTS && segment.input.counted) return;
  if (segment.input.stale) {
    // It may have gone on all the while in any direction, as it last did or as it may have begun to since.
    const double left = speed_of({segment.input.a, segment.input.side_mps, 0.0}), right = std::fabs(segment.input.b);
    const double last_mps = segment.input.model == WM_MOTION_TICKS && right > left ? right : left;
    const double begun_mps = 0.5 * p.noise_hold_mps2 * p.hold_max_s;
    const double speed_mps = last_mps > begun_mps ? last_mps : begun_mps;
    // The time in which such a motion makes the present variance: less than the whole after a correction.
    const double grown_s = speed_mps > 0.0 ? std::sqrt(position_m2) / speed_mps : segment.unknown_s;
    const double from_s = least(segment.unknown_s, grown_s), to_s = from_s + segment.dt_s;
    const double gone_m2 = square(speed_mps) * (square(to_s) - square(from_s));
    noise->distance_m2 += gone_m2;
    noise->lateral_m2 += gone_m2;
    return;
  }
  // Variances that add up to the square of the whole, however the time is cut.
  const held_time way = held_time_of(segment.overdue_s, segment.dt_s, p.hold_max_s);
  const double held_m2 = square(0.5 * p.noise_hold_mps2) * way.grown_s4;
  if (!is_counted) noise->distance_m2 += held_m2;
  if (has_own_axes(segment.input)) noise->lateral_m2 += held_m2;
  if (is_counted && segment.input.model == WM_MOTION_TICKS) return;
  const held_time turn = held_time_of(segment.turn_overdue_s, segment.dt_s, p.hold_max_s);
  const double rotation_rad2 =
      square(0.5 * p.noise_hold_radps2) * turn.grown_s4 + square(kUnknownRate_radps) * turn.unknown_s;
  noise->rotation_rad2 += rotation_rad2;
  if (!is_counted) return;
  // The distance is known, its direction is not: a heading that walks to that variance, at most any heading at all.
  const double distance_m2 = square(segment.input.a * segment.dt_s);
  noise->lateral_m2 += distance_m2 * least(rotation_rad2 / 3.0, 0.5);
  noise->distance_m2 += distance_m2 * least(square(rotation_rad2) / 8.0, 0.5);
}

}  // namespace wm

double wm_motion_gyro_noise(const wm_motion_params *params) {
  return wm::rate_noise_of(*params, wm::kKindGyro).yaw_rate_radps;
}

void wm_motion_unseen(const wm_motion_params *params, double blind_s, double *xy_m, double *heading_rad) {
  const double hold_s = params->hold_max_s, held_s = blind_s < hold_s ? blind_s : hold_s, unknown_s = blind_s - held_s;
  *xy_m = 0.5 * params->noise_hold_mps2 * held_s * (held_s + unknown_s);
  const double held_rad = 0.5 * params->noise_hold_radps2 * wm::square(held_s);
  *heading_rad = std::sqrt(wm::square(held_rad) + wm::square(wm::kUnknownRate_radps) * unknown_s);
}

namespace wm {

void add_sampling_noise(const motion_input &input, motion_noise *noise) {
  noise->distance_m2 += static_cast<double>(input.sampling[0]);
  noise->rotation_rad2 += static_cast<double>(input.sampling[1]);
  if (has_own_axes(input)) noise->lateral_m2 += static_cast<double>(input.side_sampling);
}

void add_center_noise(const wm_motion_calibration &calibration, motion_noise *noise) {
  const double x = calibration.value[kRotationCenter];
  if (x == 0.0) return;
  noise->lateral_m2 += x * x * noise->rotation_rad2 - 2.0 * x * noise->lateral_rotation;
  noise->distance_lateral -= x * noise->distance_rotation;
  noise->lateral_rotation -= x * noise->rotation_rad2;
}

void add_distrusted_noise(const motion_segment &segment, const motion_twist &twist, motion_noise *noise) {
  const double speed_mps = larger(speed_of(twist), kPushed_mps);
  noise->distrusted_m2 = square(speed_mps) * segment.dt_s;
  noise->distance_m2 += noise->distrusted_m2;
  noise->lateral_m2 += noise->distrusted_m2;
  if (segment.input.model == WM_MOTION_TICKS) noise->rotation_rad2 += square(kUnknownRate_radps) * segment.dt_s;
}

void add_refused_noise(const motion_segment &segment, const wm_motion_params &p, motion_noise *noise) {
  if (!segment.input.refused) return;
  const double from_s = least(segment.refused_s, p.hold_max_s);
  const double to_s = least(segment.refused_s + segment.dt_s, p.hold_max_s);
  const double grown_s4 = (square(square(to_s)) - square(square(from_s))) / 12.0;
  if (segment.input.refused & kRefusedSpeed) noise->distance_m2 += square(p.limits_mps2) * grown_s4;
  if (segment.input.refused & kRefusedTurn) noise->rotation_rad2 += square(p.limits_radps2) * grown_s4;
}

}  // namespace wm
