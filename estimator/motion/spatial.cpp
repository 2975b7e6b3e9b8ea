// SPDX-License-Identifier: Apache-2.0
#include "motion/spatial.hpp"

#include <cstring>

namespace wm {
namespace {

// An interval between two samples beyond this is a gap, over which their mean is taken: logs give 5 samples a second or
// more. Not swept.
constexpr double kGapAfter_s = 0.2;
// Random walks of the velocity and of the turn rates over a gap, per sqrt(s): accelerations of a vehicle in water or of
// a head. Not swept.
constexpr double kGapWalk_mps = 0.3, kGapWalk_radps = 0.3;
constexpr double kFirstPeriod_s = 0.02;  // of a sensor that has given one sample; 50 a second
// Of the low-pass behind a time offset's derivative. Chosen on seabed-a (offset 15 ms); not swept.
constexpr double kSmoothing_s = 0.3;

double variance_of(double sigma, double rel, double size) { return square(sigma) + square(rel * size); }

// A sigma that the row states, in place of the usual one.
double stated_or(double stated, double usual) { return stated > 0.0 ? stated : usual; }

// Variance of a value that is held while the truth goes on to the next sample: a change c, evenly made, leaves c^2/3 on
// average. Two samples' noise is taken off.
double held_variance(double change, double sigma) {
  const double real = square(change) - 2.0 * square(sigma);
  return real > 0.0 ? real / 3.0 : 0.0;
}

}  // namespace

void spatial_history::init(const spatial_rules &rules) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  rules_ = rules;
  if (rules_.hold_max_s < rules_.gap_after_s) rules_.hold_max_s = rules_.gap_after_s;
  period_s_ = kFirstPeriod_s;
  refused_since_ns_ = last_refusal_ns_ = WM_TIME_NONE;
}

bool spatial_history::refused_lately() const {
  return last_refusal_ns_ != WM_TIME_NONE &&
         (samples_ == 0 || wm_seconds_between(last_refusal_ns_, sample_[0].t_ns) < kShowRefusal_s);
}

bool spatial_history::is_plausible(wm_time_ns t_ns, const spatial_twist &twist) {
  bool plausible = true;
  for (int i = 0; i < 3; i++) {
    if (rules_.mps2 > 0.0)
      plausible &= check_[i].check_level(t_ns, twist.v[i], kSpeedStep_mps, rules_.mps2) != plausibility::refused;
    if (rules_.radps2 > 0.0)
      plausible &= check_[3 + i].check_level(t_ns, twist.w[i], kRateStep_radps, rules_.radps2) != plausibility::refused;
  }
  return plausible;
}

bool spatial_history::feed(wm_time_ns t_ns, const spatial_twist &twist) {
  if (!is_plausible(t_ns, twist)) {
    last_refusal_ns_ = t_ns;
    outliers_++;
    if (refused_since_ns_ == WM_TIME_NONE) refused_since_ns_ = samples_ > 0 ? sample_[0].t_ns : t_ns;
    return false;
  }
  refused_since_ns_ = WM_TIME_NONE;
  if (samples_ > 0 && t_ns > sample_[0].t_ns) {
    const double apart_s = wm_seconds_between(sample_[0].t_ns, t_ns);
    if (apart_s <= rules_.gap_after_s) period_s_ = apart_s;
    sample_[2] = sample_[1];
    sample_[1] = sample_[0];
    if (samples_ < 3) samples_++;
  }
  if (samples_ == 0) samples_ = 1;
  sample_[0] = {t_ns, twist};
  return true;
}

double spatial_history::refused_s4(wm_time_ns from_ns, wm_time_ns to_ns) const {
  if (refused_since_ns_ == WM_TIME_NONE) return 0.0;
  const auto since = [this](wm_time_ns t_ns) {
    const double s = wm_seconds_between(refused_since_ns_, t_ns);
    return s < 0.0 ? 0.0 : s < rules_.hold_max_s ? s : rules_.hold_max_s;
  };
  return 0.25 * (square(square(since(to_ns))) - square(square(since(from_ns))));
}

