// SPDX-License-Identifier: Apache-2.0
#include "init/kalibr.h"

#include <cmath>

namespace wm::init {
namespace {

constexpr double kRotationOff = 1e-3;  // Kalibr writes 16 digits; a matrix typed by hand has three
constexpr double kFarthest_m = 100;    // of a camera from the IMU
constexpr double kLongestShift_s = 10;

// T_a_b as the file has it, four rows of four.
std::optional<images::Pose> matrix(const calibrate::FlatFile &file, const std::string &key) {
  if (!file.has(key)) return std::nullopt;
  const std::vector<double> m = file.numbers(key);
  if (m.size() != 16) file.fail(key, "has " + std::to_string(m.size()) + " numbers; 4 rows of 4 are needed");
  images::Pose out = images::Pose::Identity();
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> rows(m.data());
  out.linear() = rows.topLeftCorner<3, 3>();
  out.translation() = rows.topRightCorner<3, 1>();
  const bool last_row = m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1;
  const double off = (out.linear() * out.linear().transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!last_row || !(off < kRotationOff) || !(out.linear().determinant() > 0))
    file.fail(key,
              "is not a rotation and translation: the rows of the left 3 x 3 must have length 1 and right angles, the "
              "last row is 0 0 0 1");
  if (!(out.translation().cwiseAbs().maxCoeff() < kFarthest_m)) file.fail(key, "is more than 100 m away: is it in mm?");
  out.linear() = Eigen::Quaterniond(out.linear()).normalized().toRotationMatrix();
  return out;
}

}  // namespace

std::vector<ChainCamera> read_chain(const calibrate::FlatFile &file) {
  std::vector<ChainCamera> out;
  images::Pose in_first = images::Pose::Identity();
  for (const std::string &cam : file.children("")) {
    if (!file.has(cam + ".camera_model")) continue;
    ChainCamera one;
    one.name = cam;
    if (const auto t = matrix(file, cam + ".T_cam_imu")) one.in_imu = t->inverse();
    const auto before = matrix(file, cam + ".T_cn_cnm1");  // of this camera from the one before it
    if (before) in_first = in_first * before->inverse();
    if (before || out.empty()) one.in_first = in_first;
    if (const std::vector<double> shift = file.numbers(cam + ".timeshift_cam_imu"); !shift.empty()) {
      if (shift.size() != 1 || std::abs(shift[0]) > kLongestShift_s)
        file.fail(cam + ".timeshift_cam_imu", "one number in seconds is needed, from -10 to 10");
      one.shift_s = shift[0];
    }
    out.push_back(one);
  }
  return out;
}

}  // namespace wm::init
