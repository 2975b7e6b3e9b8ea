// SPDX-License-Identifier: Apache-2.0
#include "fusion/fuser.h"

#include <math.h>
#include <string.h>

#include "rt/clock.h"

#define PARTICLES_EVERY_NS WM_NS_PER_S  // for pictures of the cloud in the report
#define Q_BIT(q) (UINT32_C(1) << (q))
#define TICKS (Q_BIT(WM_Q_WHEEL_TICKS_LEFT) | Q_BIT(WM_Q_WHEEL_TICKS_RIGHT))
#define SPEEDS                                                                                                    \
  (Q_BIT(WM_Q_WHEEL_SPEED_FRONT_LEFT) | Q_BIT(WM_Q_WHEEL_SPEED_FRONT_RIGHT) | Q_BIT(WM_Q_WHEEL_SPEED_REAR_LEFT) | \
   Q_BIT(WM_Q_WHEEL_SPEED_REAR_RIGHT) | Q_BIT(WM_Q_VEHICLE_SPEED))

size_t wm_output_bytes(uint32_t kinds) {
  size_t bytes = sizeof(wm_published);
  if (bytes < WM_EVENT_SMALL_BYTES) bytes = WM_EVENT_SMALL_BYTES;
  if (kinds & WM_EVENT_BIT(WM_EVENT_POINTS)) bytes = sizeof(wm_event);
  return bytes;
}

wm_driving wm_driving_choose(uint32_t kinds, uint32_t quantities) {
  if (!(kinds & WM_MOTION_EVENTS)) return (wm_driving){.kinds = kinds};
  if (kinds & WM_EVENT_BIT(WM_EVENT_INCREMENT))
    return (wm_driving){.kinds = WM_EVENT_BIT(WM_EVENT_INCREMENT), .quantities = 0};
  // Beside twists a gyro alone is no drive of its own: its speed is theirs.
  if ((kinds & WM_TWIST_EVENTS) && !(quantities & (TICKS | SPEEDS))) return (wm_driving){.kinds = WM_TWIST_EVENTS};
  static const uint32_t kPreferred[] = {TICKS, Q_BIT(WM_Q_YAW_RATE), SPEEDS};
  if (kinds & WM_EVENT_BIT(WM_EVENT_QUANTITIES))
    for (size_t i = 0; i < sizeof kPreferred / sizeof kPreferred[0]; i++)
      if (quantities & kPreferred[i])
        return (wm_driving){.kinds = WM_EVENT_BIT(WM_EVENT_QUANTITIES), .quantities = kPreferred[i]};
  return (wm_driving){.kinds = WM_TWIST_EVENTS};
}

int wm_driving_is(const wm_driving *driving, const wm_event *event) {
  if (!(driving->kinds & WM_EVENT_BIT(event->kind))) return 0;
  if (event->kind != WM_EVENT_QUANTITIES) return 1;
  for (size_t i = 0; i < event->as.quantities.count; i++)
    if (driving->quantities & Q_BIT(event->as.quantities.id[i])) return 1;
  return 0;
}

void wm_fuser_init(wm_fuser *self, const wm_estimator *estimator, void *state, wm_driving driving, wm_output output) {
  memset(self, 0, sizeof *self);
  self->estimator = estimator;
  self->state = state;
  self->driving = driving;
  self->output = output;
  self->row_ns = WM_TIME_NONE;
  self->last_row_ns = WM_TIME_NONE;
  self->until_ns = WM_TIME_NONE;
  self->particles_ns = self->others.made_ns = WM_TIME_NONE;
  wm_fuser_watch(self, &(wm_setup){0}, 0);
}

void wm_fuser_watch(wm_fuser *self, const wm_setup *setup, uint64_t observers) {
  wm_monitor_init(&self->monitor, setup, observers);
  self->floors = setup->floors;
  self->observers = observers;
  double probability;
  self->floor = self->floors ? self->estimator->floor(self->state, &probability) : -1;
}

void wm_fuser_estimate(const wm_fuser *self, wm_estimate *out) {
  self->estimator->estimate(self->state, out);
  wm_monitor_judge(&self->monitor, out);
}

uint32_t wm_fuser_floor_flags(const wm_fuser *self) {
  double probability;
  if (!self->floors) return 0;
  const uint32_t floor = (uint32_t)self->estimator->floor(self->state, &probability);
  return ((floor + 1) << WM_PUB_FLOOR_SHIFT) | ((uint32_t)(100.0 * probability) << WM_PUB_FLOOR_PERCENT_SHIFT);
}

