// SPDX-License-Identifier: Apache-2.0
#include "eval/landmark_detector.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/cameras.h"
#include "common/csv.h"
#include "common/edge_points.h"
#include "common/event_log.h"
#include "common/failure.h"
#include "common/recording_folder.h"
#include "common/statistics.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kWithin_rad = 0.5 * M_PI / 180;
constexpr double kHidden_rad = 1.5 * M_PI / 180;  // the mounting's error is in it

struct Seen {
  int64_t id;
  double bearing_rad, sigma_rad;
  double elevation_rad, elevation_sigma_rad;  // NaN where not told
};

struct Label {
  int64_t id;
  double bearing_rad, elevation_rad, shorter_px;
};

struct Panel {
  Vector3d middle, right, up;  // half its width and height
};

struct Counts {
  int64_t pictures = 0, labelled = 0, large = 0, found = 0, found_large = 0, seen = 0, right = 0, wrong = 0, hidden = 0;
  std::vector<double> off_deg, normalised;
  std::vector<double> up_off_deg, up_normalised;  // the elevations'
};

// Whether recall is of landmarks of this panel's size.
bool is_wanted(const Panel &panel, const std::vector<double> &sizes_m) {
  const double width = 2 * panel.right.norm(), height = 2 * panel.up.norm();
  for (size_t i = 0; i + 1 < sizes_m.size(); i += 2)
    if (std::fabs(width - sizes_m[i]) < 0.05 * width && std::fabs(height - sizes_m[i + 1]) < 0.05 * height) return true;
  return sizes_m.empty();
}

double bearing_of(const Vector3d &optical) { return std::atan2(-optical.x(), optical.z()); }

double elevation_of(const Vector3d &optical) { return std::atan2(-optical.y(), std::hypot(optical.x(), optical.z())); }

// What the sensor of the camera's name said, by stamp.
std::map<int64_t, std::vector<Seen>> load_seen(const fs::path &run, const std::string &camera) {
  const fs::path file = run / "events.wmlog";
  EventLog log(run);
  const wm_log_head &head = log.head();
  size_t sensor = 0;
  while (sensor < head.sensor_count && camera != head.sensors[sensor].name) sensor++;
  if (sensor == head.sensor_count) throw Failure(file.string() + ": the camera '" + camera + "' saw no landmarks");
  std::map<int64_t, std::vector<Seen>> out;
  while (const wm_event *next = log.next()) {
    const wm_event &event = *next;
    if (event.kind == WM_EVENT_SIGHTING && event.as.sighting.sensor == sensor &&
        std::isfinite(event.as.sighting.bearing_rad)) {
      const wm_sighting &s = event.as.sighting;
      const double up_rad = wm_sighting_has_elevation(&s) ? s.elevation_rad : std::nan("");
      out[event.t_ns].push_back({s.landmark_id, s.bearing_rad, s.bearing_sigma_rad, up_rad, s.elevation_sigma_rad});
    }
  }
  return out;
}

std::map<int64_t, Panel> load_panels(const fs::path &recording) {
  const Csv places = Csv::load(recording / "truth-landmarks.csv"),
            looks = Csv::load(recording / "landmarks/appearance.csv");
  const size_t id = places.need("id"), x = places.need("x_m"), y = places.need("y_m"), z = places.need("z_m");
  std::map<int64_t, Panel> out;
  for (size_t row = 0; row < places.rows(); row++)
    out[places.integer(row, id)].middle = {places.number(row, x), places.number(row, y), places.number(row, z)};
  const size_t look_id = looks.need("id"), width = looks.need("width_m"), height = looks.need("height_m"),
               yaw = looks.need("yaw_rad");
  for (size_t row = 0; row < looks.rows(); row++) {
    const double along = looks.number(row, yaw);
    Panel &p = out[looks.integer(row, look_id)];
    p.right = 0.5 * looks.number(row, width) * Vector3d(std::cos(along), std::sin(along), 0);
    p.up = 0.5 * looks.number(row, height) * Vector3d(0, 0, 1);
  }
  return out;
}

