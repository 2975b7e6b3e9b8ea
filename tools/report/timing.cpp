// SPDX-License-Identifier: Apache-2.0
// How long the work took.
#include <algorithm>
#include <cmath>

#include "common/statistics.h"
#include "report/axes.h"
#include "report/page.h"
#include "report/report_json.h"
#include "report/words.h"

namespace wm::tools {
namespace {

using Json = nlohmann::json;

double value_of(const Json &stage, const char *key) {
  return stage.contains(key) && stage[key].is_number() ? stage[key].get<double>() : kNan;
}

// The stages: objects with percentiles, at the top or under "stages".
std::vector<std::pair<std::string, Json>> stages_of(const Json &timing) {
  std::vector<std::pair<std::string, Json>> out;
  const Json &within = timing.contains("stages") && timing["stages"].is_object() ? timing["stages"] : timing;
  for (const auto &[name, stage] : within.items())
    if (stage.is_object() && std::isfinite(value_of(stage, "p50_us")) && !(value_of(stage, "count") == 0))
      out.emplace_back(name, stage);
  return out;
}

std::string microseconds(double us) {
  if (!std::isfinite(us)) return "–";
  if (us < 1) return fixed(us * 1e3, 0) + " ns";
  if (us < 1000) return fixed(us, us < 10 && us != 1 ? 1 : 0) + " µs";
  if (us < 1e6) return fixed(us / 1e3, us < 1e4 && us != 1e3 ? 1 : 0) + " ms";
  return fixed(us / 1e6, us == 1e6 ? 0 : 1) + " s";
}

// What a stage does.
std::string stage_words(const std::string &name) {
  if (name == "arrive") return "arrive: a datum is put in its order";
  if (name == "predict") return "predict: the pose is moved on by the motion";
  if (name == "correct") return "correct: an observation is used";
  if (name == "publish") return "publish: a pose is carried on to now and sent";
  return plain(name);
}

// Lowest and highest duration over all stages, on whole decades.
Range decades(const std::vector<std::pair<std::string, Json>> &stages) {
  double low = 1e9;
  double high = 1e-3;
  for (const auto &[name, stage] : stages) {
    for (const char *key : {"p50_us", "max_us"}) {
      const double v = value_of(stage, key);
      if (!(v > 0)) continue;
      low = std::min(low, v / 2);
      high = std::max(high, v);
    }
  }
  return {std::pow(10, std::floor(std::log10(low))), std::pow(10, std::ceil(std::log10(high * 1.01)))};
}

// [[upper_us, count], ...] as bars over the logarithm of the duration.
bool draw_bins(const Json &stage, Panel *box) {
  if (!stage.contains("histogram") || !stage["histogram"].is_array()) return false;
  std::vector<std::pair<double, double>> bins;
  double most = 0;
  for (const Json &bin : stage["histogram"]) {
    if (!bin.is_array() || bin.size() != 2 || !bin[0].is_number() || !bin[1].is_number() || !(bin[0].get<double>() > 0))
      return false;
    bins.emplace_back(bin[0].get<double>(), bin[1].get<double>());
    most = std::max(most, bins.back().second);
  }
  if (most == 0) return false;
  // Heights by the logarithm of the count: one in a million is what one looks for here.
  for (const auto &[upper, count] : bins) {
    if (!(count > 0)) continue;
    const double right = std::log10(upper);
    box->box(right - std::log10(2) / 16, right, 0, 0.08 + 0.84 * std::log1p(count) / std::log1p(most), "bar");
  }
  return true;
}

// From the percentiles alone: half of the cases, nine of ten, 99 of 100, all but one of a thousand, and the slowest.
void draw_percentiles(const Json &stage, double low, Panel *box) {
  const double p[] = {low, value_of(stage, "p50_us"), value_of(stage, "p90_us"), value_of(stage, "p99_us"),
                      value_of(stage, "p999_us")};
  const char *css[] = {"span1", "span1", "span2", "span3"};
  for (int k = 1; k < 4; ++k)
    if (p[k] > 0 && p[k + 1] > p[k]) box->box(std::log10(p[k]), std::log10(p[k + 1]), 0.2, 0.8, css[k]);
}

}  // namespace

std::string timing_section(const ReportData &data) {
  if (!data.json->timing.is_object()) return "";
  const auto stages = stages_of(data.json->timing);
  const Range range = stages.empty() ? Range{1, 10} : decades(stages);
  std::vector<std::pair<double, std::string>> ticks;
  for (double tick = range.low; tick <= range.high * 1.001; tick *= 10)
    ticks.emplace_back(std::log10(tick), microseconds(tick));
  std::string body;
  bool bins = false;
  for (size_t k = 0; k < stages.size(); ++k) {
    const auto &[name, stage] = stages[k];
    Panel box({std::log10(range.low), std::log10(range.high)}, {0, 1});
    if (draw_bins(stage, &box))
      bins = true;
    else
      draw_percentiles(stage, range.low, &box);
    for (const char *key : {"p50_us", "p99_us", "max_us"})
      if (const double v = value_of(stage, key); v > 0) box.box(std::log10(v), std::log10(v), 0, 1, "hair");
    const std::string figures = "half within " + microseconds(value_of(stage, "p50_us")) + " · 99 % within " +
                                microseconds(value_of(stage, "p99_us")) + " · slowest " +
                                microseconds(value_of(stage, "max_us")) + " · " +
                                count_text(static_cast<int64_t>(value_of(stage, "count"))) + " times";
    body += box.html({.title = "<span>" + escape(stage_words(name)) + "</span><small>" + figures + "</small>",
                      .describes = figures,
                      .x_time = false,
                      .x_text = k + 1 == stages.size(),
                      .height_px = bins ? 62 : 30,
                      .x_ticks = ticks,
                      .y_ticks = {{0, ""}}});
  }
  if (!body.empty())
    body =
        "<figure>" + body +
        legend(
            {bins ? std::pair<std::string,
                              std::string>{"<i class=\"key\" style=\"background:var(--blue);opacity:.45\"></i>",
                                           "how many took so long (height: logarithm of the count)"}
                  : std::pair<std::string, std::string>{"<i class=\"key\" style=\"background:var(--blue)\"></i>",
                                                        "from half of the cases to 90, to 99, to 99.9 of 100 (paler)"},
             {"<path stroke=\"var(--orange)\" stroke-width=\"2\" d=\"M14-8V8\"/>", "median, 99 of 100, slowest"}}) +
        "</figure>";
  std::string rows;
  const auto row = [&](const char *key, const char *words) {
    if (const double v = value_of(data.json->timing, key); std::isfinite(v))
      rows += "<tr><td>" + std::string(words) + "</td>" + (v > 0 ? "<td class=\"some\">" : "<td>") +
              count_text(static_cast<int64_t>(v)) + "</td></tr>";
  };
  row("allocations_after_start", "memory allocations on the estimator’s thread after the start");
  row("page_faults_after_start", "page faults on the estimator’s thread after the start");
  if (const double total = value_of(data.json->timing, "deadlines_total"); total > 0) {
    const double missed = value_of(data.json->timing, "deadlines_missed");
    rows += "<tr><td>deadlines missed</td>" + std::string(missed > 0 ? "<td class=\"some\">" : "<td>") +
            count_text(static_cast<int64_t>(missed)) + " of " + count_text(static_cast<int64_t>(total)) + "</td></tr>";
  }
  if (!rows.empty()) body += "<table>" + rows + "</table>";
  return section("Time",
                 "Each row is a stage of the work, from fast on the left to slow on the right, on a logarithmic scale. "
                 "What matters in a robot is not the mean but the slowest case: the last orange line.",
                 body);
}

}  // namespace wm::tools
