// SPDX-License-Identifier: Apache-2.0
// Motion in space, part by part: each axis' own plausibility, how long a twist holds and what is assumed then, the pose
// some time ago, the noise of a step on each axis, and what a gyro that sticks has missed.
#include <vector>

#include "common/suite.h"
#include "motion/spatial.hpp"
#include "space_events.hpp"

namespace {

using namespace wm;

double cube(double t) { return t * t * t; }

// ── spatial_history ─────────────────────────────────────────────────────────────────────────────────────────────────

spatial_twist with(const spatial_twist &twist, int axis, double more) {
  spatial_twist out = twist;
  (axis < 3 ? out.v : out.w)[axis % 3] += more;
  return out;
}

// Each axis is held against its own values before: a speed may change by 3 m/s and 15 m/s2, a rate by 6 rad/s and 30
// rad/s2. Refused samples are counted, shown for five seconds, and the newest good one holds.
TEST(test_each_axis_is_held_against_its_own) {
  const spatial_twist base = {{0, 30, -30}, {0, 20, -20}};
  for (int axis = 0; axis < 6; axis++)
    for (const double sign : {-1.0, 1.0})
      for (const double share : {0.999, 1.001}) {
        spatial_history history;
        history.init({0.2, 2.0, 1, 15.0, 30.0});
        for (int i = 0; i <= 10; i++) TEST_ASSERT_TRUE(history.feed(make::at(0.1 * i), base));
        const double limit = axis < 3 ? 3.0 + 1.5 : 6.0 + 3.0;
        const bool is_good = share < 1.0;
        TEST_ASSERT_EQUAL(is_good, history.feed(make::at(1.1), with(base, axis, sign * share * limit)));
        TEST_ASSERT_EQUAL(!is_good, history.refuses());
        TEST_ASSERT_EQUAL(!is_good, history.refused_lately());
        TEST_ASSERT_EQUAL_UINT64(is_good ? 0 : 1, history.outliers());
        TEST_ASSERT_EQUAL_INT64(make::at(is_good ? 1.1 : 1.0), history.sample(0).t_ns);
        if (is_good) continue;
        for (int i = 12; i <= 80; i++) {
          TEST_ASSERT_TRUE(history.feed(make::at(0.1 * i), base));
          TEST_ASSERT_EQUAL(i < 61, history.refused_lately());
          TEST_ASSERT_FALSE(history.refuses());
        }
      }
  spatial_history free;  // without limits everything is plausible
  free.init({0.2, 2.0, 1, 0.0, 0.0});
  TEST_ASSERT_TRUE(free.feed(0, {}));
  TEST_ASSERT_TRUE(free.feed(make::at(0.1), {{500, 0, 0}, {0, 0, 400}}));
}

struct walked {
  double s = 0.0, walk_s3 = 0.0, refused_s4 = 0.0;
  vec3 way{}, turn{};
};
walked walk(const spatial_history &history, double from_s, double to_s) {
  walked out;
  history.walk(make::at(from_s), make::at(to_s), [&](const spatial_piece &p, wm_time_ns) {
    out.s += p.dt_s, out.walk_s3 += p.walk_s3, out.refused_s4 += p.refused_s4;
    out.way = out.way + p.dt_s * p.twist.v;
    out.turn = out.turn + p.dt_s * p.twist.w;
  });
  return out;
}

// A twist holds for gap_after_s, then walks until hold_max_s, then the body stands, unsure.
TEST(test_how_long_a_twist_holds) {
  for (const bool bridges : {false, true}) {
    spatial_history history;
    history.init({0.2, 2.0, bridges, 15.0, 30.0});
    const walked nothing = walk(history, 0.0, 1.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, nothing.s);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, nothing.way.x);
    TEST_ASSERT_TRUE(history.feed(make::at(1.0), {{1, 2, 3}, {0.1, 0.2, 0.3}}));
    const double spans[][2] = {{1.0, 1.1}, {1.0, 1.5}, {1.1, 2.9}, {1.6, 5.0}, {4.0, 7.0}, {0.5, 0.8}};
    for (const auto &span : spans) {
      const double from = span[0] - 1.0, to = span[1] - 1.0;
      const walked w = walk(history, span[0], span[1]);
      const auto within = [&](double a, double b) { return std::fmax(std::fmin(to, b) - std::fmax(from, a), 0.0); };
      const double walks_from = std::fmin(std::fmax(from, 0.2), 2.0), walks_to = std::fmin(std::fmax(to, 0.2), 2.0);
      const double s3 = (cube(walks_to) - cube(walks_from)) / 3.0 + 4.0 * within(2.0, 1e9);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, to - from, w.s);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, s3, w.walk_s3);
      const double held = within(-1e9, 2.0);
      for (int i = 0; i < 3; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, held * (i + 1), w.way[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.1 * held * (i + 1), w.turn[i]);
      }
    }
  }
}

