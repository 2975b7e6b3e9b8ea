// SPDX-License-Identifier: Apache-2.0
// Two tests of the measured turn, each against a plain computation of the same: likelihood ratios of another factor on
// the turn (turn_check), and the way laid over positions as it is and mirrored (course_test).
#include <vector>

#include "common/suite.h"
#include "events.hpp"
#include "filters/core/course_test.hpp"
#include "filters/core/turn_check.hpp"
#include "math/elementary.hpp"
#include "waymark/random.h"

namespace {

constexpr int kN = wm::noise_adaption::kBlock;

// ── turn_check ──────────────────────────────────────────────────────────────────────────────────────────────────────

// The mean of a linear filter whose measured turns count `factor` times, and the likelihood ratio of that factor.
struct alternative {
  double factor, x[kN] = {}, nats = 0.0;

  void move(double x_m, double y_m, double turn_rad) {
    x[0] -= y_m * x[2];
    x[1] += x_m * x[2];
    x[2] += factor * turn_rad;
  }
  double expected(const double h[kN]) const {
    double sum = 0.0;
    for (int i = 0; i < kN; i++) sum += h[i] * x[i];
    return sum;
  }
  void update(const double h[kN], const double gain[kN], double observed) {
    const double innovation = observed - expected(h);
    for (int i = 0; i < kN; i++) x[i] += gain[i] * innovation;
  }
};

double clipped_nis(double innovation, double variance) { return std::fmin(innovation * innovation / variance, 9.0); }

// The check beside a filter with the turn as it is and filters with each alternative.
struct turns {
  wm::turn_check check;
  alternative as_is{1.0}, other[2] = {{-1.0}, {0.0}};

