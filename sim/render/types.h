// SPDX-License-Identifier: Apache-2.0
// Cameras, colours and pictures are the desk's (tools/images). World and geometry: double, metres, map axes. Light:
// linear, where 1 is what the sensor shows as white at exposure gain 1.
#pragma once

#include "images/camera.h"
#include "images/picture.h"

namespace wm::render {

using images::Camera;
using images::Colour;
using images::kPi;
using images::Model;
using images::Picture;
using images::Pose;
using images::pose_xyz_rpy;
using images::T_body_optical;
using images::Vec2;
using images::Vec3;

}  // namespace wm::render
