// SPDX-License-Identifier: Apache-2.0
// The figures of `waymark eval`: those of the recording format by their names there, and some beside them.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/recording_folder.h"
#include "eval/compare.h"

namespace wm::tools {

// Keys in the format's order. A figure that is not defined is null, never NaN.
using Figures = nlohmann::ordered_json;

// Position off by more than this, or heading by more than this, for longer than this, or at the end: lost.
inline constexpr double kLostPositionM = 0.5;
inline constexpr double kLostHeadingDeg = 15;
inline constexpr double kLostForS = 2;

// Length of a path, counted in steps of at least 1 cm, so that a robot that stands doesn't drive by its truth's noise.
double path_length(const std::vector<Pose> &path, bool planar);

// Everything about poses. `gnss`: no NEES, no losing.
Figures pose_figures(const Comparison &comparison, bool has_covariance, bool gnss);
// RMSE where a known landmark was seen within the last 2 s; null without sightings.
void add_sighting_figures(const Comparison &comparison, const std::vector<Sighting> &sightings,
                          const std::vector<Landmark> &known, Figures *figures);
// False: sightings without identity are all that there is to see landmarks by, so that a map's ids are its filter's
// own.
bool has_identities(const std::filesystem::path &recording);
// SLAM: landmarks against their true places, after the pose alignment. `has_identities`: the filter was given some.
void add_landmark_figures(const std::vector<Landmark> &estimate, const std::vector<Landmark> &truth,
                          const Comparison &comparison, bool has_identities, Figures *figures);
// What only the published poses have: ages, order, jumps.
void add_published_figures(const Published &published, Figures *figures);

// Number, or null where it is not finite.
nlohmann::ordered_json number(double value);

}  // namespace wm::tools
