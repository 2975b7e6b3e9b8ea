// SPDX-License-Identifier: Apache-2.0
#include "output/likelihood.h"

#include <math.h>

double wm_outlier_log_density(unsigned residual) {
  static const double kLog[WM_RESIDUAL_COUNT] = {
      [WM_RESIDUAL_BEARING] = -1.84, [WM_RESIDUAL_RANGE] = -3.91,    [WM_RESIDUAL_X] = -3.91,
      [WM_RESIDUAL_Y] = -3.91,       [WM_RESIDUAL_Z] = -3.91,        [WM_RESIDUAL_HEADING] = -1.84,
      [WM_RESIDUAL_PIXEL] = -6.91,   [WM_RESIDUAL_ELEVATION] = -1.14};
  return kLog[residual];
}

double wm_innovation_difference(const wm_innovation *in) {
  const double difference = in->observed - in->expected;
  return in->residual == WM_RESIDUAL_BEARING || in->residual == WM_RESIDUAL_HEADING ? remainder(difference, 2 * M_PI)
                                                                                    : difference;
}

double wm_innovation_log_density(const wm_innovation *in) {
  const double difference = wm_innovation_difference(in);
  return -0.5 * difference * difference / in->variance - 0.5 * log(2 * M_PI * in->variance);
}
