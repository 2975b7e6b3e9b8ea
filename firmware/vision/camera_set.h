// SPDX-License-Identifier: Apache-2.0
// The robot's cameras that a detector looks through: one, or a pair whose pictures are taken at the same instant (one
// trigger, or one shutter for both). Two cameras that run freely make no pair: their pictures never belong together.
#ifndef WM_FIRMWARE_CAMERA_SET_H
#define WM_FIRMWARE_CAMERA_SET_H

#include "waymark/devices.h"

#define CAMERA_SET_MAX 2
#define PAIR_TOLERANCE_NS (2 * WM_NS_PER_MS)  // pictures of a pair are triggered together

typedef struct camera_set {
  wm_camera_device *devices[CAMERA_SET_MAX];
  uint32_t count;  // 0: none
  wm_frame waiting[CAMERA_SET_MAX];
  int has[CAMERA_SET_MAX];
  uint64_t alone;  // pictures whose other half didn't come
} camera_set;

// The newest picture of each, of one instant. WM_AGAIN: not yet. The pixels stay until the next call.
wm_status camera_set_next(camera_set *self, wm_frame *frames, wm_error *err);
// What all of them counted, in the terms of a source; the state is that of the one that is worse off.
void camera_set_counts(camera_set *self, wm_source_counts *out);
void camera_set_close(camera_set *self);

#endif