// The first sample has no period; each further one that is no gap gives it. Three are kept, the newest first; one of
// the same stamp replaces the newest.
TEST(test_the_samples_that_are_kept) {
  spatial_history history;
  history.init({0.2, 2.0, 1, 0.0, 0.0});
  const double stamps[] = {0.1, 0.15, 0.25, 0.25, 0.6, 0.7};
  const int samples[] = {1, 2, 3, 3, 3, 3};
  const double periods[] = {0.02, 0.05, 0.1, 0.1, 0.1, 0.1}, before[] = {0.0, 0.1, 0.15, 0.15, 0.25, 0.6};
  for (int i = 0; i < 6; i++) {
    TEST_ASSERT_TRUE(history.feed(make::at(stamps[i]), {{1.0 * i, 0, 0}, {}}));
    TEST_ASSERT_EQUAL(samples[i], history.samples());
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, periods[i], history.period_s());
    TEST_ASSERT_EQUAL_DOUBLE(i, history.sample(0).twist.v.x);
    if (i > 0) TEST_ASSERT_EQUAL_INT64(make::at(before[i]), history.sample(1).t_ns);
  }
}

// Over a gap the mean of both ends, whose walk is known at both: T^3 / 12; after a gap for which nothing holds, half of
// the newer one. Where a gap is not bridged the first has held.
TEST(test_what_is_assumed_over_a_gap) {
  for (const bool bridges : {false, true})
    for (const double gap_s : {0.1, 0.21, 1.5, 3.0}) {
      spatial_history history;
      history.init({0.2, 2.0, bridges, 0.0, 0.0});
      (void)history.feed(make::at(1.0), {{1, 0, 0}, {0, 0, 0.5}});
      (void)history.feed(make::at(1.0 + gap_s), {{3, 0, 0}, {0, 0, 0.1}});
      const walked w = walk(history, 1.0, 1.0 + gap_s), half = walk(history, 1.0 + 0.5 * gap_s, 1.0 + gap_s);
      const bool is_bridged = bridges && gap_s > 0.2, is_held = gap_s <= 2.0;
      const double way = is_bridged ? (is_held ? 2.0 : 1.5) * gap_s : std::fmin(gap_s, 2.0);
      const double turn = is_bridged ? (is_held ? 0.3 : 0.05) * gap_s : 0.5 * std::fmin(gap_s, 2.0);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, way, w.way.x);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, turn, w.turn.z);
      const double walks_to = std::fmax(std::fmin(gap_s, 2.0), 0.2);
      const double held_s3 = (cube(walks_to) - cube(0.2)) / 3.0 + 4.0 * std::fmax(gap_s - 2.0, 0.0);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, is_bridged ? cube(gap_s) / 12.0 : held_s3, w.walk_s3);
      if (is_bridged) TEST_ASSERT_DOUBLE_WITHIN(1e-9, cube(gap_s) / 24.0, half.walk_s3);
      const spatial_twist change = history.last_change();
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, gap_s < 0.2 ? 2.0 : 0.0, change.v.x);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, gap_s < 0.2 ? -0.4 : 0.0, change.w.z);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, gap_s < 0.2 ? gap_s : 0.02, history.period_s());
    }
}

