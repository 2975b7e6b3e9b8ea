// SPDX-License-Identifier: Apache-2.0
#include "camera_set.h"

#include <string.h>

// Of two that don't belong together the older one waits for nothing any more. 1: they do.
static int belong_together(camera_set *self) {
  if (self->count < 2) return 1;
  wm_time_ns apart_ns = self->waiting[1].t_ns - self->waiting[0].t_ns;
  if (apart_ns <= PAIR_TOLERANCE_NS && apart_ns >= -PAIR_TOLERANCE_NS) return 1;
  self->has[apart_ns < 0] = 0;
  self->alone++;
  return 0;
}

wm_status camera_set_next(camera_set *self, wm_frame *frames, wm_error *err) {
  for (uint32_t i = 0; i < self->count; i++) {
    if (self->has[i]) continue;
    wm_status status = wm_camera_device_next(self->devices[i], &self->waiting[i], err);
    if (status != WM_OK) return status;
    self->has[i] = 1;
  }
  if (!belong_together(self)) return WM_AGAIN;
  for (uint32_t i = 0; i < self->count; i++) {
    frames[i] = self->waiting[i];
    self->has[i] = 0;
  }
  return WM_OK;
}

// Which of two states a person should hear of.
static int worse(uint8_t a, uint8_t b) {
  static const uint8_t kHowBad[] = {[WM_DEVICE_NONE] = 1,    [WM_DEVICE_WORKS] = 0, [WM_DEVICE_FROZEN] = 2,
                                    [WM_DEVICE_STALLED] = 3, [WM_DEVICE_DOWN] = 4,  [WM_DEVICE_ABSENT] = 5};
  return (a < sizeof kHowBad ? kHowBad[a] : 0) > (b < sizeof kHowBad ? kHowBad[b] : 0);
}

void camera_set_counts(camera_set *self, wm_source_counts *out) {
  out->lost = self->alone;
  out->malformed = out->frozen = out->overflows = out->out_of_order = out->not_finite = 0;
  out->stamp_uncertainty_ns = 0;
  const wm_camera_counts *told = NULL;
  for (uint32_t i = 0; i < self->count; i++) {
    const wm_camera_counts *c = wm_camera_device_counted(self->devices[i]);
    out->lost += c->lost;
    out->malformed += c->damaged;
    out->frozen += c->duplicated;
    out->overflows += c->skipped;
    out->out_of_order += c->out_of_order;
    out->not_finite += c->bad_stamps;
    if (c->stamp_uncertainty_ns > out->stamp_uncertainty_ns) out->stamp_uncertainty_ns = c->stamp_uncertainty_ns;
    if (!told || worse(c->device, told->device)) told = c;
  }
  if (!told) return;
  out->device = told->device;
  memcpy(out->device_note, told->device_note, sizeof out->device_note);
}

void camera_set_close(camera_set *self) {
  for (uint32_t i = 0; i < self->count; i++) wm_camera_device_close(self->devices[i]);
  self->count = 0;
}
