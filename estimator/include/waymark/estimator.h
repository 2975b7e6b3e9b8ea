// SPDX-License-Identifier: Apache-2.0
// The estimator contract. An estimator is a struct of functions and a size. It gets events in the order of their t_ns
// and gives the robot's pose. It has no clock, no file, no thread, no lock, no heap and no printf; its state is plain
// memory that a copy of continues identically (it may point into the setup, never into itself); the same events give
// the same bits on every machine. All functions are for one thread at a time.
#ifndef WAYMARK_ESTIMATOR_H
#define WAYMARK_ESTIMATOR_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/event.h"
#include "waymark/motion.h"
#include "waymark/params.h"
#include "waymark/pose.h"
#include "waymark/setup.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// `sightings:` of the config: noise, calibration states, time-correlated errors and gates of sightings, for every
// estimator that takes them. The fields and their meaning are in wm_sighting_params_table (sensors/sighting_params.c).
typedef struct wm_sighting_params wm_sighting_params;
extern const wm_param_table wm_sighting_params_table;
// `positions:`, of receivers (GNSS) and compasses, and `markers:`, of coded markers; likewise.
typedef struct wm_position_params wm_position_params;
extern const wm_param_table wm_position_params_table;
typedef struct wm_marker_params wm_marker_params;
extern const wm_param_table wm_marker_params_table;
// `localizer:`, of the poses of another localizer.
typedef struct wm_localizer_params wm_localizer_params;
extern const wm_param_table wm_localizer_params_table;

typedef struct wm_floor_plan wm_floor_plan;

// What belongs to a robot and a place. Must live, unchanged, as long as the estimator's state.
typedef struct wm_setup {
  const wm_motion_params *motion;
  const wm_sighting_params *sightings;
  const wm_position_params *positions;   // NULL: the defaults
  const wm_marker_params *markers;       // NULL: the defaults
  const wm_localizer_params *localizer;  // NULL: the defaults
  wm_wheels wheels;
  const wm_sensor *sensors;
  size_t sensor_count;
  const wm_landmark *landmarks;
  size_t landmark_count;
  const wm_rig *rig;     // cameras and what else calibration.yaml has; NULL where nothing is known
  const wm_raster *map;  // NULL where there is none
  wm_start start;
  uint64_t seed;
  const wm_floor_plan *floors;  // of a robot that changes between floors; NULL: the map above is its only one
} wm_setup;

// The floors of a building, for an estimator over several (waymark/carrier.h).
struct wm_floor_plan {
  const struct wm_estimator *estimator;  // of each floor
  const wm_setup *setups;                // a floor each: they differ in landmarks and map alone, and have no `floors`
  size_t count;                          // at most WM_FLOORS_MAX
  const wm_floor_end *ends;              // those of one connection stand together
  size_t end_count;
  int64_t start;  // floor of the start; -1: unknown. 64 bits: no padding
};

// A particle: one possible pose.
typedef struct wm_particle {
  double x_m, y_m, heading_rad;  // base_link in map
  double weight;                 // of all of them: 1
} wm_particle;

// A pose that may be the robot's besides the estimate.
typedef struct wm_hypothesis {
  double x_m, y_m, heading_rad;  // base_link in map at the last observation
  double covariance[6];          // xx, xy, yy, x heading, y heading, heading heading, if it is there: m2, m rad, rad2
  double weight;                 // its probability
} wm_hypothesis;

typedef struct wm_estimator {
  const char *name;  // `estimator:` in the config, and the key of its parameters there
  const char *about;
  uint32_t takes;  // WM_EVENT_BIT of each observation that it takes; motion is always taken
  wm_param_table params;
  // Parameters of the shared sections (motion, sightings, positions, markers) that it reads, as beginnings of their
  // keys
  // ("sightings.noise."); behind a '!' such that it does not. The first that fits decides; NULL ends the list.
  const char *const *reads;

  // Bytes of state for these parameters and this setup; 0 with *why set (a constant string) if they don't go together.
  size_t (*state_bytes)(const void *params, const wm_setup *setup, const char **why);
  // Makes the state in `state` (16-byte aligned, state_bytes long). The only function that may take long.
  wm_status (*init)(void *state, const void *params, const wm_setup *setup);
  // A motion event: the state goes to its t_ns. WM_TIME_RAN_BACK, WM_NOT_FINITE, WM_OUT_OF_RANGE: nothing changed.
  wm_status (*predict)(void *state, const wm_event *motion);
  // An observation, SET_POSE or RESET: the state goes to its t_ns and is corrected. Each scalar update writes one
  // record to `out` (at most `capacity`, *count says how many). A refused datum changes nothing but its counters.
  wm_status (*correct)(void *state, const wm_event *observation, wm_innovation *out, size_t capacity, size_t *count);
  // Mean, covariance and state of health at the time of the last event.
  void (*estimate)(const void *state, wm_estimate *out);
  // What is known of the motion sensors, for the predictor.
  void (*motion)(const void *state, wm_motion_calibration *out);
  // Calibration states with their sigmas; returns how many there are, of which at most `capacity` are written.
  size_t (*calibration)(const void *state, wm_calibration_value *out, size_t capacity);
  // What contradicts itself by these values; returns how many there are, at most WM_ALARMS_MAX, of which at most
  // `capacity` are written. NULL where the estimator has none.
  size_t (*alarms)(const void *state, wm_alarm *out, size_t capacity);
  // Health flags of the motion sensors: bits of WM_MOTION_HEALTH_*.
  uint32_t (*motion_health)(const void *state);
  // Counters; returns how many there are, of which at most `capacity` are written. NULL where the estimator has none.
  size_t (*counters)(const void *state, wm_counter *out, size_t capacity);
  // SLAM: landmarks estimated, with their covariances (xx, xy, yy in m2, heading in rad2; NaN where there is none);
  // returns how many there are. NULL where the estimator has none.
  size_t (*landmarks)(const void *state, wm_landmark *out, double (*covariance)[4], size_t capacity);
  // Particles, for who draws them; returns how many there are. NULL where the estimator has none.
  size_t (*particles)(const void *state, wm_particle *out, size_t capacity);
  // Other poses that explain the observations about as well as the estimate; returns how many there are.
  // NULL where the estimator has none.
  size_t (*hypotheses)(const void *state, wm_hypothesis *out, size_t capacity);
  // The floor of the estimate, and its probability. NULL where the estimator knows one floor alone.
  int (*floor)(const void *state, double *probability);
} wm_estimator;

#define WM_INNOVATIONS_PER_EVENT_MAX 8

// All registered estimators; constant.
const wm_estimator *const *wm_estimators(size_t *count);
// By name, or NULL.
const wm_estimator *wm_estimator_find(const char *name);
// Whether an estimator reads this parameter of a shared section ("motion.noise.speed_mps").
int wm_estimator_reads(const wm_estimator *estimator, const char *key);

#ifdef __cplusplus
}
#endif

#endif
