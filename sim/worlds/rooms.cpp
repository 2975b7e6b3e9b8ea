// SPDX-License-Identifier: Apache-2.0
#include "worlds/rooms.h"

#include <algorithm>
#include <cmath>

#include "waymark/internal/math/elementary.hpp"
#include "worlds/dice.h"

namespace wm::sim {
namespace {

// Three times round, from the middle of the lower side on.
wm_status office_loops(const Rectangle &r, uint64_t seed, Route &route, wm_error *err) {
  Dice dice(seed, Part::route);
  const double speed = dice.uniform(0.35, 0.5);
  Point corners[4] = {{r.x1_m, r.y0_m}, {r.x1_m, r.y1_m}, {r.x0_m, r.y1_m}, {r.x0_m, r.y0_m}};
  if (dice.chance(0.5)) std::reverse(corners, corners + 4);
  const Point start{0.5 * (r.x0_m + r.x1_m), r.y0_m};
  std::vector<Waypoint> way;
  for (const Point &p : corners) way.push_back({p, false, speed, 0, 0.6});
  way.push_back({start, false, speed});
  WaypointRules rules;
  rules.turn_speed_mps = 0.7 * speed;
  rules.acceleration_mps2 = 0.5;
  const wm_status status = route_through(start, way, rules, route, err);
  route.laps = 3;
  return status;
}

wm_status hall_loops(const std::vector<Point> &loop, Route &route, wm_error *err) {
  // Twice round, from the middle of the first side on and back to it.
  const Point start{0.5 * (loop[0].x_m + loop[1].x_m), 0.5 * (loop[0].y_m + loop[1].y_m)};
  std::vector<Waypoint> way;
  for (size_t i = 1; i <= loop.size(); i++) way.push_back({loop[i % loop.size()], false, 0.5, 0, 0.6});
  way.push_back({start, false, 0.5});
  WaypointRules rules;
  rules.turn_speed_mps = 0.4;
  rules.acceleration_mps2 = 0.5;
  const wm_status status = route_through(start, way, rules, route, err);
  route.laps = 2;
  return status;
}

}  // namespace

wm_status draw_office(uint64_t seed, RoomDrawing &out, wm_error *err) {
  Dice dice(seed, Part::building);
  const double length = dice.uniform(8, 10), width = dice.uniform(6.2, 7.4);
  std::vector<FreeRectangle> free = {{{0, 0, length, width}}};
  const double door = dice.uniform(1, length - 1);
  free.push_back({{door - 0.5, -0.12, door + 0.5, 0}, Surface::door, 2.05, 3});
  out.plan = plan_of_rectangles(free, kOfficeCeiling_m);
  // Desks in the middle, shelves along the walls; the robot drives between them.
  const double aisle = dice.uniform(1.35, 1.55), middle_x = 0.5 * length, middle_y = 0.5 * width;
  const double desks_x = length - 2 * (0.45 + aisle), desks_y = std::min(1.9, width - 2 * (0.45 + aisle));
  const int n = std::max(2, static_cast<int>(desks_x / 1.6));
  for (int i = 0; i < n; i++)
    out.plan.add_body(
        turned_box({middle_x + (i + 0.5 - 0.5 * n) * desks_x / n, middle_y}, desks_x / n - 0.04, desks_y, 0), 0, 0.74,
        Surface::desk, true);
  for (double x = 0.6; x + 1.0 < length; x += dice.uniform(1.15, 2.0))
    if (dice.chance(0.7))
      out.plan.add_body(turned_box({x + 0.45, width - 0.19}, 0.9, 0.36, 0), 0, dice.chance(0.5) ? 1.9 : 1.1,
                        Surface::shelf, true);
  const double inset_x = middle_x - 0.5 * desks_x - 0.5 * aisle, inset_y = middle_y - 0.5 * desks_y - 0.62;
  return office_loops({inset_x, inset_y, length - inset_x, width - inset_y}, seed, out.route, err);
}

wm_status draw_hall(uint64_t seed, RoomDrawing &out, wm_error *err) {
  Dice dice(seed, Part::building);
  const double half_x = dice.uniform(5.5, 7.5), half_y = dice.uniform(4.5, 6);
  std::vector<Point> loop;
  out.plan = plan_of_rectangles({{{-half_x, -half_y, half_x, half_y}}}, dice.uniform(3.8, 4.8));
  const Plan &plan = out.plan;
  // A loop of five corners round the middle; pillars keep 0.8 m from it.
  const double reach_x = half_x - dice.uniform(1.8, 2.3), reach_y = half_y - dice.uniform(1.6, 2.0);
  const double sense = dice.sign(), bite = dice.uniform(0.25, 0.6);
  for (const auto &q :
       {std::pair{-0.2, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {0.1, 1.0}, {-0.3, bite}, {-1.0, bite}, {-1.0, -1.0}})
    loop.push_back({reach_x * q.first, sense * reach_y * q.second});
  const auto beside_loop = [&](Point p, double gap) {
    for (size_t i = 0; i < loop.size(); i++)
      if (distance_m(p, {loop[i], loop[(i + 1) % loop.size()]}) < gap) return false;
    return true;
  };
  Dice pillars(seed, Part::pillars);
  std::vector<Point> placed;
  for (int tries = 0, wanted = pillars.integer(4, 6); tries < 500 && static_cast<int>(placed.size()) < wanted;
       tries++) {
    const Point p{pillars.uniform(-half_x + 0.8, half_x - 0.8), pillars.uniform(-half_y + 0.8, half_y - 0.8)};
    const double size = pillars.uniform(0.3, 0.5), yaw = pillars.chance(0.7) ? 0 : pillars.uniform(0, kPi / 2);
    bool apart = beside_loop(p, 0.85);
    for (const Point &q : placed) apart = apart && std::fabs(p.x_m - q.x_m) + std::fabs(p.y_m - q.y_m) > 2.5;
    if (!apart) continue;
    placed.push_back(p);
    out.plan.add_body(turned_box(p, size, size * pillars.uniform(0.8, 1.2), yaw), 0, plan.ceiling_m, Surface::pillar,
                      true);
  }
  Dice shelves(seed, Part::shelves);
  for (int tries = 0, made = 0, wanted = shelves.integer(3, 5); tries < 300 && made < wanted; tries++) {
    const bool along_x = shelves.chance(0.5);
    const double width = shelves.uniform(1, 1.8), deep = shelves.uniform(0.35, 0.5), side = shelves.sign();
    const Point p = along_x ? Point{shelves.uniform(-half_x + 1.2, half_x - 1.2), side * (half_y - 0.5 * deep - 0.01)}
                            : Point{side * (half_x - 0.5 * deep - 0.01), shelves.uniform(-half_y + 1.2, half_y - 1.2)};
    const std::vector<Point> box = turned_box(p, along_x ? width : deep, along_x ? deep : width, 0);
    bool fits = beside_loop(p, 1.2);
    for (const Point &q : placed) fits = fits && std::fabs(p.x_m - q.x_m) + std::fabs(p.y_m - q.y_m) > 2.2;
    if (!fits) continue;
    placed.push_back(p);
    out.plan.add_body(box, 0, shelves.uniform(1.9, 2.6), Surface::shelf, true);
    made++;
  }
  return hall_loops(loop, out.route, err);
}

}  // namespace wm::sim
