// SPDX-License-Identifier: Apache-2.0
#include "vision/edges/params.h"

static const char *const kSigns[] = {"bright_to_dark", "any", NULL};

static const char *const kModes[] = {"rays", "windows", NULL};

#define F64(key, field, initial, min, max, about) \
  { key, WM_PARAM_F64, offsetof(struct wm_edges_params, field), initial, min, max, NULL, about }

static const wm_param kParams[] = {
    {"mode", WM_PARAM_ENUM, offsetof(struct wm_edges_params, mode), EDGES_BY_RAYS, 0, EDGES_BY_WINDOWS, kModes,
     "rays: the first edge along each ray over the floor, in the camera's picture itself. windows: the paper's way, "
     "the "
     "strongest line in each window of the bird's-eye view. Rays are more accurate, and tell a wall's foot from "
     "joints."},
    F64("rays.step_rad", rays_step_rad, 0.011, 0.001, 0.2,
        "rad. Angle between two rays from the camera's foot point over the floor; each gives at most one point."),
    F64("rays.range_min_m", rays_range_min_m, 0.2, 0.0, 50,
        "m from the camera's foot point. Nearer floor is not searched."),
    F64("rays.range_max_m", rays_range_max_m, 6.0, 0.1, 100,
        "m from the camera's foot point. Farther floor is not searched: a pixel is 0.17 m of floor at 6 m."),
    {"rays.sign", WM_PARAM_ENUM, offsetof(struct wm_edges_params, rays_sign), EDGES_BRIGHT_TO_DARK, 0, EDGES_ANY_SIGN,
     kSigns,
     "Which edges are looked for, seen from the robot outwards. Skirting boards and doors are darker than floors; "
     "their "
     "upper edges go the other way and must not be taken for the joint of wall and floor."},
    F64("rays.contrast_grey", rays_contrast_grey, 6.0, 0.5, 255,
        "Grey levels. Smallest difference of both sides, averaged over four pixels each: above noise and compression."),
    F64("rays.contrast_rel", rays_contrast_rel, 0.10, 0.0, 1,
        "Smallest difference of both sides over their sum: above that of neighbouring boards, stains and reflections."),
    F64("rays.line_rel", rays_line_rel, 0.05, 0.0, 1,
        "In parts of the range. A dark band that is narrower on the floor is a line (a tile's joint, a cable), no "
        "wall: "
        "the height of a board over the camera's height, less than half of the lowest skirting."),
    F64("rays.line_m", rays_line_m, 0.035, 0.0, 1,
        "m. A dark band that is narrower across is a line, too: a ray meets the joints that run along the robot's way "
        "at a flat angle. Nearer walls than a few times this, beside the camera, are not seen."),
    F64("rays.band_m", rays_band_m, 0.1, 0.0, 1,
        "m. And so is one up to this wide with floor as bright behind it as before: tape that marks ways, a door's "
        "threshold."),
    F64("rays.mirror_rel", rays_mirror_rel, 0.3, 0.0, 2,
        "In parts of the range. How far behind an edge a stronger one is taken instead: glossy floors mirror a "
        "skirting "
        "board, whose image begins before the joint by the board's height over the camera's."),
    {"rays.support_min", WM_PARAM_I32, offsetof(struct wm_edges_params, rays_support_min), 3, 0, 8, NULL,
     "Of the four rays to each side, so many must have a point on a line with this one; else it is left out."},
    F64("bird.px_per_m", hough.bird_px_per_m, 75, 10, 500, "px/m of the bird's-eye view; the paper's."),
    F64("bird.x_min_m", hough.bird_x_min_m, 1.5, -20, 50, "m ahead of base_link: where the view begins."),
    F64("bird.x_max_m", hough.bird_x_max_m, 7.1, -20, 50, "m ahead of base_link: where the view ends."),
    F64("bird.side_m", hough.bird_side_m, 3.0, 0.2, 50, "m to the left and to the right that are viewed."),
    {"windows.px", WM_PARAM_I32, offsetof(struct wm_edges_params, hough.windows_px), 50, 8, 64, NULL,
     "px. Side of a window; the paper's."},
    {"windows.overlap_px", WM_PARAM_I32, offsetof(struct wm_edges_params, hough.windows_overlap_px), 10, 0, 63, NULL,
     "px that neighbouring windows share; the paper's."},
    F64("windows.variance_min", hough.windows_variance_min, 5000, 0, 1e9,
        "A window has a line where the sums of its most varied slope vary by more than this; the paper's."),
    F64("windows.join_px", hough.windows_join_px, 10, 0, 1000,
        "px between the nearest ends of two lines, from which on they don't continue each other; the paper's."),
    F64("windows.join_angle_rad", hough.windows_join_angle_rad, 2.792526803190927, 0, 3.1416,
        "rad. Nor do they if the angle between them, which is pi where they are one line, is smaller than this; the "
        "paper's 160 degrees."),
    F64("windows.straight_px", hough.windows_straight_px, 3, 0, 1000,
        "px from the line through the two ends farthest from each other at which an end of a line is still on it; the "
        "paper's."),
    F64("windows.straight_share", hough.windows_straight_share, 0.3333333333333333, 0, 1,
        "Connected lines of which more than this share of ends are on that line are replaced by it; the paper's third. "
        "Others become a polyline along the longest of the shortest ways through them."),
    F64("windows.spacing_m", hough.windows_spacing_m, 0.1, 0.01, 5, "m between two points of a line."),
    F64("windows.sigma_m", hough.windows_sigma_m, 0.03, 1e-4, 5, "m. Error of a line's points across it."),
    F64("sigma_px", sigma_px, 0.3, 0.01, 10, "px. Error of an edge's place across the edge where contrast is good."),
    F64("noise_grey", noise_grey, 2.0, 0.0, 100,
        "Grey levels. Noise of a pixel; over an edge's slope it is an error of its place that is added to sigma_px."),
};

const wm_param_table wm_edges_params_table = {kParams, sizeof kParams / sizeof kParams[0],
                                              sizeof(struct wm_edges_params), NULL};
