// SPDX-License-Identifier: Apache-2.0
// A window of 50 x 50 pixels, and the transform of lines in all four quadrants of it.
#pragma once

#include <cstdint>
#include <memory>

#include "vision/edges_hough/hough.hpp"
#include "waymark/random.h"

namespace bench {

struct window_at_work {
  uint8_t pixels[50 * 50], turned[50 * 50];
  std::unique_ptr<wm::hough_work> work = std::make_unique<wm::hough_work>();

  // Grey of the pixel with a number.
  template <class Grey>
  explicit window_at_work(Grey grey) {
    for (int i = 0; i < 50 * 50; i++) pixels[i] = static_cast<uint8_t>(grey(i));
    for (int y = 0; y < 50; y++)
      for (int x = 0; x < 50; x++) turned[x * 50 + y] = pixels[y * 50 + x];
  }
  window_at_work() : window_at_work([](int i) { return 256 * wm_random_uniform(1, 1, static_cast<uint64_t>(i)); }) {}
  // A sum of the planes, so that none is left out.
  template <class Transform>
  int all_slopes(Transform transform) {
    int kept = 0;
    for (int q = 0; q < 4; q++) {
      const uint8_t *from = q & 1 ? turned : pixels;
      kept += transform(q & 2 ? from + 49 : from, 50, 50, q & 2 ? -1 : 1, work.get())->sums[60];
    }
    return kept;
  }
};

}  // namespace bench
