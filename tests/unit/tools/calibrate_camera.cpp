// SPDX-License-Identifier: Apache-2.0
// `waymark calibrate camera` on rendered pictures of a board through lenses that are known: 200 degrees of fisheye,
// and a plain lens; boards that are half out of the picture; and pictures without a board.
#include <algorithm>
#include <memory>

#include "calibrate/bundle.h"
#include "calibrate/corners.h"
#include "calibrate/coverage.h"
#include "common/suite.h"
#include "render/patterns.h"
#include "render/render.h"

using namespace wm::calibrate;
using wm::images::Camera;
using wm::images::Model;
using wm::images::Pose;
using wm::images::Vec3;
using wm::tools::GreyPicture;

namespace {

constexpr double kSquare_m = 0.06;
constexpr int kColumns = 10, kRows = 7;  // squares, so 9 x 6 inner corners

// A board in the plane x = 0 of the map, its middle at the origin, facing towards -x, grey wall behind.
std::unique_ptr<wm::render::Scene> board_scene() {
  namespace r = wm::render;
  constexpr int kPixels = 64;
  r::Picture paint((kColumns + 2) * kPixels, (kRows + 2) * kPixels, 1, 0.85F);
  for (int j = 0; j < kRows; j++)
    for (int i = 0; i < kColumns; i++)
      if ((i + j) % 2 == 0)
        wm::images::fill_rect((i + 1) * kPixels, (j + 1) * kPixels, (i + 2) * kPixels, (j + 2) * kPixels,
                              r::Colour(0.04F), paint);
  auto scene = std::make_unique<r::Scene>();
  const double width = (kColumns + 2) * kSquare_m, height = (kRows + 2) * kSquare_m;
  r::Material board;
  board.albedo = r::Colour(1.0F);
  board.texture = r::Texture::make(paint, r::Wrap::clamp);
  board.texture_size_m = {width, height};
  const uint32_t material = scene->add(board);
  const uint32_t wall = scene->add(r::Material{.albedo = r::Colour(0.4F), .texture = nullptr});
  scene->add(r::picture({0, 0, 0}, {0, -1, 0}, {0, 0, 1}, width, height, material));
  scene->add(r::quad({2, -4, -4}, {0, 8, 0}, {0, 0, 8}, wall));
  scene->ambient.up = scene->ambient.down = r::Colour(0.6F);
  std::string error;
  TEST_ASSERT_TRUE_MESSAGE(scene->commit(error), error.c_str());
  return scene;
}

// The camera before the board, which it sees in the direction (azimuth, elevation) of its body frame, tilted.
Pose place(double distance, double azimuth, double elevation, double tilt_yaw, double tilt_pitch, double roll) {
  const Pose board_in_view = wm::images::pose_xyz_rpy({0, 0, 0}, 0, -elevation, azimuth) *
                             wm::images::pose_xyz_rpy({distance, 0, 0}, roll, tilt_pitch, tilt_yaw);
  return board_in_view.inverse();
}

GreyPicture shoot(const wm::render::Scene &scene, const Camera &camera, const Pose &T_map_camera, uint64_t frame) {
  wm::render::Quality quality;
  quality.samples = 4;
  quality.threads = 2;
  std::string error;
  const auto renderer = wm::render::Renderer::make(scene, camera, quality, 1, false, error);
  TEST_ASSERT_NOT_NULL_MESSAGE(renderer.get(), error.c_str());
  wm::render::Shot shot;
  shot.frame = frame;
  shot.T_map_base = [&](double) { return T_map_camera; };
  wm::render::Image image;
  renderer->render(shot, image);
  GreyPicture out{image.width, image.height, {}};
  for (size_t i = 0; i < image.values.size(); i++) {
    const int noise = static_cast<int>((i * 2654435761U + frame * 97) >> 7) % 5 - 2;
    out.pixels.push_back(static_cast<uint8_t>(std::clamp(static_cast<int>(image.values[i] * 330) + noise, 0, 255)));
  }
  return out;
}

std::vector<View> views_of(const Camera &camera, const std::vector<Pose> &places, int columns = 9, int rows = 6) {
  const auto scene = board_scene();
  std::vector<View> out;
  for (size_t i = 0; i < places.size(); i++) {
    const GreyPicture picture = shoot(*scene, camera, places[i], i);
    View view{std::to_string(i), find_chessboard(picture, columns, rows)};
    std::printf("view %zu: %zu corners\n", i, view.corners.size());
    if (view.corners.size() >= 12) out.push_back(std::move(view));
  }
  return out;
}

// Largest and mean distance of the two cameras' pixels for rays out to `widest`, after the best rotation between them
// (a calibration doesn't know the body's axes).
void differ(const Camera &truth, const Camera &found, double widest, double *mean_px, double *max_px) {
  *max_px = 0;
  double sum = 0;
  int n = 0;
  for (double angle = 0.05; angle < widest; angle += 0.1)
    for (double azimuth = 0; azimuth < 6.2; azimuth += 0.3) {
      const Vec3 d(std::sin(angle) * std::cos(azimuth), std::sin(angle) * std::sin(azimuth), std::cos(angle));
      Vec2 a(0, 0), b(0, 0);
      if (!wm::images::project(truth, d, a) || a.x() < 0 || a.y() < 0 || a.x() > truth.width - 1 ||
          a.y() > truth.height - 1)
        continue;
      TEST_ASSERT_TRUE(wm::images::project(found, d, b));
      sum += (a - b).norm();
      *max_px = std::max(*max_px, (a - b).norm());
      n++;
    }
  *mean_px = sum / std::max(1, n);
}

TEST(test_fisheye_of_200_degrees) {
  Camera camera;
  camera.width = 800, camera.height = 600;
  camera.intrinsics = {221, 222, 404, 296};
  camera.distortion = {0.02, -0.006, 0.002, -0.0004};
  std::vector<Pose> places;
  for (const double azimuth : {-1.45, -0.8, -0.3, 0.3, 0.8, 1.45})
    for (const double elevation : {-0.75, 0.0, 0.75}) {
      const double side = azimuth > 0 ? 1 : -1;
      places.push_back(place(0.42, azimuth, elevation, -0.35 * side, elevation > 0 ? -0.3 : 0.3, 0.1 * azimuth));
    }
  const std::vector<View> views = views_of(camera, places);
  TEST_ASSERT_GREATER_OR_EQUAL(15, views.size());
  const auto found = calibrate_camera(views, camera.width, camera.height);
  TEST_ASSERT_TRUE(found.has_value());
  double mean = 0, most = 0;
  differ(camera, found->camera, 1.6, &mean, &most);
  const Coverage coverage = coverage_of(*found);
  std::printf("rms %.3f px, off by %.3f px mean, %.3f max; widest %.2f rad, covered %.2f, sigma %.3f\n", found->rms_px,
              mean, most, coverage.widest_rad, coverage.covered, coverage.sigma_worst_px);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, found->rms_px);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.3, mean);
  TEST_ASSERT_LESS_THAN_DOUBLE(1.0, most);
  TEST_ASSERT_GREATER_THAN_DOUBLE(wm::images::kPi / 2, coverage.widest_rad);
  TEST_ASSERT_TRUE(complaints(*found, coverage).empty());
}

