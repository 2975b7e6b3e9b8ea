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

#define WM_CAN_DATA_MAX 64   // bytes of a CAN FD frame
#define WM_CAN_IFACE_MAX 16  // of a device: IFNAMSIZ
#define WM_CAN_BUS_MAX 64    // of a log, where the name may be a ROS topic or an adapter's path

typedef struct wm_can_frame {
  wm_time_ns t_ns;
  char iface[WM_CAN_BUS_MAX];
  uint32_t id;  // 11 or 29 bits, without flags
  uint8_t is_extended, is_remote, is_error, is_fd;
  uint8_t fd_flags;  // 4 bits as candump writes them
  uint8_t length;    // bytes of data; of a remote frame the length asked for
  uint8_t data[WM_CAN_DATA_MAX];
} wm_can_frame;

// One line of `candump -l` ("(SECONDS.MICROS) IFACE ID#DATA ..."): classic (also with a raw DLC, _9 to _F), FD (##),
// remote and error frames (bit 29 of eight digits), with or without a final direction (R, T). `line` needn't be
// terminated. Or a line of candump's screen with a time, "(SECONDS.MICROS)  IFACE  ID   [LENGTH]  BYTES". The time may
// be a date (`candump -tA`), which is taken as UTC. WM_AGAIN: an empty line, or one that begins with '#'. WM_BAD_DATA,
// WM_OUT_OF_RANGE, WM_UNSUPPORTED (CAN XL): *err has the reason, without file and line. The time is exact (integers),
// also a negative one. Cost linear in `length`; no allocation. Any thread.
wm_status wm_candump_parse(const char *line, size_t length, wm_can_frame *out, wm_error *err);

// The ids of a log's first frames, and whether its times are differences (`candump -L -td`).
#define WM_CAN_SURVEY_FRAMES 50000  // 12 s of a full bus of 500 kbit/s
#define WM_CAN_SURVEY_IDS 512       // different ones; further ones are left out
typedef struct wm_can_seen {
  uint32_t id;
  uint8_t is_extended;
  char iface[WM_CAN_BUS_MAX];
  uint64_t frames;
  wm_time_ns first_ns, last_ns;  // stamps of the first and of the newest one
} wm_can_seen;
typedef struct wm_can_survey {
  wm_can_seen seen[WM_CAN_SURVEY_IDS];  // in the order of their first frames; error and remote frames are left out
  size_t count, newest;                 // newest: that of the last frame
  uint64_t runs;                        // of frames of one id after each other: `count` where the log is sorted by id
  uint64_t frames, not_later;           // of all kinds; those whose stamp isn't later than that of the frame before
  wm_time_ns first_ns, last_ns;
  wm_time_ns rise_ns;  // the largest from a stamp to the next one
} wm_can_survey;
// All zeros begin one. 0: it has seen enough. Cost: a search among the ids.
int wm_can_survey_take(wm_can_survey *self, const wm_can_frame *frame);
// The most frequent id of this number with any width, else of this PGN (J1939); NULL: none.
const wm_can_seen *wm_can_survey_nearest(const wm_can_survey *self, uint32_t id, int is_extended);
// Stamps of a log that begins at 0 rise; differences go up and down. 1: they are differences.
int wm_can_survey_has_differences(const wm_can_survey *self);

// Writes a frame as such a line, terminated, with its line feed; stamps to the microsecond. Returns its length, 0 where
// it doesn't fit (256 bytes suffice). No allocation. Any thread.
size_t wm_candump_write(const wm_can_frame *frame, char *out, size_t capacity);

// A frame is of a message where the bits of `mask` are those of `id`.
typedef struct wm_can_match {
  uint32_t id, mask;
  uint8_t is_extended;
} wm_can_match;
static inline int wm_can_matches(const wm_can_match *match, uint32_t id, int is_extended) {
  return match->is_extended == is_extended && ((id ^ match->id) & match->mask) == 0;
}

// A DBC file, read at start, UTF-8 or Windows-1252. Allocates (at most a few times the file's size, which is at most 16
// MB); not for the real-time thread. WM_BAD_CONFIG with file and line for errors in BO_, SG_, SIG_VALTYPE_, SG_MUL_VAL_
// and VAL_; other sections are skipped. Errors that matter only for a bound signal (one that doesn't fit into its
// message, a multiplexed one without a multiplexer) are left to wm_can_decoder_make.
typedef struct wm_dbc wm_dbc;
wm_status wm_dbc_load(const char *path, wm_dbc **out, wm_error *err);
wm_status wm_dbc_parse(const char *text, size_t length, const char *path_for_messages, wm_dbc **out, wm_error *err);
void wm_dbc_free(wm_dbc *dbc);  // NULL is fine

// Further quantities: those of a GNSS receiver, which become positions (wm_can_gnss). Angles in rad, lengths in m.
enum {
  WM_CAN_LATITUDE = WM_Q_COUNT,
  WM_CAN_LONGITUDE,
  WM_CAN_ALTITUDE,
  WM_CAN_SIGMA_XY,
  WM_CAN_SIGMA_Z,
  WM_CAN_VALID,           // 0: the receiver has no fix
  WM_CAN_ALTITUDE_VALID,  // 0: its fix has no altitude
  WM_CAN_COUNT
};
// Name of a wm_quantity or of the above in can-signals.yaml; "?" for others.
const char *wm_can_quantity_name(unsigned quantity);

// The bindings of one source: motion, or the GNSS receiver.
typedef enum wm_can_part { WM_CAN_MOTION, WM_CAN_GNSS } wm_can_part;

