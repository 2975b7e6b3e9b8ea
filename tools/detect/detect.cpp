// SPDX-License-Identifier: Apache-2.0
#include "detect/detect.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <set>

#include "common/failure.h"
#include "common/program.h"
#include "common/recording_folder.h"
#include "common/run_folder.h"
#include "detect/rows.h"
#include "detect/sketch.h"
#include "images/pictures.h"
#include "images/video.h"
#include "waymark/detectors.h"

extern "C" {
#include "config/detectors.h"
}

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

constexpr size_t kEvents = 256;                 // of a picture, as on the robot
constexpr int64_t kPair_ns = 2 * WM_NS_PER_MS;  // pictures of a pair are triggered together
constexpr int kQuality = 85;

struct ConfigFreer {
  void operator()(wm_config *c) const {
    wm_config_free(c);
    delete c;
  }
};
using Config = std::unique_ptr<wm_config, ConfigFreer>;

struct Freer {
  void operator()(void *p) const { std::free(p); }
};

// ── which detectors ─────────────────────────────────────────────────────────────────────────────────────────────────

// A detector with parameters. `family` is the marker family in the name of its output, where several are tried.
struct Wanted {
  Config config;
  const wm_vision_config *vision;
  std::string family;
};

Config parse(const std::string &text) {
  Config out(new wm_config{});
  wm_error err{};
  need_ok(wm_config_parse(text.data(), text.size(), "--set", out.get(), &err), err);
  return out;
}

std::string config_text(const std::string &detector, const std::vector<std::string> &sets) {
  std::string text = "format: waymark-config/1\nestimator: odometry\nvision:\n  " + detector + ":";
  if (sets.empty()) text += " {}";
  for (const std::string &set : sets) {
    const size_t equals = set.find('=');
    if (equals == std::string::npos || equals == 0)
      throw Failure("--set: '" + set + "' is not KEY=VALUE, as in family=tag36h11", kUsage);
    text += "\n    " + set.substr(0, equals) + ": " + set.substr(equals + 1);
  }
  return text + "\n";
}

bool is_set(const std::vector<std::string> &sets, const std::string &key) {
  return std::any_of(sets.begin(), sets.end(), [&](const std::string &s) { return s.rfind(key + "=", 0) == 0; });
}

// Markers without a known size are found all the same: their distances are then in widths of a marker.
std::vector<std::string> with_size(const DetectWish &wish, const wm_rig &rig) {
  std::vector<std::string> sets = wish.sets;
  const bool is_marker = wish.detector == "apriltag" || wish.detector == "mr";
  const bool own_size =
      std::isfinite(rig.marker_size_m) && (wish.detector != "mr" || rig.marker_family == std::string("mr"));
  if (!is_marker || own_size || is_set(sets, "size_m")) return sets;
  std::fprintf(stderr, "note: the markers' size is not known (--set size_m=METRES): distances are in widths of one\n");
  sets.emplace_back("size_m=1");
  return sets;
}

std::vector<Wanted> wanted_detectors(const DetectWish &wish, const Input &input, Config from_file) {
  std::vector<Wanted> out;
  if (from_file) {
    const auto shared = from_file.get();
    for (size_t i = 0; i < shared->vision_count; i++) out.push_back({nullptr, &shared->vision[i], ""});
    if (out.empty())
      throw Failure(wish.config + ": vision: is missing; `vision: {edges: {}}` names a detector", kUsage);
    out.front().config = std::move(from_file);
    return out;
  }
  const std::vector<std::string> sets = with_size(wish, input.rig());
  const bool is_open = wish.detector == "apriltag" && input.rig().marker_family[0] == '\0' && !is_set(sets, "family");
  const bool is_all = is_open || std::find(sets.begin(), sets.end(), "family=all") != sets.end();
  if (wish.detector != "apriltag" || !is_all) {
    Config config = parse(config_text(wish.detector, sets));
    const wm_vision_config *vision = &config->vision[0];
    out.push_back({std::move(config), vision, ""});
    return out;
  }
  for (const char *const *family = wm_marker_family_names + 1; *family != nullptr; family++) {
    std::vector<std::string> with = sets;
    std::erase(with, "family=all");
    with.push_back(std::string("family=") + *family);
    Config config = parse(config_text(wish.detector, with));
    const wm_vision_config *vision = &config->vision[0];
    out.push_back({std::move(config), vision, *family});
  }
  return out;
}

