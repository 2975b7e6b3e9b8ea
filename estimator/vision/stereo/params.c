// SPDX-License-Identifier: Apache-2.0
#include "vision/stereo/params.h"

#include <stddef.h>

#define F64(key, field, initial, min, max, about) \
  { key, WM_PARAM_F64, offsetof(struct wm_stereo_params, field), initial, min, max, NULL, about }
#define I32(key, field, initial, min, max, about) \
  { key, WM_PARAM_I32, offsetof(struct wm_stereo_params, field), initial, min, max, NULL, about }

static const wm_param kParams[] = {
    I32("tracks", tracks, 100, 8, STEREO_TRACKS_MAX,
        "Points that are followed at the same time. The filter's slam.points should have room for them."),
    I32("cell_px", cell_px, 40, 16, 400,
        "px. Side of the picture's cells: a new point is begun in a cell that has none, so they are spread."),
    I32("confirm_seen", confirm_seen, 2, 1, 100,
        "Pictures in which a point must have moved as the rest does before it is told: suspended particles do not."),
    F64("noise_grey", noise_grey, 2.0, 0.1, 100,
        "Grey levels. Noise of a pixel, compression included; with the patch's contrast it says how well a corner can "
        "be placed."),
    F64("sigma_max_px", sigma_max_px, 0.25, 0.01, 5,
        "px. A corner that can't be placed so well by its contrast is not begun; a match that is worse is none."),
    F64("fit_min", fit_min, 0.5, 0.05, 0.99,
        "Share of a patch's variance that its template must explain, brightness and contrast being free."),
    F64("disparity_min_px", disparity_min_px, 4, 0.5, 2000,
        "px. Nearest that left and right may be; less is too far away to say where it is."),
    F64("disparity_max_px", disparity_max_px, 160, 4, 2000,
        "px. Farthest that left and right may be: focal length times baseline over the smallest distance."),
    F64("row_px", row_px, 1.0, 0.05, 20, "px. Left and right of a point may be so far off the epipolar line."),
    F64("agree_px", agree_px, 1.0, 0.1, 50,
        "px. A point agrees with the motion of the rest, since the picture before and since it began, when its "
        "coordinates "
        "are so near to what that says."),
};

const wm_param_table wm_stereo_params_table = {kParams, sizeof kParams / sizeof kParams[0],
                                               sizeof(struct wm_stereo_params), NULL};
