// SPDX-License-Identifier: Apache-2.0
#include "vision/landmarks/appearance.hpp"

#include <cstring>

namespace wm {
namespace {

constexpr int kSamplesMin = 3, kSamplesMax = 8;  // per pixel and axis: against aliasing of a slanted picture
constexpr double kFootprintMax = 1.4;            // learnt pixels per sample, above which a smaller size is read

struct picture_size {
  int columns, rows;
};

// Sizes of the pyramid, the first one with sides of at most kSideMax.
int kept_sizes(uint32_t width_px, uint32_t height_px, int *skipped, picture_size out[appearance::kSizes]) {
  int columns = static_cast<int>(width_px), rows = static_cast<int>(height_px);
  *skipped = 0;
  for (; columns > appearance::kSideMax || rows > appearance::kSideMax; (*skipped)++)
    columns = columns > 1 ? columns / 2 : 1, rows = rows > 1 ? rows / 2 : 1;
  int count = 0;
  while (count < appearance::kSizes && columns >= 1 && rows >= 1) {
    out[count++] = {columns, rows};
    if (columns < 4 || rows < 4) break;
    columns /= 2, rows /= 2;
  }
  return count;
}

size_t area(const picture_size &size) { return static_cast<size_t>(size.columns) * static_cast<size_t>(size.rows); }

// Mean of each square of `factor` pixels.
void shrink(const uint8_t *from, int stride, const picture_size &from_size, int factor, const picture_size &to_size,
            uint8_t *to) {
  for (int y = 0; y < to_size.rows; y++)
    for (int x = 0; x < to_size.columns; x++) {
      int32_t sum = 0, count = 0;
      for (int i = y * factor; i < (y + 1) * factor && i < from_size.rows; i++)
        for (int j = x * factor; j < (x + 1) * factor && j < from_size.columns; j++, count++)
          sum += from[i * stride + j];
      to[y * to_size.columns + x] = static_cast<uint8_t>((sum + count / 2) / count);
    }
}

// A ray's place in the learnt picture at its largest size. False beside it.
struct picture_place {
  double x, y;
};
bool place_of(const appearance &what, const mat3 &plane, const vec3 &ray, picture_place *out) {
  const vec3 q = plane * ray;
  if (!(q.z > 1e-6)) return false;
  const double a = q.x / q.z / what.width_m, b = q.y / q.z / what.height_m;
  *out = {(a + 0.5) * what.columns[0] - 0.5, (0.5 - b) * what.rows[0] - 0.5};
  return a >= -0.5 && a <= 0.5 && b >= -0.5 && b <= 0.5;
}

struct sampling {
  int across, down;  // samples per pixel
  int size;          // of the learnt pyramid
};

// Number of samples and size of the pyramid: neither aliased along the slanted axis nor blurred along the other one.
sampling sampling_at(const appearance &what, const mat3 &plane, const ray_table &rays, const pixel &at,
                     double step_px) {
  picture_place here{}, right{}, below{};
  (void)place_of(what, plane, rays.at(at.u, at.v), &here);
  (void)place_of(what, plane, rays.at(at.u + step_px, at.v), &right);
  (void)place_of(what, plane, rays.at(at.u, at.v + step_px), &below);
  const double u = std::sqrt(square(right.x - here.x) + square(right.y - here.y)),
               v = std::sqrt(square(below.x - here.x) + square(below.y - here.y));
  const double least = larger(u < v ? u : v, 1e-3);
  const auto samples = [&](double footprint) {
    const double wanted = kSamplesMin * footprint / least;
    return wanted >= kSamplesMax ? kSamplesMax : wanted <= kSamplesMin ? kSamplesMin : static_cast<int>(wanted + 0.5);
  };
  sampling out = {samples(u), samples(v), 0};
  double footprint = larger(u / out.across, v / out.down);
  for (; footprint > kFootprintMax && out.size + 1 < what.sizes; footprint *= 0.5) out.size++;
  return out;
}

// Variance of the blur by the pyramid's 1-2-1 filters below this level and by the lens, px^2 of the level. The box
// average over a pixel (1/12) is in the samples already.
double blur_variance(int level, double blur_px) {
  double halving = 0, shrunk = 1;
  for (int i = 0; i < level; i++) halving = 0.25 * (halving + 0.5), shrunk *= 0.25;
  const double missing = halving + (square(blur_px) + 1.0 / 12) * shrunk - 1.0 / 12;
  return larger(missing, 0);
}

// Smooths rows, then columns, by (a, 1 - 2a, a) over the pixels inside.
void smooth(double a, drawn_view *r) {
  const auto at = [](int x, int y) { return y * drawn_view::kSide + x; };
  const auto one = [&](const float *from, float *to, int x, int y, int step, bool before, bool after) {
    const int k = at(x, y);
    if (!r->inside[k]) return;
    double sum = (1 - 2 * a) * static_cast<double>(from[k]), weight = 1 - 2 * a;
    if (before && r->inside[k - step]) sum += a * static_cast<double>(from[k - step]), weight += a;
    if (after && r->inside[k + step]) sum += a * static_cast<double>(from[k + step]), weight += a;
    to[k] = static_cast<float>(sum / weight);
  };
  for (int y = 0; y < r->height; y++)
    for (int x = 0; x < r->width; x++) one(r->grey, r->work, x, y, 1, x > 0, x + 1 < r->width);
  for (int y = 0; y < r->height; y++)
    for (int x = 0; x < r->width; x++) one(r->work, r->grey, x, y, drawn_view::kSide, y > 0, y + 1 < r->height);
}

// Standard deviation of the grey levels, and their integers for the search.
void finish(drawn_view *r) {
  double sum = 0, squares = 0;
  for (int y = 0; y < r->height; y++)
    for (int x = 0; x < r->width; x++) {
      const int k = y * drawn_view::kSide + x;
      if (!r->inside[k]) continue;
      sum += static_cast<double>(r->grey[k]);
      squares += square(static_cast<double>(r->grey[k]));
    }
  const double mean = sum / r->count;
  r->spread_grey = std::sqrt(larger(squares / r->count - mean * mean, 0));
  r->energy = 0;
  for (int y = 0; y < r->height; y++)
    for (int x = 0; x < r->width; x++) {
      const int k = y * drawn_view::kSide + x;
      if (!r->inside[k]) continue;
      r->level[k] = static_cast<int16_t>(std::floor(4 * (static_cast<double>(r->grey[k]) - mean) + 0.5));
      r->energy += r->level[k] * r->level[k];
    }
}

}  // namespace

size_t appearance::bytes(uint32_t width_px, uint32_t height_px) {
  picture_size sizes[kSizes];
  int skipped;
  const int count = kept_sizes(width_px, height_px, &skipped, sizes);
  size_t sum = 0;
  for (int i = 0; i < count; i++) sum += area(sizes[i]);
  return sum;
}

void appearance::make(const wm_appearance &learnt, const wm_landmark &landmark, uint8_t *memory) {
  *this = appearance{};
  id = landmark.id;
  place_m = vec_of(landmark.p_m);
  sigma_m = finite(landmark.sigma_m) ? landmark.sigma_m : 0.0;
  width_m = learnt.width_m;
  height_m = learnt.height_m;
  yaw_rad = learnt.yaw_rad;
  picture_size kept[kSizes];
  int skipped;
  sizes = kept_sizes(learnt.width_px, learnt.height_px, &skipped, kept);
  for (int i = 0; i < sizes; i++) {
    columns[i] = kept[i].columns;
    rows[i] = kept[i].rows;
    grey[i] = memory;
    memory += area(kept[i]);
    if (i == 0)
      shrink(learnt.grey, static_cast<int>(learnt.width_px),
             {static_cast<int>(learnt.width_px), static_cast<int>(learnt.height_px)}, 1 << skipped, kept[0], grey[0]);
    else
      shrink(grey[i - 1], columns[i - 1], kept[i - 1], 2, kept[i], grey[i]);
  }
}

double grey_of(const appearance &what, int size, double x, double y) {
  const double scale = 1.0 / (1 << size);
  x = (x + 0.5) * scale - 0.5;
  y = (y + 0.5) * scale - 0.5;
  const int columns = what.columns[size], rows = what.rows[size];
  x = x < 0 ? 0 : x > columns - 1 ? columns - 1 : x;
  y = y < 0 ? 0 : y > rows - 1 ? rows - 1 : y;
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const int right = column + 1 < columns ? 1 : 0, down = row + 1 < rows ? columns : 0;
  const double fx = x - column, fy = y - row;
  const uint8_t *p = what.grey[size] + row * columns + column;
  return (1 - fy) * ((1 - fx) * p[0] + fx * p[right]) + fy * ((1 - fx) * p[down] + fx * p[down + right]);
}

bool view_panel(const appearance &what, const mat3 &R_map_optical, const vec3 &eye_m, panel_view *out) {
  const sin_cos yaw = sincos(what.yaw_rad);
  const vec3 right = transposed_times(R_map_optical, {yaw.cos, yaw.sin, 0}),
             up = transposed_times(R_map_optical, {0, 0, 1});
  const vec3 m = transposed_times(R_map_optical, what.place_m - eye_m);
  out->middle = m;
  out->distance = length(m);
  const vec3 normal = cross(right, up);  // towards the reader
  const double behind = -dot(normal, m);
  out->facing = behind / out->distance;
  if (!(out->distance > 0.05) || !(std::fabs(out->facing) > 1e-3)) return false;
  // Inverse of the matrix with columns (right, up, middle); its determinant is -behind.
  const double scale = -1 / behind;
  const vec3 rows[3] = {scale * cross(up, m), scale * cross(m, right), scale * normal};
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) out->plane.m[i][k] = rows[i][k];
  return true;
}

