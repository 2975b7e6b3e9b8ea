// SPDX-License-Identifier: Apache-2.0
#include "vision/landmarks/global_search.hpp"

#include <cstring>

#include "math/elementary.hpp"

namespace wm {
namespace {

constexpr int kLanes = 16, kColumnsMax = 2 * kLanes, kRowsMax = 16, kRowsMin = 5, kColumnsMin = 4;  // of a template, px
constexpr double kArea_px2 = 90;      // of a template that is not slanted: fewer pixels are ambiguous. Not swept
constexpr double kAspectMax = 2.5;    // of such a template: wide boards keep enough rows for their letters
constexpr double kLikenessMin = 0.6;  // normalised correlation of a hypothesis. Not swept
constexpr double kMargin = 0.2;       // correlation of every second place below that wanted, whose neighbours are tried
constexpr double kSpread_grey = 5;    // smallest standard deviation: below it there is noise alone
constexpr double kRankPenalty = 0.05;  // likeness lost by each further place of one landmark, so that others get a turn
constexpr int kPerLandmark = 3;        // places kept of one landmark
constexpr double kHalfStep = 0.13;     // half of a cylinder's step in distance (panorama::kCoarser)
constexpr double kNearest_m = 1;       // of a hypothesis: nearer landmarks fill the picture
constexpr double kTemplateStep_rad = 0.015;  // of the template's pixels: perspective of a middle distance
// Cosines of the slants that are searched: in geometric steps as the cylinders.
constexpr double kFacing[] = {0.97, 0.78, 0.62, 0.5, 0.4, 0.32, 0.25};

// Size of a landmark's template on a cylinder.
struct template_size {
  int rows;
  double middle_row;  // of its middle above the horizon
};

template_size size_of(double width_m, double height_m, double above_m) {
  const double aspect = width_m / height_m, limited = aspect < kAspectMax ? aspect : kAspectMax;
  int rows = static_cast<int>(std::sqrt(kArea_px2 / limited) + 0.5);
  rows = rows < kRowsMin ? kRowsMin : rows > kRowsMax ? kRowsMax : rows;
  return {rows, rows * above_m / height_m};
}

struct cylinder_template {
  int rows, columns;
  int64_t energy;                         // sum of squares of `level`
  int16_t level[kRowsMax * kColumnsMax];  // 1/4 grey levels about the mean; 0 beside
};

// Draws the landmark on a cylinder, its right side farther away by the slant. Perspective depends on the distance only
// weakly: a middle one is used for all.
bool draw_template(const appearance &what, const template_size &shape, double height_m, double facing,
                   cylinder_template *out) {
  out->rows = shape.rows;
  const double pixel_m = what.height_m / shape.rows, distance_m = pixel_m / kTemplateStep_rad,
               wanted = what.width_m * facing / pixel_m;
  out->columns = wanted >= kColumnsMax ? kColumnsMax : static_cast<int>(wanted + 0.5);  // of a wider one, its middle
  if (out->columns < kColumnsMin) return false;
  const double across = std::sqrt(1 - facing * facing);
  const int right = static_cast<int>(2 / facing + 0.5), down = 2;
  int size = 0;
  while (size + 1 < what.sizes && what.rows[0] > 3 * (out->rows << size)) size++;
  std::memset(out->level, 0, sizeof out->level);
  double grey[kRowsMax * kColumnsMax], sum = 0;
  for (int x = 0; x < out->columns; x++) {
    double to_right[16], away[16];
    for (int j = 0; j < right; j++) {
      const sin_cos a = sincos(-(x + (j + 0.5) / right - 0.5 * out->columns) * kTemplateStep_rad);
      const double toward = facing * a.cos + across * a.sin;
      away[j] = toward > 0.05 ? distance_m * facing / toward : distance_m;
      to_right[j] = (away[j] * a.cos - distance_m) * across - away[j] * a.sin * facing;
    }
    for (int y = 0; y < out->rows; y++) {
      double mean = 0;
      for (int i = 0; i < down; i++) {
        const double tangent = (shape.middle_row - (y + (i + 0.5) / down - 0.5 * out->rows)) * kTemplateStep_rad;
        for (int j = 0; j < right; j++)
          mean += grey_of(what, size, (to_right[j] / what.width_m + 0.5) * what.columns[0] - 0.5,
                          (0.5 - (away[j] * tangent - height_m) / what.height_m) * what.rows[0] - 0.5);
      }
      sum += grey[y * kColumnsMax + x] = mean / (right * down);
    }
  }
  out->energy = 0;
  sum /= out->rows * out->columns;
  for (int y = 0; y < out->rows; y++)
    for (int x = 0; x < out->columns; x++) {
      int16_t &level = out->level[y * kColumnsMax + x];
      level = static_cast<int16_t>(std::floor(4 * (grey[y * kColumnsMax + x] - sum) + 0.5));
      out->energy += level * level;
    }
  return out->energy > 16 * kSpread_grey * kSpread_grey * out->rows * out->columns;
}

int32_t product_sum(const cylinder &on, const cylinder_template &what, int left, int top) {
  int32_t sum = 0;
  for (int y = 0; y < what.rows; y++) {
    const uint8_t *from = on.row(top + y) + left;
    const int16_t *level = what.level + y * kColumnsMax;
    for (int lane = 0; lane < what.columns; lane += kLanes)
      for (int x = lane; x < lane + kLanes; x++) sum += level[x] * static_cast<int16_t>(from[x]);
  }
  return sum;
}

// The best places of one landmark, at different azimuths, the best first.
struct shortlist {
  int count;
  place_hypothesis places[kPerLandmark];

