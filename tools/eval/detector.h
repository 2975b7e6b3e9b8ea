// SPDX-License-Identifier: Apache-2.0
// An edge detector's polylines held against labelled ones, both in pixels of the camera's picture: the metric of
// Abramov et al. 2019 (regions of precision), and figures by length, which no zigzag can win.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <vector>

#include "eval/figures.h"

namespace wm::tools {

using Polyline = std::vector<Eigen::Vector2d>;  // pixels; at least one point
// Polylines of each frame; a frame that was looked at and showed none has an empty list.
using FramePolylines = std::map<int64_t, std::vector<Polyline>>;

// `frame,polyline,u_px,v_px`, rows of a polyline together. A row with an empty polyline is a frame that showed nothing.
// Throws Failure with file and line: not there, no such columns, a coordinate that is no number.
FramePolylines load_polylines(const std::filesystem::path &file);

struct DetectorMetric {
  double omega_px = 28.0 / 3;  // half width of the region of precision: 14 px at a width of 1920, in proportion
  double min_length_px = 28;   // true polylines whose part in view is shorter are left out
  // Whether a pixel shows floor that the detector was set to look at; empty: all of the picture.
  std::function<bool(const Eigen::Vector2d &)> in_view;
};

// Over the frames that `truth` has and `detected` looked at (all of truth's where `detected` has no empty lists to tell
// by: a frame that is absent there showed nothing). A polyline that is left out need not be found; a
// detection on it counts neither as right nor as wrong. Figures: frames, true_polylines, left_out_short,
// left_out_of_view, detected_polylines, detected_on_left_out, true_positives, false_positives, false_negatives,
// precision, recall, detected_length_px, true_length_px, length_precision, length_recall.
Figures detector_figures(const FramePolylines &truth, const FramePolylines &detected, const DetectorMetric &metric);

// Whether any of `line` lies in the region of precision of `other`: the union of the rectangles along its links that
// reach `omega_px` to both sides along the normal (-sin, cos).
bool touches_region(const Polyline &line, const Polyline &other, double omega_px);

// The figures as text for a person.
std::string detector_table(const Figures &figures, const std::string &title);

}  // namespace wm::tools
