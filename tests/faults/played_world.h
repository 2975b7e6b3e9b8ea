// SPDX-License-Identifier: Apache-2.0
// A recording in the place of the kernel: waymark, whole, on drivers that play a drive at its own times, with what
// breaks and when. The folder that WM_PLAYED names has `timeline` and `pictures` as tests/hil/play.c reads them, and
// `faults`, lines "FROM UNTIL WHAT [VALUE]" in seconds since WM_PLAYED_BEGIN_NS (monotonic), when the first line is
// due: a run that was killed finds the world as far on as it is.
#ifndef WM_PLAYED_WORLD_H
#define WM_PLAYED_WORLD_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/can.h"
#include "waymark/time.h"

typedef struct played_item {
  wm_time_ns due_ns;    // since the beginning
  wm_can_frame frame;   // 'c'
  const uint8_t *data;  // 'p'
  uint32_t bytes;
  char kind;
  uint32_t number;  // of its kind
} played_item;

// The first of this kind that is due at `from_ns` or later, from *next on; NULL: there is none any more.
const played_item *played_next(char kind, wm_time_ns from_ns, size_t *next);
wm_time_ns played_due_ns(const played_item *item);  // monotonic
// Whether this breaks now; *value (may be NULL) as the line says it.
int played_fault(const char *what, double *value);
// Whether this one of many is hit, of `percent` per cent; by its number alone.
int played_is_hit(uint32_t number, double percent);

wm_time_ns played_now_ns(void);
// Until `when_ns`, but not longer than `wait_ms`. 1: it is `when_ns`.
int played_sleep(wm_time_ns when_ns, int wait_ms);

#endif
