// SPDX-License-Identifier: Apache-2.0
#include "motion/motion_params.h"

#include "param_rows.h"

typedef struct wm_motion_params params;

static const char *const kModels[] = {"auto",  "ticks",      "speed_yaw_rate",    "ackermann",
                                      "twist", "increments", "constant_velocity", NULL};
static const char *const kTwists[] = {"auto", "measured", "commands", NULL};

static const char *const kDrives[] = {"rolling", "holonomic", "skid_steer", NULL};

// A calibration state of the motion sensors: the sigma at its start, and its random walk.
#define STATE(term, name, unit, initial, walk_initial, about)                   \
  F64("states." name "_sigma" unit, states.sigma[term], initial, -1, 1, about), \
      F64("states." name "_walk" unit, states.walk[term], walk_initial, 0, 1,   \
          "Random walk of that state per sqrt(s).")
#define BY_KIND " 0: off. Below 0: of that size, "

static const wm_param kParams[] = {
    ENUM("model", model, WM_MOTION_AUTO, WM_MOTION_CONSTANT_VELOCITY, kModels,
         "Motion model. auto: the first of increments, speed and yaw rate, ticks, speed and steering, twist whose data "
         "come; the speed of speed and yaw rate may be the ticks'."),
    ENUM("twist", twist, WM_TWIST_AUTO, WM_TWIST_COMMANDS, kTwists,
         "Whether the rows of motion.csv are commands or measured. auto: commands, where rows "
         "repeat the one before."),
    ENUM("drive", states.drive, WM_DRIVE_ROLLING, WM_DRIVE_SKID_STEER, kDrives,
         "What the base can do. rolling: wheels that roll forwards; a measured sideways speed is used with the noise "
         "of the "
         "speed. holonomic: it drives sideways, too (mecanum, swerve, legs), with a scale and noise of its own for "
         "that. "
         "skid_steer: wheels or tracks that slip in turns; its centre of rotation and its effective track are states."),
    F64("noise.speed_mps", noise_speed_mps, 0.02, 0, 10,
        "White noise of the speed, m/s per sqrt(s): slip and play at walking pace. Not of wheel counters: see "
        "ticks_per_sqrt_m."),
    F64("noise.speed_rel", noise_speed_rel, -1, -1, 2,
        "White noise of the speed relative to the speed, per sqrt(s); variances are added. "
        "Below 0: 0.06 of commands, 0.03 of a measured twist or with steering, 0.02 with a yaw rate, 0.007 of wheel "
        "counters beside one."),
    F64("noise.yaw_rate_radps", noise_yaw_rate_radps, -1, -1, 10,
        "White noise of the turn rate, rad/s per sqrt(s). "
        "Below 0: 0.02 of commands, 0.004 of a yaw rate's sensor, else 0.01."),
    F64("noise.yaw_rate_rel", noise_yaw_rate_rel, -1, -1, 2,
        "White noise of the turn rate relative to the turn rate, per sqrt(s). "
        "Below 0: 0.13 of commands, 0.05 of a measured twist, 0.01 of a yaw rate's sensor, else 0.03."),
    F64("noise.yaw_rate_per_mps", noise_yaw_rate_per_mps, 0.0, 0, 10,
        "White noise of the turn rate in rad/s per m/s of speed, per sqrt(s): castors, ruts, a wheel that slips."),
    F64("noise.side_rel", noise_side_rel, 0.01, 0, 2,
        "White noise of the sideways speed relative to the speed, per sqrt(s): lateral slip."),
    F64("noise.sideways_mps", noise_sideways_mps, 0.02, 0, 10,
        "White noise of the sideways speed of a holonomic drive, m/s per sqrt(s), as speed_mps."),
    // Twice that of the speed forwards: on rollers a part of the wheels' grip is lost, and the share changes with load
    // and floor.
    F64("noise.sideways_rel", noise_sideways_rel, 0.06, 0, 2,
        "White noise of the sideways speed of a holonomic drive relative to it, per sqrt(s)."),
    F64("noise.rest_factor", noise_rest_factor, 0.22, 0, 1,
        "Factor of the constant noises while speed and turn rate are zero: a robot at rest stays."),
    F64("noise.ticks_per_sqrt_m", noise_ticks_per_sqrt_m, 0.005, 0, 1,
        "Noise of a wheel's distance by its ticks, m per sqrt(m) (uneven floor, slip). The way, where a "
        "yaw rate or steering gives the turn, has this divided by sqrt(2)."),
    F64("noise.steering_rad", noise_steering_rad, 0.005, 0, 1,
        "White noise of the road wheel's angle, rad per sqrt(s): play and the table's error between its points."),
    F64("noise.adapt_log_sigma", noise_adapt_log_sigma, 1.4, 0, 10,
        "Start sigma of the logarithm of factors that adapt variances to the innovations: of this noise and of "
        "sightings from 1 to 16, of positions (GNSS) from 1/16 to 16. 0: none adapts. 1.4: a factor of 2 in a sigma. "
        "Flat from 0.7 to 2.2."),
    F64("noise.hold_mps2", noise_hold_mps2, 1.0, 0, 100,
        "m/s2. Assumed acceleration while a speed is overdue (older than 0.25 s and than three of its periods): the "
        "distance's sigma grows by a t^2 / 2."),
    F64("noise.hold_radps2", noise_hold_radps2, 0.5, 0, 100, "rad/s2. As hold_mps2, for the turn rate."),
    F64("standstill.speed_mps", standstill_speed_mps, 0.02, 0, 1,
        "A speed below this is zero. The smallest step of common wheel-speed sensors is 0.01 to 0.03 m/s."),
    F64("standstill.yaw_rate_radps", standstill_yaw_rate_radps, 0.002, 0, 1,
        "A twist's turn rate below this is zero. For twists only: a gyro has noise."),
    F64("standstill.after_s", standstill_after_s, 0.5, 0, 60,
        "Zero speed for so long is standstill: position and heading hold, the gyro measures its bias."),
    F64("standstill.bias_sigma_radps", standstill_bias_sigma_radps, 0.01, 1e-6, 1,
        "Sigma of one reading of the yaw rate as a measurement of its bias while standing (steps and vibration)."),
    F64("hold_max_s", hold_max_s, 2.0, 0.01, 3600,
        "A speed, rate or twist holds until the next of its kind, at most this long; then the motion is unknown, and "
        "sigma grows with the last speed, or with noise.hold_mps2 times half of this where that is more. Working "
        "robots "
        "have gaps of 1 s."),
    F64("limits.mps2", limits_mps2, 15.0, 0, 1000,
        "m/s2. Largest plausible acceleration. A speed that changes by more than this allows and by 3 m/s besides, or "
        "a "
        "wheel's count that implies such a speed, is refused like a frozen counter's: the last plausible motion holds "
        "and the noise grows. Tyres reach 10. 0: no limit."),
    F64("limits.radps2", limits_radps2, 30.0, 0, 10000,
        "rad/s2. As limits.mps2, for a turn rate, with a step of 6 rad/s. 0: no limit."),
    F64("commands.radius_max_m", commands_radius_max_m, 0.0, 0, 1000,
        "m. Twists are commands to a drive that takes speed and radius, of which this is the largest (iRobot Create: "
        "2): a wider turn is driven with it. 0: any turn is driven as asked."),
    F64("commands.radius_overflow_m", commands_radius_overflow_m, 0.0, 0, 1000,
        "m. With radius_max_m and not below it: a left turn with a radius beyond this is driven as the widest one to "
        "the right, since the radius overflows on its way to the drive. 0: never."),
    // The ten robots of mrclam against truth: 0.10 to 0.20 s. With 0.06, 0.1 and 0.15 slam's mean error over the best
    // known there is 0.99, 0.94 and 0.91, landmark_ekf's 1.12, 1.13 and 1.15.
    F64("commands.response_s", commands_response_s, 0.15, 0.01, 2,
        "Where twists are commands: time constant of the drive's first-order response to a change, behind the dead "
        "time, which is the lag."),
    // Steps of the turn rate on the ten robots of mrclam against truth: 0.19 s +- 0.06 to 0.12 s, of any size. Flat
    // from 0.07 to 0.13.
    F64("commands.delay_sigma_s", commands_delay_sigma_s, 0.1, 0, 2,
        "Where twists are commands: sigma of the dead time about its mean, which differs from change to change (a "
        "controller's cycle): noise of the distance and of the rotation, times the change."),
    F64("constant_velocity.speed_walk", velocity_speed_walk, 0.5, 1e-6, 100,
        "m/s per sqrt(s). Without motion data: random walk of the velocity on each of the map's axes, which is a "
        "state. "
        "Its start sigma is twice this in m/s. 0.5: a person, a cart; a car 2. Not swept."),
    F64("constant_velocity.turn_walk", velocity_turn_walk, 0.5, 1e-6, 100,
        "rad/s per sqrt(s). The same of the turn rate."),
    STATE(WM_SPEED_SCALE, "speed_scale", "", -0.05, 0,
          "Start sigma of the speed's scale about 1 (tyres, a controller that gives less than asked)." BY_KIND
          "where a speed is measured or commanded."),
    // 3.4 % RMS of the ten robots of mrclam against truth. Mean error of slam over the best known there: 0.90, 0.94 and
    // 0.98 with 0.03, 0.04 and 0.05; landmark_ekf is flat from 0.03 to 0.1.
    STATE(WM_YAW_RATE_SCALE, "yaw_rate_scale", "", -0.04, 0,
          "Start sigma of the turn rate's scale about 1." BY_KIND
          "where the turn rate is measured or commanded; a gyro's at most 0.015; a twist's with motion.drive "
          "skid_steer 0.2."),
    STATE(WM_YAW_RATE_BIAS, "yaw_rate_bias", "_radps", -0.02, 0.0001,
          "Start sigma of the turn rate's bias, rad/s (a cheap gyro: 0.02)." BY_KIND
          "where the turn rate is measured or commanded."),
    STATE(WM_LEFT_SCALE, "left_scale", "", -0.02, 0,
          "Start sigma of the left wheel's scale about 1, for ticks." BY_KIND "where ticks drive."),
    STATE(WM_RIGHT_SCALE, "right_scale", "", -0.02, 0,
          "Start sigma of the right wheel's scale about 1, for ticks." BY_KIND "where ticks drive."),
    STATE(WM_TRACK_SCALE, "track_scale", "", -0.02, 0,
          "Start sigma of the track's scale about 1, for ticks." BY_KIND
          "where ticks drive, or are a second source of the heading; with motion.drive skid_steer 0.25 about 1.5."),
    STATE(WM_STEERING_OFFSET, "steering_offset", "_rad", -0.02, 0,
          "Start sigma of the road wheel's zero, rad, for speed and steering." BY_KIND "where steering drives."),
    STATE(WM_LAG, "lag", "_s", -0.2, 0,
          "Start sigma of the motion's delay behind its samples, s." BY_KIND
          "where twists are commands: a measured motion's delay and the observations' time offsets are not observable "
          "apart."),
    STATE(WM_TURN_SLOWDOWN, "turn_slowdown", "_mps", -0.25, 0,
          "Start sigma of the loss of a commanded speed at a turn rate of 1 rad/s, m/s; it grows with the square of "
          "the turn rate (drives that limit or round their wheels' speeds)." BY_KIND "where twists are commands."),
    // The ten robots of mrclam against truth: 0.04 to 0.18 s of the speed, 0.00 to 0.07 s of the turn rate.
    STATE(WM_SPEED_ONSET, "speed_onset", "_s", -0.15, 0,
          "Start sigma of the time by which a commanded speed rises later than it falls, s: friction and play delay a "
          "start, and shorten a stop." BY_KIND "where twists are commands."),
    STATE(WM_TURN_ONSET, "turn_onset", "_s", -0.1, 0,
          "The same of the turn rate: short turns are obeyed in part." BY_KIND "where twists are commands."),
    STATE(WM_GENTLE_TURNS, "gentle_turns", "", -0.5, 0,
          "Start sigma of the share by which turns gentler than a radius of 2 m are driven with that radius, as drives "
          "by speed and radius do (iRobot Create). Only with commands.radius_max_m 0." BY_KIND
          "where twists are commands."),
    STATE(WM_SIDE_SCALE, "side_scale", "", -0.05, 0,
          "Start sigma of the scale of the sideways speed about 1, besides the speed's (rollers slip)." BY_KIND
          "where a holonomic drive measures or obeys a sideways speed."),
    // Half of the wheelbase of a small robot: where the load lies is not known [Mandow2007].
    STATE(
        WM_ROTATION_CENTER, "rotation_center", "_m", -0.15, 0.0005,
        "Start sigma of the centre of rotation's place ahead of base_link, m: a turn moves base_link sideways." BY_KIND
        "with motion.drive skid_steer."),
    F64("states.wheel_difference_sigma", states.wheel_difference_sigma, 0.0141, 0, 1,
        "With speed by ticks and the heading by a yaw rate: start sigma of the relative difference of the wheels' "
        "radii. The ticks then measure the heading, too, which bounds the random walk of the gyro's noise. 0: off. Two "
        "wheels of 1 % each."),
    F64("states.wheel_difference_walk", states.wheel_difference_walk, 0.00001, 0, 1,
        "Random walk of that state per sqrt(m): tyres warm up, loads move. Where it is above 0, slip that lasts raises "
        "it, by a factor of 1000 at most."),
};

const wm_param_table wm_motion_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), NULL};

const char *wm_motion_params_clash(const wm_motion_params *p, const char **key) {
  // 0 is off for either; where they are equal, every left turn overflows that is wider than the drive's widest.
  const double overflow_m = p->commands_radius_overflow_m;
  if (!(overflow_m > 0.0 && overflow_m < p->commands_radius_max_m)) return NULL;
  *key = "commands.radius_overflow_m";
  return "is below motion.commands.radius_max_m, which the drive still obeys: nothing overflows there; set it to at "
         "least that, or to 0 if no radius overflows";
}
