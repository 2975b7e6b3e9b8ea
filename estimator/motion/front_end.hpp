// SPDX-License-Identifier: Apache-2.0
// The motion front end: takes motion events, keeps the values that hold (speeds, rates, wheel positions, gear), detects
// standstill and faulty sensors, and gives the motion between two times in segments of constant twist.
#ifndef WAYMARK_ESTIMATOR_MOTION_FRONT_END_HPP
#define WAYMARK_ESTIMATOR_MOTION_FRONT_END_HPP

#include "motion/commands.hpp"
#include "motion/history.hpp"
#include "motion/motion_kind.hpp"
#include "motion/plausibility.hpp"
#include "motion/repeated_value.hpp"
#include "motion/step.hpp"
#include "motion/wheel.hpp"
#include "waymark/status.h"

namespace wm {

// Bits of quantities.
constexpr uint32_t quantity_bit(int id) { return UINT32_C(1) << id; }
constexpr uint32_t quantity_bits(int first, int last) { return quantity_bit(last + 1) - quantity_bit(first); }
inline constexpr uint32_t kCounts = quantity_bits(WM_Q_WHEEL_TICKS_LEFT, WM_Q_WHEEL_TICKS_RIGHT);
inline constexpr uint32_t kSpeeds = quantity_bits(WM_Q_WHEEL_SPEED_FRONT_LEFT, WM_Q_VEHICLE_SPEED);
inline constexpr uint32_t kSteering = quantity_bits(WM_Q_STEERING_WHEEL, WM_Q_STEERING_ACTUATOR);
constexpr bool is_count(int id) { return (kCounts & quantity_bit(id)) != 0; }
inline constexpr double kPeriodGain = 1.0 / 16.0;  // of the average of a message's period

struct sample_age {
  double age_s, due_s;
  bool is_overdue() const { return age_s > due_s; }
};

// Plain memory, no pointers but to the parameters, which outlive it.
class motion_front_end {
 public:
  // `rig`: what the recording states of its twists in space; nullptr: nothing.
  void init(const wm_motion_params *params, const wm_wheels *wheels, const wm_rig *rig = nullptr);

  // Would the event be taken? WM_UNSUPPORTED, WM_NOT_FINITE, WM_OUT_OF_RANGE, WM_TIME_RAN_BACK; changes nothing.
  wm_status check(const wm_event &event) const;
  // Takes an event that check() lets pass. Call advance() to its t_ns next.
  void feed(const wm_event &event);

  // Moves to `to_ns` (not earlier than now) and calls visit(segment, twist, noise) for each segment until then. The
  // calibration's lag is the delay of the motion behind its samples; ticks are positions and have none.
  template <class Visit>
  void advance(wm_time_ns to_ns, const wm_motion_calibration &calibration, Visit visit) {
    if (to_ns <= now_ns_) return;
    walk(now_ns_, to_ns, calibration,
         [&](const motion_segment &segment, const motion_twist &twist, const motion_noise &n) {
           if (ticks_drive() && !segment.input.stale) note_integrated(segment);
           visit(segment, twist, n);
         });
    now_ns_ = to_ns;
    if (wrapped_ns_ == to_ns) drop_wrapped_distance();
  }

  // The same for any interval, past or future; the state stays.
  template <class Visit>
  void walk(wm_time_ns from_ns, wm_time_ns to_ns, const wm_motion_calibration &calibration, Visit visit) const {
    walk(from_ns, to_ns, calibration, position_m2_, visit);
  }

  // The same where the position's variance at from_ns is not the present one.
  template <class Visit>
  void walk(wm_time_ns from_ns, wm_time_ns to_ns, const wm_motion_calibration &calibration, double position_m2,
            Visit visit) const {
    const wm_time_ns lag_ns = lag_of(calibration);
    history_.walk(from_ns - lag_ns, to_ns - lag_ns, hold_max_ns_, [&](motion_segment &segment) {
      if (segment.input.command) respond(*params_, calibration, wheels_, &segment);
      motion_twist twist = twist_of(segment.input, calibration, wheels_, segment.drive);
      if (segment.input.model == WM_MOTION_CONSTANT_VELOCITY) static_cast<planar_twist &>(twist) = velocity_;
      motion_noise noise = noise_of(segment.input, twist, segment.dt_s, *params_, wheels_, calibration,
                                    stated_noise_now(), noise_factors_);
      add_overdue_noise(segment, *params_, counts_give_way(segment), position_m2, &noise);
      add_refused_noise(segment, *params_, &noise);
      if (distrusted_) add_distrusted_noise(segment, twist, &noise);
      if (segment.input.command) add_change_noise(segment, *params_, &noise);
      if (segment.held_s == 0.0) add_sampling_noise(segment.input, &noise);
      const bool is_twist = segment.input.model == WM_MOTION_TWIST || segment.input.model == WM_MOTION_SPEED_YAW_RATE;
      if (segment.input.side_mps != 0.0 && is_twist && !has_own_axes(segment.input)) turn_to_axes(twist, &noise);
      add_center_noise(calibration, &noise);
      visit(segment, twist, noise);
    });
  }

