// SPDX-License-Identifier: Apache-2.0
// Tracks that are no points of the state: the motion between two pictures.
#include "filters/stereo_ekf/stereo_ekf.hpp"

namespace wm {
namespace {

// Pictures farther apart are not compared: trackers lose a picture or two, not more.
constexpr double kTracksLast_s = 1.0;
// A fitted motion is refused where its normalised innovation squared is beyond the 99 % quantile of six degrees, with
// only a quarter of the noise that it is fused with: a picture repeated by the camera shows no motion at all, and all
// of its tracks agree. 12.6 (95 %) gives the same on three drives.
constexpr double kGateOfSix = 16.8, kGateNoise = 0.25;
// Of the prediction's variance as a prior, where the tracks alone shall show what most of them follow: a lorry in front
// hides the street, and those of its tracks that are near the prediction would pull the pose along.
constexpr double kFreely = 1e4;
// Evidence of another scene, in pictures: one that contradicts the prediction adds 1, one that agrees takes
// kAgrees off, since tracks of another scene agree with all six numbers by chance alone. Behind a lorry that was there
// for long, kOtherMost / kAgrees pictures have to agree before one is fused. On drives of cars with up to 90 % of the
// tracks on a lorry, 2 and 3 with 10 and 30 give errors within 15 %.
constexpr int64_t kAgrees = 3, kOtherMost = 30;
// Added to the variance of the prediction, so that it can be inverted: 1 mm and 0.03 mrad.
constexpr double kLeast_m2 = 1e-6, kLeast_rad2 = 1e-9;
constexpr double kNoGate = 1e300;

}  // namespace

pair_view stereo_ekf::pair() const {
  const stereo_rig used = rig();
  return {used.fu,         used.fv,      used.cu,       used.cv,
          used.baseline_m, sigma_px_[0], camera_axes(), used.place + filter_.head3(kCameraPlace)};
}

void stereo_ekf::add_track(const wm_stereo &seen, const wm_innovation &blank, record_list records) {
  wm_innovation record = blank;
  record.verdict = WM_REJECTED_UNKNOWN_ID;
  const bool both = !std::isnan(seen.left_px[0]) && !std::isnan(seen.right_px[0]);
  if (params_.increments && both && matches_itself(seen, &record) &&
      !tracks_.add(seen.id, seen.left_px[0], seen.left_px[0] - seen.right_px[0],
                   0.5 * (seen.left_px[1] + seen.right_px[1])))
    record.verdict = WM_REJECTED_GATE;
  records.add(record);
}

// Derivatives of the measured motion by the states: its own error, and the pair's scale s and turn a, by which the
// way c is measured as (1 + s) c + a x c. Columns of states that are off stay 0.
void stereo_ekf::view_increment(increment_view *out) const {
  const vec3 &way = filter_.moved().p;
  out->by.setZero();
  out->columns = 0;
  const auto add = [&](int state, int width) {
    for (int i = 0; i < width; i++) out->index[out->columns++] = state + i;
    return out->columns - width;
  };
  for (int i = 0, first = add(filter_.at(kMovedPlace), kError); i < kError; i++) out->by(i, first + i) = 1.0;
  if (filter_.at(kPictureScale) >= 0) {
    const int column = add(filter_.at(kPictureScale), 1);
    for (int i = 0; i < 3; i++) out->by(i, column) = way[i];
  }
  if (filter_.at(kPictureDirection) >= 0) {
    const mat3 turned = -1.0 * skew(way);
    const int column = add(filter_.at(kPictureDirection), 3);
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) out->by(i, column + j) = turned.m[i][j];
  }
}

// Variance of the predicted motion as the tracks measure it.
auto stereo_ekf::predicted_variance(const increment_view &at) const -> matrix<kError> {
  matrix<kError> out = matrix<kError>::Zero();
  for (int a = 0; a < at.columns; a++)
    for (int b = 0; b < at.columns; b++)
      out += filter_.covariance(at.index[a], at.index[b]) * at.by.col(a) * at.by.col(b).transpose();
  for (int i = 0; i < kError; i++) out(i, i) += i < 3 ? kLeast_m2 : kLeast_rad2;
  return out;
}

// Whether the motion that the tracks show fits the predicted one.
bool stereo_ekf::shows_scene(const matrix<kError> &predicted, const motion_error &seen) {
  const vector<kError> left = map(seen.value);
  factor<kError> gate;
  vector<kError> weighted = left;
  if (!gate.init(predicted + kGateNoise * map(seen.covariance))) return false;
  gate.solve(&weighted);
  const bool fits = left.dot(weighted) < kGateOfSix;
  if (!fits && other_scene_ < kOtherMost) other_scene_++;
  return fits;
}

// The motion since the picture before, by the tracks of both, as six rows with the factor of their covariance taken
// out. False: it is unknown, contradicts the prediction, or pictures did so until now.
bool stereo_ekf::increment_rows(const pair_view &view, row_block out[2]) {
  increment_view at;
  view_increment(&at);
  const matrix<kError> predicted = predicted_variance(at);
  motion_error seen;
  matrix<kError> root;
  if (!tracks_.fit(view, filter_.moved(), kFreely * predicted, &seen) || !shows_scene(predicted, seen)) return false;
  if (!tracks_.fit(view, filter_.moved(), predicted, &seen) || !shows_scene(predicted, seen)) return false;
  tracks_.count_misses();
  other_scene_ = other_scene_ > kAgrees ? other_scene_ - kAgrees : 0;
  if (other_scene_ > 0 || !cholesky<kError>(map(seen.covariance), &root)) return false;
  vector<kError> left = map(seen.value);
  for (int i = 0; i < kError; i++) {  // L^-1
    for (int k = 0; k < i; k++) {
      left[i] -= root(i, k) * left[k];
      at.by.row(i) -= root(i, k) * at.by.row(k);
    }
    left[i] /= root(i, i);
    at.by.row(i) /= root(i, i);
    row_block &block = out[i / 3];
    if (i % 3 == 0)
      for (int c = 0; c < at.columns; c++) (void)block.add_columns(at.index[c], 1);
    const int row = block.add_row(WM_RESIDUAL_PIXEL, left[i], left[i], 1.0);
    for (int c = 0; c < at.columns; c++) block.by[row][c] = at.by(i, c);
  }
  return true;
}

void stereo_ekf::fuse_increment() {
  const pair_view view = pair();
  const bool follows = last_picture_ns_ != WM_TIME_NONE &&
                       wm_seconds_between(last_picture_ns_, picture_ns_) < kTracksLast_s && !life_.searching();
  row_block rows[2];
  if (follows && increment_rows(view, rows)) {
    const gates none = {kNoGate, kNoGate};
    for (const row_block &block : rows) (void)filter_.fuse(block, none);
    filter_.settle();
  }
  tracks_.close(view, filter_.moved());
  filter_.begin_increment();
  last_picture_ns_ = picture_ns_;
}

}  // namespace wm
