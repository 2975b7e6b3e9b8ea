// SPDX-License-Identifier: Apache-2.0
// Points found on the way: added, kept while they help, removed.
#include <cstring>
#include <limits>

#include "filters/stereo_ekf/stereo_ekf.hpp"

namespace wm {
namespace {

// Margin from the picture's edge within which a point need not be found: half of a detector's patch. Not swept.
constexpr double kInside_px = 8.0;

}  // namespace

int stereo_ekf::find_slot(int32_t id) const {
  const int count = filter_.point_count();
  for (int i = 0; i < count; i++)
    if (info_[(size_t)i].id == id) return i;
  return -1;
}

void stereo_ekf::begin_picture(wm_time_ns t_ns) {
  if (picture_ns_ == t_ns) return;
  picture_ns_ = t_ns;
  looked_count_ = 0;
  motion_.begin_picture();
}

void stereo_ekf::end_picture() {
  if (picture_ns_ == WM_TIME_NONE) return;
  filter_.settle();
  if (map_.capacity() > 0) find_again();
  leave_points();
  if (map_.capacity() > 0) extend_map();
  if (params_.increments) fuse_increment();
  picture_ns_ = WM_TIME_NONE;
}

// [BorisovND] removes a point out of view at once, and keeps one that was missed for some steps. Here a point out of
// view is kept for a while, too: the vehicle may return.
void stereo_ekf::leave_points() {
  if (filter_.point_count() == 0) return;
  const past_pose past = state_at_picture();
  for (int slot = filter_.point_count() - 1; slot >= 0; slot--) {
    point_info &point = info_[(size_t)slot];
    if (point.unseen == kOfMap) continue;
    const vec3 x = in_camera(filter_.point(slot), past);
    if (point.seen_ns == picture_ns_) {
      if (grows_fast(x.z)) leave_point(slot);
      continue;
    }
    // A point whose observations are outliers has a wrong place, in view or not.
    if (point.misfit_ns == picture_ns_ || rig_.in_view(x, kInside_px)) {
      if (++point.unseen > params_.keep_unseen_steps) leave_point(slot);
    } else if (wm_seconds_between(point.seen_ns, picture_ns_) > params_.keep_outside_s) {
      leave_point(slot);
    }
  }
}

void stereo_ekf::remove_point(int slot) {
  const int last = filter_.point_count() - 1;
  filter_.remove_point(slot);
  info_[(size_t)slot] = info_[(size_t)last];
}

// All but the corners of key frames.
void stereo_ekf::forget_points() {
  filter_.settle();
  if (map_.frames() == 0) return filter_.remove_points();
  for (int slot = filter_.point_count() - 1; slot >= 0; slot--)
    if (info_[(size_t)slot].id >= 0) remove_point(slot);
}

// The found point that was not seen for longest, which may be removed; points of the present picture stay. -1: none.
int stereo_ekf::oldest_point() const {
  int oldest = -1;
  for (int i = 0; i < filter_.point_count(); i++)
    if (info_[(size_t)i].unseen != kOfMap && info_[(size_t)i].seen_ns != picture_ns_ &&
        (oldest < 0 || info_[(size_t)i].seen_ns < info_[(size_t)oldest].seen_ns))
      oldest = i;
  return oldest;
}

// Points that the state may still take beside the corners of key frames.
int stereo_ekf::free_slots() const {
  return params_.points_max + own_map::kCorners * map_.frames() - filter_.point_count();
}

bool stereo_ekf::has_room() const { return free_slots() > 0 || oldest_point() >= 0; }

bool stereo_ekf::make_room() {
  if (free_slots() > 0) return true;
  const int oldest = oldest_point();
  if (oldest < 0) return false;
  remove_point(oldest);
  return true;
}

// The error of a known point on the map is constant: it is a state where there is capacity. -1: none.
int stereo_ekf::slot_of_known(int landmark) {
  const wm_landmark &known = setup_->landmarks[landmark];
  const double sigma = map_sigma(known);
  if (params_.points_max == 0 || !(sigma > 0.0)) return -1;
  const int found = find_slot(known.id);
  if (found >= 0) return found;
  if (!make_room()) return -1;
  const int slot = filter_.point_count();
  filter_.add_point(vec_of(known.p_m), sigma);
  info_[(size_t)slot] = {now_ns_, now_ns_, WM_TIME_NONE, known.id, kOfMap, kNoFrame, {}, {}};
  return slot;
}

// Left and right of a rectified pair lie in one row; otherwise the match is wrong.
bool stereo_ekf::matches_itself(const wm_stereo &seen, wm_innovation *record) const {
  record->observed = seen.left_px[1] - seen.right_px[1];
  record->variance = square(sigma_px_[1]) + square(sigma_px_[3]);
  record->nis = square(record->observed) / record->variance;
  record->gate = params_.gate_soft;
  record->verdict = record->nis > params_.gate_soft ? WM_REJECTED_GATE : WM_FUSED;
  return record->verdict == WM_FUSED;
}

bool stereo_ekf::grows_fast(double depth_m) const {
  return params_.increments && !(length(filter_.moved().p) < kGrowthMost * depth_m);
}

bool stereo_ekf::is_landmark(const wm_stereo &seen) const {
  if (params_.points_max == 0 || (params_.increments && !has_room())) return false;
  if (!params_.increments) return true;
  const double disparity = seen.left_px[0] - seen.right_px[0];
  const double growth = length(filter_.moved().p) * disparity / (rig_.fu * rig_.baseline_m);
  const double variance = square(sigma_px_[0]) + square(sigma_px_[2]) + 2.0 * square(kDrift_px * growth);
  return disparity > std::sqrt(variance) / kNearShare && growth < kGrowthMost;
}

void stereo_ekf::add_point(const wm_stereo &seen, const wm_innovation &blank, record_list records) {
  wm_innovation record = blank;
  const double px[4] = {seen.left_px[0], seen.left_px[1], seen.right_px[0], seen.right_px[1]};
  vec3 x;
  double by[3][4];
  if (std::isnan(px[0]) || std::isnan(px[2]) || !rig().triangulate(px, kDisparityLeast_px, &x, by)) {
    record.verdict = WM_REJECTED_UNKNOWN_ID;
    records.add(record);
    return;
  }
  if (!matches_itself(seen, &record)) {
    records.add(record);
    return;
  }
  if (!make_room()) {
    record.verdict = WM_REJECTED_NO_ASSOCIATION;
    records.add(record);
    return;
  }
  mat3 noise;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      noise.m[i][j] = 0.0;
      for (int k = 0; k < 4; k++) noise.m[i][j] += by[i][k] * by[j][k] * square(sigma_px_[k]);
    }
  const past_pose past = state_at_picture();
  const vec3 place = past.at.p + past.R * (rig_.place + filter_.head3(kCameraPlace) + camera_axes() * x);
  point_view view = view_point(place, past);
  add_lens_columns(x, &view.by);
  const int slot = filter_.point_count();
  filter_.add_point(place, view.by, view.A, noise);
  info_[(size_t)slot] = {picture_ns_, picture_ns_, WM_TIME_NONE, seen.id, 0, kNoFrame, {}, {}};
  note_appearance(slot, seen);
  record.verdict = WM_FUSED;
  records.add(record);
}

