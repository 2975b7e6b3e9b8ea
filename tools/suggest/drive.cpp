// SPDX-License-Identifier: Apache-2.0
#include "suggest/drive.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/failure.h"
#include "common/pose.h"
#include "output/likelihood.h"
#include "waymark/estimator.h"
#include "waymark/keeper.h"

namespace wm::suggest {
namespace {

// An observation is an outlier with this probability, whatever the filter did with it: a refused one is not rewarded.
constexpr double kOutlier = 0.02;
// The gap is a sixtieth of the drive, so that there are many. 5 s: beyond that, drives differ more than parameters do.
constexpr double kGapLeast_s = 0.3, kGapMost_s = 5, kGapShare = 1.0 / 60;
// After a gap a fifth of it is predicted.
constexpr double kAfterGapShare = 0.2;
// Larger differences are outliers: 5 sigma of the median's.
constexpr double kCapSigmas = 5 * 1.4826;

int64_t ns(double s) { return static_cast<int64_t>(std::llround(s * 1e9)); }

bool is_counted(const wm_innovation &in) {
  return in.residual != WM_RESIDUAL_STANDSTILL && std::isfinite(in.variance) && in.variance > 0 &&
         std::isfinite(in.observed) && std::isfinite(in.expected);
}

double log_density(const wm_innovation &in) {
  const double outlier = std::log(kOutlier) + wm_outlier_log_density(in.residual, in.variance);
  const double good = std::log1p(-kOutlier) + wm_innovation_log_density(&in);
  const double most = std::max(outlier, good);
  return most + std::log(std::exp(outlier - most) + std::exp(good - most));
}

// Looks at the halves, and time after which an observation without a landmark is the other half's.
constexpr int64_t kLook_ns = 1'000'000'000, kTurn_ns = 10'000'000'000;

// Which half takes the observation; -1: both.
int half_of(const wm_event &event) {
  int64_t number = event.t_ns / kTurn_ns;
  if (event.kind == WM_EVENT_SET_POSE || event.kind == WM_EVENT_RESET) return -1;
  if (event.kind == WM_EVENT_SIGHTING && event.as.sighting.landmark_id >= 0) number = event.as.sighting.landmark_id;
  if (event.kind == WM_EVENT_MARKER) number = event.as.marker.id;
  if (event.kind == WM_EVENT_STEREO) number = event.as.stereo.id;
  return static_cast<int>(number & 1);
}

Eigen::Matrix3d covariance_of(const wm_estimate &e) {
  const int axes[3] = {0, 1, 5};
  Eigen::Matrix3d out;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out(i, j) = e.covariance[wm_cov_index(axes[i], axes[j])];
  return out;
}

}  // namespace

struct alignas(64) CacheLine {
  char bytes[64];
};

// One drive: an estimator with its memory, and a second one that sees nothing during the gaps.
class Pass {
 public:
  explicit Pass(const Drive &drive) : drive_(drive), ops_(*drive.config_.estimator) {
    const wm_log_head &head = drive.head();
    setup_ = {.motion = drive.config_.motion,
              .sightings = drive.config_.sightings,
              .wheels = head.wheels,
              .sensors = head.sensors,
              .sensor_count = head.sensor_count,
              .landmarks = head.landmarks,
              .landmark_count = head.landmark_count,
              .rig = &head.rig,
              .map = drive.map_ ? wm_map_raster(drive.map_.get()) : nullptr,
              .start = head.start,
              .seed = head.seed};
  }

  bool init() {
    const void *params = drive_.config_.estimator_params;
    const char *why = nullptr;
    bytes_ = ops_.state_bytes(params, &setup_, &why);
    if (bytes_ == 0) return false;
    const size_t lines = (bytes_ + sizeof(CacheLine) - 1) / sizeof(CacheLine);
    state_.resize(lines);
    blind_.resize(lines);
    if (ops_.init(state_.data(), params, &setup_) != WM_OK) return false;
    const wm_log_head &head = drive_.head();
    const wm_keeper *keeper = head.kept != nullptr ? wm_keeper_of(&ops_) : nullptr;
    if (keeper != nullptr && keeper->why_not(params, &setup_, head.kept, head.kept_bytes) == nullptr)
      keeper->take(state_.data(), head.kept, head.kept_bytes);
    return true;
  }

