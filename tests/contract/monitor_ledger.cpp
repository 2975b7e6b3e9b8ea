// SPDX-License-Identifier: Apache-2.0
// What the monitor counts from step to step, against a ledger in plain words, over random drives: the time of doubt, of
// agreement, of contradiction, of proof, and what a found pose has to do. And what it reports of a silent source, of a
// place off the map, and of the spread of a lost robot.
#include "common/suite.h"
#include "lone_monitor.hpp"
#include "waymark/random.h"

namespace {

double at_least_0(double value) { return std::fmax(value, 0.0); }

// What a step has seen.
struct seen {
  double dt_s;
  bool contradicts, fits, drives;
  uint8_t state;
  bool is_reset;  // the estimator counts another reset
};

// Seconds, but for `found`.
struct ledger {
  double doubt = 0.0, fitted = 0.0, since_found = 0.0, contradicted = 0.0, proof = 0.0, lost = 0.0;
  int found = 0;
  bool is_probation = false, is_early = false, was_lost = false, is_first = true;

  double least_doubt() const { return is_early && proof < 40.0 ? 3.0 : 0.0; }
  // A pose that a search found for a lost robot. Below 40 s of driving in agreement the one before was not proven.
  void find() {
    if (proof < 40.0) is_early = true, proof = 0.0;
    is_probation = (found > 0 && since_found < 60.0) || fitted < 5.0 || contradicted > 10.0;
    if (!is_probation) found = 0;
    doubt = is_probation ? std::fmin(3.0 * std::fmax(found, 1.0) + 0.5 * contradicted, 10.0) : least_doubt();
    found++;
    since_found = fitted = 0.0;
  }
  void contradict(bool fits, double dt_s) {
    is_probation = false;
    fitted = at_least_0(fitted - dt_s);
    const double most = fits ? 10.0 : 30.0;  // beside a source that fits: degraded, not lost
    if (doubt < most) doubt = std::fmin(doubt + dt_s, most);
  }
  void agree(double dt_s) {
    const double weight = 1.0 / (1.0 + at_least_0(contradicted - 10.0) / 10.0);
    fitted = std::fmin(fitted < 60.0 ? fitted + dt_s : 60.0, 61.0);
    doubt = std::fmax(doubt - (is_probation ? 1.0 : 1.0 / 3.0) * weight * dt_s, least_doubt());
  }
  void step(const seen &s) {
    double dt_s = is_first ? 0.0 : std::fmin(s.dt_s, 1.0);
    const bool is_lost = s.state == WM_STATE_LOST;
    if (s.state == WM_STATE_SEARCHING) {
      doubt = 0.0;
      is_first = false;
      return;
    }
    if (!is_first && (s.is_reset || (!is_lost && lost > 3.0)) && (was_lost || is_lost)) find();
    is_first = false;
    since_found += dt_s;
    was_lost = is_lost;
    lost = is_lost ? lost + dt_s : 0.0;
    const bool fits = s.fits && !is_lost;
    if (s.contradicts || is_lost) contradicted = std::fmin(contradicted + dt_s, 600.0);
    if (fits && !s.contradicts && doubt <= 0.0) contradicted = at_least_0(contradicted - 0.1 * dt_s);
    if (proof < 40.0 && s.contradicts) proof = 0.0;
    if (proof < 40.0 && !s.contradicts && fits && s.drives) proof += dt_s;
    if (s.contradicts)
      contradict(fits, dt_s);
    else if (fits)
      agree(dt_s);
  }
};

constexpr wm_alarm kWrong = {WM_ALARM_LASTING_ERROR, 0, 5.0};

// A drive of which each step is drawn: stretches of agreement, contradiction and silence, of driving and of standing;
// searches that find a pose.
struct random_drive {
  lone robot{true};
  ledger expected;
  wm_random random;
  bool is_good;
  wm_time_ns sighted_ns = WM_TIME_NONE;
  bool contradicts = false, sees = true, drives = true;
  int tracked = 0, in_doubt = 0, found = 0;

  // An odd seed: contradictions and losses are seldom.
  explicit random_drive(uint64_t seed) : random{seed, 6, 0}, is_good(seed % 2 != 0) {}
  double uniform() { return wm_random_next_uniform(&random); }

