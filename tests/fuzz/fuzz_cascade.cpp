// SPDX-License-Identifier: Apache-2.0
// Any bytes as a cascade: refused with a reason, or a window can be judged by it.
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "fuzz.h"
#include "waymark/cascade_file.h"
#include "waymark/internal/vision/cascade/evaluate.hpp"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  constexpr int kSide = WM_CASCADE_SIDE_MAX + 1;
  static uint32_t sums[kSide * kSide], squares[kSide * kSide];
  if (squares[kSide * kSide - 1] == 0)
    for (int y = 1; y < kSide; y++)
      for (int x = 1; x < kSide; x++) {
        const uint32_t grey = static_cast<uint32_t>(x * 7 + y * 13) % 256;
        const int at = y * kSide + x;
        sums[at] = sums[at - 1] + sums[at - kSide] - sums[at - kSide - 1] + grey;
        squares[at] = squares[at - 1] + squares[at - kSide] - squares[at - kSide - 1] + grey * grey;
      }
  wm_cascade cascade;
  wm_error err{};
  if (wm_cascade_parse(reinterpret_cast<const char *>(data), size, "fuzz", &cascade, &err) != WM_OK) {
    if (cascade.nodes || std::strlen(err.text) < 10) std::abort();
    return 0;
  }
  double surplus;
  if (wm::stages_passed(cascade, {sums, squares, kSide}, 0, 0, &surplus) > static_cast<int>(cascade.stage_count))
    std::abort();
  wm_cascade_free(&cascade);
  return 0;
}
