// SPDX-License-Identifier: Apache-2.0
// Points on the floor joined to polylines in the picture.
#include "common/suite.h"
#include "detect/polylines.h"

namespace {

wm_points points;
wm::mounted_camera camera;

void add(double x, double y, double normal) {
  points.x_m[points.count] = static_cast<float>(x);
  points.y_m[points.count] = static_cast<float>(y);
  points.normal_rad[points.count] = static_cast<float>(normal);
  points.sigma_m[points.count++] = 0.005F;
}

TEST(a_corner_and_a_step) {
  for (int i = 0; i < 40; i++) add(3, -1 + 0.03 * i, 0);    // ahead
  for (int i = 0; i < 10; i++) add(4, 0.25 + 0.03 * i, 0);  // a metre behind it
  add(2, 1, 0);                                             // alone
  const auto lines = wm::tools::join_points(points, camera);
  TEST_ASSERT_EQUAL(2, lines.size());
  TEST_ASSERT_EQUAL(40, lines[0].size());
  TEST_ASSERT_EQUAL(10, lines[1].size());
  wm::pixel at;
  TEST_ASSERT_TRUE(wm::pixel_of(camera, {3, -1, 0}, 0, &at));
  TEST_ASSERT_DOUBLE_WITHIN(0.01, at.u, lines[0][0].u);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, at.v, lines[0][0].v);
}

TEST(nothing_to_join) { TEST_ASSERT_EQUAL(0, wm::tools::join_points(points, camera).size()); }

}  // namespace

void setUp() {
  points.count = 0;
  wm_camera c = {};
  c.width_px = 1280;
  c.height_px = 720;
  const double intrinsics[] = {522, 522, 640, 360};
  std::copy(intrinsics, intrinsics + 4, c.intrinsics);
  c.mounting = {{0.5, 0, 0.4}, {0, 22 * M_PI / 180, 0}};
  TEST_ASSERT_NULL(wm::mounted_camera_init(&camera, c));
}
