// SPDX-License-Identifier: Apache-2.0
// Data into a session, poses out of it: the calls of a run's cycle, driven by the caller's clock.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "library/session.h"

#define FARTHEST_NS (INT64_MAX / 4)  // stamps beyond it would overflow in differences
// A time may be so far ahead of the newest one, and the caller's clock so far behind it. Programs seldom stand still
// for longer; UTC, TAI and GPS differ by more (18 s and above), as does a clock that was not set.
#define AHEAD_MAX_NS (10 * WM_NS_PER_S)
// A wrong stamp is alone among right ones. Behind a pause all are far ahead: they are taken once they went on for so
// long, none of them within the bound.
#define PAUSE_PROVEN_NS WM_NS_PER_S

wm_status session_check_started(const session *self, const char *function, wm_error *err) {
  if (self->has_started) return WM_OK;
  return wm_fail(err, WM_BAD_USAGE, "%s: waymark_start has to be called before", function);
}

static wm_status check_time(const char *name, wm_time_ns t_ns, wm_error *err) {
  if (t_ns >= -FARTHEST_NS && t_ns <= FARTHEST_NS) return WM_OK;
  return wm_fail(err, WM_OUT_OF_RANGE, "%s: %lld ns is not a time", name, (long long)t_ns);
}

// A time that may become the session's newest, or the clock's.
static wm_status check_clock(session *self, const char *name, wm_time_ns t_ns, wm_error *err) {
  const int goes_on =
      self->ahead_to_ns != WM_TIME_NONE && t_ns >= self->ahead_from_ns && t_ns - self->ahead_to_ns <= AHEAD_MAX_NS;
  if (self->now_ns != WM_TIME_NONE && self->now_ns - t_ns > AHEAD_MAX_NS)
    return wm_fail(err, WM_TIME_RAN_BACK, "%s: %.3f s behind the newest time of this session: is it of another clock?",
                   name, wm_seconds_between(t_ns, self->now_ns));
  if (self->now_ns == WM_TIME_NONE || t_ns - self->now_ns <= AHEAD_MAX_NS ||
      (goes_on && t_ns - self->ahead_from_ns >= PAUSE_PROVEN_NS)) {
    self->ahead_from_ns = self->ahead_to_ns = WM_TIME_NONE;
    return WM_OK;
  }
  if (!goes_on) self->ahead_from_ns = t_ns;
  self->ahead_to_ns = t_ns;
  return wm_fail(err, WM_OUT_OF_RANGE,
                 "%s: %.3f s ahead of the newest time of this session, at most %.0f s can be: is it of another clock? "
                 "After a pause, times are taken again once they all went on for %.0f s",
                 name, wm_seconds_between(self->now_ns, t_ns), wm_seconds_between(0, AHEAD_MAX_NS),
                 wm_seconds_between(0, PAUSE_PROVEN_NS));
}

// What the merge said to a datum.
static wm_status judge(const session *self, const wm_event *event, wm_merge_verdict verdict, wm_error *err) {
  const char *name = self->assembly.sources[event->source].name;
  const double behind_s = wm_seconds_between(event->t_ns, self->now_ns);
  switch (verdict) {
    case WM_MERGE_TAKEN: break;
    case WM_MERGE_LATE:
      return wm_fail(err, WM_TIME_RAN_BACK,
                     "%s: newer data were fused already, and it is %.3f s behind the newest time of this session: %s",
                     name, behind_s,
                     behind_s > wm_seconds_between(0, AHEAD_MAX_NS)
                         ? "is one of another clock? A session keeps that of its first datum: open another one"
                         : "push in the order of the stamps, or raise lateness_max_ms");
    case WM_MERGE_FUTURE:
      return wm_fail(
          err, WM_OUT_OF_RANGE,
          "%s: its stamp is %.3f s later than its arrival, more than merge.horizon_ms: are both on one clock?", name,
          wm_seconds_between(event->arrival_ns, event->t_ns));
    case WM_MERGE_DUPLICATE: return wm_fail(err, WM_BAD_DATA, "%s: the same datum was pushed before", name);
    case WM_MERGE_DROPPED: return wm_fail(err, WM_FULL, "%s: the queue is full: raise merge.queue_events", name);
  }
  return WM_OK;
}

