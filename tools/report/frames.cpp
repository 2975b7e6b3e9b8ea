// SPDX-License-Identifier: Apache-2.0
#include "report/frames.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "common/cameras.h"
#include "images/jpeg.h"
#include "report/data.h"
#include "report/film.h"
#include "report/page.h"
#include "report/png.h"
#include "report/words.h"
#include "waymark/video.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth_px = 480, kQuality = 72;

using Opened = std::unique_ptr<wm_recording, decltype(&wm_recording_close)>;
using Video = std::unique_ptr<wm_video, decltype(&wm_video_close)>;

std::vector<uint8_t> grey_of(const wm_frame &frame) {
  std::vector<uint8_t> out;
  out.reserve(static_cast<size_t>(frame.width_px) * frame.height_px);
  for (uint32_t row = 0; row < frame.height_px; row++) {
    const uint8_t *begin = frame.grey + static_cast<size_t>(row) * frame.stride_bytes;
    out.insert(out.end(), begin, begin + frame.width_px);
  }
  return out;
}

// Null where it can't be opened.
Video open_video(const fs::path &recording, const wm_camera &camera, int32_t index, wm_error *err) {
  wm_video *made = nullptr;
  (void)wm_video_open(recording.c_str(), &camera, index, nullptr, nullptr, &made, err);
  return {made, wm_video_close};
}

// All pictures that a video has, none decoded. WM_OK or WM_IO.
wm_status read_film(wm_video *video, std::vector<Taken> *out, wm_error *err) {
  wm_frame frame{};
  wm_status status = WM_OK;
  while (status == WM_OK && (status = wm_video_peek(video, &frame, err)) == WM_OK) {
    out->push_back({frame.number, frame.t_ns});
    status = wm_video_skip(video, err);
  }
  return status == WM_END ? WM_OK : status;
}

ReportFrame frame_of(const wm_camera &camera, const wm_frame &frame) {
  const uint32_t times = std::max<uint32_t>(1, (frame.width_px + kWidth_px / 2) / kWidth_px);
  return {camera.name,
          frame.t_ns,
          static_cast<int>(frame.width_px),
          static_cast<int>(frame.height_px),
          small_jpeg(frame.grey, frame.stride_bytes, frame.width_px, frame.height_px, times),
          {},
          {},
          {},
          {},
          {},
          grey_of(frame),
          {}};
}

// `each` pictures spread over what the camera filmed of the drive. Why there is none; "" where there is one, or the
// notes say already when it filmed.
std::string frames_of(const fs::path &recording, const wm_camera &camera, int32_t index, size_t each, ReportData *data,
                      std::vector<ReportFrame> *out) {
  wm_error err{};
  Video video = open_video(recording, camera, index, &err);
  if (!video) return err.text;
  std::vector<Taken> film;
  if (read_film(video.get(), &film, &err) != WM_OK) return err.text;
  if (!film.empty()) {
    const std::string when = when_filmed(*data, camera.name, film);
    if (!when.empty()) data->film_notes.push_back(when);
    film = during(*data, film);
    if (film.empty()) return "";
    video = open_video(recording, camera, index, &err);  // from its beginning again
    if (!video) return err.text;
  }
  const size_t before = out->size();
  wm_frame frame{};
  for (const Taken &wanted : spread_over(film, each)) {
    while (wm_video_peek(video.get(), &frame, &err) == WM_OK && frame.number < wanted.number)
      if (wm_video_skip(video.get(), &err) != WM_OK) break;
    const wm_status status = wm_video_next(video.get(), &frame, &err);
    if (status == WM_IO && out->size() == before) return err.text;
    if (status != WM_OK) break;
    out->push_back(frame_of(camera, frame));
  }
  if (out->size() > before) return "";
  const char *problem = wm_video_counted(video.get())->first_problem;
  return *problem ? problem : "its video is empty";
}

std::string dots(const char *css, const std::vector<Eigen::Vector2d> &pixels) {
  std::string d;
  for (const Eigen::Vector2d &pixel : pixels) d += "M" + fixed(pixel.x(), 0) + " " + fixed(pixel.y(), 0) + "h0";
  return d.empty() ? d : std::string("<path class=\"") + css + "\" d=\"" + d + "\"/>";
}

std::string traces(const char *css, const std::vector<std::vector<Eigen::Vector2d>> &lines) {
  std::string d;
  for (const auto &line : lines)
    for (size_t i = 0; i < line.size(); i++)
      d += (i == 0 ? "M" : "L") + fixed(line[i].x(), 1) + " " + fixed(line[i].y(), 1);
  return d.empty() ? d : std::string("<path class=\"") + css + "\" d=\"" + d + "\"/>";
}

