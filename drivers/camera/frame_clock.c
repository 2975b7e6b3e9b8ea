// SPDX-License-Identifier: Apache-2.0
#include "frame_clock.h"

#define OLDEST_NS (2 * WM_NS_PER_S)                 // longer than a picture waits in a driver
#define DOUBTS 3                                    // contradicting stamps in a row that change the assumed clock
#define DIRECT_UNCERTAINTY_NS (500 * WM_NS_PER_US)  // interrupt of the frame's end to the stamp
#define GUESSED_UNCERTAINTY_NS (50 * WM_NS_PER_MS)  // exposure and transfer, without a stamp

static int can_be_ours(wm_time_ns stamp_ns, wm_time_ns arrival_ns) {
  return stamp_ns > 0 && stamp_ns <= arrival_ns && stamp_ns > arrival_ns - OLDEST_NS;
}

// From the stamped point to the middle of the exposure of the middle row.
static wm_time_ns to_middle(const frame_clock *self, stamp_point point, wm_time_ns exposure_ns) {
  wm_time_ns half_ns = (self->readout_ns + exposure_ns) / 2;
  return (point == STAMP_START ? half_ns : -half_ns) - self->latency_ns;
}

static void doubt(frame_clock *self, int fits) {
  self->doubtful = fits ? 0 : self->doubtful + 1;
  if (self->doubtful < DOUBTS) return;
  self->is_foreign = !self->is_foreign;
  self->camera.is_set = 0;
  self->doubtful = 0;
}

stamp_verdict frame_clock_stamp(frame_clock *self, wm_time_ns stamp_ns, stamp_point point, wm_time_ns arrival_ns,
                                wm_time_ns exposure_ns, wm_time_ns *out) {
  int is_ours = can_be_ours(stamp_ns, arrival_ns), was_foreign = self->is_foreign;
  wm_time_ns seen_ns = arrival_ns;
  if (stamp_ns != 0) doubt(self, is_ours != self->is_foreign);
  stamp_verdict verdict = self->is_foreign && !was_foreign ? STAMP_NOW_FOREIGN : STAMP_GOOD;
  if (stamp_ns == 0 || (!self->is_foreign && !is_ours)) {
    self->implausible++;
    self->uncertainty_ns = GUESSED_UNCERTAINTY_NS;
    verdict = STAMP_GUESSED;
    point = STAMP_END;  // it arrives after its end
  } else if (self->is_foreign) {
    // A picture arrives after its end at the earliest.
    wm_time_ns least_ns = point == STAMP_START ? self->readout_ns + exposure_ns : 0;
    seen_ns = foreign_clock_map(&self->camera, stamp_ns, arrival_ns, least_ns);
    self->uncertainty_ns = foreign_clock_uncertainty(&self->camera) + DIRECT_UNCERTAINTY_NS;
  } else {
    seen_ns = stamp_ns;
    self->uncertainty_ns = DIRECT_UNCERTAINTY_NS;
  }
  *out = seen_ns + to_middle(self, point, exposure_ns);
  return verdict;
}

count_verdict frame_count_take(frame_count *self, uint32_t sequence, uint64_t *lost) {
  *lost = 0;
  if (!self->is_set) {
    *self = (frame_count){1, sequence, 0};
    return COUNT_NEXT;
  }
  uint32_t step = sequence - self->last;
  if (step == 0) return COUNT_SAME;
  self->last = sequence;
  self->number++;
  if (step > UINT32_MAX / 2) return COUNT_RESTARTED;  // backwards: the stream was restarted
  *lost = step - 1;
  self->number += *lost;
  return COUNT_NEXT;
}