// A detector waits for pictures as a device's source for data: with is_live the readers do not read ahead.
static void set_live(session *self, uint8_t is_live) {
  for (size_t i = 0; i < wm_vision_count(self->assembly.vision); i++)
    wm_vision_source(self->assembly.vision, i)->is_live = is_live;
}

// With the first datum: from_s and until_s of the configuration count from its stamp.
static wm_status open_readers(session *self, wm_time_ns first_ns, wm_error *err) {
  if (self->has_data) return WM_OK;
  set_live(self, 1);
  wm_status status = wm_source_readers_open(&self->assembly, self->readers, first_ns, &first_ns, err);
  set_live(self, 0);
  self->has_data = status == WM_OK;
  return status;
}

void session_note_unused(session *self) {
  for (size_t i = 0; self->options.note && i < self->assembly.source_count; i++) {
    char text[WM_HEALTH_REASON_MAX];
    if (self->noted >> i & 1u || !wm_pipeline_unused(&self->pipeline, i, text)[0]) continue;
    self->noted |= UINT32_C(1) << i;
    self->options.note(self->options.context, text);
  }
}

static void advance(session *self, wm_time_ns now_ns) {
  if (self->now_ns == WM_TIME_NONE || now_ns > self->now_ns) self->now_ns = now_ns;
  wm_pipeline_advance(&self->pipeline, self->now_ns);
  session_note_unused(self);
}

// Hands on all that the source has now.
static wm_status read_source(session *self, const wm_source *source, wm_error *err) {
  wm_status first = WM_OK;
  for (size_t i = 0; i < self->assembly.source_count; i++) {
    wm_source_reader *reader = &self->readers[i];
    if (reader->source != source) continue;
    for (;;) {
      wm_status status = wm_source_reader_advance(reader, err);
      if (status != WM_OK) return status;
      if (!reader->has_next) return first;
      advance(self, reader->next.arrival_ns);
      if (reader->next.kind == WM_EVENT_NONE) continue;
      const wm_merge_verdict verdict = wm_pipeline_arrive(&self->pipeline, &reader->next);
      if (first == WM_OK) first = judge(self, &reader->next, verdict, err);
    }
  }
  return WM_OK;  // the estimator does not take it
}

static wm_time_ns arrival_of(const session *self, wm_time_ns t_ns, wm_time_ns arrival_ns) {
  if (arrival_ns != WM_TIME_NONE) return arrival_ns;
  return self->now_ns != WM_TIME_NONE && self->now_ns > t_ns ? self->now_ns : t_ns;
}

static wm_status check_times(wm_time_ns t_ns, wm_time_ns arrival_ns, wm_error *err) {
  wm_status status = check_time("t_ns", t_ns, err);
  return status == WM_OK && arrival_ns != WM_TIME_NONE ? check_time("arrival_ns", arrival_ns, err) : status;
}

// The first one's text is kept, for the health.
static void keep_reason(pushed_source *source, const wm_error *err) {
  wm_source_counts *counts = &source->base.counts;
  if (!counts->first_problem[0] && err)
    (void)snprintf(counts->first_problem, sizeof counts->first_problem, "%.255s", err->text);
}

static void count_refused(pushed_source *source, wm_status status, const wm_error *err) {
  wm_source_counts *counts = &source->base.counts;
  keep_reason(source, err);
  *(status == WM_NOT_FINITE || status == WM_OUT_OF_RANGE ? &counts->not_finite : &counts->malformed) += 1;
}

// Of a time that check_clock refused.
static void count_time(session *self, pushed_source *source, wm_status status, const wm_error *err) {
  keep_reason(source, err);
  for (size_t i = 0; i < self->assembly.source_count; i++)
    if (self->readers[i].source == &source->base)
      wm_merge_refuse(self->pipeline.merge, i, status == WM_TIME_RAN_BACK ? WM_MERGE_LATE : WM_MERGE_FUTURE);
}

