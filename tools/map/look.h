// SPDX-License-Identifier: Apache-2.0
// Where the landmarks of a map are in one picture, and why others aren't: for who taught a map.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace wm::tools {

struct LookAtPicture {
  std::filesystem::path map;  // the folder with landmarks.csv and landmarks/, or the landmarks.csv
  std::string picture, calibration, camera;
  // x, y (m), heading (degrees) of base_link in the map when the picture was taken; empty: searched everywhere.
  std::vector<double> pose;
  double mounting_deg = 0;  // how far the camera may be turned against its calibration; 0: as a run does
  double sigma_m = 0.05, sigma_deg = 1;
  std::string draw;  // a PNG to write; empty: none
};

// Runs the detector `landmarks` as a run would, prints what became of each landmark and draws it. Returns how many were
// found. Throws Failure.
int look_at_picture(const LookAtPicture &wanted);

}  // namespace wm::tools
