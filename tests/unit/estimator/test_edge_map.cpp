// SPDX-License-Identifier: Apache-2.0
// The map of edges against brute force, and the kernel that looks it up against its scalar twin.
#include <vector>

#include "common/suite.h"
#include "maps/likelihood.hpp"
#include "waymark/random.h"
#include "waymark/vectors.h"

namespace {

constexpr double kPixel_m = 0.04;

struct drawn {
  int width, height;
  std::vector<uint8_t> edges;
  wm_raster raster;
  wm::edge_map map;
  void *memory;

  drawn(int w, int h, double yaw) : width(w), height(h), edges((size_t)w * (size_t)h, 0), memory(nullptr) {
    raster = {(uint32_t)w, (uint32_t)h, kPixel_m, -3.0, 2.0, yaw, edges.data(), nullptr, 0};
  }
  ~drawn() { free(memory); }
  drawn(const drawn &) = delete;
  void build() {
    raster.edges = edges.data();
    const size_t bytes = wm::edge_map::bytes(raster);
    TEST_ASSERT_GREATER_THAN(0, bytes);
    memory = aligned_alloc(64, (bytes + 127) / 64 * 64);
    std::memset(memory, 0x5A, (bytes + 127) / 64 * 64);
    map.init(raster, memory);
    for (size_t i = bytes; i < (bytes + 127) / 64 * 64; i++)
      TEST_ASSERT_EQUAL_HEX8(0x5A, static_cast<uint8_t *>(memory)[i]);
  }
  void line(double x0, double y0, double x1, double y1) {
    for (int i = 0; i <= 4000; i++) {
      const int x = (int)(x0 + (x1 - x0) * i / 4000), y = (int)(y0 + (y1 - y0) * i / 4000);
      edges[(size_t)y * (size_t)width + (size_t)x] = 255;
    }
  }
};

TEST(distances_are_exact) {
  drawn d(300, 220, 0.0);
  for (uint64_t i = 0; i < 40; i++)
    d.edges[(size_t)(wm_random_uniform(1, 1, i) * 220) * 300 + (size_t)(wm_random_uniform(1, 2, i) * 300)] = 255;
  d.line(250, 10, 290, 60);
  d.build();
  const int reach = (int)(wm::edge_map::kReach_m / kPixel_m);
  for (int row = 0; row < d.height; row++)
    for (int column = 0; column < d.width; column++) {
      int best = 1 << 30;
      for (int y = row - reach; y <= row + reach; y++)
        for (int x = column - reach; x <= column + reach; x++)
          if (x >= 0 && y >= 0 && x < d.width && y < d.height && d.edges[(size_t)y * (size_t)d.width + (size_t)x]) {
            const int square = (x - column) * (x - column) + (y - row) * (y - row);
            if (square < best) best = square;
          }
      const int got = d.map.distance_of(column, row);
      if (best > reach * reach) {
        TEST_ASSERT_EQUAL(wm::edge_map::kFar, got);
      } else {
        TEST_ASSERT_DOUBLE_WITHIN(0.51 * d.map.unit_m(), std::sqrt((double)best) * kPixel_m, got * d.map.unit_m());
      }
    }
}

// A slanted line through the pixels is found to a tenth of a pixel, from both of its sides and with the map turned.
TEST(lines_are_found_to_a_part_of_a_pixel) {
  for (double yaw : {0.0, 0.7, -2.5}) {
    drawn d(400, 300, yaw);
    const double x0 = 40.3, y0 = 50.2, x1 = 360.7, y1 = 200.9;
    d.line(x0, y0, x1, y1);
    d.build();
    const double length = std::sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0));
    const double nx = -(y1 - y0) / length, ny = (x1 - x0) / length;
    double sum = 0, worst = 0;
    int count = 0;
    for (uint64_t i = 0; i < 400; i++) {
      const double along = 0.1 + 0.8 * wm_random_uniform(2, 1, i), off_px = 12 * (wm_random_uniform(2, 2, i) - 0.5);
      const double u = x0 + along * (x1 - x0) + off_px * nx, v = y0 + along * (y1 - y0) + off_px * ny;
      double x, y, back_u, back_v;
      d.map.to_map(u, v, &x, &y);
      d.map.to_pixels(x, y, &back_u, &back_v);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, u, back_u);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, v, back_v);
      const wm::edge_line line = d.map.nearest(x, y);
      TEST_ASSERT_TRUE(line.found);
      // The foot of the perpendicular lies on the line drawn.
      double foot_u, foot_v;
      d.map.to_pixels(x + line.offset_m * line.normal_x, y + line.offset_m * line.normal_y, &foot_u, &foot_v);
      const double error = (foot_u - x0) * nx + (foot_v - y0) * ny;
      sum += error;
      worst = std::fmax(worst, std::fabs(error));
      count++;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.0, sum / count);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.45, worst);
  }
}

// GIVEN a wall whose faces are four pixels apart WHEN lines are looked up THEN each face has its own.
TEST(the_faces_of_a_thin_wall_have_lines_of_their_own) {
  drawn d(200, 100, -0.3);
  d.line(20, 50, 180, 50);
  d.line(20, 54, 180, 54);
  d.build();
  for (const double row : {49.0, 51.0, 53.5, 56.0}) {
    double x, y, u, v;
    d.map.to_map(100.5, row, &x, &y);
    const wm::edge_line line = d.map.nearest(x, y);
    TEST_ASSERT_TRUE(line.found);
    d.map.to_pixels(x + line.offset_m * line.normal_x, y + line.offset_m * line.normal_y, &u, &v);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, row < 52.0 ? 50.5 : 54.5, v);
  }
}

