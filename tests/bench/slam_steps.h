// SPDX-License-Identifier: Apache-2.0
// The joint state of SLAM with coded markers: a prediction and one marker with three rows (x, y, heading).
#pragma once

#include <new>
#include <vector>

#include "filters/slam/joint_state.hpp"
#include "waymark/random.h"

namespace bench {

class slam_steps {
 public:
  explicit slam_steps(int landmarks) : motion_(wm_motion_params_table.bytes) {
    wm_params_defaults(&wm_motion_params_table, motion_.data());
    setup_.motion = reinterpret_cast<const wm_motion_params *>(motion_.data());
    setup_.wheels = {0.1, 2048, 0.4, 0, 0, 0, 0, {}, {}};
    setup_.start.t_ns = WM_TIME_NONE;
    const wm_motion_states &states = setup_.motion->states;
    const int robot = wm::kPoseStates + wm::joint_state::count_motion_states(states, WM_MOTION_AUTO, {});
    const wm::joint_layout layout = {robot, robot, 0, kRows, landmarks, true};
    const size_t head = (sizeof(wm::joint_state) + 15) / 16 * 16;
    memory_.resize(head + wm::joint_state::doubles(layout) * sizeof(double) + 16);
    char *at = memory_.data() + (16 - reinterpret_cast<uintptr_t>(memory_.data()) % 16) % 16;
    state_ = new (at) wm::joint_state;
    state_->init(setup_, layout, reinterpret_cast<double *>(at + head));
    state_->set_motion_states(states, WM_MOTION_AUTO, {}, wm::kPoseStates);
    const double start[3][3] = {{1e-4, 0, 0}, {0, 1e-4, 0}, {0, 0, 1e-4}};
    state_->set_pose({0, 0, 0}, start);
    state_->find_scale(false);  // as under coded markers
    for (uint64_t i = 0; i < static_cast<uint64_t>(landmarks); i++) {
      wm::joint_row rows[kRows];
      for (int k = 0; k < kRows; k++) rows[k].add(k, 1.0);
      const double noise[3][3] = {{0.01, 0, 0}, {0, 0.01, 0}, {0, 0, 0.01}};
      const double place[3] = {wm_random_normal(1, 1, i), wm_random_normal(1, 2, i), 0.0};
      state_->add_landmark(rows, noise, place);
    }
  }

  // False: the innovation's covariance is not positive definite.
  bool step() {
    wm_event e{};
    e.t_ns = WM_NS_PER_MS * 20 * (steps_ + 1);
    e.kind = WM_EVENT_TWIST2;
    e.as.twist2 = {0.5, 0.2};
    state_->move(e);
    const int s = state_->landmark_state(steps_ % state_->landmarks());
    wm::joint_row rows[kRows];
    double innovation[kRows], noise[kRows];
    for (int k = 0; k < kRows; k++) {
      rows[k].add(k, -1.0);
      rows[k].add(s + k, 1.0);
      innovation[k] = 0.01 * wm_random_normal(2, static_cast<uint64_t>(k), static_cast<uint64_t>(steps_));
      noise[k] = 1e-4;
    }
    steps_++;
    return state_->fuse(state_->prepare(rows, innovation, noise, kRows), nullptr, wm::joint_state::scope::all);
  }

 private:
  static constexpr int kRows = 3;
  std::vector<char> motion_, memory_;
  wm_setup setup_{};
  wm::joint_state *state_;
  int steps_ = 0;
};

}  // namespace bench
