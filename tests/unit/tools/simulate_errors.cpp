// SPDX-License-Identifier: Apache-2.0
// The errors and faults that the shipped easy and hard worlds name, measured back from what is in the CAN log against
// the truth: wheels' radii and track, slip, steering table, gyro, stamps; frames lost, doubled, swapped and late; a
// dead encoder, a slip, a robot that is carried away. And: hard doubles easy.
#include <Eigen/Dense>
#include <algorithm>
#include <vector>

#include "shipped.h"
#include "simulate/angle.h"
#include "simulate/bus.h"
#include "simulate/motion.h"

using namespace wm::sim;

namespace {

constexpr double kDegree = kPi / 180;

// The errors, the robot and the bus of a shipped world on an eight that turns both ways, without pictures.
Scenario eight(const std::string &name) {
  Scenario s = shipped(name);
  s.world = {};
  s.sensors.clear();
  s.pixel_cameras.clear();
  s.faults = {};
  s.route.acceleration_mps2 = 1;
  const auto leg = [](Leg::Kind kind, double value, double speed) {
    Leg l;
    l.kind = kind;
    l.speed_mps = speed;
    if (kind == Leg::Kind::stand) l.stand_s = value;
    if (kind == Leg::Kind::straight) l.length_m = value;
    if (kind == Leg::Kind::turn) l.turn_rad = value, l.radius_m = 4, l.ease_m = 2;
    return l;
  };
  s.route.legs = {leg(Leg::Kind::stand, 3, 0), leg(Leg::Kind::straight, 15, 1.5), leg(Leg::Kind::turn, 1.5 * kPi, 1.2),
                  leg(Leg::Kind::straight, 15, 1.5), leg(Leg::Kind::turn, -1.5 * kPi, 1.2)};
  return s;
}

double since(const Recording &r, wm_time_ns t_ns) { return static_cast<double>(t_ns - r.clock_start_ns) * 1e-9; }
unsigned counter(const wm_can_frame &f, Bus_message which) {
  return f.data[message(which).signals[message(which).counter()].start / 8];
}
std::vector<wm_can_frame> frames(const Recording &r, Bus_message which) {
  std::vector<wm_can_frame> out;
  std::copy_if(r.can.begin(), r.can.end(), std::back_inserter(out),
               [&](const wm_can_frame &f) { return f.id == message(which).id; });
  return out;
}
uint16_t word(const wm_can_frame &f, int byte) { return static_cast<uint16_t>(f.data[byte] | f.data[byte + 1] << 8); }
double yaw_rate(const wm_can_frame &f) { return static_cast<int16_t>(word(f, 0)) * 0.002 * kDegree; }

double square(double v) { return v * v; }

// Unwrapped counts of a wheel, one a frame.
std::vector<double> ticks(const std::vector<wm_can_frame> &wheels, int side) {
  std::vector<double> out;
  uint16_t before = 0;
  for (const wm_can_frame &f : wheels) {
    const uint16_t now = word(f, 2 * side);
    out.push_back(out.empty() ? 0 : out.back() + static_cast<int16_t>(static_cast<uint16_t>(now - before)));
    before = now;
  }
  return out;
}

// Least squares of what the wheels counted against truth's way and heading: radii and track, relative.
Eigen::Vector3d fitted(const Scenario &s, const Recording &r) {
  const auto wheels = frames(r, Bus_message::wheels);
  const double per_tick = 2 * kPi * s.robot.wheels.radius_m / s.robot.wheels.ticks_per_turn;
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  constexpr size_t kStride = 25;
  for (int side = 0; side < 2; side++) {
    const std::vector<double> count = ticks(wheels, side);
    for (size_t i = kStride; i < wheels.size(); i += kStride) {
      const State from = r.drive.at(since(r, wheels[i - kStride].t_ns)), to = r.drive.at(since(r, wheels[i].t_ns));
      // counted (1 + radius) = way -+ track/2 turned (1 + track error)
      const double counted = per_tick * (count[i] - count[i - kStride]), turned = to.heading_rad - from.heading_rad;
      const double sideways = (side == 0 ? -0.5 : 0.5) * s.robot.wheels.track_m * turned;
      Eigen::Vector3d row = Eigen::Vector3d::Zero();
      row[side] = counted;
      row[2] = -sideways;
      A += row * row.transpose();
      b += row * (to.way_m - from.way_m + sideways - counted);
    }
  }
  return A.ldlt().solve(b);
}

void wheels_are_off_as_said(const char *name, double percent) {
  Scenario s = eight(name);
  s.errors.slip = 0;
  double radius = 0, track = 0, start = 0;
  const int runs = 60;
  for (uint64_t seed = 1; seed <= runs; seed++) {
    const Recording r = driven(s, seed);
    const Eigen::Vector3d found = fitted(s, r);
    TEST_ASSERT_DOUBLE_WITHIN(4e-4, r.drawn.wheel_radius[0], found[0]);
    TEST_ASSERT_DOUBLE_WITHIN(4e-4, r.drawn.wheel_radius[1], found[1]);
    TEST_ASSERT_DOUBLE_WITHIN(2e-3, r.drawn.track, found[2]);
    radius += 0.5 * (square(found[0]) + square(found[1])) / runs;
    track += square(found[2]) / runs;
    start += square(r.start.heading_rad - r.drive.at(0).heading_rad) / runs;
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.25, 1, std::sqrt(radius) * 100 / percent);
  TEST_ASSERT_DOUBLE_WITHIN(0.37, 1, std::sqrt(track) * 100 / percent);
  TEST_ASSERT_DOUBLE_WITHIN(0.37, 1, std::sqrt(start) / s.errors.start_heading_rad);
}
TEST(test_wheels_are_off_as_said) {
  wheels_are_off_as_said("hall-easy", 1);
  wheels_are_off_as_said("crossing-hard", 2);
}

// Slip is what a wheel's count is off by beyond its radius: its deviation, and how it wanders.
TEST(test_slip_is_as_large_and_as_slow_as_said) {
  Scenario s = eight("hall-easy");
  s.errors.wheel_radius = s.errors.track = 0;
  double squares = 0, products = 0, n = 0;
  for (uint64_t seed = 1; seed <= 40; seed++) {
    const Recording r = driven(s, seed);
    const auto wheels = frames(r, Bus_message::wheels);
    const double per_tick = 2 * kPi * s.robot.wheels.radius_m / s.robot.wheels.ticks_per_turn;
    for (int side = 0; side < 2; side++) {
      const std::vector<double> count = ticks(wheels, side);
      std::vector<double> share;  // of half a second each
      for (size_t i = 25; i < wheels.size(); i += 25) {
        const State from = r.drive.at(since(r, wheels[i - 25].t_ns)), to = r.drive.at(since(r, wheels[i].t_ns));
        const double rolled = to.way_m - from.way_m +
                              (side == 0 ? -0.5 : 0.5) * s.robot.wheels.track_m * (to.heading_rad - from.heading_rad);
        share.push_back(rolled > 0.45 ? per_tick * (count[i] - count[i - 25]) / rolled - 1 : static_cast<double>(NAN));
      }
      for (size_t i = 10; i < share.size(); i++)
        if (!std::isnan(share[i]) && !std::isnan(share[i - 10]))
          squares += square(share[i]), products += share[i] * share[i - 10], n++;
    }
  }
  TEST_ASSERT_GREATER_THAN(1500, n);
  // Stamps jitter by 2 ms: of two stamps half a second apart that is another 0.57 %.
  const double stamps = 2 * square(0.002 / 0.5);
  TEST_ASSERT_DOUBLE_WITHIN(0.15, 1, (squares / n) / (square(0.005) + stamps));
  TEST_ASSERT_DOUBLE_WITHIN(0.15, std::exp(-1), products / n / square(0.005));  // 5 s apart
}

// The actuator's position through the table of calibration.yaml, against the true curvature.
TEST(test_the_steering_table_is_off_as_said) {
  for (const char *name : {"corridor-easy", "crossing-hard"}) {
    const Scenario s = eight(name);
    const wm_wheels &w = s.robot.wheels;
    const double said = std::string(name) == "corridor-easy" ? 0.5 * kDegree : 1 * kDegree;
    double squares = 0;
    const int runs = 60;
    for (uint64_t seed = 1; seed <= runs; seed++) {
      const Recording r = driven(s, seed);
      double sum = 0, n = 0, spread = 0;
      for (const wm_can_frame &f : frames(r, Bus_message::steering)) {
        const double at_m = (f.data[0] << 8 | f.data[1]) * 0.02e-3;
        uint32_t i = 1;
        while (i + 1 < w.steering_table_count && at_m > w.actuator_m[i]) i++;
        const double angle = w.road_wheel_rad[i - 1] + (at_m - w.actuator_m[i - 1]) /
                                                           (w.actuator_m[i] - w.actuator_m[i - 1]) *
                                                           (w.road_wheel_rad[i] - w.road_wheel_rad[i - 1]);
        const double off = angle - std::atan(w.wheelbase_m * r.drive.at(since(r, f.t_ns)).curvature_1pm);
        sum += off, n++, spread += square(off);
      }
      TEST_ASSERT_LESS_THAN_DOUBLE(0.1 * kDegree,
                                   std::sqrt(spread / n - square(sum / n)));  // jitter of the stamps, rounding
      squares += square(sum / n) / runs;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.37, 1, std::sqrt(squares) / said);
  }
}

// The gyro at a standstill: bias, noise, and how far the bias goes in a minute.
void gyro_is_as_said(const char *name, double times) {
  Scenario s = eight(name);
  s.route.legs.resize(1);
  s.route.legs[0].stand_s = 70;
  double bias = 0, noise = 0, walk = 0;
  const int runs = 80;
  for (uint64_t seed = 1; seed <= runs; seed++) {
    const auto rates = frames(driven(s, seed), Bus_message::yaw_rate);
    const auto mean = [&](size_t from, size_t to) {
      double sum = 0;
      for (size_t i = from; i < to; i++) sum += yaw_rate(rates[i]);
      return sum / static_cast<double>(to - from);
    };
    const double first = mean(0, 1000), last = mean(6000, 7000);
    double squares = 0;
    for (size_t i = 1; i < 1000; i++) squares += square(yaw_rate(rates[i]) - yaw_rate(rates[i - 1])) / (2 * 999);
    bias += square(first) / runs;
    noise += std::sqrt(squares) / runs;
    walk += square(last - first) / runs;
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.32, 1, std::sqrt(bias) / (0.004 * times));
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 1, noise / (0.003 * times));
  // Means of 10 s, a minute apart: a third of each is lost, two means' noise is added.
  const double wanted = square(0.0002 * times) * (60 - 10 / 3.0) / 60 + 2 * square(0.003 * times) / 1000;
  TEST_ASSERT_DOUBLE_WITHIN(0.32, 1, std::sqrt(walk / wanted));
}
TEST(test_the_gyro_is_as_said) {
  gyro_is_as_said("office-easy", 1);
  gyro_is_as_said("corridor-hard", 2);
}

