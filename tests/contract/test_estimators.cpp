// SPDX-License-Identifier: Apache-2.0
// The estimator contract (waymark/estimator.h) over every registered estimator.
#include <vector>

#include "common/no_heap.h"
#include "common/suite.h"
#include "common/trials.h"
#include "unit/estimator/events.hpp"
#include "waymark/estimator.h"
#include "waymark/health.h"
#include "waymark/random.h"

namespace {

const double kAbsent = std::numeric_limits<double>::quiet_NaN();
const wm_estimator *estimator;
std::vector<char> motion_params, sighting_params, params;
wm_setup setup;
wm_sensor sensor;
wm_landmark landmarks[4];
constexpr int kSide = 240;  // a room of 10 m in a map of 12 m
uint8_t edges[kSide * kSide], drivable[kSide * kSide];
wm_raster map;

struct machine {
  void *state;
  size_t bytes;
  machine() {
    const char *why = "";
    bytes = estimator->state_bytes(params.data(), &setup, &why);
    TEST_ASSERT_GREATER_THAN_MESSAGE(0, bytes, why);
    state = aligned_alloc(16, (bytes + 15) / 16 * 16);
    std::memset(state, 0xA5, bytes);
    TEST_ASSERT_EQUAL(WM_OK, estimator->init(state, params.data(), &setup));
  }
  ~machine() { free(state); }
  machine(const machine &) = delete;
  wm_status take(const wm_event &e, size_t *count = nullptr) {
    if (wm_event_is_motion(&e)) return estimator->predict(state, &e);
    wm_innovation out[WM_INNOVATIONS_PER_EVENT_MAX];
    size_t n = 0;
    const wm_status status = estimator->correct(state, &e, out, WM_INNOVATIONS_PER_EVENT_MAX, &n);
    TEST_ASSERT_LESS_OR_EQUAL(WM_INNOVATIONS_PER_EVENT_MAX, n);
    if (count) *count = n;
    return status;
  }
  wm_estimate estimate() const {
    wm_estimate e;
    estimator->estimate(state, &e);
    return e;
  }
};

bool takes(unsigned kind) {
  return ((estimator->takes | WM_MOTION_EVENTS) & WM_EVENT_BIT(kind & 31)) != 0 && kind < 32;
}

// A drive of events of every kind, some of them nonsense for the pose: any order of kinds that time allows.
wm_event event_at(uint64_t i, double t_s) {
  const double u = wm_random_uniform(1, 1, i), a = wm_random_normal(1, 2, i), b = wm_random_normal(1, 3, i);
  if (u < 0.5) return make::twist(t_s, 0.5 + 0.1 * a, 0.3 * sin(0.1 * t_s) + 0.1 * b);
  if (u < 0.85 && (estimator->takes & WM_EVENT_BIT(WM_EVENT_POINTS))) {
    wm_event e = make::empty(t_s, WM_EVENT_POINTS);
    e.as.points.count = (uint32_t)(i % 60);
    e.as.points.camera = i % 3 ? -1 : 0;
    for (uint32_t k = 0; k < e.as.points.count; k++) {
      e.as.points.x_m[k] = (float)(1.0 + 0.08 * k + 0.1 * a);
      e.as.points.y_m[k] = (float)(k % 2 ? 1.5 + 0.2 * b : -1.0);
      e.as.points.normal_rad[k] = k % 5 ? NAN : (float)a;
      e.as.points.sigma_m[k] = k % 3 ? NAN : 0.02f;
    }
    return e;
  }
  if (u < 0.85) return make::sighting(t_s, landmarks[i % 4].id, 0.3 * a, u < 0.7 ? 4 + std::fabs(b) : kAbsent);
  if (u < 0.93) return make::position(t_s, 2 * a, 2 * b, 3.0);
  if (u < 0.97) return make::heading(t_s, a, 0.5);
  if (u < 0.99) return make::empty(t_s, WM_EVENT_LOOKED);
  return make::set_pose(t_s, a, b, 2 * asin(0.6), 0.3, 0.2);
}

void assert_sound(const wm_estimate &e) {
  double p[3][3];
  const int at[3] = {0, 1, 5};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      p[i][j] = e.covariance[wm_cov_index(at[i], at[j])];
      TEST_ASSERT_DOUBLE_IS_DETERMINATE(p[i][j]);
      const double mirrored = e.covariance[wm_cov_index(at[j], at[i])];
      TEST_ASSERT_EQUAL_MEMORY(&mirrored, &p[i][j], sizeof mirrored);
    }
  const double minor = p[0][0] * p[1][1] - p[0][1] * p[0][1];
  const double det = p[2][2] * minor - p[0][2] * (p[0][2] * p[1][1] - p[0][1] * p[1][2]) +
                     p[1][2] * (p[0][2] * p[0][1] - p[1][2] * p[0][0]);
  TEST_ASSERT_TRUE(p[0][0] > 0 && p[1][1] > 0 && p[2][2] > 0);
  TEST_ASSERT_GREATER_THAN_DOUBLE(-1e-9 * p[0][0] * p[1][1], minor);
  TEST_ASSERT_GREATER_THAN_DOUBLE(-1e-9 * p[0][0] * p[1][1] * p[2][2], det);
  TEST_ASSERT_DOUBLE_IS_DETERMINATE(e.pose_map_base.p_m[0]);
  TEST_ASSERT_DOUBLE_IS_DETERMINATE(e.pose_map_base.p_m[1]);
  TEST_ASSERT_GREATER_THAN_DOUBLE(-3.1415926535897936, e.heading_rad);
  TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(3.1415926535897936, e.heading_rad);
  const double *q = e.pose_map_base.q_xyzw;
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  TEST_ASSERT_LESS_OR_EQUAL(WM_STATE_LOST, e.state);
}

