// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/params.h"

#include "param_rows.h"

typedef struct wm_edge_mcl_params params;

#define WM_CAMERA_PARAM(state, key, unit, name, initial, most, text) \
  F64("states." key "_sigma" unit, sigma[WM_CAMERA_ROW_##state], initial, 0, most, text),

static const wm_param kParams[] = {
    WM_CAMERA_STATES(WM_CAMERA_PARAM)

        F64("states.wall_sigma_m", wall_sigma_m, 0.02, 0, 0.3,
            "Start sigma of the distance across a wall between it and the map's, m, of each of the last six walls: "
            "errors of the map. Of 0.015 to 0.025 each is right for flats whose map is exact and with a wall 0.1 m "
            "off. 0: off."),
    F64("points.pixel_px", pixel_px, 0.5, 0.01, 10,
        "Sigma of an edge in the picture, pixels, where the detector gives none in metres."),
    F64("points.sigma_m", point_sigma_m, 0.012, 0.001, 1, "Sigma of a point besides: map and edge, m."),
    F64("points.common_px", common_px, 0.6, 0, 10,
        "Sigma of the error that all points of one wall share, pixels: blur, the wall's reflection in a glossy floor."),
    F64("points.range_max_m", range_max_m, 6.0, 0.5, 50, "Points farther from the camera are not used, m."),

    F64("lost.explained", lost_explained, 0.5, 0.05, 0.95,
        "Fraction of a scan's points that the map explains at which the scan is evidence neither for nor against being "
        "lost. Of n points n/(n + 60) can be edges; the fraction is taken of these."),
    F64("lost.margin", lost_margin, 0.2, 0, 1,
        "Margin below the fraction that the drive's usual number of false points leaves of a scan. The threshold is "
        "the larger of lost.explained and that fraction less lost.margin and 4 times the mean shortfall."),
    F64("lost.beyond_weight", lost_beyond_weight, 3, 1, 100,
        "Weight of an unexplained point beyond an edge of the map, where a camera at the estimated pose cannot see; "
        "less 4 times their usual fraction. 1: as any other (glass walls, lines on the floor that the map has)."),
    I32("search.poses", search_poses, 80000, EDGE_MCL_SEARCH_POSES_LEAST, 10000000,
        "Largest work of a scan while suspicious or lost, in poses that a sweep over the map scores by 24 points. An "
        "eighth of it otherwise, and a quarter to a half for aliased poses. Aligning a place counts 8704, weighing it "
        "3072. 80000: 1 ms on a PC."),
    F64("dead_reckoning_after_s", dead_reckoning_after_s, 1.0, 0.05, 3600,
        "The state is dead reckoning when no scan was fused for this time, s."),
};

// Keys that the table had before.
#define NO_PARTICLES "the particle filter is an estimator of its own now: pf_edges"
#define CONSTANT "it is a constant of the filter now"
static const wm_param_old kOld[] = {
    {"states.angle_walk_rad", NULL, "nothing read it"},
    {"states.*", "/motion.states.*", NULL},
    {"lasting.*", NULL, CONSTANT},
    {"lost.below", "lost.margin", NULL},
    {"lost.through", "lost.beyond_weight", NULL},
    {"lost.per_s", NULL, CONSTANT},
    {"points.correlated", NULL, CONSTANT},
    {"particles", NULL, NO_PARTICLES},
    {"weight", NULL, NO_PARTICLES},
    {"pose", NULL, NO_PARTICLES},
    {"exponent", NULL, NO_PARTICLES},
    {"sigma_m", NULL, NO_PARTICLES},
    {"floor", NULL, NO_PARTICLES},
    {"resample_below", NULL, NO_PARTICLES},
    {"noise.way", NULL, NO_PARTICLES},
    {"noise.side", NULL, NO_PARTICLES},
    {"noise.turn", NULL, NO_PARTICLES},
    {"noise.turn_rest", NULL, NO_PARTICLES},
    {"noise.turn_rel", NULL, NO_PARTICLES},
    {"pull", NULL, NO_PARTICLES},
    {"points.normal_gate_rad", NULL, CONSTANT},
    {"lost.spread", NULL, CONSTANT},
    {"lost.hidden", NULL, CONSTANT},
    {"lost.most", NULL, CONSTANT},
    {"lost.false_points", NULL, CONSTANT},
    {"lost.gain", NULL, CONSTANT},
    {"search.explained", NULL, CONSTANT},
    {"search.share", NULL, CONSTANT},
    {"points.gate_m", NULL, CONSTANT},
    {"systematic.xy_m", NULL, CONSTANT},
    {"systematic.heading_rad", NULL, CONSTANT},
    {"lost.kidnapped_per_s", NULL, CONSTANT},
    {NULL, NULL, NULL},
};

const wm_param_table wm_edge_mcl_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), kOld};
