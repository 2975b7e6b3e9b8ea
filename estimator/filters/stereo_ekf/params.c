// SPDX-License-Identifier: Apache-2.0
#include "filters/stereo_ekf/params.h"

#include "filters/core/param_rows.h"

typedef struct wm_stereo_ekf_params params;

static const char *const kPredictions[] = {"twist", "constant_velocity", NULL};

static const wm_param kParams[] = {
    {"prediction", WM_PARAM_ENUM, offsetof(params, prediction), WM_PREDICT_TWIST, 0, WM_PREDICT_CONSTANT_VELOCITY,
     kPredictions,
     "twist: the measured twist carries the pose on. constant_velocity: velocity and rates are states that walk; a "
     "measured twist is then a row like any other."},
    F64("noise.v_mps", v_mps, 0, 0, 100,
        "Sigma of one measured velocity, m/s on each axis, new in each sample. 0: calibration.yaml's "
        "motion6.sigma_v_mps, and 0.03 where that isn't there, either."),
    F64("noise.w_radps", w_radps, 0, 0, 100,
        "The same of one measured turn rate, rad/s. 0: motion6.sigma_w_radps, else 0.01."),
    F64("noise.v_rel", v_rel, 0, 0, 2, "The same of the velocity in parts of the speed; squares are added."),
    F64("noise.w_rel", w_rel, 0, 0, 2, "The same of the turn rates in parts of the rate; squares are added."),
    F64("gap.after_s", gap_after_s, 0.2, 0.001, 3600,
        "A twist holds to the next sample; where that is farther off than this, the mean of the one before and the one "
        "after is taken for the gap, s."),
    F64("gap.v_walk", gap_v_walk, 0.3, 0, 100,
        "Over a gap the velocity walks from sample to sample: m/s per sqrt(s). How briskly the vehicle moves."),
    F64("gap.w_walk", gap_w_walk, 0.3, 0, 100, "The same of the turn rates, rad/s per sqrt(s)."),
    F64("constant_velocity.v_sigma_mps", cv_v_sigma, 0.5, 1e-6, 100, "Start sigma of the velocity as a state, m/s."),
    F64("constant_velocity.w_sigma_radps", cv_w_sigma, 0.3, 1e-6, 100, "Start sigma of the turn rates, rad/s."),
    F64("constant_velocity.v_walk", cv_v_walk, 0.1, 0, 100, "Random walk of the velocity, m/s per sqrt(s)."),
    F64("constant_velocity.w_walk", cv_w_walk, 0.1, 0, 100, "Random walk of the turn rates, rad/s per sqrt(s)."),
    F64("constant_velocity.tau_s", cv_tau_s, 0, 0, 1e6,
        "Above 0, velocity and rates do not walk but are a Gauss-Markov process of these sigmas: they come back to 0 "
        "after so long, s (a head that is swung, a vehicle in still water)."),
    F64("states.rate_bias_sigma_radps", rate_bias_sigma, 0, 0, 1,
        "Start sigma of the turn rates' bias on each axis, rad/s. 0: off."),
    F64("states.rate_bias_walk", rate_bias_walk, 0.0001, 0, 1, "Random walk of that bias, rad/s per sqrt(s)."),
    F64("states.velocity_scale_sigma", velocity_scale_sigma, 0, 0, 1,
        "Start sigma of the measured velocity's scale about 1 (speed of sound, a log's calibration). 0: off."),
    F64("states.camera_rotation_sigma_rad", camera_rotation_sigma, 0, 0, 1,
        "Sigma of the rotation of the camera pair against calibration.yaml's mounting, about each axis, rad. 0: off."),
    F64("states.camera_rotation_tau_s", camera_rotation_tau_s, 0, 0, 1e6,
        "Time after which that rotation has fallen to 1/e, s: play of a mounting, shutters and clocks that don't quite "
        "agree. 0: it stays as it is."),
    F64("states.camera_place_sigma_m", camera_place_sigma, 0, 0, 10,
        "Sigma of the camera pair's place against calibration.yaml's, on each axis, m. 0: off."),
    F64("states.camera_place_tau_s", camera_place_tau_s, 0, 0, 1e6, "As camera_rotation_tau_s, for the place."),
    F64("states.time_offset_sigma_s", time_offset_sigma, 0, 0, 0.2,
        "Start sigma of the pictures' time offset, s: they are that much older than their stamps. 0: off."),
    F64("states.range_bias_sigma_m", range_bias_sigma, 0, 0, 10, "Start sigma of acoustic ranges' bias, m. 0: off."),
    F64("states.bearing_bias_sigma_rad", bearing_bias_sigma, 0, 0, 1,
        "Start sigma of the bias of bearings and headings (a compass' deviation), rad. 0: off."),
    F64("states.twist_lag_sigma_s", twist_lag_sigma, 0, 0, 0.2,
        "Start sigma of what the measured velocity, and apart from it the measured rates, run ahead of the vehicle by, "
        "s; with constant_velocity only. 0: off."),
    F64("noise.pixel_px", pixel_px, 0, 0, 1000,
        "Sigma of one coordinate of a point in a picture, px. 0: calibration.yaml's stereo.sigma_px."),
    F64("noise.range_default_m", range_m, 0.1, 1e-4, 100,
        "Sigma of a range where neither the sighting nor the sensor gives one, m."),
    F64("noise.bearing_default_rad", bearing_rad, 0.02, 1e-5, 3, "The same of a bearing, rad."),
    F64("noise.map_min_m", map_min_m, 0, 0, 10,
        "A known point's sigma is never taken to be smaller, m (maps promise more than they keep)."),
    F64("gate.soft", gate_soft, 7, 1, 1e6,
        "Normalised innovation squared of one row above which it is believed less, as a distribution with long tails "
        "does. 99 % of good ones lie below 6.6."),
    F64("gate.hard", gate_hard, 20, 1, 1e6,
        "The same, above which the row is rejected and with it the point that it is of: a wrong match."),
    I32("slam.points", points_max, 0, 0, 256,
        "Points that the state has room for: those without a place on the map, found by stereo, and those of the map, "
        "whose "
        "error on it (sigma_m) is the same in each picture. 0: known points only, their error taken as new each time."),
    I32("slam.keep_unseen_steps", keep_unseen_steps, 5, 0, 1000000,
        "Pictures in which a point of the state may be expected and not seen; then it is removed."),
    F64("slam.keep_outside_s", keep_outside_s, 10, 0, 1e6,
        "So long a point out of view is kept, to be found again, s. 0: removed at once, as the paper does."),
    F64("slam.disparity_min_px", disparity_min_px, 3, 0.1, 1000,
        "A point is added when left and right are at least so far apart, px: its distance must be known."),
    F64("dead_reckoning_after_s", dead_reckoning_after_s, 2, 0, 3600,
        "Nothing fused for so long: the state says dead reckoning."),
    BOOL("recover.on", recover, 1, "Search the pose anew when known points keep contradicting it."),
};

static const wm_param_old kOld[] = {
    {"constant_velocity.sample_at", NULL,
     "stamps are the reader's: `end` is now sources: [{name: motion6, sample_at: next_stamp}]"},
    {"recover.window_s", NULL, "observations of the last 3 s are used to find the pose"},
    {"recover.sigma_m", NULL, "a pose that is found needs a sigma of 0.5 m"},
    {"recover.sigma_rad", NULL, "a pose that is found needs a sigma of 0.25 rad"},
    {NULL, NULL, NULL}};

const wm_param_table wm_stereo_ekf_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), kOld};
