// SPDX-License-Identifier: Apache-2.0
// waymark.hpp: what it adds to the C interface. A session that moves and closes itself, exceptions of callbacks,
// results with a value or a text, an event log read to its end, a replay.
#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "waymark/waymark.hpp"

extern "C" {
#include "common/folder.h"
#include "common/suite.h"
}

using namespace std::chrono_literals;

static std::filesystem::path dir;

static waymark::options options() {
  waymark::options out{dir / "robot.yaml", dir};
  out.changes = "estimator: odometry";
  return out;
}

static const double kAbsent = std::nan("");

// 50 rows of 0.5 m/s, 20 ms apart.
static void drive(waymark::source &motion) {
  for (int i = 0; i < 50; i++) motion.push(i * 20ms, {0.5, kAbsent, 0.0}).value();
}

extern "C" void setUp() {
  dir = folder_make();
  folder_write("robot.yaml", "format: waymark-config/1\nestimator: landmark_ekf\n");
  folder_write("recording.yaml",
               "format: waymark-recording/1\nvehicle: {initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}}\n");
  folder_write("motion.csv", "t_ns,v_mps,w_radps\n0,0.5,0\n1000000000,0.5,0\n");
}

extern "C" void tearDown() { folder_remove(); }

TEST(test_a_session_moves_and_its_sources_stay) {
  std::vector<wm_estimate> fused;
  waymark::options with = options();
  with.on.fused = [&](const wm_estimate &pose) { fused.push_back(pose); };
  auto first = waymark::session::open(with).value();
  auto motion = first.add_source("motion").value();
  waymark::session second = std::move(first);
  second.start().value();
  drive(motion);
  const std::vector<double> row = {0.5, kAbsent, 0.0};
  const double array[] = {0.5, kAbsent, 0.0};
  motion.push(1000ms, row, 1001ms).value();
  motion.push(std::chrono::steady_clock::time_point(1020ms), array).value();
  TEST_ASSERT_EQUAL_STRING("motion", second.source_name(motion.number()).c_str());
  TEST_ASSERT_FALSE(second.bound().value().has_value());  // there was no pose
  const auto pose = second.pose(1300ms).value();
  TEST_ASSERT_EQUAL_INT64(pose->now.t_ns, second.bound().value()->t_ns);
  TEST_ASSERT_TRUE(pose.has_value());
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.65, pose->now.pose_map_base.p_m[0]);
  TEST_ASSERT_FALSE(second.pose(1300ms).value().has_value());  // asked for already
  TEST_ASSERT_EQUAL_UINT64(52, second.health().value().sources[0].received);
  TEST_ASSERT_GREATER_THAN_size_t(40, fused.size());
  second.close().value();
  const auto late = motion.push(1040ms, row);  // of a session that was closed
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, late.error().status);
}

TEST(test_a_source_outlives_its_session) {
  std::optional<waymark::source> motion;
  {
    auto session = waymark::session::open(options()).value();
    motion = session.add_source("motion").value();
    session.start().value();
    drive(*motion);
  }
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, motion->push(1s, {0.5, kAbsent, 0.0}).error().status);
}

TEST(test_times_beyond_64_bits_are_refused) {
  using seconds = std::chrono::duration<double>;
  auto session = waymark::session::open(options()).value();
  auto motion = session.add_source("motion").value();
  session.start().value();
  for (const waymark::time t : {waymark::time(seconds(kAbsent)), waymark::time(seconds(1e300)),
                                waymark::time(seconds(-HUGE_VAL)), waymark::time(std::chrono::hours::max())}) {
    TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, motion.push(t, {0.5, kAbsent, 0.0}).error().status);
    TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, session.pose(t).error().status);
  }
  TEST_ASSERT_EQUAL_INT64(1500000000, waymark::time(seconds(1.5)).ns());
}

TEST(test_errors_have_a_status_and_a_text) {
  waymark::options with = options();
  with.config = "/nowhere/robot.yaml";
  const auto none = waymark::session::open(with);
  TEST_ASSERT_FALSE(none.has_value());
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, none.error().status);
  TEST_ASSERT_TRUE(none.error().text.find("/nowhere/robot.yaml") != std::string::npos);
  std::string thrown;
  try {
    (void)none.value();
  } catch (const std::runtime_error &why) {
    thrown = why.what();
  }
  TEST_ASSERT_EQUAL_STRING(none.error().text.c_str(), thrown.c_str());
  auto session = waymark::session::open(options()).value();
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, session.add_source("sonar").error().status);
  auto motion = session.add_source("motion").value();
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, motion.push(0s, {0.5}).error().status);  // not started
  session.start().value();
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, motion.push(0s, {1e9, kAbsent, 0.0}).error().status);
  const std::uint8_t bytes[80] = {};
  TEST_ASSERT_EQUAL(WM_BAD_DATA, session.push_can(0s, "can0", 1, bytes).error().status);
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, session.push_picture("front", wm_frame{}).error().status);
}

TEST(test_an_exception_of_a_callback_comes_out_of_the_call) {
  waymark::options with = options();
  with.on.event = [](const wm_event &) { throw std::logic_error("the program's own"); };
  auto session = waymark::session::open(with).value();
  auto motion = session.add_source("motion").value();
  session.start().value();
  (void)motion.push(0s, {0.5, kAbsent, 0.0});
  std::string thrown;
  try {
    (void)session.advance(1s);
  } catch (const std::logic_error &why) {
    thrown = why.what();
  }
  TEST_ASSERT_EQUAL_STRING("the program's own", thrown.c_str());
  session.advance(2s).value();  // once
}

TEST(test_a_log_is_read_to_its_end_and_replayed) {
  waymark::options with = options();
  with.out = dir / "run";
  {
    auto session = waymark::session::open(with).value();
    auto motion = session.add_source("motion").value();
    session.start().value();
    drive(motion);
  }  // closes itself: the log is complete
  auto log = waymark::event_log::open(dir / "run/events.wmlog").value();
  int events = 0;
  while (log.next().value()) events++;
  TEST_ASSERT_EQUAL(50, events);
  TEST_ASSERT_EQUAL_STRING("motion", log.source_name(0).c_str());
  TEST_ASSERT_EQUAL_STRING("odometry", log.text(WAYMARK_LOG_ESTIMATOR).c_str());
  TEST_ASSERT_EQUAL(WM_IO, waymark::event_log::open(dir / "none").error().status);
  waymark::replay_options how{dir / "run/events.wmlog"};
  std::size_t poses = 0;
  how.on.fused = [&](const wm_estimate &) { poses++; };
  TEST_ASSERT_EQUAL_UINT64(50, waymark::replay(how).value().events);
  TEST_ASSERT_EQUAL_size_t(50, poses);
  how.until = 1s;  // an event log is replayed whole
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark::replay(how).error().status);
}