void test_the_same_events_give_the_same_bytes_and_a_copy_goes_on_alike(void) {
  machine a, b;
  TEST_ASSERT_EQUAL_MEMORY(a.state, b.state, a.bytes);
  for (uint64_t i = 0; i < 3000; i++) {
    const wm_event e = event_at(i, 0.02 * (double)i);
    if (!takes(e.kind)) continue;
    TEST_ASSERT_EQUAL(a.take(e), b.take(e));
    if (i == 1500) std::memcpy(b.state, a.state, a.bytes);  // a copy
  }
  TEST_ASSERT_EQUAL_MEMORY(a.state, b.state, a.bytes);
}

void test_it_never_allocates(void) {
  machine a;
  std::vector<wm_event> events;
  for (uint64_t i = 0; i < 3000; i++) events.push_back(event_at(i, 0.02 * (double)i));
  allocations = 0;
  trapped = true;
  for (const wm_event &e : events) a.take(e);
  wm_estimate out;
  estimator->estimate(a.state, &out);
  wm_calibration_value values[64];
  estimator->calibration(a.state, values, 64);
  wm_counter counters[16];
  if (estimator->counters) estimator->counters(a.state, counters, 16);
  wm_motion_calibration calibration;
  estimator->motion(a.state, &calibration);
  estimator->motion_health(a.state);
  trapped = false;
  TEST_ASSERT_EQUAL(0, allocations);
}

void test_the_estimate_is_sound_at_every_event_and_stands_at_its_time(void) {
  machine a;
  int taken = 0;
  for (uint64_t i = 0; i < 5000; i++) {
    const wm_event e = event_at(i, 0.02 * (double)i);
    if (a.take(e) != WM_OK) continue;
    const wm_estimate out = a.estimate();
    TEST_ASSERT_EQUAL_INT64(e.t_ns, out.t_ns);
    assert_sound(out);
    taken++;
  }
  TEST_ASSERT_GREATER_THAN(2000, taken);
}

