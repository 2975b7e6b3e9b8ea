// SPDX-License-Identifier: Apache-2.0
// can.log as sources of events: one for each bus under `can` of recording.yaml, or one for all frames; and those of the
// buses' GNSS receivers.
#ifndef WM_RECORDING_CAN_STREAM_H
#define WM_RECORDING_CAN_STREAM_H

#include "waymark/can.h"
#include "waymark/devices.h"
#include "waymark/source.h"

typedef struct can_bus {
  char interface[WM_CAN_BUS_MAX];  // name in the log's lines
  char dbc[WM_PATH_MAX], signals[WM_PATH_MAX];
} can_bus;

typedef struct can_buses {
  size_t count;  // 0: one decoder, bus[0], for the frames of all interfaces
  can_bus bus[WM_CAN_DEVICES_MAX];
} can_buses;

// `can:` of recording.yaml, a list of {interface, dbc, signals}; files are in `dir`. Unchanged without it.
wm_status can_buses_read(const wm_yaml_node *list, const char *dir, can_buses *out, wm_error *err);

// The stream of one of the buses: quantities, or the GNSS receiver's positions about `gnss_origin`. *quantities: bit
// per wm_quantity that it can give. *out is NULL without bindings of that part. Warns of times that are differences,
// of lines that are sorted by id, of messages with several senders and of ids that the DBC has twice.
wm_status can_stream_open(const char *log, const can_buses *buses, size_t bus, wm_can_part part,
                          const double gnss_origin[3], wm_warn_fn warn, void *context, wm_source **out,
                          uint32_t *quantities, wm_error *err);

#endif
