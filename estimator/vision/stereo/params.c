// SPDX-License-Identifier: Apache-2.0
#include "vision/stereo/params.h"

#include <stddef.h>

#define F64(key, field, initial, min, max, about) \
  { key, WM_PARAM_F64, offsetof(struct wm_stereo_params, field), initial, min, max, NULL, about }
#define I32(key, field, initial, min, max, about) \
  { key, WM_PARAM_I32, offsetof(struct wm_stereo_params, field), initial, min, max, NULL, about }

static const wm_param kParams[] = {
    I32("tracks", tracks, 100, 8, STEREO_TRACKS_MAX,
        "Points tracked at the same time. The filter's slam.points should have room for them."),
    F64("noise_grey", noise_grey, 2.0, 0.1, 100,
        "Grey levels. Noise of a pixel, compression included; with a patch's contrast it gives a corner's error."),
    F64("disparity_min_px", disparity_min_px, 4, 0.5, 2000,
        "px. Smallest disparity: farther points have no useful range."),
    F64("disparity_max_px", disparity_max_px, 160, 4, 2000,
        "px. Largest disparity: focal length times baseline over the smallest distance."),
};

static const wm_param_old kOld[] = {
    {"cell_px", NULL, "a constant now: 40 px"},
    {"sigma_max_px", NULL, "a constant now: 0.25 px"},
    {"fit_min", NULL, "a constant now: 0.5"},
    {"agree_px", NULL, "a constant now: 1 px"},
    {"confirm_seen", NULL, "a constant now: 2 pictures"},
    {"row_px", NULL, "a constant now: 1 px"},
    {NULL, NULL, NULL},
};

const wm_param_table wm_stereo_params_table = {kParams, sizeof kParams / sizeof kParams[0],
                                               sizeof(struct wm_stereo_params), kOld};