TEST(test_can_stamps_jitter_and_no_frame_overtakes_its_like) {
  for (const char *name : {"hall-easy", "hall-hard"}) {
    const Recording r = driven(eight(name), 5);
    const double said = std::string(name) == "hall-easy" ? 0.002 : 0.004;
    const auto wheels = frames(r, Bus_message::wheels), rates = frames(r, Bus_message::yaw_rate);
    double squares = 0;
    for (size_t k = 0; k < wheels.size(); k++)
      squares += square(since(r, wheels[k].t_ns) - static_cast<double>(k) / 50);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 1, std::sqrt(squares / static_cast<double>(wheels.size())) / said);
    for (size_t k = 1; k < rates.size(); k++) {
      TEST_ASSERT_GREATER_THAN_INT64(rates[k - 1].t_ns, rates[k].t_ns);
      TEST_ASSERT_EQUAL_UINT((counter(rates[k - 1], Bus_message::yaw_rate) + 1) & 255,
                             counter(rates[k], Bus_message::yaw_rate));
    }
  }
}

// Losses by the counters' jumps, doubles and swaps by the order, lateness by what the frame says.
TEST(test_faults_of_the_bus) {
  Scenario s = eight("corridor-easy");
  s.bus.stamp_jitter_s = 0;
  s.robot.sends_speeds = false;
  const Recording plain = driven(s, 2);
  const auto share = [&](const Faults &faults, auto count) {
    Scenario bad = s;
    bad.faults = faults;
    double sum = 0, all = 0;
    for (uint64_t seed = 2; seed < 6; seed++) {
      const Recording r = driven(bad, seed);
      const auto f = frames(r, Bus_message::yaw_rate);
      for (size_t i = 1; i < f.size(); i++) sum += count(r, f[i - 1], f[i]);
      all += static_cast<double>(f.size());
    }
    return sum / all;
  };
  const auto jump = [](const wm_can_frame &a, const wm_can_frame &b) {
    return (counter(b, Bus_message::yaw_rate) - counter(a, Bus_message::yaw_rate)) & 255;
  };
  Faults f;
  f.can_lost = 0.03;
  TEST_ASSERT_DOUBLE_WITHIN(0.004, 0.03 / 0.97,
                            share(f, [&](const Recording &, const wm_can_frame &a, const wm_can_frame &b) {
                              return static_cast<double>(jump(a, b)) - 1;
                            }));
  f = {};
  f.can_duplicated = 0.02;
  TEST_ASSERT_DOUBLE_WITHIN(0.003, 0.02 / 1.02,
                            share(f, [&](const Recording &, const wm_can_frame &a, const wm_can_frame &b) {
                              return jump(a, b) == 0 && a.t_ns == b.t_ns ? 1.0 : 0.0;
                            }));
  f = {};
  f.can_reordered = 0.05;
  double back = 0, all = 0;
  Scenario bad = s;
  bad.faults = f;
  const Recording swapped = driven(bad, 3);
  const Recording straight = driven(s, 3);
  for (size_t i = 0; i < swapped.can.size(); i++, all++)
    back += swapped.can[i].id == straight.can[i].id ? 0.0 : 0.5;  // two frames change places; neighbours differ in kind
  TEST_ASSERT_DOUBLE_WITHIN(0.006, 0.05 / 1.05, back / all);
  // Late by 8 ms: less than the period, so the k-th frame is still the k-th.
  f = {};
  f.can_late = 0.1;
  f.can_late_s = 0.008;
  bad.faults = f;
  const Recording waited = driven(bad, 3);
  const auto on_time = frames(plain, Bus_message::yaw_rate), rates = frames(waited, Bus_message::yaw_rate);
  TEST_ASSERT_EQUAL(on_time.size(), rates.size());
  double late = 0;
  for (size_t i = 0; i < rates.size(); i++) {
    const wm_time_ns wait_ns = rates[i].t_ns - on_time[i].t_ns;
    TEST_ASSERT_TRUE(wait_ns == 0 || wait_ns == 8000000);
    late += wait_ns > 0;
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.1, late / static_cast<double>(rates.size()));
  for (size_t i = 1; i < waited.can.size(); i++)
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(waited.can[i - 1].t_ns, waited.can[i].t_ns);
}

