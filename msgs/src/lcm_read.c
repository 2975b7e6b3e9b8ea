// SPDX-License-Identifier: Apache-2.0
// Messages of a run, read again.
#include <string.h>

#include "lcm_bytes.h"
#include "waymark/lcm_messages.h"
#include "waymark_bound_t.h"
#include "waymark_health_t.h"
#include "waymark_innovation_t.h"
#include "waymark_pose_t.h"
#include "waymark_refused_t.h"

const char *wm_lcm_read_pose(const void *message, size_t length, wm_published *out) {
  waymark_pose_t m;
  if (waymark_pose_t_decode(message, 0, given(message, length), &m) < 0) return "is not a pose_t of this version";
  *out = (wm_published){.made_ns = m.made_ns,
                        .fused_until_ns = m.fused_until_ns,
                        .pose_odom_base = {m.odom_position_m[0], m.odom_position_m[1], m.odom_heading_rad},
                        .jumps = (uint32_t)m.jumps,
                        .last_jump_m = m.last_jump_m,
                        .last_jump_rad = m.last_jump_rad,
                        .status_flags = (uint32_t)m.status_flags,
                        .deadlines_missed = (uint32_t)m.deadlines_missed,
                        .utc_offset_ns = m.utc_offset_ns,
                        .utc_uncertainty_ns = m.utc_uncertainty_ns};
  wm_estimate *e = &out->now;
  e->t_ns = m.t_ns;
  memcpy(e->pose_map_base.p_m, m.position_m, sizeof m.position_m);
  memcpy(e->pose_map_base.q_xyzw, m.orientation_xyzw, sizeof m.orientation_xyzw);
  memcpy(e->covariance, m.covariance, sizeof m.covariance);
  memcpy(e->v_mps, m.velocity_mps, sizeof m.velocity_mps);
  memcpy(e->w_radps, m.rate_radps, sizeof m.rate_radps);
  e->resets = (uint32_t)m.resets;
  e->dof = (uint8_t)m.dof;
  e->state = (uint8_t)m.state;
  e->cause = (uint8_t)WM_PUB_CAUSE(out->status_flags);
  e->cause_source = -1;
  e->lost_probability = m.lost_probability;
  return NULL;
}

const char *wm_lcm_read_bound(const void *message, size_t length, wm_bound *out) {
  waymark_bound_t m;
  if (waymark_bound_t_decode(message, 0, given(message, length), &m) < 0) return "is not a bound_t of this version";
  *out = (wm_bound){.t_ns = m.t_ns,
                    .risk = m.risk,
                    .horizontal_m = m.horizontal_m,
                    .heading_rad = m.heading_rad,
                    .limit_m = m.limit_m,
                    .limit_rad = m.limit_rad,
                    .heading_after_m = m.heading_after_m,
                    .usable = (uint8_t)(m.usable == 1),
                    .why = (uint8_t)m.unusable,
                    .cause = (uint8_t)m.cause,
                    .cause_source = m.cause_source};
  return NULL;
}

static void take_source(wm_source_health *out, const waymark_source_health_t *s) {
  memset(out, 0, sizeof *out);
  take_name(out->name, sizeof out->name, s->name, sizeof s->name);
  out->received = (uint64_t)s->received;
  out->fused = (uint64_t)s->fused;
  for (int i = 0; i < WM_VERDICT_COUNT; i++) out->rejected[i] = (uint64_t)s->rejected[i];
  for (int i = 0; i < WM_STATUS_COUNT; i++) out->refused[i] = (uint64_t)s->refused[i];
  out->late = (uint64_t)s->late;
  out->dropped = (uint64_t)s->dropped;
  out->duplicates = (uint64_t)s->duplicates;
  out->future = (uint64_t)s->future;
  out->lost = (uint64_t)s->lost;
  out->malformed = (uint64_t)s->malformed;
  out->not_finite = (uint64_t)s->not_finite;
  out->out_of_order = (uint64_t)s->out_of_order;
  out->ignored = (uint64_t)s->ignored;
  out->frozen = (uint64_t)s->frozen;
  out->overflows = (uint64_t)s->overflows;
  out->bus_errors = (uint64_t)s->bus_errors;
  out->lateness_p99_ns = s->lateness_p99_ns;
  out->lateness_max_ns = s->lateness_max_ns;
  out->lateness_worst_ns = s->lateness_worst_ns;
  out->newest_ns = s->newest_ns;
  out->silent_ns = s->silent_ns;
  out->stamp_uncertainty_ns = s->stamp_uncertainty_ns;
  out->stale = (uint8_t)s->stale;
  out->device = (uint8_t)s->device;
  for (int i = 0; i < WM_LOOK_COUNT; i++) out->looks[i] = (uint64_t)s->looks[i];
}

