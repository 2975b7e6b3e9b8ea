// SPDX-License-Identifier: Apache-2.0
// What a scenario says of its pictures, measured back from them: noise against light, the length of blur against speed
// and exposure, the skew of a rolling shutter; and from a video's CSV and labels the camera's clock and what is lost.
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "filmed.h"
#include "render/sensor.h"
#include "simulate/motion.h"

using namespace wm::images;
using namespace wm::render;

namespace {

// y = offset + slope x, by weighted least squares.
struct Line {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  void add(double at, double value, double weight = 1) {
    n += weight, x += weight * at, y += weight * value;
    xx += weight * at * at, xy += weight * at * value;
  }
  double slope() const { return (n * xy - x * y) / (n * xx - x * x); }
  double offset() const { return (y - slope() * x) / n; }
};

constexpr double kFocal = 400, kAway = 2;  // pixels, metres

Camera pinhole(int width, int height) {
  Camera c;
  c.model = Model::pinhole_radtan;
  c.width = width, c.height = height;
  c.intrinsics = {kFocal, kFocal, (width - 1) / 2.0, (height - 1) / 2.0};
  return c;
}

uint32_t glowing(Scene &scene, double light) {
  Material m;
  m.albedo = Colour(0.0f), m.emission = Colour(static_cast<float>(light));
  return scene.add(m);
}

void commit(Scene &scene) {
  std::string error;
  scene.sky = {Colour(0.0f), Colour(0.0f), Colour(0.0f)};
  TEST_ASSERT_TRUE_MESSAGE(scene.commit(error), error.c_str());
}

std::unique_ptr<Renderer> renderer_of(const Scene &scene, const Camera &camera, const Quality &quality) {
  std::string error;
  auto out = Renderer::make(scene, camera, quality, 5, false, error);
  TEST_ASSERT_NOT_NULL_MESSAGE(out.get(), error.c_str());
  return out;
}

// A wedge of strips of known light through the whole camera, response curve and rounding with it.
TEST(test_noise_grows_with_the_light_as_said) {
  const double levels[] = {0.01, 0.02, 0.05, 0.1, 0.2, 0.4};
  constexpr int kStrip = 40, kHeight = 150;
  Scene scene;
  const double metre = kAway / kFocal;  // a pixel's width on the wall
  for (int i = 0; i < 6; i++) {
    const double left = (3 - i) * kStrip * metre;
    scene.add(quad({kAway, left, -1}, {0, -kStrip * metre, 0}, {0, 0, 2}, glowing(scene, levels[i])));
  }
  commit(scene);
  auto renderer = renderer_of(scene, pinhole(6 * kStrip, kHeight), {.samples = 2});
  for (const double gain : {1.0, 2.0}) {
    SensorModel model;
    model.vignetting = 0, model.shot = 5e-5, model.read = 8e-4;
    const Sensor sensor(model, 3, 6 * kStrip, kHeight, {0, 0});
    double sum[6] = {}, squares[6] = {}, n = 0;
    for (uint64_t frame = 0; frame < 8; frame++) {
      Shot shot;
      shot.frame = frame;
      shot.T_map_base = [](double) { return Pose::Identity(); };
      Image image;
      Picture8 picture;
      renderer->render(shot, image);
      sensor.develop(image, {.gain = gain}, frame, picture);
      for (size_t y = 0; y < kHeight; y++)
        for (size_t x = 5; x < kStrip - 5; x++, n += 1)
          for (size_t i = 0; i < 6; i++) {
            const double grey = picture.bytes[(y * 6 + i) * kStrip + x];
            sum[i] += grey, squares[i] += grey * grey;
          }
    }
    Line variance;  // of the signal, against the signal
    for (int i = 0; i < 6; i++) {
      const double signal = gain * levels[i], mean = sum[i] / n;
      const double slope = 255 * (response(model, signal * 1.001) - response(model, signal * 0.999)) / (0.002 * signal);
      const double found = (squares[i] / n - mean * mean - 1.0 / 12) / (slope * slope);
      TEST_ASSERT_DOUBLE_WITHIN(0.3, 255 * response(model, signal), mean);
      variance.add(signal, found, 1 / (found * found));
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 1, variance.slope() / (model.shot * gain));
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 1, std::sqrt(variance.offset()) / (model.read * gain));
  }
}

