// SPDX-License-Identifier: Apache-2.0
// What the motion sensors said, each from when on, over the last seconds. Commands that are obeyed late and sightings
// that are older than their stamp both look back into it.
#ifndef WAYMARK_ESTIMATOR_MOTION_HISTORY_HPP
#define WAYMARK_ESTIMATOR_MOTION_HISTORY_HPP

#include <cstdint>

#include "waymark/motion.h"
#include "waymark/time.h"

namespace wm {

enum refused_bits : uint8_t { kRefusedSpeed = 1, kRefusedTurn = 2 };

// A raw input; a and b mean, by model: ticks: speed of the left and the right wheel (m/s); speed_yaw_rate and twist:
// speed (m/s) and turn rate (rad/s); ackermann: speed (m/s) and road wheel angle (rad).
struct motion_input {
  wm_time_ns t_ns;  // holds from here to the next one's
  double a, b;
  uint8_t model;     // wm_motion_model; AUTO: nothing known yet
  uint8_t standing;  // the robot is known to stand
  uint8_t doubtful;  // not to be believed: frozen counter, dead encoder
  uint8_t stale;     // set by the walk over the history: held for longer than hold_max
  uint8_t counted;   // counts that came at its end say what it was: true until then, however long
  uint8_t command;   // a twist that is a command
  uint8_t refused;   // kRefusedSpeed, kRefusedTurn: samples of it are refused, and this is the last plausible one
  double refused_s;  // at t_ns: for how long
};

// One piece of an interval of time over which one input holds.
struct motion_stretch {
  motion_input input;
  double dt_s;
  double changed[2];  // at its beginning: by how much the input's a and b differ from the one before
  double silent_s;    // at its beginning: for how long the next input has been overdue; below 0: it isn't
  double unknown_s;   // at its beginning: for how long the input has been held for too long; 0: it isn't
  double refused_s;   // at its beginning: for how long samples have been refused; only where input.refused
  bool has_next;      // a later input has come
  bool first, last;   // of the interval: their length depends on the lag
};

class motion_history {
 public:
  static constexpr uint32_t kCapacity = 256;  // 1 s of lag at 250 inputs a second; a power of two

  // An input that is older than this, and than three of the periods before it, is overdue.
  static constexpr double kOverdueS = 0.25, kOverduePeriods = 3.0;

  void clear() { count_ = 0; }
  bool empty() const { return count_ == 0; }
  const motion_input &newest() const { return at(count_ - 1); }

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

  // Calls visit(stretch) for the pieces of [from_ns, to_ns] in order of time. Before the oldest input nothing is known.
  template <class Visit>
  void walk(wm_time_ns from_ns, wm_time_ns to_ns, wm_time_ns hold_max_ns, Visit visit) const {
    if (to_ns <= from_ns) return;
    uint64_t next = count_;  // first input that begins after from_ns
    const uint64_t oldest = count_ > kCapacity ? count_ - kCapacity : 0;
    while (next > oldest && at(next - 1).t_ns > from_ns) next--;
    wm_time_ns begin = from_ns;
    while (begin < to_ns) {
      motion_stretch piece;
      wm_time_ns end = next < count_ && at(next).t_ns < to_ns ? at(next).t_ns : to_ns;
      if (next > oldest) {
        piece.input = at(next - 1);
        const wm_time_ns held_until = piece.input.t_ns + hold_max_ns;
        piece.input.stale = begin >= held_until;
        if (!piece.input.stale && end > held_until) end = held_until;
        if (piece.input.counted) piece.input.stale = 0;  // the way is known, however long it took
        piece.silent_s = wm_seconds_between(piece.input.t_ns, begin) - due_s(next, oldest);
        piece.refused_s = piece.input.refused_s + wm_seconds_between(piece.input.t_ns, begin);
        piece.unknown_s = begin > held_until ? wm_seconds_between(held_until, begin) : 0.0;
        const bool begins = next > oldest + 1 && begin == piece.input.t_ns;
        piece.changed[0] = begins ? piece.input.a - at(next - 2).a : 0.0;
        piece.changed[1] = begins ? piece.input.b - at(next - 2).b : 0.0;
      } else {
        piece.input = motion_input{};
        piece.changed[0] = piece.changed[1] = 0.0;
        piece.silent_s = -1.0;
        piece.unknown_s = piece.refused_s = 0.0;
      }
      piece.has_next = next < count_;
      piece.dt_s = wm_seconds_between(begin, end);
      piece.first = begin == from_ns;
      piece.last = end == to_ns;
      visit(piece);
      begin = end;
      while (next < count_ && at(next).t_ns <= begin) next++;
    }
  }

 private:
  // How old the input before `next` may become before `next` is overdue.
  double due_s(uint64_t next, uint64_t oldest) const {
    if (next <= oldest + 1) return kOverdueS;
    const double usual_s = kOverduePeriods * wm_seconds_between(at(next - 2).t_ns, at(next - 1).t_ns);
    return usual_s > kOverdueS ? usual_s : kOverdueS;
  }
  const motion_input &at(uint64_t index) const { return ring_[index & (kCapacity - 1)]; }

  motion_input ring_[kCapacity];
  uint64_t count_;
};

}  // namespace wm

#endif
