// SPDX-License-Identifier: Apache-2.0
// A receiver's delay beside the place of its antenna: at constant speed the two are one along the way.
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "common/suite.h"
#include "events.hpp"
#include "math/arc.hpp"
#include "waymark/random.h"

namespace {

constexpr double kStep_s = 0.02, kSpeed_mps = 1.5;
constexpr int kSteps = 3000, kAround = 200, kSeeds = 20;  // the path goes on before and behind the drive

const wm_estimator *ekf;
wm_motion_params motion;
std::vector<char> params;
wm_sensor sensor;
wm_setup setup;
std::unique_ptr<void, void (*)(void *)> state(nullptr, std::free);

void feed(const wm_event &e) { TEST_ASSERT_EQUAL(WM_OK, make::feed(*ekf, state.get(), e)); }

std::vector<wm_calibration_value> calibration() {
  std::vector<wm_calibration_value> out(64);
  out.resize(ekf->calibration(state.get(), out.data(), out.size()));
  return out;
}

wm_calibration_value found(const std::string &name) {
  for (const wm_calibration_value &v : calibration())
    if (name == v.name) return v;
  TEST_FAIL_MESSAGE(name.c_str());
  return {};
}

// What differs between drives: amplitudes of speed and turn rate, noise of the speed, compass or not, start given or
// not.
struct kind {
  const char *name;
  double speed_mps, turn_radps, noise_mps;
  bool has_heading, is_given;
};

// The true path, a pose each step, from kAround steps before the drive on.
struct path {
  std::vector<wm_pose2> pose{wm_pose2{}};
  std::vector<double> v, w;

  explicit path(const kind &k) {
    for (int i = 0; i < kSteps + 2 * kAround; i++) {
      const double t = kStep_s * (i - kAround);
      v.push_back(kSpeed_mps + k.speed_mps * std::sin(0.7 * t));
      w.push_back(k.turn_radps * std::sin(0.4 * t));
      const wm::arc a = wm::make_arc(kStep_s * v.back(), kStep_s * w.back());
      pose.push_back(wm::compose(pose.back(), {a.x_m, a.y_m, a.turn_rad}));
    }
  }
  // As seen from the drive's start.
  wm_pose2 at(double step) const {
    const auto j = static_cast<size_t>(step + kAround);
    const double part = step + kAround - static_cast<double>(j);
    const wm_pose2 &a = pose[j], &b = pose[j + 1];
    return wm::between(pose[kAround], {a.x_m + part * (b.x_m - a.x_m), a.y_m + part * (b.y_m - a.y_m),
                                       a.heading_rad + part * (b.heading_rad - a.heading_rad)});
  }
};

// Sums of squares of errors over their sigmas, of errors, and of sigmas, for delay (0) and the antenna's place ahead
// (1).
struct sums {
  double normal[2] = {0, 0}, error[2] = {0, 0}, sigma[2] = {0, 0}, together_m2 = 0;

