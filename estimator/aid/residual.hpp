// SPDX-License-Identifier: Apache-2.0
// One number of an observation on its way to the update: what an aid makes, and what every planar filter fuses.
#ifndef WAYMARK_ESTIMATOR_AID_RESIDUAL_HPP
#define WAYMARK_ESTIMATOR_AID_RESIDUAL_HPP

#include "filters/core/noise_adaption.hpp"
#include "filters/planar/planar_motion.hpp"
#include "waymark/pose.h"

namespace wm {

struct residual {
  planar_row row;            // its derivatives by the filter's states
  double innovation, noise;  // observed - expected; variance of the observation
  wm_innovation record;
  noise_adaption::source source;  // what the noise adapts to
  bool is_position = false;       // or a heading: the error of the pose is the left-invariant one [Barrau2017]
};

}  // namespace wm

#endif
