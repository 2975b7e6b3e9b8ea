// SPDX-License-Identifier: Apache-2.0
// Motion in the plane with all three of its components: sideways twists, increments with a covariance, and twists that
// leave the plane.
#include "filters/planar/past_pose.hpp"
#include "math/cholesky.hpp"
#include "math/eigen.hpp"
#include "math/se2.hpp"
#include "planar_fixture.hpp"
#include "waymark/random.h"

namespace {

using namespace planar;

wm_rig rig;

void begin(const wm_rig *known = nullptr, double speed_scale_sigma = 0.0) {
  all_exact();
  params.states.drive = WM_DRIVE_ROLLING;
  states.sigma[WM_SPEED_SCALE] = speed_scale_sigma;
  setup.rig = known;
  planar::begin(make::no_wheels(), {}, 1e-6);
}

// Nothing measures the motion: the velocity is a state.
void begin_by_its_velocity(double heading_rad) {
  all_exact();
  wm_params_defaults(&wm_motion_params_table, &params);
  params.model = WM_MOTION_CONSTANT_VELOCITY;
  planar::begin(make::no_wheels(), {0, 0, heading_rad}, 0.1);
}

void drive_askew(int from) {
  for (int i = from; i <= 20; i++) filter->move(make::twist6(0.1 * i, 0.4, -0.6 + 0.02 * i, 0.5));
}

TEST(test_derivatives_of_a_sideways_drive) {
  constexpr double kStep = 1e-5, kSigma = 0.1;
  wm_pose2 end[2];
  for (int up : {0, 1}) {
    begin(nullptr, kSigma);
    filter->move(make::twist6(0.0, 0.4, -0.6, 0.5));
    filter->forget(3, 1.0 + (up ? kStep : -kStep), kSigma * kSigma);
    drive_askew(1);
    end[up] = filter->pose();
  }
  begin(nullptr, kSigma);
  drive_askew(0);
  const double variance = kSigma * kSigma;
  TEST_ASSERT_DOUBLE_WITHIN(1e-8, (end[1].x_m - end[0].x_m) / (2 * kStep) * variance, filter->covariance(0, 3));
  TEST_ASSERT_DOUBLE_WITHIN(1e-8, (end[1].y_m - end[0].y_m) / (2 * kStep) * variance, filter->covariance(1, 3));
  // By the age of a measurement, once its low-passed twist has settled.
  for (int i = 21; i <= 100; i++) filter->move(make::twist6(0.1 * i, 0.4, -0.2, 0.5));
  const double h = 1e-4;
  const wm::past_pose at = wm::pose_before(*filter, 0.05), older = wm::pose_before(*filter, 0.05 + h);
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, (older.pose.x_m - at.pose.x_m) / h, at.age_by[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, (older.pose.y_m - at.pose.y_m) / h, at.age_by[1]);
}

// A recording's own sigmas of its twist take the place of motion.noise.
TEST(test_stated_sigmas_replace_the_configured_noise) {
  double variance[2];
  for (int stated : {0, 1}) {
    wm_rig_init(&rig);
    if (stated)
      for (int i = 0; i < 3; i++) rig.twist6_sigma_v_mps[i] = 0.5, rig.twist6_sigma_w_radps[i] = 0.4;
    begin(&rig);
    for (int i = 0; i <= 200; i++) filter->move(make::twist6(0.1 * i, 0.3, 0.0, 0.0));
    variance[stated] = filter->covariance(2, 2);
  }
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 20 * params.noise_yaw_rate_radps * params.noise_yaw_rate_radps, variance[0]);
  TEST_ASSERT_DOUBLE_WITHIN(0.02 * 20 * 0.1 * 0.16, 20 * 0.1 * 0.16, variance[1]);
}

constexpr double kCovariance[6] = {4e-4, 1e-4, 9e-4, 2e-5, -3e-5, 1e-4};

// c = a (+) b with P_c = A P_a A' + B Q B'.
void compose_with(wm_pose2 *pose, wm::matrix<3> *p, const wm_pose2 &step, const double q[6]) {
  wm::matrix<3> by_pose, by_step, noise;
  *pose = wm::compose(*pose, step, &by_pose, &by_step);
  noise << q[0], q[1], q[3], q[1], q[2], q[4], q[3], q[4], q[5];
  *p = wm::transformed(by_pose, *p) + wm::transformed(by_step, noise);
}

