// SPDX-License-Identifier: Apache-2.0
// A simulated recording as events, and an estimator with its memory that takes them.
#pragma once

#include <array>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "config/config.h"
#include "montecarlo/look.h"
#include "simulate/simulate.h"
#include "waymark/estimator.h"
#include "waymark/event.h"

namespace wm::montecarlo {

// A small event, without the room for points that a wm_event has: a drive has ten thousand.
class SmallEvent {
 public:
  explicit SmallEvent(const wm_event &event) : t_ns(event.t_ns), source(event.source) {
    std::memcpy(bytes_, &event, sizeof bytes_);
  }
  void get(wm_event *out) const { std::memcpy(out, bytes_, sizeof bytes_); }
  wm_time_ns t_ns;
  uint16_t source;

 private:
  unsigned char bytes_[WM_EVENT_SMALL_BYTES];
};

// The recording's data as events, in the order in which the merge would hand them on: by stamp, motion first.
wm_status make_events(const sim::Recording &recording, std::vector<SmallEvent> &out, wm_error *err);

// The estimator for a simulated drive on the plane.
class SimulatedFilter : public Filter {
 public:
  SimulatedFilter(const wm_config &config, const sim::Recording &recording, const wm_wheels &wheels);
  // Takes one event. Motion gives no innovations; the others give at most WM_INNOVATIONS_PER_EVENT_MAX, valid until the
  // next call. Throws std::runtime_error where the estimator refuses the event: a simulated drive has no invalid data.
  std::span<const wm_innovation> take(const wm_event &event);

 private:
  std::array<wm_innovation, WM_INNOVATIONS_PER_EVENT_MAX> innovations_;
};

// Time of the drive.
inline double seconds(const sim::Recording &r, wm_time_ns t_ns) {
  return 1e-9 * static_cast<double>(t_ns - r.clock_start_ns);
}

// Throws std::runtime_error where it failed; `what` was to be done.
void check(wm_status status, const wm_error &error, const char *what);

}  // namespace wm::montecarlo
