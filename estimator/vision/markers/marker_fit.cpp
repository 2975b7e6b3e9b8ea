// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker_fit.h"

#include <cstring>

#include "math/elementary.hpp"
#include "vision/camera/lens.hpp"

// All geometry is in the picture that a camera without distortion would make ("flat": focal length of the real one, its
// origin on the axis): there the print's edges are straight.
struct wm_marker_fit {
  wm::lens optics;
  wm_marker_print print;
  wm::vec3 up;  // the vertical in optical axes, the robot being level
  double focal_px;
  double shift_px;    // white grows by this
  double shift_seen;  // measurements of it so far, at most kShiftMemory
};

namespace wm {
namespace {

constexpr int kSamples = 24;             // along an edge
constexpr double kReach_px = 2.5;        // across it, to either side
constexpr double kStep_px = 0.5;         // of a profile
constexpr double kLeastContrast = 12.0;  // grey levels over an edge
constexpr double kShiftMemory = 400.0;   // markers
constexpr double kMostShift_px = 1.0;
constexpr double kLevel = 0.85, kUpright = 0.4;  // cosine of a print's normal to the vertical

struct flat {
  double x, y;
};
flat operator-(const flat &a, const flat &b) { return {a.x - b.x, a.y - b.y}; }
flat mix(const flat &a, const flat &b, double t) { return {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)}; }

// A straight line: n . p = d, n of length 1.
struct line {
  flat n;
  double d;
};

bool flat_of(const wm_marker_fit &self, const double px[2], flat *out) {
  vec3 ray;
  if (!unproject(self.optics, {px[0], px[1]}, &ray) || !(ray.z > 0.05)) return false;
  *out = {self.focal_px * ray.x / ray.z, self.focal_px * ray.y / ray.z};
  return true;
}

bool grey_at(const wm_marker_fit &self, const wm_frame &frame, const flat &p, double *out) {
  pixel at;
  if (!project(self.optics, {p.x, p.y, self.focal_px}, &at)) return false;
  const int u = (int)std::floor(at.u), v = (int)std::floor(at.v);
  if (u < 0 || v < 0 || u + 1 >= (int)frame.width_px || v + 1 >= (int)frame.height_px) return false;
  const uint8_t *row = frame.grey + static_cast<size_t>(v) * frame.stride_bytes + u;
  const uint8_t *below = row + frame.stride_bytes;
  const double a = at.u - u, b = at.v - v;
  *out = (1 - b) * ((1 - a) * row[0] + a * row[1]) + b * ((1 - a) * below[0] + a * below[1]);
  return true;
}

// Where along `normal` from `at` grey rises, as the centroid of the rise; false where there is no single clear edge.
bool find_edge(const wm_marker_fit &self, const wm_frame &frame, const flat &at, const flat &normal, double reach,
               double *offset) {
  constexpr int kMost = 16;
  double grey[kMost + 1] = {};
  const int steps = (int)(2.0 * reach / kStep_px + 0.5);
  if (steps > kMost) return false;
  for (int i = 0; i <= steps; i++) {
    const double t = -reach + i * kStep_px;
    if (!grey_at(self, frame, {at.x + t * normal.x, at.y + t * normal.y}, &grey[i])) return false;
  }
  double sum = 0.0, moment = 0.0;
  for (int i = 0; i < steps; i++) {
    const double rise = grey[i + 1] - grey[i];
    if (rise <= 0.0) continue;
    sum += rise;
    moment += rise * (-reach + (i + 0.5) * kStep_px);
  }
  if (sum < kLeastContrast || grey[steps] - grey[0] < 0.6 * sum) return false;
  *offset = moment / sum;
  return true;
}

// The line through the edge between two corners; `outwards` points to its bright side.
bool fit_side(const wm_marker_fit &self, const wm_frame &frame, const flat &a, const flat &b, const flat &outwards,
              line *out) {
  flat found[kSamples];
  int count = 0;
  for (int i = 0; i < kSamples; i++) {
    const flat at = mix(a, b, 0.08 + 0.84 * (i + 0.5) / kSamples);
    double offset;
    if (find_edge(self, frame, at, outwards, kReach_px, &offset))
      found[count++] = {at.x + offset * outwards.x, at.y + offset * outwards.y};
  }
  if (count < kSamples / 2) return false;
  for (int round = 0; round < 2; round++) {
    double mx = 0, my = 0, xx = 0, xy = 0, yy = 0;
    for (int i = 0; i < count; i++) mx += found[i].x / count, my += found[i].y / count;
    for (int i = 0; i < count; i++) {
      const double x = found[i].x - mx, y = found[i].y - my;
      xx += x * x, xy += x * y, yy += y * y;
    }
    const double angle = 0.5 * atan2(2.0 * xy, xx - yy);  // of the line
    const sin_cos s = sincos(angle);
    out->n = {-s.sin, s.cos};
    if (out->n.x * outwards.x + out->n.y * outwards.y < 0.0) out->n = {s.sin, -s.cos};
    out->d = out->n.x * mx + out->n.y * my;
    int kept = 0;  // without what lies off
    for (int i = 0; i < count; i++)
      if (std::fabs(out->n.x * found[i].x + out->n.y * found[i].y - out->d) < 0.6) found[kept++] = found[i];
    if (kept < kSamples / 2) return false;
    if (kept == count) break;
    count = kept;
  }
  return true;
}

bool meet(const line &a, const line &b, flat *out) {
  const double determinant = a.n.x * b.n.y - a.n.y * b.n.x;
  if (!(std::fabs(determinant) > 0.2)) return false;
  *out = {(a.d * b.n.y - b.d * a.n.y) / determinant, (a.n.x * b.d - b.n.x * a.d) / determinant};
  return true;
}

// Homography from the print's (x right, y down, corners at +-1) to flat pixels, by its four corners (P. Heckbert 1989).
struct homography {
  double h[3][3];
  flat operator()(double x, double y) const {
    const double w = h[2][0] * x + h[2][1] * y + h[2][2];
    return {(h[0][0] * x + h[0][1] * y + h[0][2]) / w, (h[1][0] * x + h[1][1] * y + h[1][2]) / w};
  }
};

bool square_to(const flat c[4], homography *out) {
  // From the unit square (0,0) (1,0) (1,1) (0,1), then to +-1.
  const double sx = c[0].x - c[1].x + c[2].x - c[3].x, sy = c[0].y - c[1].y + c[2].y - c[3].y;
  const flat d1 = c[1] - c[2], d2 = c[3] - c[2];
  const double determinant = d1.x * d2.y - d2.x * d1.y;
  if (!(std::fabs(determinant) > 1e-9)) return false;
  const double g = (sx * d2.y - d2.x * sy) / determinant, k = (d1.x * sy - sx * d1.y) / determinant;
  const double unit[3][3] = {{c[1].x - c[0].x + g * c[1].x, c[3].x - c[0].x + k * c[3].x, c[0].x},
                             {c[1].y - c[0].y + g * c[1].y, c[3].y - c[0].y + k * c[3].y, c[0].y},
                             {g, k, 1.0}};
  for (int r = 0; r < 3; r++) {
    out->h[r][0] = 0.5 * unit[r][0];
    out->h[r][1] = 0.5 * unit[r][1];
    out->h[r][2] = unit[r][2] + 0.5 * (unit[r][0] + unit[r][1]);
  }
  return true;
}

bool corners_of(const line side[4], double outwards, flat out[4]) {
  line moved[4];
  for (int i = 0; i < 4; i++) moved[i] = {side[i].n, side[i].d + outwards};
  for (int i = 0; i < 4; i++)
    if (!meet(moved[(i + 3) % 4], moved[i], &out[i])) return false;
  return true;
}

constexpr double kCorner[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};

// By how much white grows: the inner edges of the ring lie farther out than the outer ones say.
void measure_shift(wm_marker_fit *self, const wm_frame &frame, const homography &h) {
  const double inner = 1.0 - 2.0 * self->print.ring;
  const flat middle = h(0, 0), edge = h(0, -1);
  const double half_px = std::sqrt(square(edge.x - middle.x) + square(edge.y - middle.y));
  const double reach =
      std::floor(2.0 * (kReach_px < 1.6 * self->print.ring * half_px ? kReach_px : 1.6 * self->print.ring * half_px)) *
      0.5;
  if (reach < 1.5) return;
  double sum = 0.0;
  int count = 0;
  for (int side = 0; side < 4; side++) {
    const double *a = kCorner[side], *b = kCorner[(side + 1) % 4];
    for (int i = 0; i < kSamples; i++) {
      const double t = 0.1 + 0.8 * (i + 0.5) / kSamples;
      const double x = inner * (a[0] + t * (b[0] - a[0])), y = inner * (a[1] + t * (b[1] - a[1]));
      const flat at = h(x, y);
      const double inx = -0.5 * (a[0] + b[0]), iny = -0.5 * (a[1] + b[1]);
      flat in = h(x + 0.05 * inx, y + 0.05 * iny) - at;
      const double size = std::sqrt(square(in.x) + square(in.y));
      if (!(size > 1e-9)) continue;
      in = {in.x / size, in.y / size};
      double offset;
      if (!find_edge(*self, frame, at, in, reach, &offset)) continue;
      sum -= offset;  // outwards
      count++;
    }
  }
  if (count < kSamples) return;
  const double measured = sum / count / (1.0 + inner);
  if (std::fabs(measured) > kMostShift_px) return;
  if (self->shift_seen < kShiftMemory) self->shift_seen += 1.0;
  self->shift_px += (measured - self->shift_px) / self->shift_seen;
}

// The print's plane as the homography has it (Z. Zhang 2000: the columns of K^-1 H are its axes), away from the camera.
// A small print hardly shows its tilt, and noise taken for tilt makes it look foreshortened, so nearer than it is.
// Prints hang on ceilings and walls: one that is nearly level is level, one that is nearly upright is upright.
vec3 plane_of(const wm_marker_fit &self, const homography &h, vec3 *across) {
  const double f = self.focal_px;
  const vec3 a = {h.h[0][0] / f, h.h[1][0] / f, h.h[2][0]}, b = {h.h[0][1] / f, h.h[1][1] / f, h.h[2][1]};
  *across = a;
  vec3 n = cross(a, b);
  n = 1.0 / length(n) * n;
  const double rise = dot(n, self.up);
  if (std::fabs(rise) > kLevel)
    n = rise > 0.0 ? self.up : -1.0 * self.up;
  else if (std::fabs(rise) < kUpright)
    n = n - rise * self.up;
  return 1.0 / length(n) * n;
}

// In its plane the print is a square of known size: four numbers from four corners, by least squares.
bool pose_of(const wm_marker_fit &self, const homography &h, const flat corner[4], vec3 *centre, vec3 *right) {
  vec3 across;
  const vec3 n = plane_of(self, h, &across);
  vec3 e1 = across - dot(across, n) * n;
  e1 = 1.0 / length(e1) * e1;
  const vec3 e2 = cross(n, e1);
  double qx = 0.0, qy = 0.0, re = 0.0, im = 0.0;
  for (int i = 0; i < 4; i++) {
    const vec3 ray = {corner[i].x / self.focal_px, corner[i].y / self.focal_px, 1.0};
    const double depth = dot(ray, n);
    if (!(depth > 0.05)) return false;
    const double x = dot(ray, e1) / depth, y = dot(ray, e2) / depth;
    qx += 0.25 * x;
    qy += 0.25 * y;
    re += (x * kCorner[i][0] + y * kCorner[i][1]) / 8.0;
    im += (y * kCorner[i][0] - x * kCorner[i][1]) / 8.0;
  }
  const double half = std::sqrt(re * re + im * im);
  if (!(half > 1e-9)) return false;
  const double distance = 0.5 * self.print.size_m / half;  // of the plane
  *centre = distance * (qx * e1 + qy * e2 + n);
  *right = 1.0 / half * (re * e1 + im * e2);
  return true;
}

}  // namespace
}  // namespace wm

