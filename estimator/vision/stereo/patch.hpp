// SPDX-License-Identifier: Apache-2.0
// Sub-pixel matching of a patch in another picture, with brightness and contrast free. Pixels and their sums are
// integers, the few numbers computed of the sums doubles: the same bits everywhere. Sources: [Lucas1981]; [Baker2004]
// (inverse compositional: derivatives of the template, computed once).
#ifndef WAYMARK_ESTIMATOR_VISION_PATCH_HPP
#define WAYMARK_ESTIMATOR_VISION_PATCH_HPP

#include "waymark/internal/image/pyramid.hpp"
#include "waymark/internal/sensors/lens.hpp"

namespace wm {

inline constexpr int kPatch = 24;  // pixels on a side: contrast against the depth differences of a sea floor. Not swept
inline constexpr int kPatchPixels = kPatch * kPatch;
inline constexpr int kPatchHalf = kPatch / 2;  // the patch reaches from -kPatchHalf to kPatchHalf - 1 about its point

// In eighths of a grey level about the middle one, so that no sum of a patch's products leaves 32 bits.
struct patch_template {
  alignas(16) int16_t grey[kPatchPixels], across[kPatchPixels], down[kPatchPixels];  // and its slopes
  double mean[3];                                                                    // of the three
  double inverse[3][3];  // of the sums of their products, each about its mean
};

// Offsets in the source picture by offsets in the patch.
struct warp2 {
  double uu, uv, vu, vv;  // u by u, u by v, v by u, v by v
};
inline constexpr warp2 kNoWarp = {1, 0, 0, 1};  // identity

// Template about `at`, warped. False where it leaves the picture or has no contrast in some direction.
bool make_template(const grey_plane &picture, const pixel &at, const warp2 &warp, patch_template *out);

struct alignment {
  pixel at;
  double fit;       // fraction of the variance that the template explains
  double sigma_px;  // of `at` on its worse axis, by the residuals
};

// Aligns the template near `start`. False where it leaves the picture, moves farther than `reach_px` or does not fit.
// About 0.2 us a round.
bool align(const patch_template &what, const grey_plane &picture, const pixel &start, double reach_px, int rounds,
           alignment *out);

// After an alignment: shear of the patch, du = slope[0] u + slope[1] v, by one Gauss-Newton step from none. False where
// the patch does not determine it.
bool fit_slopes(const patch_template &what, const grey_plane &picture, const pixel &at, double slope[2]);

// Best place of the template on whole pixels (u, v), first <= u <= last, by normalised correlation; `second` is the
// best of those more than two pixels away. False where none is in the picture.
bool search_row(const patch_template &what, const grey_plane &picture, int32_t first, int32_t last, int32_t v,
                int32_t *u, double *best, double *second);

}  // namespace wm

#endif
