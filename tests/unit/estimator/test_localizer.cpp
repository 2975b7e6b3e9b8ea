// SPDX-License-Identifier: Apache-2.0
// Poses of another localizer: in the map's frame and in its own, right, wrong, and right again.
#include "filters/slam/params.h"
#include "world.hpp"

namespace {

using namespace world;

constexpr double kStep_s = 0.1;
const double kPlaces[5][2] = {{12, 3}, {-4, 11}, {-9, -6}, {7, -10}, {2, 14}};

wm_slam_params slam_params;

// Drives in circles of 6 m, sees landmarks or none, and has another localizer's poses at 10 Hz.
struct robot {
  wm_localizer_params localizer = make::defaults_of<wm_localizer_params>(wm_localizer_params_table);
  double speed_factor = 1;  // of the speed that it measures
  double drift_m = 0;       // of the localizer's frame in a step
  bool sees = true, is_stuck = false;
  int every = 1, step = 0;  // landmarks are seen in one step of so many
  wm_pose2 frame{};         // of the localizer, in map
  wm_pose2 wrong{};         // by which its poses are off, in map
  wm_pose2 stuck{};
  double reset = NAN, heading_sigma = 0.01;

  explicit robot(const char *name, bool is_started = true) {
    const wm_sensor eye = make::sensor("eye", 0.005, 0.05);
    if (std::strcmp(name, "slam") == 0)
      prepare("slam", &slam_params, eye, 7);
    else
      prepare("landmark_ekf", &ekf_params, eye, 7);
    put_on_map({{12, 3}, {-4, 11}, {-9, -6}, {7, -10}, {2, 14}}, 1, 1, 0.02);
    if (std::strcmp(name, "slam") == 0) setup.landmark_count = 0;
    setup.localizer = &localizer;
    start_at({}, 0.05, 0.02);
    if (!is_started) without_a_start();
  }
  wm_event pose() {
    wm_event e = make::empty(now_s, WM_EVENT_LOCALIZED);
    const wm_pose2 seen = wm::compose(wm::between(frame, wm_pose2{}), is_stuck ? stuck : wm::compose(wrong, truth));
    e.as.localized = {{seen.x_m + gauss(0.03), seen.y_m + gauss(0.03)},
                      wm::wrap(seen.heading_rad + gauss(heading_sigma)),
                      {0.0009, 0, 0.0009, 0, 0, wm::square(heading_sigma)},
                      reset};
    return e;
  }
  wm_estimate drive(double for_s, bool has_poses = true) {
    if (!state) begin();
    for (const double until_s = now_s + for_s - 1e-9; now_s < until_s;) {
      (void)tell(make::twist(now_s, speed_factor, 1.0 / 6));
      go_on(1.0, 1.0 / 6, kStep_s);
      frame.x_m += drift_m;
      step++;
      for (int i = 0; sees && step % every == 0 && i < 5; i++) {
        const auto [bearing, range] = view_of(kPlaces[i][0], kPlaces[i][1]);
        (void)tell(make::sighting(now_s, i + 1, wm::wrap(bearing + gauss(0.005)), range + gauss(0.05)));
      }
      if (has_poses) feed(pose());
    }
    return estimate();
  }
  bool has_alarm() const {
    wm_alarm alarms[WM_ALARMS_MAX];
    const size_t count = estimator->alarms(state.get(), alarms, WM_ALARMS_MAX);
    for (size_t i = 0; i < count; i++)
      if (alarms[i].kind == WM_ALARM_LOCALIZER) return true;
    return false;
  }
};

}  // namespace

TEST(test_its_poses_alone_find_and_hold_the_pose) {
  for (const char *name : {"landmark_ekf", "slam"}) {
    robot r(name, false);
    r.sees = false;
    truth = {5, -3, 1};
    r.drive(0.5);  // landmark_ekf begins with the first one, which is a whole pose
    if (std::strcmp(name, "landmark_ekf") == 0) TEST_ASSERT_LESS_THAN_DOUBLE(0.15, off());
    const wm_estimate e = r.drive(30);
    TEST_ASSERT_EQUAL_MESSAGE(WM_STATE_TRACKING, e.state, name);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.06, off());
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 0, heading_off());
  }
}

// A localizer that is confidently 10 m off is not followed. The alarm comes within 3 s. Right again, it is followed.
TEST(test_a_wrong_localizer_is_not_followed) {
  robot r("landmark_ekf");
  r.drive(20);
  TEST_ASSERT_FALSE(r.has_alarm());
  r.wrong = {8, -6, 0.2};
  for (int i = 0; i < 160; i++) {
    const wm_estimate e = r.drive(1);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, e.state);
    if (i >= 2) TEST_ASSERT_TRUE(r.has_alarm());
  }
  r.wrong = {};
  r.drive(3);
  TEST_ASSERT_FALSE(r.has_alarm());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
}

