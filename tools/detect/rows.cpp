// SPDX-License-Identifier: Apache-2.0
#include "detect/rows.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/failure.h"

namespace wm::tools {
namespace {

constexpr int kPixelDigits = 3, kMetreDigits = 6, kAngleDigits = 7;

std::string head_of(uint32_t kinds) {
  if (kinds & WM_EVENT_BIT(WM_EVENT_POINTS)) return "frame,polyline,u_px,v_px";
  const std::string first = "frame,picture,t_ns,id,";
  if (kinds & WM_EVENT_BIT(WM_EVENT_MARKER))
    return first + "x_m,y_m,z_m,yaw_rad,yaw_sigma_rad,along_sigma_m,poses,u_px,v_px";
  if (kinds & WM_EVENT_BIT(WM_EVENT_STEREO)) return first + "ul_px,vl_px,ur_px,vr_px";
  return first + "bearing_rad,bearing_sigma_rad,elevation_rad,elevation_sigma_rad,range_m,range_sigma_m,u_px,v_px";
}

}  // namespace

DetectionRows::DetectionRows(const std::filesystem::path &file, uint32_t kinds)
    : file_(file), csv_(file, std::ios::binary), has_points_((kinds & WM_EVENT_BIT(WM_EVENT_POINTS)) != 0) {
  const std::string head = head_of(kinds);
  columns_ = static_cast<size_t>(std::count(head.begin(), head.end(), ',')) + 1;
  csv_ << head << '\n' << std::fixed;
  csv_.precision(kPixelDigits);
  if (!csv_) throw Failure(file.string() + ": can't be written; does its folder exist, and may you write there?");
}

void DetectionRows::begin(const wm_frame &frame, const std::string &picture) {
  csv_ << frame.number << ',' << picture << ',' << frame.t_ns;
}

void DetectionRows::number(double value, int digits) {
  csv_ << ',';
  if (!std::isfinite(value)) return;
  csv_.precision(digits);
  csv_ << value;
}

void DetectionRows::end() { csv_ << '\n'; }

void DetectionRows::add_points(const wm_frame &frame, const std::vector<wm_event> &events, const Sketch &sketch) {
  size_t line = 0;
  for (const wm_event &event : events) {
    if (event.kind != WM_EVENT_POINTS) continue;
    for (const auto &points : sketch.polylines(event)) {
      for (const pixel &p : points) csv_ << frame.number << ',' << line << ',' << p.u << ',' << p.v << '\n';
      line++;
    }
  }
  if (line == 0) csv_ << frame.number << ",,,\n";
}

void DetectionRows::add(const wm_frame &frame, const std::string &picture, const std::vector<wm_event> &events,
                        const Sketch &sketch) {
  if (has_points_) return add_points(frame, events, sketch);
  for (const wm_event &event : events) {
    begin(frame, picture);
    if (event.kind == WM_EVENT_STEREO) {
      const wm_stereo &s = event.as.stereo;
      csv_ << ',' << s.id;
      for (const double px : {s.left_px[0], s.left_px[1], s.right_px[0], s.right_px[1]}) number(px, kPixelDigits);
      end();
      continue;
    }
    if (event.kind == WM_EVENT_MARKER) {
      const wm_marker &m = event.as.marker;
      csv_ << ',' << m.id;
      for (const double metres : m.p_m) number(metres, kMetreDigits);
      number(m.yaw_rad, kAngleDigits);
      number(m.yaw_sigma_rad, kAngleDigits);
      number(m.along_sigma_m, kMetreDigits);
      csv_ << ',' << m.poses;
    } else {
      const wm_sighting &s = event.as.sighting;
      csv_ << ',' << s.landmark_id;
      for (const double angle : {s.bearing_rad, s.bearing_sigma_rad, s.elevation_rad, s.elevation_sigma_rad})
        number(angle, kAngleDigits);
      number(s.range_m, kMetreDigits);
      number(s.range_sigma_m, kMetreDigits);
    }
    const auto at = sketch.pixel_of_event(event);
    number(at ? at->u : std::nan(""), kPixelDigits);
    number(at ? at->v : std::nan(""), kPixelDigits);
    end();
  }
  if (!events.empty()) return;
  begin(frame, picture);
  csv_ << std::string(columns_ - 3, ',');
  end();
}

void DetectionRows::finish() {
  if (!csv_.flush()) throw Failure(file_.string() + ": could not be written completely");
}

}  // namespace wm::tools
