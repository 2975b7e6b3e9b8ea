// SPDX-License-Identifier: Apache-2.0
// Checks before driving: a configuration, its files, a recording's data, this computer. Each part adds its findings,
// with a remedy each, and continues. Limits cover wheeled robots, cars and boats with a wide margin, so that only
// mistakes exceed them. Not used by a run.
#ifndef WAYMARK_CLI_CHECK_CHECK_H
#define WAYMARK_CLI_CHECK_CHECK_H

#include "cli/doctor/findings.h"
#include "fusion/assembly.h"
#include "fusion/output.h"

// ── parts ───────────────────────────────────────────────────────────────────────────────────────────────────────────

// Allowed but implausible values: rates, LCM's URL, the folders of saved files.
void check_config(const wm_config *config, findings *out);
// Wheels, cameras, sensors, stereo pair: wrong units, sizes of pictures, signs.
void check_calibration(const wm_assembly *assembly, findings *out);
void check_landmarks(const wm_setup *setup, findings *out);
// A raster map and the start on it.
void check_map(const wm_assembly *assembly, findings *out);
// Whether this computer allows the memory and the priority of a run on devices.
void check_computer(const wm_config *config, size_t memory_bytes, findings *out);

// ── a recording's data ──────────────────────────────────────────────────────────────────────────────────────────────

// Sums for the correlation and the ratio of two measurements of one quantity.
typedef struct agreement {
  double aa, bb, ab;
  uint64_t count;
} agreement;

// What was seen of the motion over CAN.
typedef struct motion_data {
  const wm_wheels *wheels;
  uint64_t count[WM_Q_COUNT];
  double least[WM_Q_COUNT], most[WM_Q_COUNT], last[WM_Q_COUNT];
  double fastest_mps;     // by the ticks
  wm_time_ns ticks_ns;    // stamp of the last pair of ticks
  double ticks[2];        // at that stamp
  double turn_by_ticks;   // rad/s, NaN: not known
  agreement turn_wheels;  // turn rate of the gyro against that of the wheels' speeds
  agreement turn_ticks;   // and of the ticks
  agreement turn_steering;
  agreement speed_wheels;  // vehicle's speed against the wheels'
} motion_data;

void motion_data_init(motion_data *self, const wm_wheels *wheels);
void motion_data_take(motion_data *self, const wm_event *event);
// `bound`: bit per wm_quantity of the binding.
void motion_data_judge(const motion_data *self, uint32_t bound, findings *out);

// What went by of one source.
typedef struct source_facts {
  uint64_t events;
  wm_time_ns first_ns, last_ns;
  wm_time_ns latest_ns;                                // largest lateness, with look_ns
  wm_time_ns look_ns;                                  // time of detection on this computer; 0 for other sources
  uint64_t sightings, unknown_landmarks, bare_ranges;  // bare_ranges: without a bearing
} source_facts;

typedef struct source_data {
  const wm_assembly *assembly;
  source_facts facts[WM_SOURCES_MAX];
  motion_data motion;
} source_data;

void source_data_init(source_data *self, const wm_assembly *assembly);
// An event that arrived.
void source_data_take(source_data *self, const wm_event *event);
// After the last event: each source's counts, and the sources against each other. `bound` as above.
void source_data_judge(source_data *self, uint32_t bound, findings *out);

// ── a drive ─────────────────────────────────────────────────────────────────────────────────────────────────────────

// How well the observations of a drive agree with its poses.
typedef struct residual_evidence {
  uint64_t fused, refused;  // updates; refused: by the gate, or because the pose was being searched for
  double sum, squares;      // of the fused innovations over their sigma
} residual_evidence;

#define EVIDENCE_LANDMARKS_MAX 256
typedef struct landmark_evidence {
  int32_t id;
  uint64_t fused, refused, unknown;  // unknown: the map doesn't have it
} landmark_evidence;

typedef struct drive_evidence {
  residual_evidence residuals[WM_SOURCES_MAX][WM_RESIDUAL_COUNT];
  landmark_evidence landmarks[EVIDENCE_LANDMARKS_MAX];
  size_t landmark_count;
  uint64_t states[4], published;  // messages by wm_state
  double log_likelihood;          // of all updates, nats; a refused one counts as an outlier of any value
  uint64_t updates, fused;
} drive_evidence;

// A record of the pipeline's output.
void evidence_put(drive_evidence *self, wm_output_kind kind, const void *record);
// Share of the messages' times with this state; without a pose counts as searching. `total`: messages that were due.
double evidence_share(const drive_evidence *self, wm_state state, uint64_t total);
// Mean log likelihood of an update, nats: the larger the better the observations fit.
double evidence_score(const drive_evidence *self);
// `health` as the drive ended.
void evidence_judge(const drive_evidence *self, const wm_assembly *assembly, const wm_health *health, uint64_t total,
                    findings *out);

#endif
