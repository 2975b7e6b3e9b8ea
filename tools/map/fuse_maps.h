// SPDX-License-Identifier: Apache-2.0
// Maps of many drives as one, by their information matrices: each drive's map is a measurement of the landmarks in a
// frame of its own, whose pose is an unknown that is eliminated. With measurement m, covariance P, landmarks x and the
// frame's pose T = (t, theta):
//
//   m = h(x, T) + e,  h = (R(theta)' (x_j - t), heading_j - theta),  e ~ N(0, P)
//
// Gauss-Newton over all x and T; the cost is linear in the drives. A drive may not know its map's size: its
// error s d has the direction d = m - centre of the map that it measured. Taken so, the drives' other errors shrink the
// merged map, as d and they are correlated (Peelle's puzzle [DAgostini1994]). So P is carried to the merged places,
// with e = h - m, by P' = T P T', T = I + e g' + J e k': g and k measure size and turn of an error, J turns by 90
// degrees.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "map/drive_map.h"

namespace wm::tools {

// A drive's map with what is computed once.
struct Measured {
  const DriveMap *map;
  Eigen::MatrixXd whitener;   // W with W' W = P^-1
  Eigen::MatrixXd by_shape;   // g and k: 2 columns
  std::vector<int> landmark;  // index in the merged map of each landmark
  Eigen::Vector3d frame{0, 0, 0};
  bool is_fixed = false;  // the frame is the merged map's
};
Measured measured(const DriveMap &map);

struct FusedMap {
  std::vector<int> x_at, heading_at;  // of each landmark: its first state; -1: not in it
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
  // How well each drive fits what the others say, and of how many numbers. 0: it shares nothing that could be compared.
  std::vector<double> chi2;
  std::vector<int> dof;
  [[nodiscard]] bool has(int landmark) const { return x_at[static_cast<size_t>(landmark)] >= 0; }
};
// `landmarks`: how many there are in all. Frames are corrected. Throws Failure where the landmarks are not determined.
FusedMap fuse(const std::vector<Measured *> &drives, int landmarks);

// A drive against a map that it is no part of: the frame that fits best, and how well it does.
struct Fit {
  Eigen::Vector3d frame{0, 0, 0};
  double chi2 = 0;
  int dof = 0;  // 0: it can't be laid over the map
  int shared = 0;
};
Fit fit(const Measured &drive, const FusedMap &map);
// The same map alone.
FusedMap alone(const Measured &drive, int landmarks);

}  // namespace wm::tools
