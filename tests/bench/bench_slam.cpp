// SPDX-License-Identifier: Apache-2.0
// What a SLAM step costs: prediction and one marker with three rows (x, y, heading), at several numbers of landmarks.
// Medians of single steps, the clock's own cost taken away; beside them the scalar twin of the covariance's kernel.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <vector>

#include "filters/slam/joint_state.hpp"
#include "timing.h"
#include "waymark/random.h"

namespace {

using wm::joint_state;
constexpr int kRuns = 2000;

struct filter {
  std::vector<char> motion, memory;
  wm_setup setup{};
  joint_state *state;

  explicit filter(int landmarks) : motion(wm_motion_params_table.bytes) {
    wm_params_defaults(&wm_motion_params_table, motion.data());
    setup.motion = reinterpret_cast<const wm_motion_params *>(motion.data());
    setup.wheels = {0.1, 2048, 0.4, 0, 0, 0, 0, {}, {}};
    setup.start.t_ns = WM_TIME_NONE;
    const wm::joint_layout layout = {10, 10, 0, 3, landmarks, true};
    const size_t head = (sizeof(joint_state) + 15) / 16 * 16;
    memory.resize(head + joint_state::doubles(layout) * sizeof(double) + 16);
    char *at = memory.data() + (16 - reinterpret_cast<uintptr_t>(memory.data()) % 16) % 16;
    state = new (at) joint_state;
    state->init(setup, layout, reinterpret_cast<double *>(at + head));
    wm_motion_states states{};
    for (double &sigma : states.sigma) sigma = 0.01;
    states.sigma[7] = states.sigma[8] = 0.0;
    state->set_motion_states(states, {}, wm::kPoseStates);
    const double start[3][3] = {{1e-4, 0, 0}, {0, 1e-4, 0}, {0, 0, 1e-4}};
    state->set_pose({0, 0, 0}, start);
    for (int i = 0; i < landmarks; i++) {
      wm::joint_row rows[3];
      for (int k = 0; k < 3; k++) rows[k].add(k, 1.0);
      const double noise[3][3] = {{0.01, 0, 0}, {0, 0.01, 0}, {0, 0, 0.01}};
      const double place[3] = {wm_random_normal(1, 1, (uint64_t)i), wm_random_normal(1, 2, (uint64_t)i), 0.0};
      state->add_landmark(rows, noise, place);
    }
  }

  void predict(int step) {
    wm_event e{};
    e.t_ns = WM_NS_PER_MS * 20 * (step + 1);
    e.kind = WM_EVENT_TWIST2;
    e.as.twist2 = {0.5, 0.2};
    state->move(e);
  }

  void correct(int step) {
    const int s = state->landmark_state(step % state->landmarks());
    wm::joint_row rows[3];
    double innovation[3], noise[3];
    for (int k = 0; k < 3; k++) {
      rows[k].add(k, -1.0);
      rows[k].add(s + k, 1.0);
      innovation[k] = 0.01 * wm_random_normal(2, (uint64_t)k, (uint64_t)step);
      noise[k] = 1e-4;
    }
    const double none[3] = {};
    joint_state::innovation_block block;
    state->prepare(rows, innovation, noise, 3, &block);
    state->fuse(block, none, false);
  }
};

void measure(int landmarks) {
  filter f(landmarks);
  std::vector<double> predict, both, overhead;
  for (int i = 0; i < kRuns; i++) {
    const int64_t a = bench::now_ns();
    f.predict(i);
    const int64_t b = bench::now_ns();
    f.correct(i);
    const int64_t c = bench::now_ns();
    overhead.push_back((double)(bench::now_ns() - c));
    predict.push_back((double)(b - a));
    both.push_back((double)(c - a));
  }
  const double clock = bench::median(overhead);
  std::printf("marker step, %3d landmarks (%3d states): predict %6.2f us, both %7.2f us\n", landmarks,
              f.state->states(), 1e-3 * (bench::median(predict) - clock), 1e-3 * (bench::median(both) - 2 * clock));
}

void bench_kernel(int n) {
  const int capacity = wm::even(n);
  std::vector<double> data(wm::half_covariance::doubles(capacity) + 2), vectors(5 * (size_t)capacity + 2);
  const auto align = [](std::vector<double> &v) {
    return reinterpret_cast<double *>((reinterpret_cast<uintptr_t>(v.data()) + 15) / 16 * 16);
  };
  double *v = align(vectors);
  for (int i = 0; i < 5 * capacity; i++) v[i] = 1e-3 * wm_random_normal(3, 1, (uint64_t)i);
  const wm::half_covariance p = {align(data), capacity};
  const wm::half_update u = {3, {v, v + capacity, v + 2 * capacity}, v + 3 * capacity, v + 4 * capacity};
  std::vector<double> fast, slow;
  for (int i = 0; i < 300; i++) {
    const int64_t a = bench::now_ns();
    wm::vectors::apply(p, u, n);
    const int64_t b = bench::now_ns();
    wm::scalar::apply(p, u, n);
    fast.push_back((double)(b - a));
    slow.push_back((double)(bench::now_ns() - b));
  }
  std::printf("covariance kernel, %3d states: vectors %7.2f us, scalar twin %7.2f us\n", n, 1e-3 * bench::median(fast),
              1e-3 * bench::median(slow));
}

}  // namespace

int main() {
  for (int landmarks : {30, 100, 250}) measure(landmarks);
  for (int n : {100, 310, 760}) bench_kernel(n);
  return 0;
}
