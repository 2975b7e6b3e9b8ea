// SPDX-License-Identifier: Apache-2.0
#include "filters/pf_edges/params.h"

#include "param_rows.h"

typedef struct wm_pf_edges_params params;

static const char *const kWeights[] = {"product", "sum", NULL};

static const wm_param kParams[] = {
    I32("particles", particles, 200, 10, 20000, "Number of particles."),
    ENUM("weight", weight, PF_EDGES_PRODUCT, 1, kWeights,
         "Likelihood of a scan: the tempered `product` of its points' likelihoods, or their `sum` (Abramov et al.)."),
    F64("exponent", exponent, 0.02, 0.001, 1,
        "Exponent of the product. Errors of neighbouring points, and of the next scans', are correlated: 180 points "
        "count as about 4."),
    F64("sigma_m", sigma_m, 0.05, 0.005, 0.5,
        "Sigma of the likelihood field besides the point's own, m: map, mounting, coarseness of a small set."),
    F64("false_points", false_points, 0.3, 0.0001, 0.9,
        "Fraction of points that are not an edge of the map: furniture, joints of the floor."),
    F64("noise.way_rel", noise_way_rel, 0.0, 0, 2,
        "Motion noise along the way, as a fraction of the step (Abramov et al.: 0.5, steps of 0.5 s)."),
    F64("noise.way", noise_way, 0.02, 0, 1, "Motion noise along the way, m per sqrt(m)."),
    F64("noise.side", noise_side, 0.01, 0, 1, "Motion noise across the way, m per sqrt(m)."),
    F64("noise.turn", noise_turn, 0.01, 0, 1, "Motion noise of the heading, rad per sqrt(m)."),
    F64("range_max_m", range_max_m, 6.0, 0.5, 50, "Points farther from base_link are not used, m."),
    F64("dead_reckoning_after_s", dead_reckoning_after_s, 1.0, 0.05, 3600,
        "The state is dead reckoning when no scan was fused for this time, s."),
};

static const wm_param_old kOld[] = {
    {"resample_below", NULL, "a constant now: half of the particles"},
    {"noise.turn_rest", NULL, "a constant now: 0.003 rad per sqrt(s)"},
    {"noise.turn_rel", NULL, "a constant now: 0.02 rad per sqrt(rad)"},
    {NULL, NULL, NULL},
};

const wm_param_table wm_pf_edges_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), kOld};
