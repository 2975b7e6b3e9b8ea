// SPDX-License-Identifier: Apache-2.0
// The estimator contract for a class: `estimator_of<filter, params>(name, about, takes, table, reads)` gives the
// struct of functions. The filter is trivially copyable and has
//  - static size_t bytes(const params &, const wm_setup &, const char **why)
//  - void init(const params &, const wm_setup &)
//  - wm_status predict(const wm_event &)
//  - wm_status correct(const wm_event &, record_list)
//  - void estimate(wm_estimate *) const
//  - wm_motion_calibration motion_calibration() const
//  - uint32_t motion_health() const
//  - void list_calibration(calibration_list *) const
//  - where it has any: list_counters(wm_counter *, size_t), list_landmarks(), list_particles(), list_hypotheses()
//
// `keeper_of<filter, params>()` does so for a filter that keeps its map (waymark/keeper.h): kept_bytes_max(), keep(),
// why_not_kept(), take_kept(). `carrier_of<filter>()` for one that changes between floors (waymark/carrier.h): carry(),
// misfit().
#ifndef WAYMARK_ESTIMATOR_CONTRACT_HPP
#define WAYMARK_ESTIMATOR_CONTRACT_HPP

#include <type_traits>

#include "filters/core/calibration_list.hpp"
#include "filters/core/counter_list.hpp"
#include "filters/core/record_list.hpp"
#include "waymark/carrier.h"
#include "waymark/estimator.h"
#include "waymark/keeper.h"

namespace wm {

template <class filter, class params>
wm_estimator estimator_of(const char *name, const char *about, uint32_t takes, wm_param_table table,
                          const char *const *reads) {
  static_assert(std::is_trivially_copyable_v<filter>, "a copy of the state continues identically");
  wm_estimator e{};
  e.name = name;
  e.about = about;
  e.takes = takes;
  e.params = table;
  e.reads = reads;
  e.state_bytes = [](const void *p, const wm_setup *setup, const char **why) {
    return filter::bytes(*static_cast<const params *>(p), *setup, why);
  };
  e.init = [](void *state, const void *p, const wm_setup *setup) {
    static_cast<filter *>(state)->init(*static_cast<const params *>(p), *setup);
    return WM_OK;
  };
  e.predict = [](void *state, const wm_event *motion) { return static_cast<filter *>(state)->predict(*motion); };
  e.correct = [](void *state, const wm_event *event, wm_innovation *out, size_t capacity, size_t *count) {
    *count = 0;
    return static_cast<filter *>(state)->correct(*event, record_list{out, capacity, count});
  };
  e.estimate = [](const void *state, wm_estimate *out) {
    static_cast<const filter *>(state)->estimate(out);
    out->cause = out->state == WM_STATE_LOST ? WM_CAUSE_CONTRADICTED : WM_CAUSE_NONE;
    out->cause_source = -1;
  };
  e.motion = [](const void *state, wm_motion_calibration *out) {
    *out = static_cast<const filter *>(state)->motion_calibration();
  };
  e.calibration = [](const void *state, wm_calibration_value *out, size_t capacity) {
    calibration_list list(out, capacity);
    static_cast<const filter *>(state)->list_calibration(&list);
    return list.count();
  };
  e.alarms = [](const void *state, wm_alarm *out, size_t capacity) {
    calibration_list list(out, capacity);
    static_cast<const filter *>(state)->list_calibration(&list);
    return list.finish_alarms();
  };
  e.motion_health = [](const void *state) { return static_cast<const filter *>(state)->motion_health(); };
  if constexpr (requires(const filter &f) { f.list_counters(nullptr, 0); })
    e.counters = [](const void *state, wm_counter *out, size_t capacity) {
      return static_cast<const filter *>(state)->list_counters(out, capacity);
    };
  if constexpr (requires(const filter &f) { f.list_landmarks(nullptr, nullptr, 0); })
    e.landmarks = [](const void *state, wm_landmark *out, double(*covariance)[4], size_t capacity) {
      return static_cast<const filter *>(state)->list_landmarks(out, covariance, capacity);
    };
  if constexpr (requires(const filter &f) { f.list_particles(nullptr, 0); })
    e.particles = [](const void *state, wm_particle *out, size_t capacity) {
      return static_cast<const filter *>(state)->list_particles(out, capacity);
    };
  if constexpr (requires(const filter &f) { f.list_hypotheses(nullptr, 0); })
    e.hypotheses = [](const void *state, wm_hypothesis *out, size_t capacity) {
      return static_cast<const filter *>(state)->list_hypotheses(out, capacity);
    };
  return e;
}

template <class filter, class params>
constexpr wm_keeper keeper_of() {
  return {[](const void *p, const wm_setup *setup) {
            return filter::kept_bytes_max(*static_cast<const params *>(p), *setup);
          },
          [](const void *state, void *out, size_t capacity) {
            return static_cast<const filter *>(state)->keep(out, capacity);
          },
          [](const void *p, const wm_setup *setup, const void *image, size_t bytes) {
            return filter::why_not_kept(*static_cast<const params *>(p), *setup, image, bytes);
          },
          [](void *state, const void *image, size_t) { static_cast<filter *>(state)->take_kept(image); }};
}

template <class filter>
constexpr wm_carrier carrier_of() {
  return {[](void *to, const void *from, const wm_pose2 *by) {
            static_cast<filter *>(to)->carry(*static_cast<const filter *>(from), by);
          },
          [](const void *state) { return static_cast<const filter *>(state)->misfit(); }};
}

}  // namespace wm

#endif
