// SPDX-License-Identifier: Apache-2.0
// The motion front end: takes motion events, keeps what holds (speeds, rates, wheel positions, gear), notices standing
// still and sensors that died, and hands out the motion between two times piece by piece.
#ifndef WAYMARK_ESTIMATOR_MOTION_FRONT_END_HPP
#define WAYMARK_ESTIMATOR_MOTION_FRONT_END_HPP

#include "motion/commands.hpp"
#include "motion/history.hpp"
#include "motion/plausibility.hpp"
#include "motion/step.hpp"
#include "motion/wheel.hpp"
#include "waymark/status.h"

namespace wm {

// Plain memory, no pointers but to the parameters, which outlive it.
class motion_front_end {
 public:
  void init(const wm_motion_params *params, const wm_wheels *wheels);

  // Would the event be taken? WM_UNSUPPORTED, WM_NOT_FINITE, WM_OUT_OF_RANGE, WM_TIME_RAN_BACK; changes nothing.
  wm_status check(const wm_event &event) const;
  // Takes an event that check() lets pass. Call advance() to its t_ns next.
  void feed(const wm_event &event);

  // Moves to `to_ns` (not earlier than now) and calls visit(stretch, twist, noise) for each piece on the way. The
  // calibration's lag is what the robot is late by behind its motion source; ticks are positions and have none.
  template <class Visit>
  void advance(wm_time_ns to_ns, const wm_motion_calibration &calibration, Visit visit) {
    if (to_ns <= now_ns_) return;
    walk(now_ns_, to_ns, calibration,
         [&](const motion_stretch &piece, const motion_twist &twist, const motion_noise &n) {
           if (ticks_drive() && !piece.input.stale) hand_out_ticks(piece);
           visit(piece, twist, n);
         });
    now_ns_ = to_ns;
  }

  // The same, for a look back or ahead: nothing moves.
  template <class Visit>
  void walk(wm_time_ns from_ns, wm_time_ns to_ns, const wm_motion_calibration &calibration, Visit visit) const {
    const wm_time_ns lag_ns = lag_of(calibration);
    history_.walk(from_ns - lag_ns, to_ns - lag_ns, hold_max_ns_, [&](const motion_stretch &stretch) {
      const motion_twist twist = twist_of(stretch.input, calibration, wheels_);
      motion_noise noise = noise_of(stretch.input, twist, stretch.dt_s, *params_, wheels_, calibration);
      add_silence(stretch, *params_, ticks_drive() && stretch.has_next, &noise);
      add_refused(stretch, *params_, &noise);
      if (stretch.input.command) add_change(stretch, *params_, &noise);
      visit(stretch, twist, noise);
    });
  }

  // Twist of base_link at a time, by what is known now.
  motion_twist twist_at(wm_time_ns t_ns, const wm_motion_calibration &calibration) const;

  // Twists are commands, although no parameter shows it: an estimator learns how much speed they lose in turns.
  void take_commands() { commands_ = 1; }

  void set_now(wm_time_ns t_ns) { now_ns_ = t_ns; }
  wm_time_ns now_ns() const { return now_ns_; }
  wm_time_ns newest_ns() const { return newest_ns_; }  // newest event that drives
  uint32_t health() const { return health_; }
  const wm_motion_params &params() const { return *params_; }
  const wm_wheels &wheels() const { return wheels_; }
  // How far the left and the right wheel have rolled by their counts, when the last event counted both and they are
  // what the speed comes from.
  bool counted_ways(double way_m[2]) const {
    if (!ticks_drive() || wheel_[0].t_ns != newest_ns_ || wheel_[1].t_ns != newest_ns_) return false;
    for (int side = 0; side < 2; side++) way_m[side] = wheel_[side].position_m;
    return true;
  }
  int model() const { return model_; }
  // The input that should have come by then hasn't.
  bool is_overdue(wm_time_ns t_ns) const { return history_.is_overdue(t_ns); }
  // The last event counted a wheel, and that is where the way comes from.
  bool counted() const { return ticks_drive() && (wheel_[0].t_ns == fed_ns_ || wheel_[1].t_ns == fed_ns_); }
  // True once after the speed came to be taken from another sensor, whose scale is another.
  bool speed_source_changed();
  // The last event brought a yaw rate while the robot stands: that is the gyro's bias.
  bool standstill_yaw_rate(double *yaw_rate_radps) const;

