// SPDX-License-Identifier: Apache-2.0
#include "vision/edges/params.h"

static const char *const kSigns[] = {"bright_to_dark", "any", NULL};

static const char *const kModes[] = {"rays", "windows", NULL};

#define F64(key, field, initial, min, max, about) \
  { key, WM_PARAM_F64, offsetof(struct wm_edges_params, field), initial, min, max, NULL, about }

static const wm_param kParams[] = {
    {"mode", WM_PARAM_ENUM, offsetof(struct wm_edges_params, mode), EDGES_BY_RAYS, 0, EDGES_BY_WINDOWS, kModes,
     "rays: the first edge along each ray over the floor, in the raw picture. windows: the strongest line in each "
     "window of the bird's-eye view, the paper's method. Rays are more accurate and distinguish walls from joints."},
    F64("rays.range_min_m", rays_range_min_m, 0.2, 0.0, 50,
        "m from the camera's foot point. Nearer floor is not searched."),
    F64("rays.range_max_m", rays_range_max_m, 6.0, 0.1, 100,
        "m from the camera's foot point. Farther floor is not searched: a pixel is 0.17 m of floor at 6 m."),
    {"rays.sign", WM_PARAM_ENUM, offsetof(struct wm_edges_params, rays_sign), EDGES_BRIGHT_TO_DARK, 0, EDGES_ANY_SIGN,
     kSigns,
     "Sign of the edges, seen from the robot outwards. Skirting boards and doors are darker than floors; their upper "
     "edges have the other sign and are not the joint of wall and floor."},
    F64("rays.contrast_grey", rays_contrast_grey, 6.0, 0.5, 255,
        "Grey levels. Smallest difference of both sides, averaged over four pixels each: above noise and compression."),
    F64("bird.x_min_m", hough.bird_x_min_m, 1.5, -20, 50, "m ahead of base_link. Near end of the bird's-eye view."),
    F64("bird.x_max_m", hough.bird_x_max_m, 7.1, -20, 50, "m ahead of base_link. Far end of the bird's-eye view."),
    F64("bird.side_m", hough.bird_side_m, 3.0, 0.2, 50,
        "m. Extent of the bird's-eye view to the left and to the right."),
    F64("sigma_px", sigma_px, 0.3, 0.01, 10, "px. Error of an edge across it, where contrast is good."),
};

static const wm_param_old kOld[] = {
    {"rays.contrast_rel", NULL, "a constant now: 0.1 of the sum of both sides"},
    {"rays.line_m", NULL, "a constant now: 0.035 m"},
    {"rays.band_m", NULL, "a constant now: 0.1 m"},
    {"rays.mirror_rel", NULL, "a constant now: 0.3 of the range"},
    {"windows.variance_min", NULL, "a constant now: the paper's 5000"},
    {"windows.sigma_m", NULL, "a constant now: 0.03 m"},
    {"rays.step_rad", NULL, "a constant now: 0.011 rad"},
    {"rays.support_min", NULL, "a constant now: 3 of 8 neighbouring rays"},
    {"windows.px", NULL, "a constant now: the paper's 50 px"},
    {"windows.overlap_px", NULL, "a constant now: the paper's 10 px"},
    {"windows.join_px", NULL, "a constant now: the paper's 10 px"},
    {"windows.join_angle_rad", NULL, "a constant now: the paper's 160 degrees"},
    {"windows.straight_px", NULL, "a constant now: the paper's 3 px"},
    {"windows.straight_share", NULL, "a constant now: the paper's third"},
    {"windows.spacing_m", NULL, "a constant now: 0.1 m"},
    {"rays.line_rel", NULL, "a constant now: 0.05 of the range"},
    {"bird.px_per_m", NULL, "a constant now: the paper's 75 px/m"},
    {"noise_grey", NULL, "a constant now: 2 grey levels"},
    {NULL, NULL, NULL},
};

const wm_param_table wm_edges_params_table = {kParams, sizeof kParams / sizeof kParams[0],
                                              sizeof(struct wm_edges_params), kOld};
