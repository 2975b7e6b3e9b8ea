// SPDX-License-Identifier: Apache-2.0
// Plans, ways and maps: the corridors that a seed draws can be driven, are connected, and are what their map says.
#include <algorithm>
#include <filesystem>
#include <string>

#include "common/suite.h"
#include "common/trials.h"
#include "simulate/route.h"
#include "worlds/corridor.h"
#include "worlds/path6.h"
#include "worlds/raster.h"
#include "worlds/rooms.h"

using namespace wm::sim;

namespace {

constexpr Footprint kCar{1.1, -0.2, 0.35};

Drive drive_of(const CorridorDrawing &drawn) {
  Route route;
  Drive drive;
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, route_through(drawn.start, drawn.way, {}, route, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, Drive::plan(route, drive, &err), err.text);
  return drive;
}

TEST(corridor_ways_keep_clear_of_walls) {
  double least = 1e9, shortest = 1e9, longest = 0;
  const uint64_t seeds = wm_trials(50, 4);
  for (uint64_t seed = 1; seed <= seeds; seed++) {
    const CorridorDrawing drawn = draw_corridor(seed, seed % 2 == 0);
    const Drive drive = drive_of(drawn);
    double backwards_m = 0, backwards_longest_m = 0, stretch_m = 0;
    for (double t = 0; t <= drive.duration_s(); t += 0.25) {
      const State s = drive.at(t);
      const double gap = clearance_m(drawn.plan, kCar, s.x_m, s.y_m, s.heading_rad);
      char text[96];
      std::snprintf(text, sizeof text, "seed %d at %.1f s: (%.2f, %.2f)", static_cast<int>(seed), t, s.x_m, s.y_m);
      TEST_ASSERT_TRUE_MESSAGE(gap > 0.08, text);
      least = std::min(least, gap);
      stretch_m = s.speed_mps < 0 ? stretch_m - 0.25 * s.speed_mps : 0;
      if (s.speed_mps < 0) backwards_m -= 0.25 * s.speed_mps;
      backwards_longest_m = std::max(backwards_longest_m, stretch_m);
    }
    TEST_ASSERT_GREATER_THAN_DOUBLE(25, backwards_m);
    TEST_ASSERT_GREATER_THAN_DOUBLE(12, backwards_longest_m);
    shortest = std::min(shortest, drive.length_m());
    longest = std::max(longest, drive.length_m());
  }
  std::printf("%d corridors: least gap %.3f m, ways of %.0f to %.0f m\n", static_cast<int>(seeds), least, shortest,
              longest);
}

TEST(room_ways_keep_clear_of_furniture) {
  constexpr Footprint round{0.28, -0.28, 0.25};
  double least[2] = {1e9, 1e9};
  const uint64_t seeds = wm_trials(50, 4);
  for (uint64_t seed = 1; seed <= seeds; seed++)
    for (int hall = 0; hall < 2; hall++) {
      RoomDrawing drawn;
      Drive drive;
      wm_error err{};
      TEST_ASSERT_EQUAL_MESSAGE(WM_OK, (hall ? draw_hall : draw_office)(seed, drawn, &err), err.text);
      TEST_ASSERT_EQUAL_MESSAGE(WM_OK, Drive::plan(drawn.route, drive, &err), err.text);
      for (double t = 0; t <= drive.duration_s() / drawn.route.laps; t += 0.25) {
        const State s = drive.at(t);
        const double gap = clearance_m(drawn.plan, round, s.x_m, s.y_m, s.heading_rad);
        TEST_ASSERT_GREATER_THAN_DOUBLE(0.08, gap);
        least[hall] = std::min(least[hall], gap);
      }
      const State begin = drive.at(0), end = drive.at(drive.duration_s());
      TEST_ASSERT_DOUBLE_WITHIN(1e-6, begin.x_m, end.x_m);  // loops close
      TEST_ASSERT_DOUBLE_WITHIN(1e-6, begin.y_m, end.y_m);
    }
  std::printf("%d offices: least gap %.3f m; as many halls: %.3f m\n", static_cast<int>(seeds), least[0], least[1]);
}

TEST(corridors_are_connected) {
  const uint64_t seeds = wm_trials(20, 4);
  for (uint64_t seed = 1; seed <= seeds; seed++) {
    const CorridorDrawing drawn = draw_corridor(seed, false);
    // Flood the free floor on a grid of 0.25 m from the start.
    const Rectangle b = drawn.plan.bounds();
    const double cell = 0.25;
    const int nx = static_cast<int>((b.x1_m - b.x0_m) / cell), ny = static_cast<int>((b.y1_m - b.y0_m) / cell);
    const auto place = [&](int i, int j) { return Point{b.x0_m + (i + 0.5) * cell, b.y0_m + (j + 0.5) * cell}; };
    std::vector<char> seen(static_cast<size_t>(nx * ny), 0);
    std::vector<std::pair<int, int>> todo = {
        {static_cast<int>((drawn.start.x_m - b.x0_m) / cell), static_cast<int>((drawn.start.y_m - b.y0_m) / cell)}};
    while (!todo.empty()) {
      const auto [i, j] = todo.back();
      todo.pop_back();
      if (i < 0 || j < 0 || i >= nx || j >= ny || seen[static_cast<size_t>(j * nx + i)]) continue;
      if (!drawn.plan.free(place(i, j))) continue;
      seen[static_cast<size_t>(j * nx + i)] = 1;
      todo.insert(todo.end(), {{i + 1, j}, {i - 1, j}, {i, j + 1}, {i, j - 1}});
    }
    for (const Hallway &h : drawn.hallways) {
      const int i = static_cast<int>((0.5 * (h.area.x0_m + h.area.x1_m) - b.x0_m) / cell);
      const int j = static_cast<int>((0.5 * (h.area.y0_m + h.area.y1_m) - b.y0_m) / cell);
      TEST_ASSERT_TRUE_MESSAGE(seen[static_cast<size_t>(j * nx + i)], "a hallway can't be reached");
    }
    TEST_ASSERT_GREATER_OR_EQUAL(7, drawn.hallways.size());
  }
}

TEST(outlines_are_closed_and_have_free_space_on_their_left) {
  const CorridorDrawing drawn = draw_corridor(3, false);
  double sum_x = 0, sum_y = 0;
  for (const Face &f : drawn.plan.faces) {
    const double dx = f.b.x_m - f.a.x_m, dy = f.b.y_m - f.a.y_m, length = std::sqrt(dx * dx + dy * dy);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0, length);
    const Point middle{0.5 * (f.a.x_m + f.b.x_m), 0.5 * (f.a.y_m + f.b.y_m)};
    const double nx = -dy / length * 0.003, ny = dx / length * 0.003;
    TEST_ASSERT_TRUE(drawn.plan.free({middle.x_m + nx, middle.y_m + ny}));
    if (f.bottom_m > 0) continue;
    TEST_ASSERT_FALSE(drawn.plan.free({middle.x_m - nx, middle.y_m - ny}));
    sum_x += dx, sum_y += dy;
  }
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, sum_x);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, sum_y);
}