 private:
  enum { kTwistSpeed = WM_Q_COUNT, kTwistRate, kSlots };  // of check_: a slot for each quantity and these
  enum speed_source : uint8_t { kNone, kFrontWheels, kVehicleSpeed, kTicksMean, kRearWheels };

  void take_quantities(const wm_event &event);
  bool is_plausible(const wm_quantities &q, wm_time_ns t_ns);
  bool counter_is_wrong(const wm_quantities &q, wm_time_ns t_ns) const;
  bool is_plausible_count(int side, wm_time_ns t_ns, double count);
  bool is_plausible_level(int slot, wm_time_ns t_ns, double value);
  void note_period(int id, wm_time_ns t_ns, int frames);
  void note_plausibility(wm_time_ns t_ns, uint32_t slots, bool plausible);
  void mark_refused(motion_input *input) const;
  void take_count(int side, wm_time_ns t_ns, double count);
  void choose_model(bool twist);
  void watch_encoders();
  void watch_yaw_rate(wm_time_ns t_ns, double speed_mps, bool fresh);
  bool watch_standstill(wm_time_ns t_ns, bool still);
  bool read_speed(double *speed_mps);
  bool read_road_wheel(double *angle_rad) const;
  bool read_other_turn_rate(double speed_mps, double *rate_radps) const;
  double counted_turn_rate() const;
  void push_input(wm_time_ns t_ns, double a, double b, bool doubtful, bool miscounted);
  void push_ticks(wm_time_ns t_ns, bool doubtful, bool miscounted);
  void hand_out_ticks(const motion_stretch &piece);
  void forget_silent_way(wm_time_ns t_ns, double dt_s);
  bool counts_ticks() const;                               // both wheels, and what a tick is worth
  bool ticks_drive() const;                                // the way comes from ticks
  double mean_of_wheels(double left, double right) const;  // a dead encoder's wheel goes with the other one
  bool seen(int quantity) const { return stamp_ns_[quantity] != WM_TIME_NONE; }
  bool silent(int quantity, wm_time_ns t_ns) const { return t_ns - stamp_ns_[quantity] > hold_max_ns_; }
  double by_gear(double value, bool is_signed) const;
  wm_time_ns lag_of(const wm_motion_calibration &calibration) const;

  const wm_motion_params *params_;
  wm_wheels wheels_;
  wm_time_ns hold_max_ns_;
  wm_time_ns now_ns_;     // integrated until here; WM_TIME_NONE before the start
  wm_time_ns newest_ns_;  // newest event that drives
  wm_time_ns fed_ns_;     // newest event of motion
  motion_history history_;
  double value_[WM_Q_COUNT];
  wm_time_ns stamp_ns_[WM_Q_COUNT], message_ns_[WM_Q_COUNT];  // newest accepted value; newest message
  double period_s_[WM_Q_COUNT];  // usual time between two messages with that quantity; 0: unknown
  sample_check check_[kSlots];
  uint32_t refused_slots_;  // of check_: the last sample was refused
  wm_time_ns refused_since_ns_, last_refusal_ns_;
  tick_wheel wheel_[2];
  wm_time_ns still_since_ns_;  // speed below the threshold since; WM_TIME_NONE while moving
  wm_time_ns yaw_same_since_ns_;
  double yaw_last_;
  double yaw_other_min_, yaw_other_max_;  // what the other sensors made of the turn rate meanwhile
  uint32_t health_;
  uint8_t model_;
  uint8_t speed_source_;
  uint8_t speed_source_changed_;
  uint8_t commands_;         // twists are commands
  uint8_t yaw_fresh_;        // the last event brought a yaw rate
  uint8_t went_on_without_;  // a bit a wheel: others than motion moved the pose on while it was overdue; no count since
  uint8_t speed_is_signed_;  // a negative speed was seen: the sign is the sensor's, not the gear's
};

}  // namespace wm

#endif
