// SPDX-License-Identifier: Apache-2.0
// Whose frames of a message are taken, where several buses or J1939 addresses send it: two wheels' counts must not be
// mixed. A unit may claim another address at any time (SAE J1939-81), and its frames go on from there.
#ifndef WM_CAN_SENDER_H
#define WM_CAN_SENDER_H

#include "decoder.h"

typedef enum sender_verdict {
  SENDER_TAKEN,
  SENDER_OTHER,    // of another unit, beside the one that is taken
  SENDER_AWAITED,  // of another unit, while the one that is taken is overdue: its values are missing
} sender_verdict;

// Counts a change of the sender in counts->news, with its text.
sender_verdict sender_take(bound_message *m, const wm_can_frame *frame, wm_source_counts *counts);

#endif
