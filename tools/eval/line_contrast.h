// SPDX-License-Identifier: Apache-2.0
// Which labelled lines a picture shows at all: those whose two sides differ.
#pragma once

#include "eval/lines.h"

namespace wm::tools {

// Sets `contrast` of each label: the means of its two sides, 0.5 to 1.5 degrees of azimuth away over the line's upper
// third, differ by at least 8 grey levels. How high a line is the recording doesn't say: it is taken from its own
// pictures, as the height up to which its sides differ in most of them. Needs the recording's video, truth.csv and
// truth-landmarks.csv; throws Failure where one is missing. `stamps`: of the frames. Reads the video twice.
void mark_contrast(const std::filesystem::path &recording, const wm_camera &camera, int32_t index,
                   const std::map<int64_t, int64_t> &stamps, std::map<int64_t, std::vector<LabelledLine>> *labels);

}  // namespace wm::tools
