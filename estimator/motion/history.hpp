// SPDX-License-Identifier: Apache-2.0
// Inputs of the motion model over the last seconds, each with the time from which it holds. A lag and delayed
// observations need the past ones.
#ifndef WAYMARK_ESTIMATOR_MOTION_HISTORY_HPP
#define WAYMARK_ESTIMATOR_MOTION_HISTORY_HPP

#include <cstdint>

#include "waymark/motion.h"
#include "waymark/time.h"

namespace wm {

enum refused_bits : uint8_t { kRefusedSpeed = 1, kRefusedTurn = 2 };

// Twist of base_link: speed forwards and to the left in m/s, turn rate in rad/s.
struct planar_twist {
  double v, u, w;
};

// A raw input; a and b mean, by model: ticks: speed of the left and the right wheel (m/s); speed_yaw_rate, twist and
// increments: speed (m/s) and turn rate (rad/s); ackermann: speed (m/s) and road wheel angle (rad).
struct motion_input {
  wm_time_ns t_ns;  // holds until the next one's
  double a, b;
  double side_mps;  // to the left; of twists in space and increments
  double steady[2];
  // Of increments: variance per s of distance, of sideways and of rotation, and their covariances; NaN: not given.
  float increment_noise[6];
  float sampling[2];    // variances of distance and rotation by the changes since the samples before
  float side_sampling;  // the same to the side, of a holonomic drive
  float period_s;       // between increments; 0: that between the inputs
  float response[2];    // of commands: speed and turn rate of the drive at t_ns (commands.hpp)
  // Of the speed and of the turn: at t_ns the age of the newest sample, and the age at which the next one was overdue.
  // 0: in time.
  float age_s[2], due_s[2];
  float steady_after_s;  // of counts: a and b hold for this time from t_ns, then `steady`; 0: always a and b
  uint8_t beside_gyro;   // the turn rate is not the gyro's, which is silent or stuck
  uint8_t uncounted;     // no count gives the distance until the next input's t_ns
  uint8_t holonomic;     // of a twist: the drive moves sideways
  uint8_t by_counts;     // the speed is that of wheel counters
  uint8_t model;         // wm_motion_model; AUTO: nothing known yet
  uint8_t standing;      // the robot is known to stand
  uint8_t doubtful;      // of a frozen counter, a dead encoder
  uint8_t stale;         // set by walk(): held for longer than hold_max
  uint8_t counted;       // by the counts or the increment at its end: true until then, however long
  uint8_t command;       // a twist that is a command
  uint8_t kind;          // motion_kind
  uint8_t refused;       // kRefusedSpeed, kRefusedTurn: samples of it are refused, and this is the last plausible one
  double refused_s;      // at t_ns: for how long
};

// Of commands (commands.hpp): rises of the speed and of the turn rate per s, and by how much a drive by radius turns
// faster, rad/s.
struct drive_terms {
  double rise[2], gentle_radps;
};

// Part of an interval over which one input holds.
struct motion_segment {
  motion_input input;
  double dt_s;
  double held_s;  // at its beginning: since the input's t_ns
  drive_terms drive;
  double changed2[2];  // of commands: squares of what the drive still has to change, beginning less end
  planar_twist end;    // of commands: at its end
  double overdue_s;    // at its beginning: for how long the next input, or speed, has been overdue; below 0: it isn't
  double turn_overdue_s;  // the same of the turn
  double unknown_s;       // at its beginning: for how long the input has been held for too long; 0: it isn't
  double refused_s;       // at its beginning: for how long samples have been refused; only where input.refused
  bool has_next;          // a later input has come
  bool first, last;       // of the interval: their length depends on the lag
};

class motion_history {
 public:
  static constexpr uint32_t kCapacity = 256;  // 1 s of lag at 250 inputs a second; a power of two

  // An input is overdue after this time and so many of the periods before it. Sources of 4 Hz and more keep within.
  static constexpr double kOverdueS = 0.25, kOverduePeriods = 3.0;

  void clear() { count_ = 0; }
  bool empty() const { return count_ == 0; }
  const motion_input &newest() const { return at(count_ - 1); }
  // The counts at the end of the newest input's time do not give its distance.
  void uncount_newest() {
    if (count_ > 0) ring_[(count_ - 1) & (kCapacity - 1)].uncounted = 1;
  }

  void push(const motion_input &input) {
    if (count_ > 0 && newest().t_ns >= input.t_ns) {
      ring_[(count_ - 1) & (kCapacity - 1)] = input;
      return;
    }
    ring_[count_ & (kCapacity - 1)] = input;
    count_++;
  }

