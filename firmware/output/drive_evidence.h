// SPDX-License-Identifier: Apache-2.0
// How well the observations of a drive agree with its poses, from the records of the pipeline: for `check`, and for the
// summary of a replay and of a run.
#ifndef WAYMARK_OUTPUT_DRIVE_EVIDENCE_H
#define WAYMARK_OUTPUT_DRIVE_EVIDENCE_H

#include "findings/findings.h"
#include "fusion/assembly.h"
#include "fusion/output.h"

// Of one quantity of a source.
typedef struct residual_evidence {
  uint64_t fused, refused;      // updates; refused: by the gate, or because the pose was being searched for
  double sum, squares;          // of the fused innovations over their sigma
  double ratio, ratio_squares;  // sum of observed over expected, less 1, of `ratios` ranges, fused and refused
  uint64_t ratios;
} residual_evidence;

#define EVIDENCE_LANDMARKS_MAX 256
typedef struct landmark_evidence {
  int32_t id;
  uint64_t fused, refused, unknown;  // unknown: the map doesn't have it
} landmark_evidence;

// A longer silence of all sources (a clock that was set, recordings put together) is skipped, not played.
#define WM_LONGEST_SILENCE_NS (600 * WM_NS_PER_S)

typedef struct drive_evidence {
  residual_evidence residuals[WM_SOURCES_MAX][WM_RESIDUAL_COUNT];
  landmark_evidence landmarks[EVIDENCE_LANDMARKS_MAX];
  size_t landmark_count;
  uint64_t states[WM_STATE_COUNT], published;  // messages by wm_state
  double log_likelihood;                       // of all updates, nats; a refused one counts as an outlier of any value
  uint64_t updates, fused;
  // Of the degraded and of the lost messages; the last row: without a source.
  uint64_t causes[2][WM_SOURCES_MAX + 1][WM_CAUSE_COUNT];
  uint64_t unusable[WM_UNUSABLE_COUNT];  // messages by wm_unusable
  uint64_t poses;                        // fused
  wm_time_ns first_ns, last_ns;          // stamps of the events
  double silent_s;                       // of this time, in silences longer than a replay plays (WM_LONGEST_SILENCE_NS)
  int has_events;
  wm_published begun;    // the first message
  double speed_squares;  // of the messages of a robot that drives, (m/s)2
  uint64_t driven;       // their number
  // The first new pose soon after the start: how far from the one before; 0 s: there was none.
  double start_moved_s, start_moved_m, start_turned_rad;
} drive_evidence;

// A record of the pipeline's output.
void evidence_put(drive_evidence *self, wm_output_kind kind, const void *record);
// Messages that were due, had there been a pose from the first event to the last.
uint64_t evidence_due(const drive_evidence *self, double publish_rate_hz);
// Share of the messages' times with this state; without a pose counts as searching. `total`: messages that were due.
double evidence_share(const drive_evidence *self, wm_state state, uint64_t total);
// Mean log likelihood of an update, nats: the larger the better the observations fit.
double evidence_score(const drive_evidence *self);
// `health` as the drive ended.
void evidence_judge(const drive_evidence *self, const wm_assembly *assembly, const wm_health *health, uint64_t total,
                    wm_findings *out);

#endif
