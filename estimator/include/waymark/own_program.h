// SPDX-License-Identifier: Apache-2.0
// For programs that use an estimator as a library, without configuration files: parameters by their keys, and
// setups whose fields are all unknown until they are filled in.
#ifndef WAYMARK_OWN_PROGRAM_H
#define WAYMARK_OWN_PROGRAM_H

#include "waymark/estimator.h"

#ifdef __cplusplus
extern "C" {
#endif

// Sets the parameter `key` of a struct of this table ("states.sensor_yaw_sigma_rad"); of WM_PARAM_BOOL 0 or 1, of
// WM_PARAM_ENUM the index. NULL, or why not, a constant string: the key is unknown, the value is out of its range or
// not a whole number. `params` is unchanged then.
const char *wm_params_set(const wm_param_table *table, void *params, const char *key, double value);
// The same for a WM_PARAM_ENUM by its name.
const char *wm_params_set_name(const wm_param_table *table, void *params, const char *key, const char *name);

// All fields unknown: NaN, no steering table, largest range infinite, mounting at base_link, no stamp.
void wm_wheels_init(wm_wheels *out);
void wm_sensor_init(wm_sensor *out, const char *name);  // a longer name is cut
void wm_landmark_init(wm_landmark *out, int32_t id);
// Wheels and start unknown (sigmas of the start 0.05 m and rad), no sensors, landmarks, rig and map; seed 1. `motion`
// and `sightings` stay NULL: they are the caller's, filled by wm_params_defaults.
void wm_setup_init(wm_setup *out);

#ifdef __cplusplus
}
#endif

#endif
