// SPDX-License-Identifier: Apache-2.0
// A robot on two floors that look alike but for a tag each, and a lift between them: the pose goes along when the floor
// changes, and the floor is in doubt until something shows it.
#include "common/suite.h"
#include "events.hpp"
#include "math/arc.hpp"
#include "waymark/carrier.h"

namespace {

// A reflector's twin stands on the other floor. The tags 3 and 13 are on one each.
constexpr double kTurn = 2.0, kShift[2] = {7.0, -3.0};  // of the upper floor's axes
constexpr int kLandmarks = 3;
wm_landmark ground[kLandmarks], upper[kLandmarks];
wm_motion_params motion;
wm_landmark_ekf_params params;
wm_sensor laser;
wm_setup setups[2], whole;
wm_floor_end ends[2];
wm_floor_plan plan;
wm_estimator over;
void *state;
double now_s;

wm_pose2 up(const wm_pose2 &p) { return wm::compose({kShift[0], kShift[1], kTurn}, p); }

void begin(int64_t start) {
  make::exact_sensors(&motion);
  make::exact_map(&params);
  laser = make::sensor("laser", 0.01, 0.02);
  const double places[kLandmarks][2] = {{4, 2}, {3, -2}, {5, 0}};
  for (int i = 0; i < kLandmarks; i++) {
    const wm_pose2 there = up({places[i][0], places[i][1], 0});
    ground[i] = {i + 1, {places[i][0], places[i][1], NAN}, 0.001, NAN, {NAN, NAN, NAN}, NAN};
    upper[i] = ground[i];
    upper[i].id = i < 2 ? i + 1 : 13;
    upper[i].p_m[0] = there.x_m;
    upper[i].p_m[1] = there.y_m;
  }
  whole = make::setup(motion, laser);
  whole.start = {WM_TIME_NONE, {0, 0, NAN}, {NAN, NAN, NAN, NAN}, 0.0, 0.05, 0.02};
  for (int i = 0; i < 2; i++) {
    setups[i] = whole;
    setups[i].landmarks = i ? upper : ground;
    setups[i].landmark_count = kLandmarks;
  }
  const wm_pose2 end = up({0, 0, 0});
  ends[0] = {0, 0, WM_CONNECTION_LIFT, 0, 0, 0, 0, 1.0};
  ends[1] = {1, 0, WM_CONNECTION_LIFT, 0, end.x_m, end.y_m, end.heading_rad, 1.0};
  plan = {wm_estimator_find("landmark_ekf"), setups, 2, ends, 2, start};
  whole.landmarks = ground;
  whole.landmark_count = kLandmarks;
  whole.floors = &plan;
  wm_estimator_over_floors(plan.estimator, &over);
  std::free(state);
  state = make::begun(over, &params, whole);
  TEST_ASSERT_NOT_NULL(state);
  now_s = 0;
}

void feed(const wm_event &e) { TEST_ASSERT_EQUAL(WM_OK, make::feed(over, state, e)); }

void stand(double for_s) {
  for (const double until = now_s + for_s; now_s < until; now_s += 0.02) feed(make::twist(now_s, 0, 0));
}

// From the ground floor's origin, as on either floor.
void see(int32_t id, int at) {
  const double x = ground[at].p_m[0], y = ground[at].p_m[1];
  feed(make::sighting(now_s, id, std::atan2(y, x), std::hypot(x, y)));
}

wm_event set_floor(int floor) {
  wm_event e = make::empty(now_s, WM_EVENT_SET_FLOOR);
  e.as.set_floor.floor = floor;
  return e;
}

wm_estimate estimate() {
  wm_estimate out{};
  over.estimate(state, &out);
  return out;
}

double probability_of(int floor) {
  double p;
  const int here = over.floor(state, &p);
  return here == floor ? p : 1.0 - p;
}

}  // namespace

