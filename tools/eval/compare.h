// SPDX-License-Identifier: Apache-2.0
// A run's poses held against truth, stamp by stamp. docs/eval.md defines each figure.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/pose.h"
#include "common/run_folder.h"

namespace wm::tools {

enum class Alignment { kNone, kSe2, kSim2, kSe3 };

// map' = scale R map + t.
struct Similarity {
  double scale = 1;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();

  [[nodiscard]] Pose operator()(const Pose &pose) const;
};

// The similarity that brings `from` closest to `to` in the sense of least squares (S. Umeyama, Least-squares estimation
// of transformation parameters between two point patterns, PAMI 13(4), 1991, equations 40 to 43). kSe2 and kSim2 turn
// about z and move in x and y only. Throws Failure where the points don't determine it.
Similarity align(const std::vector<Eigen::Vector3d> &from, const std::vector<Eigen::Vector3d> &to, Alignment kind);

// The run against truth at one stamp. NaN where something is not defined.
struct Sample {
  Pose estimate;                 // interpolated and aligned
  Pose truth;                    // of base_link
  Eigen::Vector3d error_m;       // estimate minus truth, map axes; z is 0 in the plane
  double along_m, across_m;      // the same along the true heading and to its left
  double heading_error_rad;      // estimate minus truth, (-pi, pi]
  Eigen::Vector3d rotation_rad;  // rotation vector of R_est^T R_true, in the estimate's body axes
  double nees;                   // squared error in units of the stated covariance
};

struct Comparison {
  bool planar = true;
  int nees_dof = 0;  // 3 or 6 with orientation, 2 or 3 without
  int64_t start_ns = 0;
  size_t stamps = 0;                    // truth stamps in the part judged
  size_t covariances_not_positive = 0;  // stamps whose covariance is no covariance
  std::vector<Pose> truth;              // of the part judged
  std::vector<Sample> samples;          // stamps with a pose
  Similarity alignment;
};

struct CompareOptions {
  Alignment align = Alignment::kNone;
  std::optional<double> from_s, to_s;  // seconds from the run's first pose
  Eigen::Vector3d truth_offset_m = Eigen::Vector3d::Zero();
  bool against_gnss = false;  // positions only, and no NEES: GNSS has errors of its own
};

// Throws Failure where there is nothing to compare.
Comparison compare(const Trajectory &run, const std::vector<Pose> &truth, const CompareOptions &options);

}  // namespace wm::tools
