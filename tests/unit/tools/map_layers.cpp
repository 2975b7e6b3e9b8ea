// SPDX-License-Identifier: Apache-2.0
// `waymark map make` and `check`: a plan whose rooms are known gives layers whose walls and areas are known.
#include "common/failure.h"
#include "common/suite.h"
#include "images/pictures.h"
#include "made.h"
#include "map/check.h"
#include "map/layers.h"

using namespace wm::tools;

namespace {

// 200 x 120 px of 0.05 m: a building of walls 4 px thick from (20, 20) to (180, 100), parted at x = 100 with a door.
GreyPicture building(bool door) {
  GreyPicture p{200, 120, std::vector<uint8_t>(200UL * 120UL, 255)};
  const auto wall = [&](int x0, int y0, int x1, int y1, uint8_t v = 0) {
    for (int y = y0; y < y1; y++)
      for (int x = x0; x < x1; x++) p.pixels[static_cast<size_t>(y * 200 + x)] = v;
  };
  wall(20, 20, 180, 24), wall(20, 96, 180, 100), wall(20, 20, 24, 100), wall(176, 20, 180, 100), wall(98, 20, 102, 100);
  if (door) wall(98, 50, 102, 70, 255);
  wall(40, 40, 41, 41);  // a speck
  return p;
}

Plan plan_of(const GreyPicture &picture) {
  Plan plan = plan_from_picture(picture, 128);
  plan.resolution_m = 0.05;
  plan.origin_x_m = -2, plan.origin_y_m = 1;
  return plan;
}

bool drivable_at(const Layers &m, const Plan &plan, double x, double y) {
  const Eigen::Vector2d at = pixel_of(m, plan, {x, y});
  return m.drivable[static_cast<size_t>(std::lround(at.y())) * static_cast<size_t>(m.width) +
                    static_cast<size_t>(std::lround(at.x()))] != 0;
}

void refused(const char *message, const Plan &plan, const LayerOptions &options) {
  made::refused(message, [&] { make_layers(plan, options); });
}

TEST(test_rooms_walls_and_edges) {
  const Plan plan = plan_of(building(false));
  const Layers m = make_layers(plan, {});
  TEST_ASSERT_EQUAL(800, m.width);  // 0.05 m becomes 0.0125
  TEST_ASSERT_EQUAL_DOUBLE(0.0125, m.resolution_m);
  TEST_ASSERT_EQUAL(2, m.rooms);
  TEST_ASSERT_EQUAL(1, m.specks);
  TEST_ASSERT_DOUBLE_WITHIN(0.3, 2 * 74 * 72 * 0.0025, m.drivable_m2);
  TEST_ASSERT_DOUBLE_WITHIN(0.2, 2 * 2 * (74 + 72) * 0.05, m.edges_m);
  TEST_ASSERT_TRUE(drivable_at(m, plan, 0, 4));
  TEST_ASSERT_FALSE(drivable_at(m, plan, -1.8, 4));  // outside of the building
  // Every edge pixel is wall, within a pixel of a wall's face as the plan has it (x = 24 px: -0.8 m).
  int faces = 0;
  for (int y = 300; y < 360; y++)
    for (int x = 0; x < 200; x++)
      if (m.edges[static_cast<size_t>(y) * 800 + static_cast<size_t>(x)] != 0) {
        TEST_ASSERT_DOUBLE_WITHIN(0.0125, -0.8, map_of(m, plan, x, y).x());
        faces++;
      }
  TEST_ASSERT_EQUAL(60, faces);
}

TEST(test_a_door_joins_and_inside_chooses) {
  TEST_ASSERT_EQUAL(1, make_layers(plan_of(building(true)), {}).rooms);
  const Plan plan = plan_of(building(false));
  LayerOptions options;
  options.inside = {{0, 4}};
  const Layers m = make_layers(plan, options);
  TEST_ASSERT_EQUAL(1, m.rooms);
  TEST_ASSERT_FALSE(drivable_at(m, plan, 5, 4));
  options.inside = {{-0.95, 4}};
  refused("--inside -0.95,4 lies in a wall", plan, options);
  options.inside = {{50, 4}};
  refused("outside of the map", plan, options);
}

TEST(test_clearance) {
  const Plan plan = plan_of(building(false));
  LayerOptions options;
  options.clearance_m = 0.3;
  const Layers m = make_layers(plan, options);
  TEST_ASSERT_FALSE(drivable_at(m, plan, -0.8 + 0.25, 4));
  TEST_ASSERT_TRUE(drivable_at(m, plan, -0.8 + 0.36, 4));
}

TEST(test_grey_rims_are_half_walls) {
  // A wall's face in the middle of a pixel: the grey rim puts it there.
  GreyPicture p = building(false);
  for (int y = 24; y < 96; y++) p.pixels[static_cast<size_t>(y * 200 + 24)] = 128;
  const Plan plan = plan_of(p);
  const Layers m = make_layers(plan, {});
  for (int x = 0; x < 200; x++)
    if (m.edges[330UL * 800 + static_cast<size_t>(x)] != 0)
      TEST_ASSERT_DOUBLE_WITHIN(0.0126, -0.8 + 0.025, map_of(m, plan, x, 330).x());
}

TEST(test_what_is_no_plan) {
  GreyPicture white{50, 40, std::vector<uint8_t>(2000, 255)};
  refused("no wall", plan_of(white), {});
  GreyPicture black{50, 40, std::vector<uint8_t>(2000, 0)};
  refused("no floor", plan_of(black), {});
  Plan huge = plan_of(building(true));
  LayerOptions options;
  options.resolution_m = 0.0003;
  refused("400 million", huge, options);
}

TEST(test_a_turned_origin_there_and_back) {
  Plan plan = plan_of(building(true));
  plan.origin_yaw_rad = 0.7;
  const Layers m = make_layers(plan, {});
  const Eigen::Vector2d p = map_of(m, plan, 123, 45);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, (pixel_of(m, plan, p) - Eigen::Vector2d(123, 45)).norm());
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, (map_of(m, plan, -0.5, m.height - 0.5) - Eigen::Vector2d(-2, 1)).norm());
}

