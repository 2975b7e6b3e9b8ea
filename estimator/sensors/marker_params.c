// SPDX-License-Identifier: Apache-2.0
#include "sensors/marker_params.h"

#include "param_rows.h"

typedef struct wm_marker_params params;

static const wm_param kParams[] = {
    F64("sigma_m", sigma_m, 0.002, 1e-5, 10,
        "Sigma of a marker's place, m; the sensor's sigmas, along and across, are added in squares."),
    F64("sigma_rel", sigma_rel, 0, 0, 1, "The same as a part of the distance."),
    F64("bearing_sigma_rad", bearing_sigma_rad, 0.001, 1e-5, 3,
        "Sigma of a marker's direction where the sensor gives none, rad: half a pixel of a camera with a focal length "
        "of 500 pixels."),
    F64("heading_sigma_rad", heading_sigma_rad, 0.02, 1e-5, 3, "Sigma of a marker's heading, rad."),
    F64("heading_most_rad", heading_most_rad, 10, 1e-5, 10,
        "Largest sigma of a marker's heading that is fused, rad. Seen small and nearly face on, a marker's heading is "
        "biased by several degrees for as long as it is seen so."),
    F64("stamp_sigma_s", stamp_sigma_s, 0, 0, 1,
        "Sigma of a picture's stamp as noise of each marker, s; at 1 rad/s it is so many rad across."),
    F64("correlated", correlated, 0, 0, 0.99,
        "The time-correlated part of a marker's sigma along the line of sight and in heading (pixels under its "
        "corners, light, its bend), with the time constant sightings.correlated.tau_s; needs "
        "sightings.correlated.slots. 0: all of it is independent."),
};

const wm_param_table wm_marker_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), NULL};