// ── drawings ────────────────────────────────────────────────────────────────────────────────────────────────────────

class Drawer {
 public:
  Drawer(Drawing kind, const fs::path &at, double rate_hz) : kind_(kind), at_(at), rate_hz_(rate_hz) {
    if (kind_ == Drawing::avi) at_ += ".avi";
    fs::create_directories(kind_ == Drawing::avi ? at_.parent_path() : at_);
  }
  void add(const images::Picture8 &picture, const std::string &name) {
    std::string error;
    bool good = true;
    if (kind_ == Drawing::avi) {
      if (!begun_)
        good = avi_.open(at_, images::AviWriter::Coding::mjpeg, picture.width, picture.height, rate_hz_, error);
      begun_ = true;
      good = good && avi_.add(picture, kQuality, error);
    } else {
      const bool is_jpg = kind_ == Drawing::jpg;
      const fs::path file = at_ / (name + (is_jpg ? ".jpg" : ".png"));
      good = is_jpg ? images::write_jpeg(file, picture, kQuality, error) : images::write_png(file, picture, error);
    }
    if (!good) throw Failure(error);
  }
  void finish() {
    std::string error;
    if (begun_ && !avi_.close(error)) throw Failure(error);
  }
  [[nodiscard]] std::string place() const { return at_; }

 private:
  Drawing kind_;
  fs::path at_;
  double rate_hz_;
  images::AviWriter avi_;
  bool begun_ = false;
};

Drawing drawing_of(const DetectWish &wish, const Input &input) {
  if (wish.draw == "none") return Drawing::none;
  if (wish.draw == "png") return Drawing::png;
  if (wish.draw == "jpg") return Drawing::jpg;
  if (wish.draw == "avi") return Drawing::avi;
  return input.is_folder() ? Drawing::jpg : Drawing::avi;
}

// ── one detector on one camera or pair ──────────────────────────────────────────────────────────────────────────────

class Source {
 public:
  Source(const Input &input, const Wanted &wanted, std::vector<int32_t> cameras, int every)
      : detector_(*wanted.vision->detector), cameras_(std::move(cameras)), events_(kEvents) {
    const wm_rig &rig = input.rig();
    wm_view view{};
    view.rig = &rig;
    view.cameras = cameras_.data();
    view.cascades = wanted.vision->cascades;
    view.cascade_count = wanted.vision->cascade_count;
    input.add_landmarks(&view);
    const char *why = nullptr;
    const size_t bytes = detector_.state_bytes(wanted.vision->params, &view, &why);
    const std::string camera = rig.cameras[cameras_[0]].name;
    if (bytes == 0)
      throw Failure(
          std::string("detector ") + detector_.name + ", camera '" + camera +
              "': " + (why != nullptr ? why : "this camera can't be used") +
              (input.is_calibrated() ? ""
                                     : " (--calibration FILE gives the camera's; without it, its lens is a guess)"),
          kUsage);
    state_.reset(std::aligned_alloc(64, (bytes + 63) / 64 * 64));
    if (!state_ || detector_.init(state_.get(), wanted.vision->params, &view) != WM_OK)
      throw Failure(std::string("detector ") + detector_.name + ", camera '" + camera + "': can't start");
    for (uint32_t i = 0; i < detector_.pictures; i++) streams_.push_back(input.open(cameras_[i], every));
  }

