// SPDX-License-Identifier: Apache-2.0
#include "vision/landmarks/params.h"

#include <stddef.h>

#define F64(key, field, initial, min, max, about) \
  { key, WM_PARAM_F64, offsetof(struct wm_landmarks_params, field), initial, min, max, NULL, about }

static const wm_param kParams[] = {
    F64("range_max_m", range_max_m, 40, 1, 1000, "m. Landmarks farther away are not searched."),
    F64("mounting_sigma_rad", mounting_sigma_rad, 0.007, 0, 0.1,
        "rad. Error of the camera's mounting, each axis; widens the search window."),
    F64("likeness_min", likeness_min, 0.7, 0.3, 1,
        "Smallest normalised correlation of picture and appearance; small landmarks need more."),
    F64("search_places", search_places, 250000, 0, 1e8,
        "Places compared per picture while no pose predicts the landmarks, some 20 ns each, at 30 pictures a second; "
        "at lower rates up to 8 times as many. 0: no search without a pose."),
    F64("search_area_px2", search_area_px2, 140, 0, 1e6,
        "px^2. Smallest area of a landmark in the picture without a pose: a smaller one has look-alikes near by."),
    F64("likeness_alone", likeness_alone, 0.93, 0.3, 1,
        "Normalised correlation from which a landmark found without a pose needs no others; below, two others must "
        "agree with its pose."),
    F64("likeness_far", likeness_far, 0.88, 0.3, 1,
        "Normalised correlation needed where the window reaches 32 px and more from the expected place; likeness_min "
        "is for 8 px and less."),
    F64("sigma_px", sigma_px, 0.05, 0, 10,
        "px. Error of a landmark's middle beside that of its fit: compression, the camera's response."),
};

static const wm_param_old kOld[] = {
    {"window_sigmas", NULL, "a constant now: 3.5"},
    {"window_max_px", NULL, "a constant now: 64 px"},
    {"apart_min", NULL, "a constant now: 0.06"},
    {"sigma_size", NULL, "a constant now: 0.002 of the size"},
    {"sigma_factor", NULL, "a constant now: 1.3"},
    {"facing_min", NULL, "a constant now: a cosine of 0.17"},
    {"contrast_grey", NULL, "a constant now: 4 grey levels"},
    {"search_after_s", NULL, "a constant now: 0.5 s"},
    {"blur_px", NULL, "a constant now: 0.6 px"},
    {"size_min_px", NULL, "a constant now: 7 px"},
    {NULL, NULL, NULL},
};

const wm_param_table wm_landmarks_params_table = {kParams, sizeof kParams / sizeof kParams[0],
                                                  sizeof(struct wm_landmarks_params), kOld};
