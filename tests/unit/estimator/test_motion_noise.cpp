// SPDX-License-Identifier: Apache-2.0
// The motion's noise term by term against its formulas: each parameter alone, of each model, in motion and at rest,
// refused, doubtful and overdue. And what the kind of a motion's source settles: its states, their priors, its noise.
#include <string>

#include "common/suite.h"
#include "events.hpp"
#include "motion/front_end.hpp"
#include "motion/motion_kind.hpp"

namespace {

using wm::square;

constexpr double kDt_s = 0.2, kRest = 0.3;
const wm::stated_noise kNotStated = {NAN, NAN, NAN};

// Parameters of the noise, of which one is on: by name for the message.
struct term {
  const char *name;
  double wm_motion_params::*at;
};
const term kTerms[] = {{"speed_mps", &wm_motion_params::noise_speed_mps},
                       {"speed_rel", &wm_motion_params::noise_speed_rel},
                       {"yaw_rate_radps", &wm_motion_params::noise_yaw_rate_radps},
                       {"yaw_rate_rel", &wm_motion_params::noise_yaw_rate_rel},
                       {"yaw_rate_per_mps", &wm_motion_params::noise_yaw_rate_per_mps},
                       {"side_rel", &wm_motion_params::noise_side_rel},
                       {"sideways_mps", &wm_motion_params::noise_sideways_mps},
                       {"sideways_rel", &wm_motion_params::noise_sideways_rel},
                       {"ticks_per_sqrt_m", &wm_motion_params::noise_ticks_per_sqrt_m},
                       {"steering_rad", &wm_motion_params::noise_steering_rad}};

wm_motion_params only(const term *one, double value) {
  wm_motion_params p;
  wm_params_defaults(&wm_motion_params_table, &p);
  for (const term &t : kTerms) p.*t.at = 0.0;
  if (one) p.*one->at = value;
  p.noise_rest_factor = kRest;
  p.standstill_speed_mps = 0.05;
  p.standstill_yaw_rate_radps = 0.015;
  return p;
}

enum doubt { kNone, kDoubtful, kStale, kSpeedRefused, kTurnRefused, kDoubts };

wm::motion_input input_of(int model, double a, double side, double b, int doubt) {
  wm::motion_input input{};
  input.model = static_cast<uint8_t>(model);
  input.a = a, input.b = b, input.side_mps = side;
  input.doubtful = doubt == kDoubtful;
  input.stale = doubt == kStale;
  input.refused = doubt == kSpeedRefused ? wm::kRefusedSpeed : doubt == kTurnRefused ? wm::kRefusedTurn : 0;
  input.increment_noise[0] = NAN;
  return input;
}

struct expected_noise {
  double along = 0.0, across = 0.0, turn = 0.0, along_turn = 0.0;
};

// Counts: each wheel's way is off by k sqrt(|way|).
expected_noise of_counts(const wm::motion_input &input, const wm_motion_params &p, const wm_wheels &w,
                         const wm_motion_calibration &c) {
  const double k2 = square(p.noise_ticks_per_sqrt_m), track = w.track_m * c.value[wm::kTrackScale];
  const double left = k2 * std::fabs(input.a) * c.value[wm::kLeftScale],
               right = k2 * std::fabs(input.b) * c.value[wm::kRightScale];
  return {(left + right) / 4.0, 0.0, (left + right) / square(track), (right - left) / (2.0 * track)};
}

// A speed and a turn, per second: what is stated, or the parameters' white noise and shares of what is driven.
expected_noise of_rates(const wm::motion_input &input, const wm::motion_twist &t, const wm_motion_params &p,
                        const wm_wheels &w, const wm::stated_noise &stated, bool unknown, bool own_axes) {
  const bool slow = std::hypot(input.a, input.side_mps) < 0.05;
  const bool rests = input.standing || (slow && input.model >= WM_MOTION_TWIST && std::fabs(input.b) < 0.015);
  const double slow_factor = slow && !unknown ? square(kRest) : 1.0,
               rest_factor = rests && !unknown ? square(kRest) : 1.0;
  const double speed = std::hypot(t.v, t.u);
  const bool is_stated = std::isfinite(stated.distance_m2), turn_is_stated = std::isfinite(stated.rotation_rad2);
  const double white2 = is_stated ? stated.distance_m2 : square(p.noise_speed_mps);
  const double side2 = is_stated ? stated.lateral_m2 : square(p.noise_sideways_mps);
  const double turn2 = turn_is_stated ? stated.rotation_rad2 : square(p.noise_yaw_rate_radps);
  expected_noise n;
  n.along = white2 * slow_factor + square(p.noise_speed_rel * speed);
  // Of counts: half a wheel's variance, by the distance.
  if (input.by_counts && !unknown)
    n.along = 0.5 * square(p.noise_ticks_per_sqrt_m) * speed + square(p.noise_speed_rel * speed);
  n.across = is_stated ? side2 * slow_factor : 0.0;
  if (own_axes) {
    n.along = white2 * slow_factor + square(p.noise_speed_rel * t.v) + square(p.noise_side_rel * t.u);
    n.across = side2 * slow_factor + square(p.noise_sideways_rel * t.u) + square(p.noise_side_rel * t.v);
  }
  n.turn = turn2 * rest_factor + square(p.noise_yaw_rate_rel * t.w) + square(p.noise_yaw_rate_per_mps * speed);
  if (input.model != WM_MOTION_ACKERMANN || unknown) return n;
  const double curvature = t.v != 0.0 ? t.w / t.v : 0.0, tangent = curvature * w.wheelbase_m;
  n.turn = square(t.v * (1.0 + tangent * tangent) / w.wheelbase_m * p.noise_steering_rad) + square(curvature) * n.along;
  n.along_turn = curvature * n.along;
  return n;
}

// Of doubt: sigma is the motion itself. A turn that is not known walks by 0.3 rad per sqrt(s), by 0.1 of a steering.
void add_doubt(const wm::motion_input &input, int doubt, expected_noise *n) {
  if (doubt == kDoubtful || (doubt == kSpeedRefused && !input.counted))
    n->along += input.counted ? 0.0 : square(input.a) + square(input.side_mps);
  if (doubt == kSpeedRefused) return;
  const double rate = input.model == WM_MOTION_ACKERMANN ? 0.1 : std::fabs(input.b);
  const bool may_begin = input.model == WM_MOTION_TICKS || doubt == kTurnRefused || (doubt == kStale && rate < 0.3);
  n->turn += square(may_begin ? 0.3 : rate);
}

void check_noise(const wm::motion_input &input, int doubt, const wm_motion_params &p, const wm::stated_noise &stated,
                 const char *what) {
  const wm_wheels w = make::car();
  const wm_motion_calibration c = {{1.05, 0.93, 0.02, 1.02, 0.97, 1.04, 0.03, 0.1, 0.07, 0.15, 0.04, 0.3, 1.06, 0.12}};
  const wm::motion_twist t = wm::twist_of(input, c, w, {});
  const bool unknown = doubt != kNone, own_axes = input.holonomic && !unknown;
  expected_noise n = input.model == WM_MOTION_TICKS && !unknown ? of_counts(input, p, w, c)
                                                                : of_rates(input, t, p, w, stated, unknown, own_axes);
  if (!own_axes) n.across += square(p.noise_side_rel * std::hypot(t.v, t.u));
  if (unknown) add_doubt(input, doubt, &n);
  const wm::motion_noise out = wm::noise_of(input, t, kDt_s, p, w, c, stated, {1.0, 1.0});
  TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, n.along * kDt_s, out.distance_m2, what);
  TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, n.across * kDt_s, out.lateral_m2, what);
  TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, n.turn * kDt_s, out.rotation_rad2, what);
  TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, n.along_turn * kDt_s, out.distance_rotation, what);
  TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(0.0, out.distance_lateral, what);
  TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(0.0, out.lateral_rotation, what);
  // What an estimator's factors scale: nothing of a motion that is not known.
  TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(unknown ? 0.0 : out.distance_m2, out.adapted_distance_m2, what);
  TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(unknown ? 0.0 : out.lateral_m2, out.adapted_lateral_m2, what);
  TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(unknown ? 0.0 : out.rotation_rad2, out.adapted_rotation_rad2, what);
}

