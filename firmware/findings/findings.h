// SPDX-License-Identifier: Apache-2.0
// Findings: what is wrong, or might be, with a configuration, a recording, a run or a computer. One table of kinds,
// each with an identifier and a section of that name in docs/troubleshooting.md; one type; one list. Every command uses
// them.
#ifndef WAYMARK_FINDINGS_FINDINGS_H
#define WAYMARK_FINDINGS_FINDINGS_H

#include <stddef.h>
#include <stdio.h>

#include "waymark/health.h"
#include "waymark/status.h"
#include "waymark/time.h"

typedef enum wm_finding_id {
  // files and settings
  WM_FOUND_REFUSED_INPUT,
  WM_FOUND_MISSPELT_NAME,
  WM_FOUND_FILE_NOTE,
  WM_FOUND_PUBLISH_SETTINGS,
  WM_FOUND_OPEN_NETWORK,
  WM_FOUND_FOLDER_NOT_WRITABLE,
  WM_FOUND_MAP_NOT_KEPT,
  // calibration and map
  WM_FOUND_LENGTH_IMPLAUSIBLE,
  WM_FOUND_GEAR_IMPLAUSIBLE,
  WM_FOUND_CAMERA_IMPLAUSIBLE,
  WM_FOUND_NOISE_IMPLAUSIBLE,
  WM_FOUND_STEREO_IMPLAUSIBLE,
  WM_FOUND_MAP_IMPLAUSIBLE,
  WM_FOUND_LANDMARKS_AT_ONE_PLACE,
  WM_FOUND_START_OFF_MAP,
  // data of a source
  WM_FOUND_NO_DATA,
  WM_FOUND_ROWS_SKIPPED,
  WM_FOUND_RATE_IMPLAUSIBLE,
  WM_FOUND_DATA_MISSING,
  WM_FOUND_VALUES_FROZEN,
  WM_FOUND_ROWS_DISORDERED,
  WM_FOUND_ROWS_UNUSED,
  WM_FOUND_DATA_LATE,
  WM_FOUND_CLOCKS_APART,
  WM_FOUND_CLOCK_JUMPED,
  WM_FOUND_CLOCK_COARSE,
  WM_FOUND_CLOCK_DRIFTS,
  WM_FOUND_BARE_RANGES,
  WM_FOUND_IDENTITIES_UNKNOWN,
  WM_FOUND_SENSOR_UNKNOWN,
  WM_FOUND_DATA_UNUSED,
  WM_FOUND_VALUE_IMPLAUSIBLE,
  WM_FOUND_COUNTER_RESTARTS,
  WM_FOUND_SENSORS_DISAGREE,
  // a drive
  WM_FOUND_LIKELY_CAUSE,
  WM_FOUND_CAUSE_UNDECIDED,
  WM_FOUND_OBSERVATIONS_REFUSED,
  WM_FOUND_OBSERVATIONS_BIASED,
  WM_FOUND_NOISE_TOO_SMALL,
  WM_FOUND_NOISE_TOO_LARGE,
  WM_FOUND_POSE_LOST,
  WM_FOUND_POSE_DOUBTFUL,
  WM_FOUND_POSE_NOT_FOUND,
  WM_FOUND_START_CONTRADICTED,
  WM_FOUND_LANDMARK_CONTRADICTED,
  WM_FOUND_LANDMARK_NOT_ON_MAP,
  WM_FOUND_LANDMARK_MOVED,
  WM_FOUND_IDENTITIES_AMBIGUOUS,
  WM_FOUND_CALIBRATION_OFF,
  WM_FOUND_NOT_OBSERVABLE,
  WM_FOUND_CAPACITY_REACHED,
  // a run
  WM_FOUND_SOURCE_SILENT,
  WM_FOUND_SENDER_CHANGED,
  WM_FOUND_DEVICE_TROUBLE,
  WM_FOUND_MOTION_SENSOR,
  WM_FOUND_OTHER_RUN,
  WM_FOUND_OUTPUTS_LOST,
  WM_FOUND_DEADLINES_MISSED,
  // a computer
  WM_FOUND_COMPUTER_REALTIME,
  WM_FOUND_COMPUTER_CLOCK,
  WM_FOUND_COMPUTER_SLOW,
  WM_FOUND_COMPUTER_MEMORY,
  WM_FOUND_CAN_INTERFACE,
  WM_FOUND_CAMERA_DEVICE,
  WM_FOUND_IMU_DEVICE,
  WM_FOUND_GNSS_RECEIVER,
  WM_FOUND_VELOCITY_LOG,
  WM_FOUND_LCM_ROUTE,
  WM_FOUND_COUNT
} wm_finding_id;

