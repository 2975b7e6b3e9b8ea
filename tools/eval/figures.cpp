// SPDX-License-Identifier: Apache-2.0
#include "eval/figures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "common/statistics.h"

namespace wm::tools {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kCountedStepM = 0.01;
constexpr double kBeyondSigmas = 3.5;
constexpr int64_t kSeenWithinNs = 2'000'000'000;

double seconds_between(const Pose &a, const Pose &b) { return static_cast<double>(b.t_ns - a.t_ns) * 1e-9; }

// One value a sample, those that are not defined left out.
template <class Value>
std::vector<double> values_of(const Comparison &comparison, Value value) {
  std::vector<double> out;
  for (const Sample &sample : comparison.samples)
    if (const double v = value(sample); std::isfinite(v)) out.push_back(v);
  return out;
}

struct Stretch {
  double duration_s;
  bool to_the_end;
};

// Stretches of neighbouring samples for which `holds`: from the first to the last of them.
template <class Holds>
std::vector<Stretch> stretches(const Comparison &comparison, Holds holds) {
  std::vector<Stretch> out;
  const auto &samples = comparison.samples;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!holds(samples[i])) continue;
    size_t last = i;
    while (last + 1 < samples.size() && holds(samples[last + 1])) ++last;
    out.push_back({seconds_between(samples[i].truth, samples[last].truth), last + 1 == samples.size()});
    i = last;
  }
  return out;
}

void add_lost(const Comparison &comparison, bool gnss, Figures *figures) {
  int64_t count = 0;
  double lost_s = 0;
  // In space it is the whole rotation: a camera that looks down has no heading to speak of.
  const auto off = [&comparison](const Sample &s) {
    const double turned_rad = comparison.planar ? std::abs(s.heading_error_rad) : s.rotation_rad.norm();
    return s.error_m.norm() > kLostPositionM || turned_rad * kDegrees > kLostHeadingDeg;
  };
  for (const Stretch &stretch : stretches(comparison, off))
    if (stretch.duration_s > kLostForS || stretch.to_the_end) ++count, lost_s += stretch.duration_s;
  (*figures)["lost_count"] = gnss ? Figures() : Figures(count);
  (*figures)["lost_s"] = gnss ? Figures() : Figures(lost_s);
}

// Any component of the error beyond its own sigma times kBeyondSigmas.
bool beyond_sigmas(const Sample &s, bool planar) {
  Eigen::Matrix<double, 6, 1> error;
  error << s.error_m, s.rotation_rad;
  if (planar) error.tail<3>() << 0, 0, s.heading_error_rad;
  for (int i = 0; i < 6; ++i) {
    const double variance = s.estimate.covariance(i, i);
    if (error[i] * error[i] > kBeyondSigmas * kBeyondSigmas * variance) return true;
  }
  return false;
}

}  // namespace

Figures number(double value) { return std::isfinite(value) ? Figures(value) : Figures(nullptr); }

double path_length(const std::vector<Pose> &path, bool planar) {
  if (path.empty()) return 0;
  double length = 0;
  Eigen::Vector3d last_m = path.front().p_m;
  for (const Pose &pose : path) {
    Eigen::Vector3d step = pose.p_m - last_m;
    if (planar) step.z() = 0;
    if (step.norm() < kCountedStepM) continue;
    length += step.norm();
    last_m = pose.p_m;
  }
  return length;
}

