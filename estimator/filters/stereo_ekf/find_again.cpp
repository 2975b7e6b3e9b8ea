// SPDX-License-Identifier: Apache-2.0
// The own map in use: points are found again by their appearance, and relate the pose to a key frame: after a loop,
// after a restart, or when the vehicle was carried away.
#include <cstring>

#include "filters/core/recovery.hpp"
#include "filters/stereo_ekf/stereo_ekf.hpp"
#include "math/eigen.hpp"

namespace wm {
namespace {

// A key frame is made when the cameras moved by this share of the distance to their points, or turned so far: half of
// the points are still in view. Not swept.
constexpr double kFrameApart = 0.3, kFrameApart_rad = 0.3;
constexpr int kFrameFewest = 8;  // points in view, for a key frame
// Corners of a key frame in the left camera, in shares of the points' mean distance: about their half of the view.
constexpr double kCorner[own_map::kCorners][2] = {{-0.3, -0.2}, {0.3, -0.2}, {0.0, 0.35}};
// A clone has no noise of its own; this keeps its covariance positive: 0.1 mm.
constexpr double kClone_m2 = 1e-8;
// A detector finds a corner again to so much of a pixel in each look: it chooses among whole pixels of half the size,
// from another pose. Tracks of one corner are therefore not of exactly one point.
constexpr double kCornerAgain_px = 1.5;
// A point is kept that was followed so long: then its place is known better than by one picture.
constexpr double kFollowed_s = 0.3;

// Distance from the expected place within which a point is looked for: so many sigmas, and what one picture leaves
// open.
constexpr double kReach = 3.5, kReach_m = 0.1;
constexpr double kEverywhere_m = 1e9, kEverywhereEach_s = 0.5;
// Points that are looked for in the whole map at a time. It bounds the time of a search; it was not swept.
constexpr int kSearchedMost = 48;
// With three of four matches wrong, one triple in 64 is right: of 300 triples one is, with a probability of 99 %.
constexpr int kHypotheses = 300;
// A pose is taken when fewer than 1e-6 such are expected by chance, and so many points agree on it.
constexpr double kLogChance = -13.8;
constexpr int kFewest = 8;
// Share of wrong matches that agree with a wrong pose: the area of agreement over that of the search, within bounds.
constexpr double kShareLeast = 0.02, kShareMost = 0.99, kAgree_sigmas = 3.4;
// Two searches of the whole map within this time that contradict the pose and agree with each other: it was wrong.
constexpr double kTwice_s = 3.0;
// Sigmas of a pose that was found, before its points are fused: far above theirs, and small enough to be linear.
constexpr double kFound_m = 0.3, kFound_rad = 0.1;
constexpr double kNoGate = 1e300;

pose3 composed(const pose3 &a, const pose3 &b) { return {a.p + matrix_of(a.q) * b.p, normalized(a.q * b.q)}; }

pose3 inverted(const pose3 &a) {
  const quat q = conjugate(a.q);
  return {-1.0 * (matrix_of(q) * a.p), q};
}

void put_block(row_block *block, int column, const mat3 &m) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) block->by[i][column + j] = m.m[i][j];
}

mat3 symmetric_of(const double v[6]) { return {{{v[0], v[1], v[2]}, {v[1], v[3], v[4]}, {v[2], v[4], v[5]}}}; }

double trace(const mat3 &a) { return a.m[0][0] + a.m[1][1] + a.m[2][2]; }

}  // namespace

// Of each coordinate of a point's place, by the corner that a detector finds again at this distance.
double stereo_ekf::corner_variance(double depth_m) const { return square(kCornerAgain_px * depth_m / rig_.fu); }

