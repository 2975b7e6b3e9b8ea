// SPDX-License-Identifier: Apache-2.0
// SLAM and the kidnapped robot: the state LOST, the map held meanwhile, the pose found on it.
#include "filters/relocalize/line_search.hpp"
#include "slam_room.hpp"

using namespace room;

void setUp(void) { make_room(); }

namespace {

// The robot is elsewhere; odometry does not show it.
void carry(double x_m, double y_m, double turn_rad) {
  truth.x_m += x_m;
  truth.y_m += y_m;
  truth.heading_rad = wm::wrap(truth.heading_rad + turn_rad);
}

struct found {
  double lost_s = -1.0, right_s = -1.0, sigma_m = 0.0;  // after how long; the largest sigma while lost
  double sure_s = 0.0;                                  // how long it was off by 5 sigma and 0.3 m, and not lost
};

// Drives on and watches.
found watch(double seconds) {
  found out;
  for (double t = 0.0; t < seconds; t += 0.2) {
    drive(0.2);
    const bool lost = published_state() == WM_STATE_LOST;
    if (lost && out.lost_s < 0.0) out.lost_s = t;
    if (lost) out.sigma_m = std::fmax(out.sigma_m, sigma());
    if (!lost && out.right_s < 0.0 && off() < 0.3) out.right_s = t;
    if (!lost && off() > 0.3 && off() > 5.0 * sigma()) out.sure_s += 0.2;
  }
  return out;
}

// Either the pose is lost and found, or the first sightings that agree with each other set it right.
void check_found(bool of_markers, bool is_lost) {
  coded = of_markers;
  begin();
  drive(60);
  size_t count;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.15, worst_landmark(&count));
  carry(-1.0, 1.0, 2.4);
  const found f = watch(15);
  TEST_ASSERT_EQUAL(is_lost, f.lost_s >= 0.0);
  TEST_ASSERT_LESS_THAN_DOUBLE(is_lost ? 5.0 : 0.3, f.sure_s);
  TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(0.0, f.right_s);
  TEST_ASSERT_LESS_THAN_DOUBLE(10.0, f.right_s);
  if (is_lost) TEST_ASSERT_GREATER_THAN_DOUBLE(2.0, f.sigma_m);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.3, off());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.15, worst_landmark(&count));
  TEST_ASSERT_EQUAL(kCount, count);
}

}  // namespace

TEST(test_kidnapped_among_landmarks) { check_found(false, false); }
TEST(test_kidnapped_among_markers) { check_found(true, true); }

TEST(test_undisturbed_is_never_lost) {
  for (const double share : {0.0, 0.1}) {
    make_room();
    false_share = share;
    begin();
    TEST_ASSERT_EQUAL_DOUBLE(-1.0, watch(60).lost_s);
  }
}

// GIVEN one landmark that was moved THEN it is the landmark that is wrong.
TEST(test_a_moved_landmark_is_not_a_lost_robot) {
  begin();
  drive(60);
  place[3][0] += 1.0;
  TEST_ASSERT_EQUAL_DOUBLE(-1.0, watch(40).lost_s);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.3, off());
}

TEST(test_starts_without_a_pose_on_a_given_map) {
  for (const int32_t map : {WM_SLAM_MAP_EXTEND, WM_SLAM_MAP_FROZEN}) {
    make_room();
    params.map = map;
    without_a_start();
    begin();
    TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());
    drive(5);
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
    TEST_ASSERT_LESS_THAN_DOUBLE(0.2, off());
  }
}

// GIVEN recovery switched off THEN the state is never LOST.
TEST(test_recovery_can_be_switched_off) {
  params.recover = 0;
  begin();
  drive(60);
  carry(-1.0, 1.0, 2.4);
  TEST_ASSERT_EQUAL_DOUBLE(-1.0, watch(5).lost_s);
}

// Identities up to 2^31 - 1 have lasting errors of their own.
TEST(test_large_identities_keep_their_slots) {
  make::sightings.correlated_slots = 4;
  make::sightings.correlated_bearing_rad = 0.02;
  for (int i = 0; i < kCount; i++) landmarks[i].id = INT32_MAX - i;
  params.map = WM_SLAM_MAP_EXTEND;
  begin();
  for (int i = 0; i < 20; i++) see(make::sighting(now_s += 0.01, INT32_MAX - 1, 0.0, 3.0));
  TEST_ASSERT_DOUBLE_IS_DETERMINATE(sigma());
}

// GIVEN twenty lines of which nobody knows which is which THEN one look's pattern gives the pose; bearings of nothing
// give none.
TEST(test_a_pattern_of_lines_gives_the_pose) {
  double line[20][2];
  for (auto &l : line)
    for (double &at : l) at = 10.0 * wm_random_next_uniform(&noise) - 5.0;
  const wm::landmark_places map = {line[0], 20, 2};
  for (int false_of_20 : {0, 5, 20}) {
    const wm_pose2 pose = {1.0, -0.7, 2.0}, odom = {4.0, 3.0, -1.0};
    wm::bearing_look look = {20, {}, {0.1, 0, 0.3}};
    const wm_pose2 eye = wm::compose(pose, look.sensor);
    for (int i = 0; i < 20; i++)
      look.bearing_rad[i] =
          i < false_of_20 ? gauss(2.0)
                          : wm::atan2(line[i][1] - eye.y_m, line[i][0] - eye.x_m) - eye.heading_rad + gauss(0.003);
    wm::line_search search;
    search.clear();
    wm::line_search_result found{};
    for (int i = 0; i < 40 && !found.found; i++) found = search.step(look, odom, map);
    TEST_ASSERT_EQUAL(false_of_20 < 20, found.found);
    if (!found.found) continue;
    TEST_ASSERT_DOUBLE_WITHIN(0.05, pose.x_m, found.pose.x_m);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, pose.y_m, found.pose.y_m);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, pose.heading_rad, found.pose.heading_rad);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.0, found.covariance[0][0]);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.01, found.covariance[0][0]);
  }
}
