// SPDX-License-Identifier: Apache-2.0
// A detector of upright lines held against labels, picture by picture.
#pragma once

#include <filesystem>

#include "common/line_sightings.h"
#include "eval/figures.h"

namespace wm::tools {

struct LabelledLine {
  int64_t id;
  double azimuth_rad;
  bool contrast;  // its sides differ: a detector should find it
};

struct LinePicture {
  std::vector<LabelledLine> labels;
  std::vector<LineSighting> seen;
};

// First the turn that most sightings have in common is found (the mounting's error), within 2 degrees; then a line is
// found where some sighting, turned back, is within `within_rad`, a sighting right where some labelled line is (with
// contrast or not), else false; its error is that to the nearest,
// with the turn. Two lines nearer to each other than the picture's
// resolution are one edge there, so they may share a sighting. Figures: pictures, labelled, with_contrast, found,
// recall, seen, right, false, false_per_right, azimuth_rms_deg, azimuth_mean_deg, azimuth_p95_deg, normalised_rms (null
// without sigmas), tracks.
Figures line_figures(const std::vector<LinePicture> &pictures, double within_rad);

// The figures as text for a person.
std::string line_table(const Figures &figures, const std::string &title);

// `frame,id,azimuth_rad` by frame. Throws Failure with file and line.
std::map<int64_t, std::vector<LabelledLine>> load_line_labels(const std::filesystem::path &file);

}  // namespace wm::tools