spatial_twist spatial_history::last_change() const {
  if (samples_ < 2 || wm_seconds_between(sample_[1].t_ns, sample_[0].t_ns) > rules_.gap_after_s) return {};
  return {sample_[0].twist.v - sample_[1].twist.v, sample_[0].twist.w - sample_[1].twist.w};
}

void spatial_history::remember(const spatial_piece &piece) { piece_[pieces_++ % kPieces] = piece; }

bool spatial_history::moved_since(double age_s, pose3 *out, spatial_twist *twist) const {
  pose3 since = kNoMotion;
  const auto prepend = [&](const spatial_twist &t, double dt) {
    const quat turn = turn_by(dt * t.w);
    since.p = dt * (mean_turn(dt * t.w) * t.v) + matrix_of(turn) * since.p;
    since.q = turn * since.q;
    if (twist) *twist = t;
  };
  if (twist) *twist = sample_[0].twist;
  if (age_s < 0.0) prepend(sample_[0].twist, age_s);
  for (uint64_t k = 0; k < kPieces && k < pieces_ && age_s > 0.0; k++) {
    const spatial_piece &piece = piece_[(pieces_ - 1 - k) % kPieces];
    const double dt = piece.dt_s < age_s ? piece.dt_s : age_s;
    prepend(piece.twist, dt);
    age_s -= dt;
  }
  *out = since;
  return age_s <= 0.0;
}

void spatial_motion::init(const wm_motion_params *params, const wm_wheels *wheels, const spatial_noise &noise) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  front_.init(params, wheels);
  const wm_motion_params &p = front_.params();
  source_.init(p.hold_max_s,
               {p.standstill_speed_mps + length(noise.v_mps), p.standstill_yaw_rate_radps + length(noise.w_radps)});
  history_.init({kGapAfter_s, p.hold_max_s, true, p.limits_mps2, p.limits_radps2});
  noise_ = noise;
}

void spatial_motion::feed(const wm_event &event) {
  spatial_twist now = {};
  if (event.kind == WM_EVENT_TWIST2) {
    now.v.x = event.as.twist2.v_mps;
    now.w.z = event.as.twist2.w_radps;
  } else if (event.kind != WM_EVENT_TWIST6) {
    front_.feed(event);
    front_.advance(event.t_ns, kNeutralCalibration,
                   [](const motion_segment &, const motion_twist &, const motion_noise &) {});
    const motion_twist twist = front_.twist_at(event.t_ns, kNeutralCalibration);
    now.v.x = twist.v;
    now.v.y = twist.u;
    now.w.z = twist.w;
    source_.note_standing(front_.stands(event.t_ns));
  }
  if (!source_.take(event, &now)) return;
  const bool first = history_.samples() == 0;
  if (!history_.feed(event.t_ns, now) || !first) return;
  steady_[0] = steady_[1] = now;
  for (int i = 0; i < 3; i++) {
    smooth_v_[i].restart(now.v[i]);
    smooth_w_[i].restart(now.w[i]);
  }
}

uint32_t spatial_motion::health() const {
  static constexpr uint32_t kOfAxis[3] = {WM_MOTION_HEALTH_ROLL_RATE_STUCK, WM_MOTION_HEALTH_PITCH_RATE_STUCK,
                                          WM_MOTION_HEALTH_YAW_RATE_STUCK};
  uint32_t out = front_.health() | (history_.refused_lately() ? WM_MOTION_HEALTH_IMPLAUSIBLE : 0u);
  if (source_.lacks_rates() && !source_.by_gyro()) out |= WM_MOTION_HEALTH_TURN_SILENT;
  for (int i = 0; i < 3; i++) out |= source_.stuck_rates() & (1u << i) ? kOfAxis[i] : 0u;
  return out | (source_.stuck_forces() ? WM_MOTION_HEALTH_ACCELEROMETER_STUCK : 0u);
}

void spatial_motion::sample_noise(vec3 *v_var, vec3 *w_var) const {
  const double speed = length(v_mps()), rate = length(w_radps());
  for (int i = 0; i < 3; i++) {
    (*v_var)[i] = variance_of(stated_or(source_.v_sigma_mps(), noise_.v_mps[i]), noise_.v_rel, speed);
    (*w_var)[i] = variance_of(noise_.w_radps[i], noise_.w_rel, rate);
  }
}

