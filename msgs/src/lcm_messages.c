// SPDX-License-Identifier: Apache-2.0
#include "waymark/lcm_messages.h"
#include "lcm_bytes.h"

#include <math.h>
#include <string.h>

#include "waymark_bound_t.h"
#include "waymark_health_t.h"
#include "waymark_innovation_t.h"
#include "waymark_landmarks_t.h"
#include "waymark_pose_t.h"
#include "waymark_refused_t.h"

_Static_assert(sizeof(((waymark_source_health_t *)0)->rejected) / sizeof(int64_t) == WM_VERDICT_COUNT,
               "a verdict each");
_Static_assert(sizeof(((waymark_source_health_t *)0)->refused) / sizeof(int64_t) == WM_STATUS_COUNT, "a status each");
_Static_assert(sizeof(((waymark_source_health_t *)0)->looks) / sizeof(int64_t) == WM_LOOK_COUNT, "a look each");
_Static_assert(sizeof(((waymark_health_t *)0)->sources) / sizeof(waymark_source_health_t) == WM_HEALTH_SOURCES_MAX,
               "a place each");
_Static_assert(sizeof(((waymark_health_t *)0)->calibration) / sizeof(waymark_calibration_t) ==
                   WM_HEALTH_CALIBRATION_MAX,
               "a place each");
_Static_assert(sizeof(((waymark_health_t *)0)->counters) / sizeof(waymark_counter_t) == WM_HEALTH_COUNTERS_MAX,
               "a place each");
_Static_assert(WAYMARK_POSE_T_STATUS_JUMPED == WM_PUB_JUMPED &&
                   WAYMARK_POSE_T_STATUS_CAUSE_SHIFT == WM_PUB_CAUSE_SHIFT &&
                   WAYMARK_POSE_T_STATE_DEGRADED == WM_STATE_DEGRADED && WAYMARK_POSE_T_CAUSE_FLOOR == WM_CAUSE_FLOOR &&
                   WAYMARK_POSE_T_STATUS_FLOOR_SHIFT == WM_PUB_FLOOR_SHIFT &&
                   WAYMARK_POSE_T_STATUS_FLOOR_PERCENT_SHIFT == WM_PUB_FLOOR_PERCENT_SHIFT &&
                   WAYMARK_BOUND_T_UNUSABLE_HEADING == WM_UNUSABLE_HEADING,
               "the messages' numbers are the structs' numbers");

size_t wm_lcm_bound(const wm_bound *b, void *out, size_t capacity) {
  waymark_bound_t m = {.t_ns = b->t_ns,
                       .risk = b->risk,
                       .horizontal_m = b->horizontal_m,
                       .heading_rad = b->heading_rad,
                       .limit_m = b->limit_m,
                       .limit_rad = b->limit_rad,
                       .heading_after_m = b->heading_after_m,
                       .usable = (int8_t)b->usable,
                       .unusable = (int8_t)b->why,
                       .cause = (int8_t)b->cause,
                       .cause_source = b->cause_source};
  return written(waymark_bound_t_encode(out, 0, room(capacity), &m));
}

size_t wm_lcm_pose(const wm_published *p, wm_time_ns sent_ns, void *out, size_t capacity) {
  const wm_estimate *e = &p->now;
  waymark_pose_t m = {
      .t_ns = e->t_ns,
      .sent_ns = sent_ns,
      .made_ns = p->made_ns,
      .fused_until_ns = p->fused_until_ns,
      .utc_offset_ns = p->utc_offset_ns,
      .utc_uncertainty_ns = p->utc_uncertainty_ns,
      .frame = WM_FRAME_MAP,
      .child_frame = WM_FRAME_BASE,
      .state = (int8_t)e->state,
      .dof = (int8_t)e->dof,
      .lost_probability = e->lost_probability,
      .status_flags = (int32_t)p->status_flags,
      .resets = (int32_t)e->resets,
      .deadlines_missed = (int32_t)p->deadlines_missed,
      .odom_position_m = {p->pose_odom_base.x_m, p->pose_odom_base.y_m},
      .odom_heading_rad = p->pose_odom_base.heading_rad,
      .jumps = (int32_t)p->jumps,
      .last_jump_m = p->last_jump_m,
      .last_jump_rad = p->last_jump_rad,
  };
  memcpy(m.position_m, e->pose_map_base.p_m, sizeof m.position_m);
  memcpy(m.orientation_xyzw, e->pose_map_base.q_xyzw, sizeof m.orientation_xyzw);
  memcpy(m.covariance, e->covariance, sizeof m.covariance);
  memcpy(m.velocity_mps, e->v_mps, sizeof m.velocity_mps);
  memcpy(m.rate_radps, e->w_radps, sizeof m.rate_radps);
  return written(waymark_pose_t_encode(out, 0, room(capacity), &m));
}

