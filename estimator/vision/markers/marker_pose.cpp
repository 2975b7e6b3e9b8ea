// SPDX-License-Identifier: Apache-2.0
#include "vision/markers/marker_pose.hpp"

namespace wm {

namespace {

constexpr double kAmbiguous_chi2 = 12.0;   // difference up to which the second solution is kept: 3.5 sigma
constexpr double kPlane_chi2 = 25.0;       // above, a print is neither level nor upright: 8 corners' coordinates - 4
constexpr int kTurns = 33;                 // angles of the coarse search: 5 degrees, the minima are wider
constexpr double kNever = 1e300;           // cost
constexpr double kFreeTilt_rad = 15.0;     // tilt sigma of a free print, per corner's error over its size. Not swept
constexpr double kFreeTiltMax_rad = 0.25;  // a free print whose tilt is less certain is refused: below 7 px. Not swept
constexpr double kTurnMax_rad = 1.36;      // largest angle of an upright print to the line of sight: 78 degrees
constexpr double kStepMin_rad = 0.005, kStepMax_rad = 0.05;  // of the search for the turn's sigma
constexpr double kTurnPrior_rad = 0.5;                       // sigma at which the curvature is cut off
constexpr double kDerivativeStep_rad = 0.01;                 // of the range by the turn
constexpr double kDepthMin = 0.02;  // depth along the normal of a ray of length 1: a plane seen edge on
constexpr double kLevelMin = 0.3;   // level part of the view's axis below which no wall is in view

struct plane_fit {
  marker_pose pose;
  double cost_px2;  // sum of squared residuals of the corners
};

// Fits the print's place, rotation and scale in a plane of normal `n` (pointing away from the camera): a similarity by
// least squares.
bool fit_in_plane(const tangent_view &view, const wm_marker_print &print, const tangent_point *corner, const vec3 &n,
                  plane_fit *out) {
  const vec3 across = {view.R_optical_view.m[0][0], view.R_optical_view.m[1][0], view.R_optical_view.m[2][0]};
  vec3 e1 = across - dot(across, n) * n;
  if (!(length(e1) > 1e-6)) return false;
  e1 = 1.0 / length(e1) * e1;
  const vec3 e2 = cross(n, e1);
  tangent_point on_plane[WM_MARKER_CORNERS_MAX], middle = {0, 0};
  for (int i = 0; i < print.corners; i++) {
    const vec3 ray = ray_of(view, corner[i]);
    const double depth = dot(ray, n);
    if (!(depth > kDepthMin)) return false;
    on_plane[i] = {dot(ray, e1) / depth, dot(ray, e2) / depth};
    middle = middle + (1.0 / print.corners) * on_plane[i];
  }
  double re = 0.0, im = 0.0, size = 0.0;
  for (int i = 0; i < print.corners; i++) {
    const tangent_point c = {print.corner[i][0], print.corner[i][1]};
    re += dot(on_plane[i], c), im += cross(c, on_plane[i]), size += dot(c, c);
  }
  re /= size, im /= size;
  const double scale = std::sqrt(re * re + im * im);
  if (!(scale > 1e-9)) return false;
  out->cost_px2 = 0.0;
  for (int i = 0; i < print.corners; i++) {
    const double *c = print.corner[i];
    const double x = middle.x + re * c[0] - im * c[1], y = middle.y + im * c[0] + re * c[1];
    tangent_point expected;
    if (!point_of_ray(view, x * e1 + y * e2 + n, &expected)) return false;
    out->cost_px2 += dot(corner[i] - expected, corner[i] - expected);
  }
  const double distance = print.size_m / scale;  // of the plane
  out->pose.centre_m = distance * (middle.x * e1 + middle.y * e2 + n);
  out->pose.right = 1.0 / scale * (re * e1 + im * e2);
  return true;
}

// The print's normal as the homography has it ([Zhang2000]: the columns of K^-1 H are its axes), away from the
// camera.
bool rough_normal(const tangent_view &view, const wm_marker_print &print, const tangent_point *corner, vec3 *out) {
  homography h;
  if (!homography_init(&h, print.corner, corner, print.corners)) return false;
  const double f = view.focal_px;
  const vec3 a = {h.h[0][0] / f, h.h[1][0] / f, h.h[2][0]}, b = {h.h[0][1] / f, h.h[1][1] / f, h.h[2][1]};
  const vec3 n = cross(a, b);
  if (!(length(n) > 1e-12)) return false;
  *out = view.R_optical_view * (1.0 / length(n) * n);
  return true;
}

// An upright print: its free angle is the turn about the vertical.
struct upright_print {
  const tangent_view &view;
  const wm_marker_print &print;
  const tangent_point *corner;
  double corner_px;   // sigma of a coordinate
  vec3 ahead, aside;  // level; ahead is towards the print

