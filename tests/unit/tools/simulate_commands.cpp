// SPDX-License-Identifier: Apache-2.0
// Drives whose recording has commands: what the robot does is what was published, by the drive that the scenario
// states.
#include <algorithm>

#include "shipped.h"

using namespace wm::sim;

namespace {

Recording driven(const Actuators &actuators) {
  Scenario s = shipped("loops-commands");
  TEST_ASSERT_TRUE(s.robot.commanded);
  s.robot.actuators = actuators;
  return driven(s, 7, 100);
}

// Largest difference between the true twist and the drive's equation over the published commands.
double worst(const Recording &r, const Actuators &a) {
  double v = 0, w = 0, out = 0;
  size_t next = 0;
  for (double t = 0; t < r.duration_s; t += 0.001) {
    while (next + 1 < r.commands.size() && r.commands[next + 1].t_s + a.dead_s <= t + 1e-9) next++;
    const bool acts = r.commands[next].t_s + a.dead_s <= t + 1e-9;
    const double share = a.response_s > 0 ? 1 - std::exp(-0.001 / a.response_s) : 1;
    v += share * ((acts ? a.speed_scale * r.commands[next].v_mps : 0) - v);
    w += share * ((acts ? a.turn_scale * r.commands[next].w_radps : 0) - w);
    const State now = r.drive.at(t);
    out = std::max({out, std::fabs(now.speed_mps - v), std::fabs(now.yaw_rate_radps - w)});
  }
  return out;
}

TEST(test_commands_are_obeyed_after_the_dead_time_with_the_response) {
  Actuators a;
  a.publish_hz = 10;
  a.speed_step_mps = a.turn_step_radps = 0;
  a.dead_s = 0.2;
  a.response_s = 0.3;
  a.speed_scale = 0.9;
  a.turn_scale = 1.1;
  const Recording r = driven(a);
  TEST_ASSERT_TRUE(r.can.empty());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.01, worst(r, a));
  Actuators other = a;
  other.dead_s = 0.3;
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.05, worst(r, other));
  // The controller keeps to the route in spite of the drive: the robot comes back.
  const State end = r.drive.at(1e9);
  TEST_ASSERT_DOUBLE_IS_DETERMINATE(end.x_m);
  TEST_ASSERT_GREATER_THAN_DOUBLE(50, r.length_m);
}

TEST(test_rows_are_rounded_and_repeated) {
  Actuators a;
  a.speed_step_mps = 0.05;
  const Recording r = driven(a);
  int same = 0;
  for (size_t i = 1; i < r.commands.size(); i++) {
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, std::round(r.commands[i].v_mps / 0.05) * 0.05, r.commands[i].v_mps);
    same += r.commands[i].w_radps == r.commands[i - 1].w_radps;
  }
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.6 * static_cast<double>(r.commands.size()), same);
}

TEST(test_acceleration_is_limited) {
  Actuators a;
  a.acceleration_mps2 = 0.4;
  const Recording r = driven(a);
  for (double t = 0; t < r.duration_s - 0.02; t += 0.01)
    TEST_ASSERT_DOUBLE_WITHIN(0.0041, r.drive.at(t).speed_mps, r.drive.at(t + 0.01).speed_mps);
}

// A wheel that is asked for less than the static friction stands.
TEST(test_friction_holds_a_wheel) {
  Actuators a;
  a.friction_mps = 0.1;
  const Recording r = driven(a);
  for (int k = 0; 0.02 * k < r.duration_s; k++) {
    const State s = r.drive.at(0.02 * k);
    const double half = 0.22 * s.yaw_rate_radps;
    for (const double rim : {s.speed_mps - half, s.speed_mps + half})
      TEST_ASSERT_TRUE(std::fabs(rim) < 1e-6 || std::fabs(rim) > 0.0499);
  }
}

}  // namespace
