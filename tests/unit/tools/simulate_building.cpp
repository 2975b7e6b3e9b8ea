// SPDX-License-Identifier: Apache-2.0
// Buildings of one's own: the shipped polyline plan and the same flat as a ROS map become worlds that agree; what a
// wrong plan, map or route says.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>

#include "filmed.h"
#include "made.h"
#include "simulate/angle.h"

using namespace wm::sim;

namespace {

Plan building(const std::string &file, double resolution_m = 0) {
  Plan plan;
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK,
                            load_building(std::string(std::getenv("WM_SOURCE_DIR")) + "/config/worlds/" + file, 2.5,
                                          resolution_m, plan, &err),
                            err.text);
  return plan;
}

TEST(test_plan_and_map_of_a_flat_agree) {
  const Plan drawn = building("plans/flat.yaml"), mapped = building("plans/map.yaml");
  size_t asked = 0;
  for (double x = 0.125; x < 9; x += 0.25)
    for (double y = 0.125; y < 7.5; y += 0.25) {
      const Point p{x, y};
      if (!drawn.free(p, false) || drawn.clearance_m(p, false) < 0.1) continue;
      asked++;
      TEST_ASSERT_TRUE(mapped.free(p));
      TEST_ASSERT_DOUBLE_WITHIN(0.1, drawn.clearance_m(p, false), mapped.clearance_m(p));  // a cell either way
    }
  TEST_ASSERT_TRUE(asked > 500);
  TEST_ASSERT_GREATER_THAN(20, drawn.faces.size());
  TEST_ASSERT_GREATER_THAN(10, mapped.faces.size());
}

// Its picture alone, with the map's resolution; the map's origin is 0, 0.
TEST(test_a_picture_is_a_plan) {
  const Plan mapped = building("plans/map.yaml"), drawn = building("plans/flat.pgm", 0.05);
  TEST_ASSERT_EQUAL(mapped.faces.size(), drawn.faces.size());
  const Rectangle a = mapped.bounds(), b = drawn.bounds();
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, a.x1_m - a.x0_m, b.x1_m - b.x0_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, a.y1_m - a.y0_m, b.y1_m - b.y0_m);
}

// A route that is too narrow for the world's robot is driven by a smaller one.
TEST(test_the_size_of_the_body) {
  const made::Folder folder;
  folder.write("room.yaml", "format: waymark-plan/1\noutside: solid\nrooms: [[[0, 0], [6, 0], [6, 4], [0, 4]]]\n");
  folder.write("x.yaml",
               "format: waymark-scenario/1\nname: x\nworld: {kind: corridor, plan: room.yaml}\nrobot: {wheel_radius_m: "
               "0.05, ticks_per_turn: 100, track_m: 0.3, wheelbase_m: 0.3, body: {front_m: 0.2, back_m: 0.15, width_m: "
               "0.35}}\nroute: {start: {x_m: 1, y_m: 2}, points: [[5.5, 2]]}\n");
  Scenario scenario;
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, load_scenario((folder.path() / "x.yaml").string(), scenario, &err), err.text);
  const Film film = filmed(scenario, 1);
  TEST_ASSERT_EQUAL_DOUBLE(0.2, film.world->footprint.front_m);
  TEST_ASSERT_EQUAL_DOUBLE(-0.15, film.world->footprint.back_m);
  TEST_ASSERT_EQUAL_DOUBLE(0.175, film.world->footprint.half_width_m);
}

TEST(test_shipped_scenarios_with_a_building_can_be_driven) {
  for (const char *name : {"own-plan", "own-map"}) {
    const Film film = filmed(shipped(name), 1);
    TEST_ASSERT_GREATER_THAN_DOUBLE(15, film.recording.length_m);
    TEST_ASSERT_TRUE(film.world->map.has_value());
    const State start = film.recording.drive.at(0), end = film.recording.drive.at(1e9);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3.14159265358979 / 2, start.heading_rad);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 5.4, end.x_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 2.4, end.y_m);
    TEST_ASSERT_LESS_THAN_DOUBLE(0, film.recording.drive.at(film.recording.duration_s - 1).speed_mps);  // backwards
  }
}