void test_an_absent_number_of_a_landmark_counts_as_zero(void) {
  wm_estimate with[2] = {};
  for (const double absent : {0.0, kAbsent}) {
    for (wm_landmark &l : landmarks) l.sigma_m = l.cov_m2[0] = l.cov_m2[1] = l.cov_m2[2] = l.yaw_sigma_rad = absent;
    machine a;
    for (uint64_t i = 0; i < 3000; i++) a.take(event_at(i, 0.02 * (double)i));
    with[std::isnan(absent)] = a.estimate();
    TEST_ASSERT_DOUBLE_IS_DETERMINATE(with[1].covariance[0]);
  }
  TEST_ASSERT_EQUAL_DOUBLE(with[0].heading_rad, with[1].heading_rad);
  for (int k = 0; k < 36; k++) TEST_ASSERT_EQUAL_DOUBLE(with[0].covariance[k], with[1].covariance[k]);
}

void assert_refused(machine &a, const wm_event &e, wm_status want) {
  std::vector<char> before((char *)a.state, (char *)a.state + a.bytes);
  TEST_ASSERT_EQUAL(takes(e.kind) ? want : WM_UNSUPPORTED, a.take(e));
  TEST_ASSERT_EQUAL_MEMORY(before.data(), a.state, a.bytes);
}

void test_nonsense_is_refused_with_a_status_and_changes_nothing(void) {
  machine a;
  for (uint64_t i = 0; i < 500; i++) a.take(event_at(i, 0.02 * (double)i));
  const double t_s = 11.0;
  const int32_t id = landmarks[0].id;
  wm_event points = make::empty(t_s, WM_EVENT_POINTS);
  points.as.points.count = 2;
  points.as.points.camera = -1;
  for (double x : {(double)NAN, (double)INFINITY, -(double)INFINITY, 1e300}) {
    const wm_status want = std::isfinite(x) ? WM_OUT_OF_RANGE : WM_NOT_FINITE;
    for (uint8_t q = 0; q < WM_Q_COUNT; q++) assert_refused(a, make::quantities(t_s, {{(wm_quantity)q, x}}), want);
    points.as.points.x_m[1] = (float)(std::isfinite(x) ? 1e30 : x);
    for (const wm_event &e : {make::twist(t_s, x, 0), make::twist(t_s, 0, x), make::position(t_s, x, 0, 1),
                              make::position(t_s, 0, x, 1), make::position(t_s, 0, 0, x), make::heading(t_s, x, 1),
                              make::set_pose(t_s, x, 0, 0, 1, 1), make::set_pose(t_s, 0, 0, 0, x, 1), points})
      assert_refused(a, e, want);
    if (std::isnan(x)) continue;
    assert_refused(a, make::sighting(t_s, id, x, 1), want);
    assert_refused(a, make::sighting(t_s, id, 0, x), want);
  }
  assert_refused(a, make::sighting(t_s, id, NAN, NAN), WM_NOT_FINITE);
  wm_event sigma = make::sighting(t_s, id, 0, 1), pose = make::set_pose(t_s, 0, 0, 0, 1, 1),
           quantities = make::empty(t_s, WM_EVENT_QUANTITIES), unknown = quantities, late = make::twist(t_s, 0, 0);
  sigma.as.sighting.bearing_sigma_rad = -0.1;
  pose.as.set_pose.pose_map_base.q_xyzw[3] = 0;
  quantities.as.quantities.count = 255;
  unknown.as.quantities.count = 1;
  unknown.as.quantities.id[0] = 200;
  points = make::empty(t_s, WM_EVENT_POINTS);
  points.as.points.count = WM_POINTS_MAX + 1;
  late.t_ns = INT64_MAX;
  for (const wm_event &e : {make::sighting(t_s, id, 0, 1, 77), make::sighting(t_s, id, 0, -1), sigma, pose, quantities,
                            unknown, points, late})
    assert_refused(a, e, WM_OUT_OF_RANGE);
  late.kind = 250;
  assert_refused(a, late, WM_UNSUPPORTED);
}