// Motions: driving, backwards, slow in a turn, nearly at rest, and standing.
const double kMotions[][3] = {
    {1.3, 0.6, 0.2}, {-0.8, -0.2, -0.9}, {0.02, 0.01, 0.4}, {0.02, 0.03, 0.01}, {0.04, 0.04, 0.01}};

TEST(test_each_term_of_the_noise_is_its_formula) {
  const int models[] = {WM_MOTION_TICKS, WM_MOTION_SPEED_YAW_RATE, WM_MOTION_ACKERMANN, WM_MOTION_TWIST,
                        WM_MOTION_INCREMENTS};
  const wm::stated_noise stated = {0.04, 0.02, 0.03}, turn_stated = {NAN, NAN, 0.03};
  for (size_t k = 0; k <= std::size(kTerms); k++)
    for (const int model : models)
      for (const auto &motion : kMotions)
        for (int doubt = 0; doubt < kDoubts; doubt++)
          for (int more = 0; more < 7; more++) {
            const bool has_side = model != WM_MOTION_TICKS && model != WM_MOTION_ACKERMANN;
            wm::motion_input input = input_of(model, motion[0], has_side ? motion[1] : 0.0, motion[2], doubt);
            input.holonomic = more & 1 && model >= WM_MOTION_TWIST;
            input.counted = more == 2;
            input.standing = more == 3 && doubt == kNone;
            input.by_counts = more == 6 && (model == WM_MOTION_SPEED_YAW_RATE || model == WM_MOTION_ACKERMANN);
            const std::string what = std::string(k < std::size(kTerms) ? kTerms[k].name : "none") + ", model " +
                                     std::to_string(model) + ", doubt " + std::to_string(doubt);
            check_noise(input, doubt, only(k < std::size(kTerms) ? kTerms + k : nullptr, 0.07),
                        more == 4   ? stated
                        : more == 5 ? turn_stated
                                    : kNotStated,
                        what.c_str());
          }
}

