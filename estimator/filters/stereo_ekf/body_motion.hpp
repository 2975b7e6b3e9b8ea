// SPDX-License-Identifier: Apache-2.0
// The vehicle's measured twist as stretches of time: which twist holds when, how unsure it is, and what is made of
// gaps.
#ifndef WAYMARK_ESTIMATOR_BODY_MOTION_HPP
#define WAYMARK_ESTIMATOR_BODY_MOTION_HPP

#include "filters/stereo_ekf/params.h"
#include "filters/stereo_ekf/space_filter.hpp"
#include "motion/front_end.hpp"
#include "waymark/estimator.h"

namespace wm {

class body_motion {
 public:
  void init(const wm_setup &setup, const wm_stereo_ekf_params &params);
  // Whether a motion event can be taken; changes nothing.
  wm_status check(const wm_event &event) const { return front_.check(event); }

  // Takes a motion event. A twist is as it says; a planar one, and what wheels and gyro say, has no other components.
  void feed(const wm_event &event);
  // Hands the stretches from `from_ns` to `to_ns` (at most the last sample's stamp or later than it) to `visit`.
  template <class Visit>
  void walk(wm_time_ns from_ns, wm_time_ns to_ns, Visit visit);

  // How the body moved from `age_s` ago until now, seen from where it was then, by what was handed out; a negative age
  // looks ahead with the twist that holds.
  placed moved_since(double age_s) const;

  // The twist about now as a derivative by time needs it: smoothed over a third of a second, as it was at the picture
  // before, and drawn along by that on a rope of one sample's sigma. The newest samples' noise moved the pose that the
  // picture corrects; were it in the derivative, too, the two together would look like pictures that are late. And a
  // derivative that shivers on a way that is even would seem to tell when the pictures were taken, which nothing tells
  // there.
  const vec3 &steady_v_mps() const { return steady_[0].v; }
  const vec3 &steady_w_radps() const { return steady_[0].w; }
  void begin_picture() { steady_[0] = steady_[1], steady_[1] = even_; }
  const vec3 &v_mps() const { return last_.v; }
  const vec3 &w_radps() const { return last_.w; }
  // The sample that the vehicle does now what it says of, and by how much it differs from the one before it, per
  // second. With `constant_velocity.sample_at: end` that is the one that held until now. False where there is none yet.
  bool sample_now(vec3 *v, vec3 *w, vec3 *v_slope, vec3 *w_slope) const;
  // Variances of one sample's components.
  void sample_noise(vec3 *v_var, vec3 *w_var) const;
  uint32_t health() const { return front_.health(); }

 private:
  struct sample {
    wm_time_ns t_ns;
    vec3 v, w;
  };
  struct past {
    double dt_s;
    vec3 v, w;
  };
  static constexpr int kPast = 64;

  double variance_of(double sigma, double rel, double size) const { return square(sigma) + square(rel * size); }
  body_stretch make(const vec3 &v, const vec3 &w, double dt_s, double v_walk_s3, double w_walk_s3);
  void remember(const body_stretch &s);

  motion_front_end front_;
  wm_stereo_ekf_params params_;
  double hold_max_s_;
  double sigma_v_[3], sigma_w_[3];
  bool has_sample_, has_before_, has_older_;
  sample last_, before_, older_;  // the newest sample and the ones before it
  double period_s_;               // between the last two samples that were no gap
  struct steady_twist {
    vec3 v, w;
  };
  steady_twist smooth_, even_;  // now; on the rope
  steady_twist steady_[2];      // at the picture before the newest, and at the newest
  past ring_[kPast];
  int ring_next_;
};

template <class Visit>
void body_motion::walk(wm_time_ns from_ns, wm_time_ns to_ns, Visit visit) {
  const auto step = [&](const vec3 &v, const vec3 &w, wm_time_ns a, wm_time_ns b, double v_s3, double w_s3) {
    if (b <= a) return;
    const body_stretch s = make(v, w, wm_seconds_between(a, b), v_s3, w_s3);
    remember(s);
    visit(s);
  };
  // Up to the newest sample: what held before it, or the mean of both over a gap.
  if (has_sample_ && from_ns < last_.t_ns) {
    const wm_time_ns end = to_ns < last_.t_ns ? to_ns : last_.t_ns;
    if (has_before_) {
      const double gap_s = wm_seconds_between(before_.t_ns, last_.t_ns);
      const bool gap = gap_s > params_.gap_after_s;
      const double share = gap ? wm_seconds_between(from_ns, end) / gap_s : 0.0;
      // A walk that is known at both ends has lost T^3/12 of its integral.
      const double cubed = gap ? gap_s * gap_s * gap_s / 12.0 * share : 0.0;
      if (gap && gap_s <= hold_max_s_)
        step(0.5 * (before_.v + last_.v), 0.5 * (before_.w + last_.w), from_ns, end, cubed, cubed);
      else if (gap)
        step(0.5 * last_.v, 0.5 * last_.w, from_ns, end, cubed, cubed);
      else
        step(before_.v, before_.w, from_ns, end, 0.0, 0.0);
    } else {
      step(last_.v, last_.w, from_ns, end, 0.0, 0.0);
    }
    from_ns = end;
  }
  if (from_ns >= to_ns) return;
  if (!has_sample_) {
    step({0, 0, 0}, {0, 0, 0}, from_ns, to_ns, 0.0, 0.0);
    return;
  }
  // After it: it holds, for a while.
  const wm_time_ns held_ns = last_.t_ns + wm_ns_from_seconds(params_.gap_after_s);
  const wm_time_ns old_ns = last_.t_ns + wm_ns_from_seconds(hold_max_s_);
  const wm_time_ns a = to_ns < held_ns ? to_ns : held_ns;
  step(last_.v, last_.w, from_ns, a, 0.0, 0.0);
  if (from_ns < a) from_ns = a;
  const wm_time_ns b = to_ns < old_ns ? to_ns : old_ns;
  if (from_ns < b) {
    const double begin = wm_seconds_between(last_.t_ns, from_ns), end = wm_seconds_between(last_.t_ns, b);
    const double cubed = (end * end * end - begin * begin * begin) / 3.0;
    step(last_.v, last_.w, from_ns, b, cubed, cubed);
    from_ns = b;
  }
  if (from_ns < to_ns) {
    const double dt = wm_seconds_between(from_ns, to_ns);
    step({0, 0, 0}, {0, 0, 0}, from_ns, to_ns, square(hold_max_s_) * dt, square(hold_max_s_) * dt);
  }
}

}  // namespace wm

#endif
