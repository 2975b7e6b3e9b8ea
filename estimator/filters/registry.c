// SPDX-License-Identifier: Apache-2.0
#include "filters/registry.h"

#include <string.h>

static const wm_estimator *const kEstimators[] = {&wm_odometry_estimator, &wm_landmark_ekf_estimator,
                                                  &wm_edge_mcl_estimator, &wm_pf_edges_estimator,
                                                  &wm_slam_estimator,     &wm_stereo_ekf_estimator};
static const size_t kCount = sizeof kEstimators / sizeof kEstimators[0];

const wm_estimator *const *wm_estimators(size_t *count) {
  *count = kCount;
  return kEstimators;
}

int wm_estimator_reads(const wm_estimator *estimator, const char *key) {
  for (const char *const *at = estimator->reads; at && *at; at++) {
    const int is_not = **at == '!';
    const size_t length = strlen(*at + is_not);
    if (strlen(key) >= length && memcmp(key, *at + is_not, length) == 0) return !is_not;
  }
  return 0;
}

const wm_keeper *wm_keeper_of(const wm_estimator *estimator) {
  if (estimator == &wm_slam_estimator) return &wm_slam_keeper;
  return estimator == &wm_stereo_ekf_estimator ? &wm_stereo_ekf_keeper : NULL;
}

const wm_carrier *wm_carrier_of(const wm_estimator *estimator) {
  return estimator == &wm_landmark_ekf_estimator ? &wm_landmark_ekf_carrier : NULL;
}

const wm_estimator *wm_estimator_find(const char *name) {
  for (size_t i = 0; i < kCount; i++)
    if (strcmp(kEstimators[i]->name, name) == 0) return kEstimators[i];
  return NULL;
}
