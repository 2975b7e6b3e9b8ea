// SPDX-License-Identifier: Apache-2.0
// Dark regions of a picture, each told by its outer border: what a coded marker's black ring is found by.
#ifndef WAYMARK_ESTIMATOR_VISION_DARK_REGIONS_HPP
#define WAYMARK_ESTIMATOR_VISION_DARK_REGIONS_HPP

#include <cstddef>
#include <cstdint>

#include "waymark/frame.h"

namespace wm {

struct border_point {
  int32_t u, v;
};

// A row's stretch of dark pixels, and (where `parent` is the run itself) the box of the region that begins with it.
struct dark_run {
  uint16_t begin, end, row;  // columns begin to end - 1
  uint16_t left, right, bottom;
  uint32_t parent;
};

struct dark_work {
  int32_t width, height;  // px
  int32_t stride;         // of `mask`, which has an empty border of one pixel
  uint8_t *mask;          // 255 where dark
  uint8_t *least, *most;  // of each tile; an empty tile around them
  uint8_t *columns;       // two rows: least and most of a row of tiles, before tiles are made of them
  uint8_t *threshold;     // one row: darker is dark
  dark_run *runs;         // width / 2 + 1 a row
  uint32_t *first;        // of each row's runs, height + 1
  border_point *border;
  int32_t border_max;
};

// Sets the sizes and, from `memory` on (64-byte aligned, or NULL), the pointers. Returns the bytes they need.
size_t dark_work_lay_out(dark_work *out, uint32_t width, uint32_t height, uint8_t *memory);

// Which pixels are darker than the middle between the darkest and the brightest around them, where these differ by
// `contrast` grey levels at least (the threshold of E. Olson 2011, with tiles of 4 x 4 px); and their regions. Some
// 0.5 ms for 640 x 480.
void find_dark_regions(dark_work *work, const wm_frame &frame, int contrast);

// Runs of all rows are runs[0] to runs[run_count - 1]; those that begin a region are told by is_region.
inline uint32_t run_count(const dark_work &work) { return work.first[work.height]; }
inline bool is_region(const dark_work &work, uint32_t run) { return work.runs[run].parent == run; }

// The outer border of a region into work.border, against the clock as one sees it; the number of points, 0 where it is
// too long.
int32_t trace_border(dark_work *work, uint32_t region);

}  // namespace wm

#endif
