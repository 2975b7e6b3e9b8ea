// SPDX-License-Identifier: Apache-2.0
// calibrate mounting: a drive through a drawn building with a camera that sits otherwise than believed, looks later
// than it says, on wheels and a gyro that are off: all of it is found, within what is said of its sigmas.
#include <vector>

#include "calibrate/mounting.h"

#include "common/drawn_walls.hpp"
#include "common/failure.h"
#include "common/suite.h"
#include "made.h"
#include "waymark/random.h"

namespace {

using wm::calibrate::MountingScan;

constexpr double kPixel_m = 0.02, kDegree = 0.017453292519943295;
constexpr int kWidth = 900, kHeight = 600;

const std::vector<uint8_t> edges = drawn(kCorridors, kWidth, kHeight, kPixel_m);
wm_raster map = {kWidth, kHeight, kPixel_m, 0, 0, 0, nullptr, nullptr, 1};
wm_camera camera{};

// What is true, beside what is believed: the camera looks 0.4 degrees lower and 0.3 to the left, hangs 1 cm higher.
constexpr double kPitch = 0.4 * kDegree, kYaw = 0.3 * kDegree, kHigher_m = 0.01, kOlder_s = 0.03, kScale = 0.02,
                 kBias = 0.004;

struct Pose {
  double x, y, heading;
};

// One picture from where the robot was kOlder_s before its stamp.
wm_points look(const Pose &then, uint64_t &draws) {
  wm_points p{};
  p.camera = 0;
  const double eye_x = then.x + std::cos(then.heading), eye_y = then.y + std::sin(then.heading);
  for (int i = 0; i < 120; i++) {
    const double angle = -1.1 + 2.2 * i / 119;  // as the camera's own azimuth
    const double range = cast(kCorridors, eye_x, eye_y, then.heading + angle + kYaw);
    if (range < 0.3 || range > 5) continue;
    const double below = std::atan2(camera.mounting.xyz_m[2] + kHigher_m, range) - kPitch * std::cos(angle) +
                         0.001 * wm_random_normal(7, 1, draws++);
    if (below < 0.05) continue;
    const double believed = camera.mounting.xyz_m[2] / std::tan(below);
    p.x_m[p.count] = static_cast<float>(1 + believed * std::cos(angle));
    p.y_m[p.count] = static_cast<float>(believed * std::sin(angle));
    p.normal_rad[p.count] = p.sigma_m[p.count] = NAN;
    p.count++;
  }
  return p;
}

std::vector<MountingScan> drive() {
  std::vector<MountingScan> out;
  uint64_t draws = 0;
  Pose at{2, 2, 0}, odom{0, 0, 0};
  std::vector<Pose> past;  // each 10 ms
  for (int i = 0; i < 6000; i++) {
    const int phase = i / 1000;
    const double v = (phase % 2 == 0 ? 1 : -1) * (i % 1000 < 100 ? 0.3 : 0.9);
    const double w = 0.12 * std::sin(0.9 * 0.01 * i);
    past.push_back(at);
    if (i % 10 == 3 && i > 10) {
      MountingScan scan;
      scan.t_ns = static_cast<int64_t>(i) * 10000000;
      scan.points = look(past[static_cast<size_t>(i - static_cast<int>(kOlder_s * 100 + 0.5))], draws);
      scan.start = {at.x + 0.02, at.y - 0.02, at.heading + 0.005};
      scan.odom = {odom.x, odom.y, odom.heading};
      scan.v_mps = v / (1 + kScale);
      scan.w_radps = w + kBias;
      out.push_back(scan);
    }
    const auto step = [](Pose &p, double way, double turn) {
      p.x += way * std::cos(p.heading + 0.5 * turn);
      p.y += way * std::sin(p.heading + 0.5 * turn);
      p.heading += turn;
    };
    step(at, 0.01 * v, 0.01 * w);
    step(odom, 0.01 * v / (1 + kScale), 0.01 * (w + kBias));
  }
  return out;
}

TEST(what_was_believed_wrongly_is_found) {
  const wm::calibrate::Mounting m = wm::calibrate::find_mounting(drive(), map, camera);
  const double truth[wm::calibrate::kMountingErrors] = {kPitch, 0, kYaw, kHigher_m, kOlder_s, 0, kScale, kBias};
  const double most[wm::calibrate::kMountingErrors] = {0.002, 0.002, 0.002, 0.004, 0.008, 0.01, 0.005, 0.001};
  for (size_t i = 0; i < wm::calibrate::kMountingErrors; i++) {
    char what[80];
    std::snprintf(what, sizeof what, "%zu: %.5f +- %.5f, true %.5f", i, m.value[i], m.sigma[i], truth[i]);
    // The map's pixels (2 cm) leave an edge of their own.
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(3 * m.sigma[i] + (i == wm::calibrate::kEdgeOffset ? 0.01 : 0.0005), truth[i],
                                      m.value[i], what);
    TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(most[i], m.sigma[i], what);
  }
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.9, m.explained);
}

TEST(too_short_a_drive_is_refused) {
  std::vector<MountingScan> scans = drive();
  scans.resize(30);
  const auto too_few = [&] {
    made::refused("too few", [&] { (void)wm::calibrate::find_mounting(scans, map, camera); });
  };
  too_few();
}

}  // namespace

int suite_begin(int, char **) {
  map.edges = edges.data();
  std::strcpy(camera.name, "front");
  camera.model = WM_CAMERA_EQUIDISTANT;
  camera.width_px = 1280;
  camera.intrinsics_count = 4;
  camera.intrinsics[0] = camera.intrinsics[1] = 520;
  camera.mounting = {{1.0, 0, 0.4}, {0, 0.38, 0}};
  return SUITE_RUNS;
}
