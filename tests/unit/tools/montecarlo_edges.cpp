// SPDX-License-Identifier: Apache-2.0
// What the trials over many drives are judged by: views that differ, and a run's figures.
#include <vector>

#include "common/suite.h"
#include "montecarlo/reliability.h"
#include "montecarlo/trial.h"
#include "montecarlo/views.h"

namespace {

using wm::montecarlo::Outcome;
using wm::montecarlo::Sample;
using wm::montecarlo::Viewer;

constexpr uint32_t kWidth = 2000, kHeight = 200;  // 40 x 4 m
std::vector<uint8_t> edges(static_cast<size_t>(kWidth) * kHeight, 0);
const wm_raster map = {kWidth, kHeight, 0.02, 0, 0, 0, edges.data(), nullptr, 1};

// A corridor along x between y = 1 and y = 3, with a recess at x = 10 and a wall at its end.
void draw_corridor() {
  const auto mark = [](double x, double y) {
    edges[(kHeight - 1 - static_cast<size_t>(y / 0.02)) * kWidth + static_cast<size_t>(x / 0.02)] = 255;
  };
  for (double x = 0.5; x < 39; x += 0.01) {
    mark(x, 1);
    mark(x, x > 10 && x < 11 ? 3.6 : 3);
  }
  for (double y = 1; y < 3; y += 0.01) mark(39, y);
}

TEST(a_straight_corridor_looks_the_same_all_along) {
  const Viewer viewer(map, 1);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, viewer.distinction({20, 2, 0}, {26, 2, 0}));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, Viewer::difference(viewer.at({20, 2, 0}), viewer.at({26, 2, 0})));
}

TEST(its_end_and_a_turn_look_otherwise) {
  const Viewer viewer(map, 1);
  TEST_ASSERT_GREATER_THAN_DOUBLE(wm::montecarlo::kOtherView, viewer.distinction({36.5, 2, 0}, {26, 2, 0}));
  TEST_ASSERT_GREATER_THAN_DOUBLE(wm::montecarlo::kOtherView, viewer.distinction({20, 2, 1}, {20, 2, 0}));
  // A little aside is no other view: the filter may be off by as much.
  TEST_ASSERT_LESS_THAN_DOUBLE(wm::montecarlo::kOtherView, viewer.distinction({20, 2.2, 0}, {20, 2, 0}));
}

Sample at(double t_s, double error_m, bool tracking) {
  Sample s{};
  s.t_s = t_s;
  s.way_m = t_s;
  s.error_m = error_m;
  s.tracking = tracking;
  s.lost_probability = tracking ? 0.05 : 0.95;
  return s;
}

TEST(a_run_is_judged_by_when_it_says_so_and_when_it_is_right) {
  Outcome o;
  for (int i = 0; i < 30; i++) o.samples.push_back(at(0.1 * i, 5, true));
  for (int i = 30; i < 80; i++) o.samples.push_back(at(0.1 * i, 5, false));
  for (int i = 80; i < 150; i++) o.samples.push_back(at(0.1 * i, 0.05, true));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3, *o.detected_after_s());
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 8, *o.right_after_m());
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.9, o.astray_s());
  TEST_ASSERT_TRUE(o.lost());  // for longer than 2 s
  TEST_ASSERT_EQUAL(0, o.false_alarms());
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, o.covered());
}

TEST(an_alarm_while_right_is_a_false_one) {
  Outcome o;
  for (int i = 0; i < 100; i++) o.samples.push_back(at(0.1 * i, 0.02, i < 40 || i > 50));
  TEST_ASSERT_EQUAL(1, o.false_alarms());
  TEST_ASSERT_FALSE(o.lost());
}

TEST(a_probability_that_is_right_scores_well) {
  wm::montecarlo::Reliability good, bad;
  Outcome o;
  for (int i = 0; i < 100; i++) o.samples.push_back(at(0.1 * i, i < 95 ? 0.0 : 3.0, i < 95));
  good.take(o);
  for (Sample &s : o.samples) s.lost_probability = 1 - s.lost_probability;
  bad.take(o);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.01, good.brier());
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.8, bad.brier());
}

}  // namespace

int suite_begin(int, char **) {
  draw_corridor();
  return SUITE_RUNS;
}
