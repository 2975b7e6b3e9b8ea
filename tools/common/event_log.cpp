// SPDX-License-Identifier: Apache-2.0
#include "common/event_log.h"

#include "common/failure.h"

namespace wm::tools {

EventLog::EventLog(const std::filesystem::path &run) : reader_(nullptr, wm_log_reader_close) {
  wm_error error{};
  wm_log_reader *opened = nullptr;
  const wm_status status = wm_log_open((run / "events.wmlog").c_str(), &opened, &error);
  reader_.reset(opened);
  if (status != WM_OK) throw Failure(error.text);
}

const wm_event *EventLog::next() {
  wm_error error{};
  const wm_status status = wm_log_next(reader_.get(), &event_, &missing_, &cut_, &error);
  if (status == WM_END) return nullptr;
  if (status != WM_OK) throw Failure(error.text);
  return &event_;
}

}  // namespace wm::tools
