// SPDX-License-Identifier: Apache-2.0
#include "simulate/measured.h"

#include <cmath>

#include "simulate/angle.h"
#include "simulate/motion.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

using Eigen::Vector3d;

constexpr double kSample_s = 0.005;   // of the truth
constexpr double kVibration_hz = 23;  // of a motor or a propeller
constexpr double kVibrationHz[3] = {kVibration_hz, 1.3 * kVibration_hz, 1.7 * kVibration_hz};
constexpr double kBumpLasts_s = 0.05;  // half a sine

wm_time_ns stamp(const Recording &r, double t_s) {
  return r.clock_start_ns + static_cast<wm_time_ns>(std::llround(t_s * 1e9));
}

bool stands(const State &from, const State &to) {
  return from.x_m == to.x_m && from.y_m == to.y_m && from.heading_rad == to.heading_rad;
}

struct Planar {
  double v, u, w;
};

// The twist that moves from one pose to the other in `step_s`.
Planar twist_between(const State &from, const State &to, double step_s) {
  const double turned = to.heading_rad - to.carried_heading_rad - (from.heading_rad - from.carried_heading_rad);
  const double half = 0.5 * turned, middle = from.heading_rad + half, c = wm::cos(middle), s = wm::sin(middle);
  const double arc = std::fabs(half) > 1e-9 ? half / wm::sin(half) : 1;  // over its chord
  const double dx = to.x_m - from.x_m, dy = to.y_m - from.y_m;
  return {arc * (c * dx + s * dy) / step_s, arc * (c * dy - s * dx) / step_s, turned / step_s};
}

// Rates and specific force (acceleration less gravity, in axes of the body), exact.
struct Inertial {
  Vector3d w, f;
};

Inertial inertial_at(const Recording &r, double t_s, double step_s) {
  const double middle_s = t_s + 0.5 * step_s;
  const Vector3d up(0, 0, kGravity_mps2);
  if (r.path.duration_s() > 0) {
    const State6 a = r.path.at(t_s), b = r.path.at(t_s + step_s), m = r.path.at(middle_s);
    const auto velocity = [](const State6 &s) {
      return Vector3d(pose_of(s.xyz_m.data(), s.rpy_rad.data()).linear() * Vector3d(s.velocity_body_mps.data()));
    };
    const Eigen::Matrix3d R = pose_of(m.xyz_m.data(), m.rpy_rad.data()).linear();
    return {Vector3d(m.rate_body_radps.data()), R.transpose() * ((velocity(b) - velocity(a)) / step_s + up)};
  }
  const State a = r.drive.at(t_s), b = r.drive.at(t_s + step_s), m = r.drive.at(middle_s);
  const double w = twist_between(a, b, step_s).w;
  return {Vector3d(0, 0, w), Vector3d((b.speed_mps - a.speed_mps) / step_s - w * m.side_mps,
                                      (b.side_mps - a.side_mps) / step_s + w * m.speed_mps, kGravity_mps2)};
}

// Shakes of the accelerometer: vibration with a phase of the seed's, and bumps at places of its.
class Shaking {
 public:
  Shaking(const Motion &m, const Random &random, double duration_s) : m_(m) {
    for (uint64_t i = 0; i < 3; i++) phase_[i] = 2 * kPi * random.uniform(Stream::vibration, i);
    const auto count = static_cast<uint64_t>(std::ceil(m.bumps_hz * duration_s));
    for (uint64_t k = 0; k < count && m.bump_mps2 > 0; k++) {
      const double sense = random.uniform(Stream::bump, k, 1) < 0.5 ? -1 : 1;
      bumps_.push_back({duration_s * random.uniform(Stream::bump, k), sense * m.bump_mps2});
    }
  }
  Vector3d at(double t_s) const {
    Vector3d out;
    for (int i = 0; i < 3; i++) out[i] = m_.vibration_mps2 * wm::sin(2 * kPi * kVibrationHz[i] * t_s + phase_[i]);
    for (const Bump &b : bumps_)
      if (t_s >= b.t_s && t_s < b.t_s + kBumpLasts_s)
        out += b.size_mps2 * wm::sin(kPi * (t_s - b.t_s) / kBumpLasts_s) * Vector3d(0.3, 0.3, 1);
    return out;
  }

 private:
  struct Bump {
    double t_s, size_mps2;
  };
  const Motion &m_;
  double phase_[3];
  std::vector<Bump> bumps_;
};

}  // namespace

