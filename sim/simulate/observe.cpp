// SPDX-License-Identifier: Apache-2.0
// What sensors of features say: true geometry, by the sensor's true mounting, with noise, outliers and misses.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "simulate/angle.h"
#include "simulate/features.h"
#include "simulate/motion.h"
#include "simulate/random.h"
#include "simulate/simulate.h"
#include "simulate/stereo_pair.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Kind = Sensor::Kind;

constexpr double kTiltStep_s = 0.1, kTiltLasts_s = 2;
constexpr double kAnyElevation_rad = 0.3;  // of an outlier: so far round the horizon

// The robot's roll and pitch on its springs: a Gauss-Markov process.
class Sway {
 public:
  Sway(const Random &random, double sigma_rad) : random_(random), sigma_rad_(sigma_rad) {
    for (uint64_t i = 0; i < 2; i++) tilt_rad_[i] = sigma_rad_ * random_.normal(Stream::tilt, 0, i);
  }
  // At rising times: the elevation that it adds to what is seen in that direction.
  double lifts(double t_s, double azimuth_rad) {
    const double keep = wm::exp(-kTiltStep_s / kTiltLasts_s), fresh = std::sqrt(1 - keep * keep);
    for (; kTiltStep_s * static_cast<double>(step_ + 1) <= t_s; step_++)
      for (uint64_t i = 0; i < 2; i++)
        tilt_rad_[i] = keep * tilt_rad_[i] + fresh * sigma_rad_ * random_.normal(Stream::tilt, step_ + 1, i);
    return tilt_rad_[1] * wm::cos(azimuth_rad) - tilt_rad_[0] * wm::sin(azimuth_rad);
  }

 private:
  const Random &random_;
  double sigma_rad_, tilt_rad_[2];
  uint64_t step_ = 0;
};

// One camera's sightings: true bearings from the camera's true place to the true landmarks, with noise and outliers.
void look(const Scenario &sc, const Random &random, uint16_t sensor, Recording &out) {
  const Camera &c = sc.cameras[sensor];
  Sway sway(random, sc.errors.tilt_rad);
  for (uint64_t k = 0;; k++) {
    const double t_s = c.phase_s + static_cast<double>(k) / c.rate_hz;
    if (t_s > out.drive.duration_s()) return;
    const State s = out.drive.at(t_s);
    const double cos_h = wm::cos(s.heading_rad), sin_h = wm::sin(s.heading_rad);
    const double x = s.x_m + cos_h * c.xyz_m[0] - sin_h * c.xyz_m[1];
    const double y = s.y_m + sin_h * c.xyz_m[0] + cos_h * c.xyz_m[1];
    const double axis = s.heading_rad + c.yaw_rad + out.drawn.camera_yaw_rad[sensor];
    const double latency = c.latency_s + c.latency_jitter_s * random.uniform(Stream::frame_latency, k, sensor);
    for (size_t i = 0; i < out.landmarks.size(); i++) {
      const double dx = out.landmarks[i].p_m[0] - x, dy = out.landmarks[i].p_m[1] - y;
      const double bearing = wrap(wm::atan2(dy, dx) - axis);
      if (std::fabs(bearing) > 0.5 * c.field_of_view_rad || std::sqrt(dx * dx + dy * dy) > c.range_m) continue;
      // Draws are told apart by camera and landmark, so that a landmark more doesn't change what is seen of the others.
      const uint64_t sub = sensor * uint64_t{4096} + static_cast<uint64_t>(i);
      Sighting seen{};
      seen.t_ns = out.clock_start_ns + to_ns(t_s + sc.faults.camera_clock_offset_s);
      seen.arrival_ns = out.clock_start_ns + to_ns(t_s + latency);
      seen.sensor = sensor;
      seen.id = out.landmarks[i].id;
      seen.range_m = NAN;
      seen.outlier = random.uniform(Stream::bearing_outlier, k, sub) < c.outlier_fraction;
      seen.bearing_rad = seen.outlier
                             ? (random.uniform(Stream::bearing_outlier_value, k, sub) - 0.5) * c.field_of_view_rad
                             : wrap(bearing + c.bearing_sigma_rad * random.normal(Stream::bearing_noise, k, sub));
      const double up = wm::atan2(out.landmarks[i].p_m[2] - c.xyz_m[2], std::sqrt(dx * dx + dy * dy)) +
                        sway.lifts(t_s, bearing + c.yaw_rad);
      seen.elevation_sigma_rad = c.bearing_sigma_rad;
      seen.elevation_rad = seen.outlier ? (random.uniform(Stream::elevation_outlier, k, sub) - 0.5) * kAnyElevation_rad
                                        : up + c.bearing_sigma_rad * random.normal(Stream::elevation_noise, k, sub);
      out.sightings.push_back(seen);
    }
  }
}

