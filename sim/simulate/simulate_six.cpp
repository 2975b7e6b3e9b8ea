// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "simulate/measured.h"
#include "simulate/motion.h"
#include "simulate/random.h"
#include "simulate/simulate.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

// Rz(yaw) Ry(pitch) Rx(roll).
void quaternion(const std::array<double, 3> &rpy, double q[4]) {
  const double cr = wm::cos(0.5 * rpy[0]), sr = wm::sin(0.5 * rpy[0]), cp = wm::cos(0.5 * rpy[1]),
               sp = wm::sin(0.5 * rpy[1]), cy = wm::cos(0.5 * rpy[2]), sy = wm::sin(0.5 * rpy[2]);
  q[0] = sr * cp * cy - cr * sp * sy;
  q[1] = cr * sp * cy + sr * cp * sy;
  q[2] = cr * cp * sy - sr * sp * cy;
  q[3] = cr * cp * cy + sr * sp * sy;
}

// A twist holds from its stamp to the next one, so a sample is that of the interval's middle.
void send_motion(const Scenario &sc, const Random &random, Recording &out) {
  const Errors &e = sc.errors;
  const double step_s = 1 / sc.motion.log_hz, scale = 1 + e.speed * random.normal(Stream::velocity_scale, 0);
  double bias[3];
  for (uint64_t i = 0; i < 3; i++) bias[i] = e.yaw_rate_bias_radps * random.normal(Stream::rate_bias, i);
  for (uint64_t k = 0; static_cast<double>(k) * step_s <= out.duration_s; k++) {
    const double t_s = static_cast<double>(k) * step_s;
    const State6 s = out.path.at(t_s + 0.5 * step_s);
    Twist6 m{};
    m.t_ns = out.clock_start_ns + to_ns(t_s);
    for (uint64_t i = 0; i < 3; i++) {
      m.v_mps[i] = scale * s.velocity_body_mps[i] + e.speed_noise_mps * random.normal(Stream::velocity_noise, k, i);
      m.w_radps[i] = s.rate_body_radps[i] + bias[i] + e.yaw_rate_noise_radps * random.normal(Stream::rate_noise, k, i);
      if (!sc.motion.log_rates) m.w_radps[i] = 0;
      bias[i] += e.yaw_rate_bias_walk * std::sqrt(step_s) * random.normal(Stream::yaw_rate_walk, k, i);
    }
    out.motion6.push_back(m);
  }
}

void start(const Scenario &sc, const Random &random, Recording &out) {
  const Errors &e = sc.errors;
  const State6 s = out.path.at(0);
  double away[3], turned[3];
  start_away(e, random, 3, away);
  out.start.t_ns = WM_TIME_NONE;
  for (uint64_t i = 0; i < 3; i++) {
    out.start.p_m[i] = s.xyz_m[i] + e.start_xy_m * random.normal(Stream::start_pose, i) + away[i];
    turned[i] = e.start_heading_rad * random.normal(Stream::start_pose, 3 + i);
  }
  out.start.p_m[0] += sc.faults.start_x_m;
  out.start.p_m[1] += sc.faults.start_y_m;
  const double nowhere[3] = {0, 0, 0};
  turned[2] += sc.faults.start_heading_rad;
  const Eigen::Matrix3d R = pose_of(nowhere, s.rpy_rad.data()).linear() * pose_of(nowhere, turned).linear();
  out.start.heading_rad = wm::atan2(R(1, 0), R(0, 0));
  const double pitch = wm::atan2(-R(2, 0), std::sqrt(R(0, 0) * R(0, 0) + R(1, 0) * R(1, 0)));
  quaternion({wm::atan2(R(2, 1), R(2, 2)), pitch, out.start.heading_rad}, out.start.q_xyzw);
  out.start.sigma_xy_m = std::max({e.start_xy_m, e.start_within_m / std::sqrt(5.0), 1e-4});  // of a ball, each axis
  out.start.sigma_heading_rad = std::max(e.start_heading_rad, 1e-4);
}

}  // namespace

void simulate_six(const Scenario &sc, uint64_t seed, const Path6 &path, Recording &out) {
  out = Recording{};
  out.seed = seed;
  out.path = path;
  out.clock_start_ns = to_ns(sc.clock_start_s);
  out.duration_s = sc.duration_s > 0 ? std::min(sc.duration_s, path.duration_s()) : path.duration_s();
  const Random random(seed);
  send_motion(sc, random, out);
  if (sc.motion.imu_hz > 0) measure_imu(sc, random, out);
  for (uint64_t k = 0; static_cast<double>(k) / kTruth_hz <= out.duration_s; k++) {
    const double t_s = static_cast<double>(k) / kTruth_hz;
    const State6 s = path.at(t_s);
    Truth6 truth{};
    truth.t_ns = out.clock_start_ns + to_ns(t_s);
    std::copy(s.xyz_m.begin(), s.xyz_m.end(), truth.xyz_m);
    quaternion(s.rpy_rad, truth.q_xyzw);
    if (!out.truth6.empty()) {
      const double *last = out.truth6.back().xyz_m;
      const double dx = s.xyz_m[0] - last[0], dy = s.xyz_m[1] - last[1], dz = s.xyz_m[2] - last[2];
      out.length_m += std::sqrt(dx * dx + dy * dy + dz * dz);
    }
    out.truth6.push_back(truth);
  }
  start(sc, random, out);
}

}  // namespace wm::sim