// While samples are refused: a quarter of the square of the way at 1 m/s2, (t^4 - t0^4) / 4, until hold_max_s.
TEST(test_what_refused_samples_leave_open) {
  spatial_history history;
  history.init({0.2, 2.0, 1, 15.0, 30.0});
  (void)history.feed(make::at(1.0), {});
  TEST_ASSERT_EQUAL_DOUBLE(0.0, walk(history, 1.0, 1.1).refused_s4);
  TEST_ASSERT_FALSE(history.feed(make::at(1.1), {{90, 0, 0}, {}}));
  for (const double span : {1.1, 1.9, 2.9, 4.0}) {
    const double to = std::fmin(span + 0.1 - 1.0, 2.0), from = std::fmin(span - 1.0, 2.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.25 * (cube(to) * to - cube(from) * from),
                              walk(history, span, span + 0.1).refused_s4);
  }
  TEST_ASSERT_TRUE(history.feed(make::at(1.2), {}));
  TEST_ASSERT_EQUAL_DOUBLE(0.0, walk(history, 1.2, 1.3).refused_s4);
}

// The pose some time ago is the one that was there, with its twist; ahead the newest twist goes on. A
// pose that is older than the memory is reported.
TEST(test_the_motion_since_some_time_ago) {
  spatial_history history;
  history.init({0.2, 2.0, 1, 0.0, 0.0});
  std::vector<pose3> poses = {kNoMotion};
  std::vector<spatial_twist> twists;
  const auto twist_at = [](int i) {
    return spatial_twist{{1.0 + 0.1 * i, 0.3 * std::sin(i), -0.2}, {0.2 * std::cos(i), 0.1, 0.5 * std::sin(0.5 * i)}};
  };
  (void)history.feed(0, twist_at(0));
  for (int i = 1; i <= 20; i++) {
    (void)history.feed(make::at(0.1 * i), twist_at(i));
    history.advance(make::at(0.1 * (i - 1)), make::at(0.1 * i), [&](const spatial_piece &p, wm_time_ns) {
      poses.push_back(compose(poses.back(), motion_of(p.twist.v, p.twist.w, p.dt_s)));
      twists.push_back(p.twist);
    });
  }
  TEST_ASSERT_EQUAL(21, poses.size());
  for (const double age_s : {-0.3, 0.0, 0.04, 0.53, 1.23, 1.97, 2.1}) {
    pose3 since;
    spatial_twist twist;
    TEST_ASSERT_EQUAL(age_s < 2.05, history.moved_since(age_s, &since, &twist));
    if (age_s > 2.05) continue;
    const int k = 20 - static_cast<int>(std::ceil(age_s / 0.1 - 1e-6));  // the pose before it
    pose3 then = poses[k < 20 ? k : 20];
    if (age_s > 0.0)
      then = compose(then, motion_of(twists[k].v, twists[k].w, 0.1 * (20 - k) - age_s));
    else
      then = compose(then, motion_of(twist_at(20).v, twist_at(20).w, -age_s));
    const pose3 expected = between(then, poses[20]);
    for (int i = 0; i < 3; i++) {
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected.p[i], since.p[i]);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected.q.v[i], since.q.v[i]);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, age_s > 0.0 ? twists[k].v[i] : twist_at(20).v[i], twist.v[i]);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, age_s > 0.0 ? twists[k].w[i] : twist_at(20).w[i], twist.w[i]);
    }
  }
}

// ── spatial_motion ──────────────────────────────────────────────────────────────────────────────────────────────────

// With the default parameters and no wheels.
struct motion_by_default {
  wm_motion_params p;
  wm_wheels wheels = make::no_wheels();
  spatial_motion motion;
  explicit motion_by_default(const spatial_noise &noise = {}) {
    wm_params_defaults(&wm_motion_params_table, &p);
    motion.init(&p, &wheels, noise);
  }
};

wm_event twist6(double t_s, const spatial_twist &t) { return make::log6(t_s, t.v, t.w); }