// Calls act(k, t_s, stamp_ns, arrival_ns) at each time of a sensor. Cameras' clocks may be ahead.
template <class Act>
void at_its_rate(const Scenario &sc, size_t number, const Recording &r, const Act &act) {
  const Sensor &s = sc.sensors[number];
  const Random random(r.seed);
  const bool camera =
      s.kind == Kind::markers || s.kind == Kind::stereo || (s.kind == Kind::landmarks && s.gives_bearing);
  for (uint64_t k = 0;; k++) {
    const double t_s = s.phase_s + static_cast<double>(k) / s.rate_hz;
    if (t_s > r.duration_s) return;
    // Numbers from 64 on: the cameras have those before.
    const double late_s = s.latency_s + s.latency_jitter_s * random.uniform(Stream::frame_latency, k, 64 + number);
    const double ahead_s = camera ? sc.faults.camera_clock_offset_s : 0;
    act(k, t_s, r.clock_start_ns + to_ns(t_s + ahead_s), r.clock_start_ns + to_ns(t_s + late_s));
  }
}

void look_for_landmarks(const Scenario &sc, size_t number, Recording &r) {
  const Sensor &s = sc.sensors[number];
  const Isometry3d T_base_sensor =
      true_mounting(pose_of(s.xyz_m, s.rpy_rad), sc.errors, r.seed, camera_number(sc, number));
  at_its_rate(sc, number, r, [&](uint64_t k, double t_s, wm_time_ns t_ns, wm_time_ns arrival_ns) {
    if (!is_covered(s, r, t_s)) return;
    const Isometry3d T_sensor_map = (true_pose(r, t_s) * T_base_sensor).inverse();
    for (size_t i = 0; i < r.landmarks.size(); i++) {
      const wm_landmark &l = r.landmarks[i];
      const Seen seen{k, i, l.id, t_ns, arrival_ns};
      if (s.kind == Kind::markers && std::isnan(l.yaw_rad)) continue;  // no marker
      if (s.kind == Kind::markers)
        see_marker(sc, number, seen, T_sensor_map * Vector3d(l.p_m),
                   T_sensor_map.linear() * Vector3d(wm::cos(l.yaw_rad), wm::sin(l.yaw_rad), 0), r);
      else
        see_landmark(sc, number, seen, T_sensor_map * Vector3d(l.p_m), r);
    }
  });
}

// A tracker gives a point that comes back after a second another number.
void number_tracks(Recording &r) {
  constexpr wm_time_ns kForgotten_ns = WM_NS_PER_S;
  struct Track {
    wm_time_ns seen_ns;
    int32_t number;
  };
  std::map<int32_t, Track> tracks;
  int32_t next = 1 << 30;  // as our detector's
  for (StereoSeen &row : r.stereo) {
    const auto [at, is_new] = tracks.try_emplace(row.id, Track{row.t_ns, 0});
    Track &track = at->second;
    if (is_new || row.t_ns - track.seen_ns > kForgotten_ns) track.number = next++;
    track.seen_ns = row.t_ns;
    row.id = track.number;
  }
}

void look_by_stereo(const Scenario &sc, size_t number, Recording &r) {
  const Sensor &s = sc.sensors[number];
  const StereoPair pair = StereoPair::drawn(s, sc.errors, r.seed);
  at_its_rate(sc, number, r, [&](uint64_t k, double t_s, wm_time_ns t_ns, wm_time_ns arrival_ns) {
    if (!is_covered(s, r, t_s)) return;
    const Isometry3d T_map_base = true_pose(r, t_s);
    for (size_t i = 0; i < r.landmarks.size(); i++) {
      const wm_landmark &l = r.landmarks[i];
      double left[2], right[2];
      if (pair.see(T_map_base, Vector3d(l.p_m), left, right))
        see_stereo(sc, number, {k, i, l.id, t_ns, arrival_ns}, left, right, r);
    }
  });
  if (s.tracks) number_tracks(r);
}

void look_north(const Scenario &sc, size_t number, Recording &r) {
  const Sensor &s = sc.sensors[number];
  const Random random(r.seed);
  const Isometry3d T_base_sensor = pose_of(s.xyz_m, s.rpy_rad);
  const double deviation = sc.errors.compass_rad * random.normal(Stream::compass, number);
  at_its_rate(sc, number, r, [&](uint64_t k, double t_s, wm_time_ns t_ns, wm_time_ns arrival_ns) {
    const Vector3d p = (true_pose(r, t_s) * T_base_sensor).inverse() * Vector3d(0, kNorth_m, 0);
    Sighting seen{t_ns, arrival_ns, sensor_index(sc, number), kNorthId, 0, NAN, false, NAN, 0};
    const FeatureDice dice(r.seed, number, k, 0);
    seen.outlier = dice.outlier() < s.outlier_fraction;
    seen.bearing_rad = seen.outlier ? wrap(2 * kPi * dice.anything(0))
                                    : wrap(wm::atan2(p.y(), p.x()) + deviation + s.bearing_sigma_rad * dice.noise(0));
    if (dice.missed() >= s.missed_fraction && is_covered(s, r, t_s)) r.sightings.push_back(seen);
  });
  if (std::any_of(r.map.begin(), r.map.end(), [](const wm_landmark &l) { return l.id == kNorthId; })) return;
  wm_landmark north{};
  north.id = kNorthId;
  north.p_m[1] = kNorth_m;
  north.sigma_m = kNorth_m * sc.errors.compass_rad;
  north.yaw_rad = NAN;
  r.map.push_back(north);
}