  void choose() {
    if (uniform() < 0.05) contradicts = uniform() < (is_good ? 0.05 : 0.4);
    if (uniform() < 0.03) sees = uniform() < 0.9;
    if (uniform() < 0.03) drives = uniform() < 0.8;
    wm_estimate &e = robot.estimate;
    const double chosen = uniform();
    if (e.state == WM_STATE_TRACKING) {
      if (chosen < (is_good ? 0.003 : 0.01)) e.state = WM_STATE_LOST;
      if (chosen > 0.999) e.state = WM_STATE_SEARCHING, e.resets++;
    } else if (chosen < 0.15) {
      if (uniform() < 0.7) e.resets++;
      e.state = WM_STATE_TRACKING;
    }
    const double way = uniform();  // below and above 0.05 m/s or rad/s, along each axis
    e.v_mps[0] = drives ? (way < 0.5 ? 0.06 : way < 0.6 ? -0.04 : 0.0) : 0.03;
    e.v_mps[1] = drives ? (way < 0.5 ? 0.0 : way < 0.6 ? 0.04 : 0.0) : -0.03;
    e.w_radps[2] = drives && way >= 0.6 ? (way < 0.8 ? 0.06 : -0.06) : 0.04;
  }
  void step(double dt_s) {
    const uint32_t resets_before = robot.estimate.resets;
    choose();
    robot.now_ns += wm_ns_from_seconds(dt_s);
    wm_event e{};
    e.t_ns = robot.now_ns;
    e.kind = WM_EVENT_SIGHTING;
    const wm_innovation record = record_of(WM_FUSED, uniform() < 0.5 ? 0.3 : -0.3);
    wm_estimate out = robot.estimate;
    out.t_ns = e.t_ns;
    const bool searches = out.state == WM_STATE_SEARCHING;
    const bool finds = !expected.is_first && !searches &&
                       (out.resets != resets_before || (out.state != WM_STATE_LOST && expected.lost > 3.0));
    if (sees) {
      (void)wm_monitor_take(&robot.monitor, &e, &record, 1);
      sighted_ns = e.t_ns;
    }
    // A found pose begins its windows anew: what was seen until then does not fit it.
    if (finds || searches) sighted_ns = WM_TIME_NONE;
    const bool fits = sighted_ns != WM_TIME_NONE && wm_seconds_between(sighted_ns, e.t_ns) <= 1.0;
    const bool is_driving = std::hypot(out.v_mps[0], out.v_mps[1]) > 0.05 || std::fabs(out.w_radps[2]) > 0.05;
    wm_monitor_step(&robot.monitor, &out, &kWrong, contradicts);
    expected.step({dt_s, contradicts, fits, is_driving, out.state, out.resets != resets_before});
    compare();
    tracked += !wm_monitor_doubts(&robot.monitor);
    in_doubt += robot.monitor.doubt_s > 0.0;
    found = robot.monitor.found > found ? robot.monitor.found : found;
  }
  void compare() const {
    const wm_monitor &m = robot.monitor;
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected.contradicted, m.contradicted_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected.proof, m.proof_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected.fitted, m.fitted_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected.doubt, m.doubt_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected.lost, m.lost_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected.since_found, m.since_found_s);
    TEST_ASSERT_EQUAL(expected.found, m.found);
    TEST_ASSERT_EQUAL(expected.is_probation, m.is_probation);
    TEST_ASSERT_EQUAL(expected.is_early, m.is_found_early);
  }
};

// Dense and sparse steps; of a half of the drives ones whose sums are exact, so that they meet each bound.
double step_s(uint64_t seed, int i) {
  if (seed % 4 > 1) return seed % 4 == 2 ? 0.5 : 0.25;
  return seed % 4 == 0 && i % 5 == 0 ? 1.3 : 0.31;
}

// GIVEN random drives WHEN the estimator loses and finds its pose, and observations agree, contradict
// or stay away THEN each count is the ledger's after each step.
TEST(the_counts_are_those_of_a_ledger) {
  int tracked = 0, in_doubt = 0, found = 0, steps = 0;
  for (uint64_t seed = 1; seed <= 40; seed++) {
    random_drive drive(seed);
    for (int i = 0; i < 1500; i++, steps++) drive.step(step_s(seed, i));
    tracked += drive.tracked;
    in_doubt += drive.in_doubt;
    found = drive.found > found ? drive.found : found;
  }
  TEST_ASSERT_GREATER_THAN(steps / 10, tracked);
  TEST_ASSERT_GREATER_THAN(steps / 10, in_doubt);
  TEST_ASSERT_GREATER_THAN(2, found);
}

// A pose that is set from outside, or a reset, begins everything anew: nothing of the drive before counts, and no
// source is named any more.
TEST(a_pose_from_outside_begins_anew) {
  for (const int kind : {WM_EVENT_SET_POSE, WM_EVENT_RESET}) {
    random_drive drive(3);
    for (int i = 0; i < 700; i++) drive.step(0.31);
    wm_monitor &m = drive.robot.monitor;
    m.source = m.silent = 4, m.cause = WM_CAUSE_BIASED;
    m.is_outside = m.is_unsupported = m.is_calibration_contradicted = 1;
    wm_event e{};
    e.kind = static_cast<uint8_t>(kind);
    e.t_ns = drive.robot.now_ns;
    (void)wm_monitor_take(&m, &e, nullptr, 0);
    drive.expected = {};
    drive.compare();
    TEST_ASSERT_EQUAL(-1, m.source);
    TEST_ASSERT_EQUAL(-1, m.silent);
    TEST_ASSERT_EQUAL(WM_CAUSE_NONE, m.cause);
    TEST_ASSERT_EQUAL(0, m.is_outside);
    TEST_ASSERT_EQUAL(0, m.is_unsupported);
    TEST_ASSERT_EQUAL(0, m.is_calibration_contradicted);
    TEST_ASSERT_EQUAL(0, m.was_lost);
    TEST_ASSERT_EQUAL(0, m.sources[0].opened);
    TEST_ASSERT_EQUAL(0, m.landmarks.count);
  }
}

