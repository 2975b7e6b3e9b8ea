// SPDX-License-Identifier: Apache-2.0
// What a run wrote, read back: poses, estimated landmarks, innovations, timing and health.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/pose.h"

namespace wm::tools {

struct Trajectory {
  std::vector<Pose> poses;      // rising strictly in t_ns
  bool planar = true;           // x, y and heading; else six degrees of freedom
  bool has_covariance = false;  // else all covariances are 0 and mean nothing
};

// trajectory.csv, or trajectory.tum where there is no other. Rows with an empty position are no poses; of rows of the
// same stamp the last counts. Throws Failure: neither file there, nothing in it, stamps that run back.
Trajectory load_trajectory(const std::filesystem::path &run);

// reference.csv: the smoothed trajectory. Throws Failure: not there, nothing in it.
Trajectory load_reference(const std::filesystem::path &run);

// A row of published.csv beyond the pose itself.
struct PublishedRow {
  int64_t t_ns, made_ns, fused_until_ns;
  Pose pose;
  Eigen::Vector3d odom;  // x, y, heading; NaN where absent
  int64_t announced;     // counter of announced jumps: resets, and jumps where the file has that column
  int64_t resets;
};

struct Published {
  std::vector<PublishedRow> rows;  // in the order of the file
  Trajectory trajectory;           // the same poses by t_ns, for comparing
  bool strictly_rising = true;     // whether t_ns rose from row to row
};

// published.csv. Throws Failure: not there, nothing in it.
Published load_published(const std::filesystem::path &run);

struct Landmark {
  int64_t id;  // below 0 where it has none
  Eigen::Vector3d p_m;
  Eigen::Matrix2d covariance_xy;  // 0 where not given
  double yaw_rad;                 // NaN where not given
};

// map-estimate.csv or landmarks.csv, truth-landmarks.csv: id, x_m, y_m, z_m and what else is there.
std::vector<Landmark> load_landmarks(const std::filesystem::path &file);

}  // namespace wm::tools
