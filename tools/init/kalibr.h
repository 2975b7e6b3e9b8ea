// SPDX-License-Identifier: Apache-2.0
// Where the cameras of a Kalibr camchain sit to each other and to the IMU, and how their clocks differ.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/flat_file.h"
#include "images/types.h"

namespace wm::init {

struct ChainCamera {
  std::string name;                      // cam0 ...
  std::optional<images::Pose> in_imu;    // its optical frame in the IMU's
  std::optional<images::Pose> in_first;  // its optical frame in that of the first camera
  std::optional<double> shift_s;         // time of the IMU = time of the camera + shift
};

// Empty where the file is no camchain. Throws tools::Failure with file, line and key.
std::vector<ChainCamera> read_chain(const calibrate::FlatFile &file);

}  // namespace wm::init
