// SPDX-License-Identifier: Apache-2.0
// A street for detector `landmarks`: a fisheye of 1280x720 and six known signs before it, from 3 to 14 m away.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/fisheye_rig.hpp"
#include "detector_at_work.h"
#include "vision/landmarks/guess.hpp"
#include "vision/landmarks/match.hpp"
#include "waymark/random.h"

namespace bench {

constexpr uint32_t kStreetWidth = 1280, kStreetHeight = 720;
constexpr int kSigns = 6, kSignSide = 96;

// Six signs of 0.7 m before a fisheye: each its own pattern of bars.
struct drawn_street {
  wm_rig rig;
  wm_landmark landmark[kSigns];
  wm_appearance look[kSigns];
  std::vector<uint8_t> sign[kSigns], picture;
  wm_estimate pose{};

  drawn_street()
      : rig(wm::drawn::rig_of({wm::drawn::fisheye(kStreetWidth, kStreetHeight, 424, {{0, 0, 1.4}, {0, 0, 0}})})),
        picture(kStreetWidth * kStreetHeight) {
    pose.state = WM_STATE_TRACKING;
    pose.dof = 3;
    pose.pose_map_base.q_xyzw[3] = 1;
    pose.covariance[wm_cov_index(0, 0)] = pose.covariance[wm_cov_index(1, 1)] = 0.03 * 0.03;
    pose.covariance[wm_cov_index(5, 5)] = 0.005 * 0.005;
    for (int i = 0; i < kSigns; i++) {
      sign[i].resize(kSignSide * kSignSide);
      for (int k = 0; k < kSignSide * kSignSide; k++)
        sign[i][static_cast<size_t>(k)] =
            wm_random_uniform(7, static_cast<uint64_t>(i),
                              static_cast<uint64_t>(k / kSignSide / 16 * 6 + k % kSignSide / 16)) > 0.5
                ? 210
                : 45;
      const double away = 3 + 2.2 * i, across = (i - 2.5) * 0.45 * away;
      landmark[i] = {i + 1, {away, across, 1.4 + 0.12 * away}, 0.02, static_cast<double>(NAN), {0, 0, 0}, 0};
      look[i] = {i + 1, kSignSide, kSignSide, sign[i].data(), 0.7, 0.7, -M_PI / 2 + 0.3 * (i % 3 - 1)};
    }
    draw();
  }

  void draw() {
    wm::mounted_camera camera;
    wm::camera_guess guess;
    wm::mounted_camera_init(&camera, rig.cameras[0]);
    wm::guess_camera(camera, &pose, 0, &guess);
    wm::panel_view panels[kSigns];
    wm::appearance what[kSigns];
    std::vector<uint8_t> memory[kSigns];
    for (int i = 0; i < kSigns; i++) {
      memory[i].resize(wm::appearance::bytes(kSignSide, kSignSide));
      what[i].make(look[i], landmark[i], memory[i].data());
      wm::view_panel(what[i], guess.R_map_optical, guess.eye_m, &panels[i]);
    }
    for (uint32_t v = 0; v < kStreetHeight; v++)
      for (uint32_t u = 0; u < kStreetWidth; u++) {
        double sum = 0;
        for (int s = 0; s < 4; s++) {
          wm::vec3 ray;
          double grey = 100 + 20 * std::sin(0.05 * u) * std::sin(0.07 * v);
          if (wm::unproject(camera.optics, {u - 0.25 + 0.5 * (s % 2), v - 0.25 + 0.5 * (s / 2)}, &ray))
            for (int i = kSigns - 1; i >= 0; i--) {
              const wm::vec3 q = panels[i].plane * ray;
              const double a = q.x / q.z / 0.7 + 0.5, b = 0.5 - q.y / q.z / 0.7;
              if (q.z > 0 && a > 0 && a < 1 && b > 0 && b < 1)
                grey = sign[i][static_cast<size_t>(static_cast<int>(b * kSignSide) * kSignSide +
                                                   static_cast<int>(a * kSignSide))];
            }
          sum += grey;
        }
        picture[v * kStreetWidth + u] =
            static_cast<uint8_t>(std::clamp(sum / 4 + 2 * wm_random_normal(3, 1, v * kStreetWidth + u), 0.0, 255.0));
      }
  }
};

// The street driven by: a landmark is looked for near where the pose says, which sways.
class street_at_work {
 public:
  explicit street_at_work(const drawn_street &street)
      : street_(street),
        detector_(wm_detector_find("landmarks"),
                  {&street.rig, &front_, street.landmark, kSigns, street.look, kSigns, nullptr, 0}) {}
  // One picture; `lost`: without a pose, everything is searched everywhere. Returns how many were found.
  size_t look(bool lost) {
    const wm_frame frame = frame_of(street_.picture, kStreetWidth, kStreetHeight);
    wm_estimate pose = street_.pose;
    pose.pose_map_base.p_m[1] = 0.03 * std::sin(looks_++);
    return detector_.look(&frame, lost ? nullptr : &pose);
  }
  size_t bytes() const { return detector_.bytes(); }

 private:
  static constexpr int32_t front_ = 0;
  const drawn_street &street_;
  detector_at_work detector_;
  int looks_ = 0;
};

}  // namespace bench
