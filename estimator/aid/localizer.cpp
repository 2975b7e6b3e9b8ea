// SPDX-License-Identifier: Apache-2.0
#include "aid/localizer.hpp"

#include <initializer_list>

#include "filters/core/gate.hpp"
#include "math/arc.hpp"
#include "math/cholesky.hpp"

namespace wm {
namespace {

constexpr double kFullWeight_s = 0.3;   // as of landmarks: evidence nearer in time counts in part
constexpr double kHazard_per_s = 1e-3;  // that a localizer which was right becomes wrong
// 99.9 % for two numbers. There is no soft gate: it would follow a localizer that stands still.
constexpr double kGate = 13.8;
constexpr double kNear = 2.0;       // sigmas of a localizer's own error within which it is right again
constexpr double kFollows_s = 5.0;  // time constant with which the error of a wrong one is followed
constexpr double kMostBayes = 4.0;  // nats of a pose of full weight: one in fifty is wrong by chance

// The ellipse of the place: variances along its axes, and the direction of the first.
void put_ellipse(const double covariance[6], localizer_aid::view *out) {
  const double xx = covariance[0], xy = covariance[1], yy = covariance[2];
  const double middle = 0.5 * (xx + yy), off = std::sqrt(square(0.5 * (xx - yy)) + square(xy));
  const sin_cos h = sincos(0.5 * atan2(2.0 * xy, xx - yy));
  out->axis[0] = h.cos;
  out->axis[1] = h.sin;
  out->variance[0] = middle + off;
  out->variance[1] = middle - off;
  out->variance[2] = covariance[5];
}

}  // namespace

bool localizer_aid::look(const wm_localized &seen, planar_motion *filter, view *out) {
  const bool has_heading = finite(seen.heading_rad);
  const wm_pose2 now = {seen.p_m[0], seen.p_m[1], has_heading ? wrap(seen.heading_rad) : 0.0};
  const wm_time_ns t_ns = filter->now_ns();
  const double dt_s = is_used() ? wm_seconds_between(newest_ns_, t_ns) : 0.0;
  out->past = pose_before(*filter, 0.0);
  out->there = now;
  out->rows = has_heading ? 3 : 2;
  out->weight = !is_used() || dt_s > kFullWeight_s ? 1.0 : dt_s / kFullWeight_s;
  out->follows = dt_s < kFollows_s ? dt_s / kFollows_s : 1.0;
  out->is_new = kept_ns_ == WM_TIME_NONE || !(wm_seconds_between(kept_ns_, t_ns) < kFullWeight_s);
  if (out->is_new) kept_ns_ = t_ns;
  const double xy = square(params_.sigma_xy_m), heading = square(params_.sigma_heading_rad);
  const double by_default[6] = {xy, 0.0, xy, 0.0, 0.0, heading};
  const double *stated = is_in_map() && finite(seen.covariance[0]) ? seen.covariance : by_default;
  put_ellipse(stated, out);
  wrong_.add_hazard(kHazard_per_s * dt_s);
  if (is_wrong_) distrusted_s_ += dt_s;
  newest_ns_ = t_ns;
  if (is_in_map()) {
    const double mean = 0.5 * (stated[0] + stated[2]), variance[3] = {mean, mean, stated[5]};
    carry_error(dt_s, variance, filter);
    return true;
  }
  const bool is_other = has_begun_ && finite(seen.reset) && seen.reset != reset_;
  reset_ = seen.reset;
  if (!has_begun_ || is_other || is_wrong_) return begin_frame(now, *out, filter);
  carry_frame(now, filter);
  out->there = {filter->value(first_), filter->value(first_ + 1), wrap(filter->value(first_ + 2))};
  return true;
}

// A Gauss-Markov process of each number, whose variance goes to a multiple of the stated one.
void localizer_aid::carry_error(double dt_s, const double stated[3], planar_motion *filter) {
  if (first_ < 0) return;
  const double left = exp(-dt_s / params_.lasting_s);
  for (int k = 0; k < kStates; k++) {
    const double now = square(params_.lasting) * stated[k];
    if (has_begun_) {
      filter->fade(first_ + k, left, (1.0 - square(left)) * now);
      lasting_variance_[k] = square(left) * lasting_variance_[k] + (1.0 - square(left)) * now;
    } else {
      filter->forget(first_ + k, 0.0, now);
      lasting_variance_[k] = now;
    }
  }
  has_begun_ = 1;
}

// Its place in the map is the robot's own.
bool localizer_aid::begin_frame(const wm_pose2 &now, const view &at, planar_motion *filter) {
  planar_row rows[kStates];
  double noise[kStates][kStates] = {}, values[kStates] = {at.past.pose.x_m, at.past.pose.y_m, at.past.pose.heading_rad};
  for (int k = 0; k < kStates; k++) {
    const double by[3] = {k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
    add_past_pose(&rows[k], by, at.past, -1);
    noise[k][k] = at.variance[k];
  }
  filter->assign(first_, kStates, rows, noise[0], kStates, values);
  jumps_ += is_wrong_;
  release();
  has_begun_ = 1;
  newest_ = now;
  return false;
}

// Its frame drifts with the way.
void localizer_aid::carry_frame(const wm_pose2 &now, planar_motion *filter) {
  const wm_pose2 step = between(newest_, now),
                 at = {filter->value(first_), filter->value(first_ + 1), filter->value(first_ + 2)};
  const wm_pose2 then = compose(at, step);
  const double way_m = std::sqrt(square(step.x_m) + square(step.y_m));
  planar_row rows[kStates];
  double noise[kStates][kStates] = {}, values[kStates] = {then.x_m, then.y_m, at.heading_rad + step.heading_rad};
  const double turned[2] = {at.y_m - then.y_m, then.x_m - at.x_m};
  for (int k = 0; k < kStates; k++) {
    rows[k].add(first_ + k, 1.0);
    if (k < 2) rows[k].add(first_ + 2, turned[k]);
    noise[k][k] = way_m * square(k < 2 ? params_.drift_m : params_.drift_heading_rad);
  }
  filter->assign(first_, kStates, rows, noise[0], kStates, values);
  newest_ = now;
}

void localizer_aid::put_rows(const view &at, const planar_motion &filter, const wm_innovation &record,
                             residual rows[kRows]) const {
  const wm_pose2 &past = at.past.pose;
  double expected[3] = {past.x_m, past.y_m, past.heading_rad};
  for (int i = 0; i < kStates && is_in_map() && first_ >= 0; i++) expected[i] += filter.value(first_ + i);
  const double off[3] = {at.there.x_m - expected[0], at.there.y_m - expected[1],
                         wrap(at.there.heading_rad - expected[2])};
  const double along[3][3] = {{at.axis[0], at.axis[1], 0.0}, {-at.axis[1], at.axis[0], 0.0}, {0.0, 0.0, 1.0}};
  static constexpr wm_residual kKinds[] = {WM_RESIDUAL_X, WM_RESIDUAL_Y, WM_RESIDUAL_HEADING};
  for (int k = 0; k < at.rows; k++) {
    residual &r = rows[k];
    r.row = {};
    r.source = {};
    add_past_pose(&r.row, along[k], at.past, -1);
    for (int i = 0; i < kStates && first_ >= 0; i++) r.row.add(first_ + i, is_in_map() ? along[k][i] : -along[k][i]);
    r.innovation = product(along[k], off);
    r.noise = at.variance[k];
    r.record = record;
    r.record.residual = static_cast<uint8_t>(kKinds[k]);
    r.record.expected = expected[k];
    r.record.observed = expected[k] + r.innovation;
  }
}

observation localizer_aid::observe(const view &at, const planar_motion &filter) const {
  observation out = observation_now(filter, kLocalizerKey);
  out.kind = kObservedPosition;
  out.place_m[0] = at.there.x_m;
  out.place_m[1] = at.there.y_m;
  out.sigma_length_m = std::sqrt(at.variance[0]);
  return out;
}

observation localizer_aid::observe_heading(const view &at, const planar_motion &filter) const {
  observation out = observation_now(filter, kLocalizerKey);
  out.kind = kObservedHeading;
  out.bearing_rad = at.there.heading_rad;
  out.sigma_angle_rad = std::sqrt(at.variance[2]);
  return out;
}

// Log density of the rows less `off`, whose sigmas beside the pose's are `wider` times as large; *nis: of the rows.
double localizer_aid::log_density(const view &at, const residual rows[kRows], const double off[kRows], double wider,
                                  const planar_motion &filter, double *nis) const {
  double s[kRows][kRows], r[kRows], out = 0.0;
  *nis = INFINITY;
  for (int i = 0; i < at.rows; i++) {
    for (int j = 0; j <= i; j++) s[i][j] = filter.covariance_of(rows[i].row, rows[j].row);
    s[i][i] += rows[i].noise + (square(wider) - 1.0) * own_variance(i, rows[i]);
    r[i] = rows[i].innovation - off[i];
  }
  if (!factorize(at.rows, s[0], kRows)) return -INFINITY;
  substitute_forward(at.rows, s[0], kRows, r);
  *nis = 0.0;
  for (int i = 0; i < at.rows; i++) {
    out -= 0.5 * (square(r[i]) + log(kTwoPi)) + log(s[i][i]);
    *nis += square(r[i]);
  }
  return out;
}

// Of a wrong localizer the error is several times as large as stated, or its pose is anywhere. One that is known to be
// wrong is still off by as much, until it is near: while the robot's own pose becomes vague, any pose would fit.
double localizer_aid::log_bayes_of_wrong(const view &at, const residual rows[kRows], const planar_motion &filter,
                                         double *nis) {
  constexpr double kNone[kRows] = {};
  double unused;
  const double right = log_density(at, rows, kNone, 1.0, filter, nis), anywhere = -log(at.clutter_volume());
  const double still = is_wrong_ ? log_density(at, rows, off_, 1.0, filter, &unused)
                                 : log_density(at, rows, kNone, kWider, filter, &unused);
  bool is_near = true;
  for (int i = 0; i < at.rows; i++) {
    is_near = is_near && square(rows[i].innovation) < square(kNear) * (rows[i].noise + own_variance(i, rows[i]));
    if (!is_wrong_ || still > right) off_[i] += (is_wrong_ ? at.follows : 1.0) * (rows[i].innovation - off_[i]);
  }
  if (is_wrong_ && is_near) return -kMostBayes;
  const double wrong = still > anywhere ? still : anywhere, of = wrong - right;
  return of > kMostBayes ? kMostBayes : of < -kMostBayes ? -kMostBayes : of;
}

// Its error in map is far beyond what its poses state.
bool localizer_aid::has_drifted_off(planar_motion *filter) {
  const wm_time_ns now = filter->now_ns();
  if (!is_in_map() || first_ < 0) return false;
  if (checked_ns_ != WM_TIME_NONE && wm_seconds_between(checked_ns_, now) < kCheckEvery_s) return false;
  checked_ns_ = now;
  stated_prior prior{kStates, {}, {}, {}, kWider};
  for (int k = 0; k < kStates; k++) {
    prior.state[k] = first_ + k;
    prior.root[k][k] = std::sqrt(lasting_variance_[k]);
  }
  if (!filter->take_blunder(prior)) return false;
  for (int k = 0; k < kStates; k++) filter->forget(first_ + k, 0.0, lasting_variance_[k]);
  return true;
}

bool localizer_aid::is_trusted(const view &at, const residual rows[kRows], planar_motion *filter) {
  double nis;
  wrong_.add(at.weight * log_bayes_of_wrong(at, rows, *filter, &nis));
  if (wrong_.value() < kRight) wrong_.reset(kRight);
  if (!is_wrong_ && has_drifted_off(filter)) wrong_.set(kMaxLogOdds);
  if (wrong_.value() > kWrong) is_wrong_ = 1;
  if (wrong_.value() < kRightAgain) is_wrong_ = 0;
  return !is_wrong_ && nis <= kGate * gate_scale(at.rows);
}

void localizer_aid::list(calibration_list *list) const {
  if (!is_used()) return;
  list->add("localizer", "distrusted_s", distrusted_s_, 0.0);
  if (is_wrong_) list->alarm(WM_ALARM_LOCALIZER, wrong_.probability());
  if (!is_in_map()) list->add("localizer", "jumps", static_cast<double>(jumps_), 0.0);
}

}  // namespace wm
