// SPDX-License-Identifier: Apache-2.0
// Detector `edges` on a 1280x720 fisheye picture of a room: floor, board and wall, for benchmarks. The view of windows
// is at least 0.5 to 6 m ahead of the camera and 3 m to each side.
#ifndef WAYMARK_BENCH_DRAWN_PICTURE_H
#define WAYMARK_BENCH_DRAWN_PICTURE_H

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "vision/camera/lens.hpp"
#include "vision/edges/windows.hpp"
#include "waymark/detector.h"
#include "waymark/random.h"

namespace bench {

class edges_at_work {
 public:
  explicit edges_at_work(int mode) : picture_(kWidth * kHeight) {
    wm_rig_init(&rig_);
    rig_.camera_count = 1;
    wm_camera &c = rig_.cameras[0];
    c = wm_camera{};
    c.width_px = kWidth;
    c.height_px = kHeight;
    c.intrinsics_count = 4;
    const double intrinsics[] = {522, 522, 640, 360};
    std::copy(intrinsics, intrinsics + 4, c.intrinsics);
    c.mounting = {{1.06, 0, 0.4}, {0, 22 * 3.14159265 / 180, 0}};
    wm::mounted_camera camera;
    wm::mounted_camera_init(&camera, c);
    for (uint32_t v = 0; v < kHeight; v++)
      for (uint32_t u = 0; u < kWidth; u++) {
        double x, y;
        const bool is_floor = wm::floor_of(camera, {1.0 * u, 1.0 * v}, &x, &y) && x < 5 && y < 1.2 && y > -1.5;
        picture_[v * kWidth + u] =
            static_cast<uint8_t>((is_floor ? 130 : 60) + 4 * wm_random_uniform(1, 2, v * kWidth + u));
      }
    frame_ = {0, 0, 0, 0, 0, kWidth, kHeight, kWidth, picture_.data()};
    params_.resize(edges_->params.bytes);
    wm_params_defaults(&edges_->params, params_.data());
    auto *params = reinterpret_cast<wm_edges_params *>(params_.data());
    params->mode = mode;
    wm::bird_view_size(*params, &bird_);
    const wm_view view = {&rig_, &front_, nullptr, 0, nullptr, 0, nullptr, 0};
    const char *why = "";
    state_ = std::aligned_alloc(64, (edges_->state_bytes(params_.data(), &view, &why) + 63) / 64 * 64);
    if (!state_ || edges_->init(state_, params_.data(), &view) != WM_OK) std::abort();
  }
  ~edges_at_work() { std::free(state_); }
  edges_at_work(const edges_at_work &) = delete;
  edges_at_work &operator=(const edges_at_work &) = delete;

  // One picture; returns the number of points.
  uint32_t look() {
    size_t count = 0;
    (void)edges_->detect(state_, &frame_, nullptr, events_, 2, &count);
    return count ? events_[0].as.points.count : 0;
  }
  int windows() const { return bird_.windows; }

 private:
  static constexpr uint32_t kWidth = 1280, kHeight = 720;
  const wm_detector *edges_ = wm_detector_find("edges");
  wm_rig rig_;
  int32_t front_ = 0;
  std::vector<uint8_t> picture_;
  std::vector<char> params_;
  wm_frame frame_;
  wm::bird_view bird_;
  void *state_;
  wm_event events_[2];
};

}  // namespace bench

#endif