  // The next picture, or pair; false at the end.
  bool next(wm_frame *frames) {
    for (size_t i = 0; i < streams_.size(); i++)
      if (!streams_[i]->next(&frames[i])) return false;
    while (streams_.size() == 2 && std::llabs(frames[1].t_ns - frames[0].t_ns) > kPair_ns) {
      const size_t older = frames[1].t_ns < frames[0].t_ns ? 1 : 0;
      if (!streams_[older]->next(&frames[older])) return false;
    }
    return true;
  }
  // False: a picture of another size than the camera's.
  bool detect(const wm_frame *frames, const wm_estimate *prediction, std::vector<wm_event> *out) {
    size_t count = 0;
    const wm_status status = detector_.detect(state_.get(), frames, prediction, events_.data(), events_.size(), &count);
    out->assign(events_.begin(), events_.begin() + static_cast<std::ptrdiff_t>(status == WM_OK ? count : 0));
    return status == WM_OK;
  }
  [[nodiscard]] std::string picture() const { return streams_[0]->name(); }

 private:
  const wm_detector &detector_;
  std::vector<int32_t> cameras_;
  std::vector<wm_event> events_;
  std::unique_ptr<void, Freer> state_;
  std::vector<std::unique_ptr<FrameStream>> streams_;
};

int64_t id_of(const wm_event &event) {
  if (event.kind == WM_EVENT_SIGHTING) return event.as.sighting.landmark_id;
  if (event.kind == WM_EVENT_MARKER) return event.as.marker.id;
  return event.kind == WM_EVENT_STEREO ? event.as.stereo.id : -1;
}

size_t detections_in(const wm_event &event) { return event.kind == WM_EVENT_POINTS ? event.as.points.count : 1; }

wm_estimate estimate_of(const Pose &pose) {
  wm_estimate e{};
  e.t_ns = pose.t_ns;
  for (int i = 0; i < 3; i++) e.pose_map_base.p_m[i] = pose.p_m[i];
  const double q[4] = {pose.q.x(), pose.q.y(), pose.q.z(), pose.q.w()};
  std::copy_n(q, 4, e.pose_map_base.q_xyzw);
  e.heading_rad = heading_rad(pose.q);
  for (int i = 0; i < 6; i++)
    for (int j = 0; j < 6; j++) e.covariance[wm_cov_index(i, j)] = pose.covariance(i, j);
  e.dof = 3;
  e.state = WM_STATE_TRACKING;
  return e;
}

double marker_size(const Wanted &wanted, const wm_rig &rig) {
  const wm_param_table &table = wanted.vision->detector->params;
  for (size_t i = 0; i < table.count; i++) {
    if (std::string(table.params[i].key) != "size_m") continue;
    const double own =
        *reinterpret_cast<const double *>(static_cast<const char *>(wanted.vision->params) + table.params[i].offset);
    return own > 0 ? own : rig.marker_size_m;
  }
  return 0;
}

Detected run(const DetectWish &wish, const Input &input, const Wanted &wanted, const std::vector<int32_t> &cameras,
             const std::vector<Pose> &poses, const Progress &progress) {
  using Clock = std::chrono::steady_clock;
  const wm_rig &rig = input.rig();
  Detected out;
  out.camera = rig.cameras[cameras[0]].name;
  out.detector = wanted.vision->detector->name + (wanted.family.empty() ? "" : "-" + wanted.family);
  const std::string name = out.camera + "-" + out.detector;
  Source source(input, wanted, cameras, wish.every);
  const Sketch sketch(rig, cameras[0], marker_size(wanted, rig));
  out.csv = fs::path(wish.out) / "detections" / (name + ".csv");
  fs::create_directories(fs::path(out.csv).parent_path());
  DetectionRows rows(out.csv, wanted.vision->detector->gives);
  std::optional<Drawer> drawer;
  const Drawing drawing = drawing_of(wish, input);
  if (drawing != Drawing::none) drawer.emplace(drawing, fs::path(wish.out) / "drawn" / name, wish.rate_hz);
  std::set<int64_t> ids;
  std::vector<wm_event> events;
  wm_frame frames[2] = {};
  while (source.next(frames)) {
    const auto pose = pose_at(poses, frames[0].t_ns, kMaxGapNs);
    const wm_estimate prediction = pose ? estimate_of(*pose) : wm_estimate{};
    const auto begin = Clock::now();
    const bool fits = source.detect(frames, pose ? &prediction : nullptr, &events);
    out.ms += std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
    out.pictures++;
    if (progress) progress(name, out.pictures);
    if (!fits) {
      out.refused++;
      continue;
    }
    size_t count = 0;
    for (const wm_event &event : events) {
      count += detections_in(event);
      if (id_of(event) >= 0) ids.insert(id_of(event));
    }
    out.detections += count;
    out.with_something += count > 0;
    rows.add(frames[0], source.picture(), events, sketch);
    if (drawer)
      drawer->add(sketch.draw(frames[0], events, source.picture() + ": " + std::to_string(count)), source.picture());
  }
  rows.finish();
  if (drawer) drawer->finish();
  if (drawer) out.drawn = drawer->place();
  out.ids.assign(ids.begin(), ids.end());
  if (out.pictures > 0) out.ms /= static_cast<double>(out.pictures);
  if (out.pictures > 0 && out.refused == out.pictures) {
    const wm_camera &camera = rig.cameras[cameras[0]];
    throw Failure(name + ": no picture has the size of the camera's calibration, " + std::to_string(camera.width_px) +
                      " x " + std::to_string(camera.height_px) + "; they are " + std::to_string(frames[0].width_px) +
                      " x " + std::to_string(frames[0].height_px),
                  kUsage);
  }
  return out;
}

