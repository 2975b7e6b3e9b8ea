// SPDX-License-Identifier: Apache-2.0
#include "sensors/sighting_params.h"

#include "param_rows.h"

typedef struct wm_sighting_params params;

// Rows of a state of the table in sensor_states.h: the sigma at its start, and its random walk where it has one.
// clang-format off
#define WALK_CONSTANT(state, key, unit)
#define WALK_WALK(state, key, unit) \
  F64("states." key "_walk" unit, states.walk[WM_SENSOR_ROW_##state], 0, 0, 1, \
      "Random walk of that state per sqrt(s). 0: it is constant."),
#define ONE(state, key, unit, name, neutral, low, high, noise, initial, most, text) \
  F64("states." key "_sigma" unit, states.sigma[WM_SENSOR_ROW_##state], initial, (initial) < 0 ? -(most) : 0, most, \
      text), \
  WALK_##noise(state, key, unit)
#define TWO(state, second, key, unit, name, name2, neutral, low, high, noise, initial, most, text) \
  ONE(state, key, unit, name, neutral, low, high, noise, initial, most, text)
// clang-format on

static const char *const kUnidentified[] = {"false", "true", "auto", NULL};

static const wm_param kParams[] = {
    BOOL("use.bearing", use_bearing, 1, "Fuse bearings."),
    BOOL("use.range", use_range, 1, "Fuse ranges. In SLAM without them, landmarks join once their parallax suffices."),
    BOOL("use.elevation", use_elevation, 0,
         "Fuse elevations, of sightings without a range, where the map has the landmark's height: the height above "
         "the sensor gives the distance. The robot's tilt and the heights of the map's slots become states."),
    ENUM("use.unidentified", use_unidentified, WM_UNIDENTIFIED_AUTO, WM_UNIDENTIFIED_AUTO, kUnidentified,
         "Fuse sightings without an identity, each with the one landmark that fits where no other does. auto: in slam "
         "those of sensors that give no identities (one that does could not read it), else all."),
    F64("noise.bearing_default_rad", bearing_sigma_default_rad, 0.02, 1e-5, 3,
        "Sigma of a bearing where neither the sighting nor the sensor gives one, rad."),
    F64("noise.range_default_m", range_sigma_default_m, 0.1, 1e-4, 100,
        "Sigma of a range where neither the sighting nor the sensor gives one, m."),
    F64("noise.bearing_factor", bearing_sigma_factor, 1, 0.01, 100,
        "Factor of the bearing's sigma. More than 1 where successive errors are correlated and not modelled."),
    F64("noise.range_factor", range_sigma_factor, 1, 0.01, 100, "Factor of the range's sigma."),
    F64("noise.range_rel", range_sigma_rel, 0, 0, 1,
        "Sigma of a range as a fraction of the range; the variances are added."),
    F64("noise.lateral_m", lateral_sigma_m, 0, 0, 10,
        "Sigma of a landmark's place across the line of sight, m, from its breadth. Adds (this / distance)^2 to the "
        "bearing's variance."),
    F64("noise.map_min_m", map_sigma_min_m, 0, 0, 10,
        "Lower limit of a known landmark's sigma, m, for maps whose sigmas are too small."),
    // clang-format off
    WM_SENSOR_STATES(ONE, TWO)
    // clang-format on
    F64("states.tilt_sigma_rad", tilt_sigma_rad, 0.007, 0, 1,
        "Sigma of the robot's roll and pitch on its springs and on the ground, rad: 0.4 degrees for a car that brakes, "
        "bends or is loaded on one side. States with use.elevation, else unused."),
    F64("states.tilt_tau_s", tilt_tau_s, 2, 0.01, 1e6, "Time after which such a tilt has fallen to 1/e, s."),
    I32("states.map_slots", map_slots, 16, 0, 24,
        "Landmarks (the last seen ones) whose error on the map, by their sigma_m, is carried as states. That of a "
        "landmark beyond them counts as noise, the larger the more often it is seen."),
    I32("correlated.slots", correlated_slots, 16, 0, 24,
        "Pairs of sensor and landmark (the last seen ones) whose time-correlated error is carried as Gauss-Markov "
        "states. 0: no error is time-correlated."),
    F64("correlated.bearing_rad", correlated_bearing_rad, -1, -10, 3,
        "Sigma of a bearing's time-correlated error, rad. 0: none. Below 0: that multiple of the bearing's sigma; flat "
        "from 0.5 to 1."),
    F64("correlated.lateral_m", correlated_lateral_m, 0.02, 0, 10,
        "Sigma of the time-correlated error across the line of sight, m; the variances are added. Not in slam of "
        "bearings alone that state their sigmas: an edge has no breadth."),
    F64("correlated.range_m", correlated_range_m, -0.5, -10, 100,
        "Sigma of a range's time-correlated error, m. Below 0: that multiple of the range's sigma."),
    F64("correlated.range_rel", correlated_range_rel, 0.01, 0, 1,
        "The same as a fraction of the range, where a sighting has a bearing, too; the variances are added."),
    F64("correlated.tau_s", correlated_tau_s, 2, 0.01, 1e6, "Time constant of these errors, s."),
    F64("gate.soft", gate_soft, 9, 1, 1e6,
        "Normalised innovation squared for two degrees of freedom above which the noise is inflated, as for a "
        "distribution with long tails; scaled for one and three. 99 % of correct measurements lie below 9.2."),
    F64("gate.hard", gate_hard, 50, 1, 1e6, "The same, above which a measurement is an outlier and rejected."),
};

const wm_param_table wm_sighting_params_table = {kParams, sizeof kParams / sizeof kParams[0], sizeof(params), NULL};