// Between doubt and certainty: the probability of a wrong pose, the state, and what that adds to the covariance.
TEST(doubt_gives_probability_and_covariance) {
  lone robot(true);
  wm_monitor &m = robot.monitor;
  m.spread_m2 = 40.0;
  for (const double doubt_s : {0.5, 4.0, 10.0, 10.5, 25.0}) {
    m.doubt_s = doubt_s;
    m.cause = WM_CAUSE_REFUSED;
    m.source = 3;
    const double lasting = std::fmin(doubt_s / 10.0, 1.0), wrong = 0.08 + 0.92 * lasting * lasting;
    for (const double before : {0.01, 0.95 * wrong}) {
      wm_estimate e = robot.estimate;
      e.lost_probability = before;
      wm_monitor_judge(&m, &e);
      TEST_ASSERT_EQUAL(doubt_s > 10.0 ? WM_STATE_LOST : WM_STATE_DEGRADED, e.state);
      TEST_ASSERT_EQUAL(WM_CAUSE_REFUSED, e.cause);
      TEST_ASSERT_EQUAL(3, e.cause_source);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, wrong, e.lost_probability);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.01 + wrong * 40.0, e.covariance[wm_cov_index(0, 0)]);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.01 + wrong * 40.0, e.covariance[wm_cov_index(1, 1)]);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.01 + wrong * M_PI * M_PI / 3.0, e.covariance[wm_cov_index(5, 5)]);
    }
    wm_estimate sure = robot.estimate;  // of being lost: surer than the monitor
    sure.lost_probability = 1.0;
    sure.covariance[0] = 50.0;  // and wider already
    wm_monitor_judge(&m, &sure);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, sure.lost_probability);
    TEST_ASSERT_EQUAL_DOUBLE(50.0, sure.covariance[0]);
  }
  m.doubt_s = 0.0;
  for (const double probability : {0.25, static_cast<double>(NAN)}) {
    wm_estimate lost = robot.estimate;  // of an estimator that is lost by itself
    lost.state = WM_STATE_LOST;
    lost.lost_probability = probability;
    wm_monitor_judge(&m, &lost);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.01 + (probability == 0.25 ? 10.0 : 20.0), lost.covariance[0]);
  }
  wm_estimate searching = robot.estimate;
  searching.state = WM_STATE_SEARCHING;
  m.doubt_s = 20.0;
  wm_monitor_judge(&m, &searching);
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, searching.state);
  TEST_ASSERT_EQUAL_DOUBLE(0.01, searching.covariance[0]);
}

// The source that is silent for longest, by more than two seconds, since its last datum or since the start; of those
// that may give observations, and of a robot that has none.
TEST(the_source_that_is_silent_for_longest_is_named) {
  const struct {
    double last_s[3];  // of sources 0, 1 and 3; below 0: none came
    uint8_t state;
    int named;
  } rows[] = {{{9.0, 8.5, 8.2}, WM_STATE_DEAD_RECKONING, -1}, {{9.0, 7.9, 8.2}, WM_STATE_DEAD_RECKONING, 1},
              {{4.0, 7.0, 5.0}, WM_STATE_DEAD_RECKONING, 0},  {{4.0, 7.0, 3.0}, WM_STATE_DEAD_RECKONING, 3},
              {{4.0, -1.0, 3.0}, WM_STATE_DEAD_RECKONING, 1}, {{4.0, -1.0, 3.0}, WM_STATE_TRACKING, -1}};
  const uint16_t sources[3] = {0, 1, 3};
  for (const auto &row : rows) {
    wm_monitor m;
    const wm_setup setup{};
    wm_monitor_init(&m, &setup, 0xb);  // source 2 is a motion's: it gives none
    wm_event e{};
    e.kind = WM_EVENT_TWIST2;
    e.source = 2;
    e.t_ns = WM_NS_PER_S;  // the start
    (void)wm_monitor_take(&m, &e, nullptr, 0);
    for (int i = 0; i < 3; i++) {
      e.kind = WM_EVENT_SIGHTING;
      e.source = sources[i];
      e.t_ns = wm_ns_from_seconds(row.last_s[i]);
      if (row.last_s[i] > 0.0) (void)wm_monitor_take(&m, &e, nullptr, 0);
    }
    wm_estimate out{};
    out.state = row.state;
    out.t_ns = 10 * WM_NS_PER_S;
    wm_monitor_step(&m, &out, nullptr, 0);
    wm_monitor_judge(&m, &out);
    TEST_ASSERT_EQUAL(row.named, m.silent);
    TEST_ASSERT_EQUAL(row.named < 0 ? WM_CAUSE_NONE : WM_CAUSE_SILENT, out.cause);
    if (row.named >= 0) TEST_ASSERT_EQUAL(row.named, out.cause_source);
  }
}

