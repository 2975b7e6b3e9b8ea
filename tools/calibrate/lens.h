// SPDX-License-Identifier: Apache-2.0
// The camera models of images/camera.h for any number type: with Ceres' dual numbers they give derivatives. A
// test holds them against images::project.
#pragma once

#include <cmath>

#include "images/camera.h"

namespace wm::calibrate {

using images::Model;

// How many parameters a model has here: intrinsics, then distortion (radtan with k3, omni without).
constexpr int lens_parameters(Model model) {
  switch (model) {
    case Model::equidistant: return 8;
    case Model::pinhole_radtan:
    case Model::omni: return 9;
    case Model::double_sphere: return 6;
  }
  return 0;
}

// Brown's radial and tangential distortion: d = k1 k2 p1 p2 [k3].
template <typename T>
void bend_plane(const T &x, const T &y, const T *d, bool with_k3, T out[2]) {
  const T r2 = x * x + y * y;
  const T radial = 1.0 + r2 * (d[0] + r2 * (with_k3 ? T(d[1] + r2 * d[4]) : d[1]));
  out[0] = x * radial + 2.0 * d[2] * x * y + d[3] * (r2 + 2.0 * x * x);
  out[1] = y * radial + d[2] * (r2 + 2.0 * y * y) + 2.0 * d[3] * x * y;
}

// The pixel of a point in the optical frame by parameters v. The caller makes sure that the camera shows the point.
template <Model model, typename T>
void lens_pixel(const T *v, const T p[3], T pixel[2]) {
  using std::atan2;
  using std::sqrt;
  const T *focal = v;
  T m[2];
  if constexpr (model == Model::equidistant) {
    const T r = sqrt(p[0] * p[0] + p[1] * p[1] + 1e-24);
    const T theta = atan2(r, p[2]), t2 = theta * theta;
    const T k = theta * (1.0 + t2 * (v[4] + t2 * (v[5] + t2 * (v[6] + t2 * v[7])))) / r;
    m[0] = p[0] * k;
    m[1] = p[1] * k;
  } else if constexpr (model == Model::pinhole_radtan) {
    bend_plane(T(p[0] / p[2]), T(p[1] / p[2]), v + 4, true, m);
  } else if constexpr (model == Model::omni) {
    const T z = p[2] + v[0] * sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    focal = v + 1;
    bend_plane(T(p[0] / z), T(p[1] / z), v + 5, false, m);
  } else {
    const T &xi = v[0], &alpha = v[1];
    const T r2 = p[0] * p[0] + p[1] * p[1], z2 = xi * sqrt(r2 + p[2] * p[2]) + p[2];
    const T under = alpha * sqrt(r2 + z2 * z2) + (1.0 - alpha) * z2;
    focal = v + 2;
    m[0] = p[0] / under;
    m[1] = p[1] / under;
  }
  pixel[0] = focal[0] * m[0] + focal[2];
  pixel[1] = focal[1] * m[1] + focal[3];
}

}  // namespace wm::calibrate
