// SPDX-License-Identifier: Apache-2.0
// Vectors, matrices and rotations in space, as small as the filters need them. Sums run from the first to the last.
#ifndef WAYMARK_INTERNAL_MATH_ROTATION_HPP
#define WAYMARK_INTERNAL_MATH_ROTATION_HPP

#include "waymark/frames.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm {

struct vec3 {
  double x, y, z;
  double &operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  double operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
};

inline vec3 operator+(const vec3 &a, const vec3 &b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline vec3 operator-(const vec3 &a, const vec3 &b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline vec3 operator*(double s, const vec3 &a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(const vec3 &a, const vec3 &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline double length(const vec3 &a) { return std::sqrt(dot(a, a)); }
inline vec3 cross(const vec3 &a, const vec3 &b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline bool finite(const vec3 &a) { return finite(a.x) && finite(a.y) && finite(a.z); }
inline vec3 vec_of(const double v[3]) { return {v[0], v[1], v[2]}; }

struct mat3 {
  double m[3][3];
};

inline constexpr mat3 kIdentity3 = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

inline vec3 operator*(const mat3 &a, const vec3 &v) {
  return {a.m[0][0] * v.x + a.m[0][1] * v.y + a.m[0][2] * v.z, a.m[1][0] * v.x + a.m[1][1] * v.y + a.m[1][2] * v.z,
          a.m[2][0] * v.x + a.m[2][1] * v.y + a.m[2][2] * v.z};
}
// A' v.
inline vec3 transposed_times(const mat3 &a, const vec3 &v) {
  return {a.m[0][0] * v.x + a.m[1][0] * v.y + a.m[2][0] * v.z, a.m[0][1] * v.x + a.m[1][1] * v.y + a.m[2][1] * v.z,
          a.m[0][2] * v.x + a.m[1][2] * v.y + a.m[2][2] * v.z};
}
inline mat3 operator*(const mat3 &a, const mat3 &b) {
  mat3 out;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j];
  return out;
}
inline mat3 operator+(const mat3 &a, const mat3 &b) {
  mat3 out;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out.m[i][j] = a.m[i][j] + b.m[i][j];
  return out;
}
inline mat3 operator*(double s, const mat3 &a) {
  mat3 out;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out.m[i][j] = s * a.m[i][j];
  return out;
}
inline mat3 transposed(const mat3 &a) {
  mat3 out;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out.m[i][j] = a.m[j][i];
  return out;
}
// skew(a) b = a x b.
inline mat3 skew(const vec3 &a) { return {{{0, -a.z, a.y}, {a.z, 0, -a.x}, {-a.y, a.x, 0}}}; }

// Unit quaternion: a rotation.
struct quat {
  double w;
  vec3 v;
};

inline constexpr quat kNoTurn = {1, {0, 0, 0}};

inline quat operator*(const quat &a, const quat &b) {
  return {a.w * b.w - dot(a.v, b.v), a.w * b.v + b.w * a.v + cross(a.v, b.v)};
}
inline quat conjugate(const quat &a) { return {a.w, -1.0 * a.v}; }
inline quat normalized(const quat &a) {
  const double s = 1.0 / std::sqrt(a.w * a.w + dot(a.v, a.v));
  return {s * a.w, s * a.v};
}
inline quat quat_of(const double xyzw[4]) { return normalized({xyzw[3], {xyzw[0], xyzw[1], xyzw[2]}}); }

inline mat3 matrix_of(const quat &q) {
  const double xx = q.v.x * q.v.x, yy = q.v.y * q.v.y, zz = q.v.z * q.v.z;
  const double xy = q.v.x * q.v.y, xz = q.v.x * q.v.z, yz = q.v.y * q.v.z;
  const double wx = q.w * q.v.x, wy = q.w * q.v.y, wz = q.w * q.v.z;
  return {{{1 - 2 * (yy + zz), 2 * (xy - wz), 2 * (xz + wy)},
           {2 * (xy + wz), 1 - 2 * (xx + zz), 2 * (yz - wx)},
           {2 * (xz - wy), 2 * (yz + wx), 1 - 2 * (xx + yy)}}};
}

inline quat quat_of(const mat3 &r) {
  const double(*m)[3] = r.m;
  const double trace = m[0][0] + m[1][1] + m[2][2];
  // The largest of the four is never small: no division loses digits.
  if (trace > m[0][0] && trace > m[1][1] && trace > m[2][2])
    return normalized({1 + trace, {m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]}});
  if (m[0][0] >= m[1][1] && m[0][0] >= m[2][2])
    return normalized({m[2][1] - m[1][2], {1 + 2 * m[0][0] - trace, m[0][1] + m[1][0], m[0][2] + m[2][0]}});
  if (m[1][1] >= m[2][2])
    return normalized({m[0][2] - m[2][0], {m[0][1] + m[1][0], 1 + 2 * m[1][1] - trace, m[1][2] + m[2][1]}});
  return normalized({m[1][0] - m[0][1], {m[0][2] + m[2][0], m[1][2] + m[2][1], 1 + 2 * m[2][2] - trace}});
}

// A pose in space: the rotation and the place of a frame in another one.
struct pose3 {
  vec3 p;
  quat q;
};

inline pose3 composed(const pose3 &a, const pose3 &b) { return {a.p + matrix_of(a.q) * b.p, normalized(a.q * b.q)}; }

inline pose3 inverted(const pose3 &a) {
  const quat q = conjugate(a.q);
  return {-1.0 * (matrix_of(q) * a.p), q};
}

// Exp: the rotation by the vector's length about its direction.
inline quat turn_by(const vec3 &r) {
  const double q = dot(r, r);
  if (q < 1e-4) {  // the first terms left out are below 1e-16 of the result
    return normalized({1 - q * (1.0 / 8 - q * (1.0 / 384)), (0.5 - q * (1.0 / 48 - q * (1.0 / 3840))) * r});
  }
  const double angle = std::sqrt(q);
  const sin_cos half = sincos(0.5 * angle);
  return {half.cos, (half.sin / angle) * r};
}

// Log: the shortest rotation vector of a rotation.
inline vec3 turn_of(const quat &a) {
  const quat q = a.w < 0 ? quat{-a.w, -1.0 * a.v} : a;
  const double s = length(q.v);
  if (s < 1e-9) return 2.0 * q.v;
  return (2.0 * atan2(s, q.w) / s) * q.v;
}

// Left Jacobian of SO(3): the mean rotation while turning by r evenly; J v is where a constant body speed leads.
// Source: [Barfoot2017, section 7.1.5].
inline mat3 mean_turn(const vec3 &r) {
  const double q = dot(r, r);
  double a, b;  // (1 - cos)/angle^2, (angle - sin)/angle^3
  if (q < 1e-2) {
    a = 0.5 - q * (1.0 / 24 - q * (1.0 / 720 - q * (1.0 / 40320)));
    b = 1.0 / 6 - q * (1.0 / 120 - q * (1.0 / 5040 - q * (1.0 / 362880)));
  } else {
    const double angle = std::sqrt(q);
    const sin_cos t = sincos(angle);
    a = (1 - t.cos) / q;
    b = (angle - t.sin) / (q * angle);
  }
  const mat3 s = skew(r);
  return kIdentity3 + a * s + b * (s * s);
}

// Rz(yaw) Ry(pitch) Rx(roll), as a mounting is written.
inline mat3 matrix_of_rpy(const double rpy[3]) {
  const sin_cos r = sincos(rpy[0]), p = sincos(rpy[1]), y = sincos(rpy[2]);
  return {{{y.cos * p.cos, y.cos * p.sin * r.sin - y.sin * r.cos, y.cos * p.sin * r.cos + y.sin * r.sin},
           {y.sin * p.cos, y.sin * p.sin * r.sin + y.cos * r.cos, y.sin * p.sin * r.cos - y.cos * r.sin},
           {-p.sin, p.cos * r.sin, p.cos * r.cos}}};
}

}  // namespace wm

#endif
