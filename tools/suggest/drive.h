// SPDX-License-Identifier: Apache-2.0
// A run's events through its estimator again, with other parameters, and how likely each observation was before it was
// fused: the prediction error decomposition of the likelihood. Truth is not used.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "common/event_log.h"
#include "config/config.h"
#include "waymark/health.h"
#include "waymark/map.h"

namespace wm::suggest {

// The scored time is cut into as many blocks, by turns of three splits: search, choice, promise.
constexpr int kBlocks = 30;
enum Split { kSearch, kChoice, kPromise, kSplits };

// Predicted from all before it, or across a gap: by motion alone since the gap began.
enum Channel { kNext, kAfterGap, kChannels };

// Of a block.
struct Likelihood {
  double log_sum = 0, count = 0;  // nats, scalar updates
};

// Of the updates of one source and residual.
struct Fit {
  double count = 0, refused = 0;
  double nis_sum = 0;     // of the fused ones, one degree of freedom each
  double square_sum = 0;  // SI, of all, each at most as large as the cap
};

constexpr size_t kCalibrationMax = WM_HEALTH_CALIBRATION_MAX;

// Two filters with half of the landmarks each (without landmarks, half of the time's observations): how large the
// difference of their poses is against the sum of their covariances. What both have in common is not in it, so that a
// mean above the degrees of freedom is overconfidence for certain.
struct Halves {
  double count = 0, nees_sum = 0;  // looks at both, normalised difference squared: x, y, heading
  double distance_sum = 0;         // m
};

// What came of one drive. Plain bytes: it crosses a pipe.
struct Score {
  bool is_valid = false;
  std::array<std::array<Likelihood, kBlocks>, kChannels> blocks{};
  std::array<std::array<std::array<std::array<Fit, WM_RESIDUAL_COUNT>, WM_SOURCES_MAX>, kChannels>, kSplits> fits{};
  Halves halves;
  size_t states = 0;
  std::array<wm_calibration_value, kCalibrationMax> begin{}, end{};
};

class Drive {
 public:
  // Of RUN/events.wmlog. `config` is changed by who drives. Throws tools::Failure.
  Drive(const std::filesystem::path &run, const wm_config &config, double from_s, double to_s);
  // Sets which updates are counted, and the caps, by the configuration as it is now. False where nothing is observed.
  bool set_reference();
  // `with_halves`: two more drives.
  [[nodiscard]] Score score(bool with_halves) const;
  [[nodiscard]] const wm_log_head &head() const { return log_.head(); }
  [[nodiscard]] double scored_s() const { return 1e-9 * static_cast<double>(to_ns_ - from_ns_); }
  [[nodiscard]] double gap_s() const { return 1e-9 * static_cast<double>(gap_ns_); }
  // Updates that are counted, of one channel.
  [[nodiscard]] size_t updates(Channel channel) const;

 private:
  friend class Pass;
  using Counts = std::array<uint8_t, WM_RESIDUAL_COUNT>;
  using Caps = std::array<std::array<std::array<double, WM_RESIDUAL_COUNT>, WM_SOURCES_MAX>, kChannels>;

  void event(size_t i, wm_event *out) const;
  void compare_halves(Score &out) const;

  const wm_config &config_;
  tools::EventLog log_;
  std::unique_ptr<wm_map, void (*)(wm_map *)> map_;
  std::vector<unsigned char> bytes_;  // of the events, as many of each as carry something
  std::vector<size_t> offsets_;
  int64_t from_ns_ = 0, to_ns_ = 0, gap_ns_ = 0, cycle_ns_ = 0;
  std::array<std::vector<Counts>, kChannels> counts_;  // of each event
  Caps caps_{};                                        // largest difference that counts, SI
};

}  // namespace wm::suggest