// An increment is composed as a pose, with all of its covariance, however observations cut its time.
TEST(test_increments_are_poses) {
  for (int cuts : {0, 1, 5}) {
    begin();
    wm_pose2 pose{};
    wm::matrix<3> p = wm::matrix<3>::Identity() * 1e-12;
    for (int i = 0; i < 10; i++) {
      const wm_pose2 step = {0.2 + 0.01 * i, -0.05, i % 2 ? 0.4 : -0.1};
      for (int c = 1; c <= cuts && i > 0; c++) filter->move_to(make::at(0.5 * i + 0.5 * c / (cuts + 1)));
      filter->move(make::increment(0.5 * i, 0.5 * (i + 1), step, kCovariance));
      compose_with(&pose, &p, step, kCovariance);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, pose.x_m, filter->pose().x_m);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, pose.y_m, filter->pose().y_m);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, pose.heading_rad, filter->pose().heading_rad);
    }
    for (int i = 0; i < 3 && cuts == 0; i++)
      for (int j = 0; j < 3; j++) TEST_ASSERT_DOUBLE_WITHIN(1e-6 * p(j, j), p(i, j), filter->covariance(i, j));
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * p(2, 2), p(2, 2), filter->variance(2));
  }
}

// Two that overlap by half count the common half once.
TEST(test_increments_that_overlap) {
  begin();
  filter->move(make::increment(0.0, 1.0, {1.0, 0.0, 0.0}, kCovariance));
  filter->move(make::increment(0.5, 1.5, {1.0, 0.0, 0.0}, kCovariance));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.5, filter->pose().x_m);
}

TEST(test_impossible_increments_are_refused) {
  begin();
  TEST_ASSERT_EQUAL(WM_NOT_FINITE, filter->check_motion(make::increment(0.0, 1.0, {1, NAN, 0}, kCovariance)));
  const double wide[6] = {1, 2, 1, 0, 0, 1};  // a correlation of 2
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, filter->check_motion(make::increment(0.0, 1.0, {1, 0, 0}, wide)));
  const double correlated[6] = {1e-4, 3e-5, 1e-4, 3e-5, -3e-5, 1e-4};
  TEST_ASSERT_EQUAL(WM_OK, filter->check_motion(make::increment(0.0, 1.0, {1, 0, 0}, correlated)));
  const double three[6] = {1, 0.9, 1, 0.9, -0.9, 1};  // each two of them may be, all three may not
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, filter->check_motion(make::increment(0.0, 1.0, {1, 0, 0}, three)));
  const int diagonal[3] = {0, 2, 5};
  for (int i : diagonal) {
    double one[6] = {1e-4, 0, 1e-4, 0, 0, 1e-4};
    one[i] = 0.0;  // exact
    TEST_ASSERT_EQUAL(WM_OK, filter->check_motion(make::increment(0.0, 1.0, {1, 0, 0}, one)));
    one[i] = -1e-9;
    TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, filter->check_motion(make::increment(0.0, 1.0, {1, 0, 0}, one)));
  }
  const double none[6] = {NAN, NAN, NAN, NAN, NAN, NAN};
  TEST_ASSERT_EQUAL(WM_OK, filter->check_motion(make::increment(0.0, 1.0, {1, 0, 0}, none)));
  filter->move(make::increment(0.0, 1.0, {1, 0, 0}, none));
  const double rel = params.noise_speed_rel, constant = params.noise_speed_mps;
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, rel * rel + constant * constant, filter->covariance(0, 0));
}

// A bump and a steady slope are of the plane, a dive is not.
TEST(test_motion_that_leaves_the_plane) {
  const struct {
    double rise_mps, pitch_radps, for_s;
    bool leaves;
  } drives[] = {{0.3, 0, 1.0, false}, {0.05, 0.03, 10.0, false}, {0.4, 0, 3.0, true}, {0, -0.2, 3.0, true}};
  for (const auto &drive : drives) {
    begin();
    for (int i = 0; i <= 100; i++) {
      wm_event e = make::twist6(0.1 * i, 1.0, 0.0, 0.0);
      if (0.1 * i < drive.for_s) e.as.twist6.v_mps[2] = drive.rise_mps, e.as.twist6.w_radps[1] = drive.pitch_radps;
      filter->move(e);
    }
    TEST_ASSERT_EQUAL(drive.leaves, (filter->motion_health() & WM_MOTION_HEALTH_NOT_PLANAR) != 0);
  }
}

