// SPDX-License-Identifier: Apache-2.0
// The monitor of innovations alone, with an estimator of which only the estimate and its innovations are given.
#pragma once

#include <cmath>
#include <initializer_list>

#include "waymark/health.h"
#include "waymark/monitor.h"

inline wm_innovation record_of(wm_verdict verdict, double sigmas) {
  wm_innovation out{};
  out.residual = WM_RESIDUAL_RANGE;
  out.verdict = static_cast<uint8_t>(verdict);
  out.observed = 0.1 * sigmas;
  out.variance = 0.01;
  return out;
}

// Seconds of an estimator that gives this estimate and these innovations, ten times a second.
struct lone {
  wm_monitor monitor;
  wm_setup setup{};
  wm_landmark landmark{};
  wm_raster map{};
  wm_estimate estimate{};
  wm_alarm alarm{};
  bool has_alarm = false;
  wm_time_ns now_ns = 0;

  explicit lone(bool has_landmarks, bool has_map = false) {
    setup.landmarks = &landmark;
    setup.landmark_count = has_landmarks;
    map.width_px = map.height_px = 100;
    map.resolution_m = 0.1;
    if (has_map) setup.map = &map;
    wm_monitor_init(&monitor, &setup, 1);
    estimate.state = WM_STATE_TRACKING;
    estimate.lost_probability = NAN;
    for (int axis : {0, 1, 5}) estimate.covariance[wm_cov_index(axis, axis)] = 0.01;
  }
  // `see`: calls its second argument with the records of each observation, by the number of the step.
  template <class See>
  wm_estimate observe(double seconds, wm_event_kind kind, See see) {
    wm_estimate out = estimate;
    const auto take = [&](wm_event_kind of, const wm_innovation *records, size_t count) {
      wm_event e{};
      e.kind = static_cast<uint8_t>(of);
      e.t_ns = out.t_ns = now_ns;
      e.as.position.sigma_xy_m = NAN;
      if (wm_monitor_take(&monitor, &e, records, count)) wm_monitor_step(&monitor, &out, &alarm, has_alarm);
    };
    for (const wm_time_ns until_ns = now_ns + wm_ns_from_seconds(seconds); now_ns < until_ns;
         now_ns += 100 * WM_NS_PER_MS) {
      out = estimate;
      see(static_cast<int>(now_ns / (100 * WM_NS_PER_MS)),
          [&](std::initializer_list<wm_innovation> records) { take(kind, records.begin(), records.size()); });
      take(WM_EVENT_TWIST2, nullptr, 0);
      wm_monitor_judge(&monitor, &out);
    }
    return out;
  }
  // One observation, of an estimate that is given with it.
  wm_estimate see(const wm_event &e, wm_estimate out, const wm_innovation &record, bool has_record = true) {
    out.t_ns = e.t_ns;
    if (wm_monitor_take(&monitor, &e, &record, has_record)) wm_monitor_step(&monitor, &out, nullptr, 0);
    wm_monitor_judge(&monitor, &out);
    return out;
  }
  wm_estimate drive(double seconds, wm_verdict verdict) {
    return observe(seconds, WM_EVENT_SIGHTING,
                   [&](int step, auto take) { take({record_of(verdict, step % 2 ? 0.8 : -0.8)}); });
  }
};
