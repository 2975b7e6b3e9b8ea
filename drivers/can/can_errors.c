// SPDX-License-Identifier: Apache-2.0
#include <linux/can.h>
#include <linux/can/error.h>
#include <stdio.h>

#include "can_device.h"

static void set(wm_source_counts *counts, const char *interface, wm_device_state state, const char *note) {
  counts->device = (uint8_t)state;
  (void)snprintf(counts->device_note, sizeof counts->device_note, "%.15s %s", interface, note);
}

void can_error_take(const wm_can_frame *frame, const char *interface, wm_source_counts *counts) {
  counts->bus_errors++;
  uint8_t controller = frame->id & CAN_ERR_CRTL ? frame->data[1] : 0;
  if (controller & CAN_ERR_CRTL_RX_OVERFLOW) counts->overflows++;
  if (frame->id & CAN_ERR_BUSOFF) {
    set(counts, interface, WM_DEVICE_BUS_OFF,
        "left the bus (bus-off): wiring, termination or bit rate; `ip link set ... type can restart-ms 100` lets it "
        "come "
        "back by itself");
  } else if (frame->id & CAN_ERR_RESTARTED) {
    set(counts, interface, WM_DEVICE_WORKS, "is on the bus again");
  } else if (controller & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) {
    set(counts, interface, WM_DEVICE_PASSIVE, "reports many bus errors (error-passive); check wiring and bit rate");
  } else if ((controller & CAN_ERR_CRTL_ACTIVE) && counts->device == WM_DEVICE_PASSIVE) {
    set(counts, interface, WM_DEVICE_WORKS, "works without errors again");
  }
}