// GIVEN a wall of 32 cm between two rooms WHEN a place is nearer to the face that the wall hides THEN the face towards
// the eye is found, from either room; without a drivable layer, and where floor is on both sides, the nearest one.
TEST(a_wall_hides_its_other_face) {
  for (const bool layer : {false, true}) {
    drawn d(200, 150, 0.6);
    d.line(20, 70, 180, 70);
    d.line(20, 78, 180, 78);
    d.line(20, 120, 180, 120);  // on the floor
    std::vector<uint8_t> floor(d.edges.size(), 255);
    for (size_t row = 70; row <= 78; row++) std::memset(floor.data() + row * 200, 0, 200);
    if (layer) d.raster.drivable = floor.data();
    d.build();
    const auto face = [&](double row, double from_row) {
      double x, y, eye_x, eye_y, u, v;
      d.map.to_map(100.5, row, &x, &y);
      d.map.to_map(60.5, from_row, &eye_x, &eye_y);
      const wm::edge_line line = d.map.nearest_seen(x, y, x - eye_x, y - eye_y);
      TEST_ASSERT_TRUE(line.found);
      d.map.to_pixels(x + line.offset_m * line.normal_x, y + line.offset_m * line.normal_y, &u, &v);
      TEST_ASSERT_DOUBLE_WITHIN(0.02, std::fabs(v - row) * kPixel_m, line.distance_m);
      return v;
    };
    for (const double row : {68.0, 72.0, 75.5, 80.0, 84.0}) {
      const double nearest = row < 74.5 ? 70.5 : 78.5;
      TEST_ASSERT_DOUBLE_WITHIN(0.1, layer ? 70.5 : nearest, face(row, 20));
      TEST_ASSERT_DOUBLE_WITHIN(0.1, layer ? 78.5 : nearest, face(row, 140));
    }
    for (const double row : {118.0, 122.0}) TEST_ASSERT_DOUBLE_WITHIN(0.1, 120.5, face(row, 100));
  }
}

TEST(outside_of_the_map_there_is_nothing) {
  drawn d(100, 100, 0.3);
  d.line(10, 10, 90, 10);
  d.build();
  for (double far : {-1e6, -10.0, 30.0, 1e9}) {
    TEST_ASSERT_FALSE(d.map.nearest(far, 0).found);
    TEST_ASSERT_FALSE(d.map.nearest(0, far).found);
    TEST_ASSERT_FALSE(d.map.drivable(far, far));
  }
  TEST_ASSERT_FALSE(d.map.nearest(NAN, 0).found);
}

TEST(what_is_no_map_is_refused) {
  wm_raster r{};
  TEST_ASSERT_EQUAL(0, wm::edge_map::bytes(r));
  const uint8_t pixel = 255;
  r = {1, 1, 0.0, 0, 0, 0, &pixel, nullptr, 0};
  TEST_ASSERT_EQUAL(0, wm::edge_map::bytes(r));
  r.resolution_m = 0.05;
  TEST_ASSERT_GREATER_THAN(0, wm::edge_map::bytes(r));
  r.width_px = 40000;
  TEST_ASSERT_EQUAL(0, wm::edge_map::bytes(r));
}

// Near the border and beyond it, too.
TEST(the_kernel_and_its_scalar_twin_agree_to_the_bit) {
  drawn d(500, 400, 0.4);
  d.line(30, 30, 470, 60);
  d.line(470, 60, 440, 380);
  d.line(30, 30, 60, 370);
  d.build();
  const double sigma[wm::kSigmaClasses] = {0.03, 0.05, 0.08, 0.12};
  wm::score_table table;
  wm::make_score_table(d.map, sigma, 0.05, false, &table);
  wm::scan_points points{};
  points.count = 181;
  const int ends[wm::kSigmaClasses] = {40, 90, 90, 181};
  std::memcpy(points.class_end, ends, sizeof ends);
  points.reach_m = 6.1f;
  for (int i = 0; i < points.count; i++) {
    const double range = 6 * wm_random_uniform(3, 1, (uint64_t)i),
                 angle = 3 * (wm_random_uniform(3, 2, (uint64_t)i) - 0.5);
    points.x_m[i] = (float)(range * std::cos(angle));
    points.y_m[i] = (float)(range * std::sin(angle));
  }
  int different = 0;
  for (uint64_t i = 0; i < 500; i++) {
    double x, y;
    d.map.to_map(600 * wm_random_uniform(4, 1, i) - 50, 500 * wm_random_uniform(4, 2, i) - 50, &x, &y);
    const double angle = 6.28 * wm_random_uniform(4, 3, i);
    const int32_t a = wm::score(d.map, points, table, x, y, std::cos(angle), std::sin(angle));
    TEST_ASSERT_EQUAL_INT32(wm::score_scalar(d.map, points, table, x, y, std::cos(angle), std::sin(angle)), a);
    wm_vectors_limit(true);
    TEST_ASSERT_EQUAL_INT32(a, wm::score(d.map, points, table, x, y, std::cos(angle), std::sin(angle)));
    wm_vectors_limit(false);
    different += a != points.count * table.value[0][255];
  }
  TEST_ASSERT_GREATER_THAN(300, different);
}

}  // namespace
