// SPDX-License-Identifier: Apache-2.0
#include "aid/position.hpp"

#include "filters/core/landmark_evidence.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

// A delay is linear in the path while its sigma is less: a robot begins to drive in a tenth of a second.
constexpr double kLinearDelay_s = 0.1;

}  // namespace

int position_aid::count_states(const wm_setup &setup) {
  const wm_position_params p = position_params_of(setup);
  return (p.time_offset_sigma_s > 0.0) + 2 * (p.antenna_sigma_m != 0.0) + (p.heading_bias_sigma_rad > 0.0) +
         2 * (p.correlated_m != 0.0);
}

void position_aid::wake(planar_motion *filter) {
  is_awake_ = 1;
  const auto begin = [filter](int state, double sigma) {
    if (state >= 0) filter->forget(state, 0.0, square(sigma));
  };
  begin(time_, params_.time_offset_sigma_s);
  begin(heading_bias_, params_.heading_bias_sigma_rad);
  for (int k = 0; k < 2 && antenna_ >= 0; k++) begin(antenna_ + k, antenna_sigma_m_);
  for (int k = 0; k < 2 && error_ >= 0; k++) begin(error_ + k, params_.correlated_m);
}

void position_aid::carry_error(wm_time_ns t_ns, double position_sigma_m, planar_motion *filter) {
  if (error_ < 0) return;
  noise_adaption &noise = filter->noise();
  const receiver_error::step step = receiver_.move_to(t_ns, position_sigma_m, params_);
  const double variance = square(receiver_.sigma_m()) * noise.lasting_scale();
  if (step.is_first && params_.correlated_m < 0.0) {
    for (int k = 0; k < 2; k++) filter->forget(error_ + k, 0.0, variance);
    noise.begin_correlated(variance);
  }
  if (!(step.left < 1.0)) return;
  const double factor = step.left * receiver_.sigma_m() / step.before_m, added = variance * (1.0 - square(step.left));
  for (int k = 0; k < 2; k++) filter->fade(error_ + k, factor, added);
  noise.fade_correlated(factor, added);
  filter->turn_test().fade_correlated(factor);
  filter->wheel_test().fade_correlated(factor);
}

void position_aid::release(planar_motion *filter) const {
  if (error_ < 0 || !receiver_.is_used()) return;
  const double variance = square(receiver_.sigma_m()) * filter->noise().lasting_scale();
  for (int k = 0; k < 2; k++) filter->forget(error_ + k, 0.0, variance);
  filter->noise().begin_correlated(variance);
}

double position_aid::lasting_error(const planar_motion &filter) const {
  if (error_ < 0 || !receiver_.is_used()) return 0.0;
  const double variance = square(receiver_.sigma_m()) * filter.noise().lasting_scale();
  return std::sqrt((square(filter.value(error_)) + square(filter.value(error_ + 1))) / variance);
}

// Where the delay is uncertain, its derivatives are those of the chord over two sigmas: a robot that may have stood
// then, or driven, has neither's derivative [Julier1997].
void position_aid::widen_delay(const planar_motion &filter, view *at) const {
  past_pose &past = at->past;
  at->bend_m[0] = at->bend_m[1] = 0.0;
  if (time_ < 0) return;
  const double sigma_s = std::sqrt(filter.variance(time_)), age_s = filter.value(time_);
  if (sigma_s < kLinearDelay_s) return;
  const wm_pose2 earlier = pose_before(filter, age_s + sigma_s).pose, later = pose_before(filter, age_s - sigma_s).pose;
  past.age_by[0] = (earlier.x_m - later.x_m) / (2.0 * sigma_s);
  past.age_by[1] = (earlier.y_m - later.y_m) / (2.0 * sigma_s);
  past.age_by[2] = wrap(earlier.heading_rad - later.heading_rad) / (2.0 * sigma_s);
  at->bend_m[0] = 0.5 * (earlier.x_m + later.x_m) - past.pose.x_m;
  at->bend_m[1] = 0.5 * (earlier.y_m + later.y_m) - past.pose.y_m;
}

position_aid::view position_aid::look(const wm_position &p, planar_motion *filter) {
  has_position_ = 1;
  carry_error(filter->now_ns(), p.sigma_xy_m, filter);
  view out{pose_before(*filter, time_ < 0 ? 0.0 : filter->value(time_)), {}, {}, {}, {}};
  widen_delay(*filter, &out);
  const sin_cos h = out.h = sincos(out.past.pose.heading_rad);
  for (int i = 0; i < 2; i++) out.arm_m[i] = antenna_m_[i] + (antenna_ < 0 ? 0.0 : filter->value(antenna_ + i));
  out.off_m[0] = h.cos * out.arm_m[0] - h.sin * out.arm_m[1];
  out.off_m[1] = h.sin * out.arm_m[0] + h.cos * out.arm_m[1];
  return out;
}

