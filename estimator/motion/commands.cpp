// SPDX-License-Identifier: Apache-2.0
#include "motion/commands.hpp"

#include "math/elementary.hpp"

namespace wm {

bool are_commands(const wm_motion_params &p) {
  return p.commands_radius_max_m > 0.0 || p.commands_speed_change > 0.0 || p.commands_yaw_rate_change > 0.0;
}

double driven_rate(const wm_motion_params &p, double v_mps, double w_radps) {
  const double radius_max = p.commands_radius_max_m, overflow = p.commands_radius_overflow_m;
  if (!(radius_max > 0.0) || v_mps == 0.0 || std::fabs(v_mps) <= std::fabs(w_radps) * radius_max || w_radps == 0.0)
    return w_radps;
  const double radius = v_mps / w_radps;
  const bool left = radius > 0.0 && !(overflow > 0.0 && radius > overflow);
  return v_mps / (left ? radius_max : -radius_max);
}

motion_twist twist_of_command(double speed, double side, double rate, const wm_motion_calibration &c, double track_m) {
  const double size = std::fabs(speed), turning = square(rate);
  const double slower = c.value[kTurnSlowdown] * turning;
  const double fraction = size > 0.0 && slower < size ? (size - slower) / size : size > 0.0 ? 0.0 : 1.0;
  motion_twist t = twist_of_sample(fraction * speed, side, rate, c, track_m);
  if (fraction > 0.0 && size > 0.0) {
    // Both wheels lose the same, so unequal wheels change the turn a little, too.
    const double lost = speed > 0.0 ? -turning : turning;
    const bool wheels = finite(track_m);
    const double v_by = wheels ? 0.5 * (c.value[kLeftScale] + c.value[kRightScale]) : 1.0;
    const double w_by = wheels ? (c.value[kRightScale] - c.value[kLeftScale]) / (track_m * c.value[kTrackScale]) : 0.0;
    t.add(kTurnSlowdown, c.value[kSpeedScale] * v_by * lost, c.value[kYawRateScale] * w_by * lost);
  }
  return t;
}

void add_change_noise(const motion_segment &segment, const wm_motion_params &p, motion_noise *noise) {
  noise->distance_m2 += square(p.commands_speed_change) * std::fabs(segment.changed[0]);
  noise->rotation_rad2 += square(p.commands_yaw_rate_change) * std::fabs(segment.changed[1]);
}

}  // namespace wm
