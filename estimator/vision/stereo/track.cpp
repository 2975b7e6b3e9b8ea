// SPDX-License-Identifier: Apache-2.0
#include "vision/stereo/track.hpp"

#include <cstring>

namespace wm {
namespace {

constexpr int kRounds = 8;                // of an alignment; most settle in 4
constexpr double kCoarseReach_px = 10.0;  // of its level: half a patch
constexpr double kFineReach_px = 4.0;     // at full resolution: two pixels of the level above, and the prediction
constexpr double kRow_px = 1.0;           // largest distance of a match from its epipolar line
constexpr double kSlopeMax = 0.6;         // of a disparity, px per px: steeper surfaces are seen too obliquely
constexpr double kPeakMin = 0.4;          // squared correlation of the first match. Not swept
constexpr double kRatioMax = 0.85;        // second best over best: above, the match is ambiguous. Not swept
constexpr double kFitMin = 0.5;           // fraction of a patch's variance that its template explains. Not swept
constexpr double kCoarseFitMin = 0.3;     // of an alignment in a smaller picture. Not swept
constexpr double kDetMin = 0.1, kDetMax = 10.0;  // change of a patch's area since its first picture

pixel at_level(const pixel &at, int level) {
  const double s = 1.0 / (1 << level);
  return {s * at.u, s * at.v};
}

// The surface n x = 1 through a place whose disparity changes by the slopes. d = b n' (fu x, fu y fv.., ..) is linear
// in u and v: n_x = slope_u / b, n_y = slope_v fv / (fu b).
vec3 surface_of(const pair_geometry &rig, const vec3 &place, const double slope[2]) {
  const double x = slope[0] / rig.baseline_m, y = slope[1] * rig.fv / (rig.fu * rig.baseline_m);
  return {x, y, (1.0 - x * place.x - y * place.y) / place.z};
}

void slope_of(const pair_geometry &rig, const vec3 &surface, double slope[2]) {
  slope[0] = surface.x * rig.baseline_m;
  slope[1] = surface.y * rig.baseline_m * rig.fu / rig.fv;
}

bool is_flat(const double slope[2]) { return std::fabs(slope[0]) < kSlopeMax && std::fabs(slope[1]) < kSlopeMax; }

// From offsets in the right picture to those in the left one.
warp2 left_by_right(const double slope[2]) {
  const double s = 1.0 / (1.0 - slope[0]);
  return {s, s * slope[1], 0.0, 1.0};
}

// Matches the left place in the right picture, about `start`, by the sheared patch.
bool match_right(const pair_pictures &pictures, const pixel &left, const double slope[2], const pixel &start,
                 alignment *out) {
  patch_template what;
  return make_template(pictures.left->level[0], left, left_by_right(slope), &what) &&
         align(what, pictures.right->level[0], start, kFineReach_px, kRounds, out);
}

bool is_good(const alignment &match) { return match.fit >= kFitMin && match.sigma_px <= kSigmaMax_px; }

// Stores both places. False where they are no point in front of the rig.
bool take_pair(const pair_geometry &rig, const wm_stereo_params &params, const pixel &left, const pixel &right,
               track *self) {
  const double disparity = left.u - right.u;
  if (!(disparity >= params.disparity_min_px) || !(disparity <= params.disparity_max_px)) return false;
  if (!(std::fabs(left.v - right.v) <= kRow_px)) return false;
  self->left = left;
  self->right = right;
  self->place = place_of(rig, {left.u, left.v, right.u});
  return true;
}

// Warp from offsets now to offsets in the first picture: inverse of the derivatives of the map over the surface, by
// differences over the patch.
bool anchor_by_now(const pair_geometry &rig, const track &self, const rigid &camera_anchor, warp2 *out) {
  constexpr double kStep_px = 4.0;  // of the differences: half of a patch
  const auto seen_now = [&](double du, double dv, pair_pixels *px) {
    const vec3 ray = {(self.anchor.u + du - rig.cu) / rig.fu, (self.anchor.v + dv - rig.cv) / rig.fv, 1.0};
    const double inverse_depth = dot(self.anchor_surface, ray);
    return inverse_depth > 1e-6 && pixels_of(rig, camera_anchor * ((1.0 / inverse_depth) * ray), px);
  };
  pair_pixels right, left, below, above;
  if (!seen_now(kStep_px, 0, &right) || !seen_now(-kStep_px, 0, &left) || !seen_now(0, kStep_px, &below) ||
      !seen_now(0, -kStep_px, &above))
    return false;
  const double s = 0.5 / kStep_px;
  const double uu = s * (right.left_u - left.left_u), vu = s * (right.left_v - left.left_v);
  const double uv = s * (below.left_u - above.left_u), vv = s * (below.left_v - above.left_v);
  const double det = uu * vv - uv * vu;
  if (!(det > kDetMin) || !(det < kDetMax)) return false;
  *out = {vv / det, -uv / det, -vu / det, uu / det};
  return true;
}

// The first match of a corner: along the row in pictures of half the size, then aligned there. `slope`: of the
// disparity, 0 where the patch cannot give it.
bool first_match(const pair_pictures &pictures, const wm_stereo_params &params, const pixel &half, alignment *match,
                 double slope[2]) {
  patch_template what;
  if (!make_template(pictures.left->level[1], half, kNoWarp, &what)) return false;
  const auto u = static_cast<int32_t>(std::floor(half.u + 0.5)), v = static_cast<int32_t>(std::floor(half.v + 0.5));
  const auto first = u - static_cast<int32_t>(params.disparity_max_px / 2),
             last = u - static_cast<int32_t>(params.disparity_min_px / 2);
  int32_t found;
  double best, second;
  if (!search_row(what, pictures.right->level[1], first > 0 ? first : 0, last, v, &found, &best, &second)) return false;
  if (best < kPeakMin || second > kRatioMax * best) return false;
  if (!align(what, pictures.right->level[1], {half.u + (found - u), half.v + 0.0}, kFineReach_px, kRounds, match))
    return false;
  slope[0] = slope[1] = 0;
  if (fit_slopes(what, pictures.right->level[1], match->at, slope)) {
    slope[0] = -slope[0];  // right.u = left.u - disparity
    slope[1] = -slope[1];
  }
  if (!is_flat(slope)) slope[0] = slope[1] = 0;
  return true;
}

// The picture about the corner, for later templates; pixels beyond the picture repeat its edge.
void keep_patch(const grey_plane &picture, const pixel &at, uint8_t *patch) {
  const auto corner_u = static_cast<int32_t>(at.u), corner_v = static_cast<int32_t>(at.v);
  for (int i = 0; i < kAnchorSide; i++)
    for (int j = 0; j < kAnchorSide; j++) {
      int32_t x = corner_u + j - kAnchorSide / 2, y = corner_v + i - kAnchorSide / 2;
      x = x < 0 ? 0 : x >= picture.width ? picture.width - 1 : x;
      y = y < 0 ? 0 : y >= picture.height ? picture.height - 1 : y;
      patch[i * kAnchorSide + j] = picture.grey[static_cast<ptrdiff_t>(y) * picture.width + x];
    }
}

}  // namespace

bool begin_track(const pair_geometry &rig, const pair_pictures &pictures, const wm_stereo_params &params,
                 const pixel &at, const rigid &world_camera, track *out) {
  alignment match;
  double slope[2];
  if (!first_match(pictures, params, at_level(at, 1), &match, slope)) return false;
  if (!match_right(pictures, at, slope, {2 * match.at.u, 2 * match.at.v}, &match) || !is_good(match)) return false;
  if (!take_pair(rig, params, at, match.at, out)) return false;
  std::memcpy(out->slope, slope, sizeof slope);
  out->seen = 1;
  out->anchor = at;
  out->anchor_place = out->place;
  out->anchor_surface = surface_of(rig, out->place, slope);
  out->world_anchor = world_camera;
  keep_patch(pictures.left->level[0], at, out->patch);
  return true;
}

bool follow_track(const pair_geometry &rig, const pair_pictures &pictures, const wm_stereo_params &params,
                  const rigid &camera_before, const rigid &camera_world, int levels, track *self) {
  const vec3 expected = camera_before * self->place;
  pair_pixels px;
  if (!pixels_of(rig, expected, &px)) return false;
  pixel at = {px.left_u, px.left_v};
  alignment match;
  // From small pictures to larger ones against the picture before.
  patch_template what;
  for (int level = levels; level > 0; level--) {
    if (!make_template(pictures.before->level[level], at_level(self->left, level), kNoWarp, &what)) continue;
    if (!align(what, pictures.left->level[level], at_level(at, level), kCoarseReach_px, kRounds, &match)) continue;
    if (match.fit < kCoarseFitMin) continue;
    at = {match.at.u * (1 << level), match.at.v * (1 << level)};
  }
  // Then against its first patch.
  const rigid camera_anchor = camera_world * self->world_anchor;
  warp2 warp;
  if (!anchor_by_now(rig, *self, camera_anchor, &warp)) return false;
  const grey_plane anchor = {self->patch, kAnchorSide, kAnchorSide};
  constexpr double kCentre = kAnchorSide * 0.5;
  const pixel middle = {kCentre + (self->anchor.u - std::floor(self->anchor.u)),
                        kCentre + (self->anchor.v - std::floor(self->anchor.v))};
  if (!make_template(anchor, middle, warp, &what)) return false;
  if (!align(what, pictures.left->level[0], at, kFineReach_px, kRounds, &match) || !is_good(match)) return false;
  const pixel left = match.at;
  // Left to right, by the surface as it lies now: n' = R n / (1 + (R n) t).
  const vec3 turned = camera_anchor.R * self->anchor_surface;
  double slope[2];
  slope_of(rig, (1.0 / (1.0 + dot(turned, camera_anchor.t))) * turned, slope);
  if (!is_flat(slope)) return false;
  const double disparity = px.left_u - px.right_u;
  if (!match_right(pictures, left, slope, {left.u - disparity, left.v}, &match) || !is_good(match)) return false;
  if (!take_pair(rig, params, left, match.at, self)) return false;
  std::memcpy(self->slope, slope, sizeof slope);
  self->seen++;
  return true;
}

}  // namespace wm