TEST(test_a_slip_and_a_dead_encoder) {
  Scenario s = eight("hall-easy");
  make_perfect(s);
  const Recording plain = driven(s, 1);
  s.faults.wheel_slip = {{{5, 5.5}, 0, 0.2, 0}};
  s.faults.dead_encoder = 1;
  s.faults.dead_encoder_from_s = 12;
  const Recording r = driven(s, 1);
  const auto wheels = frames(r, Bus_message::wheels), wanted = frames(plain, Bus_message::wheels);
  const auto left = ticks(wheels, 0), right = ticks(wheels, 1), left0 = ticks(wanted, 0), right0 = ticks(wanted, 1);
  const double rolled = plain.drive.at(5.5).way_m - plain.drive.at(5).way_m;
  const double slipped = 0.2 * rolled * 2048 / (2 * kPi * 0.1);
  for (size_t k = 0; k < wheels.size(); k++) {
    const double t_s = static_cast<double>(k) / 50;
    if (t_s < 4.9) TEST_ASSERT_EQUAL_DOUBLE(left0[k], left[k]);
    if (t_s > 5.6) TEST_ASSERT_DOUBLE_WITHIN(4, slipped, left[k] - left0[k]);
    if (t_s <= 12) TEST_ASSERT_EQUAL_DOUBLE(right0[k], right[k]);
    if (t_s > 12.1) TEST_ASSERT_EQUAL_DOUBLE(right[605], right[k]);
  }
  TEST_ASSERT_TRUE(slipped > 400);
}

