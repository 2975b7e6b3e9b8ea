// SPDX-License-Identifier: Apache-2.0
#include "fusion/bound.h"

#define OTHERS_MAX 8  // the most probable ones; the rest counts as a pose anywhere

// Keeps the others by falling probability.
static size_t add_other(wm_other_pose others[OTHERS_MAX], size_t count, const wm_other_pose *other) {
  size_t at = count < OTHERS_MAX ? count : OTHERS_MAX - 1;
  if (count == OTHERS_MAX && !(other->probability > others[at].probability)) return count;
  for (; at > 0 && other->probability > others[at - 1].probability; at--) others[at] = others[at - 1];
  others[at] = *other;
  return count < OTHERS_MAX ? count + 1 : count;
}

void wm_fuser_bound(wm_fuser *self, const wm_integrity *integrity, const wm_estimate *fused, const wm_estimate *now,
                    wm_bound *out) {
  const wm_estimator *e = self->estimator;
  const size_t most = sizeof self->listed / sizeof self->listed[0];
  wm_other_pose others[OTHERS_MAX];
  size_t count = 0, listed = e->hypotheses ? e->hypotheses(self->state, self->listed, most) : 0;
  for (size_t i = 0; i < listed && i < most; i++) {
    const wm_other_pose other = wm_other_pose_of(fused, &self->listed[i]);
    count = add_other(others, count, &other);
  }
  wm_estimate estimate = *now;
  wm_hypothesis image;
  if (wm_monitor_image(&self->monitor, &image)) {
    const wm_other_pose other = wm_other_pose_of(fused, &image);
    estimate.lost_probability += image.weight;  // the estimator does not know of it
    count = add_other(others, count, &other);
  }
  wm_bound_of(&estimate, wm_monitor_untested(&self->monitor), integrity, others, count, out);
}
