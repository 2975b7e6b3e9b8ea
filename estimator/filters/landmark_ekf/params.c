// SPDX-License-Identifier: Apache-2.0
#include "filters/landmark_ekf/params.h"

#include "param_rows.h"
#include "sensors/position_params.h"

typedef struct wm_landmark_ekf_params params;

static const wm_param kParams[] = {
    F64("dead_reckoning_after_s", dead_reckoning_after_s, 2, 0, 3600,
        "Time without a fused observation after which the state is dead reckoning, s."),
    BOOL("recover.on", recover, 1, "Relocalize when the observations show that the pose is wrong."),
    F64("recover.window_s", recover_window_s, 20, 1, 600,
        "Age up to which observations are used for relocalization, s; odometry relates them."),
    F64("recover.sigma_xy_m", recover_sigma_xy_m, -3, -100, 100,
        "Largest sigma with which a found pose is accepted, m. Below 0: that multiple of the least sigma of the "
        "positions and ranges that it is found by, and 1 m where there are only bearings."),
    F64("recover.sigma_heading_rad", recover_sigma_heading_rad, 0.4, 0.001, 3,
        "The same for the heading, rad. 0.25 finds a car by GNSS after 10 s instead of 6."),
};

static const wm_param_old kOld[] = {
    POSITION_KEYS_OF_OLD,
    {"markers.*", "/markers.*", NULL},
    {"gate.associate_unknown", "/sightings.use.unidentified", NULL},
    {"states.*", "/motion.states.*", NULL},
    {"states.*", "/sightings.states.*", NULL},
    {"use.*", "/sightings.use.*", NULL},
    {"noise.*", "/sightings.noise.*", NULL},
    {"lasting.*", "/sightings.correlated.*", NULL},
    {"gate.*", "/sightings.gate.*", NULL},
    {NULL, NULL, NULL},
};

const wm_param_table wm_landmark_ekf_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), kOld};