// Parameters below 0 have the noise of the source's kind; above, their own, whatever the kind.
TEST(test_noise_by_the_kind_of_the_source) {
  const struct {
    wm::motion_kind kind;
    double speed_rel, rate, rate_rel;
  } rows[] = {{wm::kKindGyro, 0.02, 0.004, 0.01},
              {wm::kKindSteering, 0.03, 0.01, 0.03},
              {wm::kKindTwist, 0.06, 0.02, 0.13},
              {wm::kKindMeasured, 0.03, 0.01, 0.05},
              {wm::kKindCommands, 0.06, 0.006, 0.12}};
  for (const auto &row : rows)
    for (int own = 0; own < 4; own++) {
      wm_motion_params p = only(nullptr, 0.0);
      p.noise_speed_rel = own == 1 ? 0.0 : -1.0;
      p.noise_yaw_rate_radps = own == 2 ? 0.5 : -1.0;
      p.noise_yaw_rate_rel = own == 3 ? 0.25 : -1.0;
      const wm::rate_noise n = wm::rate_noise_of(p, row.kind);
      TEST_ASSERT_EQUAL_DOUBLE(own == 1 ? 0.0 : row.speed_rel, n.speed_rel);
      TEST_ASSERT_EQUAL_DOUBLE(own == 2 ? 0.5 : row.rate, n.yaw_rate_radps);
      TEST_ASSERT_EQUAL_DOUBLE(own == 3 ? 0.25 : row.rate_rel, n.yaw_rate_rel);
    }
}

