// SPDX-License-Identifier: Apache-2.0
// Camera models against themselves, against finite differences, and against values worked out by hand.
#include "images/camera.h"

#include "common/suite.h"
#include "render_cameras.h"

using namespace wm::images;

namespace {

Vec3 towards(double angle_rad, double around_rad) {
  return {std::sin(angle_rad) * std::cos(around_rad), std::sin(angle_rad) * std::sin(around_rad), std::cos(angle_rad)};
}

TEST(test_there_and_back) {
  for (const NamedCamera &named : all_cameras()) {
    int seen = 0;
    for (double angle = 0; angle <= named.half_angle_rad; angle += 0.05) {
      for (double around = 0; around < 6.28; around += 0.3) {
        const Vec3 d = towards(angle, around);
        Vec2 pixel;
        Vec3 back;
        TEST_ASSERT_TRUE_MESSAGE(project(named.camera, 3.7 * d, pixel), named.name);
        TEST_ASSERT_TRUE_MESSAGE(unproject(named.camera, pixel, back), named.name);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, 0, (back - d).norm(), named.name);
        seen++;
      }
    }
    TEST_ASSERT_GREATER_THAN_INT(300, seen);
  }
}

TEST(test_every_pixel_that_looks_somewhere_comes_back) {
  for (const NamedCamera &named : all_cameras()) {
    int seen = 0;
    for (int v = 0; v < named.camera.height; v += 17) {
      for (int u = 0; u < named.camera.width; u += 13) {
        Vec3 d;
        Vec2 pixel;
        if (!unproject(named.camera, Vec2(u, v), d)) continue;
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, 1, d.norm(), named.name);
        TEST_ASSERT_TRUE_MESSAGE(project(named.camera, d, pixel), named.name);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-6, 0, (pixel - Vec2(u, v)).norm(), named.name);
        seen++;
      }
    }
    TEST_ASSERT_GREATER_THAN_INT_MESSAGE(named.camera.width * named.camera.height / 17 / 13 / 2, seen, named.name);
  }
}

// A step of a pixel turns the direction; projecting a step along that turn must give the pixel's step.
TEST(test_derivatives_fit) {
  const double h = 1e-3;
  for (const NamedCamera &named : all_cameras()) {
    for (double angle = 0.1; angle < named.half_angle_rad; angle += 0.2) {
      Vec2 p, q;
      Vec3 a, b;
      TEST_ASSERT_TRUE(project(named.camera, towards(angle, 0.7 + angle), p));
      for (const Vec2 &step : {Vec2(h, 0), Vec2(0, h)}) {
        TEST_ASSERT_TRUE(unproject(named.camera, p - step, a) && unproject(named.camera, p + step, b));
        const Vec3 slope = (b - a) / (2 * h);
        TEST_ASSERT_TRUE(project(named.camera, (a + b) / 2 + slope * 0.5, q));
        // Half a pixel along the tangent: curvature of the lens leaves less than a hundredth.
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.01, 0, (q - p - step / h * 0.5).norm(), named.name);
      }
    }
  }
}

TEST(test_values_by_hand) {
  Camera c;
  Vec2 p;
  c.intrinsics = {100, 110, 50, 60}, c.distortion = {0.1, 0, 0, 0};
  TEST_ASSERT_TRUE(project(c, {1, 0, 1}, p));  // 45 degrees: theta (1 + 0.1 theta²)
  const double theta = kPi / 4;
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 50 + 100 * theta * (1 + 0.1 * theta * theta), p.x());
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 60, p.y());
  c.model = Model::pinhole_radtan, c.distortion = {0.1, 0, 0.01, 0.02};
  TEST_ASSERT_TRUE(project(c, {0.5, 0, 1}, p));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 50 + 100 * (0.5 * 1.025 + 0.02 * (0.25 + 0.5)), p.x());
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 60 + 110 * (0.01 * 0.25), p.y());
  c.model = Model::omni, c.intrinsics = {1, 100, 110, 50, 60}, c.distortion = {};
  TEST_ASSERT_TRUE(project(c, {0, 1, 0}, p));  // 90 degrees on the unit sphere: y / (0 + xi)
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 60 + 110, p.y());
  c.model = Model::double_sphere, c.intrinsics = {0.5, 0.5, 100, 110, 50, 60};
  TEST_ASSERT_TRUE(project(c, {1, 0, 0}, p));  // d2 = sqrt(1.25); 1 / (0.5 d2 + 0.5 · 0.5)
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 50 + 100 / (0.5 * std::sqrt(1.25) + 0.25), p.x());
}

TEST(test_frames_and_rows) {
  Camera c;
  c.intrinsics = {100, 100, 639.5, 359.5};
  c.T_base_camera = pose_xyz_rpy({1, 2, 3}, 0, 0.1, 0);
  // Straight ahead and to the right and down of the body, in the optical frame.
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, (T_body_optical() * Vec3(0, 0, 1) - Vec3(1, 0, 0)).norm());
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, (T_body_optical() * Vec3(1, 0, 0) - Vec3(0, -1, 0)).norm());
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, (T_body_optical() * Vec3(0, 1, 0) - Vec3(0, 0, -1)).norm());
  // Positive pitch looks down.
  TEST_ASSERT_LESS_THAN_DOUBLE(0, (T_base_optical(c).linear() * Vec3(0, 0, 1)).z());
  c.readout_ns = 719000;
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, -359500, row_offset_ns(c, 0));
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0, row_offset_ns(c, 359.5));
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 359500, row_offset_ns(c, 719));
}

TEST(test_what_has_no_pixel) {
  Camera c;
  Vec2 p;
  std::string error;
  c.intrinsics = {100, 100, 639.5, 359.5};
  c.fov_rad = kPi;
  TEST_ASSERT_FALSE(project(c, {1, 0, -0.01}, p));
  TEST_ASSERT_TRUE(project(c, {1, 0, 0.01}, p));
  TEST_ASSERT_FALSE(project(c, {0, 0, 0}, p));
  c.distortion = {-0.5, 0, 0, 0};  // turns back at theta = 0.82
  TEST_ASSERT_TRUE(project(c, towards(0.8, 0), p));
  TEST_ASSERT_FALSE(project(c, towards(0.9, 0), p));
  c.model = Model::omni;
  TEST_ASSERT_FALSE(camera_valid(c, error));
  TEST_ASSERT_NOT_NULL(std::strstr(error.c_str(), "omni needs 5 values"));
  Model model;
  TEST_ASSERT_TRUE(model_from_name("double-sphere", model));
  TEST_ASSERT_EQUAL(Model::double_sphere, model);
  TEST_ASSERT_FALSE(model_from_name("fisheye", model));
}

}  // namespace
