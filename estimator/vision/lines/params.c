// SPDX-License-Identifier: Apache-2.0
#include "vision/lines/params.h"

#include <stddef.h>

#define F64(key, field, initial, min, max, about) \
  { key, WM_PARAM_F64, offsetof(struct wm_lines_params, field), initial, min, max, NULL, about }

static const wm_param kParams[] = {
    F64("elevation_min_rad", elevation_min_rad, -0.12, -1.5, 1.5,
        "rad above the camera's horizon. Lower parts of the picture are not searched."),
    F64("elevation_max_rad", elevation_max_rad, 1.1, -1.5, 1.5,
        "rad above the camera's horizon. Higher parts are not searched: there a pixel is a wide angle, and lamps "
        "resemble lines."),
    F64("contrast_grey", contrast_grey, 6, 1, 255, "Grey levels. Smallest difference of a line's two sides."),
    F64("sigma_px", sigma_px, 0.12, 0, 10,
        "px. Error of a line beside that of its fit: compression, the camera's response, the lens model."),
    F64("tilt_sigma_rad", tilt_sigma_rad, 0.01, 0, 0.1,
        "rad. Error of the mounting's roll and pitch, which is estimated from the lean of upright lines. 0: the "
        "mounting is exact."),
};

static const wm_param_old kOld[] = {
    {"row_step_rad", NULL, "a constant now: 0.01 rad"},
    {"gate_rad", NULL, "a constant now: 0.02 rad"},
    {"appearance_grey", NULL, "a constant now: 20 grey levels"},
    {"keep_unseen", NULL, "a constant now: 10 pictures"},
    {"length_min_rad", NULL, "a constant now: 0.09 rad"},
    {"begin_max_rad", NULL, "a constant now: 0.3 rad"},
    {"blur_px", NULL, "a constant now: 0.75 px"},
    {"turn_max_rad", NULL, "a constant now: 0.3 rad"},
    {"confirm_seen", NULL, "a constant now: 3 pictures"},
    {NULL, NULL, NULL},
};

const wm_param_table wm_lines_params_table = {kParams, sizeof kParams / sizeof kParams[0],
                                              sizeof(struct wm_lines_params), kOld};
