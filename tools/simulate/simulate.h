// SPDX-License-Identifier: Apache-2.0
// A scenario and a seed become what the robot's sensors said, and the truth. All in memory; write.h makes a recording.
#pragma once

#include <string>
#include <vector>

#include "simulate/route.h"
#include "simulate/scenario.h"
#include "waymark/can.h"

namespace wm::sim {

struct Sighting {
  wm_time_ns t_ns, arrival_ns;
  uint16_t sensor;
  int32_t id;
  double bearing_rad;
  bool outlier;  // for statistics only; not written
};

struct Truth {
  wm_time_ns t_ns;
  State state;
};

// What the seed drew: for tests and for the bound, never for an estimator.
struct Drawn {
  double wheel_radius[2];  // relative, left and right
  double track;            // relative
  double yaw_rate_bias_radps;
  double steering_offset_rad;
  std::vector<double> camera_yaw_rad;
};

struct Recording {
  uint64_t seed;
  Drive drive;  // the truth at any time since clock_start_ns
  wm_time_ns clock_start_ns;
  std::vector<wm_can_frame> can;       // by arrival
  std::vector<Sighting> sightings;     // by arrival
  std::vector<wm_sensor> sensors;      // as calibration.yaml says
  std::vector<wm_landmark> map;        // with its errors
  std::vector<wm_landmark> landmarks;  // true
  std::vector<Truth> truth;
  wm_start start;  // as recording.yaml says
  Drawn drawn;
};

// `landmarks`: how many of the scenario's landmarks are there, the first ones; more than it has means all.
// The same scenario, seed and number give the same recording; sensors draw independently, so that what the wheels say
// doesn't change with the landmarks. WM_BAD_CONFIG when the route can't be driven.
wm_status simulate(const Scenario &scenario, uint64_t seed, size_t landmarks, Recording &out, wm_error *err);

}  // namespace wm::sim
