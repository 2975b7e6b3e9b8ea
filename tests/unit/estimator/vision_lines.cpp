// SPDX-License-Identifier: Apache-2.0
// Upright lines in pictures of a hemispherical camera whose azimuths are known: found to a part of a pixel, with a
// sigma that keeps its word; followed through turns; and what pictures that no camera takes make of it.
#include <algorithm>
#include <map>
#include <memory>
#include <vector>

#include "common/eyes.hpp"
#include "vision/lines/line_tracks.hpp"
#include "vision/lines/votes.hpp"
#include "waymark/internal/sensors/lens.hpp"
#include "waymark/random.h"

namespace {

constexpr uint32_t kSide = 640;
constexpr double kDeg = M_PI / 180, kBlur_px = 0.9;
constexpr int32_t kCamera = 0;

wm_rig rig;
wm_view view;
std::unique_ptr<wm::drawn::eyes> lines;
std::vector<uint8_t> picture(kSide *kSide);

wm_camera up_camera(double yaw_deg) {
  wm_camera c{};
  std::strcpy(c.name, "omni");
  c.model = WM_CAMERA_EQUIDISTANT;
  c.width_px = c.height_px = kSide;
  const double intrinsics[] = {183.35, 183.35, 319.5, 319.5};
  c.intrinsics_count = 4;
  std::copy(intrinsics, intrinsics + 4, c.intrinsics);
  c.mounting = {{0, 0, 0.8}, {0, -90 * kDeg, yaw_deg * kDeg}};
  return c;
}

void start() { lines->begin(view); }

size_t look(wm_time_ns t_ns) {
  const wm_frame frame = wm::drawn::frame_of(picture, kSide, kSide, t_ns);
  return lines->look(&frame);
}

// A round wall of stripes: the brightness changes at each of these azimuths (rising), seen in the camera's true pose.
struct stripes {
  std::vector<double> azimuth, step;
  double at(double a, double sigma_rad) const {
    double grey = 110;
    for (size_t i = 0; i < azimuth.size(); i++) {
      const double off = wm::wrap(a - azimuth[i]);
      // A step here, taken back on the other side of the circle, where the next stripes hide it.
      const double sigmas = off / sigma_rad;
      const double up = sigmas > 5 ? 1 : sigmas < -5 ? 0 : 0.5 * std::erfc(-sigmas * M_SQRT1_2);
      grey += step[i] * (up - (off + M_PI) / (2 * M_PI));
    }
    return grey;
  }
};

stripes make_stripes(int count, uint64_t seed) {
  stripes out;
  for (int i = 0; i < count; i++) {
    out.azimuth.push_back(
        std::remainder((i + 0.35 * wm_random_uniform(seed, 1, static_cast<uint64_t>(i))) * 2 * M_PI / count, 2 * M_PI));
    const double size = 25 + 40 * wm_random_uniform(seed, 2, static_cast<uint64_t>(i));
    out.step.push_back(i % 2 ? size : -size);
  }
  return out;
}

void draw(const stripes &wall, const wm_camera &truth, double turn, double noise, uint64_t seed) {
  wm::mounted_camera camera;
  TEST_ASSERT_NULL(wm::mounted_camera_init(&camera, truth));
  for (uint32_t v = 0; v < kSide; v++)
    for (uint32_t u = 0; u < kSide; u++) {
      uint8_t &grey = picture[v * kSide + u];
      grey = 0;
      wm::vec3 ray;
      if (std::hypot(u - 319.5, v - 319.5) > 318 || !wm::unproject(camera.optics, {1.0 * u, 1.0 * v}, &ray)) continue;
      const wm::vec3 d = camera.R_base_optical * ray;
      const double level = std::hypot(d.x, d.y), elevation = std::atan2(d.z, level);
      double value = 110;
      // The wall ends at 40 degrees; above is the ceiling.
      if (elevation < 40 * kDeg) {
        const double px_per_rad = 183.35 * std::sin(M_PI_2 - elevation) * (M_PI_2 - elevation) / level;
        value = wall.at(std::atan2(d.y, d.x) + turn, kBlur_px / px_per_rad);
      }
      value += noise * wm_random_normal(seed, 3, v * kSide + u);
      grey = static_cast<uint8_t>(std::clamp(value + 0.5, 0.0, 255.0));
    }
}

// Nearest true line, as an error of azimuth.
double error_of(const stripes &wall, double azimuth, size_t *which) {
  double least = 10;
  for (size_t i = 0; i < wall.azimuth.size(); i++) {
    const double off = std::remainder(azimuth - wall.azimuth[i], 2 * M_PI);
    if (std::fabs(off) >= std::fabs(least)) continue;
    least = off;
    *which = i;
  }
  return least;
}

TEST(sub_pixel_and_honest) {
  lines->set("sigma_px", 0);
  lines->set("tilt_sigma_rad", 0);
  double squares = 0, normalised = 0, sum = 0;
  int count = 0;
  for (uint64_t world = 0; world < 3; world++) {
    const stripes wall = make_stripes(36, world);
    start();
    for (uint64_t k = 0; k < 8; k++) {
      draw(wall, rig.cameras[0], 0.0037 * static_cast<double>(k), 2 + 2.0 * static_cast<double>(world),
           100 * world + k);
      const size_t seen = look(100'000'000 * static_cast<wm_time_ns>(k + 1));
      if (k < 2) {
        TEST_ASSERT_EQUAL(0, seen);  // nothing is published of what was seen only once or twice
        continue;
      }
      TEST_ASSERT_GREATER_OR_EQUAL(35, seen);
      for (size_t i = 0; i < seen; i++) {
        const wm_sighting &s = lines->events[i].as.sighting;
        size_t which = 0;
        const double e = error_of(wall, s.bearing_rad + 0.0037 * static_cast<double>(k), &which);
        TEST_ASSERT_LESS_THAN_DOUBLE(0.3 * kDeg, std::fabs(e));
        sum += e;
        squares += e * e;
        normalised += e * e / (s.bearing_sigma_rad * s.bearing_sigma_rad);
        count++;
      }
    }
  }
  const double rms = std::sqrt(squares / count) / kDeg, ratio = std::sqrt(normalised / count);
  std::printf("%d lines: RMS %.4f deg, mean %.4f deg, normalised error %.3f\n", count, rms, sum / count / kDeg, ratio);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.02, rms);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.002, std::fabs(sum / count) / kDeg);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.9, ratio);
  TEST_ASSERT_LESS_THAN_DOUBLE(1.1, ratio);
}