TEST(floor_pieces_cover_the_free_floor_once) {
  for (uint64_t seed = 1; seed <= 5; seed++) {
    const CorridorDrawing drawn = draw_corridor(seed, false);
    double pieces_m2 = 0, outline_m2 = 0;
    for (const auto &piece : floor_pieces(drawn.plan, {10, 20}))
      for (size_t i = 0; i < piece.size(); i++) {
        const Point a = piece[i], b = piece[(i + 1) % piece.size()];
        pieces_m2 += 0.5 * (a.x_m * b.y_m - b.x_m * a.y_m);
      }
    for (const Face &f : drawn.plan.faces)
      if (f.bottom_m <= 0) outline_m2 += 0.5 * (f.a.x_m * f.b.y_m - f.b.x_m * f.a.y_m);
    TEST_ASSERT_GREATER_THAN_DOUBLE(150, outline_m2);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, outline_m2, pieces_m2);
  }
}

TEST(map_agrees_with_plan) {
  const CorridorDrawing drawn = draw_corridor(7, true);
  const RasterMap map =
      draw_map(drawn.plan, kCorridorOrigin, kCorridorWidth_px, kCorridorHeight_px, kCorridorResolution_m);
  const double r = map.resolution_m;
  int edges = 0;
  for (int row = 0; row < map.plan.height; row += 3)
    for (int column = 0; column < map.plan.width; column += 3) {
      const size_t at = static_cast<size_t>(row) * static_cast<size_t>(map.plan.width) + static_cast<size_t>(column);
      const Point p{map.origin.x_m + (column + 0.5) * r, map.origin.y_m + (map.plan.height - 0.5 - row) * r};
      TEST_ASSERT_EQUAL(drawn.plan.free(p, false), map.drivable.pixels[at] == 255);
      if (!map.edges.pixels[at]) continue;
      edges++;
      double nearest = 1e9;
      for (const Face &f : drawn.plan.faces)
        if (f.bottom_m <= 0) nearest = std::min(nearest, distance_m(p, f));
      TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(0.7072 * r, nearest);
    }
  TEST_ASSERT_TRUE(edges > 1000);
  // The other way round: each metre of wall is in the picture.
  for (const Face &f : drawn.plan.faces) {
    if (f.bottom_m > 0) continue;
    for (double s = 0.01; s < 1; s += 0.01) {
      const int column = static_cast<int>(std::floor((f.a.x_m + s * (f.b.x_m - f.a.x_m) - map.origin.x_m) / r));
      const int row =
          map.edges.height - 1 - static_cast<int>(std::floor((f.a.y_m + s * (f.b.y_m - f.a.y_m) - map.origin.y_m) / r));
      bool near = false;
      for (int dr = -1; dr <= 1; dr++)
        for (int dc = -1; dc <= 1; dc++)
          near = near || map.edges.pixels[static_cast<size_t>(row + dr) * static_cast<size_t>(map.edges.width) +
                                          static_cast<size_t>(column + dc)] != 0;
      TEST_ASSERT_TRUE(near);
    }
  }
}

