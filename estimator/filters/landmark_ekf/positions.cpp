// SPDX-License-Identifier: Apache-2.0
// Positions (GNSS) and headings, from the event to the rows of their updates.
#include "filters/landmark_ekf/landmark_ekf.hpp"
#include "math/arc.hpp"
#include "sensors/validation.hpp"

namespace wm {
namespace {

// A false position lies anywhere in a square of this side, m. An order of magnitude, not swept: a factor of 10 is 2.3
// nats.
constexpr double kClutterPlace_m = 200.0;
// Beyond this ratio of the sigmas of two positions the second is of another solution: RTK fixed states 0.02 m, RTK
// float 0.3 m, code 3 m. One solution's sigmas differ by two from epoch to epoch, and converge over many.
constexpr double kOtherSolution = 4.0;

}  // namespace

// The receiver's time-correlated error on each axis: sigma times a Gauss-Markov process of unit variance. A receiver's
// sigma falls from tens of metres to one after its start, and the error with it. It follows the stated one with the
// process's own time constant, since receivers state sigmas that differ by a factor of two from epoch to epoch. With
// half of that time constant smartloc has 10.1 m instead of 9.6 m, with one and a half 9.5 m. Another solution has an
// error of its own, so that nothing is left of the process.
void landmark_ekf::decay_gnss_error(wm_time_ns t_ns, double stated_m) {
  if (gnss_error_state_ < 0) return;
  noise_adaption &noise = filter_.noise();
  const bool is_first = gnss_error_ns_ == WM_TIME_NONE;
  const double before_m = is_first ? stated_m : gnss_error_sigma_m_, leap = is_first ? 1.0 : stated_m / gnss_stated_m_;
  const bool is_other = leap > kOtherSolution || leap < 1.0 / kOtherSolution;
  const double left = is_first ? 1.0 : is_other ? 0.0 : decay_over(gnss_error_ns_, t_ns, params_.gnss_correlated_tau_s);
  const double sigma_m = gnss_error_sigma_m_ = stated_m + left * (before_m - stated_m);
  const double variance = square(sigma_m) * noise.scale(noise_adaption::kPlace);
  gnss_error_ns_ = t_ns;
  gnss_stated_m_ = stated_m;
  if (is_first && params_.gnss_correlated_m < 0.0) {
    for (int k = 0; k < 2; k++) filter_.forget(gnss_error_state_ + k, 0.0, variance);
    noise.begin_correlated(variance);
  }
  if (!(left < 1.0)) return;
  const double factor = left * sigma_m / before_m, added = variance * (1.0 - square(left));
  for (int k = 0; k < 2; k++) filter_.fade(gnss_error_state_ + k, factor, added);
  noise.fade_correlated(factor, added);
  filter_.turn_test().fade_correlated(factor);
}

double landmark_ekf::lasting_error() const {
  if (gnss_error_state_ < 0 || gnss_error_ns_ == WM_TIME_NONE) return 0.0;
  const double x_m = filter_.value(gnss_error_state_), y_m = filter_.value(gnss_error_state_ + 1);
  return std::sqrt(square(x_m) + square(y_m)) / gnss_error_sigma_m_;
}

wm_status landmark_ekf::fuse_position(const wm_event &event, record_list records) {
  const wm_position &p = event.as.position;
  wm_innovation record = record_of(event, WM_RESIDUAL_X);
  record.observed = p.p_m[0];
  wm_status status = check_position(p, 0, 2);
  if (status != WM_OK) return refuse(records, record, status);
  status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);
  if (!params_.use_position) return reject(records, record, WM_REJECTED_BY_CONFIG);
  double sigma = params_.gnss_sigma_factor * p.sigma_xy_m;
  if (sigma < params_.gnss_sigma_min_m) sigma = params_.gnss_sigma_min_m;
  const double correlated_m = absolute_sigma(params_.gnss_correlated_m, p.sigma_xy_m);
  decay_gnss_error(event.t_ns, correlated_m);
  const past_pose past = pose_before(filter_, gnss_time_state_ < 0 ? 0.0 : filter_.value(gnss_time_state_));
  observation seen = observation_at(event.t_ns, kPositionKey, compose(filter_.odom(), past.step));
  seen.kind = kObservedPosition;
  seen.place_m[0] = p.p_m[0];
  seen.place_m[1] = p.p_m[1];
  seen.sigma_length_m = std::sqrt(square(sigma) + square(correlated_m));
  buffer_observation(seen);
  if (life_.searching()) {
    search_now(event.t_ns);
    return reject(records, record, WM_REJECTED_SEARCHING);
  }
  residual rows[2];
  for (int k = 0; k < 2; k++) {
    residual &r = rows[k];
    const double by[3] = {k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, 0.0};
    add_past_pose(&r.row, by, past, gnss_time_state_);
    double expected = k == 0 ? past.pose.x_m : past.pose.y_m;
    if (gnss_error_state_ >= 0) {
      r.row.add(gnss_error_state_ + k, 1.0);
      expected += filter_.value(gnss_error_state_ + k);
    }
    r.record = record;
    r.record.residual = k == 0 ? WM_RESIDUAL_X : WM_RESIDUAL_Y;
    r.record.observed = p.p_m[k];
    r.record.expected = expected;
    r.innovation = p.p_m[k] - expected;
    r.noise = square(sigma) * filter_.noise().scale(noise_adaption::kPlace);
    r.source = {noise_adaption::kPlace, r.noise};
  }
  note(event.t_ns, kPositionKey, fuse(rows, 2, square(kClutterPlace_m), true, records));
  return WM_OK;
}

wm_status landmark_ekf::fuse_heading(const wm_event &event, record_list records) {
  const wm_heading &h = event.as.heading;
  residual r;
  r.record = record_of(event, WM_RESIDUAL_HEADING);
  r.record.observed = h.heading_rad;
  wm_status status = check_heading(h);
  if (status != WM_OK) return refuse(records, r.record, status);
  status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);
  if (!params_.use_heading) return reject(records, r.record, WM_REJECTED_BY_CONFIG);
  observation seen = observation_at(event.t_ns, kHeadingKey, filter_.odom());
  seen.kind = kObservedHeading;
  seen.bearing_rad = h.heading_rad;
  seen.sigma_angle_rad = h.sigma_rad;
  buffer_observation(seen);
  if (life_.searching()) {
    search_now(event.t_ns);
    return reject(records, r.record, WM_REJECTED_SEARCHING);
  }
  r.row.add(kHeading, 1.0);
  r.record.expected = filter_.pose().heading_rad;
  r.innovation = wrap(h.heading_rad - r.record.expected);
  r.noise = square(h.sigma_rad);
  note(event.t_ns, kHeadingKey, fuse(&r, 1, kTwoPi, true, records));
  return WM_OK;
}

}  // namespace wm
