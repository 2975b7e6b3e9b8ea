// SPDX-License-Identifier: Apache-2.0
// Checks before driving: a configuration, its files, a recording's data, this computer. Each part adds its findings,
// with a remedy each, and continues. Limits cover wheeled robots, cars and boats with a wide margin, so that only
// mistakes exceed them. Not used by a run.
#ifndef WAYMARK_CLI_CHECK_CHECK_H
#define WAYMARK_CLI_CHECK_CHECK_H

#include "cli/check/channels.h"
#include "cli/check/clocks.h"
#include "cli/check/comparisons.h"
#include "findings/findings.h"
#include "fusion/assembly.h"
#include "output/drive_evidence.h"

// ── parts ───────────────────────────────────────────────────────────────────────────────────────────────────────────

// Allowed but implausible values: rates, LCM's URL, the folders of saved files.
void check_config(const wm_config *config, wm_findings *out);
// Wheels, cameras, sensors, stereo pair: wrong units, sizes of pictures, signs.
void check_calibration(const wm_assembly *assembly, wm_findings *out);
void check_landmarks(const wm_setup *setup, wm_findings *out);
// A raster map and the start on it.
void check_map(const wm_assembly *assembly, wm_findings *out);
// Whether this computer allows the memory and the priority of a run on devices.
void check_computer(const wm_config *config, size_t memory_bytes, wm_findings *out);

// ── a recording's data ──────────────────────────────────────────────────────────────────────────────────────────────

// Sums for the correlation and the ratio of two measurements of one quantity.
typedef struct agreement {
  double aa, bb, ab;
  uint64_t count;
} agreement;

// What was seen of the quantities of the motion, by source.
typedef struct quantity_seen {
  uint64_t count;
  double least, most, last;
  uint64_t zeros, as_float;  // as_float: values whose bits, taken for a float, are a usual number
} quantity_seen;
// A counter of wheel ticks that starts anew: each time at the end of its bits, or once, because its sender did.
#define WRAP_BITS 6  // usual numbers of bits
typedef struct ticks_wrap {
  double last, step, step_before;
  wm_time_ns last_ns, first_ns;                   // stamps of the last and of the first count
  uint64_t restarts;                              // jumps to 0
  double restart_from, restart_s;                 // of the first one: the count before, and when, since the first
  uint64_t counts, jumps, alike;                  // alike: jumps of the size of the first one
  double since, between, first_jump;              // counts: since the last jump, between the jumps
  uint64_t folds[WRAP_BITS], misfits[WRAP_BITS];  // large steps that are a small one less a cycle, and others
} ticks_wrap;
typedef struct motion_data {
  const wm_wheels *wheels;
  quantity_seen at[WM_SOURCES_MAX][WM_Q_COUNT];
  double fastest_mps;   // by the ticks
  wm_time_ns ticks_ns;  // stamp of the last pair of ticks
  double ticks[2];      // at that stamp
  ticks_wrap wraps[2];  // left, right
} motion_data;

// Column of a stream that gives this quantity, "wz_radps"; NULL: its own name, as on CAN.
const char *motion_data_column(const char *source, unsigned quantity);
void motion_data_init(motion_data *self, const wm_wheels *wheels);
void motion_data_take(motion_data *self, const wm_event *event);
// `bound`: bit per wm_quantity of the binding.
void motion_data_judge(const motion_data *self, const wm_assembly *assembly, uint32_t bound, wm_findings *out);

// Positions against the motion between them, and against headings.
typedef struct course_data {
  double speed_mps, turn_radps, heading_rad;  // newest; NaN: none
  wm_time_ns motion_ns;                       // until which the motion is summed up
  double way_m, turn_rad;                     // since the last position taken
  wm_time_ns from_ns;                         // of that position
  double from_m[2];
  double last_course_rad, last_turn_rad, last_way_m;  // of the step before
  uint64_t within, stood;  // positions since the last step; times without a step while the motion goes on
  double stood_m;          // its way meanwhile
  agreement way, turn;     // of the positions against the motion's
  double heading_less[2], heading_plus[2];  // sums of cos and sin of the heading less and plus the way's direction
  uint64_t headings;
} course_data;

void course_data_init(course_data *self);
void course_data_take(course_data *self, const wm_event *event);
void course_data_judge(const course_data *self, wm_findings *out);

// What went by of one source.
typedef struct source_facts {
  uint64_t events;
  wm_time_ns first_ns, last_ns;
  uint64_t stamps;                                     // that differ from the one before
  wm_time_ns latest_ns;                                // largest lateness, with look_ns
  uint64_t ahead;                                      // that arrive before their stamp, and are not used
  wm_time_ns look_ns;                                  // time of detection on this computer; 0 for other sources
  int jumps;                                           // its stamps jump: a finding of its own
  uint64_t sightings, unknown_landmarks, bare_ranges;  // bare_ranges: without a bearing
  uint64_t ranges, far_ranges;                         // far: beyond the sensor's max_range_m, and not used
} source_facts;

typedef struct source_data {
  const wm_assembly *assembly;
  source_facts facts[WM_SOURCES_MAX];
  motion_data motion;
  course_data course;
  channels channels;
  clock_data clocks;
} source_data;

void source_data_init(source_data *self, const wm_assembly *assembly);
// An event that arrived.
void source_data_take(source_data *self, const wm_event *event);
// After the last event: each source's counts, and the sources against each other. `bound` as above.
void source_data_judge(source_data *self, uint32_t bound, const wm_health *health, wm_findings *out);
void source_data_free(source_data *self);

// What the drive cannot show of the calibration, by the sigmas with which it ended.
void check_observable(const drive_evidence *drive, const wm_assembly *assembly, const wm_health *health,
                      wm_findings *out);

// What the recording has and the run does not use, after a drive.
void check_unused(const drive_evidence *evidence, const source_data *data, const wm_health *health, uint32_t bound,
                  wm_findings *out);

#endif