// Another floor has another map: statistics of the one before do not hold there.
static void follow_floor(wm_fuser *self) {
  double probability;
  if (!self->floors) return;
  const int floor = self->estimator->floor(self->state, &probability);
  if (floor != self->floor) wm_monitor_init(&self->monitor, &self->floors->setups[floor], self->observers);
  self->floor = floor;
}

static uint32_t at_most(size_t count, uint32_t most) { return count < most ? (uint32_t)count : most; }

static uint32_t list_alarms(const wm_fuser *self, wm_alarm out[WM_ALARMS_MAX]) {
  if (!self->estimator->alarms) return 0;
  return at_most(self->estimator->alarms(self->state, out, WM_ALARMS_MAX), WM_ALARMS_MAX);
}

static void put_calibration(const wm_fuser *self, wm_health *out) {
  wm_calibration_value all[2 * WM_HEALTH_CALIBRATION_MAX];
  if (!self->estimator->calibration) return;
  const uint32_t count = at_most(self->estimator->calibration(self->state, all, 2 * WM_HEALTH_CALIBRATION_MAX),
                                 2 * WM_HEALTH_CALIBRATION_MAX);
  out->calibration_count = at_most(count, WM_HEALTH_CALIBRATION_MAX);
  out->more_count = count - out->calibration_count;
  memcpy(out->calibration, all, out->calibration_count * sizeof all[0]);
  memcpy(out->more_calibration, all + out->calibration_count, out->more_count * sizeof all[0]);
}

void wm_fuser_health(const wm_fuser *self, wm_health *out) {
  const wm_estimator *e = self->estimator;
  wm_estimate estimate;
  wm_fuser_estimate(self, &estimate);
  out->fused_until_ns = self->until_ns;
  out->state = estimate.state;
  out->cause = estimate.cause;
  out->cause_source = estimate.cause_source;
  out->lost_probability = estimate.lost_probability;
  out->resets = estimate.resets;
  if (e->motion_health) out->motion_health = e->motion_health(self->state);
  out->floor = self->floors ? e->floor(self->state, &out->floor_probability) : -1;
  // They return how many there are, possibly more than were written.
  put_calibration(self, out);
  out->alarm_count = list_alarms(self, out->alarms);
  if (e->counters)
    out->counter_count =
        at_most(e->counters(self->state, out->counters, WM_HEALTH_COUNTERS_MAX), WM_HEALTH_COUNTERS_MAX);
}

int wm_estimate_has_pose(const wm_estimate *e) {
  const double *p = e->pose_map_base.p_m;
  return e->state != WM_STATE_SEARCHING && isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]) &&
         isfinite(e->heading_rad);
}

static void write_row(wm_fuser *self) {
  wm_estimate estimate;
  wm_fuser_estimate(self, &estimate);
  self->row_ns = WM_TIME_NONE;
  if (!wm_estimate_has_pose(&estimate) || estimate.t_ns <= self->last_row_ns) return;
  self->last_row_ns = estimate.t_ns;
  self->poses++;
  self->output.put(self->output.context, WM_OUTPUT_POSE, &estimate, sizeof estimate);
}

static void note_unused(wm_fuser_counts *counts, wm_status status, wm_time_ns t_ns, int32_t landmark_id) {
  if (counts->first_unused.status == WM_OK) counts->first_unused = (wm_unused_event){status, t_ns, landmark_id};
}

// The monitor gets each event that the estimator took, with its records.
static void monitor(wm_fuser *self, const wm_event *event, const wm_innovation *records, size_t count) {
  if (!wm_monitor_take(&self->monitor, event, records, count)) return;
  wm_estimate estimate;
  wm_alarm alarms[WM_ALARMS_MAX];
  self->estimator->estimate(self->state, &estimate);
  wm_monitor_step(&self->monitor, &estimate, alarms, list_alarms(self, alarms));
}

static wm_status predict(wm_fuser *self, const wm_event *event) {
  wm_time_ns begin_ns = wm_monotonic_ns();
  wm_status status = self->estimator->predict(self->state, event);
  wm_histogram_add(&self->predict_ns, wm_monotonic_ns() - begin_ns);
  if (status == WM_OK) monitor(self, event, NULL, 0);
  return status;
}

