// SPDX-License-Identifier: Apache-2.0
// A CAN interface as a source, on any system (can_io.h).
#ifndef WM_CAN_DEVICE_H
#define WM_CAN_DEVICE_H

#include "can_io.h"
#include "waymark/source.h"

// Takes the decoder over, also where it fails; without one (NULL) it asks for all frames and gives no events. The
// interface needn't be there: it is looked for again and again.
wm_status can_device_make(const char *interface, wm_can_decoder *decoder, const can_io *io, void *io_context,
                          wm_source **out, wm_error *err);
// Of the values of a GNSS receiver, in place of quantities.
void can_device_gives_positions(wm_source *device, const double gnss_origin[3]);
// What an error frame says of the controller (linux/can/error.h), counted into `counts`. Pure.
void can_error_take(const wm_can_frame *frame, const char *interface, wm_source_counts *counts);

#endif
