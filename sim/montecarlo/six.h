// SPDX-License-Identifier: Apache-2.0
// A drive in six degrees of freedom, for an estimator that is run by hand.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "montecarlo/montecarlo.h"
#include "simulate/simulate.h"

namespace wm::montecarlo {

// calibration.yaml's part that the estimator needs: the pair of the scenario's stereo sensor.
wm_rig rig_of(const sim::Scenario &scenario);
// What an estimator begins a drive with, without sensors and landmarks. `rig` has to outlive it.
wm_setup setup_of(const sim::Scenario &scenario, const wm_config &config, const sim::Recording &recording,
                  const wm_rig *rig);
// By stamp, motion first, then as the sources stand.
std::vector<wm_event> events_of(const sim::Recording &recording);

struct Error6 {
  Eigen::Vector3d position, rotation;
  double nees;  // of six degrees of freedom
};
Error6 error_of(const wm_estimate &estimate, const sim::State6 &truth);

}  // namespace wm::montecarlo
