// SPDX-License-Identifier: Apache-2.0
// What a SLAM step costs: prediction and one marker with three rows (x, y, heading), at several numbers of landmarks.
// Medians of single steps, the clock's own cost taken away; beside them the scalar twin of the covariance's kernel, and
// the same step (range and bearing to one landmark of two numbers) by MRPT's range-bearing EKF SLAM, where its Debian
// package was there at the build.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <vector>

#include "filters/slam/joint_state.hpp"
#include "timing.h"
#include "waymark/random.h"
#ifdef WM_HAS_MRPT_SLAM
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservationBearingRange.h>
#include <mrpt/slam/CRangeBearingKFSLAM2D.h>

#include <cmath>
#include <numbers>
#endif

namespace {

using wm::joint_state;

struct filter {
  std::vector<char> motion, memory;
  wm_setup setup{};
  joint_state *state;
  int width;  // of a landmark, and the rows of what is seen of it

  explicit filter(int landmarks, int width_) : motion(wm_motion_params_table.bytes), width(width_) {
    wm_params_defaults(&wm_motion_params_table, motion.data());
    setup.motion = reinterpret_cast<const wm_motion_params *>(motion.data());
    setup.wheels = {0.1, 2048, 0.4, 0, 0, 0, 0, {}, {}};
    setup.start.t_ns = WM_TIME_NONE;
    const wm_motion_states &states = setup.motion->states;
    const int robot = wm::kPoseStates + joint_state::count_motion_states(states, WM_MOTION_AUTO, {});
    const wm::joint_layout layout = {robot, robot, 0, width, landmarks, true};
    const size_t head = (sizeof(joint_state) + 15) / 16 * 16;
    memory.resize(head + joint_state::doubles(layout) * sizeof(double) + 16);
    char *at = memory.data() + (16 - reinterpret_cast<uintptr_t>(memory.data()) % 16) % 16;
    state = new (at) joint_state;
    state->init(setup, layout, reinterpret_cast<double *>(at + head));
    state->set_motion_states(states, WM_MOTION_AUTO, {}, wm::kPoseStates);
    const double start[3][3] = {{1e-4, 0, 0}, {0, 1e-4, 0}, {0, 0, 1e-4}};
    state->set_pose({0, 0, 0}, start);
    if (width == 3) state->find_scale(false);  // as under coded markers
    for (int i = 0; i < landmarks; i++) {
      wm::joint_row rows[3];
      for (int k = 0; k < width; k++) rows[k].add(k, 1.0);
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
    for (int k = 0; k < width; k++) {
      rows[k].add(k, -1.0);
      rows[k].add(s + k, 1.0);
      innovation[k] = 0.01 * wm_random_normal(2, (uint64_t)k, (uint64_t)step);
      noise[k] = 1e-4;
    }
    if (state->fuse(state->prepare(rows, innovation, noise, width), nullptr, wm::joint_state::scope::all)) return;
    std::printf("step %d: the innovation's covariance is not positive definite: nothing is measured\n", step);
    std::exit(1);
  }
};

// The median of prediction and correction together, in us.
double measure(int landmarks, int width) {
  filter f(landmarks, width);
  std::vector<double> predict, both, overhead;
  for (int i = 0; i < bench::rounds(landmarks > 500 ? 200 : 2000); i++) {
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
  const double us = 1e-3 * (bench::median(both) - 2 * clock);
  std::printf("%s step, %4d landmarks (%4d states): predict %6.2f us, both %7.2f us\n",
              width == 3 ? "marker" : "range and bearing", landmarks, f.state->states(),
              1e-3 * (bench::median(predict) - clock), us);
  return us;
}

#ifdef WM_HAS_MRPT_SLAM
using bayes_method = mrpt::bayes::TKFMethod;

// MRPT's, told the landmark's identity as ours is. Landmarks stand all around and it looks ahead, as narrowly as it
// can be told: it predicts what it may see within 30 degrees of its field of view, a sixth of them.
class mrpt_at_work {
 public:
  mrpt_at_work(int landmarks, bayes_method method) : count_(landmarks) {
    slam_.KF_options.method = method;
    slam_.setMinLoggingLevel(mrpt::system::LVL_ERROR);
    slam_.options.std_sensor_range = 0.01f;
    slam_.options.std_sensor_yaw = 0.01f;
    std::vector<int> all;
    for (int i = 0; i < landmarks; i++) all.push_back(i);
    see(all, 0.0);
  }

  double step_us(int calls) {
    std::vector<double> each;
    for (int i = 0; i < bench::rounds(calls); i++) {
      heading_ += kTurn_rad;
      const int ahead = static_cast<int>(std::lround(heading_ / (2 * std::numbers::pi) * count_)) % count_;
      each.push_back(see({ahead}, kTurn_rad));
    }
    return bench::median(each);
  }

  size_t states() {  // and whether it works at all
    mrpt::poses::CPosePDFGaussian pose;
    std::vector<mrpt::math::TPoint2D> places;
    std::map<unsigned int, mrpt::maps::CLandmark::TLandmarkID> ids;
    mrpt::math::CVectorDouble state;
    mrpt::math::CMatrixDouble covariance;
    slam_.getCurrentState(pose, places, ids, state, covariance);
    if (std::fabs(mrpt::math::wrapToPi(pose.mean.phi() - heading_)) > 0.01) std::printf("MRPT's heading is lost: ");
    return static_cast<size_t>(state.size());
  }

 private:
  static constexpr double kTurn_rad = 0.004, kRing_m = 5.0;
  mrpt::slam::CRangeBearingKFSLAM2D slam_;
  int count_;
  double heading_ = 0.0;

  double see(const std::vector<int> &ids, double turn_rad) {
    auto actions = mrpt::obs::CActionCollection::Create();
    mrpt::obs::CActionRobotMovement2D motion;
    motion.computeFromOdometry(mrpt::poses::CPose2D(0, 0, turn_rad), {});
    actions->insert(motion);
    auto seen = mrpt::obs::CObservationBearingRange::Create();
    seen->maxSensorDistance = 2 * static_cast<float>(kRing_m);
    seen->fieldOfView_yaw = 0.0f;
    for (int id : ids) {
      mrpt::obs::CObservationBearingRange::TMeasurement one{};
      one.range = static_cast<float>(kRing_m);
      one.yaw = static_cast<float>(mrpt::math::wrapToPi(2 * std::numbers::pi * id / count_ - heading_));
      one.landmarkID = id;
      seen->sensedData.push_back(one);
    }
    auto frame = mrpt::obs::CSensoryFrame::Create();
    frame->insert(seen);
    const int64_t begin = bench::now_ns();
    slam_.processActionObservation(actions, frame);
    return 1e-3 * static_cast<double>(bench::now_ns() - begin);
  }
};

void measure_mrpt(int landmarks, double ours_us) {
  const struct {
    const char *name;
    bayes_method method;
  } methods[] = {{"as it comes", mrpt::bayes::kfEKFNaive}, {"row by row", mrpt::bayes::kfEKFAlaDavison}};
  for (const auto &[name, method] : methods) {
    mrpt_at_work work(landmarks, method);
    const double us = work.step_us(landmarks > 200 ? 201 : 501);
    std::printf("range and bearing step, %3d landmarks (%3zu states): MRPT's, %s, %9.2f us, %.1f times ours\n",
                landmarks, work.states(), name, us, us / ours_us);
  }
}
#endif

void bench_kernel(int n) {
  const int capacity = wm::even(n);
  std::vector<double> data(wm::half_covariance::doubles(capacity) + 2), vectors(5 * (size_t)capacity + 2);
  const auto align = [](std::vector<double> &v) {
    return reinterpret_cast<double *>((reinterpret_cast<uintptr_t>(v.data()) + 15) / 16 * 16);
  };
  double *v = align(vectors);
  for (int i = 0; i < 5 * capacity; i++) v[i] = 1e-3 * wm_random_normal(3, 1, (uint64_t)i);
  const wm::half_covariance p = {align(data), capacity};
  const wm::half_update u = {3, 1, {v, v + capacity, v + 2 * capacity}, {v + 3 * capacity}, {v + 4 * capacity}};
  wm::filled_states all;
  all.add(0, capacity, 0);
  std::vector<double> fast, slow;
  for (int i = 0; i < bench::rounds(300); i++) {
    const int64_t a = bench::now_ns();
    wm::vectors::apply(p, u, all);
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
  for (int landmarks : {30, 100, 250, 1000}) measure(landmarks, 3);
  for (int landmarks : {30, 100, 250, 1000}) {
    [[maybe_unused]] const double ours_us = measure(landmarks, 2);
#ifdef WM_HAS_MRPT_SLAM
    if (landmarks <= 250) measure_mrpt(landmarks, ours_us);  // its step takes seconds beyond
#endif
  }
#ifndef WM_HAS_MRPT_SLAM
  std::printf("MRPT's SLAM: not measured, it was not there at the build (Debian: libmrpt-slam-dev)\n");
#endif
  for (int n : {100, 310, 760}) bench_kernel(n);
  return 0;
}
