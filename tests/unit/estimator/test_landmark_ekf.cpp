// SPDX-License-Identifier: Apache-2.0
// The landmark filter in a simulated room: what it expects, that it finds its sensors' errors, and that it notices,
// says and mends it when it is lost. Scenarios are GIVEN / WHEN / THEN; all noise is drawn from fixed seeds.
#include "sensors/sensor_model.hpp"
#include "state/row.hpp"
#include "world.hpp"

namespace {

using namespace world;

// What is wrong with the robot, unknown to the filter.
struct faults {
  double speed_scale = 1, yaw_scale = 1, yaw_bias = 0, lag_s = 0, sensor_yaw = 0, delay_s = 0, range_bias = 0;
  double eccentric_x = 0, eccentric_y = 0;
  double misread = 0, gnss_delay_s = 0, gnss_sigma_m = 0.3, gnss_east_m = 0;
  bool nameless = false;
} fault;
struct past {
  double t_s;
  wm_pose2 pose;
};
past trace[100000];
int traced;

wm_pose2 pose_at(double t_s) {
  for (int i = traced - 1; i > 0; i--)
    if (trace[i - 1].t_s <= t_s) {
      const double share = (t_s - trace[i - 1].t_s) / (trace[i].t_s - trace[i - 1].t_s);
      return wm::compose(trace[i - 1].pose, wm::part_of(wm::between(trace[i - 1].pose, trace[i].pose), share));
    }
  return traced > 0 ? trace[0].pose : truth;
}

// A winding drive round the room.
double speed_at(double t_s) { return t_s < 0.5 ? 0.0 : 0.8 + 0.3 * sin(0.9 * t_s); }
double rate_at(double t_s) { return t_s < 0.5 ? 0.0 : 0.4 + 0.25 * sin(0.5 * t_s); }

enum sees : unsigned { kNothing = 0, kBearings = 1, kRanges = 2, kPositions = 4 };

// Drives for so long; sees up to three landmarks every 0.2 s. Returns how many innovations were fused.
int drive(double for_s, unsigned sight) {
  int taken = 0;
  const double until = now_s + for_s;
  const double dt = 0.02;
  for (int step = 0; now_s < until; step++) {
    feed(make::twist(now_s, speed_at(now_s), rate_at(now_s)));
    // The robot does what was said lag ago, in its own scale; white noise as the parameters say.
    const double v = fault.speed_scale * speed_at(now_s - fault.lag_s);
    const double w = fault.yaw_scale * (rate_at(now_s - fault.lag_s) - fault.yaw_bias);
    trace[traced++] = {now_s, truth};
    go_on(v + gauss(0.02) / sqrt(dt), w + gauss(0.01) / sqrt(dt), dt);
    trace[traced] = {now_s, truth};
    if (step % 10 != 9 || sight == kNothing) continue;
    if (sight & kPositions) {
      traced++;
      const wm_pose2 p = pose_at(now_s - fault.gnss_delay_s);
      traced--;
      const double sigma_m = fault.gnss_sigma_m;
      feed(make::position(now_s, p.x_m + fault.gnss_east_m + gauss(sigma_m), p.y_m + gauss(sigma_m), sigma_m));
      taken += fused();
      continue;
    }
    for (int k = 0; k < 3; k++) {
      const wm_landmark &target = landmarks[(step / 10 + 3 * k) % 8];
      traced++;
      const wm_pose2 p = pose_at(now_s - fault.delay_s);
      traced--;
      const wm_pose2 eye = wm::compose(p, {0.3, 0, 0.2 + fault.sensor_yaw});
      const bool wrong = wm_random_next_uniform(&noise) < fault.misread;
      const auto [true_bearing, true_range] = view_of(target.p_m[0], target.p_m[1], eye);
      const double bearing = wm::wrap(true_bearing + gauss(0.01) - fault.eccentric_x * wm::sin(true_bearing) +
                                      fault.eccentric_y * wm::cos(true_bearing));
      const double range = true_range + fault.range_bias + gauss(0.05);
      const int32_t read = wrong ? landmarks[(step / 10 + 3 * k + 1) % 8].id : target.id;
      feed(make::sighting(now_s, fault.nameless ? -1 : read, sight & kBearings ? bearing : kAbsent,
                          sight & kRanges ? range : kAbsent));
      taken += fused();
      for (size_t r = 0; r < count; r++)
        if (records[r].verdict == WM_FUSED && !wrong) TEST_ASSERT_EQUAL(target.id, records[r].landmark_id);
    }
  }
  return taken;
}

// ---- the model ----

// By the pose and by every row of the table of sensor states, so that a new row without a right derivative fails here.
TEST(test_expected_sighting_and_its_derivatives) {
  wm_sensor s = sensor;
  s.mounting = {{0.4, -0.2, 0.7}, {0.1, 0.35, 2.2}};
  const double landmark[3] = {3.0, -1.5, 1.9};
  for (int depth = 0; depth < 2; depth++) {
    s.range_is_depth = depth;
    wm::mounted_sensor m;
    m.init(s);
    const wm_pose2 pose = {0.5, 0.3, depth ? -2.4 : 0.8};
    wm::sensor_errors errors;
    for (int k = 0; k < wm::kSensorStates; k++) errors[k] += k % 2 ? 0.03 : -0.02;
    errors[wm::kRangeScale] = 1.04;
    errors[wm::kRangeBias] = 0.1;
    const wm::expected_sighting e = wm::expect(m, errors, pose, landmark);
    TEST_ASSERT_TRUE(e.possible);
    const double h = 1e-6;
    for (int k = 0; k < wm::kCauses; k++) {
      // The body's tilt and the height: test_landmark_elevation.cpp. The time offset is the motion's.
      if ((k >= wm::kByBodyRoll && k < wm::kBySensor) || k == wm::kBySensor + wm::kTimeOffset) continue;
      wm_pose2 pose_at[2] = {pose, pose};
      wm::sensor_errors errors_at[2] = {errors, errors};
      wm::expected_sighting at[2];
      for (int side = 0; side < 2; side++) {
        double *pose_entry[3] = {&pose_at[side].x_m, &pose_at[side].y_m, &pose_at[side].heading_rad};
        (k < wm::kBySensor ? *pose_entry[k] : errors_at[side][k - wm::kBySensor]) += side == 0 ? h : -h;
        at[side] = wm::expect(m, errors_at[side], pose_at[side], landmark);
      }
      const double within = 1e-8;
      TEST_ASSERT_DOUBLE_WITHIN(within, wm::wrap(at[0].bearing_rad - at[1].bearing_rad) / (2 * h), e.bearing_by[k]);
      TEST_ASSERT_DOUBLE_WITHIN(within, (at[0].range_m - at[1].range_m) / (2 * h), e.range_by[k]);
      TEST_ASSERT_DOUBLE_WITHIN(within, (at[0].elevation_rad - at[1].elevation_rad) / (2 * h), e.elevation_by[k]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, e.range_m,
                              1.04 * e.range_by[wm::kBySensor + wm::kRangeScale] + errors[wm::kRangeBias]);
  }
}

// A camera that is rolled, pitched or of another focal length than thought: what the model says of small errors is what
// a camera that is mounted so sees.
TEST(test_tilt_and_angle_scale) {
  const double landmark[3] = {3.0, 1.5, 2.9}, h = 1e-5;
  const wm_pose2 pose = {0.5, 0.3, 0.2};
  wm_sensor s = sensor;
  s.mounting = {{0.4, -0.2, 0.7}, {0, 0, 0.3}};
  wm::mounted_sensor level, rolled, pitched;
  level.init(s);
  s.mounting.rpy_rad[0] = h;
  rolled.init(s);
  s.mounting.rpy_rad[0] = 0;
  s.mounting.rpy_rad[1] = h;
  pitched.init(s);
  const wm::expected_sighting e = wm::expect(level, {}, pose, landmark);
  const auto change = [&](const wm::mounted_sensor &other) {
    return (wm::expect(other, {}, pose, landmark).bearing_rad - e.bearing_rad) / h;
  };
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, change(rolled), e.bearing_by[wm::kBySensor + wm::kRoll]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, change(pitched), e.bearing_by[wm::kBySensor + wm::kPitch]);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.1, std::fabs(e.bearing_by[wm::kBySensor + wm::kRoll]));
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.01, std::fabs(e.bearing_by[wm::kBySensor + wm::kPitch]));
  for (const wm::sensor_state which : {wm::kRoll, wm::kPitch, wm::kAngleScale}) {
    wm::sensor_errors errors;
    errors[which] = h;
    const double moved = (wm::expect(level, errors, pose, landmark).bearing_rad - e.bearing_rad) / h;
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, moved, e.bearing_by[wm::kBySensor + which]);
  }
  // Level with the sensor a focal length scales the bearing itself; higher up it also lifts, which turns it back.
  const double beside[3] = {landmark[0], landmark[1], 0.7};
  const wm::expected_sighting low = wm::expect(level, {}, pose, beside);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, low.bearing_rad, low.bearing_by[wm::kBySensor + wm::kAngleScale]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, low.bearing_by[wm::kBySensor + wm::kRoll]);
}

