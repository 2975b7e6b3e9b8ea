// SPDX-License-Identifier: Apache-2.0
#include "simulate/scenario.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <set>

#include "simulate/scenario_reader.h"
#include "worlds/waypoints.h"

namespace wm::sim {
namespace {

void read_landmarks(Reader &r, const wm_yaml_node &list, Scenario &out) {
  static const char *const known[] = {"id", "what", "xyz_m", "yaw_deg", "sigma_m", nullptr};
  std::set<int32_t> ids;
  for (size_t i = 0, n = r.list(list); i < n && r.ok(); i++) {
    const wm_yaml_node item = wm_yaml_item(&list, i);
    r.keys(item, known);
    wm_landmark landmark{};
    landmark.yaw_rad = NAN;
    int64_t id = 0;
    r.integer(item, "id", 0, INT32_MAX, id, true);
    r.numbers(item, "xyz_m", 3, 3, landmark.p_m, true);
    r.number(item, "yaw_deg", -360, 360, kDeg, landmark.yaw_rad);
    r.number(item, "sigma_m", 0, 10, 1, landmark.sigma_m);
    landmark.id = static_cast<int32_t>(id);
    if (r.ok() && !ids.insert(landmark.id).second)
      r.fail(item, "this id is there already; each landmark needs its own");
    out.landmarks.push_back(landmark);
  }
}

void read_world(Reader &r, const wm_yaml_node &world, Scenario &out) {
  static const char *const known[] = {"landmarks", "kind",      "variant",      "markers_on_walls", "scatter", "map",
                                      "plan",      "ceiling_m", "resolution_m", "markers",          "rounds",  "tag_m",
                                      "seed",      nullptr};
  static const char *const maps[] = {"all", "listed", "none", nullptr};
  static const char *const kinds[] = {"features", "crossing", "corridor", "office", "hall", "seabed", nullptr};
  static const char *const variants[] = {"easy", "hard", nullptr};
  r.keys(world, known);
  int kind = 0, variant = 0;
  r.word(world, "kind", kinds, kind);
  r.word(world, "variant", variants, variant);
  r.flag(world, "markers_on_walls", out.world.markers_on_walls);
  static const char *const markers[] = {"tag36h11", "mr", "both", nullptr};
  int family = 0;
  r.word(world, "markers", markers, family);
  out.world.markers = static_cast<Markers>(family);
  out.world.hard = variant == 1;
  if (kind > 0) out.world.kind = kinds[kind];
  int64_t seed = 0;
  r.integer(world, "seed", 0, INT64_MAX, seed);
  out.world.seed = static_cast<uint64_t>(seed);
  r.number(world, "rounds", 0.1, 20, 1, out.world.rounds);
  if (const wm_yaml_node rounds = r.child(world, "rounds", false);
      r.ok() && out.world.kind != "seabed" && wm_yaml_there(&rounds))
    return r.fail(rounds, "only seabed has rounds");
  r.text(world, "plan", out.world.plan);
  r.number(world, "ceiling_m", 0.5, 50, 1, out.world.ceiling_m);
  r.number(world, "resolution_m", 1e-4, 10, 1, out.world.resolution_m);
  const bool building = out.world.kind == "corridor" || out.world.kind == "office" || out.world.kind == "hall";
  if (r.ok() && !out.world.plan.empty() && !building)
    return r.fail(r.child(world, "plan", false), "only corridor, office and hall have a plan");
  if (!out.world.plan.empty() && out.world.plan[0] != '/') {
    const std::string file = wm_yaml_file(&world);
    out.world.plan = file.substr(0, file.find_last_of('/') + 1) + out.world.plan;
  }
  const wm_yaml_node list = r.child(world, "landmarks", false), tag = r.child(world, "tag_m", false);
  const bool own_plan = out.world.kind == "corridor" && !out.world.plan.empty();
  if (r.ok() && kind > 0 && !own_plan && wm_yaml_there(&list))
    return r.fail(list, "a world of this kind has its own landmarks; leave the key out, or give a corridor a `plan`");
  if (r.ok() && !own_plan && wm_yaml_there(&tag)) return r.fail(tag, "only a corridor with a `plan` has such tags");
  r.number(world, "tag_m", 0.01, 2, 1, out.world.tag_m);
  read_landmarks(r, list, out);
  const wm_yaml_node scatter = r.child(world, "scatter", false), map = r.child(world, "map", false);
  if (r.ok() && kind > 0 && wm_yaml_there(&scatter))
    return r.fail(scatter, "a world of this kind has its own landmarks; leave the key out");
  if (r.ok() && kind > 0 && wm_yaml_there(&map))
    return r.fail(map, "a world of this kind has its own map; leave the key out");
  read_scatter(r, scatter, out);
  int mapped = 0;
  r.word(world, "map", maps, mapped);
  out.mapped = static_cast<Mapped>(mapped);
}

void read_actuators(Reader &r, const wm_yaml_node &map, Robot &out) {
  static const char *const known[] = {"control_hz",
                                      "publish_hz",
                                      "speed_step_mps",
                                      "turn_step_radps",
                                      "dead_ms",
                                      "dead_jitter_ms",
                                      "response_ms",
                                      "acceleration_mps2",
                                      "turn_acceleration_radps2",
                                      "friction_mps",
                                      "speed_scale",
                                      "turn_scale",
                                      nullptr};
  if (!r.ok() || !wm_yaml_there(&map)) return;
  r.keys(map, known);
  if (r.ok() && !out.differential)
    return r.fail(map, "`commands` is for a robot with two driven wheels; leave wheelbase_m and steering_table out");
  Actuators &a = out.actuators;
  out.commanded = true;
  r.number(map, "control_hz", 1, 1000, 1, a.control_hz);
  r.number(map, "publish_hz", 1, 1000, 1, a.publish_hz);
  r.number(map, "speed_step_mps", 0, 1, 1, a.speed_step_mps);
  r.number(map, "turn_step_radps", 0, 1, 1, a.turn_step_radps);
  r.number(map, "dead_ms", 0, 2000, kMilli, a.dead_s);
  r.number(map, "dead_jitter_ms", 0, 2000, kMilli, a.dead_jitter_s);
  r.number(map, "response_ms", 0, 5000, kMilli, a.response_s);
  r.number(map, "acceleration_mps2", 0, 100, 1, a.acceleration_mps2);
  r.number(map, "turn_acceleration_radps2", 0, 1000, 1, a.turn_acceleration_radps2);
  r.number(map, "friction_mps", 0, 10, 1, a.friction_mps);
  r.number(map, "speed_scale", 0.1, 10, 1, a.speed_scale);
  r.number(map, "turn_scale", 0.1, 10, 1, a.turn_scale);
}

// How far the robot's body reaches from base_link.
void read_body(Reader &r, const wm_yaml_node &map, Robot &out) {
  static const char *const known[] = {"front_m", "back_m", "width_m", nullptr};
  if (!r.ok() || !wm_yaml_there(&map)) return;
  r.keys(map, known);
  double front_m = 0, back_m = 0, width_m = 0;
  r.number(map, "front_m", 0, 10, 1, front_m, true);
  r.number(map, "back_m", 0, 10, 1, back_m, true);
  r.number(map, "width_m", 0.05, 10, 1, width_m, true);
  if (r.ok()) out.body = Footprint{front_m, -back_m, 0.5 * width_m};
}

void read_robot(Reader &r, const wm_yaml_node &map, bool steered, Robot &out) {
  static const char *const known[] = {"wheel_radius_m", "ticks_per_turn", "track_m", "wheelbase_m", "steering_table",
                                      "wheels_send",    "commands",       "body",    nullptr};
  static const char *const sends[] = {"ticks", "speeds", nullptr};
  r.keys(map, known);
  const wm_yaml_node table = r.child(map, "steering_table", false);
  wm_wheels &w = out.wheels;
  w.steering_ratio = NAN;
  w.encoder_offset_m = 0;
  w.wheelbase_m = 1;
  r.number(map, "wheel_radius_m", 0.01, 2, 1, w.radius_m, true);
  r.number(map, "ticks_per_turn", 1, 1e6, 1, w.ticks_per_turn, true);
  r.number(map, "track_m", 0.05, 5, 1, w.track_m, true);
  const wm_yaml_node wheelbase = r.child(map, "wheelbase_m", false);
  steered = steered || (r.ok() && wm_yaml_there(&wheelbase)) || wm_yaml_there(&table);
  out.differential = !steered;
  r.number(map, "wheelbase_m", 0.05, 10, 1, w.wheelbase_m, steered);

  int speeds = 0;
  r.word(map, "wheels_send", sends, speeds);
  out.sends_speeds = speeds == 1;
  read_actuators(r, r.child(map, "commands", false), out);
  read_body(r, r.child(map, "body", false), out);

  static const char *const known_table[] = {"actuator_mm", "road_wheel_deg", nullptr};
  if (!r.ok() || !wm_yaml_there(&table)) return;
  r.keys(table, known_table);
  const size_t n = r.numbers(table, "actuator_mm", 2, WM_STEERING_TABLE_MAX, w.actuator_m, true);
  const size_t m = r.numbers(table, "road_wheel_deg", 2, WM_STEERING_TABLE_MAX, w.road_wheel_rad, true);
  if (r.ok() && n != m) r.fail(table, "actuator_mm and road_wheel_deg must have the same number of values");
  for (size_t i = 0; i < n && r.ok(); i++) {
    w.actuator_m[i] *= kMilli;
    w.road_wheel_rad[i] *= kDeg;
    if (i > 0 && (w.actuator_m[i] <= w.actuator_m[i - 1] || w.road_wheel_rad[i] <= w.road_wheel_rad[i - 1]))
      r.fail(table, "both columns must rise from each value to the next");
  }
  w.steering_table_count = static_cast<uint32_t>(n);
}

void read_camera(Reader &r, const wm_yaml_node &map, Camera &out) {
  static const char *const known[] = {"name",
                                      "xyz_m",
                                      "yaw_deg",
                                      "field_of_view_deg",
                                      "range_m",
                                      "rate_hz",
                                      "phase_ms",
                                      "bearing_sigma_deg",
                                      "outlier_percent",
                                      "latency_ms",
                                      "latency_jitter_ms",
                                      nullptr};
  r.keys(map, known);
  r.text(map, "name", out.name, true);
  r.numbers(map, "xyz_m", 3, 3, out.xyz_m, true);
  r.number(map, "yaw_deg", -180, 180, kDeg, out.yaw_rad, true);
  r.number(map, "field_of_view_deg", 1, 360, kDeg, out.field_of_view_rad, true);
  r.number(map, "range_m", 0.1, kFar_m, 1, out.range_m, true);
  r.number(map, "rate_hz", 0.1, 1000, 1, out.rate_hz, true);
  r.number(map, "phase_ms", 0, 1e5, kMilli, out.phase_s);
  r.number(map, "bearing_sigma_deg", 0, 45, kDeg, out.bearing_sigma_rad, true);
  r.number(map, "outlier_percent", 0, 100, kPercent, out.outlier_fraction);
  r.number(map, "latency_ms", 0, 1e4, kMilli, out.latency_s);
  r.number(map, "latency_jitter_ms", 0, 1e4, kMilli, out.latency_jitter_s);
  if (!r.ok()) return;
  if (out.name.empty() || out.name.size() >= WM_NAME_MAX || out.name.find_first_of(", \t\n:") != std::string::npos)
    r.fail(map, "name: 1 to 31 letters without blanks, commas or colons");
}

void read_leg(Reader &r, const wm_yaml_node &map, Leg &out) {
  static const char *const known[] = {"stand_s", "straight_m", "turn_deg",  "radius_m",
                                      "ease_m",  "speed_mps",  "backwards", nullptr};
  r.keys(map, known);
  const wm_yaml_node stand = r.child(map, "stand_s", false), straight = r.child(map, "straight_m", false),
                     turn = r.child(map, "turn_deg", false);
  if (!r.ok()) return;
  const int kinds = wm_yaml_there(&stand) + wm_yaml_there(&straight) + wm_yaml_there(&turn);
  if (kinds != 1)
    return r.fail(map,
                  "a leg is one of stand_s, straight_m (with speed_mps) and turn_deg (with radius_m, "
                  "ease_m, speed_mps)");
  r.number(map, "stand_s", 0.01, 1e5, 1, out.stand_s);
  if (wm_yaml_there(&stand)) return;
  out.kind = wm_yaml_there(&straight) ? Leg::Kind::straight : Leg::Kind::turn;
  const bool turns = out.kind == Leg::Kind::turn;
  r.number(map, "straight_m", 0.01, kFar_m, 1, out.length_m);
  r.number(map, "turn_deg", -3600, 3600, kDeg, out.turn_rad);
  r.number(map, "radius_m", 0.1, kFar_m, 1, out.radius_m, turns);
  r.number(map, "ease_m", 0, kFar_m, 1, out.ease_m, turns);
  r.number(map, "speed_mps", 0.01, 100, 1, out.speed_mps, true);
  const wm_yaml_node backwards = r.child(map, "backwards", false);
  int flag = 0;
  if (r.ok() && wm_yaml_there(&backwards)) r.take(wm_yaml_bool(&backwards, &flag, r.error()));
  if (!r.ok()) return;
  out.reverse = flag != 0;
  if (turns && out.turn_rad == 0) r.fail(map, "turn_deg is 0; for a straight leg use straight_m");
}

// A route through points: straight lines, cut at the corners by turns.
void read_way(Reader &r, const wm_yaml_node &map, Route &out) {
  static const char *const known_start[] = {"x_m", "y_m", nullptr};
  static const char *const known[] = {"xy_m", "speed_mps", "radius_m", "stand_s", "backwards", nullptr};
  const wm_yaml_node start = r.child(map, "start", true), points = r.child(map, "points", true),
                     legs = r.child(map, "legs", false);
  if (r.ok() && wm_yaml_there(&legs)) return r.fail(legs, "`points` are there already; one of both");
  r.keys(start, known_start);
  Point from;
  WaypointRules rules;
  Waypoint usual;
  usual.speed_mps = 0.6;
  usual.radius_m = 0.8;
  int64_t laps = 1;
  r.number(start, "x_m", -kFar_m, kFar_m, 1, from.x_m, true);
  r.number(start, "y_m", -kFar_m, kFar_m, 1, from.y_m, true);
  r.integer(map, "laps", 1, 1000, laps);
  r.number(map, "acceleration_mps2", 0.01, 20, 1, rules.acceleration_mps2);
  r.number(map, "stand_s", 0, 1e5, 1, rules.start_stand_s);
  r.number(map, "speed_mps", 0.01, 100, 1, usual.speed_mps);
  r.number(map, "radius_m", 0.1, kFar_m, 1, usual.radius_m);
  rules.turn_speed_mps = 0.7 * usual.speed_mps;
  r.number(map, "turn_speed_mps", 0.01, 100, 1, rules.turn_speed_mps);
  std::vector<Waypoint> way;
  for (size_t i = 0, n = r.list(points); i < n && r.ok(); i++) {
    const wm_yaml_node item = wm_yaml_item(&points, i);
    Waypoint w = usual;
    double xy[2] = {0, 0};
    if (wm_yaml_is_list(&item)) {
      r.take(wm_yaml_f64_list(&item, 2, 2, xy, nullptr, r.error()));
    } else {
      r.keys(item, known);
      r.numbers(item, "xy_m", 2, 2, xy, true);
      r.number(item, "speed_mps", 0.01, 100, 1, w.speed_mps);
      r.number(item, "radius_m", 0.1, kFar_m, 1, w.radius_m);
      r.number(item, "stand_s", 0, 1e5, 1, w.stand_s);
      r.flag(item, "backwards", w.reverse);
    }
    w.p = {xy[0], xy[1]};
    way.push_back(w);
  }
  if (!r.ok()) return;
  wm_error why{};
  if (route_through(from, way, rules, out, &why) != WM_OK) return r.fail(points, why.text);
  out.laps = static_cast<int>(laps);
}

void read_route(Reader &r, const wm_yaml_node &map, Route &out) {
  static const char *const known[] = {"start",     "acceleration_mps2", "laps",     "legs",    "points",
                                      "speed_mps", "turn_speed_mps",    "radius_m", "stand_s", nullptr};
  static const char *const known_start[] = {"x_m", "y_m", "heading_deg", nullptr};
  r.keys(map, known);
  const wm_yaml_node start = r.child(map, "start", true), points = r.child(map, "points", false);
  if (r.ok() && wm_yaml_there(&points)) return read_way(r, map, out);
  for (const char *key : {"speed_mps", "turn_speed_mps", "radius_m", "stand_s"})
    if (const wm_yaml_node node = r.child(map, key, false); r.ok() && wm_yaml_there(&node))
      return r.fail(node, "belongs to `points`; each of the `legs` has its own");
  const wm_yaml_node legs = r.child(map, "legs", true);
  r.keys(start, known_start);
  r.number(start, "x_m", -kFar_m, kFar_m, 1, out.x_m, true);
  r.number(start, "y_m", -kFar_m, kFar_m, 1, out.y_m, true);
  r.number(start, "heading_deg", -360, 360, kDeg, out.heading_rad, true);
  r.number(map, "acceleration_mps2", 0.01, 20, 1, out.acceleration_mps2);
  int64_t laps = 1;
  r.integer(map, "laps", 1, 1000, laps);
  out.laps = static_cast<int>(laps);
  for (size_t i = 0, n = r.list(legs); i < n && r.ok(); i++) {
    Leg leg;
    read_leg(r, wm_yaml_item(&legs, i), leg);
    out.legs.push_back(leg);
  }
  if (r.ok() && out.legs.empty()) r.fail(legs, "a route needs at least one leg");
}

void read_bus(Reader &r, const wm_yaml_node &map, Bus &out) {
  static const char *const known[] = {"wheels_hz", "yaw_rate_hz", "steering_hz", "gear_hz", "stamp_jitter_ms", nullptr};
  if (!r.ok() || !wm_yaml_there(&map)) return;
  r.keys(map, known);
  r.number(map, "wheels_hz", 1, 1000, 1, out.wheels_hz);
  r.number(map, "yaw_rate_hz", 0, 1000, 1, out.yaw_rate_hz);
  r.number(map, "steering_hz", 0, 1000, 1, out.steering_hz);
  r.number(map, "gear_hz", 0, 1000, 1, out.gear_hz);
  r.number(map, "stamp_jitter_ms", 0, 100, kMilli, out.stamp_jitter_s);
}

void read_errors(Reader &r, const wm_yaml_node &map, Errors &out) {
  static const char *const known[] = {"wheel_radius_percent",
                                      "track_percent",
                                      "yaw_rate_bias_mradps",
                                      "yaw_rate_bias_walk_mradps_per_sqrt_min",
                                      "yaw_rate_noise_mradps",
                                      "steering_offset_deg",
                                      "landmark_m",
                                      "camera_yaw_deg",
                                      "start_xy_m",
                                      "start_heading_deg",
                                      "slip_percent",
                                      "camera_mounting_deg",
                                      "camera_mounting_mm",
                                      "camera_intrinsics_percent",
                                      "frame_stamp_jitter_ms",
                                      "speed_percent",
                                      "speed_noise_mps",
                                      "start_within_m",
                                      "compass_deg",
                                      "tilt_deg",
                                      "side_percent",
                                      "turn_percent",
                                      "rotation_center_m",
                                      "wheel_noise_mm_per_sqrt_m",
                                      nullptr};
  if (!r.ok() || !wm_yaml_there(&map)) return;
  r.keys(map, known);
  r.number(map, "wheel_radius_percent", 0, 20, kPercent, out.wheel_radius);
  r.number(map, "track_percent", 0, 20, kPercent, out.track);
  r.number(map, "yaw_rate_bias_mradps", 0, 1000, kMilli, out.yaw_rate_bias_radps);
  r.number(map, "yaw_rate_bias_walk_mradps_per_sqrt_min", 0, 1000, kMilli / std::sqrt(60.0), out.yaw_rate_bias_walk);
  r.number(map, "yaw_rate_noise_mradps", 0, 1000, kMilli, out.yaw_rate_noise_radps);
  r.number(map, "steering_offset_deg", 0, 20, kDeg, out.steering_offset_rad);
  r.number(map, "landmark_m", 0, 10, 1, out.landmark_m);
  r.number(map, "camera_yaw_deg", 0, 45, kDeg, out.camera_yaw_rad);
  r.number(map, "tilt_deg", 0, 20, kDeg, out.tilt_rad);
  r.number(map, "start_xy_m", 0, 10, 1, out.start_xy_m);
  r.number(map, "start_heading_deg", 0, 180, kDeg, out.start_heading_rad);
  r.number(map, "start_within_m", 0, 1000, 1, out.start_within_m);
  r.number(map, "compass_deg", 0, 180, kDeg, out.compass_rad);
  r.number(map, "slip_percent", 0, 20, kPercent, out.slip);
  r.number(map, "camera_mounting_deg", 0, 45, kDeg, out.camera_mounting_rad);
  r.number(map, "camera_mounting_mm", 0, 1000, kMilli, out.camera_mounting_m);
  r.number(map, "camera_intrinsics_percent", 0, 10, kPercent, out.camera_intrinsics);
  r.number(map, "frame_stamp_jitter_ms", 0, 100, kMilli, out.frame_stamp_jitter_s);
  r.number(map, "speed_percent", 0, 20, kPercent, out.speed);
  r.number(map, "speed_noise_mps", 0, 10, 1, out.speed_noise_mps);
  r.number(map, "side_percent", 0, 50, kPercent, out.side);
  r.number(map, "turn_percent", 0, 50, kPercent, out.turn);
  r.number(map, "rotation_center_m", 0, 10, 1, out.rotation_center_m);
  r.number(map, "wheel_noise_mm_per_sqrt_m", 0, 1000, kMilli, out.wheel_noise_sqrtm);
}

void read_span(Reader &r, const wm_yaml_node &node, const char *const *known, Span &out) {
  r.keys(node, known);
  r.number(node, "from_s", 0, 1e9, 1, out.from_s, true);
  r.number(node, "to_s", 0, 1e9, 1, out.to_s, true);
  if (r.ok() && out.to_s <= out.from_s) r.fail(node, "to_s must be after from_s");
}

// The map under `key`, with the stretch of time that it must give.
wm_yaml_node read_span(Reader &r, const wm_yaml_node &map, const char *key, const char *const *known, Span &out) {
  const wm_yaml_node node = r.child(map, key, false);
  if (r.ok() && wm_yaml_there(&node)) read_span(r, node, known, out);
  return node;
}

// One map, or a list of them.
void read_slips(Reader &r, const wm_yaml_node &map, std::vector<Slip> &out) {
  static const char *const known[] = {"from_s", "to_s", "wheel", "percent", "added_mps", nullptr};
  static const char *const wheels[] = {"left", "right", "both", nullptr};
  const wm_yaml_node node = r.child(map, "wheel_slip", false);
  if (!r.ok() || !wm_yaml_there(&node)) return;
  const bool is_list = wm_yaml_is_list(&node) != 0;
  for (size_t i = 0, n = is_list ? r.list(node) : 1; i < n && r.ok(); i++) {
    const wm_yaml_node item = is_list ? wm_yaml_item(&node, i) : node;
    Slip slip;
    read_span(r, item, known, slip);
    r.word(item, "wheel", wheels, slip.wheel, true);
    r.number(item, "percent", -100, 1000, kPercent, slip.share);
    r.number(item, "added_mps", -10, 10, 1, slip.added_mps);
    if (r.ok() && slip.share == 0 && slip.added_mps == 0) r.fail(item, "give percent, added_mps or both");
    out.push_back(slip);
  }
}

void read_stuck(Reader &r, const wm_yaml_node &map, const char *key, Stuck &out) {
  static const char *const known[] = {"from_s", "to_s", "axis", nullptr};
  static const char *const axes[] = {"x", "y", "z", nullptr};
  const wm_yaml_node node = read_span(r, map, key, known, out);
  if (r.ok() && wm_yaml_there(&node)) r.word(node, "axis", axes, out.axis);
}

void read_faults(Reader &r, const wm_yaml_node &map, Faults &out) {
  static const char *const known[] = {"can_lost_percent",
                                      "can_duplicated_percent",
                                      "can_reordered_percent",
                                      "can_late_percent",
                                      "can_late_ms",
                                      "sightings_lost_percent",
                                      "sightings_duplicated_percent",
                                      "sightings_misread_percent",
                                      "sightings_false_percent",
                                      "landmarks_moved",
                                      "frames_late_percent",
                                      "frames_late_ms",
                                      "camera_clock_offset_ms",
                                      "dead_encoder",
                                      "start_offset",
                                      "frames_lost_percent",
                                      "frames_duplicated_percent",
                                      "frames_reordered_percent",
                                      "camera_clock_drift_ppm",
                                      "camera_dropout",
                                      "frozen_picture",
                                      "lights_off",
                                      "wheel_slip",
                                      "kidnap",
                                      "gyro_stuck",
                                      "accelerometer_stuck",
                                      nullptr};
  static const char *const known_dead[] = {"wheel", "from_s", nullptr};
  static const char *const known_start[] = {"x_m", "y_m", "heading_deg", nullptr};
  static const char *const wheels[] = {"left", "right", nullptr};
  if (!r.ok() || !wm_yaml_there(&map)) return;
  r.keys(map, known);
  r.number(map, "can_lost_percent", 0, 100, kPercent, out.can_lost);
  r.number(map, "can_duplicated_percent", 0, 100, kPercent, out.can_duplicated);
  r.number(map, "can_reordered_percent", 0, 100, kPercent, out.can_reordered);
  r.number(map, "can_late_percent", 0, 100, kPercent, out.can_late);
  r.number(map, "can_late_ms", 0, 1e5, kMilli, out.can_late_s);
  r.number(map, "sightings_lost_percent", 0, 100, kPercent, out.sightings_lost);
  r.number(map, "sightings_duplicated_percent", 0, 100, kPercent, out.sightings_duplicated);
  r.number(map, "sightings_misread_percent", 0, 100, kPercent, out.sightings_misread);
  r.number(map, "sightings_false_percent", 0, 90, kPercent, out.sightings_false);
  static const char *const known_moved[] = {"count", "by_m", nullptr};
  const wm_yaml_node moved = r.child(map, "landmarks_moved", false);
  if (r.ok() && wm_yaml_there(&moved)) {
    r.keys(moved, known_moved);
    r.integer(moved, "count", 1, 1000, out.landmarks_moved, true);
    r.number(moved, "by_m", 0.01, 1000, 1, out.landmarks_moved_m, true);
  }
  r.number(map, "frames_late_percent", 0, 100, kPercent, out.frames_late);
  r.number(map, "frames_late_ms", 0, 1e5, kMilli, out.frames_late_s);
  r.number(map, "camera_clock_offset_ms", -1e4, 1e4, kMilli, out.camera_clock_offset_s);

  r.number(map, "frames_lost_percent", 0, 100, kPercent, out.frames_lost);
  r.number(map, "frames_duplicated_percent", 0, 100, kPercent, out.frames_duplicated);
  r.number(map, "frames_reordered_percent", 0, 100, kPercent, out.frames_reordered);
  r.number(map, "camera_clock_drift_ppm", -1e5, 1e5, 1e-6, out.camera_clock_drift);
  static const char *const known_span[] = {"from_s", "to_s", nullptr};
  static const char *const known_lights[] = {"from_s", "to_s", "left_percent", nullptr};
  static const char *const known_kidnap[] = {"at_s", "forward_s", nullptr};
  read_span(r, map, "camera_dropout", known_span, out.camera_dropout);
  read_span(r, map, "frozen_picture", known_span, out.frozen_picture);
  read_stuck(r, map, "gyro_stuck", out.gyro_stuck);
  read_stuck(r, map, "accelerometer_stuck", out.accelerometer_stuck);
  const wm_yaml_node lights = read_span(r, map, "lights_off", known_lights, out.lights_off);
  if (r.ok() && wm_yaml_there(&lights)) r.number(lights, "left_percent", 0, 100, kPercent, out.lights_left);
  read_slips(r, map, out.wheel_slip);
  const wm_yaml_node kidnap = r.child(map, "kidnap", false);
  if (r.ok() && wm_yaml_there(&kidnap)) {
    r.keys(kidnap, known_kidnap);
    r.number(kidnap, "at_s", 0, 1e9, 1, out.kidnap_at_s, true);
    r.number(kidnap, "forward_s", 0.1, 1e9, 1, out.kidnap_forward_s, true);
  }

  const wm_yaml_node dead = r.child(map, "dead_encoder", false);
  if (r.ok() && wm_yaml_there(&dead)) {
    r.keys(dead, known_dead);
    const wm_yaml_node wheel = r.child(dead, "wheel", true);
    int32_t side = -1;
    if (r.ok()) r.take(wm_yaml_choice(&wheel, wheels, &side, r.error()));
    out.dead_encoder = side;
    r.number(dead, "from_s", 0, 1e6, 1, out.dead_encoder_from_s, true);
  }
  const wm_yaml_node start = r.child(map, "start_offset", false);
  if (r.ok() && wm_yaml_there(&start)) {
    r.keys(start, known_start);
    r.number(start, "x_m", -kFar_m, kFar_m, 1, out.start_x_m);
    r.number(start, "y_m", -kFar_m, kFar_m, 1, out.start_y_m);
    r.number(start, "heading_deg", -360, 360, kDeg, out.start_heading_rad);
  }
}

void read_scenario(Reader &r, const wm_yaml_node &root, Scenario &out) {
  static const char *const known[] = {"format", "name",     "about",   "seed",   "clock_start_s", "world",
                                      "robot",  "cameras",  "route",   "path",   "bus",           "errors",
                                      "faults", "pictures", "sensors", "motion", nullptr};
  r.keys(root, known);
  std::string format;
  r.text(root, "format", format, true);
  if (r.ok() && format != "waymark-scenario/1")
    r.fail(wm_yaml_get(&root, "format"), ("is '" + format + "'; this program reads waymark-scenario/1").c_str());
  r.text(root, "name", out.name, true);
  r.text(root, "about", out.about);
  int64_t seed = 1;
  r.integer(root, "seed", 0, INT64_MAX, seed);
  out.seed = static_cast<uint64_t>(seed);
  r.number(root, "clock_start_s", 0, 1e9, 1, out.clock_start_s);
  read_world(r, r.child(root, "world", true), out);
  const bool pictured = out.world.pictured();
  const wm_yaml_node path = r.child(root, "path", false);
  if (r.ok() && pictured && wm_yaml_there(&path))
    r.fail(path, "a world of this kind has its own route; leave the key out");
  read_path(r, path, out);
  const bool six = out.world.kind == "seabed" || out.swims();
  const wm_yaml_node robot = r.child(root, "robot", !six), cameras = r.child(root, "cameras", false),
                     route = r.child(root, "route", !pictured && !six), pictures = r.child(root, "pictures", false);
  if (r.ok() && six && wm_yaml_there(&robot)) r.fail(robot, "this vehicle has no wheels; leave the key out");
  if (r.ok() && six && wm_yaml_there(&route))
    r.fail(route, "an underwater vehicle moves along `path`; leave `route` out");
  if (r.ok() && out.swims() && wm_yaml_there(&cameras))
    r.fail(cameras, "this vehicle has a sensor of kind stereo in place of `cameras`; leave the key out");
  if (r.ok() && !pictured && wm_yaml_there(&pictures))
    r.fail(pictures, "there are pictures only in a world that has a `kind`");
  const bool steered = out.world.kind == "crossing" || (out.world.kind == "corridor" && out.world.plan.empty());
  if (!six) read_robot(r, robot, steered, out.robot);
  read_motion(r, r.child(root, "motion", false), out);
  if (pictured)
    read_pixel_cameras(r, cameras, out);
  else
    read_named(r, cameras, read_camera, out.cameras);
  read_sensors(r, r.child(root, "sensors", false), out);
  if (r.ok() && wm_yaml_there(&route)) read_route(r, route, out.route);
  if (r.ok() && !out.world.plan.empty() && out.route.legs.empty())
    r.fail(r.child(root, "world", true), "a world with a `plan` needs a `route` through it");
  read_pictures(r, pictures, out.pictures);
  read_bus(r, r.child(root, "bus", false), out.bus);
  read_errors(r, r.child(root, "errors", false), out.errors);
  read_faults(r, r.child(root, "faults", false), out.faults);
}

wm_status read_document(wm_status loaded, wm_yaml *doc, Scenario &out, wm_error *err) {
  if (loaded != WM_OK) return loaded;
  out = Scenario{};
  Reader reader(err);
  read_scenario(reader, wm_yaml_root(doc), out);
  wm_yaml_free(doc);
  return reader.status();
}

}  // namespace

wm_status load_scenario(const std::string &path, Scenario &out, wm_error *err) {
  wm_yaml *doc = nullptr;
  const wm_status loaded = wm_yaml_load(path.c_str(), &doc, err);
  return read_document(loaded, doc, out, err);
}

wm_status parse_scenario(const std::string &text, const std::string &path, Scenario &out, wm_error *err) {
  wm_yaml *doc = nullptr;
  const wm_status loaded = wm_yaml_parse(text.data(), text.size(), path.c_str(), &doc, err);
  return read_document(loaded, doc, out, err);
}

void make_perfect(Scenario &scenario) {
  scenario.errors = Errors{};
  scenario.faults = Faults{};
  scenario.bus.stamp_jitter_s = 0;
  for (wm_landmark &l : scenario.landmarks) l.sigma_m = 0;
  Motion &m = scenario.motion;
  m.speed_noise_mps = m.side_noise_mps = m.turn_noise_radps = m.speed_noise = m.side_noise = m.turn_noise = 0;
  m.accelerometer_noise_mps2 = m.accelerometer_bias_mps2 = m.vibration_mps2 = m.bump_mps2 = 0;
  scenario.pictures.noise_scale = 0;
  scenario.pictures.gain_drift = 0;
  for (Camera &camera : scenario.cameras) {
    camera.bearing_sigma_rad = 0;
    camera.outlier_fraction = 0;
  }
  for (Sensor &s : scenario.sensors) {
    s.bearing_sigma_rad = s.range_sigma_m = s.heading_sigma_rad = s.range_sigma = s.sigma_px = s.wander_m = 0;
    s.outlier_fraction = s.missed_fraction = s.one_side_fraction = 0;
    s.noisy = false;
  }
}

}  // namespace wm::sim
