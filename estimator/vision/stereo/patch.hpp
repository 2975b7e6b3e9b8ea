// SPDX-License-Identifier: Apache-2.0
// A small piece of a picture, found again in another one to a small part of a pixel, whatever brightness and contrast
// are there. Pixels and their sums are integers, the few numbers made of the sums doubles: the same bits everywhere.
// Sources: B. D. Lucas, T. Kanade 1981; S. Baker, I. Matthews, "Lucas-Kanade 20 years on", 2004 (the inverse way:
// derivatives are the template's, made once).
#ifndef WAYMARK_ESTIMATOR_VISION_PATCH_HPP
#define WAYMARK_ESTIMATOR_VISION_PATCH_HPP

#include "image/pyramid.hpp"
#include "sensors/lens.hpp"

namespace wm {

inline constexpr int kPatch = 24;  // pixels on a side
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
inline constexpr warp2 kNoWarp = {1, 0, 0, 1};

// The piece about `at`, bent by the warp. False where it leaves the picture or has no contrast in some direction.
bool make_template(const grey_plane &picture, const pixel &at, const warp2 &warp, patch_template *out);

struct alignment {
  pixel at;
  double fit;       // share of the variance that the template explains
  double sigma_px;  // of `at` on its worse axis, by what is left unexplained
};

// Finds the template near `start`. False where it leaves the picture, wanders farther than `reach_px` or finds nothing
// that is like it. Cost: about 0.2 us a round.
bool align(const patch_template &what, const grey_plane &picture, const pixel &start, double reach_px, int rounds,
           alignment *out);

// After an alignment: how the place of the pixels about it changes across the patch, du = slope[0] u + slope[1] v. One
// step, from none. False where the patch doesn't tell.
bool fit_slopes(const patch_template &what, const grey_plane &picture, const pixel &at, double slope[2]);

// Best place of the template on whole pixels (u, v), first <= u <= last, by normalised correlation; `second` is the
// best of those more than two pixels away. False where none is in the picture.
bool search_row(const patch_template &what, const grey_plane &picture, int32_t first, int32_t last, int32_t v,
                int32_t *u, double *best, double *second);

}  // namespace wm

#endif