// What easy worlds name, and which worlds do; hard ones name twice as much.
TEST(test_hard_doubles_easy) {
  enum { everywhere, with_wheels, that_steer };
  const double Errors::*const doubled_too[] = {&Errors::landmark_m, &Errors::start_xy_m, &Errors::start_heading_rad,
                                               &Errors::speed, &Errors::speed_noise_mps};
  const struct {
    double Errors::*what;
    double easy;
    int where;
  } rows[] = {{&Errors::wheel_radius, 0.01, with_wheels},
              {&Errors::track, 0.01, with_wheels},
              {&Errors::slip, 0.005, with_wheels},
              {&Errors::steering_offset_rad, 0.5 * kDegree, that_steer},
              {&Errors::yaw_rate_bias_radps, 0.004, everywhere},
              {&Errors::yaw_rate_bias_walk, 0.0002 / std::sqrt(60.0), everywhere},
              {&Errors::yaw_rate_noise_radps, 0.003, everywhere},
              {&Errors::camera_mounting_rad, 0.2 * kDegree, everywhere},
              {&Errors::camera_mounting_m, 0.005, everywhere},
              {&Errors::camera_intrinsics, 0.001, everywhere},
              {&Errors::frame_stamp_jitter_s, 0.002, everywhere}};
  for (const std::string world : {"crossing", "corridor", "office", "hall", "seabed"}) {
    const Scenario easy = shipped(world + "-easy"), hard = shipped(world + "-hard");
    const bool wheels = world != "seabed", steers = easy.robot.wheels.steering_table_count > 0;
    for (const auto which : doubled_too) TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2 * (easy.errors.*which), hard.errors.*which);
    for (const auto &row : rows) {
      const bool named = row.where == everywhere || (row.where == with_wheels ? wheels : steers);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, named ? row.easy : 0, easy.errors.*row.what);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, named ? 2 * row.easy : 0, hard.errors.*row.what);
    }
    const double times_two[][3] = {
        {wheels ? 0.002 : easy.bus.stamp_jitter_s, easy.bus.stamp_jitter_s, hard.bus.stamp_jitter_s},
        {0.010, easy.faults.camera_clock_offset_s, hard.faults.camera_clock_offset_s},
        {0.01, easy.faults.frames_lost, hard.faults.frames_lost},
        {0.02, easy.pictures.latency_s, hard.pictures.latency_s}};
    for (const auto &[wanted, e, h] : times_two) {
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, wanted, e);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2 * wanted, h);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.04, easy.pictures.latency_jitter_s);
    TEST_ASSERT_TRUE(hard.faults.frames_late > 0 && hard.faults.camera_clock_drift > 0);
    TEST_ASSERT_TRUE(!wheels ||
                     (hard.faults.can_lost > 0 && hard.faults.can_late > 0 && hard.faults.wheel_slip.size() == 1));
  }
}

}  // namespace
