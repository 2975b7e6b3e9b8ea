// SPDX-License-Identifier: Apache-2.0
#include "vision/markers/params.h"

#include <stddef.h>

static const wm_param kParams[] = {
    {"size_m", WM_PARAM_F64, offsetof(struct wm_mr_params, size_m), 0, 0, 10, NULL,
     "m. Largest width of the black pentagon. 0: markers.size_m of calibration.yaml, whose markers.family is mr then."},
    {"id_max", WM_PARAM_I32, offsetof(struct wm_mr_params, id_max), 4095, 0, 65535, NULL,
     "Largest accepted identity. Fewer identities make false detections rarer."},
    {"id_offset", WM_PARAM_I32, offsetof(struct wm_mr_params, id_offset), 0, 0, 1000000000, NULL,
     "Added to each identity, so that markers of different families have different ids."},
};

static const wm_param_old kOld[] = {
    {"contrast_min", NULL, "a constant now: 20 grey levels"},
    {NULL, NULL, NULL},
};

const wm_param_table wm_mr_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(struct wm_mr_params),
                                           kOld};
