// SPDX-License-Identifier: Apache-2.0
// What all trials have in common: the error of a planar estimate, looks in a row, an estimator with its memory.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <memory>
#include <optional>

#include "config/config.h"
#include "simulate/angle.h"
#include "waymark/estimator.h"

namespace wm::montecarlo {

inline constexpr double kLook_s = 0.1;  // from look to look

struct PlanarError {
  Eigen::Vector3d off;  // x, y, heading: true less estimated
  Eigen::Matrix3d covariance;
  [[nodiscard]] double position_m() const { return off.head<2>().norm(); }
  [[nodiscard]] double heading_rad() const { return std::fabs(off[2]); }
  [[nodiscard]] double nees() const { return off.dot(covariance.ldlt().solve(off)); }
};

// `truth`: anything with x_m, y_m, heading_rad.
template <typename Pose>
PlanarError error_of(const wm_estimate &e, const Pose &truth) {
  PlanarError out;
  out.off = {truth.x_m - e.pose_map_base.p_m[0], truth.y_m - e.pose_map_base.p_m[1],
             sim::wrap(truth.heading_rad - e.heading_rad)};
  const int axes[3] = {0, 1, 5};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out.covariance(i, j) = e.covariance[wm_cov_index(axes[i], axes[j])];
  return out;
}

// Longest time that something holds without a break.
template <typename Looks, typename Is>
double longest(const Looks &looks, const Is &is) {
  double since = NAN, most = 0;
  for (const auto &look : looks) {
    if (!is(look)) since = NAN;
    if (is(look) && std::isnan(since)) since = look.t_s;
    if (is(look)) most = std::max(most, look.t_s - since);
  }
  return most;
}

// The first look of those for which something holds, and goes on to for `lasting_s`.
template <typename Looks, typename Is>
auto first_lasting(const Looks &looks, double lasting_s, const Is &is) -> decltype(&*looks.begin()) {
  decltype(&*looks.begin()) since = nullptr;
  for (const auto &look : looks) {
    if (!is(look)) since = nullptr;
    if (is(look) && since == nullptr) since = &look;
    if (since != nullptr && look.t_s - since->t_s >= lasting_s) return since;
  }
  return nullptr;
}

// The estimator of a configuration with its memory. Keeps references to all that it is made of.
class Filter {
 public:
  explicit Filter(const wm_config &config) : config_(config) { wm_config_give_params(&config, &setup_); }
  wm_status init(wm_error *err) {
    const char *why = "";
    const size_t bytes = ops().state_bytes(config_.estimator_params, &setup_, &why);
    if (bytes == 0) return wm_fail(err, WM_BAD_CONFIG, "%s: %s", ops().name, why);
    memory_ = std::make_unique<Block[]>((bytes + sizeof(Block) - 1) / sizeof(Block));
    const wm_status status = ops().init(state(), config_.estimator_params, &setup_);
    return status == WM_OK ? status : wm_fail(err, status, "%s: init: %s", ops().name, wm_status_text(status));
  }
  void *state() const { return memory_.get(); }
  const wm_estimator &ops() const { return *config_.estimator; }
  wm_setup &setup() { return setup_; }  // before init()
  wm_estimate estimate() const {
    wm_estimate e{};
    ops().estimate(state(), &e);
    return e;
  }
  // The counter of this kind, where the estimator has it.
  std::optional<wm_counter> counter(wm_counter_kind kind) const {
    wm_counter all[WM_HEALTH_COUNTERS_MAX];
    const size_t count = ops().counters ? ops().counters(state(), all, std::size(all)) : 0;
    for (size_t i = 0; i < std::min(count, std::size(all)); i++)
      if (all[i].kind == static_cast<uint32_t>(kind)) return all[i];
    return std::nullopt;
  }

 private:
  struct alignas(64) Block {
    char bytes[64];
  };
  const wm_config &config_;
  wm_setup setup_{};
  std::unique_ptr<Block[]> memory_;
};

}  // namespace wm::montecarlo
