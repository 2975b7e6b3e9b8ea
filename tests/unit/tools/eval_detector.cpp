// SPDX-License-Identifier: Apache-2.0
// The detector's metric on made polylines whose figures are known, and a zigzag over the whole picture: it touches
// every region of precision, so it wins by the paper's counting, and must lose by length.
#include <nlohmann/json.hpp>

#include "common/failure.h"
#include "common/suite.h"
#include "eval/detector.h"
#include "made.h"

using namespace wm::tools;

namespace {

const DetectorMetric kMetric{.omega_px = 9, .min_length_px = 28, .in_view = {}};

Polyline line(double u0, double v0, double u1, double v1) { return {{u0, v0}, {u1, v1}}; }

void expect(const Figures &f, const char *key, double value, double within = 1e-9) {
  TEST_ASSERT_TRUE_MESSAGE(f.at(key).is_number(), key);
  TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(within, value, f.at(key).get<double>(), key);
}

TEST(test_region_is_a_rectangle_along_the_link) {
  const Polyline link = line(100, 100, 200, 100);
  TEST_ASSERT_TRUE(touches_region(line(150, 108, 150, 300), link, 9));
  TEST_ASSERT_FALSE(touches_region(line(150, 110, 150, 300), link, 9));
  TEST_ASSERT_FALSE(touches_region(line(201, 100, 300, 100), link, 9));  // no caps at the ends
  TEST_ASSERT_TRUE(touches_region(line(0, 0, 300, 200), link, 9));       // through it, both ends outside
  TEST_ASSERT_TRUE(touches_region({{150, 95}}, link, 9));                // a single point
  // At 30 degrees, off by 8.9 and 9.1 px across.
  const double c = std::cos(0.5236), s = std::sin(0.5236);
  const Polyline sloped = line(0, 0, 100 * c, 100 * s);
  for (const double off : {8.9, 9.1})
    TEST_ASSERT_EQUAL(
        off < 9,
        touches_region(line(20 * c - off * s, 20 * s + off * c, 60 * c - off * s, 60 * s + off * c), sloped, 9));
}

TEST(test_right_false_missed) {
  const FramePolylines truth{{0, {line(100, 100, 200, 100), line(100, 300, 200, 300)}}, {10, {line(0, 0, 50, 0)}}};
  const FramePolylines detected{{0, {line(100, 104, 150, 104), line(100, 500, 140, 500)}}, {5, {line(0, 0, 9, 9)}}};
  const Figures f = detector_figures(truth, detected, kMetric);
  expect(f, "frames", 2);
  expect(f, "true_positives", 1);
  expect(f, "false_positives", 1);
  expect(f, "false_negatives", 2);
  expect(f, "precision", 0.5);
  expect(f, "recall", 1.0 / 3);
  expect(f, "length_precision", 50.0 / 90, 0.01);
  expect(f, "length_recall", (50 + std::sqrt(81.0 - 16)) / 250, 0.01);
}

TEST(test_left_out_is_neither_right_nor_wrong) {
  const FramePolylines truth{{0, {line(100, 100, 120, 100), line(600, 100, 700, 100), line(0, 200, 100, 200)}}};
  const FramePolylines detected{{0, {line(100, 100, 120, 100), line(600, 100, 650, 100), line(0, 200, 100, 200)}}};
  DetectorMetric metric = kMetric;
  metric.in_view = [](const Eigen::Vector2d &p) { return p.x() < 500; };
  const Figures f = detector_figures(truth, detected, metric);
  expect(f, "left_out_short", 1);
  expect(f, "left_out_of_view", 1);
  expect(f, "detected_on_left_out", 2);
  expect(f, "true_positives", 1);
  expect(f, "false_positives", 0);
  expect(f, "false_negatives", 0);
  expect(f, "length_precision", 1);
  expect(f, "length_recall", 1);
}

TEST(test_nothing_detected_or_nothing_true) {
  const FramePolylines some{{0, {line(0, 0, 100, 0)}}}, none{{0, {}}};
  Figures f = detector_figures(some, none, kMetric);
  TEST_ASSERT_TRUE(f["precision"].is_null());
  expect(f, "recall", 0);
  f = detector_figures(none, some, kMetric);
  expect(f, "precision", 0);
  TEST_ASSERT_TRUE(f["recall"].is_null());
}

TEST(test_a_zigzag_over_the_picture_loses_by_length) {
  Polyline zigzag;
  for (int i = 0; i <= 64; i++) zigzag.emplace_back(20.0 * i, i % 2 == 0 ? 0 : 720);
  const FramePolylines truth{{0, {line(100, 400, 600, 380), line(700, 300, 1200, 420), line(640, 100, 660, 300)}}};
  const Figures f = detector_figures(truth, {{0, {zigzag}}}, kMetric);
  expect(f, "precision", 1);  // why the paper's metric alone can be won by anybody
  expect(f, "recall", 1);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, f["length_precision"].get<double>());
}

TEST(test_file_is_read_and_its_mistakes_are_named) {
  const made::Folder folder;
  folder.write("edges.csv", "frame,polyline,u_px,v_px\n0,0,1,2\n0,0,3,4\n0,1,5,6\n10,,,\n20,0,7,8\n");
  const FramePolylines lines = load_polylines(folder.path() / "edges.csv");
  TEST_ASSERT_EQUAL(3, lines.size());
  TEST_ASSERT_EQUAL(2, lines.at(0).size());
  TEST_ASSERT_EQUAL(2, lines.at(0)[0].size());
  TEST_ASSERT_EQUAL(0, lines.at(10).size());
  TEST_ASSERT_EQUAL_DOUBLE(8, lines.at(20)[0][0].y());
  folder.write("bad.csv", "frame,polyline,u_px,v_px\n0,0,1,\n");
  made::refused("bad.csv:2: u_px", [&] { load_polylines(folder.path() / "bad.csv"); });
}

}  // namespace
