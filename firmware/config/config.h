// SPDX-License-Identifier: Apache-2.0
// A configuration names an estimator and its parameters, or leaves the estimator to sources and maps
// (wm_choose_estimator). Calibration, landmarks, DBC and start pose of a robot or recording come from the recording's
// folder unless the configuration names others. Read once at start.
//
//   format: waymark-config/1
//   estimator: landmark_ekf
//   sources:                       # order here is the order at equal stamps; what isn't listed follows with defaults
//     - {name: sightings, lateness_max_ms: 300}
//     - {name: gnss, until_s: 25}
//   calibration: FILE              # all of these optional, relative to the configuration's folder
//   landmarks: FILE
//   dbc: FILE
//   can_signals: FILE
//   devices: {can: [{interface: can0}]}    # the robot's own, where there is no recording
//   map: FILE                      # a map.yaml
//   site: FOLDER/FLOOR             # landmarks and map are those of this floor; the others are beside it
//   initial_pose: {x_m: 0, y_m: 0, heading_rad: 0, sigma_xy_m: 0.05, sigma_heading_rad: 0.05}
//   merge: {horizon_ms: 300, ...}  # wm_runtime_params
//   publish: {rate_hz: 50, ...}
//   integrity: {alert_limit_m: 0.3, ...}
//   realtime: {priority: 80, ...}
//   start: {saved_pose: FILE, ...}
//   black_box: {folder: FOLDER, ...}
//   motion: {...}                  # wm_motion_params_table
//   sightings: {...}               # wm_sighting_params_table; likewise positions, markers, localizer
//   vision: {edges: {cameras: [front], ...}}   # detectors on pictures, with their tables
//   vision: {cascade: {classes: [{file: FILE, height_m: 0.9}]}}
//   landmark_ekf: {...}            # the estimator's own table
#ifndef WAYMARK_CONFIG_CONFIG_H
#define WAYMARK_CONFIG_CONFIG_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "waymark/detector.h"
#include "waymark/devices.h"
#include "waymark/estimator.h"
#include "waymark/floors.h"
#include "waymark/recording.h"
#include "waymark/source.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_source_config {
  char name[WM_SOURCE_NAME_MAX];  // a source's whole name, or what stands before its ':' ("sightings" is each of them)
  int32_t use;                    // 0: not opened
  double lateness_max_ms;         // older than this on the arrival clock is final (and late)
  int32_t lateness_is_stated;     // 0: it may rise to merge.horizon_ms with the source's data
  double period_ms;               // > 0: no event follows within this time after one
  double ready_after_ms;          // of a detector on recorded pictures: arrival of its observations after the picture's
  int32_t sample_at_next;         // of motion.csv, motion6.csv: a row's values get the stamp of the next row
  double from_s, until_s;         // seconds from the run's first stamp; only data with stamps inside are taken
  int line;
} wm_source_config;

// `merge:`, `publish:`, `integrity:`, `realtime:` and the like. Meanings and limits are in wm_runtime_params_table.
typedef struct wm_runtime_params {
  double merge_horizon_ms;       // largest lateness_max that is allowed
  int32_t merge_queue_events;    // events that may wait in the merge
  double merge_lateness_max_ms;  // default of the sources
  double publish_rate_hz;
  double publish_jump_m, publish_jump_deg;  // map against odom: larger moves are announced as jumps
  double publish_motion_stale_ms;
  int32_t publish_lcm;       // 0: no LCM
  int32_t commands_lcm;      // 0: SET_POSE, SET_FLOOR and RESET are not taken
  double publish_useless_m;  // sigma of position above which a pose is useless
  double integrity_risk_per_pose;
  double integrity_alert_limit_m, integrity_alert_limit_heading_deg;  // 0: none
  double start_max_age_s;                                             // of the saved pose
  double start_moved_m, start_moved_deg;  // sigmas of a motion of the robot while it was off
  double start_save_every_s, start_save_map_every_s;
  double black_box_keep_s, black_box_pictures_hz;
  int32_t realtime_loop_hz;
  int32_t realtime_priority;  // SCHED_FIFO, 0: normal thread
  int32_t realtime_cpu;       // -1: any
  int32_t realtime_lock_memory;
  int32_t realtime_ring_events;  // slots of each source's ring
} wm_runtime_params;
extern const wm_param_table wm_runtime_params_table;

#define WM_CONFIG_WARNINGS_MAX 4096  // bytes
#define WM_VISION_MAX 8              // detectors
#define WM_CONFIG_CASCADES_MAX 8     // classes of a cascade detector

