// SPDX-License-Identifier: Apache-2.0
// Where the vehicle of a simulated drive is, on wheels or in the water.
#pragma once

#include <Eigen/Geometry>

#include "simulate/random.h"
#include "simulate/simulate.h"

namespace wm::sim {

// Rz(yaw)·Ry(pitch)·Rx(roll) and a place. The same bits on every machine.
Eigen::Isometry3d pose_of(const double xyz_m[3], const double rpy_rad[3]);

// base_link in map, t_s after the start of the recording.
Eigen::Isometry3d true_pose(const Recording &recording, double t_s);

// A mounting as it is: turned about each of its axes and moved along each, by what the seed draws for camera `number`.
Eigen::Isometry3d true_mounting(const Eigen::Isometry3d &believed, const Errors &errors, uint64_t seed,
                                uint64_t number);

// How far off the start is by `errors.start_within_m`: anywhere in a disc (2 axes) or a ball (3), each place as likely.
void start_away(const Errors &errors, const Random &random, int axes, double out_m[3]);

// The way that the seed draws, as the scenario's `rounds` describe it.
Path6 swum_path(const Rounds &rounds, uint64_t seed);

}  // namespace wm::sim