// A map that is turned and shifted: its border, and 5 m and three sigma beyond it, on each side.
TEST(a_turned_map_ends_at_its_corners) {
  wm_raster map{};
  map.width_px = 200, map.height_px = 100, map.resolution_m = 0.1;  // 20 m by 10 m
  map.origin_x_m = 3.0, map.origin_y_m = -2.0, map.origin_yaw_rad = 0.5;
  wm_setup setup{};
  setup.map = &map;
  wm_monitor m;
  wm_monitor_init(&m, &setup, 1);
  const double c = std::cos(0.5), s = std::sin(0.5);
  const double low[2] = {3.0 - 10.0 * s, -2.0}, high[2] = {3.0 + 20.0 * c, -2.0 + 20.0 * s + 10.0 * c};
  for (int k = 0; k < 2; k++) {
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, low[k], m.low_m[k]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, high[k], m.high_m[k]);
  }
  // Anywhere in a box: a twelfth of its squares, on either axis half of both; and 5 m around it.
  const double squares = std::pow(high[0] - low[0], 2) + std::pow(high[1] - low[1], 2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 25.0 + squares / 24.0, m.spread_m2);
  for (int k = 0; k < 2; k++)
    for (const bool is_low : {true, false})
      for (const double sigma_m : {0.01, 1.0})
        for (const double off_m : {4.9, 5.1, 7.9, 8.1}) {
          wm_estimate e{};
          e.state = WM_STATE_TRACKING;
          e.t_ns = 0;
          for (int i = 0; i < 2; i++) e.pose_map_base.p_m[i] = 0.5 * (low[i] + high[i]);
          e.pose_map_base.p_m[k] = is_low ? low[k] - off_m : high[k] + off_m;
          e.covariance[wm_cov_index(k, k)] = sigma_m * sigma_m;
          wm_monitor_step(&m, &e, nullptr, 0);
          TEST_ASSERT_EQUAL(off_m > 5.0 + 3.0 * sigma_m, m.is_outside);
        }
}

// Without a map the box is that of the way; with landmarks it is theirs, wherever the robot drives.
TEST(the_box_of_landmarks_or_of_the_way) {
  wm_landmark posts[3] = {};
  posts[0].p_m[0] = -4.0, posts[1].p_m[1] = 7.0, posts[2].p_m[0] = 2.0;
  wm_setup setup{};
  setup.landmarks = posts;
  for (const size_t count : {size_t{0}, size_t{3}}) {
    setup.landmark_count = count;
    wm_monitor m;
    wm_monitor_init(&m, &setup, 1);
    wm_estimate e{};
    e.state = WM_STATE_TRACKING;
    const double way[3][2] = {{1.0, -3.0}, {10.0, 5.0}, {4.0, 9.0}};
    for (int i = 0; i < 3; i++) {
      e.t_ns = i * WM_NS_PER_S;
      e.pose_map_base.p_m[0] = way[i][0], e.pose_map_base.p_m[1] = way[i][1];
      wm_monitor_step(&m, &e, nullptr, 0);
    }
    const double expected[4] = {count ? -4.0 : 1.0, count ? 0.0 : -3.0, count ? 2.0 : 10.0, count ? 7.0 : 9.0};
    const double box[4] = {m.low_m[0], m.low_m[1], m.high_m[0], m.high_m[1]};
    TEST_ASSERT_EQUAL_DOUBLE_ARRAY(expected, box, 4);
    TEST_ASSERT_EQUAL(0, m.is_outside);
  }
}

// A step is due each 0.3 s of the events' time, whatever their kind.
TEST(steps_are_due_each_third_of_a_second) {
  lone robot(true);
  int due = 0;
  for (int i = 0; i < 1000; i++) {
    wm_event e{};
    e.kind = i % 3 ? WM_EVENT_TWIST2 : WM_EVENT_SIGHTING;
    e.t_ns = i * 10 * WM_NS_PER_MS;
    const int is_due = wm_monitor_take(&robot.monitor, &e, nullptr, 0);
    TEST_ASSERT_EQUAL(i % 30 == 0, is_due);
    due += is_due;
  }
  TEST_ASSERT_EQUAL(34, due);
}

}  // namespace