// An observation that is an outlier for the point with its number. A point of one observation begins again with the
// newer one: either may be the wrong match, and the next observation decides. (Otherwise a point that began with a
// wrong match stays far off and out of view, and rejects every later observation.)
void stereo_ekf::contradict_point(int slot, const wm_stereo &seen, const wm_innovation &blank, record_list records) {
  info_[(size_t)slot].misfit_ns = picture_ns_;
  if (info_[(size_t)slot].seen_ns != info_[(size_t)slot].begun_ns) return;
  remove_point(slot);
  add_point(seen, blank, records);
}

size_t stereo_ekf::list_landmarks(wm_landmark *out, double (*covariance)[4], size_t capacity) const {
  const auto slots = (size_t)filter_.point_count();
  size_t count = 0;
  for (size_t slot = 0; slot < slots; slot++) {
    if (info_[slot].id < 0) continue;
    const size_t i = count++;
    if (i >= capacity) continue;
    const int state = filter_.point_state((int)slot);
    const vec3 place = filter_.point((int)slot) + filter_.pending(state);
    std::memset(&out[i], 0, sizeof out[i]);
    out[i].id = info_[slot].id;
    for (int k = 0; k < 3; k++) out[i].p_m[k] = place[k];
    out[i].sigma_m =
        std::sqrt((filter_.variance(state) + filter_.variance(state + 1) + filter_.variance(state + 2)) / 3.0);
    out[i].yaw_rad = std::numeric_limits<double>::quiet_NaN();
    if (!covariance) continue;
    covariance[i][0] = filter_.covariance(state, state);
    covariance[i][1] = filter_.covariance(state, state + 1);
    covariance[i][2] = filter_.covariance(state + 1, state + 1);
    covariance[i][3] = std::nan("");
  }
  return count;
}

}  // namespace wm
