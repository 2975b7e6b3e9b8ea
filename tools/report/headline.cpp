// SPDX-License-Identifier: Apache-2.0
// What a person wants to know first, in words and a few figures.
#include <algorithm>
#include <cmath>

#include "common/statistics.h"
#include "report/page.h"
#include "report/report_json.h"
#include "report/words.h"
#include "waymark/pose.h"

namespace wm::tools {
namespace {

struct Tile {
  std::string value, words;
};

std::string tiles(const std::vector<Tile> &all) {
  std::string out = "<div class=\"tiles\">";
  for (const Tile &tile : all) out += "<div><b>" + tile.value + "</b><span>" + tile.words + "</span></div>";
  return out + "</div>\n";
}

double figure(const ReportData &data, const char *key) {
  return data.json->figures.contains(key) && data.json->figures[key].is_number() ? data.json->figures[key].get<double>()
                                                                                 : kNan;
}

std::string strong(const std::string &text) { return "<em>" + text + "</em>"; }

// Whether the stated uncertainty is consistent, by how often truth lay in the stated 95 % region.
std::string honesty(double inside, double nees_per_dof) {
  const std::string share = strong(percent_text(inside));
  if (!std::isfinite(inside)) return "";
  if (inside >= 0.97 && nees_per_dof < 0.4)
    return " The stated uncertainty is conservative: truth lay inside the 95&nbsp;% region " + share + " of the time.";
  if (inside >= 0.85)
    return " The stated uncertainty is consistent: truth lay inside the 95&nbsp;% region " + share + " of the time.";
  if (inside >= 0.6)
    return " The stated uncertainty is somewhat too small: truth lay inside the 95&nbsp;% region only " + share +
           " of the time.";
  return " The stated uncertainty is not to be relied on: truth lay inside the 95&nbsp;% region only " + share +
         " of the time.";
}

// Share of the time in this state.
double share_in(const ReportData &data, wm_state state) {
  const auto &poses = data.trajectory.poses;
  double spent_s = 0;
  for (size_t i = 1; i < poses.size(); ++i)
    if (poses[i - 1].state == state) spent_s += data.seconds(poses[i].t_ns) - data.seconds(poses[i - 1].t_ns);
  return spent_s / std::max(data.end_s(), 1e-9);
}

std::string losing(const ReportData &data) {
  if (data.trajectory.poses.front().state < 0) return "";  // a trajectory without states
  const double lost = share_in(data, WM_STATE_LOST), count = figure(data, "lost_count");
  if (!(lost > 0)) return count > 0 ? " It was LOST for a moment." : " It was never LOST.";
  return " It was LOST for " + strong(percent_text(lost)) + " of the time" +
         (count > 0 ? ", " + times_text(static_cast<int64_t>(count)) : "") + ".";
}

// Share of the updates that the gates refused, where it is more than the outliers of a good run.
std::string refusing(const ReportData &data) {
  constexpr double kUsual = 0.03;
  size_t updates = 0, refused = 0;
  for (const Innovation &innovation : data.innovations) {
    const bool is_refused = innovation.verdict == wm_verdict_name(WM_REJECTED_GATE) ||
                            innovation.verdict == wm_verdict_name(WM_REJECTED_SEARCHING);
    updates += innovation.fused() || is_refused;
    refused += is_refused;
  }
  const double share = updates > 0 ? static_cast<double>(refused) / static_cast<double>(updates) : 0;
  if (share < kUsual) return "";
  return " " + strong(percent_text(share)) + " of what it saw contradicted its pose and was refused.";
}

// How much of the time it went by its motion alone, where that is worth a word.
std::string blindness(const ReportData &data) {
  const double share = share_in(data, WM_STATE_DEAD_RECKONING);
  if (share < 0.05) return "";
  return " For " + strong(percent_text(share)) + " of the time it had no observation: dead reckoning.";
}

// Radius in metres of the stated 95 % region, its longer half axis.
std::vector<double> stated_radii(const Trajectory &trajectory) {
  std::vector<double> out;
  const double reach = std::sqrt(chi2_quantile(0.95, 2));
  for (const Pose &pose : trajectory.poses) {
    const double longer_m = ellipse_of(pose.covariance.topLeftCorner<2, 2>()).longer_m;
    if (std::isfinite(longer_m)) out.push_back(reach * longer_m);
  }
  return out;
}

std::string with_truth(const ReportData &data) {
  const double rmse = figure(data, "position_rmse_m");
  std::string text = "The robot drove " + strong(length_text(figure(data, "distance_m"))) + " in " +
                     strong(duration_text(figure(data, "duration_s"))) + ". Its pose was typically off by " +
                     strong(length_text(rmse)) + ", at worst by " + strong(length_text(figure(data, "position_max_m")));
  const std::string turn = data.trajectory.planar ? "heading" : "rotation";  // in space the whole of it
  const double turned = figure(data, (turn + "_rmse_deg").c_str());
  const std::string turn_words = data.trajectory.planar ? "heading" : "orientation";
  if (std::isfinite(turned)) text += ", and its " + turn_words + " was off by " + strong(angle_text(turned));
  text += "." + honesty(figure(data, "nees_inside_95"), figure(data, "nees_mean") / figure(data, "anees_dof")) +
          losing(data) + refusing(data);

  std::vector<Tile> all{{length_text(rmse), "position error, root mean square"},
                        {length_text(figure(data, "position_p95_m")), "95 of 100 moments are better than this"},
                        {length_text(figure(data, "position_end_m")),
                         "at the end: " + fixed(figure(data, "position_end_percent"), 2) + "&nbsp;% of the way"}};
  if (std::isfinite(turned))
    all.push_back({angle_text(turned), turn_words + " error, root mean square; at worst " +
                                           angle_text(figure(data, (turn + "_max_deg").c_str()))});
  if (std::isfinite(figure(data, "nees_inside_95")))
    all.push_back(
        {percent_text(figure(data, "nees_inside_95")), "of the time truth lay inside the stated 95&nbsp;% region"});
  if (figure(data, "coverage") < 0.995)
    all.push_back({percent_text(figure(data, "coverage")), "of truth’s stamps have a pose to compare with"});
  return "<p class=\"headline\">" + text + "</p>" + tiles(all);
}

std::string without_truth(const ReportData &data) {
  const double way = path_length(data.trajectory.poses, data.trajectory.planar);
  const auto radii = stated_radii(data.trajectory);
  const bool known = data.trajectory.has_covariance && !radii.empty();
  std::string text = "By its estimate the robot drove " + strong(length_text(way)) + " in " +
                     strong(duration_text(data.end_s())) + ".";
  if (known)
    text += " By its own covariance, the typical error of the position was " +
            strong(length_text(percentile(radii, 50))) + " and at worst to " + strong(length_text(max_abs(radii))) +
            ", with 95&nbsp;% confidence.";
  text += blindness(data) + losing(data) + refusing(data) + " There is no truth to compare it with.";
  std::vector<Tile> all{{length_text(way), "driven, by its estimate"},
                        {duration_text(data.end_s()), "from the first pose to the last"}};
  if (known) {
    all.push_back({length_text(percentile(radii, 50)), "radius of its 95&nbsp;% region, median"});
    all.push_back({length_text(radii.back()), "the same at the end"});
  }
  return "<p class=\"headline\">" + text + "</p>" + tiles(all);
}

}  // namespace

std::string headline_section(const ReportData &data) {
  std::string about = data.about.empty() ? "" : "<p class=\"note\">The recording: " + escape(data.about) + "</p>\n";
  return "<header><h1>" + escape(data.name) + "</h1>" + (data.truth ? with_truth(data) : without_truth(data)) + about +
         "</header>\n";
}

}  // namespace wm::tools
