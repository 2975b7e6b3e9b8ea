// SPDX-License-Identifier: Apache-2.0
// How a point looks, as 256 bits: comparisons of the brightness at pairs of places about it. The pattern of places has
// the same size on the ground at every distance and turns with the patch. Sources: [Calonder2010], orientation
// [Rublee2011].
#ifndef WAYMARK_ESTIMATOR_VISION_DESCRIBE_HPP
#define WAYMARK_ESTIMATOR_VISION_DESCRIBE_HPP

#include "waymark/internal/image/pyramid.hpp"
#include "waymark/internal/sensors/lens.hpp"

namespace wm {

// `px_per_m`: of the ground at the point. All bits 0: the pattern leaves the picture.
void describe(const pyramid &picture, const pixel &at, double px_per_m, uint64_t out[4]);

}  // namespace wm

#endif
