// SPDX-License-Identifier: Apache-2.0
// Commands from programs of this computer alone: a local datagram socket (a file, whose permissions restrict the
// senders). Each datagram is a set_pose_t, a set_floor_t or a reset_t as lcm-gen's code encodes it.
#ifndef WAYMARK_LIVE_COMMAND_SOCKET_H
#define WAYMARK_LIVE_COMMAND_SOCKET_H

#include "waymark/floors.h"
#include "waymark/source.h"

// A source of WM_COMMAND_EVENTS. `floors` (NULL: none) outlives it. Makes the file `path` for owner and group (0660);
// one that a run left behind is replaced. WM_IO: it can't be made, or another process listens there. Allocates.
wm_status command_socket_open(const char *path, const wm_floors *floors, wm_source **out, wm_error *err);

#endif