  turns() { check.init(); }
  void move(double x_m, double y_m, double turn_rad) {
    check.move(x_m, y_m, turn_rad);
    for (alternative *a : {&as_is, &other[0], &other[1]}) a->move(x_m, y_m, turn_rad);
  }
  void fade(double left) {
    check.fade_correlated(left);
    for (alternative *a : {&as_is, &other[0], &other[1]})
      for (int i = wm::noise_adaption::kPose; i < kN; i++) a->x[i] *= left;
  }
  void restart() {
    check.restart();
    for (alternative &a : other) std::memcpy(a.x, as_is.x, sizeof a.x);
  }
  void update(const double (&h)[kN], const double (&gain)[kN], double innovation, double variance) {
    wm::noise_adaption::row row{};
    std::memcpy(row.by, h, sizeof h);
    std::memcpy(row.gain, gain, sizeof gain);
    row.innovation = innovation;
    row.variance = variance;
    check.update(row);
    const double observed = as_is.expected(h) + innovation;
    for (alternative &a : other) {
      // A shift of more than half a radian is beyond the derivatives.
      if (std::fabs(a.x[2] - as_is.x[2]) <= 0.5) {
        a.nats += 0.5 * (clipped_nis(innovation, variance) - clipped_nis(observed - a.expected(h), variance));
        a.nats = std::fmin(std::fmax(a.nats, 0.0), 40.0);
      }
      a.update(h, gain, observed);
    }
    as_is.update(h, gain, observed);
  }
  // The factor that the check lists; NaN: none.
  double listed() const {
    wm_calibration_value value{};
    wm::calibration_list list(&value, 1);
    check.list(&list);
    if (list.count() == 0) return NAN;
    TEST_ASSERT_EQUAL_STRING("motion.turn_factor", value.name);
    wm_alarm alarm{};
    wm::calibration_list alarms(&alarm, 1);
    check.list(&alarms);
    TEST_ASSERT_EQUAL(1, alarms.finish_alarms());
    TEST_ASSERT_EQUAL(WM_ALARM_TURN, alarm.kind);
    TEST_ASSERT_EQUAL(0, alarm.calibration);
    TEST_ASSERT_EQUAL_DOUBLE(value.value, alarm.value);
    return value.value;
  }
  double expected_listed() const {
    const alternative &best = other[0].nats >= other[1].nats ? other[0] : other[1];
    return best.nats > 20.0 ? best.factor : static_cast<double>(NAN);
  }
  void expect_listed() const {
    const double expected = expected_listed();
    if (std::isnan(expected))
      TEST_ASSERT_DOUBLE_IS_NAN(listed());
    else
      TEST_ASSERT_EQUAL_DOUBLE(expected, listed());
  }
};

// In each drive the true turn is the measured one times a factor. The factor is listed exactly while the likelihood
// ratio of a filter with that factor is above its limit.
TEST(test_a_factor_is_listed_when_its_filter_explains_the_innovations) {
  wm_random random = {11, 1, 0};
  const auto normal = [&] { return wm_random_next_normal(&random); };
  int listed[2] = {}, none = 0, ended = 0;
  for (int drive = 0; drive < 60; drive++) {
    turns t;
    double true_factor = drive % 3 == 0 ? -1.0 : drive % 3 == 1 ? 0.0 : 1.0;
    alternative truth{true_factor};
    bool was_listed = false;
    for (int step = 0; step < 400; step++) {
      if (step == 250) truth.factor = 1.0;  // later observations take it back
      const double x_m = 0.3 + 0.2 * normal(), y_m = 0.3 * normal(), turn = 0.02 * normal() + (drive % 2 ? 0.03 : 0.0);
      t.move(x_m, y_m, turn);
      truth.move(x_m, y_m, turn);
      if (step % 7 == 0) {
        t.fade(0.8);
        for (int i = wm::noise_adaption::kPose; i < kN; i++) truth.x[i] *= 0.8;
      }
      if (step == 120) {
        t.restart();
        std::memcpy(truth.x, t.as_is.x, sizeof truth.x);
      }
      double h[kN], gain[kN];
      for (int i = 0; i < kN; i++) h[i] = normal(), gain[i] = 0.06 * normal() + 0.1 * h[i];
      const double variance = 0.0009, innovation = truth.expected(h) - t.as_is.expected(h) + 0.03 * normal();
      const double observed = t.as_is.expected(h) + innovation;
      t.update(h, gain, innovation, variance);
      truth.update(h, gain, observed);
      t.expect_listed();
      const double factor = t.listed();
      ended += was_listed && std::isnan(factor);
      was_listed = !std::isnan(factor);
      none += std::isnan(factor);
      for (int k = 0; k < 2; k++) listed[k] += factor == t.other[k].factor;
    }
  }
  for (int k = 0; k < 2; k++) TEST_ASSERT_GREATER_THAN(100, listed[k]);
  TEST_ASSERT_GREATER_THAN(1000, none);
  TEST_ASSERT_GREATER_THAN(3, ended);
}

// GIVEN a factor that is certain for long WHEN the turn is right from now on THEN the 40 nats that it has at most are
// taken back: an observation of three sigma each for either.
TEST(test_a_factor_is_taken_back_within_as_many_observations) {
  turns t;
  double heading = 0.0;
  int until_listed = 0, until_gone = 0;
  const double h[kN] = {0.0, 0.0, 1.0, 0.0, 0.0}, none[kN] = {};
  t.move(0.0, 0.0, 0.1);  // the mirrored heading is off by 0.2 rad, that without a turn by 0.1
  for (int i = 0; i < 40; i++) {
    t.update(h, none, heading - 0.2, 0.01 / 9.0);
    if (std::isnan(t.listed())) until_listed = i + 1;
    t.expect_listed();
  }
  for (int i = 0; i < 40; i++) {
    t.update(h, none, 0.0, 0.01 / 9.0);
    if (!std::isnan(t.listed())) until_gone = i + 1;
    t.expect_listed();
  }
  TEST_ASSERT_EQUAL(4, until_listed);  // 4.5 nats each: 18 after the fourth
  TEST_ASSERT_EQUAL(4, until_gone);    // 40 - 22.5 is the first below 20
}

// ── course_test ─────────────────────────────────────────────────────────────────────────────────────────────────────

struct point {
  double x, y;
};

point turned(double angle, const point &p) {
  return {std::cos(angle) * p.x - std::sin(angle) * p.y, std::sin(angle) * p.x + std::cos(angle) * p.y};
}

// What is left of two sets of points about their middles, of which the second is turned in the best way; the turn is
// found by trying. `side` -1: the second set is mirrored.
std::vector<point> least_squares(const point *places, const point *ways, int n, double side) {
  point middle[2] = {};
  for (int i = 0; i < n; i++) {
    middle[0] = {middle[0].x + places[i].x / n, middle[0].y + places[i].y / n};
    middle[1] = {middle[1].x + ways[i].x / n, middle[1].y + side * ways[i].y / n};
  }
  std::vector<point> left(n);
  const auto squares = [&](double turn) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
      const point way = turned(turn, {ways[i].x - middle[1].x, side * ways[i].y - middle[1].y});
      left[i] = {places[i].x - middle[0].x - way.x, places[i].y - middle[0].y - way.y};
      sum += wm::square(left[i].x) + wm::square(left[i].y);
    }
    return sum;
  };
  double best = 0.0;
  for (int i = 0; i < 64; i++)
    if (squares(i * M_PI / 32) < squares(best)) best = i * M_PI / 32;
  for (double step = M_PI / 64; step > 1e-10; step *= 0.5)
    for (const double sign : {-1.0, 1.0})
      while (squares(best + sign * step) < squares(best)) best += sign * step;
  (void)squares(best);
  return left;
}

