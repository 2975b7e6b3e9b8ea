// SPDX-License-Identifier: Apache-2.0
// A drive whose pictures have been through the detector: events.wmlog as a replay wrote it, beside truth.csv and map/.
// From there on filters run in a part of a second, and the drive may be cut and put together otherwise.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/event_log.h"
#include "common/pose.h"
#include "waymark/event.h"
#include "waymark/frames.h"
#include "waymark/map.h"

namespace wm::montecarlo {

class EdgeDrive {
 public:
  // Throws tools::Failure with file and reason.
  explicit EdgeDrive(const std::filesystem::path &folder);

  [[nodiscard]] const std::string &name() const { return name_; }
  [[nodiscard]] const wm_log_head &head() const { return log_.head(); }
  [[nodiscard]] const wm_raster &map() const { return *wm_map_raster(map_.get()); }
  // Stamps of the first and the last event.
  [[nodiscard]] int64_t begin_ns() const { return begin_ns_; }
  [[nodiscard]] int64_t end_ns() const { return end_ns_; }

  [[nodiscard]] size_t events() const { return offsets_.size(); }
  void event(size_t i, wm_event *out) const;

  // base_link at a time (held at the ends), and how far it has driven by then.
  [[nodiscard]] wm_pose2 truth(int64_t t_ns) const;
  [[nodiscard]] double way_m(int64_t t_ns) const;
  [[nodiscard]] double speed_mps(int64_t t_ns) const;
  // Longest time within [from, to] without a scan of at least 8 points: dark, or the camera is silent.
  [[nodiscard]] double blind_s(int64_t from_ns, int64_t to_ns) const;

 private:
  std::string name_;
  tools::EventLog log_;
  std::unique_ptr<wm_map, void (*)(wm_map *)> map_;
  int64_t begin_ns_ = 0, end_ns_ = 0;
  std::vector<unsigned char> bytes_;  // of the events, as many of each as carry something
  std::vector<size_t> offsets_;
  std::vector<tools::Pose> truth_;
  std::vector<double> way_m_;  // at each row of truth
  std::vector<int64_t> scans_ns_;
};

// Pose of b in a, and a's child by `way`.
wm_pose2 relative(const wm_pose2 &a, const wm_pose2 &b);
wm_pose2 composed(const wm_pose2 &a, const wm_pose2 &way);

}  // namespace wm::montecarlo
