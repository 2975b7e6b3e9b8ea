// SPDX-License-Identifier: Apache-2.0
// How a landmark seen by bearings alone begins: the unscented transform against one linearisation (the textbook's), at
// four parallaxes, a thousand trials each. Both get the same drawn poses and azimuths. The unscented one must not be
// worse in error or in consistency beyond two standard errors. Prints the table of docs/estimators.md.
#include <time.h>

#include "common/suite.h"
#include "filters/slam/bearing_tracks.hpp"
#include "math/elementary.hpp"
#include "waymark/random.h"

namespace {

constexpr int kTrials = 1000, kPoses = 6;
constexpr double kDeg = wm::kPi / 180.0;

struct column {
  double sum = 0.0, squares = 0.0;
  int count = 0;
  void add(double x) {
    sum += x;
    squares += x * x;
    count++;
  }
  double mean() const { return sum / count; }
  double error() const { return std::sqrt(std::fmax(squares / count - mean() * mean(), 0.0) / count); }
};

double seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// Six poses over 1 m, across the line of sight; odometry's error walks from pose to pose, azimuths have 0.3 degrees.
wm::line_bundle draw(double distance, uint64_t trial, double place[2]) {
  constexpr double kWalk_m = 0.002, kWalk_rad = 0.002, kFirst_m = 0.05, kFirst_rad = 0.03, kAzimuth = 0.3 * kDeg;
  wm::line_bundle b{};
  b.count = kPoses;
  place[0] = distance;
  place[1] = 0.5;
  double error[3] = {};
  for (int i = 0; i < kPoses; i++) {
    const double sigma[3] = {i == 0 ? kFirst_m : kWalk_m, i == 0 ? kFirst_m : kWalk_m, i == 0 ? kFirst_rad : kWalk_rad};
    for (int k = 0; k < 3; k++) error[k] += sigma[k] * wm_random_normal(5, trial, (uint64_t)(4 * i + k));
    const double y = 1.0 * i / (kPoses - 1);
    b.pose[i] = {error[0], y + error[1], 0.2 * i + error[2]};
    b.sigma_rad[i] = kAzimuth;
    b.azimuth_rad[i] = wm::wrap(wm::atan2(place[1] - y, place[0]) - 0.2 * i +
                                kAzimuth * wm_random_normal(5, trial, (uint64_t)(4 * i + 3)));
    for (int j = 0; j < kPoses; j++)
      for (int k = 0; k < 3; k++) {
        const double first = wm::square(k < 2 ? kFirst_m : kFirst_rad), step = wm::square(k < 2 ? kWalk_m : kWalk_rad);
        b.pose_covariance[3 * i + k][3 * j + k] = first + step * (i < j ? i : j);
        b.pose_covariance[3 * j + k][3 * i + k] = b.pose_covariance[3 * i + k][3 * j + k];
      }
  }
  return b;
}

// Error in parts of the distance, and NEES by its degrees of freedom.
void judge(const wm::line_bundle &b, const wm::line_landmark &l, const double place[2], double distance, double *error,
           double *nees) {
  double p[2][2];
  for (int r = 0; r < 2; r++)
    for (int c = 0; c < 2; c++) {
      p[r][c] = l.noise[r][c];
      for (int i = 0; i < 3 * kPoses; i++)
        for (int j = 0; j < 3 * kPoses; j++) p[r][c] += l.by_pose[r][i] * b.pose_covariance[i][j] * l.by_pose[c][j];
    }
  const double dx = l.place_m[0] - place[0], dy = l.place_m[1] - place[1];
  *error = std::sqrt(dx * dx + dy * dy) / distance;
  *nees =
      0.5 * (p[1][1] * dx * dx - 2.0 * p[0][1] * dx * dy + p[0][0] * dy * dy) / (p[0][0] * p[1][1] - p[0][1] * p[0][1]);
}

TEST(test_the_unscented_start_is_not_worse_than_the_linear_one) {
  std::printf("parallax  tried  unscented: error  NEES/dof  time us   linear: error  NEES/dof  time us\n");
  for (double parallax : {2.0, 5.0, 10.0, 20.0}) {
    const double distance = 0.5 / std::tan(0.5 * parallax * kDeg);
    column error[2], nees[2], worse_error, worse_nees;
    column took[2];
    for (uint64_t trial = 0; trial < kTrials; trial++) {
      double place[2], e[2], n[2];
      const wm::line_bundle b = draw(distance, trial, place);
      bool both = true;
      for (int turn = 0; turn < 2; turn++) {
        const int method = (int)((trial + (uint64_t)turn) % 2);  // neither is always the one that warms the caches
        const double begin = seconds();
        const wm::line_landmark l = wm::find_line(b, method == 0);
        took[method].add(1e6 * (seconds() - begin));
        both &= l.solved;
        judge(b, l, place, distance, &e[method], &n[method]);
      }
      if (!both) continue;
      for (int method = 0; method < 2; method++) {
        error[method].add(e[method]);
        nees[method].add(n[method]);
      }
      worse_error.add(e[0] - e[1]);
    }
    std::printf("%6.0f deg  %5d  %16.4f  %8.2f  %7.1f  %14.4f  %8.2f  %7.1f\n", parallax, error[0].count,
                error[0].mean(), nees[0].mean(), took[0].mean(), error[1].mean(), nees[1].mean(), took[1].mean());
    std::printf("            time differs by %.1f us (%.1f)\n", took[0].mean() - took[1].mean(),
                std::sqrt(took[0].error() * took[0].error() + took[1].error() * took[1].error()));
    TEST_ASSERT_GREATER_THAN(kTrials * 9 / 10, error[0].count);
    TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(2.0 * worse_error.error(), worse_error.mean());
    const double off = std::fabs(nees[0].mean() - 1.0), off_linear = std::fabs(nees[1].mean() - 1.0);
    TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(off_linear + 2.0 * (nees[0].error() + nees[1].error()), off);
  }
}

// The derivatives by the poses against differences, and the covariance against their sum with the azimuths' noise: of a
// bundle without errors, whose weights then do not matter. Both methods.
TEST(test_the_derivatives_are_those_of_differences) {
  double place[2] = {4.0, 1.5};
  wm::line_bundle b{};
  b.count = kPoses;
  const auto aim = [&place](const wm_pose2 &from) {
    return wm::wrap(wm::atan2(place[1] - from.y_m, place[0] - from.x_m) - from.heading_rad);
  };
  for (int i = 0; i < kPoses; i++) {
    b.pose[i] = {0.1 * i, 0.4 * i * (i % 2 == 0 ? 1.0 : 0.8), 0.7 - 0.2 * i};
    b.azimuth_rad[i] = aim(b.pose[i]);
    b.sigma_rad[i] = 0.002;
    for (int k = 0; k < 3; k++) b.pose_covariance[3 * i + k][3 * i + k] = wm::square(k < 2 ? 0.003 : 0.002);
  }
  for (bool unscented : {true, false}) {
    const wm::line_landmark l = wm::find_line(b, unscented);
    TEST_ASSERT_TRUE(l.solved);
    double want[2][2] = {}, got[2][2];
    const auto difference = [&](double *number, double by[2]) {
      const double step = 1e-5, before = *number;
      *number = before + step;
      const wm::line_landmark plus = wm::find_line(b, unscented);
      *number = before - step;
      const wm::line_landmark minus = wm::find_line(b, unscented);
      *number = before;
      for (int r = 0; r < 2; r++) by[r] = (plus.place_m[r] - minus.place_m[r]) / (2 * step);
    };
    for (int j = 0; j < 4 * kPoses; j++) {
      const int i = j < 3 * kPoses ? j / 3 : j - 3 * kPoses, k = j < 3 * kPoses ? j % 3 : 3;
      double by[2];
      difference(k == 0   ? &b.pose[i].x_m
                 : k == 1 ? &b.pose[i].y_m
                 : k == 2 ? &b.pose[i].heading_rad
                          : &b.azimuth_rad[i],
                 by);
      for (int r = 0; r < 2; r++) {
        if (k < 3) TEST_ASSERT_DOUBLE_WITHIN(0.01 + 0.01 * std::fabs(by[r]), by[r], l.by_pose[r][j]);
        for (int c = 0; c < 2; c++)
          want[r][c] += by[r] * by[c] * (k < 3 ? b.pose_covariance[j][j] : wm::square(b.sigma_rad[i]));
      }
    }
    for (int r = 0; r < 2; r++)
      for (int c = 0; c < 2; c++) {
        got[r][c] = l.noise[r][c];
        for (int j = 0; j < 3 * kPoses; j++) got[r][c] += l.by_pose[r][j] * b.pose_covariance[j][j] * l.by_pose[c][j];
      }
    for (int r = 0; r < 2; r++)
      for (int c = 0; c < 2; c++) TEST_ASSERT_DOUBLE_WITHIN(0.02 * want[r][r], want[r][c], got[r][c]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, place[0], l.place_m[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, place[1], l.place_m[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, l.misfit);
  }
}

// A place behind one of the poses solves the equations and is none.
TEST(test_a_place_behind_a_pose_is_none) {
  double place[2];
  wm::line_bundle b = draw(2.0, 1, place);
  TEST_ASSERT_TRUE(wm::find_line(b, true).solved);
  b.azimuth_rad[2] = wm::wrap(b.azimuth_rad[2] + wm::kPi);
  TEST_ASSERT_FALSE(wm::find_line(b, true).solved);
}

}  // namespace
