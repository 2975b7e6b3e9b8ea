// SPDX-License-Identifier: Apache-2.0
#include "eval/detector.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "common/csv.h"
#include "common/failure.h"

namespace wm::tools {
namespace {

using Eigen::Vector2d;

constexpr double kStep_px = 1;  // lengths are sampled so

double length_of(const Polyline &line) {
  double sum = 0;
  for (size_t i = 1; i < line.size(); i++) sum += (line[i] - line[i - 1]).norm();
  return sum;
}

double distance_to_link(const Vector2d &p, const Vector2d &a, const Vector2d &b) {
  const Vector2d along = b - a;
  const double length2 = along.squaredNorm();
  const double s = length2 > 0 ? std::clamp((p - a).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (p - a - s * along).norm();
}

double distance(const Vector2d &p, const Polyline &line) {
  double nearest = (p - line.front()).norm();
  for (size_t i = 1; i < line.size(); i++) nearest = std::min(nearest, distance_to_link(p, line[i - 1], line[i]));
  return nearest;
}

bool near_any(const Vector2d &p, const std::vector<Polyline> &lines, double within) {
  return std::any_of(lines.begin(), lines.end(), [&](const Polyline &line) { return distance(p, line) <= within; });
}

// Calls visit(middle of a piece, its length) along the line, in pieces of at most a step.
template <typename Visit>
void along(const Polyline &line, Visit visit) {
  for (size_t i = 1; i < line.size(); i++) {
    const Vector2d link = line[i] - line[i - 1];
    const double length = link.norm();
    const int pieces = std::max(1, static_cast<int>(std::ceil(length / kStep_px)));
    for (int k = 0; k < pieces; k++) visit(line[i - 1] + link * ((k + 0.5) / pieces), length / pieces);
  }
}

// Whether a segment meets the rectangle 0 <= x <= length, |y| <= half (Liang and Barsky's clipping).
bool meets_rectangle(const Vector2d &a, const Vector2d &b, double length, double half) {
  const Vector2d d = b - a;
  double t0 = 0, t1 = 1;
  const auto clip = [&](double p, double q) {  // p t <= q
    if (p == 0) return q >= 0;
    if (p < 0)
      t0 = std::max(t0, q / p);
    else
      t1 = std::min(t1, q / p);
    return t0 <= t1;
  };
  return clip(-d.x(), a.x()) && clip(d.x(), length - a.x()) && clip(-d.y(), a.y() + half) && clip(d.y(), half - a.y());
}

bool touches_any(const Polyline &line, const std::vector<Polyline> &others, double omega_px) {
  return std::any_of(others.begin(), others.end(),
                     [&](const Polyline &other) { return touches_region(line, other, omega_px); });
}

// The stretches of the line that are in view.
std::vector<Polyline> in_view(const Polyline &line, const DetectorMetric &metric) {
  if (!metric.in_view) return {line};
  std::vector<Polyline> out;
  bool inside = false;
  const auto step = [&](const Vector2d &p) {
    const bool now = metric.in_view(p);
    if (now && !inside) out.emplace_back();
    if (now) out.back().push_back(p);
    inside = now;
  };
  step(line.front());
  for (size_t i = 1; i < line.size(); i++) {
    const Vector2d link = line[i] - line[i - 1];
    const int pieces = std::max(1, static_cast<int>(std::ceil(link.norm() / kStep_px)));
    for (int k = 1; k <= pieces; k++) step(line[i - 1] + link * (static_cast<double>(k) / pieces));
  }
  return out;
}

struct Counts {
  int64_t frames = 0, true_polylines = 0, left_out_short = 0, left_out_of_view = 0;
  int64_t detected = 0, on_left_out = 0, tp = 0, fp = 0, found = 0, fn = 0;
  double detected_length = 0, detected_near = 0, true_length = 0, true_near = 0;
};

void judge_frame(const std::vector<Polyline> &truth, const std::vector<Polyline> &detected,
                 const DetectorMetric &metric, Counts &n) {
  std::vector<Polyline> wanted, left_out;
  n.frames++;
  for (const Polyline &line : truth) {
    n.true_polylines++;
    double length = 0;
    std::vector<Polyline> parts = in_view(line, metric);
    for (const Polyline &part : parts) length += length_of(part);
    left_out.push_back(line);  // also of a line that counts, the parts out of view: whoever finds them isn't wrong
    if (length < metric.min_length_px) {
      (parts.empty() ? n.left_out_of_view : n.left_out_short)++;
      continue;
    }
    for (Polyline &part : parts) wanted.push_back(std::move(part));
    const bool found = std::any_of(detected.begin(), detected.end(), [&](const Polyline &d) {
      return std::any_of(wanted.end() - static_cast<std::ptrdiff_t>(parts.size()), wanted.end(),
                         [&](const Polyline &part) { return touches_region(d, part, metric.omega_px); });
    });
    (found ? n.found : n.fn)++;
  }
  for (const Polyline &line : detected) {
    n.detected++;
    if (touches_any(line, wanted, metric.omega_px))
      n.tp++;
    else if (touches_any(line, left_out, metric.omega_px))
      n.on_left_out++;
    else
      n.fp++;
    along(line, [&](const Vector2d &p, double length) {
      const bool right = near_any(p, wanted, metric.omega_px);
      if (!right && near_any(p, left_out, metric.omega_px)) return;
      n.detected_length += length;
      if (right) n.detected_near += length;
    });
  }
  for (const Polyline &line : wanted)
    along(line, [&](const Vector2d &p, double length) {
      n.true_length += length;
      if (near_any(p, detected, metric.omega_px)) n.true_near += length;
    });
}

nlohmann::ordered_json share(double part, double whole) {
  return whole > 0 ? nlohmann::ordered_json(part / whole) : nlohmann::ordered_json(nullptr);
}

}  // namespace

bool touches_region(const Polyline &line, const Polyline &other, double omega_px) {
  for (size_t i = 1; i < other.size(); i++) {
    const Vector2d link = other[i] - other[i - 1];
    const double length = link.norm();
    if (!(length > 0)) continue;
    const Vector2d u = link / length;
    const auto local = [&](const Vector2d &p) {
      const Vector2d d = p - other[i - 1];
      return Vector2d(d.dot(u), u.x() * d.y() - u.y() * d.x());
    };
    for (size_t k = 0; k < line.size(); k++)
      if (meets_rectangle(local(line[k]), local(line[k + 1 < line.size() ? k + 1 : k]), length, omega_px)) return true;
  }
  return false;
}

FramePolylines load_polylines(const std::filesystem::path &file) {
  const Csv csv = Csv::load(file);
  const size_t frame = csv.need("frame"), polyline = csv.need("polyline"), u = csv.need("u_px"), v = csv.need("v_px");
  FramePolylines out;
  int64_t last_frame = -1, last = -1;
  for (size_t row = 0; row < csv.rows(); row++) {
    const int64_t number = csv.integer(row, frame);
    std::vector<Polyline> &lines = out[number];
    if (csv.text(row, polyline).empty()) continue;
    const int64_t which = csv.integer(row, polyline);
    const Vector2d p(csv.number(row, u), csv.number(row, v));
    if (!p.allFinite()) throw Failure(csv.where(row, u) + ": u_px and v_px are needed, both");
    if (number != last_frame || which != last || lines.empty()) lines.emplace_back();
    lines.back().push_back(p);
    last_frame = number;
    last = which;
  }
  return out;
}

Figures detector_figures(const FramePolylines &truth, const FramePolylines &detected, const DetectorMetric &metric) {
  static const std::vector<Polyline> kNothing;
  Counts n;
  for (const auto &[frame, lines] : truth) {
    const auto seen = detected.find(frame);
    judge_frame(lines, seen == detected.end() ? kNothing : seen->second, metric, n);
  }
  Figures f;
  f["omega_px"] = metric.omega_px;
  f["min_length_px"] = metric.min_length_px;
  f["frames"] = n.frames;
  f["true_polylines"] = n.true_polylines;
  f["left_out_short"] = n.left_out_short;
  f["left_out_of_view"] = n.left_out_of_view;
  f["detected_polylines"] = n.detected;
  f["detected_on_left_out"] = n.on_left_out;
  f["true_positives"] = n.tp;
  f["false_positives"] = n.fp;
  f["false_negatives"] = n.fn;
  f["precision"] = share(static_cast<double>(n.tp), static_cast<double>(n.tp + n.fp));
  f["recall"] = share(static_cast<double>(n.found), static_cast<double>(n.found + n.fn));
  f["detected_length_px"] = n.detected_length;
  f["true_length_px"] = n.true_length;
  f["length_precision"] = share(n.detected_near, n.detected_length);
  f["length_recall"] = share(n.true_near, n.true_length);
  return f;
}

std::string detector_table(const Figures &f, const std::string &title) {
  const auto percent = [&](const char *key) {
    char text[32];
    if (!f[key].is_number()) return std::string("-");
    std::snprintf(text, sizeof text, "%.1f %%", 100 * f[key].get<double>());
    return std::string(text);
  };
  const auto count = [&](const char *key) { return std::to_string(f[key].get<int64_t>()); };
  char head[256];
  std::snprintf(head, sizeof head, "%s: edges in %s labelled pictures, region of precision %.1f px to each side\n\n",
                title.c_str(), count("frames").c_str(), f["omega_px"].get<double>());
  std::string out = head;
  out += "  by polylines   precision " + percent("precision") + " (" + count("true_positives") + " right, " +
         count("false_positives") + " false), recall " + percent("recall") + " (" + count("false_negatives") +
         " missed)\n";
  out += "  by length      precision " + percent("length_precision") + ", recall " + percent("length_recall") + "\n";
  out += "  left out       of " + count("true_polylines") + " true polylines " + count("left_out_of_view") +
         " out of view and " + count("left_out_short") + " too short; " + count("detected_on_left_out") +
         " detected ones lie on them alone\n";
  return out;
}

}  // namespace wm::tools