static void put_source(waymark_source_health_t *out, const wm_source_health *s) {
  put_name(out->name, sizeof out->name, s->name);
  out->received = (int64_t)s->received;
  out->fused = (int64_t)s->fused;
  for (int i = 0; i < WM_VERDICT_COUNT; i++) out->rejected[i] = (int64_t)s->rejected[i];
  for (int i = 0; i < WM_STATUS_COUNT; i++) out->refused[i] = (int64_t)s->refused[i];
  out->late = (int64_t)s->late;
  out->dropped = (int64_t)s->dropped;
  out->duplicates = (int64_t)s->duplicates;
  out->future = (int64_t)s->future;
  out->lost = (int64_t)s->lost;
  out->malformed = (int64_t)s->malformed;
  out->not_finite = (int64_t)s->not_finite;
  out->out_of_order = (int64_t)s->out_of_order;
  out->ignored = (int64_t)s->ignored;
  out->frozen = (int64_t)s->frozen;
  out->lateness_p99_ns = s->lateness_p99_ns;
  out->lateness_max_ns = s->lateness_max_ns;
  out->lateness_worst_ns = s->lateness_worst_ns;
  out->newest_ns = s->newest_ns;
  out->silent_ns = s->silent_ns;
  out->stale = (int8_t)s->stale;
  out->overflows = (int64_t)s->overflows;
  out->bus_errors = (int64_t)s->bus_errors;
  out->stamp_uncertainty_ns = s->stamp_uncertainty_ns;
  out->device = (int8_t)s->device;
  for (int i = 0; i < WM_LOOK_COUNT; i++) out->looks[i] = (int64_t)s->looks[i];
}

static void put_calibration(waymark_health_t *m, const char *name, double value, double sigma) {
  waymark_calibration_t *to = &m->calibration[m->calibration_count++];
  put_name(to->name, sizeof to->name, name);
  to->value = value;
  to->sigma = sigma;
}

static int has_alarm(const wm_health *h, uint32_t i) {
  for (unsigned kind = 0; kind < WM_ALARM_KIND_COUNT; kind++)
    if (wm_health_has_alarm(h, kind, i)) return 1;
  return 0;
}

// Where there are more values than room, those with an alarm come first, and the last one states how many are left out.
static void put_all_calibration(waymark_health_t *m, const wm_health *h) {
  const uint32_t count = wm_health_calibration_count(h);
  const int fits = count <= WM_HEALTH_CALIBRATION_MAX;
  const int32_t room = WM_HEALTH_CALIBRATION_MAX - !fits;
  for (int pass = 0; pass < 2; pass++)
    for (uint32_t i = 0; i < count && m->calibration_count < room; i++) {
      const wm_calibration_value *c = wm_health_calibration(h, i);
      const int is_first = fits || has_alarm(h, i);
      if (is_first == (pass == 0)) put_calibration(m, c->name, c->value, c->sigma);
    }
  if (!fits) put_calibration(m, WM_LCM_CALIBRATION_LEFT, count - (double)room, (double)NAN);
}