// A sample's error, and a third of the square of a change beyond the noise of two samples, held for a period: on each
// axis its own.
TEST(test_noise_of_a_step_on_each_axis) {
  const spatial_noise noise = {{0.01, 0.02, 0.03}, {0.004, 0.005, 0.006}, 0.05, 0.07};
  const spatial_twist a = {{1.0, 0.5, -0.3}, {0.1, -0.2, 0.3}}, change = {{0.2, -0.01, 0.3}, {-0.1, 0.05, 0.002}};
  for (const double dt_s : {0.1, 0.05, 0.15}) {
    motion_by_default by(noise);
    spatial_motion &motion = by.motion;
    motion.feed(twist6(0.0, a));
    motion.feed(twist6(0.1, {a.v + change.v, a.w + change.w}));
    const vec3 v = a.v + change.v, w = a.w + change.w;
    int steps = 0;
    motion.walk(make::at(0.1), make::at(0.1 + dt_s), [&](const spatial_step &s) {
      for (int i = 0; i < 3; i++) {
        const double held_v = std::fmax(square(change.v[i]) - 2.0 * square(noise.v_mps[i]), 0.0) / 3.0,
                     held_w = std::fmax(square(change.w[i]) - 2.0 * square(noise.w_radps[i]), 0.0) / 3.0;
        const double v_var = square(noise.v_mps[i]) + square(0.05 * length(v)) + held_v,
                     w_var = square(noise.w_radps[i]) + square(0.07 * length(w)) + held_w;
        const double held_s2 = dt_s * std::fmax(dt_s, 0.1);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, v_var * held_s2, s.place_m2[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, w_var * held_s2, s.turn_rad2[i]);
        TEST_ASSERT_EQUAL_DOUBLE(v[i], s.v_mps[i]);
        TEST_ASSERT_EQUAL_DOUBLE(w[i], s.w_radps[i]);
      }
      steps++;
    });
    TEST_ASSERT_EQUAL(1, steps);
    vec3 v_var, w_var;
    motion.sample_noise(&v_var, &w_var);
    for (int i = 0; i < 3; i++) {
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, square(noise.v_mps[i]) + square(0.05 * length(v)), v_var[i]);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, square(noise.w_radps[i]) + square(0.07 * length(w)), w_var[i]);
    }
    spatial_twist now, slope;
    TEST_ASSERT_TRUE(motion.sample_now(&now, &slope));
    for (int i = 0; i < 3; i++) {
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, 10.0 * change.v[i], slope.v[i]);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, 10.0 * change.w[i], slope.w[i]);
      TEST_ASSERT_EQUAL_DOUBLE(v[i], now.v[i]);
    }
  }
}

// While samples are refused the body may have changed by up to the limits, evenly distributed: a t^2 / (2 sqrt 3) since
// the last good one, of place and rotation alike.
TEST(test_noise_of_refused_samples_in_space) {
  motion_by_default by;
  spatial_motion &motion = by.motion;
  for (int i = 0; i <= 10; i++) motion.feed(twist6(0.1 * i, {}));
  motion.feed(twist6(1.1, {{90, 0, 0}, {}}));
  TEST_ASSERT_EQUAL_UINT32(WM_MOTION_HEALTH_IMPLAUSIBLE, motion.health());
  TEST_ASSERT_EQUAL_UINT64(1, motion.outliers());
  double place[3] = {}, turn[3] = {};
  motion.walk(make::at(1.1), make::at(1.2), [&](const spatial_step &s) {
    for (int i = 0; i < 3; i++) place[i] += s.place_m2[i], turn[i] += s.turn_rad2[i];
  });
  const double grown = (std::pow(0.2, 4) - std::pow(0.1, 4)) / 12.0;
  for (int i = 0; i < 3; i++) {
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, square(by.p.limits_mps2) * grown, place[i]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, square(by.p.limits_radps2) * grown, turn[i]);
  }
}

