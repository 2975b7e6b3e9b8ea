// SPDX-License-Identifier: Apache-2.0
// A simulated recording as events, and an estimator with its memory that takes them.
#pragma once

#include <array>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "config/config.h"
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

// One estimator with its memory. Keeps references to all that it is made of.
class SimulatedFilter {
 public:
  SimulatedFilter(const wm_config &config, const sim::Recording &recording, const wm_wheels &wheels);
  wm_status init(wm_error *err);
  void *state() { return memory_.get(); }
  const wm_estimator &ops() const { return *estimator_; }
  // Takes one event. Motion gives no innovations; the others give at most WM_INNOVATIONS_PER_EVENT_MAX, valid until the
  // next call. Throws std::runtime_error where the estimator refuses the event: a simulated drive has no invalid data.
  std::span<const wm_innovation> take(const wm_event &event);
  wm_start &start() { return setup_.start; }  // before init()
  // The counter of this kind; of count 0 where the estimator has none.
  wm_counter counter(wm_counter_kind kind) const;

 private:
  struct alignas(64) Block {
    char bytes[64];
  };
  const wm_estimator *estimator_;
  const wm_config &config_;
  wm_setup setup_ = {};
  std::unique_ptr<Block[]> memory_;
  std::array<wm_innovation, WM_INNOVATIONS_PER_EVENT_MAX> innovations_;
};

}  // namespace wm::montecarlo
