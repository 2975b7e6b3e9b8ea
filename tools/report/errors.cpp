// SPDX-License-Identifier: Apache-2.0
// How far off, over time, and how sure the robot was of it.
#include <algorithm>
#include <cmath>
#include <functional>

#include "common/statistics.h"
#include "report/axes.h"
#include "report/page.h"
#include "report/words.h"

namespace wm::tools {
namespace {

constexpr double kGapS = 1.0;
constexpr double kDegrees = 180 / M_PI;

struct Series {
  std::string what;  // the panel's title without its unit
  bool angle;
  std::vector<double> t, error, sigma;
};

// The unit in which the values are read best.
struct Unit {
  double per_si;
  std::string name;
};

Unit unit_for(double largest, bool angle) {
  if (angle) return {kDegrees, "°"};
  if (largest < 0.02) return {1e3, "mm"};
  if (largest < 2) return {1e2, "cm"};
  return {1, "m"};
}

// So high that all errors are seen, and the bounds as far as they don't make the errors flat.
double half_height(const Series &s) {
  std::vector<double> bounds;
  for (const double sigma : s.sigma)
    if (std::isfinite(sigma)) bounds.push_back(3 * sigma);
  const double errors = max_abs(s.error);
  const double wide = bounds.empty() ? 0 : percentile(bounds, 97);
  const double high = std::max(errors, std::isfinite(errors) && errors > 0 ? std::min(wide, 3 * errors) : wide);
  return high > 0 ? 1.12 * high : 1;
}

std::string panel(const Series &s, double end_s, bool last) {
  const double high = half_height(s);
  const Unit unit = unit_for(high, s.angle);
  std::vector<double> error;
  std::vector<double> low;
  std::vector<double> up;
  size_t outside = 0;
  for (size_t i = 0; i < s.t.size(); ++i) {
    error.push_back(s.error[i] * unit.per_si);
    up.push_back(3 * s.sigma[i] * unit.per_si);
    low.push_back(-up.back());
    if (std::abs(error.back()) > up.back()) ++outside;
  }
  Panel box({0, end_s}, {-high * unit.per_si, high * unit.per_si});
  box.band(s.t, low, up, "band", kGapS);
  box.level(0, "zero", "");
  box.line(s.t, error, "value", kGapS);
  const auto said = [&s](double value) { return s.angle ? angle_text(value * kDegrees) : length_text(value); };
  std::string figures = "rms " + said(rms(s.error)) + " · largest " + said(max_abs(s.error));
  if (std::isfinite(s.sigma.front()))
    figures += " · outside of 3 σ " + percent_text(static_cast<double>(outside) / static_cast<double>(s.t.size()));
  return box.html({.title = "<span>" + s.what + ", " + unit.name + "</span><small>" + figures + "</small>",
                   .describes = s.what + " over time: " + figures,
                   .x_text = last,
                   .height_px = 138});
}

// A series of every sample that has a value.
Series series(const ReportData &data, std::string what, bool angle, const std::function<double(const Sample &)> &error,
              const std::function<double(const Sample &)> &variance) {
  Series s{std::move(what), angle, {}, {}, {}};
  for (const Sample &sample : data.truth->samples) {
    const double value = error(sample);
    if (!std::isfinite(value)) continue;
    s.t.push_back(data.seconds(sample.truth.t_ns));
    s.error.push_back(value);
    s.sigma.push_back(data.trajectory.has_covariance ? std::sqrt(variance(sample)) : kNan);
  }
  return s;
}

// Variance of the position error in the direction that is `turn` to the left of truth's heading.
double variance_along(const Sample &s, double turn) {
  const double angle = heading_rad(s.truth.q) + turn;
  const Eigen::Vector2d axis(std::cos(angle), std::sin(angle));
  return axis.dot(s.estimate.covariance.topLeftCorner<2, 2>() * axis);
}

std::vector<Series> all_series(const ReportData &data) {
  std::vector<Series> out;
  out.push_back(series(
      data, "Along its way: ahead (+) or behind (−)", false, [](const Sample &s) { return s.along_m; },
      [](const Sample &s) { return variance_along(s, 0); }));
  out.push_back(series(
      data, "Across its way: to the left (+) or right (−)", false, [](const Sample &s) { return s.across_m; },
      [](const Sample &s) { return variance_along(s, M_PI / 2); }));
  if (out.front().t.empty()) {
    out.clear();  // truth without orientation: the map's axes
    for (const int axis : {0, 1})
      out.push_back(series(
          data, axis == 0 ? "In x of the map" : "In y of the map", false,
          [axis](const Sample &s) { return s.error_m[axis]; },
          [axis](const Sample &s) { return s.estimate.covariance(axis, axis); }));
  }
  if (data.trajectory.planar) {
    out.push_back(series(
        data, "Heading: turned too far left (+) or right (−)", true,
        [](const Sample &s) { return s.heading_error_rad; },
        [](const Sample &s) { return s.estimate.covariance(5, 5); }));
  } else {
    out.push_back(series(
        data, "Height: too high (+) or too low (−)", false, [](const Sample &s) { return s.error_m.z(); },
        [](const Sample &s) { return s.estimate.covariance(2, 2); }));
    const char *names[] = {"Roll, about the body’s x", "Pitch, about the body’s y", "Yaw, about the body’s z"};
    for (int axis = 0; axis < 3; ++axis)
      out.push_back(series(
          data, names[axis], true, [axis](const Sample &s) { return -s.rotation_rad[axis]; },
          [axis](const Sample &s) { return s.estimate.covariance(3 + axis, 3 + axis); }));
  }
  std::erase_if(out, [](const Series &s) { return s.t.empty(); });
  return out;
}

}  // namespace

std::string error_section(const ReportData &data) {
  const auto all = all_series(data);
  std::string body;
  for (size_t i = 0; i < all.size(); ++i) body += panel(all[i], data.end_s(), i + 1 == all.size());
  std::vector<std::pair<std::string, std::string>> marks{
      {"<path class=\"estimate\" d=\"M0 0H28\"/>", "error: estimate minus truth"}};
  if (data.trajectory.has_covariance)
    marks.emplace_back("<path fill=\"var(--band)\" d=\"M0-7H28V7H0ZM0-7H28V7H0Z\"/>",
                       "±3 σ as the robot stated it at that moment");
  return section("Errors",
                 data.trajectory.has_covariance
                     ? "The line is the error; the band is where the robot itself said that the error would be. The "
                       "line should lie in the band nearly always, and fill a good part of it: a band much wider than "
                       "the line is timid, a narrower one is careless. Time runs from the first pose."
                     : "The line is the error. This run stated no uncertainty. Time runs from the first pose.",
                 "<figure>" + body + legend(marks) + "</figure>");
}

std::string uncertainty_section(const ReportData &data) {
  if (!data.trajectory.has_covariance) return "";
  std::vector<double> t;
  std::vector<double> radius;
  std::vector<double> heading;
  const double reach = std::sqrt(chi2_quantile(0.95, 2));
  for (const Pose &pose : data.trajectory.poses) {
    t.push_back(data.seconds(pose.t_ns));
    radius.push_back(std::max(0.0, reach * ellipse_of(pose.covariance.topLeftCorner<2, 2>()).longer_m));
    heading.push_back(1.96 * std::sqrt(std::max(0.0, pose.covariance(5, 5))) * kDegrees);
  }
  const auto draw = [&](const std::string &what, std::vector<double> v, const Unit &unit, bool last) {
    for (double &value : v) value *= unit.per_si;
    Panel box({0, data.end_s()}, {0, 1.1 * std::max(max_abs(v), 1e-9)});
    box.band(t, std::vector<double>(v.size(), 0.0), v, "band", kGapS);
    box.line(t, v, "value", kGapS);
    return box.html({.title = "<span>" + what + ", " + unit.name + "</span>", .describes = what, .x_text = last});
  };
  return section("Uncertainty",
                 "There is no truth in this recording, so this is the robot’s own word: in 95 of 100 moments it should "
                 "be nearer to its stated pose than this line.",
                 "<figure>" + draw("Position", radius, unit_for(max_abs(radius), false), false) +
                     draw("Heading", heading, {1, "°"}, true) + "</figure>");
}

}  // namespace wm::tools