  void add(int k, const wm_calibration_value &v, double truth) {
    normal[k] += (v.value - truth) * (v.value - truth) / (v.sigma * v.sigma) / kSeeds;
    error[k] += (v.value - truth) * (v.value - truth) / kSeeds;
    sigma[k] += v.sigma / kSeeds;
  }
  void add(const sums &other) {
    for (int k = 0; k < 2; k++) normal[k] += other.normal[k], error[k] += other.error[k], sigma[k] += other.sigma[k];
    together_m2 += other.together_m2;
  }
};

void begin(const kind &k, uint64_t seed) {
  const auto noise = [seed](uint64_t i) { return wm_random_normal(110, seed, i); };
  setup.start = {WM_TIME_NONE, {noise(0), noise(1), 0}, {0, 0, 0, 1}, 0.1 * noise(2), 1.0, 0.1};
  if (!k.is_given) setup.start.p_m[0] = setup.start.p_m[1] = setup.start.heading_rad = NAN;
  params.resize(ekf->params.bytes);
  wm_params_defaults(&ekf->params, params.data());
  state.reset(make::begun(*ekf, params.data(), setup));
}

// A receiver of 3 cm five times a second, with a delay and an antenna of its own in each drive.
sums drive(const kind &k, uint64_t seed, int steps = kSteps) {
  sums out;
  const auto noise = [seed](uint64_t of, int i) { return wm_random_normal(of, seed, static_cast<uint64_t>(i)); };
  const double delay_s = 0.2 * noise(103, 0), ahead_m = 0.3 * noise(101, 0), left_m = 0.3 * noise(102, 0);
  const path truth(k);
  begin(k, seed);
  for (int i = 0; i < steps; i++) {
    const double t = kStep_s * i;
    const auto at = static_cast<size_t>(i + kAround);
    feed(make::twist(t, truth.v[at] + k.noise_mps * noise(0, i), truth.w[at] + 0.005 * noise(1, i)));
    if (i % 10) continue;
    const wm_pose2 antenna = wm::compose(truth.at(i - delay_s / kStep_s), {ahead_m, left_m, 0});
    feed(make::position(t, antenna.x_m + 0.03 * noise(2, i), antenna.y_m + 0.03 * noise(3, i), 0.05));
    const double heading_rad = truth.at(i).heading_rad + 0.02 * noise(4, i);
    if (k.has_heading) feed(make::heading(t, std::remainder(heading_rad, 2 * M_PI), 0.02));
  }
  const wm_calibration_value delay = found("gnss.time_offset_s"), ahead = found("gnss.antenna_x_m");
  out.add(0, delay, delay_s);
  out.add(1, ahead, ahead_m);
  const double off_m = ahead.value - ahead_m - kSpeed_mps * (delay.value - delay_s);
  out.together_m2 += off_m * off_m / kSeeds;
  return out;
}

sums drives(const kind &k) {
  sums out;
  for (uint64_t seed = 1; seed <= kSeeds; seed++) out.add(drive(k, seed));
  std::printf("%s: delay %.2f sigmas of %.3f s, rms %.3f s; antenna %.2f sigmas of %.3f m, rms %.3f m; sum %.3f m\n",
              k.name, std::sqrt(out.normal[0]), out.sigma[0], std::sqrt(out.error[0]), std::sqrt(out.normal[1]),
              out.sigma[1], std::sqrt(out.error[1]), std::sqrt(out.together_m2));
  return out;
}

// A pose that is found takes the calibration back to its start; the receiver's error is no part of that, and keeps the
// sigma that the receiver states: 0.1 m, not the 2 m that its state begins with before the first position.
TEST(test_a_found_start_leaves_the_receivers_error_as_it_is) {
  for (uint64_t seed = 1; seed <= kSeeds; seed++) {
    drive({"found", 0, 0.4, 0.02, true, false}, seed, 150);
    for (const wm_calibration_value &v : calibration())
      TEST_ASSERT_NOT_EQUAL(0, std::string(v.name).compare("gnss.lasting_error"));
  }
}

// In curves their sum is found; each keeps what the prior of the other leaves it: 0.3 m over 1.5 m/s are 0.2 s.
TEST(test_at_one_speed_the_sum_is_found_and_each_stays_open) {
  const kind kinds[] = {{"curves", 0, 0.4, 0.02, true, true},
                        {"curves without a start", 0, 0.4, 0.02, true, false},
                        {"curves without a compass", 0, 0.4, 0.02, false, true},
                        {"curves, exact speed", 0, 0.4, 0, true, true}};
  for (const kind &k : kinds) {
    const sums s = drives(k);
    TEST_ASSERT_GREATER_THAN_DOUBLE_MESSAGE(0.15, s.sigma[0], k.name);
    TEST_ASSERT_GREATER_THAN_DOUBLE_MESSAGE(0.22, s.sigma[1], k.name);
    for (const double normal : s.normal) TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(1.0, normal, k.name);
    TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(0.05, std::sqrt(s.together_m2), k.name);
  }
}

// Noise of the speed's samples is no change of speed.
TEST(test_noise_of_the_speed_tells_nothing) {
  const sums s = drives({"noisy speed", 0, 0.4, 0.1, true, true});
  for (const double normal : s.normal) TEST_ASSERT_LESS_THAN_DOUBLE(1.5 * 1.5, normal);
}

// Straight on, the place is one with both, too. The heading is found meanwhile: its updates turn what is unknown along.
TEST(test_on_a_straight_the_place_is_not_told_from_the_delay) {
  const sums s = drives({"straight", 0, 0, 0.02, true, true});
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.2, s.sigma[0]);
  for (const double normal : s.normal) TEST_ASSERT_LESS_THAN_DOUBLE(1.2 * 1.2, normal);
}

// The change of speed tells both.
TEST(test_turns_and_changes_of_speed_tell_both) {
  const kind kinds[] = {{"speeds", 0.3, 0.4, 0.02, true, true},
                        {"speeds without a start", 0.3, 0.4, 0.02, true, false},
                        {"speeds without a compass", 0.3, 0.4, 0.02, false, true}};
  for (const kind &k : kinds) {
    const sums s = drives(k);
    TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(0.03, std::sqrt(s.error[0]), k.name);
    TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(0.06, std::sqrt(s.error[1]), k.name);
    for (const double normal : s.normal) TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(1.0, normal, k.name);
  }
}

// A tag that is carried, without motion data: its place is known from the first position on, or from the start, and no
// heading is claimed.
TEST(test_without_motion_a_place_is_enough) {
  for (const bool is_given : {true, false}) {
    motion.model = WM_MOTION_CONSTANT_VELOCITY;
    begin({"carried", 0, 0, 0, false, false}, 3);
    if (is_given) {
      setup.start.p_m[0] = setup.start.p_m[1] = 0.05;
      setup.start.sigma_xy_m = 0.1;
      state.reset(make::begun(*ekf, params.data(), setup));
    }
    wm_estimate now{};
    double worst_m = 0;
    for (int i = 0; i < 200; i++) {
      const double t = 0.2 * i, x = std::sin(0.3 * t), y = 1.0 - std::cos(0.3 * t);
      const auto noise = [i](uint64_t of) { return 0.03 * wm_random_normal(of, 3, static_cast<uint64_t>(i)); };
      feed(make::position(t, x + noise(1), y + noise(2), 0.03));
      ekf->estimate(state.get(), &now);
      TEST_ASSERT_EQUAL(is_given || i > 0 ? WM_STATE_TRACKING : WM_STATE_DEAD_RECKONING, now.state);
      if (i > 10) worst_m = std::fmax(worst_m, std::hypot(now.pose_map_base.p_m[0] - x, now.pose_map_base.p_m[1] - y));
    }
    TEST_ASSERT_LESS_THAN_DOUBLE(3.5 * std::sqrt(now.covariance[0] + now.covariance[wm_cov_index(1, 1)]), worst_m);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.07, std::sqrt(now.covariance[0]));
    TEST_ASSERT_DOUBLE_WITHIN(0.01, wm::kPi * wm::kPi / 3, now.covariance[wm_cov_index(5, 5)]);
  }
}

}  // namespace

void setUp() {
  ekf = wm_estimator_find("landmark_ekf");
  wm_params_defaults(&wm_motion_params_table, &motion);
  wm_params_defaults(&wm_sighting_params_table, &make::sightings);
  sensor = make::sensor("camera", 0.01, 0.1);
  setup = make::setup(motion, sensor);
}
void tearDown() { state.reset(); }
