// SPDX-License-Identifier: Apache-2.0
#include "pictures.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/fisheye_rig.hpp"
#include "waymark/mr_code.h"

namespace pictures {
namespace {

vec operator+(const vec &a, const vec &b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
vec operator*(double s, const vec &a) { return {s * a.x, s * a.y, s * a.z}; }

// Rz(yaw) Ry(pitch) Rx(roll) v
vec turned(const double rpy[3], vec v) {
  const double cr = std::cos(rpy[0]), sr = std::sin(rpy[0]), cp = std::cos(rpy[1]), sp = std::sin(rpy[1]),
               cy = std::cos(rpy[2]), sy = std::sin(rpy[2]);
  v = {v.x, cr * v.y - sr * v.z, sr * v.y + cr * v.z};
  v = {cp * v.x + sp * v.z, v.y, cp * v.z - sp * v.x};
  return {cy * v.x - sy * v.y, sy * v.x + cy * v.y, v.z};
}

// Evenly in [0, 1), by number.
double dice(uint64_t seed, uint64_t number) {
  uint64_t bits = (number + 1) * UINT64_C(0x9E3779B97F4A7C15) + seed * UINT64_C(0xD1B54A32D192ED03);
  bits = (bits ^ (bits >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
  bits = (bits ^ (bits >> 27)) * UINT64_C(0x94D049BB133111EB);
  return static_cast<double>((bits ^ (bits >> 31)) >> 11) * 0x1p-53;
}

struct robot {
  vec p;
  double rpy[3];
};

wm_camera camera_of(int model, uint32_t width, uint32_t height, double focal_px, const wm_mounting &mounting) {
  wm_camera c{};
  c.model = model;
  c.width_px = width, c.height_px = height;
  c.intrinsics_count = 4;
  const double intrinsics[] = {focal_px, focal_px, 0.5 * width - 0.5, 0.5 * height - 0.5};
  std::copy(intrinsics, intrinsics + 4, c.intrinsics);
  c.mounting = mounting;
  return c;
}

// Ray of a pixel in the camera's body axes (ahead, left, up).
vec ray_of(const wm_camera &c, double u, double v) {
  const double a = (u - c.intrinsics[2]) / c.intrinsics[0], b = (v - c.intrinsics[3]) / c.intrinsics[1];
  if (c.model == WM_CAMERA_PINHOLE_RADTAN) return {1, -a, -b};
  const double angle = std::hypot(a, b), part = angle > 1e-9 ? std::sin(angle) / angle : 1;
  return {std::cos(angle), -part * a, -part * b};
}

// Adds one picture of each camera, taken by `from` at 0.1 s times its number. Pixels are areas, with noise.
void shoot(film &out, const robot &from, const world &of, double noise_grey) {
  const auto number = static_cast<int>(out.predictions.size());
  for (const int32_t index : out.cameras) {
    const wm_camera &c = out.rig.cameras[index];
    const double *xyz = c.mounting.xyz_m;
    const vec eye = from.p + turned(from.rpy, {xyz[0], xyz[1], xyz[2]});
    std::vector<uint8_t> grey(static_cast<size_t>(c.width_px) * c.height_px);
    for (uint32_t v = 0; v < c.height_px; v++)
      for (uint32_t u = 0; u < c.width_px; u++) {
        double sum = 0;
        for (int i = 0; i < 4; i++) {
          const vec ray = ray_of(c, i % 2 ? u + 0.25 : u - 0.25, i < 2 ? v - 0.25 : v + 0.25);
          sum += of(eye, turned(from.rpy, turned(c.mounting.rpy_rad, ray)), number);
        }
        const size_t at = static_cast<size_t>(v) * c.width_px + u;
        const double noise =
            noise_grey * 3.46 * (dice(7 * static_cast<uint64_t>(number) + static_cast<uint64_t>(index), at) - 0.5);
        grey[at] = static_cast<uint8_t>(std::clamp(sum / 4 + noise + 0.5, 0.0, 255.0));
      }
    out.grey.push_back(std::move(grey));
    const wm_time_ns t = 1'000'000'000 + 100'000'000 * static_cast<wm_time_ns>(number);
    out.frames.push_back(
        {t, t, 0, static_cast<uint64_t>(number), index, c.width_px, c.height_px, c.width_px, out.grey.back().data()});
  }
  wm_estimate e{};
  e.t_ns = out.frames.back().t_ns;
  e.pose_map_base.p_m[0] = from.p.x, e.pose_map_base.p_m[1] = from.p.y;
  e.heading_rad = from.rpy[2];
  e.pose_map_base.q_xyzw[2] = std::sin(0.5 * from.rpy[2]), e.pose_map_base.q_xyzw[3] = std::cos(0.5 * from.rpy[2]);
  e.covariance[wm_cov_index(0, 0)] = e.covariance[wm_cov_index(1, 1)] = 0.03 * 0.03;
  e.covariance[wm_cov_index(5, 5)] = 0.005 * 0.005;
  e.dof = 3;
  e.state = WM_STATE_TRACKING;
  out.predictions.push_back(e);
}

double smooth_noise(double x, double y, uint64_t seed) {
  const double i = std::floor(x), j = std::floor(y), a = x - i, b = y - j;
  const auto at = [&](double k, double l) {
    const auto n = static_cast<int64_t>(k) * 4096 + static_cast<int64_t>(l) + (INT64_C(1) << 40);
    return dice(seed, static_cast<uint64_t>(n));
  };
  return (at(i, j) * (1 - a) + at(i + 1, j) * a) * (1 - b) + (at(i, j + 1) * (1 - a) + at(i + 1, j + 1) * a) * b;
}

// A room: bright floor, dark boards at x = 3.4 m and y = +-1.6 m, a corner that juts out, a round pillar; joints of
// tiles, tape, a mirrored board, faint and short edges.
double room_grey(const vec &eye, const vec &ray, int /*picture*/) {
  if (ray.z > -1e-3) return 60;
  const double s = -eye.z / ray.z, x = eye.x + s * ray.x, y = eye.y + s * ray.y;
  const bool juts = x > 2.4 && y > 0.9, pillar = std::hypot(x - 2.2, y + 0.9) < 0.35;
  if (x > 3.4 || std::fabs(y) > 1.6 || juts || pillar) return 60;
  if (x > 3.1 && y < 0.3) return 95;                                      // the board's image in the floor
  if (x > 3.0 && x < 3.05 && y > 0.4) return 120;                         // faint
  if (std::fabs(x - 1.6) < 0.035 && y > -0.2) return 75;                  // tape across
  if (std::fabs(x - 1.9) < 0.012) return 85;                              // a joint
  if (std::fabs(y - 0.5) < 0.02) return 80;                               // a joint along the way
  if (std::fabs(x - 2.6) < 0.06 && std::fabs(y + 0.1) < 0.04) return 70;  // a short thing
  if (std::fabs(x - 2.8) < 0.15 && y > -1.0 && y < -0.6) return 128;      // a stain
  return 140 + 4 * std::sin(9 * x) * std::sin(7 * y);
}

// Upright stripes all round; some begin high (lamps), some are short, one vanishes for pictures 4 to 8.
double upright_grey(const vec & /*eye*/, const vec &ray, int picture) {
  const double azimuth = std::atan2(ray.y, ray.x), elevation = std::atan2(ray.z, std::hypot(ray.x, ray.y));
  const double turn = (azimuth + M_PI) * 14 / (2 * M_PI), lean = 0.15 * elevation;
  const int stripe = static_cast<int>(turn + lean * 0.1) % 14;
  const double low[] = {-0.5, -0.5, 0.2, -0.5, 0.45}, high[] = {0.9, 0.5, 0.7, 0.12, 0.9};
  if (stripe % 2 == 0 || (stripe == 5 && picture >= 4 && picture <= 8)) return 110;
  if (elevation < low[stripe % 5] || elevation > high[stripe % 5]) return 110;
  const double step[] = {40, -30, 9, 55, -14};
  return 110 + step[(stripe / 2) % 5] + (picture > 5 ? 8 : 0);
}

double sea_grey(const vec &eye, const vec &ray, int picture) {
  if (ray.z > -0.05) return 90;
  const double s = -eye.z / ray.z, x = eye.x + s * ray.x, y = eye.y + s * ray.y;
  double grey = 70 + 50 * smooth_noise(14 * x, 14 * y, 1) + 40 * smooth_noise(41 * x, 41 * y, 2);
  for (int i = 0; i < 12; i++) {  // in the water, each on its own way
    const vec at = {eye.x + 0.9 + 0.07 * i + 0.05 * std::sin(picture + i), eye.y - 0.5 + 0.09 * i, eye.z - 0.8};
    const vec to = at + -1.0 * eye;
    const double along = (to.x * ray.x + to.y * ray.y + to.z * ray.z) / (ray.x * ray.x + ray.y * ray.y + ray.z * ray.z);
    const vec off = to + -along * ray;
    if (std::hypot(std::hypot(off.x, off.y), off.z) < 0.012) grey += 60;
  }
  return grey;
}

// Prints at x = 1.2 m: black and white, faint, and another identity.
double print_grey(const vec &eye, const vec &ray, int /*picture*/) {
  constexpr double kSize_m = 0.25, kAway_m = 1.2;
  static const uint64_t modules[] = {wm_mr_encode(9), wm_mr_encode(3), wm_mr_encode(700)};
  if (ray.x < 0.05) return 120;
  const double s = (kAway_m - eye.x) / ray.x, y = eye.y + s * ray.y, z = eye.z + s * ray.z;
  const double black[] = {30, 100, 60}, white[] = {220, 126, 170};
  for (int i = 0; i < 3; i++) {
    const int ink = wm_mr_ink(modules[i], -(y - 0.45 * (i - 1)) / kSize_m, -(z - 1.0) / kSize_m);
    if (ink >= 0) return ink ? black[i] : white[i];
  }
  return 120;
}

constexpr int kSide = 48;  // of a sign, px
constexpr double kSign_m = 0.6;

// By these cameras, number 0 first.
std::unique_ptr<film> film_of(std::initializer_list<wm_camera> cameras) {
  auto out = std::make_unique<film>();
  out->rig = wm::drawn::rig_of(cameras);
  for (int32_t i = 0; i < static_cast<int32_t>(cameras.size()); i++) out->cameras.push_back(i);
  return out;
}

}  // namespace

wm_view film::view() const {
  return {&rig,
          cameras.data(),
          landmarks.data(),
          landmarks.size(),
          appearances.data(),
          appearances.size(),
          cascades.data(),
          cascades.size()};
}

std::unique_ptr<film> floor_film() {
  auto out = film_of({camera_of(WM_CAMERA_EQUIDISTANT, 640, 360, 260, {{0.3, 0, 0.4}, {0, 22 * M_PI / 180, 0}})});
  for (int i = 0; i < 2; i++) shoot(*out, {{0.2 * i, 0.1 * i, 0}, {0, 0, 0.1 * i}}, room_grey, 1.5);
  return out;
}

std::unique_ptr<film> upright_film() {
  auto out = film_of({camera_of(WM_CAMERA_EQUIDISTANT, 400, 400, 115, {{0, 0, 0.8}, {0, -M_PI / 2, 0}})});
  for (int i = 0; i < 14; i++)
    shoot(*out, {{0, 0, 0}, {0.008, -0.006, 0.06 * i + (i == 10 ? 0.25 : 0)}}, upright_grey, 1.5);
  return out;
}

std::unique_ptr<film> stereo_film() {
  const auto side = [](double y_m) {
    return camera_of(WM_CAMERA_PINHOLE_RADTAN, 400, 300, 260, {{0.4, y_m, -0.1}, {0, 48 * M_PI / 180, 0}});
  };
  auto out = film_of({side(0.15), side(-0.15)});
  out->rig.stereo = {0, 1, 0.3, {260, 260, 199.5, 149.5}, {0.5, 0.5, 0.5, 0.5}};
  for (int i = 0; i < 6; i++) shoot(*out, {{0.05 * i, 0.01 * i, 2.2}, {0.01 * i, 0.005 * i, 0.015 * i}}, sea_grey, 1.5);
  return out;
}

std::unique_ptr<film> marker_film() {
  auto out = film_of({camera_of(WM_CAMERA_EQUIDISTANT, 640, 360, 330, {{0, 0, 1}, {0, 0, 0}})});
  std::strcpy(out->rig.marker_family, "mr");
  out->rig.marker_size_m = 0.25;
  for (int i = 0; i < 2; i++) shoot(*out, {{0.05 * i, 0.02, 0}, {0, 0, 0.02}}, print_grey, 1);
  return out;
}

// Signs at different distances and angles on both sides of a street. A square of white is what the cascade finds.
std::unique_ptr<film> street_film(bool lost, int signs) {
  auto out = film_of({camera_of(WM_CAMERA_EQUIDISTANT, 640, 400, 300, {{0, 0, 1.4}, {0, 0, 0}})});
  out->signs.resize(static_cast<size_t>(signs));
  for (int i = 0; i < signs; i++) {
    std::vector<uint8_t> &sign = out->signs[static_cast<size_t>(i)];
    for (int k = 0; k < kSide * kSide; k++) {
      const auto row = static_cast<uint64_t>(k / kSide / 8), column = static_cast<uint64_t>(k % kSide / 8);
      const bool middle = row >= 2 && row < 4 && column >= 2 && column < 4;
      const double drawn = dice(static_cast<uint64_t>(i), row * 6 + column);
      sign.push_back(middle ? 230 : drawn > 0.5 ? 130 : 40);
    }
    const double away = 3 + 1.7 * i, across = (i - 2.5) * 0.4 * away;
    out->landmarks.push_back({i + 1, {away, across, 1.4 + 0.1 * away}, 0.02, static_cast<double>(NAN), {}, 0});
    out->appearances.push_back({i + 1, kSide, kSide, sign.data(), kSign_m, kSign_m, -M_PI / 2 + 0.4 * (i % 3 - 1)});
  }
  // The block in the middle of 3 x 3 is brighter than all about it.
  static wm_cascade_feature block = {{0}, {0}, {4}, {4}, {1}};
  static wm_cascade_node brighter = {{0, -1}, 0, 0, {1, 0, 0, 0, 0, 0, 0, 0}};
  static float leaves[] = {1, -1};
  static wm_cascade_tree tree = {0, 0};
  static wm_cascade_stage stage = {0, 1, 0};
  out->cascades = {{1, 12, 12, 0.6, 1, 1, 2, 1, 1, &block, &brighter, leaves, &tree, &stage}};
  const film &made = *out;
  const world street = [&made](const vec &eye, const vec &ray, int picture) {
    double nearest = 1e9, grey = 95 + 25 * std::sin(11 * ray.y / (std::fabs(ray.x) + 0.1)) * std::sin(9 * ray.z);
    for (size_t i = 0; i < made.signs.size(); i++) {
      const double *p = made.landmarks[i].p_m, yaw = made.appearances[i].yaw_rad;
      const double nx = -std::sin(yaw), ny = std::cos(yaw), slope = nx * ray.x + ny * ray.y;
      const double s = (nx * (p[0] - eye.x) + ny * (p[1] - eye.y)) / slope;
      if (!(s > 0 && s < nearest)) continue;
      const double a =
          ((eye.x + s * ray.x - p[0]) * std::cos(yaw) + (eye.y + s * ray.y - p[1]) * std::sin(yaw)) / kSign_m + 0.5;
      const double b = 0.5 - (eye.z + s * ray.z - p[2]) / kSign_m;
      if (a < 0 || a >= 1 || b < 0 || b >= 1) continue;
      nearest = s;
      const auto row = static_cast<size_t>(b * kSide), column = static_cast<size_t>(a * kSide);
      const double own = made.signs[i][row * kSide + column];
      // One is dirty, one pale.
      grey = i == 1 ? 0.6 * own + 60 * smooth_noise(9 * a, 9 * b, 4) : i == 3 ? 100 + 0.05 * own : own;
    }
    return grey + (picture > 2 ? 5 : 0);
  };
  for (int i = 0; i < (lost ? 8 : 5); i++) {
    shoot(*out, {{0.1 * i, 0.05, 0}, {0.004, 0.003, 0.02}}, street, 2);
    wm_estimate &e = out->predictions.back();
    if (lost && i < 2) e.state = WM_STATE_SEARCHING;
    if (lost && i >= 2) {  // sure of a wrong pose, and late
      e.pose_map_base.p_m[1] += 1.5;
      out->frames.back().t_ns += INT64_C(400'000'000) * i;
    }
    e.covariance[wm_cov_index(1, 1)] = i == 3 ? 0.04 : 0.03 * 0.03;
  }
  return out;
}

}  // namespace pictures
