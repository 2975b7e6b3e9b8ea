// SPDX-License-Identifier: Apache-2.0
// What detectors would find in the pictures of a drive.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <sstream>

#include "simulate/features.h"
#include "simulate/film.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

using images::Pose;
using images::Vec2;
using images::Vec3;
using Kind = Sensor::Kind;

// A camera at the moment of a picture.
struct Moment {
  const FilmCamera &camera;
  render::Shot shot;

  Pose T_map_camera() const { return shot.T_map_base(static_cast<double>(shot.t_ns)) * camera.truth.T_base_camera; }
  // A true pixel as a direction in base_link, by what is believed of the camera.
  bool believed(const Vec2 &pixel, Vec3 &direction) const {
    if (!images::unproject(camera.believed, pixel, direction)) return false;
    direction = images::T_base_optical(camera.believed).linear() * direction;
    return true;
  }
  // A direction in the true camera, by the believed mounting, in base_link.
  Vec3 by_mounting(const Vec3 &in_map) const {
    return camera.believed.T_base_camera.linear() * (T_map_camera().linear().transpose() * in_map);
  }
};

// Base axes turned by the sensor's yaw, at the sensor's place.
Vec3 levelled(const Sensor &s, const Vec3 &base) {
  const auto yaw = wm::sincos(s.rpy_rad[2]);
  return {yaw.cos * base.x() + yaw.sin * base.y(), yaw.cos * base.y() - yaw.sin * base.x(), base.z()};
}

// The labels that a sensor of this kind reads; false where the world has none.
bool looked_for(const World &world, Kind kind, World::Labels &what) {
  for (const World::Labels one : world.labels) {
    what = one;
    const Kind reader = one == World::Labels::edges     ? Kind::edges
                        : one == World::Labels::markers ? Kind::markers
                                                        : Kind::landmarks;
    if (reader == kind || (kind == Kind::stereo && reader == Kind::landmarks)) return true;
  }
  return false;
}

wm_status fit(const Film &film, Sensor &s, size_t &camera, wm_error *err) {
  const World &world = *film.world;
  const bool stereo = s.kind == Kind::stereo;
  World::Labels what;
  if (stereo ? world.stereo_left.empty() : !looked_for(world, s.kind, what))
    return wm_fail(err, WM_BAD_CONFIG, "sensors: %s: the world `%s` has nothing for a sensor of this kind",
                   s.name.c_str(), world.name.c_str());
  const std::string &name = stereo ? world.stereo_left : s.camera;
  camera = 0;
  while (camera < film.cameras.size() && film.cameras[camera].name != name) camera++;
  if (camera == film.cameras.size())
    return wm_fail(err, WM_BAD_CONFIG, "sensors: %s: this world has no camera `%s`; give the name of one as `camera`",
                   s.name.c_str(), name.c_str());
  const images::Camera &c = film.cameras[camera].believed;
  const Vec3 place = c.T_base_camera.translation(), ahead = c.T_base_camera.linear().col(0);
  for (int i = 0; i < 3; i++) s.xyz_m[i] = place[i];
  s.rpy_rad[0] = s.rpy_rad[1] = 0;  // levelled: bearings are azimuths
  s.rpy_rad[2] = std::fabs(ahead.z()) > 0.7 ? 0 : wm::atan2(ahead.y(), ahead.x());
  s.size_px[0] = c.width;
  s.size_px[1] = c.height;
  return WM_OK;
}

// Calls act(time, moment) for each picture of a camera in which there is something to see for the sensor.
template <class Act>
void for_each_picture(const Film &film, const Sensor &s, size_t camera, const Act &act) {
  const Faults &f = film.scenario.faults;
  double shown_s = 0;
  for (const FrameTime &time : frame_times(film, camera)) {
    if (f.lights_off.holds(time.t_s) || !is_covered(s, film.recording, time.t_s)) continue;
    if (!f.frozen_picture.holds(time.t_s)) shown_s = time.t_s;
    Moment moment{film.cameras[camera], {}};
    moment.shot.t_ns = std::llround(shown_s * 1e9);
    moment.shot.exposure_ns = std::llround(film.cameras[camera].exposure_s * 1e9);
    moment.shot.frame = time.number;
    moment.shot.T_map_base = motion_of(film.recording);
    act(time, moment);
  }
}

