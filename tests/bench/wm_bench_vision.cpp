// SPDX-License-Identifier: Apache-2.0
// What detectors cost: of edges, the transform of a 50x50 window, the search for its strongest line and whole pictures;
// of upright lines, a hemispherical picture.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <vector>

#include "drawn_picture.h"
#include "timing.h"
#include "vision/edges_hough/hough.hpp"
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

void hemispherical_picture() {
  bench::lines_at_work lines;
  size_t count = 0;
  const double us = bench::median_us(101, [&] { count = lines.look(); });
  std::printf("lines_640x640_us %.0f (%zu lines followed)\n", us, count);
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
