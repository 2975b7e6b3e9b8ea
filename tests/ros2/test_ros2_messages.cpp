// SPDX-License-Identifier: Apache-2.0
// Messages of ROS 2 from a run's, and back: axes of covariances, odometry of the robot's own, doubtful input.
#include "common/suite.h"
#include "ros2/incoming.h"
#include "ros2/outgoing.h"
#include "ros2/participant.h"
#include "ros2/track.h"

using namespace wm::ros2;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
char map_frame[] = "map", other_frame[] = "odom";

TEST(test_covariances_turn_into_the_axes_of_the_map) {
  wm_estimate estimate{};
  // A quarter turn about z: the body's x is the map's y.
  estimate.pose_map_base.q_xyzw[2] = estimate.pose_map_base.q_xyzw[3] = std::sqrt(0.5);
  estimate.covariance[wm_cov_index(0, 0)] = 1;
  estimate.covariance[wm_cov_index(3, 3)] = 4;
  estimate.covariance[wm_cov_index(5, 5)] = 9;
  const auto out = ros_covariance(estimate);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1, out[wm_cov_index(0, 0)]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, out[wm_cov_index(3, 3)]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 4, out[wm_cov_index(4, 4)]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 9, out[wm_cov_index(5, 5)]);
}

TEST(test_a_pose_has_the_quaternion_of_the_run) {
  wm_published published{};
  published.now.pose_map_base.q_xyzw[2] = std::sin(-1.25);  // a heading of -2.5 rad
  published.now.pose_map_base.q_xyzw[3] = std::cos(-1.25);
  const PoseStamped out = pose_message(published, 1, Frames());
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, std::sin(-1.25), out.pose.pose.orientation.z);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, std::cos(-1.25), out.pose.pose.orientation.w);
}

TEST(test_a_track_has_the_poses_between_its_stamps_and_none_outside) {
  Track track;
  Eigen::Isometry3d a = Eigen::Isometry3d::Identity(), b = a;
  b.translation().x() = 2;
  b.linear() = Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ()).matrix();
  track.add(100, a);
  track.add(200, b);
  const auto middle = track.at(150);
  TEST_ASSERT_TRUE(middle.has_value());
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1, middle->translation().x());
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::sin(0.5), middle->linear()(1, 0));
  TEST_ASSERT_FALSE(track.at(99).has_value());
  TEST_ASSERT_FALSE(track.at(201).has_value());
  track.add(50, a);  // the sender began anew
  TEST_ASSERT_FALSE(track.at(150).has_value());
  TEST_ASSERT_EQUAL_INT64(50, *track.newest_ns());
}

TEST(test_odom_in_map_takes_the_corrections) {
  Eigen::Isometry3d in_map = Eigen::Isometry3d::Identity(), in_odom = in_map;
  in_map.translation() << 3, 4, 0;
  in_map.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()).matrix();
  in_odom.translation() << 1, -1, 0;
  in_odom.linear() = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()).matrix();
  TEST_ASSERT_TRUE((odom_in_map(in_map, in_odom) * in_odom).isApprox(in_map));
}

TEST(test_a_pose_to_set_needs_the_frame_of_the_map_and_numbers) {
  PoseStamped message{};
  message.header.frame_id = map_frame;
  message.pose.pose = {{1, 2, 0}, {0, 0, 0, 1}};
  wm_set_pose out{};
  TEST_ASSERT_FALSE(set_pose_of(message, "map", &out).has_value());
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5, out.sigma_xy_m);  // without a covariance, RViz's
  message.pose.covariance[0] = 0.04;
  message.pose.covariance[35] = 0.01;
  TEST_ASSERT_FALSE(set_pose_of(message, "map", &out).has_value());
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.2, out.sigma_xy_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.1, out.sigma_heading_rad);
  message.pose.covariance[0] = kNan;
  TEST_ASSERT_TRUE(set_pose_of(message, "map", &out).has_value());
  message.pose.covariance[0] = 0;
  message.pose.pose.orientation = {0, 0, 0, 0};
  TEST_ASSERT_TRUE(set_pose_of(message, "map", &out).has_value());
  message.pose.pose.orientation = {0, 0, 0, 1};
  message.header.frame_id = other_frame;
  TEST_ASSERT_EQUAL_STRING("its frame is 'odom', not 'map'", set_pose_of(message, "map", &out)->c_str());
}

TEST(test_an_imu_without_an_accelerometer_and_one_without_a_gyro) {
  Imu message{};
  message.angular_velocity = {0.1, 0.2, 0.3};
  message.linear_acceleration = {1, 2, 3};
  message.angular_velocity_covariance[8] = 0.04;
  message.linear_acceleration_covariance[0] = -1;
  wm_stream_row row{};
  TEST_ASSERT_FALSE(imu_of(message, &row).has_value());
  TEST_ASSERT_EQUAL_DOUBLE(0.3, row.number[2]);
  TEST_ASSERT_TRUE(std::isnan(row.number[3]));
  TEST_ASSERT_TRUE(std::isnan(row.number[6]));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.2, row.number[8]);
  message.angular_velocity_covariance[0] = -1;
  TEST_ASSERT_TRUE(imu_of(message, &row).has_value());
}