// A picture with what is drawn over it, in its own pixels, and a line below.
std::string figure(const std::string &label, const std::string &jpeg, int width, int height, const std::string &over,
                   const std::string &below) {
  const std::string w = std::to_string(width), h = std::to_string(height);
  return "<figure class=\"shot\"><svg viewBox=\"-0.5 -0.5 " + w + " " + h + "\" role=\"img\" aria-label=\"" +
         escape(label) + "\"><image x=\"-0.5\" y=\"-0.5\" width=\"" + w + "\" height=\"" + h +
         "\" preserveAspectRatio=\"none\" href=\"data:image/jpeg;base64," + base64(jpeg) + "\"/>" + over +
         "</svg><figcaption>" + below + "</figcaption></figure>";
}

// The same from above; nothing where there is no such view.
std::string drawn_from_above(const ReportFrame &frame) {
  const FloorView &view = frame.floor;
  if (view.jpeg.empty()) return "";
  return figure("The floor that camera " + frame.camera + " sees, from above", view.jpeg, view.width_px, view.height_px,
                traces("edge-line", view.lines_seen) + dots("edge-mapped", view.edges_mapped),
                "the same from above: ahead is up");
}

std::string drawn(const ReportData &data, const ReportFrame &frame) {
  const double unit = frame.width_px / 480.0;  // marks are as large whatever the picture's size
  std::string svg = dots("edge-seen", frame.edges_seen) + dots("edge-mapped", frame.edges_mapped) +
                    traces("line-seen", frame.lines_seen) + traces("line-mapped", frame.lines_mapped);
  for (const FrameMark &m : frame.marks) {
    const std::string at = fixed(m.u_px, 1) + "\" cy=\"" + fixed(m.v_px, 1);
    const char *name = m.kind == FrameMark::Kind::seen ? "hit" : m.kind == FrameMark::Kind::rejected ? "miss" : "hope";
    svg += std::string("<circle class=\"") + name + "\" cx=\"" + at + "\" r=\"" +
           fixed((m.kind == FrameMark::Kind::expected ? 8 : 3.2) * unit, 1) + "\"/>";
    if (!m.text.empty())
      svg += "<text x=\"" + fixed(m.u_px + 11 * unit, 1) + "\" y=\"" + fixed(m.v_px + 4 * unit, 1) + "\" font-size=\"" +
             fixed(12 * unit, 1) + "\">" + escape(m.text) + "</text>";
  }
  return figure("Picture of camera " + frame.camera, frame.jpeg, frame.width_px, frame.height_px, svg,
                escape(frame.camera) + ", " + fixed(data.seconds(frame.t_ns), 1) + " s");
}

}  // namespace

std::string small_jpeg(const uint8_t *grey, size_t stride, uint32_t width_px, uint32_t height_px, uint32_t times) {
  const uint32_t width = width_px / times, height = height_px / times;
  std::vector<uint8_t> small(static_cast<size_t>(width) * height);
  for (uint32_t y = 0; y < height; y++)
    for (uint32_t x = 0; x < width; x++) {
      uint32_t sum = 0;
      for (uint32_t j = 0; j < times; j++)
        for (uint32_t i = 0; i < times; i++) sum += grey[(y * times + j) * stride + x * times + i];
      small[static_cast<size_t>(y) * width + x] = static_cast<uint8_t>(sum / (times * times));
    }
  return grey_jpeg(small, static_cast<int>(width), static_cast<int>(height));
}

std::string grey_jpeg(const std::vector<uint8_t> &grey, int width, int height) {
  images::Jpeg jpeg;
  std::string error;
  if (!jpeg.compress({width, height, 1, grey}, kQuality, error)) return {};
  return {reinterpret_cast<const char *>(jpeg.data()), jpeg.size()};
}

std::vector<ReportFrame> load_frames(const fs::path &recording, ReportData *data, size_t each) {
  std::vector<ReportFrame> out;
  wm_recording *made = nullptr;
  wm_error err{};
  if (!fs::exists(recording / "video")) return out;
  if (wm_recording_open(recording.c_str(), nullptr, nullptr, nullptr, &made, &err) != WM_OK) {
    data->film_notes.push_back(std::string("No pictures: ") + err.text);
    return out;
  }
  const Opened opened(made, wm_recording_close);
  const wm_rig *rig = wm_site_rig(wm_recording_site(opened.get()));
  for (uint32_t i = 0; i < rig->camera_count; i++) {
    const wm_camera &camera = rig->cameras[i];
    if (!wm_video_there(recording.c_str(), camera.name)) continue;
    const std::string why = frames_of(recording, camera, static_cast<int32_t>(i), each, data, &out);
    if (!why.empty()) data->film_notes.push_back(std::string("No pictures of ") + camera.name + ": " + why);
  }
  std::stable_sort(out.begin(), out.end(), [](const ReportFrame &a, const ReportFrame &b) { return a.t_ns < b.t_ns; });
  return out;
}

