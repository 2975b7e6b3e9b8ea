// SPDX-License-Identifier: Apache-2.0
#include "filters/stereo_ekf/params.h"

#include "param_rows.h"
#include "sensors/position_params.h"

typedef struct wm_stereo_ekf_params params;

static const char *const kPredictions[] = {"twist", "constant_velocity", NULL};

static const wm_param kParams[] = {
    {"prediction", WM_PARAM_ENUM, offsetof(params, prediction), WM_PREDICT_TWIST, 0, WM_PREDICT_CONSTANT_VELOCITY,
     kPredictions,
     "twist: prediction by the measured twist. constant_velocity: velocity and rates are states, and a measured twist "
     "is an observation of them; for noisy twists, or twists with gaps, and always without a stream of motion."},
    F64("noise.v_mps", v_mps, 0, 0, 100,
        "Sigma of one measured velocity on each axis, independent in each sample, m/s. 0: calibration.yaml's "
        "motion6.sigma_v_mps, or 0.03 without that."),
    F64("noise.w_radps", w_radps, 0, 0, 100,
        "Sigma of one measured turn rate on each axis, rad/s. 0: motion6.sigma_w_radps, or 0.01 without that."),
    F64("noise.v_rel", v_rel, 0, 0, 2,
        "A further sigma of the velocity, as a fraction of the speed; the variances are added."),
    F64("noise.w_rel", w_rel, 0, 0, 2,
        "A further sigma of the turn rates, as a fraction of the rate; the variances are added."),
    // Of a car, the fastest that is expected: half a minute to 100 km/h, and bends in a second. Without motion, walks
    // of 0.5, 1 and 2 m/s give 7.0, 7.0 and 7.0 mm at the sea floor, and 15, 7.5 and 4.7 m with a car.
    F64("constant_velocity.v_sigma_mps", cv_v_sigma, 4, 1e-6, 100, "Start sigma of the velocity as a state, m/s."),
    F64("constant_velocity.w_sigma_radps", cv_w_sigma, 0.5, 1e-6, 100, "Start sigma of the turn rates, rad/s."),
    F64("constant_velocity.v_walk", cv_v_walk, 2, 0, 100, "Random walk of the velocity, m/s per sqrt(s)."),
    F64("constant_velocity.w_walk", cv_w_walk, 0.5, 0, 100, "Random walk of the turn rates, rad/s per sqrt(s)."),
    F64("constant_velocity.tau_s", cv_tau_s, 0, 0, 1e6,
        "Above 0: velocity and rates are Gauss-Markov processes with these sigmas and this time constant, s, instead "
        "of random walks (a head that is swung, a vehicle in still water)."),
    F64("states.rate_bias_sigma_radps", rate_bias_sigma, 0.002, 0, 1,
        "Start sigma of the turn rates' bias on each axis, rad/s. 0: off."),
    F64("states.rate_bias_walk", rate_bias_walk, 0.0001, 0, 1, "Random walk of that bias, rad/s per sqrt(s)."),
    F64("states.velocity_scale_sigma", velocity_scale_sigma, 0.01, 0, 1,
        "Start sigma of the measured velocity's scale about 1 (speed of sound, a log's calibration). 0: off."),
    F64("states.rate_scale_sigma", rate_scale_sigma, 0.02, 0, 1,
        "Start sigma of the measured turn rates' scale about 1, one for all axes. 0: off."),
    F64("states.twist_axes_sigma_rad", twist_axes_sigma, 0.03, 0, 1,
        "Start sigma of the rotation of the measured twist's axes against the body's, rad: the mounting of a log or of "
        "gyros. 0: off."),
    F64("states.velocity_direction_sigma_rad", velocity_direction_sigma, 0.02, 0, 1,
        "Sigma of the velocity's direction against those axes, rad: sideslip, a pitch by load or current. 0: off."),
    F64("states.velocity_direction_tau_s", velocity_direction_tau_s, 10, 0, 1e6,
        "Time constant of that direction as a Gauss-Markov process, s. 0: it is constant."),
    F64("states.camera_rotation_sigma_rad", camera_rotation_sigma, -1, -1, 1,
        "Sigma of the rotation of the camera pair against calibration.yaml's mounting, about each axis, rad. 0: off. "
        "Below 0: what a pixel's sigma has beyond a detector's 1 px, over the focal length, with a time constant of 2 "
        "s; without such an excess 0.003, with 20 s. camera_rotation_tau_s above 0 is in place of these."),
    F64("states.camera_rotation_tau_s", camera_rotation_tau_s, 0, 0, 1e6,
        "Time constant of that rotation as a Gauss-Markov process, s: play of a mounting, shutters and clocks that "
        "differ a little. 0: it is constant."),
    F64("states.camera_place_sigma_m", camera_place_sigma, 0, 0, 10,
        "Sigma of the camera pair's place against calibration.yaml's, on each axis, m. 0: off."),
    F64("states.camera_place_tau_s", camera_place_tau_s, 0, 0, 1e6, "As camera_rotation_tau_s, for the place."),
    F64("states.time_offset_sigma_s", time_offset_sigma, 0.02, 0, 0.2,
        "Start sigma of the pictures' time offset, s: by how much they are older than their stamps. With twist only. "
        "0: off."),
    F64("states.camera_focal_sigma", camera_focal_sigma, 0, 0, 0.2,
        "Sigma of the pair's focal lengths, across and down, as a share of calibration.yaml's: of a good calibration "
        "0.001. For several rounds with slam.key_frames. 0: off."),
    F64("states.camera_centre_sigma_px", camera_centre_sigma, 0, 0, 100,
        "Sigma of the pair's principal point, across and down, px. 0: off."),
    F64("states.increment_scale_sigma", increment_scale_sigma, 0.02, 0, 1,
        "Sigma of the share by which motion between two pictures is too long: disparities that are all off by 0.2 px "
        "at 10 px. 0: off."),
    F64("states.increment_direction_sigma_rad", increment_direction_sigma, 0.02, 0, 1,
        "Sigma of the angle by which that motion is turned, rad: cameras that are not quite parallel. 0: off."),
    F64("states.range_bias_sigma_m", range_bias_sigma, 0.05, 0, 10, "Start sigma of acoustic ranges' bias, m. 0: off."),
    F64("states.bearing_bias_sigma_rad", bearing_bias_sigma, 0.05, 0, 1,
        "Start sigma of the bias of bearings and headings (a compass' deviation), rad. 0: off."),
    F64("states.twist_lag_sigma_s", twist_lag_sigma, 0, 0, 0.2,
        "Start sigma of two time offsets, s: by how much the measured velocity and the measured rates are ahead of the "
        "vehicle. With constant_velocity only. 0: off."),
    F64("states.accelerometer_bias_sigma_mps2", accelerometer_bias_sigma, 0, 0, 10,
        "Start sigma of an accelerometer's constant error on each axis, m/s2 (of cheap ones 0.1 to 0.5). Above 0 the "
        "direction of gravity by `imu` corrects roll and pitch, once a second. 0: the accelerometer is not used."),
    F64("states.accelerometer_bias_walk", accelerometer_bias_walk, 0.0005, 0, 1,
        "Random walk of that error, m/s2 per sqrt(s)."),
    F64("noise.accelerometer_mps2", accelerometer_mps2, 0.03, 1e-4, 10,
        "Sigma of the mean of a second of specific force, m/s2, besides what its scatter in that second (vibration, "
        "bumps) and the velocity's noise add: scales, axes, the arm from base_link."),
    F64("noise.pixel_px", pixel_px, 0, 0, 1000,
        "Sigma of one coordinate of a point in a picture, px. 0: calibration.yaml's stereo.sigma_px, or 0.5 without "
        "that."),
    F64("gate.soft", gate_soft, 7, 1, 1e6,
        "Normalised innovation squared of one row above which its variance is inflated, as for a distribution with "
        "long tails. 99 % of correct rows lie below 6.6."),
    F64("gate.hard", gate_hard, 20, 1, 1e6,
        "Normalised innovation squared of one row above which the whole observation is an outlier."),
    BOOL("increments.on", increments, 1,
         "Use tracks that are not points of the state, as far ones, for the motion between two pictures (visual "
         "odometry)."),
    I32("slam.points", points_max, 250, 0, 256,
        "Capacity of the state for points: points found by stereo, and points of the map, whose error on it (sigma_m) "
        "is the same in each picture. 0: known points only, with an independent error in each picture."),
    I32("slam.keep_unseen_steps", keep_unseen_steps, 5, 0, 1000000,
        "Pictures in which a point of the state may be missing although it should be in view; then it is removed."),
    F64("slam.keep_outside_s", keep_outside_s, 600, 0, 1e6,
        "Time for which a point out of view is kept, to be found again, s. 0: it is removed at once, as in the paper."),
    I32("slam.key_frames", frames_max, 0, 0, 200,
        "Capacity of the own map: places to which the pose is related when their points are found again by their "
        "appearance: after a loop, a restart, or when carried away. Each has up to 64 points and 9 states. A full map "
        "gives up the place that was not seen for longest. 0: no map; points that leave the view are forgotten."),
    F64("dead_reckoning_after_s", dead_reckoning_after_s, 2, 0, 3600,
        "Time without a fused observation after which the state is dead reckoning, s."),
    BOOL("recover.on", recover, 1, "Relocalize by known points when the observations show that the pose is wrong."),
};

#define CONSTANT "it is a constant of the filter now"
static const wm_param_old kOld[] = {
    POSITION_KEYS_OF_OLD,
    {"markers.*", "/markers.*", NULL},
    {"gap.after_s", NULL, CONSTANT},
    {"gap.v_walk", NULL, CONSTANT},
    {"gap.w_walk", NULL, CONSTANT},
    {"slam.disparity_min_px", NULL, CONSTANT},
    {"noise.range_default_m", "/sightings.noise.range_default_m", NULL},
    {"noise.bearing_default_rad", "/sightings.noise.bearing_default_rad", NULL},
    {"noise.map_min_m", "/sightings.noise.map_min_m", NULL},
    {"constant_velocity.sample_at", NULL,
     "stamps are the reader's: `end` is now sources: [{name: motion6, sample_at: next_stamp}]"},
    {"recover.window_s", NULL, "observations of the last 3 s are used to find the pose"},
    {"recover.sigma_m", NULL, "a pose that is found needs a sigma of 0.5 m"},
    {"recover.sigma_rad", NULL, "a pose that is found needs a sigma of 0.25 rad"},
    {NULL, NULL, NULL}};

const wm_param_table wm_stereo_ekf_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), kOld};