// The ways of slots of five seconds, bent by a bias of the turn rate about the middle time.
std::vector<point> bent(const point *ways, int n, double side, double bias_radps) {
  std::vector<point> out(ways, ways + n);
  for (int i = n - 1; i > 0; i--) {
    const double by = side * bias_radps * (5.0 * (i - 0.5) - 2.5 * (n - 1));
    const point step = turned(by, {ways[i - 1].x - ways[i].x, ways[i - 1].y - ways[i].y});
    out[i - 1] = {out[i].x + step.x, out[i].y + step.y};
  }
  return out;
}

// Log likelihood of the way, or of its mirror image, but for a constant: with the turn rate's bias of 0.02 rad/s, and
// errors that are a first-order autoregression.
double log_likelihood(const point *places, const point *ways, int n, double side, double stated) {
  const auto dot = [](const point &a, const point &b) { return a.x * b.x + a.y * b.y; };
  const double step = 1e-4;
  std::vector<point> left = least_squares(places, ways, n, side);
  const std::vector<point> more = least_squares(places, bent(ways, n, side, step).data(), n, side),
                           less = least_squares(places, bent(ways, n, side, -step).data(), n, side);
  double squares = 0.0, by_by = 0.0, by_left = 0.0;
  std::vector<point> by(n);
  for (int i = 0; i < n; i++) {
    by[i] = {(less[i].x - more[i].x) / (2.0 * step), (less[i].y - more[i].y) / (2.0 * step)};
    squares += dot(left[i], left[i]);
    by_by += dot(by[i], by[i]);
    by_left += dot(by[i], left[i]);
  }
  const double bias = by_left / (by_by + (squares + stated) / (2.0 * n) / (0.02 * 0.02));
  for (int i = 0; i < n; i++) left[i] = {left[i].x - bias * by[i].x, left[i].y - bias * by[i].y};
  double products = 0.0, older = 0.0;
  for (int i = 1; i < n; i++) {
    products += dot(left[i], left[i - 1]);
    older += dot(left[i - 1], left[i - 1]);
  }
  const double stays = std::fmin(std::fmax(products / older, 0.0), 1.0);
  double sum = (1.0 - stays * stays) * dot(left[0], left[0]) + stated;
  for (int i = 1; i < n; i++) {
    const point new_one = {left[i].x - stays * left[i - 1].x, left[i].y - stays * left[i - 1].y};
    sum += dot(new_one, new_one);
  }
  return -n * std::log(sum) - 0.5 * wm::square(bias / 0.02);
}

