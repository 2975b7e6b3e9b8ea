// SPDX-License-Identifier: Apache-2.0
// Small drawn films for the test of the detectors' parameters: a world of planes and patterns, seen by rays from
// equidistant or pinhole cameras. Nothing here is the detectors' own code but the print of a coded marker.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "waymark/detector.h"

namespace pictures {

struct vec {
  double x, y, z;
};

// Grey of what a ray from `eye` along `ray` meets, in map axes; `picture`: number in the film.
using world = std::function<double(const vec &eye, const vec &ray, int picture)>;

// What one detector sees: frames of its cameras from a moving robot.
struct film {
  wm_rig rig{};
  std::vector<int32_t> cameras;
  std::vector<wm_landmark> landmarks;
  std::vector<wm_appearance> appearances;
  std::vector<wm_cascade> cascades;
  std::vector<std::vector<uint8_t>> grey;  // picture by picture, camera by camera
  std::vector<wm_frame> frames;
  std::vector<wm_estimate> predictions;  // one a picture; state SEARCHING: the pose is not known
  std::vector<std::vector<uint8_t>> signs;

  wm_view view() const;
};

std::unique_ptr<film> floor_film();    // edges: a room with boards, joints, tape, reflections
std::unique_ptr<film> upright_film();  // lines: stripes of different heights, a camera that looks up
std::unique_ptr<film> stereo_film();   // stereo: a floor with a grain, and particles before it
std::unique_ptr<film> marker_film();   // mr: prints of different contrast
std::unique_ptr<film> street_film(bool lost,
                                  int signs);  // landmarks, cascade: signs; `lost`: no pose, then a wrong one

}  // namespace pictures