// The paper's own formula, for a level sensor: alpha = atan2(y_b - y_c, x_b - x_c) - theta - theta_c.
TEST(test_expected_bearing_is_the_papers) {
  wm::mounted_sensor m;
  m.init(sensor);
  const wm_pose2 pose = {1, 2, 0.7};
  const double landmark[3] = {-3, 4, 0};
  const double xc = 1 + 0.3 * cos(0.7), yc = 2 + 0.3 * sin(0.7);
  const wm::expected_sighting e = wm::expect(m, {}, pose, landmark);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, atan2(4 - yc, -3 - xc) - 0.7 - 0.2, e.bearing_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::hypot(4 - yc, -3 - xc), e.range_m);
  const double on_it[3] = {xc, yc, 0};
  TEST_ASSERT_FALSE(wm::expect(m, {}, pose, on_it).possible);
}

// ---- accuracy and self-calibration ----

TEST(test_it_tracks_and_its_covariance_is_honest) {
  begin();
  int inside = 0, steps = 0;
  for (int i = 0; i < 100; i++) {
    drive(0.5, kBearings | kRanges);
    inside += nees_from(truth) < 5.991;
    steps++;
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, estimate().state);
  TEST_ASSERT_GREATER_OR_EQUAL(88, inside * 100 / steps);
  TEST_ASSERT_EQUAL_UINT32(1, estimate().resets);
}