// A drive at changing speeds, sideways, too, ten times a second; its own dead reckoning is by the middle heading.
struct course_drive {
  wm_monitor_course course;
  wm_random random;
  double t_s = 0.0, x_m = 0.0, y_m = 0.0, heading_rad = 0.0, v[3] = {};

  explicit course_drive(uint64_t seed) : random{seed, 3, 0} { wm::course_begin(&course); }
  void go(double v_mps, double u_mps, double w_radps, double dt_s = 0.1) {
    wm_estimate e{};
    e.t_ns = make::at(t_s);
    e.v_mps[0] = v_mps, e.v_mps[1] = u_mps, e.w_radps[2] = w_radps;
    wm::course_move(&course, e);
    const double now[3] = {v_mps, u_mps, w_radps};
    for (int i = 0; i < 3; i++) v[i] = std::isfinite(now[i]) ? now[i] : 0.0;
    t_s += dt_s;
    const point step = turned(heading_rad + 0.5 * v[2] * dt_s, {v[0] * dt_s, v[1] * dt_s});
    x_m += step.x, y_m += step.y;
    heading_rad = wm::wrap(heading_rad + v[2] * dt_s);
  }
  void curve(int step) {
    go(1.0 + 0.5 * std::sin(0.3 * step), 0.3 * std::cos(0.2 * step), 0.5 * std::sin(0.02 * step));
  }
  // A position at the time that is reached, of the way itself or of its mirror image, laid somewhere on the map.
  point see(bool mirrored, double turn_rad, const point &shift, double noise_m, double sigma_m) {
    const point laid = turned(turn_rad, {x_m, mirrored ? -y_m : y_m});
    const point at = {laid.x + shift.x + noise_m * wm_random_next_normal(&random),
                      laid.y + shift.y + noise_m * wm_random_next_normal(&random)};
    wm_position p{};
    p.p_m[0] = at.x, p.p_m[1] = at.y;
    p.sigma_xy_m = sigma_m;
    wm::course_take(&course, make::at(t_s), p);
    return at;
  }
};

// GIVEN positions every second WHEN a slot of five seconds is complete THEN the log likelihood ratio of the mirror
// image is that of both laid over the means of slots, with the stated variances added.
TEST(test_the_ratio_is_that_of_both_laid_over_the_positions) {
  for (uint64_t seed = 1; seed <= 6; seed++) {
    course_drive d(seed);
    point places[33] = {}, ways[33] = {};
    double variance[33] = {}, least = 0.0;
    int slots = 0, in_slot = 0;
    for (int second = 0; second < 120; second++) {
      for (int i = 0; i < 10; i++) d.curve(10 * second + i);
      if (second % 5 == 0 && slots > 0) {
        places[slots - 1] = {places[slots - 1].x / in_slot, places[slots - 1].y / in_slot};
        ways[slots - 1] = {ways[slots - 1].x / in_slot, ways[slots - 1].y / in_slot};
        variance[slots - 1] /= in_slot;  // errors within five seconds are one
      }
      if (second % 5 == 0) slots++, in_slot = 0;
      const double sigma_m = 0.5 + 0.1 * (second % 3);
      const point at = d.see(seed % 2 == 0, 0.7 * static_cast<double>(seed), {20.0, -5.0}, 0.4, sigma_m);
      in_slot++;
      places[slots - 1] = {places[slots - 1].x + at.x, places[slots - 1].y + at.y};
      ways[slots - 1] = {ways[slots - 1].x + d.x_m, ways[slots - 1].y + d.y_m};
      variance[slots - 1] += 2.0 * sigma_m * sigma_m;
      const int complete = slots - 1;
      if (second % 5 != 0 || complete < 3) continue;
      // The windows of 6, 16 and 33 slots; the longest one's ratio is kept.
      bool is_mirrored = false;
      double nats = 0.0;
      for (const int window : {6, 16, 33}) {
        const int n = complete < window ? complete : window;
        double stated = 0.0;
        for (int i = complete - n; i < complete; i++) stated += variance[i];
        const point *from[2] = {places + complete - n, ways + complete - n};
        nats = log_likelihood(from[0], from[1], n, -1.0, stated) - log_likelihood(from[0], from[1], n, 1.0, stated);
        is_mirrored = is_mirrored || (n >= 6 && nats > 9.21);
        least = std::fmin(least, nats);
      }
      TEST_ASSERT_DOUBLE_WITHIN(1e-3 * (1.0 + std::fabs(nats)), nats, d.course.nats);
      TEST_ASSERT_EQUAL(is_mirrored, wm::course_contradicts(d.course));
      const double odds = -4.0 + least + std::fmax(nats, 0.0);
      TEST_ASSERT_DOUBLE_WITHIN(1e-3, 1.0 / (1.0 + std::exp(-odds)), wm::course_mirrored(d.course));
    }
    TEST_ASSERT_EQUAL(seed % 2 == 0, wm::course_contradicts(d.course));
  }
}