// The robot turns by five degrees a picture, then back: each line keeps its number.
TEST(numbers_stay_through_turns) {
  const stripes wall = make_stripes(30, 9);
  start();
  std::map<int32_t, size_t> line_of;
  double turn = 0;
  for (int k = 0; k < 14; k++) {
    draw(wall, rig.cameras[0], turn, 2, 500 + static_cast<uint64_t>(k));
    const size_t seen = look(100'000'000 * (k + 1));
    if (k > 3) TEST_ASSERT_GREATER_OR_EQUAL(28, seen);
    for (size_t i = 0; i < seen; i++) {
      size_t which = 0;
      (void)error_of(wall, lines->events[i].as.sighting.bearing_rad + turn, &which);
      const auto known = line_of.emplace(lines->events[i].as.sighting.landmark_id, which);
      TEST_ASSERT_EQUAL(known.first->second, which);
    }
    turn += (k < 7 ? 1 : -1) * 5 * kDeg;
  }
  TEST_ASSERT_LESS_OR_EQUAL(32, line_of.size());
}

// The mounting is off by half a degree: the lines' lean tells, and azimuths are right again.
TEST(leaning_lines_tell_the_zenith) {
  const stripes wall = make_stripes(36, 4);
  wm_camera truth = rig.cameras[0];
  truth.mounting.rpy_rad[1] += 0.5 * kDeg;
  start();
  double squares = 0;
  int count = 0;
  for (uint64_t k = 0; k < 8; k++) {
    draw(wall, truth, 0, 2, 900 + k);
    const size_t seen = look(100'000'000 * static_cast<wm_time_ns>(k + 1));
    for (size_t i = 0; k > 4 && i < seen; i++) {
      size_t which = 0;
      const double e = error_of(wall, lines->events[i].as.sighting.bearing_rad, &which);
      squares += e * e;
      count++;
    }
  }
  TEST_ASSERT_GREATER_THAN(90, count);
  std::printf("half a degree of tilt: RMS %.4f deg\n", std::sqrt(squares / count) / kDeg);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.03, std::sqrt(squares / count) / kDeg);
}

// A mounting that is turned says azimuths about its own yaw, and a camera that looks ahead directions in its own axes.
TEST(bearings_are_the_sensors_own) {
  const stripes wall = make_stripes(30, 2);
  rig.cameras[0] = up_camera(30);
  start();
  for (int k = 0; k < 4; k++) {
    draw(wall, rig.cameras[0], 0, 1, 50 + static_cast<uint64_t>(k));
    const size_t seen = look(100'000'000 * (k + 1));
    for (size_t i = 0; i < seen; i++) {
      size_t which = 0;
      TEST_ASSERT_LESS_THAN_DOUBLE(
          0.1 * kDeg, std::fabs(error_of(wall, lines->events[i].as.sighting.bearing_rad + 30 * kDeg, &which)));
    }
  }
}

