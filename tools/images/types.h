// SPDX-License-Identifier: Apache-2.0
// Small types of the renderer. World and geometry: double, metres, map axes. Light: linear, where 1 is what the sensor
// shows as white at exposure gain 1.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <numbers>

namespace wm::images {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
// T_parent_child: x_parent = T * x_child.
using Pose = Eigen::Isometry3d;

inline constexpr double kPi = std::numbers::pi;

struct Colour {
  float r = 0, g = 0, b = 0;

  Colour() = default;
  constexpr Colour(float grey) : r(grey), g(grey), b(grey) {}  // NOLINT: a grey is a colour
  constexpr Colour(float red, float green, float blue) : r(red), g(green), b(blue) {}
  float grey() const { return 0.2126f * r + 0.7152f * g + 0.0722f * b; }
  Colour operator*(float k) const { return {r * k, g * k, b * k}; }
  Colour operator*(Colour k) const { return {r * k.r, g * k.g, b * k.b}; }
  Colour operator+(Colour k) const { return {r + k.r, g + k.g, b + k.b}; }
};

// Rz(yaw)·Ry(pitch)·Rx(roll) and a place: the pose of a mounting, of a robot, of an object.
Pose pose_xyz_rpy(const Vec3 &xyz_m, double roll_rad, double pitch_rad, double yaw_rad);

}  // namespace wm::images
