// SPDX-License-Identifier: Apache-2.0
#include "vision/lines/params.h"

#include <stddef.h>

#define F64(key, field, initial, min, max, about) \
  { key, WM_PARAM_F64, offsetof(struct wm_lines_params, field), initial, min, max, NULL, about }
#define I32(key, field, initial, min, max, about) \
  { key, WM_PARAM_I32, offsetof(struct wm_lines_params, field), initial, min, max, NULL, about }

static const wm_param kParams[] = {
    F64("elevation_min_rad", elevation_min_rad, -0.12, -1.5, 1.5,
        "rad above the horizon of the camera's place. Lower parts of the picture are not searched."),
    F64("elevation_max_rad", elevation_max_rad, 1.1, -1.5, 1.5,
        "rad above the horizon. Higher parts are not searched: there a pixel is a wide angle, and lamps look like "
        "lines."),
    F64("row_step_rad", row_step_rad, 0.01, 0.001, 0.1, "rad of elevation from row to row of the polar picture."),
    F64("contrast_grey", contrast_grey, 6, 1, 255, "Grey levels. Smallest difference of a line's two sides."),
    F64("length_min_rad", length_min_rad, 0.09, 0.01, 2, "rad of elevation. Shortest line."),
    F64("begin_max_rad", begin_max_rad, 0.3, -1.5, 1.5,
        "rad above the horizon. A line must begin below: what begins higher hangs (lamps, beams)."),
    F64("blur_px", blur_px, 0.75, 0.1, 10, "px. Width (sigma) of the picture's edges: lens, pixel and compression."),
    F64("sigma_px", sigma_px, 0.12, 0, 10,
        "px. Error of a line that noise doesn't explain: compression, the camera's response, the lens model."),
    F64("tilt_sigma_rad", tilt_sigma_rad, 0.01, 0, 0.1,
        "rad. How far the zenith may be from where calibration.yaml's mounting has it: upright lines lean by that, and "
        "tell it. 0: the mounting is right."),
    F64("turn_max_rad", turn_max_rad, 0.3, 0.01, 1.5, "rad. Largest turn of the robot from picture to picture."),
    F64("gate_rad", gate_rad, 0.02, 0.001, 0.5, "rad. How far a tracked line may be from where it was expected."),
    F64("appearance_grey", appearance_grey, 20, 1, 255,
        "Grey levels. Change of a side's brightness from picture to picture that is nothing special."),
    I32("confirm_seen", confirm_seen, 3, 1, 100, "Pictures in which a line was seen before it is published."),
    I32("keep_unseen", keep_unseen, 10, 0, 100, "Pictures in which a line may be missed before its track ends."),
};

const wm_param_table wm_lines_params_table = {kParams, sizeof kParams / sizeof kParams[0],
                                              sizeof(struct wm_lines_params), NULL};
