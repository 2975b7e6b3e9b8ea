// SPDX-License-Identifier: Apache-2.0
#include "drives.hpp"

#include <cmath>
#include <cstring>

#include "common/drawn_walls.hpp"
#include "waymark/random.h"

namespace drives {
namespace {

constexpr double kStep_s = 0.01, kTrack_m = 0.5, kWheelbase_m = 1.2, kEyeUp_m = 0.8;
constexpr double kCentre_m[2] = {6.0, 5.0};  // of the circle that the robot drives, and of the room
constexpr double kDowncast_rad = 0.4, kCameraUp_m = 0.5, kCameraAhead_m = 0.5;

double wrapped(double angle) { return std::remainder(angle, 2 * M_PI); }

// The room's walls: 9.6 x 7.6 m, with niches that a half turn about the middle maps onto each other, a
// pillar, and corners that are cut off.
const std::vector<segment> kWalls = {
    {1.2, 1.2, 4, 1.2},     {4, 1.2, 4, 0.8},     {4, 0.8, 5.2, 0.8},    {5.2, 0.8, 5.2, 1.2}, {5.2, 1.2, 10.8, 1.2},
    {10.8, 1.2, 10.8, 8.8}, {10.8, 8.8, 8, 8.8},  {8, 8.8, 8, 9.2},      {8, 9.2, 6.8, 9.2},   {6.8, 9.2, 6.8, 8.8},
    {6.8, 8.8, 1.2, 8.8},   {1.2, 8.8, 1.2, 1.2}, {5.8, 4.8, 6.2, 4.8},  {6.2, 4.8, 6.2, 5.2}, {6.2, 5.2, 5.8, 5.2},
    {5.8, 5.2, 5.8, 4.8},   {8.6, 1.2, 8.6, 2.4}, {8.6, 2.4, 10.8, 2.4}, {2.0, 1.2, 2.0, 3.0}, {2.0, 3.0, 1.2, 3.0},
};

void rotate(const double rpy[3], double out[3][3]) {
  const double cr = std::cos(rpy[0]), sr = std::sin(rpy[0]), cp = std::cos(rpy[1]), sp = std::sin(rpy[1]);
  const double cy = std::cos(rpy[2]), sy = std::sin(rpy[2]);
  const double m[3][3] = {{cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr},
                          {sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr},
                          {-sp, cp * sr, cp * cr}};
  std::memcpy(out, m, sizeof m);
}

}  // namespace

double scene::noise(uint64_t number) { return wm_random_normal(11, 5, number); }

wm_event *scene::add(wm_event_kind kind, double t_s) {
  events_.emplace_back();
  wm_event &e = events_.back();
  std::memset(static_cast<void *>(&e), 0, sizeof e);
  e.kind = static_cast<uint8_t>(kind);
  e.t_ns = e.arrival_ns = wm_ns_from_seconds(t_s);
  return &e;
}

const scene::truth &scene::at(double t_s) const {
  const auto last = static_cast<double>(path_.size() - 1);
  return path_[static_cast<size_t>(std::fmax(0.0, std::fmin(last, std::floor(t_s / kStep_s + 0.5))))];
}

void scene::make_place(unsigned happens) {
  for (int i = 0; i < kLandmarks; i++) {
    const double angle = 2 * M_PI * i / kLandmarks + 0.1, radius = i % 2 ? 4.6 : 3.6;
    const double place[3] = {kCentre_m[0] + radius * std::cos(angle), kCentre_m[1] + radius * std::sin(angle),
                             0.4 + 0.35 * (i % 5)};
    std::memcpy(place_m_[i], place, sizeof place);
    if (happens & kNoMap) continue;
    const double z = i == 7 ? static_cast<double>(NAN) : place[2];
    landmarks_.push_back(
        {10 + i, {place[0] + 0.02 * noise(900 + i), place[1] + 0.02 * noise(950 + i), z}, 0.02, 0.5 * i, {}, 0.01});
  }
  for (int i = 0; i < 2; i++) {
    wm_sensor &s = sensors_[i];
    std::strcpy(s.name, i ? "back" : "front");
    s.mounting = {{i ? -0.3 : 0.3, 0.1, kEyeUp_m}, {0.0, i ? 0.0 : 0.03, i ? M_PI : 0.05}};
    s.bearing_sigma_rad = i ? static_cast<double>(NAN) : 0.02;
    s.range_sigma_m = i ? static_cast<double>(NAN) : 0.05;
    s.max_range_m = i ? 7.5 : static_cast<double>(INFINITY);
  }
  sensors_[0].range_is_depth = (happens & kDepth) != 0;
  wm_rig_init(&rig_);
  rig_.camera_count = 1;
  wm_camera &camera = rig_.cameras[0];
  camera.model = WM_CAMERA_EQUIDISTANT;
  camera.width_px = 640, camera.height_px = 480;
  camera.intrinsics_count = 4;
  const double intrinsics[] = {260, 260, 320, 240};
  std::memcpy(camera.intrinsics, intrinsics, sizeof intrinsics);
  camera.mounting = {{kCameraAhead_m, 0, kCameraUp_m}, {0, kDowncast_rad, 0}};
}

void scene::begin(unsigned happens) {
  constexpr double kPixel_m = 0.05;
  edges_.assign(kMapWidth * kMapHeight, 0);
  drivable_.assign(kMapWidth * kMapHeight, 0);
  const auto pixel = [](double x, double y) {
    const int row = kMapHeight - 1 - static_cast<int>(y / kPixel_m), column = static_cast<int>(x / kPixel_m);
    return static_cast<size_t>(row) * kMapWidth + static_cast<size_t>(column);
  };
  for (double x = 1.3; x < 10.7; x += kPixel_m)
    for (double y = 1.3; y < 8.7; y += kPixel_m) drivable_[pixel(x, y)] = 255;
  for (const segment &w : kWalls)
    for (double u = 0; u <= 1; u += 0.002) edges_[pixel(w.ax + u * (w.bx - w.ax), w.ay + u * (w.by - w.ay))] = 255;
  map_ = {kMapWidth, kMapHeight, kPixel_m, 0, 0, 0, edges_.data(), drivable_.data(), 1};
  setup_.sensors = sensors_;
  setup_.sensor_count = 2;
  setup_.landmarks = landmarks_.data();
  setup_.landmark_count = landmarks_.size();
  setup_.rig = &rig_;
  setup_.map = &map_;
  setup_.seed = 1;
  const truth &start = path_.front();
  const double off = happens & kWrongStart ? 1.5 : 0.03;
  setup_.start = {WM_TIME_NONE, {start.x_m + off, start.y_m - 0.02, 0}, {0, 0, 0, 1}, start.heading_rad + 0.01, 0.05,
                  0.03};
  if (happens & kNoStart) {
    for (double &p : setup_.start.p_m) p = static_cast<double>(NAN);
    setup_.start.heading_rad = static_cast<double>(NAN);
  }
}

const wm_setup &scene::setup(const wm_setup &params) {
  setup_.motion = params.motion;
  setup_.sightings = params.sightings;
  setup_.positions = params.positions;
  setup_.markers = params.markers;
  return setup_;
}

// Stands, drives bends, goes straight, stands again; carried off at half of the time.
void scene::drive(unsigned happens, double seconds) {
  truth p = {kCentre_m[0] + 2.4, kCentre_m[1], M_PI / 2, 0, 0, 0, 0, 0, 0};
  for (int i = 0; i * kStep_s < seconds; i++) {
    const double t = i * kStep_s;
    const bool stands = t < 1.5 || (t > 0.3 * seconds && t < 0.3 * seconds + 1.5);
    const bool straight = t > 6 && t < 7.5;
    p.v_mps = stands ? 0 : 0.55 + 0.1 * std::sin(0.9 * t);
    p.w_radps = stands ? 0 : straight ? 0.03 : p.v_mps / 2.4 * (1 + 0.5 * std::sin(0.8 * t));
    p.roll_rad = 0.007 * std::sin(1.3 * t), p.pitch_rad = 0.006 * std::sin(0.9 * t);
    path_.push_back(p);
    p.left_m += kStep_s * (p.v_mps - 0.505 * kTrack_m * p.w_radps) * 1.01;
    p.right_m += kStep_s * (p.v_mps + 0.505 * kTrack_m * p.w_radps) * 0.995;
    p.heading_rad += 0.5 * kStep_s * p.w_radps;
    p.x_m += kStep_s * p.v_mps * std::cos(p.heading_rad);
    p.y_m += kStep_s * p.v_mps * std::sin(p.heading_rad);
    p.heading_rad += 0.5 * kStep_s * p.w_radps;
    if ((happens & kCarriedOff) && i == static_cast<int>(0.5 * seconds / kStep_s)) {
      p.x_m = 2 * kCentre_m[0] - p.x_m + 0.4;
      p.y_m = 2 * kCentre_m[1] - p.y_m - 0.3;
      p.heading_rad += 1.2;
    }
  }
}

void scene::add_motion(motion by, double t_s, bool glitch) {
  constexpr double kRadius_m = 0.1, kTicksPerTurn = 2000;
  const truth &now = at(t_s);
  const double v = 1.02 * now.v_mps + (glitch ? 6 : 0), w = 1.01 * now.w_radps + 0.004 + (glitch ? 20 : 0);
  if (by == motion::twist) {
    const truth &later = at(t_s + 0.05);
    wm_twist2 &twist = add(WM_EVENT_TWIST2, t_s)->as.twist2;
    twist = {1.02 * later.v_mps, 1.01 * later.w_radps};
    return;
  }
  if (by == motion::sideways) {
    add(WM_EVENT_TWIST6, t_s)->as.twist6 = {{v, 0.05 * std::sin(t_s), 0.0}, {0.0, 0.0, w}, NAN, {}};
    return;
  }
  wm_quantities &q = add(WM_EVENT_QUANTITIES, t_s)->as.quantities;
  const auto tell = [&q](wm_quantity id, double value) {
    q.id[q.count] = static_cast<uint8_t>(id);
    q.value[q.count++] = value;
  };
  if (by == motion::ticks || by == motion::ticks_and_gyro) {
    const double per_m = kTicksPerTurn / (2 * M_PI * kRadius_m);
    tell(WM_Q_WHEEL_TICKS_LEFT, std::floor(now.left_m * per_m));
    tell(WM_Q_WHEEL_TICKS_RIGHT, std::floor(now.right_m * per_m));
  }
  if (by == motion::ticks_and_gyro || by == motion::speed_and_gyro) tell(WM_Q_YAW_RATE, w + 0.004 * normal());
  if (by == motion::speed_and_gyro || by == motion::steering) tell(WM_Q_VEHICLE_SPEED, v);
  if (by == motion::steering)
    tell(WM_Q_ROAD_WHEEL, now.v_mps > 0 ? std::atan(kWheelbase_m * now.w_radps / now.v_mps) + 0.01 : 0.0);
}

// A coded marker with the wrong one of two poses in every fourth sighting.
void scene::add_marker(int sensor, int landmark, const double level_m[3], double yaw_rad, double t_s, bool wrong) {
  wm_marker &m = add(WM_EVENT_MARKER, t_s)->as.marker;
  m.sensor = static_cast<uint16_t>(sensor);
  m.id = 10 + landmark;
  m.poses = 1;
  for (int k = 0; k < 3; k++) m.p_m[k] = level_m[k] * (1 + 0.004 * normal());
  m.p_m[0] += 0.02 * level_m[2];  // the camera leans
  m.p_m[2] -= 0.02 * level_m[0];
  m.yaw_rad = wrapped(yaw_rad + 0.01 * normal() + (wrong ? 0.8 : 0.0));
  const bool knows = seen_ % 3 == 0;
  m.yaw_sigma_rad = knows ? 0.015 : static_cast<double>(NAN);
  m.along_sigma_m = knows ? 0.01 * std::fabs(level_m[0]) : static_cast<double>(NAN);
  m.bloom_px = static_cast<double>(NAN);
  if (seen_ % 4 != 1) return;
  m.poses = 2;
  std::memcpy(m.other_p_m, m.p_m, sizeof m.p_m);
  m.other_yaw_rad = m.yaw_rad;
  m.yaw_rad = wrapped(m.yaw_rad + 0.5);
}

void scene::add_sighting(unsigned sees, int sensor, int landmark, double t_s, bool wrong) {
  constexpr double kAge_s = 0.04;
  const truth &then = at(t_s - kAge_s);
  const wm_sensor &s = sensors_[sensor];
  const double heading = then.heading_rad + s.mounting.rpy_rad[2] + 0.01, c = std::cos(then.heading_rad),
               d = std::sin(then.heading_rad);
  const double *xyz = s.mounting.xyz_m, *place = place_m_[landmark];
  const double dx = place[0] - then.x_m - c * xyz[0] + d * xyz[1], dy = place[1] - then.y_m - d * xyz[0] - c * xyz[1];
  const double bearing = wrapped(std::atan2(dy, dx) - heading), range = std::hypot(dx, dy);
  if (std::fabs(bearing) > 1.3 || range > s.max_range_m) return;
  seen_++;
  const double up = place[2] - xyz[2];
  if (sees & kMarkers) {
    const double level[3] = {range * std::cos(bearing), range * std::sin(bearing), up};
    add_marker(sensor, landmark, level, 0.5 * landmark - heading, t_s, wrong);
    return;
  }
  wm_sighting &out = add(WM_EVENT_SIGHTING, t_s)->as.sighting;
  out = wm_sighting_without_numbers();
  out.sensor = static_cast<uint16_t>(sensor);
  out.landmark_id = 10 + landmark;
  if (sees & kBearings) out.bearing_rad = wrapped(bearing + 0.015 * normal() + (wrong ? 0.9 : 0.0));
  if (sees & kRanges)
    out.range_m =
        (s.range_is_depth ? std::fmax(0.1, range * std::cos(bearing)) : range) * 1.02 + 0.05 + 0.04 * normal();
  if (sees & kElevations) {
    const double tilt = then.roll_rad * std::sin(bearing) + then.pitch_rad * std::cos(bearing);
    out.elevation_rad = std::atan2(up, range) + tilt + s.mounting.rpy_rad[1] + 0.004 * normal();
    out.elevation_sigma_rad = 0.004;
  }
  if ((sees & kNameless) && seen_ % 2) out.landmark_id = -1;
  if (sees & kRenamed) out.landmark_id += 100 * static_cast<int>(t_s / 8);
}

void scene::add_sightings(unsigned sees, unsigned happens, double t_s, double seconds) {
  if ((happens & kBlind) && t_s > 0.6 * seconds && t_s < 0.85 * seconds) return;
  if ((happens & kOneMoved) && t_s > 0.33 * seconds) place_m_[2][0] = kCentre_m[0] + 2.2, place_m_[2][1] = 6.0;
  for (int i = 0; i < kLandmarks; i++) {
    if ((happens & kFewBeacons) && i != 3 && i != 7) continue;
    for (int sensor = 0; sensor < 2; sensor++)
      add_sighting(sees, sensor, i, t_s, (happens & kOutliers) && seen_ % 13 == 12);
  }
}

// Edge points of the floor as a camera sees them that is pitched, higher and later than the calibration has it.
void scene::add_scan(unsigned happens, double t_s) {
  const truth &then = at(t_s - 0.03);
  const double eye[2] = {then.x_m + kCameraAhead_m * std::cos(then.heading_rad),
                         then.y_m + kCameraAhead_m * std::sin(then.heading_rad)};
  wm_points &p = add(WM_EVENT_POINTS, t_s)->as.points;
  p.camera = 0;
  seen_++;
  for (int i = 0; i < 110; i++) {
    const double angle = -1.2 + 2.4 * i / 109;
    double normal_rad = 0, range = cast(kWalls, eye[0], eye[1], then.heading_rad + angle, &normal_rad);
    if (happens & kReflections) {
      if (i % 9 < 2) range *= 0.8;
      if (i > 50 && i < 62) range = std::fmin(range, 1.6);
      if (i > 95) range *= 1.3;
    }
    if (range < 0.3 || range > 7.5) continue;
    const double below = std::atan2(kCameraUp_m + 0.01, range) - 0.006 * std::cos(angle) + 0.0015 * normal();
    if (below < 0.04) continue;
    const double seen = kCameraUp_m / std::tan(below);
    p.x_m[p.count] = static_cast<float>(kCameraAhead_m + seen * std::cos(angle + 0.004));
    p.y_m[p.count] = static_cast<float>(seen * std::sin(angle + 0.004));
    p.normal_rad[p.count] = i % 4 ? static_cast<float>(wrapped(normal_rad - then.heading_rad + 0.05 * normal())) : NAN;
    p.sigma_m[p.count] = seen_ % 2 ? NAN : static_cast<float>(0.004 * seen);
    p.count++;
  }
}

scene::scene(motion by, unsigned sees, unsigned happens, double seconds) {
  drive(happens, seconds);
  make_place(happens);
  begin(happens);
  setup_.wheels = {0.1, 2000, kTrack_m, kWheelbase_m, 15, static_cast<double>(NAN), 0, {}, {}};
  for (int i = 1; i * 0.05 < seconds; i++) {
    const double t = i * 0.05;
    const bool silent = (happens & kSilence) && ((t > 4 && t < 4.6) || (t > 0.6 * seconds && t < 0.6 * seconds + 3));
    if (!silent) add_motion(by, t, (happens & kGlitches) && i % 60 == 50);
    const double seen_s = t + 0.001;
    if (i % 4 == 0 && (sees & (kBearings | kRanges | kMarkers))) add_sightings(sees, happens, seen_s, seconds);
    if (i % 2 == 0 && (sees & kPoints)) add_scan(happens, seen_s + 0.001);
    const truth &then = at(t - 0.1);
    if (i % 20 == 10 && (sees & kPositions)) {
      const double off = (happens & kOutliers) && i % 100 == 50 ? 20 : 0;
      add(WM_EVENT_POSITION, seen_s + 0.002)->as.position = {
          {then.x_m + 0.3 + off + 0.4 * normal(), then.y_m - 0.2 + 0.4 * normal(), static_cast<double>(NAN)},
          i % 40 == 10 ? 0.005 : 0.5,
          static_cast<double>(NAN)};
    }
    if (i % 40 == 20 && (sees & kHeadings))
      add(WM_EVENT_HEADING, seen_s + 0.002)->as.heading = {wrapped(at(t).heading_rad + 0.05 * normal()), 0.05};
  }
}

// Circles of 4 m, 2.4 m above the floor, with a slow roll and pitch.
dive::placed dive::swim(double t_s, bool carried) const {
  const double yaw = 0.14 * t_s, radius = 4.0;
  placed out = {{radius * std::sin(yaw), radius * (1 - std::cos(yaw)), 2.4 + 0.1 * std::sin(0.4 * t_s)}, {}};
  const double rpy[3] = {0.05 * std::sin(0.7 * t_s), 0.04 * std::sin(0.5 * t_s), carried ? yaw + 0.7 : yaw};
  if (carried) out.p[0] += 1.5, out.p[1] -= 1.0;
  rotate(rpy, out.R);
  return out;
}

void dive::add_picture(const placed &vehicle, double t_s, unsigned happens) {
  constexpr double kFocal_px = 420, kBaseline_m = 0.3;
  const wm_camera &left = rig_.cameras[0];
  double mounted[3][3];
  rotate(left.mounting.rpy_rad, mounted);
  int told = 0;
  for (int i = 0; i < 400 && told < 24; i++) {
    const double place[3] = {-6 + 12.0 * ((i * 37) % 400) / 400, -2 + 12.0 * i / 400, 0.3 * std::sin(1.7 * i)};
    double body[3] = {}, camera[3] = {};
    for (int r = 0; r < 3; r++)
      for (int k = 0; k < 3; k++) body[r] += vehicle.R[k][r] * (place[k] - vehicle.p[k]);
    for (int r = 0; r < 3; r++)
      for (int k = 0; k < 3; k++) camera[r] += mounted[k][r] * (body[k] - left.mounting.xyz_m[k] - 0.01);
    const double ahead = camera[0], across = -camera[1], down = -camera[2];
    if (ahead < 0.5) continue;
    const double u = 321 + kFocal_px * across / ahead + 2.0, v = 238 + kFocal_px * down / ahead;
    const double right = u - kFocal_px * kBaseline_m / ahead;
    if (u < 5 || u > 635 || v < 5 || v > 475 || right < 5) continue;
    if ((i + static_cast<int>(t_s)) % 7 == 0) continue;  // missed for a second
    told++;
    const double bad = (happens & kOutliers) && (told + static_cast<int>(5 * t_s)) % 17 == 0 ? 9.0 : 0.0;
    wm_stereo &s = add(WM_EVENT_STEREO, t_s)->as.stereo;
    s = {i, {u + 0.4 * normal() + bad, v + 0.4 * normal()}, {right + 0.4 * normal(), v + 0.4 * normal()}, {}};
    if (told % 6 == 0) s.right_px[0] = s.right_px[1] = static_cast<double>(NAN);
  }
}

void dive::add_beacons(const placed &vehicle, double t_s, bool marked) {
  for (int i = 0; i < 3; i++) {
    const double beacon[3] = {6.0 * std::cos(2.1 * i), 4 + 6.0 * std::sin(2.1 * i), 0.5};
    double to[3], body[3] = {}, length = 0;
    for (int k = 0; k < 3; k++) to[k] = beacon[k] - vehicle.p[k], length += to[k] * to[k];
    for (int r = 0; r < 3; r++)
      for (int k = 0; k < 3; k++) body[r] += vehicle.R[k][r] * to[k];
    if (marked) {
      for (double &b : body) b += 0.02 * normal();
      add_marker(1, i, body, 0.0, t_s + 0.001 * i, false);
      events_.back().as.marker.id = 900 + i;
      continue;
    }
    wm_sighting &s = add(WM_EVENT_SIGHTING, t_s + 0.001 * i)->as.sighting;
    s = wm_sighting_without_numbers();
    s.sensor = 1;
    s.landmark_id = 900 + i;
    s.bearing_rad = std::atan2(body[1], body[0]) + 0.03 + 0.02 * normal();
    s.range_m = std::sqrt(length) + 0.1 + 0.05 * normal();
  }
}

// At rest but for the slow turns, with a constant error and the noise of a shaken accelerometer.
void dive::add_imu(double t_s) {
  const placed vehicle = swim(t_s, false);
  wm_quantities &q = add(WM_EVENT_QUANTITIES, t_s)->as.quantities;
  const double w[3] = {0.035 * std::cos(0.7 * t_s) + 0.004, 0.02 * std::cos(0.5 * t_s), 0.14};
  static constexpr wm_quantity kOf[6] = {WM_Q_ROLL_RATE,      WM_Q_PITCH_RATE,     WM_Q_YAW_RATE,
                                         WM_Q_ACCELERATION_X, WM_Q_ACCELERATION_Y, WM_Q_ACCELERATION_Z};
  for (int i = 0; i < 6; i++) {
    q.id[q.count] = static_cast<uint8_t>(kOf[i]);
    q.value[q.count++] = i < 3 ? w[i] + 0.003 * normal() : 9.80665 * vehicle.R[2][i - 3] + 0.1 + 0.3 * normal();
  }
}

dive::dive(unsigned happens, double seconds) {
  path_.push_back({0, 0, 0, 0, 0, 0, 0, 0, 0});
  make_place(kNoMap);
  sensors_[1].max_range_m = 50;
  rig_.camera_count = 2;
  for (int i = 0; i < 2; i++) {
    wm_camera &c = rig_.cameras[i];
    c = rig_.cameras[0];
    c.model = WM_CAMERA_PINHOLE_RADTAN;
    c.mounting = {{0.4, 0.15 - 0.3 * i, -0.1}, {0, 0.85, 0}};
  }
  rig_.stereo = {0, 1, 0.3, {420, 420, 321, 238}, {0.5, 0.5, 0.5, 0.5}};
  if (!(happens & kNoMap)) {
    for (int i = 0; i < 400; i += 2)
      landmarks_.push_back(
          {i,
           {-6 + 12.0 * ((i * 37) % 400) / 400 + 0.01 * noise(i), -2 + 12.0 * i / 400, 0.3 * std::sin(1.7 * i)},
           0.01,
           static_cast<double>(NAN),
           {},
           0});
  }
  for (int i = 0; i < 3; i++)
    landmarks_.push_back(
        {900 + i, {6.0 * std::cos(2.1 * i), 4 + 6.0 * std::sin(2.1 * i), 0.5}, 0.02, static_cast<double>(NAN), {}, 0});
  begin(happens);
  setup_.map = nullptr;
  if (!(happens & kNoStart)) {
    const placed start = swim(0, false);
    setup_.start.p_m[0] = start.p[0], setup_.start.p_m[1] = start.p[1], setup_.start.p_m[2] = start.p[2];
    setup_.start.heading_rad = 0;
    if (happens & kWrongStart) setup_.start.p_m[0] += 2;
  }
  for (int i = 1; i * 0.1 < seconds; i++) {
    const double t = 0.1 * i;
    const bool carried = (happens & kCarriedOff) && t > 0.5 * seconds;
    const placed vehicle = swim(t - 0.02, carried);
    const bool silent = (happens & kSilence) && ((t > 3 && t < 3.7) || (t > 0.6 * seconds && t < 0.6 * seconds + 3));
    const bool glitch = (happens & kGlitches) && i % 30 == 20;
    if (!silent)
      add(WM_EVENT_TWIST6, t)->as.twist6 = {
          {(glitch ? 30 : 0.57) + 0.1 * std::sin(t) + 0.02 * normal(), 0.02 * normal(),
           0.04 * std::cos(0.4 * t) + 0.02 * normal()},
          {0.035 * std::cos(0.7 * t) + 0.004 + 0.003 * normal(), 0.02 * std::cos(0.5 * t) + 0.003 * normal(),
           (glitch ? 20 : 0.14) + 0.003 * normal()},
          NAN,
          {}};
    const bool blind = (happens & kBlind) && t > 0.4 * seconds && t < 0.7 * seconds;
    if (i % 2 == 0 && !blind) add_picture(vehicle, t + 0.002, happens);
    if (i % 10 == 5) add_beacons(vehicle, t + 0.01, (happens & kMarked) != 0);
    if (i % 10 == 7)
      add(WM_EVENT_POSITION, t + 0.01)->as.position = {
          {static_cast<double>(NAN), static_cast<double>(NAN), vehicle.p[2] + 0.02 * normal()},
          static_cast<double>(NAN),
          0.03};
    if (i % 30 == 9)
      add(WM_EVENT_HEADING, t + 0.01)->as.heading = {std::atan2(vehicle.R[1][0], vehicle.R[0][0]) + 0.04, 0.05};
    if ((happens & kReceiver) && i % 5 == 3) {
      const placed before = swim(t - 0.1, carried);
      const double sigma_m = t < 0.5 * seconds ? 0.05 : 0.5;
      add(WM_EVENT_POSITION, t + 0.01)->as.position = {
          {before.p[0] + sigma_m * normal(), before.p[1] + sigma_m, before.p[2] + sigma_m * normal()},
          sigma_m,
          sigma_m};
    }
    for (int k = 1; (happens & kImu) && k < 5; k++) add_imu(t + 0.02 * k);
  }
}

}  // namespace drives
