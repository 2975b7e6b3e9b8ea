// SPDX-License-Identifier: Apache-2.0
// The cameras' pictures with what their detectors found and where the map should be, for a browser that looks. While
// somebody looked within kStay, a thread asks the run for pictures; else it is not connected, and nothing is copied,
// encoded or projected anywhere.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/map_edges.h"
#include "common/pose.h"
#include "web/site.h"

extern "C" {
#include "sources/picture_socket.h"
#include "waymark/codec.h"
}

namespace wm::tools {

struct LookedAt {  // a picture as the run sent it
  wm_picture_head head{};
  std::vector<wm_event> events;
  std::vector<uint8_t> grey;
};

// Checks what came; empty where it is no picture.
std::optional<LookedAt> read_picture(const wm_picture_head &head, const std::vector<uint8_t> &body);

// What is known when a picture is drawn.
struct Around {
  std::optional<Pose> pose;            // at its stamp
  std::vector<wm_landmark> landmarks;  // of the map and the robot's own
};

// JSON with the picture as a JPEG and what is drawn over it, in pixels of the camera.
std::string picture_json(const LookedAt &looked, const WebSite &site, const MapEdges *edges, const Around &around,
                         int64_t number);

class Pictures {
 public:
  static constexpr std::chrono::seconds kStay{3};

  // `around` is called by the thread here.
  Pictures(const WebSite &site, std::function<Around(int64_t t_ns)> around);
  ~Pictures();
  Pictures(const Pictures &) = delete;
  Pictures &operator=(const Pictures &) = delete;

  // The newest picture of a source, unless the browser has it; null where there is none. Says that somebody looks.
  std::shared_ptr<const std::string> newest(int64_t source, int64_t has_number);
  [[nodiscard]] int64_t encoded() const { return encoded_; }

 private:
  void work();
  void take_from_run(int socket);
  [[nodiscard]] bool somebody_looks();

  const WebSite &site_;
  std::function<Around(int64_t)> around_;
  std::unique_ptr<MapEdges> edges_;
  std::mutex lock_;  // of all below
  std::condition_variable changed_;
  bool stop_ = false;
  std::chrono::steady_clock::time_point looked_{};
  uint32_t source_ = 0;
  int64_t number_ = 0;
  std::string why_not_;
  std::shared_ptr<const std::string> newest_;
  std::atomic<int64_t> encoded_{0};
  std::thread thread_;
};

}  // namespace wm::tools
