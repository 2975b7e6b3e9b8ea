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
#include "waymark/site.h"
#include "waymark/source.h"
#include "waymark/status.h"
#include "waymark/yaml.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_recording wm_recording;

// No folder, but a site, which is taken over, also where it fails, and sources that are added: a robot.
wm_status wm_recording_of_site(const char *name, wm_site *site, wm_recording **out, wm_error *err);
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
double wm_recording_duration_s(const wm_recording *self);    // NaN where not given
wm_site *wm_recording_site(const wm_recording *self);        // what is known of its place
uint32_t wm_recording_quantities(const wm_recording *self);  // bit per wm_quantity that the CAN binding gives

// `initial_pose` of recording.yaml and of a configuration: t_ns, x_m, y_m, z_m, heading_rad or heading_deg, qx, qy, qz,
// qw, sigma_xy_m, sigma_heading_rad or _deg; what is absent is unknown. Unknown keys are the caller's to check, by
// wm_start_keys (NULL-terminated). With a quaternion alone, heading_rad is that of the quaternion.
extern const char *const wm_start_keys[];
void wm_start_init(wm_start *out);
wm_status wm_start_read(const wm_yaml_node *map, wm_start *out, wm_error *err);

// A decoder from a DBC file and one part of a can-signals.yaml; NULL where nothing of that part is bound. Allocates.
wm_status wm_can_decoder_load(const char *dbc_path, const char *signals_path, wm_can_part part, wm_can_decoder **out,
                              wm_error *err);

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