bool spatial_motion::sample_now(spatial_twist *now, spatial_twist *slope) const {
  *slope = {};
  const int samples = history_.samples();
  if (samples == 0 || history_.refuses()) return false;
  const spatial_sample &last = history_.sample(0), &before = history_.sample(1);
  *now = last.twist;
  if (samples == 1) return true;
  const double per_s = 1.0 / wm_seconds_between(before.t_ns, last.t_ns);
  *slope = {per_s * (now->v - before.twist.v), per_s * (now->w - before.twist.w)};
  return true;
}

// A sample's error is the same while it holds, T, and new in the next: a white density of variance times T.
spatial_step spatial_motion::step_of(const spatial_piece &piece, wm_time_ns end_ns) const {
  spatial_step s = {piece.dt_s, piece.twist.v, piece.twist.w, {}, {}};
  const double speed = length(s.v_mps), rate = length(s.w_radps);
  const double held_s2 = s.dt_s * (s.dt_s > history_.period_s() ? s.dt_s : history_.period_s());
  const wm_motion_params &p = front_.params();
  spatial_twist changed = history_.last_change();
  double v_held_s2 = held_s2, walk_s3 = piece.walk_s3;
  if (source_.is_held()) {
    changed.v = source_.velocity_change();
    v_held_s2 = s.dt_s * (s.dt_s > source_.twist_period_s() ? s.dt_s : source_.twist_period_s());
    walk_s3 += source_.unmeasured_s3(s.dt_s, end_ns);
  }
  const uint32_t by_twist = source_.is_held() ? source_.lost_rates() : 0u;  // rates that hold as the velocity does
  const uint32_t unmeasured = source_.unmeasured_rates(end_ns);
  for (int i = 0; i < 3; i++) {
    const bool held = (by_twist & (1u << i)) != 0;
    if (held) changed.w[i] = source_.rate_change()[i];
    const double sigma_mps = stated_or(source_.v_sigma_held_mps(), noise_.v_mps[i]);
    const double v_var = variance_of(sigma_mps, noise_.v_rel, speed) + held_variance(changed.v[i], sigma_mps);
    const double w_var =
        variance_of(noise_.w_radps[i], noise_.w_rel, rate) + held_variance(changed.w[i], noise_.w_radps[i]);
    s.place_m2[i] = v_var * v_held_s2 + square(kGapWalk_mps) * walk_s3 + square(p.limits_mps2) * piece.refused_s4 / 3.0;
    s.turn_rad2[i] = w_var * (held ? v_held_s2 : held_s2) + square(kGapWalk_radps) * piece.walk_s3 +
                     square(p.limits_radps2) * piece.refused_s4 / 3.0;
    if (unmeasured & (1u << i)) s.turn_rad2[i] += square(kUnmeasured_radps) * s.dt_s;
  }
  return s;
}

// A turn that was missed evenly over a way bends it: half of the way is displaced on average, with a third of its
// square.
void spatial_motion::add_missed(spatial_step *s) {
  double turn_rad2[3], since_s;
  if (!source_.take_missed(turn_rad2, &since_s)) return;
  const double way2 = dot(s->v_mps, s->v_mps) * square(since_s);
  for (int i = 0; i < 3; i++) {
    s->turn_rad2[i] += turn_rad2[i];
    for (int j = 0; j < 3; j++)
      if (j != i) s->place_m2[j] += way2 * turn_rad2[i] / 3.0;
  }
}

double spatial_motion::unmeasured_turn_rad2ps(wm_time_ns t_ns) const {
  const uint32_t axes = source_.unmeasured_rates(t_ns);
  double sum = 0.0;
  for (int i = 0; i < 3; i++) sum += axes & (1u << i) ? square(kUnmeasured_radps) : 0.0;
  return sum;
}

void spatial_motion::smooth(const spatial_piece &piece) {
  const double share = piece.dt_s / (piece.dt_s + kSmoothing_s);
  for (int i = 0; i < 3; i++) {
    smooth_v_[i].step(piece.twist.v[i], share, noise_.v_mps[i]);
    smooth_w_[i].step(piece.twist.w[i], share, noise_.w_radps[i]);
  }
}

}  // namespace wm
