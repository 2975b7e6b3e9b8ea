// SPDX-License-Identifier: Apache-2.0
// Motion in space by measured twists of six components: which twist holds when, what is assumed over gaps, and how the
// body moved lately. One rule for the filter in space and for the poses published between its estimates.
#ifndef WAYMARK_ESTIMATOR_MOTION_SPATIAL_HPP
#define WAYMARK_ESTIMATOR_MOTION_SPATIAL_HPP

#include "math/se3.hpp"
#include "motion/front_end.hpp"
#include "motion/spatial_source.hpp"
#include "motion/steady_rate.hpp"

namespace wm {

struct spatial_sample {
  wm_time_ns t_ns;
  spatial_twist twist;
};

// A constant twist over dt_s. walk_s3: the integral over a velocity that walks randomly without being measured, for a
// density of 1; refused_s4: a quarter of the square of the way at 1 m/s2 while samples were refused as implausible.
struct spatial_piece {
  double dt_s;
  spatial_twist twist;
  double walk_s3, refused_s4;
};

// A sample holds to the next, and without one for `gap_after_s`; then its twist walks, to the next sample or until
// `hold_max_s`, when the body is taken to stand, unsure. `bridges`: over a gap the mean of the samples at both ends is
// taken as soon as the second is there; else the first has held, so that nothing is revised.
struct spatial_rules {
  double gap_after_s, hold_max_s;
  int64_t bridges;      // is a gap bridged by the next sample? Of 64 bits: no padding, so that states compare by bytes
  double mps2, radps2;  // motion.limits; 0: none
};

class spatial_history {
 public:
  void init(const spatial_rules &rules);
  // False: no body can move so after the samples before it; it is not taken.
  bool feed(wm_time_ns t_ns, const spatial_twist &twist);

  // Calls visit(piece, end_ns) for the interval, which ends at the newest sample or later.
  template <class Visit>
  void walk(wm_time_ns from_ns, wm_time_ns to_ns, Visit visit) const;
  // The same, and remembers the pieces as motion done.
  template <class Visit>
  void advance(wm_time_ns from_ns, wm_time_ns to_ns, Visit visit);

  // Motion from `age_s` before the end of what was advanced to that end. A negative age looks ahead with the twist that
  // holds. *twist: where not null, that at the beginning. False: older than what is remembered, which *out begins with.
  bool moved_since(double age_s, pose3 *out, spatial_twist *twist = nullptr) const;

  spatial_twist last_change() const;        // between the last two samples; 0 over a gap
  int samples() const { return samples_; }  // up to 3
  const spatial_sample &sample(int back) const { return sample_[back]; }
  double period_s() const { return period_s_; }                       // between the last two samples that were no gap
  bool refuses() const { return refused_since_ns_ != WM_TIME_NONE; }  // the newest sample was refused
  bool refused_lately() const;
  uint64_t outliers() const { return outliers_; }  // samples that were refused

 private:
  template <class Step>
  void hold(const spatial_sample &sample, wm_time_ns from_ns, wm_time_ns to_ns, Step step) const;

  static constexpr int kPieces = 256;  // a second at 250 samples a second

  void remember(const spatial_piece &piece);
  bool is_plausible(wm_time_ns t_ns, const spatial_twist &twist);
  double refused_s4(wm_time_ns from_ns, wm_time_ns to_ns) const;

  spatial_rules rules_;
  sample_check check_[6];
  wm_time_ns refused_since_ns_, last_refusal_ns_;
  uint64_t outliers_;
  spatial_sample sample_[3];  // the newest first
  int samples_;
  double period_s_;
  spatial_piece piece_[kPieces];
  uint64_t pieces_;
};

// Noise of a sample's twist: sigmas a component and a fraction of the size.
struct spatial_noise {
  vec3 v_mps, w_radps;
  double v_rel, w_rel;
};

// A piece with the variances of what it integrates to on each axis.
struct spatial_step {
  double dt_s;
  vec3 v_mps, w_radps;
  double place_m2[3], turn_rad2[3];
};

// The motion of a filter in space: any motion event as a twist, with noise and what a time offset's derivative needs.
class spatial_motion {
 public:
  void init(const wm_motion_params *params, const wm_wheels *wheels, const spatial_noise &noise);
  // Whether a motion event can be taken; changes nothing.
  wm_status check(const wm_event &event) const { return front_.check(event); }

  // Takes a motion event. A planar twist, and what wheels and gyro give, has no other components, but the rates of an
  // IMU with three axes.
  void feed(const wm_event &event);
  // Hands the steps from `from_ns` to `to_ns` (at most the last sample's stamp or later than it) to `visit`.
  template <class Visit>
  void walk(wm_time_ns from_ns, wm_time_ns to_ns, Visit visit) {
    history_.advance(from_ns, to_ns, [&](const spatial_piece &piece, wm_time_ns end_ns) {
      smooth(piece);
      spatial_step s = step_of(piece, end_ns);
      add_missed(&s);
      visit(s);
    });
  }