// A planar twist, and what wheels and a gyro give, are motion in space without other components.
TEST(test_planar_motion_in_space) {
  for (const bool twists : {false, true}) {
    motion_by_default by;
    spatial_motion &motion = by.motion;
    for (int i = 0; i <= 20; i++)
      motion.feed(twists ? make::twist(0.05 * i, 0.7, -0.3)
                         : make::quantities(0.05 * i, {{WM_Q_VEHICLE_SPEED, 0.7}, {WM_Q_YAW_RATE, -0.3}}));
    const double expected[6] = {0.7, 0, 0, 0, 0, -0.3};
    for (int i = 0; i < 3; i++) {
      TEST_ASSERT_EQUAL_DOUBLE(expected[i], motion.v_mps()[i]);
      TEST_ASSERT_EQUAL_DOUBLE(expected[3 + i], motion.w_radps()[i]);
    }
  }
}

// Over a silence velocity and rates walk by 0.3 per sqrt(s).
TEST(test_noise_of_a_silence_in_space) {
  motion_by_default by;
  spatial_motion &motion = by.motion;
  motion.feed(twist6(0.0, {{1, 0, 0}, {}}));
  motion.feed(twist6(0.1, {{1, 0, 0}, {}}));
  double place[3] = {}, turn[3] = {};
  motion.walk(make::at(0.1), make::at(1.1), [&](const spatial_step &s) {
    for (int i = 0; i < 3; i++) place[i] += s.place_m2[i], turn[i] += s.turn_rad2[i];
  });
  const double expected = 0.09 * (1.0 - cube(0.2)) / 3.0;
  for (int i = 0; i < 3; i++) {
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected, place[i]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected, turn[i]);
  }
}

// ── spatial_source ──────────────────────────────────────────────────────────────────────────────────────────────────

using make::imu;

spatial_source begun() {
  spatial_source out;
  out.init(2.0, {0.05, 0.015});
  return out;
}

// A pseudo-random number between -1 and 1.
double noise_of(int i, int axis) {
  const auto h = static_cast<uint32_t>(i * 6 + axis) * 2654435761u;
  return static_cast<double>(h >> 8) / static_cast<double>(1u << 23) - 1.0;
}

// What an axis missed since its last value until it was found stuck: the turn by the twist less its own, and what a
// twist at rest may hide; without a twist's rates a turn of 0.1 rad per sqrt(s). Once.
TEST(test_what_a_stuck_axis_has_missed) {
  constexpr double kStep_s = 0.01, kRest_radps = 0.015;
  for (int axis = 0; axis < 3; axis++)
    for (const bool has_rates : {false, true}) {
      spatial_source source = begun();
      const spatial_twist log = {{0.4, 0, 0}, has_rates ? vec3{0.2, -0.3, 0.4} : vec3{0, 0, 0}};
      vec3 last{};
      double turn_rad2[3], since_s = -1.0, value = 0.0;
      int stuck_at = -1;
      for (int i = 0; i < 1200 && stuck_at < 0; i++) {
        spatial_twist now = log;
        if (i % 10 == 0) (void)source.take(twist6(kStep_s * i, log), &now);
        vec3 w = {0.05 * noise_of(i, 0), 0.05 * noise_of(i, 1), 0.05 * noise_of(i, 2)};
        if (i == 1000) value = last[axis];
        if (i >= 1000) w[axis] = value;
        last = w;
        (void)source.take(imu(kStep_s * i, w, {noise_of(i, 3), noise_of(i, 4), 9.8 + noise_of(i, 5)}), &now);
        if (source.stuck_rates()) stuck_at = i;
        if (stuck_at < 0) TEST_ASSERT_FALSE(source.take_missed(turn_rad2, &since_s));
      }
      TEST_ASSERT_EQUAL(999 + 26, stuck_at);  // the first sample beyond a quarter of a second
      TEST_ASSERT_EQUAL(1u << axis, source.stuck_rates());
      TEST_ASSERT_TRUE(source.take_missed(turn_rad2, &since_s));
      const double passed_s = kStep_s * (stuck_at - 999);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, passed_s, since_s);
      const double apart_rad = (log.w[axis] - value) * passed_s;
      const double expected = has_rates ? square(apart_rad) + square(kRest_radps * passed_s) : 0.01 * passed_s;
      for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-9, i == axis ? expected : 0.0, turn_rad2[i]);
      TEST_ASSERT_FALSE(source.take_missed(turn_rad2, &since_s));
    }
}