void mark_sightings(const fs::path &recording, const ReportData &data, std::vector<ReportFrame> *frames) {
  if (frames->empty() || data.innovations.empty()) return;
  const std::vector<NamedCamera> cameras = load_cameras(recording / "calibration.yaml");
  for (ReportFrame &frame : *frames) {
    const auto camera =
        std::find_if(cameras.begin(), cameras.end(), [&](const NamedCamera &c) { return c.name == frame.camera; });
    const auto mounting = data.mountings.find(frame.camera);
    const auto pose = pose_at(data.trajectory.poses, frame.t_ns, kMaxGapNs);
    if (camera == cameras.end() || mounting == data.mountings.end() || !pose) continue;
    const auto mark = [&](FrameMark::Kind kind, const Eigen::Vector3d &base, const std::string &text) {
      images::Vec2 pixel;
      if (images::project(camera->camera, images::T_base_optical(camera->camera).inverse() * base, pixel) &&
          pixel.x() > 0 && pixel.y() > 0 && pixel.x() < frame.width_px && pixel.y() < frame.height_px)
        frame.marks.push_back({kind, pixel.x(), pixel.y(), text});
    };
    for (const Innovation &saw : data.innovations) {
      if (saw.t_ns != frame.t_ns || saw.sensor != frame.camera || saw.residual != "bearing") continue;
      const auto landmark = std::find_if(data.landmarks.begin(), data.landmarks.end(),
                                         [&](const Landmark &l) { return l.id == saw.landmark; });
      if (landmark == data.landmarks.end()) continue;
      const Eigen::Vector3d expected = pose->q.conjugate() * (landmark->p_m - pose->p_m);
      const Eigen::Vector3d from = mounting->second.q.conjugate() * (expected - mounting->second.p_m);
      const double level_m = from.head<2>().norm();
      mark(FrameMark::Kind::expected, expected, std::to_string(saw.landmark));
      mark(saw.fused() ? FrameMark::Kind::seen : FrameMark::Kind::rejected,
           mounting->second.q *
                   Eigen::Vector3d(level_m * std::cos(saw.observed), level_m * std::sin(saw.observed), from.z()) +
               mounting->second.p_m,
           "");
    }
  }
}

std::string frames_section(const ReportData &data) {
  if (data.frames.empty() && data.film_notes.empty()) return "";
  std::string body;
  for (const std::string &note : data.film_notes) body += "<p class=\"note\">" + escape(note) + "</p>";
  body += "<div class=\"shots\">";
  bool marks = false, edges = false, lines = false;
  for (const ReportFrame &frame : data.frames) {
    body += drawn(data, frame) + drawn_from_above(frame);
    marks = marks || !frame.marks.empty();
    edges = edges || !frame.edges_seen.empty();
    lines = lines || !frame.lines_seen.empty();
  }
  body += "</div>";
  if (marks)
    body +=
        legend({{"<circle class=\"hope\" cx=\"14\" r=\"6\"/>", "where the robot expected a landmark, with its number"},
                {"<circle class=\"hit\" cx=\"14\" r=\"4\"/>", "the direction in which it was seen; used"},
                {"<circle class=\"miss\" cx=\"14\" r=\"4\"/>", "seen, and refused"}});
  if (edges)
    body +=
        legend({{"<path class=\"edge-seen\" d=\"M4 0h0M14 0h0M24 0h0\"/>",
                 "edges of the floor that were found in the picture"},
                {"<path class=\"edge-mapped\" d=\"M2 0h0M6 0h0M10 0h0M14 0h0M18 0h0M22 0h0M26 0h0\"/>",
                 "the map’s edges, projected from the estimated pose: they lie on the found ones where it was right"}});
  if (lines)
    body += legend({{"<path class=\"line-seen\" d=\"M2 0H26\"/>", "upright lines that were found and followed"},
                    {"<path class=\"line-mapped\" d=\"M2 0H26\"/>",
                     "lines of the finished map, projected from the estimated pose (walls hide some)"}});
  return section("Pictures", "Pictures of its cameras, spread over what each filmed of the drive.", body);
}

}  // namespace wm::tools
