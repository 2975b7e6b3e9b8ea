// SPDX-License-Identifier: Apache-2.0
// Pieces joined to polylines as the paper does: straight ones, bends, corners, branches, gaps; and a drawn arc of a
// wall.
#include <memory>
#include <vector>

#include "vision/edges_hough/polylines.hpp"

#include "common/block.hpp"
#include "common/suite.h"
#include "waymark/random.h"

namespace {

wm::polyline_limits limits;
std::vector<wm::line_piece> pieces;
std::vector<wm::line_vertex> vertices;
int lines;

void join() {
  const auto count = static_cast<int32_t>(pieces.size());
  const block memory = allocate(wm::piece_graph_bytes(count));
  wm::piece_graph graph;
  wm::piece_graph_place(&graph, count, memory.get());
  vertices.resize(2 * pieces.size());
  const int used = wm::make_polylines(pieces.data(), count, limits, &graph, vertices.data());
  TEST_ASSERT_LESS_OR_EQUAL(static_cast<int>(vertices.size()), used);
  vertices.resize(static_cast<size_t>(used));
  lines = used > 0 ? vertices.back().line + 1 : 0;
  for (size_t i = 1; i < vertices.size(); i++) {
    const int step = vertices[i].line - vertices[i - 1].line;
    TEST_ASSERT_TRUE(step == 0 || step == 1);
  }
}

void expect(size_t i, double x, double y, double within) {
  TEST_ASSERT_DOUBLE_WITHIN(within, x, static_cast<double>(vertices[i].x));
  TEST_ASSERT_DOUBLE_WITHIN(within, y, static_cast<double>(vertices[i].y));
}

void piece(double x0, double y0, double x1, double y1) {
  pieces.push_back({static_cast<float>(x0), static_cast<float>(y0), static_cast<float>(x1), static_cast<float>(y1)});
}

// A row of windows sees a wall that jitters by a pixel.
TEST(a_straight_wall_is_one_line) {
  for (int i = 0; i < 6; i++) piece(40 * i, 100 + i % 2, 40 * i + 49, 101 - i % 2);
  join();
  TEST_ASSERT_EQUAL(2, vertices.size());
  expect(0, 0, 100, 1);
  expect(1, 249, 100, 1);
}

// Each piece turns by 15 degrees; in any order and direction.
TEST(an_arc_is_a_polyline_through_the_intersections) {
  double x = 0, y = 0;
  std::vector<double> at_x = {x}, at_y = {y};
  for (int i = 0; i < 8; i++) {
    const double angle = 15 * M_PI / 180 * i;
    const double to_x = x + 50 * std::cos(angle), to_y = y + 50 * std::sin(angle);
    if (i % 2)
      piece(x, y, to_x, to_y);
    else
      piece(to_x, to_y, x, y);
    x = to_x;
    y = to_y;
    at_x.push_back(x);
    at_y.push_back(y);
  }
  std::swap(pieces[1], pieces[6]);
  std::swap(pieces[0], pieces[3]);
  join();
  TEST_ASSERT_EQUAL(1, lines);
  TEST_ASSERT_EQUAL(9, vertices.size());
  const bool turned = std::fabs(static_cast<double>(vertices[0].x)) > 1;
  for (size_t i = 0; i < 9; i++) expect(i, at_x[turned ? 8 - i : i], at_y[turned ? 8 - i : i], 0.01);
}

TEST(a_corner_is_no_continuation) {
  piece(0, 0, 50, 0);
  piece(50, 1, 50, 50);
  join();
  TEST_ASSERT_EQUAL(2, lines);
  TEST_ASSERT_EQUAL(4, vertices.size());
  limits.join_angle_rad = 1.5;  // but for one who says so
  join();
  TEST_ASSERT_EQUAL(1, lines);
}

TEST(a_gap_parts) {
  piece(0, 0, 50, 0);
  piece(59.9, 0, 100, 0);
  piece(110.1, 0, 150, 0);
  join();
  TEST_ASSERT_EQUAL(2, lines);
  expect(1, 100, 0, 1e-6);
  expect(2, 110.1, 0, 1e-4);
}

// A spur leaves a bend: the way goes along the longer arm.
TEST(a_branch_is_left_out) {
  double x = 0, y = 0;
  for (int i = 0; i < 9; i++) {
    const double angle = 18 * M_PI / 180 * i, to_x = x + 50 * std::cos(angle), to_y = y + 50 * std::sin(angle);
    piece(x, y, to_x, to_y);
    if (i == 4) piece(to_x, to_y, to_x + 15 * std::cos(angle), to_y + 15 * std::sin(angle));
    x = to_x;
    y = to_y;
  }
  join();
  TEST_ASSERT_EQUAL(1, lines);
  TEST_ASSERT_EQUAL(10, vertices.size());
  expect(0, 0, 0, 0.01);
  expect(9, x, y, 0.01);
}

TEST(nothing_and_nonsense) {
  join();
  TEST_ASSERT_EQUAL(0, vertices.size());
  for (uint64_t i = 0; i < 200; i++) {  // any heap of pieces gives finite lines
    const auto n = [i](uint64_t k) { return 60 * wm_random_uniform(1, k, i); };
    piece(n(1), n(2), i % 7 ? n(3) : n(1), i % 7 ? n(4) : n(2));
  }
  limits.join_angle_rad = 0;
  limits.straight_share = 1;
  join();
  TEST_ASSERT_GREATER_THAN(0, lines);
  for (const wm::line_vertex &v : vertices) TEST_ASSERT_TRUE(std::isfinite(v.x) && std::isfinite(v.y));
}

}  // namespace

void setUp() {
  pieces.clear();
  vertices.clear();
  limits = {};
}
