// SPDX-License-Identifier: Apache-2.0
#include "map/connections.h"

#include <cmath>

#include "common/text.h"
#include "waymark/local_frame.h"

namespace wm::tools {
namespace {

// Ends are measured by hand, or by a robot that stands there: half a metre and 10 degrees are no such error.
constexpr double kMeet_m = 0.5, kMeet_deg = 10;
constexpr double kScale = 0.02;      // of the way between two connections on the two floors
constexpr double kOriginMeet_m = 3;  // origins are measured by any receiver, or on a map of the web
constexpr double kDegree = 3.14159265358979323846 / 180;

Eigen::Vector2d place(const wm_connection_end &end) { return {end.x_m, end.y_m}; }

std::string name_of(const wm_floors &site, const wm_connection &c) {
  return text("%s:%d: %s '%s'", site.yaml, c.line, kind_name(c.kind), c.name);
}

// Of two connections between the same two floors; "" where they fit.
std::string contradiction(const wm_floors &site, const wm_connection &one, const wm_connection &other, int a, int b) {
  const wm_connection_end &one_a = *end_on(one, a), &one_b = *end_on(one, b), &other_a = *end_on(other, a),
                          &other_b = *end_on(other, b);
  const double way_a = (place(one_a) - place(other_a)).norm(), way_b = (place(one_b) - place(other_b)).norm();
  if (std::abs(way_a - way_b) > kMeet_m + kScale * std::max(way_a, way_b))
    return name_of(site, other) + text(
                                      ": is %.2f m from '%s' on floor '%s', but %.2f m on floor '%s': one of the two "
                                      "maps has a wrong scale (`resolution`), or an end a wrong place",
                                      way_a, one.name, site.floors[a].name, way_b, site.floors[b].name);
  const double off_m = (carry(one_a, one_b, place(other_a)) - place(other_b)).norm();
  const double turn_deg =
      std::remainder((other_b.heading_rad - other_a.heading_rad) - (one_b.heading_rad - one_a.heading_rad),
                     2 * 180 * kDegree) /
      kDegree;
  if (off_m <= kMeet_m + kScale * way_a && std::abs(turn_deg) <= kMeet_deg) return "";
  return name_of(site, other) + text(
                                    ": does not meet: by '%s' its end on floor '%s' is %.2f m and %.0f degrees off; "
                                    "correct x_m, y_m or heading_deg of one of the two",
                                    one.name, site.floors[b].name, off_m, std::abs(turn_deg));
}

// The floors' axes are east and north of their origins: an end is the same place of the world on both.
std::string against_origins(const wm_floors &site, const wm_connection &c, int a, int b) {
  const wm_floor &from = site.floors[a], &to = site.floors[b];
  if (!std::isfinite(from.origin[0]) || !std::isfinite(to.origin[0])) return "";
  double shift_m[3];
  local_frame(from.origin, to.origin, shift_m);
  const wm_connection_end &one = *end_on(c, a), &other = *end_on(c, b);
  const double off_m = (place(other) + Eigen::Vector2d(shift_m[0], shift_m[1]) - place(one)).norm();
  const double turn_deg = std::remainder(other.heading_rad - one.heading_rad, 2 * 180 * kDegree) / kDegree;
  if (off_m <= kOriginMeet_m && std::abs(turn_deg) <= kMeet_deg) return "";
  return name_of(site, c) + text(
                                ": by the origins of floors '%s' and '%s' its ends are %.2f m and %.0f degrees apart; "
                                "correct an `origin`, or give floors of other axes one of their own",
                                from.name, to.name, off_m, std::abs(turn_deg));
}

}  // namespace

const char *kind_name(wm_connection_kind kind) {
  return kind == WM_CONNECTION_LIFT ? "lift" : kind == WM_CONNECTION_RAMP ? "ramp" : "door";
}

const wm_connection_end *end_on(const wm_connection &connection, int floor) {
  for (int i = 0; i < connection.end_count; i++)
    if (connection.ends[i].floor == floor) return &connection.ends[i];
  return nullptr;
}

Eigen::Vector2d carry(const wm_connection_end &from, const wm_connection_end &to, const Eigen::Vector2d &place_m) {
  const double turn = to.heading_rad - from.heading_rad, c = std::cos(turn), s = std::sin(turn);
  const Eigen::Vector2d way = place_m - place(from);
  return place(to) + Eigen::Vector2d(c * way.x() - s * way.y(), s * way.x() + c * way.y());
}

std::vector<std::string> connections_that_do_not_meet(const wm_floors &site) {
  std::vector<std::string> out;
  const auto note = [&](std::string line) {
    if (!line.empty()) out.push_back(std::move(line));
  };
  for (int a = 0; a < site.floor_count; a++)
    for (int b = a + 1; b < site.floor_count; b++) {
      const wm_connection *first = nullptr;
      for (int i = 0; i < site.connection_count; i++) {
        const wm_connection &c = site.connections[i];
        if (end_on(c, a) == nullptr || end_on(c, b) == nullptr) continue;
        note(against_origins(site, c, a, b));
        if (first != nullptr) note(contradiction(site, *first, c, a, b));
        if (first == nullptr) first = &c;
      }
    }
  return out;
}

}  // namespace wm::tools
