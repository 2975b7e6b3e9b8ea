// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker_fit.h"

#include <cstring>
#include <limits>

#include "vision/markers/marker_pose.hpp"

namespace wm {
constexpr int kWidths = 12;  // classes of width, kWidthStep_px from kWidthMin_px on
}

struct wm_marker_fit {
  wm::lens optics;
  wm_marker_print print;
  wm::mat3 R_level_body;  // level axes about the mounting's yaw, from the camera's body
  wm::vec3 up;            // the vertical in optical axes, the robot being level
  // Bloom by the width of the black between the two borders: where that is narrow, their blurred edges interact.
  struct {
    double bloom_px, weight;  // `weight`: sides measured, at most kBloomMemory
  } by_width[wm::kWidths];
};

namespace wm {
namespace {

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();
constexpr int kSamples = 24;                         // along a side; more cost time and share the same pixels
constexpr double kFirstSample = 0.08, kSpan = 0.84;  // of a side: its corners are rounded by blur
constexpr double kReach_px = 2.5;                    // of a profile to either side: the corners' error and the blur
constexpr double kReachMin_px = 1.0;                 // the same where the other border is near
constexpr double kReachBloom_px = 1.5;               // below, a profile is too short to measure the bloom
constexpr double kReachOfWidth = 0.85;               // of the distance to the other border
constexpr double kStep_px = 0.5;                     // of a profile
constexpr double kContrastMin_grey = 12.0;           // over an edge: above noise and compression. Not swept
constexpr double kMonotonousMin = 0.6;               // net over total rise of a profile: a single edge. Not swept
constexpr double kOutlier_px = 0.6;                  // a point farther off its side is left out. Not swept
constexpr double kCorner_px = 0.12;                  // sigma of a corner's coordinate: measured on rendered prints
constexpr double kSideMin_px = 8.0;                  // shortest side of a print that can be measured
constexpr double kSideLeast_px = 1.0;                // for the sigma of one that cannot: against division by 0
constexpr double kBloomMemory = 1600.0;              // sides in the running mean: some minutes of prints
constexpr double kBloomMax_px = 1.0;                 // a larger one is a wrong edge
constexpr double kWidthStep_px = 0.5, kWidthMin_px = 1.0,
                 kWide_px = 6.5;             // of the classes; the last one: no interaction
constexpr double kRough_px = 0.5;            // sigma of corners whose sides are too short to be measured: bloom, steps
constexpr double kTurnSigmaMin_rad = 0.003;  // of an upright print: the camera's own tilt, the paper's bend

// Offset along `normal` from `at` of a rise of grey, its centroid. False where there is no single clear edge.
bool find_edge(const tangent_view &view, const wm_frame &frame, const tangent_point &at, const tangent_point &normal,
               double reach, double *offset) {
  constexpr int kStepsMax = 16;
  double grey[kStepsMax + 1] = {};
  const int steps = static_cast<int>(2.0 * reach / kStep_px + 0.5);
  if (steps > kStepsMax) return false;
  for (int i = 0; i <= steps; i++)
    if (!grey_at(view, frame, at + (-reach + i * kStep_px) * normal, &grey[i])) return false;
  double sum = 0.0, moment = 0.0;
  for (int i = 0; i < steps; i++) {
    const double rise = grey[i + 1] - grey[i];
    if (rise <= 0.0) continue;
    sum += rise;
    moment += rise * (-reach + (i + 0.5) * kStep_px);
  }
  if (sum < kContrastMin_grey || grey[steps] - grey[0] < kMonotonousMin * sum) return false;
  *offset = moment / sum;
  return true;
}

// Measured points of the edge between two corners.
struct side_points {
  int count;
  tangent_point at[kSamples], to_white;
  int sample[kSamples];
  double beside[kSamples];  // of each sample: fraction of the other border that lies next to it, 0 to 1
  double overlap;           // its mean over the points
  bool deep[kSamples];      // the other border exists there and has as much white behind it as the first one
};

// Place of a sample along its side, 0 to 1.
double along_side(int sample) { return kFirstSample + kSpan * (sample + 0.5) / kSamples; }

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

// The line through the points, each moved towards white by the bloom: `bloom_beside` where the other border is next to
// it, `bloom_alone` elsewhere, interpolated between.
bool fit_side(const side_points &side, double bloom_beside, double bloom_alone, tangent_line *out) {
  tangent_point found[kSamples];
  int count = side.count;
  for (int i = 0; i < count; i++)
    found[i] = side.at[i] + (bloom_alone + side.beside[side.sample[i]] * (bloom_beside - bloom_alone)) * side.to_white;
  for (int round = 0; round < 2; round++) {
    *out = line_through(found, count, side.to_white);
    int kept = 0;
    for (int i = 0; i < count; i++)
      if (std::fabs(dot(out->n, found[i]) - out->d) < kOutlier_px) found[kept++] = found[i];
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

// Whiteness behind each sample of a side: at `widths` of the band between the two borders inwards from `scale` times
// the side. 1 is the white next to the first border, 0 its black.
struct whiteness {
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
        white - black < kContrastMin_grey)
      return false;
    *out = (there - black) / (white - black);
    return true;
  }
};

// Where the other border exists along side `from`, by the whiteness on its far side, and where it has as much white
// behind it as the first one.
void find_other_border(const tangent_view &view, const wm_frame &frame, const wm_marker_print &print,
                       const homography &h, int from, side_points *side) {
  const whiteness look = {view, frame, print, h, print.corner[from], print.corner[(from + 1) % print.corners]};
  double sum = 0.0;
  for (int i = 0; i < kSamples; i++) {
    double beside, near, far;
    side->beside[i] = print.overlap;
    if (print.overlap < 1.0 && look.white(i, 1.0, 1.5, &beside))
      side->beside[i] = beside < 0.0 ? 0.0 : beside > 1.0 ? 1.0 : beside;
    side->deep[i] =
        look.white(i, print.other, 0.5, &near) && look.white(i, print.other, 1.5, &far) && near > 0.5 && far > 0.5;
  }
  for (int i = 0; i < side->count; i++) sum += side->beside[side->sample[i]];
  side->overlap = sum / side->count;
}

// Whether the other border exists at a sample and its neighbours: its rounded corners are left out.
bool has_other_border(const side_points &side, int sample) {
  for (int i = sample - 1; i <= sample + 1; i++)
    if (i >= 0 && i < kSamples && !side.deep[i]) return false;
  return true;
}

// Distance between the two borders on this side, px.
double width_of(const wm_marker_print &print, const homography &h, int side) {
  const double *a = print.corner[side], *b = print.corner[(side + 1) % print.corners];
  const double x = 0.5 * (a[0] + b[0]), y = 0.5 * (a[1] + b[1]);
  const tangent_point along = h(b[0], b[1]) - h(a[0], a[1]), apart = h(x, y) - h(print.other * x, print.other * y);
  return std::fabs(cross(along, apart)) / length(along);
}

// Reach of a profile that does not meet the other border, in whole steps.
double reach_of(double width_px) {
  const double reach = std::floor(2.0 * kReachOfWidth * width_px) * 0.5;
  return reach < kReachMin_px ? kReachMin_px : reach > kReach_px ? kReach_px : reach;
}

// Class of a width, not rounded.
double class_of(double width_px) {
  const double at = (width_px - kWidthMin_px) / kWidthStep_px;
  return at < 0.0 ? 0.0 : at > kWidths - 1.0 ? kWidths - 1.0 : at;
}

// Bias of find_edge towards white by the other edge of a band of this width, px: it cuts off the tail of the first one.
// Computed for a blur of 1 px sigma (lens, pixel and interpolation).
double tail_bias(double width_px) {
  static constexpr double kBias_px[kWidths] = {0.38, 0.29, 0.30, 0.30, 0.21, 0.15, 0.08, 0.05, 0.01, 0.0, 0.0, 0.0};
  const double at = class_of(width_px);
  const int i = static_cast<int>(at);
  return i + 1 < kWidths ? kBias_px[i] + (at - i) * (kBias_px[i + 1] - kBias_px[i]) : kBias_px[i];
}

// Bloom at a width: the mean over all classes, weighted by their number of sides and their distance, each corrected by
// the difference of the tail bias.
double bloom_of(const wm_marker_fit &self, double width_px) {
  const double at = class_of(width_px);
  double sum = 0.0, weights = 0.0;
  for (int i = 0; i < kWidths; i++) {
    const double weight = self.by_width[i].weight / square(1.0 + 4.0 * square(i - at));
    sum += weight * (self.by_width[i].bloom_px + tail_bias(kWidthMin_px + i * kWidthStep_px));
    weights += weight;
  }
  return weights > 0.0 ? sum / weights - tail_bias(width_px) : 0.0;
}

// Measures the bloom: both borders move away from white, in opposite directions, so their distance changes by twice it.
void measure_bloom(wm_marker_fit *self, const tangent_view &view, const wm_frame &frame, const homography &h,
                   const side_points *points, const double *width_px) {
  const wm_marker_print &print = self->print;
  const double sign = print.is_white_inside ? 1.0 : -1.0;  // outwards (1) or inwards to the other border's white
  for (int side = 0; side < print.corners; side++) {
    const double *a = print.corner[side], *b = print.corner[(side + 1) % print.corners];
    const double mx = 0.5 * (a[0] + b[0]), my = 0.5 * (a[1] + b[1]), reach = reach_of(width_px[side]);
    if (reach < kReachBloom_px) continue;
    double sum = 0.0;
    int count = 0;
    for (int i = 0; i < kSamples; i++) {
      if (!has_other_border(points[side], i)) continue;
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
    // Relative to the measured first border, the other one is off by its own bloom plus the first one's, scaled. Where
    // they are not next to each other, the first one has the bloom of a border alone.
    auto &known = self->by_width[static_cast<int>(class_of(width_px[side]) + 0.5)];
    const double alone =
        print.other * (1.0 - points[side].overlap) * (bloom_of(*self, kWide_px) - bloom_of(*self, width_px[side]));
    const double measured = (sum / count - alone) / (1.0 + print.other);
    if (std::fabs(measured) > kBloomMax_px) continue;
    if (known.weight < kBloomMemory) known.weight += 1.0;
    known.bloom_px += (measured - known.bloom_px) / known.weight;
  }
}

// Optical axes (x right, y down, z forward) to the body's (x forward, y left, z up).
vec3 body_of(const vec3 &optical) { return {optical.z, -optical.x, -optical.y}; }

// Centre in the camera body's frame, and the direction of the upper edge seen from above.
void write_pose(const wm_marker_fit &self, const marker_pose &pose, double p_m[3], double *yaw_rad) {
  const vec3 centre = body_of(pose.centre_m), upper = self.R_level_body * body_of(pose.right);
  for (int i = 0; i < 3; i++) p_m[i] = centre[i];
  *yaw_rad = atan2(upper.y, upper.x);
}

// Corners and homography of a print in the tangent plane of its middle, refined by its edges.
struct print_view {
  tangent_view view;
  tangent_point corner[WM_MARKER_CORNERS_MAX];
  tangent_line side[WM_MARKER_CORNERS_MAX];
  side_points points[WM_MARKER_CORNERS_MAX];
  double width_px[WM_MARKER_CORNERS_MAX];
  homography h;

  bool place(const lens &optics, const wm_marker_print &print, const double (*corners_px)[2]) {
    vec3 ray[WM_MARKER_CORNERS_MAX], middle = {0, 0, 0};
    for (int i = 0; i < print.corners; i++) {
      if (!unproject(optics, {corners_px[i][0], corners_px[i][1]}, &ray[i])) return false;
      middle = middle + ray[i];
    }
    if (!(length(middle) > 0.1) || !tangent_init(&view, optics, middle)) return false;
    for (int i = 0; i < print.corners; i++)
      if (!point_of_ray(view, ray[i], &corner[i])) return false;
    return homography_init(&h, print.corner, corner, print.corners);
  }
  // Measures all sides from the corners as they are, and moves the corners to where the sides meet.
  bool refine(const wm_frame &frame, const wm_marker_print &print) {
    const int count = print.corners;
    for (int i = 0; i < count; i++) {
      const tangent_point &a = corner[i], &b = corner[(i + 1) % count];
      const double size = length(b - a);
      if (!(size > kSideMin_px)) return false;
      width_px[i] = width_of(print, h, i);
      // Clockwise with y down: outwards is to the left of the direction.
      const double outwards = print.is_white_inside ? -1.0 : 1.0;
      const tangent_point to_white = {outwards * (b.y - a.y) / size, -outwards * (b.x - a.x) / size};
      if (!find_side(view, frame, a, b, to_white, reach_of(width_px[i]), &points[i]) ||
          !fit_side(points[i], 0.0, 0.0, &side[i]))
        return false;
    }
    return corners_of(side, count, corner) && homography_init(&h, print.corner, corner, count);
  }
  // Corrects the sides and corners by the bloom.
  bool correct_bloom(const wm_marker_fit &fit) {
    const int count = fit.print.corners;
    for (int i = 0; i < count; i++)
      if (!fit_side(points[i], bloom_of(fit, width_px[i]), bloom_of(fit, kWide_px), &side[i])) return false;
    return corners_of(side, count, corner);
  }
  // Sides, bloom, and corners without bloom. False where a side cannot be measured.
  bool measure(wm_marker_fit *fit, const wm_frame &frame) {
    const wm_marker_print &print = fit->print;
    // Twice: a profile that is not centred on its edge cuts off one tail more than the other.
    if (!refine(frame, print) || !refine(frame, print)) return false;
    for (int i = 0; i < print.corners; i++) find_other_border(view, frame, print, h, i, &points[i]);
    measure_bloom(fit, view, frame, h, points, width_px);
    return correct_bloom(*fit);
  }
  double shortest_px(int count) const {
    double least = length(corner[1] - corner[0]);
    for (int i = 1; i < count; i++) {
      const double size = length(corner[(i + 1) % count] - corner[i]);
      if (size < least) least = size;
    }
    return larger(least, kSideLeast_px);
  }
};

// Pose and sigmas by corners whose coordinates have this sigma; `rough`: a further sigma as a share of the print's
// size, or 0. False where no pose fits.
bool write_marker(const wm_marker_fit &self, const print_view &seen, double corner_px, double rough, wm_marker *out) {
  marker_poses poses;
  if (!pose_of(seen.view, self.print, seen.corner, corner_px, self.up, &poses)) return false;
  const vec3 all = poses.best.centre_m + poses.other.centre_m;
  if (!finite(all) || !(length(poses.best.centre_m) > 0.0)) return false;
  write_pose(self, poses.best, out->p_m, &out->yaw_rad);
  const double along_m = rough * length(poses.best.centre_m);
  out->along_sigma_m =
      poses.range_sigma_m > 0.0 || rough > 0.0 ? std::sqrt(square(poses.range_sigma_m) + square(along_m)) : kAbsent;
  out->yaw_sigma_rad = poses.turn_sigma_rad > 0.0 || rough > 0.0
                           ? std::sqrt(square(poses.turn_sigma_rad) + square(kTurnSigmaMin_rad) + square(rough))
                           : kAbsent;
  out->poses = poses.has_other ? 2 : 1;
  if (poses.has_other) {
    write_pose(self, poses.other, out->other_p_m, &out->other_yaw_rad);
  } else {
    for (double &p : out->other_p_m) p = kAbsent;
    out->other_yaw_rad = kAbsent;
  }
  return true;
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
  print_view seen;
  if (!seen.place(self->optics, print, corners_px)) return 0;
  const bool is_measured = seen.measure(self, *frame);
  if (!is_measured && !seen.place(self->optics, print, corners_px)) return 0;
  const double rough = is_measured ? 0.0 : kRough_px / seen.shortest_px(print.corners);
  if (!write_marker(*self, seen, kCorner_px, rough, out)) return 0;
  const double bloom_px = wm_marker_fit_bloom_px(self);
  out->bloom_px = bloom_px != 0.0 ? bloom_px : kAbsent;  // 0: not measured yet
  return 1;
}

int wm_marker_fit_corners(const wm_marker_fit *self, const double (*corners_px)[2], double sigma_px, wm_marker *out) {
  wm::print_view seen;
  if (!seen.place(self->optics, self->print, corners_px)) return 0;
  out->bloom_px = wm::kAbsent;
  return wm::write_marker(*self, seen, sigma_px, 0.0, out);
}

double wm_marker_fit_bloom_px(const wm_marker_fit *self) { return wm::bloom_of(*self, wm::kWide_px); }
