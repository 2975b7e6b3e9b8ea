// SPDX-License-Identifier: Apache-2.0
// CAN: frames, candump's text, DBC files, and the binding of signals to quantities. No YAML, no files but the DBC here.
#ifndef WAYMARK_CAN_H
#define WAYMARK_CAN_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/event.h"
#include "waymark/source.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_CAN_DATA_MAX 64
#define WM_CAN_IFACE_MAX 16

typedef struct wm_can_frame {
  wm_time_ns t_ns;
  char iface[WM_CAN_IFACE_MAX];
  uint32_t id;  // 11 or 29 bits, without flags
  uint8_t is_extended, is_remote, is_error, is_fd;
  uint8_t fd_flags;  // 4 bits as candump writes them
  uint8_t length;    // bytes of data; of a remote frame the length asked for
  uint8_t data[WM_CAN_DATA_MAX];
} wm_can_frame;

// One line of `candump -l` ("(SECONDS.MICROS) IFACE ID#DATA ..."). `line` needn't be terminated. Empty lines and lines
// that begin with '#' give WM_AGAIN. What candump prints on the screen is refused with a message that says so.
// Cost linear in `length`; no allocation. Any thread.
wm_status wm_candump_parse(const char *line, size_t length, wm_can_frame *out, wm_error *err);

// A DBC file, read at start. Allocates; not for the real-time thread. Unknown sections are skipped with grace.
typedef struct wm_dbc wm_dbc;
wm_status wm_dbc_load(const char *path, wm_dbc **out, wm_error *err);
wm_status wm_dbc_parse(const char *text, size_t length, const char *path_for_messages, wm_dbc **out, wm_error *err);
void wm_dbc_free(wm_dbc *dbc);

// The line of can-signals.yaml that binds signals to one quantity.
#define WM_CAN_SUM_MAX 4
#define WM_CAN_VALUES_MAX 32
typedef struct wm_can_binding {
  int quantity;  // wm_quantity
  char message[64];
  char signal[WM_CAN_SUM_MAX][64];  // several: their sum
  uint32_t signal_count;
  char bus[WM_CAN_IFACE_MAX];  // "": any
  char unit[16];               // "": the DBC's
  double scale, offset;        // applied after the unit: quantity = scale * si + offset; 1 and 0
  uint32_t gear_count;         // gear only: raw value -> direction
  struct {
    double raw;
    double direction;
  } gear[WM_CAN_VALUES_MAX];
  int line;  // where it stands, for messages
  char file[192];
} wm_can_binding;

// Decodes frames into quantities. Allocates when made; decoding doesn't.
typedef struct wm_can_decoder wm_can_decoder;
wm_status wm_can_decoder_make(const wm_dbc *dbc, const wm_can_binding *bindings, size_t count, wm_can_decoder **out,
                              wm_error *err);
void wm_can_decoder_free(wm_can_decoder *self);
// WM_OK: *out holds the quantities of this frame (ticks unwrapped, units SI). WM_AGAIN: nothing is bound to this frame
// (counted as ignored), or it is a repeated one. WM_BAD_DATA: counted. `counts` is updated. No allocation.
wm_status wm_can_decode(wm_can_decoder *self, const wm_can_frame *frame, wm_quantities *out, wm_source_counts *counts,
                        wm_error *err);
// CAN ids that are needed, for kernel filters; returns how many there are.
size_t wm_can_decoder_ids(const wm_can_decoder *self, uint32_t *ids, uint8_t *is_extended, size_t capacity);
// Quantities that this decoder can give: bit per wm_quantity.
uint32_t wm_can_decoder_quantities(const wm_can_decoder *self);

#ifdef __cplusplus
}
#endif

#endif
