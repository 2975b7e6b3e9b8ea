// SPDX-License-Identifier: Apache-2.0
#include "vision/cascade/params.h"

#include <stddef.h>

#define F64(key, field, initial, min, max, about) \
  { key, WM_PARAM_F64, offsetof(struct wm_cascade_params, field), initial, min, max, NULL, about }

static const wm_param kParams[] = {
    F64("size_min_px", size_min_px, 10, 4, 200,
        "px. Height of the smallest windows, in the middle of the picture; the largest ones are eight times as high."),
};

static const wm_param_old kOld[] = {
    {"sigma_px", NULL, "a constant now: 0.3 px"},
    {"sigma_size", NULL, "a constant now: 0.05 of the window's size"},
    {"neighbours_min", NULL, "a constant now: 3 windows"},
    {"sigma_range", NULL, "a constant now: 0.2 of the distance"},
    {"mounting_sigma_rad", NULL, "a constant now: 0.007 rad"},
    {NULL, NULL, NULL},
};

const wm_param_table wm_cascade_params_table = {kParams, sizeof kParams / sizeof kParams[0],
                                                sizeof(struct wm_cascade_params), kOld};
