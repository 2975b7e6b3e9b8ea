// SPDX-License-Identifier: Apache-2.0
// A map that outlives a restart (waymark/keeper.h): kept with its joint covariance, taken up, refused where it is
// wrong.
#include <vector>

#include "slam_room.hpp"
#include "waymark/keeper.h"

namespace {

using namespace room;

const wm_keeper *keeper;
std::vector<char> image;

void keep() {
  image.assign(keeper->bytes_max(&params, &setup), 0);
  image.resize(keeper->keep(state.get(), image.data(), image.size()));
}

const char *why_not() { return keeper->why_not(&params, &setup, image.data(), image.size()); }

// The program begins anew, on another clock, where the robot is known to be within these sigmas.
void restart(double x_m, double y_m, double heading_rad, double sigma_m = 0.2, double sigma_rad = 0.05) {
  setup.start = {WM_TIME_NONE, {x_m, y_m, 0}, {0, 0, 0, 1}, heading_rad, sigma_m, sigma_rad};
  now_s = 7.0;
  begin();
  TEST_ASSERT_NULL(why_not());
  keeper->take(state.get(), image.data(), image.size());
}

void learn() {
  begin();
  drive(40);
  keep();
  TEST_ASSERT_GREATER_THAN(0, image.size());
}

// GIVEN a map that was learnt WHEN the program begins anew where the robot stands THEN the map is the same at once, the
// pose is as unsure as the start, and both are right again after the first sightings.
TEST(test_map_and_calibration_are_taken_up_with_their_covariances) {
  for (const bool with_codes : {false, true}) {
    make_room();
    coded = with_codes;
    learn();
    const std::vector<mapped> before = map();
    const wm_calibration_value bias = calibrated("motion.yaw_rate_bias_radps");
    restart(truth.x_m, truth.y_m, truth.heading_rad);
    const std::vector<mapped> after = map();
    TEST_ASSERT_EQUAL(before.size(), after.size());
    TEST_ASSERT_GREATER_THAN(6, before.size());
    for (size_t i = 0; i < before.size(); i++) {
      const wm_landmark &was = before[i].landmark, &is = after[i].landmark;
      TEST_ASSERT_EQUAL(was.id, is.id);
      for (int k = 0; k < 2; k++) TEST_ASSERT_DOUBLE_WITHIN(0.1, was.p_m[k], is.p_m[k]);
      for (int k = 0; k < 3; k++) TEST_ASSERT_DOUBLE_WITHIN(1e-4, before[i].covariance[k], after[i].covariance[k]);
    }
    if (std::isfinite(bias.value)) {
      TEST_ASSERT_EQUAL_DOUBLE(bias.value, value_of("motion.yaw_rate_bias_radps"));
      TEST_ASSERT_EQUAL_DOUBLE(bias.sigma, sigma_of("motion.yaw_rate_bias_radps"));
    }
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.2, sigma());
    drive(1);
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
    TEST_ASSERT_LESS_THAN_DOUBLE(0.06, off());
    TEST_ASSERT_LESS_THAN_DOUBLE(0.1, sigma());
    drive(30);
    expect_whole_map(0.1);
    TEST_ASSERT_EQUAL_DOUBLE(0, counted(WM_COUNTER_LANDMARKS_MOVED));
  }
}

// GIVEN a map that was taken up WHEN the pose is proven again THEN the map is kept again.
TEST(test_a_map_that_was_taken_up_is_kept_again) {
  learn();
  const size_t bytes = image.size();
  restart(truth.x_m, truth.y_m, truth.heading_rad);
  keep();
  TEST_ASSERT_EQUAL(0, image.size());  // not yet proven
  drive(2);
  keep();
  TEST_ASSERT_EQUAL(bytes, image.size());
  restart(truth.x_m, truth.y_m, truth.heading_rad);
  drive(2);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.06, off());
}

// GIVEN a kept map WHEN the robot was carried away while it was off THEN it is found in the map.
TEST(test_a_robot_that_was_moved_while_off_is_found_in_its_map) {
  coded = true;
  learn();
  restart(truth.x_m - 2.5, truth.y_m + 1.5, truth.heading_rad + 1.0);
  TEST_ASSERT_GREATER_THAN_DOUBLE(2.0, off());
  drive(5);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark(&found));
}