// A point of the present picture, with its place in the body by this picture alone.
void stereo_ekf::look(const wm_stereo &seen) {
  const double px[4] = {seen.left_px[0], seen.left_px[1], seen.right_px[0], seen.right_px[1]};
  vec3 x;
  double by[3][4], variance = 0.0;
  wm_innovation unused{};
  if (map_.capacity() == 0 || looked_count_ == kLookedMost || !has_appearance(seen.appearance)) return;
  if (std::isnan(px[0]) || std::isnan(px[2]) || !rig_.triangulate(px, kDisparityLeast_px, &x, by)) return;
  if (!matches_itself(seen, &unused)) return;
  for (const auto &row : by)
    for (int k = 0; k < 4; k++) variance += square(row[k] * sigma_px_[k]);
  variance += 2.0 * corner_variance(x.z);
  looked_[(size_t)looked_count_++] = {seen, rig_.place + filter_.head3(kCameraPlace) + camera_axes() * x,
                                      std::sqrt(variance), -1};
}

void stereo_ekf::note_appearance(int slot, const wm_stereo &seen) {
  std::memcpy(info_[(size_t)slot].seen_as, seen.appearance, sizeof seen.appearance);
}

frame_triangle stereo_ekf::triangle_of(int frame) const {
  frame_triangle out;
  for (int c = 0; c < own_map::kCorners; c++) out.corner[c] = filter_.point(find_slot(corner_id(frame, c)));
  return out;
}

// Columns of a frame's corners, by which the place of `coordinates` in it moves.
void stereo_ekf::triangle_block(int frame, const vec3 &coordinates, row_block *out) const {
  mat3 by[own_map::kCorners];
  corner_derivatives(triangle_of(frame), coordinates, by);
  out->rows = 3;
  for (int c = 0; c < own_map::kCorners; c++)
    put_block(out, out->add_columns(filter_.point_state(find_slot(corner_id(frame, c))), 3), by[c]);
}

mat3 stereo_ekf::covariance_by(const row_block &block) const {
  mat3 out{};
  for (int a = 0; a < block.columns; a++)
    for (int b = 0; b < block.columns; b++) {
      const double value = filter_.covariance(block.index[a], block.index[b]);
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) out.m[i][j] += block.by[i][a] * value * block.by[j][b];
    }
  return out;
}

// A point of the state as one of its key frame. Its error against the frame is that of its own measurement, since the
// pose's is the frame's, too; what little they have in common with the rest is left out. False: it has no frame, or was
// hardly seen.
bool stereo_ekf::map_point_of(int slot, own_point *out) const {
  const point_info &info = info_[(size_t)slot];
  if (info.id < 0 || info.frame < 0 || wm_seconds_between(info.begun_ns, info.seen_ns) < kFollowed_s) return false;
  const auto frame = (int)info.frame;
  std::memcpy(out->appearance, info.kept_as, sizeof info.kept_as);
  out->at = in_triangle(triangle_of(frame), filter_.point(slot));
  row_block block;
  triangle_block(frame, out->at, &block);
  put_block(&block, block.add_columns(filter_.point_state(slot), 3), -1.0 * kIdentity3);
  const mat3 noise = covariance_by(block);
  for (int i = 0, k = 0; i < 3; i++)
    for (int j = i; j < 3; j++, k++) out->noise[k] = noise.m[i][j] + (i == j ? kClone_m2 : 0.0);
  return finite(out->at) && finite(trace(noise));
}

// A point leaves the state; the own map keeps it where it is good enough.
void stereo_ekf::leave_point(int slot) {
  own_point kept;
  if (map_.capacity() > 0 && life_.tracking() && info_[(size_t)slot].misfit_ns != picture_ns_ &&
      map_point_of(slot, &kept))
    (void)map_.add((int)info_[(size_t)slot].frame, kept);
  remove_point(slot);
}

// How far from its expected place a point of each frame may be: by the covariance of a point that is seen now against
// the same place carried along by the frame. (Of two places apart it would have the heading of the whole scene in it.)
void stereo_ekf::bound_reach(double *reach_m) const {
  int reference = -1;
  for (int slot = 0; slot < filter_.point_count() && reference < 0; slot++)
    if (info_[(size_t)slot].id >= 0 && info_[(size_t)slot].seen_ns == picture_ns_) reference = slot;
  const vec3 there = reference >= 0 ? filter_.point(reference) : vec3{0, 0, 0};
  for (int f = 0; f < map_.capacity(); f++) {
    reach_m[f] = 0.0;
    if (!map_.is_used(f) || reference < 0) continue;
    row_block block;
    triangle_block(f, in_triangle(triangle_of(f), there), &block);
    put_block(&block, block.add_columns(filter_.point_state(reference), 3), -1.0 * kIdentity3);
    reach_m[f] = kReach * std::sqrt(trace(covariance_by(block))) + kReach_m;
  }
}

