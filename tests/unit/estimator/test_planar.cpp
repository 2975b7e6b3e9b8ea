// SPDX-License-Identifier: Apache-2.0
// The planar filter's algebra: kernels and their scalar twins, prediction's derivatives against finite differences,
// Joseph's form against the plain one, one number after the other against all at once.
#include "math/arc.hpp"
#include "math/elementary.hpp"
#include "planar_fixture.hpp"
#include "waymark/random.h"

namespace {

using namespace planar;

constexpr int kMax = 16;
const wm_pose2 kStart = {1, 2, 0.4};

wm_wheels wheels_of_track() {
  wm_wheels wheels = make::no_wheels();
  wheels.track_m = 0.5;
  return wheels;
}

// A filter with everything on that twists can teach, driven for a while so that all is correlated.
// No lag: it is held at 0 and above, which is not linear.
void make_busy_filter(int more = 0) {
  all_exact();
  const double sigma[9] = {0.1, 0.1, 0.02, 0.05, 0.05, 0.05, 0, 0, 0.05};
  std::memcpy(states.sigma, sigma, sizeof sigma);
  begin(wheels_of_track(), kStart, 0.1, more);
  drive_swinging();
}

void copy_covariance(double out[kMax][kMax]) {
  for (int i = 0; i < filter->states(); i++)
    for (int j = 0; j < filter->states(); j++) out[i][j] = filter->covariance(i, j);
}

// The pose after a drive as a function of the start pose and the calibration.
wm_pose2 drive(const double x0[3], const wm_motion_calibration &c, const wm_wheels &wheels) {
  wm::motion_front_end front;
  front.init(&params, &wheels);
  front.take_commands(true);
  wm_pose2 pose = {x0[0], x0[1], x0[2]};
  for (int i = 0; i <= 20; i++) {
    const wm_event e = swinging(i);
    front.feed(e);
    front.advance(e.t_ns, c, [&](const wm::motion_segment &s, const wm::motion_twist &t, const wm::motion_noise &) {
      const wm::arc a = wm::make_arc(t.v * s.dt_s, t.u * s.dt_s, t.w * s.dt_s);
      pose = wm::compose(pose, {a.x_m, a.y_m, a.turn_rad});
    });
  }
  return pose;
}

// With a diagonal start and no noise, the covariance of (pose, state) after the drive is derivative times variance:
// every calibration column, the lag's too, against differences.
TEST(test_prediction_carries_the_right_derivatives) {
  const wm_wheels wheels = wheels_of_track();
  params.noise_speed_mps = params.noise_speed_rel = params.noise_yaw_rate_radps = params.noise_yaw_rate_rel = 0;
  params.noise_side_rel = 0;
  const double sigma[] = {0.1, 0.1, 0.02, 0.05, 0.05, 0.05, 0, 0.1, 0.05, 0.1, 0.05, 0.3, 0, 0.1};
  std::memcpy(states.sigma, sigma, sizeof sigma);
  begin(wheels, kStart, 0.1);
  drive_swinging();
  int state = 3, checked = 0;
  for (int k = 0; k < wm::kCalibrationCount; k++) {
    if (sigma[k] == 0) continue;
    const double start[3] = {1, 2, 0.4};
    wm_motion_calibration cu = wm::kNeutralCalibration, cd = wm::kNeutralCalibration;
    // The lag's derivative is one-sided at 0: commands that are still to come are not obeyed early.
    const double h = k == wm::kLag ? 1e-4 : 1e-5, below = k == wm::kLag ? 0.0 : h;
    cu.value[k] += h;
    cd.value[k] -= below;
    const wm_pose2 a = drive(start, cu, wheels), b = drive(start, cd, wheels);
    const double variance = sigma[k] * sigma[k];
    const double scale = variance / (h + below);
    const int column = state++;
    const double want[3] = {(a.x_m - b.x_m) * scale, (a.y_m - b.y_m) * scale,
                            wm::wrap(a.heading_rad - b.heading_rad) * scale};
    const double tolerance = (k == wm::kLag ? 1e-3 : 1e-6) * (std::fabs(want[0]) + std::fabs(want[1]) + variance);
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, want[0], filter->covariance(0, column));
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, want[1], filter->covariance(1, column));
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, want[2], filter->covariance(2, column));
    checked++;
  }
  TEST_ASSERT_EQUAL(12, checked);
}