// GIVEN the defaults THEN a way by counts beside a yaw rate is known to 6 mm after 1 m at walking pace, and to 22 cm
// after 100 m at 10 m/s; that of a speedometer to 3 and 64 cm. An impossible speed counts as 30 m/s.
TEST(test_noise_of_a_counted_way) {
  wm_motion_params p;
  wm_params_defaults(&wm_motion_params_table, &p);
  const auto sigma_m = [&](double speed, double way_m, bool by_counts) {
    wm::motion_input input = input_of(WM_MOTION_SPEED_YAW_RATE, speed, 0.0, 0.0, kNone);
    input.kind = wm::kKindGyro;
    input.by_counts = by_counts;
    const wm::motion_twist t = wm::twist_of(input, wm::kNeutralCalibration, make::two_wheels(), {});
    return std::sqrt(
        wm::noise_of(input, t, way_m / speed, p, make::two_wheels(), wm::kNeutralCalibration, kNotStated, {1, 1})
            .distance_m2);
  };
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.0061, sigma_m(0.5, 1.0, true));
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.2242, sigma_m(10.0, 100.0, true));
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.0316, sigma_m(0.5, 1.0, false));
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.6356, sigma_m(10.0, 100.0, false));
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.0385, sigma_m(1e6, 1.0, true));
}

// A speed that is the artefact of two stamps: sideways it counts by its distance, as 30 m/s.
TEST(test_sideways_noise_of_an_impossible_speed_is_by_distance) {
  const wm_motion_params p = only(&kTerms[5], 0.05);
  for (const double speed : {29.0, 31.0, 900.0}) {
    const wm::motion_input input = input_of(WM_MOTION_TICKS, speed, 0.0, speed, kNone);
    const wm::motion_twist t = wm::twist_of(input, wm::kNeutralCalibration, make::two_wheels(), {});
    const wm::motion_noise n =
        wm::noise_of(input, t, kDt_s, p, make::two_wheels(), wm::kNeutralCalibration, kNotStated, {1, 1});
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, square(0.05) * speed * std::fmin(speed, 30.0) * kDt_s, n.lateral_m2);
  }
}

// A velocity that walks: the integral of its walk, q t^3 / 3 on each axis, whatever the input is.
TEST(test_noise_of_a_velocity_that_walks) {
  wm_motion_params p = only(nullptr, 0.0);
  p.velocity_speed_walk = 0.5, p.velocity_turn_walk = 0.3;
  const wm::motion_input input = input_of(WM_MOTION_CONSTANT_VELOCITY, 0.0, 0.0, 0.0, kNone);
  for (const double dt_s : {0.1, 0.4, 1.7}) {
    const wm::motion_noise n =
        wm::noise_of(input, {}, dt_s, p, make::no_wheels(), wm::kNeutralCalibration, kNotStated, {1, 1});
    const double cubed = dt_s * dt_s * dt_s / 3.0;
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.25 * cubed, n.distance_m2);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.25 * cubed, n.lateral_m2);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.09 * cubed, n.rotation_rad2);
  }
}

// Along and across the way, turned to base_link's axes: R diag(along, across) R'.
TEST(test_noise_on_the_axes_of_a_sideways_drive) {
  for (int i = 0; i < 16; i++) {
    const double angle = 0.4 * i, c = std::cos(angle), s = std::sin(angle);
    wm::motion_noise n{};
    n.distance_m2 = 0.5, n.lateral_m2 = 0.1;
    wm::turn_to_axes({2.0 * c, 2.0 * s, 0.3}, &n);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5 * c * c + 0.1 * s * s, n.distance_m2);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5 * s * s + 0.1 * c * c, n.lateral_m2);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.4 * c * s, n.distance_lateral);
  }
  wm::motion_noise still{};
  still.distance_m2 = 0.5;
  wm::turn_to_axes({0.0, 0.0, 0.3}, &still);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, still.distance_m2);
}