void test_time_never_runs_back(void) {
  machine a;
  for (uint64_t i = 0; i < 500; i++) a.take(event_at(i, 0.02 * (double)i));
  for (uint64_t i = 0; i < 200; i++) {
    const wm_event old = event_at(i, 5.0);
    assert_refused(a, old, WM_TIME_RAN_BACK);
  }
}

void test_set_pose_works_at_any_time(void) {
  machine a;
  uint32_t resets = a.estimate().resets;
  for (int k = 0; k < 20; k++) {
    for (uint64_t i = 0; i < 50; i++) a.take(event_at(i, 2.0 * k + 0.02 * (double)i));
    wm_event e = make::set_pose(0, 10.0 * k, -3, 2 * asin(0.6), 0.3, 0.2);
    e.t_ns = a.estimate().t_ns + 1000;
    resets = a.estimate().resets;
    TEST_ASSERT_EQUAL(WM_OK, a.take(e));
    const wm_estimate out = a.estimate();
    TEST_ASSERT_EQUAL_DOUBLE(10.0 * k, out.pose_map_base.p_m[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2 * asin(0.6), out.heading_rad);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.09, out.covariance[0]);
    TEST_ASSERT_EQUAL_UINT32(resets + 1, out.resets);
    TEST_ASSERT_NOT_EQUAL(WM_STATE_SEARCHING, out.state);
    TEST_ASSERT_NOT_EQUAL(WM_STATE_LOST, out.state);
  }
}

// A day: twists at 10 Hz, a sighting now and then, and hours of rest.
void test_a_day_without_drift_of_symmetry(void) {
  machine a;
  const uint64_t events = wm_trials(864000, 108000);  // in an emulator three hours, the third at rest
  for (uint64_t i = 0; i < events; i++) {
    const double t = 0.1 * (double)i;
    const bool rests = (i / 36000) % 3 == 2;
    TEST_ASSERT_EQUAL(WM_OK, a.take(make::twist(t, rests ? 0 : 0.4, rests ? 0 : 0.1)));
    if (i % 50 == 7) {
      wm_event o = event_at(i, t);
      if (!wm_event_is_motion(&o) && takes(o.kind)) TEST_ASSERT_EQUAL(WM_OK, a.take(o));
    }
    if (i % 1000 == 0) assert_sound(a.estimate());
  }
}

// A probability at every event, or NaN at every event with a pose; certainly lost while there is none.
void test_the_lost_probability_is_a_probability_or_absent(void) {
  machine a;
  int absent = 0, given = 0;
  for (uint64_t i = 0; i < 2000; i++) {
    a.take(event_at(i, 0.02 * (double)i));
    const wm_estimate e = a.estimate();
    if (e.state == WM_STATE_SEARCHING) {
      TEST_ASSERT_EQUAL_DOUBLE(1, e.lost_probability);
    } else if (std::isnan(e.lost_probability)) {
      absent++;
    } else {
      TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(0, e.lost_probability);
      TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(1, e.lost_probability);
      given++;
    }
  }
  TEST_ASSERT_TRUE(absent == 0 || given == 0);
}

// A counter of each kind once, never counting backwards unless it is a number of now; none is a calibration value.
void test_counters_are_typed(void) {
  if (!estimator->counters) return;
  machine a;
  uint64_t before[WM_COUNTER_KIND_COUNT] = {};
  for (uint64_t i = 0; i < 2000; i++) {
    a.take(event_at(i, 0.02 * (double)i));
    wm_counter counters[WM_HEALTH_COUNTERS_MAX];
    const size_t count = estimator->counters(a.state, counters, WM_HEALTH_COUNTERS_MAX);
    TEST_ASSERT_GREATER_THAN(0, count);
    TEST_ASSERT_LESS_OR_EQUAL(WM_HEALTH_COUNTERS_MAX, count);
    TEST_ASSERT_EQUAL(count, estimator->counters(a.state, counters, 0));
    bool seen[WM_COUNTER_KIND_COUNT] = {};
    for (size_t k = 0; k < count; k++) {
      const wm_counter &c = counters[k];
      TEST_ASSERT_LESS_THAN(WM_COUNTER_KIND_COUNT, c.kind);
      TEST_ASSERT_FALSE(seen[c.kind]);
      seen[c.kind] = true;
      const bool now = c.kind == WM_COUNTER_LANDMARKS || c.kind == WM_COUNTER_ALIASED_POSES ||
                       c.kind == WM_COUNTER_EXPLAINED_PERMILLE;
      TEST_ASSERT_TRUE(now || c.count >= before[c.kind]);
      before[c.kind] = c.count;
    }
  }
}

