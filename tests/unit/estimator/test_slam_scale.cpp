// SPDX-License-Identifier: Apache-2.0
// How large a map is, where nothing measures it: a robot whose speed is commanded and a camera whose ranges' scale
// nobody knows; two wheels and prints. And the axis along which a camera's depths are measured. GIVEN / WHEN / THEN;
// noise is drawn from fixed seeds.
#include "filters/slam/params.h"
#include "motion/step.hpp"
#include "world.hpp"

namespace {

using namespace world;

constexpr int kCount = 14;
constexpr double kPrior = 0.05;  // of the speed's and the ranges' scale

wm_slam_params params;
double range_factor;  // of the measured depths
bool is_stated;       // each sighting has its own sigmas
bool has_covariance;  // of the motion's increments
bool has_wheels;      // counts from the start on, and a gyro from the second sample on

struct found {
  double speed, speed_sigma, range, axis, axis_sigma;
};

// Five minutes round a circle of 3 m, of which the middle third of each minute sees nothing.
found drive(uint64_t seed, double axis_rad) {
  begin();
  noise = {seed, 1, 0};
  truth = {3, 0, wm::kHalfPi};
  const double dt = 0.05;
  for (int step = 0; step < 6000; step++) {
    const double v = 0.3, w = 0.1;
    const double covariance[6] = {v * v * 1e-4, 0, 1e-8, 0, 0, wm::square(motion.noise_yaw_rate_radps) * dt};
    const wm_event e = has_covariance && step > 0
                           ? make::increment((step - 1) * dt, step * dt, {v * dt, 0, w * dt}, covariance)
                           : make::twist(step * dt, v, w);
    const auto counted = [=](double speed_mps) {
      return std::floor(step * dt * speed_mps * 100000 / (wm::kTwoPi * 0.1));
    };
    const wm_event wheels = make::quantities(
        step * dt, {{WM_Q_WHEEL_TICKS_LEFT, counted(v - 0.25 * w)}, {WM_Q_WHEEL_TICKS_RIGHT, counted(v + 0.25 * w)}});
    feed(has_wheels ? wheels : e);
    const wm_event gyro = make::quantities(step * dt, {{WM_Q_YAW_RATE, w + gauss(0.002)}});
    if (has_wheels && step > 0) feed(gyro);
    for (int i = 0; step % 4 == 0 && step / 400 % 3 != 1 && i < kCount; i++) {
      const wm::sin_cos at = wm::sincos(wm::kTwoPi * i / kCount);
      const double radius = 4.0 + i % 3;
      const auto [bearing, distance] = view_of(radius * at.cos, radius * at.sin);
      if (std::fabs(bearing) > 0.6 || distance > 5.0) continue;
      const double depth = distance * wm::cos(bearing - axis_rad);
      wm_event seen = make::sighting(step * dt, i, bearing + gauss(0.005), range_factor * depth + gauss(0.02));
      if (is_stated) seen.as.sighting.bearing_sigma_rad = 0.005, seen.as.sighting.range_sigma_m = 0.02;
      feed(seen);
    }
    const double drifted = v + gauss(0.1);
    go_on(drifted, w + gauss(motion.noise_yaw_rate_radps) / std::sqrt(dt), dt);
  }
  const wm_calibration_value speed = calibrated("motion.speed_scale"), axis = calibrated("camera.depth_axis_rad");
  return {speed.value, speed.sigma, value_of("camera.range_scale"), axis.value, axis.sigma};
}

// GIVEN a speed and ranges whose scales are known to 5 % each WHEN the map is driven through for minutes THEN only
// their product is learnt: each stays as unsure as the mean of two such, and lies as near to 1 as that says. The
// textbook's filter believes to have learnt more.
TEST(test_a_scale_that_nothing_measures_is_not_learnt) {
  const double honest = kPrior / std::sqrt(2.0);
  double squares = 0.0, plain_sigma = 0.0;
  for (uint64_t seed = 1; seed <= 6; seed++) {
    const found f = drive(seed, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.03 * honest, honest, f.speed_sigma);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 1.0, f.speed * f.range);
    squares += (f.speed - 1.0) * (f.speed - 1.0) / 6;
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.012, std::sqrt(squares));
  params.consistency = WM_SLAM_PLAIN;
  for (uint64_t seed = 1; seed <= 6; seed++) plain_sigma += drive(seed, 0.0).speed_sigma / 6;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.5 * honest, plain_sigma);
}

