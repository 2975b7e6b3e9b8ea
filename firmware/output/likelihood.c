// SPDX-License-Identifier: Apache-2.0
#include "output/likelihood.h"

#include <math.h>

#define OUTLIER_SIGMAS 20.0  // an outlier of a length has any value within ten sigma to both sides, at least

double wm_outlier_log_density(unsigned residual, double variance) {
  static const double kLog[WM_RESIDUAL_COUNT] = {
      [WM_RESIDUAL_BEARING] = -1.84, [WM_RESIDUAL_RANGE] = -3.91,    [WM_RESIDUAL_X] = -3.91,
      [WM_RESIDUAL_Y] = -3.91,       [WM_RESIDUAL_Z] = -3.91,        [WM_RESIDUAL_HEADING] = -1.84,
      [WM_RESIDUAL_PIXEL] = -6.91,   [WM_RESIDUAL_ELEVATION] = -1.14};
  const int is_length = residual == WM_RESIDUAL_RANGE || residual == WM_RESIDUAL_X || residual == WM_RESIDUAL_Y ||
                        residual == WM_RESIDUAL_Z;
  return is_length && variance > 0 ? fmin(kLog[residual], -log(OUTLIER_SIGMAS * sqrt(variance))) : kLog[residual];
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
