// SPDX-License-Identifier: Apache-2.0
// How late a GNSS receiver's positions are: its filter and its interface delay them, often by 0.1 to 1 s.
#pragma once

#include <vector>

#include "eval/compare.h"

namespace wm::tools {

struct GnssDelay {
  double delay_s;       // a position stamped t is the place at t - delay_s
  double rms_before_m;  // of the nearest kKept of the positions, at delay 0
  double rms_m;         // the same at delay_s
};

// The delay with which the positions fit the run best. Throws Failure: the run does not determine it (it hardly moves,
// or the best is at an end of the interval), or there is nothing to compare.
GnssDelay find_gnss_delay(const Trajectory &run, const std::vector<Pose> &gnss, const CompareOptions &options);

// The positions at the times when they were true.
std::vector<Pose> without_delay(const std::vector<Pose> &gnss, double delay_s);

}  // namespace wm::tools
