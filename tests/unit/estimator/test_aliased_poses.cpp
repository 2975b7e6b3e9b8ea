// SPDX-License-Identifier: Apache-2.0
// Places that look as the tracked one: a building of two rooms of the same shape, the second turned by half.
#include <vector>

#include "common/suite.h"
#include "filters/edge_mcl/hypotheses.hpp"
#include "math/arc.hpp"

namespace {

constexpr double kPixel_m = 0.02;
constexpr int kWidth = 900, kHeight = 400;  // 18 x 8 m

struct segment {
  double ax, ay, bx, by;
};
const segment kRoom[] = {{1, 1, 7, 1}, {7, 1, 7, 4}, {7, 4, 5, 4}, {5, 4, 5, 6}, {5, 6, 1, 6}, {1, 6, 1, 1}};

std::vector<uint8_t> edges, drivable;
wm_raster raster;
char *map_memory, *field_memory;
wm::edge_map map;
wm::search_field field;
wm::hypotheses alike;
wm::floor_points scan;

// Of a pose in the first room that in the second.
wm_pose2 twin(const wm_pose2 &p) { return {17 - p.x_m, 7 - p.y_m, wm::wrap(p.heading_rad + wm::kPi)}; }

bool inside(double x, double y) { return x > 1 && y > 1 && ((x < 7 && y < 4) || (x < 5 && y < 6)); }

void draw(double x, double y) {
  edges[(size_t)(kHeight - 1 - (int)(y / kPixel_m)) * kWidth + (size_t)(x / kPixel_m)] = 1;
}

// What is seen of the first room's walls, and of a box in it that the second has not.
void see(const wm_pose2 &pose, bool box) {
  scan.count = 0;
  const double c = std::cos(pose.heading_rad), s = std::sin(pose.heading_rad);
  const auto add = [&](double x, double y) {
    const double dx = x - pose.x_m, dy = y - pose.y_m;
    scan.of[scan.count].x_m = (float)(c * dx + s * dy);
    scan.of[scan.count++].y_m = (float)(c * dy - s * dx);
  };
  for (const segment &w : kRoom)
    for (int i = 0; i < 20; i++) add(w.ax + (w.bx - w.ax) * i / 20, w.ay + (w.by - w.ay) * i / 20);
  for (int i = 0; box && i < 120; i++) add(2.5 + 0.5 * (i % 12) / 12, 2.5);
}

const wm::hypothesis *listed(const wm_pose2 &pose) {
  for (int i = 0; i < alike.aliased(); i++) {
    const wm_pose2 off = wm::between(pose, alike.alias(i).pose);
    if (std::sqrt(off.x_m * off.x_m + off.y_m * off.y_m) < 0.1 && std::fabs(off.heading_rad) < 0.03)
      return &alike.alias(i);
  }
  return nullptr;
}

const wm_pose2 kHere = {2.0, 3.0, 0.3};

void look(int scans, const wm_pose2 &pose, double new_m) {
  alike.carry(pose, {});
  for (int i = 0; i < scans; i++) alike.update_aliased(map, field, scan, new_m, 1.0, 1e-5, 40000);
}

// GIVEN a robot in the first room WHEN it has seen all of it a few times THEN the same place of the second room is
// listed, turned by half, with a small weight, and nothing else is.
TEST(the_same_place_of_a_room_that_looks_the_same_is_listed) {
  see(kHere, false);
  look(6, kHere, 0.0);
  const wm::hypothesis *there = listed(twin(kHere));
  TEST_ASSERT_NOT_NULL(there);
  TEST_ASSERT_EQUAL(1, alike.aliased());
  TEST_ASSERT_GREATER_THAN_DOUBLE(0, there->odds);
  TEST_ASSERT_LESS_THAN_DOUBLE(1e-3, there->odds);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0, there->covariance[0]);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, there->covariance[0]);
}

// GIVEN that WHEN the robot drives on THEN odometry carries the place along.
TEST(odometry_carries_it_along) {
  see(kHere, false);
  look(6, kHere, 0.0);
  const wm_pose2 way = {0.7, 0.1, 0.4};
  alike.carry(kHere, way);
  TEST_ASSERT_NOT_NULL(listed(twin(wm::compose(kHere, way))));
}

// GIVEN that WHEN a box comes into view that stands in the first room only THEN the second is dropped.
TEST(a_view_that_tells_them_apart_drops_it) {
  see(kHere, false);
  look(6, kHere, 0.0);
  TEST_ASSERT_NOT_NULL(listed(twin(kHere)));
  see(kHere, true);
  look(6, kHere, 0.2);
  TEST_ASSERT_NULL(listed(twin(kHere)));
}

// GIVEN that WHEN what is seen fits there, but no longer where the robot is believed to be THEN the odds turn with the
// way, and stop somewhere.
TEST(the_odds_turn_with_what_is_seen) {
  see(kHere, false);
  look(6, kHere, 0.0);
  const double before = listed(twin(kHere))->odds;
  const wm_pose2 believed = wm::compose(kHere, {0.3, 0.3, 0.0});
  look(10, believed, 0.4);
  TEST_ASSERT_NOT_NULL(listed(twin(kHere)));
  TEST_ASSERT_GREATER_THAN_DOUBLE(100 * before, listed(twin(kHere))->odds);
  look(20, believed, 0.4);
  const double weight = listed(twin(kHere))->odds;
  TEST_ASSERT_GREATER_THAN_DOUBLE(1.0, weight);
  TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(50.0, weight);
  TEST_ASSERT_DOUBLE_WITHIN(3.0, 11.0, alike.likelier_for_m());
  alike.forget_aliased_odds();
  TEST_ASSERT_EQUAL_DOUBLE(0.0, alike.aliased_odds());
}

