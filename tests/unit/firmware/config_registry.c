// SPDX-License-Identifier: Apache-2.0
// Estimators and motion parameters of the test's own making, so that the tests of the configuration don't change with
// the real ones' parameters.
#include "config_registry.h"

#include <stddef.h>
#include <string.h>

static const char *const kModels[] = {"plain", "robust", NULL};

#define FIELD(field) offsetof(registry_params, field)
static const wm_param kParams[] = {
    {"gate", WM_PARAM_F64, FIELD(gate), 9.0, 0.0, 1000.0, NULL, "Gate."},
    {"states.yaw_sigma_rad", WM_PARAM_F64, FIELD(yaw_sigma_rad), 0.1, 0.0, 3.2, NULL, "Yaw, rad."},
    {"states.slots", WM_PARAM_I32, FIELD(slots), 2, 0, 16, NULL, "Slots."},
    {"states.deep.on", WM_PARAM_BOOL, FIELD(on), 1, 0, 1, NULL, "On."},
    {"model", WM_PARAM_ENUM, FIELD(model), 0, 0, 1, kModels, "Model."},
};
static const wm_param_old kOld[] = {
    {"gate_sigmas", "gate", NULL},
    {"states.places", "states.slots", "at most 16 by now"},
    {"walls.weight", "model", NULL},
    {"walls.image_share", NULL, "images are found by their number."},
    {"states.*", "/motion.states.*", NULL},
    {"states.*", "/sightings.states.*", NULL},
    {"lasting.*", "/sightings.correlated.*", NULL},
    {NULL, NULL, NULL},
};
static const wm_param kOtherParams[] = {
    {"window_s", WM_PARAM_F64, 0, 5.0, 0.1, 60.0, NULL, "Window, s."},
};
static const wm_param kMotionParams[] = {
    {"noise.speed_mps", WM_PARAM_F64, 0, 0.02, 0.0, 10.0, NULL, "Noise, m/s."},
    {"states.lag_sigma_s", WM_PARAM_F64, sizeof(double), 0, 0, 1, NULL, "Lag, s."},
    {"states.scale_sigma", WM_PARAM_F64, 2 * sizeof(double), 0, 0, 1, NULL, "Scale."},
};
static const wm_param kSightingParams[] = {
    {"correlated.tau_s", WM_PARAM_F64, 0, 2, 0.0, 10.0, NULL, "Time constant, s."},
    {"states.yaw_walk_rad", WM_PARAM_F64, sizeof(double), 0, 0.0, 10.0, NULL, "Walk, rad."},
};

const wm_param_table wm_motion_params_table = {kMotionParams, 3, 3 * sizeof(double), NULL};
const wm_param_table wm_sighting_params_table = {kSightingParams, 2, 2 * sizeof(double), NULL};
const wm_param_table wm_position_params_table = {NULL, 0, 0, NULL};
const wm_param_table wm_marker_params_table = {NULL, 0, 0, NULL};
const wm_param_table wm_localizer_params_table = {NULL, 0, 0, NULL};
const char *wm_motion_params_clash(const wm_motion_params *params, const char **key) {
  double noise;
  memcpy(&noise, params, sizeof noise);
  if (noise != REGISTRY_CLASH) return NULL;
  *key = "noise.speed_mps";
  return "doesn't go with another";
}

static const wm_estimator kPole = {
    .name = "pole_filter", .about = "Of the test.", .params = {kParams, 5, sizeof(registry_params), kOld}};
static const wm_estimator kCloud = {
    .name = "cloud_filter", .about = "Of the test.", .params = {kOtherParams, 1, sizeof(double), NULL}};
static const wm_estimator *const kAll[] = {&kPole, &kCloud};

const wm_estimator *const *wm_estimators(size_t *count) {
  *count = 2;
  return kAll;
}

// pole_filter takes all but the lag, cloud_filter nothing.
int wm_estimator_reads(const wm_estimator *estimator, const char *key) {
  return estimator == &kPole && strcmp(key, "motion.states.lag_sigma_s") != 0;
}

const wm_estimator *wm_estimator_find(const char *name) {
  for (size_t i = 0; i < 2; i++)
    if (strcmp(kAll[i]->name, name) == 0) return kAll[i];
  return NULL;
}