// A turn that was missed evenly over a way bends it to the sides: a third of its square times the way's.
TEST(test_a_missed_turn_bends_the_way) {
  for (int axis = 0; axis < 3; axis++) {
    motion_by_default by;
    spatial_motion &motion = by.motion;
    const spatial_twist log = {{0.4, 0.2, 0.1}, {0.2, -0.3, 0.4}};
    vec3 last{};
    double before[3] = {}, after[3] = {}, turned[3] = {}, value = 0.0, since_s = 0.0;
    bool is_found = false;
    for (int i = 0; i < 1200 && !is_found; i++) {
      const double t_s = 0.01 * i;
      if (i % 10 == 0) motion.feed(twist6(t_s, log));
      vec3 w = {0.05 * noise_of(i, 0), 0.05 * noise_of(i, 1), 0.05 * noise_of(i, 2)};
      if (i == 1000) value = last[axis];
      if (i >= 1000) w[axis] = value;
      last = w;
      motion.feed(imu(t_s, w, {noise_of(i, 3), noise_of(i, 4), 9.8 + noise_of(i, 5)}));
      is_found = motion.source().stuck_rates() != 0;
      since_s = 0.01 * (i - 999);
      motion.walk(make::at(t_s), make::at(t_s + 1e-4), [&](const spatial_step &s) {
        for (int k = 0; k < 3; k++)
          (is_found ? after : before)[k] = s.place_m2[k], turned[k] = is_found ? s.turn_rad2[k] : 0.0;
      });
    }
    TEST_ASSERT_TRUE(is_found);
    for (int k = 0; k < 3; k++) {
      TEST_ASSERT_EQUAL(k == axis, turned[k] > 1e-4);
      TEST_ASSERT_EQUAL(k != axis, after[k] > before[k] + 1e-6);
    }
    const int side = axis == 0 ? 1 : 0, other = 3 - axis - side;
    const double bent_m2 = dot(log.v, log.v) * since_s * since_s * turned[axis] / 3.0;
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * bent_m2, bent_m2, after[side] - before[side]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * bent_m2, bent_m2, after[other] - before[other]);
  }
}

// GIVEN a gyro that has fallen silent WHEN the log has no rates THEN each axis turns by 0.1 rad per sqrt(s) that
// nothing measures; with the log's rates nothing is unmeasured.
TEST(test_turns_that_nothing_measures) {
  for (const bool has_rates : {false, true}) {
    motion_by_default by;
    spatial_motion &motion = by.motion;
    const spatial_twist log = {{0.5, 0, 0}, {0, 0, has_rates ? 0.01 : 0.0}};
    for (int i = 0; i <= 200; i++) {
      if (i % 10 == 0) motion.feed(twist6(0.01 * i, log));
      if (i < 100) motion.feed(imu(0.01 * i, {noise_of(i, 0), noise_of(i, 1), noise_of(i, 2)}, {0, 0, 9.8}));
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, has_rates ? 0.0 : 0.03, motion.unmeasured_turn_rad2ps(make::at(2.0)));
    motion.walk(make::at(2.0), make::at(2.1), [&](const spatial_step &s) {
      for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-9, has_rates ? 0.0 : 0.001, s.turn_rad2[i]);
    });
  }
}

