// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker_fit.h"

#include <cstring>

#include "vision/markers/marker_pose.hpp"

namespace wm {
constexpr int kWidths = 12;  // steps of kWidthStep_px from kWidthLeast_px on
}

struct wm_marker_fit {
  wm::lens optics;
  wm_marker_print print;
  wm::mat3 R_level_body;  // level axes about the mounting's yaw, from the camera's body
  wm::vec3 up;            // the vertical in optical axes, the robot being level
  // White grows by this, by the width of the black between the two borders: where that is narrow, they pull each other.
  struct {
    double shift_px, seen;  // `seen`: sides measured, at most kShiftMemory
  } by_width[wm::kWidths];
};

namespace wm {
namespace {

constexpr int kSamples = 24;       // along an edge
constexpr double kReach_px = 2.5;  // across it, to either side
constexpr double kReachLeast_px = 1.0, kReachShift_px = 1.5;
constexpr double kStep_px = 0.5;         // of a profile
constexpr double kLeastContrast = 12.0;  // grey levels over an edge
constexpr double kLeastSide_px = 8.0;
constexpr double kShiftMemory = 1600.0;  // sides
constexpr double kWidthStep_px = 0.5, kWidthLeast_px = 1.0, kWide_px = 6.5;
constexpr double kMostShift_px = 1.0;
constexpr double kLeastTurn_rad = 0.003;  // of an upright print: the camera's own tilt, the paper's bend

// Where along `normal` from `at` grey rises, as the centroid of the rise; false where there is no single clear edge.
bool find_edge(const tangent_view &view, const wm_frame &frame, const tangent_point &at, const tangent_point &normal,
               double reach, double *offset) {
  constexpr int kMost = 16;
  double grey[kMost + 1] = {};
  const int steps = static_cast<int>(2.0 * reach / kStep_px + 0.5);
  if (steps > kMost) return false;
  for (int i = 0; i <= steps; i++)
    if (!grey_at(view, frame, at + (-reach + i * kStep_px) * normal, &grey[i])) return false;
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

// The edge between two corners, point by point.
struct side_points {
  int count;
  tangent_point at[kSamples], to_white;
  int sample[kSamples];
  double beside[kSamples];  // of each sample: how much of the other border is beside it there, 0 to 1
  double share;             // their mean over the points
  bool deep[kSamples];      // of the other border: it is there, with white as far behind it as behind the first
};

// How far along a side a sample is, 0 to 1.
double along_side(int sample) { return 0.08 + 0.84 * (sample + 0.5) / kSamples; }

// `to_white` is the direction in which grey rises.
bool find_side(const tangent_view &view, const wm_frame &frame, const tangent_point &a, const tangent_point &b,
               const tangent_point &to_white, double reach, side_points *out) {
  out->count = 0;
  out->to_white = to_white;
  for (double &beside : out->beside) beside = 0.0;
  for (int i = 0; i < kSamples; i++) {
    const tangent_point at = mix(a, b, along_side(i));
    double offset;
    if (!find_edge(view, frame, at, to_white, reach, &offset)) continue;
    out->at[out->count] = at + offset * to_white;
    out->sample[out->count++] = i;
  }
  return out->count >= kSamples / 2;
}

// The line through them, each moved towards white by its own way.
bool fit_side(const side_points &side, double by_beside, double by_alone, tangent_line *out) {
  tangent_point found[kSamples];
  int count = side.count;
  for (int i = 0; i < count; i++)
    found[i] = side.at[i] + (by_alone + side.beside[side.sample[i]] * (by_beside - by_alone)) * side.to_white;
  for (int round = 0; round < 2; round++) {
    *out = line_through(found, count, side.to_white);
    int kept = 0;  // without what lies off
    for (int i = 0; i < count; i++)
      if (std::fabs(dot(out->n, found[i]) - out->d) < 0.6) found[kept++] = found[i];
    if (kept < kSamples / 2) return false;
    if (kept == count) break;
    count = kept;
  }
  return true;
}

bool corners_of(const tangent_line *side, int count, tangent_point *out) {
  for (int i = 0; i < count; i++)
    if (!meet(side[(i + count - 1) % count], side[i], &out[i])) return false;
  return true;
}

// How white it is behind each sample of side `from`: so many widths of the stretch between the two borders from where
// `scale` times the side is, straight inwards; 1 and more as white as beside the first border, 0 and less as black.
struct behind {
  const tangent_view &view;
  const wm_frame &frame;
  const wm_marker_print &print;
  const homography &h;
  const double *a, *b;

  bool grey(int sample, double scale, double widths, double *out) const {
    const double t = along_side(sample), in = 0.5 * widths * (1.0 - print.other);
    const double x = scale * (a[0] + t * (b[0] - a[0])) - in * (a[0] + b[0]);
    const double y = scale * (a[1] + t * (b[1] - a[1])) - in * (a[1] + b[1]);
    return grey_at(view, frame, h(x, y), out);
  }
  bool white(int sample, double scale, double widths, double *out) const {
    double white, black, there;
    if (!grey(sample, 1.0, -0.5, &white) || !grey(sample, 1.0, 0.5, &black) || !grey(sample, scale, widths, &there) ||
        white - black < kLeastContrast)
      return false;
    *out = (there - black) / (white - black);
    return true;
  }
};

// Where on side `from` the other border is: how white it is on that one's far side. And where the other border has as
// much white behind it as the first one has.
void find_beside(const tangent_view &view, const wm_frame &frame, const wm_marker_print &print, const homography &h,
                 int from, side_points *side) {
  const behind look = {view, frame, print, h, print.corner[from], print.corner[(from + 1) % print.corners]};
  double sum = 0.0;
  for (int i = 0; i < kSamples; i++) {
    double beside, near, far;
    side->beside[i] = print.beside;
    if (print.beside < 1.0 && look.white(i, 1.0, 1.5, &beside))
      side->beside[i] = beside < 0.0 ? 0.0 : beside > 1.0 ? 1.0 : beside;
    side->deep[i] =
        look.white(i, print.other, 0.5, &near) && look.white(i, print.other, 1.5, &far) && near > 0.5 && far > 0.5;
  }
  for (int i = 0; i < side->count; i++) sum += side->beside[side->sample[i]];
  side->share = sum / side->count;
}

// Not where the other border begins or ends, whose corner is round.
bool is_whole(const side_points &side, int sample) {
  for (int i = sample - 1; i <= sample + 1; i++)
    if (i >= 0 && i < kSamples && !side.deep[i]) return false;
  return true;
}

// Between the two borders on this side, px.
double width_of(const wm_marker_print &print, const homography &h, int side) {
  const double *a = print.corner[side], *b = print.corner[(side + 1) % print.corners];
  const double x = 0.5 * (a[0] + b[0]), y = 0.5 * (a[1] + b[1]);
  const tangent_point along = h(b[0], b[1]) - h(a[0], a[1]), apart = h(x, y) - h(print.other * x, print.other * y);
  return std::fabs(cross(along, apart)) / length(along);
}

// How far an edge may be looked for without meeting the other border's: nearly to it.
double reach_of(double width_px) {
  const double reach = std::floor(2.0 * 0.85 * width_px) * 0.5;
  return reach < kReachLeast_px ? kReachLeast_px : reach > kReach_px ? kReach_px : reach;
}

double step_of(double width_px) {
  const double at = (width_px - kWidthLeast_px) / kWidthStep_px;
  return at < 0.0 ? 0.0 : at > kWidths - 1.0 ? kWidths - 1.0 : at;
}

// Towards white, by the width of the stretch: what its other edge takes from an edge's tail, where both are seen
// through a blur of 1 px (lens, pixel, and grey between pixels) as find_edge sees them.
double pull_of(double width_px) {
  static constexpr double kPull_px[kWidths] = {0.38, 0.29, 0.30, 0.30, 0.21, 0.15, 0.08, 0.05, 0.01, 0.0, 0.0, 0.0};
  const double at = step_of(width_px);
  const int i = static_cast<int>(at);
  return i + 1 < kWidths ? kPull_px[i] + (at - i) * (kPull_px[i + 1] - kPull_px[i]) : kPull_px[i];
}

// What is known of the shift at a width: from the widths about it, and where these weren't seen from others, less the
// pull there and here.
double shift_of(const wm_marker_fit &self, double width_px) {
  const double at = step_of(width_px);
  double sum = 0.0, weights = 0.0;
  for (int i = 0; i < kWidths; i++) {
    const double weight = self.by_width[i].seen / square(1.0 + 4.0 * square(i - at));
    sum += weight * (self.by_width[i].shift_px + pull_of(kWidthLeast_px + i * kWidthStep_px));
    weights += weight;
  }
  return weights > 0.0 ? sum / weights - pull_of(width_px) : 0.0;
}

// By how much white grows: both borders move away from white, so to opposite sides.
void measure_shift(wm_marker_fit *self, const tangent_view &view, const wm_frame &frame, const homography &h,
                   const side_points *points, const double *width_px) {
  const wm_marker_print &print = self->print;
  const double sign = print.is_white_inside ? 1.0 : -1.0;  // of the other border's way to white
  for (int side = 0; side < print.corners; side++) {
    const double *a = print.corner[side], *b = print.corner[(side + 1) % print.corners];
    const double mx = 0.5 * (a[0] + b[0]), my = 0.5 * (a[1] + b[1]), reach = reach_of(width_px[side]);
    if (reach < kReachShift_px) continue;
    double sum = 0.0;
    int count = 0;
    for (int i = 0; i < kSamples; i++) {
      if (!is_whole(points[side], i)) continue;
      const double t = along_side(i);
      const double x = print.other * (a[0] + t * (b[0] - a[0])), y = print.other * (a[1] + t * (b[1] - a[1]));
      const tangent_point at = h(x, y);
      const tangent_point way = sign * (h(x + 0.1 * mx, y + 0.1 * my) - at);
      const double size = length(way);
      if (!(size > 1e-9)) continue;
      double offset;
      if (!find_edge(view, frame, at, 1.0 / size * way, reach, &offset)) continue;
      sum -= offset;  // away from white
      count++;
    }
    if (count < kSamples / 8) continue;
    // The first border is where it was found, so the other seems to be off by its own shift and the first one's,
    // scaled: as large where they are side by side, else that of a border alone.
    auto &known = self->by_width[static_cast<int>(step_of(width_px[side]) + 0.5)];
    const double alone =
        print.other * (1.0 - points[side].share) * (shift_of(*self, kWide_px) - shift_of(*self, width_px[side]));
    const double measured = (sum / count - alone) / (1.0 + print.other);
    if (std::fabs(measured) > kMostShift_px) continue;
    if (known.seen < kShiftMemory) known.seen += 1.0;
    known.shift_px += (measured - known.shift_px) / known.seen;
  }
}

// Optical axes (x right, y down, z forward) to the body's (x forward, y left, z up).
vec3 body_of(const vec3 &optical) { return {optical.z, -optical.x, -optical.y}; }

// Place in the body's frame, and the upper edge's direction seen from above.
void put(const wm_marker_fit &self, const marker_pose &pose, double p_m[3], double *yaw_rad) {
  const vec3 centre = body_of(pose.centre_m), upper = self.R_level_body * body_of(pose.right);
  for (int i = 0; i < 3; i++) p_m[i] = centre[i];
  *yaw_rad = atan2(upper.y, upper.x);
}

}  // namespace
}  // namespace wm

size_t wm_marker_fit_bytes(void) { return sizeof(wm_marker_fit); }

const char *wm_marker_fit_init(wm_marker_fit *self, const wm_camera *camera, const wm_marker_print *print) {
  std::memset(static_cast<void *>(self), 0, sizeof *self);
  self->print = *print;
  if (!(print->size_m > 0.0)) return "the markers' size is needed: markers.size_m of calibration.yaml";
  const char *why = wm::lens_init(&self->optics, *camera);
  if (why) return why;
  const double level[3] = {camera->mounting.rpy_rad[0], camera->mounting.rpy_rad[1], 0};
  self->R_level_body = wm::matrix_of_rpy(level);
  const double(*m)[3] = self->R_level_body.m;
  self->up = {-m[2][1], -m[2][2], m[2][0]};  // the last row, in optical axes
  return nullptr;
}

int wm_marker_fit_read(wm_marker_fit *self, const wm_frame *frame, const double (*corners_px)[2], wm_marker *out) {
  using namespace wm;
  const wm_marker_print &print = self->print;
  const int count = print.corners;
  vec3 ray[WM_MARKER_CORNERS_MAX], middle = {0, 0, 0};
  for (int i = 0; i < count; i++) {
    if (!unproject(self->optics, {corners_px[i][0], corners_px[i][1]}, &ray[i])) return 0;
    middle = middle + ray[i];
  }
  tangent_view view;
  tangent_point corner[WM_MARKER_CORNERS_MAX];
  if (!(length(middle) > 0.1) || !tangent_init(&view, self->optics, middle)) return 0;
  for (int i = 0; i < count; i++)
    if (!point_of_ray(view, ray[i], &corner[i])) return 0;
  homography h;
  if (!homography_init(&h, print.corner, corner, count)) return 0;
  side_points points[WM_MARKER_CORNERS_MAX];
  tangent_line side[WM_MARKER_CORNERS_MAX];
  double width_px[WM_MARKER_CORNERS_MAX];
  // Twice: a profile that isn't centred on its edge misses more of the one tail than of the other.
  for (int pass = 0; pass < 2; pass++) {
    for (int i = 0; i < count; i++) {
      const tangent_point &a = corner[i], &b = corner[(i + 1) % count];
      const double size = length(b - a);
      if (!(size > kLeastSide_px)) return 0;
      width_px[i] = width_of(print, h, i);
      // Clockwise with y down: outwards is to the left of the way.
      const double outwards = print.is_white_inside ? -1.0 : 1.0;
      const tangent_point to_white = {outwards * (b.y - a.y) / size, -outwards * (b.x - a.x) / size};
      if (!find_side(view, *frame, a, b, to_white, reach_of(width_px[i]), &points[i]) ||
          !fit_side(points[i], 0.0, 0.0, &side[i]))
        return 0;
    }
    if (!corners_of(side, count, corner) || !homography_init(&h, print.corner, corner, count)) return 0;
  }
  for (int i = 0; i < count; i++) find_beside(view, *frame, print, h, i, &points[i]);
  measure_shift(self, view, *frame, h, points, width_px);
  for (int i = 0; i < count; i++)
    if (!fit_side(points[i], shift_of(*self, width_px[i]), shift_of(*self, kWide_px), &side[i])) return 0;
  if (!corners_of(side, count, corner)) return 0;
  marker_poses poses;
  if (!pose_of(view, print, corner, self->up, &poses)) return 0;
  const vec3 all = poses.best.centre_m + poses.other.centre_m;
  if (!wm::finite(all) || !(length(poses.best.centre_m) > 0.0)) return 0;
  put(*self, poses.best, out->p_m, &out->yaw_rad);
  out->along_sigma_m = poses.range_sigma_m;
  out->yaw_sigma_rad =
      poses.turn_sigma_rad > 0 ? std::sqrt(square(poses.turn_sigma_rad) + square(kLeastTurn_rad)) : 0.0;
  out->edge_shift_px = wm_marker_fit_shift_px(self);
  out->poses = poses.has_other ? 2 : 1;
  if (poses.has_other) put(*self, poses.other, out->other_p_m, &out->other_yaw_rad);
  return 1;
}

double wm_marker_fit_shift_px(const wm_marker_fit *self) { return wm::shift_of(*self, wm::kWide_px); }
