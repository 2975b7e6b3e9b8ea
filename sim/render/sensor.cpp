// SPDX-License-Identifier: Apache-2.0
#include "render/sensor.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "render/dice.h"
#include "waymark/internal/math/elementary.hpp"
#include "waymark/random.h"

namespace wm::render {

namespace {

// The curve's table has 256 places for each doubling of the signal, from 2^-14 to 2^6: by a float's own bits.
constexpr int kFirstPower = -14, kPowers = 20, kSteps = 256;
constexpr uint32_t kFirstBits = static_cast<uint32_t>(127 + kFirstPower) << 23;
constexpr int kShift = 23 - 8;

constexpr size_t kQuantiles = 4096;

// The normal distribution's quantiles at the middles of equal shares, by bisection of its distribution function, scaled
// to a variance of exactly one.
std::vector<float> normal_quantiles() {
  auto below = [](double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); };
  std::vector<double> z(kQuantiles);
  double power = 0;
  for (size_t i = 0; i < kQuantiles; i++) {
    const double share = (static_cast<double>(i) + 0.5) / kQuantiles;
    double low = -6, high = 6;
    for (int k = 0; k < 50; k++) (below((low + high) / 2) < share ? low : high) = (low + high) / 2;
    z[i] = (low + high) / 2;
    power += z[i] * z[i];
  }
  const double scale = std::sqrt(kQuantiles / power);
  std::vector<float> out;
  for (double v : z) out.push_back(static_cast<float>(v * scale));
  return out;
}

}  // namespace

double response(const SensorModel &model, double signal) {
  if (!(signal > 0)) return 0;
  const double y = wm::exp(model.response_power * wm::log(signal));
  const double s = std::clamp(model.shoulder, 0.0, 1.0);
  if (y <= s) return y;
  return s >= 1 ? 1 : 1 - (1 - s) * wm::exp(-(y - s) / (1 - s));
}

Sensor::Sensor(const SensorModel &model, uint64_t seed, int width, int height, const Vec2 &centre_px)
    : model_(model), seed_(seed), centre_px_(centre_px), corner2_(1), normal_(normal_quantiles()) {
  const double cx = 0.5 * (width - 1), cy = 0.5 * (height - 1);
  corner2_ = std::max(cx * cx + cy * cy, 1.0);
  for (int i = 0; i <= kPowers * kSteps; i++) {
    const float signal = std::bit_cast<float>(kFirstBits + (static_cast<uint32_t>(i) << kShift));
    curve_.push_back(static_cast<float>(255 * response(model, double(signal))));
  }
  falloff_.reserve(static_cast<size_t>(width) * static_cast<size_t>(height));
  for (int v = 0; v < height; v++)
    for (int u = 0; u < width; u++) falloff_.push_back(static_cast<float>(vignetting_at(u, v)));
}

double Sensor::vignetting_at(double u_px, double v_px) const {
  const double r2 = (Vec2(u_px, v_px) - centre_px_).squaredNorm() / corner2_;
  return std::max(1 - model_.vignetting * r2, 0.0);
}

void Sensor::develop(const Image &image, const Exposure &exposure, uint64_t frame, images::Picture8 &out) const {
  out.width = image.width, out.height = image.height, out.channels = image.channels;
  out.bytes.resize(image.values.size());
  const auto gain = static_cast<float>(exposure.gain);
  const auto scale2 = static_cast<float>(exposure.noise_scale * exposure.noise_scale);
  const float shot = static_cast<float>(model_.shot) * gain * scale2;
  const float read2 = static_cast<float>(model_.read * model_.read) * gain * gain * scale2;
  const uint64_t key = dice_frame(seed_ ^ 0x6e6f697365ull, frame);
  const auto channels = static_cast<size_t>(image.channels);
  const bool noisy = shot > 0 || read2 > 0;
  for (size_t i = 0; i < image.values.size(); i++) {
    float signal = image.values[i] * gain * falloff_[i / channels];
    if (noisy) {
      // Two quantiles added: a distribution that is normal out to five deviations.
      const uint64_t bits = dice(key + i);
      const float z = (normal_[bits & (kQuantiles - 1)] + normal_[bits >> 12 & (kQuantiles - 1)]) * 0.70710678f;
      signal += z * std::sqrt(shot * std::max(signal, 0.0f) + read2);
    }
    const auto from_first =
        static_cast<int32_t>(std::bit_cast<uint32_t>(std::max(signal, 0.0f))) - static_cast<int32_t>(kFirstBits);
    float grey = 0;
    if (from_first > 0) {
      const int at = std::min(from_first >> kShift, kPowers * kSteps - 1);
      const auto k = static_cast<size_t>(at);
      const float part = static_cast<float>(from_first & ((1 << kShift) - 1)) * (1.0f / (1 << kShift));
      grey = curve_[k] + (curve_[k + 1] - curve_[k]) * part;
    }
    out.bytes[i] = static_cast<uint8_t>(static_cast<int>(std::min(grey, 255.0f) + 0.5f));
  }
}

AutoExposure::AutoExposure(double target, double share, double drift, uint64_t seed, double min_gain, double max_gain)
    : target_(target), share_(share), drift_(drift), min_gain_(min_gain), max_gain_(max_gain), seed_(seed) {}

double AutoExposure::next(const Image &image, uint64_t frame) {
  // Every seventh value is plenty for a mean. What is far over white counts as white does in a sensor.
  double sum = 0;
  size_t n = 0;
  const double limit = begun_ ? 4 * wm::exp(-log_gain_) : 1e9;
  for (size_t i = 0; i < image.values.size(); i += 7, n++) sum += std::min(double(image.values[i]), limit);
  const double mean = n ? sum / static_cast<double>(n) : 0;
  const double wanted = wm::log(std::clamp(target_ / std::max(mean, 1e-9), min_gain_, max_gain_));
  if (!begun_) log_gain_ = wanted;
  begun_ = true;
  const double gain = std::clamp(wm::exp(log_gain_ + wander_), min_gain_, max_gain_);
  log_gain_ += share_ * (wanted - log_gain_);
  wander_ = 0.98 * wander_ + drift_ * wm_random_normal(seed_, 0x6165ull, frame);
  return gain;
}

}  // namespace wm::render
