// SPDX-License-Identifier: Apache-2.0
// Commands from programs of this computer alone: a local datagram socket (a file, whose permissions restrict the
// senders). Each datagram is a set_pose_t or a reset_t as lcm-gen's code encodes it.
#ifndef WAYMARK_LIVE_COMMAND_SOCKET_H
#define WAYMARK_LIVE_COMMAND_SOCKET_H

#include "waymark/source.h"

// A source of WM_EVENT_SET_POSE and WM_EVENT_RESET. Makes the file `path` for owner and group (0660); one that a run
// left behind is replaced. WM_IO: it can't be made, or another process listens there. Allocates.
wm_status command_socket_open(const char *path, wm_source **out, wm_error *err);

#endif
