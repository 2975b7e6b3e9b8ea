// SPDX-License-Identifier: Apache-2.0
// Dead reckoning as an estimator: motion alone, with an honest covariance. The baseline that every other is set
// against.
#include <cstring>

#include "filters/planar/planar_filter.hpp"
#include "filters/planar/set_pose.hpp"
#include "filters/registry.h"

namespace {

struct odometry_params {
  wm_motion_states states;
};

const wm_param kParams[] = {WM_MOTION_STATE_PARAMS(odometry_params, states)};

struct odometry_state {
  wm::planar_filter filter;
  const wm_setup *setup;
  wm_motion_states states;
  uint32_t resets;
  uint8_t searching;
};

odometry_state &of(void *state) { return *static_cast<odometry_state *>(state); }
const odometry_state &of(const void *state) { return *static_cast<const odometry_state *>(state); }

size_t state_bytes(const void *, const wm_setup *, const char **) { return sizeof(odometry_state); }

wm_status init(void *state, const void *params, const wm_setup *setup) {
  std::memset(state, 0, sizeof(odometry_state));
  odometry_state &self = of(state);
  self.setup = setup;
  self.states = static_cast<const odometry_params *>(params)->states;
  self.filter.init(*setup, self.states);
  self.searching = !wm::start_is_known(setup->start);
  self.resets = 1;
  return WM_OK;
}

wm_status predict(void *state, const wm_event *motion) {
  const wm_status status = of(state).filter.check_motion(*motion);
  if (status == WM_OK) of(state).filter.move(*motion);
  return status;
}

wm_status correct(void *state, const wm_event *event, wm_innovation *, size_t, size_t *count) {
  odometry_state &self = of(state);
  *count = 0;
  wm_status status = WM_UNSUPPORTED;
  if (event->kind == WM_EVENT_SET_POSE) {
    status = wm::set_pose(self.filter, *event);
    if (status == WM_OK) self.searching = 0;
  } else if (event->kind == WM_EVENT_RESET) {
    status = wm::reset_pose(self.filter, self.setup->start, event->t_ns);
    if (status == WM_OK) self.searching = !wm::start_is_known(self.setup->start);
  }
  if (status == WM_OK) self.resets++;
  return status;
}

void estimate(const void *state, wm_estimate *out) {
  const odometry_state &self = of(state);
  self.filter.estimate(out);
  out->resets = self.resets;
  out->state = self.searching ? WM_STATE_SEARCHING : WM_STATE_DEAD_RECKONING;
}

void motion(const void *state, wm_motion_calibration *out) { *out = of(state).filter.calibration(); }

size_t calibration(const void *state, wm_calibration_value *out, size_t capacity) {
  return of(state).filter.list_calibration(out, capacity);
}

uint32_t motion_health(const void *state) { return of(state).filter.motion_health(); }

}  // namespace

const wm_estimator wm_odometry_estimator = {
    "odometry",
    "Dead reckoning from the motion sensors alone, with its growing covariance. Takes no observation.",
    WM_EVENT_BIT(WM_EVENT_SET_POSE) | WM_EVENT_BIT(WM_EVENT_RESET),
    {kParams, sizeof kParams / sizeof kParams[0], sizeof(odometry_params)},
    state_bytes,
    init,
    predict,
    correct,
    estimate,
    motion,
    calibration,
    motion_health,
    nullptr,
    nullptr};
