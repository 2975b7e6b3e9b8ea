// SPDX-License-Identifier: Apache-2.0
// Stamps of messages on this computer's monotonic clock.
#ifndef WAYMARK_LIVE_LCM_STAMP_H
#define WAYMARK_LIVE_LCM_STAMP_H

#include <stddef.h>

#include "waymark/event.h"
#include "waymark/floors.h"

// NULL, or why a stamp can't be of a message that arrives now; in `text` where it has figures.
const char *lcm_stamp_fault(wm_time_ns t_ns, wm_time_ns arrival_ns, char *text, size_t capacity);

// A command that arrives now; without a stamp it is of now. NULL, or why it can't be.
const char *lcm_stamp_command(wm_event *event, char *text, size_t capacity);

// The floor of a SET_FLOOR by its name. NULL, or what is wrong. `floors` NULL: the run has none.
const char *lcm_floor_of(const wm_floors *floors, const char *name, wm_event *event);

#endif
