// SPDX-License-Identifier: Apache-2.0
// Of a scenario: sensors, landmarks drawn by the seed, and the way of a vehicle with six degrees of freedom.
#include <algorithm>
#include <cmath>
#include <set>

#include "simulate/scenario_reader.h"

namespace wm::sim {
namespace {

using Kind = Sensor::Kind;

constexpr const char *kKinds[] = {"landmarks", "markers", "edges", "stereo", "gnss", "depth", "compass", nullptr};

bool there(Reader &r, const wm_yaml_node &map, const char *key) {
  const wm_yaml_node node = r.child(map, key, false);
  return r.ok() && wm_yaml_there(&node);
}

// Keys that only some kinds have; a key at the wrong kind is told.
void only(Reader &r, const wm_yaml_node &map, const char *key, bool allowed, const char *kinds) {
  if (!allowed && there(r, map, key))
    r.fail(r.child(map, key, false), (std::string("only a sensor of kind ") + kinds + " has this").c_str());
}

void read_angles(Reader &r, const wm_yaml_node &map, Sensor &out) {
  double rpy_deg[3];
  if (r.numbers(map, "rpy_deg", 3, 3, rpy_deg) == 3)
    for (int i = 0; i < 3; i++) out.rpy_rad[i] = rpy_deg[i] * kDeg;
}

void read_areas(Reader &r, const wm_yaml_node &map, Sensor &out) {
  const wm_yaml_node list = r.child(map, "areas_m", false);
  for (size_t i = 0, n = r.list(list); i < n && r.ok(); i++) {
    const wm_yaml_node item = wm_yaml_item(&list, i);
    double v[4];
    r.take(wm_yaml_f64_list(&item, 4, 4, v, nullptr, r.error()));
    if (r.ok() && (v[2] <= v[0] || v[3] <= v[1]))
      return r.fail(item, "an area is [x0, y0, x1, y1]; x1 is above x0 and y1 above y0");
    out.areas.push_back({v[0], v[1], v[2], v[3]});
  }
}

void read_stereo(Reader &r, const wm_yaml_node &map, Sensor &out) {
  r.number(map, "sigma_px", 0, 100, 1, out.sigma_px, true);
  r.number(map, "focal_px", 1, 1e5, 1, out.focal_px);
  r.numbers(map, "centre_px", 2, 2, out.centre_px);
  r.number(map, "baseline_m", 1e-3, 100, 1, out.baseline_m);
  r.number(map, "one_side_percent", 0, 100, kPercent, out.one_side_fraction);
  out.tracks = there(r, map, "appearance_noise_percent");
  r.number(map, "appearance_noise_percent", 0, 50, kPercent, out.appearance_noise);
  r.number(map, "alike_percent", 0, 100, kPercent, out.alike_fraction);
  if (r.ok() && !out.tracks && there(r, map, "alike_percent"))
    return r.fail(map, "alike_percent needs appearance_noise_percent");
  double size[2];
  if (r.numbers(map, "size", 2, 2, size) != 2 || !r.ok()) return;
  if (size[0] < 16 || size[0] > 8192 || size[1] < 16 || size[1] > 8192)
    return r.fail(map, "size: width and height from 16 to 8192 px");
  out.size_px[0] = static_cast<int>(size[0]);
  out.size_px[1] = static_cast<int>(size[1]);
}

void read_landmark_sensor(Reader &r, const wm_yaml_node &map, Sensor &out) {
  out.gives_bearing = there(r, map, "bearing_sigma_deg");
  out.gives_range = there(r, map, "range_sigma_m");
  if (r.ok() && out.kind == Kind::landmarks && !out.gives_bearing && !out.gives_range)
    return r.fail(map, "give bearing_sigma_deg, range_sigma_m or both: they choose what this sensor measures");
  const bool marker = out.kind == Kind::markers;
  r.number(map, "bearing_sigma_deg", 0, 45, kDeg, out.bearing_sigma_rad, marker || out.kind == Kind::compass);
  r.number(map, "range_sigma_m", 0, 1000, 1, out.range_sigma_m, marker);
  r.number(map, "heading_sigma_deg", 0, 45, kDeg, out.heading_sigma_rad, marker);
  r.number(map, "range_sigma_percent", 0, 100, kPercent, out.range_sigma);
  r.number(map, "outlier_m", 0, 1e5, 1, out.outlier_m);
  int is_depth = 0;
  static const char *const ranges[] = {"distance", "depth", nullptr};
  r.word(map, "range_is", ranges, is_depth);
  out.range_is_depth = is_depth == 1;
}

void read_position(Reader &r, const wm_yaml_node &map, Sensor &out) {
  r.number(map, "sigma_xy_m", 1e-6, 1e5, 1, out.sigma_xy_m, out.kind == Kind::gnss);
  r.number(map, "stated_xy_m", 1e-6, 1e5, 1, out.stated_xy_m);
  r.number(map, "sigma_z_m", 1e-6, 1e5, 1, out.sigma_z_m, true);
  r.number(map, "outlier_m", 0, 1e5, 1, out.outlier_m);
  r.number(map, "wander_m", 0, 1e5, 1, out.wander_m);
  r.number(map, "wander_s", 0.1, 1e5, 1, out.wander_s);
}

void read_sensor(Reader &r, const wm_yaml_node &map, bool pictured, Sensor &out) {
  static const char *const known[] = {"kind",
                                      "name",
                                      "camera",
                                      "beside_pictures",
                                      "xyz_m",
                                      "rpy_deg",
                                      "rate_hz",
                                      "phase_ms",
                                      "range_m",
                                      "field_of_view_deg",
                                      "ids",
                                      "areas_m",
                                      "bearing_sigma_deg",
                                      "baseline_m",
                                      "range_is",
                                      "range_sigma_m",
                                      "heading_sigma_deg",
                                      "outlier_m",
                                      "range_sigma_percent",
                                      "sigma_px",
                                      "focal_px",
                                      "centre_px",
                                      "outlier_percent",
                                      "size",
                                      "one_side_percent",
                                      "appearance_noise_percent",
                                      "alike_percent",
                                      "sigma_xy_m",
                                      "stated_xy_m",
                                      "wander_m",
                                      "missed_percent",
                                      "sigma_z_m",
                                      "wander_s",
                                      "latency_ms",
                                      "latency_jitter_ms",
                                      nullptr};
  r.keys(map, known);
  int kind = 0;
  r.word(map, "kind", kKinds, kind, true);
  if (!r.ok()) return;
  out.kind = static_cast<Kind>(kind);
  const bool stereo = out.kind == Kind::stereo, position = out.kind == Kind::gnss || out.kind == Kind::depth;
  const bool looks = out.kind == Kind::landmarks || out.kind == Kind::markers;  // at landmarks
  const bool edges = out.kind == Kind::edges;
  only(r, map, "camera", pictured && (looks || edges), "landmarks, markers or edges in a world with pictures");
  only(r, map, "beside_pictures", pictured && (looks || stereo || edges),
       "landmarks, markers, edges or stereo in a world with pictures");
  for (const char *key : {"field_of_view_deg", "range_sigma_m", "range_sigma_percent", "range_is"})
    only(r, map, key, looks, "landmarks or markers");
  only(r, map, "heading_sigma_deg", out.kind == Kind::markers, "markers");
  for (const char *key : {"range_m", "missed_percent"})
    only(r, map, key, looks || stereo || edges, "landmarks, markers, edges or stereo");
  only(r, map, "ids", looks || stereo, "landmarks, markers or stereo");
  only(r, map, "sigma_px", stereo || edges, "stereo or edges");
  for (const char *key :
       {"focal_px", "centre_px", "baseline_m", "size", "one_side_percent", "appearance_noise_percent", "alike_percent"})
    only(r, map, key, stereo, "stereo");
  for (const char *key : {"sigma_xy_m", "stated_xy_m", "wander_m", "wander_s"})
    only(r, map, key, out.kind == Kind::gnss, "gnss");
  only(r, map, "sigma_z_m", position, "gnss or depth");
  only(r, map, "bearing_sigma_deg", looks || out.kind == Kind::compass, "landmarks, markers or compass");

  out.name = kKinds[kind];
  r.text(map, "camera", out.camera);
  if (!out.camera.empty()) out.name = out.camera;
  r.text(map, "name", out.name);
  if (r.ok() &&
      (out.name.empty() || out.name.size() >= WM_NAME_MAX || out.name.find_first_of(", \t\n:") != std::string::npos))
    return r.fail(map, "name: 1 to 31 letters without blanks, commas or colons");
  r.flag(map, "beside_pictures", out.beside_pictures);
  r.numbers(map, "xyz_m", 3, 3, out.xyz_m);
  read_angles(r, map, out);
  r.number(map, "rate_hz", 0.01, 1000, 1, out.rate_hz);
  r.number(map, "phase_ms", 0, 1e5, kMilli, out.phase_s);
  r.number(map, "field_of_view_deg", 1, 360, kDeg, out.field_of_view_rad);
  r.number(map, "range_m", 0.1, kFar_m, 1, out.range_m);
  double ids[2] = {0, INT32_MAX};
  r.range(map, "ids", 0, INT32_MAX, ids);
  for (int i = 0; i < 2; i++) out.ids[i] = static_cast<int32_t>(ids[i]);
  r.number(map, "outlier_percent", 0, 100, kPercent, out.outlier_fraction);
  r.number(map, "missed_percent", 0, 100, kPercent, out.missed_fraction);
  r.number(map, "latency_ms", 0, 1e4, kMilli, out.latency_s);
  r.number(map, "latency_jitter_ms", 0, 1e4, kMilli, out.latency_jitter_s);
  read_areas(r, map, out);
  if (edges) r.number(map, "sigma_px", 0, 100, 1, out.sigma_px, true);
  if (looks || out.kind == Kind::compass) read_landmark_sensor(r, map, out);
  if (stereo) read_stereo(r, map, out);
  if (position) read_position(r, map, out);
}

}  // namespace

void read_sensors(Reader &r, const wm_yaml_node &list, Scenario &out) {
  std::set<std::string> names;
  for (const Camera &camera : out.cameras) names.insert(camera.name);
  size_t pairs = 0;
  for (size_t i = 0, n = r.list(list); i < n && r.ok(); i++) {
    const wm_yaml_node item = wm_yaml_item(&list, i);
    Sensor sensor;
    read_sensor(r, item, out.world.pictured(), sensor);
    if (r.ok() && !names.insert(sensor.name).second)
      r.fail(item, ("the name '" + sensor.name + "' is there already; give this sensor a `name` of its own").c_str());
    if (r.ok() && sensor.kind == Kind::stereo && ++pairs > 1) r.fail(item, "a recording has one stereo pair");
    for (const Sensor &other : out.sensors)
      if (r.ok() && sensor.kind == Kind::gnss && other.kind == Kind::gnss &&
          !std::equal(sensor.xyz_m, sensor.xyz_m + 3, other.xyz_m))
        r.fail(item, "sensors of kind gnss are one receiver in several modes, with one antenna: write the same xyz_m");
    if (r.ok() && sensor.kind == Kind::edges && out.world.kind != "corridor")
      r.fail(item, "only the world `corridor` has edges on the floor");
    if (r.ok() && sensor.kind == Kind::markers && (out.swims() || out.world.kind == "seabed"))
      r.fail(item, "markers.csv is for robots on wheels");
    if (r.ok() && sensor.kind == Kind::stereo && !out.swims() && !out.world.pictured())
      r.fail(item, "a stereo pair needs a `path`, a vehicle with six degrees of freedom");
    out.sensors.push_back(sensor);
  }
  if (out.cameras.size() + out.sensors.size() > 32) r.fail(list, "more than 32 sensors, with the cameras");
}

void read_scatter(Reader &r, const wm_yaml_node &map, Scenario &out) {
  static const char *const known[] = {"count",   "per_view", "first_id", "aside_m", "height_m",
                                      "apart_m", "ahead_m",  "seed",     nullptr};
  if (!r.ok() || !wm_yaml_there(&map)) return;
  r.keys(map, known);
  Scatter &s = out.scatter;
  int64_t count = 0, per_view = 0, first = 1, seed = 0;
  r.integer(map, "count", 1, 20000, count);
  r.integer(map, "per_view", 1, 500, per_view);
  r.integer(map, "first_id", 0, 1000000, first);
  r.integer(map, "seed", 0, INT64_MAX, seed);
  s.seed = static_cast<uint64_t>(seed);
  s.count = static_cast<int>(count);
  s.per_view = static_cast<int>(per_view);
  s.first_id = static_cast<int32_t>(first);
  r.range(map, "aside_m", 0, 1000, s.aside_m);
  r.range(map, "height_m", -1000, 1000, s.height_m);
  r.number(map, "apart_m", 0, 1000, 1, s.apart_m);
  r.range(map, "ahead_m", 0.1, 1000, s.ahead_m);
  if (r.ok() && (count > 0) == (per_view > 0)) r.fail(map, "`count` or `per_view` is needed, one of them");
  for (const wm_landmark &l : out.landmarks)
    if (r.ok() && l.id >= s.first_id)
      return r.fail(map, "first_id must be above the ids of `landmarks`, so that no id is there twice");
}

void read_path(Reader &r, const wm_yaml_node &map, Scenario &out) {
  static const char *const known[] = {"knots", "rounds", nullptr};
  static const char *const known_rounds[] = {"duration_s", "radius_m", "height_m", "rounds",
                                             "wobble_m",   "tilt_deg", nullptr};
  if (!r.ok() || !wm_yaml_there(&map)) return;
  r.keys(map, known);
  const wm_yaml_node knots = r.child(map, "knots", false), rounds = r.child(map, "rounds", false);
  if (r.ok() && wm_yaml_there(&knots) == wm_yaml_there(&rounds))
    return r.fail(map, "`knots` or `rounds` is needed, one of them");
  if (r.ok() && wm_yaml_there(&rounds)) {
    r.keys(rounds, known_rounds);
    r.number(rounds, "duration_s", 1, 1e5, 1, out.rounds.duration_s, true);
    r.number(rounds, "radius_m", 0.1, 1000, 1, out.rounds.radius_m);
    r.number(rounds, "height_m", -1000, 1000, 1, out.rounds.height_m);
    r.number(rounds, "rounds", 0.01, 1000, 1, out.rounds.rounds);
    r.number(rounds, "wobble_m", 0, 100, 1, out.rounds.wobble_m);
    r.number(rounds, "tilt_deg", 0, 30, kDeg, out.rounds.tilt_rad);
  }
  const size_t n = r.list(knots);
  if (r.ok() && wm_yaml_there(&knots) && n < 2) return r.fail(knots, "a way needs two knots at least");
  for (size_t i = 0; i < n && r.ok(); i++) {
    const wm_yaml_node item = wm_yaml_item(&knots, i);
    double v[7];
    size_t count = 0;
    r.take(wm_yaml_f64_list(&item, 7, 7, v, &count, r.error()));
    if (!r.ok()) return;
    if (i > 0 && v[0] <= out.knots.back().t_s) return r.fail(item, "each knot is later than the one before");
    out.knots.push_back({v[0], v[1], v[2], v[3], v[4] * kDeg, v[5] * kDeg, v[6] * kDeg});
  }
  if (r.ok() && !out.knots.empty() && out.knots.front().t_s != 0) r.fail(knots, "the first knot is at 0 s");
}

}  // namespace wm::sim
