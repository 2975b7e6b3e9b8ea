// SPDX-License-Identifier: Apache-2.0
// Pictures of a recording's cameras, small enough for a page, with what was seen drawn into them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "report/bird.h"

namespace wm::tools {

struct ReportData;

// A place in a picture, in the pixels of the camera.
struct FrameMark {
  enum class Kind { seen, rejected, expected };
  Kind kind;
  double u_px, v_px;
  std::string text;  // beside it; may be empty
};

struct ReportFrame {
  std::string camera;
  int64_t t_ns;
  int width_px, height_px;  // as the camera took it
  std::string jpeg;         // made smaller
  std::vector<FrameMark> marks;
  std::vector<Eigen::Vector2d> edges_seen{}, edges_mapped{};  // pixels: by the detector, and by map and pose
  // Upright lines: each from below to above, in pixels; as they were seen, and as map and pose expect them.
  std::vector<std::vector<Eigen::Vector2d>> lines_seen{}, lines_mapped{};
  std::vector<uint8_t> grey{};  // as the camera took it, row by row
  FloorView floor{};            // where edges on the floor were fused
};

// Grey bytes, row by row, as a JPEG. Empty where it can't be made.
std::string grey_jpeg(const std::vector<uint8_t> &grey, int width, int height);
// The same of the means of blocks of `times` x `times` pixels.
std::string small_jpeg(const uint8_t *grey, size_t stride, uint32_t width_px, uint32_t height_px, uint32_t times);

// `each` pictures of every camera that has a video, spread over what it filmed of the run's time; the data's film_notes
// say when that was where it isn't all of it. What can't be read leaves its part empty and a line there, too. Passes
// over each video twice.
std::vector<ReportFrame> load_frames(const std::filesystem::path &recording, ReportData *data, size_t each);

// Marks for a picture of what a bearing sensor of the camera's name saw: where each landmark was expected by the run's
// own pose, and in which direction it was seen.
void mark_sightings(const std::filesystem::path &recording, const ReportData &data, std::vector<ReportFrame> *frames);

// The upright lines that the camera's detector followed, from the run's event log, and those of the run's own map as
// they should look from where it says it was. Does nothing where no camera saw lines.
void mark_lines(const std::filesystem::path &run, const std::filesystem::path &recording, ReportData *data);

}  // namespace wm::tools
