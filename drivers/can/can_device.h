// SPDX-License-Identifier: Apache-2.0
// A CAN interface as a source, on any system (can_io.h).
#ifndef WM_CAN_DEVICE_H
#define WM_CAN_DEVICE_H

#include "can_io.h"
#include "waymark/source.h"

// Takes ownership of the decoder, also on failure; without one (NULL) it receives all frames and gives no events. An
// absent interface is searched for again and again.
wm_status can_device_make(const char *interface, wm_can_decoder *decoder, const can_io *io, void *io_context,
                          wm_source **out, wm_error *err);
// Gives positions of a GNSS receiver instead of quantities.
void can_device_gives_positions(wm_source *device, const double gnss_origin[3]);
// Counts an error frame's report on the controller (linux/can/error.h) into `counts`. Pure.
void can_error_take(const wm_can_frame *frame, const char *interface, wm_source_counts *counts);

#endif
