// SPDX-License-Identifier: Apache-2.0
// Wheel counters of few ticks: their rounding must not become a calibration.
#include "common/suite.h"
#include "events.hpp"
#include "filters/landmark_ekf/params.h"
#include "math/arc.hpp"
#include "motion/motion_params.h"
#include "waymark/estimator.h"
#include "waymark/random.h"

namespace {

constexpr int kLandmarks = 6;
constexpr double kTick_m = 2 * M_PI * 0.25 / 256, kTrack_m = 1.2, kPeriod_s = 0.02;

// A robot that drives squares, sees all landmarks of a known map, and counts its wheels in steps of 6 mm.
struct counted_robot {
  explicit counted_robot(uint64_t seed) : noise{seed, 1, 0} {
    wm_params_defaults(&wm_motion_params_table, &motion);
    wm_params_defaults(&wm_sighting_params_table, &make::sightings);
    wm_params_defaults(&wm_landmark_ekf_params_table, &params);
    for (int i = 0; i < kLandmarks; i++) {
      const wm::sin_cos at = wm::sincos(wm::kTwoPi * i / kLandmarks);
      known[i] = {i, {8.0 + 22.0 * at.cos, 8.0 + 22.0 * at.sin, NAN}, 0.01, NAN, {}, 0};
    }
    sensor = make::sensor("camera", 0.005, NAN);
    setup = make::setup(motion, sensor);
    setup.wheels = make::two_wheels();
    setup.wheels.radius_m = 0.25;
    setup.wheels.ticks_per_turn = 256;
    setup.wheels.track_m = kTrack_m;
    setup.landmarks = known;
    setup.landmark_count = kLandmarks;
    setup.start = {WM_TIME_NONE, {0, 0, 0}, {0, 0, 0, 1}, 0.0, 0.02, 0.01};
    state = make::begun(*ekf, &params, setup);
  }
  ~counted_robot() { std::free(state); }

  void count() {
    const wm_event e = make::quantities(t_s, {{WM_Q_WHEEL_TICKS_LEFT, std::floor(way_m[0] / kTick_m)},
                                              {WM_Q_WHEEL_TICKS_RIGHT, std::floor(way_m[1] / kTick_m)}});
    TEST_ASSERT_EQUAL(WM_OK, ekf->predict(state, &e));
  }

  void look() {
    for (const wm_landmark &l : known) {
      const double bearing =
          wm::wrap(wm::atan2(l.p_m[1] - truth.y_m, l.p_m[0] - truth.x_m) - truth.heading_rad) + gauss(0.005);
      const wm_event e = make::sighting(t_s, l.id, bearing, NAN);
      wm_innovation out[WM_INNOVATIONS_PER_EVENT_MAX];
      size_t count = 0;
      TEST_ASSERT_EQUAL(WM_OK, ekf->correct(state, &e, out, WM_INNOVATIONS_PER_EVENT_MAX, &count));
    }
  }

  // Straight on for 6 s, then around a corner. Looks 10 ms after a count, 20 times a second: the pose there is carried
  // on by that count's speed. Counts of a constant speed have roundings in a pattern.
  void drive_side() {
    const double straight_s = 6.0, turn_s = 8.0;
    for (int i = 0; i < static_cast<int>((straight_s + turn_s) / kPeriod_s); i++) {
      const double turned_s = i * kPeriod_s - straight_s;
      const double v = 2.0 + 0.2 * wm::sin(0.7 * t_s);
      const double w = turned_s < 0.0 ? 0.0 : 0.2 * (1.0 - wm::cos(wm::kTwoPi * turned_s / turn_s));
      count();
      go_on(v, w, 0.5 * kPeriod_s);
      if (i % 5 == 0 || i % 5 == 2) look();
      go_on(v, w, 0.5 * kPeriod_s);
    }
  }

  void go_on(double v, double w, double dt_s) {
    const wm::arc a = wm::make_arc(v * dt_s, 0.0, w * dt_s);
    truth = wm::compose(truth, {a.x_m, a.y_m, a.turn_rad});
    way_m[0] += (v - 0.5 * kTrack_m * w) * dt_s;
    way_m[1] += (v + 0.5 * kTrack_m * w) * dt_s;
    t_s += dt_s;
  }

  double gauss(double sigma) { return sigma * wm_random_next_normal(&noise); }

  // Error over sigma; the calibration is neutral.
  double normalised(const char *name) const {
    wm_calibration_value values[64];
    const size_t n = ekf->calibration(state, values, 64);
    for (size_t i = 0; i < n; i++)
      if (std::strcmp(values[i].name, name) == 0) return (values[i].value - 1.0) / values[i].sigma;
    return NAN;
  }

  const wm_estimator *ekf = wm_estimator_find("landmark_ekf");
  wm_motion_params motion;
  wm_landmark_ekf_params params;
  wm_setup setup;
  wm_sensor sensor;
  wm_landmark known[kLandmarks] = {};
  void *state;
  wm_random noise;
  wm_pose2 truth = {};
  double t_s = 10.0, way_m[2] = {0.0013, 0.0047};
};

// The rounding of the newest count is in the pose that it carries on, and in that pose's correlation with the track.
TEST(test_rounding_of_counts_is_no_track) {
  double sum = 0.0;
  for (uint64_t seed = 1; seed <= 4; seed++) {
    counted_robot robot(seed);
    for (int side = 0; side < 8; side++) robot.drive_side();
    sum += robot.normalised("motion.track_scale");
  }
  TEST_ASSERT_DOUBLE_WITHIN(1.0, 0.0, sum / 4);
}

}  // namespace
