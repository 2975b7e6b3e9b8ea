// SPDX-License-Identifier: Apache-2.0
// Gating and its record. A measurement's normalised innovation squared (NIS) is held against a soft and a hard gate.
// Between the two its noise is inflated by nis/soft, as a Student distribution's tails would weigh it; above the hard
// gate it is an outlier. The gates are stated for two degrees of freedom and scaled by the 99 % quantiles of chi2.
#ifndef WAYMARK_ESTIMATOR_CORE_GATE_HPP
#define WAYMARK_ESTIMATOR_CORE_GATE_HPP

#include "filters/core/record_list.hpp"
#include "waymark/event.h"
#include "waymark/status.h"

namespace wm {

// 99 % quantiles of chi2 by degrees of freedom, over that of two (9.210).
inline double gate_scale(int dof) {
  // 0 to 4 degrees of freedom.
  constexpr double kQuantile[5] = {0.0, 6.635 / 9.210, 1.0, 11.345 / 9.210, 13.277 / 9.210};
  return kQuantile[dof];
}

struct gate_limits {
  double soft, hard;  // of two degrees of freedom
};

struct gate_result {
  double nis, limit;   // the hard gate as scaled for the degrees of freedom
  double noise_scale;  // >= 1: times the measurement's variance, when fused
  bool passed, soft;   // soft: above the soft gate
};

// NaN does not pass.
inline gate_result gate(double nis, int dof, const gate_limits &limits) {
  const double scale = gate_scale(dof), soft = limits.soft * scale, hard = limits.hard * scale;
  return {nis, hard, nis > soft ? nis / soft : 1.0, nis <= hard, nis > soft};
}

// The record of an event's update before anything is known of it.
inline wm_innovation record_of(const wm_event &event, wm_residual kind) {
  wm_innovation r{};
  r.t_ns = event.t_ns;
  r.source = event.source;
  r.landmark_id = -1;
  r.residual = static_cast<uint8_t>(kind);
  return r;
}

// Writes what the gate found into the record. `variance`: of this component's innovation.
inline void put_gate(const gate_result &g, int dof, double variance, wm_verdict verdict, wm_innovation *record) {
  record->variance = variance;
  record->nis = g.nis;
  record->gate = g.limit;
  record->gate_dof = static_cast<uint8_t>(dof);
  record->verdict = static_cast<uint8_t>(verdict);
}

// An observation that is not fused leaves its record; the event itself is in order.
inline wm_status reject(record_list records, wm_innovation record, wm_verdict verdict) {
  record.verdict = static_cast<uint8_t>(verdict);
  records.add(record);
  return WM_OK;
}

// A datum that is refused leaves its record, too.
inline wm_status refuse(record_list records, const wm_innovation &record, wm_status status) {
  (void)reject(records, record, status == WM_NOT_FINITE ? WM_REJECTED_NOT_FINITE : WM_REJECTED_OUT_OF_RANGE);
  return status;
}

}  // namespace wm

#endif