bool is_within(const std::vector<Pose> &truth, int64_t t_ns) {
  return !truth.empty() && t_ns > truth.front().t_ns && t_ns < truth.back().t_ns;
}

// The robot at t_ns (which is within), between the two nearest rows of truth.
images::Pose pose_at(const std::vector<Pose> &truth, int64_t t_ns) {
  const auto after =
      std::lower_bound(truth.begin(), truth.end(), t_ns, [](const Pose &p, int64_t t) { return p.t_ns < t; });
  const Pose &a = *(after - 1), &b = *after;
  const double s = static_cast<double>(t_ns - a.t_ns) / static_cast<double>(b.t_ns - a.t_ns);
  images::Pose out = images::Pose::Identity();
  out.linear() = a.q.slerp(s, b.q).toRotationMatrix();
  out.translation() = a.p_m + s * (b.p_m - a.p_m);
  return out;
}

// The shorter side's pixels and the bearing by truth; false where the camera has no picture of it.
bool by_truth(const images::Camera &camera, const images::Pose &T_map_base, const Panel &panel, double *shorter_px,
              double *bearing_rad) {
  const images::Pose T_optical_map = (T_map_base * images::T_base_optical(camera)).inverse();
  const Vector3d corners[4] = {panel.middle - panel.right + panel.up, panel.middle + panel.right + panel.up,
                               panel.middle + panel.right - panel.up, panel.middle - panel.right - panel.up};
  Vector2d p[4];
  for (int i = 0; i < 4; i++)
    if (!images::project(camera, T_optical_map * corners[i], p[i])) return false;
  *shorter_px = std::min(0.5 * ((p[0] - p[1]).norm() + (p[2] - p[3]).norm()),
                         0.5 * ((p[1] - p[2]).norm() + (p[3] - p[0]).norm()));
  *bearing_rad = bearing_of(T_optical_map * panel.middle);
  return true;
}

// The labels of one camera by frame, as the camera, as calibrated, has their bearings.
std::map<int64_t, std::vector<Label>> load_labels(const fs::path &recording, size_t index, const images::Camera &camera,
                                                  const std::map<int64_t, int64_t> &stamps,
                                                  const std::map<int64_t, Panel> &panels,
                                                  const std::vector<Pose> &truth) {
  const Csv csv = Csv::load(recording / "labels/landmarks.csv");
  const size_t frame = csv.need("frame"), which = csv.need("camera"), id = csv.need("id"), u = csv.need("u_px"),
               v = csv.need("v_px");
  std::map<int64_t, std::vector<Label>> out;
  for (size_t row = 0; row < csv.rows(); row++) {
    if (csv.integer(row, which) != static_cast<int64_t>(index)) continue;
    const auto stamp = stamps.find(csv.integer(row, frame));
    const auto panel = panels.find(csv.integer(row, id));
    Vector3d ray;
    if (stamp == stamps.end() || panel == panels.end() || !is_within(truth, stamp->second) ||
        !images::unproject(camera, {csv.number(row, u), csv.number(row, v)}, ray))
      continue;
    Label label{csv.integer(row, id), bearing_of(ray), elevation_of(ray), 0};
    double bearing = 0;
    (void)by_truth(camera, pose_at(truth, stamp->second), panel->second, &label.shorter_px, &bearing);
    out[stamp->first].push_back(label);
  }
  return out;
}

// One of a class, that the detector doesn't name: the label nearest to it that nothing else was taken for, within the
// angle that is right.
std::vector<Label>::const_iterator nearest(const std::vector<Label> &wanted, const std::map<int64_t, bool> &found,
                                           const Seen &seen) {
  auto best = wanted.end();
  double least = kWithin_rad;
  for (auto at = wanted.begin(); at != wanted.end(); ++at) {
    const double off = std::fabs(std::remainder(seen.bearing_rad - at->bearing_rad, 2 * M_PI));
    if (off < least && !found.contains(at->id)) least = off, best = at;
  }
  return best;
}