// GIVEN a receiver that wanders by metres for half a minute, beside a nearly straight way whose turn rate has a bias
// WHEN the robot drives for three minutes THEN its turn is not contradicted.
TEST(test_a_wandering_receiver_mirrors_no_straight_way) {
  for (uint64_t seed = 1; seed <= 40; seed++) {
    course_drive d(seed);
    const double bias_radps = 0.01 * wm_random_next_normal(&d.random);
    point wander = {};
    double heading_rad = 0.0;
    point true_place = {};
    for (int second = 0; second < 180; second++) {
      for (int i = 0; i < 10; i++) {
        const double w = 0.02 * std::sin(0.05 * second);
        d.go(1.0, 0.0, w + bias_radps);
        heading_rad += 0.1 * w;
        const point step = turned(heading_rad, {0.1, 0.0});
        true_place = {true_place.x + step.x, true_place.y + step.y};
      }
      const double left = std::exp(-1.0 / 25.0), added = 2.0 * std::sqrt(1.0 - left * left);
      wander = {left * wander.x + added * wm_random_next_normal(&d.random),
                left * wander.y + added * wm_random_next_normal(&d.random)};
      wm_position p{};
      p.p_m[0] = true_place.x + wander.x, p.p_m[1] = true_place.y + wander.y;
      p.sigma_xy_m = 0.8;
      wm::course_take(&d.course, make::at(d.t_s), p);
      TEST_ASSERT_FALSE(wm::course_contradicts(d.course));
    }
  }
}

// GIVEN positions that are exactly the mirror image of the way WHEN the image is asked for THEN it is the pose on it:
// the newest position, the other heading.
TEST(test_the_mirror_image_is_where_the_positions_are) {
  for (uint64_t seed = 1; seed <= 4; seed++) {
    course_drive d(seed);
    const double turn_rad = 1.9 * static_cast<double>(seed);
    for (int second = 0; second < 60; second++) {
      for (int i = 0; i < 10; i++) d.curve(10 * second + i);
      (void)d.see(true, turn_rad, {-7.0, 12.0}, 0.0, 0.1);
    }
    d.go(0.0, 0.0, 0.0);  // takes the way until now
    const wm_pose2 image = wm::course_mirror_image(d.course);
    const point at = turned(turn_rad, {d.x_m, -d.y_m});
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, at.x - 7.0, image.x_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, at.y + 12.0, image.y_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, wm::wrap(turn_rad - d.heading_rad - image.heading_rad));
  }
}

