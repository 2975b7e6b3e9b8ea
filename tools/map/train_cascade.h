// SPDX-License-Identifier: Apache-2.0
// `waymark map train-cascade`: a cascade for a class of landmarks, from labelled recordings.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace wm::tools {

struct TrainCascade {
  std::vector<std::string> recordings;
  std::vector<double> size_m;  // width, height of the class
  std::string out;
  int rows_px = 24;         // of a window
  double margin = 0.15;     // of the landmark's size, on each side
  double size_min_px = 10;  // of a window in the middle of the picture, as the detector's
  double facing_min = 0.5;  // cosine of the slant up to which it shall be known
  int stages = 20, pictures = 300, others = 2500, things = 2500;
  uint64_t seed = 1;
};

// Windows about the labelled landmarks whose size in landmarks/appearance.csv is `size_m`, against windows of the same
// pictures that show none of them and that the stages before let through. Needs of each recording: video,
// calibration.yaml, truth.csv, truth-landmarks.csv (else landmarks.csv), landmarks/appearance.csv,
// labels/landmarks.csv. Writes the cascade and prints a line a stage. Throws Failure. Some minutes.
void train_cascade(const TrainCascade &arguments);

}  // namespace wm::tools
