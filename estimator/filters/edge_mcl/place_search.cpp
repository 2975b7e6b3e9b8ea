// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/place_search.hpp"

#include <cstring>

#include "filters/edge_mcl/align.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kGrid_m = 0.2;
constexpr int kHeadings = 72;
constexpr double kKeyframeWay_m = 0.4, kKeyframeTurn_rad = 0.25;
constexpr double kSameWay_m = 0.6, kSameTurn_rad = 0.3;  // places nearer than this are one
constexpr int kRefinedAScan = 6;
constexpr double kHopeful = 0.35;  // how much better a point more may be than those before, on average

double way_between(const wm_pose2 &a, const wm_pose2 &b) {
  return std::sqrt(square(a.x_m - b.x_m) + square(a.y_m - b.y_m));
}

bool same_place(const wm_pose2 &a, const wm_pose2 &b) {
  return way_between(a, b) < kSameWay_m && std::fabs(wrap(a.heading_rad - b.heading_rad)) < kSameTurn_rad;
}

void close(scan_points &scan) {
  double reach = 0.0;
  for (int i = 0; i < scan.count; i++) {
    const double r = std::sqrt(square((double)scan.x_m[i]) + square((double)scan.y_m[i]));
    if (r > reach) reach = r;
  }
  scan.reach_m = (float)reach;
  for (int i = scan.count; i < scan.count + kScanLanes; i++) {
    scan.x_m[i] = scan.count > 0 ? scan.x_m[scan.count - 1] : 0.0f;
    scan.y_m[i] = scan.count > 0 ? scan.y_m[scan.count - 1] : 0.0f;
  }
  for (int &end : scan.class_end) end = scan.count;
}

}  // namespace

void place_search::init(const edge_map &map) {
  const double wide[kSigmaClasses] = {0.2, 0.2, 0.2, 0.2};
  make_score_table(map, wide, 0.1, false, &wide_);
  clear();
}

void place_search::clear() {
  seen_ = marked_ = from_ = 0;
  running_ = false;
  place_count_ = 0;
}

void place_search::begin_at_mark() {
  from_ = marked_;
  running_ = false;
}

bool place_search::see(const scan_points &scan, const wm_pose2 &odom) {
  if (scan.count < 8) return false;
  if (seen_ > 0) {
    const keyframe &last = keyframes_[(seen_ - 1) % kKeyframes];
    const double way = way_between(last.odom, odom);
    if (way < kKeyframeWay_m && std::fabs(wrap(last.odom.heading_rad - odom.heading_rad)) < kKeyframeTurn_rad)
      return false;
  }
  keyframe &k = keyframes_[seen_++ % kKeyframes];
  k.odom = odom;
  k.count = scan.count < kPointsEach ? scan.count : kPointsEach;
  for (int i = 0; i < k.count; i++) {
    const int from = (int)((int64_t)i * scan.count / k.count);
    k.x_m[i] = scan.x_m[from];
    k.y_m[i] = scan.y_m[from];
  }
  return true;
}

void place_search::gather(const wm_pose2 &odom, scan_points *out) const {
  out->count = 0;
  for (uint64_t n = oldest(); n < seen_; n++) {
    const keyframe &k = keyframes_[n % kKeyframes];
    const wm_pose2 from = between(odom, k.odom);
    const sin_cos h = sincos(from.heading_rad);
    for (int i = 0; i < k.count && out->count < WM_POINTS_MAX; i++) {
      const double x = (double)k.x_m[i], y = (double)k.y_m[i];
      out->x_m[out->count] = (float)(from.x_m + h.cos * x - h.sin * y);
      out->y_m[out->count++] = (float)(from.y_m + h.sin * x + h.cos * y);
    }
  }
}

double place_search::explained(const edge_map &map, const wm_pose2 &odom, wm_pose2 *pose) {
  gather(odom, &now_);
  return align_pose(map, now_.x_m, now_.y_m, now_.count, 0.3, 0.1, 4, pose);
}