// The rows that the world labels a picture with, as numbers.
std::vector<std::vector<double>> labels_of(const Film &film, Kind kind, size_t camera, const Moment &moment) {
  std::string text, line;
  World::Labels what;
  if (!looked_for(*film.world, kind, what)) return {};
  film.world->label(what, camera, film.cameras[camera].truth, moment.shot, text);
  std::replace(text.begin(), text.end(), ',', ' ');
  std::vector<std::vector<double>> rows;
  for (std::istringstream lines(text); std::getline(lines, line);) {
    std::vector<double> row;
    std::istringstream fields(line);
    for (double value = 0; fields >> value;) row.push_back(value);
    rows.push_back(row);
  }
  return rows;
}

Seen seen_at(const FrameTime &time, const Sensor &s, const Random &random, size_t number, double id) {
  const double late_s =
      s.latency_s + s.latency_jitter_s * random.uniform(Stream::frame_latency, time.number, 64 + number);
  return {time.number, static_cast<size_t>(id), static_cast<int32_t>(id), time.stamp_ns,
          time.arrival_ns + std::llround(late_s * 1e9)};
}

void find_landmarks(Film &film, size_t number, size_t camera) {
  const Sensor &s = film.scenario.sensors[number];
  const World &world = *film.world;
  const Random random(film.recording.seed);
  for_each_picture(film, s, camera, [&](const FrameTime &time, const Moment &moment) {
    const Vec3 eye = moment.T_map_camera().translation();
    for (const auto &row : labels_of(film, s.kind, camera, moment)) {
      Vec3 direction, place;
      double id = row[1];
      if (world.has(World::Labels::lines)) {
        const auto line = std::find_if(world.lines.begin(), world.lines.end(),
                                       [&](const World::Line &l) { return l.id == static_cast<int32_t>(id); });
        place = line->foot + 0.97 * (line->head - line->foot);
        direction = moment.by_mounting((place - eye).normalized());
      } else {
        id = row[2];
        const auto truth = std::find_if(world.truth.begin(), world.truth.end(),
                                        [&](const WorldLandmark &l) { return l.id == static_cast<int32_t>(id); });
        place = truth->p;
        if (!moment.believed({row[3], row[4]}, direction)) continue;
      }
      see_landmark(film.scenario, number, seen_at(time, s, random, number, id),
                   levelled(s, direction * (place - eye).norm()), film.recording);
    }
  });
}

void find_markers(Film &film, size_t number, size_t camera) {
  const Sensor &s = film.scenario.sensors[number];
  const Random random(film.recording.seed);
  for_each_picture(film, s, camera, [&](const FrameTime &time, const Moment &moment) {
    const Vec3 eye = moment.T_map_camera().translation();
    for (const auto &row : labels_of(film, s.kind, camera, moment)) {
      const auto &panels = film.world->panels;
      const auto panel = std::find_if(panels.begin(), panels.end(),
                                      [&](const World::Panel &p) { return p.id == static_cast<int32_t>(row[1]); });
      Vec2 pixel;
      Vec3 direction;
      if (!render::project_shot(moment.camera.truth, moment.shot, panel->middle(), pixel) ||
          !moment.believed(pixel, direction))
        continue;
      see_marker(film.scenario, number, seen_at(time, s, random, number, row[1]),
                 levelled(s, direction * (panel->middle() - eye).norm()),
                 levelled(s, moment.by_mounting(panel->corners[1] - panel->corners[0])), film.recording);
    }
  });
}

