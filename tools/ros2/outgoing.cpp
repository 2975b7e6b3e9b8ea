// SPDX-License-Identifier: Apache-2.0
#include "ros2/outgoing.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace wm::ros2 {
namespace {

// diagnostic_msgs/DiagnosticStatus
constexpr uint8_t kOk = 0, kWarn = 1, kError = 2, kStale = 3;

std::string number(double value) {
  char out[32];
  (void)std::snprintf(out, sizeof out, "%.6g", value);
  return out;
}

Header header(const std::string &frame, int64_t utc_ns) { return {to_time(utc_ns), text(frame)}; }

Quaternion quaternion(const Eigen::Quaterniond &q) { return {q.x(), q.y(), q.z(), q.w()}; }

RosPose pose(const Eigen::Isometry3d &at) {
  const Eigen::Vector3d p = at.translation();
  return {{p.x(), p.y(), p.z()}, quaternion(Eigen::Quaterniond(at.rotation()))};
}

}  // namespace

Eigen::Isometry3d base_in_map(const wm_published &published) {
  const wm_pose3 &at = published.now.pose_map_base;
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = Eigen::Quaterniond(at.q_xyzw[3], at.q_xyzw[0], at.q_xyzw[1], at.q_xyzw[2]).normalized().matrix();
  out.translation() << at.p_m[0], at.p_m[1], at.p_m[2];
  return out;
}

Eigen::Isometry3d base_in_odom(const wm_published &published) {
  const wm_pose2 &at = published.pose_odom_base;
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = Eigen::AngleAxisd(at.heading_rad, Eigen::Vector3d::UnitZ()).matrix();
  out.translation() << at.x_m, at.y_m, 0;
  return out;
}

std::array<double, 36> ros_covariance(const wm_estimate &estimate) {
  using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
  const wm_pose3 &at = estimate.pose_map_base;
  Matrix6 turn = Matrix6::Identity();
  turn.bottomRightCorner<3, 3>() =
      Eigen::Quaterniond(at.q_xyzw[3], at.q_xyzw[0], at.q_xyzw[1], at.q_xyzw[2]).normalized().matrix();
  std::array<double, 36> out{};
  Eigen::Map<Matrix6>(out.data()) = turn * Eigen::Map<const Matrix6>(estimate.covariance) * turn.transpose();
  return out;
}

PoseStamped pose_message(const wm_published &published, int64_t utc_ns, const Frames &frames) {
  const auto &[p, q] = published.now.pose_map_base;
  // Of the two quaternions of a rotation, the run's.
  const Quaternion turn = quaternion(Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized());
  PoseStamped out{header(frames.map, utc_ns), {{{p[0], p[1], p[2]}, turn}, {}}};
  const std::array<double, 36> covariance = ros_covariance(published.now);
  std::copy(covariance.begin(), covariance.end(), out.pose.covariance);
  return out;
}

Odometry odometry_message(const wm_published &published, int64_t utc_ns, const Frames &frames) {
  const double *v = published.now.v_mps, *w = published.now.w_radps;
  Odometry out{};
  out.header = header(frames.odom, utc_ns);
  out.child_frame_id = text(frames.base);
  out.pose.pose = pose(base_in_odom(published));
  out.twist.twist = {{v[0], v[1], v[2]}, {w[0], w[1], w[2]}};
  return out;
}

TransformStamped transform_message(const std::string &parent, const std::string &child,
                                   const Eigen::Isometry3d &child_in_parent, int64_t utc_ns) {
  const RosPose at = pose(child_in_parent);
  return {header(parent, utc_ns), text(child), {{at.position.x, at.position.y, at.position.z}, at.orientation}};
}

