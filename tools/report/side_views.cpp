// SPDX-License-Identifier: Apache-2.0
#include "report/side_views.h"

#include <algorithm>
#include <cmath>

#include "common/statistics.h"
#include "report/axes.h"
#include "report/picture.h"
#include "report/style.h"
#include "report/words.h"

namespace wm::tools {
namespace {

constexpr double kWidth = 1000;
constexpr double kMargin = 28;
constexpr double kFoot = 40;
constexpr double kLowest = 170;  // height of a drawing
constexpr double kFlat_m = 0.05;
constexpr size_t kEllipses = 28;
constexpr int kHeight = 2;  // z

// One side: metres along `axis` and up, in the drawing's units; the same scale both ways.
struct Side {
  int axis;
  double scale, left_m, top_m, inner;
  [[nodiscard]] std::string at(const Eigen::Vector3d &p) const {
    return fixed((p[axis] - left_m) * scale, 1) + " " + fixed((top_m - p[kHeight]) * scale, 1);
  }
};

Eigen::AlignedBox3d extent(const ReportData &data) {
  Eigen::AlignedBox3d box;
  for (const Pose &pose : data.trajectory.poses) box.extend(pose.p_m);
  if (data.truth)
    for (const Pose &pose : data.truth->truth) box.extend(pose.p_m);
  const double reach = std::max(box.sizes().norm(), 1.0);
  const Eigen::AlignedBox3d near(box.min().array() - reach, box.max().array() + reach);
  for (const auto *list : {&data.landmarks, &data.estimated_landmarks})
    for (const Landmark &landmark : *list)
      if (near.contains(landmark.p_m)) box.extend(landmark.p_m);
  return box;
}

Side side_of(int axis, const Eigen::AlignedBox3d &box) {
  const double wide = std::max(box.sizes()[axis], 0.5), high = std::max(box.sizes()[kHeight], 0.1);
  const double scale = std::min((kWidth - 2 * kMargin) / wide, 420 / high);
  const double inner = std::max(kLowest, high * scale + 2 * kMargin);
  return {axis, scale, box.center()[axis] - kWidth / 2 / scale, box.center()[kHeight] + inner / 2 / scale, inner};
}

std::string trace(const std::vector<Pose> &poses, const Side &side) {
  std::string d;
  Eigen::Vector2d drawn{1e300, 0};
  for (const Pose &pose : poses) {
    const Eigen::Vector2d here(pose.p_m[side.axis], pose.p_m[kHeight]);
    if ((here - drawn).norm() * side.scale < 0.6 && &pose != &poses.back()) continue;
    d += (d.empty() ? "M" : "L") + side.at(pose.p_m);
    drawn = here;
  }
  return d;
}

std::string ellipse(const Pose &pose, const Side &side, double times) {
  Eigen::Matrix2d covariance;
  const int at[2] = {side.axis, kHeight};
  for (int i = 0; i < 2; i++)
    for (int j = 0; j < 2; j++) covariance(i, j) = pose.covariance(at[i], at[j]);
  if (!covariance.allFinite()) return "";
  const double reach = std::sqrt(chi2_quantile(0.95, 2)) * times * side.scale;
  const Ellipse axes = ellipse_of(covariance);
  return "<ellipse class=\"ellipse\" rx=\"" + fixed(axes.longer_m * reach, 1) + "\" ry=\"" +
         fixed(axes.shorter_m * reach, 1) + "\" transform=\"translate(" + side.at(pose.p_m) + ") rotate(" +
         fixed(-axes.longer_rad * 180 / M_PI, 1) + ")\"/>";
}

std::string grid(const Side &side, const char *name) {
  const double right_m = side.left_m + kWidth / side.scale, bottom_m = side.top_m - side.inner / side.scale;
  std::string d, text;
  for (const double x : round_ticks(side.left_m, right_m, 7)) {
    const double at = (x - side.left_m) * side.scale;
    d += "M" + fixed(at, 1) + " 0V" + fixed(side.inner, 1);
    if (at > 30 && at < kWidth - 60)
      text += "<text x=\"" + fixed(at, 1) + "\" y=\"" + fixed(side.inner + 27, 1) + "\" text-anchor=\"middle\">" +
              number_text(x, x == std::round(x) ? 0 : 1) + "</text>";
  }
  for (const double z : round_ticks(bottom_m, side.top_m, 4)) {
    const double at = (side.top_m - z) * side.scale;
    d += "M0 " + fixed(at, 1) + "H" + fixed(kWidth, 0);
    if (at > 44 && at < side.inner - 6)
      text += "<text x=\"6\" y=\"" + fixed(at - 5, 1) + "\">" + number_text(z, z == std::round(z) ? 0 : 1) + "</text>";
  }
  text += "<text x=\"" + fixed(kWidth - 6, 0) + "\" y=\"" + fixed(side.inner + 27, 1) + "\" text-anchor=\"end\">" +
          name + ", m</text><text x=\"6\" y=\"6\" dy=\".95em\">z, m</text>";
  return "<path class=\"grid\" d=\"" + d + "\"/><g class=\"tick\">" + text + "</g>";
}

std::string draw(const ReportData &data, const Side &side, const char *name, double ellipse_scale) {
  const auto &poses = data.trajectory.poses;
  std::string body = grid(side, name);
  if (ellipse_scale > 0)
    for (const size_t i : spread_along(poses, kEllipses)) body += ellipse(poses[i], side, ellipse_scale);
  if (data.truth) body += "<path class=\"truth\" d=\"" + trace(data.truth->truth, side) + "\"/>";
  body += "<path class=\"estimate\" d=\"" + trace(poses, side) + "\"/>";
  for (const Landmark &landmark : data.estimated_landmarks)
    body += "<path class=\"guess\" d=\"M" + side.at(landmark.p_m) + "m-6 0h12m-6-6v12\"/>";
  for (const Landmark &landmark : data.landmarks)
    body += "<path class=\"landmark\" d=\"M" + side.at(landmark.p_m) + "m0-8l8 8l-8 8l-8-8Z\"/>";
  return "<svg class=\"map\" viewBox=\"0 0 " + fixed(kWidth, 0) + " " + fixed(side.inner + kFoot, 0) +
         "\" role=\"img\" aria-label=\"The drive from the side: " + name + " and height\">" + body + "</svg>\n";
}

}  // namespace

std::string side_views(const ReportData &data, double ellipse_scale) {
  Eigen::AlignedBox3d path;
  for (const Pose &pose : data.trajectory.poses) path.extend(pose.p_m);
  if (path.isEmpty() || path.sizes()[kHeight] < kFlat_m) return "";
  const Eigen::AlignedBox3d box = extent(data);
  return "<p class=\"how\">The same from the side, along y and along x.</p><figure>" +
         draw(data, side_of(0, box), "x", ellipse_scale) + "</figure><p></p><figure>" +
         draw(data, side_of(1, box), "y", ellipse_scale) + "</figure>";
}

}  // namespace wm::tools