  // Twist of base_link at a time, by the inputs until now.
  motion_twist twist_at(wm_time_ns t_ns, const wm_motion_calibration &calibration) const;

  // Whether an estimator takes twists as commands, although no parameter shows it: by the loss of speed in turns that
  // it estimates. It may find out later that they are measured.
  void take_commands(bool are) { commands_ = (uint8_t)((commands_ & ~kTaken) | (are ? kTaken : 0)); }

  void set_now(wm_time_ns t_ns) {
    now_ns_ = t_ns;
    if (model_ == WM_MOTION_CONSTANT_VELOCITY && history_.empty()) begin_velocity();
  }
  // The velocity of WM_MOTION_CONSTANT_VELOCITY, on the map's axes: the estimator's states.
  void set_velocity(const planar_twist &velocity) { velocity_ = velocity; }
  const planar_twist &velocity() const { return velocity_; }
  // The position's present variance, by which corrections bound the noise of a motion that is unknown; before the
  // first call it grows without them.
  void set_position_variance(double variance_m2) { position_m2_ = variance_m2; }
  void set_noise_factors(const noise_factors &factors) { noise_factors_ = factors; }
  // The wheels are found to lie, or are not: the speed is unknown meanwhile.
  void distrust(bool lie) { distrusted_ = static_cast<uint8_t>(lie); }
  // The speed is that of wheels that roll: measured, not commanded, and not another program's.
  bool are_wheels() const { return !commands_ && model_ >= WM_MOTION_TICKS && model_ <= WM_MOTION_TWIST; }
  wm_time_ns now_ns() const { return now_ns_; }
  wm_time_ns newest_ns() const { return newest_ns_; }  // newest event that the model uses
  uint32_t health() const { return health_; }
  uint64_t outliers() const { return outliers_; }  // messages refused as implausible
  const wm_motion_params &params() const { return *params_; }
  const wm_wheels &wheels() const { return wheels_; }
  // Distance of the left and the right wheel since the start by their counts. False: the last event did not count both,
  // or the speed is not theirs.
  bool wheel_distances(double distance_m[2]) const {
    if (!ticks_drive() || wheel_[0].t_ns != newest_ns_ || wheel_[1].t_ns != newest_ns_) return false;
    for (int side = 0; side < 2; side++) distance_m[side] = wheel_[side].position_m;
    return true;
  }
  int model() const { return model_; }
  motion_kind kind() const;
  // The next input of any kind is overdue at that time.
  // Since when the path is known; WM_TIME_NONE: no motion has come.
  wm_time_ns known_since_ns(const wm_motion_calibration &c) const {
    return history_.empty() ? WM_TIME_NONE : history_.oldest_ns() + lag_of(c);
  }
  bool is_overdue(wm_time_ns t_ns) const { return model_ != WM_MOTION_CONSTANT_VELOCITY && history_.is_overdue(t_ns); }
  // Sigmas of the speed and the turn rate of one period by the counts' steps; 0 where no counts drive.
  void count_noise(double *speed_mps, double *turn_rate_radps) const;
  // Variances of the way and of the rotation at `t_ns` by the steps of the newest counts; 0 where no counts drive.
  void count_variances(wm_time_ns t_ns, double *way_m2, double *turn_rad2) const;
  // The last event counted a wheel, and the distance is the counted one.
  bool counted() const {
    return ticks_drive() && !counts_wrapped() && (wheel_[0].t_ns == fed_ns_ || wheel_[1].t_ns == fed_ns_);
  }
  // The last event had counts whose differences to those before are unknown.
  bool counts_wrapped() const { return wrapped_ns_ != WM_TIME_NONE && wrapped_ns_ == fed_ns_; }
  // True once after the speed's source changed to another sensor, with another scale.
  bool speed_source_changed();
  // No speed since standstill.after_s.
  bool stands(wm_time_ns t_ns) const {
    return still_since_ns_ != WM_TIME_NONE && !distrusted_ &&
           wm_seconds_between(still_since_ns_, t_ns) >= params_->standstill_after_s;
  }
  // The yaw rate of the last event at standstill, which is the gyro's bias. False: none.
  bool standstill_yaw_rate(double *yaw_rate_radps) const;

