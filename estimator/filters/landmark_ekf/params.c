// SPDX-License-Identifier: Apache-2.0
#include "filters/landmark_ekf/params.h"

#include "filters/planar/sighting_params.h"

typedef struct wm_landmark_ekf_params params;

static const wm_param kParams[] = {
    WM_MOTION_STATE_PARAMS(params, motion),
    WM_WHEEL_HEADING_PARAMS(params, motion),
    // clang-format off
    WM_SENSOR_STATE_PARAMS
        // clang-format on
        F64("states.tilt_sigma_rad", tilt_sigma_rad, 0.007, 0, 1,
            "The robot's roll and pitch on its springs and on the ground, rad: 0.4 degrees, as a car has that brakes, "
            "bends or "
            "is loaded on one side. States with use.elevation, which tells them from a distance; else unused."),
    F64("states.tilt_tau_s", tilt_tau_s, 2, 0.01, 1e6, "Time after which such a tilt has fallen to 1/e, s."),
    F64("states.gnss_time_offset_sigma_s", gnss_time_offset_sigma_s, 0, 0, 1,
        "Start sigma of the receiver's time offset, s: its positions are that much older than their stamps. 0: off."),
    I32("states.map_slots", map_slots, 0, 0, 16,
        "Landmarks (the last seen ones) whose error on the map, by their sigma_m, is carried as states. 0: the map's "
        "error is taken as fresh noise of each sighting, which is too sure of itself where one landmark is seen "
        "often."),
    BOOL("use.bearing", use_bearing, 1, "Fuse bearings."),
    BOOL("use.range", use_range, 1, "Fuse ranges."),
    BOOL("use.elevation", use_elevation, 0,
         "Fuse elevations, of sightings without a range, where the map has the landmark's height: what it is above the "
         "sensor tells how far away it is. Carries the robot's tilt and the heights of the map's slots as states."),
    BOOL("use.position", use_position, 1, "Fuse positions (GNSS)."),
    BOOL("use.heading", use_heading, 1, "Fuse headings."),
    WM_SIGHTING_NOISE_PARAMS,
    F64("noise.map_min_m", map_sigma_min_m, 0, 0, 10,
        "A landmark's sigma on the map is never taken to be smaller, m (maps promise more than they keep)."),
    F64("noise.gnss_factor", gnss_sigma_factor, 1, 0.01, 100, "Times the position's sigma."),
    F64("noise.gnss_min_m", gnss_sigma_min_m, 0.01, 0, 1000, "A position's sigma is never taken to be smaller, m."),
    WM_LASTING_PARAMS,
    F64("lasting.gnss_m", gnss_lasting_m, 0, 0, 1000,
        "Sigma of a position's lasting error on each axis, m (reflections, atmosphere). 0: none."),
    F64("lasting.gnss_tau_s", gnss_lasting_tau_s, 60, 0.1, 1e6, "Time after which that has fallen to 1/e, s."),
    F64("gate.soft", gate_soft, 9, 1, 1e6,
        "Normalised innovation squared for two numbers above which the measurement is believed less, as a "
        "distribution with long tails does; for one number it is scaled. 99 % of good ones lie below 9.2."),
    F64("gate.hard", gate_hard, 25, 1, 1e6, "The same, above which it is rejected and counted: a misread code."),
    BOOL("gate.associate_unknown", associate_unknown, 0,
         "Sightings without an id: fuse them with the one landmark that fits, where no other does."),
    F64("dead_reckoning_after_s", dead_reckoning_after_s, 2, 0, 3600,
        "Nothing fused for so long: the state says dead reckoning."),
    BOOL("recover.on", recover, 1, "Search the pose anew when observations keep contradicting it."),
    F64("recover.window_s", recover_window_s, 20, 1, 600,
        "Observations that are used to find the pose are at most so old; odometry carries them together."),
    F64("recover.sigma_xy_m", recover_sigma_xy_m, 1, 0.001, 100,
        "A pose found anew is taken when it is known at least so well, m (GNSS alone: a few metres)."),
    F64("recover.sigma_heading_rad", recover_sigma_heading_rad, 0.25, 0.001, 3, "The same for the heading, rad."),
};

const wm_param_table wm_landmark_ekf_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), NULL};