Drive on_base(const Motion &motion, double center_m, const Drive &planned) {
  if (motion.base == Motion::Base::rolling) return planned;
  std::vector<State> driven;
  const auto samples = static_cast<uint64_t>(std::ceil(planned.duration_s() / kSample_s)) + 1;
  for (uint64_t k = 0; k < samples; k++) {
    State s = planned.at(static_cast<double>(k) * kSample_s);
    const double along_mps = s.speed_mps, per_m = 2 * kPi / motion.crab_m;
    if (motion.base == Motion::Base::holonomic) {
      const double crab = motion.crab_rad * wm::sin(per_m * s.way_m);
      s.heading_rad += crab;
      s.yaw_rate_radps += motion.crab_rad * per_m * wm::cos(per_m * s.way_m) * along_mps;
      s.speed_mps = along_mps * wm::cos(crab);
      s.side_mps = -along_mps * wm::sin(crab);
    } else {
      s.x_m -= center_m * wm::cos(s.heading_rad);
      s.y_m -= center_m * wm::sin(s.heading_rad);
      s.side_mps = -center_m * s.yaw_rate_radps;
    }
    driven.push_back(s);
  }
  return Drive::sampled(driven, kSample_s);
}

void measure_twist(const Scenario &sc, const Random &random, Recording &out) {
  const Motion &m = sc.motion;
  const Errors &e = sc.errors;
  const bool gyro = m.imu_hz > 0;  // the bias and the scale of the turn rate are the gyro's then
  const double step_s = 1 / m.twist_hz, each = std::sqrt(m.twist_hz);
  const double speed = 1 + e.speed * random.normal(Stream::twist_scale, 0);
  const double side = speed * (1 + e.side * random.normal(Stream::twist_scale, 1));
  const double turn = gyro ? 1 : 1 + e.turn * random.normal(Stream::twist_scale, 2);
  double bias = gyro ? 0 : out.drawn.yaw_rate_bias_radps;
  for (uint64_t k = 0; static_cast<double>(k) * step_s <= out.drive.duration_s(); k++) {
    const double t_s = static_cast<double>(k) * step_s;
    const State from = out.drive.at(t_s), to = out.drive.at(t_s + step_s);
    if (stands(from, to)) {
      out.commands.push_back({t_s, 0, bias, 0});
      continue;
    }
    const Planar now = twist_between(from, to, step_s);
    const auto noise = [&](double constant, double relative, double of, uint64_t axis) {
      return each * std::sqrt(constant * constant + relative * of * relative * of) *
             random.normal(Stream::twist_noise, k, axis);
    };
    const double v = now.v + noise(m.speed_noise_mps, m.speed_noise, now.v, 0);
    const double u = now.u + noise(m.side_noise_mps, m.side_noise, now.u, 1);
    const double w = now.w + noise(m.turn_noise_radps, m.turn_noise, now.w, 2);
    out.commands.push_back({t_s, v / speed, w / turn + bias, m.base == Motion::Base::holonomic ? u / side : 0});
    if (!gyro) bias += e.yaw_rate_bias_walk * std::sqrt(step_s) * random.normal(Stream::yaw_rate_walk, k);
  }
}

void measure_imu(const Scenario &sc, const Random &random, Recording &out) {
  const Motion &m = sc.motion;
  const Errors &e = sc.errors;
  const bool six = out.path.duration_s() > 0;
  const double step_s = 1 / m.imu_hz, turn = 1 + e.turn * random.normal(Stream::twist_scale, 2);
  const Shaking shaking(m, random, out.duration_s);
  double bias[3], offset[3];
  for (uint64_t i = 0; i < 3; i++) {
    bias[i] =
        !six && i == 2 ? out.drawn.yaw_rate_bias_radps : e.yaw_rate_bias_radps * random.normal(Stream::rate_bias, i);
    offset[i] = m.accelerometer_bias_mps2 * random.normal(Stream::accelerometer_bias, i);
  }
  for (uint64_t k = 0; static_cast<double>(k) * step_s <= out.duration_s; k++) {
    const double t_s = static_cast<double>(k) * step_s;
    const Inertial now = inertial_at(out, t_s, step_s);
    const Vector3d shaken = shaking.at(t_s);
    ImuRow row{};
    row.t_ns = stamp(out, t_s);
    for (uint64_t i = 0; i < 3; i++) {
      const auto axis = static_cast<Eigen::Index>(i);
      row.w_radps[i] = now.w[axis] / turn + bias[i] + e.yaw_rate_noise_radps * random.normal(Stream::gyro_noise, k, i);
      row.a_mps2[i] = now.f[axis] + offset[i] + shaken[axis] +
                      m.accelerometer_noise_mps2 * random.normal(Stream::accelerometer_noise, k, i);
      bias[i] += e.yaw_rate_bias_walk * std::sqrt(step_s) * random.normal(Stream::yaw_rate_walk, k, 8 + i);
      if (out.imu.empty()) continue;
      const int stuck_axis = static_cast<int>(i);
      if (sc.faults.gyro_stuck.holds(t_s, stuck_axis)) row.w_radps[i] = out.imu.back().w_radps[i];
      if (sc.faults.accelerometer_stuck.holds(t_s, stuck_axis)) row.a_mps2[i] = out.imu.back().a_mps2[i];
    }
    out.imu.push_back(row);
  }
}

}  // namespace wm::sim