TEST(the_pose_and_its_covariance_go_along) {
  begin(0);
  for (int i = 0; i < 20; i++) {
    for (int k = 0; k < 5; k++, now_s += 0.02) feed(make::twist(now_s, 0.5, 0.4));
    if (i % 4 == 0) (void)make::feed(over, state, make::sighting(now_s, 3, NAN, 4.8));
  }
  now_s -= 0.02;  // of the last event
  const wm_estimate before = estimate();
  feed(set_floor(1));
  const wm_estimate after = estimate();
  const wm_pose2 there = up({before.pose_map_base.p_m[0], before.pose_map_base.p_m[1], before.heading_rad});
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, there.x_m, after.pose_map_base.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, there.y_m, after.pose_map_base.p_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, wm::wrap(there.heading_rad - after.heading_rad));
  const double c = std::cos(kTurn), s = std::sin(kTurn), turn[3][3] = {{c, -s, 0}, {s, c, 0}, {0, 0, 1}};
  const int at[3] = {0, 1, 5};
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) {
      double expected = 0;
      for (int m = 0; m < 3; m++)
        for (int n = 0; n < 3; n++) expected += turn[i][m] * before.covariance[wm_cov_index(at[m], at[n])] * turn[k][n];
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, expected, after.covariance[wm_cov_index(at[i], at[k])]);
    }
  TEST_ASSERT_EQUAL(before.resets, after.resets);
  TEST_ASSERT_EQUAL_DOUBLE(1.0, probability_of(1));
  // And back.
  feed(set_floor(0));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, before.pose_map_base.p_m[0], estimate().pose_map_base.p_m[0]);
}

TEST(a_floor_that_is_not_there_is_refused) {
  begin(0);
  stand(1);
  const double before = probability_of(0);
  for (const int floor : {-1, 2}) TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, make::feed(over, state, set_floor(floor)));
  TEST_ASSERT_EQUAL_DOUBLE(before, probability_of(0));
}

TEST(in_a_lift_the_floor_is_in_doubt_until_a_tag_shows_it) {
  for (const int floor : {0, 1}) {
    begin(0);
    stand(15);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 0.4, probability_of(1));
    const double doubt = probability_of(1);
    TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, estimate().state);
    TEST_ASSERT_EQUAL(WM_CAUSE_FLOOR, estimate().cause);
    // Twins fit both.
    for (int i = 0; i < 4; i++, now_s += 0.1) {
      feed(make::twist(now_s, 0.3, 0));  // it moves: no floor changes now
      see(1, 0);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.1, doubt, probability_of(1));
    for (int i = 0; i < 4; i++, now_s += 0.1) {
      feed(make::twist(now_s, 0.3, 0));
      feed(make::twist(now_s + 0.05, -0.6, 0));
      now_s += 0.06;
      see(floor ? 13 : 3, 2);
    }
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.99, probability_of(floor));
    TEST_ASSERT_NOT_EQUAL(WM_STATE_DEGRADED, estimate().state);
  }
}

TEST(an_unknown_floor_is_found_by_its_tag) {
  begin(-1);
  stand(0.5);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, probability_of(1));
  for (int i = 0; i < 4; i++, now_s += 0.3) {
    feed(make::twist(now_s, 0, 0));
    see(3, 2);
  }
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.99, probability_of(0));
}

TEST(carried_to_the_other_floor_it_is_found_there) {
  begin(0);
  // Away from the lift: nothing else opens the other floor.
  feed(make::set_pose(0.0, 0, 0, 0, 0.05, 0.02));
  const wm_pose2 far = up({100, 0, 0});
  ends[0].x_m = 100;
  ends[1].x_m = far.x_m;
  ends[1].y_m = far.y_m;
  int sure_of_ground = 0;
  for (int i = 0; i < 20; i++, now_s += 0.2) {
    feed(make::twist(now_s, 0, 0));
    see(13, 2);
    if (i > 3) sure_of_ground += probability_of(0) > 0.99;
  }
  TEST_ASSERT_EQUAL(0, sure_of_ground);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.99, probability_of(1));
}

TEST(a_copy_of_the_state_goes_on_identically) {
  begin(0);
  stand(5);
  const char *why = nullptr;
  const size_t bytes = over.state_bytes(&params, &whole, &why);
  void *copy = aligned_alloc(64, (bytes + 63) / 64 * 64);
  std::memcpy(copy, state, bytes);
  const double from_s = now_s;
  const auto drive = [&](void *of) {
    for (int i = 0; i < 20; i++) {
      const double t_s = from_s + 0.1 * i;
      (void)make::feed(over, of, make::twist(t_s, 0.2, 0.1));
      (void)make::feed(over, of, make::sighting(t_s, 13, 0.1, 4.9));
      wm_event e = make::empty(t_s, WM_EVENT_SET_FLOOR);
      e.as.set_floor.floor = i / 5 % 2;
      if (i % 5 == 0) (void)make::feed(over, of, e);
    }
  };
  drive(state);
  drive(copy);
  TEST_ASSERT_EQUAL_MEMORY(state, copy, bytes);
  std::free(copy);
  std::free(state);
  state = nullptr;
}
