// SPDX-License-Identifier: Apache-2.0
// Poses of another localizer: in the map's frame and in its own, right, wrong, and right again.
#include "common/suite.h"
#include "events.hpp"
#include "math/arc.hpp"
#include "waymark/random.h"

namespace {

constexpr double kStep_s = 0.1;
const double kPlaces[5][2] = {{12, 3}, {-4, 11}, {-9, -6}, {7, -10}, {2, 14}};

// A robot that drives in circles of 6 m, sees landmarks or none, and has another localizer's poses at 10 Hz.
struct robot {
  const wm_estimator *estimator;
  wm_motion_params motion;
  wm_sensor sensor = make::sensor("eye", 0.005, 0.05);
  wm_landmark landmarks[5];
  wm_localizer_params localizer = make::defaults_of<wm_localizer_params>(wm_localizer_params_table);
  wm_setup setup;
  std::vector<char> params;
  std::unique_ptr<void, void (*)(void *)> state{nullptr, std::free};
  wm_pose2 truth{};
  double now_s = 0, speed_factor = 1;  // of the speed that it measures
  double drift_m = 0;                  // of the localizer's frame in a step
  bool sees = true, is_stuck = false;
  int every = 1, step = 0;  // landmarks are seen in one step of so many
  wm_pose2 frame{};         // of the localizer, in map
  wm_pose2 wrong{};         // by which its poses are off, in map
  wm_pose2 stuck{};
  double reset = NAN, heading_sigma = 0.01;
  wm_random noise = {7, 1, 0};

  explicit robot(const char *name, bool is_started = true) : estimator(wm_estimator_find(name)) {
    make::exact_sensors(&motion);
    params.resize(estimator->params.bytes);
    wm_params_defaults(&estimator->params, params.data());
    for (int i = 0; i < 5; i++)
      landmarks[i] = {i + 1, {kPlaces[i][0], kPlaces[i][1], 0}, 0.02, NAN, {NAN, NAN, NAN}, NAN};
    setup = make::setup(motion, sensor);
    setup.localizer = &localizer;
    setup.landmarks = landmarks;
    setup.landmark_count = std::strcmp(name, "slam") == 0 ? 0 : 5;
    const double at = is_started ? 0 : NAN;
    setup.start = {WM_TIME_NONE, {at, at, 0}, {0, 0, 0, 1}, at, 0.05, 0.02};
  }
  double normal() { return wm_random_next_normal(&noise); }
  wm_event pose() {
    wm_event e = make::empty(now_s, WM_EVENT_LOCALIZED);
    const wm_pose2 seen = wm::compose(wm::between(frame, wm_pose2{}), is_stuck ? stuck : wm::compose(wrong, truth));
    e.as.localized = {{seen.x_m + 0.03 * normal(), seen.y_m + 0.03 * normal()},
                      wm::wrap(seen.heading_rad + heading_sigma * normal()),
                      {0.0009, 0, 0.0009, 0, 0, wm::square(heading_sigma)},
                      reset};
    return e;
  }
  wm_estimate drive(double for_s, bool has_poses = true) {
    if (!state) state.reset(make::begun(*estimator, params.data(), setup));
    for (const double until_s = now_s + for_s - 1e-9; now_s < until_s;) {
      (void)make::feed(*estimator, state.get(), make::twist(now_s, speed_factor, 1.0 / 6));
      const wm::arc a = wm::make_arc(kStep_s, kStep_s / 6);
      truth = wm::compose(truth, {a.x_m, a.y_m, a.turn_rad});
      now_s += kStep_s;
      frame.x_m += drift_m;
      step++;
      for (int i = 0; sees && step % every == 0 && i < 5; i++) {
        const double dx = kPlaces[i][0] - truth.x_m, dy = kPlaces[i][1] - truth.y_m;
        const double bearing = wm::wrap(std::atan2(dy, dx) - truth.heading_rad + 0.005 * normal());
        (void)make::feed(*estimator, state.get(),
                         make::sighting(now_s, i + 1, bearing, std::hypot(dx, dy) + 0.05 * normal()));
      }
      if (has_poses) TEST_ASSERT_EQUAL(WM_OK, make::feed(*estimator, state.get(), pose()));
    }
    wm_estimate out;
    estimator->estimate(state.get(), &out);
    return out;
  }
  double off_m() const {
    wm_estimate e;
    estimator->estimate(state.get(), &e);
    return std::hypot(e.pose_map_base.p_m[0] - truth.x_m, e.pose_map_base.p_m[1] - truth.y_m);
  }
  double value(const char *name) const {
    wm_calibration_value values[64];
    const size_t count = estimator->calibration(state.get(), values, 64);
    for (size_t i = 0; i < count; i++)
      if (std::strcmp(values[i].name, name) == 0) return values[i].value;
    return NAN;
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
    r.truth = {5, -3, 1};
    r.drive(0.5);  // landmark_ekf begins with the first one, which is a whole pose
    if (std::strcmp(name, "landmark_ekf") == 0) TEST_ASSERT_LESS_THAN_DOUBLE(0.15, r.off_m());
    const wm_estimate e = r.drive(30);
    TEST_ASSERT_EQUAL_MESSAGE(WM_STATE_TRACKING, e.state, name);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.06, r.off_m());
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 0, wm::wrap(e.heading_rad - r.truth.heading_rad));
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
    TEST_ASSERT_LESS_THAN_DOUBLE(0.1, r.off_m());
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, e.state);
    if (i >= 2) TEST_ASSERT_TRUE(r.has_alarm());
  }
  r.wrong = {};
  r.drive(3);
  TEST_ASSERT_FALSE(r.has_alarm());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, r.off_m());
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
    worst_m = std::fmax(worst_m, r.off_m());
  }
  TEST_ASSERT_TRUE(is_said);
  TEST_ASSERT_TRUE(r.has_alarm());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, worst_m);
  r.drive(5);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.08, r.off_m());
}