  bool at(double turn, plane_fit *out) const {
    const sin_cos s = sincos(turn);
    return fit_in_plane(view, print, corner, s.cos * ahead + s.sin * aside, out);
  }
};

// Minimum of the cost near `turn` by parabolas, and the curvature there.
bool refine(const upright_print &t, double *turn, double step, plane_fit *best, double *curvature) {
  if (!t.at(*turn, best)) return false;
  for (int i = 0; i < 6; i++) {
    plane_fit left, right;
    if (!t.at(*turn - step, &left) || !t.at(*turn + step, &right)) return false;
    const double slope = (right.cost_px2 - left.cost_px2) / (2 * step);
    *curvature = (right.cost_px2 - 2 * best->cost_px2 + left.cost_px2) / (step * step);
    double move = *curvature > 1e-9 ? -slope / *curvature : slope > 0 ? -step : step;
    if (std::fabs(move) > step) move = move > 0 ? step : -step;
    plane_fit moved;
    if (!t.at(*turn + move, &moved)) return false;
    if (moved.cost_px2 < best->cost_px2) *best = moved, *turn += move;
    step *= 0.5;
  }
  return true;
}

// Distance from the best turn in the direction of `step` at which chi2 has grown by 4, which is two sigmas.
double two_sigmas(const upright_print &t, double turn, double least, double step) {
  const double most = least + 4.0 * square(t.corner_px);
  double before = least;
  for (double off = step;; off += step) {
    plane_fit f;
    if (std::fabs(turn + off) > kTurnMax_rad || !t.at(turn + off, &f)) return std::fabs(off);
    if (f.cost_px2 > most) return std::fabs(off - step * (f.cost_px2 - most) / (f.cost_px2 - before));
    before = f.cost_px2;
  }
}

// The two best minima of the cost over the turn.
struct turn_minima {
  int count;
  plane_fit fit[2];
  double turn[2], curvature[2];

