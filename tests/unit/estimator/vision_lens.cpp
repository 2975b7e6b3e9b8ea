// SPDX-License-Identifier: Apache-2.0
// Camera models: there and back, and where a model has no pixel or no ray.
#include "common/suite.h"
#include "waymark/internal/sensors/lens.hpp"

namespace {

wm_camera camera_of(wm_camera_model model) {
  wm_camera c = {};
  c.model = model;
  c.width_px = 1280;
  c.height_px = 720;
  switch (model) {
    case WM_CAMERA_EQUIDISTANT: {
      const double i[] = {522.4, 522.9, 642.6, 357.3}, k[] = {-0.0052, 0.0021, -0.0016, 0.0002};
      std::copy(i, i + 4, c.intrinsics);
      std::copy(k, k + 4, c.distortion);
      break;
    }
    case WM_CAMERA_PINHOLE_RADTAN: {
      const double i[] = {610, 612, 639, 362}, k[] = {-0.21, 0.06, 0.0004, -0.0003, -0.008};
      std::copy(i, i + 4, c.intrinsics);
      std::copy(k, k + 5, c.distortion);
      break;
    }
    case WM_CAMERA_OMNI: {
      const double i[] = {1.1, 900, 898, 639, 362}, k[] = {-0.1, 0.02, 0.0004, -0.0003};
      std::copy(i, i + 5, c.intrinsics);
      std::copy(k, k + 4, c.distortion);
      break;
    }
    default: {
      const double i[] = {-0.2, 0.59, 360, 361, 639, 362};
      std::copy(i, i + 6, c.intrinsics);
      break;
    }
  }
  return c;
}

const wm_camera_model kModels[] = {WM_CAMERA_EQUIDISTANT, WM_CAMERA_PINHOLE_RADTAN, WM_CAMERA_OMNI,
                                   WM_CAMERA_DOUBLE_SPHERE};

TEST(there_and_back) {
  for (wm_camera_model model : kModels) {
    wm::lens lens;
    TEST_ASSERT_NULL(wm::lens_init(&lens, camera_of(model)));
    for (double u = 0; u < 1280; u += 31)
      for (double v = 0; v < 720; v += 29) {
        wm::vec3 ray;
        wm::pixel back;
        if (!wm::unproject(lens, {u, v}, &ray)) {
          TEST_ASSERT_NOT_EQUAL(WM_CAMERA_EQUIDISTANT, model);
          continue;
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1, wm::length(ray));
        TEST_ASSERT_TRUE(wm::project(lens, 3.5 * ray, &back));
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, u, back.u);
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, v, back.v);
      }
  }
}

// Formulas written out once more, for one ray each.
TEST(by_hand) {
  wm::lens lens;
  wm::pixel at;
  const wm::vec3 ray = {0.3, -0.2, 0.8};
  const double size = std::sqrt(0.77);
  wm::lens_init(&lens, camera_of(WM_CAMERA_EQUIDISTANT));
  TEST_ASSERT_TRUE(wm::project(lens, ray, &at));
  const double r = std::hypot(0.3, 0.2), t = std::atan2(r, 0.8), t2 = t * t;
  const double d = t * (1 - 0.0052 * t2 + 0.0021 * t2 * t2 - 0.0016 * t2 * t2 * t2 + 0.0002 * t2 * t2 * t2 * t2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 522.4 * d * 0.3 / r + 642.6, at.u);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, -522.9 * d * 0.2 / r + 357.3, at.v);
  wm::lens_init(&lens, camera_of(WM_CAMERA_DOUBLE_SPHERE));
  TEST_ASSERT_TRUE(wm::project(lens, ray, &at));
  const double z2 = -0.2 * size + 0.8, d2 = std::sqrt(0.13 + z2 * z2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 360 * 0.3 / (0.59 * d2 + 0.41 * z2) + 639, at.u);
}

TEST(no_pixel_no_ray) {
  wm::lens lens;
  wm::pixel at;
  wm::vec3 ray;
  for (wm_camera_model model : kModels) {
    wm::lens_init(&lens, camera_of(model));
    TEST_ASSERT_FALSE(wm::project(lens, {0, 0, 0}, &at));
    TEST_ASSERT_FALSE(wm::project(lens, {0, 0, -1}, &at));
    TEST_ASSERT_FALSE(wm::project(lens, {NAN, 0, 1}, &at));
    TEST_ASSERT_FALSE(wm::unproject(lens, {NAN, 0}, &ray));
  }
  wm::lens_init(&lens, camera_of(WM_CAMERA_EQUIDISTANT));
  TEST_ASSERT_FALSE(wm::unproject(lens, {1e6, 0}, &ray));
  wm_camera ocam = camera_of(WM_CAMERA_EQUIDISTANT);
  ocam.model = WM_CAMERA_OCAM;
  TEST_ASSERT_NOT_NULL(wm::lens_init(&lens, ocam));
}

TEST(on_the_robot) {
  wm_camera c = camera_of(WM_CAMERA_EQUIDISTANT);
  c.mounting = {{0.5, 0.1, 0.4}, {0.02, 22 * M_PI / 180, -0.3}};
  wm::mounted_camera camera;
  TEST_ASSERT_NULL(wm::mounted_camera_init(&camera, c));
  wm::pixel at;
  double x, y;
  TEST_ASSERT_TRUE(wm::pixel_of(camera, {2.5, -0.6, 0}, 2, &at));
  TEST_ASSERT_TRUE(at.v > 200);
  TEST_ASSERT_TRUE(wm::floor_of(camera, at, &x, &y));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.5, x);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, -0.6, y);
  TEST_ASSERT_FALSE(wm::pixel_of(camera, {-2, 0, 0}, 2, &at));  // behind
  TEST_ASSERT_FALSE(wm::floor_of(camera, {640, 0}, &x, &y));    // above the horizon
}

}  // namespace