// The way of a position is that of its own stamp, before or behind the newest estimate by less than 1.5 s. A position
// that is farther off, or not of numbers, does not count.
TEST(test_a_position_counts_where_the_way_is_known) {
  for (const double ahead_s : {-1.6, -1.4, -0.5, 0.7, 1.4, 1.6}) {
    course_drive d(1);
    for (int i = 0; i < 100; i++) d.go(1.0, 0.4, 0.3);
    wm_position p{};
    p.sigma_xy_m = 1.0;
    wm::course_take(&d.course, make::at(9.9 + ahead_s), p);
    TEST_ASSERT_EQUAL(std::fabs(ahead_s) < 1.5 ? 1 : 0, d.course.opened);
    if (d.course.opened == 0) continue;
    const double heading = 0.3 * 9.9, sign = ahead_s;
    course_drive until(1);
    for (int i = 0; i < 99; i++) until.go(1.0, 0.4, 0.3);
    const point step = turned(heading + 0.15 * sign, {sign, 0.4 * sign});
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, until.x_m + step.x, d.course.slots[0].way_m[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, until.y_m + step.y, d.course.slots[0].way_m[1]);
  }
  for (int which = 0; which < 3; which++) {
    course_drive d(1);
    d.go(1.0, 0.0, 0.0);
    wm_position p{};
    (which == 0 ? p.p_m[0] : which == 1 ? p.p_m[1] : p.sigma_xy_m) = NAN;
    wm::course_take(&d.course, make::at(0.0), p);
    TEST_ASSERT_EQUAL(0, d.course.opened);
  }
}

// Speeds that are no numbers are none: the way stays. A second of silence is driven through, two begin the way anew.
TEST(test_gaps_and_speeds_that_are_no_numbers) {
  course_drive d(1);
  d.go(1.0, 0.2, 0.1, 1.0);
  d.go(NAN, NAN, NAN, 1.0);
  d.go(1.0, -0.3, 0.2, 0.5);
  d.go(0.0, 0.0, 0.0);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, d.x_m, d.course.way_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, d.y_m, d.course.way_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, d.heading_rad, d.course.heading_rad);
  for (const double gap_s : {1.4, 1.6, -0.1}) {
    course_drive gone(2);
    for (int second = 0; second < 60; second++) {
      for (int i = 0; i < 10; i++) gone.curve(10 * second + i);
      (void)gone.see(true, 0.3, {}, 0.0, 0.1);
    }
    TEST_ASSERT_TRUE(wm::course_contradicts(gone.course));
    gone.go(0.0, 0.0, 0.0, gap_s);
    gone.go(0.0, 0.0, 0.0);
    const bool is_known = gap_s == 1.4;
    TEST_ASSERT_EQUAL(is_known, gone.course.opened > 0);
    TEST_ASSERT_EQUAL(is_known, wm::course_contradicts(gone.course));
    if (!is_known) TEST_ASSERT_EQUAL_DOUBLE(0.0, wm::course_mirrored(gone.course));
  }
}

// No vehicle drives 16 m/s2 to either side; 14 may be. Two seconds more of it than of other driving contradict, and at
// most ten are remembered.
TEST(test_turns_that_no_vehicle_drives_contradict_for_as_long) {
  for (const double w_radps : {0.7, -0.7, 0.8, -0.8}) {
    course_drive d(1);
    const bool is_impossible = std::fabs(w_radps) > 0.75;
    int first = -1, last = -1, step = 0;
    const auto go = [&](double w, int steps) {
      for (int i = 0; i < steps; i++, step++) {
        d.go(20.0, 0.0, w);
        if (!wm::course_contradicts(d.course)) continue;
        if (first < 0) first = step;
        last = step;
      }
    };
    go(w_radps, 15);
    go(0.0, 30);  // makes up for it
    go(w_radps, 300);
    go(0.0, 200);
    TEST_ASSERT_EQUAL(is_impossible, first >= 0);
    if (!is_impossible) continue;
    TEST_ASSERT_INT_WITHIN(1, 45 + 21, first);
    TEST_ASSERT_INT_WITHIN(1, 345 + 80, last);
  }
}

}  // namespace
