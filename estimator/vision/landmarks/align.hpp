// SPDX-License-Identifier: Apache-2.0
// Sub-pixel place of a drawn landmark in the picture: inverse compositional alignment [Baker2004] of a
// shift, a shift with scale, or an affine warp; brightness and contrast are free.
#ifndef WAYMARK_ESTIMATOR_VISION_ALIGN_HPP
#define WAYMARK_ESTIMATOR_VISION_ALIGN_HPP

#include "vision/landmarks/appearance.hpp"
#include "waymark/internal/image/pyramid.hpp"

namespace wm {

inline constexpr int kAlignColumns = 8;    // contrast, brightness, and up to six of the warp
inline constexpr int kAlignPixels = 4096;  // twice the pixels a landmark is drawn with (kAreaMax_px2)

struct align_work {
  double column[kAlignPixels][kAlignColumns];
  int16_t x[kAlignPixels], y[kAlignPixels];
};

struct aligned {
  pixel middle;          // in pixels of the level
  double uu, uv, vv;     // its covariance by the fit's residuals, px^2 of the level
  double likeness;       // normalised correlation there
  double stretch;        // largest element of the warp's matrix minus identity
  double wider, taller;  // scale of width and height against the drawn ones
};

// `middle` is the drawn middle of the landmark, `right` and `down` the initial shift in whole pixels. False where the
// iteration does not settle, or leaves the picture or the neighbourhood.
bool align_landmark(const grey_plane &picture, const drawn_view &what, const pixel &middle, int right, int down,
                    align_work *work, aligned *out);

}  // namespace wm

#endif