typedef struct wm_finding_kind {
  const char *identifier;  // "rows-skipped": also the section in docs/troubleshooting.md
  const char *cause;       // what it usually comes from
  const char *fix;         // of a finding that has no closer one
} wm_finding_kind;

extern const wm_finding_kind kFindingKinds[WM_FOUND_COUNT];

typedef enum wm_severity { WM_SEVERITY_GOOD, WM_SEVERITY_NOTE, WM_SEVERITY_BAD } wm_severity;
// "good", "note", "bad"
const char *wm_severity_name(unsigned severity);
// Of a share of updates that gates refused.
wm_severity wm_refused_severity(uint64_t refused, uint64_t updates);

#define WM_FINDING_ABOUT_MAX 48
#define WM_FINDING_FIX_MAX 320
typedef struct wm_finding {
  wm_finding_id id;
  wm_severity severity;
  double size;                       // the share, ratio or number that was compared with a limit; NaN: none
  char about[WM_FINDING_ABOUT_MAX];  // "calibration", a source's name
  char text[WM_ERROR_TEXT_MAX];      // what was observed, with figures
  char fix[WM_FINDING_FIX_MAX];      // "": no action needed
} wm_finding;

#define WM_FINDINGS_MAX 64  // further ones are counted and dropped
typedef struct wm_findings {
  wm_finding at[WM_FINDINGS_MAX];
  wm_finding spare;  // takes what is dropped
  size_t count, dropped;
} wm_findings;

// Adds a finding and returns it, for its size. `fix` NULL: that of its kind.
wm_finding *wm_find(wm_findings *out, wm_finding_id id, wm_severity severity, const char *about, const char *fix,
                    const char *format, ...) __attribute__((format(printf, 6, 7)));
// Adds an error; its text has the remedy, too.
void wm_find_error(wm_findings *out, const char *about, const wm_error *err);
// Number of findings of this severity.
size_t wm_findings_of(const wm_findings *self, wm_severity severity);
// Whether there is one of this kind about this thing.
int wm_findings_has(const wm_findings *self, wm_finding_id id, const char *about);
// Moves the findings from place `from` on to the front: causes stand before their consequences.
void wm_findings_to_front(wm_findings *self, size_t from);

// "ABOUT: TEXT; fix: FIX [IDENTIFIER]" without a line's end. Returns its length as snprintf.
int wm_finding_line(const wm_finding *self, char *out, size_t capacity);
// A line each: "SEVERITY ABOUT TEXT; fix: FIX [IDENTIFIER]", then where the identifiers are explained.
void wm_findings_print(const wm_findings *self, FILE *to);
// The list in brackets: id, severity, size, about, text, cause, fix, link.
void wm_findings_json(const wm_findings *self, FILE *to);
// `"key": "text"`, with what JSON needs escaped.
void wm_json_string(FILE *to, const char *key, const char *text);
#define WM_FINDINGS_PAGE "docs/troubleshooting.md"

// Receives a line of text without its end: notes for a person or a log.
typedef void (*wm_line_fn)(void *context, const char *line);

// Findings of a run by its health, less those that `out` has already: late, lost and unreadable data, silent sources,
// devices, refused observations, maps.
void wm_health_findings(const wm_health *health, wm_findings *out);

// Of the first of these bits of motion_health; "" for none.
const char *wm_motion_health_text(uint32_t bits);
// What is wrong with the source behind a doubtful pose: "has biased innovations"; "" for none.
const char *wm_cause_text(unsigned cause);
// Of these, the ones about the map: landmarks that moved, identities that stand for two, capacity.
void wm_health_map_findings(const wm_health *health, wm_findings *out);

// ── for a log ───────────────────────────────────────────────────────────────────────────────────────────────────────

// A finding of the same kind about the same thing is written again after this time at the earliest.
#define WM_SAID_AGAIN_NS (600 * WM_NS_PER_S)
typedef struct wm_said {
  struct {
    wm_finding_id id;
    char about[WM_FINDING_ABOUT_MAX];
    wm_time_ns at_ns;
  } known[WM_FINDINGS_MAX];
  size_t count;
} wm_said;
// Passes on those findings that are due.
void wm_said_take(wm_said *self, const wm_findings *found, wm_time_ns now_ns, wm_line_fn say, void *context);

#endif
