// SPDX-License-Identifier: Apache-2.0
// The reference trajectory on a made drive: a room whose walls are known, odometry that turns and slips; smoothed, it
// must lie on the way that was driven, also from a start that is off.
#include "common/suite.h"
#include "reference/smoother.h"

using namespace wm::tools;

namespace {

constexpr int kSide = 400;
constexpr double kCell_m = 0.025;  // 10 x 10 m, origin at its lower left

// A room with two pillars, so that no two places look alike.
struct Room {
  std::vector<uint8_t> edges = std::vector<uint8_t>(kSide * kSide, 0);
  wm_raster raster{};
  Room() {
    for (int i = 40; i <= 360; i++) set(i, 40), set(i, 360), set(40, i), set(360, i);
    for (int i = 0; i <= 20; i++)
      set(120 + i, 120), set(120 + i, 140), set(120, 120 + i), set(140, 120 + i), set(250 + i, 200), set(250, 200 + i);
    raster.width_px = raster.height_px = kSide;
    raster.resolution_m = kCell_m;
    raster.edges = edges.data();
  }
  void set(int x, int y) { edges[static_cast<size_t>(y) * kSide + static_cast<size_t>(x)] = 255; }
};

TEST(test_field_is_the_distance) {
  const Room room;
  const EdgeField field(room.raster, 0.5);
  const double wall = (40 + 0.5) * kCell_m;
  for (double d = 0; d < 0.45; d += 0.03) TEST_ASSERT_DOUBLE_WITHIN(0.01, d, field.distance_m(wall + d, 2));
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.5, field.distance_m(5, 3));
  TEST_ASSERT_EQUAL_DOUBLE(0.5, field.distance_m(-100, 1e9));
  TEST_ASSERT_EQUAL_DOUBLE(0.5, field.distance_m(std::nan(""), 0));
}

// Truth: a circle of 2 m. Points: edge pixels within 3 m, as the robot sees them.
TEST(test_smoothed_lies_on_the_way) {
  const Room room;
  const EdgeField field(room.raster, 0.5);
  std::vector<SmootherStep> steps;
  std::vector<Eigen::Vector3d> truth;
  Eigen::Vector3d odom(0, 0, 0);
  for (int k = 0; k < 150; k++) {
    const double a = 0.04 * k;
    truth.emplace_back(5 + 2 * std::cos(a), 5 + 2 * std::sin(a), a + 3.14159265358979323846 / 2);
    SmootherStep step{k * 100000000LL, odom, {}};
    const Eigen::Vector3d &p = truth.back();
    const double c = std::cos(p.z()), s = std::sin(p.z());
    int n = 0;
    for (int y = 0; y < kSide; y++)
      for (int x = 0; x < kSide; x++) {
        if (room.edges[static_cast<size_t>(y) * kSide + static_cast<size_t>(x)] == 0 || n++ % 9 != 0) continue;
        const double dx = (x + 0.5) * kCell_m - p.x(), dy = (kSide - 0.5 - y) * kCell_m - p.y();
        if (dx * dx + dy * dy < 9) step.points.emplace_back(c * dx + s * dy, c * dy - s * dx);
      }
    steps.push_back(step);
    const double way = 2 * 0.04 * 1.03, turn = 0.04 * 1.05;  // wheels too small, a gyro that is off
    odom += Eigen::Vector3d(way * std::cos(odom.z()), way * std::sin(odom.z()), turn);
  }
  SmootherOptions options;
  options.particles = 200;
  int told = 0;
  const Reference reference =
      smooth(steps, field, truth[0] + Eigen::Vector3d(0.06, -0.05, 0.04), options, [&](int, double) { told++; });
  double sum = 0;
  for (size_t k = 0; k < truth.size(); k++)
    sum += (reference.poses[k] - truth[k]).head<2>().norm() / static_cast<double>(truth.size());
  std::printf("mean %.4f m in %d passes, explained %.3f\n", sum, reference.passes, reference.explained);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.04, sum);  // wheels and gyro are off by 3 and 5 %, and 200 particles are few
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.98, reference.explained);
  TEST_ASSERT_EQUAL(told, reference.passes);
  // The same again gives the same bits; another seed others.
  const Reference again = smooth(steps, field, truth[0] + Eigen::Vector3d(0.06, -0.05, 0.04), options, {});
  TEST_ASSERT_EQUAL_MEMORY(reference.poses.data(), again.poses.data(), truth.size() * sizeof(Eigen::Vector3d));
  options.seed = 2;
  TEST_ASSERT_TRUE(smooth(steps, field, truth[0], options, {}).poses[9] != reference.poses[9]);
}

TEST(test_nothing_to_smooth) {
  const Room room;
  const EdgeField field(room.raster, 0.5);
  TEST_ASSERT_EQUAL(0, smooth({}, field, Eigen::Vector3d::Zero(), {}, {}).poses.size());
}

}  // namespace