// The place of a point by the state, which all pictures of its track determine. False: it was found again already, or
// was not followed for long enough.
bool stereo_ekf::take_filtered(const past_pose &past, looked_point *look) const {
  const int slot = find_slot(look->seen.id);
  if (slot < 0) return false;
  const point_info &info = info_[(size_t)slot];
  if (info.frame == kFoundAgain || wm_seconds_between(info.begun_ns, info.seen_ns) < kFollowed_s) return false;
  point_view view = view_point(filter_.point(slot), past);
  put_block(&view.by, view.by.add_columns(filter_.point_state(slot), 3), view.A);
  look->in_body = transposed_times(past.R, filter_.point(slot) - past.at.p);
  look->sigma_m = std::sqrt(trace(covariance_by(view.by)) / 3.0 + 2.0 * corner_variance(view.x.z));
  return true;
}

// Matches the points of this picture with the map's, near where they are expected or anywhere. Returns the sum of the
// agreeing areas over the searched ones: the share of wrong matches that agree by chance.
double stereo_ekf::match(bool everywhere, matched_points *out) {
  double reach_m[kFramesMost];
  const past_pose past = state_at_picture();
  if (everywhere)
    for (double &reach : reach_m) reach = kEverywhere_m;
  else
    bound_reach(reach_m);
  map_.place_points([this](int frame) { return triangle_of(frame); });
  double share = 0.0;
  vec3 low = {kEverywhere_m, kEverywhere_m, kEverywhere_m}, high = -1.0 * low;
  const int64_t each = everywhere ? 1 + (looked_count_ - 1) / kSearchedMost : 1;
  for (int64_t i = 0; i < looked_count_; i++) {
    looked_point &look = looked_[(size_t)i];
    look.found = -1;
    if (i % each != 0) continue;
    if (life_.tracking() && !take_filtered(past, &look)) continue;
    look.found = map_.find(look.seen.appearance, past.at.p + past.R * look.in_body, reach_m);
    if (look.found < 0) continue;
    const auto number = (int)look.found;
    const int frame = own_map::frame_of(number), point = own_map::index_of(number);
    const vec3 &place = map_.place_of(frame, point);
    const double variance = square(look.sigma_m) + trace(symmetric_of(map_.point(frame, point).noise)) / 3.0;
    share += square(kAgree_sigmas) * variance / square(reach_m[frame]);
    for (int k = 0; k < 3; k++) {
      low[k] = place[k] < low[k] ? place[k] : low[k];
      high[k] = place[k] > high[k] ? place[k] : high[k];
    }
    out->from[out->count] = look.in_body;
    out->to[out->count] = place;
    out->weight[out->count] = 1.0 / variance;
    out->id[out->count++] = look.found;
  }
  if (out->count == 0) return kShareMost;
  share /= out->count;
  const vec3 spread = high - low;
  if (everywhere) share *= square(kEverywhere_m) / (0.25 * dot(spread, spread) + square(kReach_m));
  return share < kShareLeast ? kShareLeast : share > kShareMost ? kShareMost : share;
}

// Drops the matches that do not agree; returns how many points of the state are left.
int stereo_ekf::keep_agreeing(const matched_points &all, const pose3 &at) {
  int left = 0, k = 0;
  for (int64_t i = 0; i < looked_count_; i++) {
    looked_point &look = looked_[(size_t)i];
    if (look.found < 0) continue;
    if (agrees(all, k++, at))
      left++;
    else
      look.found = -1;
  }
  return left;
}