// Derivatives of the antenna's x (axis 0) or y; returns what is expected there.
double position_aid::put_row(int axis, const view &at, const planar_motion &filter, planar_row *row) const {
  const bool is_x = axis == 0;
  const double by[3] = {is_x ? 1.0 : 0.0, is_x ? 0.0 : 1.0, is_x ? -at.off_m[1] : at.off_m[0]};
  add_past_pose(row, by, at.past, time_);
  double expected = (is_x ? at.past.pose.x_m : at.past.pose.y_m) + at.off_m[axis];
  if (antenna_ >= 0) {
    row->add(antenna_, is_x ? at.h.cos : at.h.sin);
    row->add(antenna_ + 1, is_x ? -at.h.sin : at.h.cos);
  }
  if (error_ >= 0) {
    row->add(error_ + axis, 1.0);
    expected += filter.value(error_ + axis);
  }
  return expected;
}

void position_aid::put_rows(const wm_position &p, const view &at, const planar_motion &filter,
                            const wm_innovation &record, residual rows[2]) const {
  const double white_m2 = square(white_sigma_m(p.sigma_xy_m, params_)) * filter.noise().scale(noise_adaption::kPlace);
  for (int k = 0; k < 2; k++) {
    residual &r = rows[k];
    r.row = {};
    r.is_position = true;
    const double expected = put_row(k, at, filter, &r.row) + at.bend_m[k];
    r.record = record;
    r.record.residual = k == 0 ? WM_RESIDUAL_X : WM_RESIDUAL_Y;
    r.record.observed = p.p_m[k];
    r.record.expected = expected;
    r.innovation = p.p_m[k] - expected;
    r.source = {noise_adaption::kPlace, white_m2};
    r.noise = white_m2 + 2.0 * square(at.bend_m[k]);
  }
}

observation position_aid::observe(const wm_position &p, const view &at, const planar_motion &filter) const {
  observation out = observation_now(filter, kPositionKey);
  out.kind = kObservedPosition;
  out.sensor = compose(out.sensor, compose(at.past.step, {at.arm_m[0], at.arm_m[1], 0.0}));
  for (int i = 0; i < 2; i++) out.place_m[i] = p.p_m[i];
  out.sigma_length_m =
      std::sqrt(square(white_sigma_m(p.sigma_xy_m, params_)) + square(correlated_sigma_m(p.sigma_xy_m, params_)));
  return out;
}

void position_aid::put_row(const wm_heading &h, const planar_motion &filter, residual *r) const {
  r->row = {};
  r->is_position = true;
  r->source = {};
  r->row.add(kHeading, 1.0);
  r->row.add(heading_bias_, 1.0);
  r->record.residual = WM_RESIDUAL_HEADING;
  r->record.observed = h.heading_rad;
  r->record.expected = wrap(filter.pose().heading_rad + bias(filter));
  r->innovation = wrap(h.heading_rad - r->record.expected);
  r->noise = square(h.sigma_rad);
}

observation position_aid::observe(const wm_heading &h, const planar_motion &filter) {
  has_heading_ = 1;
  observation out = observation_now(filter, kHeadingKey);
  out.kind = kObservedHeading;
  out.bearing_rad = wrap(h.heading_rad - bias(filter));
  out.sigma_angle_rad = std::sqrt(square(h.sigma_rad) + (heading_bias_ < 0 ? 0.0 : filter.variance(heading_bias_)));
  return out;
}

void position_aid::list(const planar_motion &filter, calibration_list *list) const {
  const auto add = [&](const char *owner, const char *name, int state, double about) {
    list->add(owner, name, about + filter.value(state), std::sqrt(filter.variance(state)));
  };
  if (time_ >= 0) add("gnss", "time_offset_s", time_, 0.0);
  static const char *const kAntenna[] = {"antenna_x_m", "antenna_y_m"};
  for (int i = 0; i < 2 && antenna_ >= 0 && receiver_.is_used(); i++)
    add("gnss", kAntenna[i], antenna_ + i, antenna_m_[i]);
  if (heading_bias_ >= 0 && has_heading_) add("heading", "bias_rad", heading_bias_, 0.0);
}

}  // namespace wm