// GIVEN wheels and a gyro that comes later, so that the scale of the way is the wheels' at first and then the speed's,
// WHEN the map is driven through THEN it has no other size than by the gyro alone.
TEST(test_a_scale_is_not_learnt_either_where_the_motions_kind_changes) {
  setup.wheels = {0.1, 100000, 0.5, NAN, NAN, NAN, 0, {}, {}};
  motion.states.sigma[wm::kSpeedScale] = -kPrior;
  for (int i = 0; i < 3; i++) motion.states.sigma[wm::kLeftScale + i] = -0.02;
  has_wheels = true;
  for (uint64_t seed = 1; seed <= 3; seed++) {
    const found f = drive(seed, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 1.0, f.speed * f.range);
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 1.0, f.speed);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.9 * kPrior / std::sqrt(2.0), f.speed_sigma);
  }
}

// GIVEN the default and ranges that are 5 % short WHEN the map is driven through THEN the speed's scale, which is
// right, lies within its sigma: the ranges are no better a standard of length than the wheels, also where sightings
// state their sigmas. Where the motion has covariances, too, both are calibrated.
TEST(test_by_default_ranges_do_not_measure_the_scale) {
  make::sightings.states.sigma[WM_SENSOR_ROW_kRangeScale] = -kPrior;
  range_factor = 0.95;
  const found f = drive(3, 0.0);
  TEST_ASSERT_DOUBLE_WITHIN(0.005, kPrior / std::sqrt(2.0), f.speed_sigma);
  TEST_ASSERT_DOUBLE_WITHIN(f.speed_sigma, 1.0, f.speed);
  is_stated = true;
  const found stated = drive(3, 0.0);
  TEST_ASSERT_EQUAL_DOUBLE(f.speed, stated.speed);
  TEST_ASSERT_EQUAL_DOUBLE(f.range, stated.range);
  has_covariance = true;
  range_factor = 1.0;
  const found calibrated = drive(3, 0.0);
  TEST_ASSERT_EQUAL_DOUBLE(1.0, calibrated.range);
}

// Two minutes round a circle of 2 m under prints, by two wheels that are 2 % and 1 % larger than said, each print seen
// three times as far off as its sigma says and 12 mm ahead of where it is: how large the map becomes against the
// prints, and the wheels.
struct worn {
  double range, left, right, track;
};

