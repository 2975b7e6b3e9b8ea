// SPDX-License-Identifier: Apache-2.0
// White noise of a gyro, against what is configured. Noise of the density N (rad/s per sqrt(s)) turns the heading by a
// random walk: the turn in a time t has the variance N^2 t, and the second difference of three of them 6 N^2 t, in
// which a steady turn is none. The quartile of their sizes is that of the calm parts of a drive. Vibrations and turns
// have another density at each t; noise has the same.
#include <math.h>
#include <stdlib.h>

#include "cli/check/comparisons.h"
#include "waymark/motion.h"

#define COVER_MIN 0.8    // share of a window that has data
#define SIZES_MIN 20     // second differences
#define QUARTILE 0.3186  // of the size of a normal deviate
#define LONG_WINDOWS 4   // of the longer one of the two times
#define ALIKE 2.0        // densities of white noise at the two times: of twenty differences each is known to a half
// As much as temperature, a car's engine and the method's own error (at 20 Hz 1.8 times) do not make.
#define TIMES_CONFIGURED 5.5

static int by_size(const void *a, const void *b) {
  const float x = *(const float *)a, y = *(const float *)b;
  return (x > y) - (x < y);
}

// Turn over `together` windows from window `from` on; NaN where they are not covered.
static double turn_of(const channel *c, size_t from, size_t together) {
  double sum = 0;
  for (size_t i = from; i < from + together; i++) {
    if (i >= c->windows || (double)c->cover[i] < COVER_MIN * WINDOW_S) return (double)NAN;
    sum += (double)c->sum[i];
  }
  return sum;
}

// rad/s per sqrt(s) by turns of `together` windows each; 0: too few.
static double density_of(const channel *c, size_t together) {
  float *sizes = calloc(c->windows + 1, sizeof *sizes);
  size_t count = 0;
  for (size_t i = 0; sizes && i + 3 * together <= c->windows; i++) {
    const double second =
        turn_of(c, i, together) - 2 * turn_of(c, i + together, together) + turn_of(c, i + 2 * together, together);
    if (isfinite(second)) sizes[count++] = (float)fabs(second);
  }
  if (count > 0) qsort(sizes, count, sizeof *sizes, by_size);
  const double quartile = count >= SIZES_MIN ? (double)sizes[count / 4] : 0;
  free(sizes);
  return quartile / QUARTILE / sqrt(6 * (double)together * WINDOW_S);
}

double comparisons_white_noise(const channel *c) {
  const double brief = density_of(c, 1), longer = density_of(c, LONG_WINDOWS);
  return longer < ALIKE * brief && brief < ALIKE * longer ? sqrt(brief * longer) : 0;
}

int comparisons_is_noisy(const channel *c, const wm_assembly *assembly) {
  return c->kind == CHANNEL_YAW_RATE &&
         comparisons_white_noise(c) > TIMES_CONFIGURED * wm_motion_gyro_noise(assembly->setup.motion);
}

void noise_judge(const channels *self, const wm_assembly *assembly, wm_findings *out) {
  const double stated = wm_motion_gyro_noise(assembly->setup.motion);
  for (size_t i = 0; i < self->count; i++) {
    const channel *c = &self->at[i];
    if (c->is_stuck || !comparisons_is_noisy(c, assembly)) continue;
    char name[96], fix[WM_FINDING_FIX_MAX];
    const double noise = comparisons_white_noise(c);
    (void)snprintf(fix, sizeof fix,
                   "look at its range, its filter and its mounting; if it is as noisy: `motion: {noise: "
                   "{yaw_rate_radps: %.2g}}`",
                   noise);
    wm_find(out, WM_FOUND_NOISE_TOO_SMALL, WM_SEVERITY_BAD, wm_assembly_source_name(assembly, c->source), fix,
            "%s has a white noise of %.2g rad/s per sqrt(s), %.1f times as much as is configured (%.2g): it turns the "
            "heading by %.1f degrees in a minute",
            comparisons_name(c, assembly, name, sizeof name), noise, noise / stated, stated,
            noise * sqrt(60.0) * 180 / M_PI)
        ->size = noise / stated;
  }
}