namespace {

// Bounding box of the corners in pixels of the level; its middle in pixels of the picture. False: larger than kSide.
bool frame_view(const pixel corners[4], double step, drawn_view *out, pixel *middle) {
  double u0 = corners[0].u, u1 = u0, v0 = corners[0].v, v1 = v0;
  for (int i = 1; i < 4; i++) {
    u0 = corners[i].u < u0 ? corners[i].u : u0;
    u1 = larger(u1, corners[i].u);
    v0 = corners[i].v < v0 ? corners[i].v : v0;
    v1 = larger(v1, corners[i].v);
  }
  out->left = static_cast<int>(std::floor(u0 / step));
  out->top = static_cast<int>(std::floor(v0 / step));
  out->width = static_cast<int>(std::floor(u1 / step)) + 2 - out->left;
  out->height = static_cast<int>(std::floor(v1 / step)) + 2 - out->top;
  *middle = {0.5 * (u0 + u1), 0.5 * (v0 + v1)};
  return out->width <= drawn_view::kSide && out->height <= drawn_view::kSide;
}

// Mean over the samples of pixel (x, y) of the level. False where one of them is beside the landmark.
bool sample_pixel(const appearance &what, const mat3 &plane, const ray_table &rays, const sampling &by, int x, int y,
                  double step, float *out) {
  double sum = 0;
  for (int i = 0; i < by.down; i++)
    for (int j = 0; j < by.across; j++) {
      picture_place at;
      const double u = (x + (j + 0.5) / by.across - 0.5) * step, v = (y + (i + 0.5) / by.down - 0.5) * step;
      if (!place_of(what, plane, rays.at(u, v), &at)) return false;
      sum += grey_of(what, by.size, at.x, at.y);
    }
  *out = static_cast<float>(sum / (by.across * by.down));
  return true;
}

}  // namespace

bool draw(const appearance &what, const panel_view &view, const ray_table &rays, const pixel corners[4], int level,
          double blur_px, drawn_view *out) {
  const double step = 1 << level;
  pixel middle;
  if (!frame_view(corners, step, out, &middle)) return false;
  std::memset(out->level, 0, sizeof out->level);
  std::memset(out->inside, 0, sizeof out->inside);
  const sampling by = sampling_at(what, view.plane, rays, middle, step);
  out->count = 0;
  for (int y = 0; y < out->height; y++)
    for (int x = 0; x < out->width; x++) {
      const int k = y * drawn_view::kSide + x;
      if (!sample_pixel(what, view.plane, rays, by, out->left + x, out->top + y, step, &out->grey[k])) continue;
      out->inside[k] = -1;
      out->count++;
    }
  if (out->count == 0) return false;
  const double variance = blur_variance(level, blur_px);
  for (double left = variance; left > 1e-3; left -= 0.5) smooth(0.5 * (left < 0.5 ? left : 0.5), out);
  finish(out);
  return true;
}

}  // namespace wm
