// SPDX-License-Identifier: Apache-2.0
#include "vision/markers/mr_read.hpp"

#include <initializer_list>

#include "vision/markers/print_reader.hpp"

namespace wm {

namespace {

constexpr double kShapeMisfit = 0.03;  // RMS of the homography over the radius: the regular pentagon in perspective
// White from the rim, black from the middle of the ring, as scales of the outline.
constexpr double kRing = 0.5 * (1 + WM_MR_INNER), kRim = 1 + 0.9 * (1 - kRing);

// Whether the tip has its black module, and the two nearest vertices have none.
bool points_up(const print_reader &r, double turn_sin, double turn_cos) {
  for (int k = -1; k <= 1; k++) {
    const double s = k * turn_sin, c = k == 0 ? 1 : turn_cos, x = -s * WM_MR_TIP_Y, y = c * WM_MR_TIP_Y;
    double grey;
    if (!r.module(x, y, &grey)) return false;
    const bool is_black = grey < 0.5 * (r.white.at(x, y) + r.black.at(x, y));
    if (is_black != (k == 0)) return false;
  }
  return true;
}

// Level of each module between black (-0.5) and white (0.5).
bool read_modules(const print_reader &r, double level[64]) {
  for (int i = 0; i < 64; i++) {
    const int column = i % 8, row = i / 8;
    const double x = WM_MR_CODE_LEFT + (column + 0.5) * WM_MR_MODULE, y = WM_MR_CODE_TOP + (row + 0.5) * WM_MR_MODULE;
    if (!r.level(x, y, &level[i])) return false;
  }
  return true;
}

uint64_t decide(const double level[64], double sharpen) {
  uint64_t modules = 0;
  for (int i = 0; i < 64; i++)
    if (is_black_module(level, 8, i, sharpen)) modules |= UINT64_C(1) << i;
  return modules;
}

// Whether five points fit the regular pentagon's homography, which has eight unknowns for ten numbers.
bool is_regular(const homography &h, const double outline[5][2], const tangent_point corner[5]) {
  const tangent_point middle = h(0, 0);
  double off = 0, size = 0;
  for (int i = 0; i < 5; i++) {
    off += length(h(outline[i][0], outline[i][1]) - corner[i]);
    size += length(corner[i] - middle);
  }
  return off < kShapeMisfit * size;
}

// Decodes the modules, sharpened and as they are.
bool decode(const double level[64], uint32_t id_max, mr_reading *out) {
  for (const double sharpen : {kSharpen, 0.0})
    if (wm_mr_decode(decide(level, sharpen), &out->id, &out->wrong) && out->id <= id_max) return true;
  return false;
}

enum class verdict { kRead, kNextVertex, kNoMarker };

// Reads the print with vertex `tip` as its tip.
verdict read_at(print_reader *r, const double outline[5][2], const tangent_point corner[5], int tip, uint32_t id_max,
                int contrast, mr_reading *out) {
  tangent_point rotated[5];
  for (int i = 0; i < 5; i++) rotated[i] = corner[(tip + i) % 5];
  if (!homography_init(&r->h, outline, rotated, 5)) return verdict::kNoMarker;
  if (tip == 0 && !is_regular(r->h, outline, rotated)) return verdict::kNoMarker;  // the same for each vertex
  if (!r->measure_shades(outline, 5, kRim, kRing) || r->white.at(0, 0) - r->black.at(0, 0) < contrast)
    return verdict::kNoMarker;
  const double turn_sin = outline[1][0] / WM_MR_CIRCUMRADIUS, turn_cos = -outline[1][1] / WM_MR_CIRCUMRADIUS;
  if (!points_up(*r, turn_sin, turn_cos)) return verdict::kNextVertex;
  double level[64];
  if (!read_modules(*r, level)) return verdict::kNoMarker;
  out->tip = tip;
  return decode(level, id_max, out) ? verdict::kRead : verdict::kNextVertex;
}

}  // namespace

bool mr_read(const tangent_view &view, const wm_frame &frame, const tangent_point corner[5], uint32_t id_max,
             int contrast, mr_reading *out) {
  double outline[5][2];
  for (int i = 0; i < 5; i++) wm_mr_vertex(i, outline[i]);
  print_reader r = {view, frame, WM_MR_MODULE, {}, {}, {}};
  for (int tip = 0; tip < 5; tip++) {
    const verdict result = read_at(&r, outline, corner, tip, id_max, contrast, out);
    if (result != verdict::kNextVertex) return result == verdict::kRead;
  }
  return false;
}

}  // namespace wm
