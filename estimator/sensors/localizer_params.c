// SPDX-License-Identifier: Apache-2.0
#include "sensors/localizer_params.h"

#include "param_rows.h"

typedef struct wm_localizer_params params;

static const char *const kFrames[] = {"map", "own", NULL};

static const wm_param kParams[] = {
    ENUM("frame", frame, WM_LOCALIZER_IN_MAP, WM_LOCALIZER_IN_OWN_FRAME, kFrames,
         "Frame of another localizer's poses. map: the map's, as of a lidar's localizer; own: it begins anywhere and "
         "drifts, as of a visual odometry, and its place in the map is found from the robot's own pose."),
    F64("sigma_xy_m", sigma_xy_m, 0.1, 1e-5, 1000,
        "Sigma of a pose's place on each axis, m, where it has no covariance; of those in an own frame always, since "
        "their covariance is that of the whole way."),
    F64("sigma_heading_rad", sigma_heading_rad, 0.03, 1e-5, 3, "The same of its heading, rad."),
    F64("lasting", lasting, 2, 0, 100,
        "In the map: sigma of the error that its poses have in common for a while, over the stated sigma. A localizer "
        "is a "
        "filter: its poses are not independent. 0: they are."),
    F64("lasting_s", lasting_s, 10, 0.1, 1e6, "Time constant of that error, s."),
    F64("drift_m", drift_m, 0.03, 0, 10,
        "Sigma by which an own frame drifts on each axis on 1 m of way, m; it grows with the root of the way."),
    F64("drift_heading_rad", drift_heading_rad, 0.003, 0, 1, "The same of its heading, rad."),
};

const wm_param_table wm_localizer_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), NULL};
