// SPDX-License-Identifier: Apache-2.0
// The true way of a vehicle with six degrees of freedom: cubic splines in time of position and of roll, pitch and yaw,
// twice continuously differentiable and at rest at both ends. Twists are exact derivatives, not differences.
#pragma once

#include <array>
#include <vector>

namespace wm::sim {

struct Knot6 {
  double t_s;
  double x_m, y_m, z_m;
  double roll_rad, pitch_rad, yaw_rad;  // unwrapped: neighbours differ by the turn that is meant
};

struct State6 {
  std::array<double, 3> xyz_m;
  std::array<double, 3> rpy_rad;            // Rz(yaw) Ry(pitch) Rx(roll)
  std::array<double, 3> velocity_body_mps;  // in the vehicle's axes
  std::array<double, 3> rate_body_radps;    // in the vehicle's axes
};

class Path6 {
 public:
  Path6() = default;
  // At least two knots, times rising. O(n).
  explicit Path6(std::vector<Knot6> knots);

  double duration_s() const { return knots_.empty() ? 0 : knots_.back().t_s; }
  // Before the first and after the last knot it rests. O(log n).
  State6 at(double t_s) const;

 private:
  std::vector<Knot6> knots_;
  std::vector<std::array<double, 6>> slopes_;  // d/dt at the knots
};

}  // namespace wm::sim
