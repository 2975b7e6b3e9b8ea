// SPDX-License-Identifier: Apache-2.0
#include "sources/vision_source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rt/clock.h"

// Whether state `a` is to be reported rather than `b`.
static int worse(uint8_t a, uint8_t b) {
  static const uint8_t kHowBad[WM_DEVICE_STATE_COUNT] = {
      [WM_DEVICE_NONE] = 1,    [WM_DEVICE_WORKS] = 0, [WM_DEVICE_FROZEN] = 2,
      [WM_DEVICE_STALLED] = 3, [WM_DEVICE_DOWN] = 4,  [WM_DEVICE_ABSENT] = 5};
  return kHowBad[a] > kHowBad[b];
}

static void add_counts(wm_source_counts *sum, const wm_source_counts *one, int is_first) {
  sum->lost += one->lost;
  sum->malformed += one->malformed;
  sum->frozen += one->frozen;
  sum->overflows += one->overflows;
  sum->out_of_order += one->out_of_order;
  sum->not_finite += one->not_finite;
  if (one->stamp_uncertainty_ns > sum->stamp_uncertainty_ns) sum->stamp_uncertainty_ns = one->stamp_uncertainty_ns;
  if (!sum->first_problem[0]) memcpy(sum->first_problem, one->first_problem, sizeof sum->first_problem);
  if (!is_first && !worse(one->device, sum->device)) return;
  sum->device = one->device;
  memcpy(sum->device_note, one->device_note, sizeof sum->device_note);
}

// Sums what all its cameras counted, and adds this source's own counts.
static void take_counts(vision_source *self) {
  wm_source_counts sum = {.received = self->counts.received};
  memcpy(sum.looks, self->counts.looks, sizeof sum.looks);
  for (uint32_t i = 0; i < self->detector->pictures; i++) {
    wm_source_counts one;
    self->pictures[i]->ops->counts(self->pictures[i], &one);
    add_counts(&sum, &one, i == 0);
  }
  sum.out_of_order += self->went_back;
  sum.malformed += self->refused;
  self->counts = sum;
}

#define ONLY_TOLERANCE_NS (50 * WM_NS_PER_MS)  // of a run's stamp from the recording's; or less than half a period

// The nearest wanted picture, if within only_tolerance_ns; else NULL.
static const wm_seen *wanted(const vision_source *self, wm_time_ns t_ns) {
  size_t low = 0, high = self->only_count;
  while (low < high) {
    size_t middle = low + (high - low) / 2;
    if (self->only[middle].t_ns < t_ns)
      low = middle + 1;
    else
      high = middle;
  }
  wm_time_ns after_ns = low < self->only_count ? self->only[low].t_ns - t_ns : INT64_MAX;
  wm_time_ns before_ns = low > 0 ? t_ns - self->only[low - 1].t_ns : INT64_MAX;
  if ((after_ns < before_ns ? after_ns : before_ns) > self->only_tolerance_ns) return NULL;
  return &self->only[after_ns < before_ns ? low : low - 1];
}

static wm_status skip_all(vision_source *self, wm_error *err) {
  wm_status status = WM_OK;
  for (uint32_t i = 0; status == WM_OK && i < self->detector->pictures; i++)
    status = self->pictures[i]->ops->skip(self->pictures[i], err);
  return status;
}

void vision_look_only_at(vision_source *self, wm_seen *seen, size_t count) {
  wm_time_ns nearest_ns = INT64_MAX;
  for (size_t i = 1; i < count; i++)
    if (seen[i].t_ns - seen[i - 1].t_ns < nearest_ns) nearest_ns = seen[i].t_ns - seen[i - 1].t_ns;
  free(self->only);
  self->only = seen;
  self->only_count = count;
  self->only_tolerance_ns = nearest_ns / 5 * 2 < ONLY_TOLERANCE_NS ? nearest_ns / 5 * 2 : ONLY_TOLERANCE_NS;
}

static int are_together(const vision_source *self, const wm_frame *frames) {
  if (self->detector->pictures == 1) return 1;
  wm_time_ns apart_ns = frames[1].t_ns - frames[0].t_ns;
  return apart_ns <= PAIR_TOLERANCE_NS && apart_ns >= -PAIR_TOLERANCE_NS;
}

// Skips pictures of a pair whose other half is missing. Stamps of the next complete pair (or picture) into `heads`.
static wm_status find_together(vision_source *self, wm_frame *heads, wm_error *err) {
  for (;;) {
    for (uint32_t i = 0; i < self->detector->pictures; i++) {
      wm_status status = self->pictures[i]->ops->peek(self->pictures[i], &heads[i], err);
      if (status != WM_OK) return status;
    }
    int is_together = are_together(self, heads);
    if (is_together && (!self->only || wanted(self, heads[0].t_ns))) return WM_OK;
    wm_frame_source *older = self->pictures[self->detector->pictures == 2 && heads[1].t_ns < heads[0].t_ns];
    wm_status status = is_together ? skip_all(self, err) : older->ops->skip(older, err);
    if (status != WM_OK) return status;
  }
}