  void add(const plane_fit &f, double at, double bend) {
    int place = count;
    if (count == 2) {
      if (!(f.cost_px2 < larger(fit[0].cost_px2, fit[1].cost_px2))) return;
      place = fit[0].cost_px2 > fit[1].cost_px2 ? 0 : 1;
    } else {
      count++;
    }
    fit[place] = f, turn[place] = at, curvature[place] = bend;
  }
  int best() const { return count == 2 && fit[1].cost_px2 < fit[0].cost_px2 ? 1 : 0; }
};

turn_minima find_minima(const upright_print &t) {
  double cost_px2[kTurns];
  const double step = 2 * kTurnMax_rad / (kTurns - 1);
  for (int i = 0; i < kTurns; i++) {
    plane_fit f;
    cost_px2[i] = t.at(-kTurnMax_rad + i * step, &f) ? f.cost_px2 : kNever;
  }
  turn_minima out{};
  for (int i = 0; i < kTurns; i++) {
    if (cost_px2[i] >= kNever || (i > 0 && cost_px2[i - 1] < cost_px2[i]) ||
        (i + 1 < kTurns && cost_px2[i + 1] <= cost_px2[i]))
      continue;
    plane_fit f;
    double at = -kTurnMax_rad + i * step, bend = 0;
    if (refine(t, &at, step, &f, &bend)) out.add(f, at, bend);
  }
  return out;
}

// Best turn of an upright print. Returns the cost of the best minimum, or kNever.
double fit_upright(const upright_print &t, marker_poses *out) {
  const turn_minima minima = find_minima(t);
  if (minima.count == 0) return kNever;
  const int first = minima.best();
  const double turn = minima.turn[first], least = minima.fit[first].cost_px2;
  // The width of a print shrinks with the cosine of its turn, which noise reaches only from below: seen nearly face on,
  // the best turn is too large to either side. So estimate and sigma are those of the interval in which chi2 stays low.
  const double noise = square(t.corner_px);
  const double curvature_sigma =
      std::sqrt(2 * noise / larger(minima.curvature[first], 2 * noise / square(kTurnPrior_rad)));
  const double step_rad = curvature_sigma > kStepMax_rad ? kStepMax_rad : larger(curvature_sigma, kStepMin_rad);
  const double left = two_sigmas(t, turn, least, -step_rad), right = two_sigmas(t, turn, least, step_rad);
  const double middle = turn + 0.5 * (right - left);
  plane_fit at_middle, beside;
  if (!t.at(middle, &at_middle)) return kNever;
  out->best = at_middle.pose;
  out->turn_sigma_rad = 0.25 * (left + right);
  if (minima.count == 2) {
    const double apart = minima.turn[1 - first] - turn;
    out->has_other =
        minima.fit[1 - first].cost_px2 - least < kAmbiguous_chi2 * noise && (apart < -left || apart > right);
    out->other = minima.fit[1 - first].pose;
  }
  const double distance = length(out->best.centre_m);
  const double size_px = t.print.size_m / distance * t.view.focal_px;
  out->range_sigma_m = distance * t.corner_px / (0.5 * size_px);
  if (t.at(middle + kDerivativeStep_rad, &beside))
    out->range_sigma_m = std::sqrt(square(out->range_sigma_m) + square((length(beside.pose.centre_m) - distance) /
                                                                       kDerivativeStep_rad * out->turn_sigma_rad));
  return least;
}

}  // namespace

bool pose_of(const tangent_view &view, const wm_marker_print &print, const tangent_point *corner, double corner_px,
             const vec3 &up, marker_poses *out) {
  // The tilt of a small print is mostly noise, so the better fit of level and upright decides.
  const vec3 ahead = {view.R_optical_view.m[0][2], view.R_optical_view.m[1][2], view.R_optical_view.m[2][2]};
  const vec3 level = ahead - dot(ahead, up) * up;
  *out = marker_poses{};
  double upright_cost_px2 = kNever;
  if (length(level) > kLevelMin) {
    const vec3 forward = 1.0 / length(level) * level;
    upright_cost_px2 = fit_upright({view, print, corner, corner_px, forward, cross(up, forward)}, out);
  }
  plane_fit level_fit;
  const bool is_level = fit_in_plane(view, print, corner, dot(ahead, up) > 0.0 ? up : -1.0 * up, &level_fit);
  const double noise = square(corner_px), level_cost_px2 = is_level ? level_fit.cost_px2 : kNever;
  if (upright_cost_px2 < kPlane_chi2 * noise && upright_cost_px2 <= level_cost_px2) return true;
  *out = marker_poses{};
  if (level_cost_px2 < kPlane_chi2 * noise) {
    out->best = level_fit.pose;
    return true;
  }
  // Neither: a free print, by its homography. Of a small one the tilt is noise.
  vec3 n;
  plane_fit tilted;
  if (!rough_normal(view, print, corner, &n) || !fit_in_plane(view, print, corner, n, &tilted)) return false;
  out->best = tilted.pose;
  const double distance = length(tilted.pose.centre_m), size_px = print.size_m / distance * view.focal_px;
  out->turn_sigma_rad = kFreeTilt_rad * corner_px / size_px;
  out->range_sigma_m = distance * out->turn_sigma_rad;
  return out->turn_sigma_rad < kFreeTiltMax_rad;
}

}  // namespace wm
