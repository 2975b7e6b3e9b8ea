// SPDX-License-Identifier: Apache-2.0
// Many drives' maps to one (docs/building.md).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "map/associate.h"
#include "map/fuse_maps.h"

namespace wm::tools {

struct MergeOptions {
  bool one_frame = false;  // all drives began in the frame of the first one, and their maps have that start's error
  bool by_place = false;   // ids are not compared
};

struct DriveVerdict {
  std::string name;
  bool is_used = false;
  int landmarks = 0, shared = 0;
  double chi2 = 0;
  int dof = 0;
  std::string why_not;  // "": used
};

struct MergeResult {
  std::vector<Merged> landmarks;  // all that were seen; those that the map has are in it
  FusedMap map;                   // its covariance includes `widened`
  double widened = 1;             // factor of the covariance, where drives differ by more than their covariances
  std::vector<DriveVerdict> drives;
};

// `surveyed` (may be NULL): landmarks at known places, which give the frame. Throws Failure where no two drives fit.
MergeResult merge_maps(const std::vector<DriveMap> &drives, const DriveMap *surveyed, const MergeOptions &options,
                       const std::function<void(const std::string &)> &progress);

}  // namespace wm::tools
