// SPDX-License-Identifier: Apache-2.0
// The robot's own devices as sources. Opening one never fails because the device isn't there: it is looked for again
// and again, and `counts.device` says how it does.
#ifndef WAYMARK_DEVICES_H
#define WAYMARK_DEVICES_H

#include <stdint.h>

#include "waymark/recording.h"
#include "waymark/source.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_can_device_config {
  char interface[WM_CAN_IFACE_MAX];  // "can0"
  char dbc[WM_PATH_MAX], can_signals[WM_PATH_MAX];
  int line;
} wm_can_device_config;

#define WM_CAN_DEVICES_MAX 4
typedef struct wm_devices_config {
  wm_can_device_config can[WM_CAN_DEVICES_MAX];
  size_t can_count;
} wm_devices_config;

// A SocketCAN interface: quantities as its DBC and binding say, filtered by the kernel to the ids that are needed.
// *quantities: bit per wm_quantity that it can give. WM_BAD_CONFIG where DBC or binding are wrong.
wm_status wm_can_device_open(const wm_can_device_config *config, wm_source **out, uint32_t *quantities, wm_error *err);

#ifdef __cplusplus
}
#endif

#endif
