// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/estimator.h"

// The test's motion parameters don't go together where noise.speed_mps is this.
#define REGISTRY_CLASH 6.5

// Parameters of the test's estimator "pole_filter".
typedef struct registry_params {
  double gate;
  double yaw_sigma_rad;
  int32_t slots, on, model;
} registry_params;