// A log whose rates jitter about none stands by its mean: a coarse gyro that shows one value then is alive. A log that
// turns steadily does not stand.
TEST(test_a_body_stands_by_the_mean_of_its_log) {
  for (const bool turns : {false, true}) {
    spatial_source source = begun();
    for (int i = 0; i < 2000; i++) {
      const double jitter = (i / 10) % 2 ? 0.02 : -0.02;
      spatial_twist now = {{0.06 * ((i / 10) % 2 ? 1 : -1), 0, 0}, {0, turns ? 0.02 : jitter, turns ? 0.01 : -jitter}};
      if (i % 10 == 0) (void)source.take(twist6(0.01 * i, now), &now);
      vec3 w = {0.01 * noise_of(i, 0), 0.01 * noise_of(i, 1), 0.01 * noise_of(i, 2)};
      if (i >= 1000) w.z = 0.01;
      (void)source.take(imu(0.01 * i, w, {noise_of(i, 3), noise_of(i, 4), 9.8 + noise_of(i, 5)}), &now);
    }
    TEST_ASSERT_EQUAL(turns ? 4 : 0, source.stuck_rates());
  }
}

// A velocity that is held beside a gyro walks from when the next twist is overdue, after 0.2 s or one of its own
// periods, until hold_max_s: the integral of the square of its age, by small steps.
TEST(test_the_walk_of_a_held_velocity) {
  for (const double period_s : {0.1, 0.5}) {
    spatial_source source = begun();
    double t_s = 0.0;
    for (int i = 0; i <= 1000; i++) {
      t_s = 0.01 * i;
      spatial_twist now = {{0.4, 0.1, 0}, {}};
      if (i % static_cast<int>(std::lround(100 * period_s)) == 0) (void)source.take(twist6(t_s, now), &now);
      (void)source.take(imu(t_s, {noise_of(i, 0), noise_of(i, 1), noise_of(i, 2)}, {noise_of(i, 3), 0, 9.8}), &now);
    }
    TEST_ASSERT_TRUE(source.is_held());
    const double overdue_s = std::fmax(0.2, period_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, period_s, source.twist_period_s());
    TEST_ASSERT_TRUE(source.velocity_is_known(make::at(t_s + overdue_s - 1e-3)));
    TEST_ASSERT_FALSE(source.velocity_is_known(make::at(t_s + overdue_s + 1e-3)));
    for (const double end_s : {0.1, 0.4, 0.9, 2.0, 3.5})
      for (const double dt_s : {0.05, 0.3, 1.7}) {
        double s3 = 0.0;
        const int cuts = 20000;
        for (int i = 0; i < cuts; i++) {
          const double age_s = end_s - dt_s + dt_s * (i + 0.5) / cuts;
          s3 += age_s < overdue_s ? 0.0 : square(std::fmin(age_s, 2.0)) * dt_s / cuts;
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * s3 + 1e-4, s3, source.unmeasured_s3(dt_s, make::at(t_s + end_s)));
      }
  }
}

// The period of the twists is their mean one, with a gain of a sixteenth; after a silence longer than hold_max_s
// neither a period nor a change of velocity is taken from it.
TEST(test_the_period_and_the_change_of_twists) {
  spatial_source source = begun();
  double t_s = 0.0, period_s = 0.0;
  spatial_twist before{};
  for (int i = 0; i < 40; i++) {
    const double dt_s = i == 30 ? 2.5 : i < 20 ? 0.1 : 0.3;
    t_s += dt_s;
    const spatial_twist twist = {{0.1 * i, -0.2 * i, 0.3}, {0.01 * i, 0, 0.02 * i * i}};
    spatial_twist now = twist;
    (void)source.take(twist6(t_s, twist), &now);
    if (i == 0) before = twist;
    if (i == 1) period_s = dt_s;
    if (i > 1 && dt_s < 2.0) period_s += (dt_s - period_s) / 16.0;
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, period_s, source.twist_period_s());
    for (int k = 0; k < 3; k++) {
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, dt_s < 2.0 ? twist.v[k] - before.v[k] : 0.0, source.velocity_change()[k]);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, dt_s < 2.0 ? twist.w[k] - before.w[k] : 0.0, source.rate_change()[k]);
    }
    before = twist;
  }
}

