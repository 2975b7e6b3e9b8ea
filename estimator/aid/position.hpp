// SPDX-License-Identifier: Apache-2.0
// Positions of a receiver (GNSS) and headings (compass, two antennas) as observations of a planar filter, with their
// states: the receiver's delay, the antenna's place, the time-correlated error on each axis, the headings' bias.
#ifndef WAYMARK_ESTIMATOR_AID_POSITION_HPP
#define WAYMARK_ESTIMATOR_AID_POSITION_HPP

#include "aid/observation.hpp"
#include "aid/residual.hpp"
#include "filters/core/receiver_error.hpp"
#include "filters/planar/past_pose.hpp"

namespace wm {

// A false position lies anywhere in a square of this side, m. An order of magnitude: a factor of 10 is 2.3 nats.
inline constexpr double kClutterPlace_m = 200.0;

class position_aid {
 public:
  static constexpr int kStates = 6;  // at most
  static int count_states(const wm_setup &setup);
  // add(value, sigma) appends a state to the filter and returns its index. `at_antenna`: the filter's pose is that of
  // the antenna when a position comes, and not base_link's.
  template <class Add>
  void init(const wm_setup &setup, planar_motion *filter, Add add, bool at_antenna = false) {
    const auto pair_of = [&add](double sigma) {
      const int first = sigma > 0.0 ? add(0.0, sigma) : -1;
      if (first >= 0) add(0.0, sigma);
      return first;
    };
    const wm_position_params &params = params_ = position_params_of(setup);
    time_ = params.time_offset_sigma_s > 0.0 ? add(0.0, params.time_offset_sigma_s) : -1;
    error_ = pair_of(std::fabs(params.correlated_m));  // below 0: the first position sets its variance
    if (params.correlated_m > 0.0) filter->noise().begin_correlated(square(params.correlated_m));
    const antenna mounted = antenna_of(setup, params);
    // Without motion data the heading is that of nothing: no place in base_link is learnt.
    antenna_ = setup.motion->model == WM_MOTION_CONSTANT_VELOCITY ? -1 : pair_of(mounted.sigma_m);
    antenna_sigma_m_ = mounted.sigma_m;
    for (int i = 0; i < 2; i++) antenna_m_[i] = at_antenna ? 0.0 : mounted.place_m[i];
    heading_bias_ = params.heading_bias_sigma_rad > 0.0 ? add(0.0, params.heading_bias_sigma_rad) : -1;
    has_heading_ = has_position_ = is_awake_ = unused_ = 0;
    receiver_.begin();
  }
  const wm_position_params &params() const { return params_; }
  int error_state() const { return error_; }  // of the time-correlated error's first axis; -1: none
  bool has_position() const { return has_position_ != 0; }
  // For a filter whose states wait with variance 0 for the first position or heading, since they cost time.
  bool is_awake() const { return is_awake_ != 0; }
  void wake(planar_motion *filter);
  // What was learnt of the receiver's time-correlated error does not hold: its states begin anew.
  void release(planar_motion *filter) const;

  // ---- a position ----
  // The robot when it was measured.
  struct view {
    past_pose past;
    sin_cos h;         // of its heading
    double arm_m[2];   // the antenna's place in base_link
    double off_m[2];   // the same on the map's axes
    double bend_m[2];  // by how much the middle of the delay's chord is off the path
  };
  // The receiver's error goes on to this position; then the robot as it was.
  view look(const wm_position &p, planar_motion *filter);
  // x and y. `record`: what is known of them.
  void put_rows(const wm_position &p, const view &at, const planar_motion &filter, const wm_innovation &record,
                residual rows[2]) const;
  observation observe(const wm_position &p, const view &at, const planar_motion &filter) const;
  double lasting_error(const planar_motion &filter) const;  // over its sigma; 0 where it is no state

  // ---- a heading ----
  void put_row(const wm_heading &h, const planar_motion &filter, residual *row) const;
  observation observe(const wm_heading &h, const planar_motion &filter);

  void list(const planar_motion &filter, calibration_list *list) const;

 private:
  void carry_error(wm_time_ns t_ns, double position_sigma_m, planar_motion *filter);
  void widen_delay(const planar_motion &filter, view *at) const;
  double put_row(int axis, const view &at, const planar_motion &filter, planar_row *row) const;
  double bias(const planar_motion &filter) const { return heading_bias_ < 0 ? 0.0 : filter.value(heading_bias_); }

  wm_position_params params_;
  int time_, error_, antenna_, heading_bias_;           // states; -1: none
  int has_heading_, has_position_, is_awake_, unused_;  // has_: one has come; no padding
  double antenna_m_[2], antenna_sigma_m_;               // in base_link, without the states of its error
  receiver_error receiver_;
};

}  // namespace wm

#endif
