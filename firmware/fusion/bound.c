// SPDX-License-Identifier: Apache-2.0
#include "fusion/bound.h"

// The places of other poses stay, and their weights change with observations: as often as stated values are tested. A
// list costs as much as some observations.
#define OTHERS_EVERY_NS (WM_NS_PER_S / 2)

static void add_other(wm_others *to, const wm_other_pose *other) {
  size_t at = to->count < WM_OTHERS_MAX ? to->count++ : WM_OTHERS_MAX - 1;
  if (to->poses[at].probability > 0 && !(other->probability > to->poses[at].probability)) return;
  for (; at > 0 && other->probability > to->poses[at - 1].probability; at--) to->poses[at] = to->poses[at - 1];
  to->poses[at] = *other;
}

static void list_others(wm_fuser *self, const wm_estimate *fused) {
  const wm_estimator *e = self->estimator;
  const size_t most = sizeof self->listed / sizeof self->listed[0];
  const size_t listed = e->hypotheses ? e->hypotheses(self->state, self->listed, most) : 0;
  wm_hypothesis image;
  self->others = (wm_others){.made_ns = fused->t_ns, .resets = fused->resets};
  for (size_t i = 0; i < listed && i < most; i++) {
    const wm_other_pose other = wm_other_pose_of(fused, &self->listed[i]);
    add_other(&self->others, &other);
  }
  if (!wm_monitor_image(&self->monitor, &image)) return;
  const wm_other_pose other = wm_other_pose_of(fused, &image);
  self->others.image = image.weight;
  add_other(&self->others, &other);
}

void wm_fuser_bound(wm_fuser *self, const wm_integrity *integrity, const wm_estimate *fused, const wm_estimate *now,
                    wm_bound *out) {
  const wm_others *others = &self->others;
  if (others->made_ns == WM_TIME_NONE || fused->t_ns - others->made_ns >= OTHERS_EVERY_NS ||
      fused->resets != others->resets)
    list_others(self, fused);
  wm_estimate estimate = *now;
  estimate.lost_probability += others->image;
  wm_bound_of(&estimate, wm_monitor_untested(&self->monitor), integrity, others->poses, others->count, out);
}
