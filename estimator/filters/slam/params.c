// SPDX-License-Identifier: Apache-2.0
#include "filters/slam/params.h"

#include "param_rows.h"

typedef struct wm_slam_params params;

static const char *const kConsistency[] = {"invariant", "plain", NULL};
static const char *const kMaps[] = {"none", "extend", "frozen", NULL};
static const char *const kMethods[] = {"unscented", "linear", "inverse_distance", NULL};

static const wm_param kParams[] = {
    F64("states.wheel_slip_sigma", wheel_slip_sigma, 0, 0, 1,
        "For ticks: each wheel's scale wanders by so much (one sigma) about a mean that is a state, too: slip that "
        "lasts "
        "for seconds, where noise.ticks_per_sqrt_m is fresh with each tick. 0: off."),
    F64("states.wheel_slip_tau_s", wheel_slip_tau_s, 5, 0.01, 1e6, "And forgets by 1/e in this time, s."),
    F64("states.sensor_stamp_sigma_s", sensor_stamp_sigma_s, 0, 0, 1,
        "Sigma of the error of each picture's stamp, s: the same for all that is seen in it, independent between "
        "pictures. 0: off."),
    BOOL("markers.on", markers, 0,
         "Take coded markers: each landmark has a heading, too, and a marker gives all three at once."),
    F64("markers.sigma_m", marker_sigma_m, 0.002, 1e-5, 10,
        "Noise of a marker's place, m; the sensor's sigmas, along and across, are added in squares."),
    F64("markers.sigma_rel", marker_sigma_rel, 0, 0, 1, "The same in parts of the distance."),
    F64("markers.heading_sigma_rad", marker_heading_sigma_rad, 0.02, 1e-5, 3, "Noise of a marker's heading, rad."),
    F64("markers.stamp_sigma_s", marker_stamp_sigma_s, 0, 0, 1,
        "How far a picture's stamp scatters, s: a robot that turns at 1 rad/s sees a marker that much rad beside."),
    F64("markers.correlated", marker_correlated, 0, 0, 0.99,
        "The part of a marker's sigma along the line of sight and in heading that is the same from one sighting of it "
        "to "
        "the next (pixels under its corners, light, its bend), with the time constant sightings.correlated.tau_s; "
        "needs "
        "sightings.correlated.slots. 0: all of it is independent."),
    F64("markers.heading_most_rad", marker_heading_most_rad, 10, 1e-5, 10,
        "A marker's heading is taken where the detector is surer of it than this, rad: seen small and nearly face on, "
        "a print seems turned by several degrees to one side for as long as it is seen so."),
    ENUM("landmarks.map", map, WM_SLAM_MAP_NONE, WM_SLAM_MAP_FROZEN, kMaps,
         "What landmarks.csv is for. none: nothing, all are found anew; extend: they are in the state from the start, "
         "as unsure as their sigma_m, and new ones join; frozen: they stay as they are and only the robot is located."),
    I32("landmarks.capacity", landmark_capacity, 256, 1, 2000,
        "Landmarks that there is room for. Memory and the cost of a correction grow with the square of how many are in "
        "the state."),
    I32("landmarks.confirm_seen", confirm_seen, 3, 1, 1000,
        "A landmark seen so often is one; before, it leaves when it isn't seen again."),
    F64("landmarks.leave_after_s", leave_after_s, 10, 0.1, 1e6,
        "An unconfirmed landmark leaves when it wasn't seen for so long, s."),
    I32("landmarks.moved_after", moved_after, 12, 2, 1000,
        "So many sightings of a landmark in a row that don't fit, while others do: it was moved. It leaves, counted, "
        "and joins anew where it is."),
    F64("association.gate", associate_gate, 9.2, 1, 1000,
        "A sighting without an identity (sightings.use.unidentified) is one of the nearest landmark's where its "
        "normalised innovation squared is below this, no "
        "sighting of the same stamp was that landmark's, and no other landmark comes near."),
    F64("association.new_gate", new_gate, 40, 1, 1e6,
        "It is a new landmark's where all landmarks are farther than this. What lies between is left alone."),
    F64("association.near_m", associate_near_m, 8, 0.01, 1000,
        "Landmarks farther than this from where the sighting points are not looked at, m."),
    F64("association.max_range_m", associate_max_range_m, 1e4, 0.1, 1e6,
        "Sightings without an identity are taken up to this range, m: far ones are few pixels or one beam wide."),
    I32("lines.clones", line_clones, 0, 0, 40,
        "Poses of the past that are kept in the state for landmarks seen by bearings alone. 0: such landmarks are not "
        "taken. 12 to 24 do."),
    I32("lines.poses", line_poses, 6, 3, 8, "A landmark is initialised from at most so many poses."),
    ENUM(
        "lines.method", line_method, WM_SLAM_LINE_UNSCENTED, WM_SLAM_LINE_INVERSE_DISTANCE, kMethods,
        "How such a landmark joins. unscented: when the parallax suffices, its distribution by the unscented transform "
        "over poses and bearings; linear: the same by one linearisation (for comparison); inverse_distance: at once, "
        "as "
        "a ray with the inverse of its length, which holds the heading where dead reckoning can't."),
    F64("lines.near_m", line_near_m, 0.5, 0.01, 1000,
        "inverse_distance: landmarks are rarely nearer than this when first seen, m."),
    F64("lines.patience_s", line_patience_s, 10, 0.1, 1e6,
        "inverse_distance: a ray not seen for so long is begun anew; where the robot is unsure of its way by then, the "
        "old "
        "one's bearing is far from linear, s."),
    F64("lines.parallax_rad", line_parallax_rad, 0.15, 0.001, 3,
        "A landmark is initialised when its lines of sight cross at this angle at least, rad."),
    F64("lines.step_m", line_step_m, 0.15, 0.001, 100, "A pose is kept after so much way, m."),
    F64("lines.sigma_rel", line_sigma_rel, 0.25, 0.001, 1,
        "And when its place is known to this part of its distance (one sigma)."),
    BOOL("lines.rejoin", line_rejoin, 0,
         "A line's number is its tracker's own: one that was lost comes back under another. Two landmarks, one lost "
         "before "
         "the other was first seen, that lie at one place as far as is known, are one line."),
    ENUM("consistency", consistency, WM_SLAM_INVARIANT, WM_SLAM_PLAIN, kConsistency,
         "invariant: the right-invariant filter, which knows what it can't know (the map's heading and place); plain: "
         "the textbook's, which becomes too sure of its heading (for comparison)."),
    BOOL(
        "recover.on", recover, 1,
        "Detect that observations contradict the pose (the robot was carried off or pushed): hold the map, state LOST, "
        "and search the pose on the map."),
    F64("dead_reckoning_after_s", dead_reckoning_after_s, 2, 0, 3600,
        "Nothing fused for so long: the state says dead reckoning."),
};

static const wm_param_old kOld[] = {
    {"states.wheel_difference_sigma", NULL, "slam never read it; landmark_ekf and odometry have it"},
    {"states.wheel_difference_walk", NULL, "slam never read it; landmark_ekf and odometry have it"},
    {"association.unknown", "/sightings.use.unidentified", NULL},
    {"markers.lasting", "markers.correlated", NULL},
    {"states.*", "/motion.states.*", NULL},
    {"states.*", "/sightings.states.*", NULL},
    {"use.*", "/sightings.use.*", NULL},
    {"noise.*", "/sightings.noise.*", NULL},
    {"lasting.*", "/sightings.correlated.*", NULL},
    {"gate.*", "/sightings.gate.*", NULL},
    {NULL, NULL, NULL},
};

const wm_param_table wm_slam_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), kOld};
