// SPDX-License-Identifier: Apache-2.0
// The site of a robot: calibration, landmarks with their appearances, map, start. From a recording's folder or from
// single files. Small files are read whole at the opening. Allocates; never on the real-time thread.
#ifndef WAYMARK_SITE_H
#define WAYMARK_SITE_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/setup.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_PATH_MAX 512    // bytes of a path with its terminator
#define WM_SENSORS_MAX 32  // of a calibration, cameras included

// Files in place of the folder's own; "": the folder's.
typedef struct wm_recording_overrides {
  char calibration[WM_PATH_MAX];
  char landmarks[WM_PATH_MAX];
  char dbc[WM_PATH_MAX];
  char can_signals[WM_PATH_MAX];
  char map[WM_PATH_MAX];  // a map.yaml
  // WGS84 of the map's origin: latitude and longitude in degrees, altitude in m. calibration.yaml must have none then,
  // or the same.
  int has_origin;
  double origin[3];
} wm_recording_overrides;

// What a warning is about.
typedef enum wm_note {
  WM_NOTE_FILE,             // something is ignored or unusual
  WM_NOTE_UNUSED,           // data that nothing reads
  WM_NOTE_MISSPELT,         // a name is nearly a known one: a mistake
  WM_NOTE_SENSOR_UNKNOWN,   // calibration.yaml has no such sensor
  WM_NOTE_SENSOR_MISSPELT,  // nor does it, but one of nearly this name
} wm_note;

// `warn` (may be NULL) gets unknown keys and other warnings, one line each.
typedef void (*wm_warn_fn)(void *context, wm_note note, const char *text);

typedef struct wm_site wm_site;

// The folder `dir` with `files` (may be NULL) in place of its own; `dir` NULL: `files` alone.
wm_status wm_site_open(const char *dir, const wm_recording_overrides *files, wm_warn_fn warn, void *context,
                       wm_site **out, wm_error *err);
void wm_site_close(wm_site *self);  // NULL is fine

const wm_wheels *wm_site_wheels(const wm_site *self);
const wm_rig *wm_site_rig(const wm_site *self);      // cameras; an empty one where calibration.yaml has none
const wm_start *wm_site_start(const wm_site *self);  // initial_pose; NaN where unknown
void wm_site_set_start(wm_site *self, const wm_start *start);
const wm_sensor *wm_site_sensors(const wm_site *self, size_t *count);
// Index of the sensor of this name in the file `path`. A sensor that `sensors` of calibration.yaml lacks is added at
// the camera of its name, or at base_link, sigmas unknown: read the sensors afterwards. WM_FULL: no room.
wm_status wm_site_sensor(wm_site *self, const char *path, const char *name, uint16_t *out, wm_error *err);
// The same for the sensor of a camera's detectors.
wm_status wm_site_camera_sensor(wm_site *self, const char *camera, uint16_t *out, wm_error *err);
// Latitude and longitude in degrees and altitude in m of the map's origin; NaN where calibration.yaml has none.
const double *wm_site_gnss_origin(const wm_site *self);
// Mountings of the IMU and of a velocity log; that of base_link where calibration.yaml has none.
const wm_row_mountings *wm_site_row_mountings(const wm_site *self);
const wm_landmark *wm_site_landmarks(const wm_site *self, size_t *count);
// Those of landmarks/appearance.csv beside the landmarks.csv in use, read at the first call and kept as long as the
// site; none without such a file.
wm_status wm_site_appearances(wm_site *self, const wm_appearance **out, size_t *count, wm_error *err);
// Path of the map's YAML: the named file, else map/map.yaml of the folder; "" without either.
const char *wm_site_map_path(const wm_site *self);
// The raster map, read at the first call and kept as long as the site; NULL without one. Errors as of wm_map_load
// (waymark/map.h).
wm_status wm_site_map(wm_site *self, const wm_raster **out, wm_error *err);
// Text of calibration.yaml as read ("" where there is none), for the event log.
const char *wm_site_calibration_text(const wm_site *self, size_t *length);

#ifdef __cplusplus
}
#endif

#endif
