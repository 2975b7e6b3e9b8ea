// SPDX-License-Identifier: Apache-2.0
#include "report/page.h"
#include "common/statistics.h"

#include <cmath>

#include <wm_version.h>
#include "report/picture.h"
#include "report/report_json.h"
#include "report/script.h"
#include "report/side_views.h"
#include "report/style.h"
#include "report/words.h"

namespace wm::tools {
namespace {

constexpr size_t kTrackPoints = 700;

// What the script needs to show, for a time under the finger, where the robot was: time, place in the picture, error,
// and the radius that the run said would hold it in 95 of 100 cases.
std::string track_json(const ReportData &data, const Picture &picture) {
  const auto &poses = data.trajectory.poses;
  std::string out;
  const size_t step = std::max<size_t>(1, poses.size() / kTrackPoints);
  for (size_t i = 0; i < poses.size(); i += step) {
    const Pose &pose = poses[i];
    double off_m = kNan;
    if (data.truth)
      if (const auto truth = pose_at(data.truth->truth, pose.t_ns, kMaxGapNs))
        off_m = (pose.p_m - truth->p_m).head<2>().norm();
    const Eigen::Vector2d at = (pose.p_m.head<2>() - picture.left_top_m) * picture.scale;
    const auto field = [](double v, int decimals) {
      return std::isfinite(v) ? fixed(v, decimals) : std::string("null");
    };
    out += std::string(out.empty() ? "" : ",") + "[" + fixed(data.seconds(pose.t_ns), 2) + "," + fixed(at.x(), 1) +
           "," + fixed(-at.y(), 1) + "," + field(off_m, 4) + "]";
  }
  return "[" + out + "]";
}

std::string figure_row(const std::string &key, const Figures &value) {
  std::string text = value.dump();
  if (value.is_null()) text = "–";
  if (value.is_number_float()) {
    text = fixed(value.get<double>(), 4);
  }
  return "<tr><td>" + escape(plain(key)) + "</td><td>" + escape(text) + "</td></tr>";
}

}  // namespace

std::string section(const std::string &title, const std::string &how_to_read, const std::string &body) {
  if (body.empty()) return "";
  return "<section><h2>" + title + "</h2><p class=\"how\">" + how_to_read + "</p>" + body + "</section>\n";
}

std::string legend(const std::vector<std::pair<std::string, std::string>> &marks_and_words) {
  std::string out = "<ul class=\"legend\">";
  for (const auto &[mark, words] : marks_and_words) {
    out += "<li>";
    if (mark.starts_with("<i"))
      out += mark;
    else
      out.append("<svg class=\"swatch\" viewBox=\"0 -8 28 16\" aria-hidden=\"true\">").append(mark).append("</svg>");
    out.append(words).append("</li>");
  }
  return out + "</ul>";
}

std::string map_section(const ReportData &data) {
  const Picture picture = draw_picture(data, false);
  std::vector<std::pair<std::string, std::string>> marks;
  if (data.truth) marks.emplace_back("<path class=\"truth\" d=\"M0 0H28\"/>", "truth");
  marks.emplace_back("<path class=\"estimate\" d=\"M0 0H28\"/>", "estimate");
  if (picture.ellipse_scale > 0)
    marks.emplace_back(
        "<ellipse class=\"ellipse\" cx=\"14\" rx=\"13\" ry=\"7\"/>",
        "its 95 % region" +
            (picture.ellipse_scale > 1 ? ", <b>&nbsp;drawn " + fixed(picture.ellipse_scale, 0) + " times larger</b>"
                                       : std::string()) +
            (picture.ellipses_left_out > 0 ? ", " + std::to_string(picture.ellipses_left_out) + " too large to draw"
                                           : std::string()));
  if (!data.landmarks.empty())
    marks.emplace_back("<path class=\"landmark\" d=\"M14-7l7 7l-7 7l-7-7Z\"/>", "landmark, with its number");
  if (!data.estimated_landmarks.empty())
    marks.emplace_back("<path class=\"guess\" d=\"M8 0h12m-6-6v12\"/>", "landmark of the robot's own map");
  if (data.edge_layer) marks.emplace_back("<path class=\"edges\" d=\"M0 0H28\"/>", "edges of the map");
  if (!data.cloud.empty())
    marks.emplace_back("<path class=\"cloud\" d=\"M4 0h0M14 0h0M24 0h0\"/>", "particles at some instants");
  if (picture.sight_lines) marks.emplace_back("<path class=\"sight\" d=\"M0 0H28\"/>", "sightings at some instants");
  if (!data.truth && !data.gnss.empty())
    marks.emplace_back("<path class=\"gnss\" d=\"M4 0h0M14 0h0M24 0h0\"/>", "GNSS positions");
  const std::string how = std::string("The drive from above, in metres. ") +
                          (data.truth ? "Where the thin line covers the broad one, the pose was right. " : "") +
                          "Arrows: start and end, with the heading. Point at a chart below to see the place here.";
  std::string notes;
  for (const std::string &note : data.notes) notes += "<p class=\"note\">" + escape(note) + "</p>";
  return section(
             "Path", how,
             "<figure>" + picture.svg + legend(marks) + "</figure>" + side_views(data, picture.ellipse_scale) + notes) +
         "<script>const track=" + track_json(data, picture) + "</script>\n";
}

std::string figures_section(const ReportData &data) {
  if (!data.json->figures.is_object()) return "";
  std::string rows;
  for (const auto &[key, value] : data.json->figures.items()) rows += figure_row(key, value);
  return "<details><summary>All figures, by their names in <code>waymark eval --json</code></summary><div "
         "class=\"wide\"><table>" +
         rows + "</table></div></details>\n";
}

std::string report_page(const ReportData &data) {
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
         "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><meta name=\"color-scheme\" "
         "content=\"light dark\">"
         "<title>" +
         escape(data.name) + " – Waymark</title><style>" + page_style() +
         "</style></head>\n<body data-from=\"0\" data-to=\"" + fixed(data.end_s(), 3) + "\"><main>\n" +
         headline_section(data) + findings_section(data) + map_section(data) + frames_section(data) +
         (data.truth ? error_section(data) : uncertainty_section(data)) + consistency_section(data) +
         state_section(data) + innovation_section(data) + looked_for_section(data) + source_section(data) +
         calibration_section(data) + timing_section(data) + figures_section(data) +
         "<footer>Made by <code>waymark report</code> " WM_VERSION
         ". Everything on this page comes from the run’s own files" +
         std::string(data.truth ? " and the recording’s truth, which the robot never saw" : "") +
         ".</footer>\n</main><div id=\"readout\" role=\"status\"></div><script>" + page_script() +
         "</script></body></html>\n";
}

}  // namespace wm::tools
