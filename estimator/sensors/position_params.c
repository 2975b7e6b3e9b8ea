// SPDX-License-Identifier: Apache-2.0
#include "sensors/position_params.h"

#include "param_rows.h"

typedef struct wm_position_params params;

static const wm_param kParams[] = {
    BOOL("use.position", use_position, 1, "Fuse positions (GNSS)."),
    BOOL("use.heading", use_heading, 1, "Fuse headings."),
    F64("noise.factor", sigma_factor, 0.5, 0.01, 100,
        "Factor of the position's sigma: the share that is new in each position."),
    F64("noise.min_m", sigma_min_m, 0.01, 0, 1000, "Lower limit of a position's sigma, m."),
    F64("states.time_offset_sigma_s", time_offset_sigma_s, 0.5, 0, 1,
        "Start sigma of the receiver's time offset, s: its positions are that much older than their stamps. Receivers "
        "without a pulse a second are late by up to half a second. 0: off."),
    F64("states.antenna_sigma_m", antenna_sigma_m, -0.3, -100, 100,
        "Start sigma of the antenna's place in base_link on each axis, m, about calibration.yaml's "
        "`gnss: {mounting: {xyz_m}}`, or else about base_link. Turns show it. 0: off. Below 0: 0.02 by a tape measure "
        "where the mounting is given, and of that size where it is not."),
    F64("states.heading_bias_sigma_rad", heading_bias_sigma_rad, 0.05, 0, 1,
        "Start sigma of the constant error of headings, rad: a compass' deviation, the mounting of two antennas. 0: "
        "off."),
    F64("correlated.sigma_m", correlated_m, -2, -100, 1000,
        "Sigma of a position's time-correlated error on each axis, m (reflections, atmosphere). 0: none. Below 0: that "
        "multiple of the position's sigma."),
    F64("correlated.tau_s", correlated_tau_s, 20, 0.1, 1e6,
        "Time constant of that error, s. Among houses 10 to 20 s, under an open sky minutes. With 20 and 60 two "
        "recordings have 9.6 and 20.1 m, 0.37 and 0.28 m."),
};

const wm_param_table wm_position_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), NULL};