TEST(test_check_says_what_is_wrong) {
  const made::Folder folder;
  const Plan plan = plan_of(building(true));
  const Layers m = make_layers(plan, {});
  std::string error;
  const auto write = [&](const char *name, std::vector<uint8_t> layer) {
    TEST_ASSERT_TRUE(wm::images::write_png(folder.path() / name, {m.width, m.height, 1, std::move(layer)}, error));
  };
  write("edges.png", m.edges);
  write("drivable.png", m.drivable);
  write("nothing.png", std::vector<uint8_t>(m.edges.size(), 0));
  const auto report = [&](const char *edges, const std::vector<Eigen::Vector2d> &starts) {
    folder.write("map.yaml", std::string("image: drivable.png\nresolution: 0.0125\norigin: [-2, 1, 0]\nnegate: 0\n"
                                         "occupied_thresh: 0.65\nfree_thresh: 0.196\nlayers: {edges: ") +
                                 edges + ", drivable: drivable.png}\n");
    return check_map(folder.path() / "map.yaml", starts);
  };
  TEST_ASSERT_EQUAL(0, report("edges.png", {{0, 4}}).wrong.size());
  TEST_ASSERT_EQUAL(0, report("edges.png", {{0, 4}}).odd.size());
  TEST_ASSERT_NOT_NULL(std::strstr(report("edges.png", {{-1.9, 4}}).wrong.at(0).c_str(), "not drivable"));
  TEST_ASSERT_NOT_NULL(std::strstr(report("edges.png", {{90, 4}}).wrong.at(0).c_str(), "outside"));
  TEST_ASSERT_NOT_NULL(std::strstr(report("nothing.png", {}).wrong.at(0).c_str(), "empty"));
  TEST_ASSERT_NOT_NULL(std::strstr(report("drivable.png", {}).wrong.at(0).c_str(), "edges"));
}

}  // namespace