// GIVEN a kept map WHEN the robot drove on and turned while it was off, within the start's sigmas THEN no pose is
// further off than its sigma: at such angles a correction is far from linear.
TEST(test_a_robot_that_turned_while_off_is_never_surely_wrong) {
  for (const bool with_codes : {false, true}) {
    double worst = 0.0, late_m = 0.0;
    make_room();
    coded = with_codes;
    learn();
    const wm_pose2 stood = truth;
    for (const double scale : {1.0, 2.0})
      for (int i = 0; i < 18; i++) {
        const double turn = 0.3 * (i % 6 < 3 ? i % 6 - 3 : i % 6 - 2) * scale, side = (i / 6 - 1) * scale;
        truth = stood;
        restart(truth.x_m + 0.3 * side, truth.y_m - 0.4 * side, truth.heading_rad + turn, 0.4 * scale, 0.5 * scale);
        for (int k = 0; k < 30; k++) {
          drive(0.1);
          worst = std::fmax(worst, off() / sigma());
        }
        late_m = std::fmax(late_m, off());
      }
    std::printf("%s: at most %.1f sigma off, %.3f m after 3 s\n", with_codes ? "markers" : "landmarks", worst, late_m);
    TEST_ASSERT_LESS_THAN_DOUBLE(3.0, worst);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.15, late_m);
  }
}

// GIVEN a kept map WHEN the place is vague, as after a minute without motion, and the heading is known THEN the first
// markers give the place: it is linear in it.
TEST(test_a_vague_place_alone_is_found_by_the_first_markers) {
  coded = true;
  learn();
  restart(truth.x_m - 1.0, truth.y_m + 0.5, truth.heading_rad, 80.0, 0.005);
  drive(0.1);
  std::printf("%.3f m off, sigma %.3f m\n", off(), sigma());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.3, sigma());
  TEST_ASSERT_LESS_THAN_DOUBLE(4.0, off() / sigma());
}

TEST(test_without_a_pose_it_is_searched_in_the_map) {
  coded = true;
  learn();
  restart(kAbsent, kAbsent, kAbsent);
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());
  drive(5);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
}

TEST(test_an_image_that_is_wrong_is_refused_with_the_reason) {
  learn();
  const std::vector<char> good = image;
  for (size_t bytes = 0; bytes < good.size(); bytes += 97) {
    image.assign(good.begin(), good.begin() + (long)bytes);
    TEST_ASSERT_EQUAL_STRING("it is truncated", why_not());
  }
  image = good;
  image[0] ^= 1;
  TEST_ASSERT_EQUAL_STRING("it is not a map of slam", why_not());
  image = good;
  image[8] ^= 2;
  TEST_ASSERT_EQUAL_STRING("it has another version", why_not());
  const double nan = kAbsent, large = 1e6;
  for (const size_t from_end : {size_t{8}, size_t{512}, size_t{1024}}) {  // the last variance, two covariances
    image = good;
    std::memcpy(&image[image.size() - from_end], &nan, sizeof nan);
    TEST_ASSERT_NOT_NULL(why_not());
    std::memcpy(&image[image.size() - from_end], &large, sizeof large);
    if (from_end != 8) TEST_ASSERT_NOT_NULL(why_not());
  }
  for (const int32_t next : {-1, INT32_MAX / 2 + 1, INT32_MAX}) {
    image = good;
    std::memcpy(&image[24], &next, sizeof next);
    TEST_ASSERT_EQUAL_STRING("its numbers of landmarks are used up", why_not());
  }
  image = good;
  params.landmark_capacity = 5;
  TEST_ASSERT_EQUAL_STRING("it has more landmarks than slam.landmarks.capacity", why_not());
  make_room();
  image = good;
  motion.states.sigma[WM_SPEED_SCALE] = 0.02;
  TEST_ASSERT_EQUAL_STRING("it has other calibration states than the configuration", why_not());
}

// The run's slot has bytes_max: a map that has grown to its capacity is kept as any other.
TEST(test_a_map_at_its_capacity_is_kept) {
  for (const bool with_codes : {false, true}) {
    make_room();
    coded = with_codes;
    constexpr int kHalf = kCount / 2;
    params.landmark_capacity = kHalf;
    learn();
    TEST_ASSERT_EQUAL_DOUBLE(kHalf, counted(WM_COUNTER_LANDMARKS));
    TEST_ASSERT_LESS_OR_EQUAL(keeper->bytes_max(&params, &setup), image.size());
    TEST_ASSERT_NULL(why_not());
  }
}

TEST(test_an_image_with_too_little_room_is_not_written) {
  learn();
  std::vector<char> small(image.size() - 1, 0x5a);
  TEST_ASSERT_EQUAL(0, keeper->keep(state.get(), small.data(), small.size()));
  for (const char c : small) TEST_ASSERT_EQUAL(0x5a, c);
}

TEST(test_estimators_without_a_map_of_their_own_keep_nothing) {
  TEST_ASSERT_NULL(wm_keeper_of(wm_estimator_find("landmark_ekf")));
  TEST_ASSERT_NOT_NULL(wm_keeper_of(wm_estimator_find("slam")));
}

}  // namespace

void setUp(void) {
  make_room();
  keeper = wm_keeper_of(estimator);
}
