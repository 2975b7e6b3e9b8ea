// SPDX-License-Identifier: Apache-2.0
// Detector `apriltag` on drawn pictures of markers of known pose: place, direction, distance, and that the growing of
// white which a camera's response makes doesn't change the distance.
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <vector>

#include "common/eyes.hpp"
#include "waymark/detectors.h"

namespace {

constexpr int kWidth = 640, kHeight = 480, kTag = 23;
constexpr double kSize_m = 0.2;

std::unique_ptr<wm::drawn::marker_eyes> eyes;
std::vector<double> light;
std::vector<uint8_t> grey;

// The camera looks up (pitch -90 degrees); the print hangs level at (x, y, z) of the camera's body, turned by `yaw`.
struct pose {
  double x, y, z, yaw;
};

// u, v from -1 to 1 over the black square, v down. The library draws its tags upside down, as readers of the format see
// them (the order of ArUco's corners).
double print_at(image_u8_t *tag, double u, double v) {
  const int modules = tag->width;  // with the white rim
  const double cells = modules - 2;
  const int i = (int)std::floor((1 - u) / 2 * cells + 1), j = (int)std::floor((1 - v) / 2 * cells + 1);
  if (i < 0 || j < 0 || i >= modules || j >= modules) return 0.5;
  return tag->buf[j * tag->stride + i] ? 0.9 : 0.1;
}

// Light by 5 x 5 samples a pixel and a blur; `gamma` bends it into grey levels, which makes white grow.
void draw(const pose &p, double gamma, int id = kTag, int blurred = 2) {
  apriltag_family_t *family = tag36h11_create();
  image_u8_t *tag = apriltag_to_image(family, (uint32_t)id);
  const wm_camera &c = eyes->rig.cameras[0];
  light.assign(kWidth * kHeight, 0.0);
  for (int row = 0; row < kHeight; row++)
    for (int column = 0; column < kWidth; column++)
      for (int k = 0; k < 25; k++) {
        const int across = k % 5 - 2, down = k / 5 - 2;
        const double px = column + across / 5.0, py = row + down / 5.0;
        // Body: x forward (up), y left, z up of the body; optical x = -y, y = -z.
        const double rx = (px - c.intrinsics[2]) / c.intrinsics[0], ry = (py - c.intrinsics[3]) / c.intrinsics[1];
        const double dy = -rx * p.x - p.y, dz = -ry * p.x - p.z;  // on the print's plane, from its centre
        // Seen from above (levelled: x = -z of the body, y = y): the print's upper edge points along yaw; seen from
        // below its "down" is to the right of that by the reader's eye, which looks up.
        const double lx = -dz, ly = dy;
        const double u = (std::cos(p.yaw) * lx + std::sin(p.yaw) * ly) / (0.5 * kSize_m);
        const double v = (-std::sin(p.yaw) * lx + std::cos(p.yaw) * ly) / (0.5 * kSize_m);
        light[static_cast<size_t>(row) * kWidth + static_cast<size_t>(column)] += print_at(tag, u, v) / 25.0;
      }
  for (int pass = 0; pass < blurred; pass++) {  // [1 2 1], both ways
    std::vector<double> from = light;
    for (int i = kWidth + 1; i < kWidth * kHeight - kWidth - 1; i++) {
      double sum = 0.0;
      for (int a = -1; a <= 1; a++)
        for (int b = -1; b <= 1; b++) sum += from.data()[i + a * kWidth + b] * (2 - std::abs(a)) * (2 - std::abs(b));
      light[(size_t)i] = sum / 16.0;
    }
  }
  grey.resize(light.size());
  for (size_t i = 0; i < light.size(); i++) grey[i] = (uint8_t)(255.0 * std::pow(light[i], gamma) + 0.5);
  std::free(tag->buf);
  std::free(tag);
  tag36h11_destroy(family);
}

void begin() {
  size_t count;
  wm_camera c{};
  std::strcpy(c.name, "ceiling");
  c.model = WM_CAMERA_PINHOLE_RADTAN;
  c.width_px = kWidth;
  c.height_px = kHeight;
  c.intrinsics_count = 4;
  const double k[4] = {450, 452, 322.5, 237.0};
  std::memcpy(c.intrinsics, k, sizeof k);
  c.mounting.rpy_rad[1] = -1.5707963267948966;
  eyes = std::make_unique<wm::drawn::marker_eyes>(wm_library_detectors(&count)[0], c, "tag36h11", kSize_m);
}

size_t look() { return eyes->look(grey, 5); }

TEST(test_place_direction_and_distance_are_right_whatever_the_response) {
  for (double gamma : {1.0, 0.5})
    for (double yaw : {0.3, -2.4}) {
      begin();
      const pose want = {2.26, 0.5, -0.3, yaw};
      draw(want, gamma);
      for (int i = 0; i < 3; i++) TEST_ASSERT_EQUAL(1, look());
      const wm_marker &m = eyes->events[0].as.marker;
      TEST_ASSERT_EQUAL(WM_EVENT_MARKER, eyes->events[0].kind);
      TEST_ASSERT_EQUAL(kTag, m.id);
      TEST_ASSERT_EQUAL_INT64(5, eyes->events[0].t_ns);
      TEST_ASSERT_DOUBLE_WITHIN(0.007 * want.x, want.x, m.p_m[0]);  // outer edges alone: 0.02
      TEST_ASSERT_DOUBLE_WITHIN(0.004, want.y, m.p_m[1]);
      TEST_ASSERT_DOUBLE_WITHIN(0.004, want.z, m.p_m[2]);
      TEST_ASSERT_DOUBLE_WITHIN(0.006, 0.0, std::remainder(m.yaw_rad - yaw, 6.283185307179586));
    }
}

// Along its border a code's modules are white here, black there, and white grows less over a stretch that is narrow. A
// mean of both would make each code another size: where which is, each picture tells.
TEST(test_codes_are_as_far_as_they_are_whatever_lies_along_their_borders) {
  begin();
  for (int id : {77, 103, 175})
    for (double x : {1.3, 1.6, 2.0, 2.4}) {  // near ones teach how much white grows
      draw({x, 0.2, -0.1, 0.3}, 0.5, id, 1);
      TEST_ASSERT_EQUAL(1, look());
      if (x == 2.4) TEST_ASSERT_DOUBLE_WITHIN(0.0012 * x, x, eyes->events[0].as.marker.p_m[0]);  // with a mean: 0.002
    }
}

// The corner's module of the ring lies partly beyond the picture's rim: two sides end there and are extended.
TEST(test_a_print_is_read_whose_corner_is_outside_of_the_picture) {
  for (double corner_px : {2.0, -1.0, -4.0}) {  // distance of the corner from the rim
    begin();
    const double distance_m = 2.0, half_diagonal_px = 450 * 0.70710678 * kSize_m / distance_m;
    const pose want = {distance_m, (322.5 - half_diagonal_px - corner_px) / 450 * distance_m, 0.1, 0.78539816};
    draw(want, 1.0);
    TEST_ASSERT_EQUAL(1, look());
    const wm_marker &m = eyes->events[0].as.marker;
    TEST_ASSERT_EQUAL(kTag, m.id);
    TEST_ASSERT_DOUBLE_WITHIN(0.03 * want.x, want.x, m.p_m[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.03, want.y, m.p_m[1]);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, want.z, m.p_m[2]);
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 0.0, std::remainder(m.yaw_rad - want.yaw, 6.283185307179586));
  }
}

TEST(test_an_empty_picture_and_one_of_another_size) {
  begin();
  grey.assign(kWidth * kHeight, 128);
  TEST_ASSERT_EQUAL(0, look());
  const wm_frame frame = wm::drawn::frame_of(grey, 32, 32, 0);
  size_t count = 9;
  TEST_ASSERT_EQUAL(WM_BAD_DATA,
                    eyes->detector->detect(eyes->state.get(), &frame, nullptr, eyes->events.data(), 4, &count));
  TEST_ASSERT_EQUAL(0, count);
}

TEST(test_what_it_lacks_is_said) {
  begin();
  eyes->rig.marker_size_m = std::nan("");
  eyes->expect_refused(eyes->view, "size_m");
  std::strcpy(eyes->rig.marker_family, "mr");
  eyes->expect_refused(eyes->view, "family");
}

}  // namespace
