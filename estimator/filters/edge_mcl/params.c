// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/params.h"

#include "filters/core/param_rows.h"

typedef struct wm_edge_mcl_params params;

static const wm_param kParams[] = {
    WM_MOTION_STATE_PARAMS(params, motion),
    WM_WHEEL_HEADING_PARAMS(params, motion),
    F64("states.pitch_sigma_rad", pitch_sigma_rad, 0.01, 0, 0.5,
        "Start sigma of each camera's pitch about calibration.yaml's, rad. 0.1 degrees are 7 cm of floor at 4 m. 0: "
        "off."),
    F64("states.roll_sigma_rad", roll_sigma_rad, 0.01, 0, 0.5, "The same of its roll about the view, rad. 0: off."),
    F64("states.yaw_sigma_rad", yaw_sigma_rad, 0.01, 0, 0.5, "The same of its yaw, rad. 0: off."),
    F64("states.height_sigma_m", height_sigma_m, 0.01, 0, 0.5, "The same of its height above the floor, m. 0: off."),
    F64("states.time_offset_sigma_s", time_offset_sigma_s, 0.03, 0, 0.3,
        "Start sigma of each camera's time offset, s: its pictures are that much older than their stamps. 0: off."),
    F64("states.edge_offset_sigma_m", edge_offset_sigma_m, 0.01, 0, 0.3,
        "Start sigma of what lies between the edge that the detector sees and the map's, m: skirting, contact shadow. "
        "0: off."),

    F64("points.pixel_px", pixel_px, 0.5, 0.01, 10,
        "Sigma of an edge in the picture, pixels, where the detector doesn't give it in metres."),
    F64("points.sigma_m", point_sigma_m, 0.012, 0.001, 1, "Sigma of a point besides: map and edge, m."),
    F64("points.common_px", common_px, 0.6, 0, 10,
        "Sigma of what the edges of one wall are seen off by together, pixels: blur, and the wall's image in a shiny "
        "floor. Far off it is more than points that agree with each other say."),
    F64("points.correlated", correlated, 30, 1, 1000,
        "As many points of successive scans err together: the alignment counts each as so many times less."),
    F64("points.range_max_m", range_max_m, 6.0, 0.5, 50, "Points farther from the camera are not used, m."),
    F64("points.gate_m", gate_m, 0.15, 0.01, 0.6, "A point farther from the map's edge than this is not aligned, m."),
    F64("points.normal_gate_rad", normal_gate_rad, 0.6, 0.05, 1.6,
        "Nor is one whose edge runs otherwise than the map's by more than this, rad."),
    F64("lasting.xy_m", lasting_xy_m, 0.01, 0, 1,
        "What the pose is unsure of beside the filter's covariance, m: errors that last longer than it remembers, as "
        "where exactly the camera sits."),
    F64("lasting.heading_rad", lasting_heading_rad, 0.0005, 0, 1, "The same of the heading, rad."),

    F64("lost.explained", lost_explained, 0.5, 0.05, 0.95,
        "Share of the points that the map explains at which a scan of many points speaks neither for nor against being "
        "lost."),
    F64("lost.below", lost_below, 0.2, 0, 1,
        "So is what is less than usual in this place by this and by lost.spread, both taken of as many points as can "
        "be edges (lost.false_points); the larger of the two shares counts."),
    F64("lost.spread", lost_spread, 4, 0, 100,
        "Times what the scans of the last minute were short of what was usual, on average: where a floor shines or "
        "tape lies about, a scan that explains little says less."),
    F64("lost.hidden", lost_hidden, 0.9, 0, 1,
        "What a point counts as unexplained that lies on this side of the map's edges: something stands there, or the "
        "floor changes, that the map doesn't have."),
    F64("lost.most", lost_most, 1, 0.01, 100,
        "What a scan says at most, logarithm of the odds, besides what is seen through edges: one thing in the way "
        "hides all behind it."),
    F64("lost.through", lost_through, 3, 1, 100,
        "What a point counts as unexplained that lies behind an edge of the map, where the robot can't see if it is "
        "where it believes; less what is usual of them in the drive (lost.spread times)."),
    F64("lost.false_points", lost_false_points, 60, 0, 1000,
        "Points of a scan with which half of that share is enough: some are no edge of the map wherever it is, and of "
        "few they are most. What lies before an edge, as its image in a shiny floor does, counts by it, too."),
    F64("lost.gain", lost_gain, 8, 0.1, 100,
        "How much a scan speaks: the logarithm of the odds changes by this times the share's difference."),
    F64("lost.per_s", lost_per_s, 0.0001, 0, 1,
        "Probability of being lost out of the blue, per s: someone lifts it, once in some hours. The prior of places "
        "that look the same, too."),
    F64("search.explained", search_explained, 0.6, 0.05, 1,
        "Share of the last metres' points that a place must explain."),
    F64("search.share", search_share, 0.95, 0.1, 1,
        "Probability, among all places that are possible, from which on a place is taken."),
    I32("search.poses", search_poses, 80000, EDGE_MCL_SEARCH_POSES_LEAST, 10000000,
        "Work of a scan at most while in doubt, in poses that a sweep over the map scores by 24 points one by one; an "
        "eighth of it otherwise, and a quarter, at most half of it for places that look as the tracked one. Aligning "
        "places (8704 each) and weighing them (3072) come out of it. 80000: 1 ms on a PC."),
    F64("dead_reckoning_after_s", dead_reckoning_after_s, 1.0, 0.05, 3600,
        "Nothing fused for so long: the state says dead reckoning."),
};

const wm_param_table wm_edge_mcl_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), NULL};
