// SPDX-License-Identifier: Apache-2.0
// A drawn landmark's place in the picture to a part of a pixel: inverse compositional alignment (S. Baker, I. Matthews
// 2004) of shift, scale or all of an affine warp, with brightness and contrast free.
#ifndef WAYMARK_ESTIMATOR_VISION_ALIGN_HPP
#define WAYMARK_ESTIMATOR_VISION_ALIGN_HPP

#include "image/pyramid.hpp"
#include "vision/landmarks/appearance.hpp"

namespace wm {

inline constexpr int kAlignColumns = 8;  // contrast, brightness, and up to six of the warp

inline constexpr int kAlignPixels = 4096;

struct align_work {
  double column[kAlignPixels][kAlignColumns];
  int16_t x[kAlignPixels], y[kAlignPixels];
};

struct aligned {
  pixel middle;          // in pixels of the level
  double uu, uv, vv;     // its covariance by the fit's residuals alone, px2 of the level
  double likeness;       // normalised correlation there
  double stretch;        // how far the warp is from none
  double wider, taller;  // how many times the drawn width and height it has
};

// `middle` is where the landmark's middle was drawn, `right` and `down` whole pixels from there to begin at. False
// where it doesn't settle, or leaves the picture or the neighbourhood.
bool align_landmark(const grey_plane &picture, const raster &what, const pixel &middle, int right, int down,
                    align_work *work, aligned *out);

}  // namespace wm

#endif
