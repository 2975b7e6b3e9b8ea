// SPDX-License-Identifier: Apache-2.0
// When a camera took its pictures: which of them a report shows, and what it says where they don't cover the drive.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace wm::tools {

struct ReportData;

// A picture of a video, by its number there.
struct Taken {
  uint64_t number;
  int64_t t_ns;
};

// Those that were taken during the drive, in the order of the film.
std::vector<Taken> during(const ReportData &data, const std::vector<Taken> &film);

// The pictures nearest to `each` times spread over the film, each once, in the order of the film.
std::vector<Taken> spread_over(const std::vector<Taken> &film, size_t each);

// What a reader should know of a film, which is not empty: a sentence with the times where the camera took none of its
// pictures during the drive, began well after it or fell silent well before its end; else "".
std::string when_filmed(const ReportData &data, const std::string &camera, const std::vector<Taken> &film);

}  // namespace wm::tools
