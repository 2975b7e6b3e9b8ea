// SPDX-License-Identifier: Apache-2.0
// One step of the prediction against numeric derivatives: the columns of F by the heading, by calibration states and by
// the lag, and of a velocity that is a state.
#include "common/suite.h"
#include "filters/planar/pose_step.hpp"

namespace {

constexpr double kStep = 1e-6, kWithin = 1e-7;
constexpr wm::motion_noise kNoNoise{};

struct vec3 {
  double at[3];
};

struct at_work {
  double heading = 0.7, before_heading = 0.72, dt_s = 0.4;  // a correction between
  wm::motion_twist twist{};
  wm::planar_twist before = {0.6, -0.2, 0.9};
  wm::motion_segment segment{};
  int motion_state[wm::kMotionStates];

  at_work(double v, double u, double w) {
    twist.v = v;
    twist.u = u;
    twist.w = w;
    segment.input.model = WM_MOTION_TWIST;
    for (int &state : motion_state) state = -1;
  }

  wm::pose_step make(const wm::motion_noise &noise = kNoNoise) {
    segment.dt_s = dt_s;
    return wm::make_pose_step(segment, twist, noise, heading, before, before_heading, motion_state);
  }

  // Where it is after so much more of the twist and of the heading.
  vec3 moved(double heading_by, double v_by, double u_by, double w_by) const {
    at_work other = *this;
    other.heading += heading_by;
    other.twist.v += v_by;
    other.twist.u += u_by;
    other.twist.w += w_by;
    const wm::pose_step s = other.make();
    return {{s.x_m, s.y_m, s.turn_rad}};
  }

  vec3 derivative(double heading_by, double v_by, double u_by, double w_by) const {
    const vec3 a = moved(kStep * heading_by, kStep * v_by, kStep * u_by, kStep * w_by);
    const vec3 b = moved(-kStep * heading_by, -kStep * v_by, -kStep * u_by, -kStep * w_by);
    vec3 out;
    for (int i = 0; i < 3; i++) out.at[i] = (a.at[i] - b.at[i]) / (2 * kStep);
    return out;
  }
};

const double kTwists[][3] = {{1.3, 0, 0.8}, {-0.9, 0.4, -1.7}, {0.5, -0.7, 0}, {2, 0.3, 4}};

void check_column(const vec3 &expected, const wm::pose_step &step, int column, double within = kWithin) {
  for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(within, expected.at[i], step.by[column][i]);
}

TEST(test_columns_by_heading_and_states) {
  for (const auto &t : kTwists) {
    at_work work(t[0], t[1], t[2]);
    work.twist.add(wm::kSpeedScale, 0.7, 0.2, -0.4);
    work.twist.add(wm::kYawRateBias, 0.0, -1.0, 0.0);
    work.twist.add(wm::kTrackScale, 0.3, 0.5, 0.1);
    work.motion_state[wm::kSpeedScale] = 5;
    work.motion_state[wm::kTrackScale] = 9;  // the bias between them is off
    const wm::pose_step step = work.make();
    TEST_ASSERT_EQUAL(3, step.columns);
    TEST_ASSERT_EQUAL(wm::kHeading, step.column[0]);
    TEST_ASSERT_EQUAL(5, step.column[1]);
    TEST_ASSERT_EQUAL(9, step.column[2]);
    const vec3 by_heading = work.derivative(1, 0, 0, 0);
    for (int i = 0; i < 2; i++) TEST_ASSERT_DOUBLE_WITHIN(kWithin, by_heading.at[i], step.by[0][i]);
    TEST_ASSERT_EQUAL_DOUBLE(0, step.by[0][2]);  // besides the identity
    check_column(work.derivative(0, 0.7, -0.4, 0.2), step, 1);
    check_column(work.derivative(0, 0.3, 0.1, 0.5), step, 2);
    // The same motion in base_link.
    const double c = std::cos(work.heading), s = std::sin(work.heading);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, step.x_m, c * step.body.x_m - s * step.body.y_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, step.y_m, s * step.body.x_m + c * step.body.y_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, t[2] * work.dt_s, step.body.heading_rad);
  }
}