// A turn about a centre x ahead of base_link: J Q J' with the sideways way less x times the turn.
TEST(test_noise_of_a_turn_about_a_centre) {
  const double x = 0.4, q[3][3] = {{0.05, 0.01, -0.007}, {0.01, 0.04, 0.006}, {-0.007, 0.006, 0.03}};
  const double j[3][3] = {{1, 0, 0}, {0, 1, -x}, {0, 0, 1}};
  wm::motion_noise n{};
  n.distance_m2 = q[0][0], n.lateral_m2 = q[1][1], n.rotation_rad2 = q[2][2];
  n.distance_lateral = q[0][1], n.distance_rotation = q[0][2], n.lateral_rotation = q[1][2];
  wm_motion_calibration c = wm::kNeutralCalibration;
  c.value[wm::kRotationCenter] = x;
  wm::add_center_noise(c, &n);
  const double out[3][3] = {{n.distance_m2, n.distance_lateral, n.distance_rotation},
                            {0, n.lateral_m2, n.lateral_rotation},
                            {0, 0, n.rotation_rad2}};
  for (int a = 0; a < 3; a++)
    for (int b = a; b < 3; b++) {
      double sum = 0.0;
      for (int k = 0; k < 3; k++)
        for (int l = 0; l < 3; l++) sum += j[a][k] * q[k][l] * j[b][l];
      TEST_ASSERT_DOUBLE_WITHIN(1e-15, sum, out[a][b]);
    }
}

TEST(test_noise_of_changes_between_samples) {
  for (const bool holonomic : {false, true})
    for (const bool doubtful : {false, true}) {
      wm::motion_input input = input_of(WM_MOTION_TWIST, 1, 0, 0, doubtful ? kDoubtful : kNone);
      input.holonomic = holonomic;
      input.sampling[0] = 0.5f, input.sampling[1] = 0.25f, input.side_sampling = 0.125f;
      wm::motion_noise n{};
      n.distance_m2 = n.rotation_rad2 = n.lateral_m2 = 1.0;
      wm::add_sampling_noise(input, &n);
      TEST_ASSERT_EQUAL_DOUBLE(1.5, n.distance_m2);
      TEST_ASSERT_EQUAL_DOUBLE(1.25, n.rotation_rad2);
      TEST_ASSERT_EQUAL_DOUBLE(holonomic && !doubtful ? 1.125 : 1.0, n.lateral_m2);
    }
}

double fourth(double t) { return t * t * t * t; }

// sigma = a t^2 / 2 from when a sample was overdue until it has held for two seconds; then a turn walks by 0.3 rad per
// sqrt(s). By counts the way is known, by those of both wheels the turn, too.
TEST(test_noise_of_an_overdue_sample) {
  wm_motion_params p = only(nullptr, 0.0);
  p.hold_max_s = 2.0, p.noise_hold_mps2 = 0.6, p.noise_hold_radps2 = 0.4;
  const double overdue[] = {-1.0, -0.3, 0.0, 0.7, 1.8, 3.0};
  for (const int model : {WM_MOTION_TICKS, WM_MOTION_SPEED_YAW_RATE, WM_MOTION_TWIST, WM_MOTION_INCREMENTS})
    for (const double way_s : overdue)
      for (const double turn_s : overdue)
        for (int more = 0; more < 16; more++) {
          const bool is_counted = more & 1;
          const double dt_s = more & 8 ? 100.0 : 0.5;
          wm::motion_segment segment{};
          segment.input = input_of(model, 1.5, 0.0, 0.2, kNone);
          segment.input.holonomic = more & 2 && model == WM_MOTION_TWIST;
          segment.input.counted = more & 4 && model == WM_MOTION_INCREMENTS;
          segment.dt_s = dt_s, segment.overdue_s = way_s, segment.turn_overdue_s = turn_s;
          const auto grown = [dt_s](double from) {
            return fourth(std::fmin(std::fmax(from + dt_s, 0.0), 2.0)) - fourth(std::fmin(std::fmax(from, 0.0), 2.0));
          };
          const double held_m2 = square(0.3) * grown(way_s);
          const double unknown_s = std::fmax(turn_s + dt_s, 2.0) - std::fmax(turn_s, 2.0);
          double turn = square(0.2) * grown(turn_s) + 0.09 * unknown_s;
          double along = is_counted ? 0.0 : held_m2, across = segment.input.holonomic ? held_m2 : 0.0;
          if (is_counted && model == WM_MOTION_TICKS) turn = 0.0;
          if (is_counted) {
            along += square(1.5 * dt_s) * std::fmin(square(turn) / 8.0, 0.5);
            across += square(1.5 * dt_s) * std::fmin(turn / 3.0, 0.5);
          }
          if (segment.input.counted) along = across = turn = 0.0;
          wm::motion_noise n{};
          wm::add_overdue_noise(segment, p, is_counted, 0.0, &n);
          TEST_ASSERT_DOUBLE_WITHIN(1e-12 * dt_s * dt_s, along, n.distance_m2);
          TEST_ASSERT_DOUBLE_WITHIN(1e-12 * dt_s * dt_s, across, n.lateral_m2);
          TEST_ASSERT_DOUBLE_WITHIN(1e-12, turn, n.rotation_rad2);
        }
}

