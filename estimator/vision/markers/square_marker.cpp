// SPDX-License-Identifier: Apache-2.0
#include "waymark/square_marker.h"

#include <bit>
#include <cstring>
#include <initializer_list>
#include <limits>

#include "vision/markers/outline.hpp"
#include "vision/markers/print_reader.hpp"
#include "waymark/marker_fit.h"

namespace wm {

namespace {

constexpr double kFalseMax = 2e-4;      // probability that a random pattern is a code: some clutter is square
constexpr int kCorrectedMax = 2;        // bits: more gain no recall on rendered views
constexpr double kRingWrongMax = 0.1;   // of the modules of the rings, which are known: blur, a finger. Not swept
constexpr double kRingUnreadMax = 0.2;  // of the same, beyond the picture's rim: about a corner. Not swept
// Corners of the ring's outer border, in parts of its size.
constexpr double kOutline[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
constexpr double kUnread = std::numeric_limits<double>::quiet_NaN();
constexpr int kModulesMax = WM_SQUARE_ACROSS_MAX * WM_SQUARE_ACROSS_MAX;

enum module_kind : int8_t { kOther, kBlack, kWhite };

}  // namespace

}  // namespace wm

struct wm_square_reader {
  wm::outline_work outlines;
  wm_marker_fit *fit;
  uint64_t *codes;
  uint32_t count;
  int32_t border, across, bits, corrected, contrast_min;
  bool is_white_inside, half_turned;
  wm::module_kind kind[wm::kModulesMax];
  uint8_t place[4][WM_SQUARE_BITS_MAX];  // module of each bit, by quarter turns of the print
};

namespace wm {

namespace {

size_t lay_out(wm_square_reader *self, uint32_t codes, bool is_counting) {
  memory_layout memory(is_counting ? nullptr : self, sizeof *self);
  uint8_t *fit = memory.take<uint8_t>(wm_marker_fit_bytes());
  uint64_t *copy = memory.take<uint64_t>(codes);
  outline_place(&self->outlines, &memory, is_counting);
  if (is_counting) return memory.bytes();
  self->fit = reinterpret_cast<wm_marker_fit *>(fit);
  self->codes = copy;
  return memory.bytes();
}

// Module (x, y) of the ring's square as a place in the whole code's grid.
int place_of(const wm_square_reader &self, int x, int y) {
  const int beside = (self.across - self.border) / 2;
  return (y + beside) * self.across + x + beside;
}

void lay_out_modules(wm_square_reader *self, const wm_square_family &family) {
  const int last = self->border - 1;
  const auto ring = [&](int from, int to, module_kind kind) {
    for (int i = from; i <= to; i++)
      for (const int k : {from, to}) self->kind[place_of(*self, i, k)] = self->kind[place_of(*self, k, i)] = kind;
  };
  ring(0, last, self->is_white_inside ? kWhite : kBlack);
  if (self->is_white_inside) ring(-1, last + 1, kBlack);
  for (int i = 0; i < self->bits; i++)
    for (int turns = 0, x = family.x[i], y = family.y[i]; turns < 4; turns++) {
      self->place[turns][i] = static_cast<uint8_t>(place_of(*self, x, y));
      const int right = x;  // a quarter turn clockwise
      x = last - y;
      y = right;
    }
}

bool is_good(const wm_square_family &f) {
  const int beside = (f.across - f.border) / 2;
  if (f.border < 3 || f.across > WM_SQUARE_ACROSS_MAX || f.across != f.border + 2 * beside || f.bits < 1 ||
      f.bits > WM_SQUARE_BITS_MAX || f.count < 1 || beside < (f.is_white_inside ? 1 : 0))
    return false;
  for (int i = 0; i < f.bits; i++)
    if (f.x[i] < -beside || f.y[i] < -beside || f.x[i] >= f.border + beside || f.y[i] >= f.border + beside)
      return false;
  return true;
}

// Levels of all modules; NaN for a ring's module outside of the picture. False where a module of the code is outside or
// has no contrast.
bool read_levels(const wm_square_reader &self, print_reader *r, double *level) {
  const double module_size = r->module_size;
  const double ring = 1 - module_size, rim = 1 + module_size;  // middles of both rings
  if (!r->measure_shades(kOutline, 4, self.is_white_inside ? ring : rim, self.is_white_inside ? rim : ring) ||
      r->white.at(0, 0) - r->black.at(0, 0) < self.contrast_min)
    return false;
  const double middle = 0.5 * (self.across - 1);
  for (int y = 0; y < self.across; y++)
    for (int x = 0; x < self.across; x++) {
      const int i = y * self.across + x;
      if (r->level((x - middle) * module_size, (y - middle) * module_size, &level[i])) continue;
      if (self.kind[i] == kOther) return false;
      level[i] = kUnread;
    }
  return true;
}

// Gives ring modules that were not read the level they are printed with. False where these are too many.
bool complete_rings(const wm_square_reader &self, double *level) {
  int known = 0, unread = 0;
  for (int i = 0; i < self.across * self.across; i++) {
    if (self.kind[i] == kOther) continue;
    known++;
    if (level[i] == level[i]) continue;
    unread++;
    level[i] = self.kind[i] == kBlack ? -0.5 : 0.5;
  }
  return unread <= kRingUnreadMax * known;
}

// Whether the rings are black and white where they must be.
bool has_rings(const wm_square_reader &self, const bool *is_black) {
  int known = 0, wrong = 0;
  for (int i = 0; i < self.across * self.across; i++) {
    if (self.kind[i] == kOther) continue;
    known++;
    wrong += is_black[i] != (self.kind[i] == kBlack);
  }
  return wrong <= kRingWrongMax * known;
}

struct square_reading {
  int32_t id;
  int turns;  // quarter turns of the print clockwise in the view
};

// The nearest code, of equals the first.
bool nearest_code(const wm_square_reader &self, const bool *is_black, square_reading *out) {
  int least = self.corrected + 1;
  for (int turns = 0; turns < 4; turns++) {
    uint64_t word = 0;
    for (int i = 0; i < self.bits; i++) word = word << 1 | (is_black[self.place[turns][i]] ? 0U : 1U);
    for (uint32_t i = 0; i < self.count && least > 0; i++) {
      const int wrong = std::popcount(word ^ self.codes[i]);
      if (wrong < least) least = wrong, *out = {static_cast<int32_t>(i), turns};
    }
  }
  return least <= self.corrected;
}

bool read_code(const wm_square_reader &self, const tangent_view &view, const wm_frame &frame,
               const tangent_point corner[4], square_reading *out) {
  print_reader r = {view, frame, 1.0 / self.border, {}, {}, {}};
  double level[kModulesMax] = {};
  if (!homography_init(&r.h, kOutline, corner, 4) || !read_levels(self, &r, level) || !complete_rings(self, level))
    return false;
  for (const double sharpen : {kSharpen, 0.0}) {
    bool is_black[kModulesMax];
    for (int i = 0; i < self.across * self.across; i++) is_black[i] = is_black_module(level, self.across, i, sharpen);
    if (has_rings(self, is_black) && nearest_code(self, is_black, out)) return true;
  }
  return false;
}

bool read_region(wm_square_reader *self, const wm_frame &frame, uint32_t region, wm_marker *out) {
  tangent_view view;
  tangent_point corner[4];
  square_reading reading = {-1, 0};
  double corners_px[4][2];
  if (!find_outline(&self->outlines, region, 4, &view, corner) || !read_code(*self, view, frame, corner, &reading))
    return false;
  const int first = (reading.turns + (self->half_turned ? 2 : 0)) % 4;
  out->id = reading.id;
  return outline_in_picture(self->outlines, view, corner, 4, first, corners_px) &&
         wm_marker_fit_read(self->fit, &frame, corners_px, out);
}

}  // namespace

}  // namespace wm

int wm_square_corrected(const wm_square_family *family) {
  const double one = 4.0 * family->count / static_cast<double>(UINT64_C(1) << (family->bits - 1)) / 2;
  double patterns = 1, sum = 1;
  int corrected = 0;
  while (corrected < wm::kCorrectedMax && 2 * (corrected + 1) < family->distance) {
    patterns *= static_cast<double>(family->bits - corrected) / (corrected + 1);
    sum += patterns;
    if (sum * one > wm::kFalseMax) break;
    corrected++;
  }
  return corrected;
}

size_t wm_square_reader_bytes(const wm_camera *camera, const wm_square_family *family, const char **why) {
  wm_square_reader self;
  *why = wm::is_good(*family) ? wm::outline_init(&self.outlines, *camera) : "the family's modules are inconsistent";
  return *why ? 0 : wm::lay_out(&self, family->count, true);
}

const char *wm_square_reader_init(wm_square_reader *self, const wm_camera *camera, const wm_square_family *family,
                                  double size_m, int contrast_min) {
  std::memset(static_cast<void *>(self), 0, sizeof *self);
  const char *why = wm::outline_init(&self->outlines, *camera);
  if (why) return why;
  wm::lay_out(self, family->count, false);
  self->count = family->count;
  std::memcpy(self->codes, family->codes, family->count * sizeof *family->codes);
  self->border = family->border;
  self->across = family->across;
  self->bits = family->bits;
  self->corrected = wm_square_corrected(family);
  self->contrast_min = contrast_min;
  self->is_white_inside = family->is_white_inside != 0;
  self->half_turned = family->half_turned != 0;
  wm::lay_out_modules(self, *family);
  wm_marker_print print = {};
  print.size_m = size_m;
  print.corners = 4;
  std::memcpy(print.corner, wm::kOutline, sizeof wm::kOutline);
  print.is_white_inside = family->is_white_inside;
  print.other = 1 + (self->is_white_inside ? 2.0 : -2.0) / family->border;
  print.overlap = 0.5;  // of a code's modules half are white
  return wm_marker_fit_init(self->fit, camera, &print);
}

wm_status wm_square_reader_read(wm_square_reader *self, const wm_frame *frame, int32_t id_offset, wm_event *out,
                                size_t capacity, size_t *count) {
  *count = 0;
  if (frame->width_px != self->outlines.width_px || frame->height_px != self->outlines.height_px) return WM_BAD_DATA;
  const wm::dark_work &regions = self->outlines.regions;
  wm::find_regions(&self->outlines.regions, *frame, self->contrast_min, self->is_white_inside);
  const uint32_t runs = wm::run_count(regions);
  for (uint32_t i = 0; i < runs && *count < capacity; i++) {
    if (!wm::is_region(regions, i)) continue;
    wm_event *event = &out[*count];
    std::memset(static_cast<void *>(event), 0, WM_EVENT_SMALL_BYTES);
    if (!wm::read_region(self, *frame, i, &event->as.marker)) continue;
    event->t_ns = frame->t_ns;
    event->kind = WM_EVENT_MARKER;
    event->as.marker.id += id_offset;
    ++*count;
  }
  return WM_OK;
}