TEST(test_it_finds_every_error_of_its_sensors) {
  motion.states.sigma[0] = 0.1;
  motion.states.sigma[1] = 0.1;
  motion.states.sigma[2] = 0.05;
  motion.states.sigma[7] = 0.2;
  make::sightings.states.sigma[WM_SENSOR_ROW_kYaw] = 0.2;
  make::sightings.states.sigma[WM_SENSOR_ROW_kTimeOffset] = 0.1;
  make::sightings.states.sigma[WM_SENSOR_ROW_kRangeBias] = 0.2;
  fault.speed_scale = 0.93;
  fault.yaw_scale = 1.06;
  fault.yaw_bias = 0.03;
  fault.lag_s = 0.18;
  fault.sensor_yaw = -0.12;
  fault.delay_s = 0.1;
  fault.range_bias = 0.15;
  begin();
  drive(120, kBearings | kRanges);
  const struct {
    const char *name;
    double value;
  } want[] = {{"motion.speed_scale", 0.93}, {"motion.yaw_rate_scale", 1.06}, {"motion.yaw_rate_bias_radps", 0.03},
              {"motion.lag_s", 0.18},       {"camera.yaw_rad", -0.12},       {"camera.time_offset_s", 0.1},
              {"camera.range_bias_m", 0.15}};
  for (const auto &w : want) {
    const wm_calibration_value got = calibrated(w.name);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(4 * got.sigma, w.value, got.value, w.name);
    // The motion's lag and the sensor's time offset show as a sum alone.
    const bool delay = strstr(w.name, "lag_s") || strstr(w.name, "time_offset_s");
    TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(delay ? 0.1 : 0.03, got.sigma, w.name);
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.28, value_of("motion.lag_s") + value_of("camera.time_offset_s"));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, off());  // the share that is the offset's moves the pose along the way
}

// A rotating laser whose angle encoder sits beside its axis.
TEST(test_an_eccentric_turntable_is_found) {
  make::sightings.states.sigma[WM_SENSOR_ROW_kEccentricX] = 0.05;
  fault.eccentric_x = 0.04;
  fault.eccentric_y = -0.03;
  begin();
  drive(60, kBearings | kRanges);
  for (const auto &[name, want] : {std::pair{"camera.eccentric_x_rad", 0.04}, {"camera.eccentric_y_rad", -0.03}}) {
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(3 * sigma_of(name), want, value_of(name), name);
    TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(0.005, sigma_of(name), name);
  }
}

TEST(test_gnss_and_its_delay) {
  make::positions.time_offset_sigma_s = 0.5;
  fault.gnss_delay_s = 0.3;
  begin();
  drive(150, kPositions);
  TEST_ASSERT_DOUBLE_WITHIN(0.08, 0.3, value_of("gnss.time_offset_s"));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, off());
}

