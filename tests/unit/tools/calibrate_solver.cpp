// SPDX-License-Identifier: Apache-2.0
// The solver of `waymark calibrate camera` on corners of known cameras: the lens functions are the renderer's, errors
// are as large as their sigmas, pairs and mountings are found.
#include <optional>

#include "calibrate/bundle.h"
#include "calibrate/fit.h"
#include "calibrate/lens.h"
#include "calibrate/rig.h"
#include "common/failure.h"
#include "common/suite.h"
#include "common/trials.h"
#include "made.h"
#include "waymark/random.h"

using namespace wm::calibrate;
using wm::images::Camera;
using wm::images::Pose;

namespace {

int trials = 40;

constexpr int kColumns = 9, kRows = 6;
constexpr double kSquare_m = 0.04, kNoise_px = 0.2;

Camera camera_of(Model model) {
  Camera out{.model = model, .width = 800, .height = 600, .intrinsics = {}, .distortion = {}};
  switch (model) {
    case Model::equidistant:
      out.intrinsics = {320, 322, 404, 296}, out.distortion = {0.02, -0.006, 0.002, -0.0004};
      break;
    case Model::pinhole_radtan:
      out.intrinsics = {620, 623, 409, 291}, out.distortion = {-0.28, 0.09, 0.0006, -0.0008, -0.01};
      break;
    case Model::omni: out.intrinsics = {1.2, 700, 702, 404, 296}, out.distortion = {-0.1, 0.02, 0.0005, 0.0003}; break;
    case Model::double_sphere: out.intrinsics = {-0.2, 0.6, 330, 331, 404, 296}; break;
  }
  return out;
}

template <Model model>
void lens_agrees() {
  const Camera camera = camera_of(model);
  const Eigen::VectorXd v = parameters(camera);
  TEST_ASSERT_EQUAL(lens_parameters(model), v.size());
  int shown = 0;
  for (double y = 20; y < 600; y += 40)
    for (double x = 20; x < 800; x += 40) {
      Vec3 d(0, 0, 1);
      if (!wm::images::unproject(camera, {x, y}, d)) continue;
      const Vec3 p = 2.5 * d;
      double pixel[2];
      lens_pixel<model>(v.data(), p.data(), pixel);
      TEST_ASSERT_DOUBLE_WITHIN(1e-6, x, pixel[0]);
      TEST_ASSERT_DOUBLE_WITHIN(1e-6, y, pixel[1]);
      shown++;
    }
  TEST_ASSERT_GREATER_THAN(200, shown);
}

TEST(test_lens_functions_are_those_of_the_renderer) {
  lens_agrees<Model::equidistant>();
  lens_agrees<Model::pinhole_radtan>();
  lens_agrees<Model::omni>();
  lens_agrees<Model::double_sphere>();
}

// Corners that the camera sees, with noise; the lattice begins anywhere, as a search for saddles has it.
View view_of(const Camera &camera, const Pose &T_camera_board, int name, wm_random &noise, bool moved_origin = false) {
  View out{.name = std::to_string(name), .corners = {}};
  for (int row = 0; row < kRows; row++)
    for (int column = 0; column < kColumns; column++) {
      Vec2 pixel(0, 0);
      const Vec3 p = T_camera_board * Vec3((column - 4) * kSquare_m, (row - 2.5) * kSquare_m, 0);
      if (!wm::images::project(camera, p, pixel) || pixel.x() < 0 || pixel.y() < 0 || pixel.x() > 799 ||
          pixel.y() > 599)
        continue;
      const double u = kNoise_px * wm_random_next_normal(&noise), v = kNoise_px * wm_random_next_normal(&noise);
      const Vec2 place = moved_origin ? Vec2(4 - row, column - 3) : Vec2(column, row);
      out.corners.push_back({pixel + Vec2(u, v), place});
    }
  return out;
}

// A board `away` before the camera in a direction, tilted.
Pose board_at(double away, double right, double down, double tilt_x, double tilt_y, double turn) {
  Pose out = Pose::Identity();
  out.linear() =
      (Eigen::AngleAxisd(down * -1, Vec3::UnitX()) * Eigen::AngleAxisd(right, Vec3::UnitY())).toRotationMatrix();
  out.translation() = out.linear() * Vec3(0, 0, away);
  out.linear() = out.linear() * (Eigen::AngleAxisd(tilt_x, Vec3::UnitX()) * Eigen::AngleAxisd(tilt_y, Vec3::UnitY()) *
                                 Eigen::AngleAxisd(turn, Vec3::UnitZ()))
                                    .toRotationMatrix();
  return out;
}

std::vector<Pose> places(double spread) {
  std::vector<Pose> out;
  for (int i = 0; i < 16; i++)
    out.push_back(board_at(0.45 + 0.05 * (i % 3), spread * (i % 4 - 1.5) / 1.5, spread * (i / 4 - 1.5) / 2,
                           i % 2 ? 0.5 : -0.45, i % 3 ? 0.4 : -0.5, 0.2 * (i % 5 - 2)));
  return out;
}

// Errors over sigmas of all parameters and many trials, root mean square.
double errors_over_sigmas(Model model) {
  const Camera truth = camera_of(model);
  const Eigen::VectorXd at = parameters(truth);
  double squares = 0, n = 0;
  for (int trial = 0; trial < trials; trial++) {
    wm_random noise{7, static_cast<uint64_t>(trial), 0};
    std::vector<View> views;
    for (const Pose &place : places(model == Model::pinhole_radtan ? 0.35 : 0.6))
      views.push_back(view_of(truth, place, static_cast<int>(views.size()), noise));
    std::optional<Calibration> found = calibrate_camera(views, 800, 600);
    TEST_ASSERT_TRUE(found.has_value());
    if (model != Model::equidistant) found = with_model(*found, model);
    TEST_ASSERT_TRUE(found.has_value());
    TEST_ASSERT_TRUE(found->determined);
    if (model == Model::double_sphere) {  // two shapes fit alike: the pixels of rays are judged
      for (double y = 100; y < 600; y += 100)
        for (double x = 100; x < 800; x += 100) {
          Vec3 d(0, 0, 1);
          Vec2 there(0, 0);
          TEST_ASSERT_TRUE(wm::images::unproject(truth, {x, y}, d) && wm::images::project(found->camera, d, there));
          squares += std::pow((there - Vec2(x, y)).norm() / pixel_sigma(*found, {x, y}), 2);
          n++;
        }
      continue;
    }
    const Eigen::VectorXd off = parameters(found->camera) - at;
    squares += off.dot(found->covariance.ldlt().solve(off));
    n += static_cast<double>(at.size());
  }
  std::printf("%s: errors %.3f sigmas over %d trials\n", wm::images::model_name(model), std::sqrt(squares / n), trials);
  return std::sqrt(squares / n);
}

TEST(test_errors_are_as_large_as_their_sigmas) {
  // The pixels of the double sphere's trials depend on each other: less than 40 are no statistic.
  const bool all = trials >= 40;
  for (const Model model : {Model::equidistant, Model::pinhole_radtan, Model::double_sphere}) {
    if (model == Model::double_sphere && !all) continue;
    const double ratio = errors_over_sigmas(model);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.8, ratio);
    TEST_ASSERT_LESS_THAN_DOUBLE(1.25, ratio);
  }
}