// One that stands still while the robot drives on: the robot's own motion is believed.
TEST(test_a_stuck_localizer_is_not_followed) {
  robot r("landmark_ekf");
  r.drive(20);
  r.sees = false;
  r.stuck = r.truth;
  make::sightings.gate_hard = 50;
  r.is_stuck = true;
  r.drive(5);
  TEST_ASSERT_TRUE(r.has_alarm());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.4, r.off_m());
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
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, r.off_m());
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
    const wm_estimate e = r.drive(25, has_poses);
    off_m[has_poses] = r.off_m();
    TEST_ASSERT_LESS_THAN_DOUBLE(3.5 * std::sqrt(e.covariance[0] + e.covariance[wm_cov_index(1, 1)]), r.off_m());
    if (!has_poses) continue;
    for (const bool is_told : {true, false}) {
      r.frame = {is_told ? -3.0 : 7.0, 0, 0};  // it began anew, with another `reset` or without
      if (is_told) r.reset = 1;
      r.drive(1);
      TEST_ASSERT_EQUAL_DOUBLE(is_told ? 0 : 1, r.value("localizer.jumps"));
      TEST_ASSERT_LESS_THAN_DOUBLE(off_m[1] + 0.3, r.off_m());
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
  wm_event e = make::empty(r.now_s, WM_EVENT_LOCALIZED);
  e.as.localized = {{r.truth.x_m + 0.1, r.truth.y_m + 0.1}, NAN, {0.5, 0.499, 0.5, 0, 0, 1}, NAN};
  TEST_ASSERT_EQUAL(WM_OK, make::feed(*r.estimator, r.state.get(), e));
  wm_estimate now;
  r.estimator->estimate(r.state.get(), &now);
  const double xx = now.covariance[0], xy = now.covariance[wm_cov_index(0, 1)], yy = now.covariance[wm_cov_index(1, 1)];
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.0023, 0.5 * (xx + yy) + xy);  // along: still the start's
  TEST_ASSERT_LESS_THAN_DOUBLE(0.001, 0.5 * (xx + yy) - xy);      // across: the ellipse's
  TEST_ASSERT_LESS_THAN_DOUBLE(0.01, r.off_m());
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
    wm_event e = make::empty(r.now_s, WM_EVENT_LOCALIZED);
    e.as.localized = one;
    const wm_status status = make::feed(*r.estimator, r.state.get(), e);
    TEST_ASSERT_TRUE(status == WM_NOT_FINITE || status == WM_OUT_OF_RANGE);
  }
}
