// SPDX-License-Identifier: Apache-2.0
#include "vision/markers/marker_pose.hpp"

namespace wm {

namespace {

constexpr double kCorner_px = 0.12;  // error of a corner, each coordinate
constexpr double kUndecided = 12.0;  // chi2 that the worse answer may be worse by
constexpr double kPlain = 25.0;      // chi2 above which a print is neither level nor upright
constexpr int kTurns = 33;
constexpr double kNever = 1e300;
constexpr double kTilted = 15.0;  // of a print that hangs freely: its tilt's noise, in corners' errors by its size
constexpr double kTiltedMax_rad = 0.08;
constexpr double kTurnMax_rad = 1.36;
constexpr double kLeastStep_rad = 0.005, kMostStep_rad = 0.05;  // when the turn's sigma is looked for

struct fit {
  marker_pose pose;
  double misfit;  // px^2, sum over the corners
};

// In its plane the print is known but for its place, direction and size: four numbers from the corners, by least
// squares. `n` points away from the camera.
bool fit_in_plane(const tangent_view &view, const wm_marker_print &print, const tangent_point *corner, const vec3 &n,
                  fit *out) {
  const vec3 across = {view.R_optical_view.m[0][0], view.R_optical_view.m[1][0], view.R_optical_view.m[2][0]};
  vec3 e1 = across - dot(across, n) * n;
  if (!(length(e1) > 1e-6)) return false;
  e1 = 1.0 / length(e1) * e1;
  const vec3 e2 = cross(n, e1);
  tangent_point on_plane[WM_MARKER_CORNERS_MAX], middle = {0, 0};
  for (int i = 0; i < print.corners; i++) {
    const vec3 ray = ray_of(view, corner[i]);
    const double depth = dot(ray, n);
    if (!(depth > 0.02)) return false;
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
  out->misfit = 0.0;
  for (int i = 0; i < print.corners; i++) {
    const double *c = print.corner[i];
    const double x = middle.x + re * c[0] - im * c[1], y = middle.y + im * c[0] + re * c[1];
    tangent_point expected;
    if (!point_of_ray(view, x * e1 + y * e2 + n, &expected)) return false;
    out->misfit += dot(corner[i] - expected, corner[i] - expected);
  }
  const double distance = print.size_m / scale;  // of the plane
  out->pose.centre_m = distance * (middle.x * e1 + middle.y * e2 + n);
  out->pose.right = 1.0 / scale * (re * e1 + im * e2);
  return true;
}

// The print's normal as the homography has it (Z. Zhang 2000: the columns of K^-1 H are its axes), away from the
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

// An upright print: what is open is its turn about the vertical.
struct turning {
  const tangent_view &view;
  const wm_marker_print &print;
  const tangent_point *corner;
  vec3 ahead, aside;  // level; ahead is towards the print

  bool at(double turn, fit *out) const {
    const sin_cos s = sincos(turn);
    return fit_in_plane(view, print, corner, s.cos * ahead + s.sin * aside, out);
  }
};

// A lowest place of the misfit between two turns about `turn`, by parabolas; its curvature, too.
bool refine(const turning &t, double *turn, double step, fit *best, double *curvature) {
  if (!t.at(*turn, best)) return false;
  for (int i = 0; i < 6; i++) {
    fit left, right;
    if (!t.at(*turn - step, &left) || !t.at(*turn + step, &right)) return false;
    const double slope = (right.misfit - left.misfit) / (2 * step);
    *curvature = (right.misfit - 2 * best->misfit + left.misfit) / (step * step);
    double move = *curvature > 1e-9 ? -slope / *curvature : slope > 0 ? -step : step;
    if (std::fabs(move) > step) move = move > 0 ? step : -step;
    fit moved;
    if (!t.at(*turn + move, &moved)) return false;
    if (moved.misfit < best->misfit) *best = moved, *turn += move;
    step *= 0.5;
  }
  return true;
}

// How far the turn may go from the best one towards `step` until chi2 has grown by 4, which is two sigmas.
double two_sigmas(const turning &t, double turn, double least, double step) {
  const double most = least + 4.0 * square(kCorner_px);
  double before = least;
  for (double way = step;; way += step) {
    fit f;
    if (std::fabs(turn + way) > kTurnMax_rad || !t.at(turn + way, &f)) return std::fabs(way);
    if (f.misfit > most) return std::fabs(way - step * (f.misfit - most) / (f.misfit - before));
    before = f.misfit;
  }
}

// The misfit of the better answer, or infinity.
double fit_upright(const turning &t, marker_poses *out) {
  double misfit[kTurns];
  const double step = 2 * kTurnMax_rad / (kTurns - 1);
  for (int i = 0; i < kTurns; i++) {
    fit f;
    misfit[i] = t.at(-kTurnMax_rad + i * step, &f) ? f.misfit : kNever;
  }
  int found = 0;
  fit best[2];
  double turn[2] = {}, curvature[2] = {};
  for (int i = 0; i < kTurns; i++) {
    if (misfit[i] >= kNever || (i > 0 && misfit[i - 1] < misfit[i]) || (i + 1 < kTurns && misfit[i + 1] <= misfit[i]))
      continue;
    fit f;
    double at = -kTurnMax_rad + i * step, bend = 0;
    if (!refine(t, &at, step, &f, &bend)) continue;
    if (found < 2) {
      best[found] = f, turn[found] = at, curvature[found++] = bend;
    } else if (f.misfit < larger(best[0].misfit, best[1].misfit)) {
      const int worse = best[0].misfit > best[1].misfit ? 0 : 1;
      best[worse] = f, turn[worse] = at, curvature[worse] = bend;
    }
  }
  if (found == 0) return kNever;
  const int first = found == 2 && best[1].misfit < best[0].misfit ? 1 : 0;
  // A print looks narrower by the cosine of its turn, which noise reaches only from below: seen nearly face on, the
  // best turn is too large to either side, and the truth anywhere between. So its sigma is by how far the misfit stays
  // low.
  const double noise = square(kCorner_px);
  const double bend_sigma = std::sqrt(2 * noise / larger(curvature[first], 2 * noise / square(0.5)));
  const double step_rad = bend_sigma > kMostStep_rad ? kMostStep_rad : larger(bend_sigma, kLeastStep_rad);
  const double left = two_sigmas(t, turn[first], best[first].misfit, -step_rad);
  const double right = two_sigmas(t, turn[first], best[first].misfit, step_rad);
  const double middle = turn[first] + 0.5 * (right - left);
  fit at_middle, beside;
  if (!t.at(middle, &at_middle)) return kNever;
  out->best = at_middle.pose;
  out->turn_sigma_rad = 0.25 * (left + right);
  if (found == 2) {
    const double apart = turn[1 - first] - turn[first];
    out->has_other =
        best[1 - first].misfit - best[first].misfit < kUndecided * noise && (apart < -left || apart > right);
    out->other = best[1 - first].pose;
  }
  const double distance = length(out->best.centre_m);
  const double size_px = t.print.size_m / distance * t.view.focal_px;
  out->range_sigma_m = distance * kCorner_px / (0.5 * size_px);
  if (t.at(middle + 0.01, &beside))
    out->range_sigma_m = std::sqrt(square(out->range_sigma_m) +
                                   square((length(beside.pose.centre_m) - distance) / 0.01 * out->turn_sigma_rad));
  return best[first].misfit;
}

}  // namespace

bool pose_of(const tangent_view &view, const wm_marker_print &print, const tangent_point *corner, const vec3 &up,
             marker_poses *out) {
  // A small print's own tilt is mostly noise: whether it hangs level or upright is told by which of them fits.
  const vec3 ahead = {view.R_optical_view.m[0][2], view.R_optical_view.m[1][2], view.R_optical_view.m[2][2]};
  const vec3 level = ahead - dot(ahead, up) * up;
  *out = marker_poses{};
  double upright_misfit = kNever;
  if (length(level) > 0.3) {
    const vec3 forward = 1.0 / length(level) * level;
    upright_misfit = fit_upright({view, print, corner, forward, cross(up, forward)}, out);
  }
  fit flat_fit;
  const bool is_level = fit_in_plane(view, print, corner, dot(ahead, up) > 0.0 ? up : -1.0 * up, &flat_fit);
  const double noise = square(kCorner_px), level_misfit = is_level ? flat_fit.misfit : kNever;
  if (upright_misfit < kPlain * noise && upright_misfit <= level_misfit) return true;
  *out = marker_poses{};
  if (level_misfit < kPlain * noise) {
    out->best = flat_fit.pose;
    return true;
  }
  // Neither: as its corners have it, which noise tilts; of a small one that says nothing.
  vec3 n;
  fit tilted;
  if (!rough_normal(view, print, corner, &n) || !fit_in_plane(view, print, corner, n, &tilted)) return false;
  out->best = tilted.pose;
  const double distance = length(tilted.pose.centre_m), size_px = print.size_m / distance * view.focal_px;
  out->turn_sigma_rad = kTilted * kCorner_px / size_px;
  out->range_sigma_m = distance * out->turn_sigma_rad;
  return out->turn_sigma_rad < kTiltedMax_rad;
}

}  // namespace wm
