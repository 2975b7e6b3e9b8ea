// SPDX-License-Identifier: Apache-2.0
#include "vision/landmarks/matcher.hpp"

#include <limits>

namespace wm {
namespace {

constexpr double kBlurred = 0.35;   // fraction of the drawn contrast, below which an unlike place counts as blurred
constexpr double kSmall_px2 = 30;   // a landmark of n px^2 needs a likeness of 1 - (1 - min) n / (n + this). Not swept
constexpr double kApartMin = 0.06;  // likeness of the best place above the second one. Not swept
constexpr double kSigmaFactor = 1.3;    // of the fit's sigma: errors of neighbouring pixels are correlated
constexpr double kSigmaOfSize = 0.002;  // of the middle, in sizes: errors of the learnt picture, other light
constexpr double kSizeMin_px = 7;       // shorter side of a landmark in the picture: smaller ones are ambiguous
constexpr double kBlur_px = 0.6;        // sigma of the picture's blur: lens and compression
constexpr double kMargin_px = 2;        // from the edge of the picture
constexpr double kFits = 1.1;           // of the longer side, beside 4 px: room in the drawn view for a tilted landmark
constexpr double kBeforeAlign = 0.1;    // likeness on whole pixels may be this much below the needed one
constexpr double kContrastMin_grey = 4;       // standard deviation of a place in the picture: noise has 1 to 3
constexpr double kNear_px = 8, kFar_px = 32;  // window, from likeness_min to likeness_far

double likeness_needed(const matcher &self, int pixels, double reach_px) {
  const double near = 1 - (1 - self.params.likeness_min) * pixels / (pixels + kSmall_px2);
  const double far = (reach_px - kNear_px) / (kFar_px - kNear_px);
  return near + (far < 0 ? 0 : far > 1 ? 1 : far) * (larger(near, self.params.likeness_far) - near);
}

}  // namespace

wm_look expect_landmark(const matcher &self, const camera_guess &guess, const appearance &what, double area_max,
                        expected_view *out) {
  out->what = &what;
  if (!view_panel(what, guess.R_map_optical, guess.eye_m, &out->view)) return WM_LOOK_FACES_AWAY;
  if (!(out->view.distance < self.params.range_max_m)) return WM_LOOK_NOT_IN_VIEW;
  const auto in_picture = [&](const vec3 &point, pixel *at) {
    return project(self.camera.optics, point, at) && at->u >= kMargin_px && at->v >= kMargin_px &&
           at->u <= self.camera.width_px - 1 - kMargin_px && at->v <= self.camera.height_px - 1 - kMargin_px;
  };
  if (!in_picture(out->view.middle, &out->middle)) return WM_LOOK_NOT_IN_VIEW;
  if (!(out->view.facing >= kFacingMin)) return WM_LOOK_FACES_AWAY;
  const sin_cos yaw = sincos(what.yaw_rad);
  const vec3 right =
                 transposed_times(guess.R_map_optical, {0.5 * what.width_m * yaw.cos, 0.5 * what.width_m * yaw.sin, 0}),
             up = transposed_times(guess.R_map_optical, {0, 0, 0.5 * what.height_m}), m = out->view.middle;
  const vec3 corners[4] = {m - right + up, m + right + up, m + right - up, m - right - up};
  for (int i = 0; i < 4; i++)
    if (!in_picture(corners[i], &out->corners[i])) return WM_LOOK_NOT_IN_VIEW;
  const auto side = [&](int a, int b) {
    return std::sqrt(square(out->corners[a].u - out->corners[b].u) + square(out->corners[a].v - out->corners[b].v));
  };
  const double wide = 0.5 * (side(0, 1) + side(2, 3)), high = 0.5 * (side(1, 2) + side(3, 0));
  out->shorter_px = wide < high ? wide : high;
  out->area_px2 = wide * high;
  if (!(out->shorter_px >= kSizeMin_px)) return WM_LOOK_TOO_SMALL;
  out->level = 0;
  const double longer = wide < high ? high : wide;
  while (out->level + 1 < kLevels &&
         (wide * high > area_max * (1 << (2 * out->level)) || kFits * longer + 4 > (drawn_view::kSide << out->level)))
    out->level++;
  return WM_LOOK_FOUND;
}

wm_look match_landmark(matcher *self, const expected_view &one, double across_px, double down_px, bool is_final,
                       landmark_match *out) {
  out->likeness = std::numeric_limits<double>::quiet_NaN();
  if (!draw(*one.what, one.view, self->rays, one.corners, one.level, kBlur_px, &self->drawn))
    return WM_LOOK_NOT_IN_VIEW;
  const double step = 1 << one.level;
  const double across = across_px / step + 1, down = down_px / step + 1;
  if (!(across < kReachMax) || !(down < kReachMax)) return WM_LOOK_UNCERTAIN;
  const grey_plane &picture = self->picture.level[one.level];
  best_place best;
  if (!search_window(picture, self->drawn, static_cast<int>(across), static_cast<int>(down), self->scores, &best))
    return WM_LOOK_NOT_IN_VIEW;
  out->likeness = best.likeness;
  if (best.spread_grey < kContrastMin_grey) return WM_LOOK_LOW_CONTRAST;
  const double needed = likeness_needed(*self, self->drawn.count, is_final ? larger(across_px, down_px) : 0);
  if (best.likeness < needed - kBeforeAlign)
    return best.spread_grey < kBlurred * self->drawn.spread_grey ? WM_LOOK_BLURRED : WM_LOOK_UNLIKE;
  aligned fine;
  const pixel middle = {one.middle.u / step, one.middle.v / step};
  if (!align_landmark(picture, self->drawn, middle, best.right, best.down, &self->work, &fine)) return WM_LOOK_UNLIKE;
  out->likeness = fine.likeness;
  if (fine.likeness < needed) return WM_LOOK_UNLIKE;
  if (best.second > larger(fine.likeness, best.likeness) - kApartMin) return WM_LOOK_AMBIGUOUS;
  const double scale = square(step * kSigmaFactor),
               floor = square(self->params.sigma_px) + square(kSigmaOfSize * step) * self->drawn.count;
  out->at = {fine.middle.u * step, fine.middle.v * step};
  out->wider = fine.wider;
  out->taller = fine.taller;
  out->uu = scale * fine.uu + floor;
  out->uv = scale * fine.uv;
  out->vv = scale * fine.vv + floor;
  return WM_LOOK_FOUND;
}

}  // namespace wm
