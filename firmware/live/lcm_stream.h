// SPDX-License-Identifier: Apache-2.0
// A recording's stream over LCM, sent by another program: its messages become the events that the stream's rows would.
#ifndef WAYMARK_LIVE_LCM_STREAM_H
#define WAYMARK_LIVE_LCM_STREAM_H

#include <lcm/lcm.h>

#include "waymark/devices.h"
#include "waymark/source.h"
#include "waymark/streams.h"

// `imu`: mounting of the IMU. `lent` may be NULL: then connecting is tried again and again. Allocates.
wm_status lcm_stream_open(const wm_lcm_device_config *config, const char *url, const char *channel_prefix,
                          const wm_mounting *imu, lcm_t *lent, wm_source **out, wm_error *err);
const wm_stream *lcm_stream_of(const wm_source *source);
// The row of the last event, stamped on the monotonic clock, for a recorder.
const wm_stream_row *lcm_stream_row(const wm_source *source);

#endif
