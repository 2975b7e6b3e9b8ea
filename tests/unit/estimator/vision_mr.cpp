// SPDX-License-Identifier: Apache-2.0
// Detector `mr` on drawn views: place and turn, and pictures that nobody means.
#include <algorithm>
#include <memory>

#include "common/eyes.hpp"
#include "common/marker_views.hpp"
#include "waymark/marker_fit.h"
#include "waymark/mr_code.h"
#include "waymark/random.h"

namespace {

using namespace wm::views;

struct Machine : wm::drawn::marker_eyes {
  explicit Machine(const wm_camera &c, double size_m = 0.27) : marker_eyes(wm_detector_find("mr"), c, "mr", size_m) {}
};

// The camera looks along its body's x axis, the print stands upright before it.
TEST(place_and_turn_are_right) {
  for (const double tilt : {0.0, 0.6, -0.9}) {
    View view = plain_view(1.5, tilt, 0.27);
    view.response = 0.6;  // white grows
    Machine machine(view.camera);
    for (int i = 0; i < 3; i++) TEST_ASSERT_EQUAL(1, machine.look(take_picture(view, mr_ink(9))));
    const wm_marker &m = machine.events[0].as.marker;
    TEST_ASSERT_EQUAL(9, m.id);
    TEST_ASSERT_DOUBLE_WITHIN(0.004, 1.5, m.p_m[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.001, -view.centre_m.x, m.p_m[1]);
    TEST_ASSERT_DOUBLE_WITHIN(0.001, -view.centre_m.y, m.p_m[2]);
    const double yaw = std::remainder(m.yaw_rad + M_PI / 2 + tilt, 2 * M_PI);
    TEST_ASSERT_DOUBLE_WITHIN(4 * m.yaw_sigma_rad + 0.002, 0.0, yaw);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0, m.yaw_sigma_rad);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0, m.along_sigma_m);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.02, m.along_sigma_m);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.02, m.bloom_px);
  }
}

// A detector's corners are good to a pixel or so, and lie inwards where white grows: what is measured doesn't lean
// there.
TEST(rough_corners_do_not_matter) {
  const wm_marker_print print = {0.2, 4, {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}, {}}, 0, 0.75, 1.0};
  const Ink ring = [](double x, double y) {
    const double reach = std::max(std::fabs(x), std::fabs(y));
    return reach > 0.6 ? -1 : reach < 0.5 && reach > 0.375 ? 1 : 0;
  };
  View view = plain_view(2.5, 0.5, print.size_m);
  view.blur_px = 0.9;
  view.response = 0.6;
  const std::vector<uint8_t> grey = take_picture(view, ring);
  const wm_frame frame = frame_of(grey, view.camera);
  wm::lens optics;
  TEST_ASSERT_NULL(wm::lens_init(&optics, view.camera));
  double range_m[2];
  for (int outwards = 0; outwards < 2; outwards++) {
    const double scale = outwards ? 1.05 : 0.95;  // about a pixel
    double corner_px[4][2];
    for (int i = 0; i < 4; i++) {
      const double *c = print.corner[i];
      wm::pixel p;
      TEST_ASSERT_TRUE(
          wm::project(optics, view.centre_m + scale * print.size_m * (c[0] * view.right + c[1] * view.down), &p));
      corner_px[i][0] = p.u, corner_px[i][1] = p.v;
    }
    std::unique_ptr<void, decltype(&std::free)> memory(std::aligned_alloc(64, (wm_marker_fit_bytes() + 63) / 64 * 64),
                                                       &std::free);
    auto *fit = static_cast<wm_marker_fit *>(memory.get());
    TEST_ASSERT_NULL(wm_marker_fit_init(fit, &view.camera, &print));
    wm_marker seen{};
    for (int i = 0; i < 3; i++) TEST_ASSERT_TRUE(wm_marker_fit_read(fit, &frame, corner_px, &seen));
    range_m[outwards] = std::hypot(seen.p_m[0], seen.p_m[1], seen.p_m[2]);
  }
  std::printf("2.5 m away, corners a pixel inwards: %.4f m, outwards: %.4f m\n", range_m[0], range_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(0.001, range_m[0], range_m[1]);
}

