// SPDX-License-Identifier: Apache-2.0
#include "vision/stereo/patch.hpp"

#include <initializer_list>

#include "math/eigen.hpp"

namespace wm {
namespace {

constexpr int kMiddle = 1020;  // of 0 to 2040, eighths of a grey level
constexpr int kSourceSide = kPatch + 2;
constexpr double kPivotMin = 1e-4;                 // of Cholesky, relative: below, a direction has no contrast
constexpr double kGainMin = 0.1, kGainMax = 10.0;  // contrast against the template's
constexpr double kFarthest_px = 1e6;               // coordinates that fit the integers
constexpr double kWarpMax = 4.0;                   // element of a warp: its fixed-point numbers fit 32 bits

// A place in 1/16 px: whole column and row, and the remainders to the right and down.
struct place16 {
  int32_t column, row, right, down;
};

place16 place_of(const pixel &at) {
  const auto u = static_cast<int32_t>(std::floor(at.u * 16 + 0.5)),
             v = static_cast<int32_t>(std::floor(at.v * 16 + 0.5));
  return {u >> 4, v >> 4, u & 15, v & 15};
}

bool is_near(const pixel &at) {
  return at.u > -kFarthest_px && at.u < kFarthest_px && at.v > -kFarthest_px && at.v < kFarthest_px;
}

// Samples the patch about a place, bilinear in steps of 1/16 px. False where it leaves the picture.
bool sample(const grey_plane &picture, const place16 &at, int16_t *out) {
  const int32_t left = at.column - kPatchHalf, top = at.row - kPatchHalf;
  if (left < 0 || top < 0 || left + kPatch >= picture.width || top + kPatch >= picture.height) return false;
  const auto fx = static_cast<uint16_t>(at.right), fy = static_cast<uint16_t>(at.down);
  const auto cx = static_cast<uint16_t>(16 - fx), cy = static_cast<uint16_t>(16 - fy);
  uint16_t rows[2][kPatch];
  for (int i = 0; i <= kPatch; i++) {
    const uint8_t *from = picture.grey + static_cast<size_t>(top + i) * static_cast<size_t>(picture.width) + left;
    uint16_t *now = rows[i & 1];
    for (int j = 0; j < kPatch; j++) now[j] = static_cast<uint16_t>(from[j] * cx + from[j + 1] * fx);
    if (i == 0) continue;
    const uint16_t *before = rows[(i - 1) & 1];
    int16_t *to = out + (i - 1) * kPatch;
    for (int j = 0; j < kPatch; j++) {
      const auto sum = static_cast<uint16_t>(before[j] * cy + now[j] * fy);  // at most 255 * 256
      to[j] = static_cast<int16_t>((sum >> 5) - kMiddle);
    }
  }
  return true;
}

int32_t sum_of(const int16_t *a) {
  int32_t sum = 0;
  for (int i = 0; i < kPatchPixels; i++) sum += a[i];
  return sum;
}

int32_t sum_of(const int16_t *a, const int16_t *b) {
  int32_t sum = 0;
  for (int i = 0; i < kPatchPixels; i++) sum += a[i] * b[i];
  return sum;
}

// Fit of the template to a picture's patch.
struct template_fit {
  double gain, step_u, step_v;  // contrast; Gauss-Newton step of the place, px
  double fit, residual;         // explained fraction of the variance; the rest, squared eighths of a grey level
};

bool compare(const patch_template &what, const int16_t *patch, template_fit *out) {
  constexpr double n = kPatchPixels;
  const double mean = sum_of(patch) / n;
  const double variance = sum_of(patch, patch) - n * mean * mean;
  const double right[3] = {sum_of(what.grey, patch) - n * what.mean[0] * mean,
                           sum_of(what.across, patch) - n * what.mean[1] * mean,
                           sum_of(what.down, patch) - n * what.mean[2] * mean};
  double x[3];
  for (int i = 0; i < 3; i++)
    x[i] = what.inverse[i][0] * right[0] + what.inverse[i][1] * right[1] + what.inverse[i][2] * right[2];
  if (!(x[0] > kGainMin) || !(x[0] < kGainMax) || !(variance > 0.0)) return false;
  const double explained = x[0] * right[0] + x[1] * right[1] + x[2] * right[2];
  *out = {x[0], -x[1] / x[0], -x[2] / x[0], explained / variance, variance - explained};
  return true;
}

}  // namespace

namespace {

// Grey levels of the warped patch and a border of one pixel, in eighths. False where it leaves the picture.
bool sample_warped(const grey_plane &picture, const pixel &at, const warp2 &warp,
                   int16_t source[kSourceSide][kSourceSide]) {
  constexpr double kOne = 65536.0;  // fixed-point numbers with 16 bits behind the point
  constexpr int kHalf = kSourceSide / 2;
  const auto fixed = [](double x) { return static_cast<int32_t>(std::floor(x * kOne + 0.5)); };
  const int32_t uu = fixed(warp.uu), uv = fixed(warp.uv), vu = fixed(warp.vu), vv = fixed(warp.vv);
  const auto whole_u = static_cast<int32_t>(std::floor(at.u)), whole_v = static_cast<int32_t>(std::floor(at.v));
  const int32_t u0 = fixed(at.u - whole_u), v0 = fixed(at.v - whole_v);
  for (const int i : {-kHalf, kHalf - 1})
    for (const int j : {-kHalf, kHalf - 1}) {
      const int32_t u = whole_u + ((u0 + uu * j + uv * i) >> 16), v = whole_v + ((v0 + vu * j + vv * i) >> 16);
      if (u < 0 || v < 0 || u + 1 >= picture.width || v + 1 >= picture.height) return false;
    }
  for (int i = 0; i < kSourceSide; i++)
    for (int j = 0; j < kSourceSide; j++) {
      const int32_t u = u0 + uu * (j - kHalf) + uv * (i - kHalf), v = v0 + vu * (j - kHalf) + vv * (i - kHalf);
      const uint8_t *from = picture.grey +
                            static_cast<ptrdiff_t>(whole_v + (v >> 16)) * static_cast<ptrdiff_t>(picture.width) +
                            whole_u + (u >> 16);
      const int32_t fx = (u >> 8) & 255, fy = (v >> 8) & 255;
      const int32_t above = from[0] * (256 - fx) + from[1] * fx;
      const int32_t below = from[picture.width] * (256 - fx) + from[picture.width + 1] * fx;
      source[i][j] = static_cast<int16_t>(((above * (256 - fy) + below * fy) >> 13) - kMiddle);
    }
  return true;
}

}  // namespace

bool make_template(const grey_plane &picture, const pixel &at, const warp2 &warp, patch_template *out) {
  if (!is_near(at)) return false;
  for (const double w : {warp.uu, warp.uv, warp.vu, warp.vv})
    if (!(w > -kWarpMax && w < kWarpMax)) return false;
  int16_t source[kSourceSide][kSourceSide];
  if (!sample_warped(picture, at, warp, source)) return false;
  for (int i = 0; i < kPatch; i++)
    for (int j = 0; j < kPatch; j++) {
      const int at_pixel = i * kPatch + j;
      out->grey[at_pixel] = source[i + 1][j + 1];
      out->across[at_pixel] = static_cast<int16_t>((source[i + 1][j + 2] - source[i + 1][j]) / 2);
      out->down[at_pixel] = static_cast<int16_t>((source[i + 2][j + 1] - source[i][j + 1]) / 2);
    }
  constexpr double n = kPatchPixels;
  const int16_t *column[3] = {out->grey, out->across, out->down};
  double sums[3][3];
  for (int i = 0; i < 3; i++) out->mean[i] = sum_of(column[i]) / n;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      sums[i][j] = j < i ? sums[j][i] : sum_of(column[i], column[j]) - n * out->mean[i] * out->mean[j];
  matrix<3> inverse;
  if (!(sums[0][0] > n && sums[1][1] > n && sums[2][2] > n) || !invert_positive<3>(map(sums), &inverse, kPivotMin))
    return false;
  map(out->inverse) = inverse;
  return true;
}

bool align(const patch_template &what, const grey_plane &picture, const pixel &start, double reach_px, int rounds,
           alignment *out) {
  alignas(16) int16_t patch[kPatchPixels];
  if (!is_near(start)) return false;
  pixel at = start;
  place16 place = place_of(at);
  template_fit like;
  for (int round = 0;; round++) {
    if (!sample(picture, place, patch) || !compare(what, patch, &like)) return false;
    // A step is at most as long as the linearisation holds.
    const double size = std::sqrt(like.step_u * like.step_u + like.step_v * like.step_v);
    const double scale = size > 2.0 ? 2.0 / size : 1.0;
    at = {place.column + place.right / 16.0 + scale * like.step_u, place.row + place.down / 16.0 + scale * like.step_v};
    if (!(std::fabs(at.u - start.u) <= reach_px) || !(std::fabs(at.v - start.v) <= reach_px)) return false;
    const place16 next = place_of(at);
    const bool stays =
        next.column == place.column && next.row == place.row && next.right == place.right && next.down == place.down;
    if (stays || round + 1 >= rounds) break;
    place = next;
  }
  if (!(std::fabs(like.step_u) < 0.5) || !(std::fabs(like.step_v) < 0.5)) return false;  // not settled
  const double left = like.residual > 0.0 ? like.residual : 0.0;
  const double worse = what.inverse[1][1] > what.inverse[2][2] ? what.inverse[1][1] : what.inverse[2][2];
  *out = {at, like.fit, std::sqrt(left / (kPatchPixels - 4) * worse) / like.gain};
  return true;
}

bool fit_slopes(const patch_template &what, const grey_plane &picture, const pixel &at, double slope[2]) {
  constexpr int kColumns = 5;
  constexpr double n = kPatchPixels;
  int16_t patch[kPatchPixels];
  if (!is_near(at) || !sample(picture, place_of(at), patch)) return false;
  double sums[kColumns][kColumns] = {}, right[kColumns] = {}, mean[kColumns] = {}, mean_patch = 0;
  for (int i = 0; i < kPatch; i++)
    for (int j = 0; j < kPatch; j++) {
      const int k = i * kPatch + j;
      const double u = j - kPatchHalf, v = i - kPatchHalf, across = what.across[k];
      const double column[kColumns] = {static_cast<double>(what.grey[k]), across, static_cast<double>(what.down[k]),
                                       across * u, across * v};
      for (int a = 0; a < kColumns; a++) {
        mean[a] += column[a] / n;
        right[a] += column[a] * patch[k];
        for (int b = 0; b <= a; b++) sums[a][b] += column[a] * column[b];
      }
      mean_patch += patch[k] / n;
    }
  for (int a = 0; a < kColumns; a++) {
    right[a] -= n * mean[a] * mean_patch;
    for (int b = 0; b <= a; b++) sums[a][b] = sums[b][a] = sums[a][b] - n * mean[a] * mean[b];
  }
  matrix<kColumns> inverse;
  if (!invert_positive<kColumns>(map(sums), &inverse, kPivotMin)) return false;
  const vector<kColumns> x = inverse * map(right);
  if (!(x[0] > kGainMin)) return false;
  slope[0] = -x[3] / x[0];
  slope[1] = -x[4] / x[0];
  return true;
}

bool search_row(const patch_template &what, const grey_plane &picture, int32_t first, int32_t last, int32_t v,
                int32_t *u, double *best, double *second) {
  constexpr double n = kPatchPixels;
  constexpr int kApart_px = 2;          // half width of a correlation's peak
  constexpr int32_t kPlacesMax = 1024;  // of a search: more than any disparity
  float score[kPlacesMax];
  alignas(16) int16_t patch[kPatchPixels];
  const double own = sum_of(what.grey, what.grey) - n * what.mean[0] * what.mean[0];
  if (last - first >= kPlacesMax) first = last - kPlacesMax + 1;
  int32_t at = -1;
  for (int32_t i = 0; i <= last - first; i++) {
    score[i] = -1.0F;
    if (!sample(picture, {first + i, v, 0, 0}, patch)) continue;
    const double mean = sum_of(patch) / n;
    const double variance = sum_of(patch, patch) - n * mean * mean;
    const double product = sum_of(what.grey, patch) - n * what.mean[0] * mean;
    if (variance > n && product > 0.0) score[i] = static_cast<float>(product * product / (variance * own));
    if (at < 0 || score[i] > score[at]) at = i;
  }
  if (at < 0 || !(score[at] > 0.0F)) return false;
  *u = first + at;
  *best = static_cast<double>(score[at]);
  *second = 0.0;
  for (int32_t i = 0; i <= last - first; i++)
    if ((i < at - kApart_px || i > at + kApart_px) && static_cast<double>(score[i]) > *second)
      *second = static_cast<double>(score[i]);
  return true;
}

}  // namespace wm