void find_position(const Scenario &sc, size_t number, Recording &r) {
  const Sensor &s = sc.sensors[number];
  const Random random(r.seed);
  const bool depth = s.kind == Kind::depth;
  const double keep = wm::exp(-1 / (s.rate_hz * s.wander_s)), fresh = std::sqrt(1 - keep * keep);
  double wander[3];
  for (uint64_t i = 0; i < 3; i++) wander[i] = random.normal(Stream::position_wander, 0, 4 * number + i);
  at_its_rate(sc, number, r, [&](uint64_t k, double t_s, wm_time_ns t_ns, wm_time_ns arrival_ns) {
    const Vector3d p = true_pose(r, t_s) * (depth ? Vector3d::Zero() : Vector3d(s.xyz_m[0], s.xyz_m[1], s.xyz_m[2]));
    const FeatureDice dice(r.seed, number, k, 0);
    Fix fix{t_ns,
            arrival_ns,
            static_cast<uint16_t>(64 + number),
            {0, 0, 0},
            depth               ? kNoIdea_m
            : s.stated_xy_m > 0 ? s.stated_xy_m
                                : s.sigma_xy_m,
            s.sigma_z_m,
            dice.outlier() < s.outlier_fraction};
    for (uint64_t i = 0; i < 3; i++) {
      const double sigma = s.noisy ? (i < 2 ? s.sigma_xy_m : s.sigma_z_m) : 0;
      const double off = fix.outlier ? s.outlier_m * (2 * dice.anything(i) - 1) : 0;
      if (!depth || i == 2)
        fix.p_m[i] = p[static_cast<Eigen::Index>(i)] + sigma * dice.noise(i) + s.wander_m * wander[i] + off;
      wander[i] = keep * wander[i] + fresh * random.normal(Stream::position_wander, k + 1, 4 * number + i);
    }
    if (is_covered(s, r, t_s)) r.fixes.push_back(fix);
  });
}

void add_sensor(const char *name, const double xyz_m[3], const double rpy_rad[3], double bearing_sigma_rad,
                double range_sigma_m, bool is_depth, Recording &out) {
  wm_sensor sensor{};
  std::snprintf(sensor.name, sizeof sensor.name, "%s", name);
  std::copy(xyz_m, xyz_m + 3, sensor.mounting.xyz_m);
  std::copy(rpy_rad, rpy_rad + 3, sensor.mounting.rpy_rad);
  sensor.bearing_sigma_rad = bearing_sigma_rad;
  sensor.range_sigma_m = range_sigma_m;
  sensor.max_range_m = INFINITY;
  sensor.range_is_depth = is_depth;
  out.sensors.push_back(sensor);
}

}  // namespace

void list_sensors(const Scenario &sc, Recording &out) {
  out.sensors.clear();
  for (const Camera &c : sc.cameras) {
    const double rpy[3] = {0, 0, c.yaw_rad};
    add_sensor(c.name.c_str(), c.xyz_m, rpy, c.bearing_sigma_rad, NAN, false, out);
  }
  for (const Sensor &s : sc.sensors)
    if (s.kind == Kind::landmarks || s.kind == Kind::markers || s.kind == Kind::compass)
      add_sensor(s.name.c_str(), s.xyz_m, s.rpy_rad,
                 s.gives_bearing || s.kind != Kind::landmarks ? s.bearing_sigma_rad : static_cast<double>(NAN),
                 s.gives_range || s.kind == Kind::markers ? s.range_sigma_m : static_cast<double>(NAN),
                 s.range_is_depth, out);
}

void observe(const Scenario &sc, Recording &out) {
  const Random random(out.seed);
  list_sensors(sc, out);
  for (size_t i = 0; i < sc.cameras.size(); i++) look(sc, random, static_cast<uint16_t>(i), out);
  for (size_t i = 0; i < sc.sensors.size(); i++) {
    const Sensor &s = sc.sensors[i];
    if (by_pictures(sc, s)) continue;
    switch (s.kind) {
      case Kind::landmarks:
      case Kind::markers: look_for_landmarks(sc, i, out); break;
      case Kind::edges: break;  // of pictures alone
      case Kind::stereo: look_by_stereo(sc, i, out); break;
      case Kind::compass: look_north(sc, i, out); break;
      case Kind::gnss:
      case Kind::depth: find_position(sc, i, out); break;
    }
  }
}

}  // namespace wm::sim