TEST(test_fixes_are_metres_from_the_origin) {
  const double origin[3] = {48, 11, 500};
  wm_can_gnss gnss;
  wm_can_gnss_init(&gnss, origin);
  Fix message{};
  message.latitude = 48.001;
  message.longitude = 11.0;
  message.altitude = 503;
  message.position_covariance_type = 2;
  message.position_covariance[0] = message.position_covariance[4] = 0.25;
  wm_stream_row row{};
  TEST_ASSERT_FALSE(position_of(message, &gnss, &row).has_value());
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0, row.number[0]);
  TEST_ASSERT_DOUBLE_WITHIN(0.05, 111.2035, row.number[1]);  // a thousandth of a degree of latitude there
  TEST_ASSERT_DOUBLE_WITHIN(0.002, 3, row.number[2]);        // less what the earth falls away in 111 m
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5, row.number[3]);
  message.status.status = -1;
  TEST_ASSERT_EQUAL_STRING("", position_of(message, &gnss, &row)->c_str());
  message.status.status = 0;
  message.latitude = 4800;
  TEST_ASSERT_TRUE(position_of(message, &gnss, &row)->size() > 0);
}

TEST(test_stamps) {
  TEST_ASSERT_EQUAL_INT64(0, monotonic_stamp({0, 0}, 5));
  TEST_ASSERT_EQUAL_INT64(2'000'000'001 - 7, monotonic_stamp({2, 1}, 7));
  TEST_ASSERT_EQUAL_INT64(0, from_time(to_time(-5)));
  TEST_ASSERT_EQUAL_INT64(1'500'000'000, from_time(to_time(1'500'000'000)));
}

TEST(test_a_pose_of_a_desk_with_another_clock_is_of_now) {
  const int64_t now_ns = 100 * WM_NS_PER_S;
  for (const int64_t off_ns : {-9 * WM_NS_PER_S, -50 * WM_NS_PER_MS, int64_t{0}, 50 * WM_NS_PER_MS, 9 * WM_NS_PER_S}) {
    int64_t t_ns = 1;
    TEST_ASSERT_FALSE(given_now(now_ns + off_ns, now_ns, &t_ns).has_value());
    TEST_ASSERT_EQUAL_INT64(0, t_ns);
  }
  int64_t t_ns = 1;
  TEST_ASSERT_FALSE(given_now(0, now_ns, &t_ns).has_value());  // without a stamp
  TEST_ASSERT_EQUAL_INT64(0, t_ns);
  TEST_ASSERT_TRUE(given_now(now_ns - 11 * WM_NS_PER_S, now_ns, &t_ns)->find("11 s behind") != std::string::npos);
  TEST_ASSERT_TRUE(given_now(now_ns + 3600 * WM_NS_PER_S, now_ns, &t_ns)->find("3600 s ahead of") != std::string::npos);
}

TEST(test_silence_is_a_stale_diagnostic) {
  Diagnostics texts;
  static wm_health health{};
  health.state = WM_STATE_TRACKING;
  health.source_count = 1;
  DiagnosticArray out = texts.message(health, "", 5);
  TEST_ASSERT_EQUAL_UINT32(2, out.status._length);
  TEST_ASSERT_EQUAL_UINT8(0, out.status._buffer[0].level);
  out = texts.message(health, "no poses for 3 s", 5);
  TEST_ASSERT_EQUAL_UINT32(1, out.status._length);
  TEST_ASSERT_EQUAL_UINT8(3, out.status._buffer[0].level);
  TEST_ASSERT_EQUAL_STRING("no poses for 3 s", out.status._buffer[0].message);
}

TEST(test_a_diagnostic_has_whether_the_pose_is_usable) {
  Diagnostics texts;
  static wm_health health{};
  const uint32_t before = texts.message(health, "", 5).status._buffer[0].values._length;
  wm_bound bound{};
  bound.horizontal_m = 0.25;
  bound.why = WM_UNUSABLE_DOUBT;
  texts.take(bound);
  const DiagnosticArray out = texts.message(health, "", 5);
  const auto &values = out.status._buffer[0].values;
  TEST_ASSERT_EQUAL_UINT32(before + 4, values._length);
  TEST_ASSERT_EQUAL_STRING("usable", values._buffer[before].key);
  TEST_ASSERT_EQUAL_STRING("no: doubt", values._buffer[before].value);
  TEST_ASSERT_EQUAL_STRING("bound_m", values._buffer[before + 1].key);
  TEST_ASSERT_EQUAL_STRING("0.25", values._buffer[before + 1].value);
}

TEST(test_bridges_that_are_in_each_other_s_way) {
  const Peer self{2, 10, "here", "", "WAYMARK_@udpm"};
  TEST_ASSERT_FALSE(conflict(self, {1, 11, "there", "", "WAYMARK_@udpm"}).empty());       // the same topics
  TEST_ASSERT_TRUE(conflict(self, {1, 11, "there", "robot2", "WAYMARK_@udpm"}).empty());  // another robot
  TEST_ASSERT_FALSE(conflict(self, {1, 11, "here", "robot2", "WAYMARK_@udpm"}).empty());  // the same channels
}

}  // namespace
