// SPDX-License-Identifier: Apache-2.0
// What a listener of the published poses can notice: how old they are, whether they come in order, whether they jump.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/statistics.h"
#include "eval/figures.h"

namespace wm::tools {
namespace {

// Map against odom moving by more than this between two messages is a jump, which must be announced (the default of
// publish.jump_m and publish.jump_deg).
constexpr double kJumpM = 0.1;
constexpr double kJumpRad = 2 * M_PI / 180;

Eigen::Isometry2d planar(double x_m, double y_m, double angle_rad) {
  return Eigen::Translation2d(x_m, y_m) * Eigen::Rotation2Dd(angle_rad);
}

// How far the pose in map moved beyond what odom says it moved.
struct Jump {
  double m, rad;
};

Jump jump_between(const PublishedRow &a, const PublishedRow &b) {
  const auto map = [](const PublishedRow &row) {
    return planar(row.pose.p_m.x(), row.pose.p_m.y(), heading_rad(row.pose.q));
  };
  const auto odom = [](const PublishedRow &row) { return planar(row.odom[0], row.odom[1], row.odom[2]); };
  const Eigen::Isometry2d expected = map(a) * odom(a).inverse() * odom(b);
  const Eigen::Isometry2d off = expected.inverse() * map(b);
  return {off.translation().norm(), std::abs(Eigen::Rotation2Dd(off.rotation()).smallestAngle())};
}

}  // namespace

void add_published_figures(const Published &published, Figures *figures) {
  std::vector<double> ages_ms;
  std::vector<double> behind_ms;
  for (const PublishedRow &row : published.rows) {
    ages_ms.push_back(static_cast<double>(row.made_ns - row.t_ns) * 1e-6);
    behind_ms.push_back(static_cast<double>(row.t_ns - row.fused_until_ns) * 1e-6);
  }
  double odom_step_m = 0;
  double odom_speed_mps = 0;
  double largest_jump_m = 0;
  int64_t jumps = 0;
  int64_t unannounced = 0;
  for (size_t i = 1; i < published.rows.size(); ++i) {
    const PublishedRow &a = published.rows[i - 1];
    const PublishedRow &b = published.rows[i];
    if (!a.odom.allFinite() || !b.odom.allFinite()) continue;
    const double step_m = (b.odom.head<2>() - a.odom.head<2>()).norm();
    odom_step_m = std::max(odom_step_m, step_m);
    if (b.t_ns > a.t_ns)
      odom_speed_mps = std::max(odom_speed_mps, step_m / (static_cast<double>(b.t_ns - a.t_ns) * 1e-9));
    const Jump jump = jump_between(a, b);
    largest_jump_m = std::max(largest_jump_m, jump.m);
    if (jump.m <= kJumpM && jump.rad <= kJumpRad) continue;
    ++jumps;
    if (a.announced == b.announced) ++unannounced;
  }
  auto &f = *figures;
  f["published"] = published.rows.size();
  f["t_strictly_rising"] = published.strictly_rising;
  f["age_median_ms"] = number(percentile(ages_ms, 50));
  f["age_p99_ms"] = number(percentile(ages_ms, 99));
  f["age_max_ms"] = number(percentile(ages_ms, 100));
  f["predicted_ahead_median_ms"] = number(percentile(behind_ms, 50));
  f["resets"] = published.rows.back().resets - published.rows.front().resets;
  f["jumps"] = jumps;
  f["jumps_unannounced"] = unannounced;
  f["jump_max_m"] = number(largest_jump_m);
  f["odom_step_max_m"] = number(odom_step_m);
  f["odom_speed_max_mps"] = number(odom_speed_mps);
}

}  // namespace wm::tools
