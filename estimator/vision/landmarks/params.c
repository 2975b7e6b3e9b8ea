// SPDX-License-Identifier: Apache-2.0
#include "vision/landmarks/params.h"

#include <stddef.h>

#define F64(key, field, initial, min, max, about) \
  { key, WM_PARAM_F64, offsetof(struct wm_landmarks_params, field), initial, min, max, NULL, about }

static const wm_param kParams[] = {
    F64("range_max_m", range_max_m, 40, 1, 1000, "m. Landmarks farther away are not looked for."),
    F64("size_min_px", size_min_px, 7, 4, 100,
        "px. Shorter side that a landmark must have in the picture: smaller ones look like anything."),
    F64("facing_min", facing_min, 0.17, 0, 1,
        "Cosine of the angle between line of sight and the landmark's normal: more slanted ones are not looked for."),
    F64("mounting_sigma_rad", mounting_sigma_rad, 0.007, 0, 0.1,
        "rad. How far the camera may be turned against calibration.yaml, each axis; widens the window that is "
        "searched."),
    F64("window_sigmas", window_sigmas, 3.5, 1, 10, "The window's half width, in sigmas of the expected place."),
    F64("window_max_px", window_max_px, 64, 4, 400,
        "px. A landmark whose place is less sure than this is not looked for in a window."),
    F64("likeness_min", likeness_min, 0.7, 0.3, 1,
        "Normalised correlation of picture and appearance from which on they are one; small ones need more."),
    F64("apart_min", apart_min, 0.06, 0, 1,
        "By how much the best place in the window must be more like the landmark than any other."),
    F64("contrast_grey", contrast_grey, 4, 1, 255,
        "Grey levels. Standard deviation that a landmark's place in the picture must have."),
    F64("search_places", search_places, 250000, 0, 1e8,
        "How many places a picture are compared with landmarks, some 20 ns each, while there is no pose that says "
        "where they are, at 30 pictures a second; at fewer, up to 8 times as many. 0: nothing is searched without a "
        "pose."),
    F64("search_area_px2", search_area_px2, 140, 0, 1e6,
        "px^2. Area that a landmark must have in the picture while there is no pose: of a smaller one there is another "
        "thing near by that looks as much like it."),
    F64("search_after_s", search_after_s, 0.5, 0, 3600,
        "s. The pose led to no landmark for so long: they are searched everywhere, too."),
    F64("likeness_alone", likeness_alone, 0.93, 0.3, 1,
        "Normalised correlation from which on a landmark is believed that was found without a pose; less alike ones "
        "must "
        "agree with two others."),
    F64("likeness_far", likeness_far, 0.88, 0.3, 1,
        "Normalised correlation that a landmark needs where the window reaches 32 px and more from where it is "
        "expected; "
        "likeness_min is for 8 px and less."),
    F64("blur_px", blur_px, 0.6, 0, 5, "px. Width (sigma) of a point in the picture: lens and compression."),
    F64("sigma_px", sigma_px, 0.05, 0, 10,
        "px. Error of a landmark's middle that the rest of its fit doesn't show: compression, the camera's response."),
    F64("sigma_size", sigma_size, 0.002, 0, 1,
        "Share of the landmark's size in the picture by which its middle may be off: how well it was learnt, and "
        "light that falls on it otherwise."),
    F64("sigma_factor", sigma_factor, 1.3, 0.1, 10,
        "The fit's own sigma is taken so many times: neighbouring pixels err alike."),
};

const wm_param_table wm_landmarks_params_table = {kParams, sizeof kParams / sizeof kParams[0],
                                                  sizeof(struct wm_landmarks_params), NULL};
