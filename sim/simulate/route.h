// SPDX-License-Identifier: Apache-2.0
// The true drive: where base_link is at any time. Curvature is piecewise linear in the way (straights, clothoids,
// arcs), speed goes from one value to the next along a smooth ramp, so both are continuous and the pose has no
// numerical drift: heading and way are closed forms, the position is integrated by Gauss-Legendre over at most 0.25 m.
#pragma once

#include <vector>

#include "simulate/scenario.h"

namespace wm::sim {

struct State {
  double x_m, y_m;
  double heading_rad;  // unwrapped
  double way_m;        // signed: backwards counts down
  double speed_mps;    // signed
  double yaw_rate_radps;
  double curvature_1pm;                               // tan(road wheel angle) / wheelbase
  double carried_way_m = 0, carried_heading_rad = 0;  // of these it was carried so much: no wheel, no gyro says so
  double side_mps = 0;                                // to the left, of a base that can
};

class Drive {
 public:
  // WM_BAD_CONFIG with a text that names the leg (from 1) when it can't be driven.
  static wm_status plan(const Route &route, Drive &out, wm_error *err);

  // States of a drive that was not planned so, the first at the start, `step_s` apart; linear in between.
  static Drive sampled(const std::vector<State> &states, double step_s);

  double duration_s() const { return duration_s_; }
  double whole_s() const { return planned_s_ - carry_forward_s_; }  // as planned, whether it was cut or not
  double length_m() const;  // driven until duration_s(), forwards and backwards; not what it was carried
  // Ends the drive there, where it is longer.
  void cut(double duration_s);
  // At `at_s` the vehicle is put where it would be `forward_s` later, and drives on from there. WM_BAD_CONFIG when the
  // drive is too short. Wheels and gyro measure nothing of it.
  wm_status carry(double at_s, double forward_s, wm_error *err);
  // At t in seconds from the start; before and after it the robot stands. O(log n).
  State at(double t_s) const;

 private:
  // A stretch of path with linear curvature, at most 0.25 m long.
  struct Piece {
    double start_m, length_m;  // along the path, always growing
    int sign;                  // -1: driven backwards
    double curvature, slope;   // of the vehicle at the start, and its change per metre of path
    double x_m, y_m, heading_rad, way_m;
  };
  // Time in which the speed goes from v0 to v1 along 3u^2 - 2u^3.
  struct Ramp {
    double start_s, duration_s, start_m, v0, v1;
  };

  void add_path(double length_m, int sign, double curvature0, double curvature1);
  void add_ramp(double duration_s, double v0, double v1);
  State driven(double t_s) const;
  // Path until that time, forwards and backwards; of a planned drive also its speed along it.
  double path_m(double t_s, double *speed_mps) const;
  State between_samples(double t_s) const;
  static void end_of(const Piece &piece, double along_m, double &x, double &y, double &heading);

  std::vector<Piece> pieces_;
  std::vector<Ramp> ramps_;
  double duration_s_ = 0, length_m_ = 0;
  double planned_m_ = 0;  // way of the ramps
  double planned_s_ = 0;  // their duration
  State start_ = {};
  std::vector<State> samples_;  // in place of pieces and ramps
  double step_s_ = 0;
  double carry_at_s_ = 0, carry_forward_s_ = 0, carry_way_m_ = 0, carry_heading_rad_ = 0;
};

}  // namespace wm::sim
