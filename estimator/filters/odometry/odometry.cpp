// SPDX-License-Identifier: Apache-2.0
// Dead reckoning as an estimator: motion alone, with its covariance. The baseline for all others.
#include <limits>

#include "filters/core/contract.hpp"
#include "filters/core/counter_list.hpp"
#include "filters/planar/planar_filter.hpp"
#include "filters/planar/set_pose.hpp"
#include "filters/registry.h"

namespace wm {
namespace {

struct odometry_params {};
const wm_param_old kOld[] = {{"states.*", "/motion.states.*", nullptr}, {nullptr, nullptr, nullptr}};
const char *const kReads[] = {"!motion.constant_velocity.", "!motion.noise.adapt", "motion.", nullptr};

class odometry {
 public:
  static size_t bytes(const odometry_params &, const wm_setup &setup, const char **why) {
    if (setup.motion->model != WM_MOTION_CONSTANT_VELOCITY) return sizeof(odometry);
    *why = "dead reckoning needs motion data";
    return 0;
  }

  void init(const odometry_params &, const wm_setup &setup) {
    setup_ = &setup;
    const wm_motion_states &states = setup.motion->states;
    filter_.init(setup, states, kPoseStates + planar_filter::count_motion_states(states, setup.motion->model));
    searching_ = !start_is_known(setup.start);
    resets_ = 1;
  }

  wm_status predict(const wm_event &motion) {
    const wm_status status = filter_.check_motion(motion);
    if (status == WM_OK) filter_.move(motion);
    return status;
  }

  wm_status correct(const wm_event &event, record_list) {
    wm_status status = WM_UNSUPPORTED;
    if (event.kind == WM_EVENT_SET_POSE) {
      status = set_pose(filter_, event);
      if (status == WM_OK) searching_ = false;
    } else if (event.kind == WM_EVENT_RESET) {
      status = reset_pose(filter_, setup_->start, event.t_ns);
      if (status == WM_OK) searching_ = !start_is_known(setup_->start);
    }
    if (status == WM_OK) resets_++;
    return status;
  }

  void estimate(wm_estimate *out) const {
    filter_.estimate(out);
    out->resets = resets_;
    out->state = searching_ ? WM_STATE_SEARCHING : WM_STATE_DEAD_RECKONING;
    // Without observations nothing contradicts the pose.
    out->lost_probability = searching_ ? 1.0 : std::numeric_limits<double>::quiet_NaN();
  }
  const wm_motion_calibration &motion_calibration() const { return filter_.calibration(); }
  uint32_t motion_health() const { return filter_.motion_health(); }
  size_t list_counters(wm_counter *out, size_t capacity) const {
    counter_list list(out, capacity);
    list.add(WM_COUNTER_MOTION_OUTLIERS, filter_.motion_outliers());
    return list.count();
  }
  void list_calibration(calibration_list *list) const { filter_.list_motion_states(list); }

 private:
  planar_filter_of<kPoseStates + kCalibrationCount + 2> filter_;  // 2: the wheels' heading and difference
  const wm_setup *setup_;
  uint32_t resets_;
  bool searching_;
};

}  // namespace
}  // namespace wm

const wm_estimator wm_odometry_estimator = wm::estimator_of<wm::odometry, wm::odometry_params>(
    "odometry", "Dead reckoning from the motion sensors alone, with its growing covariance. Takes no observation.",
    WM_EVENT_BIT(WM_EVENT_SET_POSE) | WM_EVENT_BIT(WM_EVENT_RESET), {nullptr, 0, 0, wm::kOld}, wm::kReads);