// GIVEN a steady drive WHEN one sample says 138 m/s THEN it is counted, once.
void test_motion_that_no_robot_can_do_is_counted(void) {
  machine a;
  for (int i = 0; i < 200; i++) (void)a.take(make::twist(0.02 * i, i == 150 ? 138.0 : 0.5, 0.0));
  wm_counter counters[WM_HEALTH_COUNTERS_MAX];
  const size_t count = estimator->counters(a.state, counters, WM_HEALTH_COUNTERS_MAX);
  for (size_t k = 0; k < count; k++)
    if (counters[k].kind == WM_COUNTER_MOTION_OUTLIERS) {
      TEST_ASSERT_EQUAL(1, counters[k].count);
      return;
    }
  TEST_FAIL_MESSAGE("motion outliers are not counted");
}

// GIVEN a start that is well known WHEN the robot moves sideways on a circle THEN each estimator goes there.
void test_sideways_motion_counts(void) {
  setup.start.sigma_xy_m = setup.start.sigma_heading_rad = 1e-3;
  machine a;
  for (int i = 0; i <= 40; i++) TEST_ASSERT_EQUAL(WM_OK, a.take(make::twist6(0.1 * i, 0, 0.5, 0.25)));
  const wm_estimate out = a.estimate();
  TEST_ASSERT_DOUBLE_WITHIN(0.02, -2.0 * (1.0 - cos(1.0)), out.pose_map_base.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 2.0 * sin(1.0), out.pose_map_base.p_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 1.0, out.heading_rad);
}

void test_what_is_learnt_is_listed_and_given_to_the_predictor(void) {
  machine a;
  for (uint64_t i = 0; i < 500; i++) a.take(event_at(i, 0.02 * (double)i));
  wm_calibration_value values[64];
  const size_t count = estimator->calibration(a.state, values, 64);
  const bool has_states = strcmp(estimator->name, "pf_edges") != 0;  // it estimates the pose alone
  TEST_ASSERT_EQUAL(has_states, count > 0);
  TEST_ASSERT_EQUAL(count, estimator->calibration(a.state, values, 1));
  wm_motion_calibration c;
  estimator->motion(a.state, &c);
  TEST_ASSERT_DOUBLE_IS_DETERMINATE(c.value[WM_SPEED_SCALE]);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0, c.value[WM_SPEED_SCALE]);
  for (size_t i = 0; i < count && i < 1; i++) {
    TEST_ASSERT_DOUBLE_IS_DETERMINATE(values[i].value);
    TEST_ASSERT_TRUE(values[i].sigma > 0);
    TEST_ASSERT_GREATER_THAN(0, strlen(values[i].name));
  }
}

void set_param(const wm_param_table &table, std::vector<char> &out, const char *key, double value) {
  for (size_t i = 0; i < table.count; i++)
    if (std::strcmp(table.params[i].key, key) == 0) {
      TEST_ASSERT_EQUAL(WM_PARAM_F64, table.params[i].type);
      std::memcpy(&out[table.params[i].offset], &value, sizeof value);
    }
}

}  // namespace

