// SPDX-License-Identifier: Apache-2.0
// Where things are in rendered pictures against where the calibration and the true pose say they are: bright squares by
// their centroids, long edges by the place where the brightness steps, for every camera model, standing, in motion with
// exposure, and with rolling shutter.
#include <algorithm>
#include <vector>

#include "common/suite.h"
#include "render/render.h"
#include "render_cameras.h"

using namespace wm::images;
using namespace wm::render;

namespace {

struct Square {
  Vec3 corner, u, v;
};

// Squares all around the camera at 2 to 4 m, and turned off its line of sight.
std::vector<Square> squares_around(const NamedCamera &named, const Vec3 &centre) {
  std::vector<Square> out;
  const Pose T = pose_xyz_rpy({0, 0, 0}, 0, 0, 0) * T_base_optical(named.camera);
  int i = 0;
  for (double angle = 0.15; angle < named.half_angle_rad - 0.1; angle += 0.3) {
    for (double around = 0.4 * i; around < 0.4 * i + 6.2; around += 1.3, i++) {
      const Vec3 d =
          T.linear() * Vec3(std::sin(angle) * std::cos(around), std::sin(angle) * std::sin(around), std::cos(angle));
      const Vec3 side = (d + 0.3 * Vec3(std::cos(i), std::sin(2 * i), std::cos(3 * i))).unitOrthogonal();
      const Vec3 up = (d + Vec3(0.2, 0.1 * (i % 3), 0)).cross(side).normalized();
      const double far = 2 + 0.4 * (i % 6), size = 0.05 * far;
      out.push_back({centre + d * far - size / 2 * (side + up), side * size, up * size});
    }
  }
  return out;
}

// Row by row: where the robot is when the row is in the middle of its exposure. Written apart from project_shot.
bool see(const Camera &camera, const Shot &shot, const Vec3 &point, Vec2 &pixel) {
  double row = (camera.height - 1) / 2.0;
  for (int i = 0; i < 60; i++) {
    const double t =
        static_cast<double>(shot.t_ns) + (row / (camera.height - 1) - 0.5) * static_cast<double>(camera.readout_ns);
    const Pose T = shot.T_map_base(t) * camera.T_base_camera;
    const Vec3 body = T.inverse() * point;
    if (!project(camera, Vec3(-body.y(), -body.z(), body.x()), pixel)) return false;
    row = pixel.y();
  }
  return true;
}

// Centre of gravity of a square's picture: small cells weighted by their area in the picture.
bool centroid_true(const Camera &camera, const Shot &shot, const Square &square, Vec2 &centre, double &reach) {
  constexpr int n = 6;
  Vec2 grid[n + 1][n + 1];
  for (int i = 0; i <= n; i++)
    for (int j = 0; j <= n; j++)
      if (!see(camera, shot, square.corner + square.u * i / n + square.v * j / n, grid[i][j])) return false;
  double area = 0;
  Vec2 sum(0, 0);
  for (int i = 0; i < n; i++) {
    for (int j = 0; j < n; j++) {
      const Vec2 p = grid[i + 1][j + 1] - grid[i][j], q = grid[i][j + 1] - grid[i + 1][j];
      const double a = std::fabs(p.x() * q.y() - p.y() * q.x()) / 2;
      area += a;
      sum += a * (grid[i][j] + grid[i + 1][j] + grid[i][j + 1] + grid[i + 1][j + 1]) / 4;
    }
  }
  centre = sum / area, reach = 0;
  for (auto &row : grid)
    for (const Vec2 &p : row) reach = std::max(reach, (p - centre).norm());
  return centre.x() - reach > 8 && centre.y() - reach > 8 && centre.x() + reach < camera.width - 8 &&
         centre.y() + reach < camera.height - 8;
}

Vec2 centroid_found(const Image &image, const Vec2 &near, double reach) {
  double weight = 0;
  Vec2 sum(0, 0);
  const int r = static_cast<int>(reach) + 5, cx = static_cast<int>(near.x()), cy = static_cast<int>(near.y());
  for (int y = std::max(cy - r, 0); y <= std::min(cy + r, image.height - 1); y++) {
    for (int x = std::max(cx - r, 0); x <= std::min(cx + r, image.width - 1); x++) {
      const auto w = static_cast<double>(image.values[static_cast<size_t>(y * image.width + x)]);
      weight += w, sum += w * Vec2(x, y);
    }
  }
  return sum / weight;
}

// Squares are bright, all else is black: no neighbour may disturb a centroid, so each is rendered where others are far.
double worst_square(const NamedCamera &named, const Shot &shot, int samples, int &count) {
  Scene scene;
  Material bright;
  bright.albedo = Colour(0.0f), bright.emission = Colour(1.0f);
  const uint32_t lamp = scene.add(bright);
  scene.sky = {Colour(0.0f), Colour(0.0f), Colour(0.0f)};
  const Vec3 centre = camera_centre(named.camera, shot, (named.camera.height - 1) / 2.0);
  const std::vector<Square> squares = squares_around(named, centre);
  for (const Square &s : squares) scene.add(quad(s.corner, s.u, s.v, lamp));
  std::string error;
  TEST_ASSERT_TRUE_MESSAGE(scene.commit(error), error.c_str());
  Quality quality;
  quality.samples = samples;
  auto renderer = Renderer::make(scene, named.camera, quality, 7, false, error);
  TEST_ASSERT_NOT_NULL_MESSAGE(renderer.get(), error.c_str());
  Image image;
  renderer->render(shot, image);
  double worst = 0;
  std::vector<Vec2> places;
  for (const Square &square : squares) {
    Vec2 expected, other;
    double reach;
    if (!centroid_true(named.camera, shot, square, expected, reach)) continue;
    const bool crowded = std::any_of(squares.begin(), squares.end(), [&](const Square &s) {
      return &s != &square && see(named.camera, shot, s.corner, other) && (other - expected).norm() < 2 * reach + 25;
    });
    if (crowded) continue;
    const double off = (centroid_found(image, expected, reach) - expected).norm();
    worst = std::max(worst, off);
    count++;
  }
  std::printf("%-20s %2d squares, worst %.3f px\n", named.name, count, worst);
  return worst;
}

Shot standing() {
  Shot shot;
  shot.T_map_base = [](double) { return pose_xyz_rpy({1, 2, 0.1}, 0, 0, 0.0); };
  return shot;
}

// Two metres a second along a curve of one radian a second, nodding a little.
Shot moving(int64_t exposure_ns) {
  Shot shot;
  shot.t_ns = 5000000000;
  shot.exposure_ns = exposure_ns;
  shot.T_map_base = [](double t_ns) {
    const double t = t_ns * 1e-9 - 5;
    return pose_xyz_rpy({1 + 2 * t, 2 + 0.3 * t, 0.1}, 0.2 * t, -0.3 * t, 1.0 * t);
  };
  return shot;
}

// Standing; in motion, at the middle of the exposure; with a rolling shutter.
TEST(test_squares) {
  const struct {
    Shot shot;
    int64_t readout_ns;
    double most_px;
  } rows[] = {{standing(), 0, 0.1}, {moving(10000000), 0, 0.15}, {moving(5000000), 25000000, 0.15}};
  for (const auto &row : rows)
    for (NamedCamera named : all_cameras()) {
      named.camera.readout_ns = row.readout_ns;
      int count = 0;
      TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(row.most_px, worst_square(named, row.shot, 16, count), named.name);
      TEST_ASSERT_GREATER_THAN_INT_MESSAGE(4, count, named.name);
    }
}

double bilinear(const Image &image, const Vec2 &p) {
  const int x = static_cast<int>(std::floor(p.x())), y = static_cast<int>(std::floor(p.y()));
  const double fx = p.x() - x, fy = p.y() - y;
  auto at = [&](int i, int j) {
    return static_cast<double>(image.values[static_cast<size_t>((y + j) * image.width + x + i)]);
  };
  return (at(0, 0) * (1 - fx) + at(1, 0) * fx) * (1 - fy) + (at(0, 1) * (1 - fx) + at(1, 1) * fx) * fy;
}

// The joint between a bright floor and a dark wall, as the edge system sees it.
TEST(test_edges_between_floor_and_wall) {
  for (NamedCamera named : all_cameras()) {
    for (int64_t readout_ns : {0, 20000000}) {
      named.camera.readout_ns = readout_ns;
      named.camera.T_base_camera = pose_xyz_rpy({0, 0, 0.6}, 0, 0.35, 0);
      const Shot shot = readout_ns ? moving(4000000) : standing();
      const Vec3 at = shot.T_map_base(static_cast<double>(shot.t_ns)).translation();
      Scene scene;
      Material bright, dark;
      bright.albedo = Colour(0.0f), bright.emission = Colour(0.8f);
      dark.albedo = Colour(0.0f), dark.emission = Colour(0.1f);
      const uint32_t floor = scene.add(bright), wall = scene.add(dark);
      const double z = at.z() - 0.4, side = at.y() + 1.6, front = at.x() + 3.5;
      scene.add(quad({at.x() - 5, at.y() - 5, z}, {front - at.x() + 5, 0, 0}, {0, side - at.y() + 5, 0}, floor));
      scene.add(walls({{front, at.y() - 5}, {front, side}, {at.x() - 5, side}}, false, z, z + 4, wall));
      std::string error;
      TEST_ASSERT_TRUE_MESSAGE(scene.commit(error), error.c_str());
      Quality quality;
      quality.samples = 16;
      auto renderer = Renderer::make(scene, named.camera, quality, 3, false, error);
      TEST_ASSERT_NOT_NULL_MESSAGE(renderer.get(), error.c_str());
      Image image;
      renderer->render(shot, image);
      double sum = 0, worst = 0, mean = 0;
      int n = 0;
      for (int i = 0; i < 80; i++) {
        const double s = 0.05 + 0.05 * (i % 40);
        const bool ahead = i < 40;
        const Vec3 p = ahead ? Vec3(front, side - 0.1 - 2 * s, z) : Vec3(front - 0.1 - 2 * s, side, z);
        const Vec3 q = p + (ahead ? Vec3(0, 0.01, 0) : Vec3(0.01, 0, 0));
        Vec2 a, b;
        if (!see(named.camera, shot, p, a) || !see(named.camera, shot, q, b)) continue;
        if (a.x() < 10 || a.y() < 10 || a.x() > named.camera.width - 11 || a.y() > named.camera.height - 11) continue;
        Vec2 along = (b - a).normalized(), normal(-along.y(), along.x());
        if (bilinear(image, a + 4 * normal) < bilinear(image, a - 4 * normal)) normal = -normal;
        double before = bilinear(image, a - 3 * normal), found = 99;
        for (double d = -3 + 0.125; d <= 3; d += 0.125) {
          const double now = bilinear(image, a + d * normal);
          if (before < 0.45 && now >= 0.45) found = d - 0.125 * (now - 0.45) / (now - before);
          before = now;
        }
        worst = std::max(worst, std::fabs(found)), sum += found * found, mean += found, n++;
      }
      std::printf("%-20s readout %2d ms: %2d places on edges, mean %+.3f, rms %.3f, worst %.3f px\n", named.name,
                  static_cast<int>(readout_ns / 1000000), n, mean / n, std::sqrt(sum / n), worst);
      TEST_ASSERT_GREATER_THAN_INT_MESSAGE(10, n, named.name);
      TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(0.3, worst, named.name);
      TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(0.1, std::sqrt(sum / n), named.name);
      TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(0.05, std::fabs(mean / n), named.name);
    }
  }
}

TEST(test_project_shot_is_the_same) {
  for (NamedCamera named : all_cameras()) {
    named.camera.readout_ns = 30000000;
    const Shot shot = moving(0);
    const Vec3 centre = camera_centre(named.camera, shot, 100);
    for (const Square &s : squares_around(named, centre)) {
      Vec2 a, b;
      if (!see(named.camera, shot, s.corner, a)) continue;
      TEST_ASSERT_TRUE(project_shot(named.camera, shot, s.corner, b));
      TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0, (a - b).norm());
    }
  }
}

}  // namespace