void refuse(const std::string &world, const std::string &route, const char *wanted) {
  const made::Folder folder;
  folder.write("empty.yaml", "colour: red\n");
  folder.write("white.pgm", "P5\n4 4\n255\n" + std::string(16, '\xff'));
  folder.write("white.yaml", "image: white.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n");
  folder.write("unscaled.yaml", "image: white.pgm\n");
  folder.write("room.yaml", "format: waymark-plan/1\noutside: solid\nrooms: [[[0, 0], [6, 0], [6, 4], [0, 4]]]\n");
  folder.write("x.yaml", "format: waymark-scenario/1\nname: x\nworld: {" + world +
                             "}\nrobot: {wheel_radius_m: 0.1, ticks_per_turn: 100, track_m: 0.5, wheelbase_m: 1}\n" +
                             route);
  Scenario scenario;
  Film film;
  wm_error err{};
  const std::string path = (folder.path() / "x.yaml").string();
  wm_status status = load_scenario(path, scenario, &err);
  if (status == WM_OK) status = prepare(scenario, 1, film, &err);
  TEST_ASSERT_TRUE_MESSAGE(status == WM_BAD_CONFIG || status == WM_NOT_FOUND || status == WM_IO, wanted);
  std::string said = err.text;
  for (size_t at; (at = said.find(folder.path().string() + "/")) != std::string::npos;)
    said.erase(at, folder.path().string().size() + 1);
  TEST_ASSERT_EQUAL_STRING(wanted, said.c_str());
}

// The way that `way` leads to on a wall of the plan: the nearest face of what the map has.
double to_wall_m(const Plan &plan, double x_m, double y_m) {
  double least = 1e9;
  for (const Face &f : plan.faces)
    if (f.mapped && f.bottom_m == 0) least = std::min(least, distance_m({x_m, y_m}, f));
  return least;
}

// Without errors edge points lie on the plan's walls and tags where they hang; radio and RTK speak in their areas
// alone.
TEST(test_the_hospital_has_all_of_its_sources) {
  Scenario scenario = shipped("hospital");
  TEST_ASSERT_TRUE(scenario.robot.differential);
  make_perfect(scenario);
  scenario.pictures.none = true;
  scenario.pixel_cameras[0].rate_hz = 2;
  Film film = filmed(scenario, 1);
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, observe_pictures(film, &err), err.text);
  const Recording &r = film.recording;
  const auto place_at = [&r](wm_time_ns t_ns) {
    return r.drive.at(1e-9 * static_cast<double>(t_ns - r.clock_start_ns));
  };
  size_t points = 0;
  for (const EdgesSeen &seen : r.edges) {
    const State s = place_at(seen.t_ns);
    for (const Eigen::Vector2d &p : seen.points_m) {
      const double c = std::cos(s.heading_rad), q = std::sin(s.heading_rad);
      const double off_m = to_wall_m(film.world->plan, s.x_m + c * p.x() - q * p.y(), s.y_m + q * p.x() + c * p.y());
      TEST_ASSERT_LESS_THAN_DOUBLE(0.01, off_m);
      points++;
    }
  }
  TEST_ASSERT_GREATER_THAN(5000, points);
  std::set<int32_t> tags;
  for (const MarkerSeen &m : r.markers) {
    const State s = place_at(m.t_ns);
    const auto at =
        std::find_if(r.landmarks.begin(), r.landmarks.end(), [&](const wm_landmark &l) { return l.id == m.id; });
    const double c = std::cos(s.heading_rad), q = std::sin(s.heading_rad), x = 0.33 + m.p_m[0], y = m.p_m[1];
    TEST_ASSERT_DOUBLE_WITHIN(0.01, at->p_m[0], s.x_m + c * x - q * y);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, at->p_m[1], s.y_m + q * x + c * y);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0, wrap(at->yaw_rad - s.heading_rad - m.yaw_rad));
    tags.insert(m.id);
  }
  TEST_ASSERT_EQUAL(8, tags.size());
  TEST_ASSERT_GREATER_THAN(100, r.sightings.size());
  for (const Sighting &s : r.sightings) TEST_ASSERT_DOUBLE_WITHIN(7, 29, place_at(s.t_ns).x_m);
  TEST_ASSERT_GREATER_THAN(100, r.fixes.size());
  for (const Fix &f : r.fixes) TEST_ASSERT_DOUBLE_WITHIN(12, 49, place_at(f.t_ns).x_m);
  TEST_ASSERT_EQUAL(12, r.map.size());
}