void judge_camera(const fs::path &run, const fs::path &recording, size_t index, const NamedCamera &named,
                  double size_min_px, const std::vector<double> &sizes_m, Counts *n) {
  const auto seen = load_seen(run, named.name);
  if (seen.empty()) return;
  std::map<int64_t, int64_t> stamps;
  for (const auto &[t_ns, frame] : load_frame_stamps(recording, named.name)) stamps[frame] = t_ns;
  const auto panels = load_panels(recording);
  const std::vector<Pose> truth = load_truth(recording);
  const auto labels = load_labels(recording, index, named.camera, stamps, panels, truth);
  const int64_t half_ns = named.camera.readout_ns / 2 + 1000;
  for (const auto &[frame, t_ns] : stamps) {
    if (t_ns < seen.begin()->first - half_ns || t_ns > seen.rbegin()->first + half_ns || !is_within(truth, t_ns))
      continue;
    static const std::vector<Label> kNone;
    const auto there = labels.find(frame);
    const std::vector<Label> &wanted = there == labels.end() ? kNone : there->second;
    n->pictures++;
    std::map<int64_t, bool> found;
    for (auto at = seen.lower_bound(t_ns - half_ns); at != seen.end() && at->first <= t_ns + half_ns; ++at)
      for (const Seen &s : at->second) {
        n->seen++;
        const auto label =
            s.id >= 0 ? std::find_if(wanted.begin(), wanted.end(), [&](const Label &l) { return l.id == s.id; })
                      : nearest(wanted, found, s);
        if (label == wanted.end()) {
          const images::Pose robot = pose_at(truth, t_ns);
          const bool stands_there = std::any_of(panels.begin(), panels.end(), [&](const auto &panel) {
            double size = 0, bearing = 0;
            return (s.id < 0 || panel.first == s.id) && by_truth(named.camera, robot, panel.second, &size, &bearing) &&
                   std::fabs(std::remainder(s.bearing_rad - bearing, 2 * M_PI)) <
                       (s.id < 0 ? kWithin_rad : kHidden_rad);
          });
          (stands_there ? n->hidden : n->wrong)++;
          continue;
        }
        const double off = std::remainder(s.bearing_rad - label->bearing_rad, 2 * M_PI);
        if (std::fabs(off) > kWithin_rad) {
          n->wrong++;
          continue;
        }
        n->right++;
        found[label->id] = true;
        n->off_deg.push_back(off * 180 / M_PI);
        if (s.sigma_rad > 0) n->normalised.push_back(off / s.sigma_rad);
        if (!std::isfinite(s.elevation_rad)) continue;
        const double up_off = s.elevation_rad - label->elevation_rad;
        n->up_off_deg.push_back(up_off * 180 / M_PI);
        if (s.elevation_sigma_rad > 0) n->up_normalised.push_back(up_off / s.elevation_sigma_rad);
      }
    for (const Label &l : wanted) {
      if (!is_wanted(panels.at(l.id), sizes_m)) continue;
      const bool is_found = found.contains(l.id), is_large = l.shorter_px >= size_min_px;
      n->labelled++;
      n->found += is_found;
      n->large += is_large;
      n->found_large += is_large && is_found;
    }
  }
}

nlohmann::ordered_json share(int64_t part, int64_t whole) {
  if (whole == 0) return nullptr;
  return static_cast<double>(part) / static_cast<double>(whole);
}

// Mean, RMS and 95 % of one angle's errors, and of these over their sigmas; null where there are none.
void add_angle(const std::vector<double> &off_deg, const std::vector<double> &normalised, const std::string &name,
               const std::string &over_sigma, Figures *f) {
  std::vector<double> sizes;
  for (const double off : off_deg) sizes.push_back(std::fabs(off));
  const auto put = [f](const std::string &key, bool there, const auto &value) {
    (*f)[key] = nullptr;
    if (there) (*f)[key] = value();
  };
  put(name + "_mean_deg", !off_deg.empty(), [&] { return mean(off_deg); });
  put(name + "_rms_deg", !off_deg.empty(), [&] { return rms(off_deg); });
  put(name + "_p95_deg", !off_deg.empty(), [&] { return percentile(sizes, 95); });
  put(over_sigma + "_mean", !normalised.empty(), [&] { return mean(normalised); });
  put(over_sigma + "_rms", !normalised.empty(), [&] { return rms(normalised); });
}

}  // namespace