Figures pose_figures(const Comparison &comparison, bool has_covariance, bool gnss) {
  const auto position = values_of(comparison, [](const Sample &s) { return s.error_m.norm(); });
  const auto along = values_of(comparison, [](const Sample &s) { return s.along_m; });
  const auto across = values_of(comparison, [](const Sample &s) { return s.across_m; });
  const auto heading = values_of(comparison, [](const Sample &s) { return s.heading_error_rad * kDegrees; });
  const auto rotation = values_of(comparison, [](const Sample &s) { return s.rotation_rad.norm() * kDegrees; });
  const auto nees = values_of(comparison, [](const Sample &s) { return s.nees; });
  const double distance_m = path_length(comparison.truth, comparison.planar);
  const double end_m = comparison.samples.back().error_m.norm();
  const auto samples = static_cast<double>(comparison.samples.size());

  Figures f;
  f["distance_m"] = number(distance_m);
  f["duration_s"] = number(seconds_between(comparison.truth.front(), comparison.truth.back()));
  f["poses"] = comparison.samples.size();
  f["coverage"] = number(samples / static_cast<double>(comparison.stamps));
  f["position_mean_m"] = number(mean(position));
  f["position_median_m"] = number(percentile(position, 50));
  f["position_rmse_m"] = number(rms(position));
  f["position_p95_m"] = number(percentile(position, 95));
  f["position_max_m"] = number(max_abs(position));
  f["position_end_m"] = number(end_m);
  f["position_end_percent"] = number(distance_m > 0 ? 100 * end_m / distance_m : kNan);
  for (const auto &[name, values] : {std::pair{"longitudinal", &along}, std::pair{"lateral", &across}}) {
    const std::string prefix = name;
    f[prefix + "_mean_m"] = number(mean(*values));
    f[prefix + "_mean_abs_m"] = number(mean_abs(*values));
    f[prefix + "_std_m"] = number(standard_deviation(*values));
    f[prefix + "_max_m"] = number(max_abs(*values));
  }
  f["heading_mean_deg"] = number(mean(heading));
  f["heading_mean_abs_deg"] = number(mean_abs(heading));
  f["heading_rmse_deg"] = number(rms(heading));
  f["heading_max_deg"] = number(max_abs(heading));
  f["rotation_rmse_deg"] = number(rms(rotation));
  f["rotation_max_deg"] = number(max_abs(rotation));

  const bool judged = has_covariance && !gnss;
  const double bound = chi2_quantile(0.95, comparison.nees_dof);
  const auto inside = std::count_if(nees.begin(), nees.end(), [bound](double v) { return v <= bound; });
  f["nees_mean"] = number(mean(nees));
  // Of all stamps: one whose covariance is none is not inside of it.
  f["nees_inside_95"] = number(judged ? static_cast<double>(inside) / samples : kNan);
  f["anees_dof"] = judged ? Figures(comparison.nees_dof) : Figures();
  add_lost(comparison, gnss, &f);
  for (const char *name : {"landmark_rmse_m", "landmark_heading_rmse_deg", "landmarks_found", "landmarks_total"})
    f[name] = nullptr;

  // Beside the format's.
  f["covariances_not_positive"] = judged ? Figures(comparison.covariances_not_positive) : Figures();
  double longest_s = 0;
  const auto beyond = [&comparison](const Sample &sample) { return beyond_sigmas(sample, comparison.planar); };
  for (const Stretch &stretch : stretches(comparison, beyond)) longest_s = std::max(longest_s, stretch.duration_s);
  f["beyond_3_5_sigma_longest_s"] = number(judged ? longest_s : kNan);
  f["position_rmse_landmark_seen_m"] = nullptr;
  return f;
}

void add_sighting_figures(const Comparison &comparison, const std::vector<Sighting> &sightings,
                          const std::vector<Landmark> &known, Figures *figures) {
  std::set<int64_t> ids;
  for (const Landmark &landmark : known) ids.insert(landmark.id);
  std::vector<double> errors;
  size_t next = 0;
  int64_t last_seen_ns = std::numeric_limits<int64_t>::min() / 2;
  for (const Sample &sample : comparison.samples) {
    for (; next < sightings.size() && sightings[next].t_ns <= sample.truth.t_ns; ++next)
      if (ids.contains(sightings[next].id)) last_seen_ns = sightings[next].t_ns;
    if (sample.truth.t_ns - last_seen_ns <= kSeenWithinNs) errors.push_back(sample.error_m.norm());
  }
  (*figures)["position_rmse_landmark_seen_m"] = number(rms(errors));
}

}  // namespace wm::tools