worn drive_under_prints() {
  const double v = 0.4, w = 0.2, dt = 0.02, rolls[2] = {1.02, 1.01};
  setup.wheels = {0.1, 100000, 0.5, NAN, NAN, NAN, 0, {}, {}};
  setup.start = {WM_TIME_NONE, {2, 0, 0}, {0, 0, 0, 1}, wm::kHalfPi, 0.01, 0.01};
  begin();
  noise = {5, 1, 0};
  truth = {2, 0, wm::kHalfPi};
  double turns[2] = {0.0, 0.0};
  for (int step = 0; step < 6000; step++) {
    const double ticks = 100000 / (wm::kTwoPi * 0.1);
    feed(make::quantities(step * dt, {{WM_Q_WHEEL_TICKS_LEFT, std::floor(turns[0] * ticks)},
                                      {WM_Q_WHEEL_TICKS_RIGHT, std::floor(turns[1] * ticks)}}));
    for (int i = 0; step % 5 == 0 && i < kCount; i++) {
      const wm::sin_cos at = wm::sincos(wm::kTwoPi * i / kCount), h = wm::sincos(truth.heading_rad);
      const double dx = (1.5 + i % 3) * at.cos - truth.x_m, dy = (1.5 + i % 3) * at.sin - truth.y_m;
      if (dx * dx + dy * dy > 1.5 * 1.5) continue;
      wm_event seen = make::empty(step * dt, WM_EVENT_MARKER);
      wm_marker &m = seen.as.marker;
      m.id = i;
      m.p_m[0] = h.cos * dx + h.sin * dy + 0.012 + gauss(0.0045);
      m.p_m[1] = h.cos * dy - h.sin * dx + gauss(0.0045);
      m.p_m[2] = 2.0;
      m.along_sigma_m = m.yaw_sigma_rad = m.bloom_px = NAN;
      m.yaw_rad = wm::wrap(0.3 * i - truth.heading_rad + gauss(0.009));
      feed(seen);
    }
    go_on(v, w, dt);
    for (int side = 0; side < 2; side++) turns[side] += dt * (v + (side == 0 ? -0.25 : 0.25) * w) / rolls[side];
  }
  return {value_of("camera.range_scale"), value_of("motion.left_scale"), value_of("motion.right_scale"),
          value_of("motion.track_scale")};
}

// GIVEN wheels known to 2 % and prints to 0.3 %, and sightings worse than they are told WHEN it is driven round and
// round THEN the map is as large as both together say, the prints above all: it doesn't grow or shrink with the rounds.
TEST(test_a_map_under_prints_is_as_large_as_they_say) {
  motion.states.sigma[0] = 0.0;
  for (int i = 0; i < 3; i++) motion.states.sigma[wm::kLeftScale + i] = 0.02;  // left, right, track
  make::sightings.states.sigma[WM_SENSOR_ROW_kRangeScale] = 0.003;
  make::markers.sigma_m = 0.0015;
  make::markers.sigma_rel = 0.0;
  make::markers.heading_sigma_rad = 0.003;
  motion.noise_ticks_per_sqrt_m = 0.001;
  const worn w = drive_under_prints();
  TEST_ASSERT_DOUBLE_WITHIN(0.004, 1.02, w.left * w.range);
  TEST_ASSERT_DOUBLE_WITHIN(0.004, 1.01, w.right * w.range);
  const double wheels = w.left * (w.left - 1.0) + w.right * (w.right - 1.0) + w.track * (w.track - 1.0);
  TEST_ASSERT_DOUBLE_WITHIN(2e-5, 1.0 + 0.0225 * wheels, w.range);  // (0.003 / 0.02)^2: where the starts put it
}

// GIVEN a camera whose bearings are 0 beside its lens's axis WHEN it is driven THEN the angle between is found.
TEST(test_the_axis_of_depth_is_found) {
  make::sightings.states.sigma[WM_SENSOR_ROW_kDepthAxis] = 0.05;
  for (double axis : {-0.04, 0.03}) {
    const found f = drive(7, axis);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.01, f.axis_sigma);
    TEST_ASSERT_DOUBLE_WITHIN(3.0 * f.axis_sigma, axis, f.axis);
  }
}

}  // namespace

void setUp(void) {
  prepare("slam", &params, make::sensor("camera", 0.005, 0.02));
  start_at({3, 0, wm::kHalfPi}, 0.05, 0.05);
  motion.states.sigma[0] = kPrior;  // speed_scale
  make::sightings.states.sigma[WM_SENSOR_ROW_kRangeScale] = kPrior;
  make::sightings.states.sigma[WM_SENSOR_ROW_kYaw] = 0.05;
  motion.noise_yaw_rate_radps = 0.03;
  sensor.range_is_depth = 1;
  range_factor = 1.0;
  is_stated = has_covariance = has_wheels = false;
}