// Pixels of edges, with the sensor's noise, as points on the floor; an outlier is something nearer on the same ray.
void find_edges(Film &film, size_t number, size_t camera) {
  const Sensor &s = film.scenario.sensors[number];
  const Random random(film.recording.seed);
  for_each_picture(film, s, camera, [&](const FrameTime &time, const Moment &moment) {
    const Seen seen = seen_at(time, s, random, number, 0);
    EdgesSeen out{seen.t_ns, seen.arrival_ns, static_cast<uint16_t>(number), {}};
    const Vec3 eye = moment.camera.believed.T_base_camera.translation();
    const auto rows = labels_of(film, s.kind, camera, moment);
    for (size_t i = 0; i < rows.size(); i++) {
      const FeatureDice dice(film.recording.seed, number, time.number, i);
      const Vec2 pixel(rows[i][2] + s.sigma_px * dice.noise(0), rows[i][3] + s.sigma_px * dice.noise(1));
      Vec3 direction;
      if (dice.missed() < s.missed_fraction || !moment.believed(pixel, direction) || direction.z() >= 0) continue;
      const Vec2 ahead = direction.head<2>() * (-eye.z() / direction.z());
      const double share = dice.outlier() < s.outlier_fraction ? dice.anything(0) : 1;
      if (ahead.norm() <= s.range_m) out.points_m.emplace_back(eye.head<2>() + share * ahead);
    }
    if (!out.points_m.empty()) film.recording.edges.push_back(out);
  });
}

// A true pixel in the believed rectified picture.
Vec2 rectified(const FilmCamera &camera, const std::vector<double> &k, const Vec2 &pixel) {
  Vec3 d;
  if (!images::unproject(camera.believed, pixel, d)) return {NAN, NAN};
  return {k[2] + k[0] * d.x() / d.z(), k[3] + k[1] * d.y() / d.z()};
}

void find_stereo(Film &film, size_t number) {
  const Sensor &s = film.scenario.sensors[number];
  const Random random(film.recording.seed);
  struct Pair {
    Seen seen;
    double px[2][2] = {{NAN, NAN}, {NAN, NAN}};
  };
  std::map<std::pair<uint64_t, int>, Pair> points;  // by trigger and id
  size_t left = 0;
  while (film.cameras[left].name != film.world->stereo_left) left++;
  const std::vector<double> &k = film.cameras[left].believed.intrinsics;
  for (size_t camera = 0; camera < film.cameras.size(); camera++) {
    const bool right = film.cameras[camera].name == film.world->stereo_right;
    if (camera != left && !right) continue;
    for_each_picture(film, s, camera, [&](const FrameTime &time, const Moment &moment) {
      for (const auto &row : labels_of(film, s.kind, camera, moment)) {
        const Vec2 pixel = rectified(moment.camera, k, {row[3], row[4]});
        if (std::isnan(pixel.x())) continue;
        Pair &pair =
            points.try_emplace({time.number, static_cast<int>(row[2])}, Pair{seen_at(time, s, random, number, row[2])})
                .first->second;
        pair.seen.arrival_ns = std::max(pair.seen.arrival_ns, time.arrival_ns);
        pair.px[right ? 1 : 0][0] = pixel.x();
        pair.px[right ? 1 : 0][1] = pixel.y();
      }
    });
  }
  for (const auto &[key, pair] : points)
    see_stereo(film.scenario, number, pair.seen, pair.px[0], pair.px[1], film.recording);
}

}  // namespace

wm_status observe_pictures(Film &film, wm_error *err) {
  Scenario &sc = film.scenario;
  std::vector<Sensor> kept;
  for (const Sensor &s : sc.sensors)
    if (!by_pictures(sc, s) || s.beside_pictures || sc.pictures.none) kept.push_back(s);
  sc.sensors = kept;
  std::vector<size_t> cameras(sc.sensors.size());
  for (size_t i = 0; i < sc.sensors.size(); i++)
    if (by_pictures(sc, sc.sensors[i]))
      if (const wm_status s = fit(film, sc.sensors[i], cameras[i], err); s != WM_OK) return s;
  observe(sc, film.recording);
  for (size_t i = 0; i < sc.sensors.size(); i++) {
    if (!by_pictures(sc, sc.sensors[i])) continue;
    switch (sc.sensors[i].kind) {
      case Kind::markers: find_markers(film, i, cameras[i]); break;
      case Kind::edges: find_edges(film, i, cameras[i]); break;
      case Kind::stereo: find_stereo(film, i); break;
      default: find_landmarks(film, i, cameras[i]); break;
    }
  }
  settle(sc, film.recording);
  return WM_OK;
}

}  // namespace wm::sim