// GIVEN that WHEN the map usually explains no more than it does where the robot is believed to be THEN nothing turns.
TEST(what_is_explained_beyond_the_usual_says_nothing) {
  see(kHere, false);
  look(6, kHere, 0.0);
  const wm_pose2 believed = wm::compose(kHere, {0.3, 0.3, 0.0});
  alike.carry(believed, {});
  for (int i = 0; i < 10; i++) alike.update_aliased(map, field, scan, 0.4, 0.0, 1e-5, 40000);
  TEST_ASSERT_LESS_THAN_DOUBLE(1e-3, alike.aliased_odds());
}

// GIVEN a fit whose information can't be inverted WHEN its covariance is asked for THEN there is none, and what the
// caller had stays.
TEST(a_failed_inverse_gives_no_covariance) {
  wm::matrix<3> information = 100.0 * wm::matrix<3>::Identity();
  double out[6] = {-1, -1, -1, -1, -1, -1};
  TEST_ASSERT_TRUE(wm::place_covariance(information, out));
  TEST_ASSERT_TRUE(out[0] > 0 && out[2] > 0 && out[5] > 0);
  for (double &v : out) v = -1;
  information(1, 1) = NAN;
  TEST_ASSERT_FALSE(wm::place_covariance(information, out));
  for (const double v : out) TEST_ASSERT_EQUAL_DOUBLE(-1.0, v);
}

// GIVEN a wall at x = 1 and a camera at (3, 2) THEN what is seen on this side of it, by at most half of the way, may be
// its image in the floor; what is seen behind it, or nearer, is none.
TEST(an_image_lies_before_an_edge) {
  const auto before = [](double x) { return wm::before_an_edge(map, x, 2.0, x - 3.0, 0.0); };
  TEST_ASSERT_TRUE(before(1.2));
  TEST_ASSERT_TRUE(before(1.6));
  TEST_ASSERT_FALSE(before(1.8));
  TEST_ASSERT_FALSE(before(0.8));
}

// GIVEN the same camera THEN only what is behind the wall by more than its place may be off is seen through it; nothing
// is that lies along a wall, at the camera's own place or outside of the map.
TEST(nothing_is_seen_through_a_wall) {
  const auto through = [](double x, double y, double eye_x, double eye_y) {
    return wm::through_an_edge(map, x, y, x - eye_x, y - eye_y);
  };
  TEST_ASSERT_TRUE(through(0.5, 2.0, 3.0, 2.0));
  TEST_ASSERT_TRUE(through(-40.0, 2.0, 3.0, 2.0));
  TEST_ASSERT_FALSE(through(0.8, 2.0, 3.0, 2.0));
  TEST_ASSERT_FALSE(through(1.5, 2.0, 3.0, 2.0));
  TEST_ASSERT_FALSE(through(6.0, 1.1, 3.0, 1.1));
  TEST_ASSERT_FALSE(through(3.0, 2.0, 3.0, 2.0));
  TEST_ASSERT_FALSE(through(-3.0, -5.0, -1.0, -5.0));
  TEST_ASSERT_FALSE(through(NAN, 2.0, 3.0, 2.0));
}

}  // namespace

void setUp(void) {
  alike.init(map);
  alike.clear({}, {});
}

int suite_begin(int, char **) {
  edges.assign((size_t)kWidth * kHeight, 0);
  drivable.assign(edges.size(), 0);
  for (const segment &w : kRoom)
    for (double u = 0; u <= 1; u += 0.001) {
      const wm_pose2 p = {w.ax + (w.bx - w.ax) * u, w.ay + (w.by - w.ay) * u, 0};
      draw(p.x_m, p.y_m);
      draw(twin(p).x_m, twin(p).y_m);
    }
  for (double u = 0; u < 0.5; u += 0.01) draw(2.5 + u, 2.5);
  for (int r = 0; r < kHeight; r++)
    for (int c = 0; c < kWidth; c++) {
      const double x = (c + 0.5) * kPixel_m, y = (kHeight - r - 0.5) * kPixel_m;
      drivable[(size_t)r * kWidth + (size_t)c] = inside(x, y) || inside(17 - x, 7 - y);
    }
  raster = {kWidth, kHeight, kPixel_m, 0, 0, 0, edges.data(), drivable.data(), 0};
  map_memory = (char *)aligned_alloc(64, (wm::edge_map::bytes(raster) + 63) / 64 * 64);
  map.init(raster, map_memory);
  field_memory = (char *)aligned_alloc(64, (wm::search_field::bytes(raster) + 63) / 64 * 64);
  field.init(map, field_memory);
  return SUITE_RUNS;
}

void suite_end() {
  free(map_memory);
  free(field_memory);
}
