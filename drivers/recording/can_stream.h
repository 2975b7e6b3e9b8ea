// SPDX-License-Identifier: Apache-2.0
// can.log as a source of quantities.
#ifndef WM_RECORDING_CAN_STREAM_H
#define WM_RECORDING_CAN_STREAM_H

#include "waymark/source.h"

// Reads the DBC and the binding, opens the log. *quantities: bit per wm_quantity that is bound.
wm_status can_stream_open(const char *log, const char *dbc, const char *signals, wm_source **out, uint32_t *quantities,
                          wm_error *err);

#endif