  // Likeness that a further place needs.
  double least() const { return count < kPerLandmark ? kLikenessMin : places[count - 1].likeness; }
  void offer(const place_hypothesis &one, double apart_rad) {
    int at = 0;
    while (at < count && std::fabs(places[at].azimuth_rad - one.azimuth_rad) > apart_rad) at++;
    if (at < count && places[at].likeness >= one.likeness) return;
    if (at == count) {
      if (count == kPerLandmark && places[kPerLandmark - 1].likeness >= one.likeness) return;
      at = count < kPerLandmark ? count++ : kPerLandmark - 1;
    }
    places[at] = one;
    for (; at > 0 && places[at - 1].likeness < places[at].likeness; at--) {
      const place_hypothesis higher = places[at];
      places[at] = places[at - 1];
      places[at - 1] = higher;
    }
  }
};

bool is_all_seen(const cylinder &on, const cylinder_template &what, int left, int top) {
  return on.is_seen(left, top) && on.is_seen(left + what.columns - 1, top) && on.is_seen(left, top + what.rows - 1) &&
         on.is_seen(left + what.columns - 1, top + what.rows - 1);
}

// Normalised correlation at one place; -2 where the picture has no contrast.
double likeness_at(const cylinder &on, const cylinder_template &what, int left, int top) {
  const ptrdiff_t stride = on.columns + 1, from = top * stride + left, below = what.rows * stride;
  const int w = what.columns, n = what.rows * w;
  const uint32_t *s = on.sums + from, *q = on.squares + from;
  const int64_t sum = static_cast<uint32_t>(s[below + w] - s[below] - s[w] + s[0]);
  const int64_t squares = static_cast<uint32_t>(q[below + w] - q[below] - q[w] + q[0]);
  const int64_t variance = n * squares - sum * sum;  // times n squared
  if (variance < static_cast<int64_t>(n) * n * static_cast<int64_t>(kSpread_grey * kSpread_grey)) return -2;
  return product_sum(on, what, left, top) /
         std::sqrt(static_cast<double>(what.energy) * static_cast<double>(variance) / n);
}

// The best of a place and its eight neighbours.
struct peak {
  double likeness;
  int left, top;
};
peak climb(const cylinder &on, const cylinder_template &what, int x, int y, double here, int last_column,
           int last_row) {
  peak out = {here, x, y};
  for (int i = y > 0 ? y - 1 : 0; i <= y + 1 && i <= last_row; i++)
    for (int j = x > 0 ? x - 1 : 0; j <= x + 1 && j <= last_column; j++) {
      const double there = i == y && j == x ? here : likeness_at(on, what, j, i);
      if (there > out.likeness) out = {there, j, i};
    }
  return out;
}

// Compares every second place within `tolerance` rows of the expected one, and the neighbours of promising ones.
// Returns the number of comparisons.
int compare(const cylinder &on, const cylinder_template &what, int top, int tolerance, const place_hypothesis &like,
            shortlist *best) {
  int compared = 0;
  const int last_row = on.rows - what.rows, last_column = on.columns - what.columns;
  const int from = top - tolerance < 0 ? 0 : top - tolerance,
            to = top + tolerance > last_row ? last_row : top + tolerance;
  for (int y = from; y <= to; y += 2)
    for (int x = 0; x <= last_column; x += 2) {
      const double here = likeness_at(on, what, x, y);
      compared++;
      if (here < best->least() - kMargin) continue;
      const peak at = climb(on, what, x, y, here, last_column, last_row);
      compared += 8;
      if (at.likeness <= best->least() || !is_all_seen(on, what, at.left, at.top)) continue;
      place_hypothesis place = like;
      place.azimuth_rad = on.left_rad - (at.left + 0.5 * (what.columns - 1)) * on.step_rad;
      place.likeness = at.likeness;
      best->offer(place, 0.5 * what.columns * on.step_rad);
    }
  return compared;
}

// Rows by which a landmark may be off: tilt of the camera and half of the cylinders' step.
int tolerance_of(const template_size &shape, const cylinder &on, double tilt_rad) {
  return static_cast<int>(tilt_rad / on.step_rad + kHalfStep * std::fabs(shape.middle_row)) + 1;
}

}  // namespace

void global_search::need(const mounted_camera &camera, double width_m, double height_m, double z_m) {
  const template_size shape = size_of(width_m, height_m, z_m - camera.centre_m.z);
  const double reach = 0.5 * shape.rows + kHalfStep * std::fabs(shape.middle_row) + 2;
  around.need(shape.middle_row + reach, reach - shape.middle_row);
}

int global_search::search_one(const mounted_camera &camera, const appearance *known, int which, double range_max_m,
                              double tilt_rad) {
  const appearance &what = known[which];
  const double height_m = what.place_m.z - camera.centre_m.z;
  const template_size shape = size_of(what.width_m, what.height_m, height_m);
  shortlist best{};
  int compared = 0;
  for (const double facing : kFacing) {
    cylinder_template drawn;
    if (!draw_template(what, shape, height_m, facing, &drawn)) break;
    for (const cylinder &on : around.cylinders) {
      const double distance_m = what.height_m / (shape.rows * on.step_rad);
      if (distance_m > range_max_m || distance_m < kNearest_m) continue;
      const int top = on.horizon - static_cast<int>(std::floor(shape.middle_row + 0.5 * shape.rows));
      const place_hypothesis like = {which, 0, distance_m, atan2(std::sqrt(1 - facing * facing), facing), 0};
      compared += compare(on, drawn, top, tolerance_of(shape, on, tilt_rad), like, &best);
    }
  }
  for (int i = 0; i < best.count; i++) best.places[i].likeness -= kRankPenalty * i;
  for (int i = 0; i < best.count; i++) insert(best.places[i]);
  return compared;
}

void global_search::insert(const place_hypothesis &place) {
  if (count == kPlaces && places[count - 1].likeness >= place.likeness) return;
  int at = count < kPlaces ? count++ : kPlaces - 1;
  for (; at > 0 && places[at - 1].likeness < place.likeness; at--) places[at] = places[at - 1];
  places[at] = place;
}

int global_search::search(const mounted_camera &camera, const appearance *known, int known_count, double range_max_m,
                          double tilt_rad, int compare_max) {
  int compared = 0;
  count = 0;
  for (int i = 0; i < known_count && compared < compare_max; i++) {
    const int which = next;
    next = next + 1 < known_count ? next + 1 : 0;
    compared += search_one(camera, known, which, range_max_m, tilt_rad);
  }
  return compared;
}

camera_guess guess_from(const mounted_camera &camera, const appearance &what, double azimuth_rad, double distance_m,
                        double slant_rad, double distance_sigma, double slant_sigma_rad, double azimuth_sigma_rad) {
  const double sight_rad = what.yaw_rad - slant_rad + kHalfPi;
  const sin_cos to = sincos(sight_rad), h = sincos(sight_rad - azimuth_rad);
  camera_guess out;
  out.R_map_base = {{{h.cos, -h.sin, 0}, {h.sin, h.cos, 0}, {0, 0, 1}}};
  out.R_map_optical = out.R_map_base * camera.R_base_optical;
  out.eye_m = {what.place_m.x - distance_m * to.cos, what.place_m.y - distance_m * to.sin, camera.centre_m.z};
  out.base_m = out.eye_m - out.R_map_base * camera.centre_m;
  const vec3 arm = out.R_map_base * camera.centre_m;
  // Derivatives of x, y, heading by distance, slant, azimuth, times their sigmas; the heading rotates about the eye.
  const double by[3][3] = {{-to.cos * distance_m * distance_sigma, -to.sin * distance_m * distance_sigma, 0},
                           {(-distance_m * to.sin - arm.y) * slant_sigma_rad,
                            (distance_m * to.cos + arm.x) * slant_sigma_rad, -slant_sigma_rad},
                           {-arm.y * azimuth_sigma_rad, arm.x * azimuth_sigma_rad, -azimuth_sigma_rad}};
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) out.cov[i][k] = by[0][i] * by[0][k] + by[1][i] * by[1][k] + by[2][i] * by[2][k];
  return out;
}

}  // namespace wm
