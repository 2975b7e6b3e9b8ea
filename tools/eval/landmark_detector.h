// SPDX-License-Identifier: Apache-2.0
// A detector of known landmarks held against labelled pictures: precision, recall, and whether its sigmas are right.
#pragma once

#include "eval/detector_command.h"
#include "eval/figures.h"

namespace wm::tools {

// Reads RUN/events.wmlog and of the recording labels/landmarks.csv, video/*.csv, calibration.yaml,
// landmarks/appearance.csv, truth.csv, truth-landmarks.csv; all cameras together, or the one that is named. A sighting
// is right where the label of its landmark, seen through the camera as calibrated, has a bearing within half a degree:
// so the mounting's error is in neither. A landmark that isn't labelled, but stands there by truth, is partly hidden:
// what is seen of it is counted apart. Recall is of the labelled landmarks whose shorter side has `size_min_px`; of all
// of them it is `recall_of_all`; where `sizes_m` (width, height, width, height, ...) isn't empty, of those of these
// sizes alone. A sighting without an identity, of a class, is that of the nearest label. Throws Failure.
Figures evaluate_landmarks(const DetectorArguments &arguments, double size_min_px, const std::vector<double> &sizes_m);

// The figures as text for a person.
std::string landmark_table(const Figures &figures, const std::string &title);

}  // namespace wm::tools