 private:
  enum { kTwistSpeed = WM_Q_COUNT, kTwistRate, kTwistSide, kSlots };  // of check_: a slot for each quantity and these
  enum : uint8_t { kStated = 1, kDetected = 2, kTaken = 4 };          // of commands_
  enum speed_source : uint8_t { kNone, kFrontWheels, kVehicleSpeed, kTicksMean, kRearWheels, kOfTwist };

  void take_quantities(const wm_event &event);
  planar_twist measured_twist(const wm_event &event) const;
  void take_twist(const wm_event &event);
  void take_twist_beside_gyro(wm_time_ns t_ns, const planar_twist &sample);
  bool drives_sideways() const {
    return params_->states.drive == WM_DRIVE_HOLONOMIC && (model_ == WM_MOTION_TWIST || speed_source_ == kOfTwist);
  }
  void take_increment(const wm_event &event);
  wm_status check_increment(const wm_event &event) const;
  stated_noise stated_noise_now() const;
  void watch_plane(wm_time_ns t_ns, const wm_twist6 &twist);
  void push_quantities(wm_time_ns t_ns, uint32_t fresh, bool frozen, bool refused);
  void push_speed_and_rate(wm_time_ns t_ns, double speed_mps, bool frozen, bool refused);
  bool is_plausible(const wm_quantities &q, wm_time_ns t_ns);
  bool counter_is_wrong(const wm_quantities &q, wm_time_ns t_ns) const;
  // `bound`: this fraction of the limits.
  bool is_plausible_count(int side, wm_time_ns t_ns, double count, double bound);
  bool is_plausible_level(int slot, wm_time_ns t_ns, double value, double bound = 1.0);
  void note_period(int id, wm_time_ns t_ns, int frames);
  void note_plausibility(wm_time_ns t_ns, uint32_t slots, bool plausible);
  void mark_refused(motion_input *input) const;
  void take_count(int side, wm_time_ns t_ns, double count);
  void choose_model(uint32_t kinds);
  void watch_encoders();
  bool twist_gives_speed() const;
  bool gyro_is_alive() const;
  // The age of the newest sample, of `first` or `last`, and the age at which the next one is overdue.
  sample_age age_of(int first, int last, wm_time_ns t_ns) const;
  sample_age age_of_speed(wm_time_ns t_ns) const;
  sample_age age_of_steering(wm_time_ns t_ns) const;
  bool wheels_stand_in(bool steering) const;
  bool twist_stands_in() const { return model_ == WM_MOTION_TWIST && speed_source_ == kOfTwist; }
  // Counts have come since, which give the distance; not where the gyro's inputs alone are newer.
  bool counts_give_way(const motion_segment &segment) const {
    const motion_input &input = segment.input;
    return ticks_drive() && segment.has_next && !input.uncounted && (input.counted || !(input.age_s[0] > 0.0F));
  }
  void note_ages(motion_input *input) const;
  void note_steady(motion_input *input) const;
  void note_silence(wm_time_ns t_ns);
  void stand_in(wm_time_ns t_ns, double speed_mps, double turn_radps);
  bool is_still(double speed_mps) const;
  void watch_yaw_rate(wm_time_ns t_ns, double speed_mps, bool fresh);
  bool watch_standstill(wm_time_ns t_ns, bool still);
  bool read_speed(double *speed_mps);
  double behind_front_wheels(double front_mps) const;
  bool read_road_wheel(double *angle_rad) const;
  bool read_other_turn_rate(double speed_mps, double *rate_radps) const;
  double counted_turn_rate() const;
  bool read_rear_turn_rate(double *rate_radps) const;
  void leave_gyro();
  void begin_velocity();
  void push_input(wm_time_ns t_ns, double a, double b, bool doubtful, bool miscounted, double side_mps = 0.0,
                  bool beside_gyro = false);
  void push_ticks(wm_time_ns t_ns, bool doubtful, bool miscounted);
  void note_samples(motion_input *input);
  void note_holonomic(motion_input *input);
  void note_integrated(const motion_segment &segment);
  void drop_silent_distance(wm_time_ns t_ns, double dt_s);
  void take_wrapped(const wm_quantities &q, wm_time_ns t_ns);
  void drop_wrapped_distance();
  bool counts_ticks() const;                               // both wheels, and a tick's length is known
  bool ticks_drive() const;                                // the distance comes from ticks
  double mean_of_wheels(double left, double right) const;  // a dead encoder's wheel rolls like the other one
  bool seen(int quantity) const { return stamp_ns_[quantity] != WM_TIME_NONE; }
  bool silent(int quantity, wm_time_ns t_ns) const { return t_ns - stamp_ns_[quantity] > hold_max_ns_; }
  double by_gear(double value, bool is_signed) const;
  wm_time_ns lag_of(const wm_motion_calibration &calibration) const;

