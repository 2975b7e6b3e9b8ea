// SPDX-License-Identifier: Apache-2.0
// Detectors on drawn pictures, for benchmarks: `edges` on a 1280x720 fisheye picture of a room (floor, board and wall;
// the view of windows is at least 0.5 to 6 m ahead of the camera and 3 m to each side), `lines` on a hemispherical one.
#pragma once

#include <cstdint>
#include <vector>

#include "common/fisheye_rig.hpp"
#include "detector_at_work.h"
#include "vision/edges/params.h"
#include "vision/edges_hough/windows.hpp"
#include "waymark/internal/sensors/lens.hpp"
#include "waymark/random.h"

namespace bench {

class edges_at_work {
 public:
  // Mode 0: by rays; 1: by windows.
  explicit edges_at_work(int mode)
      : picture_(drawn()), edges_(wm_detector_find("edges"), view_, [&](void *params) {
          auto *of_edges = static_cast<wm_edges_params *>(params);
          of_edges->mode = mode;
          wm::bird_view_size(of_edges->hough, &bird_);
        }) {}

  // One picture; returns the number of points.
  uint32_t look() {
    const wm_frame frame = frame_of(picture_, kWidth, kHeight);
    return edges_.look(&frame) ? edges_.told(0).as.points.count : 0;
  }
  int windows() const { return bird_.windows; }

 private:
  static constexpr uint32_t kWidth = 1280, kHeight = 720;
  static constexpr int32_t kFront = 0;

  std::vector<uint8_t> drawn() const {
    std::vector<uint8_t> picture(kWidth * kHeight);
    wm::mounted_camera camera;
    wm::mounted_camera_init(&camera, rig_.cameras[0]);
    for (uint32_t v = 0; v < kHeight; v++)
      for (uint32_t u = 0; u < kWidth; u++) {
        double x, y;
        const bool is_floor = wm::floor_of(camera, {1.0 * u, 1.0 * v}, &x, &y) && x < 5 && y < 1.2 && y > -1.5;
        picture[v * kWidth + u] =
            static_cast<uint8_t>((is_floor ? 130 : 60) + 4 * wm_random_uniform(1, 2, v * kWidth + u));
      }
    return picture;
  }

  const wm_rig rig_ =
      wm::drawn::rig_of({wm::drawn::fisheye(kWidth, kHeight, 522, {{1.06, 0, 0.4}, {0, 22 * 3.14159265 / 180, 0}})});
  const wm_view view_ = {&rig_, &kFront, nullptr, 0, nullptr, 0, nullptr, 0};
  const std::vector<uint8_t> picture_;
  wm::bird_view bird_{};
  detector_at_work edges_;
};

// Upright lines of a 640x640 hemispherical picture, followed: forty of them, as in a furnished hall, and the grain of a
// sensor.
class lines_at_work {
 public:
  // One picture; returns the number of lines followed.
  size_t look() {
    const wm_frame frame = frame_of(picture_, kSide, kSide, 0, t_ns_ += 100'000'000);
    return lines_.look(&frame);
  }

 private:
  static constexpr uint32_t kSide = 640;
  static constexpr int32_t kUp = 0;

  std::vector<uint8_t> drawn() const {
    std::vector<uint8_t> picture(kSide * kSide);
    wm::mounted_camera camera;
    wm::mounted_camera_init(&camera, rig_.cameras[0]);
    for (uint32_t v = 0; v < kSide; v++)
      for (uint32_t u = 0; u < kSide; u++) {
        wm::vec3 ray;
        if (!wm::unproject(camera.optics, {1.0 * u, 1.0 * v}, &ray)) continue;
        const wm::vec3 d = camera.R_base_optical * ray;
        const int stripe = static_cast<int>((wm::atan2(d.y, d.x) + wm::kPi) * 40 / wm::kTwoPi);
        const double level = d.z > 0.5 || d.z < -0.2 ? 120 : 90 + 50 * (stripe % 2);
        picture[v * kSide + u] = static_cast<uint8_t>(level + 4 * wm_random_uniform(1, 2, v * kSide + u));
      }
    return picture;
  }

  const wm_rig rig_ = wm::drawn::rig_of(
      {wm::drawn::fisheye(kSide, kSide, 183.35, {{0, 0, 0.8}, {0, -90 * 3.14159265358979 / 180, 0}})});
  const wm_view view_ = {&rig_, &kUp, nullptr, 0, nullptr, 0, nullptr, 0};
  const std::vector<uint8_t> picture_ = drawn();
  detector_at_work lines_{wm_detector_find("lines"), view_};
  int64_t t_ns_ = 0;
};

}  // namespace bench
