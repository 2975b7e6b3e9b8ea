// SPDX-License-Identifier: Apache-2.0
// A run's event log, event by event.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

extern "C" {
#include "output/event_log.h"
}

namespace wm::tools {

class EventLog {
 public:
  // RUN/events.wmlog. Throws Failure: not there, damaged.
  explicit EventLog(const std::filesystem::path &run);

  const wm_log_head &head() const { return *wm_log_reader_head(reader_.get()); }

  // The next event, until the next call; nullptr at the end. Throws Failure: damaged.
  const wm_event *next();

  // After the end: nothing is missing within it, and it was not cut short.
  bool is_whole() const { return missing_ == 0 && cut_ == 0; }

 private:
  std::unique_ptr<wm_log_reader, void (*)(wm_log_reader *)> reader_;
  wm_event event_{};
  uint64_t missing_ = 0;
  int cut_ = 0;
};

}  // namespace wm::tools