  const wm_motion_params *params_;
  wm_wheels wheels_;
  wm_time_ns hold_max_ns_;
  wm_time_ns now_ns_;      // integrated until here; WM_TIME_NONE before the start
  wm_time_ns newest_ns_;   // newest event that the model uses
  wm_time_ns fed_ns_;      // newest event of motion
  wm_time_ns wrapped_ns_;  // newest counts that may have wrapped in a silence
  double position_m2_;     // variance of the position, of all axes together
  motion_history history_;
  double value_[WM_Q_COUNT];
  wm_time_ns stamp_ns_[kSlots], message_ns_[kSlots];  // newest accepted value; newest message
  double period_s_[kSlots];                           // usual time between two messages with that quantity; 0: unknown
  sample_check check_[kSlots];
  command_detector twists_;
  uint32_t refused_slots_;  // of check_: the last sample was refused
  wm_time_ns refused_since_ns_, last_refusal_ns_;
  tick_wheel wheel_[2];
  planar_twist velocity_;
  noise_factors noise_factors_;
  wm_time_ns increment_ns_;                     // end of the newest increment; WM_TIME_NONE: none came
  wm_time_ns off_plane_since_ns_[3];            // rising, rolling, pitching; WM_TIME_NONE: it doesn't
  double off_plane_[3];                         // the last such value
  double stated_v_mps_[3], stated_w_radps_[3];  // sigmas of a twist in space; NaN: not stated
  double twist_period_s_;                       // usual time between two twists; 0: unknown
  wm_time_ns twist_ns_;
  planar_twist twist_;          // the newest plausible one
  wm_time_ns twist_sample_ns_;  // stamp of the newest twist, whatever model drives
  double change2_[3];           // of a holonomic twist: mean square of the changes less the samples' noise
  wm_time_ns sampled_ns_[2];    // newest sample of the speed and of the turn rate that the model uses
  wm_time_ns still_since_ns_;   // speed below the threshold since; WM_TIME_NONE while moving
  double still_apart_m_;        // the wheels' difference then
  // While the gyro's value has the same bits.
  struct yaw_watch : repeated_value {
    wm_time_ns moved_ns;   // the newest sample at which the robot moved
    double explained_rad;  // of the turn by the other sensor less the gyro's, by that sensor's errors
  } yaw_watch_;
  double wheel_mps_;         // newest speed of the faster wheel, along it
  double missed_turn_rad2_;  // variance of the heading for the next input: what the gyro has missed
  double stand_in_rad_;      // error of the heading since the wheels' difference stands in for the gyro
  uint64_t outliers_;
  uint32_t health_;
  uint8_t model_;
  uint8_t speed_source_;
  uint8_t speed_source_changed_;
  uint8_t lacks_rate_;                 // the newest twist does not measure the turn
  uint8_t commands_;                   // twists are commands: why
  uint8_t twists_in_space_;            // the newest twist had six components
  uint8_t increments_are_calibrated_;  // the newest increment had a covariance
  uint8_t yaw_fresh_;                  // the last event brought a yaw rate
  uint8_t observed_without_;  // per wheel: observations corrected the pose while counts were missing; no count since
  uint8_t speed_is_signed_;   // a negative speed came: the sign is the sensor's, not the gear's
  uint8_t distrusted_;        // the wheels are found to lie
};

}  // namespace wm

#endif
