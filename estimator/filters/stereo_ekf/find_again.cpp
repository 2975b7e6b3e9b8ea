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
// Where the pose is less certain than this the whole map is searched, in cycles: near searches must stay cheap.
constexpr double kNearMost_m = 1.0;
constexpr double kEverywhereEach_s = 0.5;
// With three of four matches wrong, one triple in 64 is right: of 300 triples one is, with a probability of 99 %.
constexpr int kHypotheses = 300;
// A pose is taken when fewer than 1e-6 such are expected by chance, and so many points agree on it.
constexpr double kLogChance = -13.8;
constexpr int kFewest = 8;
// Two searches of the whole map within this time that contradict the pose: it was wrong.
// A search of 200 key frames may take some seconds.
constexpr double kTwice_s = 10.0;
// Of one pose: a corner of a key frame is so far from where the pose expects it, or nearer. The quantile of chi2 with
// three degrees of freedom that is exceeded with a probability of 1e-6, as kLogChance.
constexpr double kOtherPose = 30.66;
// A larger turn is not corrected linearly: half of its square is 5 mm at one metre, the error of one match.
constexpr double kLinear_rad = 0.1;
// Sigmas of a pose that was found, before its points are fused: far above theirs, and so many times the key frame's own
// at least: what is known of the pose is then known from the frame alone, but for 1 %.
constexpr double kFound_m = 0.3, kFound_rad = 0.1, kWeak = 10.0;
// Distance within which the points of a later picture lie from where a pose that was found expects them.
constexpr double kConfirm_m = 0.3;
constexpr double kNoGate = 1e300;
// Matches of one picture that are fused: each costs as much as a point of the picture. The others' turn is the next
// picture, in which they are found again.
constexpr int kFusedMost = 12;

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
  if (std::isnan(px[0]) || std::isnan(px[2]) || !rig().triangulate(px, kDisparityLeast_px, &x, by)) return;
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
    if (reach_m[f] > kNearMost_m) reach_m[f] = 0.0;
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

// Matches the points of this picture with the map's that lie near where `body` expects them. Returns the mean of the
// agreeing areas over the searched ones: the share of wrong matches that agree by chance.
double stereo_ekf::match(const pose3 &body, const double *reach_m, matched_points *out) {
  const past_pose past = state_at_picture();
  const mat3 r = matrix_of(body.q);
  map_.place_points([this](int frame) { return triangle_of(frame); });
  double share = 0.0;
  for (int64_t i = 0; i < looked_count_; i++) {
    looked_point &look = looked_[(size_t)i];
    look.found = -1;
    if (life_.tracking() && !take_filtered(past, &look)) continue;
    look.found = map_.find(look.seen.appearance, body.p + r * look.in_body, reach_m);
    if (look.found < 0) continue;
    const auto number = (int)look.found;
    const int frame = own_map::frame_of(number), point = own_map::index_of(number);
    const double variance = square(look.sigma_m) + trace_of(map_.point(frame, point).noise) / 3.0;
    const double by_chance = square(kAgree_sigmas) * variance / square(reach_m[frame]);
    share += by_chance < kShareMost ? by_chance : kShareMost;
    out->from[out->count] = look.in_body;
    out->to[out->count] = map_.place_of(frame, point);
    out->weight[out->count] = 1.0 / variance;
    out->id[out->count++] = look.found;
  }
  if (out->count == 0) return kShareMost;
  share /= out->count;
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
  int fused = 0, tried = 0;
  for (int64_t i = 0; i < looked_count_; i++) {
    looked_point &look = looked_[(size_t)i];
    if (look.found < 0) continue;
    if (tried++ == kFusedMost) break;
    if (fuse_match(look, limits)) fused++;
  }
  filter_.settle();
  if (fused > 0) life_.fused(now_ns_);
  return fused;
}

// The frame to which most of the agreeing points belong; -1: none.
int stereo_ekf::agreeing_frame() const {
  int points[kFramesMost] = {}, most = -1;
  for (int64_t i = 0; i < looked_count_; i++) {
    if (looked_[(size_t)i].found < 0) continue;
    const int frame = own_map::frame_of((int)looked_[(size_t)i].found);
    points[frame]++;
    if (most < 0 || points[frame] > points[most]) most = frame;
  }
  return most;
}

// Whether a pose that was found by points of `frame` is the state's own, as far as that is known: the corners of the
// frame lie where the state expects them in the camera. `noise_m2`: of the found pose.
bool stereo_ekf::is_expected(const pose3 &body_at_picture, int frame, double noise_m2) const {
  const past_pose past = state_at_picture();
  past_pose found = past;
  found.at = body_at_picture;
  found.R = matrix_of(body_at_picture.q);
  for (int c = 0; c < own_map::kCorners; c++) {
    const int slot = find_slot(corner_id(frame, c));
    const vec3 corner = filter_.point(slot), off = in_camera(corner, found) - in_camera(corner, past);
    point_view view = view_point(corner, past);
    put_block(&view.by, view.by.add_columns(filter_.point_state(slot), 3), view.A);
    mat3 covariance = covariance_by(view.by);
    for (int i = 0; i < 3; i++) covariance.m[i][i] += noise_m2 + kClone_m2;
    matrix<3> inverse;
    if (!invert_positive<3>(map(covariance.m), &inverse)) return false;
    double chi2 = 0.0;
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) chi2 += off[i] * inverse(i, j) * off[j];
    if (!(chi2 < kOtherPose)) return false;
  }
  return true;
}