// A robot that is silent for too long may have gone on in any direction, at its last speed or at what it may have begun
// to drive since; from when its place was last known, however the time is cut.
TEST(test_noise_of_a_motion_that_is_not_known) {
  wm_motion_params p = only(nullptr, 0.0);
  p.hold_max_s = 2.0, p.noise_hold_mps2 = 0.6;
  for (const int model : {WM_MOTION_TICKS, WM_MOTION_SPEED_YAW_RATE, WM_MOTION_TWIST})
    for (const double a : {0.3, 1.5})
      for (const double b : {-2.5, 0.1})
        for (const double position_m2 : {0.0, 1.0, 400.0})
          for (const double unknown_s : {0.0, 0.8, 6.0}) {
            wm::motion_segment segment{};
            segment.input = input_of(model, -a, model == WM_MOTION_TWIST ? 0.4 : 0.0, b, kStale);
            segment.dt_s = 0.5, segment.unknown_s = unknown_s;
            double speed = std::hypot(a, segment.input.side_mps);
            if (model == WM_MOTION_TICKS) speed = std::fmax(a, std::fabs(b));
            speed = std::fmax(speed, 0.6);  // 0.6 m/s2 for two seconds, in the mean
            const double from_s = std::fmin(unknown_s, std::sqrt(position_m2) / speed);
            const double expected = square(speed) * (square(from_s + 0.5) - square(from_s));
            wm::motion_noise n{};
            wm::add_overdue_noise(segment, p, false, position_m2, &n);
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, expected, n.distance_m2);
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, expected, n.lateral_m2);
            TEST_ASSERT_EQUAL_DOUBLE(0.0, n.rotation_rad2);
          }
}

// While samples are refused: a change by up to the limits, evenly distributed, sigma = a t^2 / (2 sqrt 3), until two
// seconds.
TEST(test_noise_of_refused_samples) {
  wm_motion_params p = only(nullptr, 0.0);
  p.hold_max_s = 2.0, p.limits_mps2 = 15.0, p.limits_radps2 = 30.0;
  for (int refused = 0; refused < 4; refused++)
    for (const double from_s : {0.0, 0.4, 1.9, 3.0}) {
      wm::motion_segment segment{};
      segment.input.refused = static_cast<uint8_t>(refused);
      segment.refused_s = from_s, segment.dt_s = 0.3;
      const double grown = (fourth(std::fmin(from_s + 0.3, 2.0)) - fourth(std::fmin(from_s, 2.0))) / 12.0;
      wm::motion_noise n{};
      wm::add_refused_noise(segment, p, &n);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, refused & wm::kRefusedSpeed ? 225.0 * grown : 0.0, n.distance_m2);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, refused & wm::kRefusedTurn ? 900.0 * grown : 0.0, n.rotation_rad2);
    }
}

// ── motion_kind ─────────────────────────────────────────────────────────────────────────────────────────────────────

