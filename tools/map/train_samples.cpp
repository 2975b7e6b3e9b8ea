// SPDX-License-Identifier: Apache-2.0
#include "map/train_samples.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "common/csv.h"
#include "common/failure.h"
#include "common/recording_folder.h"
#include "waymark/internal/sensors/lens.hpp"
#include "waymark/recording.h"
#include "waymark/video.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

struct Panel {
  Vector3d middle, normal;
};

// The landmarks of the class.
std::map<int64_t, Panel> load_panels(const fs::path &recording, const std::vector<double> &size_m) {
  const fs::path truth = recording / "truth-landmarks.csv";
  const Csv places = Csv::load(fs::exists(truth) ? truth : recording / "landmarks.csv");
  const Csv looks = Csv::load(recording / "landmarks/appearance.csv");
  std::map<int64_t, Panel> out;
  const size_t id = looks.need("id"), width = looks.need("width_m"), height = looks.need("height_m"),
               yaw = looks.need("yaw_rad");
  const auto alike = [](double a, double b) { return std::fabs(a - b) < 0.05 * b; };
  for (size_t row = 0; row < looks.rows(); row++) {
    if (!alike(looks.number(row, width), size_m[0]) || !alike(looks.number(row, height), size_m[1])) continue;
    const double along = looks.number(row, yaw);
    out[looks.integer(row, id)].normal = {std::sin(along), -std::cos(along), 0};
  }
  const size_t place_id = places.need("id"), x = places.need("x_m"), y = places.need("y_m"), z = places.need("z_m");
  std::set<int64_t> placed;
  for (size_t row = 0; row < places.rows(); row++) {
    const auto at = out.find(places.integer(row, place_id));
    if (at == out.end()) continue;
    at->second.middle = {places.number(row, x), places.number(row, y), places.number(row, z)};
    placed.insert(at->first);
  }
  std::erase_if(out, [&](const auto &one) { return !placed.contains(one.first); });
  return out;
}

class Reader {
 public:
  Reader(const TrainCascade &a, fs::path recording, Samples *out) : a_(a), recording_(std::move(recording)), out_(out) {
    wm_error err{};
    wm_recording *opened = nullptr;
    const wm_recording_overrides none{};
    if (wm_recording_open(recording_.c_str(), &none, nullptr, nullptr, &opened, &err) != WM_OK) throw Failure(err.text);
    opened_.reset(opened);
    panels_ = load_panels(recording_, a.size_m);
    truth_ = load_truth(recording_);
    const Csv labels = Csv::load(recording_ / "labels/landmarks.csv");
    const size_t frame = labels.need("frame"), camera = labels.need("camera"), id = labels.need("id");
    for (size_t row = 0; row < labels.rows(); row++)
      labels_.insert({labels.integer(row, camera), labels.integer(row, frame), labels.integer(row, id)});
  }

  void read(int every, int first) {
    const wm_rig &rig = *wm_site_rig(wm_recording_site(opened_.get()));
    for (uint32_t i = 0; i < rig.camera_count; i++)
      if (wm_video_there(recording_.c_str(), rig.cameras[i].name)) read_camera(rig.cameras[i], i, every, first);
  }

 private:
  void read_camera(const wm_camera &camera, uint32_t index, int every, int first) {
    const mounted_camera &mounted = camera_of(camera);
    wm_error err{};
    wm_video *opened = nullptr;
    if (wm_video_open(recording_.c_str(), &camera, static_cast<int32_t>(index), nullptr, nullptr, &opened, &err) !=
        WM_OK)
      throw Failure(err.text);
    const std::unique_ptr<wm_video, decltype(&wm_video_close)> video(opened, wm_video_close);
    wm_frame frame;
    for (int n = first; wm_video_peek(video.get(), &frame, &err) == WM_OK; n++) {
      if (n % every != 0) {
        if (wm_video_skip(video.get(), &err) != WM_OK) break;
        continue;
      }
      if (wm_video_next(video.get(), &frame, &err) != WM_OK) break;
      const auto pose = pose_at(truth_, frame.t_ns, kMaxGapNs);
      if (pose && frame.width_px == mounted.width_px && frame.height_px == mounted.height_px)
        take(frame, mounted, index, *pose);
    }
  }

  // Recordings of one robot have the same cameras.
  const mounted_camera &camera_of(const wm_camera &camera) {
    auto made = std::make_unique<mounted_camera>();
    std::memset(static_cast<void *>(made.get()), 0, sizeof *made);
    if (const char *why = mounted_camera_init(made.get(), camera)) throw Failure(recording_.string() + ": " + why);
    for (const auto &there : out_->cameras)
      if (std::memcmp(static_cast<const void *>(there.get()), static_cast<const void *>(made.get()), sizeof *made) == 0)
        return *there;
    out_->cameras.push_back(std::move(made));
    return *out_->cameras.back();
  }

  void take(const wm_frame &frame, const mounted_camera &camera, uint32_t index, const Pose &pose) {
    LabelledPicture picture{&camera, {}, {}};
    for (uint32_t y = 0; y < frame.height_px; y++) {
      const uint8_t *row = frame.grey + static_cast<size_t>(y) * frame.stride_bytes;
      picture.grey.insert(picture.grey.end(), row, row + frame.width_px);
    }
    const Vector3d centre(camera.centre_m.x, camera.centre_m.y, camera.centre_m.z);
    for (const auto &[id, panel] : panels_) {
      const Vector3d from = pose.q.conjugate() * (panel.middle - pose.p_m) - centre;
      const double distance = std::hypot(from.x(), from.y());
      if (distance < 0.5) continue;
      const double facing = -(pose.q.conjugate() * panel.normal).dot(from) / from.norm();
      picture.places.push_back(
          {std::atan2(from.y(), from.x()), from.z() / distance, distance,
           facing >= a_.facing_min && labels_.contains({index, static_cast<int64_t>(frame.number), id})});
      out_->low_m = std::min(out_->low_m, from.z());
      out_->high_m = std::max(out_->high_m, from.z());
    }
    out_->pictures.push_back(std::move(picture));
  }

  const TrainCascade &a_;
  fs::path recording_;
  Samples *out_;
  std::unique_ptr<wm_recording, void (*)(wm_recording *)> opened_{nullptr, wm_recording_close};
  std::map<int64_t, Panel> panels_;
  std::vector<Pose> truth_;
  std::set<std::tuple<int64_t, int64_t, int64_t>> labels_;  // camera, frame, landmark
};

}  // namespace

Samples load_samples(const TrainCascade &a) {
  Samples out;
  out.low_m = 1e9, out.high_m = -1e9;
  constexpr int kEach = 80;  // pictures of a recording, about: those that are of use are told after reading
  const int every = std::max(1, static_cast<int>(kEach * a.recordings.size()) / a.pictures);
  int first = 0;
  for (const std::string &recording : a.recordings) Reader(a, recording, &out).read(every, first++);
  if (out.low_m > out.high_m)
    throw Failure("no landmark of this size is in landmarks/appearance.csv of these recordings: --size", kUsage);
  return out;
}

}  // namespace wm::tools