  // How the body moved from `age_s` ago until now, seen from where it was then; a negative age looks ahead.
  pose3 moved_since(double age_s) const {
    pose3 out;
    (void)history_.moved_since(age_s, &out);
    return out;
  }

  // The twist for derivatives by time: low-passed, with a dead band of one sample's sigma, as of the picture before.
  // The newest samples' noise moved the pose that the picture corrects; a derivative correlated with it would look like
  // a time offset.
  const vec3 &steady_v_mps() const { return steady_[0].v; }
  const vec3 &steady_w_radps() const { return steady_[0].w; }
  void begin_picture() {
    steady_[0] = steady_[1];
    for (int i = 0; i < 3; i++) {
      steady_[1].v[i] = smooth_v_[i].banded;
      steady_[1].w[i] = smooth_w_[i].banded;
    }
  }
  const vec3 &v_mps() const { return history_.sample(0).twist.v; }
  const vec3 &w_radps() const { return history_.sample(0).twist.w; }
  // The sample that holds now and its slope per second by the one before it. False: none yet, or it was refused.
  bool sample_now(spatial_twist *now, spatial_twist *slope) const;
  // Variances of one sample's components.
  void sample_noise(vec3 *v_var, vec3 *w_var) const;
  uint64_t outliers() const { return front_.outliers() + history_.outliers(); }
  uint32_t health() const;
  const spatial_source &source() const { return source_; }
  // Density of turns that nothing measures, of all axes.
  double unmeasured_turn_rad2ps(wm_time_ns t_ns) const;

 private:
  spatial_step step_of(const spatial_piece &piece, wm_time_ns end_ns) const;
  void add_missed(spatial_step *s);
  void smooth(const spatial_piece &piece);

  motion_front_end front_;
  spatial_source source_;
  spatial_history history_;
  spatial_noise noise_;
  steady_rate smooth_v_[3], smooth_w_[3];
  spatial_twist steady_[2];  // at the picture before the newest, and at the newest
};

template <class Visit>
void spatial_history::walk(wm_time_ns from_ns, wm_time_ns to_ns, Visit visit) const {
  const auto step = [&](const spatial_twist &twist, wm_time_ns a, wm_time_ns b, double walk_s3) {
    if (b > a) visit(spatial_piece{wm_seconds_between(a, b), twist, walk_s3, refused_s4(a, b)}, b);
  };
  const spatial_sample &last = sample_[0], &before = sample_[1];
  if (samples_ == 0) {
    step({}, from_ns, to_ns, 0.0);
    return;
  }
  // Up to the newest sample: the one before it, or the mean of both over a gap.
  if (from_ns < last.t_ns) {
    const wm_time_ns end = to_ns < last.t_ns ? to_ns : last.t_ns;
    const double gap_s = samples_ > 1 ? wm_seconds_between(before.t_ns, last.t_ns) : 0.0;
    if (gap_s > rules_.gap_after_s && rules_.bridges) {
      // A walk that is known at both ends has T^3/12 of its integral left.
      const double walk_s3 = gap_s * gap_s * gap_s / 12.0 * (wm_seconds_between(from_ns, end) / gap_s);
      const bool held = gap_s <= rules_.hold_max_s;
      const vec3 v = 0.5 * (held ? before.twist.v + last.twist.v : last.twist.v);
      const vec3 w = 0.5 * (held ? before.twist.w + last.twist.w : last.twist.w);
      step({v, w}, from_ns, end, walk_s3);
    } else if (samples_ > 1) {
      hold(before, from_ns, end, step);
    } else {
      step(last.twist, from_ns, end, 0.0);
    }
    from_ns = end;
  }
  if (from_ns < to_ns) hold(last, from_ns, to_ns, step);
}

// A sample holds, then walks, then is unknown.
template <class Step>
void spatial_history::hold(const spatial_sample &sample, wm_time_ns from_ns, wm_time_ns to_ns, Step step) const {
  const auto until = [to_ns](wm_time_ns t_ns) { return to_ns < t_ns ? to_ns : t_ns; };
  const wm_time_ns held = until(sample.t_ns + wm_ns_from_seconds(rules_.gap_after_s));
  const wm_time_ns old = until(sample.t_ns + wm_ns_from_seconds(rules_.hold_max_s));
  step(sample.twist, from_ns, held, 0.0);
  if (from_ns < held) from_ns = held;
  if (from_ns < old) {
    const double begin = wm_seconds_between(sample.t_ns, from_ns), end = wm_seconds_between(sample.t_ns, old);
    step(sample.twist, from_ns, old, (end * end * end - begin * begin * begin) / 3.0);
    from_ns = old;
  }
  if (from_ns < to_ns) step({}, from_ns, to_ns, square(rules_.hold_max_s) * wm_seconds_between(from_ns, to_ns));
}

template <class Visit>
void spatial_history::advance(wm_time_ns from_ns, wm_time_ns to_ns, Visit visit) {
  walk(from_ns, to_ns, [&](const spatial_piece &piece, wm_time_ns end_ns) {
    remember(piece);
    visit(piece, end_ns);
  });
}

}  // namespace wm

#endif
