// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/place_search.hpp"

#include <bit>
#include <cstring>

#include "filters/edge_mcl/align.hpp"
#include "filters/edge_mcl/keep_best.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr uint64_t kKeyframesLeast = 4;
constexpr double kKeyframeWay_m = 0.4, kKeyframeTurn_rad = 0.25;
constexpr double kSameWay_m = 0.6, kSameTurn_rad = 0.3;  // places nearer than this are one
// Of 16 places of the grid as many poses as headings at each where a robot may stand, three more where all points were
// looked at. So many a sweep takes however it is computed, and with them the scans between two sweeps.
constexpr int kRestCost = 3;
constexpr double kOpen_m = 0.1, kOpenMost_m = 2.0;
constexpr double kHopeful = 0.35;  // how much better a point more may be than those before, on average

double way_between(const wm_pose2 &a, const wm_pose2 &b) {
  return std::sqrt(square(a.x_m - b.x_m) + square(a.y_m - b.y_m));
}

bool same_place(const wm_pose2 &a, const wm_pose2 &b) {
  return way_between(a, b) < kSameWay_m && std::fabs(wrap(a.heading_rad - b.heading_rad)) < kSameTurn_rad;
}

}  // namespace

void place_search::init(const edge_map &map, void *memory) {
  field_.init(map, memory);
  spent_ = 0;
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

void place_search::begin_ago(double way_m) {
  const uint64_t keyframes = (uint64_t)(way_m / kKeyframeWay_m) + kKeyframesLeast;
  if (seen_ > keyframes && seen_ - keyframes > from_) from_ = seen_ - keyframes;
  running_ = false;
}

double place_search::telling() const {
  double sum = 0.0;
  for (uint64_t n = oldest(); n < seen_; n++) sum += keyframes_[n % kKeyframes].telling;
  return sum;
}

bool place_search::see(const slack_points &scan, const wm_pose2 &odom) {
  if (scan.count < 8) return false;
  if (seen_ > 0) {
    const keyframe &last = keyframes_[(seen_ - 1) % kKeyframes];
    const double way = way_between(last.odom, odom);
    if (way < kKeyframeWay_m && std::fabs(wrap(last.odom.heading_rad - odom.heading_rad)) < kKeyframeTurn_rad)
      return false;
  }
  keyframe &k = keyframes_[seen_++ % kKeyframes];
  k.odom = odom;
  k.telling = information_weight(scan.count);
  k.count = scan.count < kPointsEach ? scan.count : kPointsEach;
  for (int i = 0; i < k.count; i++) {
    const int from = (int)((int64_t)i * scan.count / k.count);
    k.camera[i] = scan.camera[from];
    k.x_m[i] = scan.x_m[from];
    k.y_m[i] = scan.y_m[from];
    k.ray_x_m[i] = scan.ray_x_m[from];
    k.image[i] = scan.image[from];
    k.ray_y_m[i] = scan.ray_y_m[from];
    for (int e = 0; e < kSlackErrors; e++) {
      k.x_by[e][i] = scan.x_by[e][from];
      k.y_by[e][i] = scan.y_by[e][from];
    }
  }
  return true;
}

void place_search::gather(const wm_pose2 &odom, slack_points *out) const {
  out->count = 0;
  for (uint64_t n = oldest(); n < seen_; n++) {
    const keyframe &k = keyframes_[n % kKeyframes];
    const wm_pose2 from = between(odom, k.odom);
    const sin_cos h = sincos(from.heading_rad);
    for (int i = 0; i < k.count && out->count < WM_POINTS_MAX; i++) {
      const double x = (double)k.x_m[i], y = (double)k.y_m[i];
      out->camera[out->count] = k.camera[i];
      out->x_m[out->count] = (float)(from.x_m + h.cos * x - h.sin * y);
      out->y_m[out->count] = (float)(from.y_m + h.sin * x + h.cos * y);
      out->image[out->count] = k.image[i];
      const double ray_x = (double)k.ray_x_m[i], ray_y = (double)k.ray_y_m[i];
      out->ray_x_m[out->count] = (float)(h.cos * ray_x - h.sin * ray_y);
      out->ray_y_m[out->count] = (float)(h.sin * ray_x + h.cos * ray_y);
      for (int e = 0; e < kSlackErrors; e++) {
        const double by_x = (double)k.x_by[e][i], by_y = (double)k.y_by[e][i];
        out->x_by[e][out->count] = (float)(h.cos * by_x - h.sin * by_y);
        out->y_by[e][out->count] = (float)(h.sin * by_x + h.cos * by_y);
      }
      out->count++;
    }
  }
}

double place_search::explained(const edge_map &map, const wm_pose2 &odom, wm_pose2 *pose, double error[kSlackMost],
                               bool images) {
  gather(odom, &now_);
  align_place(map, now_, 2, 0.3, 0.1, 4, pose, error);
  spent_ += kWeighingCost;
  return explained_share(map, now_, 0.1, *pose, error, images);
}

void place_search::begin(const wm_pose2 &odom) {
  odom_ = odom;
  gather(odom, &all_);
  running_ = all_.count > 0;
  next_ = 0;
  refined_ = 0;
  place_count_ = 0;
}

// What is too far for the field says nothing, from anywhere; and a sweep can't move points: as long as it is not known
// how a camera sits, those that it leaves open by more than the grid does would hide where the others fit. Where too
// few are left, others are better than none. Returns how many.
int place_search::list_near(int *out) const {
  int count = 0;
  for (double open_m = kOpen_m; open_m < kOpenMost_m && count < kSweepPoints; open_m *= 2.0) {
    count = 0;
    for (int i = 0; i < all_.count; i++) {
      double open2 = 0.0;
      for (int e = 0; e < kSlackErrors; e++) open2 += square((double)all_.x_by[e][i]) + square((double)all_.y_by[e][i]);
      const double range2 = square((double)all_.x_m[i]) + square((double)all_.y_m[i]);
      if (range2 < square(field_.reach_m()) && open2 < square(open_m)) out[count++] = i;
    }
  }
  return count;
}

// Every fourth of the points comes first.
void place_search::turn_points(const edge_map &map) {
  constexpr int kStride = kSweepPoints / kFirstPoints;
  int near[WM_POINTS_MAX];
  const int all = list_near(near), count = all < kSweepPoints ? all : kSweepPoints;
  int chosen[kSweepPoints];
  some_ = first_ = 0;
  for (int phase = 0; phase < kStride; phase++) {
    for (int i = phase; i < count; i += kStride) chosen[some_++] = near[(int64_t)i * all / count];
    if (phase == 0) first_ = some_;
  }
  for (int k = 0; k < kHeadings; k++) {
    const sin_cos h = sincos(k * (kTwoPi / kHeadings) - map.raster().origin_yaw_rad);
    for (int i = 0; i < some_; i++) {
      const double x = (double)all_.x_m[chosen[i]], y = (double)all_.y_m[chosen[i]];
      steps_[k][i] = field_.step(h.cos * x - h.sin * y, -(h.sin * x + h.cos * y));
    }
  }
}

void place_search::offer(const wm_pose2 &pose, int32_t score) {
  keep_best(places_, &place_count_, {pose, score, 0.0, {}}, same_place);
}

// What the first points of a pose must come to for the rest to be looked at.
double place_search::least_first() const {
  if (place_count_ < kPlaces) return 0.0;
  return ((double)places_[kPlaces - 1].score / some_ - kHopeful / field_.unit()) * first_;
}

// Where the points fit from the places of a run, in each heading. A quarter of the points says of most poses that it is
// not there.
int place_search::look_from(const edge_map &map, int64_t run, int64_t row) {
  const uint32_t standing = field_.standing(run, row);
  if (standing == 0) return search_field::kRun;
  const ptrdiff_t corner = field_.corner_of(run, row);
  uint16_t first[kHeadings][search_field::kRun], rest[1][search_field::kRun];
  bool reached[kHeadings], more[1];
  double least = least_first();
  const int bar = least > 0.0 ? (int)least : 0;
  field_.sum_run(corner, steps_[0], kSweepPoints, kHeadings, first_, bar, first, reached);
  int cost = search_field::kRun + kHeadings * std::popcount(standing);
  for (int k = 0; k < kHeadings; k++) {
    if (!reached[k]) continue;
    field_.sum_run(corner, steps_[k] + first_, kSweepPoints, 1, some_ - first_, 0, rest, more);
    for (int i = 0; i < search_field::kRun; i++) {
      if (!(standing >> i & 1) || first[k][i] < least) continue;
      wm_pose2 pose;
      field_.place_of(map, run, row, i, &pose.x_m, &pose.y_m);
      pose.heading_rad = wrap(k * (kTwoPi / kHeadings));
      offer(pose, first[k][i] + rest[0][i]);
      cost += kRestCost;
      least = least_first();
    }
  }
  return cost;
}

int place_search::sweep(const edge_map &map, int poses) {
  constexpr int kMost = search_field::kRun * (1 + kHeadings * (1 + kRestCost));
  static_assert(kMost <= kAligningCost);
  for (; next_ < field_.runs() * field_.rows() && poses >= kMost; next_++)
    poses -= look_from(map, next_ % field_.runs(), next_ / field_.runs());
  return poses;
}

void place_search::refine(const edge_map &map, int poses) {
  for (; refined_ < place_count_ && poses >= kAligningCost; refined_++, poses -= kAligningCost) {
    place &p = places_[refined_];
    align_place(map, all_, 4, 0.4, 0.2, 5, &p.pose, p.error);
    align_place(map, all_, 2, 0.2, 0.1, 4, &p.pose, p.error);
    p.explained = 0.0;
    if (map.drivable(p.pose.x_m, p.pose.y_m)) p.explained = explained_share(map, all_, 0.1, p.pose, p.error, false);
    spent_ += kAligningCost;
  }
}

bool place_search::step(const edge_map &map, int poses, const wm_pose2 &odom) {
  if (!running_) {
    begin(odom);
    if (!running_) return false;
    turn_points(map);
  }
  if (next_ < field_.runs() * field_.rows() && first_ > 0) {
    const int left = sweep(map, poses);
    spent_ += (uint64_t)(poses - left);
    poses = left;
    if (next_ < field_.runs() * field_.rows()) return false;
  }
  refine(map, poses);
  if (refined_ < place_count_) return false;
  sort_places();
  running_ = false;
  return true;
}

// By what they explain; aligned places may have come together.
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
    for (int k = 0; k < kept; k++) again |= same_place(places_[k].pose, places_[i].pose);
    if (!again) places_[kept++] = places_[i];
  }
  place_count_ = kept;
}

}  // namespace wm