// The robot passes an edge, kAway aside: what lies ahead is bright, what lies behind is dark. The edge leans a little:
// over the rows it is at all places in a pixel, so that what pixels do to its width is the same always.
constexpr double kLean = 0.05;
struct Passing {
  Scene scene;
  Passing() {
    scene.add(quad({3 * kLean, kAway, -3}, {5, 0, 0}, {-6 * kLean, 0, 6}, glowing(scene, 1)));
    commit(scene);
  }
  Image look(const Camera &camera, const Quality &quality, double speed_mps, double turn_radps, double exposure_s) {
    Shot shot;
    shot.exposure_ns = std::llround(exposure_s * 1e9);
    shot.T_map_base = [=](double t_ns) {
      return pose_xyz_rpy({speed_mps * t_ns * 1e-9, 0, 0}, 0, 0, kPi / 2 + turn_radps * t_ns * 1e-9);
    };
    Image out;
    renderer_of(scene, camera, quality)->render(shot, out);
    return out;
  }
};

// Where a row's edge is, and the variance of the light's step about it.
struct Edge {
  double at = 0, variance = 0;
};
Edge edge_of(const std::vector<double> &row) {
  double weight = 0, sum = 0, squares = 0;
  for (size_t x = 1; x < row.size(); x++) {
    const double step = row[x] - row[x - 1], at = static_cast<double>(x) - 0.5;
    weight += step, sum += step * at, squares += step * at * at;
  }
  return {sum / weight, squares / weight - sum / weight * sum / weight};
}
std::vector<double> row_of(const Image &image, int y) {
  const auto begin = image.values.begin() + static_cast<std::ptrdiff_t>(y) * image.width;
  return {begin, begin + image.width};
}

TEST(test_blur_is_as_long_as_speed_times_exposure) {
  Passing passing;
  const Camera camera = pinhole(61, 100);  // leans five whole pixels
  const auto variance_at = [&](double speed_mps, double exposure_s) {
    const Image image = passing.look(camera, {.samples = 32}, speed_mps, 0, exposure_s);
    double sum = 0;
    for (int y = 0; y < image.height; y++) sum += edge_of(row_of(image, y)).variance;
    return sum / image.height;
  };
  const double still = variance_at(0, 0.01);  // the lens and the pixel
  Line length;
  for (const double speed_mps : {0.5, 1.0, 2.0}) {
    for (const double exposure_s : {0.005, 0.01, 0.04}) {
      const double expected_px = kFocal / kAway * speed_mps * exposure_s;
      // A light that moves steadily leaves a bar, whose variance is a twelfth of its length's square.
      const double found_px = std::sqrt(12 * std::max(0.0, variance_at(speed_mps, exposure_s) - still));
      if (expected_px >= 1) TEST_ASSERT_DOUBLE_WITHIN(0.05 * expected_px, expected_px, found_px);
      if (expected_px >= 1) length.add(speed_mps * exposure_s, found_px);
    }
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.02 * kFocal / kAway, kFocal / kAway, length.slope());
}

TEST(test_rolling_shutter_leans_by_readout_and_motion) {
  Passing passing;
  Camera camera = pinhole(121, 121);
  for (const double readout_s : {0.0, 0.01, 0.03}) {
    camera.readout_ns = std::llround(readout_s * 1e9);
    for (const bool turns : {false, true}) {
      const double speed_mps = turns ? 0 : 1.5, turn_radps = turns ? 0.8 : 0;
      const Image image = passing.look(camera, {.samples = 32}, speed_mps, turn_radps, 0.004);
      Line lean;  // of the edge's column against the row, from the middle
      for (int y = 0; y < image.height; y++) lean.add(y - 60, edge_of(row_of(image, y)).at);
      // What is passed forwards moves back, which is to the left of a camera that looks to the left side; turning to
      // the left moves it to the right.
      const double moved_px = turns ? kFocal * turn_radps * readout_s : -kFocal / kAway * speed_mps * readout_s;
      TEST_ASSERT_DOUBLE_WITHIN(0.08, moved_px, (lean.slope() - kLean) * 120);
      TEST_ASSERT_DOUBLE_WITHIN(0.03, 60, lean.offset());  // the stamp is the middle row's
    }
  }
}

