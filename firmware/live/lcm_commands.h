// SPDX-License-Identifier: Apache-2.0
// Commands over LCM, set_pose_t, set_floor_t and reset_t, as a source of events.
#ifndef WAYMARK_LIVE_LCM_COMMANDS_H
#define WAYMARK_LIVE_LCM_COMMANDS_H

#include <lcm/lcm.h>

#include "waymark/floors.h"
#include "waymark/source.h"

// `floors` (NULL: none) outlives it. `lent` may be NULL: then connecting is tried again and again. Allocates.
wm_status lcm_commands_open(const char *url, const char *channel_prefix, const wm_floors *floors, lcm_t *lent,
                            wm_source **out, wm_error *err);

#endif