// A detector under `vision:`.
typedef struct wm_vision_config {
  const wm_detector *detector;
  void *params;  // detector->params.bytes bytes
  char cameras[WM_CAMERAS_MAX][WM_NAME_MAX];
  uint32_t camera_count;  // 0: all that have pictures
  wm_cascade cascades[WM_CONFIG_CASCADES_MAX];
  uint32_t cascade_count;
  int line;
} wm_vision_config;

// A section that estimators share, and the offset in wm_config of the pointer to its struct.
typedef struct wm_shared_section {
  const char *name, *prefix, *about;  // "motion", "motion."
  const wm_param_table *table;
  size_t offset;
} wm_shared_section;

enum {
  WM_CONFIG_MOTION = 0,
  WM_CONFIG_SIGHTINGS,
  WM_CONFIG_POSITIONS,
  WM_CONFIG_MARKERS,
  WM_CONFIG_LOCALIZER,
  WM_CONFIG_SHARED
};
extern const wm_shared_section wm_config_shared[WM_CONFIG_SHARED];

typedef struct wm_config {
  char path[WM_PATH_MAX];
  char *text;  // the file as read, for the event log
  size_t text_length;
  const wm_estimator *estimator;  // NULL until wm_config_decide, where the file names none
  void *estimator_params;         // estimator->params.bytes bytes
  char estimator_because[160];    // why the program chose it; "": the file names it
  size_t stated_length;           // of the text, without the estimator that wm_config_decide has added
  wm_motion_params *motion;
  wm_sighting_params *sightings;
  wm_position_params *positions;
  wm_marker_params *markers;
  wm_localizer_params *localizer;
  wm_runtime_params runtime;
  int32_t lateness_is_stated;  // merge.lateness_max_ms
  wm_recording_overrides overrides;
  wm_chosen_floor floor;  // of `site`; without a name: none. Its site is the configuration's
  wm_vision_config vision[WM_VISION_MAX];
  size_t vision_count;
  wm_devices_config devices;
  int has_initial_pose;
  wm_start initial_pose;
  wm_source_config sources[WM_SOURCES_MAX];
  size_t source_count;
  char lcm_url[128];                 // publish.lcm_url; "" : LCM_DEFAULT_URL or LCM's own default
  char saved_pose[WM_PATH_MAX];      // start.saved_pose; "": none
  char saved_map[WM_PATH_MAX];       // start.saved_map; "": none
  char black_box[WM_PATH_MAX];       // black_box.folder; "": none
  char commands[WM_PATH_MAX];        // commands.socket; "": none
  char picture_socket[WM_PATH_MAX];  // publish.picture_socket; "": none
  char channel_prefix[48];           // publish.channel_prefix, "WAYMARK_"
  // Renamed or removed keys, and keys that the estimator does not take: a line each, "FILE:LINE: KEY: what to do", with
  // its line feed; "": none.
  char warnings[WM_CONFIG_WARNINGS_MAX];
} wm_config;

// Each mistake is reported with file, line, key, value and what is allowed ("did you mean"). Allocates.
wm_status wm_config_load(const char *path, wm_config *out, wm_error *err);
wm_status wm_config_parse(const char *text, size_t length, const char *path, wm_config *out, wm_error *err);
// As wm_config_load and wm_config_parse; `estimator:` may be left out, and is to be decided before anything runs.
wm_status wm_config_load_undecided(const char *path, wm_config *out, wm_error *err);
wm_status wm_config_parse_undecided(const char *text, size_t length, const char *path, wm_config *out, wm_error *err);
// Takes an estimator for a file that names none, and reads its parameters. The text, which goes into event logs, names
// it from then on. `because` is kept. Files and start that others have set since stay. May be called again.
wm_status wm_config_decide(wm_config *config, const wm_estimator *estimator, const char *because, wm_error *err);
// As wm_config_parse, for the text in an event log: the files that it names needn't be on this computer.
wm_status wm_config_parse_logged(const char *text, size_t length, const char *path, wm_config *out, wm_error *err);
void wm_config_free(wm_config *config);
// The struct of shared section `i`.
void *wm_config_params(const wm_config *config, int i);
// The setup's parameters are those of the configuration, which must live as long.
void wm_config_give_params(const wm_config *config, wm_setup *setup);
// Calls `say` with each line of config->warnings, without its line feed.
void wm_config_each_warning(const wm_config *config, void (*say)(void *context, const char *line), void *context);
// The settings of the source `name` ("sightings:laser" takes those of "sightings"), and its rank in the config's order.
void wm_config_source(const wm_config *config, const char *name, wm_source_config *out, int *rank);
// Every key with its range, default, unit and meaning as markdown, from the tables that read them.
void wm_config_reference(FILE *to);
// The same as a JSON schema.
void wm_config_schema(FILE *to);

#ifdef __cplusplus
}
#endif

#endif
