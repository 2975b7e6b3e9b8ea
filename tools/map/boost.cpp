// SPDX-License-Identifier: Apache-2.0
#include "map/boost.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>

#include "common/failure.h"
#include "waymark/internal/vision/cascade/evaluate.hpp"

namespace wm::tools {
namespace {

constexpr int kCodes = 256;
constexpr size_t kTurns = 6;

// Weights of the two kinds of windows at each code of a feature.
struct Histogram {
  double things[kCodes], others[kCodes];
};

class Booster {
 public:
  Booster(const std::vector<WindowSums> &things, const std::vector<WindowSums> &others, const TrainedCascade &cascade)
      : features_(cascade.features), count_(things.size() + others.size()), things_(things.size()) {
    codes_.resize(features_.size() * count_);
    const ptrdiff_t stride = cascade.width_px + 1;
    for (size_t i = 0; i < count_; i++) {
      const WindowSums &sums = i < things_ ? things[i] : others[i - things_];
      const integral picture = {sums.data(), nullptr, stride};
      for (size_t f = 0; f < features_.size(); f++)
        codes_[f * count_ + i] = static_cast<uint8_t>(lbp_code(features_[f], picture, 0, 0));
    }
    weights_.assign(count_, 0);
    sums_.assign(count_, 0);
    for (size_t i = 0; i < count_; i++)
      weights_[i] = static_cast<float>(0.5 / static_cast<double>(i < things_ ? things_ : count_ - things_));
  }

  Stump best_stump() {
    Stump best{};
    double most = -1;
    // Each stump chooses among every sixth feature, in turn: neighbours are alike, and it takes a sixth of the time.
    for (size_t f = turn_++ % kTurns; f < features_.size(); f += kTurns) {
      Histogram h{};
      const uint8_t *codes = &codes_[f * count_];
      for (size_t i = 0; i < things_; i++) h.things[codes[i]] += static_cast<double>(weights_[i]);
      for (size_t i = things_; i < count_; i++) h.others[codes[i]] += static_cast<double>(weights_[i]);
      Stump one{static_cast<uint32_t>(f), {}, {}};
      const double gain = split(h, &one);
      if (gain > most) most = gain, best = one;
    }
    return best;
  }

  void take(const Stump &s) {
    const uint8_t *codes = &codes_[s.feature * count_];
    double all = 0;
    for (size_t i = 0; i < count_; i++) {
      const float leaf = s.leaves[(s.codes[codes[i] >> 5] >> (codes[i] & 31) & 1u) ? 0 : 1];
      sums_[i] += static_cast<double>(leaf);
      weights_[i] *= static_cast<float>(std::exp(i < things_ ? -static_cast<double>(leaf) : static_cast<double>(leaf)));
      all += static_cast<double>(weights_[i]);
    }
    for (float &w : weights_) w /= static_cast<float>(all);
  }

  // The largest threshold that keeps so many of the things; how many others pass.
  void judge(double keep, Stage *stage) const {
    std::vector<double> ordered(sums_.begin(), sums_.begin() + static_cast<ptrdiff_t>(things_));
    std::sort(ordered.begin(), ordered.end());
    const auto lost = static_cast<size_t>((1 - keep) * static_cast<double>(things_));
    stage->threshold = static_cast<float>(ordered[lost] - 1e-4);
    const auto share = [&](size_t from, size_t to) {
      const auto passed =
          std::count_if(sums_.begin() + static_cast<ptrdiff_t>(from), sums_.begin() + static_cast<ptrdiff_t>(to),
                        [&](double s) { return s >= static_cast<double>(stage->threshold); });
      return static_cast<double>(passed) / static_cast<double>(to - from);
    };
    stage->kept = share(0, things_);
    stage->passed = share(things_, count_);
  }

 private:
  // Codes that speak against the thing, or for nothing that was seen, go to the first leaf.
  static double split(const Histogram &h, Stump *out) {
    constexpr double kUnseen = 2e-4;  // weight against it that each code has beforehand
    double weight[2] = {0, 0}, sum[2] = {0, 0};
    for (int c = 0; c < kCodes; c++) {
      const bool against = h.things[c] <= h.others[c] + kUnseen;
      if (against) out->codes[c >> 5] |= 1u << (c & 31);
      const int leaf = against ? 0 : 1;
      weight[leaf] += h.things[c] + h.others[c];
      sum[leaf] += h.things[c] - h.others[c];
    }
    double gain = 0;
    for (int leaf = 0; leaf < 2; leaf++) {
      out->leaves[leaf] = weight[leaf] > 0 ? static_cast<float>(sum[leaf] / weight[leaf]) : (leaf == 0 ? -1.f : 1.f);
      if (weight[leaf] > 0) gain += sum[leaf] * sum[leaf] / weight[leaf];
    }
    return gain;
  }

