// SPDX-License-Identifier: Apache-2.0
#include "vision/markers/outline.hpp"

#include "vision/markers/polygon.hpp"

namespace wm {

namespace {

constexpr int kBoxMin_px = 10;       // smaller side of a region's box: a module has less than a pixel then
constexpr int kBorderMin_px = 40;    // length of a border: of the smallest box
constexpr double kRoundMin = 0.3;    // 4 pi area / border^2: a square has 0.79, seen at 75 degrees 0.5
constexpr double kOff_px = 1.2;      // largest distance of a border's point from its side: pixel steps. Not swept
constexpr double kOffOfSize = 0.02;  // the same, as a fraction of the root of the doubled area: lens residuals
constexpr double kHalfPixel = 0.5;   // from a border pixel's centre to the edge
constexpr double kRim_px = 1.5;      // a fitted corner nearer to the picture's rim lies on it

// Whether a border can be a convex polygon's, by its area and length.
bool is_round(const border_point *border, int32_t count) {
  int64_t area = 0;
  double length_px = 0;
  for (int32_t i = 0; i < count; i++) {
    const border_point &a = border[i], &b = border[i + 1 < count ? i + 1 : 0];
    area += static_cast<int64_t>(b.u) * a.v - static_cast<int64_t>(a.u) * b.v;
    length_px += a.u != b.u && a.v != b.v ? 1.41421356 : 1.0;
  }
  return 2 * kPi * static_cast<double>(area) > kRoundMin * length_px * length_px;
}

// The undistorted border in the tangent plane of its middle.
bool undistort_border(outline_work *self, const dark_run &box, int32_t count, tangent_view *view) {
  vec3 middle;
  const pixel centre = {0.5 * (box.left + box.right), 0.5 * (box.row + box.bottom)};
  if (!unproject(self->optics, centre, &middle) || !tangent_init(view, self->optics, middle)) return false;
  for (int32_t i = 0; i < count; i++) {
    const border_point &p = self->regions.border[i];
    vec3 ray;
    if (!unproject(self->optics, {1.0 * p.u, 1.0 * p.v}, &ray) || !point_of_ray(*view, ray, &self->border[i]))
      return false;
  }
  return true;
}

bool is_at_rim(const outline_work &self, const tangent_view &view, const tangent_point &p) {
  pixel at;
  return project(self.optics, ray_of(view, p), &at) &&
         (at.u < kRim_px || at.v < kRim_px || at.u > self.width_px - 1 - kRim_px ||
          at.v > self.height_px - 1 - kRim_px);
}

// The polygon whose corner the picture's rim cut off: has a side more, on the rim. Its neighbours are extended to meet.
bool restore_corner(const outline_work &self, const tangent_view &view, const tangent_point *cut, int count,
                    tangent_point *corner) {
  int rim = -1;
  for (int i = 0; i <= count; i++)
    if (is_at_rim(self, view, cut[i]) && is_at_rim(self, view, cut[(i + 1) % (count + 1)])) {
      if (rim >= 0) return false;
      rim = i;
    }
  if (rim < 0) return false;
  const auto at = [&](int i) { return cut[(rim + i + count + 1) % (count + 1)]; };
  const auto line = [](const tangent_point &a, const tangent_point &b) {
    const tangent_point pair[2] = {a, b};
    return line_through(pair, 2, {0, 0});
  };
  for (int i = 1; i < count; i++) corner[i] = at(i + 1);
  return meet(line(at(-1), at(0)), line(at(1), at(2)), &corner[0]);
}

// Corners on the line of the border's points. A region at the picture's rim may lack a corner.
bool find_corners(const outline_work &self, const tangent_view &view, const dark_run &box, int points, int count,
                  tangent_point *inside) {
  const double size = std::sqrt(std::fabs(doubled_area(self.border, points)));
  const double off = larger(kOff_px, kOffOfSize * size);
  const bool is_beside_rim =
      box.left == 0 || box.row == 0 || box.right + 1U >= self.width_px || box.bottom + 1U >= self.height_px;
  tangent_point cut[kOutlineCornersMax + 1];
  if (is_beside_rim && polygon_of(self.border, points, count + 1, off, cut))
    return restore_corner(self, view, cut, count, inside);
  return polygon_of(self.border, points, count, off, inside);
}

// Moves the sides of a polygon outwards.
bool move_out(const tangent_point *from, int count, double by, tangent_point *to) {
  tangent_line side[kOutlineCornersMax];
  for (int i = 0; i < count; i++) {
    const tangent_point along = from[(i + 1) % count] - from[i];
    const tangent_point n = {along.y / length(along), -along.x / length(along)};
    side[i] = {n, dot(n, from[i]) + by};
  }
  for (int i = 0; i < count; i++)
    if (!meet(side[(i + count - 1) % count], side[i], &to[i])) return false;
  return true;
}

}  // namespace

const char *outline_init(outline_work *self, const wm_camera &camera) {
  self->width_px = camera.width_px;
  self->height_px = camera.height_px;
  if (camera.width_px < 16 || camera.height_px < 16 || camera.width_px > 16384 || camera.height_px > 16384)
    return "the camera's size must be 16 to 16384 px";
  return lens_init(&self->optics, camera);
}

void outline_place(outline_work *self, memory_layout *memory, bool is_counting) {
  dark_work work;
  const size_t bytes = dark_work_lay_out(&work, self->width_px, self->height_px, nullptr);
  uint8_t *regions = memory->take<uint8_t>(bytes);
  tangent_point *border = memory->take<tangent_point>(static_cast<size_t>(work.border_max));
  if (is_counting) return;
  dark_work_lay_out(&self->regions, self->width_px, self->height_px, regions);
  self->border = border;
}

bool find_outline(outline_work *self, uint32_t region, int count, tangent_view *view, tangent_point *corner) {
  const dark_run &box = self->regions.runs[region];
  if (box.right - box.left < kBoxMin_px || box.bottom - box.row < kBoxMin_px) return false;
  const int32_t points = trace_border(&self->regions, region);
  if (points < kBorderMin_px || !is_round(self->regions.border, points)) return false;
  if (!undistort_border(self, box, points, view)) return false;
  tangent_point inside[kOutlineCornersMax];
  return find_corners(*self, *view, box, points, count, inside) && move_out(inside, count, kHalfPixel, corner);
}

bool outline_in_picture(const outline_work &self, const tangent_view &view, const tangent_point *corner, int count,
                        int first, double (*corners_px)[2]) {
  for (int i = 0; i < count; i++) {
    pixel at;
    if (!project(self.optics, ray_of(view, corner[(first + i) % count]), &at)) return false;
    corners_px[i][0] = at.u;
    corners_px[i][1] = at.v;
  }
  return true;
}

}  // namespace wm
