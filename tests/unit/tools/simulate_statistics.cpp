// SPDX-License-Identifier: Apache-2.0
// What a recording's sensors say, measured back against its truth: noise, biases, outliers and latency are those of the
// scenario; one seed always says the same; landmarks don't change what the wheels say.
#include <map>
#include <vector>

#include "shipped.h"
#include "simulate/angle.h"
#include "simulate/bus.h"

using namespace wm::sim;

namespace {

const Scenario crossing = shipped("crossing");

Recording simulated(const Scenario &scenario, uint64_t seed, size_t landmarks = 3) {
  return driven(scenario, seed, landmarks);
}

bool same(const wm_can_frame &a, const wm_can_frame &b) {
  return a.t_ns == b.t_ns && a.id == b.id && a.length == b.length && std::memcmp(a.data, b.data, a.length) == 0;
}
bool same(const Sighting &a, const Sighting &b) {
  return a.t_ns == b.t_ns && a.arrival_ns == b.arrival_ns && a.sensor == b.sensor && a.id == b.id &&
         a.bearing_rad == b.bearing_rad;
}
template <class T>
bool same(const std::vector<T> &a, const std::vector<T> &b) {
  if (a.size() != b.size()) return false;
  for (size_t i = 0; i < a.size(); i++)
    if (!same(a[i], b[i])) return false;
  return true;
}

// The bearing that a perfect camera would have measured.
double true_bearing(const Scenario &sc, const Recording &r, const Sighting &s) {
  const State at = r.drive.at(static_cast<double>(s.t_ns - r.clock_start_ns) * 1e-9);
  const Camera &c = sc.cameras[s.sensor];
  const double cos_h = std::cos(at.heading_rad), sin_h = std::sin(at.heading_rad);
  const double x = at.x_m + cos_h * c.xyz_m[0] - sin_h * c.xyz_m[1];
  const double y = at.y_m + sin_h * c.xyz_m[0] + cos_h * c.xyz_m[1];
  for (const wm_landmark &l : r.landmarks)
    if (l.id == s.id) return wrap(std::atan2(l.p_m[1] - y, l.p_m[0] - x) - at.heading_rad - c.yaw_rad);
  return NAN;
}

double raw_yaw_rate(const wm_can_frame &f) {
  const auto raw = static_cast<int16_t>(static_cast<uint16_t>(f.data[0] | f.data[1] << 8));
  return raw * 0.002 * kPi / 180;
}

TEST(test_a_seed_says_the_same_again_and_another_seed_something_else) {
  const Recording a = simulated(crossing, 7), b = simulated(crossing, 7), c = simulated(crossing, 8);
  TEST_ASSERT_TRUE(same(a.can, b.can));
  TEST_ASSERT_TRUE(same(a.sightings, b.sightings));
  TEST_ASSERT_FALSE(same(a.can, c.can));
  TEST_ASSERT_FALSE(same(a.sightings, c.sightings));
  TEST_ASSERT_EQUAL_DOUBLE(b.map[0].p_m[0], a.map[0].p_m[0]);
  TEST_ASSERT_NOT_EQUAL_DOUBLE(c.map[0].p_m[0], a.map[0].p_m[0]);
}

TEST(test_landmarks_change_neither_wheels_nor_each_other) {
  const Recording three = simulated(crossing, 7, 3), one = simulated(crossing, 7, 1), none = simulated(crossing, 7, 0);
  TEST_ASSERT_TRUE(same(three.can, one.can));
  TEST_ASSERT_TRUE(same(three.can, none.can));
  TEST_ASSERT_EQUAL(0, none.sightings.size());
  std::vector<Sighting> first;
  for (const Sighting &s : three.sightings)
    if (s.id == one.landmarks[0].id) first.push_back(s);
  TEST_ASSERT_TRUE(same(first, one.sightings));
}

TEST(test_bearings_have_the_noise_and_the_outliers_that_are_asked_for) {
  double sum = 0, squares = 0, n = 0, outliers = 0, all = 0;
  for (uint64_t seed = 1; seed <= 10; seed++) {
    const Recording r = simulated(crossing, seed);
    for (const Sighting &s : r.sightings) {
      all++;
      outliers += s.outlier;
      TEST_ASSERT_EQUAL_INT64(150000000, s.arrival_ns - s.t_ns);
      TEST_ASSERT_DOUBLE_WITHIN(0.5 * crossing.cameras[s.sensor].field_of_view_rad + 0.05, 0.0, s.bearing_rad);
      if (s.outlier) continue;
      const double e = wrap(s.bearing_rad - true_bearing(crossing, r, s));
      sum += e;
      squares += e * e;
      n++;
    }
  }
  const double sigma = 0.3 * kPi / 180;
  TEST_ASSERT_GREATER_THAN(5000, n);
  TEST_ASSERT_DOUBLE_WITHIN(0.05, 1, squares / n / (sigma * sigma));  // 3 sigma of a variance of 7000 draws
  TEST_ASSERT_DOUBLE_WITHIN(4 * sigma / std::sqrt(n), 0, sum / n);
  TEST_ASSERT_DOUBLE_WITHIN(4 * std::sqrt(0.05 * 0.95 / all), 0.05, outliers / all);
}

TEST(test_yaw_rate_has_bias_walk_and_noise) {
  double bias_squares = 0, walk_squares = 0;
  const int runs = 200;
  for (uint64_t seed = 1; seed <= runs; seed++) {
    const Recording r = simulated(crossing, seed, 0);
    double squares = 0, n = 0, first = 0, last = 0;
    for (const wm_can_frame &f : r.can) {
      if (f.id != message(Bus_message::yaw_rate).id) continue;
      const double t_s = std::round(static_cast<double>(f.t_ns - r.clock_start_ns) * 1e-7) * 1e-2;
      const double turned = r.drive.at(t_s + 0.01).heading_rad - r.drive.at(t_s).heading_rad;
      const double e = raw_yaw_rate(f) - turned / 0.01 - r.drawn.yaw_rate_bias_radps;
      squares += e * e;
      if (n < 500) first += e / 500;
      if (t_s > r.drive.duration_s() - 5) last += e / 500;
      n++;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.12, 1, squares / n / (0.003 * 0.003));
    bias_squares += r.drawn.yaw_rate_bias_radps * r.drawn.yaw_rate_bias_radps;
    walk_squares += (last - first) * (last - first);
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.35, 1, bias_squares / runs / (0.004 * 0.004));
  // Mean of the first 5 s against that of the last 5 s, half a minute apart; noise of the two means added.
  const Recording r = simulated(crossing, 1, 0);
  const double walked = 0.0002 * 0.0002 * (r.drive.duration_s() - 5 - 5.0 / 3) / 60 + 2 * 0.003 * 0.003 / 500;
  TEST_ASSERT_DOUBLE_WITHIN(0.35, 1, walk_squares / runs / walked);
}

TEST(test_wheels_count_what_they_roll) {
  Scenario sc = crossing;
  sc.errors.track = 0;
  for (uint64_t seed = 1; seed <= 5; seed++) {
    const Recording r = simulated(sc, seed, 0);
    uint16_t before[2] = {0, 0};
    int64_t total[2] = {0, 0};
    bool any = false;
    for (const wm_can_frame &f : r.can) {
      if (f.id != message(Bus_message::wheels).id) continue;
      for (int side = 0; side < 2; side++) {
        const auto now = static_cast<uint16_t>(f.data[2 * side] | f.data[2 * side + 1] << 8);
        if (any) total[side] += static_cast<int16_t>(static_cast<uint16_t>(now - before[side]));
        before[side] = now;
      }
      any = true;
    }
    const double turned = r.drive.at(1e9).heading_rad - r.drive.at(0).heading_rad;
    for (int side = 0; side < 2; side++) {
      const double rolled = r.drive.at(1e9).way_m + (side ? 0.5 : -0.5) * 1.2 * turned;
      const double ticks = rolled / (2 * kPi * 0.25 * (1 + r.drawn.wheel_radius[side])) * 1024;
      TEST_ASSERT_DOUBLE_WITHIN(1.01, ticks, static_cast<double>(total[side]));
    }
  }
}

TEST(test_draws_of_many_seeds_are_as_large_as_the_scenario_says) {
  double radius = 0, track = 0, steering = 0, map = 0, start = 0;
  const int runs = 400;
  for (uint64_t seed = 1; seed <= runs; seed++) {
    Scenario sc = crossing;
    sc.route.legs.resize(1);  // standing is enough
    const Recording r = simulated(sc, seed);
    radius +=
        0.5 * (r.drawn.wheel_radius[0] * r.drawn.wheel_radius[0] + r.drawn.wheel_radius[1] * r.drawn.wheel_radius[1]);
    track += r.drawn.track * r.drawn.track;
    steering += r.drawn.steering_offset_rad * r.drawn.steering_offset_rad;
    map += std::pow(r.map[1].p_m[1] - r.landmarks[1].p_m[1], 2);
    start += r.start.heading_rad * r.start.heading_rad;
  }
  const double deg = kPi / 180;
  TEST_ASSERT_DOUBLE_WITHIN(0.2, 1, radius / runs / 1e-4);
  TEST_ASSERT_DOUBLE_WITHIN(0.28, 1, track / runs / 1e-4);
  TEST_ASSERT_DOUBLE_WITHIN(0.28, 1, steering / runs / (0.25 * deg * deg));
  TEST_ASSERT_DOUBLE_WITHIN(0.28, 1, map / runs / 4e-4);
  TEST_ASSERT_DOUBLE_WITHIN(0.28, 1, start / runs / (0.25 * deg * deg));
}

TEST(test_faults_happen_as_often_as_asked) {
  Scenario sc = crossing;
  const Recording plain = simulated(sc, 3);
  sc.faults.can_lost = 0.1;
  sc.faults.can_duplicated = 0.05;
  sc.faults.can_reordered = 0.02;
  sc.faults.sightings_lost = 0.2;
  sc.faults.sightings_duplicated = 0.1;
  sc.faults.frames_late = 0.3;
  sc.faults.frames_late_s = 0.1;
  const Recording r = simulated(sc, 3);
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.9 * 1.05,
                            static_cast<double>(r.can.size()) / static_cast<double>(plain.can.size()));
  TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.8 * 1.1,
                            static_cast<double>(r.sightings.size()) / static_cast<double>(plain.sightings.size()));
  size_t back = 0, late = 0;
  for (size_t i = 1; i < r.can.size(); i++) back += r.can[i].t_ns < r.can[i - 1].t_ns;
  for (size_t i = 1; i < r.sightings.size(); i++) {
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(r.sightings[i - 1].arrival_ns, r.sightings[i].arrival_ns);
    late += r.sightings[i].arrival_ns - r.sightings[i].t_ns == 250000000;
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.006, 0.02, static_cast<double>(back) / static_cast<double>(r.can.size()));
  TEST_ASSERT_DOUBLE_WITHIN(0.06, 0.3, static_cast<double>(late) / static_cast<double>(r.sightings.size()));
}

