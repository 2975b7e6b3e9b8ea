// SPDX-License-Identifier: Apache-2.0
// A source of events, implemented by devices and by recorded streams. Used by one thread.
#ifndef WAYMARK_SOURCE_H
#define WAYMARK_SOURCE_H

#include <stdint.h>

#include "waymark/event.h"
#include "waymark/health.h"
#include "waymark/look.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_SOURCE_NAME_MAX 48  // bytes, "sightings:" and a sensor's name
#define WM_SOURCES_MAX 32      // of a run

// What is wrong with a row that can't be read, where it is known.
typedef enum wm_row_problem {
  WM_ROW_OTHER = 0,
  WM_ROW_STAMP_OF_SECONDS,  // a stamp with a fraction: nanoseconds are whole
  WM_ROW_ANGLE,             // an angle outside of what can be: degrees
  WM_ROW_VALUE,             // another number outside of what can be
  WM_ROW_STAMP_APART,       // a single stamp far from those before and after it
  WM_ROW_SENDER             // of another unit on the bus than the one that is taken, which is silent
} wm_row_problem;

// Counts of a source: every datum that doesn't become an event is in one of these.
typedef struct wm_source_counts {
  uint64_t received;           // events handed out
  uint64_t lost;               // missing by the sender's own count (message counters, frame numbers)
  uint64_t malformed;          // rows, lines or frames that could not be read
  uint64_t not_finite;         // values that were NaN, infinite or impossible
  uint64_t out_of_order;       // older than the one before it where the format requires order
  uint64_t ignored;            // well-formed, but without a binding (other CAN frames), or a repeated report
  uint64_t frozen;             // of a sender whose counter or stamp stood still
  uint64_t bus_errors;         // CAN error frames: faults of the bus, reported by the controller
  uint64_t overflows;          // dropped by the kernel or the controller because they were not read in time
  char first_problem[256];     // text of the first malformed one, with file and line; "" where none
  uint8_t first_problem_kind;  // wm_row_problem
  // Devices: wm_device_state with a note for the user, and the uncertainty of stamps.
  uint8_t device;
  char device_note[160];
  uint32_t news;  // changes that are reported without a change of the device's state: another type of fix
  wm_time_ns stamp_uncertainty_ns;
  uint64_t looks[WM_LOOK_COUNT];  // of a detector of known landmarks: search outcomes over all pictures
} wm_source_counts;

// Longest wait of a device's `next`, so that a stop is noticed.
#define WM_DEVICE_WAIT_MS 50

typedef struct wm_source wm_source;

typedef struct wm_source_ops {
  // Fills *out (t_ns, arrival_ns, seq, kind, as; `source` is set to self->index) and returns WM_OK; WM_END at the end;
  // WM_AGAIN without data for a while (devices: they wait for up to WM_DEVICE_WAIT_MS, and never end). Bad data is
  // counted and skipped, never returned. Devices stamp by CLOCK_MONOTONIC.
  wm_status (*next)(wm_source *self, wm_event *out, wm_error *err);
  void (*close)(wm_source *self);
} wm_source_ops;

struct wm_source {
  const wm_source_ops *ops;
  char name[WM_SOURCE_NAME_MAX];  // "can", "motion", "sightings:laser", "gnss"
  uint16_t index;                 // in the run's table of sources: also the order at equal stamps
  uint8_t is_motion;              // its events are motion
  uint8_t is_live;                // a device: its data arrive in real time
  uint8_t event_driven;           // sends on demand: its silence is no fault
  uint8_t in_order;               // its stamps never go back (a file without arrival_ns, a CAN bus)
  uint8_t is_bus;                 // decoded from a CAN bus
  uint8_t sample_at_next;         // of a CSV of motion: each row's values get the stamp of the row after it
  wm_time_ns ready_after_ns;      // of recorded pictures: from a picture's arrival to that of its observations
  double lateness_max_ms;         // default where the configuration doesn't name the source; 0: merge.lateness_max_ms
  uint32_t kinds;                 // WM_EVENT_BIT of what it hands out
  uint32_t quantities;            // bit per wm_quantity that it may give
  wm_source_counts counts;
  wm_time_ns from_ns, until_ns;  // of the interval that a run takes: search outcomes outside of it aren't counted
  // NULL where nothing may be skipped. Pictures are large and slow to process: those that are no longer the newest at
  // `now_ns`, on the clock of the arrivals, are skipped and counted (overflows).
  void (*skip_to)(wm_source *self, wm_time_ns now_ns);
};

// Counts an unusable datum; the first one's reason is kept.
void wm_source_refuse(wm_source_counts *counts, const char *where, const char *why);

#ifdef __cplusplus
}
#endif

#endif