// The difference of a point of the state and its own point of the map is zero but for that one's noise: three rows.
bool stereo_ekf::fuse_match(const looked_point &looked, const gates &limits) {
  const int slot = find_slot(looked.seen.id), number = (int)looked.found, frame = own_map::frame_of(number);
  if (slot < 0) return false;
  const own_point &known = map_.point(frame, own_map::index_of(number));
  const vec3 left = filter_.point(slot) - out_of_triangle(triangle_of(frame), known.at);
  row_block block;
  triangle_block(frame, known.at, &block);
  put_block(&block, block.add_columns(filter_.point_state(slot), 3), -1.0 * kIdentity3);
  block.rows = 0;
  matrix<3> root;
  mat3 noise = symmetric_of(known.noise);
  const double corner = 2.0 * corner_variance(in_camera(filter_.point(slot), state_at_picture()).z);
  for (int i = 0; i < 3; i++) noise.m[i][i] += corner;
  if (!cholesky<3>(map(noise.m), &root)) return false;
  double by[3][row_block::kColumns], whitened[3];
  for (int i = 0; i < 3; i++) {
    whitened[i] = left[i];
    for (int c = 0; c < block.columns; c++) by[i][c] = block.by[i][c];
    for (int k = 0; k < i; k++) {
      whitened[i] -= root(i, k) * whitened[k];
      for (int c = 0; c < block.columns; c++) by[i][c] -= root(i, k) * by[k][c];
    }
    whitened[i] /= root(i, i);
    for (int c = 0; c < block.columns; c++) by[i][c] /= root(i, i);
    const int row = block.add_row(WM_RESIDUAL_PIXEL, whitened[i], whitened[i], 1.0);
    for (int c = 0; c < block.columns; c++) block.by[row][c] = by[i][c];
  }
  if (!filter_.fuse(block, limits).fused) return false;
  info_[(size_t)slot].frame = kFoundAgain;
  map_.frame(frame).used_ns = now_ns_;
  return true;
}

int stereo_ekf::fuse_matches(const gates &limits) {
  int fused = 0;
  for (int64_t i = 0; i < looked_count_; i++)
    if (looked_[(size_t)i].found >= 0 && fuse_match(looked_[(size_t)i], limits)) fused++;
  filter_.settle();
  if (fused > 0) life_.fused(now_ns_);
  return fused;
}

// The pose by points of the map alone: all points of the state begin anew at it.
void stereo_ekf::begin_again(const pose3 &body_at_picture) {
  const pose3 since = composed(inverted(state_at_picture().at), filter_.nominal());
  set_pose(composed(body_at_picture, since), kFound_m, kFound_rad);
  for (int64_t i = 0; i < looked_count_; i++) {
    size_t none = 0;
    add_point(looked_[(size_t)i].seen, wm_innovation{}, record_list{nullptr, 0, &none});
  }
  (void)fuse_matches({kNoGate, kNoGate});
  filter_.restart_transient();
  evidence_.begin(kFoundWrong);
  life_.relocalized(now_ns_);
  elsewhere_ns_ = WM_TIME_NONE;
}

// True: points were found again, and agree with the pose as far as that is known.
bool stereo_ekf::close_loop(bool everywhere) {
  matched_points all;
  const double share = match(everywhere, &all);
  const agreed_pose best = pose_of_most(all, kHypotheses, setup_->seed);
  if (best.inliers < kFewest || !(log_by_chance(best.inliers, all.count, share) < kLogChance)) return false;
  const int agreeing = keep_agreeing(all, best.at);
  if (2 * fuse_matches(limits()) >= agreeing) {
    elsewhere_ns_ = WM_TIME_NONE;
    return true;
  }
  if (!everywhere) return false;
  const bool twice = elsewhere_ns_ != WM_TIME_NONE && wm_seconds_between(elsewhere_ns_, now_ns_) < kTwice_s;
  elsewhere_ns_ = now_ns_;
  if (twice) begin_again(best.at);
  return twice;
}

