// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "simulate/angle.h"
#include "simulate/film.h"
#include "simulate/motion.h"

namespace wm::sim {
namespace {

using images::Pose;
using images::Vec3;

void add(std::string &text, const char *format, ...) __attribute__((format(printf, 2, 3)));
void add(std::string &text, const char *format, ...) {
  char line[512];
  va_list args;
  va_start(args, format);
  std::vsnprintf(line, sizeof line, format, args);
  va_end(args);
  text += line;
}

void scale_to(int width, int height, images::Camera &camera) {
  const double share = static_cast<double>(width) / camera.width;
  const size_t first = camera.intrinsics.size() - 4;
  for (size_t i = first; i < first + 2; i++) camera.intrinsics[i] *= share;
  // A pixel's middle is its integer coordinate.
  camera.intrinsics[first + 2] = (camera.intrinsics[first + 2] + 0.5) * share - 0.5;
  camera.intrinsics[first + 3] =
      (camera.intrinsics[first + 3] - 0.5 * (camera.height - 1)) * share + 0.5 * (height - 1);
  camera.width = width;
  camera.height = height;
}

void change(const PixelCamera &wish, FilmCamera &out) {
  images::Camera &c = out.believed;
  if (!wish.model.empty()) {
    images::model_from_name(wish.model, c.model);
    c.distortion.clear();
  }
  if (wish.width > 0 && wish.intrinsics.empty()) scale_to(wish.width, wish.height, c);
  if (wish.width > 0) c.width = wish.width, c.height = wish.height;
  if (!wish.intrinsics.empty()) c.intrinsics = wish.intrinsics;
  if (!wish.distortion.empty()) c.distortion = wish.distortion;
  if (wish.field_of_view_rad) c.fov_rad = *wish.field_of_view_rad;
  if (!wish.xyz_m.empty()) c.T_base_camera.translation() = Vec3(wish.xyz_m[0], wish.xyz_m[1], wish.xyz_m[2]);
  if (!wish.rpy_rad.empty())
    c.T_base_camera =
        images::pose_xyz_rpy(c.T_base_camera.translation(), wish.rpy_rad[0], wish.rpy_rad[1], wish.rpy_rad[2]);
  if (wish.readout_s) c.readout_ns = std::llround(*wish.readout_s * 1e9);
  out.rate_hz = wish.rate_hz.value_or(out.rate_hz);
  out.exposure_s = wish.exposure_s.value_or(out.exposure_s);
  out.colour = wish.colour.value_or(out.colour);
}

// The camera as it is: the mounting off on each axis, each number of the intrinsics off by a share of itself.
images::Camera draw_truth(const Errors &e, const Random &random, uint64_t camera, const images::Camera &believed) {
  images::Camera c = believed;
  c.T_base_camera = true_mounting(believed.T_base_camera, e, random.seed(), camera);
  for (size_t i = c.intrinsics.size() - 4; i < c.intrinsics.size(); i++)
    c.intrinsics[i] *= 1 + e.camera_intrinsics * random.normal(Stream::camera_intrinsics, i, camera);
  return c;
}

// A rectified pair is one rigid instrument: the right camera sits to the left one as calibrated, with its intrinsics.
void join_pair(Film &film) {
  FilmCamera *left = nullptr, *right = nullptr;
  for (FilmCamera &c : film.cameras) {
    if (c.name == film.world->stereo_left) left = &c;
    if (c.name == film.world->stereo_right) right = &c;
  }
  if (left == nullptr || right == nullptr) return;
  right->truth.T_base_camera =
      left->truth.T_base_camera * left->believed.T_base_camera.inverse() * right->believed.T_base_camera;
  if (right->believed.intrinsics == left->believed.intrinsics) right->truth.intrinsics = left->truth.intrinsics;
}

wm_status set_up_cameras(const Scenario &sc, uint64_t seed, Film &out, wm_error *err) {
  const Random random(seed);
  for (const WorldCamera &c : out.world->cameras) {
    FilmCamera film{c.name, c.camera, c.camera, c.rate_hz, c.exposure_s, c.colour};
    for (const PixelCamera &wish : sc.pixel_cameras)
      if (wish.name == c.name) change(wish, film);
    std::string problem;
    if (!images::camera_valid(film.believed, problem))
      return wm_fail(err, WM_BAD_CONFIG, "cameras: %s: %s", c.name.c_str(), problem.c_str());
    film.truth = draw_truth(sc.errors, random, out.cameras.size(), film.believed);
    if (film.colour && sc.pictures.lossless)
      return wm_fail(err, WM_BAD_CONFIG, "cameras: %s: pictures.coding grey has no colour", c.name.c_str());
    out.cameras.push_back(film);
  }
  for (const PixelCamera &wish : sc.pixel_cameras) {
    const auto &all = out.cameras;
    if (std::any_of(all.begin(), all.end(), [&](const FilmCamera &c) { return c.name == wish.name; })) continue;
    std::string names;
    for (const FilmCamera &c : all) names += (names.empty() ? "" : ", ") + c.name;
    return wm_fail(err, WM_BAD_CONFIG, "cameras: this world has no camera `%s`; it has %s", wish.name.c_str(),
                   names.c_str());
  }
  join_pair(out);
  return WM_OK;
}

// Rz(yaw) Ry(pitch) Rx(roll) in degrees; straight up or down, where only their sum counts, roll is 0.
Vec3 rpy_deg(const Pose &T) {
  const auto R = T.linear();
  const double pitch = std::atan2(-R(2, 0), std::sqrt(R(0, 0) * R(0, 0) + R(1, 0) * R(1, 0)));
  Vec3 rpy(std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0)));
  if (std::fabs(R(2, 0)) > 1 - 1e-12) rpy = Vec3(0, pitch, std::atan2(-R(0, 1), R(1, 1)));
  return rpy * (180 / kPi);
}

