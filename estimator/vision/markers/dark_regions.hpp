// SPDX-License-Identifier: Apache-2.0
// Dark or light regions of a picture and their outer borders: candidates for a coded marker's ring.
#ifndef WAYMARK_ESTIMATOR_VISION_DARK_REGIONS_HPP
#define WAYMARK_ESTIMATOR_VISION_DARK_REGIONS_HPP

#include <cstddef>
#include <cstdint>

#include "waymark/frame.h"

namespace wm {

struct border_point {
  int32_t u, v;
};

// A run of pixels in a row; where `parent` is the run itself, also the box of the region that begins with it.
struct dark_run {
  uint16_t begin, end, row;  // columns begin to end - 1
  uint16_t left, right, bottom;
  uint32_t parent;
};

struct dark_work {
  int32_t width, height;  // px
  int32_t stride;         // of `mask`, which has an empty border of one pixel
  uint8_t *mask;          // 255 in a region
  uint8_t *least, *most;  // minimum and maximum of each tile; an empty tile around them
  uint8_t *columns;       // two rows: minimum and maximum of each column of a row of tiles
  uint8_t *threshold;     // one row
  dark_run *runs;         // up to width / 2 + 1 a row
  uint32_t *first;        // index of each row's first run, height + 1
  border_point *border;
  int32_t border_max;
};

// Sets the sizes and, from `memory` on (64-byte aligned, or NULL), the pointers. Returns the bytes needed.
size_t dark_work_lay_out(dark_work *out, uint32_t width, uint32_t height, uint8_t *memory);

// Adaptive threshold and connected regions. A pixel is dark (light) if it is below (above) the middle between minimum
// and maximum of its tile's neighbourhood, where these differ by at least `contrast` grey levels ([Olson2011], with
// tiles of 4 x 4 px). About 0.3 ms for 640 x 480.
void find_regions(dark_work *work, const wm_frame &frame, int contrast, bool is_light);

// Runs of all rows are runs[0] to runs[run_count - 1]; is_region marks those that begin a region.
inline uint32_t run_count(const dark_work &work) { return work.first[work.height]; }
inline bool is_region(const dark_work &work, uint32_t run) { return work.runs[run].parent == run; }

// Writes the outer border of a region to work.border, counterclockwise. Returns the number of points; 0 if too long.
int32_t trace_border(dark_work *work, uint32_t region);

}  // namespace wm

#endif
