// SPDX-License-Identifier: Apache-2.0
// A landmark into a map, with how it looks in a picture.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace wm::tools {

struct AddLandmark {
  std::filesystem::path
      map;  // the folder with landmarks.csv and landmarks/, created if it is missing; or the landmarks.csv
  int id = -1;
  std::string picture;         // JPEG, PNG or PGM
  std::vector<double> at_m;    // x, y, z of its middle; empty: as landmarks.csv has it already
  std::vector<double> from_m;  // x, y, z of who took the picture; empty: unknown
  std::vector<double> size_m;  // width, height; empty: by the angles, where `from_m` and a calibration are given
  double yaw_deg;              // from its left to its right edge as a reader sees it; NaN: it faces `from_m`
  double sigma_m = 0.02;
  std::vector<double>
      corners_px;  // u, v of upper left, upper right, lower right, lower left; empty: all of the picture
  std::string calibration, camera;  // of the picture; empty: it has no distortion
};

struct AddedLandmark {
  std::filesystem::path picture, appearances, landmarks;
  int width_px, height_px;
  double width_m, height_m, yaw_rad;
  double spread_grey;  // its contrast: standard deviation
};

// Cuts the landmark out as if seen from straight ahead, writes it beside the map and adds a row to appearance.csv and,
// where it is new, to landmarks.csv. A second picture of the same landmark is one more appearance. Throws Failure.
AddedLandmark add_landmark(const AddLandmark &wanted);

}  // namespace wm::tools
