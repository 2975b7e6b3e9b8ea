// SPDX-License-Identifier: Apache-2.0
// The scenario file: what is read, and what each mistake says.
#include "simulate/scenario.h"

#include <fstream>
#include <iterator>

#include "common/suite.h"
#include "simulate/angle.h"

using namespace wm::sim;

namespace {

std::string crossing;

// The shipped scenario with one piece of its text replaced.
std::string with(const char *from, const char *to) {
  std::string text = crossing;
  const size_t at = text.find(from);
  if (at == std::string::npos) TEST_FAIL_MESSAGE(from);
  return text.replace(at, std::strlen(from), to);
}

TEST(test_the_shipped_crossing_is_read) {
  Scenario s;
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, parse_scenario(crossing, "crossing.yaml", s, &err), err.text);
  TEST_ASSERT_EQUAL_STRING("crossing", s.name.c_str());
  TEST_ASSERT_EQUAL(3, s.landmarks.size());
  TEST_ASSERT_EQUAL(2, s.cameras.size());
  TEST_ASSERT_EQUAL(9, s.robot.wheels.steering_table_count);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.112, s.robot.wheels.actuator_m[8]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 36 * kPi / 180, s.robot.wheels.road_wheel_rad[8]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.3 * kPi / 180, s.cameras[1].bearing_sigma_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -50 * kPi / 180, s.cameras[1].yaw_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.15, s.cameras[0].latency_s);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.01, s.errors.wheel_radius);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0002 / std::sqrt(60.0), s.errors.yaw_rate_bias_walk);
  TEST_ASSERT_EQUAL(Leg::Kind::turn, s.route.legs[2].kind);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, kPi / 2, s.route.legs[2].turn_rad);
  TEST_ASSERT_EQUAL(-1, s.faults.dead_encoder);
}

TEST(test_faults_are_read) {
  Scenario s;
  wm_error err{};
  const std::string text = crossing +
                           "faults:\n  can_lost_percent: 2\n  frames_late_percent: 10\n  frames_late_ms: 100\n"
                           "  camera_clock_offset_ms: -20\n  dead_encoder: {wheel: right, from_s: 12}\n"
                           "  start_offset: {x_m: 5, heading_deg: 90}\n";
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, parse_scenario(text, "crossing.yaml", s, &err), err.text);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.02, s.faults.can_lost);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.1, s.faults.frames_late_s);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.02, s.faults.camera_clock_offset_s);
  TEST_ASSERT_EQUAL(1, s.faults.dead_encoder);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 5, s.faults.start_x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, kPi / 2, s.faults.start_heading_rad);
}

TEST(test_each_mistake_is_refused_with_file_line_and_key) {
  const struct {
    const char *from, *to;
    const char *says[3];
  } cases[] = {
      {"waymark-scenario/1", "waymark-scenario/2", {"crossing.yaml:", "format", "waymark-scenario/1"}},
      {"name: crossing", "title: crossing", {"crossing.yaml:", "title", ""}},
      {"robot:\n", "robott:\n", {"crossing.yaml:", "robott", "robot"}},
      {"  track_m: 1.2\n", "", {"crossing.yaml:", "robot", "track_m"}},
      {"track_m: 1.2", "track_m: -1.2", {"crossing.yaml:", "track_m", "-1.2"}},
      {"track_m: 1.2", "track_m: wide", {"crossing.yaml:", "track_m", "wide"}},
      {"ticks_per_turn: 1024", "ticks_per_turn: 0", {"crossing.yaml:", "ticks_per_turn", ""}},
      {"{id: 2, what", "{id: 1, what", {"crossing.yaml:", "world.landmarks", "there already"}},
      {"xyz_m: [15.0, 14.0, 2.0]", "xyz_m: [15.0, 14.0]", {"crossing.yaml:", "xyz_m", ""}},
      {"name: right", "name: left", {"crossing.yaml:", "cameras", "there already"}},
      {"name: right", "name: right side", {"crossing.yaml:", "cameras", "blanks"}},
      {"[-34, -24,", "[-34, -35,", {"crossing.yaml:", "steering_table", "rise"}},
      {"[-34, -24,", "[-34,", {"crossing.yaml:", "steering_table", "same number"}},
      {"{stand_s: 4}", "{stand_s: 4, turn_deg: 5}", {"crossing.yaml:", "legs", "one of"}},
      {"radius_m: 7, ", "", {"crossing.yaml:", "legs", "radius_m"}},
      {"turn_deg: 90", "turn_deg: 0", {"crossing.yaml:", "legs", "straight_m"}},
      {"straight_m: 20, speed_mps: 3", "straight_m: 20", {"crossing.yaml:", "legs", "speed_mps"}},
      {"laps: 1", "laps: 0", {"crossing.yaml:", "laps", ""}},
      {"outlier_percent: 5", "outlier_percent: 500", {"crossing.yaml:", "outlier_percent", "500"}},
      {"landmark_m: 0.02", "landmarks_m: 0.02", {"crossing.yaml:", "landmarks_m", "landmark_m"}},
      {"seed: 37 ", "seed: one ", {"crossing.yaml:", "seed", "one"}},
      {"robot:\n", "motion: {measured: false, imu: {rate_hz: 100}}\nrobot:\n", {"crossing.yaml:", "measured", "imu"}},
  };
  for (const auto &c : cases) {
    Scenario s;
    wm_error err{};
    TEST_ASSERT_EQUAL_MESSAGE(WM_BAD_CONFIG, parse_scenario(with(c.from, c.to), "crossing.yaml", s, &err), c.to);
    for (const char *wanted : c.says) TEST_ASSERT_NOT_NULL_MESSAGE(std::strstr(err.text, wanted), err.text);
  }
}

TEST(test_a_file_that_is_not_there_is_named) {
  Scenario s;
  wm_error err{};
  TEST_ASSERT_NOT_EQUAL(WM_OK, load_scenario("no/such/scenario.yaml", s, &err));
  TEST_ASSERT_NOT_NULL_MESSAGE(std::strstr(err.text, "no/such/scenario.yaml"), err.text);
}

}  // namespace

void setUp(void) {
  std::ifstream file(std::string(std::getenv("WM_SOURCE_DIR")) + "/config/worlds/crossing.yaml");
  crossing.assign(std::istreambuf_iterator<char>(file), {});
  TEST_ASSERT_GREATER_THAN(1000, crossing.size());
}