TEST(test_dead_encoder_clock_offset_and_start_error) {
  Scenario sc = crossing;
  make_perfect(sc);
  sc.faults.dead_encoder = 0;
  sc.faults.dead_encoder_from_s = 10;
  sc.faults.camera_clock_offset_s = 0.05;
  sc.faults.start_x_m = 2;
  sc.faults.start_heading_rad = -0.5;
  const Recording r = simulated(sc, 1);
  uint16_t last[2] = {0, 0};
  int moved[2] = {0, 0};
  for (const wm_can_frame &f : r.can) {
    if (f.id != message(Bus_message::wheels).id || f.t_ns - r.clock_start_ns < INT64_C(10100000000)) continue;
    for (int side = 0; side < 2; side++) {
      const auto now = static_cast<uint16_t>(f.data[2 * side] | f.data[2 * side + 1] << 8);
      moved[side] += now != last[side];
      last[side] = now;
    }
  }
  TEST_ASSERT_EQUAL(1, moved[0]);  // the first look
  TEST_ASSERT_TRUE(moved[1] > 300);
  TEST_ASSERT_EQUAL_INT64(100000000, r.sightings[0].arrival_ns - r.sightings[0].t_ns);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2, r.start.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.5, r.start.heading_rad);
}

}  // namespace