// Rates are fresh for a quarter of a second after an IMU with three axes sent them, and so is the force.
TEST(test_which_values_are_fresh) {
  const wm_quantity axes[6] = {WM_Q_ROLL_RATE,      WM_Q_PITCH_RATE,     WM_Q_YAW_RATE,
                               WM_Q_ACCELERATION_X, WM_Q_ACCELERATION_Y, WM_Q_ACCELERATION_Z};
  for (int missing = 0; missing < 7; missing++)
    for (const double late_s : {0.24, 0.26}) {
      spatial_source source = begun();
      spatial_twist now{};
      for (int k = 0; k < 6; k++)
        if (k != missing) (void)source.take(make::quantities(0.0, {{axes[k], 0.1 * (k + 1)}}), &now);
      const bool rates = missing >= 3, force = missing < 3 || missing == 6;
      TEST_ASSERT_EQUAL(rates, source.by_gyro());
      TEST_ASSERT_EQUAL(force, source.force_is_fresh());
      (void)source.take(make::quantities(late_s, {{WM_Q_YAW_RATE, 0.7}, {WM_Q_ACCELERATION_Z, 9.0}}), &now);
      const bool has_rates = missing > 1 && late_s < 0.25, has_force = missing != 3 && missing != 4 && late_s < 0.25;
      TEST_ASSERT_EQUAL(has_rates, source.rates_are_fresh());
      TEST_ASSERT_EQUAL(has_rates, source.by_gyro());
      TEST_ASSERT_EQUAL(has_force, source.force_is_fresh());
      if (source.rates_are_fresh()) {
        const double expected[3] = {0.1, 0.2, 0.7}, got[3] = {now.w.x, now.w.y, now.w.z};
        TEST_ASSERT_EQUAL_DOUBLE_ARRAY(expected, got, 3);
      }
      (void)source.take(make::quantities(late_s, {{WM_Q_VEHICLE_SPEED, 1.0}}), &now);
      TEST_ASSERT_FALSE(source.rates_are_fresh());
      TEST_ASSERT_FALSE(source.force_is_fresh());
    }
}

// A log without rates and without an IMU: the turn of each axis is unknown, and motion_health has the flag.
TEST(test_a_log_without_rates_measures_no_turn) {
  motion_by_default by({{0.01, 0.01, 0.01}, {0.004, 0.004, 0.004}, 0, 0});
  by.motion.feed(twist6(0.0, {{1, 0, 0}, make::kNoRates}));
  by.motion.feed(twist6(0.1, {{1, 0, 0}, make::kNoRates}));
  by.motion.walk(make::at(0.0), make::at(0.1), [](const spatial_step &s) {
    for (int i = 0; i < 3; i++) {
      TEST_ASSERT_EQUAL_DOUBLE(0.0, s.w_radps[i]);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.01 * s.dt_s + square(0.004) * s.dt_s * 0.1, s.turn_rad2[i]);
    }
  });
  TEST_ASSERT_EQUAL_HEX32(WM_MOTION_HEALTH_TURN_SILENT, by.motion.health());
  by.motion.feed(twist6(0.2, {{1, 0, 0}, {0, 0, 0.1}}));
  TEST_ASSERT_EQUAL_HEX32(0, by.motion.health());
}

// The sigma of a row takes the place of the usual one. A row holds until the next has come: the larger one of both.
TEST(test_a_row_states_its_own_sigma) {
  motion_by_default by({{0.01, 0.02, 0.03}, {0.004, 0.004, 0.004}, 0, 0});
  const double stated[] = {NAN, 0.3, 0.001, 0.001, NAN}, newest[] = {0.02, 0.3, 0.001, 0.001, 0.02},
               held[] = {0.02, 0.3, 0.3, 0.001, 0.001};
  for (int k = 0; k < 5; k++) {
    wm_event e = twist6(0.1 * k, {{1, 0, 0}, {0, 0, 0}});
    e.as.twist6.v_sigma_mps = stated[k];
    by.motion.feed(e);
    vec3 v_var, w_var;
    by.motion.sample_noise(&v_var, &w_var);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, square(newest[k]), v_var.y);
    by.motion.walk(make::at(0.1 * k), make::at(0.1 * k + 0.1), [&](const spatial_step &s) {
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, square(held[k]) * s.dt_s * 0.1, s.place_m2[1]);
    });
  }
}

}  // namespace