static wm_status correct(wm_fuser *self, const wm_event *event) {
  wm_innovation out[WM_INNOVATIONS_PER_EVENT_MAX];
  size_t count = 0;
  wm_time_ns begin_ns = wm_monotonic_ns();
  wm_status status = self->estimator->correct(self->state, event, out, WM_INNOVATIONS_PER_EVENT_MAX, &count);
  wm_histogram_add(&self->correct_ns, wm_monotonic_ns() - begin_ns);
  if (status != WM_OK && count == 0) return status;
  monitor(self, event, out, count);

  wm_fuser_counts *counts = &self->counts[event->source];
  int any_fused = count == 0;  // SET_POSE, RESET, LOOKED: taken, without an innovation
  for (size_t i = 0; i < count; i++) {
    any_fused |= out[i].verdict == WM_FUSED;
    out[i].source = event->source;
    self->innovations++;
    self->output.put(self->output.context, WM_OUTPUT_INNOVATION, &out[i], sizeof out[i]);
  }
  if (any_fused) {
    counts->fused++;
  } else {
    counts->rejected[out[0].verdict]++;
    if (out[0].verdict == WM_REJECTED_UNKNOWN_ID && out[0].landmark_id >= 0)
      note_unused(counts, WM_NOT_FOUND, event->t_ns, out[0].landmark_id);
  }
  return WM_OK;
}

static void write_hypotheses(wm_fuser *self, wm_time_ns t_ns) {
  const wm_estimator *e = self->estimator;
  if (!e->hypotheses) return;
  const size_t most = sizeof self->listed / sizeof self->listed[0];
  size_t count = e->hypotheses(self->state, self->listed, most);
  if (count > most) count = most;
  wm_hypothesis_set *set = &self->hypotheses;
  set->t_ns = t_ns;
  for (size_t from = 0; from < count; from += set->count) {
    set->count = count - from < WM_HYPOTHESES_MAX ? count - from : WM_HYPOTHESES_MAX;
    memcpy(set->places, self->listed + from, set->count * sizeof set->places[0]);
    self->output.put(self->output.context, WM_OUTPUT_HYPOTHESES, set, sizeof *set);
  }
}

// Records have the size of the largest event: without points there is no room for particles.
static void write_particles(wm_fuser *self, const wm_event *event) {
  _Static_assert(sizeof(wm_particle_set) <= sizeof(wm_event) && sizeof(wm_hypothesis_set) <= sizeof(wm_event),
                 "a set fits where an event of points does");
  const wm_estimator *e = self->estimator;
  if (!e->particles || event->kind != WM_EVENT_POINTS) return;
  if (self->particles_ns != WM_TIME_NONE && event->t_ns - self->particles_ns < PARTICLES_EVERY_NS) return;
  self->particles_ns = event->t_ns;
  wm_particle_set *set = &self->particles;
  set->t_ns = event->t_ns;
  set->total = (uint32_t)e->particles(self->state, set->particles, WM_PARTICLES_MAX);
  set->count = set->total < WM_PARTICLES_MAX ? set->total : WM_PARTICLES_MAX;
  self->output.put(self->output.context, WM_OUTPUT_PARTICLES, set, sizeof *set);
  write_hypotheses(self, event->t_ns);
}

void wm_fuser_feed(wm_fuser *self, const wm_event *event) {
  if (self->row_ns != WM_TIME_NONE && event->t_ns > self->row_ns) write_row(self);
  self->output.put(self->output.context, WM_OUTPUT_EVENT, event, wm_event_bytes(event));
  self->events++;

  wm_fuser_counts *counts = &self->counts[event->source];
  const int is_motion = wm_event_is_motion(event);
  const wm_status status = is_motion ? predict(self, event) : correct(self, event);
  follow_floor(self);
  if (status != WM_OK) {
    counts->refused[status]++;
    note_unused(counts, status, event->t_ns, -1);
    return;
  }
  if (is_motion)
    counts->fused++;
  else
    write_particles(self, event);
  if (wm_driving_is(&self->driving, event)) self->row_ns = event->t_ns;
  self->until_ns = event->t_ns;
}

void wm_fuser_finish(wm_fuser *self) {
  if (self->row_ns != WM_TIME_NONE) write_row(self);
}