// Terms that have an effect, in the order of wm_motion_calibration: speed, yaw rate and its bias, left, right, track,
// steering, lag, slowdown, onset of speed and turn, gentle turns, side, centre.
const struct {
  wm::motion_kind kind;
  const char *terms;
} kStates[] = {{wm::kKindUnknown, ".............."},  {wm::kKindTicks, "...lrt.......c"},
               {wm::kKindGyro, "syb..t......dc"},     {wm::kKindSteering, "s.....o......."},
               {wm::kKindTwist, "syb.........dc"},    {wm::kKindMeasured, "syb.........dc"},
               {wm::kKindCommands, "syb....lSoOgdc"}, {wm::kKindCalibrated, ".............."}};

TEST(test_terms_that_are_states_by_the_kind) {
  for (const auto &row : kStates)
    for (int term = 0; term < wm::kCalibrationCount; term++) {
      const bool acts = row.terms[term] != '.' && row.terms[term] != '\0';
      TEST_ASSERT_EQUAL_MESSAGE(acts, wm::is_state(-0.1, term, row.kind), row.terms);
      TEST_ASSERT_FALSE_MESSAGE(wm::is_state(0.0, term, row.kind), row.terms);
      TEST_ASSERT_TRUE_MESSAGE(wm::is_state(0.1, term, row.kind), row.terms);
    }
}

// What may become a state: with a model, of its most general kind; a side's scale on a holonomic base alone and a
// centre with skid steer alone, unless their sigma is stated. Without a model anything that is not 0.
TEST(test_terms_that_may_become_states) {
  const struct {
    int model;
    const char *terms;
  } models[] = {{WM_MOTION_TICKS, kStates[1].terms},      {WM_MOTION_SPEED_YAW_RATE, kStates[2].terms},
                {WM_MOTION_ACKERMANN, kStates[3].terms},  {WM_MOTION_TWIST, kStates[6].terms},
                {WM_MOTION_INCREMENTS, kStates[5].terms}, {WM_MOTION_CONSTANT_VELOCITY, kStates[7].terms},
                {WM_MOTION_AUTO, "******************"}};
  for (const auto &row : models)
    for (const int drive : {WM_DRIVE_ROLLING, WM_DRIVE_HOLONOMIC, WM_DRIVE_SKID_STEER})
      for (int term = 0; term < wm::kCalibrationCount; term++) {
        const bool fits_drive = (term != wm::kSideScale || drive == WM_DRIVE_HOLONOMIC) &&
                                (term != wm::kRotationCenter || drive == WM_DRIVE_SKID_STEER);
        wm_motion_states states{};
        states.drive = drive;
        TEST_ASSERT_FALSE(wm::may_be_state(states, term, row.model));
        states.sigma[term] = 0.1;
        TEST_ASSERT_TRUE(wm::may_be_state(states, term, row.model));
        states.sigma[term] = -0.1;
        TEST_ASSERT_EQUAL_MESSAGE(row.terms[term] != '.' && fits_drive, wm::may_be_state(states, term, row.model),
                                  row.terms);
      }
}

// Priors: the sigma without its sign; of skid steer the track's and the turn rate's, where the configuration states
// none.
TEST(test_priors_of_the_terms) {
  for (const int drive : {WM_DRIVE_ROLLING, WM_DRIVE_HOLONOMIC, WM_DRIVE_SKID_STEER})
    for (int term = 0; term < wm::kCalibrationCount; term++)
      for (const double sigma : {-0.07, 0.0, 0.07}) {
        const bool skids = drive == WM_DRIVE_SKID_STEER && sigma < 0.0;
        wm_motion_states states{};
        states.drive = drive;
        states.sigma[term] = sigma;
        const double expected = skids && term == wm::kTrackScale     ? WM_SKID_TRACK_SIGMA
                                : skids && term == wm::kYawRateScale ? 0.2
                                                                     : std::fabs(sigma);
        TEST_ASSERT_EQUAL_DOUBLE(expected, wm::start_sigma(states, term));
        const double value = skids && term == wm::kTrackScale ? WM_SKID_TRACK : wm::kNeutralCalibration.value[term];
        TEST_ASSERT_EQUAL_DOUBLE(value, wm::start_value(states, term));
      }
}