TEST(test_plain_lens) {
  Camera camera;
  camera.model = Model::pinhole_radtan;
  camera.width = 640, camera.height = 480;
  camera.intrinsics = {520, 523, 326, 236};
  camera.distortion = {-0.28, 0.09, 0.0006, -0.0008};
  std::vector<Pose> places;
  for (int i = 0; i < 12; i++)
    places.push_back(place(0.7 + 0.1 * (i % 3), 0.2 * (i % 4 - 1.5), 0.15 * (i / 4 - 1), i % 2 ? 0.55 : -0.5,
                           i % 3 ? 0.4 : -0.45, 0.3 * (i % 5 - 2)));
  const auto found = calibrate_camera(views_of(camera, places), camera.width, camera.height);
  TEST_ASSERT_TRUE(found.has_value());
  const auto plain = with_model(*found, Model::pinhole_radtan);
  TEST_ASSERT_TRUE(plain.has_value());
  double mean = 0, most = 0;
  differ(camera, plain->camera, 0.7, &mean, &most);
  std::printf("rms %.3f (equidistant %.3f) px, off by %.3f px mean, %.3f max\n", plain->rms_px, found->rms_px, mean,
              most);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, plain->rms_px);
  // Truth lies within what the calibration says of itself.
  const double sigma = std::sqrt(plain->covariance(0, 0));
  std::printf("fx %.2f +- %.2f\n", plain->camera.intrinsics[0], sigma);
  TEST_ASSERT_DOUBLE_WITHIN(std::max(4 * sigma, 1.0), 520, plain->camera.intrinsics[0]);
}

TEST(test_too_little_is_said) {
  Camera camera;
  camera.width = 640, camera.height = 480;
  camera.intrinsics = {300, 300, 320, 240};
  camera.distortion = {0, 0, 0, 0};
  const std::vector<View> views = views_of(camera, {place(0.7, 0, 0, 0.02, 0, 0), place(0.8, 0, 0, 0, 0.02, 0),
                                                    place(0.9, 0, 0, 0, 0, 0), place(0.75, 0, 0, 0.01, 0.01, 0)});
  const auto found = calibrate_camera(views, 640, 480);
  if (found) TEST_ASSERT_GREATER_OR_EQUAL(3, complaints(*found, coverage_of(*found)).size());
  TEST_ASSERT_FALSE(calibrate_camera({}, 640, 480).has_value());
}

TEST(test_no_board) {
  GreyPicture blank{640, 480, std::vector<uint8_t>(640UL * 480UL, 128)};
  TEST_ASSERT_EQUAL(0, grow_chessboard(blank, 0, 0).size());
  for (size_t i = 0; i < blank.pixels.size(); i++) blank.pixels[i] = static_cast<uint8_t>((i * 2654435761U) >> 9);
  TEST_ASSERT_EQUAL(0, grow_chessboard(blank, 0, 0).size());
  TEST_ASSERT_EQUAL(0, grow_chessboard({3, 2, std::vector<uint8_t>(6, 0)}, 0, 0).size());
  TEST_ASSERT_EQUAL(0, find_aprilgrid(blank, 6, 6, 0.088, 0.03).size());
}

}  // namespace