// source->event is filled but for its arrival.
static wm_status deliver(session *self, pushed_source *source, wm_time_ns arrival_ns, wm_error *err) {
  const wm_time_ns t_ns = source->event.t_ns;
  source->event.arrival_ns = arrival_of(self, t_ns, arrival_ns);
  wm_status status =
      check_clock(self, arrival_ns == WM_TIME_NONE ? "t_ns" : "arrival_ns", source->event.arrival_ns, err);
  if (status != WM_OK) {
    count_time(self, source, status, err);
    return wm_fail_in(err, "%s", source->base.name);
  }
  status = open_readers(self, t_ns, err);
  if (status != WM_OK) return status;
  source->has_event = 1;
  status = read_source(self, &source->base, err);
  source->has_event = 0;
  return status;
}

static wm_status find_source(session *self, const char *function, uint32_t source, pushed_source **out, wm_error *err) {
  wm_status status = session_check_started(self, function, err);
  if (status != WM_OK) return status;
  if (source >= self->source_count)
    return wm_fail(err, WM_NOT_FOUND, "%s: %u is not a source of this session, which has %zu", function, source,
                   self->source_count);
  *out = self->sources[source];
  return WM_OK;
}

wm_status session_push_row(session *self, uint32_t source, wm_time_ns t_ns, wm_time_ns arrival_ns,
                           const double *numbers, size_t count, wm_error *err) {
  pushed_source *to;
  wm_status status = find_source(self, "waymark_push_row", source, &to, err);
  if (status == WM_OK) status = check_times(t_ns, arrival_ns, err);
  if (status != WM_OK) return status;
  if (!to->stream)
    return wm_fail(err, WM_BAD_USAGE, "%s: takes events (waymark_push_event) or frames, no rows", to->base.name);
  wm_stream_row row = {.t_ns = t_ns, .arrival_ns = t_ns};
  size_t columns = 0;
  while (columns < WM_STREAM_NUMBERS_MAX && wm_stream_number(to->stream, columns)) columns++;
  if (count > columns)
    return wm_fail(err, WM_BAD_USAGE, "%s: %zu numbers; its table has %zu columns behind the stamps", to->base.name,
                   count, columns);
  for (size_t i = 0; i < WM_STREAM_NUMBERS_MAX; i++) row.number[i] = i < count ? numbers[i] : (double)NAN;
  status = wm_stream_event(to->stream, &row, wm_site_row_mountings(wm_recording_site(self->robot)), &to->event, err);
  if (status == WM_OK) return deliver(self, to, arrival_ns, err);
  count_refused(to, status, err);
  return wm_fail_in(err, "%s", to->base.name);
}

static void set_sensor(wm_event *event, uint16_t sensor) {
  if (sensor == NO_SENSOR) return;
  if (event->kind == WM_EVENT_SIGHTING) event->as.sighting.sensor = sensor;
  if (event->kind == WM_EVENT_MARKER) event->as.marker.sensor = sensor;
  if (event->kind == WM_EVENT_LOOKED) event->as.looked.sensor = sensor;
}

wm_status session_push_event(session *self, uint32_t source, const wm_event *event, wm_error *err) {
  pushed_source *to;
  wm_status status = find_source(self, "waymark_push_event", source, &to, err);
  if (status == WM_OK) status = check_times(event->t_ns, event->arrival_ns, err);
  if (status != WM_OK) return status;
  memcpy(&to->event, event, wm_event_bytes(event));
  set_sensor(&to->event, to->sensor);
  status = pushed_source_check(to, &to->event, self->assembly.setup.sensor_count, err);
  if (status == WM_OK) return deliver(self, to, event->arrival_ns, err);
  count_refused(to, status, err);
  return status;
}

wm_status session_push_can(session *self, const char *interface, const wm_can_frame *frame, wm_error *err) {
  wm_status status = session_check_started(self, "waymark_push_can", err), first = WM_OK;
  if (status == WM_OK) status = check_time("t_ns", frame->t_ns, err);
  if (status != WM_OK) return status;
  size_t takers = 0;
  for (size_t i = 0; i < self->source_count; i++) {
    pushed_source *to = self->sources[i];
    wm_error why;
    if (!to->decoder || (to->interface[0] && strcmp(to->interface, interface) != 0)) continue;
    takers++;
    status = wm_can_event(to->decoder, to->part, &to->gnss, frame, &to->event, &to->base.counts, &why);
    if (status == WM_BAD_DATA) {
      status = wm_fail_in(&why, "%s", to->base.name);
      keep_reason(to, &why);
    }
    if (status == WM_OK) status = deliver(self, to, WM_TIME_NONE, &why);
    if (first != WM_OK || status == WM_OK || status == WM_AGAIN) continue;
    first = status;
    if (err) *err = why;
  }
  if (takers > 0) return first;
  return wm_fail(err, WM_NOT_FOUND,
                 "waymark_push_can: this session has no source for '%.40s': add \"can\" or \"can:%.40s\"", interface,
                 interface);
}