// By default each term is a state where the motion has it, and nowhere else: no model gets one that it does not use.
TEST(test_by_default_the_kind_decides) {
  wm_motion_params p;
  wm_params_defaults(&wm_motion_params_table, &p);
  for (const auto &row : kStates)
    for (int term = 0; term < wm::kCalibrationCount; term++) {
      const bool acts = row.terms[term] != '.';
      const std::string what = std::string(row.terms) + ", term " + std::to_string(term);
      TEST_ASSERT_EQUAL_MESSAGE(acts, wm::is_state(p.states.sigma[term], term, row.kind), what.c_str());
    }
}

// Commands repeat until they change: more than a fifth of the moving rows equal the one before. A decision comes each
// 64 moving rows; of a run only the first eight repetitions count.
TEST(test_commands_are_told_by_their_repetitions) {
  const auto kind_of = [](int rows, int repeats_of_ten, bool moving) {
    wm::command_detector detector{};
    double v = 0.0, w = 0.0;
    for (int i = 0; i < rows; i++) {
      if (i % 10 >= repeats_of_ten) (i % 2 ? v : w) += 0.01;
      detector.note(v, w, moving);
    }
    return detector.kind();
  };
  TEST_ASSERT_EQUAL(wm::kKindUnknown, kind_of(63, 5, true));
  TEST_ASSERT_EQUAL(wm::kKindCommands, kind_of(64, 5, true));
  TEST_ASSERT_EQUAL(wm::kKindCommands, kind_of(640, 3, true));
  TEST_ASSERT_EQUAL(wm::kKindMeasured, kind_of(64, 0, true));
  TEST_ASSERT_EQUAL(wm::kKindMeasured, kind_of(640, 1, true));
  TEST_ASSERT_EQUAL(wm::kKindMeasured, kind_of(640, 2, true));  // a fifth is no more than a fifth
  TEST_ASSERT_EQUAL(wm::kKindUnknown, kind_of(640, 5, false));
  wm::command_detector detector{};
  for (int run = 0; run < 8; run++)
    for (int i = 0; i < 100; i++) detector.note(1.0, 0.01 * run, true);
  TEST_ASSERT_EQUAL(wm::kKindCommands, detector.kind());  // 72 rows of which 64 repeat count
  // A measurement that is written several times: each value as often, or once more where the rates are no multiples.
  const auto written = [](int rows, int times, int more, bool both = true) {
    wm::command_detector repeats{};
    double v = 1.0, w = 0.1;
    for (int i = 0, left = 0, k = 0; i < rows; i++, left--) {
      if (left == 0) {
        v += 0.01;
        if (both) w -= 0.001;
        left = times + (k++ % 2 ? more : 0);
      }
      repeats.note(v, w, true);
    }
    return repeats.kind();
  };
  for (int times = 2; times <= 8; times++) TEST_ASSERT_EQUAL(wm::kKindMeasured, written(640, times, 0));
  TEST_ASSERT_EQUAL(wm::kKindMeasured, written(640, 2, 1));
  TEST_ASSERT_EQUAL(wm::kKindMeasured, written(640, 3, 1));
  TEST_ASSERT_EQUAL(wm::kKindCommands, written(640, 3, 0, false));  // a controller that is slower than the rows
  TEST_ASSERT_EQUAL(wm::kKindCommands, written(640, 2, 4));
  TEST_ASSERT_EQUAL(wm::kKindCommands, written(640, 1, 2));
  wm::command_detector stands{};
  for (int i = 0; i < 400; i++) stands.note(1.0 + (i < 60 || i > 360 ? 0.01 * i : 0.0), 0.0, true);
  TEST_ASSERT_EQUAL(wm::kKindMeasured, stands.kind());  // one long run
}

}  // namespace