void place_search::begin(const wm_pose2 &odom) {
  odom_ = odom;
  gather(odom, &all_);
  few_.count = all_.count < kSweepPoints ? all_.count : kSweepPoints;
  for (int i = 0; i < few_.count; i++) {
    const int from = (int)((int64_t)i * all_.count / few_.count);
    few_.x_m[i] = all_.x_m[from];
    few_.y_m[i] = all_.y_m[from];
  }
  fewer_.count = 0;
  for (int i = 0; i < few_.count; i += kSweepPoints / kFirstPoints) {
    fewer_.x_m[fewer_.count] = few_.x_m[i];
    fewer_.y_m[fewer_.count++] = few_.y_m[i];
  }
  close(all_);
  close(few_);
  close(fewer_);
  running_ = few_.count > 0;
  next_ = 0;
  refined_ = 0;
  place_count_ = 0;
}

// Keeps the best, one of each place.
void place_search::offer(const wm_pose2 &pose, int32_t score) {
  if (place_count_ == kPlaces && score <= places_[kPlaces - 1].score) return;
  int at = place_count_;
  for (int i = 0; i < place_count_; i++)
    if (same_place(places_[i].pose, pose)) {
      if (places_[i].score >= score) return;
      at = i;
      break;
    }
  if (at == place_count_) {
    if (place_count_ < kPlaces)
      place_count_++;
    else
      at = kPlaces - 1;
  }
  for (; at > 0 && places_[at - 1].score < score; at--) places_[at] = places_[at - 1];
  places_[at] = {pose, score, 0.0};
}

void place_search::refine(const edge_map &map) {
  for (int n = 0; n < kRefinedAScan && refined_ < place_count_; n++, refined_++) {
    place &p = places_[refined_];
    (void)align_pose(map, all_.x_m, all_.y_m, all_.count, 0.4, 0.2, 5, &p.pose);
    p.explained = align_pose(map, all_.x_m, all_.y_m, all_.count, 0.2, 0.1, 4, &p.pose);
    if (!map.drivable(p.pose.x_m, p.pose.y_m)) p.explained = 0.0;
  }
}

bool place_search::step(const edge_map &map, int poses, const wm_pose2 &odom) {
  if (!running_) {
    begin(odom);
    if (!running_) return false;
  }
  const wm_raster &r = map.raster();
  const double grid_px = kGrid_m / r.resolution_m;
  const int64_t columns = (int64_t)(r.width_px / grid_px) + 1, rows = (int64_t)(r.height_px / grid_px) + 1;
  const int64_t cells = columns * rows;
  int cells_left = 20 * poses;  // a map of little floor is not swept in one go, either
  for (; next_ < cells && poses > 0 && cells_left > 0; next_++, cells_left--) {
    const int64_t column = next_ % columns, row = next_ / columns;
    wm_pose2 pose;
    map.to_map(((double)column + 0.5) * grid_px, ((double)row + 0.5) * grid_px, &pose.x_m, &pose.y_m);
    if (!map.drivable(pose.x_m, pose.y_m)) continue;
    for (int k = 0; k < kHeadings; k++) {
      pose.heading_rad = wrap(k * (kTwoPi / kHeadings));
      const sin_cos h = sincos(pose.heading_rad);
      // A quarter of the points says of most poses that it is not there.
      const int32_t first = score(map, fewer_, wide_, pose.x_m, pose.y_m, h.cos, h.sin);
      const double hoped = (double)first / fewer_.count + kHopeful / kScoreUnit;
      if (place_count_ == kPlaces && hoped * few_.count < places_[kPlaces - 1].score) continue;
      offer(pose, score(map, few_, wide_, pose.x_m, pose.y_m, h.cos, h.sin));
    }
    poses -= kHeadings;
  }
  if (next_ < cells) return false;
  refine(map);
  if (refined_ < place_count_) return false;
  // By what they explain; aligned places may have come together.
  for (int i = 1; i < place_count_; i++)
    for (int k = i; k > 0 && places_[k].explained > places_[k - 1].explained; k--) {
      const place better = places_[k];
      places_[k] = places_[k - 1];
      places_[k - 1] = better;
    }
  int kept = 0;
  for (int i = 0; i < place_count_; i++) {
    bool again = false;
    for (int k = 0; k < kept; k++) again |= same_place(places_[k].pose, places_[i].pose);
    if (!again) places_[kept++] = places_[i];
  }
  place_count_ = kept;
  running_ = false;
  return true;
}

}  // namespace wm
