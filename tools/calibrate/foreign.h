// SPDX-License-Identifier: Apache-2.0
// A camera as another program calibrated it: where the ray of each pixel goes, and, where one of our models says just
// the same, that one.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/entry.h"
#include "calibrate/flat_file.h"
#include "images/camera.h"

namespace wm::calibrate {

using images::Vec2;
using images::Vec3;

struct ForeignCamera {
  std::string name;   // as the file has it; "" where it has none
  std::string model;  // for people: "Kalibr pinhole + fov"
  int width = 0, height = 0;
  Vec2 centre{0, 0};                                                  // near the optical axis, px
  std::optional<images::Camera> same;                                 // one of our models with the same parameters
  std::function<bool(const Vec2 &pixel, Vec3 &direction)> unproject;  // optical frame; false: no ray
  std::vector<std::string> notes;                                     // what was left out of the file
};

// What a file may not say of itself.
struct ImportHints {
  int width = 0, height = 0;  // 0: as the file says
  std::string lens;           // "plain" (radial and tangential) or "fisheye", for OpenCV's four coefficients
};

// Recognises OpenCV's FileStorage (YAML, XML), Kalibr's camchain, ROS camera_info (YAML, JSON, INI), PhotonVision's
// JSON and OCamCalib's text, also packed by gzip, and reads all cameras in it. Throws tools::Failure with file, line
// and key, and with what to do.
std::vector<ForeignCamera> read_foreign(const std::filesystem::path &file, const ImportHints &hints);

// As an entry named `name`, without a mounting: the same model where we have it (`model` "auto" or its name), else the
// best fit of `model` ("auto": of ours). How far it is off goes to standard error. `file`: for messages.
Entry import_camera(const ForeignCamera &camera, const std::string &name, const std::string &model,
                    const std::string &file);

// ── the formats ──
std::vector<ForeignCamera> read_opencv(const FlatFile &file, const ImportHints &hints);
std::vector<ForeignCamera> read_kalibr(const FlatFile &file, const ImportHints &hints);
std::vector<ForeignCamera> read_ros(const FlatFile &file, const ImportHints &hints);
std::vector<ForeignCamera> read_ros_ini(const std::string &text, const std::string &path, const ImportHints &hints);
std::vector<ForeignCamera> read_ocamcalib(const std::string &text, const std::string &path, const ImportHints &hints);

// ── the models ──
// [fx, fy, cx, cy] and a skew (px of u for one of normalised y).
struct Matrix3 {
  double fx, fy, cx, cy, skew;
};
// OpenCV's k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4]]]; `same` is set where it is ours (no skew, at most five).
ForeignCamera plain_camera(const Matrix3 &k, const std::vector<double> &distortion, int width, int height);
// Kannala-Brandt, four coefficients.
ForeignCamera fisheye_camera(const Matrix3 &k, const std::vector<double> &distortion, int width, int height);
// A camera whose model is ours.
ForeignCamera our_camera(const images::Camera &camera);
// Devernay and Faugeras' field-of-view model, angle w.
ForeignCamera fov_camera(const Matrix3 &k, double w, int width, int height);
// Enhanced unified model (B. Khomutenko et al. 2016): alpha, beta.
ForeignCamera eucm_camera(double alpha, double beta, const Matrix3 &k, int width, int height);

}  // namespace wm::calibrate
