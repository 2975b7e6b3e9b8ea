// SPDX-License-Identifier: Apache-2.0
// LCM messages that are rows of a recording's streams: motion_t of motion.csv, imu_t of imu.csv ...
#ifndef WAYMARK_LCM_STREAMS_H
#define WAYMARK_LCM_STREAMS_H

#include <stddef.h>

#include "waymark/stream_row.h"

#ifdef __cplusplus
extern "C" {
#endif

// "motion_t" of "motion"; NULL: the stream has no message.
const char *wm_lcm_stream_type(const char *stream);
// The row of a message: t_ns and numbers. NULL, or a text with the fault. The numbers are not checked. Constant cost.
const char *wm_lcm_read_row(const char *stream, const void *message, size_t length, wm_stream_row *out);
// The message of a row; returns the bytes written, 0 where `capacity` is too small.
size_t wm_lcm_row(const char *stream, const wm_stream_row *row, void *out, size_t capacity);

#ifdef __cplusplus
}
#endif

#endif
