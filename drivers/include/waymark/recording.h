// SPDX-License-Identifier: Apache-2.0
// A recording (format waymark-recording/1): a folder with a robot's sensor data. Opening reads the small files
// (recording.yaml, calibration.yaml, landmarks.csv, can-signals.yaml, vehicle.dbc) whole; the streams are read on
// demand. Allocates; never on the real-time thread. truth.csv is never opened here.
#ifndef WAYMARK_RECORDING_H
#define WAYMARK_RECORDING_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/can.h"
#include "waymark/frame_source.h"
#include "waymark/setup.h"
#include "waymark/site.h"
#include "waymark/source.h"
#include "waymark/status.h"
#include "waymark/yaml.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_recording wm_recording;

// A robot: a site instead of a folder, and added sources. Takes ownership of the site, also on failure.
wm_status wm_recording_of_site(const char *name, wm_site *site, wm_recording **out, wm_error *err);
// Takes ownership of the source, also on failure (WM_FULL). `quantities`: bit per wm_quantity that it can give.
wm_status wm_recording_add_device(wm_recording *self, wm_source *device, uint32_t quantities, wm_error *err);

// Sets its cameras instead of its folder's videos; takes ownership.
void wm_recording_set_pictures(wm_recording *self, wm_pictures *pictures);
wm_pictures *wm_recording_pictures(const wm_recording *self);  // NULL: the folder's videos

wm_status wm_recording_open(const char *dir, const wm_recording_overrides *overrides, wm_warn_fn warn, void *context,
                            wm_recording **out, wm_error *err);
void wm_recording_close(wm_recording *self);

const char *wm_recording_name(const wm_recording *self);
const char *wm_recording_dir(const wm_recording *self);
double wm_recording_duration_s(const wm_recording *self);    // NaN where not given
wm_site *wm_recording_site(const wm_recording *self);        // calibration, landmarks, map, start
uint32_t wm_recording_quantities(const wm_recording *self);  // bit per wm_quantity that the CAN binding gives

// `initial_pose` of recording.yaml and of a configuration: t_ns, x_m, y_m, z_m, heading_rad or heading_deg, qx, qy, qz,
// qw, sigma_xy_m, sigma_heading_rad or _deg; absent values are unknown. The caller checks for unknown keys by
// wm_start_keys (NULL-terminated). With a quaternion alone, heading_rad is the quaternion's.
extern const char *const wm_start_keys[];
void wm_start_init(wm_start *out);
wm_status wm_start_read(const wm_yaml_node *map, wm_start *out, wm_error *err);

// A decoder from a DBC file and one part of a can-signals.yaml; NULL without bindings of that part. Allocates.
wm_status wm_can_decoder_load(const char *dbc_path, const char *signals_path, wm_can_part part, wm_can_decoder **out,
                              wm_error *err);

// landmarks.csv alone; the caller frees *out. An empty z_m is 0, with a warning; an empty sigma_m or yaw_rad is NaN.
// Columns cov_xx, cov_xy, cov_yy and cov_tt, as in a run's map, are optional. Duplicate ids and unreadable rows are
// errors.
wm_status wm_landmarks_load(const char *path, wm_warn_fn warn, void *context, wm_landmark **out, size_t *count,
                            wm_error *err);

// Appearances of landmarks from an appearance.csv: `id,picture,width_m,height_m,yaw_rad`, a row for each picture (PNG
// or PGM beside it); a landmark may have several. The caller frees *out by wm_appearances_free. WM_BAD_CONFIG,
// WM_NOT_FOUND, WM_BAD_DATA with file and line.
wm_status wm_appearances_load(const char *path, wm_warn_fn warn, void *context, wm_appearance **out, size_t *count,
                              wm_error *err);
void wm_appearances_free(wm_appearance *list, size_t count);

// The recording's sources, in the order of the format's table of files: can, motion, motion6, increments, then one for
// each sensor of sightings ("sightings:NAME"), markers ("markers:NAME") and their corners ("corners:NAME"), then
// stereo, points, gnss. Their indices are 0, 1, 2 ... Owned by the recording. Each hands out its events in the order of
// their arrival: a row older than the one above it arrived with that one; it is counted as out of order and handed out.
// A single stamp far ahead of the rows around it is counted (not_finite) and skipped.
wm_source *const *wm_recording_sources(wm_recording *self, size_t *count);

#ifdef __cplusplus
}
#endif

#endif
