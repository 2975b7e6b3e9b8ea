// SPDX-License-Identifier: Apache-2.0
#include "vision/cascade/params.h"

#include <stddef.h>

#define F64(key, field, initial, min, max, about) \
  { key, WM_PARAM_F64, offsetof(struct wm_cascade_params, field), initial, min, max, NULL, about }

static const wm_param kParams[] = {
    F64("size_min_px", size_min_px, 10, 4, 200,
        "px. Height in the middle of the picture of the smallest windows that are looked at; the largest are eight "
        "times as high."),
    {"neighbours_min", WM_PARAM_I32, offsetof(struct wm_cascade_params, neighbours_min), 3, 1, 1000, NULL,
     "So many windows about a place must show the thing (OpenCV's minNeighbors)."},
    F64("mounting_sigma_rad", mounting_sigma_rad, 0.007, 0, 0.1,
        "rad. How far the camera may be turned against calibration.yaml: landmarks are looked for between the lowest "
        "and the highest of the map, and so much beside."),
    F64("sigma_px", sigma_px, 0.3, 0, 10, "px. Error of a thing's middle, whatever its size."),
    F64("sigma_size", sigma_size, 0.05, 0, 1,
        "Share of the window's width by which the thing's middle is off: windows are a coarse measure."),
    F64("sigma_range", sigma_range, 0.2, 0.001, 10,
        "Share of the distance by which it is off: it follows from the window's height."),
};

const wm_param_table wm_cascade_params_table = {kParams, sizeof kParams / sizeof kParams[0],
                                                sizeof(struct wm_cascade_params), NULL};
