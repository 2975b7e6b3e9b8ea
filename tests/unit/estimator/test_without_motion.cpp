// SPDX-License-Identifier: Apache-2.0
// landmark_ekf without motion data: a tag or a receiver that is carried.
#include "world.hpp"

using namespace world;

// Its place is known from the first position on, or from the start, and no heading is claimed.
TEST(test_a_place_is_enough) {
  prepare_ekf(make::sensor("tag", NAN, 0.1));
  all_by_default();
  motion.model = WM_MOTION_CONSTANT_VELOCITY;
  for (const bool is_given : {true, false}) {
    const double place_m = is_given ? 0.05 : kAbsent;
    start_at({place_m, place_m, NAN}, 0.1, NAN);
    begin();
    double worst_m = 0;
    for (int i = 0; i < 200; i++) {
      const double t = 0.2 * i, x = std::sin(0.3 * t), y = 1.0 - std::cos(0.3 * t);
      const auto noise = [i](uint64_t of) { return 0.03 * wm_random_normal(of, 3, static_cast<uint64_t>(i)); };
      feed(make::position(t, x + noise(1), y + noise(2), 0.03));
      TEST_ASSERT_EQUAL(is_given || i > 0 ? WM_STATE_TRACKING : WM_STATE_DEAD_RECKONING, published_state());
      if (i > 10) worst_m = std::fmax(worst_m, off_from({x, y, 0}));
    }
    TEST_ASSERT_LESS_THAN_DOUBLE(3.5 * sigma(), worst_m);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.07, std::sqrt(estimate().covariance[0]));
    TEST_ASSERT_DOUBLE_WITHIN(0.01, wm::kPi * wm::kPi / 3, estimate().covariance[wm_cov_index(5, 5)]);
  }
}