  // The input after the newest one should have come by now.
  bool is_overdue(wm_time_ns t_ns) const {
    const uint64_t oldest = count_ > kCapacity ? count_ - kCapacity : 0;
    return count_ > 0 && wm_seconds_between(newest().t_ns, t_ns) > due_s(count_, oldest);
  }

  // Since when the motion is known; there is an input.
  wm_time_ns oldest_ns() const { return at(count_ > kCapacity ? count_ - kCapacity : 0).t_ns; }
  // Calls visit(segment) for the segments of [from_ns, to_ns] in order of time. Before the oldest input the motion is
  // unknown.
  template <class Visit>
  void walk(wm_time_ns from_ns, wm_time_ns to_ns, wm_time_ns hold_max_ns, Visit visit) const {
    if (to_ns <= from_ns) return;
    uint64_t next = count_;  // first input that begins after from_ns
    const uint64_t oldest = count_ > kCapacity ? count_ - kCapacity : 0;
    while (next > oldest && at(next - 1).t_ns > from_ns) next--;
    wm_time_ns begin = from_ns;
    while (begin < to_ns) {
      wm_time_ns end = next < count_ && at(next).t_ns < to_ns ? at(next).t_ns : to_ns;
      motion_segment segment = next > oldest ? held(next, oldest, begin, hold_max_ns, &end) : unknown();
      segment.has_next = next < count_;
      segment.dt_s = wm_seconds_between(begin, end);
      segment.first = begin == from_ns;
      segment.last = end == to_ns;
      visit(segment);
      begin = end;
      while (next < count_ && at(next).t_ns <= begin) next++;
    }
  }

 private:
  static motion_segment unknown() {
    motion_segment segment{};
    segment.overdue_s = segment.turn_overdue_s = -1.0;
    return segment;
  }

  // The input before `next` holds from `begin` on. Where it becomes stale before *end, *end is that time.
  motion_segment held(uint64_t next, uint64_t oldest, wm_time_ns begin, wm_time_ns hold_max_ns, wm_time_ns *end) const {
    motion_segment segment{};
    segment.input = at(next - 1);
    const wm_time_ns age_ns = wm_ns_from_seconds(static_cast<double>(segment.input.age_s[0]));
    const wm_time_ns held_until = segment.input.t_ns + hold_max_ns - age_ns;
    segment.input.stale = begin >= held_until;
    if (!segment.input.stale && *end > held_until) *end = held_until;
    if (segment.input.counted) segment.input.stale = 0;  // the distance is known, however long it took
    if (segment.input.steady_after_s > 0.0F) {
      const wm_time_ns own_until =
          segment.input.t_ns + wm_ns_from_seconds(static_cast<double>(segment.input.steady_after_s));
      if (begin >= own_until) {
        segment.input.a = segment.input.steady[0];
        segment.input.b = segment.input.steady[1];
      } else if (*end > own_until) {
        *end = own_until;
      }
    }
    segment.held_s = wm_seconds_between(segment.input.t_ns, begin);
    segment.overdue_s = part_overdue_s(segment, 0, due_s(next, oldest));
    segment.turn_overdue_s = part_overdue_s(segment, 1, due_s(next, oldest));
    segment.refused_s = segment.input.refused_s + segment.held_s;
    segment.unknown_s = begin > held_until ? wm_seconds_between(held_until, begin) : 0.0;
    return segment;
  }

  static double part_overdue_s(const motion_segment &segment, int part, double input_due_s) {
    const double age_s = static_cast<double>(segment.input.age_s[part]);
    const double due_s = age_s > 0.0 ? static_cast<double>(segment.input.due_s[part]) : input_due_s;
    return age_s + segment.held_s - due_s;
  }

  // How old the input before `next` may become before `next` is overdue.
  double due_s(uint64_t next, uint64_t oldest) const {
    if (next <= oldest + 1) return kOverdueS;
    const double own_s = static_cast<double>(at(next - 1).period_s);
    const double period_s = own_s > 0.0 ? own_s : wm_seconds_between(at(next - 2).t_ns, at(next - 1).t_ns);
    const double usual_s = kOverduePeriods * period_s;
    return usual_s > kOverdueS ? usual_s : kOverdueS;
  }
  const motion_input &at(uint64_t index) const { return ring_[index & (kCapacity - 1)]; }

  motion_input ring_[kCapacity];
  uint64_t count_;
};

}  // namespace wm

#endif