size_t wm_lcm_refused(const wm_health *h, uint32_t index, void *out, size_t capacity) {
  const wm_source_health *s = &h->sources[index];
  waymark_refused_t m = {
      .t_ns = h->t_ns, .run_id = (int64_t)h->run_id, .count = (int64_t)(s->malformed + s->not_finite)};
  put_name(m.source, sizeof m.source, s->name);
  put_name(m.reason, sizeof m.reason, h->refused_because[index]);
  return written(waymark_refused_t_encode(out, 0, room(capacity), &m));
}

size_t wm_lcm_health(const wm_health *h, void *out, size_t capacity) {
  waymark_health_t m = {
      .t_ns = h->t_ns,
      .fused_until_ns = h->fused_until_ns,
      .state = (int8_t)h->state,
      .cause = (int8_t)h->cause,
      .cause_source = h->cause_source,
      .lost_probability = h->lost_probability,
      .resets = (int32_t)h->resets,
      .jumps = (int32_t)h->jumps,
      .motion_health = (int32_t)h->motion_health,
      .loops = (int64_t)h->loops,
      .deadlines_missed = (int64_t)h->deadlines_missed,
      .outputs_lost = (int64_t)h->outputs_lost,
      .published = (int64_t)h->published,
      .reckoning_left_m = h->reckoning_left_m,
      .reckoning_left_s = h->reckoning_left_s,
      .send_p99_ns = h->send_p99_ns,
      .lines_lost = (int64_t)h->lines_lost,
      .run_id = (int64_t)h->run_id,
      .pid = h->pid,
      .other_runs = (int32_t)h->other_runs,
      .other_runs_total = (int32_t)h->other_runs_total,
  };
  put_name(m.host, sizeof m.host, h->host);
  m.source_count = (int32_t)(h->source_count < WM_HEALTH_SOURCES_MAX ? h->source_count : WM_HEALTH_SOURCES_MAX);
  for (int32_t i = 0; i < m.source_count; i++) put_source(&m.sources[i], &h->sources[i]);
  put_all_calibration(&m, h);
  m.counter_count = (int32_t)(h->counter_count < WM_HEALTH_COUNTERS_MAX ? h->counter_count : WM_HEALTH_COUNTERS_MAX);
  for (int32_t i = 0; i < m.counter_count; i++) {
    m.counters[i].kind = (int32_t)h->counters[i].kind;
    m.counters[i].landmark_id = h->counters[i].landmark_id;
    m.counters[i].count = (int64_t)h->counters[i].count;
  }
  return written(waymark_health_t_encode(out, 0, room(capacity), &m));
}

size_t wm_lcm_innovation(const wm_innovation *i, void *out, size_t capacity) {
  waymark_innovation_t m = {
      .t_ns = i->t_ns,
      .source = (int16_t)i->source,
      .sensor = (int16_t)i->sensor,
      .landmark_id = i->landmark_id,
      .residual = (int8_t)i->residual,
      .verdict = (int8_t)i->verdict,
      .gate_dof = (int8_t)i->gate_dof,
      .observed = i->observed,
      .expected = i->expected,
      .variance = i->variance,
      .nis = i->nis,
      .gate = i->gate,
  };
  return written(waymark_innovation_t_encode(out, 0, room(capacity), &m));
}

size_t wm_lcm_landmarks(const wm_landmark *landmarks, size_t total, size_t first, wm_time_ns t_ns, void *out,
                        size_t capacity) {
  if (first > total) return 0;
  size_t count = total - first < WM_LCM_LANDMARKS_MAX ? total - first : WM_LCM_LANDMARKS_MAX;
  waymark_landmarks_t m = {.t_ns = t_ns, .total = (int32_t)total, .first = (int32_t)first, .count = (int32_t)count};
  for (size_t i = 0; i < count; i++) {
    const wm_landmark *l = &landmarks[first + i];
    m.id[i] = l->id;
    memcpy(m.position_m[i], l->p_m, sizeof m.position_m[i]);
    m.sigma_m[i] = l->sigma_m;
  }
  return written(waymark_landmarks_t_encode(out, 0, room(capacity), &m));
}
