// SPDX-License-Identifier: Apache-2.0
#include "map/survey.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "common/csv.h"
#include "common/json_file.h"
#include "common/run_folder.h"
#include "common/statistics.h"
#include "common/text.h"

namespace wm::tools {
namespace {

constexpr size_t kStreak = 6;   // sightings refused one after the other: no accident
constexpr size_t kSettled = 3;  // fused ones between two streaks: it was there again
constexpr double kOftenRefused = 0.05;
constexpr double kFitsBadly = 2.0;  // sigmas
constexpr size_t kFew = 3;          // an identity seen so seldom, and not on the map

// One sighting of a landmark: its rows, one a residual.
struct Seen {
  enum Verdict { kFused, kRefused, kTwice } verdict;
  double t_s;
  struct Row {
    std::string kind;
    double residual, variance;
  };
  std::vector<Row> rows;
  double off_m;  // how far from where it was expected, over the floor; NaN where the rows don't say
};

double turn(double angle) { return std::remainder(angle, 2 * 3.14159265358979323846); }

// Marker: along and across the line of sight. Bearing and range: across and along.
double off_m(const std::vector<Seen::Row> &rows, double range_m) {
  double sum = 0;
  for (const Seen::Row &row : rows) {
    if (row.kind == "heading") continue;
    const double way = row.kind == "bearing" ? row.residual * range_m : row.residual;
    sum += way * way;
  }
  return std::sqrt(sum);
}

using Sightings = std::map<int64_t, std::vector<Seen>>;

Sightings load_sightings_of(const std::filesystem::path &file) {
  const Csv csv = Csv::load(file);
  const size_t t = csv.need("t_ns"), source = csv.need("source"), id = csv.need("landmark"),
               kind = csv.need("residual"), observed = csv.need("observed"), expected = csv.need("expected"),
               variance = csv.need("variance"), verdict = csv.need("verdict");
  Sightings out;
  const int64_t begin_ns = csv.rows() > 0 ? csv.integer(0, t) : 0;
  for (size_t row = 0; row < csv.rows();) {
    // The rows of one sighting follow each other, each of another kind.
    const size_t first = row;
    std::vector<Seen::Row> rows;
    double range_m = NAN;
    const auto continues = [&] {
      if (row == first) return true;
      if (row == csv.rows() || csv.text(row, id) != csv.text(first, id) || csv.text(row, t) != csv.text(first, t) ||
          csv.text(row, source) != csv.text(first, source) || csv.text(row, verdict) != csv.text(first, verdict))
        return false;
      return std::none_of(rows.begin(), rows.end(), [&](const Seen::Row &r) { return r.kind == csv.text(row, kind); });
    };
    for (; continues(); ++row) {
      const std::string what(csv.text(row, kind));
      const double is = csv.number(row, observed), should = csv.number(row, expected);
      const bool angle = what == "bearing" || what == "heading";
      rows.push_back({what, angle ? turn(is - should) : is - should, csv.number(row, variance)});
      if (what == "range") range_m = should;
    }
    const std::string_view said = csv.text(first, verdict);
    const bool fused = said == "fused", refused = said == "gate", twice = said == "no_association";
    if (csv.text(first, id).empty() || !(fused || refused || twice)) continue;
    const double t_s = static_cast<double>(csv.integer(first, t) - begin_ns) * 1e-9;
    out[csv.integer(first, id)].push_back({fused     ? Seen::kFused
                                           : refused ? Seen::kRefused
                                                     : Seen::kTwice,
                                           t_s, rows, off_m(rows, range_m)});
  }
  return out;
}

std::vector<ResidualFigures> figures_of(const std::vector<Seen> &seen) {
  std::vector<ResidualFigures> out;
  std::map<std::string, std::vector<double>> residuals, scaled;
  for (const Seen &one : seen) {
    if (one.verdict != Seen::kFused) continue;
    for (const Seen::Row &row : one.rows) {
      if (!(row.variance > 0)) continue;  // the sighting by which it joined
      residuals[row.kind].push_back(row.residual);
      scaled[row.kind].push_back(row.residual / std::sqrt(row.variance));
    }
  }
  for (const auto &[kind, values] : residuals) out.push_back({kind, mean(values), rms(values), rms(scaled[kind])});
  return out;
}

// A run of sightings that were refused one after the other.
struct Streak {
  size_t begin, end;
};

std::vector<Streak> streaks_of(const std::vector<Seen> &seen) {
  std::vector<Streak> out;
  for (size_t i = 0; i < seen.size();) {
    if (seen[i].verdict != Seen::kRefused) {
      ++i;
      continue;
    }
    const size_t begin = i;
    while (i < seen.size() && seen[i].verdict == Seen::kRefused) ++i;
    if (i - begin >= kStreak) out.push_back({begin, i});
  }
  return out;
}

size_t fused_between(const std::vector<Seen> &seen, size_t begin, size_t end) {
  return static_cast<size_t>(std::count_if(seen.begin() + static_cast<std::ptrdiff_t>(begin),
                                           seen.begin() + static_cast<std::ptrdiff_t>(end),
                                           [](const Seen &s) { return s.verdict == Seen::kFused; }));
}

std::string how_far(const std::vector<Seen> &seen, const Streak &streak) {
  std::vector<double> off;
  for (size_t i = streak.begin; i < streak.end; ++i)
    if (std::isfinite(seen[i].off_m)) off.push_back(seen[i].off_m);
  return off.empty() ? "far" : text("about %.2f m", percentile(off, 50));
}

void judge(const std::vector<Seen> &seen, LandmarkSurvey *out) {
  auto &say = out->findings;
  const std::vector<Streak> streaks = streaks_of(seen);
  size_t in_streaks = 0, returns = 0;
  for (size_t i = 0; i < streaks.size(); ++i) {
    in_streaks += streaks[i].end - streaks[i].begin;
    if (i > 0 && fused_between(seen, streaks[i - 1].end, streaks[i].begin) >= kSettled) returns++;
  }
  if (out->twice > 0 && out->fused > 0)
    say.push_back(
        text("%zu sightings while the same identity was elsewhere: two markers, or a mirror shows one", out->twice));
  else if (out->twice > 0)
    say.emplace_back("found no room on the map: raise landmarks.capacity");
  if (returns > 0) {
    say.push_back(text("was %s off and back again, %zu times: two of one identity, or one that is carried about",
                       how_far(seen, streaks.front()).c_str(), returns + 1));
  } else if (!streaks.empty() && streaks.front().begin == 0) {
    say.push_back(text("is %s off where the map has it", how_far(seen, streaks.front()).c_str()));
  } else if (!streaks.empty()) {
    const size_t begin = streaks.front().begin;
    say.push_back(text("moved %s between %.1f s and %.1f s", how_far(seen, streaks.front()).c_str(),
                       seen[begin - 1].t_s, seen[begin].t_s));
  }
  const size_t alone = out->refused - in_streaks, all = out->fused + out->refused;
  if (alone >= kFew && static_cast<double>(alone) > kOftenRefused * static_cast<double>(all))
    say.push_back(
        text("%zu of %zu sightings refused one by one: its code is misread, or others are read as it", alone, all));
  if (!out->on_map && all <= kFew) say.push_back(text("seen %zu times only: a misread code", all));
  for (const ResidualFigures &r : out->residuals)
    if (r.in_sigmas > kFitsBadly && out->fused > kStreak)
      say.push_back(text("%s fits worse than it should: %.1f sigma", r.kind.c_str(), r.in_sigmas));
}

std::vector<std::string> cameras_of(const nlohmann::json &health) {
  std::vector<std::string> out;
  if (!health.is_object() || !health.contains("calibration")) return out;
  std::map<std::string, std::string> lines;
  for (const auto &[name, value] : health["calibration"].items()) {
    const size_t dot = name.find('.');
    const std::string whose = name.substr(0, dot), what = dot == std::string::npos ? "" : name.substr(dot + 1);
    std::string said;
    if (what == "range_scale")
      said = text("scale %.4f +- %.4f", value.at("value").get<double>(), value.at("sigma").get<double>());
    if (what == "bloom_px" || what == "edge_shift_px") said = text("bloom %.3f px", value.at("value").get<double>());
    if (said.empty()) continue;
    std::string &line = lines[whose];
    line += (line.empty() ? "" : ", ") + said;
  }
  for (const auto &[whose, line] : lines) out.push_back(whose + ": " + line);
  return out;
}

}  // namespace

size_t Survey::findings() const {
  size_t count = 0;
  for (const LandmarkSurvey &l : landmarks) count += l.findings.size();
  return count;
}

Survey survey_run(const std::filesystem::path &run) {
  const Sightings sightings = load_sightings_of(run / "innovations.csv");
  std::map<int64_t, LandmarkSurvey> landmarks;
  for (const Landmark &l : load_landmarks(run / "map-estimate.csv")) {
    LandmarkSurvey &out = landmarks[l.id];
    const Eigen::Matrix2d &c = l.covariance_xy;
    out.on_map = true;
    out.x_m = l.p_m.x(), out.y_m = l.p_m.y();
    out.sigma_m = std::sqrt(0.5 * (c(0, 0) + c(1, 1)) + std::hypot(0.5 * (c(0, 0) - c(1, 1)), c(0, 1)));
  }
  for (const auto &[id, seen] : sightings) {
    LandmarkSurvey &out = landmarks[id];
    out.first_s = seen.front().t_s, out.last_s = seen.back().t_s;
    for (const Seen &one : seen)
      ++(one.verdict == Seen::kFused ? out.fused : one.verdict == Seen::kRefused ? out.refused : out.twice);
    out.residuals = figures_of(seen);
    judge(seen, &out);
  }
  Survey out;
  for (auto &[id, landmark] : landmarks) {
    landmark.id = id;
    if (sightings.find(id) == sightings.end()) landmark.findings.emplace_back("was never seen");
    out.landmarks.push_back(landmark);
  }
  out.cameras = cameras_of(load_json(run / "health.json"));
  return out;
}

std::string survey_table(const Survey &survey) {
  std::string out = "     id        x m        y m  sigma m   fused refused  residuals: mean, rms (in sigmas)\n";
  for (const LandmarkSurvey &l : survey.landmarks) {
    out += l.on_map ? text("%7lld %10.3f %10.3f %8.4f", static_cast<long long>(l.id), l.x_m, l.y_m, l.sigma_m)
                    : text("%7lld %10s %10s %8s", static_cast<long long>(l.id), "-", "-", "-");
    out += text(" %7zu %7zu ", l.fused, l.refused + l.twice);
    for (const ResidualFigures &r : l.residuals)
      out += text(" %s %+.4f %.4f (%.1f)", r.kind.c_str(), r.mean, r.rms, r.in_sigmas);
    out += "\n";
  }
  for (const std::string &camera : survey.cameras) out += camera + "\n";
  for (const LandmarkSurvey &l : survey.landmarks)
    for (const std::string &finding : l.findings)
      out += text("landmark %lld ", static_cast<long long>(l.id)) + finding + "\n";
  return out + (survey.findings() == 0 ? "good\n" : "");
}

nlohmann::ordered_json survey_json(const Survey &survey) {
  nlohmann::ordered_json out;
  out["landmarks"] = nlohmann::ordered_json::array();
  for (const LandmarkSurvey &l : survey.landmarks) {
    nlohmann::ordered_json one = {{"id", l.id}, {"on_map", l.on_map}};
    if (l.on_map) one["x_m"] = l.x_m, one["y_m"] = l.y_m, one["sigma_m"] = l.sigma_m;
    one["fused"] = l.fused, one["refused"] = l.refused, one["twice"] = l.twice;
    one["first_s"] = l.first_s, one["last_s"] = l.last_s;
    for (const ResidualFigures &r : l.residuals)
      one["residuals"][r.kind] = {{"mean", r.mean}, {"rms", r.rms}, {"in_sigmas", r.in_sigmas}};
    one["findings"] = l.findings;
    out["landmarks"].push_back(one);
  }
  out["cameras"] = survey.cameras;
  return out;
}

}  // namespace wm::tools
