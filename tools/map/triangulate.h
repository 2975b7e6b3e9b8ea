// SPDX-License-Identifier: Apache-2.0
// Places of landmarks from bearings that were taken from known poses: each landmark with covariance, and the mounting
// of each sensor with it, as far as the bearings say something of it.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <string>
#include <vector>

#include "common/pose.h"

namespace wm::tools {

struct BearingSensor {
  std::string name;
  Eigen::Vector3d xyz_m, rpy_rad;  // mounting in base_link
};

struct TakenBearing {
  int64_t t_ns;
  size_t sensor, landmark;        // from 0
  double bearing_rad, sigma_rad;  // in the sensor's own level of x and y, as the detectors tell it
  Eigen::Vector2d twist_mps;      // of the robot in map: what a late stamp is worth ...
  double turn_radps;              // ... and this
  Pose pose;                      // base_link in map at its stamp
  // Found by triangulate():
  double residual_rad = 0, expected_sigma_rad = 0;
  bool fits = true;
};

struct SurveyPriors {
  double yaw_rad = 0.009, tilt_rad = 0.009, place_m = 0.01;  // of each mounting: half a degree, a centimetre
  double angle_scale = 0.002, late_s = 0.02;                 // focal length; a clock that is off
  double pose_m = 0.002, pose_rad = 0.0005;                  // of each pose
};

struct SurveyedPlace {
  Eigen::Vector3d p_m;         // z as it was given
  Eigen::Matrix2d covariance;  // of x and y
  bool found = false;          // from at least two directions
};

// The place of one landmark that most of its bearings agree with (a degree), from pairs of them. Not found: all of one
// direction.
SurveyedPlace agreed_place(const std::vector<BearingSensor> &sensors, const std::vector<TakenBearing *> &bearings,
                           double z_m);

// Refines all places and the sensors' mountings together (Gauss-Newton; a bearing off by several sigmas weighs little:
// Geman and McClure). Marks what doesn't fit. Covariances take in the mountings' errors, and grow where the residuals
// are larger than they should be. Cost: some ms a thousand bearings.
void triangulate(const std::vector<BearingSensor> &sensors, const SurveyPriors &priors,
                 std::vector<TakenBearing> &bearings, std::vector<SurveyedPlace> &places);

// Where a sensor should see a place, rad.
double bearing_to(const BearingSensor &sensor, const Pose &pose, const Eigen::Vector3d &place_m);

}  // namespace wm::tools