// The numbers of a CSV file below its header.
std::vector<std::vector<double>> rows_of(const std::string &path) {
  std::vector<std::vector<double>> out;
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<double> row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
    out.push_back(row);
  }
  return out;
}

// When the picture was taken, that has these labels: from where its stamp says it was, to where it fits the truth.
double taken_s(const wm::sim::Film &film, size_t camera, const std::vector<std::vector<double>> &labels, double t_s) {
  const Camera &c = film.cameras[camera].truth;
  const auto error = [&](const std::vector<double> &label, double at_s) {
    Vec2 pixel(0, 0);
    for (const wm_landmark &l : film.recording.landmarks)
      if (l.id == static_cast<int>(label[2]))
        project(c, T_base_optical(c).inverse() * (wm::sim::true_pose(film.recording, at_s).inverse() * Vec3(l.p_m)),
                pixel);
    return Vec2(Vec2(label[3], label[4]) - pixel);
  };
  for (int pass = 0; pass < 3; pass++) {
    double across = 0, along = 0;
    for (const auto &label : labels) {
      const Vec2 off = error(label, t_s), moves = (error(label, t_s + 1e-4) - off) / -1e-4;
      across += moves.squaredNorm(), along += moves.dot(off);
    }
    t_s += along / across;
  }
  return t_s;
}

TEST(test_clock_and_losses_are_in_the_video) {
  wm::sim::Scenario scenario = wm::sim::shipped("seabed-easy");
  scenario.duration_s = 40;
  scenario.pictures.samples = 1;
  scenario.errors.camera_mounting_rad = scenario.errors.camera_mounting_m = scenario.errors.camera_intrinsics = 0;
  scenario.faults.frames_lost = 0.1;
  scenario.faults.camera_clock_drift = 4e-4;
  for (const char *name : {"left", "right"}) {
    wm::sim::PixelCamera camera;
    camera.name = name, camera.width = 64, camera.height = 48, camera.rate_hz = 10;
    scenario.pixel_cameras.push_back(camera);
  }
  const wm::sim::Film film = wm::sim::filmed(scenario, 6);
  wm_error err{};
  const std::string dir = "render_statistics." + std::to_string(getpid());
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm::sim::write_pictures(film, dir, nullptr, &err), err.text);

  Line clock;
  double squares = 0, frames = 0, lost = 0;
  for (size_t camera = 0; camera < 2; camera++) {
    std::map<size_t, std::vector<std::vector<double>>> seen;
    for (const auto &label : rows_of(dir + "/" + wm::sim::label_file(film.world->labels[0])))
      if (static_cast<size_t>(label[1]) == camera) seen[static_cast<size_t>(label[0])].push_back(label);
    const auto stamps = rows_of(dir + "/video/" + film.cameras[camera].name + ".csv");
    lost += 400 - static_cast<double>(stamps.size());
    for (const auto &[frame, labels] : seen) {
      if (labels.size() < 2) continue;
      const double stamp_s = (stamps.at(frame)[1] - static_cast<double>(film.recording.clock_start_ns)) * 1e-9;
      const double at_s = taken_s(film, camera, labels, stamp_s), ahead_s = stamp_s - at_s;
      clock.add(at_s, ahead_s);
      const double jitter_s = ahead_s - 0.010 - 4e-4 * at_s;
      squares += jitter_s * jitter_s, frames++;
    }
  }
  std::filesystem::remove_all(dir);
  TEST_ASSERT_GREATER_THAN_DOUBLE(300, frames);
  TEST_ASSERT_DOUBLE_WITHIN(4 * std::sqrt(0.1 * 0.9 / 800), 0.1, lost / 800);
  // A pair is triggered together: both videos have the same jitter, so half as many draws.
  TEST_ASSERT_DOUBLE_WITHIN(3 / std::sqrt(frames), 1, std::sqrt(squares / frames) / 0.002);
  TEST_ASSERT_DOUBLE_WITHIN(5e-5, 4e-4, clock.slope());
  TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.010, clock.offset());
}

}  // namespace
