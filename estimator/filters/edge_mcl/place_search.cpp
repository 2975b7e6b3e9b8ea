// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/place_search.hpp"

namespace wm {
namespace {

constexpr uint64_t kKeyframesLeast = 4;                    // 1.6 m: one keyframe fits anywhere; not swept
constexpr double kKeyframe_m = 0.4, kKeyframe_rad = 0.25;  // from one keyframe to the next; not swept
constexpr int kPointsMin = 8;                              // of a keyframe: fewer leave a pose open
// Points whose place the mounting's uncertainty leaves open by more than this are left out of the sweep, whose places
// can't move them: half a grid step. Where too few remain, twice that, up to the maximum.
constexpr double kOpen_m = 0.1, kOpenMax_m = 2.0;
constexpr double kHopeful = 0.35;  // nats by which a further point may be better than the mean of the first; not swept
constexpr double kGate_m = 0.3,
                 kExplained_m = 0.1;  // of points that are aligned; that are explained: half of the sweep's sigma

}  // namespace

void place_search::init(const edge_map &map, void *memory) {
  field_.init(map, memory);
  spent_ = 0;
  clear();
}

void place_search::clear() {
  seen_ = marked_ = from_ = 0;
  sweep_.stop();
  place_count_ = 0;
}

void place_search::begin_at_mark() {
  from_ = marked_;
  sweep_.stop();
}

void place_search::begin_ago(double way_m) {
  const uint64_t keyframes = (uint64_t)(way_m / kKeyframe_m) + kKeyframesLeast;
  if (seen_ > keyframes && seen_ - keyframes > from_) from_ = seen_ - keyframes;
  sweep_.stop();
}

double place_search::information() const {
  double sum = 0.0;
  for (uint64_t n = oldest(); n < seen_; n++) sum += keyframes_[n % kKeyframes].information;
  return sum;
}

bool place_search::add_keyframe(const floor_points &scan, const wm_pose2 &odom) {
  if (scan.count < kPointsMin) return false;
  if (seen_ > 0 && same_pose(keyframes_[(seen_ - 1) % kKeyframes].odom, odom, kKeyframe_m, kKeyframe_rad)) return false;
  keyframe &k = keyframes_[seen_++ % kKeyframes];
  k.odom = odom;
  k.information = information_weight(scan.count);
  k.count = take_evenly(scan.of, scan.count, kPointsEach, k.of);
  return true;
}

// Points of all keyframes in base_link at `odom`.
void place_search::gather(const wm_pose2 &odom, floor_points *out) const {
  out->count = 0;
  for (uint64_t n = oldest(); n < seen_; n++) {
    const keyframe &k = keyframes_[n % kKeyframes];
    const wm_pose2 from = between(odom, k.odom);
    const sin_cos h = sincos(from.heading_rad);
    for (int i = 0; i < k.count && out->count < WM_POINTS_MAX; i++) out->of[out->count++] = moved(k.of[i], from, h);
  }
}

double place_search::explained(const edge_map &map, const wm_pose2 &odom, wm_pose2 *pose, double error[kMountingAll],
                               bool reflections) {
  gather(odom, &now_);
  align_place(map, now_, 2, kGate_m, kExplained_m, 4, pose, error);
  spent_ += kWeighingCost;
  return explained_share(map, now_, kExplained_m, *pose, error, reflections);
}

// Points within the field's reach whose place is known well enough for the grid. Returns how many.
int place_search::list_sure_points(int *out) const {
  int count = 0;
  for (double open_m = kOpen_m; open_m < kOpenMax_m && count < kSweepPoints; open_m *= 2.0) {
    count = 0;
    for (int i = 0; i < all_.count; i++) {
      const floor_edge &p = all_.of[i];
      double open2 = 0.0;
      for (int e = 0; e < kMountingErrors; e++) open2 += square((double)p.x_by[e]) + square((double)p.y_by[e]);
      const double range2 = square((double)p.x_m) + square((double)p.y_m);
      if (range2 < square(field_.reach_m()) && open2 < square(open_m)) out[count++] = i;
    }
  }
  return count;
}

// Every fourth of the sweep's points comes first.
void place_search::begin(const edge_map &map, const wm_pose2 &odom) {
  constexpr int kStride = kSweepPoints / kFirstPoints;
  odom_ = odom;
  gather(odom, &all_);
  refined_ = 0;
  place_count_ = 0;
  if (all_.count == 0) return;
  sweep_.begin(kHeadings, kHopeful / field_.unit());
  for (int k = 0; k < kHeadings; k++) sweep_.set_heading(k, k * (kTwoPi / kHeadings));
  int sure[WM_POINTS_MAX];
  const int all = list_sure_points(sure), count = all < kSweepPoints ? all : kSweepPoints;
  for (int phase = 0; phase < kStride; phase++) {
    for (int i = phase; i < count; i += kStride) {
      const floor_edge &p = all_.of[sure[(int64_t)i * all / count]];
      sweep_.add_point(field_, map.raster().origin_yaw_rad, (double)p.x_m, (double)p.y_m);
    }
    if (phase == 0) sweep_.set_first(sweep_.points());
  }
}

void place_search::refine(const edge_map &map, int poses) {
  for (; refined_ < sweep_.count() && poses >= kAligningCost; refined_++, poses -= kAligningCost) {
    place &p = places_[place_count_++] = {sweep_[refined_].pose, 0.0, {}};
    align_place(map, all_, 4, 0.4, 2.0 * kExplained_m, 5, &p.pose, p.error);
    align_place(map, all_, 2, 0.2, kExplained_m, 4, &p.pose, p.error);
    if (map.drivable(p.pose.x_m, p.pose.y_m))
      p.explained = explained_share(map, all_, kExplained_m, p.pose, p.error, false);
    spent_ += kAligningCost;
  }
}

bool place_search::step(const edge_map &map, int poses, const wm_pose2 &odom) {
  if (!sweep_.running()) begin(map, odom);
  if (!sweep_.running()) return false;
  if (!sweep_.swept()) {
    const int left = sweep_.step(map, field_, poses);
    spent_ += (uint64_t)(poses - left);
    poses = left;
    if (!sweep_.swept()) return false;
  }
  refine(map, poses);
  if (refined_ < sweep_.count()) return false;
  sort_places();
  sweep_.stop();
  return true;
}

// By `explained`, the largest first; of aligned places that have become one the first.
void place_search::sort_places() {
  for (int i = 1; i < place_count_; i++)
    for (int k = i; k > 0 && places_[k].explained > places_[k - 1].explained; k--) {
      const place better = places_[k];
      places_[k] = places_[k - 1];
      places_[k - 1] = better;
    }
  int kept = 0;
  for (int i = 0; i < place_count_; i++) {
    bool again = false;
    for (int k = 0; k < kept; k++) again |= same_pose(places_[k].pose, places_[i].pose, kSweepApart_m, kSweepApart_rad);
    if (!again) places_[kept++] = places_[i];
  }
  place_count_ = kept;
}

}  // namespace wm
