// SPDX-License-Identifier: Apache-2.0
// Poses of another localizer (a lidar's, a visual odometry, a second robot program) as observations of a planar filter.
// In the map's frame they are observations of the pose with a time-correlated error: a localizer is a filter itself. In
// a frame of their own its place in the map is unknown: three states hold base_link's pose in map by the localizer.
// They follow the motion between two of its poses, and drift with the distance. So only this motion is observed.
// Whether the localizer is wrong is a hypothesis with a probability of its own: it is not followed while it is likely,
// and is again when its poses fit.
#ifndef WAYMARK_ESTIMATOR_AID_LOCALIZER_HPP
#define WAYMARK_ESTIMATOR_AID_LOCALIZER_HPP

#include "aid/observation.hpp"
#include "aid/residual.hpp"
#include "filters/core/evidence.hpp"
#include "filters/core/landmark_evidence.hpp"
#include "filters/core/state_pool.hpp"
#include "filters/planar/past_pose.hpp"
#include "sensors/localizer_params.h"
#include "sensors/shared_params.hpp"

namespace wm {

class localizer_aid {
 public:
  static constexpr int kStates = 3, kRows = 3;
  // A false pose lies anywhere in a square of this side, m, with any heading.
  static constexpr double kClutterPlace_m = 200.0;

  static int count_states(const wm_setup &setup) {
    const wm_localizer_params p = localizer_params_of(setup);
    return p.frame == WM_LOCALIZER_IN_OWN_FRAME || p.lasting > 0.0 ? kStates : 0;
  }
  // add(value, sigma) appends a state to the filter and returns its index. The states wait with variance 0.
  template <class Add>
  void init(const wm_setup &setup, planar_motion *filter, Add add) {
    params_ = localizer_params_of(setup);
    const int count = count_states(setup);
    first_ = count > 0 ? add(0.0, 1.0) : -1;
    for (int k = 1; k < count; k++) add(0.0, 1.0);
    for (int k = 0; k < count; k++) filter->forget(first_ + k, 0.0, 0.0);
    newest_ns_ = kept_ns_ = checked_ns_ = WM_TIME_NONE;
    jumps_ = 0;
    distrusted_s_ = 0.0;
    release();
  }
  bool is_in_map() const { return params_.frame == WM_LOCALIZER_IN_MAP; }
  int key() const { return is_in_map() ? kLocalizerKey : kNoKey; }  // of the evidence for the robot's own pose
  bool is_used() const { return newest_ns_ != WM_TIME_NONE; }
  bool places() const { return is_in_map() && is_used(); }

  // A pose on its way to the filter.
  struct view {
    past_pose past;      // the robot when it was measured
    wm_pose2 there;      // base_link in map by the localizer
    double axis[2];      // cos and sin of the direction of its ellipse's first axis in map
    double variance[3];  // along that axis, across, of the heading
    double weight;       // of its evidence: poses nearer in time share their errors
    double follows;      // share by which the error of a wrong localizer is followed
    int rows;            // 2: it has no heading
    bool is_new;         // it shares its errors with none that was kept for the search
    double clutter_volume() const { return kClutterPlace_m * kClutterPlace_m * (rows == kRows ? kTwoPi : 1.0); }
  };
  // False: nothing is to be fused, since an own frame begins with it.
  bool look(const wm_localized &seen, planar_motion *filter, view *out);
  void put_rows(const view &at, const planar_motion &filter, const wm_innovation &record, residual rows[kRows]) const;
  // Whether the search of a pose may use it.
  bool is_for_search(const view &at, bool tracking) const {
    return is_in_map() && at.is_new && !(tracking && is_wrong_);
  }
  // Of one pose in map, in m^2 (k 0 and 1, the longer axis of its ellipse) or rad^2 (2).
  double variance(int k, const view &at) const {
    return at.variance[k < 2 ? 0 : 2] + (first_ >= 0 ? lasting_variance_[k] : 0.0);
  }
  observation observe(const view &at, const planar_motion &filter) const;
  observation observe_heading(const view &at, const planar_motion &filter) const;

  // Weighs whether the localizer is wrong by these rows, before they are fused. False: they are not to be. Where it was
  // followed although it had drifted off, that is taken back.
  bool is_trusted(const view &at, const residual rows[kRows], planar_motion *filter);
  // The robot's own pose was another one: what was learnt of the localizer by it does not hold.
  void release() {
    has_begun_ = is_wrong_ = 0;
    wrong_.reset(kRight);
  }

  void list(calibration_list *list) const;

 private:
  // Log odds of a wrong localizer: at first (2 %), from where on it is not followed (88 %) and is again (12 %).
  static constexpr double kRight = -4.0, kWrong = 2.0, kRightAgain = -2.0;

  bool begin_frame(const wm_pose2 &now, const view &at, planar_motion *filter);
  void carry_frame(const wm_pose2 &now, planar_motion *filter);
  void carry_error(double dt_s, const double stated[3], planar_motion *filter);
  // Of the error that the localizer's poses have in common, or else of their own.
  double own_variance(int i, const residual &row) const {
    return is_in_map() && first_ >= 0 ? lasting_variance_[i] : row.noise;
  }
  double log_density(const view &at, const residual rows[kRows], const double off[kRows], double wider,
                     const planar_motion &filter, double *nis) const;
  double log_bayes_of_wrong(const view &at, const residual rows[kRows], const planar_motion &filter, double *nis);
  bool has_drifted_off(planar_motion *filter);

  wm_localizer_params params_;
  int first_, has_begun_;                        // of its states; -1: none
  int is_wrong_, jumps_;                         // jumps_: how often an own frame began anew
  double reset_;                                 // of the newest pose
  double distrusted_s_;                          // for so long in all it was not followed
  double lasting_variance_[3];                   // of the states of its error in map
  double off_[kRows];                            // the innovations, which a wrong one is off by
  wm_pose2 newest_;                              // in the localizer's frame
  wm_time_ns newest_ns_, kept_ns_, checked_ns_;  // kept: the last one for the search
  evidence wrong_;
};

}  // namespace wm

#endif
