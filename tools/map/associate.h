// SPDX-License-Identifier: Apache-2.0
// Which landmarks of many drives' maps are one.
#pragma once

#include <cstdint>
#include <vector>

#include "map/fuse_maps.h"

namespace wm::tools {

struct Merged {
  int64_t id;
  double z_sum_m = 0, z_weight = 0;
  int drives = 0;
};

// Landmarks of all drives so far, as a list. By id.
void associate_by_id(const DriveMap &drive, std::vector<Merged> *known, std::vector<int> *landmark);
// A landmark, where the first drive that has it puts it.
struct KnownPlace {
  Eigen::Vector2d p_m;
  Eigen::Matrix2d covariance;
  int landmark;
};
std::vector<KnownPlace> places_known(const DriveMap &drive, const std::vector<int> &landmark);
// By place: a rigid motion that lays the most landmarks over those that are known, within both covariances, then pairs
// that are each other's nearest within the gate of chi-square. Landmarks without a pair are new; those of a drive that
// fits nowhere all are, and their places are not compared with.
void associate_by_place(const DriveMap &drive, std::vector<KnownPlace> *places, std::vector<Merged> *known,
                        std::vector<int> *landmark);

}  // namespace wm::tools
