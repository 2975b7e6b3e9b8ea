// SPDX-License-Identifier: Apache-2.0
#include "filters/stereo_ekf/body_motion.hpp"

#include <cstring>
#include <limits>

namespace wm {
namespace {

constexpr double kDefaultSigmaV_mps = 0.03, kDefaultSigmaW_radps = 0.01;
constexpr double kFirstPeriod_s = 0.02;
constexpr double kSteady_s = 0.3;

double first_of(double set, double calibrated, double otherwise) {
  if (set > 0.0) return set;
  return finite(calibrated) && calibrated > 0.0 ? calibrated : otherwise;
}

// What follows `leader` on a rope of that length.
double drawn_along(double follower, double leader, double rope) {
  if (leader > follower + rope) return leader - rope;
  return leader < follower - rope ? leader + rope : follower;
}

}  // namespace

void body_motion::init(const wm_setup &setup, const wm_stereo_ekf_params &params) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  front_.init(setup.motion, &setup.wheels);
  params_ = params;
  hold_max_s_ = front_.params().hold_max_s;
  if (hold_max_s_ < params.gap_after_s) hold_max_s_ = params.gap_after_s;
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 3; i++) {
    const wm_rig *rig = setup.rig;
    sigma_v_[i] = first_of(params.v_mps, rig ? rig->twist6_sigma_v_mps[i] : unknown, kDefaultSigmaV_mps);
    sigma_w_[i] = first_of(params.w_radps, rig ? rig->twist6_sigma_w_radps[i] : unknown, kDefaultSigmaW_radps);
  }
  period_s_ = kFirstPeriod_s;
}

void body_motion::feed(const wm_event &event) {
  sample now = {event.t_ns, {0, 0, 0}, {0, 0, 0}};
  if (event.kind == WM_EVENT_TWIST6) {
    now.v = vec_of(event.as.twist6.v_mps);
    now.w = vec_of(event.as.twist6.w_radps);
  } else if (event.kind == WM_EVENT_TWIST2) {
    now.v.x = event.as.twist2.v_mps;
    now.w.z = event.as.twist2.w_radps;
  } else {
    front_.feed(event);
    front_.advance(event.t_ns, kNeutralCalibration,
                   [](const motion_stretch &, const motion_twist &, const motion_noise &) {});
    const motion_twist twist = front_.twist_at(event.t_ns, kNeutralCalibration);
    now.v.x = twist.v;
    now.w.z = twist.w;
  }
  if (has_sample_ && now.t_ns > last_.t_ns) {
    const double apart_s = wm_seconds_between(last_.t_ns, now.t_ns);
    if (apart_s <= params_.gap_after_s) period_s_ = apart_s;
    older_ = before_;
    has_older_ = has_before_;
    before_ = last_;
    has_before_ = true;
  }
  if (!has_sample_) smooth_ = even_ = steady_[0] = steady_[1] = {now.v, now.w};
  last_ = now;
  has_sample_ = true;
}

void body_motion::sample_noise(vec3 *v_var, vec3 *w_var) const {
  const double speed = length(last_.v), rate = length(last_.w);
  for (int i = 0; i < 3; i++) {
    (*v_var)[i] = variance_of(sigma_v_[i], params_.v_rel, speed);
    (*w_var)[i] = variance_of(sigma_w_[i], params_.w_rel, rate);
  }
}

bool body_motion::sample_now(vec3 *v, vec3 *w, vec3 *v_slope, vec3 *w_slope) const {
  *v_slope = *w_slope = {0, 0, 0};
  const bool at_end = params_.cv_sample_at == WM_SAMPLE_AT_END;
  if (!has_sample_ || (at_end && !has_before_)) return false;
  const sample &now = at_end ? before_ : last_, &then = at_end ? older_ : before_;
  *v = now.v;
  *w = now.w;
  if (at_end ? !has_older_ : !has_before_) return true;
  const double per_s = 1.0 / wm_seconds_between(before_.t_ns, last_.t_ns);
  *v_slope = per_s * (now.v - then.v);
  *w_slope = per_s * (now.w - then.w);
  return true;
}

// A sample's error is the same while it holds, T, and new in the next: a white density of variance times T.
body_stretch body_motion::make(const vec3 &v, const vec3 &w, double dt_s, double v_walk_s3, double w_walk_s3) {
  body_stretch s = {dt_s, v, w, {}, {}};
  const double speed = length(v), rate = length(w);
  const double held_s2 = dt_s * (dt_s > period_s_ ? dt_s : period_s_);
  for (int i = 0; i < 3; i++) {
    s.place_m2[i] = variance_of(sigma_v_[i], params_.v_rel, speed) * held_s2 + square(params_.gap_v_walk) * v_walk_s3;
    s.turn_rad2[i] = variance_of(sigma_w_[i], params_.w_rel, rate) * held_s2 + square(params_.gap_w_walk) * w_walk_s3;
  }
  return s;
}

void body_motion::remember(const body_stretch &s) {
  ring_[ring_next_] = {s.dt_s, s.v_mps, s.w_radps};
  ring_next_ = (ring_next_ + 1) % kPast;
  const double share = s.dt_s / (s.dt_s + kSteady_s);
  smooth_.v = smooth_.v + share * (s.v_mps - smooth_.v);
  smooth_.w = smooth_.w + share * (s.w_radps - smooth_.w);
  for (int i = 0; i < 3; i++) {
    even_.v[i] = drawn_along(even_.v[i], smooth_.v[i], sigma_v_[i]);
    even_.w[i] = drawn_along(even_.w[i], smooth_.w[i], sigma_w_[i]);
  }
}

placed body_motion::moved_since(double age_s) const {
  placed since = {{0, 0, 0}, kNoTurn};
  const auto before = [&](const vec3 &v, const vec3 &w, double dt) {  // this piece came before all that is in `since`
    const quat turn = turn_by(dt * w);
    since.p = dt * (mean_turn(dt * w) * v) + matrix_of(turn) * since.p;
    since.q = turn * since.q;
  };
  if (age_s < 0.0) before(last_.v, last_.w, age_s);
  for (int k = 0; k < kPast && age_s > 0.0; k++) {
    const past &piece = ring_[(ring_next_ + 2 * kPast - 1 - k) % kPast];
    if (!(piece.dt_s > 0.0)) break;
    const double dt = piece.dt_s < age_s ? piece.dt_s : age_s;
    before(piece.v, piece.w, dt);
    age_s -= dt;
  }
  return since;
}

}  // namespace wm
