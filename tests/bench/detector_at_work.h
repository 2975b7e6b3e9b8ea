// SPDX-License-Identifier: Apache-2.0
// A detector with its state, for benchmarks.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <functional>
#include <vector>

#include "waymark/detector.h"

namespace bench {

class detector_at_work {
 public:
  // `tune` sets parameters before the start. What `view` points at must outlive this.
  detector_at_work(const wm_detector *detector, const wm_view &view, const std::function<void(void *)> &tune = {})
      : detector_(detector), view_(view), params_(detector->params.bytes / sizeof(double) + 1), events_(256) {
    wm_params_defaults(&detector->params, params_.data());
    if (tune) tune(params_.data());
    const char *why = "";
    bytes_ = (detector->state_bytes(params_.data(), &view_, &why) + 63) / 64 * 64;
    state_ = std::aligned_alloc(64, bytes_);
    again();
  }
  ~detector_at_work() { std::free(state_); }
  detector_at_work(const detector_at_work &) = delete;
  detector_at_work &operator=(const detector_at_work &) = delete;

  // From the start once more: nothing has been seen.
  void again() {
    if (!state_ || detector_->init(state_, params_.data(), &view_) != WM_OK) std::abort();
  }
  // One picture of each camera; returns the number of events told.
  size_t look(const wm_frame *frames, const wm_estimate *prediction = nullptr) {
    size_t count = 0;
    (void)detector_->detect(state_, frames, prediction, events_.data(), events_.size(), &count);
    return count;
  }
  const wm_event &told(size_t i) const { return events_[i]; }
  size_t bytes() const { return bytes_; }

 private:
  const wm_detector *detector_;
  wm_view view_;
  std::vector<double> params_;  // doubles: aligned for any parameters
  std::vector<wm_event> events_;
  size_t bytes_ = 0;
  void *state_ = nullptr;
};

inline wm_frame frame_of(const std::vector<uint8_t> &grey, uint32_t width_px, uint32_t height_px, int32_t camera = 0,
                         int64_t t_ns = 0) {
  return {t_ns, t_ns, 0, 0, camera, width_px, height_px, width_px, grey.data()};
}

}  // namespace bench
