// SPDX-License-Identifier: Apache-2.0
// Labelled pictures to train a cascade with.
#pragma once

#include <memory>
#include <vector>

#include "map/boost.h"
#include "map/train_cascade.h"
#include "waymark/internal/vision/cascade/bands.hpp"

namespace wm::tools {

// Where a landmark of the class is from a camera: as the panorama has it.
struct Place {
  double azimuth_rad, tangent, distance_m;  // on the floor
  bool is_labelled;                         // else it is there, but perhaps hidden, slanted or too small
};

struct LabelledPicture {
  const mounted_camera *camera;
  std::vector<uint8_t> grey;
  std::vector<Place> places;
};

struct Samples {
  std::vector<std::unique_ptr<mounted_camera>> cameras;
  std::vector<LabelledPicture> pictures;
  double low_m = 0, high_m = 0;  // of the class's landmarks, above the cameras
};

// Some pictures of all recordings, evenly. Throws Failure.
Samples load_samples(const TrainCascade &arguments);

}  // namespace wm::tools