Figures evaluate_landmarks(const DetectorArguments &a, double size_min_px, const std::vector<double> &sizes_m) {
  const fs::path run = a.run, recording = a.recording, calibration = recording / "calibration.yaml";
  for (const char *file : {"labels/landmarks.csv", "truth-landmarks.csv", "landmarks/appearance.csv"})
    if (!fs::exists(recording / file))
      throw Failure((recording / file).string() +
                    ": is not there; landmarks are judged in labelled pictures (waymark simulate writes them for "
                    "crossings)");
  const std::vector<NamedCamera> cameras = load_cameras(calibration);
  if (!a.camera.empty()) (void)choose_camera(cameras, a.camera, calibration);
  Counts n;
  for (size_t i = 0; i < cameras.size(); i++)
    if (a.camera.empty() || a.camera == cameras[i].name)
      judge_camera(run, recording, i, cameras[i], size_min_px, sizes_m, &n);
  if (n.pictures == 0) throw Failure(run.string() + ": the run detected no landmark in a labelled picture");
  Figures f;
  f["within_deg"] = kWithin_rad * 180 / M_PI;
  f["size_min_px"] = size_min_px;
  f["pictures"] = n.pictures;
  f["labelled"] = n.labelled;
  f["labelled_large"] = n.large;
  f["seen"] = n.seen;
  f["right"] = n.right;
  f["false"] = n.wrong;
  f["on_hidden"] = n.hidden;
  f["precision"] = share(n.right, n.right + n.wrong);
  f["recall"] = share(n.found_large, n.large);
  f["recall_of_all"] = share(n.found, n.labelled);
  add_angle(n.off_deg, n.normalised, "bearing", "normalised", &f);
  add_angle(n.up_off_deg, n.up_normalised, "elevation", "elevation_normalised", &f);
  return f;
}

std::string landmark_table(const Figures &f, const std::string &title) {
  const auto number = [&](const char *key, const char *format) {
    char text[32];
    if (!f[key].is_number()) return std::string("-");
    std::snprintf(text, sizeof text, format, f[key].get<double>());
    return std::string(text);
  };
  const auto angle = [&](const char *title_of, const std::string &name, const std::string &over_sigma) {
    return "  " + std::string(title_of) + " RMS " + number((name + "_rms_deg").c_str(), "%.4f") + ", mean " +
           number((name + "_mean_deg").c_str(), "%.4f") + ", 95 % below " +
           number((name + "_p95_deg").c_str(), "%.4f") + " degrees; against its own sigma: RMS " +
           number((over_sigma + "_rms").c_str(), "%.3f") + ", mean " + number((over_sigma + "_mean").c_str(), "%.3f") +
           "\n";
  };
  const auto count = [&](const char *key) { return std::to_string(f[key].get<int64_t>()); };
  return title + ": known landmarks in " + count("pictures") + " labelled pictures\n\n  seen      " + count("seen") +
         ": " + count("right") + " right, " + count("false") + " false, " + count("on_hidden") +
         " partly hidden; precision " + number("precision", "%.3f") + "\n  labelled  " + count("labelled_large") +
         " with " + number("size_min_px", "%.0f") + " px and more: recall " + number("recall", "%.3f") + "; of all " +
         count("labelled") + " " + number("recall_of_all", "%.3f") + "\n" +
         angle("bearing  ", "bearing", "normalised") +
         (f["elevation_rms_deg"].is_number() ? angle("elevation", "elevation", "elevation_normalised") : "");
}

}  // namespace wm::tools
