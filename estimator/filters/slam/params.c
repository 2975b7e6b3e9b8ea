// SPDX-License-Identifier: Apache-2.0
#include "filters/slam/params.h"

#include "param_rows.h"

typedef struct wm_slam_params params;

static const char *const kConsistency[] = {"invariant", "plain", NULL};
static const char *const kMaps[] = {"none", "extend", "frozen", NULL};
static const char *const kRejoin[] = {"false", "true", "auto", NULL};
static const char *const kMethods[] = {"unscented", "linear", "inverse_distance", NULL};

static const wm_param kParams[] = {
    F64("states.wheel_slip_sigma", wheel_slip_sigma, 0, 0, 1,
        "For ticks: sigma of each wheel's scale about its mean, Gauss-Markov; the mean is a state, too. Slip that "
        "lasts for seconds, where noise.ticks_per_sqrt_m is independent with each tick. 0: off."),
    F64("states.wheel_slip_tau_s", wheel_slip_tau_s, 5, 0.01, 1e6, "Time constant of that, s."),
    F64("states.sensor_stamp_sigma_s", sensor_stamp_sigma_s, 0, 0, 1,
        "Sigma of the error of each picture's stamp, s: the same for all that is seen in it, independent between "
        "pictures. 0: off."),
    ENUM("landmarks.map", map, WM_SLAM_MAP_NONE, WM_SLAM_MAP_FROZEN, kMaps,
         "Use of landmarks.csv. none: not used; extend: its landmarks are in the state from the start, with their "
         "covariance, and new ones join; frozen: they are considered, not corrected, and only the robot is located."),
    I32("landmarks.capacity", landmark_capacity, 700, 1, 2000,
        "Largest number of landmarks; a further one is counted and left out. Memory grows with its square, the cost of "
        "a correction with the square of the number in the state."),
    I32("landmarks.confirm_seen", confirm_seen, 3, 1, 1000, "Observations after which a landmark is confirmed."),
    F64("landmarks.leave_after_s", leave_after_s, 10, 0.1, 1e6,
        "An unconfirmed landmark that was not seen for so long is removed, s."),
    I32("landmarks.moved_after", moved_after, 12, 2, 1000,
        "Outliers of a landmark in a row, while others fit, after which it has moved: it is removed, counted, and "
        "joins anew where it is."),
    F64("association.gate", associate_gate, 9.2, 1, 1000,
        "Largest NIS at which a sighting without identity (sightings.use.unidentified) is associated with the nearest "
        "landmark; no other landmark may be near, and no other sighting of the same stamp associated with it."),
    F64("association.new_gate", new_gate, 40, 1, 1e6,
        "NIS of the nearest landmark above which the sighting is of a new one. Between the two gates it is ignored."),
    F64("association.near_m", associate_near_m, 8, 0.01, 1000,
        "Landmarks farther than this from the sighting's place are not compared with it, m."),
    F64("association.max_range_m", associate_max_range_m, 1e4, 0.1, 1e6,
        "Largest range of a sighting without identity, m: far ones are few pixels or one beam wide."),
    I32("lines.clones", line_clones, 30, 0, 40,
        "Largest number of past poses kept in the state for landmarks seen by bearings alone, from the first such "
        "bearing on; fewer where the robot's 192 states have no room for them. 12 to 24 suffice. 0: such landmarks are "
        "not used."),
    I32("lines.poses", line_poses, 6, 3, 8, "Largest number of poses from which a landmark is initialised."),
    ENUM("lines.method", line_method, WM_SLAM_LINE_INVERSE_DISTANCE, WM_SLAM_LINE_INVERSE_DISTANCE, kMethods,
         "How such a landmark joins. unscented: once the parallax suffices, by the unscented transform over poses and "
         "bearings; linear: the same by one linearisation (for comparison); inverse_distance: at once, as a ray with "
         "the inverse of its length, which corrects the heading where dead reckoning drifts fast."),
    F64("lines.near_m", line_near_m, 0.5, 0.01, 1000,
        "inverse_distance: landmarks are rarely nearer than this when first seen, m."),
    F64("lines.patience_s", line_patience_s, 10, 0.1, 1e6,
        "inverse_distance: a ray not seen for so long begins anew, s; its bearing is too far from linear by then."),
    F64("lines.parallax_rad", line_parallax_rad, 0.15, 0.001, 3,
        "Smallest angle at which the lines of sight must cross before a landmark joins, rad."),
    F64("lines.step_m", line_step_m, 0.15, 0.001, 100, "Distance between two poses that are kept, m."),
    F64("lines.sigma_rel", line_sigma_rel, 0.15, 0.001, 1,
        "Largest sigma of a landmark's place before it joins, as a part of its distance."),
    ENUM("lines.rejoin", line_rejoin, WM_SLAM_REJOIN_AUTO, WM_SLAM_REJOIN_AUTO, kRejoin,
         "A line's number is its tracker's own and changes when it was lost. Two landmarks, one lost before the other "
         "was first seen, are merged where their places agree within their covariance. auto: so for bearings without a "
         "range, on no given map, until two identities come back after 5 s out of sight."),
    ENUM("consistency", consistency, WM_SLAM_INVARIANT, WM_SLAM_PLAIN, kConsistency,
         "invariant: the right-invariant filter, consistent in the unobservable heading and place of the map; plain: "
         "the textbook's, which gains false certainty of its heading (for comparison)."),
    BOOL("recover.on", recover, 1,
         "Detect that observations contradict the pose (a kidnapped or pushed robot): hold the map, state LOST, search "
         "the pose on the map."),
    F64("dead_reckoning_after_s", dead_reckoning_after_s, 2, 0, 3600,
        "Time without a fused observation after which the state is dead reckoning, s."),
};

static const wm_param_old kOld[] = {
    {"states.wheel_difference_sigma", NULL, "slam never read it; landmark_ekf and odometry have it"},
    {"states.wheel_difference_walk", NULL, "slam never read it; landmark_ekf and odometry have it"},
    {"markers.on", NULL, "markers are taken wherever a sensor gives them"},
    {"association.unknown", "/sightings.use.unidentified", NULL},
    {"markers.lasting", "/markers.correlated", NULL},
    {"markers.*", "/markers.*", NULL},
    {"states.*", "/motion.states.*", NULL},
    {"states.*", "/sightings.states.*", NULL},
    {"use.*", "/sightings.use.*", NULL},
    {"noise.*", "/sightings.noise.*", NULL},
    {"lasting.*", "/sightings.correlated.*", NULL},
    {"gate.*", "/sightings.gate.*", NULL},
    {NULL, NULL, NULL},
};

const wm_param_table wm_slam_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), kOld};