size_t wm_marker_fit_bytes(void) { return sizeof(wm_marker_fit); }

const char *wm_marker_fit_init(wm_marker_fit *self, const wm_camera *camera, const wm_marker_print *print) {
  std::memset(static_cast<void *>(self), 0, sizeof *self);
  self->print = *print;
  if (!(print->size_m > 0.0)) return "markers.size_m of calibration.yaml is needed";
  const char *why = wm::lens_init(&self->optics, *camera);
  if (why) return why;
  const double *rpy = camera->mounting.rpy_rad;
  const wm::sin_cos roll = wm::sincos(rpy[0]), pitch = wm::sincos(rpy[1]);
  // Up in the body's axes is the last row of Ry(pitch) Rx(roll); body (x, y, z) is optical (z, -x, -y).
  self->up = {-pitch.cos * roll.sin, -pitch.cos * roll.cos, -pitch.sin};
  self->focal_px = 0.5 * (self->optics.fx + self->optics.fy);
  return nullptr;
}

int wm_marker_fit_pose(wm_marker_fit *self, const wm_frame *frame, const double corners_px[4][2], double centre_m[3],
                       double upper_edge[3]) {
  using namespace wm;
  flat corner[4];
  for (int i = 0; i < 4; i++)
    if (!flat_of(*self, corners_px[i], &corner[i])) return 0;
  line side[4];
  for (int i = 0; i < 4; i++) {
    const flat &a = corner[i], &b = corner[(i + 1) % 4];
    const flat along = b - a;
    const double size = std::sqrt(square(along.x) + square(along.y));
    if (!(size > 8.0)) return 0;
    // Upper left to upper right to lower right is clockwise with y down: outwards is to the left of the way.
    const flat outwards = {along.y / size, -along.x / size};
    if (!fit_side(*self, *frame, a, b, outwards, &side[i])) return 0;
  }
  homography h;
  if (!corners_of(side, 0.0, corner) || !square_to(corner, &h)) return 0;
  measure_shift(self, *frame, h);
  if (!corners_of(side, self->shift_px, corner) || !square_to(corner, &h)) return 0;
  vec3 centre, right;
  if (!pose_of(*self, h, corner, &centre, &right)) return 0;
  if (!wm::finite(centre.x + centre.y + centre.z) || !(centre.z > 0.0)) return 0;
  // Optical axes (x right, y down, z forward) to the body's (x forward, y left, z up).
  const double c[3] = {centre.z, -centre.x, -centre.y}, u[3] = {right.z, -right.x, -right.y};
  std::memcpy(centre_m, c, sizeof c);
  std::memcpy(upper_edge, u, sizeof u);
  return 1;
}

double wm_marker_fit_shift_px(const wm_marker_fit *self) { return self->shift_px; }
