// SPDX-License-Identifier: Apache-2.0
// The frames of a candump log in the order of their times: differences are summed up, and a log that was sorted by id
// is sorted by time again.
#ifndef WM_RECORDING_CAN_LOG_H
#define WM_RECORDING_CAN_LOG_H

#include "lines.h"
#include "waymark/can.h"

typedef struct can_log {
  line_reader lines;
  int has_differences;
  wm_time_ns sum_ns;
  long line;  // of what was handed out last, from 1
  // A log that was sorted by id, whole: its text, and where each line is, by time. NULL: the lines as they come.
  char *text;
  struct sorted_line *sorted;
  size_t sorted_count, next;
} can_log;

// Surveys the log's first frames into `survey` (all zeros), and goes to its front. What is done with its times is in
// `note`, "" where nothing is. A log that was sorted by id is kept in memory. WM_NOT_FOUND, WM_IO. Allocates.
wm_status can_log_open(can_log *self, const char *path, wm_can_survey *survey, char *note, size_t room, wm_error *err);
// WM_OK: a frame. WM_AGAIN: no frame in this line; *why has the reason, or "" of an empty line. WM_END, WM_IO.
wm_status can_log_next(can_log *self, wm_can_frame *out, wm_error *why, wm_error *err);
// From the front again.
wm_status can_log_rewind(can_log *self, wm_error *err);
void can_log_close(can_log *self);

#endif