// Sigmas of a pose before it is fused with points of `frame`: so weak that it adds nothing to them.
void stereo_ekf::weak_prior(int frame, double *sigma_m, double *sigma_rad) const {
  const frame_triangle at = triangle_of(frame);
  double place_m2 = 0.0, turn_rad2 = 0.0;
  const int first = filter_.point_state(find_slot(corner_id(frame, 0)));
  for (int c = 0; c < own_map::kCorners; c++) {
    const int state = filter_.point_state(find_slot(corner_id(frame, c)));
    double own = 0.0, apart = 0.0;
    for (int i = 0; i < 3; i++) {
      own += filter_.variance(state + i);
      apart +=
          filter_.variance(state + i) + filter_.variance(first + i) - 2.0 * filter_.covariance(state + i, first + i);
    }
    const vec3 side = at.corner[c] - at.corner[0];
    if (own > place_m2) place_m2 = own;
    if (c > 0 && apart / dot(side, side) > turn_rad2) turn_rad2 = apart / dot(side, side);
  }
  *sigma_m = kWeak * std::sqrt(place_m2);
  *sigma_rad = kWeak * std::sqrt(turn_rad2);
  if (*sigma_m < kFound_m) *sigma_m = kFound_m;
  if (*sigma_rad < kFound_rad) *sigma_rad = kFound_rad;
}

// The pose by points of the map alone: all points of the state begin anew at it.
void stereo_ekf::begin_again(const pose3 &body_at_picture, int frame) {
  const pose3 since = composed(inverted(state_at_picture().at), filter_.nominal());
  double sigma_m, sigma_rad;
  weak_prior(frame, &sigma_m, &sigma_rad);
  set_pose(composed(body_at_picture, since), sigma_m, sigma_rad);
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

// The pose by points of the map near where `body` expects them, and what follows of it. `elsewhere`: the search of the
// whole map found `body`; its agreement was not by chance, and most of this picture's points must confirm it. True: the
// pose was used.
bool stereo_ekf::close_loop(const pose3 &body, const double *reach_m, bool elsewhere) {
  matched_points all;
  const double share = match(body, reach_m, &all);
  const agreed_pose best = pose_of_most(all, kHypotheses, setup_->seed);
  const bool is_real =
      elsewhere ? 2 * best.inliers > all.count : log_by_chance(best.inliers, all.count, share) < kLogChance;
  if (best.inliers < kFewest || !is_real) return false;
  const int agreeing = keep_agreeing(all, best.at), frame = agreeing_frame();
  if (!life_.tracking()) {
    begin_again(best.at, frame);
    return true;
  }
  double weight = 0.0;
  for (int i = 0; i < all.count; i++)
    if (agrees(all, i, best.at)) weight += all.weight[i];
  if (is_expected(best.at, frame, 3.0 / weight)) {
    const bool linear = length(turn_of(best.at.q * conjugate(state_at_picture().at.q))) < kLinear_rad;
    if (!linear) begin_again(best.at, frame);
    if (!linear || 2 * fuse_matches(limits()) >= (agreeing < kFusedMost ? agreeing : kFusedMost)) {
      elsewhere_ns_ = WM_TIME_NONE;
      return true;
    }
  }
  if (!elsewhere) return false;
  const bool twice = elsewhere_ns_ != WM_TIME_NONE && wm_seconds_between(elsewhere_ns_, now_ns_) < kTwice_s;
  elsewhere_ns_ = now_ns_;
  if (twice) begin_again(best.at, frame);
  return twice;
}

// For points of the present picture, spread over it.
void stereo_ekf::begin_search() {
  const past_pose past = state_at_picture();
  map_search &search = search_[0];
  const int64_t each = 1 + (looked_count_ - 1) / map_search::kPointsMost;
  search.begin(odometry_.pose);
  for (int64_t i = 0; i < looked_count_; i += each) {
    looked_point &look = looked_[(size_t)i];
    if (!life_.tracking() || take_filtered(past, &look)) search.add(look.seen.appearance, look.in_body, look.sigma_m);
  }
  if (search.points() < kFewest) search.cancel();
  if (!life_.tracking()) life_.searched(now_ns_);
  everywhere_ns_ = now_ns_;
}

// A cycle's share of a search; its end is a pose, or none.
void stereo_ekf::search_on() {
  map_search &search = search_[0];
  if (search.is_idle() || !search.step(map_)) return;
  matched_points all;
  const auto place = [this](int frame, int point) {
    return out_of_triangle(triangle_of(frame), map_.point(frame, point).at);
  };
  const double share = search.matches(map_, place, &all);
  const agreed_pose best = pose_of_most(all, kHypotheses, setup_->seed);
  if (best.inliers < kFewest || !(log_by_chance(best.inliers, all.count, share) < kLogChance))
    search.cancel();
  else
    search.found(best.at);
}

// At the end of a picture.
void stereo_ekf::find_again() {
  if (map_.frames() == 0 || looked_count_ == 0) return;
  map_search &search = search_[0];
  double reach_m[kFramesMost];
  if (life_.tracking()) {
    bound_reach(reach_m);
    if (close_loop(state_at_picture().at, reach_m, false)) return search.cancel();
  }
  if (!params_.recover || looked_count_ < kFewest) return;
  if (search.has_pose()) {
    for (double &reach : reach_m) reach = kConfirm_m;
    (void)close_loop(search.pose(odometry_.pose), reach_m, true);
    return search.cancel();
  }
  const bool due = life_.tracking() ? everywhere_ns_ == WM_TIME_NONE ||
                                          wm_seconds_between(everywhere_ns_, now_ns_) >= kEverywhereEach_s
                                    : life_.search_due(now_ns_);
  if (search.is_idle() && due) begin_search();
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
  if (map_.capacity() > 0) search_[0].cancel();
  frame_ns_ = everywhere_ns_ = elsewhere_ns_ = WM_TIME_NONE;
}

}  // namespace wm