// One number or two at once, by the whole matrices: Joseph's form for the best gain without the rows of states that are
// considered. What such a state contributes to the innovation counts in its covariance; it stays, and so does its own
// covariance with others that stay. Premise, asserted: the prior couples the two rows.
TEST(test_an_update_is_josephs_form) {
  for (const int count : {1, 2})
    for (const int kept_to : {3, 6, 7}) {
      make_busy_filter();
      const int n = filter->states();
      double p[kMax][kMax], x[kMax], g[2][kMax] = {}, k[2][kMax] = {};
      copy_covariance(p);
      for (int i = 0; i < n; i++) x[i] = filter->value(i);
      const double h[2][kMax] = {{1.0, 0, 0.4, 0, 0.7}, {0, -0.8, 0.9, 0, 0.5}}, z[2] = {0.03, -0.05},
                   r[2] = {0.01, 0.02};
      wm::planar_row row[2];
      for (int m = 0; m < count; m++)
        for (int i = 0; i < n; i++) {
          row[m].add(i, h[m][i]);
          for (int j = 0; j < n; j++) g[m][i] += p[i][j] * h[m][j];
        }
      double s[2][2] = {{r[0], 0}, {0, count == 2 ? r[1] : 1.0}};
      for (int m = 0; m < count; m++)
        for (int l = 0; l < count; l++)
          for (int i = 0; i < n; i++) s[m][l] += h[m][i] * g[l][i];
      const double det = s[0][0] * s[1][1] - s[0][1] * s[1][0];
      if (count == 2) TEST_ASSERT_GREATER_THAN_DOUBLE(0.05, std::fabs(s[0][1]) / sqrt(s[0][0] * s[1][1]));
      const double inverse[2][2] = {{s[1][1] / det, -s[0][1] / det}, {-s[1][0] / det, s[0][0] / det}};
      for (int i = 0; i < n; i++)
        for (int m = 0; m < count && (i < 3 || i >= kept_to); m++)
          k[m][i] = g[0][i] * inverse[0][m] + g[1][i] * inverse[1][m];
      wm::planar_filter::update_options options;
      options.kept_from = 3;
      options.kept_to = kept_to;
      const wm::sparse_row rows[2] = {row[0], row[1]};
      if (count == 1 && kept_to == 3) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-14, s[0][0] - r[0], filter->variance_of(row[0]));
        TEST_ASSERT_TRUE(filter->update(row[0], z[0], r[0]));
      } else {
        wm::innovation together = filter->prepare(rows, z, r, count);
        if (count == 2) TEST_ASSERT_DOUBLE_WITHIN(1e-12, det, together.determinant);
        if (count == 2) TEST_ASSERT_DOUBLE_WITHIN(1e-13, s[1][0], together.s[1][0]);
        TEST_ASSERT_TRUE(filter->update(std::move(together), rows, options));
      }
      for (int i = 0; i < n; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, x[i] + k[0][i] * z[0] + k[1][i] * z[1], filter->value(i));
        for (int j = 0; j < n; j++) {
          double joseph = k[0][i] * r[0] * k[0][j] + k[1][i] * r[1] * k[1][j];
          for (int a = 0; a < n; a++)
            for (int b = 0; b < n; b++)
              joseph += ((i == a) - k[0][i] * h[0][a] - k[1][i] * h[1][a]) * p[a][b] *
                        ((j == b) - k[0][j] * h[0][b] - k[1][j] * h[1][b]);
          TEST_ASSERT_DOUBLE_WITHIN(1e-13, joseph, filter->covariance(i, j));
          const double ij = filter->covariance(i, j), ji = filter->covariance(j, i);
          TEST_ASSERT_EQUAL_MEMORY(&ij, &ji, sizeof ij);
        }
      }
    }
}

// GIVEN a car that stands WHEN its gyro says 0.015 rad/s THEN that is its bias.
TEST(test_standing_still_teaches_the_gyros_bias) {
  states.sigma[2] = 0.02;
  begin(make::car(), kStart, 0.1);
  for (int i = 0; i < 300; i++)
    filter->move(make::quantities(0.1 * i, {{WM_Q_VEHICLE_SPEED, 0.0}, {WM_Q_YAW_RATE, 0.015 + 0.002 * (i % 2)}}));
  TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.016, filter->calibration().value[wm::kYawRateBias]);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.002, sqrt(filter->variance(3)));
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.4, filter->pose().heading_rad);
}