void stereo_ekf::search_map() {
  if (!params_.recover || map_.frames() == 0 || !life_.search_due(now_ns_) || looked_count_ < kFewest) return;
  life_.searched(now_ns_);
  matched_points all;
  const double share = match(true, &all);
  const agreed_pose best = pose_of_most(all, kHypotheses, setup_->seed);
  if (best.inliers < kFewest || !(log_by_chance(best.inliers, all.count, share) < kLogChance)) return;
  (void)keep_agreeing(all, best.at);
  begin_again(best.at);
}

void stereo_ekf::find_again() {
  if (!life_.tracking()) return search_map();
  if (map_.frames() == 0 || looked_count_ == 0 || close_loop(false) || !params_.recover) return;
  if (everywhere_ns_ != WM_TIME_NONE && wm_seconds_between(everywhere_ns_, now_ns_) < kEverywhereEach_s) return;
  everywhere_ns_ = now_ns_;
  (void)close_loop(true);
}

// A key frame where the view is new.
void stereo_ekf::extend_map() {
  if (!life_.tracking()) return;
  const past_pose past = state_at_picture();
  int in_view = 0, again = 0;
  double depth_m = 0.0;
  for (int slot = 0; slot < filter_.point_count(); slot++) {
    const point_info &info = info_[(size_t)slot];
    if (info.id < 0 || info.unseen == kOfMap || info.seen_ns != picture_ns_) continue;
    in_view++;
    again += info.frame == kFoundAgain;
    depth_m += in_camera(filter_.point(slot), past).z;
  }
  if (in_view < kFrameFewest) return;
  depth_m /= in_view;
  const pose3 &now = filter_.nominal();
  const bool is_apart = frame_ns_ == WM_TIME_NONE || length(now.p - frame_pose_.p) > kFrameApart * depth_m ||
                        length(turn_of(now.q * conjugate(frame_pose_.q))) > kFrameApart_rad;
  const bool is_known = 3 * again >= in_view;
  if (!is_known && !is_apart) return;
  frame_pose_ = now;
  frame_ns_ = now_ns_;
  if (!is_known) begin_frame(map_.oldest(), depth_m);
}

void stereo_ekf::begin_frame(int frame, double depth_m) {
  forget_frame(frame);
  const past_pose past = state_at_picture();
  mat3 noise{};
  for (int i = 0; i < 3; i++) noise.m[i][i] = kClone_m2;
  for (int c = 0; c < own_map::kCorners; c++) {
    const vec3 x = depth_m * vec3{kCorner[c][0], kCorner[c][1], 1.0};
    const vec3 place = past.at.p + past.R * (rig_.place + filter_.head3(kCameraPlace) + camera_axes() * x);
    const point_view view = view_point(place, past);
    const int slot = filter_.point_count();
    filter_.add_point(place, view.by, view.A, noise);
    info_[(size_t)slot] = {now_ns_, now_ns_, WM_TIME_NONE, corner_id(frame, c), kOfMap, kNoFrame, {}, {}};
  }
  map_.begin(frame, now_ns_);
  for (int slot = 0; slot < filter_.point_count(); slot++) {
    point_info &info = info_[(size_t)slot];
    if (info.id < 0 || info.unseen == kOfMap || info.seen_ns != picture_ns_ || info.frame != kNoFrame) continue;
    if (!has_appearance(info.seen_as)) continue;
    info.frame = frame;
    std::memcpy(info.kept_as, info.seen_as, sizeof info.kept_as);
  }
}

void stereo_ekf::forget_frame(int frame) {
  if (!map_.is_used(frame)) return;
  for (int c = 0; c < own_map::kCorners; c++) remove_point(find_slot(corner_id(frame, c)));
  for (int slot = 0; slot < filter_.point_count(); slot++)
    if (info_[(size_t)slot].frame == frame) info_[(size_t)slot].frame = kNoFrame;
  map_.remove(frame);
}

void stereo_ekf::forget_map() {
  filter_.settle();
  for (int f = 0; f < map_.capacity(); f++) forget_frame(f);
  looked_count_ = 0;
  frame_ns_ = everywhere_ns_ = elsewhere_ns_ = WM_TIME_NONE;
}

}  // namespace wm
