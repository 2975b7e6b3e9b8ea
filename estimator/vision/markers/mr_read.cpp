// SPDX-License-Identifier: Apache-2.0
#include "vision/markers/mr_read.hpp"

#include <initializer_list>

#include "math/eigen.hpp"

namespace wm {

namespace {

constexpr double kShapeMisfit = 0.03;    // RMS of the homography over the radius: the regular pentagon in perspective
constexpr double kSharpen = 0.25;        // deconvolution of a module from its neighbours, as AprilTag's decoder does
constexpr int kSamples = 12;             // along a side of the ring, for black and for white. Not swept
constexpr double kContrastMin_grey = 1;  // between the interpolated white and black at a module

// Shading model of one colour over the print: grey = a + b x + c y, by least squares.
struct shade {
  double normal[3][3], right[3], a, b, c;

  void add(double x, double y, double grey) {
    const double row[3] = {1, x, y};
    for (int i = 0; i < 3; i++) {
      right[i] += row[i] * grey;
      for (int k = 0; k < 3; k++) normal[i][k] += row[i] * row[k];
    }
  }
  bool solve() {
    vector<3> x;
    if (!solve_positive<3, 1>(map(normal), map(right), &x)) return false;
    a = x(0), b = x(1), c = x(2);
    return true;
  }
  double at(double x, double y) const { return a + b * x + c * y; }
};

struct reader {
  const tangent_view &view;
  const wm_frame &frame;
  homography h;

  bool grey(double x, double y, double *out) const { return grey_at(view, frame, h(x, y), out); }
  // Mean over the middle of a module.
  bool module(double x, double y, double *out) const {
    constexpr double kOff = 0.2 * WM_MR_MODULE;  // from the middle: within the part that blur leaves
    double sum = 0, one;
    for (int i = 0; i < 5; i++) {
      const double dx = i == 0 ? 0 : i % 2 ? kOff : -kOff, dy = i == 0 ? 0 : i < 3 ? kOff : -kOff;
      if (!grey(x + dx, y + dy, &one)) return false;
      sum += one;
    }
    *out = sum / 5;
    return true;
  }
};

// White from the rim, black from the ring.
bool measure_shades(const reader &r, shade *white, shade *black) {
  *white = *black = shade{};
  for (int side = 0; side < 5; side++) {
    double a[2], b[2];
    wm_mr_vertex(side, a);
    wm_mr_vertex(side + 1, b);
    for (int i = 0; i < kSamples; i++) {
      const double t = (i + 0.5) / kSamples, x = a[0] + t * (b[0] - a[0]), y = a[1] + t * (b[1] - a[1]);
      constexpr double kRing = 0.5 * (1 + WM_MR_INNER), kRim = 1 + 0.9 * (1 - kRing);
      double grey;
      if (!r.grey(kRing * x, kRing * y, &grey)) return false;
      black->add(kRing * x, kRing * y, grey);
      if (!r.grey(kRim * x, kRim * y, &grey)) return false;
      white->add(kRim * x, kRim * y, grey);
    }
  }
  return white->solve() && black->solve();
}

// Whether the tip has its black module, and the two nearest vertices have none.
bool points_up(const reader &r, const shade &white, const shade &black, double turn_sin, double turn_cos) {
  for (int k = -1; k <= 1; k++) {
    const double s = k * turn_sin, c = k == 0 ? 1 : turn_cos, x = -s * WM_MR_TIP_Y, y = c * WM_MR_TIP_Y;
    double grey;
    if (!r.module(x, y, &grey)) return false;
    const bool is_black = grey < 0.5 * (white.at(x, y) + black.at(x, y));
    if (is_black != (k == 0)) return false;
  }
  return true;
}

// Level of each module between black (-0.5) and white (0.5).
bool read_modules(const reader &r, const shade &white, const shade &black, double level[64]) {
  for (int i = 0; i < 64; i++) {
    const int column = i % 8, row = i / 8;
    const double x = WM_MR_CODE_LEFT + (column + 0.5) * WM_MR_MODULE, y = WM_MR_CODE_TOP + (row + 0.5) * WM_MR_MODULE;
    double grey;
    if (!r.module(x, y, &grey)) return false;
    const double low = black.at(x, y), high = white.at(x, y);
    if (!(high - low > kContrastMin_grey)) return false;
    level[i] = (grey - 0.5 * (low + high)) / (high - low);
  }
  return true;
}

uint64_t decide(const double level[64], double sharpen) {
  uint64_t modules = 0;
  for (int i = 0; i < 64; i++) {
    const int x = i % 8, y = i / 8;
    double around = 0;
    int count = 0;
    const auto add = [&](bool there, int k) {
      if (there) around += level[k], count++;
    };
    add(x > 0, i - 1);
    add(x < 7, i + 1);
    add(y > 0, i - 8);
    add(y < 7, i + 8);
    if (level[i] + sharpen * (count * level[i] - around) < 0) modules |= UINT64_C(1) << i;
  }
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
verdict read_at(reader *r, const double outline[5][2], const tangent_point corner[5], int tip, uint32_t id_max,
                int contrast, mr_reading *out) {
  tangent_point rotated[5];
  for (int i = 0; i < 5; i++) rotated[i] = corner[(tip + i) % 5];
  if (!homography_init(&r->h, outline, rotated, 5)) return verdict::kNoMarker;
  if (tip == 0 && !is_regular(r->h, outline, rotated)) return verdict::kNoMarker;  // the same for each vertex
  shade white, black;
  if (!measure_shades(*r, &white, &black) || white.at(0, 0) - black.at(0, 0) < contrast) return verdict::kNoMarker;
  const double turn_sin = outline[1][0] / WM_MR_CIRCUMRADIUS, turn_cos = -outline[1][1] / WM_MR_CIRCUMRADIUS;
  if (!points_up(*r, white, black, turn_sin, turn_cos)) return verdict::kNextVertex;
  double level[64];
  if (!read_modules(*r, white, black, level)) return verdict::kNoMarker;
  out->tip = tip;
  return decode(level, id_max, out) ? verdict::kRead : verdict::kNextVertex;
}

}  // namespace

bool mr_read(const tangent_view &view, const wm_frame &frame, const tangent_point corner[5], uint32_t id_max,
             int contrast, mr_reading *out) {
  double outline[5][2];
  for (int i = 0; i < 5; i++) wm_mr_vertex(i, outline[i]);
  reader r = {view, frame, {}};
  for (int tip = 0; tip < 5; tip++) {
    const verdict result = read_at(&r, outline, corner, tip, id_max, contrast, out);
    if (result != verdict::kNextVertex) return result == verdict::kRead;
  }
  return false;
}

}  // namespace wm