  const std::vector<wm_cascade_feature> &features_;
  size_t count_, things_, turn_ = 0;
  std::vector<uint8_t> codes_;  // a row a feature
  std::vector<float> weights_;
  std::vector<double> sums_;
};

}  // namespace

TrainedCascade::TrainedCascade(int width, int height) : width_px(width), height_px(height) {
  for (int h = 1; 3 * h <= height; h++)
    for (int w = 1; 3 * w <= width; w++)
      for (int y = 0; y + 3 * h <= height; y++)
        for (int x = 0; x + 3 * w <= width; x++) {
          wm_cascade_feature f{};
          f.x[0] = static_cast<uint8_t>(x), f.y[0] = static_cast<uint8_t>(y);
          f.width[0] = static_cast<uint8_t>(w), f.height[0] = static_cast<uint8_t>(h);
          f.weight[0] = 1;
          features.push_back(f);
        }
}

void TrainedCascade::flatten(Flat *out) {
  *out = {};
  for (const Stage &stage : stages) {
    out->stages.push_back(
        {static_cast<uint32_t>(out->trees.size()), static_cast<uint32_t>(stage.stumps.size()), stage.threshold});
    for (const Stump &s : stage.stumps) {
      out->trees.push_back({static_cast<uint32_t>(out->nodes.size()), static_cast<uint32_t>(out->leaves.size())});
      wm_cascade_node node{{0, -1}, s.feature, 0, {}};
      std::copy(std::begin(s.codes), std::end(s.codes), node.codes);
      out->nodes.push_back(node);
      out->leaves.insert(out->leaves.end(), {s.leaves[0], s.leaves[1]});
    }
  }
  wm_cascade &v = out->view;
  v.is_lbp = 1;
  v.width_px = static_cast<uint32_t>(width_px), v.height_px = static_cast<uint32_t>(height_px);
  v.feature_count = features.size(), v.features = features.data();
  v.node_count = out->nodes.size(), v.nodes = out->nodes.data();
  v.leaf_count = out->leaves.size(), v.leaves = out->leaves.data();
  v.tree_count = out->trees.size(), v.trees = out->trees.data();
  v.stage_count = out->stages.size(), v.stages = out->stages.data();
}

void train_stage(const std::vector<WindowSums> &things, const std::vector<WindowSums> &others,
                 const BoostOptions &options, TrainedCascade *cascade) {
  Booster booster(things, others, *cascade);
  Stage stage;
  while (static_cast<int>(stage.stumps.size()) < options.stumps_max) {
    stage.stumps.push_back(booster.best_stump());
    booster.take(stage.stumps.back());
    booster.judge(options.keep, &stage);
    if (stage.passed <= options.let_pass) break;
  }
  cascade->stages.push_back(stage);
}

void write_cascade(const TrainedCascade &cascade, const std::string &about, const std::filesystem::path &file) {
  std::map<uint32_t, size_t> used;
  for (const Stage &stage : cascade.stages)
    for (const Stump &s : stage.stumps) used.emplace(s.feature, 0);
  size_t next = 0;
  for (auto &entry : used) entry.second = next++;
  std::string text = "<?xml version=\"1.0\"?>\n<!-- " + about +
                     " -->\n<opencv_storage>\n<cascade type_id=\"opencv-cascade-classifier\">\n";
  const auto line = [&](const char *format, auto... values) {
    char row[256];
    std::snprintf(row, sizeof row, format, values...);
    text += row;
  };
  line("  <stageType>BOOST</stageType>\n  <featureType>LBP</featureType>\n  <height>%d</height>\n  <width>%d</width>\n",
       cascade.height_px, cascade.width_px);
  size_t most = 0;
  for (const Stage &stage : cascade.stages) most = std::max(most, stage.stumps.size());
  line(
      "  <stageParams>\n    <boostType>GAB</boostType>\n    <maxDepth>1</maxDepth>\n    "
      "<maxWeakCount>%zu</maxWeakCount>"
      "</stageParams>\n",
      most);
  line(
      "  <featureParams>\n    <maxCatCount>256</maxCatCount></featureParams>\n  <stageNum>%zu</stageNum>\n  <stages>\n",
      cascade.stages.size());
  for (const Stage &stage : cascade.stages) {
    line(
        "    <_>\n      <maxWeakCount>%zu</maxWeakCount>\n      <stageThreshold>%.9g</stageThreshold>\n"
        "      <weakClassifiers>\n",
        stage.stumps.size(), static_cast<double>(stage.threshold));
    for (const Stump &s : stage.stumps) {
      line("        <_>\n          <internalNodes>\n            0 -1 %zu", used[s.feature]);
      for (const uint32_t codes : s.codes) line(" %d", static_cast<int32_t>(codes));
      line("</internalNodes>\n          <leafValues>\n            %.9g %.9g</leafValues></_>\n",
           static_cast<double>(s.leaves[0]), static_cast<double>(s.leaves[1]));
    }
    text += "      </weakClassifiers></_>\n";
  }
  text += "  </stages>\n  <features>\n";
  for (const auto &entry : used) {
    const wm_cascade_feature &f = cascade.features[entry.first];
    line("    <_>\n      <rect>\n        %d %d %d %d</rect></_>\n", f.x[0], f.y[0], f.width[0], f.height[0]);
  }
  text += "  </features></cascade>\n</opencv_storage>\n";
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw Failure(file.string() + ": could not be written");
}

}  // namespace wm::tools