const BoardShape kShape{kColumns, kRows, kSquare_m, false, false, Vec2::Zero()};

std::vector<size_t> all_shots(const Calibration &c) {
  std::vector<size_t> out;
  for (const View &view : c.views) out.push_back(std::stoul(view.name));
  return out;
}

TEST(test_a_pair_and_its_mounting) {
  const Camera left = camera_of(Model::equidistant), right = camera_of(Model::pinhole_radtan);
  Pose T_left_right = Pose::Identity();
  T_left_right.linear() = Eigen::AngleAxisd(0.05, Vec3(0.3, 1, 0.2).normalized()).toRotationMatrix();
  T_left_right.translation() = Vec3(0.12, 0.004, -0.01);
  wm_random noise{3, 1, 0};
  std::vector<View> first, second;
  for (const Pose &place : places(0.3)) {
    first.push_back(view_of(left, place, static_cast<int>(first.size()), noise));
    second.push_back(view_of(right, T_left_right.inverse() * place, static_cast<int>(second.size()), noise, true));
  }
  // The board on the floor: its middle 0.9 m ahead of the rear axle, the camera 0.5 m above the floor, looking down.
  const Pose T_base_left = wm::images::pose_xyz_rpy({0.4, 0.05, 0.5}, 0.02, 0.7, -0.03) * wm::images::T_body_optical();
  const FloorBoard floor{"16", 0.9, 0.1, 1.6};
  const Pose T_base_board = wm::images::pose_xyz_rpy({0.9, 0.1, 0}, wm::images::kPi, 0, 1.6);
  first.push_back(view_of(left, T_base_left.inverse() * T_base_board, 16, noise));
  const auto a = calibrate_camera(first, 800, 600);
  const auto plain = calibrate_camera(second, 800, 600);
  TEST_ASSERT_TRUE(a.has_value() && plain.has_value());
  const auto b = with_model(*plain, Model::pinhole_radtan);
  TEST_ASSERT_TRUE(b.has_value());
  const Rig rig = solve_rig({*a, *b}, {all_shots(*a), all_shots(*b)}, kShape, {floor});
  const Pose off = T_left_right.inverse() * rig.T_first_second;
  std::printf("pair off by %.5f m (sigma %.5f), %.5f rad (%.5f) by %zu pictures\n", off.translation().norm(),
              rig.pair_sigma_m, Eigen::AngleAxisd(off.linear()).angle(), rig.pair_sigma_rad, rig.shared);
  TEST_ASSERT_GREATER_OR_EQUAL(8, rig.shared);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.001, rig.pair_sigma_m);
  TEST_ASSERT_LESS_THAN_DOUBLE(5 * rig.pair_sigma_m, off.translation().norm());
  TEST_ASSERT_LESS_THAN_DOUBLE(5 * rig.pair_sigma_rad, Eigen::AngleAxisd(off.linear()).angle());
  TEST_ASSERT_TRUE(rig.T_base_first.has_value());
  const Pose base = T_base_left.inverse() * *rig.T_base_first;
  std::printf("mounting off by %.4f m (sigma %.4f), %.4f rad (%.4f)\n", base.translation().norm(), rig.base_sigma_m,
              Eigen::AngleAxisd(base.linear()).angle(), rig.base_sigma_rad);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.01, base.translation().norm());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.01, Eigen::AngleAxisd(base.linear()).angle());
  TEST_ASSERT_GREATER_THAN_DOUBLE(kFloor_m, rig.base_sigma_m);
}

