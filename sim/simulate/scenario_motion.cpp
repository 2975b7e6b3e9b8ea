// SPDX-License-Identifier: Apache-2.0
// Of a scenario: `motion`, the base and what measures its motion beside or in place of the bus.
#include "simulate/scenario_reader.h"

namespace wm::sim {
namespace {

void read_twist(Reader &r, const wm_yaml_node &map, Motion &out) {
  static const char *const known[] = {"rate_hz",
                                      "speed_noise_mps",
                                      "speed_noise_percent",
                                      "side_noise_mps",
                                      "side_noise_percent",
                                      "turn_noise_mradps",
                                      "turn_noise_percent",
                                      nullptr};
  if (!r.ok() || !wm_yaml_there(&map)) return;
  r.keys(map, known);
  r.number(map, "rate_hz", 1, 1000, 1, out.twist_hz, true);
  r.number(map, "speed_noise_mps", 0, 10, 1, out.speed_noise_mps);
  r.number(map, "speed_noise_percent", 0, 100, kPercent, out.speed_noise);
  r.number(map, "side_noise_mps", 0, 10, 1, out.side_noise_mps);
  r.number(map, "side_noise_percent", 0, 100, kPercent, out.side_noise);
  r.number(map, "turn_noise_mradps", 0, 10000, kMilli, out.turn_noise_radps);
  r.number(map, "turn_noise_percent", 0, 100, kPercent, out.turn_noise);
}

void read_imu(Reader &r, const wm_yaml_node &map, Motion &out) {
  static const char *const known[] = {
      "rate_hz", "accelerometer_noise_mps2", "accelerometer_bias_mps2", "vibration_mps2", "bump_mps2", "bumps_hz",
      nullptr};
  if (!r.ok() || !wm_yaml_there(&map)) return;
  r.keys(map, known);
  r.number(map, "rate_hz", 1, 2000, 1, out.imu_hz, true);
  r.number(map, "accelerometer_noise_mps2", 0, 100, 1, out.accelerometer_noise_mps2);
  r.number(map, "accelerometer_bias_mps2", 0, 10, 1, out.accelerometer_bias_mps2);
  r.number(map, "vibration_mps2", 0, 100, 1, out.vibration_mps2);
  r.number(map, "bump_mps2", 0, 1000, 1, out.bump_mps2);
  r.number(map, "bumps_hz", 0, 100, 1, out.bumps_hz);
}

}  // namespace

void read_motion(Reader &r, const wm_yaml_node &map, Scenario &out) {
  static const char *const known[] = {"base",      "crab_deg", "crab_m", "track_scale", "log_hz",
                                      "log_rates", "twist",    "imu",    "measured",    nullptr};
  static const char *const bases[] = {"rolling", "holonomic", "skid_steer", nullptr};
  if (!r.ok() || !wm_yaml_there(&map)) return;
  r.keys(map, known);
  Motion &m = out.motion;
  int base = 0;
  r.word(map, "base", bases, base);
  m.base = static_cast<Motion::Base>(base);
  r.number(map, "crab_deg", 0, 180, kDeg, m.crab_rad);
  r.number(map, "crab_m", 0.5, 1000, 1, m.crab_m);
  r.number(map, "track_scale", 0.5, 5, 1, m.track_scale);
  r.number(map, "log_hz", 0.5, 1000, 1, m.log_hz);
  r.flag(map, "log_rates", m.log_rates);
  r.flag(map, "measured", m.measured);
  const wm_yaml_node twist = r.child(map, "twist", false), imu = r.child(map, "imu", false);
  read_twist(r, twist, m);
  read_imu(r, imu, m);
  if (!r.ok()) return;
  const bool six = out.swims() || out.world.kind == "seabed";
  if (six && (m.base != Motion::Base::rolling || m.twist_hz > 0))
    return r.fail(map, "a vehicle with six degrees of freedom has no base and no planar twist; `imu` alone is for it");
  if (!m.measured && (six || m.twist_hz > 0 || m.imu_hz > 0))
    return r.fail(map, "`measured: false` is a carried tag on the ground: without twist and imu");
  if (m.base == Motion::Base::holonomic && m.twist_hz <= 0 && m.measured)
    return r.fail(map, "counts of two wheels do not give a sideways speed: a holonomic base needs `twist`");
  if (out.robot.commanded && m.is_there())
    return r.fail(map, "`robot.commands` is a base whose motion is not measured; leave `motion` out");
}

}  // namespace wm::sim
