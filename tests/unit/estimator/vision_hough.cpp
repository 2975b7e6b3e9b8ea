// SPDX-License-Identifier: Apache-2.0
// The fast Hough transform against the sums it stands for, and its vectors against its scalar twin.
#include <memory>

#include "common/suite.h"
#include "vision/edges_hough/hough.hpp"
#include "waymark/random.h"
#include "waymark/vectors.h"

namespace {

uint8_t window[64 * 64];

void fill(uint64_t seed, int side) {
  for (int i = 0; i < side * side; i++) window[i] = static_cast<uint8_t>(256 * wm_random_uniform(seed, 1, i));
}

TEST(sums_along_dyadic_lines) {
  for (int side : {2, 3, 5, 32, 50, 63, 64}) {
    const auto work = std::make_unique<wm::hough_work>();
    fill(static_cast<uint64_t>(side), side);
    const wm::hough_plane *plane = wm::hough_transform(window, side, side, 1, work.get());
    fill(99, side);
    wm::hough_transform(window, side, side, 1, work.get());  // leaves nothing behind
    fill(static_cast<uint64_t>(side), side);
    plane = wm::hough_transform(window, side, side, 1, work.get());
    for (int t = 0; t < side; t++)
      for (int o = 0; o < 2 * side - 1; o++) {
        int expected = 0;
        for (int y = 0; y < side; y++) {
          const int x = o - (side - 1) + wm::hough_line(side, t, y);
          if (x >= 0 && x < side) expected += window[y * side + x];
        }
        TEST_ASSERT_EQUAL(expected, plane->sums[t * wm::kHoughStride + o]);
      }
  }
}

// A dyadic line leaves the straight one by less than a sixth of a pixel for each halving.
TEST(lines_are_nearly_straight) {
  for (int side : {32, 50, 64})
    for (int t = 0; t < side; t++) {
      TEST_ASSERT_EQUAL(0, wm::hough_line(side, t, 0));
      TEST_ASSERT_EQUAL(t, wm::hough_line(side, t, side - 1));
      for (int y = 0; y < side; y++)
        TEST_ASSERT_DOUBLE_WITHIN(1.5, static_cast<double>(t) * y / (side - 1), wm::hough_line(side, t, y));
    }
}

TEST(vectors_and_scalars_agree) {
  const auto a = std::make_unique<wm::hough_work>(), b = std::make_unique<wm::hough_work>();
  for (uint64_t seed = 0; seed < 20; seed++) {
    fill(seed, 50);
    for (int quadrant = 0; quadrant < 4; quadrant++) {
      const int row = quadrant & 1 ? 1 : 50, column = quadrant & 1 ? 50 : 1;
      const uint8_t *from = quadrant & 2 ? window + 49 * column : window;
      const int step = quadrant & 2 ? -column : column;
      const wm::hough_plane *q = wm::hough_transform_scalar(from, 50, row, step, b.get());
      wm::hough_peak peak[2];
      for (int plain = 0; plain < 2; plain++) {
        wm_vectors_limit(plain != 0);
        const wm::hough_plane *p = wm::hough_transform(from, 50, row, step, a.get());
        TEST_ASSERT_EQUAL_MEMORY(p->sums, q->sums, 50 * wm::kHoughStride * sizeof(int16_t));
        peak[plain] = wm::hough_find(*p, 50);
      }
      TEST_ASSERT_EQUAL_MEMORY(&peak[0], &peak[1], sizeof peak[0]);
    }
  }
}

TEST(a_line_is_found) {
  const auto work = std::make_unique<wm::hough_work>();
  std::memset(window, 3, sizeof window);
  for (int y = 0; y < 50; y++) window[y * 50 + 12 + wm::hough_line(50, 17, y)] = 200;
  const wm::hough_peak peak = wm::hough_find(*wm::hough_transform(window, 50, 50, 1, work.get()), 50);
  TEST_ASSERT_EQUAL(17, peak.t);
  TEST_ASSERT_EQUAL(12 + 49, peak.offset);
  TEST_ASSERT_EQUAL(50 * 200, peak.sum);
}

}  // namespace