// How narrow it looks says little of the turn of an upright print seen nearly face on from afar: its sigma says so.
TEST(nearly_face_on_the_turn_is_as_unsure_as_it_says) {
  double nees = 0, sigma = 0;
  int seen = 0;
  for (const double tilt : {0.0, 0.04, 0.08, 0.12})
    for (uint64_t seed = 1; seed <= 12; seed++) {
      View view = plain_view(4.0, tilt, 0.2);
      view.seed = seed;
      view.noise_grey = 4;
      view.centre_m.x = 0.02 + 0.004 * static_cast<double>(seed);
      Machine machine(view.camera, 0.2);
      if (machine.look(take_picture(view, mr_ink(9))) == 0) continue;
      const wm_marker &m = machine.events[0].as.marker;
      const auto off = [&](double yaw) { return std::fabs(std::remainder(yaw + M_PI / 2 + tilt, 2 * M_PI)); };
      const double error = m.poses == 2 ? std::min(off(m.yaw_rad), off(m.other_yaw_rad)) : off(m.yaw_rad);
      nees += error * error / (m.yaw_sigma_rad * m.yaw_sigma_rad);
      sigma += m.yaw_sigma_rad;
      seen++;
    }
  printf("nearly face on: NEES of the turn %.2f, sigma %.3f rad, %d seen\n", nees / seen, sigma / seen, seen);
  TEST_ASSERT_GREATER_OR_EQUAL(40, seen);
  TEST_ASSERT_LESS_THAN_DOUBLE(1.3, nees / seen);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.15, sigma / seen);
}

// Two prints of one identity, or one seen twice in a mirror's place: both are given, each where it is.
TEST(a_marker_twice_in_a_picture_is_given_twice) {
  View view = plain_view(2.0, 0.0, 0.27);
  view.centre_m.x = -0.5;
  std::vector<uint8_t> left = take_picture(view, mr_ink(9));
  view.centre_m.x = 0.5;
  const std::vector<uint8_t> right = take_picture(view, mr_ink(9));
  for (size_t i = 0; i < left.size(); i++)
    if (i % 640 >= 320) left[i] = right[i];
  Machine machine(view.camera);
  TEST_ASSERT_EQUAL(2, machine.look(left));
  TEST_ASSERT_EQUAL(9, machine.events[0].as.marker.id);
  TEST_ASSERT_EQUAL(9, machine.events[1].as.marker.id);
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 1.0,
                            std::fabs(machine.events[0].as.marker.p_m[1] - machine.events[1].as.marker.p_m[1]));
}

TEST(capacity_is_kept) {
  const View view = plain_view(1.0, 0.0, 0.27);
  Machine machine(view.camera);
  const std::vector<uint8_t> grey = take_picture(view, mr_ink(3));
  const wm_frame frame = frame_of(grey, view.camera);
  size_t count = 99;
  TEST_ASSERT_EQUAL(WM_OK,
                    machine.detector->detect(machine.state.get(), &frame, nullptr, machine.events.data(), 0, &count));
  TEST_ASSERT_EQUAL(0, count);
}

TEST(blank_and_noisy_pictures_have_none) {
  const View view = plain_view(1.0, 0.0, 0.27);
  Machine machine(view.camera);
  std::vector<uint8_t> grey(640 * 480);
  for (const int level : {0, 1, 127, 254, 255}) {
    grey.assign(grey.size(), static_cast<uint8_t>(level));
    TEST_ASSERT_EQUAL(0, machine.look(grey));
  }
  for (uint64_t seed = 0; seed < 6; seed++) {
    for (size_t i = 0; i < grey.size(); i++) {
      const double u = wm_random_uniform(seed, 21, i / (1 + seed * seed));  // grains, streaks
      grey[i] = static_cast<uint8_t>(seed % 2 ? 255 * (u > 0.5) : 256 * u);
    }
    TEST_ASSERT_EQUAL(0, machine.look(grey));
  }
}

// Prints cut by the picture's edge, and the smallest pictures.
TEST(parts_of_prints_and_tiny_pictures) {
  View view = plain_view(0.6, 0.0, 0.27);
  Machine machine(view.camera);
  for (const double x : {-0.42, 0.42}) {
    view.centre_m.x = x;
    TEST_ASSERT_EQUAL(0, machine.look(take_picture(view, mr_ink(3))));
  }
  wm_camera tiny = view.camera;
  for (const uint32_t size : {16U, 17U, 31U}) {
    tiny.width_px = tiny.height_px = size;
    Machine small(tiny);
    std::vector<uint8_t> grey(static_cast<size_t>(size) * size);
    for (uint64_t seed = 0; seed < 20; seed++) {
      for (size_t i = 0; i < grey.size(); i++) grey[i] = static_cast<uint8_t>(256 * wm_random_uniform(seed, 22, i));
      TEST_ASSERT_EQUAL(0, small.look(grey));
    }
  }
}

// A print with so many modules painted over: up to six are read, more are none.
TEST(painted_modules_are_corrected_or_refused) {
  const View view = plain_view(1.0, 0.3, 0.27);
  for (int painted = 4; painted <= 9; painted++) {
    const uint64_t code = wm_mr_encode(200);
    uint64_t modules = code;
    for (int i = 0; i < painted; i++) modules ^= UINT64_C(1) << (7 * i + 3);
    Machine machine(view.camera);
    const size_t count = machine.look(take_picture(view, [=](double x, double y) { return wm_mr_ink(modules, x, y); }));
    TEST_ASSERT_EQUAL(painted <= WM_MR_CORRECTED, count);
    if (count) TEST_ASSERT_EQUAL(200, machine.events[0].as.marker.id);
  }
}

}  // namespace
