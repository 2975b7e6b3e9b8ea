// SPDX-License-Identifier: Apache-2.0
#include "eval/line_contrast.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>

#include "common/failure.h"
#include "common/recording_folder.h"
#include "common/run_folder.h"
#include "common/statistics.h"
#include "waymark/internal/sensors/lens.hpp"
#include "waymark/video.h"

namespace wm::tools {
namespace {

constexpr double kDeg = M_PI / 180;
constexpr double kNear = 0.5 * kDeg, kFar = 1.5 * kDeg;  // of a side
constexpr int kAcross = 5, kAlong = 9;                   // samples of a side
constexpr double kContrast_grey = 8;
constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();
constexpr double kStep = 0.5 * kDeg, kLowest = -4 * kDeg, kHighest = 70 * kDeg;  // of the search for the upper end
constexpr int kGap = 4;        // steps without contrast that don't end a line
constexpr double kUsual = 60;  // percentile of a line's height over its pictures

using Labels = std::map<int64_t, std::vector<LabelledLine>>;

struct Picture {
  const wm_frame &frame;
  const wm::mounted_camera &camera;

  [[nodiscard]] bool grey_at(double azimuth, double elevation, double *out) const {
    wm::pixel at;
    const wm::vec3 ray = {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                          std::sin(elevation)};
    if (!wm::pixel_of(camera, camera.centre_m + ray, 1, &at)) return false;
    const auto u = static_cast<size_t>(at.u), v = static_cast<size_t>(at.v);
    const double right = at.u - static_cast<double>(u), down = at.v - static_cast<double>(v);
    const uint8_t *p = frame.grey + v * frame.stride_bytes + u, *q = p + frame.stride_bytes;
    *out = (1 - down) * ((1 - right) * p[0] + right * p[1]) + down * ((1 - right) * q[0] + right * q[1]);
    return true;
  }
  // Mean of the side towards larger azimuths less that of the other one; NaN outside of the picture.
  [[nodiscard]] double difference(double azimuth, double from, double to, int along) const {
    double sum = 0;
    for (int i = 0; i < along; i++)
      for (int k = 0; k < kAcross; k++) {
        const double elevation = from + (to - from) * (i + 0.5) / along,
                     away = kNear + (kFar - kNear) * k / (kAcross - 1);
        double left, right;
        if (!grey_at(azimuth + away, elevation, &left) || !grey_at(azimuth - away, elevation, &right)) return kAbsent;
        sum += left - right;
      }
    return sum / (along * kAcross);
  }
  // Elevation up to which the sides differ; NaN where they nowhere do.
  [[nodiscard]] double upper_end(double azimuth) const {
    double end = kAbsent;
    int missed = 0, sign = 0;
    for (double e = kLowest; e < kHighest && missed <= kGap; e += kStep) {
      const double d = difference(azimuth, e, e + kStep, 1);
      const int here = d > kContrast_grey ? 1 : d < -kContrast_grey ? -1 : 0;
      if (sign == 0) sign = here;
      if (here != 0 && here == sign) {
        end = e + kStep;
        missed = 0;
      } else if (sign != 0) {
        missed++;
      }
    }
    return end;
  }
};

using Visit = std::function<void(const Picture &, LabelledLine *)>;

void each_label(const std::filesystem::path &recording, const wm_camera &camera, int32_t index, Labels *labels,
                const Visit &visit) {
  wm::mounted_camera mounted;
  if (const char *why = wm::mounted_camera_init(&mounted, camera)) throw Failure(std::string(camera.name) + ": " + why);
  wm_error err{};
  wm_video *made = nullptr;
  if (wm_video_open(recording.c_str(), &camera, index, nullptr, nullptr, &made, &err) != WM_OK) throw Failure(err.text);
  const std::unique_ptr<wm_video, decltype(&wm_video_close)> video(made, wm_video_close);
  wm_frame frame{};
  while (wm_video_peek(video.get(), &frame, &err) == WM_OK) {
    const auto wanted = labels->find(static_cast<int64_t>(frame.number));
    if (wanted == labels->end()) {
      if (wm_video_skip(video.get(), &err) != WM_OK) return;
      continue;
    }
    if (wm_video_next(video.get(), &frame, &err) != WM_OK) return;
    const Picture picture{frame, mounted};
    for (LabelledLine &label : wanted->second) visit(picture, &label);
  }
}

}  // namespace

void mark_contrast(const std::filesystem::path &recording, const wm_camera &camera, int32_t index,
                   const std::map<int64_t, int64_t> &stamps, Labels *labels) {
  const std::vector<Pose> truth = load_truth(recording);
  std::map<int64_t, Eigen::Vector2d> places;
  for (const Landmark &l : load_landmarks(recording / "truth-landmarks.csv")) places[l.id] = l.p_m.head<2>();
  // From the camera on the floor.
  const auto distance = [&](const wm_frame &frame, int64_t id) {
    const auto stamp = stamps.find(static_cast<int64_t>(frame.number));
    const auto place = places.find(id);
    if (stamp == stamps.end() || place == places.end()) return std::nan("");
    const auto pose = pose_at(truth, stamp->second, kMaxGapNs);
    if (!pose) return std::nan("");
    const Eigen::Vector3d centre(camera.mounting.xyz_m[0], camera.mounting.xyz_m[1], camera.mounting.xyz_m[2]);
    return ((place->second - (pose->p_m + pose->q * centre).head<2>()).norm());
  };
  const double eye_m = camera.mounting.xyz_m[2];
  std::map<int64_t, std::vector<double>> heights;
  each_label(recording, camera, index, labels, [&](const Picture &picture, LabelledLine *label) {
    const double d = distance(picture.frame, label->id),
                 height = eye_m + d * std::tan(picture.upper_end(label->azimuth_rad));
    if (std::isfinite(height)) heights[label->id].push_back(height);
  });
  each_label(recording, camera, index, labels, [&](const Picture &picture, LabelledLine *label) {
    label->contrast = false;
    const double d = distance(picture.frame, label->id);
    const auto known = heights.find(label->id);
    if (known == heights.end() || !(d > 0)) return;
    const double top = percentile(known->second, kUsual);
    const double from = std::atan2(2.0 / 3.0 * top - eye_m, d), to = std::atan2(top - eye_m, d);
    label->contrast = std::fabs(picture.difference(label->azimuth_rad, from, to, kAlong)) >= kContrast_grey;
  });
}

}  // namespace wm::tools