wm_status session_push_picture(session *self, const char *camera, const wm_frame *frame, wm_error *err) {
  wm_status status = session_check_started(self, "waymark_push_picture", err);
  if (status == WM_OK) status = check_times(frame->t_ns, frame->arrival_ns, err);
  if (status != WM_OK) return status;
  const wm_rig *rig = wm_site_rig(wm_recording_site(self->robot));
  const int index = wm_rig_find_camera(rig, camera);
  if (index < 0) return wm_fail(err, WM_NOT_FOUND, "'%.40s' is not a camera of calibration.yaml", camera);
  const wm_camera *is = &rig->cameras[index];
  if (!frame->grey || frame->width_px != is->width_px || frame->height_px != is->height_px ||
      frame->stride_bytes < frame->width_px)
    return wm_fail(err, WM_BAD_DATA, "%s: a picture of %u x %u, rows of %u bytes; calibration.yaml has %u x %u", camera,
                   frame->width_px, frame->height_px, frame->stride_bytes, is->width_px, is->height_px);
  wm_frame taken = *frame;
  taken.arrival_ns = arrival_of(self, frame->t_ns, frame->arrival_ns);
  status = check_clock(self, camera, taken.arrival_ns, err);
  if (status == WM_OK) status = open_readers(self, frame->t_ns, err);
  if (status != WM_OK) return status;
  if (!pushed_pictures_put(self->pictures, index, &taken))
    return wm_fail(err, WM_NOT_FOUND, "waymark_push_picture: no detector of `vision:` looks at the camera '%.40s'",
                   camera);
  for (size_t i = 0; status == WM_OK && i < wm_vision_count(self->assembly.vision); i++)
    status = read_source(self, wm_vision_source(self->assembly.vision, i), err);
  return status;
}

wm_status session_advance(session *self, const char *function, wm_time_ns now_ns, wm_error *err) {
  wm_status status = session_check_started(self, function, err);
  if (status == WM_OK) status = check_time("now_ns", now_ns, err);
  if (status == WM_OK) status = check_clock(self, "now_ns", now_ns, err);
  if (status == WM_OK && self->has_data) advance(self, now_ns);  // else a wrong one would make all data late
  return status;
}

wm_status session_pose(session *self, wm_time_ns now_ns, wm_published *out, wm_error *err) {
  wm_status status = session_advance(self, "waymark_pose", now_ns, err);
  if (status != WM_OK) return status;
  wm_estimate expected;
  const int there_is_one = wm_pipeline_publish(&self->pipeline, now_ns, out);
  if (there_is_one) {
    out->made_ns = now_ns;
    wm_pipeline_bound(&self->pipeline, out, &self->bound);
    self->pipeline.output.put(self->pipeline.output.context, WM_OUTPUT_BOUND, &self->bound, sizeof self->bound);
    self->pipeline.output.put(self->pipeline.output.context, WM_OUTPUT_PUBLISHED, out, sizeof *out);
  }
  if (wm_pipeline_expect(&self->pipeline, now_ns, &expected))
    wm_vision_set_prediction(self->assembly.vision, &expected);
  return there_is_one ? WM_OK : WM_AGAIN;
}

wm_status session_bound(session *self, wm_bound *out, wm_error *err) {
  wm_status status = session_check_started(self, "waymark_bound", err);
  if (status != WM_OK) return status;
  *out = self->bound;
  return self->bound.risk > 0 ? WM_OK : WM_AGAIN;
}

wm_status session_health(session *self, wm_health *out, wm_error *err) {
  wm_status status = session_check_started(self, "waymark_health", err);
  if (status != WM_OK) return status;
  memset(out, 0, sizeof *out);
  wm_pipeline_health(&self->pipeline, self->now_ns, out);
  if (self->has_data) wm_source_readers_health(self->readers, self->assembly.source_count, out);
  return WM_OK;
}
