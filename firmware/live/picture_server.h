// SPDX-License-Identifier: Apache-2.0
// The local socket of publish.picture_socket (sources/picture_socket.h). A thread of its own waits for readers; it asks
// a detector for a picture only where a reader asked, and twice a second at most. What a reader does not take in time
// is passed over, and counted; one that takes nothing for seconds is sent away. Nothing is encoded here.
#ifndef WAYMARK_LIVE_PICTURE_SERVER_H
#define WAYMARK_LIVE_PICTURE_SERVER_H

#include "config/config.h"
#include "sources/vision.h"
#include "waymark/status.h"

typedef struct picture_server picture_server;

// Opens the socket (its owner and group may connect) and starts the thread. *out is NULL, and WM_OK, where none is
// wanted. WM_IO: the socket can't be made there. `vision` must outlive it.
wm_status picture_server_start(const wm_config *config, wm_vision *vision, picture_server **out, wm_error *err);
// Ends the thread and removes the socket. NULL is fine.
void picture_server_close(picture_server *self);

#endif
