// SPDX-License-Identifier: Apache-2.0
// Whether the errors have the size of the stated covariance: NEES over time.
#include <algorithm>
#include <cmath>

#include "common/statistics.h"
#include "report/axes.h"
#include "report/page.h"
#include "report/report_json.h"
#include "report/words.h"

namespace wm::tools {
namespace {

constexpr int kWindows = 40;

}  // namespace

std::string consistency_section(const ReportData &data) {
  if (!data.truth || !data.trajectory.has_covariance) return "";
  std::vector<double> t;
  std::vector<double> nees;
  for (const Sample &sample : data.truth->samples) {
    if (!std::isfinite(sample.nees)) continue;
    t.push_back(data.seconds(sample.truth.t_ns));
    nees.push_back(sample.nees);
  }
  if (nees.empty()) return "";
  const int dof = data.truth->nees_dof;
  const double bound = chi2_quantile(0.95, dof);

  std::vector<double> edges;
  for (int k = 0; k <= kWindows; ++k) edges.push_back(data.end_s() * k / kWindows);
  std::vector<double> sum(kWindows, 0);
  std::vector<double> count(kWindows, 0);
  for (size_t i = 0; i < t.size(); ++i) {
    const auto k = static_cast<size_t>(std::clamp(static_cast<int>(t[i] / data.end_s() * kWindows), 0, kWindows - 1));
    sum[k] += nees[i];
    ++count[k];
  }
  for (size_t k = 0; k < kWindows; ++k) sum[k] = count[k] > 0 ? sum[k] / count[k] : kNan;

  const double high = std::max(4 * bound, 1.3 * max_abs(nees));
  const double low = 0.02 * dof;
  for (double &value : nees) value = std::max(value, low);
  Panel box({0, data.end_s()}, {low, high}, Panel::Scale::kLog);
  box.line(t, nees, "ranges", 1.0);
  box.level(bound, "bound", "95 % bound " + fixed(bound, 1));
  box.level(dof, "zero", "ideal mean " + std::to_string(dof), true);
  box.steps(edges, sum, "mean");
  std::vector<std::pair<double, std::string>> ticks;
  for (double tick = std::pow(10, std::ceil(std::log10(low))); tick <= high; tick *= 10)
    ticks.emplace_back(tick, tick < 1 ? fixed(tick, 1) : fixed(tick, 0));
  const double inside =
      data.json->figures["nees_inside_95"].is_number() ? data.json->figures["nees_inside_95"].get<double>() : kNan;
  const std::string figures =
      "inside of the bound " + percent_text(inside) + " of the time (95 % is ideal) · mean " +
      fixed(data.json->figures["nees_mean"].is_number() ? data.json->figures["nees_mean"].get<double>() : kNan, 2);
  return section(
      "Consistency (NEES)",
      "NEES compares each error with the uncertainty that was stated for it, all of x, y and heading at once: " +
          std::to_string(dof) +
          " is as expected, more is surer than right, less is more careful than needed. It should lie below the dashed "
          "line 95 % of the time. The scale is logarithmic.",
      "<figure>" +
          box.html({.title = "<span>NEES</span><small>" + figures + "</small>",
                    .describes = "NEES over time: " + figures,
                    .height_px = 190,
                    .y_ticks = ticks}) +
          legend({{"<path class=\"estimate\" style=\"stroke-width:1.2;opacity:.75\" d=\"M0 0H28\"/>", "each stamp"},
                  {"<path fill=\"none\" stroke=\"var(--ink)\" stroke-width=\"1.6\" d=\"M0 0H28\"/>",
                   "mean of a fortieth of the drive"}}) +
          "</figure>");
}

}  // namespace wm::tools
