// SPDX-License-Identifier: Apache-2.0
// What detector `landmarks` costs: two fisheyes of 1280x720, six known signs in each, from 3 to 14 m away.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "common/fisheye_rig.hpp"
#include "vision/landmarks/align.hpp"
#include "vision/landmarks/everywhere.hpp"
#include "vision/landmarks/guess.hpp"
#include "vision/landmarks/match.hpp"
#include "waymark/detector.h"
#include "waymark/random.h"

namespace {

constexpr uint32_t kWidth = 1280, kHeight = 720;
constexpr int kSigns = 6, kSide = 96;

// Time of this thread alone: other work on the machine is not counted.
double thread_us() {
  timespec now;
  (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

double median(std::vector<double> &v) {
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}

// Six signs of 0.7 m before a fisheye: each its own pattern of bars.
struct Street {
  wm_rig rig;
  wm_landmark landmark[kSigns];
  wm_appearance look[kSigns];
  std::vector<uint8_t> sign[kSigns], picture;
  wm_estimate pose{};

  Street()
      : rig(wm::drawn::rig_of({wm::drawn::fisheye(kWidth, kHeight, 424, {{0, 0, 1.4}, {0, 0, 0}})})),
        picture(kWidth * kHeight) {
    pose.state = WM_STATE_TRACKING;
    pose.dof = 3;
    pose.pose_map_base.q_xyzw[3] = 1;
    pose.covariance[wm_cov_index(0, 0)] = pose.covariance[wm_cov_index(1, 1)] = 0.03 * 0.03;
    pose.covariance[wm_cov_index(5, 5)] = 0.005 * 0.005;
    for (int i = 0; i < kSigns; i++) {
      sign[i].resize(kSide * kSide);
      for (int k = 0; k < kSide * kSide; k++)
        sign[i][static_cast<size_t>(k)] =
            wm_random_uniform(7, static_cast<uint64_t>(i), static_cast<uint64_t>(k / kSide / 16 * 6 + k % kSide / 16)) >
                    0.5
                ? 210
                : 45;
      const double away = 3 + 2.2 * i, across = (i - 2.5) * 0.45 * away;
      landmark[i] = {i + 1, {away, across, 1.4 + 0.12 * away}, 0.02, static_cast<double>(NAN), {0, 0, 0}, 0};
      look[i] = {i + 1, kSide, kSide, sign[i].data(), 0.7, 0.7, -M_PI / 2 + 0.3 * (i % 3 - 1)};
    }
    draw();
  }

  void draw() {
    wm::mounted_camera camera;
    wm::camera_guess guess;
    wm::mounted_camera_init(&camera, rig.cameras[0]);
    wm::guess_camera(camera, &pose, 0, &guess);
    wm::panel_view panels[kSigns];
    wm::appearance what[kSigns];
    std::vector<uint8_t> memory[kSigns];
    for (int i = 0; i < kSigns; i++) {
      memory[i].resize(wm::appearance::bytes(kSide, kSide));
      what[i].make(look[i], landmark[i], memory[i].data());
      wm::view_panel(what[i], guess.R_map_optical, guess.eye_m, &panels[i]);
    }
    for (uint32_t v = 0; v < kHeight; v++)
      for (uint32_t u = 0; u < kWidth; u++) {
        double sum = 0;
        for (int s = 0; s < 4; s++) {
          wm::vec3 ray;
          double grey = 100 + 20 * std::sin(0.05 * u) * std::sin(0.07 * v);
          if (wm::unproject(camera.optics, {u - 0.25 + 0.5 * (s % 2), v - 0.25 + 0.5 * (s / 2)}, &ray))
            for (int i = kSigns - 1; i >= 0; i--) {
              const wm::vec3 q = panels[i].plane * ray;
              const double a = q.x / q.z / 0.7 + 0.5, b = 0.5 - q.y / q.z / 0.7;
              if (q.z > 0 && a > 0 && a < 1 && b > 0 && b < 1)
                grey = sign[i][static_cast<size_t>(static_cast<int>(b * kSide) * kSide + static_cast<int>(a * kSide))];
            }
          sum += grey;
        }
        picture[v * kWidth + u] =
            static_cast<uint8_t>(std::clamp(sum / 4 + 2 * wm_random_normal(3, 1, v * kWidth + u), 0.0, 255.0));
      }
  }
};

void whole(const Street &street, bool lost) {
  constexpr int kRounds = 60;
  const wm_detector *detector = wm_detector_find("landmarks");
  const int32_t camera = 0;
  const wm_view view = {&street.rig, &camera, street.landmark, kSigns, street.look, kSigns, nullptr, 0};
  std::vector<double> params(detector->params.bytes / sizeof(double) + 1);
  wm_params_defaults(&detector->params, params.data());
  const char *why = "";
  const size_t bytes = (detector->state_bytes(params.data(), &view, &why) + 63) / 64 * 64;
  void *state = std::aligned_alloc(64, bytes);
  if (!state || detector->init(state, params.data(), &view) != WM_OK) return;
  std::vector<double> times;
  size_t found = 0;
  static wm_event events[64];
  for (int k = 0; k < kRounds; k++) {
    const wm_frame frame = {0, 0, 0, 0, 0, kWidth, kHeight, kWidth, street.picture.data()};
    wm_estimate pose = street.pose;
    pose.pose_map_base.p_m[1] = 0.03 * std::sin(k);
    size_t count;
    const double begin = thread_us();
    (void)detector->detect(state, &frame, lost ? nullptr : &pose, events, 64, &count);
    times.push_back(thread_us() - begin);
    found += count;
  }
  const double one_ms = median(times) * 1e-3;
  std::printf(
      "landmarks_1280x720%s_ms median %.2f, largest %.2f (%.1f of %d found; %.1f MB); two cameras at 30 Hz take %.0f "
      "%% "
      "of a core\n",
      lost ? "_without_a_pose" : "", one_ms, times.back() * 1e-3, static_cast<double>(found) / kRounds, kSigns,
      static_cast<double>(bytes) * 1e-6, one_ms * 60 * 0.1);
  std::free(state);
}

// The same pictures without a pose: searched everywhere.
void everywhere(const Street &street) {
  constexpr int kRounds = 40;
  wm::mounted_camera camera;
  wm::mounted_camera_init(&camera, street.rig.cameras[0]);
  std::vector<uint8_t> levels(wm::pyramid_bytes(kWidth, kHeight) + wm::kReadBehind), looks[kSigns];
  std::vector<uint16_t> row(kWidth);
  wm::pyramid pyramid{};
  wm::pyramid_lay(&pyramid, kWidth, kHeight, levels.data());
  std::copy(street.picture.begin(), street.picture.end(), pyramid.level[0].grey);
  wm::pyramid_build(&pyramid, row.data());
  static wm::search_everywhere search;
  wm::appearance known[kSigns];
  for (int i = 0; i < kSigns; i++) {
    looks[i].resize(wm::appearance::bytes(kSide, kSide));
    known[i].make(street.look[i], street.landmark[i], looks[i].data());
    search.need(camera, 0.7, 0.7, street.landmark[i].p_m[2]);
  }
  search.round.plan(camera, 0.021);
  std::vector<uint8_t> memory(search.round.bytes());
  search.round.make(camera, memory.data());
  std::vector<double> take, compare;
  int places = 0;
  for (int k = 0; k < kRounds; k++) {
    const double begin = thread_us();
    search.round.take(pyramid);
    const double taken = thread_us();
    places = search.search(camera, known, kSigns, 40, 0.17, 0.021, 1 << 30);
    compare.push_back(thread_us() - taken);
    take.push_back(taken - begin);
  }
  std::printf("landmarks_everywhere_us panorama %.0f a picture (%.1f MB); a landmark %.0f (%d places, %.1f ns each)\n",
              median(take), static_cast<double>(memory.size()) * 1e-6, median(compare) / kSigns, places / kSigns,
              median(compare) * 1e3 / places);
}

// One sign, 5 m away: its stages.
void stages(const Street &street) {
  constexpr int kRounds = 60;
  wm::mounted_camera camera;
  wm::camera_guess guess;
  wm::mounted_camera_init(&camera, street.rig.cameras[0]);
  wm::guess_camera(camera, &street.pose, 0, &guess);
  std::vector<uint8_t> table(wm::ray_table::bytes(kWidth, kHeight)),
      levels(wm::pyramid_bytes(kWidth, kHeight) + wm::kReadBehind), look(wm::appearance::bytes(kSide, kSide));
  std::vector<uint16_t> row(kWidth);
  std::vector<float> scores(static_cast<size_t>(wm::kReachSide) * wm::kReachSide);
  wm::ray_table rays{};
  rays.make(camera.optics, kWidth, kHeight, table.data());
  wm::pyramid pyramid{};
  wm::pyramid_lay(&pyramid, kWidth, kHeight, levels.data());
  wm::appearance what{};
  what.make(street.look[1], street.landmark[1], look.data());
  wm::panel_view panel{};
  wm::view_panel(what, guess.R_map_optical, guess.eye_m, &panel);
  wm::pixel middle{}, corners[4];
  wm::project(camera.optics, panel.middle, &middle);
  const double yaw = street.look[1].yaw_rad;
  for (int i = 0; i < 4; i++) {
    const double a = i == 0 || i == 3 ? -0.35 : 0.35, b = i < 2 ? 0.35 : -0.35;
    const wm::vec3 point = what.place_m + wm::vec3{a * std::cos(yaw), a * std::sin(yaw), b};
    wm::project(camera.optics, wm::transposed_times(guess.R_map_optical, point - guess.eye_m), &corners[i]);
  }
  static wm::raster drawn;
  static wm::align_work work;
  std::vector<double> times[4];
  for (int k = 0; k < kRounds; k++) {
    double at[5] = {thread_us()};
    std::copy(street.picture.begin(), street.picture.end(), pyramid.level[0].grey);
    wm::pyramid_build(&pyramid, row.data());
    at[1] = thread_us();
    wm::draw(what, panel, rays, corners, 1, 0.6, &drawn);
    at[2] = thread_us();
    wm::best_place best{};
    wm::search_window(pyramid.level[1], drawn, 8, 8, scores.data(), &best);
    at[3] = thread_us();
    wm::aligned fine{};
    wm::align_landmark(pyramid.level[1], drawn, {0.5 * middle.u, 0.5 * middle.v}, best.right, best.down, &work, &fine);
    at[4] = thread_us();
    for (int i = 0; i < 4; i++) times[i].push_back(at[i + 1] - at[i]);
  }
  std::printf(
      "landmarks_stages_us pyramid %.0f a picture; a landmark of %d px: draw %.0f, search of 17 x 17 %.0f, align "
      "%.0f\n",
      median(times[0]), drawn.count, median(times[1]), median(times[2]), median(times[3]));
}

}  // namespace

int main() {
  const Street street;
  whole(street, false);
  whole(street, true);
  everywhere(street);
  stages(street);
}
