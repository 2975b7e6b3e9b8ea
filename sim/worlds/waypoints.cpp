// SPDX-License-Identifier: Apache-2.0
#include "worlds/waypoints.h"

#include <algorithm>
#include <cmath>

#include "simulate/route.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

struct Heading {
  double length_m, travel_rad;
};

Heading between(Point a, Point b) {
  const double dx = b.x_m - a.x_m, dy = b.y_m - a.y_m;
  return {std::sqrt(dx * dx + dy * dy), wm::atan2(dy, dx)};
}

// How far before its corner a turn begins (and behind it ends): both tangents of a symmetrical turn are equally long,
// and the turn's way across is tangent * sin(turn).
double tangent_m(double turn_rad, double radius_m, double ease_m) {
  Route route;
  Leg leg;
  leg.kind = Leg::Kind::turn;
  leg.turn_rad = std::fabs(turn_rad);
  leg.radius_m = radius_m;
  leg.ease_m = ease_m;
  leg.speed_mps = 1;
  route.legs = {leg};
  Drive drive;
  if (Drive::plan(route, drive, nullptr) != WM_OK) return 0;
  return drive.at(drive.duration_s()).y_m / wm::sin(leg.turn_rad);
}

}  // namespace

wm_status route_through(Point start, const std::vector<Waypoint> &points, const WaypointRules &rules, Route &out,
                        wm_error *err) {
  out = Route{};
  out.x_m = start.x_m;
  out.y_m = start.y_m;
  out.acceleration_mps2 = rules.acceleration_mps2;
  if (points.empty()) return wm_fail(err, WM_BAD_CONFIG, "route: at least one point is needed");
  const auto from = [&](size_t i) { return i == 0 ? start : points[i - 1].p; };
  const Heading first = between(start, points[0].p);
  out.heading_rad = wm::wrap(first.travel_rad + (points[0].reverse ? kPi : 0));
  Leg stand;
  stand.stand_s = rules.start_stand_s;
  if (stand.stand_s > 0) out.legs.push_back(stand);

  double used_m = 0;  // of this straight by the turn before it
  for (size_t i = 0; i < points.size(); i++) {
    const Waypoint &here = points[i];
    const Heading in = between(from(i), here.p);
    Leg turn;
    double tangent = 0;
    if (i + 1 < points.size()) {
      const double bend = wm::wrap(between(here.p, points[i + 1].p).travel_rad - in.travel_rad);
      if (points[i + 1].reverse != here.reverse) {
        if (std::fabs(std::fabs(bend) - kPi) > 1e-6)
          return wm_fail(
              err, WM_BAD_CONFIG,
              "route: point %zu: the gear changes in a corner of %.1f deg; it must change on a straight line", i + 1,
              bend * 180 / kPi);
      } else if (std::fabs(bend) > 1e-9) {
        if (std::fabs(bend) > 0.97 * kPi)
          return wm_fail(err, WM_BAD_CONFIG, "route: point %zu: turns back without a change of gear", i + 1);
        turn.kind = Leg::Kind::turn;
        turn.turn_rad = bend;
        turn.radius_m = here.radius_m;
        turn.ease_m = rules.ease_share * std::fabs(bend) * here.radius_m;
        turn.speed_mps = std::min(rules.turn_speed_mps, here.speed_mps);
        turn.reverse = here.reverse;
        tangent = tangent_m(bend, here.radius_m, turn.ease_m);
      }
    }
    Leg straight;
    straight.kind = Leg::Kind::straight;
    straight.length_m = in.length_m - used_m - tangent;
    straight.speed_mps = here.speed_mps;
    straight.reverse = here.reverse;
    if (straight.length_m < 0)
      return wm_fail(err, WM_BAD_CONFIG, "route: point %zu: its turn needs %.2f m more of the straight before it",
                     i + 1, -straight.length_m);
    if (straight.length_m > 1e-9) out.legs.push_back(straight);
    if (turn.kind == Leg::Kind::turn) out.legs.push_back(turn);
    used_m = tangent;
    if (here.stand_s > 0) {
      stand.stand_s = here.stand_s;
      out.legs.push_back(stand);
    }
  }
  return WM_OK;
}

}  // namespace wm::sim
