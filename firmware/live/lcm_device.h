// SPDX-License-Identifier: Apache-2.0
// A recording's stream over LCM, sent by another program: each message is a row.
#ifndef WAYMARK_LIVE_LCM_DEVICE_H
#define WAYMARK_LIVE_LCM_DEVICE_H

#include <lcm/lcm.h>

#include "waymark/devices.h"

// `lent` may be NULL: then connecting is tried again and again. Allocates.
wm_status lcm_device_open(const wm_lcm_device_config *config, const char *url, const char *channel_prefix, lcm_t *lent,
                          wm_row_device **out, wm_error *err);

#endif
