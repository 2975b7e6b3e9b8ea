// SPDX-License-Identifier: Apache-2.0
#include "filters/planar/pose_step.hpp"

#include "math/arc.hpp"
#include "motion/plausibility.hpp"

namespace wm {
namespace {

// A robot that turns faster spins: no landmark is identified then.
constexpr double kTurnMost_radps = 10.0;
// Names of the motion's states, and limits beyond which the model is wrong, or the lag exceeds the history; by
// calibration_index and those behind.
constexpr struct {
  const char *name;
  double lowest, highest;
} kRows[kMotionStates] = {
    {"motion.speed_scale", 0.3, 3.0},
    {"motion.yaw_rate_scale", 0.3, 3.0},
    {"motion.yaw_rate_bias_radps", -1.0, 1.0},
    {"motion.left_scale", 0.3, 3.0},
    {"motion.right_scale", 0.3, 3.0},
    {"motion.track_scale", 0.3, 3.0},
    {"motion.steering_offset_rad", -0.5, 0.5},
    {"motion.lag_s", 0.0, 0.8},
    {"motion.turn_slowdown_mps", -1.0, 1.0},
    {"motion.speed_onset_s", -1.0, 1.0},
    {"motion.turn_onset_s", -1.0, 1.0},
    {"motion.gentle_turns", -1.0, 2.0},
    {"motion.side_scale", 0.3, 3.0},
    {"motion.rotation_center_m", -5.0, 5.0},
    {"motion.velocity_x_mps", -kSpeedMost_mps, kSpeedMost_mps},
    {"motion.velocity_y_mps", -kSpeedMost_mps, kSpeedMost_mps},
    {"motion.turn_rate_radps", -kTurnMost_radps, kTurnMost_radps},
};

}  // namespace

const char *motion_state_name(int calibration_index) { return kRows[calibration_index].name; }

double motion_state_within_limits(int calibration_index, double value) {
  const auto &row = kRows[calibration_index];
  if (value < row.lowest) return row.lowest;
  return value > row.highest ? row.highest : value;
}

namespace {

// A velocity on the map's axes does not turn with the robot: no column by the heading.
pose_step make_velocity_step(double dt, const motion_twist &twist, const motion_noise &noise, double heading_rad,
                             const int motion_state[kMotionStates]) {
  pose_step out{};
  out.x_m = twist.v * dt;
  out.y_m = twist.u * dt;
  out.turn_rad = twist.w * dt;
  out.body = between({0.0, 0.0, heading_rad}, {out.x_m, out.y_m, heading_rad + out.turn_rad});
  out.columns = kVelocityStates;
  for (int k = 0; k < kVelocityStates; k++) {
    out.column[k] = motion_state[kVelocityX + k];
    out.by[k][k] = dt;
  }
  out.noise[kX][kX] = noise.distance_m2;
  out.noise[kY][kY] = noise.lateral_m2;
  out.noise[kHeading][kHeading] = noise.rotation_rad2;
  return out;
}

}  // namespace

pose_step make_pose_step(const motion_segment &segment, const motion_twist &twist, const motion_noise &noise,
                         double heading_rad, const planar_twist &before, double before_heading_rad,
                         const int motion_state[kMotionStates]) {
  const double dt = segment.dt_s;
  if (segment.input.model == WM_MOTION_CONSTANT_VELOCITY)
    return make_velocity_step(dt, twist, noise, heading_rad, motion_state);
  pose_step out;
  const arc a = make_arc(twist.v * dt, twist.u * dt, twist.w * dt);
  const sin_cos h = sincos(heading_rad);
  const double dx = h.cos * a.x_m - h.sin * a.y_m;
  const double dy = h.sin * a.x_m + h.cos * a.y_m;
  out.x_m = dx;
  out.y_m = dy;
  out.turn_rad = a.turn_rad;
  out.body = {a.x_m, a.y_m, a.turn_rad};
  out.heading = h;

  out.column[0] = kHeading;
  out.by[0][0] = -dy;
  out.by[0][1] = dx;
  out.by[0][2] = 0.0;
  out.columns = 1;
  const auto add_column = [&](int state, double distance_by, double side_by, double turn_by) {
    const double bx = a.x_by_way * distance_by + a.x_by_turn * turn_by - a.y_by_way * side_by;
    const double by_body = a.y_by_way * distance_by + a.y_by_turn * turn_by + a.x_by_way * side_by;
    double *by = out.by[out.columns];
    out.column[out.columns++] = state;
    by[0] = h.cos * bx - h.sin * by_body;
    by[1] = h.sin * bx + h.cos * by_body;
    by[2] = turn_by;
  };
  for (int i = 0; i < twist.count; i++) {
    const int state = motion_state[twist.index[i]];
    if (state >= 0) add_column(state, twist.v_by[i] * dt, twist.u_by[i] * dt, twist.w_by[i] * dt);
  }
  // More lag: the interval contains more of the inputs before it, at its beginning, which rotates all that follows, and
  // less of the last ones. The two cancel from interval to interval.
  const int lag = motion_state[kLag];
  if (lag >= 0 && (segment.first || segment.last)) {
    const planar_twist &end = segment.input.command ? segment.end : twist;
    add_column(lag, segment.last ? -end.v : 0.0, segment.last ? -end.u : 0.0, segment.last ? -end.w : 0.0);
    if (segment.first) {
      const sin_cos b = sincos(before_heading_rad);
      double *by = out.by[out.columns - 1];
      by[0] += b.cos * before.v - dy * before.w - b.sin * before.u;
      by[1] += b.sin * before.v + dx * before.w + b.cos * before.u;
      by[2] += before.w;
    }
  }

  // Noise along the path, of the rotation, and sideways, with their covariances.
  const double way_x = h.cos * a.x_by_way - h.sin * a.y_by_way, way_y = h.sin * a.x_by_way + h.cos * a.y_by_way;
  const double turn_x = h.cos * a.x_by_turn - h.sin * a.y_by_turn, turn_y = h.sin * a.x_by_turn + h.cos * a.y_by_turn;
  const double q_distance = noise.distance_m2, q_rotation = noise.rotation_rad2, q_both = noise.distance_rotation,
               q_lateral = noise.lateral_m2, q_place = noise.distance_lateral, q_side = noise.lateral_rotation;
  out.noise[0][0] = way_x * way_x * q_distance + 2.0 * way_x * turn_x * q_both + turn_x * turn_x * q_rotation +
                    way_y * way_y * q_lateral - 2.0 * way_x * way_y * q_place - 2.0 * way_y * turn_x * q_side;
  out.noise[0][1] = way_x * way_y * q_distance + (way_x * turn_y + turn_x * way_y) * q_both +
                    turn_x * turn_y * q_rotation - way_x * way_y * q_lateral +
                    (way_x * way_x - way_y * way_y) * q_place + (way_x * turn_x - way_y * turn_y) * q_side;
  out.noise[1][1] = way_y * way_y * q_distance + 2.0 * way_y * turn_y * q_both + turn_y * turn_y * q_rotation +
                    way_x * way_x * q_lateral + 2.0 * way_x * way_y * q_place + 2.0 * way_x * turn_y * q_side;
  out.noise[0][2] = way_x * q_both + turn_x * q_rotation - way_y * q_side;
  out.noise[1][2] = way_y * q_both + turn_y * q_rotation + way_x * q_side;
  out.noise[2][2] = q_rotation;
  return out;
}

}  // namespace wm
