// SPDX-License-Identifier: Apache-2.0
// What detectors cost: of edges, the transform of a 50x50 window, the search for its strongest line and whole pictures;
// of upright lines, a hemispherical picture.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <vector>

#include "drawn_picture.h"
#include "timing.h"
#include "vision/edges/hough.hpp"
#include "waymark/random.h"

namespace {

// Of work so short that the clock would be seen: fifty at a time.
template <class Work>
double fifty_us(Work work) {
  return bench::median_us(101,
                          [&] {
                            for (int i = 0; i < 50; i++) work();
                          }) /
         50;
}

void whole_pictures() {
  for (int mode = 0; mode < 2; mode++) {
    bench::edges_at_work edges(mode);
    uint32_t points = 0;
    const double us = bench::median_us(101, [&] { points = edges.look(); });
    std::printf("edges_1280x720_%s_us %.0f (%u points", mode ? "windows" : "rays", us, points);
    if (mode) std::printf(", %d windows", edges.windows());
    std::printf(")\n");
  }
}

// Upright lines of a 640x640 hemispherical picture, followed: forty of them, as in a furnished hall, and the grain of a
// sensor; and of this what the polar picture and the votes cost.
void hemispherical_picture() {
  constexpr uint32_t kSide = 640;
  wm_rig rig;
  wm_rig_init(&rig);
  rig.camera_count = 1;
  wm_camera &c = rig.cameras[0];
  c = wm_camera{};
  c.width_px = c.height_px = kSide;
  c.intrinsics_count = 4;
  const double intrinsics[] = {183.35, 183.35, 319.5, 319.5};
  std::copy(intrinsics, intrinsics + 4, c.intrinsics);
  c.mounting = {{0, 0, 0.8}, {0, -90 * 3.14159265358979 / 180, 0}};
  wm::mounted_camera camera;
  wm::mounted_camera_init(&camera, c);
  std::vector<uint8_t> picture(kSide * kSide);
  for (uint32_t v = 0; v < kSide; v++)
    for (uint32_t u = 0; u < kSide; u++) {
      wm::vec3 ray;
      if (!wm::unproject(camera.optics, {1.0 * u, 1.0 * v}, &ray)) continue;
      const wm::vec3 d = camera.R_base_optical * ray;
      const int stripe = static_cast<int>((wm::atan2(d.y, d.x) + wm::kPi) * 40 / wm::kTwoPi);
      const double level = d.z > 0.5 || d.z < -0.2 ? 120 : 90 + 50 * (stripe % 2);
      picture[v * kSide + u] = static_cast<uint8_t>(level + 4 * wm_random_uniform(1, 2, v * kSide + u));
    }
  const wm_detector *lines = wm_detector_find("lines");
  std::vector<char> params(lines->params.bytes);
  wm_params_defaults(&lines->params, params.data());
  static wm_event events[256];
  const int32_t up = 0;
  const wm_view view = {&rig, &up, nullptr, 0, nullptr, 0, nullptr, 0};
  const char *why = "";
  const size_t bytes = (lines->state_bytes(params.data(), &view, &why) + 63) / 64 * 64;
  void *state = std::aligned_alloc(64, bytes);
  if (!state || lines->init(state, params.data(), &view) != WM_OK) return;
  wm_frame frame = {0, 0, 0, 0, 0, kSide, kSide, kSide, picture.data()};
  size_t count = 0;
  const double us = bench::median_us(101, [&] {
    frame.t_ns += 100'000'000;
    (void)lines->detect(state, &frame, nullptr, events, 256, &count);
  });
  std::printf("lines_640x640_us %.0f (%zu lines followed)\n", us, count);
  std::free(state);
}

}  // namespace

int main() {
  uint8_t window[50 * 50];
  for (size_t i = 0; i < sizeof window; i++) window[i] = static_cast<uint8_t>(256 * wm_random_uniform(1, 1, i));
  uint8_t turned[50 * 50];
  for (int y = 0; y < 50; y++)
    for (int x = 0; x < 50; x++) turned[x * 50 + y] = window[y * 50 + x];
  const auto work = std::make_unique<wm::hough_work>();
  volatile int kept = 0;
  const auto all = [&](auto transform) {
    for (int q = 0; q < 4; q++) {
      const uint8_t *from = q & 1 ? turned : window;
      const wm::hough_plane *plane = transform(q & 2 ? from + 49 : from, 50, 50, q & 2 ? -1 : 1, work.get());
      kept = kept + plane->sums[60];
    }
  };
  std::printf("hough_50x50_us %.2f\n", fifty_us([&] { all(wm::hough_transform); }));
  std::printf("hough_50x50_scalar_us %.2f\n", fifty_us([&] { all(wm::hough_transform_scalar); }));
  std::printf("hough_50x50_find_us %.2f\n", fifty_us([&] {
                for (int q = 0; q < 4; q++) kept = kept + wm::hough_find(work->a, 50).t;
              }));
  whole_pictures();
  hemispherical_picture();
}
