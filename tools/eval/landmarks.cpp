// SPDX-License-Identifier: Apache-2.0
// SLAM's map against the true places.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/statistics.h"
#include "eval/figures.h"

namespace wm::tools {
namespace {

constexpr double kNearestM = 0.5;
// Pairs of wrong identities leave about the spread of the true places, however the map is laid over them: 0.7 of it and
// more with five landmarks.
constexpr double kShapeless = 0.5;

struct Pair {
  const Landmark *estimate;
  const Landmark *truth;
};

double apart(const Landmark &a, const Landmark &b, bool planar) {
  return planar ? (a.p_m - b.p_m).head<2>().norm() : (a.p_m - b.p_m).norm();
}

const Landmark *nearest(const Landmark &to, const std::vector<Landmark> &among, bool planar) {
  const Landmark *best = nullptr;
  for (const Landmark &candidate : among)
    if (best == nullptr || apart(to, candidate, planar) < apart(to, *best, planar)) best = &candidate;
  return best;
}

std::vector<Pair> by_id(const std::vector<Landmark> &estimate, const std::vector<Landmark> &truth) {
  std::map<int64_t, const Landmark *> known;
  for (const Landmark &landmark : truth) known[landmark.id] = &landmark;
  std::map<int64_t, Pair> pairs;  // a true landmark counts once
  for (const Landmark &landmark : estimate)
    if (const auto found = known.find(landmark.id); found != known.end())
      pairs[landmark.id] = {&landmark, found->second};
  std::vector<Pair> out;
  for (const auto &[id, pair] : pairs) out.push_back(pair);
  return out;
}

std::vector<Pair> by_place(const std::vector<Landmark> &estimate, const std::vector<Landmark> &truth, bool planar) {
  std::vector<Pair> out;
  for (const Landmark &landmark : estimate) {
    const Landmark *there = nearest(landmark, truth, planar);
    if (there != nullptr && apart(landmark, *there, planar) <= kNearestM &&
        nearest(*there, estimate, planar) == &landmark)
      out.push_back({&landmark, there});
  }
  return out;
}

// What is left when the map as a whole is laid over the true one: its shape alone, wherever a causal trajectory says
// that it lies. NaN with fewer than three landmarks.
double rms_by_own_fit(const std::vector<Pair> &pairs, Alignment kind) {
  if (pairs.size() < 3) return std::numeric_limits<double>::quiet_NaN();
  std::vector<Eigen::Vector3d> from;
  std::vector<Eigen::Vector3d> to;
  for (const Pair &pair : pairs) {
    from.push_back(pair.estimate->p_m);
    to.push_back(pair.truth->p_m);
  }
  const Similarity fit = align(from, to, kind);
  std::vector<double> off_m;
  for (size_t i = 0; i < from.size(); ++i)
    off_m.push_back((fit.scale * (fit.R * from[i]) + fit.t - to[i]).head<2>().norm());
  return rms(off_m);
}

double spread(const std::vector<Pair> &pairs) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Pair &pair : pairs) mean += pair.truth->p_m.head<2>() / static_cast<double>(pairs.size());
  std::vector<double> off_m;
  for (const Pair &pair : pairs) off_m.push_back((pair.truth->p_m.head<2>() - mean).norm());
  return rms(off_m);
}

// Whether the estimate's ids are truth's: at least half of them occur there. Ids that a filter gave out itself (lines,
// landmarks without identity) occur there by chance: then the map has truth's shape by place, and none by id.
bool shares_ids(const std::vector<Landmark> &estimate, const std::vector<Pair> &named, const std::vector<Pair> &placed,
                Alignment kind) {
  if (2 * named.size() < estimate.size()) return false;
  return named.size() < 3 || 2 * placed.size() < estimate.size() ||
         !(rms_by_own_fit(named, kind) > kShapeless * spread(named));
}

}  // namespace

bool has_identities(const std::filesystem::path &recording) {
  const auto seen = load_sightings(recording);
  const bool is_named = std::any_of(seen.begin(), seen.end(), [](const Sighting &s) { return s.id >= 0; });
  return is_named || seen.empty() || std::filesystem::exists(recording / "markers.csv") ||
         std::filesystem::exists(recording / "video");
}

void add_landmark_figures(const std::vector<Landmark> &estimate, const std::vector<Landmark> &truth,
                          const Comparison &comparison, bool has_identities, Figures *figures) {
  std::vector<Landmark> aligned = estimate;
  const Similarity &alignment = comparison.alignment;
  const double turned = std::atan2(alignment.R(1, 0), alignment.R(0, 0));
  for (Landmark &landmark : aligned) {
    landmark.p_m = alignment.scale * (alignment.R * landmark.p_m) + alignment.t;
    landmark.yaw_rad += turned;
  }
  const Alignment kind = alignment.scale == 1 ? Alignment::kSe2 : Alignment::kSim2;
  const auto named = by_id(aligned, truth), placed = by_place(aligned, truth, comparison.planar);
  const bool same_ids = has_identities && shares_ids(aligned, named, placed, kind);
  const std::vector<Pair> &pairs = same_ids ? named : placed;

  std::vector<double> off_m;
  std::vector<double> off_deg;
  for (const Pair &pair : pairs) {
    off_m.push_back(apart(*pair.estimate, *pair.truth, comparison.planar));
    const double turn = wrap(pair.estimate->yaw_rad - pair.truth->yaw_rad);
    if (std::isfinite(turn)) off_deg.push_back(turn * 180 / std::numbers::pi);
  }
  auto &f = *figures;
  f["landmark_rmse_m"] = number(rms(off_m));
  f["landmark_heading_rmse_deg"] = number(rms(off_deg));
  f["landmarks_found"] = pairs.size();
  f["landmarks_total"] = truth.size();
  f["landmarks_estimated"] = estimate.size();
  f["landmark_max_m"] =
      number(off_m.empty() ? std::numeric_limits<double>::quiet_NaN() : *std::max_element(off_m.begin(), off_m.end()));
  f["landmark_rmse_own_fit_m"] =
      number(comparison.planar ? rms_by_own_fit(pairs, kind) : std::numeric_limits<double>::quiet_NaN());
  f["landmarks_matched_by"] = same_ids ? "id" : "place";
}

}  // namespace wm::tools
