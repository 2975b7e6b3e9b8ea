// SPDX-License-Identifier: Apache-2.0
// Upright lines against labels: what is found, right, false; how far off, and by how much all are turned.
#include <nlohmann/json.hpp>

#include "common/suite.h"
#include "eval/lines.h"

using namespace wm::tools;

namespace {

constexpr double kDeg = M_PI / 180;

LinePicture picture(double turn_deg) {
  LinePicture p;
  for (int i = 0; i < 10; i++) {
    p.labels.push_back({i, (30.0 * i - 150) * kDeg, i < 8});
    // Every other one is off by 0.1 degrees, to either side; the last one with contrast and one without aren't seen.
    if (i != 7 && i != 9) p.seen.push_back({i, (30.0 * i - 150 + (i % 2 ? 0.1 : -0.1) + turn_deg) * kDeg, 0.05 * kDeg});
  }
  p.seen.push_back({50, 15 * kDeg, 0.05 * kDeg});  // nobody's
  return p;
}

TEST(test_found_right_and_false) {
  const Figures f = line_figures({picture(0), picture(0)}, 0.5 * kDeg);
  TEST_ASSERT_EQUAL(20, f["labelled"].get<int>());
  TEST_ASSERT_EQUAL(16, f["with_contrast"].get<int>());
  TEST_ASSERT_EQUAL(14, f["found"].get<int>());
  TEST_ASSERT_EQUAL_DOUBLE(0.875, f["recall"].get<double>());
  TEST_ASSERT_EQUAL(16, f["right"].get<int>());  // one has no contrast: nobody has to find it, and who does is right
  TEST_ASSERT_EQUAL(2, f["false"].get<int>());
  TEST_ASSERT_EQUAL_DOUBLE(0.125, f["false_per_right"].get<double>());
  TEST_ASSERT_EQUAL(9, f["tracks"].get<int>());
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.1, f["azimuth_rms_deg"].get<double>());
}

TEST(test_a_turned_mounting_is_told_and_loses_no_line) {
  const Figures f = line_figures({picture(0.8), picture(0.8)}, 0.5 * kDeg);
  TEST_ASSERT_EQUAL(14, f["found"].get<int>());
  TEST_ASSERT_DOUBLE_WITHIN(0.11, 0.8, f["common_turn_deg"].get<double>());
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.8, f["azimuth_rms_deg"].get<double>());
}

TEST(test_lines_beside_each_other_may_share_a_sighting) {
  LinePicture p;
  p.labels = {{1, 0, true}, {2, 0.3 * kDeg, true}};
  p.seen = {{7, 0.1 * kDeg, std::numeric_limits<double>::quiet_NaN()}};
  const Figures f = line_figures({p}, 0.5 * kDeg);
  TEST_ASSERT_EQUAL(2, f["found"].get<int>());
  TEST_ASSERT_EQUAL(1, f["right"].get<int>());
  TEST_ASSERT_TRUE(f["normalised_rms"].is_null());
}

TEST(test_nothing_seen_is_no_figure) {
  LinePicture p;
  p.labels = {{1, 0, true}};
  const Figures f = line_figures({p}, 0.5 * kDeg);
  TEST_ASSERT_EQUAL(0, f["found"].get<int>());
  TEST_ASSERT_TRUE(f["false_per_right"].is_null());
  TEST_ASSERT_TRUE(f["azimuth_rms_deg"].is_null());
  TEST_ASSERT_TRUE(line_table(f, "run").find("-") != std::string::npos);
}

}  // namespace