// Decodes a picture or a pair, or takes the pixels that another thread has decoded.
static wm_status decode(vision_source *self, wm_frame *frames, wm_time_ns *took_ns, wm_error *err) {
  wm_frame heads[PICTURES_MAX] = {0};
  wm_status status = find_together(self, heads, err);
  wm_time_ns begin_ns = wm_monotonic_ns(), elsewhere_ns = 0;
  for (uint32_t i = 0; status == WM_OK && i < self->detector->pictures; i++) {
    status = self->pictures[i]->ops->next(self->pictures[i], &frames[i], err);
    elsewhere_ns += self->pictures[i]->decoded_in_ns;
  }
  *took_ns = wm_monotonic_ns() - begin_ns + elsewhere_ns;
  if (status == WM_OK) wm_histogram_add(&self->decode_ns, *took_ns);
  return status;
}

// Detects in the next picture; events into self->events.
static wm_status look(vision_source *self, wm_error *err) {
  wm_frame frames[PICTURES_MAX] = {0};
  wm_time_ns decoding_ns;
  self->event_count = self->next_event = 0;
  wm_status status = decode(self, frames, &decoding_ns, err);
  if (status != WM_OK) return status;
  if (!are_together(self, frames)) return WM_OK;  // one picture of the pair is damaged
  // A camera's stamps must rise; a stamp that goes back is a clock fault.
  if (self->newest_ns != WM_TIME_NONE && frames[0].t_ns <= self->newest_ns) {
    self->went_back++;
    return WM_OK;
  }
  self->newest_ns = frames[0].t_ns;
  wm_time_ns arrival_ns = frames[0].arrival_ns;
  if (self->detector->pictures == 2 && frames[1].arrival_ns > arrival_ns) arrival_ns = frames[1].arrival_ns;
  const wm_seen *seen = self->only ? wanted(self, frames[0].t_ns) : NULL;
  arrival_ns = seen ? seen->arrival_ns : arrival_ns + self->base.ready_after_ns;

  wm_estimate newest;
  const wm_estimate *prediction = self->newest && newest_pose_get(self->newest, &newest) ? &newest : NULL;
  wm_time_ns begin_ns = wm_monotonic_ns();
  status = self->detector->detect(self->state, frames, prediction, self->events, self->capacity, &self->event_count);
  wm_time_ns ready_ns = wm_monotonic_ns();
  wm_histogram_add(&self->detect_ns, ready_ns - begin_ns);
  wm_histogram_add(&self->look_ns, decoding_ns + ready_ns - begin_ns);
  if (self->base.is_live) arrival_ns = ready_ns;  // an observation arrives when it is ready, not with its picture
  self->busy_until_ns = arrival_ns;
  if (status != WM_OK) {
    self->refused++;
    self->event_count = 0;
    return WM_OK;
  }
  if (frames[0].t_ns >= self->base.from_ns && frames[0].t_ns <= self->base.until_ns)
    search_outcomes_take(&self->outcomes, self->detector, self->state, self->counts.looks);
  if (self->event_count == 0 && self->gives_looked) {
    wm_event *event = &self->events[self->event_count++];
    memset(event, 0, WM_EVENT_SMALL_BYTES);
    event->kind = WM_EVENT_LOOKED;
    event->t_ns = frames[0].t_ns;
    event->as.looked.sensor = self->sensor;
  }
  onlooker_show(&self->shown, &frames[0], self->events, self->event_count);
  for (size_t i = 0; i < self->event_count; i++) {
    if (self->events[i].kind == WM_EVENT_MARKER) self->events[i].as.marker.sensor = self->sensor;
    if (self->events[i].kind == WM_EVENT_SIGHTING) self->events[i].as.sighting.sensor = self->sensor;
    self->events[i].arrival_ns = arrival_ns;
    self->events[i].source = self->base.index;
    self->events[i].seq = self->seq++;
    self->events[i].reserved = 0;
  }
  return WM_OK;
}

// Hands out the arrival of the next picture, without detection.
static wm_status announce(vision_source *self, wm_event *out, wm_error *err) {
  wm_frame heads[PICTURES_MAX] = {0};
  wm_status status = find_together(self, heads, err);
  if (status != WM_OK) return status;
  const wm_seen *seen = self->only ? wanted(self, heads[0].t_ns) : NULL;
  memset(out, 0, WM_EVENT_SMALL_BYTES);
  out->kind = WM_EVENT_NONE;
  out->t_ns = heads[0].t_ns;
  out->arrival_ns = seen ? seen->arrival_ns : heads[0].arrival_ns;
  // A busy detector processes the picture when it has finished the one before.
  if (out->arrival_ns < self->busy_until_ns) out->arrival_ns = self->busy_until_ns;
  self->announced = 1;
  return WM_OK;
}

wm_status vision_next(vision_source *self, wm_event *out, wm_error *err) {
  while (self->next_event == self->event_count) {
    if (self->looks_at_arrival && !self->base.is_live && !self->announced) return announce(self, out, err);
    self->announced = 0;
    wm_status status = look(self, err);
    take_counts(self);
    if (status != WM_OK) return status;
  }
  const wm_event *event = &self->events[self->next_event++];
  memcpy(out, event, wm_event_bytes(event));
  self->counts.received++;
  return WM_OK;
}

void vision_skip_to(vision_source *self, wm_time_ns now_ns) {
  if (self->next_event < self->event_count) return;  // of a picture that is processed already
  for (uint32_t i = 0; i < self->detector->pictures; i++)
    (void)self->pictures[i]->ops->skip_to(self->pictures[i], now_ns, NULL);
  take_counts(self);
}