TEST(the_scalar_twin_votes_alike) {
  constexpr int kColumns = 256, kRows = 40;
  std::vector<int16_t> grey(kRows * (kColumns + 2 * wm::kPolarPad));
  for (size_t i = 0; i < grey.size(); i++)
    grey[i] = static_cast<int16_t>(255 * wm::kPolarScale * wm_random_uniform(8, 1, i));
  std::vector<wm::polar_row> rows(kRows);
  for (int r = 0; r < kRows; r++) rows[static_cast<size_t>(r)] = {0.01 * r, 0.01 * r, 1, 2 << (r % 3)};
  wm::polar_view polar{};
  polar.columns = kColumns;
  polar.rows = kRows;
  polar.row = rows.data();
  polar.grey = grey.data();
  struct alignas(16) work_space {
    int16_t numbers[wm::kVoteArrays][kColumns];
  };
  static work_space a, b;
  const auto use = [](work_space &m) {
    const auto side = [&m](int at) {
      return wm::vote_side{{m.numbers[at], m.numbers[at + 1], m.numbers[at + 2]},
                           {m.numbers[at + 3], m.numbers[at + 4], m.numbers[at + 5]}};
    };
    return wm::vote_work{m.numbers[0], side(1), side(7)};
  };
  wm::vote_work first = use(a), second = use(b);
  wm::count_votes(polar, 12, &first);
  wm::count_votes_scalar(polar, 12, &second);
  TEST_ASSERT_EQUAL_MEMORY(a.numbers, b.numbers, sizeof a.numbers);
}

TEST(absurd_pictures_show_nothing) {
  start();
  wm_time_ns t_ns = 0;
  for (int level : {0, 255, 128}) {
    std::fill(picture.begin(), picture.end(), static_cast<uint8_t>(level));
    for (int k = 0; k < 5; k++) TEST_ASSERT_EQUAL(0, look(t_ns += 100'000'000));
  }
  for (int k = 0; k < 6; k++) {  // noise: now and then a line, never many
    for (size_t i = 0; i < picture.size(); i++)
      picture[i] = static_cast<uint8_t>(256 * wm_random_uniform(70 + static_cast<uint64_t>(k), 1, i));
    TEST_ASSERT_LESS_OR_EQUAL(5, look(t_ns += 100'000'000));
  }
  for (size_t i = 0; i < picture.size(); i++) picture[i] = (i / 16 + i / kSide / 16) % 2 ? 255 : 0;
  for (int k = 0; k < 5; k++) {
    const size_t seen = look(t_ns += 100'000'000);
    for (size_t i = 0; i < seen; i++) TEST_ASSERT_DOUBLE_IS_DETERMINATE(lines->events[i].as.sighting.bearing_rad);
  }
  // Upside down: what was the left is the right, as many lines as before, none at a wrong place twice.
  const stripes wall = make_stripes(24, 3);
  for (int k = 0; k < 5; k++) {
    draw(wall, rig.cameras[0], 0, 2, 40 + static_cast<uint64_t>(k));
    if (k >= 2) std::reverse(picture.begin(), picture.end());
    TEST_ASSERT_LESS_OR_EQUAL(26, look(t_ns += 100'000'000));
  }
}

// An identity has 27 bits: the one behind the largest is the first again.
TEST(identities_of_tracks_begin_anew) {
  static wm::line_tracks tracks;
  wm::radial_edge edges[3] = {};
  for (int i = 0; i < 3; i++) edges[i] = {-1.0 + i, 0.001, 0, 0.1, 60.0 + 50 * i, 200.0 - 50 * i, 0, 100, 1000};
  constexpr int32_t kEnd = INT32_MAX / 16;
  tracks.clear();
  tracks.next_id = kEnd - 2;
  for (int shown = 0; shown < 3; shown++) {  // they keep it
    tracks.follow(edges, 3, WM_NS_PER_S + shown * 50 * WM_NS_PER_MS);
    const int32_t want[3] = {kEnd - 2, kEnd - 1, 1};
    for (int i = 0; i < 3; i++) {
      TEST_ASSERT_EQUAL_INT32(want[i], tracks.track[i].id);
      TEST_ASSERT_EQUAL_INT32(shown + 1, tracks.track[i].seen);
    }
  }
  TEST_ASSERT_EQUAL_INT32(2, tracks.next_id);
}

TEST(what_does_not_fit_is_told) {
  rig.cameras[0].width_px = rig.cameras[0].height_px = 3;
  lines->expect_refused(view, "");
  rig.cameras[0] = up_camera(0);
  rig.cameras[0].mounting.rpy_rad[1] = 90 * kDeg;  // looks at the floor with a narrow lens
  rig.cameras[0].intrinsics[0] = rig.cameras[0].intrinsics[1] = 2000;
  lines->expect_refused(view, "");
}

}  // namespace

void setUp() {
  lines = std::make_unique<wm::drawn::eyes>("lines");
  wm_rig_init(&rig);
  rig.camera_count = 1;
  rig.cameras[0] = up_camera(0);
  view = {&rig, &kCamera, nullptr, 0, nullptr, 0, nullptr, 0};
}