  // `take` gets channel, event's number, block, source and the innovations.
  template <typename Take>
  void drive(const Take &take) {
    wm_event event{};
    for (size_t i = 0; i < drive_.offsets_.size(); i++) {
      drive_.event(i, &event);
      if (event.t_ns >= drive_.to_ns_) break;
      follow_gap(event.t_ns);
      const int block = block_of(event.t_ns);
      if (wm_event_is_motion(&event)) {
        (void)ops_.predict(state_.data(), &event);
        if (blind_from_ns_ != WM_TIME_NONE) (void)ops_.predict(blind_.data(), &event);
        continue;
      }
      take(kNext, i, block, event.source, correct(state_.data(), event));
      const bool is_command = event.kind == WM_EVENT_SET_POSE || event.kind == WM_EVENT_RESET;
      if (blind_from_ns_ == WM_TIME_NONE) continue;
      if (is_command)
        (void)correct(blind_.data(), event);
      else if (event.t_ns - blind_from_ns_ >= drive_.gap_ns_)
        take(kAfterGap, i, block, event.source, correct(blind_.data(), event));
    }
  }

  // `take` gets the estimates of both halves, once a second.
  template <typename Take>
  void halves(const Take &take) {
    wm_event event{};
    std::array<wm_estimate, 2> estimates{};
    int64_t look_ns = drive_.from_ns_;
    blind_ = state_;
    for (size_t i = 0; i < drive_.offsets_.size(); i++) {
      drive_.event(i, &event);
      if (event.t_ns >= drive_.to_ns_) break;
      const int half = half_of(event);
      for (int k = 0; k < 2; k++) {
        void *state = k == 0 ? state_.data() : blind_.data();
        if (wm_event_is_motion(&event))
          (void)ops_.predict(state, &event);
        else if (half < 0 || half == k)
          (void)correct(state, event);
      }
      if (event.t_ns < look_ns) continue;
      look_ns = event.t_ns + kLook_ns;
      ops_.estimate(state_.data(), &estimates[0]);
      ops_.estimate(blind_.data(), &estimates[1]);
      take(estimates);
    }
  }

  size_t calibration(std::array<wm_calibration_value, kCalibrationMax> &out) const {
    if (ops_.calibration == nullptr) return 0;
    return std::min(ops_.calibration(state_.data(), out.data(), out.size()), out.size());
  }

 private:
  struct Innovations {
    std::array<wm_innovation, WM_INNOVATIONS_PER_EVENT_MAX> all;
    size_t count = 0;
  };

  const Innovations &correct(void *state, const wm_event &event) {
    out_.count = 0;
    (void)ops_.correct(state, &event, out_.all.data(), out_.all.size(), &out_.count);
    return out_;
  }

  // Gaps follow each other from the first scored stamp on.
  void follow_gap(int64_t t_ns) {
    if (t_ns < drive_.from_ns_) return;
    const int64_t since_ns = (t_ns - drive_.from_ns_) % drive_.cycle_ns_;
    const int64_t begin_ns = t_ns - since_ns;
    if (blind_from_ns_ == begin_ns) return;
    blind_from_ns_ = begin_ns;
    std::memcpy(blind_.data(), state_.data(), bytes_);
  }

  [[nodiscard]] int block_of(int64_t t_ns) const {
    if (t_ns < drive_.from_ns_) return -1;
    const double share =
        static_cast<double>(t_ns - drive_.from_ns_) / static_cast<double>(drive_.to_ns_ - drive_.from_ns_);
    return std::min(static_cast<int>(share * kBlocks), kBlocks - 1);
  }