TEST(seeds_draw_the_same_and_others_another) {
  const CorridorDrawing a = draw_corridor(11, false), b = draw_corridor(11, false), c = draw_corridor(12, false);
  TEST_ASSERT_EQUAL(a.plan.faces.size(), b.plan.faces.size());
  for (size_t i = 0; i < a.plan.faces.size(); i++)
    TEST_ASSERT_EQUAL_MEMORY(&a.plan.faces[i].a, &b.plan.faces[i].a, sizeof(Point));
  TEST_ASSERT_FALSE(a.start.x_m == c.start.x_m && a.start.y_m == c.start.y_m);
}

TEST(a_map_read_back_gives_the_same_walls) {
  const CorridorDrawing drawn = draw_corridor(5, false);
  const RasterMap map =
      draw_map(drawn.plan, kCorridorOrigin, kCorridorWidth_px, kCorridorHeight_px, kCorridorResolution_m);
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "waymark-worlds-map";
  std::filesystem::create_directories(folder);
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, write_map(map, folder.string(), &err), err.text);
  GreyImage drivable;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, read_grey((folder / "drivable.png").string(), drivable, &err), err.text);
  TEST_ASSERT_TRUE(drivable.pixels == map.drivable.pixels);
  const Plan plan = plan_of_image(drivable, map.resolution_m, map.origin, 128, 2.6);
  for (int i = 0; i < 3000; i++) {
    const Point p{-3 + 60 * std::fmod(i * 0.618034, 1.0), -1.5 + 16 * std::fmod(i * 0.754878, 1.0)};
    double nearest = 1e9;
    for (const Face &f : drawn.plan.faces)
      if (f.bottom_m <= 0) nearest = std::min(nearest, distance_m(p, f));
    if (nearest > 0.03) TEST_ASSERT_EQUAL(drawn.plan.free(p), plan.free(p));
  }
  std::filesystem::remove_all(folder);
}

