// SPDX-License-Identifier: Apache-2.0
#include "ros2/incoming.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <limits>

namespace wm::ros2 {
namespace {

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegree_rad = M_PI / 180;
// RViz's "2D Pose Estimate": 0.5 m and 15 degrees.
constexpr double kSetSigma_m = 0.5, kSetSigma_rad = 15 * kDegree_rad;

bool finite(std::initializer_list<double> values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

bool finite(const Vector3 &v) { return finite({v.x, v.y, v.z}); }

double sigma(double variance, double otherwise) { return variance > 0 ? std::sqrt(variance) : otherwise; }

std::string without_slash(const char *frame) { return frame[0] == '/' ? frame + 1 : frame; }

// Fills *out with a pose whose quaternion is one.
Fault read(const RosPose &from, Eigen::Isometry3d *out) {
  const auto &[p, q] = from;
  if (!finite({p.x, p.y, p.z, q.x, q.y, q.z, q.w})) return "the pose is not finite";
  Eigen::Quaterniond turn(q.w, q.x, q.y, q.z);
  if (std::fabs(turn.norm() - 1) > 0.01) return "the quaternion's length is not 1";
  *out = Eigen::Isometry3d::Identity();
  out->linear() = turn.normalized().matrix();
  out->translation() << p.x, p.y, p.z;
  return std::nullopt;
}

}  // namespace

int64_t monotonic_stamp(const Time &stamp, int64_t utc_offset_ns) {
  const int64_t utc_ns = from_time(stamp);
  return utc_ns == 0 ? 0 : utc_ns - utc_offset_ns;
}

Fault given_now(int64_t t_ns, int64_t now_ns, int64_t *out) {
  constexpr int64_t kMost_ns = 10 * WM_NS_PER_S;
  *out = 0;
  if (t_ns == 0 || (t_ns - now_ns <= kMost_ns && now_ns - t_ns <= kMost_ns)) return std::nullopt;
  char text[160];
  (void)std::snprintf(text, sizeof text,
                      "its stamp is %.0f s %s this computer's clock: set the clocks (NTP), or send a stamp of 0",
                      std::fabs(static_cast<double>(t_ns - now_ns) * 1e-9), t_ns > now_ns ? "ahead of" : "behind");
  return text;
}

Fault set_pose_of(const PoseStamped &message, const std::string &map_frame, wm_set_pose *out) {
  const std::string frame = without_slash(message.header.frame_id);
  if (frame != map_frame) return "its frame is '" + frame + "', not '" + map_frame + "'";
  Eigen::Isometry3d at;
  if (Fault fault = read(message.pose.pose, &at)) return fault;
  const double *covariance = message.pose.covariance;
  if (!finite({covariance[0], covariance[7], covariance[35]})) return "the covariance is not finite";
  const Eigen::Quaterniond q(at.linear());
  *out = {{{at.translation().x(), at.translation().y(), at.translation().z()}, {q.x(), q.y(), q.z(), q.w()}},
          sigma(std::max(covariance[0], covariance[7]), kSetSigma_m),
          sigma(covariance[35], kSetSigma_rad)};
  return std::nullopt;
}

Fault motion_of(const Odometry &message, wm_stream_row *out) {
  const auto &[linear, angular] = message.twist.twist;
  if (!finite({linear.x, linear.y, angular.z})) return "the twist is not finite";
  out->number[0] = linear.x;
  out->number[1] = linear.y;
  out->number[2] = angular.z;
  return std::nullopt;
}

Fault pose_of(const Odometry &message, Eigen::Isometry3d *out) { return read(message.pose.pose, out); }

Fault localized_of(const RosPoseCovariance &pose, wm_stream_row *out) {
  Eigen::Isometry3d at;
  if (Fault fault = read(pose.pose, &at)) return fault;
  const auto &r = at.linear();
  const double *c = pose.covariance;
  const double covariance[6] = {c[0], (c[1] + c[6]) / 2, c[7], (c[5] + c[30]) / 2, (c[11] + c[31]) / 2, c[35]};
  const bool is_one =
      std::all_of(std::begin(covariance), std::end(covariance), [](double v) { return std::isfinite(v); }) &&
      c[0] > 0 && c[35] > 0 && c[0] * c[7] > covariance[1] * covariance[1];
  out->number[0] = at.translation().x();
  out->number[1] = at.translation().y();
  out->number[2] = std::atan2(r(1, 0), r(0, 0));
  for (int i = 0; i < 6; i++) out->number[3 + i] = is_one ? covariance[i] : kAbsent;
  out->number[9] = kAbsent;  // ROS has no counter of resets
  return std::nullopt;
}

Fault imu_of(const Imu &message, wm_stream_row *out) {
  const Vector3 &w = message.angular_velocity, &a = message.linear_acceleration;
  const double *w_variance = message.angular_velocity_covariance, *a_variance = message.linear_acceleration_covariance;
  if (w_variance[0] < 0) return "it has no turn rates (the covariance begins with -1)";
  if (!finite(w)) return "the turn rates are not finite";
  const bool has_acceleration = a_variance[0] >= 0 && finite(a);
  const double rows[2][3] = {{w.x, w.y, w.z}, {a.x, a.y, a.z}};
  for (int i = 0; i < 3; i++) {
    out->number[i] = rows[0][i];
    out->number[3 + i] = has_acceleration ? rows[1][i] : kAbsent;
    out->number[6 + i] = sigma(w_variance[4 * i], kAbsent);
    out->number[9 + i] = has_acceleration ? sigma(a_variance[4 * i], kAbsent) : kAbsent;
  }
  out->number[12] = kAbsent;  // temperature
  return std::nullopt;
}

Fault position_of(const Fix &message, wm_can_gnss *gnss, wm_stream_row *out) {
  if (message.status.status < 0) return "";
  if (!finite({message.latitude, message.longitude}) || std::fabs(message.latitude) > 90 ||
      std::fabs(message.longitude) > 180)
    return "latitude or longitude is not an angle in degrees";
  const double *variance = message.position_covariance;
  const bool has_variance = message.position_covariance_type != 0 && finite({variance[0], variance[4], variance[8]});
  const bool has_altitude = std::isfinite(message.altitude);
  wm_quantities values = {};
  const auto add = [&values](unsigned id, double value) {
    values.id[values.count] = static_cast<uint8_t>(id);
    values.value[values.count++] = value;
  };
  add(WM_CAN_LATITUDE, message.latitude * kDegree_rad);
  add(WM_CAN_LONGITUDE, message.longitude * kDegree_rad);
  add(WM_CAN_ALTITUDE, has_altitude ? message.altitude : kAbsent);
  add(WM_CAN_SIGMA_XY, has_variance ? sigma((variance[0] + variance[4]) / 2, kAbsent) : kAbsent);
  add(WM_CAN_SIGMA_Z, has_variance ? sigma(variance[8], kAbsent) : kAbsent);
  wm_position position;
  if (!wm_can_gnss_take(gnss, &values, &position)) return "";
  const double numbers[] = {position.p_m[0], position.p_m[1], position.p_m[2], position.sigma_xy_m, position.sigma_z_m};
  std::copy(std::begin(numbers), std::end(numbers), out->number);
  return std::nullopt;
}

}  // namespace wm::ros2
