// SPDX-License-Identifier: Apache-2.0
// landmark_ekf without motion data: a tag or a receiver that is carried.
#include "common/suite.h"
#include "events.hpp"
#include "math/elementary.hpp"
#include "waymark/random.h"

// Its place is known from the first position on, or from the start, and no heading is claimed.
TEST(test_a_place_is_enough) {
  const wm_estimator *ekf = wm_estimator_find("landmark_ekf");
  wm_params_defaults(&wm_sighting_params_table, &make::sightings);
  std::vector<char> params(ekf->params.bytes);
  wm_params_defaults(&ekf->params, params.data());
  wm_motion_params motion;
  wm_params_defaults(&wm_motion_params_table, &motion);
  motion.model = WM_MOTION_CONSTANT_VELOCITY;
  const wm_sensor sensor = make::sensor("tag", std::nan(""), 0.1);
  for (const bool is_given : {true, false}) {
    wm_setup setup = make::setup(motion, sensor);
    const double place_m = is_given ? 0.05 : std::nan("");
    setup.start = {WM_TIME_NONE, {place_m, place_m, 0}, {0, 0, 0, 1}, std::nan(""), 0.1, std::nan("")};
    const std::unique_ptr<void, void (*)(void *)> state(make::begun(*ekf, params.data(), setup), std::free);
    wm_estimate now{};
    double worst_m = 0;
    for (int i = 0; i < 200; i++) {
      const double t = 0.2 * i, x = std::sin(0.3 * t), y = 1.0 - std::cos(0.3 * t);
      const auto noise = [i](uint64_t of) { return 0.03 * wm_random_normal(of, 3, static_cast<uint64_t>(i)); };
      TEST_ASSERT_EQUAL(WM_OK, make::feed(*ekf, state.get(), make::position(t, x + noise(1), y + noise(2), 0.03)));
      ekf->estimate(state.get(), &now);
      TEST_ASSERT_EQUAL(is_given || i > 0 ? WM_STATE_TRACKING : WM_STATE_DEAD_RECKONING, now.state);
      if (i > 10) worst_m = std::fmax(worst_m, std::hypot(now.pose_map_base.p_m[0] - x, now.pose_map_base.p_m[1] - y));
    }
    TEST_ASSERT_LESS_THAN_DOUBLE(3.5 * std::sqrt(now.covariance[0] + now.covariance[wm_cov_index(1, 1)]), worst_m);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.07, std::sqrt(now.covariance[0]));
    TEST_ASSERT_DOUBLE_WITHIN(0.01, wm::kPi * wm::kPi / 3, now.covariance[wm_cov_index(5, 5)]);
  }
}
