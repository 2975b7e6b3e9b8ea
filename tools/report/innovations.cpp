// SPDX-License-Identifier: Apache-2.0
// What each sensor said against what was expected of it.
#include <algorithm>
#include <cmath>

#include "common/statistics.h"
#include "report/axes.h"
#include "report/page.h"
#include "report/words.h"

namespace wm::tools {
namespace {

constexpr int kWindows = 40;
constexpr int kBars = 33;
constexpr double kBarsReach = 4;  // sigmas to each side
constexpr size_t kGroupsAtMost = 12;

struct Group {
  std::string name;
  std::string residual;
  std::vector<const Innovation *> all;
};

std::vector<Group> groups_of(const ReportData &data) {
  std::map<std::string, Group> by_name;
  for (const Innovation &innovation : data.innovations) {
    if (!std::isfinite(innovation.value()) || !(innovation.variance > 0)) continue;
    const std::string who = innovation.sensor.empty() || innovation.source.find(innovation.sensor) != std::string::npos
                                ? innovation.source
                                : innovation.source + " " + innovation.sensor;
    Group &group = by_name[who + "\n" + innovation.residual];
    group.name = plain(innovation.residual) + " of " + plain(who);
    group.residual = innovation.residual;
    group.all.push_back(&innovation);
  }
  std::vector<Group> out;
  for (auto &[key, group] : by_name) out.push_back(std::move(group));
  std::stable_sort(out.begin(), out.end(), [](const Group &a, const Group &b) { return a.all.size() > b.all.size(); });
  return out;
}

struct Unit {
  double per_si;
  const char *name;
};

Unit unit_of(const std::string &residual, double largest) {
  if (residual == "bearing" || residual == "elevation" || residual == "heading") return {180 / M_PI, "°"};
  if (residual == "pixel") return {1, "px"};
  if (residual == "standstill") return {1, ""};
  if (largest < 2) return {100, "cm"};
  return {1, "m"};
}

// Over time: the differences, those refused, and the band of three sigmas.
std::string differences(const ReportData &data, const Group &group) {
  std::vector<double> t;
  std::vector<double> bound;
  std::vector<double> fused_t;
  std::vector<double> fused;
  std::vector<double> refused_t;
  std::vector<double> refused;
  for (const Innovation *i : group.all) {
    const double seconds = data.seconds(i->t_ns);
    if (i->fused()) {
      t.push_back(seconds);
      bound.push_back(3 * std::sqrt(i->variance));
      fused_t.push_back(seconds);
      fused.push_back(i->value());
    } else {
      refused_t.push_back(seconds);
      refused.push_back(i->value());
    }
  }
  double high = 1.15 * std::max(max_abs(fused), bound.empty() ? kNan : percentile(bound, 97));
  if (fused.empty()) high = 1.15 * max_abs(refused);
  if (!(high > 0)) high = 1;
  const Unit unit = unit_of(group.residual, high);
  const auto scaled = [&unit, high](std::vector<double> v, bool clip) {
    for (double &value : v) value = (clip ? std::clamp(value, -0.97 * high, 0.97 * high) : value) * unit.per_si;
    return v;
  };
  const auto up = scaled(bound, false);
  auto low = up;
  for (double &value : low) value = -value;
  Panel box({0, data.end_s()}, {-high * unit.per_si, high * unit.per_si});
  box.band(t, low, up, "band", 5.0);
  box.level(0, "zero", "");
  box.dots(fused_t, scaled(fused, false), fused.size() > 2500 ? "ranges" : "points");
  box.dots(refused_t, scaled(refused, true), "refused");
  std::string figures = count_text(static_cast<int64_t>(fused.size())) + " used";
  if (!refused.empty()) figures += " · " + count_text(static_cast<int64_t>(refused.size())) + " refused";
  return box.html(
      {.title = "<span>Seen minus expected, " + std::string(unit.name) + "</span><small>" + figures + "</small>",
       .describes = group.name + ": " + figures,
       .x_text = false,
       .height_px = 130});
}

// In units of the stated sigma: should have the bell's shape.
std::string bell(const Group &group) {
  std::vector<double> counts(kBars, 0);
  double total = 0;
  for (const Innovation *i : group.all) {
    if (!i->fused()) continue;
    const double sigmas = i->value() / std::sqrt(i->variance);
    const int bar = static_cast<int>(std::floor((sigmas + kBarsReach) / (2 * kBarsReach) * kBars));
    if (bar >= 0 && bar < kBars) ++counts[static_cast<size_t>(bar)];
    ++total;
  }
  if (total == 0) return "";
  const double width = 2 * kBarsReach / kBars;
  const double highest = std::max(*std::max_element(counts.begin(), counts.end()) / total / width, 0.4);
  Panel box({-kBarsReach, kBarsReach}, {0, 1.1 * highest});
  for (int k = 0; k < kBars; ++k) {
    const double left = -kBarsReach + k * width;
    box.box(left, left + width, 0, counts[static_cast<size_t>(k)] / total / width, "bar");
  }
  std::vector<double> x;
  std::vector<double> y;
  for (int k = 0; k <= 96; ++k) {
    x.push_back(-kBarsReach + 2 * kBarsReach * k / 96);
    y.push_back(std::exp(-x.back() * x.back() / 2) / std::sqrt(2 * M_PI));
  }
  box.line(x, y, "curve", 1);
  return box.html({.title = "<span>in σ, against the bell</span>",
                   .describes = "Histogram of the differences in units of their stated standard deviation",
                   .x_time = false,
                   .height_px = 130,
                   .x_ticks = {{-3, "−3"}, {0, "0"}, {3, "3"}},
                   .y_ticks = {{0, ""}}});
}

// NIS averaged over parts of the drive, with the bounds that such an average has if the innovations are as stated.
std::string nis(const ReportData &data, const Group &group) {
  std::vector<double> edges;
  for (int k = 0; k <= kWindows; ++k) edges.push_back(data.end_s() * k / kWindows);
  std::vector<double> sum(kWindows, 0);
  std::vector<double> count(kWindows, 0);
  int dof = 1;
  for (const Innovation *i : group.all) {
    if (!i->fused() || !std::isfinite(i->nis)) continue;
    dof = std::max(1, i->gate_dof);
    const auto k = static_cast<size_t>(
        std::clamp(static_cast<int>(data.seconds(i->t_ns) / data.end_s() * kWindows), 0, kWindows - 1));
    sum[k] += i->nis / dof;
    ++count[k];
  }
  std::vector<double> mean_nis(kWindows, kNan);
  Panel box({0, data.end_s()}, {0.05, 20}, Panel::Scale::kLog);
  double most = 0;
  for (size_t k = 0; k < kWindows; ++k) {
    if (count[k] == 0) continue;
    most = std::max(most, count[k]);
    mean_nis[k] = std::clamp(sum[k] / count[k], 0.051, 19.5);
    const double n = count[k] * dof;
    box.box(edges[k], edges[k + 1], std::max(0.051, chi2_quantile(0.025, n) / n),
            std::min(19.5, chi2_quantile(0.975, n) / n), "band");
  }
  if (most == 0) return "";
  box.level(1, "zero", "");
  box.steps(edges, mean_nis, "value");
  return box.html({.title = "<span>NIS per degree of freedom, mean of a fortieth of the drive</span>",
                   .describes = "Normalised innovation squared over time",
                   .height_px = 96,
                   .y_ticks = {{0.1, "0.1"}, {1, "1"}, {10, "10"}}});
}

}  // namespace

std::string innovation_section(const ReportData &data) {
  const auto groups = groups_of(data);
  if (groups.empty()) return "";
  std::string body;
  for (size_t k = 0; k < std::min(groups.size(), kGroupsAtMost); ++k) {
    std::string name = groups[k].name;
    name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
    body += "<h3>" + escape(name) + "</h3><div class=\"pair\"><div>" + differences(data, groups[k]) +
            nis(data, groups[k]) + "</div><div>" + bell(groups[k]) + "</div></div>";
  }
  if (groups.size() > kGroupsAtMost)
    body += "<p class=\"note\">" + std::to_string(groups.size() - kGroupsAtMost) +
            " more kinds with fewer data are not drawn.</p>";
  return section(
      "Observations",
      "Each measurement is compared with its prediction from the estimated pose. The differences should scatter evenly "
      "about zero, within the band, in the shape of the bell; a constant offset means that something is mounted or "
      "timed otherwise than stated. NIS sums them up: about 1, within the shaded bounds, is right; above, the sensor "
      "is noisier than stated (or its errors are not independent), below, it is better.",
      "<figure>" + body +
          legend({{"<path stroke=\"var(--blue)\" stroke-width=\"1.5\" d=\"M6 4V-5M12 6V-3M18 3V-6M24 5V-4\"/>",
                   "used (many in one column: their range)"},
                  {"<path stroke=\"var(--orange)\" stroke-width=\"6\" stroke-linecap=\"round\" d=\"M14 0h0\"/>",
                   "refused (at the edge: farther out)"},
                  {"<path fill=\"var(--band)\" d=\"M0-7H28V7H0ZM0-7H28V7H0Z\"/>",
                   "±3 σ as expected; for NIS the bounds of a mean of so many"}}) +
          "</figure>");
}

}  // namespace wm::tools
