// SPDX-License-Identifier: Apache-2.0
// A CAN interface that does what a test says, on a clock that only waiting moves.
#pragma once

#include "can_io.h"

typedef enum fake_what { FAKE_FRAME, FAKE_FAILS, FAKE_DOWN, FAKE_UP, FAKE_REMOVED, FAKE_BACK, FAKE_END } fake_what;

typedef struct fake_step {
  wm_time_ns at_ns;  // on the monotonic clock
  fake_what what;
  can_received received;  // FAKE_FRAME
  int reason;             // FAKE_FAILS: errno
} fake_step;

#define FAKE_BOOT_NS (1000 * WM_NS_PER_S)
#define FAKE_UTC_NS (INT64_C(1700000000) * WM_NS_PER_S)  // CLOCK_REALTIME at monotonic 0

typedef struct fake_can {
  wm_time_ns now_ns, utc_offset_ns;
  wm_time_ns reads_late_ns;  // the reader comes that long after a frame
  fake_step *steps;
  size_t next;
  unsigned index;  // of the interface; 0: not there
  int is_up, is_open, opened;
  size_t filters;
} fake_can;

extern const can_io kFakeCan;
void fake_can_init(fake_can *self, fake_step *steps);

// A frame of id 100 with two bytes of a speed in it, stamped by the kernel.
can_received fake_frame(wm_time_ns at_ns, uint16_t speed);
can_received fake_error_frame(wm_time_ns at_ns, uint32_t id, uint8_t controller);
