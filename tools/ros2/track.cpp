// SPDX-License-Identifier: Apache-2.0
#include "ros2/track.h"

#include <algorithm>

namespace wm::ros2 {
namespace {

constexpr int64_t kKept_ns = 2'000'000'000;  // longer than odometry or a pose is late
constexpr size_t kKept = 4000;               // 2 s at 2 kHz; faster senders get a shorter track

}  // namespace

void Track::add(int64_t t_ns, const Eigen::Isometry3d &pose) {
  if (!entries_.empty() && t_ns <= entries_.back().t_ns) entries_.clear();
  entries_.push_back({t_ns, pose});
  while (entries_.size() > kKept || entries_.front().t_ns < t_ns - kKept_ns) entries_.pop_front();
}

std::optional<Eigen::Isometry3d> Track::at(int64_t t_ns) const {
  const auto after = std::find_if(entries_.begin(), entries_.end(), [&](const Entry &e) { return e.t_ns >= t_ns; });
  if (after == entries_.end()) return std::nullopt;
  if (after->t_ns == t_ns) return after->pose;
  if (after == entries_.begin()) return std::nullopt;
  const Entry &a = *(after - 1), &b = *after;
  const double part = static_cast<double>(t_ns - a.t_ns) / static_cast<double>(b.t_ns - a.t_ns);
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translation() = (1 - part) * a.pose.translation() + part * b.pose.translation();
  out.linear() = Eigen::Quaterniond(a.pose.linear()).slerp(part, Eigen::Quaterniond(b.pose.linear())).matrix();
  return out;
}

std::optional<int64_t> Track::newest_ns() const {
  if (entries_.empty()) return std::nullopt;
  return entries_.back().t_ns;
}

}  // namespace wm::ros2