Diagnostics::Status Diagnostics::pose(const wm_health &health) const {
  const char *cause = wm_cause_name(health.cause);
  Status out{kError, "waymark: pose", wm_state_name(health.state), {}};
  if (health.state == WM_STATE_TRACKING) out.level = kOk;
  if (health.state == WM_STATE_DEAD_RECKONING || health.state == WM_STATE_DEGRADED) out.level = kWarn;
  if (cause[0]) out.message += std::string(", ") + cause;
  if (health.other_runs > 0) {
    out.level = std::max(out.level, kWarn);
    out.message += "; another run publishes on the same channels";
  }
  out.values = {{"state", wm_state_name(health.state)},
                {"cause", cause},
                {"lost_probability", number(health.lost_probability)},
                {"reckoning_left_m", number(health.reckoning_left_m)},
                {"reckoning_left_s", number(health.reckoning_left_s)},
                {"resets", std::to_string(health.resets)},
                {"jumps", std::to_string(health.jumps)},
                {"published", std::to_string(health.published)},
                {"deadlines_missed", std::to_string(health.deadlines_missed)},
                {"outputs_lost", std::to_string(health.outputs_lost)},
                {"send_p99_ms", number(static_cast<double>(health.send_p99_ns) * 1e-6)},
                {"other_runs", std::to_string(health.other_runs)},
                {"host", health.host},
                {"pid", std::to_string(health.pid)}};
  if (bound_) {
    out.values.emplace_back("usable",
                            bound_->usable != 0 ? "yes" : std::string("no: ") + wm_unusable_name(bound_->why));
    out.values.emplace_back("bound_m", number(bound_->horizontal_m));
    out.values.emplace_back("bound_heading_rad", number(bound_->heading_rad));
    out.values.emplace_back("heading_after_m", number(bound_->heading_after_m));
  }
  for (uint32_t i = 0; i < health.calibration_count; i++) {
    const wm_calibration_value &value = health.calibration[i];
    out.values.emplace_back(value.name, number(value.value) + " +- " + number(value.sigma));
  }
  for (uint32_t i = 0; i < health.counter_count; i++)
    out.values.emplace_back(wm_counter_name(health.counters[i].kind), std::to_string(health.counters[i].count));
  return out;
}

Diagnostics::Status Diagnostics::source(const wm_source_health &source) {
  const char *device = wm_device_state_name(source.device);
  Status out{kOk, std::string("waymark: ") + source.name, "", {}};
  out.message = std::to_string(source.fused) + " of " + std::to_string(source.received) + " fused";
  if (source.device > WM_DEVICE_WORKS) out.level = kWarn, out.message = device;
  if (source.stale != 0) out.level = kError, out.message = "stale";
  out.values = {{"received", std::to_string(source.received)},
                {"fused", std::to_string(source.fused)},
                {"late", std::to_string(source.late)},
                {"dropped", std::to_string(source.dropped)},
                {"lost", std::to_string(source.lost)},
                {"malformed", std::to_string(source.malformed)},
                {"overflows", std::to_string(source.overflows)},
                {"lateness_p99_ms", number(static_cast<double>(source.lateness_p99_ns) * 1e-6)},
                {"silent_s", number(static_cast<double>(source.silent_ns) * 1e-9)},
                {"stale", source.stale != 0 ? "true" : "false"}};
  if (device[0]) out.values.emplace_back("device", device);
  for (unsigned i = 1; i < WM_VERDICT_COUNT; i++)
    if (source.rejected[i] > 0)
      out.values.emplace_back(std::string("rejected: ") + wm_verdict_name(i), std::to_string(source.rejected[i]));
  return out;
}

DiagnosticArray Diagnostics::message(const wm_health &health, const std::string &silence, int64_t utc_ns) {
  static const std::string no_frame;
  statuses_.clear(), values_.clear(), messages_.clear();
  if (silence.empty()) {
    statuses_.push_back(pose(health));
    for (uint32_t i = 0; i < health.source_count; i++) statuses_.push_back(source(health.sources[i]));
  } else {
    statuses_.push_back({kStale, "waymark: pose", silence, {}});
  }
  for (const Status &status : statuses_) {
    std::vector<KeyValue> &pairs = values_.emplace_back();
    for (const auto &[key, value] : status.values) pairs.push_back({text(key), text(value)});
    const auto count = static_cast<uint32_t>(pairs.size());
    messages_.push_back(
        {status.level, text(status.name), text(status.message), text("waymark"), {count, count, pairs.data(), false}});
  }
  const auto count = static_cast<uint32_t>(messages_.size());
  return {header(no_frame, utc_ns), {count, count, messages_.data(), false}};
}

}  // namespace wm::ros2
