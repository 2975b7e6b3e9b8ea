// SPDX-License-Identifier: Apache-2.0
// Cascades trained: stages of gently boosted stumps over multi-block LBP codes (J. Friedman et al. 2000; L. Zhang et
// al. 2007), in the shape of OpenCV's files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "waymark/cascade.h"

namespace wm::tools {

// A window's integral image: (width + 1) x (height + 1) numbers.
using WindowSums = std::vector<uint32_t>;

struct Stump {
  uint32_t feature;
  uint32_t codes[8];  // those that lead to the first leaf
  float leaves[2];
};

struct Stage {
  std::vector<Stump> stumps;
  float threshold = 0;
  double kept = 1, passed = 1;  // share of the things, and of all else, that it lets through
};

struct TrainedCascade {
  int width_px = 0, height_px = 0;
  std::vector<wm_cascade_feature> features;  // all that are possible
  std::vector<Stage> stages;

  TrainedCascade(int width, int height);
  // As the runtime evaluates it, for looking with what is trained so far; valid while neither is changed.
  struct Flat {
    std::vector<wm_cascade_node> nodes;
    std::vector<float> leaves;
    std::vector<wm_cascade_tree> trees;
    std::vector<wm_cascade_stage> stages;
    wm_cascade view{};
  };
  void flatten(Flat *out);
};

struct BoostOptions {
  double keep = 0.997;     // of the things a stage lets through at least
  double let_pass = 0.35;  // of all else at most
  int stumps_max = 60;
};

// One more stage. Cost: features times windows for a stump.
void train_stage(const std::vector<WindowSums> &things, const std::vector<WindowSums> &others,
                 const BoostOptions &options, TrainedCascade *cascade);

// The file, with the features that are used. Throws Failure.
void write_cascade(const TrainedCascade &cascade, const std::string &about, const std::filesystem::path &file);

}  // namespace wm::tools