TEST(a_polyline_plan_is_read) {
  const std::string text =
      "format: waymark-plan/1\nceiling_m: 3\nwalls:\n"
      "  - {points_m: [[0, 0], [10, 0], [10, 6], [0, 6]], closed: true, thickness_m: 0.2,\n"
      "     openings: [{at_m: 5, width_m: 1, kind: door}, {at_m: 13, width_m: 1.5, kind: opening},\n"
      "                {at_m: 21, width_m: 2, kind: window}]}\n"
      "pillars: [{xy_m: [3, 3], size_m: [0.5, 0.5], yaw_deg: 45}]\nclutter: [{xy_m: [7, 3]}]\n";
  Plan plan;
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, parse_plan(text, "plan.yaml", plan, &err), err.text);
  TEST_ASSERT_TRUE(plan.free({1, 1}));
  TEST_ASSERT_FALSE(plan.free({2, 0}));         // wall
  TEST_ASSERT_FALSE(plan.free({5, 0}));         // a door's leaf
  TEST_ASSERT_TRUE(plan.free({5, 0.06}));       // and beside it
  TEST_ASSERT_TRUE(plan.free({10, 3}));         // opening
  TEST_ASSERT_FALSE(plan.free({5, 6.05}));      // under a window
  TEST_ASSERT_FALSE(plan.free({10.05, 6.05}));  // mitred corner
  TEST_ASSERT_FALSE(plan.free({3, 3.3}));       // turned pillar
  TEST_ASSERT_FALSE(plan.free({7, 3}));
  TEST_ASSERT_TRUE(plan.free({7, 3}, false));  // the map doesn't know it
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.9, plan.clearance_m({1, 1}));
  const PlanHit hit = plan.ray({1, 3}, {9, 3});
  TEST_ASSERT_TRUE(hit.hit);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2 - 0.25 * std::sqrt(2.0), hit.distance_m);

  const auto refused = [&](const char *wrong, const char *says) {
    TEST_ASSERT_EQUAL(WM_BAD_CONFIG, parse_plan(wrong, "plan.yaml", plan, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(std::strstr(err.text, says), err.text);
  };
  refused("format: waymark-plan/1\nwals: []\n", "walls");
  refused("walls: []\n", "format");
  refused("format: waymark-plan/1\nwalls: [{points_m: [[0, 0]]}]\n", "at least 2 points");
  refused("format: waymark-plan/1\nwalls: [{points_m: [[0, 0], [2, 0]], openings: [{at_m: 1.9, width_m: 1}]}]\n",
          "spans");
}

TEST(ways_that_cannot_be_driven_are_refused) {
  Route route;
  wm_error err{};
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, route_through({0, 0}, {{{1, 0}}, {{1, 5}}}, {}, route, &err));
  TEST_ASSERT_NOT_NULL(std::strstr(err.text, "point 1"));
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, route_through({0, 0}, {{{5, 0}}, {{5, 5}, true}}, {}, route, &err));
  TEST_ASSERT_NOT_NULL(std::strstr(err.text, "gear"));
  // The drive ends where the way does.
  const std::vector<Waypoint> way = {{{8, 0}}, {{8, 7}}, {{8, 2}, true}, {{14, 2}, true, 1, 0, 1.5}};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, route_through({0, 0}, way, {}, route, &err), err.text);
  Drive drive;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, Drive::plan(route, drive, &err), err.text);
  const State end = drive.at(drive.duration_s());
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 14, end.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 2, end.y_m);
}

TEST(twists_of_a_path_in_space_are_its_derivatives) {
  const Path6 path({{0, 0, 0, 3, 0, 0.1, 0},
                    {4, 2, 1, 2.8, 0.05, -0.05, 0.7},
                    {9, 1, 4, 3.2, -0.1, 0.2, 2.2},
                    {15, -2, 3, 3, 0, 0, 3.6}});
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1, path.at(9).xyz_m[0]);
  for (double t = 0.3; t < 15; t += 0.37) {
    const double h = 1e-4;
    const State6 s = path.at(t), a = path.at(t - h), b = path.at(t + h);
    const auto matrix = [](const State6 &q, double m[3][3]) {
      const double sr = std::sin(q.rpy_rad[0]), cr = std::cos(q.rpy_rad[0]), sp = std::sin(q.rpy_rad[1]),
                   cp = std::cos(q.rpy_rad[1]), sy = std::sin(q.rpy_rad[2]), cy = std::cos(q.rpy_rad[2]);
      const double r[3][3] = {{cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr},
                              {sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr},
                              {-sp, cp * sr, cp * cr}};
      std::memcpy(m, r, sizeof r);
    };
    double R[3][3], A[3][3], B[3][3];
    matrix(s, R), matrix(a, A), matrix(b, B);
    double skew[3][3] = {};
    for (size_t i = 0; i < 3; i++) {
      double v = 0;
      for (size_t k = 0; k < 3; k++) v += R[k][i] * (b.xyz_m[k] - a.xyz_m[k]) / (2 * h);
      TEST_ASSERT_DOUBLE_WITHIN(1e-6, v, s.velocity_body_mps[i]);
      for (size_t j = 0; j < 3; j++)
        for (size_t k = 0; k < 3; k++) skew[i][j] += R[k][i] * (B[k][j] - A[k][j]) / (2 * h);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, skew[2][1], s.rate_body_radps[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, skew[0][2], s.rate_body_radps[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, skew[1][0], s.rate_body_radps[2]);
    // Twice continuously differentiable: no jump of the rates at the knots.
    for (const double knot : {4.0, 9.0}) {
      const State6 before = path.at(knot - 1e-9), after = path.at(knot + 1e-9);
      for (size_t i = 0; i < 3; i++)
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, before.rate_body_radps[i], after.rate_body_radps[i]);
    }
  }
}

}  // namespace
