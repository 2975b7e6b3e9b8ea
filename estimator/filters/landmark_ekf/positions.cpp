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
// A delay is linear in the way while its sigma is less: a robot begins to drive in a tenth of a second. Not swept.
constexpr double kLinearDelay_s = 0.1;

}  // namespace

void landmark_ekf::decay_gnss_error(wm_time_ns t_ns, double position_sigma_m) {
  if (gnss_error_state_ < 0) return;
  noise_adaption &noise = filter_.noise();
  const receiver_error::step step = receiver_.move_to(t_ns, position_sigma_m, params_.gnss);
  const double variance = square(receiver_.sigma_m()) * noise.scale(noise_adaption::kPlace);
  if (step.is_first && params_.gnss.correlated_m < 0.0) {
    for (int k = 0; k < 2; k++) filter_.forget(gnss_error_state_ + k, 0.0, variance);
    noise.begin_correlated(variance);
  }
  if (!(step.left < 1.0)) return;
  const double factor = step.left * receiver_.sigma_m() / step.before_m, added = variance * (1.0 - square(step.left));
  for (int k = 0; k < 2; k++) filter_.fade(gnss_error_state_ + k, factor, added);
  noise.fade_correlated(factor, added);
  filter_.turn_test().fade_correlated(factor);
}

double landmark_ekf::lasting_error() const {
  if (gnss_error_state_ < 0 || !receiver_.is_used()) return 0.0;
  const double x_m = filter_.value(gnss_error_state_), y_m = filter_.value(gnss_error_state_ + 1);
  return std::sqrt(square(x_m) + square(y_m)) / receiver_.sigma_m();
}

landmark_ekf::antenna_view landmark_ekf::view_antenna(const past_pose &past) const {
  const sin_cos h = sincos(past.pose.heading_rad);
  antenna_view out = {h, {antenna_m_[0], antenna_m_[1]}, {0.0, 0.0}};
  for (int i = 0; i < 2 && antenna_state_ >= 0; i++) out.arm_m[i] += filter_.value(antenna_state_ + i);
  out.off_m[0] = h.cos * out.arm_m[0] - h.sin * out.arm_m[1];
  out.off_m[1] = h.sin * out.arm_m[0] + h.cos * out.arm_m[1];
  return out;
}

// Derivatives of the antenna's x (axis 0) or y; returns what is expected there.
double landmark_ekf::position_row(int axis, const past_pose &past, const antenna_view &antenna, planar_row *row) const {
  const bool is_x = axis == 0;
  const double by[3] = {is_x ? 1.0 : 0.0, is_x ? 0.0 : 1.0, is_x ? -antenna.off_m[1] : antenna.off_m[0]};
  add_past_pose(row, by, past, gnss_time_state_);
  double expected = (is_x ? past.pose.x_m : past.pose.y_m) + antenna.off_m[axis];
  if (antenna_state_ >= 0) {
    row->add(antenna_state_, is_x ? antenna.h.cos : antenna.h.sin);
    row->add(antenna_state_ + 1, is_x ? -antenna.h.sin : antenna.h.cos);
  }
  if (gnss_error_state_ >= 0) {
    row->add(gnss_error_state_ + axis, 1.0);
    expected += filter_.value(gnss_error_state_ + axis);
  }
  return expected;
}

// Where the delay is uncertain, its derivatives are those of the chord over two sigmas: a robot that may have stood
// then, or driven, has neither's derivative [Julier1997]. bend_m: by how much the chord's middle is off the way. Before
// the first motion datum the robot is taken to have moved as it does by that one: taken to have stood, its first
// positions would be exact, and determine a delay that cannot be separated from the place of the antenna.
void landmark_ekf::widen_delay(past_pose *past, double bend_m[2]) const {
  bend_m[0] = bend_m[1] = 0.0;
  if (gnss_time_state_ < 0) return;
  const double sigma_s = std::sqrt(filter_.variance(gnss_time_state_)), age_s = filter_.value(gnss_time_state_);
  const wm_time_ns now = filter_.now_ns();
  if (sigma_s < kLinearDelay_s) return;
  if (!filter_.is_path_known(now - wm_ns_from_seconds(age_s + sigma_s))) {
    motion_twist ahead{};
    (void)filter_.path(now, now + 1, &ahead);
    put_age(filter_.steady(ahead), sincos(past->pose.heading_rad), past->age_by);
    return;
  }
  const wm_pose2 earlier = pose_before(filter_, age_s + sigma_s).pose,
                 later = pose_before(filter_, age_s - sigma_s).pose;
  past->age_by[0] = (earlier.x_m - later.x_m) / (2.0 * sigma_s);
  past->age_by[1] = (earlier.y_m - later.y_m) / (2.0 * sigma_s);
  past->age_by[2] = wrap(earlier.heading_rad - later.heading_rad) / (2.0 * sigma_s);
  bend_m[0] = 0.5 * (earlier.x_m + later.x_m) - past->pose.x_m;
  bend_m[1] = 0.5 * (earlier.y_m + later.y_m) - past->pose.y_m;
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
  const double sigma = white_sigma_m(p.sigma_xy_m, params_.gnss);
  const double correlated_m = correlated_sigma_m(p.sigma_xy_m, params_.gnss);
  decay_gnss_error(event.t_ns, p.sigma_xy_m);
  past_pose past = pose_before(filter_, gnss_time_state_ < 0 ? 0.0 : filter_.value(gnss_time_state_));
  double bend_m[2];
  widen_delay(&past, bend_m);
  const antenna_view antenna = view_antenna(past);
  const wm_pose2 antenna_step = compose(past.step, {antenna.arm_m[0], antenna.arm_m[1], 0.0});
  observation seen = observation_at(event.t_ns, kPositionKey, compose(filter_.odom(), antenna_step));
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
    const double expected = position_row(k, past, antenna, &r.row) + bend_m[k];
    r.record = record;
    r.record.residual = k == 0 ? WM_RESIDUAL_X : WM_RESIDUAL_Y;
    r.record.observed = p.p_m[k];
    r.record.expected = expected;
    r.innovation = p.p_m[k] - expected;
    r.noise = square(sigma) * filter_.noise().scale(noise_adaption::kPlace);
    r.source = {noise_adaption::kPlace, r.noise};
    r.noise += 2.0 * square(bend_m[k]);
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
  has_heading_ = 1;
  const double bias_rad = heading_state_ < 0 ? 0.0 : filter_.value(heading_state_);
  seen.bearing_rad = wrap(h.heading_rad - bias_rad);
  seen.sigma_angle_rad = std::sqrt(square(h.sigma_rad) + (heading_state_ < 0 ? 0.0 : filter_.variance(heading_state_)));
  buffer_observation(seen);
  if (life_.searching()) {
    search_now(event.t_ns);
    return reject(records, r.record, WM_REJECTED_SEARCHING);
  }
  r.row.add(kHeading, 1.0);
  if (heading_state_ >= 0) r.row.add(heading_state_, 1.0);
  r.record.expected = wrap(filter_.pose().heading_rad + bias_rad);
  r.innovation = wrap(h.heading_rad - r.record.expected);
  r.noise = square(h.sigma_rad);
  note(event.t_ns, kHeadingKey, fuse(&r, 1, kTwoPi, true, records));
  return WM_OK;
}

}  // namespace wm