// By the whole matrix: P' = F P F' + Q, where F has one row beside the identity's.
void expect_row_of_f(int state, const double (&row)[kMax], double added, const double (&p)[kMax][kMax]) {
  const int n = filter->states();
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) {
      double want = i == state && j == state ? added : 0.0;
      for (int k = 0; k < n; k++)
        for (int l = 0; l < n; l++) want += (i == state ? row[k] : i == k) * p[k][l] * (j == state ? row[l] : j == l);
      TEST_ASSERT_DOUBLE_WITHIN(1e-14, want, filter->covariance(i, j));
    }
}

// A copied state has the covariances of the original, and the variance that copying adds. A carried one is moved by the
// states that it depends on.
TEST(test_a_copied_and_a_carried_state) {
  make_busy_filter();
  double p[kMax][kMax] = {}, copied[kMax] = {}, carried[kMax] = {};
  copy_covariance(p);
  copied[2] = 1.0;
  filter->copy_state(4, 2, 0.01);
  expect_row_of_f(4, copied, 0.01, p);
  TEST_ASSERT_EQUAL_DOUBLE(filter->value(2), filter->value(4));
  copy_covariance(p);
  carried[4] = 1.0, carried[0] = 0.3, carried[5] = -0.8;
  wm::planar_row row;
  row.add(0, 0.3);
  row.add(5, -0.8);
  const double before = filter->value(4);
  filter->carry_state(4, row, 0.25, 0.02);
  expect_row_of_f(4, carried, 0.02, p);
  TEST_ASSERT_EQUAL_DOUBLE(before + 0.25, filter->value(4));
}

// A sensor's yaw, stated with a sigma of 0.05 rad, is 1: given up within the next test, in doubt while it is known less
// well than it was stated, and then as if it had never been stated so. One of 0.1 is kept.
TEST(test_a_yaw_that_is_stated_wrongly_is_found) {
  for (const double yaw : {1.0, 0.1}) {
    make_busy_filter(1);
    const int state = filter->add_sensor_state(0.0, 0.05, 0.0, -3.2, 3.2);
    wm::planar_row row;
    row.add(state, 1.0);
    const auto see = [&](double variance) {
      TEST_ASSERT_TRUE(filter->update(row, yaw - filter->value(state), variance));
    };
    see(0.15 * 0.15);
    filter->move(make::twist(2.6, 1.0, 0.1));
    TEST_ASSERT_EQUAL(yaw == 1.0, filter->is_stated_wrongly(state));
    const double prior = yaw == 1.0 ? wm::square(wm::kWider * 0.05) : wm::square(0.05);
    const double expected = yaw * prior / (prior + wm::square(0.15));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected, filter->value(state));
    see(1e-6);
    filter->move(make::twist(3.2, 1.0, 0.1));
    TEST_ASSERT_FALSE(filter->is_stated_wrongly(state));
  }
}

TEST(test_the_estimate_of_a_drive_has_its_twist) {
  begin(make::no_wheels(), kStart, 0.1);
  for (int i = 0; i <= 10; i++) filter->move(make::twist(0.1 * i, 1.5, i < 5 ? 0.0 : 0.2));
  filter->move_to(make::at(1.1));
  wm_estimate out;
  filter->estimate(&out);
  for (int i = 0; i < 3; i++) {
    TEST_ASSERT_EQUAL_DOUBLE(i == 0 ? 1.5 : 0.0, out.v_mps[i]);
    TEST_ASSERT_EQUAL_DOUBLE(i == 2 ? 0.2 : 0.0, out.w_radps[i]);
  }
}

// After months without data: 5.9e15 m2, then positions of 0.1 m sigma on each axis.
TEST(test_an_update_of_a_vast_variance_leaves_some) {
  make_busy_filter();
  filter->inflate_pose(5.9e15, 0.0);
  for (int round = 0; round < 3; round++)
    for (int axis = 0; axis < 2; axis++) {
      wm::planar_row row;
      row.add(axis, 1.0);
      TEST_ASSERT_TRUE(filter->update(row, 0.0, 0.01));
      TEST_ASSERT_GREATER_THAN_DOUBLE(0.0, filter->covariance(axis, axis));
    }
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.01, filter->covariance(0, 0));
}

}  // namespace

void setUp(void) { all_exact(); }
