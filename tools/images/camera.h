// SPDX-License-Identifier: Apache-2.0
// Camera models: from a direction in the optical frame (z forward, x right, y down) to a pixel and back. Integer pixel
// coordinates are the centres of pixels. Models and parameters as calibration.yaml writes them.
//
//   equidistant     J. Kannala, S. Brandt, "A generic camera model and calibration method for conventional, wide-angle,
//                   and fish-eye lenses", PAMI 2006; four coefficients, as OpenCV's fisheye
//   omni            C. Mei, P. Rives, "Single view point omnidirectional camera calibration from planar grids", ICRA
//   2007 double-sphere   V. Usenko, N. Demmel, D. Cremers, "The double sphere camera model", 3DV 2018 pinhole-radtan
//   Brown's radial and tangential distortion
#pragma once

#include <string>
#include <vector>

#include "images/types.h"

namespace wm::images {

enum class Model { equidistant, pinhole_radtan, omni, double_sphere };

struct Camera {
  Model model = Model::equidistant;
  int width = 1280, height = 720;
  std::vector<double> intrinsics;  // [fx, fy, cx, cy]; omni: xi before them; double-sphere: xi, alpha before them
  std::vector<double> distortion;  // equidistant: k1..k4; radtan and omni: k1 k2 p1 p2 [k3]; may be empty
  double fov_rad = 2 * kPi;        // whole angle that the lens passes; beyond it the picture is black
  Pose T_base_camera = Pose::Identity();  // the BODY frame (x along the view, y left, z up) in base_link: the mounting
  int64_t readout_ns = 0;                 // rolling shutter: first to last row
};

// "equidistant", "pinhole-radtan", "omni", "double-sphere"; false for others.
bool model_from_name(const std::string &name, Model &out);
const char *model_name(Model model);
// Whether the numbers of parameters fit the model and the focal lengths and the size are positive.
bool camera_valid(const Camera &camera, std::string &error);

// Pixel of a point (any length > 0) in the optical frame. False behind the lens' angle, or where the model (or its
// distortion, where it turns back) has no picture of it. The pixel may lie outside of the picture. Any thread, no
// allocation, about 0.1 us.
bool project(const Camera &camera, const Vec3 &point, Vec2 &pixel);
// Unit direction of a pixel: Newton or fixed-point iteration to 1e-13 rad. False where there is none.
bool unproject(const Camera &camera, const Vec2 &pixel, Vec3 &direction);

// The optical frame in the body frame: its axes lie along (-y, -z, x) of the body.
Pose T_body_optical();
// The optical frame in base_link.
Pose T_base_optical(const Camera &camera);
// When row v is in the middle of its exposure, relative to the frame's stamp (its middle row).
double row_offset_ns(const Camera &camera, double v_px);

}  // namespace wm::images
