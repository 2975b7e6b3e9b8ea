// SPDX-License-Identifier: Apache-2.0
// Everything that a report is made of, read from a run's folder and, where it is given, its recording's.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/recording_folder.h"
#include "eval/compare.h"
#include "report/frames.h"
#include "waymark/look.h"

namespace wm::tools {

// A row of innovations.csv.
struct Innovation {
  int64_t t_ns;
  std::string source, sensor, residual;
  int64_t landmark;  // -1 where none
  double observed, expected, variance, nis, gate;
  int gate_dof;
  std::string verdict;

  [[nodiscard]] bool fused() const { return verdict == "fused"; }
  // Observed minus expected; angles wrapped.
  [[nodiscard]] double value() const;
};

// A row of looked-for.csv.
struct LandmarkLooks {
  std::string source;
  int64_t landmark;
  std::array<int64_t, WM_LOOK_COUNT> counts;  // pictures, by wm_look
};

// The map as a picture: an image file and where it lies.
struct Raster {
  std::string png;         // the file's bytes
  int width, height;       // px
  double resolution_m;     // m/px
  Eigen::Vector3d origin;  // outer corner of the lower left pixel: x, y, yaw
};

struct ReportJson;  // report/report_json.h

struct ReportData {
  std::string name;   // the recording's, or the run folder's
  std::string about;  // what the recording says of itself; may be empty
  Trajectory trajectory;
  int64_t start_ns;  // first pose
  std::optional<Comparison> truth;
  std::shared_ptr<const ReportJson> json;  // never null
  std::vector<Innovation> innovations;
  std::vector<LandmarkLooks> looked_for;
  std::vector<Landmark> landmarks, estimated_landmarks;
  std::vector<Pose> gnss;
  std::vector<Sighting> sightings;
  std::map<std::string, Pose> mountings;  // sensor in base_link
  std::optional<Raster> raster;
  std::optional<Raster> edge_layer;     // the map's edges, see-through between them
  std::vector<Eigen::Vector2d> cloud;   // particles at some instants, in map
  std::vector<ReportFrame> frames;      // by time
  std::vector<std::string> film_notes;  // what a reader should know of the cameras' pictures
  std::vector<std::string> notes;       // what a reader should know of the page itself

  [[nodiscard]] double seconds(int64_t t_ns) const { return static_cast<double>(t_ns - start_ns) * 1e-9; }
  [[nodiscard]] double end_s() const { return seconds(trajectory.poses.back().t_ns); }
};

// Absent files leave their part empty; a file that is there and broken throws Failure. `recording` may be empty.
ReportData load_report_data(const std::filesystem::path &run, const std::filesystem::path &recording);

// looked-for.csv of a run; nothing where it isn't there.
std::vector<LandmarkLooks> load_looked_for(const std::filesystem::path &file);

// map/map.yaml of a recording and its image (PNG as it is, PGM made into one); nothing where there is no map, or where
// its image is too large, which `notes` then says.
std::optional<Raster> load_raster(const std::filesystem::path &recording, std::vector<std::string> *notes);

}  // namespace wm::tools