// RTK is lost for ten seconds: the receiver falls back to a solution that is half a metre off, and states it.
TEST(test_positions_of_another_solution_have_an_error_of_their_own) {
  make::positions.correlated_m = -2;
  make::positions.correlated_tau_s = 20;
  fault.gnss_sigma_m = 0.02;
  begin();
  drive(20, kPositions);
  fault.gnss_sigma_m = 0.3;
  fault.gnss_east_m = 0.5;
  drive(10, kPositions);
  TEST_ASSERT_LESS_THAN_DOUBLE(2.5, off() / std::sqrt(estimate().covariance[0]));
  fault.gnss_sigma_m = 0.02;
  fault.gnss_east_m = 0;
  drive(1, kPositions);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.03, off());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, std::sqrt(estimate().covariance[0]));
}

TEST(test_misread_codes_are_rejected_and_do_no_harm) {
  fault.misread = 0.1;
  begin();
  TEST_ASSERT_INT_WITHIN(60, 1620, drive(60, kBearings | kRanges));  // 90 % of 1800
  TEST_ASSERT_LESS_THAN_DOUBLE(0.06, off());
  TEST_ASSERT_EQUAL_UINT32(1, estimate().resets);
}

// GIVEN sightings without an identity WHEN one landmark fits THEN it is that one; WHEN two fit THEN none is.
TEST(test_nameless_sightings_are_of_the_one_that_fits) {
  fault.nameless = true;
  make::sightings.use_unidentified = 1;
  begin();
  TEST_ASSERT_GREATER_THAN_INT(1400, drive(60, kBearings | kRanges));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.06, off());
  setUp();
  fault.nameless = true;
  make::sightings.use_unidentified = 1;
  for (int i = 0; i < 4; i++) {  // each of them twice, a hand apart
    landmarks[i + 4] = landmarks[i];
    landmarks[i + 4].id += 1;
    landmarks[i + 4].p_m[0] += 0.1;
  }
  begin();
  TEST_ASSERT_LESS_THAN_INT(50, drive(20, kBearings | kRanges));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.5, off());
}

// GIVEN one landmark whose place on the map is wrong WHEN it is seen again and again THEN the filter does not get surer
// than the map.
TEST(test_a_maps_error_is_not_averaged_away) {
  landmarks[0].sigma_m = landmarks[3].sigma_m = landmarks[6].sigma_m = 0.2;
  make::sightings.map_slots = 4;
  setup.landmark_count = 1;
  begin();
  for (int i = 0; i < 200; i++) {
    feed(make::twist(0.1 * i, 0, 0));
    feed(make::sighting(0.1 * i, landmarks[0].id, wm::wrap(atan2(-0.3, 4.0) - wm::kHalfPi - 0.2), 4.0));
  }
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.02, sqrt(estimate().covariance[0]));
}

// ---- lost and found ----

// What of the start is known, what is seen for how long, and how far off place and heading may be then.
TEST(test_a_start_of_which_something_is_unknown_is_found) {
  const struct {
    bool has_place;
    unsigned sees;
    double for_s, off_m, off_rad;
  } rows[] = {
      {true, kBearings, 5, 0.15, 0.05}, {false, kBearings | kRanges, 6, 0.1, 0.05}, {false, kPositions, 30, 0.4, 0.2}};
  for (const auto &row : rows) {
    setUp();
    if (row.has_place)
      setup.start.heading_rad = NAN;
    else
      without_a_start();
    begin();
    drive(1, kNothing);
    TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, estimate().state);
    drive(row.for_s, row.sees);
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, estimate().state);
    TEST_ASSERT_LESS_THAN_DOUBLE(row.off_m, off());
    TEST_ASSERT_LESS_THAN_DOUBLE(row.off_rad, heading_off());
  }
}

TEST(test_given_silence_then_it_says_dead_reckoning_and_grows_unsure) {
  begin();
  drive(10, kBearings | kRanges);
  const double before = estimate().covariance[0];
  drive(10, kNothing);
  TEST_ASSERT_EQUAL(WM_STATE_DEAD_RECKONING, estimate().state);
  TEST_ASSERT_GREATER_THAN_DOUBLE(3 * before, estimate().covariance[0]);
  drive(2, kBearings | kRanges);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, estimate().state);
}

TEST(test_set_pose_and_reset) {
  begin();
  drive(3, kNothing);
  feed(make::set_pose(now_s, truth.x_m + 1, truth.y_m, truth.heading_rad, 0.5, 0.1));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, off());
  TEST_ASSERT_EQUAL_UINT32(2, estimate().resets);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.25, estimate().covariance[0]);
  feed(make::empty(now_s, WM_EVENT_RESET));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2.0, estimate().pose_map_base.p_m[0]);
  TEST_ASSERT_EQUAL_UINT32(3, estimate().resets);
}

// ---- refusals explain themselves ----

