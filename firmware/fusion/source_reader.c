// SPDX-License-Identifier: Apache-2.0
#include "fusion/source_reader.h"

#include <math.h>
#include <string.h>

static wm_time_ns limit(wm_time_ns first_ns, double seconds, wm_time_ns none) {
  if (!isfinite(seconds) || fabs(seconds) > 1e9) return none;
  wm_time_ns t_ns;
  if (__builtin_add_overflow(first_ns, wm_ns_from_seconds(seconds), &t_ns)) return none;
  return t_ns;
}

// 1: nothing of it is left.
static int drop_quantities(wm_event *event, uint32_t drops) {
  wm_quantities *q = &event->as.quantities;
  if (drops == 0 || event->kind != WM_EVENT_QUANTITIES) return 0;
  uint8_t left = 0;
  for (uint8_t i = 0; i < q->count; i++) {
    if (drops >> q->id[i] & 1u) continue;
    q->id[left] = q->id[i];
    q->value[left++] = q->value[i];
  }
  q->count = left;
  return left == 0;
}

static wm_status read_one(wm_source_reader *self, wm_error *err) {
  wm_status status = self->source->ops->next(self->source, &self->next, err);
  while (status == WM_OK && drop_quantities(&self->next, self->drops)) {
    self->source->counts.ignored++;
    status = self->source->ops->next(self->source, &self->next, err);
  }
  self->has_next = status == WM_OK;
  self->next.source = self->index;
  return status == WM_END || status == WM_AGAIN ? WM_OK : status;
}

static int inside(const wm_source_reader *self) {
  return self->next.t_ns >= self->from_ns && self->next.t_ns <= self->until_ns;
}

#define COUNTERS 7

static void counters_of(wm_source_counts *counts, uint64_t *out[COUNTERS]) {
  uint64_t *all[COUNTERS] = {&counts->lost,   &counts->malformed, &counts->not_finite, &counts->out_of_order,
                             &counts->frozen, &counts->overflows, &counts->bus_errors};
  memcpy(out, all, sizeof all);
}

// Counts that arise while events outside of the interval are read belong to the outside.
static wm_status skip_outside(wm_source_reader *self, wm_error *err) {
  uint64_t *now[COUNTERS], *skipped[COUNTERS], before[COUNTERS];
  counters_of(&self->source->counts, now);
  counters_of(&self->outside, skipped);
  while (self->has_next && !inside(self)) {
    self->outside.ignored++;
    for (size_t i = 0; i < COUNTERS; i++) before[i] = *now[i];
    wm_status status = read_one(self, err);
    for (size_t i = 0; i < COUNTERS; i++) *skipped[i] += *now[i] - before[i];
    if (status != WM_OK) return status;
  }
  return WM_OK;
}

void wm_source_reader_counts(const wm_source_reader *self, wm_source_counts *out) {
  uint64_t *counts[COUNTERS], *skipped[COUNTERS];
  wm_source_counts outside = self->outside;
  *out = self->source->counts;
  counters_of(out, counts);
  counters_of(&outside, skipped);
  // A frame counted lost outside of the interval that arrives inside of it is counted in neither.
  for (size_t i = 0; i < COUNTERS; i++) *counts[i] = *counts[i] > *skipped[i] ? *counts[i] - *skipped[i] : 0;
  out->ignored += outside.ignored;
}

wm_status wm_source_reader_advance(wm_source_reader *self, wm_error *err) {
  wm_status status = read_one(self, err);
  return status == WM_OK ? skip_outside(self, err) : status;
}

// With the first problem of the first source that has one.
static wm_status fail_empty(const wm_source_reader *readers, const wm_assembly *assembly, wm_error *err) {
  wm_source_counts counts = {0};
  for (size_t i = 0; i < assembly->source_count && !counts.first_problem[0]; i++)
    wm_source_reader_counts(&readers[i], &counts);
  return wm_fail(err, WM_BAD_DATA, "'%s' is empty: none of its %zu sources holds a datum that can be used%s%s",
                 assembly->recording, assembly->source_count, counts.first_problem[0] ? "; the first problem: " : "",
                 counts.first_problem);
}

wm_status wm_source_readers_open(const wm_assembly *assembly, wm_source_reader *readers, wm_time_ns now_ns,
                                 wm_time_ns *first_ns, wm_error *err) {
  size_t recorded = 0;
  *first_ns = INT64_MAX;
  for (size_t i = 0; i < assembly->source_count; i++) {
    wm_source_reader *reader = &readers[i];
    memset(reader, 0, sizeof *reader);
    reader->source = assembly->sources[i].source;
    reader->index = (uint16_t)i;
    reader->drops = assembly->sources[i].drops;
    reader->source->from_ns = INT64_MIN;
    reader->source->until_ns = INT64_MAX;
    if (reader->source->is_live) continue;
    recorded++;
    wm_status status = read_one(reader, err);
    if (status != WM_OK) return status;
    if (reader->has_next && reader->next.t_ns < *first_ns) *first_ns = reader->next.t_ns;
  }
  if (!recorded) *first_ns = now_ns;
  if (*first_ns == INT64_MAX) return fail_empty(readers, assembly, err);
  for (size_t i = 0; i < assembly->source_count; i++) {
    readers[i].from_ns = limit(*first_ns, assembly->sources[i].from_s, INT64_MIN);
    readers[i].until_ns = limit(*first_ns, assembly->sources[i].until_s, INT64_MAX);
    readers[i].source->from_ns = readers[i].from_ns;
    readers[i].source->until_ns = readers[i].until_ns;
    wm_status status = skip_outside(&readers[i], err);
    if (status != WM_OK) return status;
  }
  if (recorded == assembly->source_count && !wm_source_readers_earliest(readers, assembly->source_count))
    return wm_fail(err, WM_BAD_USAGE,
                   "'%s' has no datum in the part from --from to --until (from_s, until_s), s since its first stamp",
                   assembly->recording);
  return WM_OK;
}

wm_source_reader *wm_source_readers_earliest(wm_source_reader *readers, size_t count) {
  wm_source_reader *earliest = NULL;
  for (size_t i = 0; i < count; i++)
    if (readers[i].has_next && (!earliest || readers[i].next.arrival_ns < earliest->next.arrival_ns))
      earliest = &readers[i];
  return earliest;
}

void wm_source_readers_health(const wm_source_reader *readers, size_t count, wm_health *health) {
  for (size_t i = 0; i < count && i < health->source_count; i++) {
    wm_source_counts counts;
    wm_source_reader_counts(&readers[i], &counts);
    wm_source_health *out = &health->sources[i];
    out->lost = counts.lost;
    out->malformed = counts.malformed;
    out->not_finite = counts.not_finite;
    out->out_of_order = counts.out_of_order;
    out->ignored = counts.ignored;
    out->frozen = counts.frozen;
    out->overflows = counts.overflows;
    out->bus_errors = counts.bus_errors;
    out->device = counts.device;
    out->stamp_uncertainty_ns = counts.stamp_uncertainty_ns;
    memcpy(out->looks, counts.looks, sizeof out->looks);
    _Static_assert(sizeof health->refused_because[0] == sizeof counts.first_problem, "a reason fits");
    if (counts.first_problem[0]) memcpy(health->refused_because[i], counts.first_problem, sizeof counts.first_problem);
  }
}
