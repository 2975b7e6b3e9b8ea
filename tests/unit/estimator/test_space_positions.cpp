// SPDX-License-Identifier: Apache-2.0
// Positions in space: a receiver with an error that lasts, a delay, and solutions of other kinds.
#include "stereo_scene.hpp"

namespace {

constexpr double kStep_s = 0.02, kTau_s = 20;

// A boat in circles at 1 to 2 m/s: at one speed a delay would look as an antenna further ahead. Its receiver gives five
// positions a second.
struct boat : scene {
  explicit boat(const vec3 &antenna = {0, 0, 0}, bool is_stated = false) : scene(10), antenna_m(antenna) {
    if (is_stated) std::memcpy(rig.antenna_m, &antenna, sizeof rig.antenna_m);
    begin();
  }
  // `lasting_m`: sigma of an error that wanders; `east_m`: of one that does not.
  void sail(double seconds, double stated_m, double lasting_m, double east_m = 0) {
    const double left = std::exp(-0.2 / kTau_s);
    for (int i = 0; i < static_cast<int>(std::lround(seconds / kStep_s)); i++, step_++) {
      swim(kStep_s, {1.5 + 0.5 * std::sin(0.5 * t_s), 0, 0}, {0, 0, 0.19});
      way_.push_back(truth);
      if (step_ % 10 != 9) continue;
      for (double &error : error_) error = step_ == 9 ? noise() : left * error + std::sqrt(1 - left * left) * noise();
      const auto late = static_cast<size_t>(std::lround(delay_s / kStep_s));
      const pose3 before = way_[way_.size() - 1 - std::min(late, way_.size() - 1)];
      const vec3 then = before.p + matrix_of(before.q) * antenna_m;
      wm_event e = make::position(t_s, then.x + east_m + lasting_m * error_[0] + 0.5 * stated_m * noise(),
                                  then.y + lasting_m * error_[1] + 0.5 * stated_m * noise(), stated_m);
      e.as.position.p_m[2] = then.z + lasting_m * error_[2] + 0.5 * stated_m * noise();
      e.as.position.sigma_z_m = stated_m;
      TEST_ASSERT_EQUAL(WM_OK, take(e));
      if (t_s < 20) continue;
      const wm_estimate now = estimate();
      const double dx = now.pose_map_base.p_m[0] - truth.p.x, dy = now.pose_map_base.p_m[1] - truth.p.y;
      const double xx = now.covariance[0], xy = now.covariance[1], yy = now.covariance[7];
      inside_ += (dx * dx * yy - 2 * dx * dy * xy + dy * dy * xx) / (xx * yy - xy * xy) < 5.991;
      judged_++;
    }
  }
  double off() const {
    const wm_estimate now = estimate();
    return std::hypot(now.pose_map_base.p_m[0] - truth.p.x, now.pose_map_base.p_m[1] - truth.p.y);
  }
  double delay_s = 0;
  vec3 antenna_m;
  double error_[3] = {0, 0, 0};
  int step_ = 0, inside_ = 0, judged_ = 0;
  std::vector<pose3> way_;
};

TEST(test_an_error_that_lasts_is_not_averaged_away) {
  boat b;
  b.sail(150, 0.5, 1.0);
  TEST_ASSERT_GREATER_OR_EQUAL(90, 100 * b.inside_ / b.judged_);
  TEST_ASSERT_LESS_THAN_DOUBLE(1.0, b.off());
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, b.estimate().state);
}

TEST(test_the_receivers_delay_is_found) {
  boat b;
  b.delay_s = 0.2;
  b.sail(100, 0.1, 0.2);
  const wm_calibration_value found = b.calibrated("gnss.time_offset_s");
  TEST_ASSERT_DOUBLE_WITHIN(std::fmin(0.05, 3 * found.sigma), 0.2, found.value);
}

// RTK is lost for ten seconds: the receiver falls back to a solution that is half a metre off, and states it.
TEST(test_another_solution_has_an_error_of_its_own) {
  boat b;
  b.sail(20, 0.02, 0.02);
  b.sail(10, 0.3, 0, 0.5);
  TEST_ASSERT_LESS_THAN_DOUBLE(2.5, b.off() / std::sqrt(b.estimate().covariance[0]));
  b.sail(1, 0.02, 0.02);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, b.off());
}

TEST(test_the_antennas_place_is_found_by_turns) {
  boat b({0.5, -0.3, 0});
  b.sail(100, 0.05, 0.05);
  TEST_ASSERT_DOUBLE_WITHIN(0.06, 0.5, b.calibrated("gnss.antenna_x_m").value);
  TEST_ASSERT_DOUBLE_WITHIN(0.06, -0.3, b.calibrated("gnss.antenna_y_m").value);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.15, b.off());
}

TEST(test_a_stated_mounting_is_taken) {
  boat b({0.5, -0.3, 1.2}, true);
  b.sail(1, 0.05, 0.05);
  TEST_ASSERT_DOUBLE_WITHIN(0.03, 1.2, b.calibrated("gnss.antenna_z_m").value);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.021, b.calibrated("gnss.antenna_z_m").sigma);
}

// Nothing of a receiver stands in the calibration of a vehicle without one.
TEST(test_a_vehicle_without_a_receiver) {
  boat b;
  wm_calibration_value values[64];
  const size_t count = b.ekf->calibration(b.state, values, 64);
  for (size_t i = 0; i < count; i++) TEST_ASSERT_NULL_MESSAGE(std::strstr(values[i].name, "gnss"), values[i].name);
}

// A visual odometry that measures 8 % too much, by positions for a while and then alone for 60 m. A prior of that size
// holds; one of 1 % is wrong by many of its sigmas, and the pose with it.
TEST(test_the_scale_of_a_visual_odometry) {
  constexpr double kScale = 1 / 1.08;
  for (const bool wide : {false, true}) {
    boat b;
    b.set("states.velocity_scale_sigma", wide ? 0.08 : 0.01);
    b.log_scale = kScale;
    free(b.state);
    b.begin();
    b.sail(20, 1.0, 0.3);
    for (int i = 0; i < 2000; i++) b.swim(kStep_s, {1.5, 0, 0}, {0, 0, 0});
    const wm_estimate e = b.estimate();
    const wm_calibration_value found = b.calibrated("motion.velocity_scale");
    const double scale_off = std::fabs(found.value - kScale) / found.sigma;
    const double off = b.off() / std::sqrt(e.covariance[0] + e.covariance[7]);
    TEST_ASSERT_EQUAL(wide, scale_off < 3);
    TEST_ASSERT_EQUAL(wide, off < 2.5);
  }
}

}  // namespace