TEST(test_what_a_pair_lacks_is_said) {
  const Camera camera = camera_of(Model::equidistant);
  wm_random noise{5, 1, 0};
  std::vector<View> views;
  for (const Pose &place : places(0.3)) views.push_back(view_of(camera, place, static_cast<int>(views.size()), noise));
  const auto c = calibrate_camera(views, 800, 600);
  TEST_ASSERT_TRUE(c.has_value());
  std::vector<size_t> others = all_shots(*c);
  for (size_t &shot : others) shot += 100;
  const auto refused = [&](const char *text, const std::vector<std::vector<size_t>> &shots,
                           const std::vector<FloorBoard> &floor) {
    made::refused(text, [&] {
      (void)solve_rig(shots.size() > 1 ? std::vector<Calibration>{*c, *c} : std::vector<Calibration>{*c}, shots, kShape,
                      floor);
    });
  };
  refused("seen by both cameras at once in 0 pictures", {all_shots(*c), others}, {});
  refused("no whole board was found in a picture of this name", {all_shots(*c)}, {{"nowhere.jpg", 1, 0, 0}});
}

}  // namespace

// calibrate_solver [TRIALS]
int suite_begin(int argc, char **argv) {
  if (argc > 1) trials = std::atoi(argv[1]);
  trials = static_cast<int>(wm_trials(static_cast<uint64_t>(trials), 10));
  return SUITE_RUNS;
}