TEST(test_each_refusal_has_its_verdict) {
  sensor.max_range_m = 10;
  begin();
  drive(1, kNothing);
  TEST_ASSERT_EQUAL(WM_REJECTED_UNKNOWN_ID, verdict_of(make::sighting(now_s, 5, 0, 1)));
  TEST_ASSERT_EQUAL(WM_REJECTED_NO_ASSOCIATION, verdict_of(make::sighting(now_s, -1, 0, 1)));
  TEST_ASSERT_EQUAL(WM_REJECTED_OUT_OF_RANGE, verdict_of(make::sighting(now_s, 100, 0, 11)));
  TEST_ASSERT_EQUAL(WM_REJECTED_NOT_FINITE, verdict_of(make::sighting(now_s, 100, NAN, NAN), WM_NOT_FINITE));
  TEST_ASSERT_EQUAL(WM_REJECTED_GATE, verdict_of(make::sighting(now_s, 100, 3, NAN)));
  TEST_ASSERT_GREATER_THAN_DOUBLE(records[0].gate, records[0].nis);
  make::sightings.use_range = 0;
  begin();
  drive(1, kNothing);
  TEST_ASSERT_EQUAL(WM_REJECTED_BY_CONFIG, verdict_of(make::sighting(now_s, 100, NAN, 2)));
}

// Sixteen sensors, each with every error as a state, beside the largest pools of lent states.
TEST(test_sixteen_fully_calibrated_sensors) {
  static wm_sensor sensors[17];
  for (wm_sensor &s : sensors) s = sensor;
  make::sightings.correlated_slots = 24;
  make::sightings.correlated_bearing_rad = make::sightings.correlated_range_m = 0.1;
  make::sightings.map_slots = 16;
  make::sightings.map_sigma_min_m = 0.01;
  make::sightings.use_elevation = 1;
  for (double &sigma : make::sightings.states.sigma) sigma = 0.01;
  for (double &sigma : motion.states.sigma) sigma = 0.01;
  setup.sensors = sensors;
  setup.sensor_count = 17;
  const char *why = nullptr;
  TEST_ASSERT_EQUAL(0, estimator->state_bytes(chosen, &setup, &why));
  TEST_ASSERT_NOT_NULL(strstr(why, "16 sensors"));
  setup.sensor_count = 16;
  begin();
  drive(1, kNothing);
  for (uint16_t i = 0; i < 16; i++) {
    feed(make::sighting(now_s, 100, 0.1, 5, i));
    TEST_ASSERT_EQUAL(2, count);
    TEST_ASSERT_NOT_EQUAL(WM_REJECTED_NUMERIC, records[0].verdict);
  }
  TEST_ASSERT_GREATER_OR_EQUAL(16 * wm::kSensorStates, calibration().size());
}

// A full row counts what it could not take; it must not write behind its end.
TEST(test_a_full_row_counts_what_is_missing) {
  wm::jacobian_row<3> row;
  row.add(-1, 1.0);
  row.add(2, 0.0);
  for (int i = 0; i < 5; i++) row.add(i, 1.0 + i);
  TEST_ASSERT_EQUAL(3, row.count);
  TEST_ASSERT_EQUAL(2, row.missing);
  TEST_ASSERT_EQUAL(2, row.index[2]);
  TEST_ASSERT_EQUAL_DOUBLE(3.0, row.by[2]);
}

}  // namespace

void setUp(void) {
  prepare_ekf(make::sensor("camera", 0.01, 0.05));
  put_on_map({{6, 0}, {0, 6}, {-6, 1}, {1, -6}, {5, 5}, {-4, -5}, {-5, 4}, {4, -4}}, 100, 7);
  sensor.mounting.xyz_m[0] = 0.3;
  sensor.mounting.rpy_rad[2] = 0.2;
  start_at({2, 0, wm::kHalfPi}, 0.05, 0.05);
  traced = 0;
  fault = {};
}

// GIVEN no parameter, THEN a tape measure leaves the place of a sensor with ranges open, and the place of others is
// exact.
TEST(test_a_sensor_with_ranges_is_mounted_to_two_centimetres) {
  for (const double range_sigma_m : {0.1, kAbsent}) {
    prepare_ekf(make::sensor("eye", 0.01, range_sigma_m));
    all_by_default();
    begin();
    int places = 0;
    for (const wm_calibration_value &value : calibration())
      if (std::strcmp(value.name, "eye.x_m") == 0 || std::strcmp(value.name, "eye.y_m") == 0) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.02, value.sigma);
        places++;
      }
    TEST_ASSERT_EQUAL(std::isnan(range_sigma_m) ? 0 : 2, places);
  }
}
