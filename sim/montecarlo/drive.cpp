// SPDX-License-Identifier: Apache-2.0
#include "montecarlo/drive.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/failure.h"
#include "common/recording_folder.h"

namespace wm::montecarlo {

wm_pose2 relative(const wm_pose2 &a, const wm_pose2 &b) {
  const double c = std::cos(a.heading_rad), s = std::sin(a.heading_rad), dx = b.x_m - a.x_m, dy = b.y_m - a.y_m;
  return {c * dx + s * dy, c * dy - s * dx, tools::wrap(b.heading_rad - a.heading_rad)};
}

wm_pose2 composed(const wm_pose2 &a, const wm_pose2 &way) {
  const double c = std::cos(a.heading_rad), s = std::sin(a.heading_rad);
  return {a.x_m + c * way.x_m - s * way.y_m, a.y_m + s * way.x_m + c * way.y_m,
          tools::wrap(a.heading_rad + way.heading_rad)};
}

EdgeDrive::EdgeDrive(const std::filesystem::path &folder)
    : name_(folder.filename()), log_(folder), map_(nullptr, wm_map_free) {
  wm_error error{};
  wm_map *map = nullptr;
  if (wm_map_load((folder / "map/map.yaml").c_str(), nullptr, nullptr, &map, &error) != WM_OK)
    throw tools::Failure(error.text);
  map_.reset(map);
  if (map_ && wm_map_raster(map)->edges == nullptr) throw tools::Failure(folder.string() + ": map has no edges");

  while (const wm_event *next = log_.next()) {
    const wm_event &event = *next;
    offsets_.push_back(bytes_.size());
    const auto *from = reinterpret_cast<const unsigned char *>(&event);
    bytes_.insert(bytes_.end(), from, from + wm_event_bytes(&event));
    if (offsets_.size() == 1) begin_ns_ = event.t_ns;
    end_ns_ = event.t_ns;
    if (event.kind == WM_EVENT_POINTS && event.as.points.count >= 8) scans_ns_.push_back(event.t_ns);
  }
  if (!log_.is_whole() || scans_ns_.empty())
    throw tools::Failure(folder.string() + "/events.wmlog: cut short, or without edge points; render the drive again");

  truth_ = tools::load_truth(folder);
  way_m_.assign(truth_.size(), 0.0);
  for (size_t i = 1; i < truth_.size(); i++)
    way_m_[i] = way_m_[i - 1] + (truth_[i].p_m - truth_[i - 1].p_m).head<2>().norm();
}

void EdgeDrive::event(size_t i, wm_event *out) const {
  const size_t end = i + 1 < offsets_.size() ? offsets_[i + 1] : bytes_.size();
  std::memcpy(static_cast<void *>(out), bytes_.data() + offsets_[i], end - offsets_[i]);
}

wm_pose2 EdgeDrive::truth(int64_t t_ns) const {
  const int64_t t = std::clamp(t_ns, truth_.front().t_ns, truth_.back().t_ns);
  const auto pose = tools::pose_at(truth_, t, INT64_MAX);
  return {pose->p_m.x(), pose->p_m.y(), tools::heading_rad(pose->q)};
}

double EdgeDrive::way_m(int64_t t_ns) const {
  const auto after = std::lower_bound(truth_.begin(), truth_.end(), t_ns,
                                      [](const tools::Pose &pose, int64_t t) { return pose.t_ns < t; });
  return after == truth_.end() ? way_m_.back() : way_m_[static_cast<size_t>(after - truth_.begin())];
}

double EdgeDrive::speed_mps(int64_t t_ns) const {
  constexpr int64_t kHalf_ns = 250'000'000;
  return (way_m(t_ns + kHalf_ns) - way_m(t_ns - kHalf_ns)) / (2e-9 * kHalf_ns);
}

double EdgeDrive::blind_s(int64_t from_ns, int64_t to_ns) const {
  int64_t longest = 0, last = from_ns;
  for (auto t = std::lower_bound(scans_ns_.begin(), scans_ns_.end(), from_ns); t != scans_ns_.end() && *t < to_ns;
       ++t) {
    longest = std::max(longest, *t - last);
    last = *t;
  }
  return 1e-9 * static_cast<double>(std::max(longest, to_ns - last));
}

}  // namespace wm::montecarlo
