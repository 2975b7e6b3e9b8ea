// SPDX-License-Identifier: Apache-2.0
// `waymark eval --detector edges` and `lines`: from folders to figures.
#pragma once

#include <string>
#include <vector>

#include "eval/figures.h"

namespace wm::tools {

struct DetectorArguments {
  std::string run, recording, camera;
  std::vector<double> view_m;  // x from, x to, y from, y to in base_link; empty: all of the floor
};

// Reads RUN/detections/CAMERA-edges.csv, REC/labels/edges.csv and REC/calibration.yaml. Throws Failure.
Figures evaluate_detector(const DetectorArguments &arguments);
// Reads RUN/events.wmlog, REC/labels/lines.csv, REC/video, truth.csv and truth-landmarks.csv. Throws Failure.
Figures evaluate_lines(const DetectorArguments &arguments);

}  // namespace wm::tools