// GIVEN no motion data WHEN a robot whose velocity walks is seen each 0.5 s THEN pose and velocity are found, and their
// errors are as large as their sigmas say: NEES over 40 drives.
TEST(test_a_velocity_of_its_own) {
  double nees = 0.0, speed_errors = 0.0;
  const int drives = 40, steps = 60, fine = 50;
  for (uint64_t drive = 0; drive < drives; drive++) {
    uint64_t draw = 0;
    const auto normal = [&] { return wm_random_normal(7, drive, draw++); };
    begin_by_its_velocity(0);
    wm_pose2 truth = {0.1 * normal(), 0.1 * normal(), 0.1 * normal()};
    double v[3] = {normal(), normal(), normal()};  // a start sigma of two of the walk
    filter->move_to(0);
    const double walks[3] = {params.velocity_speed_walk, params.velocity_speed_walk, params.velocity_turn_walk};
    for (int k = 0; k < 3; k++) TEST_ASSERT_EQUAL_DOUBLE(4.0 * walks[k] * walks[k], filter->variance(3 + k));
    for (int i = 1; i <= steps; i++) {
      for (int k = 0; k < fine; k++) {
        truth = {truth.x_m + 0.01 * v[0], truth.y_m + 0.01 * v[1], wm::wrap(truth.heading_rad + 0.01 * v[2])};
        for (double &each : v) each = each * (1.0 - 0.01 / 8.0) + 0.5 * 0.1 * normal();
      }
      filter->move_to(make::at(0.5 * i));
      const double seen[3] = {truth.x_m, truth.y_m, truth.heading_rad};
      for (int k = 0; k < 3; k++) {
        wm::planar_row row;
        row.add(k, 1.0);
        const double off = seen[k] + 0.05 * normal() - filter->value(k);
        TEST_ASSERT_TRUE(filter->update(row, k == 2 ? wm::wrap(off) : off, 0.05 * 0.05));
      }
    }
    wm::matrix<3> p;
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) p(i, j) = filter->covariance(i, j);
    const wm::vector<3> off = {truth.x_m - filter->pose().x_m, truth.y_m - filter->pose().y_m,
                               wm::wrap(truth.heading_rad - filter->pose().heading_rad)};
    wm::matrix<3> inverse;
    TEST_ASSERT_TRUE(wm::invert_positive(p, &inverse));
    nees += off.dot(inverse * off) / drives;
    speed_errors += wm::square(v[0] - filter->value(3)) / filter->variance(3) / drives;
  }
  TEST_ASSERT_DOUBLE_WITHIN(1.0, 3.0, nees);  // 2.6 sigma of the mean
  TEST_ASSERT_DOUBLE_WITHIN(0.6, 1.0, speed_errors);
}

// GIVEN a velocity on the map's axes of a robot that turns WHEN its path from a time in the past is asked for THEN it
// is seen from base_link as it was turned then.
TEST(test_a_past_path_of_a_velocity_of_its_own) {
  begin_by_its_velocity(1.2);
  filter->move_to(make::at(10.0));
  const double velocity[3] = {0.8, 0.3, 0.5};
  for (int k = 0; k < 3; k++) filter->forget(3 + k, velocity[k], 0.01);
  wm::motion_twist twist{};
  const wm_pose2 path = filter->path(make::at(8.0), make::at(9.5), &twist);
  const double then_rad = 1.2 - 2.0 * 0.5;
  const double ahead = 0.8 * std::cos(then_rad) + 0.3 * std::sin(then_rad),
               left = 0.3 * std::cos(then_rad) - 0.8 * std::sin(then_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, ahead, twist.v);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, left, twist.u);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5, twist.w);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.5 * ahead, path.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.5 * left, path.y_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.75, path.heading_rad);
}

}  // namespace