// Positions from the values of a GNSS receiver, in metres east, north and up of an origin: in the plane that touches
// the WGS84 ellipsoid there (waymark/local_frame.h).
typedef struct wm_can_gnss {
  double origin[3];  // degrees, degrees, m; NaN: the first position
  double level_m;    // the map's above the ellipsoid
  double value[WM_CAN_COUNT - WM_CAN_LATITUDE];
  uint32_t fresh;  // bit per value since the last position
} wm_can_gnss;
// `origin`: latitude and longitude in degrees, altitude in m; NaN: unknown.
void wm_can_gnss_init(wm_can_gnss *self, const double origin[3]);
// Takes the values of a frame. 1: with latitude and longitude it makes a position. Without a stated accuracy 5 m, and
// twice the horizontal one for the altitude; without an altitude its fields are NaN.
int wm_can_gnss_take(wm_can_gnss *self, const wm_quantities *values, wm_position *out);

// The line of can-signals.yaml that binds signals to one quantity.
#define WM_CAN_SUM_MAX 4      // signals of a sum: one for each wheel
#define WM_CAN_VALUES_MAX 32  // gears in a table
typedef struct wm_can_binding {
  int quantity;                     // wm_quantity or WM_CAN_LATITUDE ...
  char message[64];                 // name in the DBC, short or long
  char signal[WM_CAN_SUM_MAX][64];  // several: their sum
  uint32_t signal_count;
  char bus[WM_CAN_BUS_MAX];  // "": any
  char unit[16];             // "": the DBC's
  double scale, offset;      // applied after the unit: quantity = scale * si + offset; 1 and 0
  uint32_t gear_count;       // gear only: raw value -> direction; 0: by the names in the DBC's VAL_
  struct {
    double raw;
    double direction;
  } gear[WM_CAN_VALUES_MAX];
  int line;  // of can-signals.yaml, for messages
  char file[192];
} wm_can_binding;

// Decodes frames into quantities. Making one allocates and copies all it needs: the DBC and the bindings may be freed.
// Each quantity may be bound once. WM_BAD_CONFIG with the binding's file and line for a wrong binding (docs/can.md
// lists the checks).
typedef struct wm_can_decoder wm_can_decoder;
wm_status wm_can_decoder_make(const wm_dbc *dbc, const wm_can_binding *bindings, size_t count, wm_can_decoder **out,
                              wm_error *err);
void wm_can_decoder_free(wm_can_decoder *self);  // NULL is fine

// WM_OK: *out holds the quantities of this frame (ticks unwrapped, units SI), with `lost_before` and `doubt`.
// WM_AGAIN: no quantities: a frame without a binding (counts.ignored), an error frame (bus_errors), or a repeated one
// (frozen; from the third on they are handed out with WM_DOUBT_FROZEN_COUNTER).
// WM_BAD_DATA: shorter than its bound signals (malformed), or all of its signals mean "not available" (not_finite); the
// text is in *err.
// The source, which has file and line, fills `counts.received` and `counts.first_problem`.
// A message of J1939 (by the DBC's VFrameFormat, or source address FE) is taken by its PGN: priority, destination and
// source address are free. Of several senders of a message (buses, source addresses) the first one is taken, and those
// of the others are `ignored`, until it has been silent for 3 s.
// A message's rolling counter, where the DBC has one that steps by one in the first frames, gives `lost`; a late frame
// is subtracted again.
// Ticks continue from their last value by the shorter way round. After a silence (0.25 s, three periods) of a counter
// of up to 48 bits: by the one number of cycles that fits the rates so far; else with WM_DOUBT_COUNTS_WRAPPED. No
// allocation. Cost: linear in the bound messages and their signals; on a desk computer some 20 ns for an unbound id
// beside six messages and 50 ns for a frame. One thread at a time.
wm_status wm_can_decode(wm_can_decoder *self, const wm_can_frame *frame, wm_quantities *out, wm_source_counts *counts,
                        wm_error *err);
// A decoded frame as an event of its source: quantities, or the position that is complete with it (`gnss` is of that
// part). Sets *out but for source, arrival and seq. Statuses as above; WM_AGAIN also without a position.
wm_status wm_can_event(wm_can_decoder *self, wm_can_part part, wm_can_gnss *gnss, const wm_can_frame *frame,
                       wm_event *out, wm_source_counts *counts, wm_error *err);
// Matches of the bound messages, for kernel filters; returns how many there are.
size_t wm_can_decoder_matches(const wm_can_decoder *self, wm_can_match *out, size_t capacity);
// Of the bound messages of which no frame has come: a text for people that names each wanted id, and those in the
// survey that are like it, else the most frequent ones. "" where all came. Returns its length.
size_t wm_can_decoder_missing(const wm_can_decoder *self, const wm_can_survey *seen, char *out, size_t capacity);
// Of a bound message whose id the DBC has twice, with different contents: which one is taken. "": none.
const char *wm_can_decoder_twins(const wm_can_decoder *self);
// Of the bound messages that several senders (buses, J1939 source addresses) send: which one is taken. "": none.
size_t wm_can_decoder_senders(const wm_can_decoder *self, const wm_can_survey *seen, char *out, size_t capacity);
// Of the bound integer signals whose bits all are numbers as floating point, and none in range as an integer: the line
// that the DBC lacks. "": none.
size_t wm_can_decoder_floats(const wm_can_decoder *self, char *out, size_t capacity);
// Quantities that this decoder can give: bit per wm_quantity.
uint32_t wm_can_decoder_quantities(const wm_can_decoder *self);

#ifdef __cplusplus
}
#endif

#endif
