// SPDX-License-Identifier: Apache-2.0
#include "vision/lines/polar.hpp"

#include <cstring>

namespace wm {

namespace {

constexpr double kMargin_px = 1.0;                    // for the four pixels of the bilinear interpolation
constexpr int kProbes = 64;                           // azimuths at which a row's scale is measured
constexpr double kProbe_rad = 1e-3;                   // step of the numerical derivative: below a pixel
constexpr double kFine_px = 0.65, kMiddle_px = 0.33;  // px a column from which 2 or 4 columns are averaged, else 8

bool pixel_at(const mounted_camera &camera, double azimuth, double elevation, double margin_px, pixel *out) {
  const sin_cos a = sincos(azimuth), e = sincos(elevation);
  return pixel_of(camera, camera.centre_m + vec3{e.cos * a.cos, e.cos * a.sin, e.sin}, margin_px, out);
}

// Scale of the picture along azimuth (or elevation), px/rad: the mean over the visible part of a row. 0: not visible.
double px_per_rad(const mounted_camera &camera, double elevation, bool along_row) {
  double sum = 0;
  int count = 0;
  for (int i = 0; i < kProbes; i++) {
    const double azimuth = (i + 0.5) * kTwoPi / kProbes;
    pixel a, b;
    if (!pixel_at(camera, azimuth, elevation, kMargin_px, &a) ||
        !pixel_at(camera, azimuth + (along_row ? kProbe_rad : 0), elevation + (along_row ? 0 : kProbe_rad), kMargin_px,
                  &b))
      continue;
    sum += std::sqrt(square(b.u - a.u) + square(b.v - a.v)) / kProbe_rad;
    count++;
  }
  return count > 0 ? sum / count : 0;
}

// Calls take(elevation, px/rad of azimuth) for each row that is visible.
template <class Take>
void each_row(const mounted_camera &camera, const wm_lines_params &params, Take take) {
  int count = 0;
  for (int r = 0; count < kPolarRowsMax; r++) {
    const double elevation = params.elevation_min_rad + r * kRowStep_rad;
    if (elevation > params.elevation_max_rad || elevation > kHalfPi - kRowStep_rad) break;
    const double scale = px_per_rad(camera, elevation, true);
    if (!(scale > 0)) continue;
    take(elevation, scale);
    count++;
  }
}

}  // namespace

const char *polar_size(const mounted_camera &camera, const wm_lines_params &params, polar_view *out) {
  *out = polar_view{};
  double largest = 0;
  each_row(camera, params, [&](double, double scale) {
    out->rows++;
    if (scale > largest) largest = scale;
  });
  if (out->rows * kRowStep_rad < kLengthMin_rad)
    return "the camera sees too little between elevation_min_rad and elevation_max_rad: is its mounting right?";
  const int wanted = static_cast<int>(kTwoPi * largest) / 16 * 16;
  out->columns = wanted < 256 ? 256 : wanted > kPolarColumnsMax ? kPolarColumnsMax : wanted;
  out->step_rad = kTwoPi / out->columns;
  return nullptr;
}

void polar_make(const mounted_camera &camera, const wm_lines_params &params, polar_view *out) {
  int r = 0;
  each_row(camera, params, [&](double elevation, double scale) {
    polar_row &row = out->row[r];
    row.elevation_rad = elevation;
    row.tan = tan(elevation);
    row.px_per_column = scale * out->step_rad;
    row.half = row.px_per_column > kFine_px ? 2 : row.px_per_column > kMiddle_px ? 4 : 8;
    picture_sample *samples = out->table + static_cast<size_t>(r) * static_cast<size_t>(out->columns);
    // A place outside of the picture repeats the last one inside: the end of the view is no edge.
    int last = -1;
    for (int pass = 0; pass < 2; pass++)
      for (int c = 0; c < out->columns; c++) {
        pixel at;
        if (pixel_at(camera, out->azimuth_of(c), elevation, kMargin_px, &at)) {
          samples[c] = sample_of(at);
          last = c;
        } else if (last >= 0) {
          samples[c] = samples[last];
        }
      }
    r++;
  });
  out->row_px = px_per_rad(camera, out->row[out->rows / 2].elevation_rad, false) * kRowStep_rad;
}

void polar_fill(polar_view *view, const wm_frame &frame) {
  for (int r = 0; r < view->rows; r++) {
    const picture_sample *samples = view->table + static_cast<size_t>(r) * static_cast<size_t>(view->columns);
    int16_t *out = view->line(r);
    for (int c = 0; c < view->columns; c++) out[c] = static_cast<int16_t>((grey_of(frame, samples[c]) + 2048) >> 12);
    std::memcpy(out - kPolarPad, out + view->columns - kPolarPad, kPolarPad * sizeof(int16_t));
    std::memcpy(out + view->columns, out, kPolarPad * sizeof(int16_t));
  }
}

}  // namespace wm