void refuse_landmark(const char *landmark, const char *wanted) {
  const made::Folder folder;
  folder.write("room.yaml", "format: waymark-plan/1\noutside: solid\nrooms: [[[0, 0], [6, 0], [6, 4], [0, 4]]]\n");
  folder.write("x.yaml", std::string("format: waymark-scenario/1\nname: x\nworld: {kind: corridor, plan: room.yaml, ") +
                             "landmarks: [" + landmark + "]}\nrobot: {wheel_radius_m: 0.05, ticks_per_turn: 100, " +
                             "track_m: 0.3, body: {front_m: 0.2, back_m: 0.2, width_m: 0.3}}\n" +
                             "route: {start: {x_m: 1, y_m: 2}, points: [[5, 2]]}\n");
  Scenario scenario;
  Film film;
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, load_scenario((folder.path() / "x.yaml").string(), scenario, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_BAD_CONFIG, prepare(scenario, 1, film, &err), landmark);
  TEST_ASSERT_EQUAL_STRING(wanted, err.text);
}

TEST(test_tags_that_nobody_could_see_are_refused) {
  refuse_landmark(
      "{id: 3, xyz_m: [2, 0, 1], yaw_deg: 0}",
      "world.landmarks: tag 3 at (2.00, 0.00) looks into a wall; yaw_deg is the direction from its left edge "
      "to its right one, as who stands before it reads it");
  refuse_landmark("{id: 999, xyz_m: [2, 0, 1], yaw_deg: 180}",
                  "world.landmarks: tag 999: tag36h11 has the ids 0 to 586");
}

TEST(test_mistakes_are_told) {
  const std::string along = "route: {start: {x_m: 1, y_m: 2}, points: [[4, 2]]}\n";
  refuse("kind: corridor, plan: room.yaml", "", "x.yaml:3: world: a world with a `plan` needs a `route` through it");
  refuse("kind: crossing, plan: room.yaml", along, "x.yaml:3: world.plan: only corridor, office and hall have a plan");
  refuse("kind: corridor, plan: empty.yaml", along,
         "empty.yaml:1: neither a plan (`format: waymark-plan/1`) nor a ROS map (`image: FILE`)");
  refuse("kind: corridor, plan: white.pgm", along,
         "world.plan: white.pgm is a picture: `resolution_m`, metres of a pixel, is needed beside it");
  refuse("kind: corridor, plan: unscaled.yaml", along,
         "unscaled.yaml:1: resolution: is missing; the metres of a pixel are needed");
  refuse("kind: corridor, plan: white.yaml", along,
         "white.yaml: no pixel is occupied; are `negate` and the thresholds right?");
  refuse("kind: corridor, plan: room.yaml", "route: {start: {x_m: 1, y_m: 2}, points: [[5.5, 2]]}\n",
         "route: 10.3 s after the start, at (4.90, 2.00), the robot (0.70 m wide, from 1.10 m before "
         "base_link to 0.20 m behind it; `body` of `robot` sets these) is inside of a wall or touches it");
  refuse("kind: corridor, plan: room.yaml", "route: {start: {x_m: 1, y_m: 2}, points: [[1.5, 2], [1.5, 3.5]]}\n",
         "x.yaml:5: route.points: route: point 1: its turn needs 0.56 m more of the straight before it");
}

}  // namespace