  const Drive &drive_;
  const wm_estimator &ops_;
  wm_setup setup_{};
  size_t bytes_ = 0;
  std::vector<CacheLine> state_, blind_;
  int64_t blind_from_ns_ = WM_TIME_NONE;
  Innovations out_;
};

Drive::Drive(const std::filesystem::path &run, const wm_config &config, double from_s, double to_s)
    : config_(config), log_(run), map_(nullptr, wm_map_free) {
  if (head().map_hash != 0) {
    wm_error error{};
    wm_map *map = nullptr;
    const char *path = config.overrides.map[0] != '\0' ? config.overrides.map : head().map_path;
    if (wm_map_load(path, nullptr, nullptr, &map, &error) != WM_OK) throw tools::Failure(error.text, tools::kUsage);
    map_.reset(map);
  }
  int64_t begin_ns = 0, end_ns = 0;
  while (const wm_event *next = log_.next()) {
    offsets_.push_back(bytes_.size());
    const auto *from = reinterpret_cast<const unsigned char *>(next);
    bytes_.insert(bytes_.end(), from, from + wm_event_bytes(next));
    if (offsets_.size() == 1) begin_ns = next->t_ns;
    end_ns = next->t_ns;
  }
  if (offsets_.empty()) throw tools::Failure(run.string() + "/events.wmlog: has no events", tools::kUsage);
  from_ns_ = begin_ns + ns(from_s);
  to_ns_ = to_s > 0 ? std::min(end_ns + 1, begin_ns + ns(to_s)) : end_ns + 1;
  if (to_ns_ - from_ns_ < ns(2))
    throw tools::Failure(run.string() + ": less than 2 s lie between --from and --to", tools::kUsage);
  gap_ns_ = ns(std::clamp(scored_s() * kGapShare, kGapLeast_s, kGapMost_s));
  cycle_ns_ = gap_ns_ + ns(gap_s() * kAfterGapShare);
}

void Drive::event(size_t i, wm_event *out) const {
  const size_t end = i + 1 < offsets_.size() ? offsets_[i + 1] : bytes_.size();
  std::memcpy(static_cast<void *>(out), bytes_.data() + offsets_[i], end - offsets_[i]);
}

bool Drive::set_reference() {
  std::array<std::array<std::array<std::vector<double>, WM_RESIDUAL_COUNT>, WM_SOURCES_MAX>, kChannels> sizes;
  for (auto &of : counts_) of.assign(offsets_.size(), Counts{});
  Pass pass(*this);
  if (!pass.init()) return false;
  pass.drive([&](Channel channel, size_t event, int block, uint16_t source, const auto &innovations) {
    if (block < 0) return;
    for (size_t i = 0; i < innovations.count; i++) {
      const wm_innovation &in = innovations.all[i];
      if (!is_counted(in)) continue;
      counts_[channel][event][in.residual]++;
      sizes[channel][source][in.residual].push_back(std::fabs(wm_innovation_difference(&in)));
    }
  });
  for (size_t c = 0; c < kChannels; c++)
    for (size_t s = 0; s < WM_SOURCES_MAX; s++)
      for (size_t r = 0; r < WM_RESIDUAL_COUNT; r++) {
        std::vector<double> &all = sizes[c][s][r];
        if (all.empty()) continue;
        const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
        std::nth_element(all.begin(), middle, all.end());
        caps_[c][s][r] = kCapSigmas * *middle;
      }
  return updates(kNext) > 0;
}

size_t Drive::updates(Channel channel) const {
  size_t sum = 0;
  for (const Counts &counts : counts_[channel])
    for (const uint8_t count : counts) sum += count;
  return sum;
}

void Drive::compare_halves(Score &out) const {
  Pass pass(*this);
  if (!pass.init()) return;
  pass.halves([&](const std::array<wm_estimate, 2> &e) {
    const Eigen::Vector3d off(e[1].pose_map_base.p_m[0] - e[0].pose_map_base.p_m[0],
                              e[1].pose_map_base.p_m[1] - e[0].pose_map_base.p_m[1],
                              tools::wrap(e[1].heading_rad - e[0].heading_rad));
    const bool track = std::all_of(e.begin(), e.end(), [](const wm_estimate &one) {
      return one.state == WM_STATE_TRACKING || one.state == WM_STATE_DEAD_RECKONING;
    });
    const double nees = off.dot((covariance_of(e[0]) + covariance_of(e[1])).ldlt().solve(off));
    if (!track || !std::isfinite(nees)) return;
    out.halves.count++;
    out.halves.nees_sum += nees;
    out.halves.distance_sum += off.head<2>().norm();
  });
}

Score Drive::score(bool with_halves) const {
  Score out;
  const char *key = nullptr;
  Pass pass(*this);
  if (wm_motion_params_clash(config_.motion, &key) != nullptr || !pass.init()) return out;
  out.states = pass.calibration(out.begin);
  pass.drive([&](Channel channel, size_t event, int block, uint16_t source, const auto &innovations) {
    if (block < 0) return;
    std::array<double, WM_RESIDUAL_COUNT> log_sum{}, count{};
    auto &fits = out.fits[block % kSplits][channel][source];
    for (size_t i = 0; i < innovations.count; i++) {
      const wm_innovation &in = innovations.all[i];
      if (!is_counted(in)) continue;
      const double difference = std::fabs(wm_innovation_difference(&in));
      log_sum[in.residual] += log_density(in);
      count[in.residual]++;
      Fit &fit = fits[in.residual];
      fit.count++;
      fit.square_sum += std::pow(std::min(difference, caps_[channel][source][in.residual]), 2);
      if (in.verdict == WM_FUSED)
        fit.nis_sum += difference * difference / in.variance;
      else
        fit.refused++;
    }
    // As many updates as in the reference, so that sums can be compared: a missing one counts as an outlier.
    Likelihood &of = out.blocks[channel][block];
    for (unsigned r = 0; r < WM_RESIDUAL_COUNT; r++) {
      const double due = counts_[channel][event][r];
      if (due == 0) continue;
      of.count += due;
      of.log_sum += count[r] > due
                        ? log_sum[r] * due / count[r]
                        : log_sum[r] + (due - count[r]) * (std::log(kOutlier) + wm_outlier_log_density(r, 0.0));
    }
  });
  out.states = std::min(out.states, pass.calibration(out.end));
  if (with_halves) compare_halves(out);
  out.is_valid = true;
  return out;
}

}  // namespace wm::suggest
