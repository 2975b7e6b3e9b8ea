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

namespace {

constexpr double kTags_m[3][2] = {{-0.07, -0.14}, {-0.07, 0.14}, {0.2, 0.14}};
wm_sensor tags[3];

// A cart on curves among anchors with so many tags, of which the first `heard` give ranges. `stated_m`: the first tag's
// place by the configuration, where it is another one. Returns the largest sigmas by which a heading that is claimed is
// off; *known: the share of stamps at which one is.
double drive_with(int count, int heard, const double *stated_m, double from_s, double to_s, double *known) {
  constexpr double kAnchors_m[][2] = {{-5, -5}, {9, -4}, {8, 9}, {-6, 8}};
  double worst = 0.0;
  int claims = 0, steps = 0;
  if (from_s == 0.0) {
    prepare_ekf(make::sensor("tag", NAN, 0.1));
    all_by_default();
    motion.model = WM_MOTION_CONSTANT_VELOCITY;
    put_on_map({{-5, -5}, {9, -4}, {8, 9}, {-6, 8}}, 0);
    for (int i = 0; i < count; i++) {
      tags[i] = make::sensor("tag", NAN, 0.1);
      for (int k = 0; k < 2; k++) tags[i].mounting.xyz_m[k] = stated_m ? stated_m[k] : kTags_m[i][k];
    }
    setup.sensors = tags;
    setup.sensor_count = static_cast<size_t>(count);
    start_at({0, 0, NAN}, 0.05, NAN);
    truth.heading_rad = 0.5;
    begin();
  }
  for (double t = from_s; t < to_s; t += 0.1, steps++) {
    go_on(0.5, 0.4 * std::sin(0.3 * t), 0.1);
    for (int i = 0; i < heard; i++) {
      const int own = count == 1 ? 2 : i + count - heard;
      const wm_pose2 eye = wm::compose(truth, {kTags_m[own][0], kTags_m[own][1], 0});
      for (int a = 0; a < 4; a++)
        feed(make::sighting(now_s, a, NAN, view_of(kAnchors_m[a][0], kAnchors_m[a][1], eye).range_m + gauss(0.1),
                            static_cast<uint16_t>(count == 1 ? 0 : own)));
    }
    const wm_estimate e = estimate();
    const double sigma_rad = std::sqrt(e.covariance[wm_cov_index(5, 5)]);
    TEST_ASSERT_LESS_THAN_DOUBLE(11.8, nees_from(truth));  // 3 sigma of two numbers
    if (sigma_rad > 0.5) continue;
    claims++;
    worst = std::fmax(worst, std::fabs(wm::wrap(e.heading_rad - truth.heading_rad)) / sigma_rad);
  }
  *known = static_cast<double>(claims) / steps;
  return worst;
}

}  // namespace

// GIVEN one tag, THEN no heading is claimed, wherever on the cart it is stated to be, and base_link's place is as sure
// as the tag's and the arm allow.
TEST(test_one_tag_has_no_heading) {
  constexpr double kStated_m[][2] = {{0.2, 0.14}, {-0.2, 0.14}, {0.5, 0.0}};
  for (const auto &stated_m : kStated_m) {
    double known;
    drive_with(1, 1, stated_m, 0.0, 60.0, &known);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, known);
    TEST_ASSERT_GREATER_THAN_DOUBLE(1.5, std::sqrt(estimate().covariance[wm_cov_index(5, 5)]));
  }
}

// GIVEN three tags, THEN they show the heading by their differences; WHEN one is left, THEN it is claimed no longer.
TEST(test_several_tags_have_a_heading) {
  double known;
  TEST_ASSERT_LESS_THAN_DOUBLE(4.0, drive_with(3, 3, nullptr, 0.0, 40.0, &known));
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.95, known);
  TEST_ASSERT_LESS_THAN_DOUBLE(4.0, drive_with(3, 1, nullptr, 40.0, 80.0, &known));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, known);
  TEST_ASSERT_GREATER_THAN_DOUBLE(1.5, std::sqrt(estimate().covariance[wm_cov_index(5, 5)]));
}

// GIVEN four anchors on a vehicle, WHEN their tag is carried far from them, THEN a place that is vague across the line
// of sight is corrected and not searched.
TEST(test_a_tag_far_from_its_anchors_is_tracked) {
  constexpr double kAnchors_m[][2] = {{2.5, 0.9}, {2.5, -0.9}, {0.7, 0.9}, {-2.5, -0.9}},
                   kOwn_m[] = {0.03, -0.02, 0.0, -0.04};
  prepare_ekf(make::sensor("tag", NAN, 0.2));
  all_by_default();
  motion.model = WM_MOTION_CONSTANT_VELOCITY;
  put_on_map({{2.5, 0.9}, {2.5, -0.9}, {0.7, 0.9}, {-2.5, -0.9}}, 0);
  start_at({-3, -4, NAN}, 0.1, NAN);
  truth.heading_rad = 0.2;
  begin();
  double sum_m2 = 0.0;
  int steps = 0;
  for (double t = 0.0; t < 120.0; t += 0.1, steps++) {
    go_on(t < 50.0 ? 1.0 : t < 60.0 ? 0.0 : 0.8, t > 55.0 && t < 60.0 ? 0.6 : 0.0, 0.1);
    for (int a = 0; a < 4; a++)
      feed(make::sighting(now_s, a, NAN,
                          view_of(kAnchors_m[a][0], kAnchors_m[a][1], truth).range_m + kOwn_m[a] + gauss(0.05)));
    sum_m2 += wm::square(off_from(truth));
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.6, std::sqrt(sum_m2 / steps));
}
