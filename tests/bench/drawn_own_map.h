// SPDX-License-Identifier: Apache-2.0
// A full own map of random looks, and a search for the points of one picture in it.
#pragma once

#include <memory>
#include <vector>

#include "filters/stereo_ekf/map_search.hpp"
#include "waymark/random.h"

namespace bench {

class own_map_at_work {
 public:
  explicit own_map_at_work(int frames)
      : frames_(static_cast<size_t>(frames)),
        points_(frames_.size() * wm::own_map::kPointsOfFrame),
        places_(points_.size()),
        search_(std::make_unique<wm::map_search>()) {
    map_.init(frames, frames_.data(), points_.data(), places_.data());
    for (int f = 0; f < frames; f++) {
      map_.begin(f, f);
      for (int i = 0; i < wm::own_map::kPointsOfFrame; i++) {
        wm::own_point point{};
        look(static_cast<uint64_t>(f * wm::own_map::kPointsOfFrame + i), point.appearance);
        (void)map_.add(f, point);
      }
    }
  }
  void begin() {
    search_->begin({{0, 0, 0}, wm::kNoTurn});
    for (uint64_t i = 0; i < wm::map_search::kPointsMost; i++) {
      uint64_t seen[wm::kAppearanceWords];
      look(7 * i, seen);
      search_->add(seen, {0, 0, 0}, 0.01);
    }
  }
  bool step() { return search_->step(map_); }

 private:
  static void look(uint64_t point, uint64_t out[wm::kAppearanceWords]) {
    for (uint64_t i = 0; i < wm::kAppearanceWords; i++)
      out[i] = static_cast<uint64_t>(wm_random_uniform(point, 1, i) * 1.8e19);
  }
  std::vector<wm::own_frame> frames_;
  std::vector<wm::own_point> points_;
  std::vector<wm::vec3> places_;
  wm::own_map map_;
  std::unique_ptr<wm::map_search> search_;
};

}  // namespace bench
