// SPDX-License-Identifier: Apache-2.0
// faults.yaml: what breaks during a drive and when, what health has to state about it, and the bounds that the pose has
// to keep. One table has all kinds of faults: who causes each, and its parameters. Read at start; allocates.
#ifndef WAYMARK_FAULTS_H
#define WAYMARK_FAULTS_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "waymark/setup.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_FAULTS_MAX 256           // of a file
#define WM_FAULT_PARAMS_MAX 2       // numbers of a kind
#define WM_FAULT_IDS_MAX 16         // CAN ids of a fault
#define WM_FAULT_STATEMENTS_MAX 12  // of health, of a fault
#define WM_FAULT_TEXT_MAX 128       // bytes of a name or a path

typedef enum wm_fault_kind {
  WM_FAULT_CAMERA_UNPLUGGED = 0,
  WM_FAULT_CAMERA_FROZEN,
  WM_FAULT_CAMERA_STALLED,
  WM_FAULT_CAMERA_DARK,
  WM_FAULT_CAMERA_DROPPED,
  WM_FAULT_CAMERA_DAMAGED,
  WM_FAULT_CAMERA_CLOCK_AHEAD,
  WM_FAULT_BUS_DOWN,
  WM_FAULT_BUS_REMOVED,
  WM_FAULT_BUS_OFF,
  WM_FAULT_BUS_SILENT,
  WM_FAULT_BUS_DROPPED,
  WM_FAULT_BUS_DUPLICATED,
  WM_FAULT_BUS_BYTE_ORDER,
  WM_FAULT_BUS_LOAD,
  WM_FAULT_STREAM_SILENT,
  WM_FAULT_STREAM_DROPPED,
  WM_FAULT_STREAM_CLOCK_AHEAD,
  WM_FAULT_POWER_CUT,
  WM_FAULT_PROCESS_KILLED,
  WM_FAULT_DISK_FULL,
  WM_FAULT_CPU_HOGGED,
  WM_FAULT_FREQUENCY_CAP,
  WM_FAULT_NO_ROUTE,
  WM_FAULT_BAD_CONFIG,
  WM_FAULT_KIND_COUNT
} wm_fault_kind;

// Who causes it. Faults of data come from the player, on real interfaces and in the place of drivers; what happens to
// the computer or to a process comes from who runs the test.
enum { WM_FAULT_BY_PLAYER = 1, WM_FAULT_BY_PLAYED_DRIVER = 2, WM_FAULT_BY_RUNNER = 4 };

typedef struct wm_fault_param {
  const char *name;              // "share"; NULL: none
  double min, max, when_absent;  // inclusive limits; NaN: it has to be there
} wm_fault_param;

typedef struct wm_fault_kind_row {
  const char *name;      // as the file has it: "camera_unplugged"
  unsigned by;           // WM_FAULT_BY_ bits
  const char *of;        // key of what breaks: "camera", "bus", "stream"; NULL: the computer
  int is_instant;        // without an end it ends where it begins
  int takes_ids;         // `ids`: of these CAN ids alone
  const char *text_key;  // a text that it takes ("path"); NULL: none
  const char *text_when_absent;
  wm_fault_param params[WM_FAULT_PARAMS_MAX];
  const char *about;  // one sentence for the reference
} wm_fault_kind_row;

const wm_fault_kind_row *wm_fault_kind_of(wm_fault_kind kind);

// What health or the run's text has to state while the fault lasts.
typedef enum wm_statement_kind {
  WM_STATES_DEVICE,   // device state of a source in health_t
  WM_STATES_FLAG,     // flag of pose_t
  WM_STATES_STATE,    // state of pose_t
  WM_STATES_CAUSE,    // cause of health_t
  WM_STATES_COUNTER,  // counter of a source in health_t: by how much it grows from the fault's begin to its end
  WM_STATES_TEXT      // text on the run's standard error
} wm_statement_kind;

typedef struct wm_statement {
  wm_statement_kind kind;
  char source[WM_FAULT_TEXT_MAX];  // as health has it; "": none
  char what[WM_FAULT_TEXT_MAX];    // name of the state, flag, cause or counter, or the text
  double within_s;                 // from the fault's begin; NaN: not judged
  double cleared_within_s;         // from the fault's end; NaN: not judged
  double at_least, at_most;        // of a counter, and how often a text is there; NaN: not judged
} wm_statement;

// Bounds of the pose from the fault's begin until `within_s` after its end; NaN: not judged.
typedef struct wm_pose_bound {
  double position_m, heading_deg;  // largest error
  double error_sigmas;             // largest error in sigmas of the pose
  double sigma_m, sigma_deg;       // largest sigma
  double sigma_grows;              // least growth of the sigma during the fault, as a factor
  double rate_hz, gap_max_s;       // of the published poses
  double within_s;                 // from the fault's end to a pose as good as before
} wm_pose_bound;

typedef struct wm_fault {
  char name[WM_FAULT_TEXT_MAX];
  wm_fault_kind kind;
  double from_s, until_s;      // since the recording's first datum; infinite: to the end
  char of[WM_FAULT_TEXT_MAX];  // camera, bus or stream of the recording; "": all
  double param[WM_FAULT_PARAMS_MAX];
  char text[WM_FAULT_TEXT_MAX];
  uint32_t ids[WM_FAULT_IDS_MAX];
  size_t id_count;  // 0: all
  wm_statement states[WM_FAULT_STATEMENTS_MAX];
  size_t state_count;
  int has_pose;
  wm_pose_bound pose;
  int line;
} wm_fault;

typedef struct wm_faults {
  char path[512];
  wm_fault *fault;  // in the file's order
  size_t count;
} wm_faults;

// WM_BAD_CONFIG with file, line, key and what is allowed. *out is empty on failure.
wm_status wm_faults_load(const char *path, wm_faults *out, wm_error *err);
wm_status wm_faults_parse(const char *text, size_t length, const char *path, wm_faults *out, wm_error *err);
void wm_faults_free(wm_faults *self);

// The first fault of this kind that lasts at `at_s` for `of` (a camera, bus or stream); NULL: none. Faults without `of`
// are for all. Cost linear in the number of faults. Any thread.
const wm_fault *wm_faults_at(const wm_faults *self, wm_fault_kind kind, const char *of, double at_s);
// Whether the datum of this number is one of a share (0 to 1); by the number alone, so that a replay breaks the same.
int wm_fault_hits(uint32_t number, double share);

// The file as one JSON object, with all defaults, for programs that judge: an absent number is null.
void wm_faults_json(const wm_faults *self, FILE *to);
// The kinds as a table in markdown.
void wm_fault_kinds_reference(FILE *to);

#ifdef __cplusplus
}
#endif

#endif
