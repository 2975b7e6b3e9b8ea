// SPDX-License-Identifier: Apache-2.0
#include "eval/lines.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

#include "common/csv.h"
#include "common/failure.h"
#include "common/statistics.h"

namespace wm::tools {
namespace {

double turned(double a, double b) { return std::remainder(a - b, 2 * M_PI); }

struct LineCounts {
  int64_t labelled = 0, contrast = 0, found = 0, seen = 0, right = 0;
  std::vector<double> off_deg, normalised;
  std::set<int32_t> tracks;
};

// By how much most sightings are turned against the labels: a mounting's error is not the detector's, and must not make
// its lines others'. The fullest place of a histogram over all pairs.
double common_turn(const std::vector<LinePicture> &pictures) {
  constexpr double kMost = 2 * M_PI / 180, kBin = 0.02 * M_PI / 180;
  constexpr int kHalf = 100, kBlur = 8;
  std::vector<double> bins(2 * kHalf + 1), offs;
  const auto each = [&](auto take) {
    for (const LinePicture &picture : pictures)
      for (const LineSighting &s : picture.seen)
        for (const LabelledLine &label : picture.labels)
          if (const double off = turned(s.azimuth_rad, label.azimuth_rad); std::fabs(off) < kMost) take(off);
  };
  each([&](double off) { bins[static_cast<size_t>(std::lround(off / kBin)) + kHalf]++; });
  double most = 0;
  int at = 0;
  for (int b = -kHalf + kBlur; b <= kHalf - kBlur; b++) {
    double sum = 0;
    for (int k = -kBlur; k <= kBlur; k++) sum += bins.at(static_cast<size_t>(b + k) + kHalf);
    if (sum > most) {
      most = sum;
      at = b;
    }
  }
  each([&](double off) {
    if (std::fabs(off - at * kBin) < kBlur * kBin) offs.push_back(off);
  });
  return offs.empty() ? 0 : percentile(offs, 50);
}

void judge(const LinePicture &picture, double turn, double within_rad, LineCounts *n) {
  for (const LabelledLine &label : picture.labels) {
    n->labelled++;
    n->contrast += label.contrast;
    n->found += label.contrast && std::any_of(picture.seen.begin(), picture.seen.end(), [&](const LineSighting &s) {
                  return std::fabs(turned(s.azimuth_rad - turn, label.azimuth_rad)) <= within_rad;
                });
  }
  for (const LineSighting &s : picture.seen) {
    double off = 10;
    for (const LabelledLine &label : picture.labels)
      if (const double here = turned(s.azimuth_rad - turn, label.azimuth_rad); std::fabs(here) < std::fabs(off))
        off = here;
    n->seen++;
    n->tracks.insert(s.track);
    if (std::fabs(off) > within_rad) continue;
    n->right++;
    n->off_deg.push_back((off + turn) * 180 / M_PI);
    if (s.sigma_rad > 0) n->normalised.push_back(off / s.sigma_rad);
  }
}

nlohmann::ordered_json share_of(int64_t part, int64_t whole) {
  if (whole == 0) return nullptr;
  return static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

Figures line_figures(const std::vector<LinePicture> &pictures, double within_rad) {
  LineCounts n;
  const double turn = common_turn(pictures);
  for (const LinePicture &picture : pictures) judge(picture, turn, within_rad, &n);
  Figures f;
  f["within_deg"] = within_rad * 180 / M_PI;
  f["pictures"] = pictures.size();
  f["labelled"] = n.labelled;
  f["with_contrast"] = n.contrast;
  f["found"] = n.found;
  f["recall"] = share_of(n.found, n.contrast);
  f["seen"] = n.seen;
  f["right"] = n.right;
  f["false"] = n.seen - n.right;
  f["false_per_right"] = share_of(n.seen - n.right, n.right);
  f["tracks"] = n.tracks.size();
  for (const char *key :
       {"common_turn_deg", "azimuth_rms_deg", "azimuth_mean_deg", "azimuth_p95_deg", "normalised_rms"})
    f[key] = nullptr;
  if (n.off_deg.empty()) return f;
  double sum = 0;
  std::vector<double> sizes;
  for (const double off : n.off_deg) {
    sum += off;
    sizes.push_back(std::fabs(off));
  }
  f["common_turn_deg"] = turn * 180 / M_PI;
  f["azimuth_rms_deg"] = rms(n.off_deg);
  f["azimuth_mean_deg"] = sum / static_cast<double>(n.off_deg.size());
  f["azimuth_p95_deg"] = percentile(sizes, 95);
  if (!n.normalised.empty()) f["normalised_rms"] = rms(n.normalised);
  return f;
}

std::string line_table(const Figures &f, const std::string &title) {
  const auto number = [&](const char *key, const char *format) {
    char text[32];
    if (!f[key].is_number()) return std::string("-");
    std::snprintf(text, sizeof text, format, f[key].get<double>());
    return std::string(text);
  };
  const auto count = [&](const char *key) { return std::to_string(f[key].get<int64_t>()); };
  return title + ": upright lines in " + count("pictures") + " labelled pictures\n\n  found     " + count("found") +
         " of " + count("with_contrast") + " with contrast (of " + count("labelled") + " labelled): recall " +
         number("recall", "%.3f") + "\n  seen      " + count("seen") + " by " + count("tracks") +
         " tracks: " + count("right") + " right, " + count("false") + " false, " + number("false_per_right", "%.3f") +
         " false for each right one\n  azimuth   RMS " + number("azimuth_rms_deg", "%.4f") + ", mean " +
         number("azimuth_mean_deg", "%.4f") + ", 95 % below " + number("azimuth_p95_deg", "%.4f") +
         " degrees\n            all are turned by " + number("common_turn_deg", "%.3f") +
         "; beyond that, against their own sigma " + number("normalised_rms", "%.2f") + "\n";
}

std::map<int64_t, std::vector<LabelledLine>> load_line_labels(const std::filesystem::path &file) {
  const Csv csv = Csv::load(file);
  const size_t frame = csv.need("frame"), id = csv.need("id"), azimuth = csv.need("azimuth_rad");
  std::map<int64_t, std::vector<LabelledLine>> out;
  for (size_t row = 0; row < csv.rows(); row++) {
    const double at = csv.number(row, azimuth);
    if (!std::isfinite(at)) throw Failure(csv.where(row, azimuth) + ": a number is needed");
    out[csv.integer(row, frame)].push_back({csv.integer(row, id), at, true});
  }
  return out;
}

}  // namespace wm::tools
