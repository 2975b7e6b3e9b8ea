// SPDX-License-Identifier: Apache-2.0
#include "aid/position.hpp"

#include "filters/core/landmark_evidence.hpp"
#include "math/arc.hpp"
#include "math/cholesky.hpp"

namespace wm {
namespace {

// Half of the least time over which a delay's derivative is taken: a robot begins to drive in a tenth of a second.
constexpr double kLeastChord_s = 0.1;
// Half width of a held speed's dead band, in sigmas of the noise that its chord leaves.
constexpr double kHeldSigmas = 3.0;

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
  const double variance = square(receiver_.sigma_m()) * noise.scale(noise_adaption::kPlace);
  if (step.is_first && params_.correlated_m < 0.0) {
    for (int k = 0; k < 2; k++) filter->forget(error_ + k, 0.0, variance);
    noise.begin_correlated(variance);
  }
  if (!(step.left < 1.0)) return;
  const double factor = step.left * receiver_.sigma_m() / step.before_m, added = variance * (1.0 - square(step.left));
  for (int k = 0; k < 2; k++) filter->fade(error_ + k, factor, added);
  noise.fade_correlated(factor, added);
  filter->turn_test().fade_correlated(factor);
}

void position_aid::release(planar_motion *filter) const {
  if (error_ < 0 || !receiver_.is_used()) return;
  const double variance = square(receiver_.sigma_m()) * filter->noise().scale(noise_adaption::kPlace);
  for (int k = 0; k < 2; k++) filter->forget(error_ + k, 0.0, variance);
  filter->noise().begin_correlated(variance);
}

double position_aid::lasting_error(const planar_motion &filter) const {
  if (error_ < 0 || !receiver_.is_used()) return 0.0;
  return std::sqrt(square(filter.value(error_)) + square(filter.value(error_ + 1))) / receiver_.sigma_m();
}

double position_aid::half_chord_s(const planar_motion &filter) const {
  return larger(std::sqrt(filter.variance(time_)), kLeastChord_s);
}

// The twist over the chord of two sigmas of the delay: a robot that may have stood then, or driven, has neither's
// derivative [Julier1997]. Before the first motion datum the robot is taken to have moved as it does by that one: taken
// to have stood, its first positions would be exact, and determine a delay that cannot be separated from the place of
// the antenna.
planar_twist position_aid::chord(const planar_motion &filter, const wm_pose2 &past, double bend_m[2]) const {
  const double age_s = filter.value(time_), half_s = half_chord_s(filter);
  const wm_time_ns now = filter.now_ns();
  if (!filter.is_path_known(now - wm_ns_from_seconds(age_s + half_s))) {
    motion_twist ahead{};
    (void)filter.path(now, now + 1, &ahead);
    return filter.steady(ahead);
  }
  const wm_pose2 earlier = between(past, pose_before(filter, age_s + half_s).pose);
  const wm_pose2 later = between(past, pose_before(filter, age_s - half_s).pose);
  const double by = 0.5 / half_s, share = 0.5 * filter.variance(time_) / square(half_s);
  bend_m[0] = share * (earlier.x_m + later.x_m);
  bend_m[1] = share * (earlier.y_m + later.y_m);
  return {by * (later.x_m - earlier.x_m), by * (later.y_m - earlier.y_m),
          by * wrap(later.heading_rad - earlier.heading_rad)};
}

// At constant speed a delay and the antenna's place along the way are one: the derivative by the first is minus the
// speed times that by the second. Noise, the speed's scale and an arm that is being estimated would tell them apart in
// each row a little, although nothing does. Their derivatives are therefore those of first estimates [Huang2010]: the
// speed as measured, held within the noise of the chord, and the arm as stated. A change of speed tells them apart.
void position_aid::put_delay(const planar_motion &filter, view *at) {
  if (time_ < 0) return;
  double bend_m[2] = {0.0, 0.0}, variance_m2[2];
  const planar_twist moved = chord(filter, at->past.pose, bend_m);
  const double *scale = filter.calibration().value;
  const double by_speed = 1.0 / (scale[kSpeedScale] * 0.5 * (scale[kLeftScale] + scale[kRightScale]));
  const double half_width = kHeldSigmas * std::sqrt(filter.way_noise() / (2.0 * half_chord_s(filter)));
  const double speed[2] = {by_speed * moved.v, by_speed * moved.u};
  for (int k = 0; k < 2; k++) {
    if (!receiver_.is_used()) held_[k].restart(speed[k]);
    held_[k].step(speed[k], 1.0, half_width);
  }
  const double by[2] = {moved.w * antenna_m_[1] - held_[0].banded, -moved.w * antenna_m_[0] - held_[1].banded};
  put_second_order(filter, moved.w, bend_m, variance_m2);
  const sin_cos h = at->h;
  at->delay_by[0] = h.cos * by[0] - h.sin * by[1];
  at->delay_by[1] = h.sin * by[0] + h.cos * by[1];
  at->bend_m[0] = h.cos * bend_m[0] - h.sin * bend_m[1];
  at->bend_m[1] = h.sin * bend_m[0] + h.cos * bend_m[1];
  at->bend_m2[0] = square(h.cos) * variance_m2[0] + square(h.sin) * variance_m2[1];
  at->bend_m2[1] = square(h.sin) * variance_m2[0] + square(h.cos) * variance_m2[1];
}

// Terms of the second order in base_link: bend_m has half of the path's second derivative by the delay times its
// variance; the turn in between moves the arm, which is uncertain, too. Mean and variance for normal errors.
void position_aid::put_second_order(const planar_motion &filter, double w_radps, double bend_m[2],
                                    double variance_m2[2]) const {
  for (int k = 0; k < 2; k++) {
    const double path_m = bend_m[k], by = k == 0 ? w_radps : -w_radps;  // of the arm on the other axis
    const int arm = antenna_ < 0 ? -1 : antenna_ + 1 - k;
    const double both = arm < 0 ? 0.0 : filter.covariance(time_, arm);
    const double product = arm < 0 ? 0.0 : filter.variance(time_) * filter.variance(arm);
    bend_m[k] += by * both;
    variance_m2[k] = 2.0 * square(path_m) + 4.0 * path_m * by * both + square(by) * (product + square(both));
  }
}

// What delay and arm explain of a place's error lies on the axes of the heading. An update of the heading turns that
// part, as it does in truth: P <- T P T'. Else the axes of several headings would tell a delay from a place.
void position_aid::turn_explained(planar_motion *filter, const places &landmarks) {
  const double turn_rad = filter->corrected_rad() - corrected_rad_;
  corrected_rad_ = filter->corrected_rad();
  int state[3], count = 0;
  if (time_ >= 0) state[count++] = time_;
  for (int k = 0; k < 2 && antenna_ >= 0; k++) state[count++] = antenna_ + k;
  double factor[3][3];
  for (int i = 0; i < count; i++)
    for (int j = 0; j < count; j++) factor[i][j] = filter->covariance(state[i], state[j]);
  if (turn_rad == 0.0 || !factorize(count, factor[0], 3)) return;
  const sin_cos turn = sincos(turn_rad);
  for (int place = -1; place < landmarks.count; place++) {
    const int first = place < 0 ? kX : landmarks.first + place * landmarks.width;
    double by[2][3];
    for (int k = 0; k < 2; k++) {
      for (int i = 0; i < count; i++) by[k][i] = filter->covariance(first + k, state[i]);
      substitute_forward(count, factor[0], 3, by[k]);
      substitute_backward(count, factor[0], 3, by[k]);
    }
    planar_row rows[2];
    for (int i = 0; i < count; i++) {
      rows[0].add(state[i], (turn.cos - 1.0) * by[0][i] - turn.sin * by[1][i]);
      rows[1].add(state[i], turn.sin * by[0][i] + (turn.cos - 1.0) * by[1][i]);
    }
    filter->transport_place(first, rows);
  }
}

position_aid::view position_aid::look(const wm_position &p, planar_motion *filter, const places &landmarks) {
  has_position_ = 1;
  turn_explained(filter, landmarks);
  view out{pose_before(*filter, time_ < 0 ? 0.0 : filter->value(time_)), {}, {}, {}, {}, {}, {}};
  const sin_cos h = out.h = sincos(out.past.pose.heading_rad);
  for (int i = 0; i < 2; i++) out.arm_m[i] = antenna_m_[i] + (antenna_ < 0 ? 0.0 : filter->value(antenna_ + i));
  out.off_m[0] = h.cos * out.arm_m[0] - h.sin * out.arm_m[1];
  out.off_m[1] = h.sin * out.arm_m[0] + h.cos * out.arm_m[1];
  put_delay(*filter, &out);
  carry_error(filter->now_ns(), p.sigma_xy_m, filter);
  return out;
}

// Derivatives of the antenna's x (axis 0) or y; returns what is expected there.
double position_aid::put_row(int axis, const view &at, const planar_motion &filter, planar_row *row) const {
  const bool is_x = axis == 0;
  const double by[3] = {is_x ? 1.0 : 0.0, is_x ? 0.0 : 1.0, is_x ? -at.off_m[1] : at.off_m[0]};
  add_past_pose(row, by, at.past, -1);
  row->add(time_, at.delay_by[axis]);
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
    const double expected = put_row(k, at, filter, &r.row) + at.bend_m[k];
    r.record = record;
    r.record.residual = k == 0 ? WM_RESIDUAL_X : WM_RESIDUAL_Y;
    r.record.observed = p.p_m[k];
    r.record.expected = expected;
    r.innovation = p.p_m[k] - expected;
    r.source = {noise_adaption::kPlace, white_m2};
    r.noise = white_m2 + at.bend_m2[k];
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
