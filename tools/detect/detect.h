// SPDX-License-Identifier: Apache-2.0
// Detectors on pictures, without a filter: each detection as a row of a CSV and drawn into its picture.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "config/config.h"
#include "detect/input.h"

namespace wm::tools {

enum class Drawing { none, jpg, png, avi };

struct DetectWish {
  InputWish input;
  std::string config;             // a configuration with `vision:`; or "":
  std::string detector;           // this detector, with
  std::vector<std::string> sets;  // parameters "KEY=VALUE"
  std::string out, poses;         // folder to write to; folder of a run or recording, for guided detectors
  std::string draw = "auto";      // none, jpg, png, avi; auto: avi, of a folder of pictures jpg
  int every = 1;
  double rate_hz = 10;  // of the AVI
};

// What one detector found in one camera's (or pair's) pictures.
struct Detected {
  std::string camera, detector, csv, drawn;  // `drawn`: a file or folder; "" where nothing was drawn
  uint64_t pictures = 0, with_something = 0, detections = 0, refused = 0;
  std::vector<int64_t> ids;  // those found, each once, in order
  double ms = 0;             // of detection, for a picture
};

using Progress = std::function<void(const std::string &source, uint64_t pictures)>;

// Writes OUT/detections/CAMERA-DETECTOR.csv and OUT/drawn/. Throws Failure.
std::vector<Detected> detect(const DetectWish &wish, const Progress &progress);

// Names of all detectors, in their order.
std::vector<std::string> detector_names();

}  // namespace wm::tools