// Where a lag of `more` puts the robot: the twist before for so long, then the present one for so much less.
vec3 with_lag(const at_work &work, double more, bool first, bool last) {
  at_work begin = work, rest = work;
  begin.twist.v = work.before.v;
  begin.twist.u = work.before.u;
  begin.twist.w = work.before.w;
  begin.heading = work.before_heading;
  begin.dt_s = first ? more : 0.0;
  const wm::pose_step a = begin.make();
  rest.heading += a.turn_rad;
  rest.dt_s = last ? work.dt_s - more : work.dt_s;
  const wm::pose_step b = rest.make();
  return {{a.x_m + b.x_m, a.y_m + b.y_m, a.turn_rad + b.turn_rad}};
}

TEST(test_column_by_the_lag) {
  for (const auto &t : kTwists)
    for (int ends = 1; ends < 4; ends++) {
      at_work work(t[0], t[1], t[2]);
      work.motion_state[wm::kLag] = 4;
      work.segment.first = ends & 1;
      work.segment.last = ends & 2;
      const wm::pose_step step = work.make();
      TEST_ASSERT_EQUAL(2, step.columns);
      TEST_ASSERT_EQUAL(4, step.column[1]);
      const vec3 none = with_lag(work, 0, ends & 1, ends & 2), more = with_lag(work, kStep, ends & 1, ends & 2);
      vec3 by_lag;
      for (int i = 0; i < 3; i++) by_lag.at[i] = (more.at[i] - none.at[i]) / kStep;
      check_column(by_lag, step, 1, 1e-5);  // one-sided
    }
  at_work inner(1, 0, 0.5);  // neither end: its length does not depend on the lag
  inner.motion_state[wm::kLag] = 4;
  TEST_ASSERT_EQUAL(1, inner.make().columns);
}

TEST(test_velocity_as_states) {
  at_work work(0.8, -0.3, 0.6);
  work.segment.input.model = WM_MOTION_CONSTANT_VELOCITY;
  for (int k = 0; k < wm::kVelocityStates; k++) work.motion_state[wm::kVelocityX + k] = 3 + k;
  wm::motion_noise noise{};
  noise.distance_m2 = 1, noise.lateral_m2 = 2, noise.rotation_rad2 = 3;
  const wm::pose_step step = work.make(noise);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.32, step.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.12, step.y_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.24, step.turn_rad);
  const double c = std::cos(0.7), s = std::sin(0.7);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, c * 0.32 + s * -0.12, step.body.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -s * 0.32 + c * -0.12, step.body.y_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.24, step.body.heading_rad);
  TEST_ASSERT_EQUAL(3, step.columns);
  for (int k = 0; k < 3; k++) {
    TEST_ASSERT_EQUAL(3 + k, step.column[k]);
    for (int i = 0; i < 3; i++) TEST_ASSERT_EQUAL_DOUBLE(i == k ? work.dt_s : 0.0, step.by[k][i]);
    for (int i = k; i < 3; i++) TEST_ASSERT_EQUAL_DOUBLE(i == k ? k + 1.0 : 0.0, step.noise[k][i]);
  }
}

TEST(test_limits_of_states) {
  const struct {
    int state;
    double lowest, highest;
  } rows[] = {{wm::kSpeedScale, 0.3, 3}, {wm::kYawRateBias, -1, 1}, {wm::kSteeringOffset, -0.5, 0.5},
              {wm::kLag, 0, 0.8},        {wm::kGentleTurns, -1, 2}, {wm::kRotationCenter, -5, 5}};
  for (const auto &row : rows) {
    TEST_ASSERT_EQUAL_DOUBLE(row.lowest, wm::motion_state_within_limits(row.state, row.lowest - 1));
    TEST_ASSERT_EQUAL_DOUBLE(row.highest, wm::motion_state_within_limits(row.state, row.highest + 1));
    const double inside = 0.5 * (row.lowest + row.highest);
    TEST_ASSERT_EQUAL_DOUBLE(inside, wm::motion_state_within_limits(row.state, inside));
  }
  for (int state = wm::kVelocityX; state < wm::kMotionStates; state++) {
    const double most = wm::motion_state_within_limits(state, 1e9);
    TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(10, most);
    TEST_ASSERT_EQUAL_DOUBLE(-most, wm::motion_state_within_limits(state, -1e9));
  }
  TEST_ASSERT_EQUAL_STRING("motion.lag_s", wm::motion_state_name(wm::kLag));
  TEST_ASSERT_EQUAL_STRING("motion.turn_rate_radps", wm::motion_state_name(wm::kTurnState));
}

}  // namespace
