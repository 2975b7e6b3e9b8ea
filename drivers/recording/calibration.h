// SPDX-License-Identifier: Apache-2.0
// The files that are read whole when a recording is opened: calibration.yaml, landmarks.csv, initial_pose and
// can-signals.yaml.
#ifndef WM_RECORDING_CALIBRATION_H
#define WM_RECORDING_CALIBRATION_H

#include "waymark/recording.h"
#include "waymark/yaml.h"

typedef struct warner {
  wm_warn_fn fn;
  void *context;
} warner;

// One line to the caller's `warn`, printf-like; nothing without one.
void warn_line(const warner *warn, wm_note note, const char *format, ...) __attribute__((format(printf, 3, 4)));

typedef struct calibration {
  wm_wheels wheels;
  wm_rig rig;
  wm_sensor sensors[WM_SENSORS_MAX];
  size_t sensor_count;
  double gnss_origin[3];  // latitude and longitude in degrees, altitude in m; NaN: unknown
  wm_row_mountings mountings;
} calibration;

// An empty calibration: no wheels, no sensors.
void calibration_init(calibration *self);
// Reads and checks all of it.
wm_status calibration_read(const wm_yaml *doc, const warner *warn, calibration *out, wm_error *err);

// Checks the keys: near misses are errors, other unknown keys a warning.
wm_status calibration_keys(const wm_yaml_node *map, const char *const *known, const warner *warn, wm_error *err);
// Mounting of the camera of this name, or NULL.
const wm_mounting *calibration_camera_mounting(const calibration *self, const char *name);
// Reads `mounting` of `parent` (xyz_m, rpy_deg or rpy_rad; absent numbers are 0). Without it: `otherwise`, or base_link
// with a warning where that is NULL.
wm_status calibration_mounting(const wm_yaml_node *parent, const wm_mounting *otherwise, const warner *warn,
                               wm_mounting *out, wm_error *err);
// One camera: model, size, intrinsics, distortion, readout, mounting.
wm_status calibration_camera(const wm_yaml_node *node, const warner *warn, wm_camera *out, wm_error *err);
// Reads NAME_rad or NAME_deg of `map`, limits in radians; *out is unchanged without either. Both together are an error.
wm_status calibration_angle(const wm_yaml_node *map, const char *name, double min_rad, double max_rad, double *out_rad,
                            wm_error *err);

// landmarks.csv; the caller frees *out.
wm_status landmarks_read(const char *path, const warner *warn, wm_landmark **out, size_t *count, wm_error *err);
// can-signals.yaml; the caller frees *out.
wm_status can_signals_read(const char *path, wm_can_binding **out, size_t *count, wm_error *err);

#endif