bool names_camera(const wm_vision_config &vision, const wm_camera &camera) {
  if (vision.camera_count == 0) return true;
  return std::any_of(vision.cameras, vision.cameras + vision.camera_count,
                     [&](const char *name) { return std::string(name) == camera.name; });
}

// A family of markers that was tried and is not in the pictures leaves no files.
void forget(const Detected &d) {
  fs::remove(d.csv);
  if (!d.drawn.empty()) fs::remove_all(d.drawn);
}

std::vector<Pose> guiding_poses(const std::string &from) {
  if (from.empty()) return {};
  return fs::exists(fs::path(from) / "recording.yaml") ? load_truth(from) : load_trajectory(from).poses;
}

}  // namespace

std::vector<std::string> detector_names() {
  std::vector<std::string> out;
  for (size_t i = 0; config_detector(i) != nullptr; i++) out.emplace_back(config_detector(i)->name);
  return out;
}

std::vector<Detected> detect(const DetectWish &wish, const Progress &progress) {
  InputWish from = wish.input;
  Config config;
  if (!wish.config.empty()) {
    config.reset(new wm_config{});
    wm_error err{};
    need_ok(wm_config_load(wish.config.c_str(), config.get(), &err), err);
    std::fputs(config->warnings, stderr);
    from.files = config->overrides;
  }
  const Input input(from);
  const std::vector<Pose> poses = guiding_poses(wish.poses);
  const std::vector<Wanted> all = wanted_detectors(wish, input, std::move(config));
  if (!input.is_calibrated())
    std::fprintf(stderr,
                 "note: no calibration of this camera: its lens is taken for one of 60 degrees; pixels and identities "
                 "are right, bearings and distances are not (--calibration FILE)\n");
  std::vector<Detected> out;
  for (const Wanted &wanted : all) {
    if (wanted.vision->detector->pictures == 2) {
      const wm_stereo_pair &pair = input.rig().stereo;
      if (pair.left < 0 || pair.right < 0 || !input.is_recording())
        throw Failure(std::string("detector ") + wanted.vision->detector->name +
                          ": needs a recording with a pair of cameras: stereo: {left: ..., right: ...} in "
                          "calibration.yaml",
                      kUsage);
      out.push_back(run(wish, input, wanted, {pair.left, pair.right}, poses, progress));
      continue;
    }
    for (const int32_t camera : input.cameras()) {
      if (!names_camera(*wanted.vision, input.rig().cameras[camera])) continue;
      Detected found = run(wish, input, wanted, {camera}, poses, progress);
      if (!wanted.family.empty() && found.detections == 0)
        forget(found);
      else
        out.push_back(std::move(found));
    }
  }
  return out;
}

}  // namespace wm::tools
