// SPDX-License-Identifier: Apache-2.0
// What makes false edges on a floor: lamps' reflections, joints of tiles, the mirror image of a skirting board; and
// that the edge that is looked for is found among them, with its normal.
#include <functional>
#include <vector>

#include "common/eyes.hpp"
#include "common/fisheye_rig.hpp"
#include "waymark/internal/sensors/lens.hpp"
#include "waymark/random.h"

namespace {

constexpr uint32_t kWidth = 1280, kHeight = 720;
constexpr double kWall_m = 3, kBoard_m = 0.08;

wm_rig rig;
wm::mounted_camera camera;
std::vector<uint8_t> picture;
std::unique_ptr<wm::drawn::eyes> edges;

// A wall with a skirting board across the way, seen over a floor of this brightness, which mirrors a share of it.
using Floor = std::function<double(double x, double y)>;
double brightness(const wm::vec3 &d, const Floor &floor, double mirror) {
  const double to_wall = (kWall_m - camera.centre_m.x) / d.x, height = camera.centre_m.z + to_wall * d.z;
  const auto wall = [](double z) { return z < kBoard_m ? 50.0 : 170.0; };
  if (d.x > 0 && height > 0) return wall(height);
  const double to_floor = -camera.centre_m.z / d.z;
  const double seen = floor(camera.centre_m.x + to_floor * d.x, camera.centre_m.y + to_floor * d.y);
  return d.x > 0 ? seen + mirror * (wall(-height) - seen) : seen;
}

void draw(const Floor &floor, double mirror) {
  picture.assign(kWidth * kHeight, 0);
  for (uint32_t v = 0; v < kHeight; v++)
    for (uint32_t u = 0; u < kWidth; u++) {
      double sum = 0;
      for (int i = 0; i < 4; i++) {
        wm::vec3 ray;
        if (wm::unproject(camera.optics, {u - 0.25 + 0.5 * (i % 2), v - 0.25 + 0.5 * (i / 2)}, &ray))
          sum += brightness(camera.R_base_optical * ray, floor, mirror) / 4;
      }
      picture[v * kWidth + u] = static_cast<uint8_t>(sum + 4 * wm_random_uniform(1, 2, v * kWidth + u));
    }
}

const wm_points &look() {
  const int32_t front = 0;
  edges->begin({&rig, &front, nullptr, 0, nullptr, 0, nullptr, 0});
  const wm_frame frame = wm::drawn::frame_of(picture, kWidth, kHeight, 10);
  TEST_ASSERT_EQUAL(1, edges->look(&frame));
  return edges->events[0].as.points;
}

// At least this share lies at the wall, and these look straight away from the robot.
void expect_wall(double share) {
  const wm_points &p = look();
  uint32_t right = 0;
  double normal_off = 0;
  for (uint32_t i = 0; i < p.count; i++) {
    if (std::fabs(static_cast<double>(p.x_m[i]) - kWall_m) > 4 * static_cast<double>(p.sigma_m[i])) continue;
    right++;
    normal_off += std::fabs(static_cast<double>(p.normal_rad[i]));
  }
  TEST_ASSERT_GREATER_THAN(100, p.count);
  TEST_ASSERT_GREATER_OR_EQUAL(static_cast<uint32_t>(share * p.count), right);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.03, normal_off / right);
}

double plain_floor(double, double) { return 130; }

TEST(a_plain_floor) {
  draw(plain_floor, 0);
  expect_wall(1);
}

TEST(lamps_in_the_floor) {
  draw([](double x, double y) { return std::fabs(y) < 0.4 && std::fmod(x, 1.2) < 0.3 ? 220.0 : 130.0; }, 0);
  expect_wall(0.97);
}

TEST(joints_of_tiles) {
  draw([](double x, double y) { return std::fmod(x, 0.6) < 0.01 || std::fmod(y + 9, 0.6) < 0.01 ? 60.0 : 130.0; }, 0);
  expect_wall(0.9);
}

// Tape of 6 cm along the way and a threshold of 8 cm across it: wider than any joint, floor on both sides.
TEST(bands_on_the_floor) {
  const auto floor = [](double x, double y) {
    return std::fabs(y - 0.5) < 0.03 || std::fabs(x - 2.2) < 0.04 ? 60.0 : 130.0;
  };
  draw(floor, 0);
  expect_wall(0.9);
}

TEST(a_floor_that_mirrors) {
  draw(plain_floor, 0.35);
  expect_wall(0.9);
}

// The paper's way finds the foot of the wall, but the board's upper edge as well.
TEST(by_windows) {
  draw(plain_floor, 0);
  edges->set("mode", 1);
  const wm_points &p = look();
  uint32_t right = 0;
  for (uint32_t i = 0; i < p.count; i++) {
    const double x = static_cast<double>(p.x_m[i]), normal = std::fabs(static_cast<double>(p.normal_rad[i]));
    if (std::fabs(x - kWall_m) < 0.05 && normal < 0.2) right++;
  }
  TEST_ASSERT_GREATER_THAN(20, right);
  TEST_ASSERT_DOUBLE_IS_DETERMINATE(static_cast<double>(p.sigma_m[0]));
}

TEST(a_lone_point_is_left_out) {
  // A dark spot on the floor, two rays wide.
  draw([](double x, double y) { return std::fabs(y) < 0.02 && x > 1.8 && x < 2.2 ? 40.0 : 130.0; }, 0);
  expect_wall(1);
}

}  // namespace

void setUp() {
  rig = wm::drawn::rig_of({wm::drawn::fisheye(kWidth, kHeight, 522, {{0.5, 0, 0.4}, {0, 22 * M_PI / 180, 0}})});
  TEST_ASSERT_NULL(wm::mounted_camera_init(&camera, rig.cameras[0]));
  edges = std::make_unique<wm::drawn::eyes>("edges");
}
