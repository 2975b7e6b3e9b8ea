// SPDX-License-Identifier: Apache-2.0
// What detectors cost: of edges, the transform of a 50x50 window, the search for its strongest line and whole pictures;
// of upright lines, a hemispherical picture.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <vector>

#include "drawn_picture.h"
#include "drawn_window.h"
#include "timing.h"

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
  bench::window_at_work window;
  volatile int kept = 0;
  const auto all = [&](auto transform) { kept = kept + window.all_slopes(transform); };
  std::printf("hough_50x50_us %.2f\n", fifty_us([&] { all(wm::hough_transform); }));
  std::printf("hough_50x50_scalar_us %.2f\n", fifty_us([&] { all(wm::hough_transform_scalar); }));
  std::printf("hough_50x50_find_us %.2f\n", fifty_us([&] {
                for (int q = 0; q < 4; q++) kept = kept + wm::hough_find(window.work->a, 50).t;
              }));
  whole_pictures();
  hemispherical_picture();
}
