// SPDX-License-Identifier: Apache-2.0
// What detector `landmarks` costs: two fisheyes of 1280x720, six known signs in each, from 3 to 14 m away.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "drawn_street.h"
#include "timing.h"
#include "vision/landmarks/align.hpp"
#include "vision/landmarks/global_search.hpp"

namespace {

using namespace bench;

void whole(const drawn_street &street, bool lost) {
  const int calls = rounds(60);
  street_at_work work(street);
  std::vector<double> times;
  size_t found = 0;
  for (int k = 0; k < calls; k++) {
    const double begin = thread_us();
    found += work.look(lost);
    times.push_back(thread_us() - begin);
  }
  const double one_ms = median(times) * 1e-3;
  std::printf(
      "landmarks_1280x720%s_ms median %.2f, largest %.2f (%.1f of %d found; %.1f MB); two cameras at 30 Hz take %.0f "
      "%% of a core\n",
      lost ? "_without_a_pose" : "", one_ms, *std::max_element(times.begin(), times.end()) * 1e-3,
      static_cast<double>(found) / calls, kSigns, static_cast<double>(work.bytes()) * 1e-6, one_ms * 60 * 0.1);
}

// The same pictures without a pose: searched everywhere.
void everywhere(const drawn_street &street) {
  const int calls = rounds(40);
  wm::mounted_camera camera;
  wm::mounted_camera_init(&camera, street.rig.cameras[0]);
  std::vector<uint8_t> levels(wm::pyramid_bytes(kStreetWidth, kStreetHeight) + wm::kReadBehind), looks[kSigns];
  std::vector<uint16_t> row(kStreetWidth);
  wm::pyramid pyramid{};
  wm::pyramid_lay(&pyramid, kStreetWidth, kStreetHeight, levels.data());
  std::copy(street.picture.begin(), street.picture.end(), pyramid.level[0].grey);
  wm::pyramid_build(&pyramid, row.data());
  static wm::global_search search;
  wm::appearance known[kSigns];
  for (int i = 0; i < kSigns; i++) {
    looks[i].resize(wm::appearance::bytes(kSignSide, kSignSide));
    known[i].make(street.look[i], street.landmark[i], looks[i].data());
    search.need(camera, 0.7, 0.7, street.landmark[i].p_m[2]);
  }
  search.around.plan(camera, 0.021);
  std::vector<uint8_t> memory(search.around.bytes());
  search.around.make(camera, memory.data());
  std::vector<double> take, compare;
  int places = 0;
  for (int k = 0; k < calls; k++) {
    const double begin = thread_us();
    search.around.take(pyramid);
    const double taken = thread_us();
    places = search.search(camera, known, kSigns, 40, 0.021, 1 << 30);
    compare.push_back(thread_us() - taken);
    take.push_back(taken - begin);
  }
  std::printf("landmarks_everywhere_us panorama %.0f a picture (%.1f MB); a landmark %.0f (%d places, %.1f ns each)\n",
              median(take), static_cast<double>(memory.size()) * 1e-6, median(compare) / kSigns, places / kSigns,
              median(compare) * 1e3 / places);
}

// One sign, 5 m away: its stages.
void stages(const drawn_street &street) {
  const int calls = rounds(60);
  wm::mounted_camera camera;
  wm::camera_guess guess;
  wm::mounted_camera_init(&camera, street.rig.cameras[0]);
  wm::guess_camera(camera, &street.pose, 0, &guess);
  std::vector<uint8_t> table(wm::ray_table::bytes(kStreetWidth, kStreetHeight)),
      levels(wm::pyramid_bytes(kStreetWidth, kStreetHeight) + wm::kReadBehind),
      look(wm::appearance::bytes(kSignSide, kSignSide));
  std::vector<uint16_t> row(kStreetWidth);
  std::vector<float> scores(static_cast<size_t>(wm::kReachSide) * wm::kReachSide);
  wm::ray_table rays{};
  rays.make(camera.optics, kStreetWidth, kStreetHeight, table.data());
  wm::pyramid pyramid{};
  wm::pyramid_lay(&pyramid, kStreetWidth, kStreetHeight, levels.data());
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
  static wm::drawn_view drawn;
  static wm::align_work work;
  std::vector<double> times[4];
  for (int k = 0; k < calls; k++) {
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
  const drawn_street street;
  whole(street, false);
  whole(street, true);
  everywhere(street);
  stages(street);
}
