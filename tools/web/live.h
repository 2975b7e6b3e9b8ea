// SPDX-License-Identifier: Apache-2.0
// State of a run for browsers, from its LCM messages: all that the page shows, as JSON. Not a number and infinity
// become null; names from messages are made valid UTF-8, and the page shows them as text alone.
#pragma once

#include <cstdint>
#include <deque>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

extern "C" {
#include "cli/watch/watch.h"
#include "waymark/health.h"
}

#include "common/pose.h"
#include "waymark/lcm_messages.h"
#include "waymark/lcm_views.h"
#include "web/site.h"
#include "web/trail.h"

namespace wm::tools {

// What a browser has already: of lists it gets what is new.
struct Has {
  int64_t trail_generation = 0, trail_points = 0, landmarks = 0, places = 0;
};

class Live {
 public:
  explicit Live(const WebSite &site) : site_(site) {}

  // A message of the channel `what` (without the prefix), as it came.
  void take(const std::string &what, const void *message, size_t length, int64_t now_ns);

  // The state at `now_ns` on this computer's monotonic clock, in one line.
  [[nodiscard]] std::string state(int64_t now_ns, const Has &has) const;
  // Metrics in Prometheus' text format.
  [[nodiscard]] std::string metrics(int64_t now_ns) const;
  // The pose that the run had at a stamp; empty where it had none.
  [[nodiscard]] std::optional<Pose> pose_at_stamp(int64_t t_ns) const;
  // All landmarks: the map's and the robot's own.
  [[nodiscard]] const std::vector<wm_landmark> &known() const { return known_.all; }
  [[nodiscard]] const std::vector<wm_landmark> &own() const { return own_.all; }

 private:
  struct LandmarkList {
    std::vector<wm_landmark> all, coming;
    int64_t coming_ns = 0;
    bool take(const wm_lcm_part &part, const wm_landmark *landmarks);  // true where `all` is another one
  };
  struct Places {
    std::vector<wm_place> all;
    int64_t t_ns = 0, heard_ns = 0;
    size_t total = 0;
  };
  struct Looked {  // the newest sightings of a sensor
    std::string sensor;
    int64_t t_ns, heard_ns;
    std::vector<wm_sighting> sightings;
  };
  struct Verdict {
    int64_t t_ns;
    int32_t landmark;
    uint8_t verdict;
  };

  void take_pose(const void *message, size_t length, int64_t now_ns);
  void take_innovation(const void *message, size_t length);
  void take_sightings(const void *message, size_t length, int64_t now_ns);
  void take_places(Places *places, const void *message, size_t length, int64_t now_ns);
  [[nodiscard]] nlohmann::json pose_json() const;
  [[nodiscard]] nlohmann::json health_json() const;
  [[nodiscard]] nlohmann::json rays_json(int64_t now_ns) const;
  [[nodiscard]] nlohmann::json trail_json(const Has &has) const;
  [[nodiscard]] nlohmann::json landmarks_json() const;
  [[nodiscard]] nlohmann::json places_json(int64_t now_ns) const;
  [[nodiscard]] const wm_landmark *find(int32_t id) const;

  const WebSite &site_;
  watch seen_{};
  std::vector<Pose> poses_;  // of the last seconds
  Trail trail_;
  uint32_t resets_ = 0, jumps_ = 0;
  LandmarkList known_, own_;
  Places particles_, hypotheses_;
  std::vector<Looked> looked_;
  std::deque<Verdict> verdicts_;
  int64_t landmarks_version_ = 1, places_version_ = 1;
};

}  // namespace wm::tools