// One that drifts away is followed at first. What it did to the pose is taken back when it is found out.
TEST(test_a_drift_is_taken_back) {
  robot r("landmark_ekf");
  r.every = 10;
  r.drive(20);
  bool is_said = false;
  double worst_m = 0;
  for (int i = 0; i < 400; i++) {
    r.wrong.x_m += 0.01;
    r.drive(kStep_s);
    is_said = is_said || r.has_alarm();
    worst_m = std::fmax(worst_m, off());
  }
  TEST_ASSERT_TRUE(is_said);
  TEST_ASSERT_TRUE(r.has_alarm());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, worst_m);
  r.drive(5);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.08, off());
}

// One that stands still while the robot drives on: the robot's own motion is believed.
TEST(test_a_stuck_localizer_is_not_followed) {
  robot r("landmark_ekf");
  r.drive(20);
  r.sees = false;
  r.stuck = truth;
  make::sightings.gate_hard = 50;
  r.is_stuck = true;
  r.drive(5);
  TEST_ASSERT_TRUE(r.has_alarm());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.4, off());
}

// Too small for the landmarks' gate, and still no error of such a localizer.
TEST(test_a_small_lie_is_not_followed) {
  robot r("landmark_ekf");
  r.drive(20);
  r.sees = false;
  r.wrong.x_m = 0.4;
  make::sightings.gate_hard = 50;
  r.drive(5);
  TEST_ASSERT_TRUE(r.has_alarm());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
}

// In a frame of its own it observes the motion: wheels that are 5 % off lose 5 m on 100 m.
TEST(test_an_own_frame_keeps_the_way) {
  double off_m[2];
  for (const bool has_poses : {false, true}) {
    robot r("landmark_ekf");
    r.localizer.frame = WM_LOCALIZER_IN_OWN_FRAME;
    r.frame = {100, -50, 2.5};
    r.speed_factor = 1.05;
    r.drift_m = 0.0011;
    r.drive(5);
    r.sees = false;
    r.drive(25, has_poses);
    off_m[has_poses] = off();
    TEST_ASSERT_LESS_THAN_DOUBLE(3.5 * sigma(), off());
    if (!has_poses) continue;
    for (const bool is_told : {true, false}) {
      r.frame = {is_told ? -3.0 : 7.0, 0, 0};  // it began anew, with another `reset` or without
      if (is_told) r.reset = 1;
      r.drive(1);
      TEST_ASSERT_EQUAL_DOUBLE(is_told ? 0 : 1, value_of("localizer.jumps"));
      TEST_ASSERT_LESS_THAN_DOUBLE(off_m[1] + 0.3, off());
    }
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.5 * off_m[false], off_m[true]);
}

// The long axis of its ellipse gives little information; here it lies across the map's axes.
TEST(test_the_ellipse_counts) {
  robot r("landmark_ekf");
  r.sees = false;
  r.localizer.lasting = 0;
  (void)r.drive(0.1, false);
  wm_event e = make::empty(now_s, WM_EVENT_LOCALIZED);
  e.as.localized = {{truth.x_m + 0.1, truth.y_m + 0.1}, NAN, {0.5, 0.499, 0.5, 0, 0, 1}, NAN};
  feed(e);
  const wm_estimate now = estimate();
  const double xx = now.covariance[0], xy = now.covariance[wm_cov_index(0, 1)], yy = now.covariance[wm_cov_index(1, 1)];
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.0023, 0.5 * (xx + yy) + xy);  // along: still the start's
  TEST_ASSERT_LESS_THAN_DOUBLE(0.001, 0.5 * (xx + yy) - xy);      // across: the ellipse's
  TEST_ASSERT_LESS_THAN_DOUBLE(0.01, off());
}

TEST(test_what_is_no_pose_is_refused) {
  robot r("landmark_ekf");
  r.drive(1, false);
  const wm_localized bad[] = {{{NAN, 0}, 0, {NAN, NAN, NAN, NAN, NAN, NAN}, NAN},
                              {{0, 0}, INFINITY, {NAN, NAN, NAN, NAN, NAN, NAN}, NAN},
                              {{0, 1e9}, 0, {NAN, NAN, NAN, NAN, NAN, NAN}, NAN},
                              {{0, 0}, 0, {1, 2, 1, 0, 0, 1}, NAN},
                              {{0, 0}, 0, {1, 0, 1, 0, 0, 0}, NAN},
                              {{0, 0}, 0, {1, NAN, 1, 0, 0, 1}, NAN}};
  for (const wm_localized &one : bad) {
    wm_event e = make::empty(now_s, WM_EVENT_LOCALIZED);
    e.as.localized = one;
    const wm_status status = tell(e);
    TEST_ASSERT_TRUE(status == WM_NOT_FINITE || status == WM_OUT_OF_RANGE);
  }
}
