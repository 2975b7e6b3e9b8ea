// SPDX-License-Identifier: Apache-2.0
// A recording (format waymark-recording/1): a folder with what a robot's sensors said. Opening reads the small files
// (recording.yaml, calibration.yaml, landmarks.csv, can-signals.yaml, vehicle.dbc) whole; the streams are read as they
// are asked for. Allocates; never on the real-time thread. truth.csv is never opened here.
#ifndef WAYMARK_RECORDING_H
#define WAYMARK_RECORDING_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/can.h"
#include "waymark/frame_source.h"
#include "waymark/setup.h"
#include "waymark/source.h"
#include "waymark/status.h"
#include "waymark/yaml.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_PATH_MAX 512
#define WM_SENSORS_MAX 32

// Files to take instead of the recording's own; "" where the recording's own is meant.
typedef struct wm_recording_overrides {
  char calibration[WM_PATH_MAX];
  char landmarks[WM_PATH_MAX];
  char dbc[WM_PATH_MAX];
  char can_signals[WM_PATH_MAX];
  char map[WM_PATH_MAX];  // a map.yaml
} wm_recording_overrides;

typedef struct wm_recording wm_recording;

// Unknown keys and other oddities that don't stop are handed to `warn` (may be NULL), one line each.
typedef void (*wm_warn_fn)(void *context, const char *text);

// A robot instead of a recording: calibration and landmarks as the overrides name them, no streams. Its sources are
// devices, added before they are asked for.
wm_status wm_recording_open_robot(const char *name, const wm_recording_overrides *overrides, wm_warn_fn warn,
                                  void *context, wm_recording **out, wm_error *err);
// Takes the source over, also where it fails (WM_FULL). `quantities`: bit per wm_quantity that it can give.
wm_status wm_recording_add_device(wm_recording *self, wm_source *device, uint32_t quantities, wm_error *err);

// Its cameras, if they aren't the videos of its folder; taken over, and closed with it.
void wm_recording_set_pictures(wm_recording *self, wm_pictures *pictures);
wm_pictures *wm_recording_pictures(const wm_recording *self);  // NULL: the folder's videos

wm_status wm_recording_open(const char *dir, const wm_recording_overrides *overrides, wm_warn_fn warn, void *context,
                            wm_recording **out, wm_error *err);
void wm_recording_close(wm_recording *self);

const char *wm_recording_name(const wm_recording *self);
const char *wm_recording_dir(const wm_recording *self);
double wm_recording_duration_s(const wm_recording *self);  // NaN where not given
const wm_wheels *wm_recording_wheels(const wm_recording *self);
const wm_sensor *wm_recording_sensors(const wm_recording *self, size_t *count);
// Index of the sensor that the camera's detectors speak for. One that `sensors` of calibration.yaml doesn't have is
// added where the camera sits, sigmas unknown: ask for the sensors afterwards. WM_FULL: no room.
wm_status wm_recording_camera_sensor(wm_recording *self, const char *camera, uint16_t *out, wm_error *err);
const wm_landmark *wm_recording_landmarks(const wm_recording *self, size_t *count);
const wm_rig *wm_recording_rig(const wm_recording *self);      // cameras; an empty one where calibration.yaml has none
const wm_start *wm_recording_start(const wm_recording *self);  // initial_pose; NaN where unknown
// Path of the map's YAML: the override, else map/map.yaml of the folder; "" where neither is there.
const char *wm_recording_map_path(const wm_recording *self);
// The raster map, read when first asked for and kept as long as the recording; NULL where there is none. Errors as
// wm_map_load (waymark/map.h).
wm_status wm_recording_map(wm_recording *self, const wm_raster **out, wm_error *err);
uint32_t wm_recording_quantities(const wm_recording *self);  // bit per wm_quantity that the CAN binding gives
// Text of calibration.yaml as read ("" where there is none), for the event log.
const char *wm_recording_calibration_text(const wm_recording *self, size_t *length);

// `initial_pose` of recording.yaml and of a configuration: t_ns, x_m, y_m, z_m, heading_rad or heading_deg, qx, qy, qz,
// qw, sigma_xy_m, sigma_heading_rad or _deg; what is absent is unknown. Unknown keys are the caller's to check, by
// wm_start_keys (NULL-terminated). With a quaternion alone, heading_rad is that of the quaternion.
extern const char *const wm_start_keys[];
void wm_start_init(wm_start *out);
wm_status wm_start_read(const wm_yaml_node *map, wm_start *out, wm_error *err);

// A decoder from a DBC file and a can-signals.yaml. Allocates.
wm_status wm_can_decoder_load(const char *dbc_path, const char *signals_path, wm_can_decoder **out, wm_error *err);

// landmarks.csv alone; the caller frees *out. An empty z_m is 0, with a warning; an empty sigma_m or yaw_rad is NaN.
// Columns cov_xx, cov_xy, cov_yy and cov_tt, as a run writes them, are optional. A duplicate id and a row that can't be
// read are errors.
wm_status wm_landmarks_load(const char *path, wm_warn_fn warn, void *context, wm_landmark **out, size_t *count,
                            wm_error *err);

// How landmarks look, from an appearance.csv: `id,picture,width_m,height_m,yaw_rad`, a row a picture (PNG or PGM beside
// it); a landmark may have several. *out is the caller's to free by wm_appearances_free. WM_BAD_CONFIG, WM_NOT_FOUND,
// WM_BAD_DATA with file and line.
wm_status wm_appearances_load(const char *path, wm_warn_fn warn, void *context, wm_appearance **out, size_t *count,
                              wm_error *err);
void wm_appearances_free(wm_appearance *list, size_t count);
// Those of landmarks/appearance.csv beside the landmarks.csv in use, read when first asked for and kept as long as the
// recording; none where there is no such file.
wm_status wm_recording_appearances(wm_recording *self, const wm_appearance **out, size_t *count, wm_error *err);

// The recording's sources, in the order of the format's table of files: can, motion, motion6, increments, then a source
// a sensor for sightings ("sightings:NAME"), markers ("markers:NAME") and their corners ("corners:NAME"), then stereo,
// points, gnss. Indices are 0, 1, 2
// ... in this order. Owned by the recording. Each hands out its events in the order of their arrival: a row that is
// older than the one above it arrived with that one; it is counted as out of order and handed out. A single stamp far
// ahead of the rows around it is counted (not_finite) and skipped.
wm_source *const *wm_recording_sources(wm_recording *self, size_t *count);

#ifdef __cplusplus
}
#endif

#endif