const char *wm_lcm_read_health(const void *message, size_t length, wm_health *out) {
  static _Thread_local waymark_health_t m;  // large
  if (waymark_health_t_decode(message, 0, given(message, length), &m) < 0) return "is not a health_t of this version";
  memset(out, 0, sizeof *out);
  out->t_ns = m.t_ns;
  out->fused_until_ns = m.fused_until_ns;
  out->state = (uint8_t)m.state;
  out->cause = (uint8_t)m.cause;
  out->cause_source = m.cause_source;
  out->lost_probability = m.lost_probability;
  out->resets = (uint32_t)m.resets;
  out->jumps = (uint32_t)m.jumps;
  out->motion_health = (uint32_t)m.motion_health;
  out->loops = (uint64_t)m.loops;
  out->deadlines_missed = (uint64_t)m.deadlines_missed;
  out->outputs_lost = (uint64_t)m.outputs_lost;
  out->published = (uint64_t)m.published;
  out->reckoning_left_m = m.reckoning_left_m;
  out->reckoning_left_s = m.reckoning_left_s;
  out->send_p99_ns = m.send_p99_ns;
  out->lines_lost = (uint64_t)m.lines_lost;
  out->run_id = (uint64_t)m.run_id;
  out->pid = m.pid;
  take_name(out->host, sizeof out->host, m.host, sizeof m.host);
  out->other_runs = (uint32_t)m.other_runs;
  out->other_runs_total = (uint32_t)m.other_runs_total;
  for (int32_t i = 0; i < m.source_count && i < WM_HEALTH_SOURCES_MAX; i++)
    take_source(&out->sources[out->source_count++], &m.sources[i]);
  for (int32_t i = 0; i < m.calibration_count && i < WM_HEALTH_CALIBRATION_MAX; i++) {
    wm_calibration_value *c = &out->calibration[out->calibration_count++];
    take_name(c->name, sizeof c->name, m.calibration[i].name, sizeof m.calibration[i].name);
    c->value = m.calibration[i].value;
    c->sigma = m.calibration[i].sigma;
  }
  for (int32_t i = 0; i < m.counter_count && i < WM_HEALTH_COUNTERS_MAX; i++)
    out->counters[out->counter_count++] =
        (wm_counter){(uint32_t)m.counters[i].kind, m.counters[i].landmark_id, (uint64_t)m.counters[i].count};
  return NULL;
}

const char *wm_lcm_read_innovation(const void *message, size_t length, wm_innovation *out) {
  waymark_innovation_t m;
  if (waymark_innovation_t_decode(message, 0, given(message, length), &m) < 0)
    return "is not an innovation_t of this version";
  *out = (wm_innovation){.t_ns = m.t_ns,
                         .source = (uint16_t)m.source,
                         .sensor = (uint16_t)m.sensor,
                         .landmark_id = m.landmark_id,
                         .residual = (uint8_t)m.residual,
                         .verdict = (uint8_t)m.verdict,
                         .observed = m.observed,
                         .expected = m.expected,
                         .variance = m.variance,
                         .nis = m.nis,
                         .gate = m.gate,
                         .gate_dof = (uint8_t)m.gate_dof};
  return NULL;
}

const char *wm_lcm_read_refused(const void *message, size_t length, char source[WM_HEALTH_NAME_MAX],
                                char reason[WM_HEALTH_REASON_MAX]) {
  waymark_refused_t m;
  if (waymark_refused_t_decode(message, 0, given(message, length), &m) < 0) return "is not a refused_t of this version";
  take_name(source, WM_HEALTH_NAME_MAX, m.source, sizeof m.source);
  take_name(reason, WM_HEALTH_REASON_MAX, m.reason, sizeof m.reason);
  return NULL;
}