void setUp(void) {
  motion_params.resize(wm_motion_params_table.bytes);
  wm_params_defaults(&wm_motion_params_table, motion_params.data());
  sighting_params.resize(wm_sighting_params_table.bytes);
  wm_params_defaults(&wm_sighting_params_table, sighting_params.data());
  params.resize(estimator->params.bytes + 1);
  wm_params_defaults(&estimator->params, params.data());
  // Everything that may be learnt is switched on, where the estimator has it.
  const char *sigmas[] = {"states.speed_scale_sigma",         "states.yaw_rate_scale_sigma",
                          "states.yaw_rate_bias_sigma_radps", "states.lag_sigma_s",
                          "states.sensor_yaw_sigma_rad",      "states.sensor_time_offset_sigma_s",
                          "states.range_bias_sigma_m",        "states.rate_bias_sigma_radps",
                          "states.velocity_scale_sigma",      "states.rate_scale_sigma"};
  for (const char *key : sigmas) {
    set_param(estimator->params, params, key, 0.1);
    set_param(wm_motion_params_table, motion_params, key, 0.1);
    set_param(wm_sighting_params_table, sighting_params, key, 0.1);
  }
  sensor = {};
  std::strcpy(sensor.name, "eye");
  sensor.bearing_sigma_rad = sensor.range_sigma_m = NAN;
  sensor.max_range_m = INFINITY;
  for (int i = 0; i < 4; i++) landmarks[i] = {40 - i, {5.0 * cos(i), 5.0 * sin(i), 0}, 0.01, NAN, {}, 0};
  setup = {};
  setup.motion = reinterpret_cast<const wm_motion_params *>(motion_params.data());
  setup.sightings = reinterpret_cast<const wm_sighting_params *>(sighting_params.data());
  setup.wheels = {NAN, NAN, NAN, NAN, NAN, NAN, 0, {}, {}};
  setup.sensors = &sensor;
  setup.sensor_count = 1;
  setup.landmarks = landmarks;
  setup.landmark_count = 4;
  for (int row = 0; row < kSide; row++)
    for (int column = 0; column < kSide; column++) {
      const bool in = row >= 20 && row < 220 && column >= 20 && column < 220;
      const bool deep = row >= 21 && row < 219 && column >= 21 && column < 219;
      edges[row * kSide + column] = in && !deep ? 255 : 0;
      drivable[row * kSide + column] = deep ? 255 : 0;
    }
  map = {kSide, kSide, 0.05, -6, -6, 0, edges, drivable, 1};
  setup.map = &map;
  setup.start = {WM_TIME_NONE, {0, 0, 0}, {0, 0, 0, 1}, 0, 0.05, 0.05};
  setup.seed = 1;
}
void tearDown(void) {}

int main(void) {
  UNITY_BEGIN();
  size_t count;
  const wm_estimator *const *all = wm_estimators(&count);
  for (size_t i = 0; i < count; i++) {
    estimator = all[i];
    printf("-- %s\n", estimator->name);
    if (wm_estimator_find(estimator->name) != estimator) return 1;
    RUN_TEST(test_the_same_events_give_the_same_bytes_and_a_copy_goes_on_alike);
    RUN_TEST(test_it_never_allocates);
    RUN_TEST(test_the_estimate_is_sound_at_every_event_and_stands_at_its_time);
    RUN_TEST(test_an_absent_number_of_a_landmark_counts_as_zero);
    RUN_TEST(test_nonsense_is_refused_with_a_status_and_changes_nothing);
    RUN_TEST(test_time_never_runs_back);
    RUN_TEST(test_set_pose_works_at_any_time);
    RUN_TEST(test_a_day_without_drift_of_symmetry);
    RUN_TEST(test_the_lost_probability_is_a_probability_or_absent);
    RUN_TEST(test_counters_are_typed);
    RUN_TEST(test_motion_that_no_robot_can_do_is_counted);
    RUN_TEST(test_sideways_motion_counts);
    RUN_TEST(test_what_is_learnt_is_listed_and_given_to_the_predictor);
  }
  if (wm_estimator_find("no such") || count < 2) return 1;
  return UNITY_END();
}
