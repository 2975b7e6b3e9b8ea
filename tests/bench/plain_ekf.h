// SPDX-License-Identifier: Apache-2.0
// A plain extended Kalman filter of a planar pose, written out as in a textbook [Thrun2005]: what the least costs, for
// comparison. No gate, no calibration, no record, no check of its input.
#pragma once

#include <cmath>

namespace bench {

class plain_ekf {
 public:
  plain_ekf(double x_m, double y_m, double heading_rad, double sigma_xy_m, double sigma_heading_rad)
      : x_{x_m, y_m, heading_rad} {
    p_[0][0] = p_[1][1] = sigma_xy_m * sigma_xy_m;
    p_[2][2] = sigma_heading_rad * sigma_heading_rad;
  }

  // A step of a twist: the chord at its middle heading; noise along the way and of the heading, per second.
  void predict(double dt_s, double v_mps, double w_radps, double noise_m2ps, double noise_rad2ps) {
    const double way = v_mps * dt_s, middle = x_[2] + 0.5 * w_radps * dt_s, c = std::cos(middle), s = std::sin(middle);
    x_[0] += way * c;
    x_[1] += way * s;
    x_[2] += w_radps * dt_s;
    const double f[2] = {-way * s, way * c};  // d(x, y) / d heading
    // F P F' + Q, F = I but for f in its last column.
    for (int i = 0; i < 2; i++)
      for (int j = i; j < 2; j++) p_[i][j] += f[j] * p_[i][2] + f[i] * p_[j][2] + f[i] * f[j] * p_[2][2];
    for (int i = 0; i < 2; i++) p_[i][2] += f[i] * p_[2][2];
    const double q = noise_m2ps * dt_s;
    p_[0][0] += q * c * c;
    p_[0][1] += q * c * s;
    p_[1][1] += q * s * s;
    p_[2][2] += noise_rad2ps * dt_s;
  }

  void bearing(double x_m, double y_m, double bearing_rad, double variance_rad2) {
    const double dx = x_m - x_[0], dy = y_m - x_[1], square_m2 = dx * dx + dy * dy;
    const double h[3] = {dy / square_m2, -dx / square_m2, -1.0};
    double gain[3], s = variance_rad2;
    for (int i = 0; i < 3; i++) gain[i] = h[0] * at(i, 0) + h[1] * at(i, 1) + h[2] * at(i, 2);
    for (int i = 0; i < 3; i++) s += h[i] * gain[i];
    const double innovation = std::remainder(bearing_rad - (std::atan2(dy, dx) - x_[2]), 2.0 * M_PI);
    for (int i = 0; i < 3; i++) x_[i] += gain[i] * innovation / s;
    for (int i = 0; i < 3; i++)
      for (int j = i; j < 3; j++) p_[i][j] -= gain[i] * gain[j] / s;
  }

  double x_m() const { return x_[0]; }
  double y_m() const { return x_[1]; }

 private:
  double x_[3];
  double p_[3][3] = {};  // upper half

  double at(int i, int j) const { return i < j ? p_[i][j] : p_[j][i]; }
};

}  // namespace bench