std::string calibration_of(const Film &film) {
  std::string text = "cameras:\n";
  const auto list = [&](const char *key, const std::vector<double> &values) {
    add(text, "    %s: [", key);
    for (size_t i = 0; i < values.size(); i++) add(text, "%s%.9g", i ? ", " : "", values[i]);
    text += "]\n";
  };
  for (const FilmCamera &c : film.cameras) {
    const images::Camera &b = c.believed;
    const Vec3 xyz = b.T_base_camera.translation(), rpy = rpy_deg(b.T_base_camera);
    add(text, "  %s:\n    model: %s\n    size: [%d, %d]\n", c.name.c_str(), images::model_name(b.model), b.width,
        b.height);
    list("intrinsics", b.intrinsics);
    list("distortion", b.distortion.empty() ? std::vector<double>(4, 0.0) : b.distortion);
    add(text, "    mounting: {xyz_m: [%.6g, %.6g, %.6g], rpy_deg: [%.6f, %.6f, %.6f]}\n    readout_ns: %lld\n", xyz.x(),
        xyz.y(), xyz.z(), rpy.x(), rpy.y(), rpy.z(), static_cast<long long>(b.readout_ns));
  }
  const auto named = [&](const std::string &name) {
    return std::find_if(film.cameras.begin(), film.cameras.end(), [&](const FilmCamera &c) { return c.name == name; });
  };
  const auto left = named(film.world->stereo_left), right = named(film.world->stereo_right);
  if (left != film.cameras.end() && right != film.cameras.end()) {
    const std::vector<double> &k = left->believed.intrinsics;
    const double baseline_m =
        (left->believed.T_base_camera.translation() - right->believed.T_base_camera.translation()).norm();
    add(text, "stereo:\n  left: %s\n  right: %s\n  baseline_m: %.6g\n  rectified: [%.9g, %.9g, %.9g, %.9g]\n",
        left->name.c_str(), right->name.c_str(), baseline_m, k[0], k[1], k[2], k[3]);
    for (const Sensor &s : film.scenario.sensors)
      if (s.kind == Sensor::Kind::stereo && s.sigma_px > 0)
        add(text, "  sigma_px: [%.6g, %.6g, %.6g, %.6g]\n", s.sigma_px, s.sigma_px, s.sigma_px, s.sigma_px);
  }
  if (film.world->marker_size_m > 0)
    add(text, "markers: {family: %s, size_m: %.6g}\n", film.world->marker_family.c_str(), film.world->marker_size_m);
  return text;
}

std::vector<wm_landmark> landmarks_of(const World &world) {
  std::vector<wm_landmark> out;
  for (const WorldLandmark &l : world.truth) {
    wm_landmark landmark{};
    landmark.id = l.id;
    for (int i = 0; i < 3; i++) landmark.p_m[i] = l.p[i];
    landmark.yaw_rad = l.yaw_rad;
    landmark.sigma_m = l.sigma_m;
    out.push_back(landmark);
  }
  return out;
}

// Whether the robot gets along its route without bumping into the building.
wm_status check_clear(const World &world, wm_error *err) {
  Drive drive;
  if (const wm_status s = Drive::plan(world.route, drive, err); s != WM_OK) return s;
  Plan mapped = world.plan;  // clutter keeps out of the way by itself
  std::erase_if(mapped.faces, [](const Face &f) { return !f.mapped; });
  double way_m = -1;
  for (double t_s = 0; t_s <= drive.duration_s(); t_s += 0.05) {
    const State at = drive.at(t_s);
    if (way_m >= 0 && std::fabs(at.way_m - way_m) < 0.05) continue;
    way_m = at.way_m;
    if (clearance_m(mapped, world.footprint, at.x_m, at.y_m, at.heading_rad) > 0) continue;
    return wm_fail(err, WM_BAD_CONFIG,
                   "route: %.1f s after the start, at (%.2f, %.2f), the robot (%.2f m wide, from %.2f m before "
                   "base_link to %.2f m "
                   "behind it; `body` of `robot` sets these) is inside of a wall or touches it",
                   t_s, at.x_m, at.y_m, 2 * world.footprint.half_width_m, world.footprint.front_m,
                   -world.footprint.back_m);
  }
  return WM_OK;
}

}  // namespace

wm_status prepare(const Scenario &scenario, uint64_t seed, Film &out, wm_error *err) {
  out.scenario = scenario;
  WorldRequest request;
  request.name = scenario.world.kind;
  request.hard = scenario.world.hard;
  request.markers_on_walls = scenario.world.markers_on_walls;
  request.markers = scenario.world.markers;
  request.rounds = scenario.world.rounds;
  request.seed = scenario.world.seed ? scenario.world.seed : seed;
  if (!scenario.route.legs.empty()) request.route = scenario.route;
  request.footprint = scenario.robot.body;
  request.landmarks = scenario.landmarks;
  request.tag_m = scenario.world.tag_m;
  if (!scenario.world.plan.empty()) {
    request.plan.emplace();
    if (const wm_status s = load_building(scenario.world.plan, scenario.world.ceiling_m, scenario.world.resolution_m,
                                          *request.plan, err);
        s != WM_OK)
      return s;
  }
  out.world = make_world(request, err);
  if (!out.world) return err->text[0] ? WM_BAD_CONFIG : WM_INTERNAL;
  out.scenario.route = out.world->route;
  if (request.plan)
    if (const wm_status s = check_clear(*out.world, err); s != WM_OK) return s;
  if (out.scenario.about.empty()) out.scenario.about = out.world->about;
  if (const wm_status s = set_up_cameras(scenario, seed, out, err); s != WM_OK) return s;
  return record(seed, out, err);
}

wm_status record(uint64_t seed, Film &out, wm_error *err) {
  Recording &r = out.recording;
  if (out.world->vehicle == Vehicle::six)
    simulate_six(out.scenario, seed, out.world->path, r);
  else if (const wm_status s = simulate(out.scenario, seed, SIZE_MAX, r, err); s != WM_OK)
    return s;
  r.landmarks = landmarks_of(*out.world);
  if (out.world->landmarks_known) r.map = r.landmarks;
  for (wm_landmark &l : r.landmarks) l.sigma_m = 0;
  misplace(out.scenario, 3, r);
  move_landmarks(out.scenario, r);
  r.camera_calibration = calibration_of(out);
  if (out.world->map) r.picture_streams.push_back("map/map.yaml");
  if (out.scenario.pictures.none) return WM_OK;
  for (const FilmCamera &c : out.cameras) {
    r.picture_streams.push_back("video/" + c.name + ".avi");
    r.picture_streams.push_back("video/" + c.name + ".csv");
  }
  for (const World::Labels what : out.world->labels) r.picture_streams.emplace_back(label_file(what));
  if (out.world->has(World::Labels::landmarks)) r.picture_streams.push_back("landmarks/appearance.csv");
  return WM_OK;
}

}  // namespace wm::sim
