// SPDX-License-Identifier: Apache-2.0
#include "replay/seen_frames.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "output/event_log.h"
#include "sources/vision.h"
#include "waymark/codec.h"

#define SAME_TIME_NS (20 * WM_NS_PER_MS)  // jitter of playing a recording, and of stamps
#define VOTES_MIN 20                      // fewer equal data may agree by chance
#define ALIKE_MAX 4                       // more equal data (standing still) carry no information about the offset

// A growing list of pairs: hash of the content (or an arrival), and stamp.
typedef struct said {
  uint64_t what;
  wm_time_ns t_ns;
} said;

typedef struct said_list {
  said *at;
  size_t count, capacity;
} said_list;

static wm_status append(said_list *self, uint64_t what, wm_time_ns t_ns, wm_error *err) {
  if (self->count == self->capacity) {
    size_t capacity = self->capacity ? 2 * self->capacity : 4096;
    said *at = realloc(self->at, capacity * sizeof *at);
    if (!at) return wm_fail(err, WM_IO, "no memory for %zu data", capacity);
    self->at = at;
    self->capacity = capacity;
  }
  self->at[self->count++] = (said){what, t_ns};
  return WM_OK;
}

static int by_what(const void *a, const void *b) {
  const said *x = a, *y = b;
  if (x->what != y->what) return x->what < y->what ? -1 : 1;
  return x->t_ns < y->t_ns ? -1 : x->t_ns > y->t_ns;
}

static int by_time(const void *a, const void *b) {
  const said *x = a, *y = b;
  return x->t_ns < y->t_ns ? -1 : x->t_ns > y->t_ns;
}

// Kind and content, without stamps, source and number.
static uint64_t content(const wm_event *event) {
  uint8_t bytes[WM_EVENT_ENCODED_MAX];
  size_t head = 24, length = wm_event_encode(event, bytes, sizeof bytes);
  return length > head ? wm_hash(WM_HASH_START + event->kind, bytes + head, length - head) : 0;
}

// ── the two sides ───────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status read_recorded_motion(wm_recording *recording, const wm_config *config, said_list *out, wm_error *err) {
  wm_recording *again;
  wm_status status = wm_recording_open(wm_recording_dir(recording), &config->overrides, NULL, NULL, &again, err);
  if (status != WM_OK) return status;
  static wm_event event;
  size_t count;
  wm_source *const *sources = wm_recording_sources(again, &count);
  for (size_t i = 0; status == WM_OK && i < count; i++) {
    if (!sources[i]->is_motion) continue;
    while ((status = sources[i]->ops->next(sources[i], &event, err)) == WM_OK)
      if ((status = append(out, content(&event), event.t_ns, err)) != WM_OK) break;
    if (status == WM_END) status = WM_OK;
  }
  wm_recording_close(again);
  return status;
}

// The log's motion; stamps and arrivals (as `what`) of each source of the assembly.
static wm_status read_log(const char *path, const wm_assembly *assembly, said_list *motion, said_list *stamps,
                          wm_error *err) {
  wm_log_reader *log;
  wm_status status = wm_log_open(path, &log, err);
  if (status != WM_OK) return status;
  const wm_log_head *head = wm_log_reader_head(log);
  int place[WM_SOURCES_MAX];
  for (uint32_t i = 0; i < head->source_count; i++) {
    place[i] = -1;
    for (size_t k = 0; k < assembly->source_count; k++)
      if (strcmp(head->sources[i].name, assembly->sources[k].name) == 0) place[i] = (int)k;
  }
  static wm_event event;
  uint64_t missing = 0;
  int cut = 0;
  while (status == WM_OK && (status = wm_log_next(log, &event, &missing, &cut, err)) == WM_OK) {
    if (wm_event_is_motion(&event)) status = append(motion, content(&event), event.t_ns, err);
    said_list *of = place[event.source] < 0 ? NULL : &stamps[place[event.source]];
    if (status == WM_OK && of && (of->count == 0 || of->at[of->count - 1].t_ns != event.t_ns))
      status = append(of, (uint64_t)event.arrival_ns, event.t_ns, err);
  }
  wm_log_reader_close(log);
  return status == WM_END ? WM_OK : status;
}

// ── the clocks ──────────────────────────────────────────────────────────────────────────────────────────────────────

// Each datum of the log votes for its time differences to equal data of the recording.
static wm_status collect_votes(const said_list *recorded, const said_list *logged, said_list *votes, wm_error *err) {
  wm_status status = WM_OK;
  for (size_t i = 0; status == WM_OK && i < logged->count; i++) {
    size_t low = 0, high = recorded->count;
    while (low < high) {
      size_t middle = low + (high - low) / 2;
      if (recorded->at[middle].what < logged->at[i].what)
        low = middle + 1;
      else
        high = middle;
    }
    size_t end = low;
    while (end < recorded->count && recorded->at[end].what == logged->at[i].what) end++;
    if (end - low > ALIKE_MAX) continue;
    for (; status == WM_OK && low < end; low++)
      status = append(votes, 0, logged->at[i].t_ns - recorded->at[low].t_ns, err);
  }
  return status;
}

// The median of the densest interval of votes.
static wm_status find_offset(const char *path, const said_list *recorded, const said_list *logged,
                             wm_time_ns *offset_ns, wm_error *err) {
  said_list votes = {0};
  wm_status status = collect_votes(recorded, logged, &votes, err);
  if (status == WM_OK && votes.count > 0) qsort(votes.at, votes.count, sizeof *votes.at, by_time);
  size_t best_first = 0, best = 0;
  for (size_t first = 0, end = 0; status == WM_OK && first < votes.count; first++) {
    while (end < votes.count && votes.at[end].t_ns - votes.at[first].t_ns <= SAME_TIME_NS) end++;
    if (end - first > best) {
      best = end - first;
      best_first = first;
    }
  }
  if (status == WM_OK && best < VOTES_MIN)
    status =
        wm_fail(err, WM_BAD_DATA, "%s: has no motion in common with the recording: is it of a run fed from it?", path);
  if (status == WM_OK && votes.at) *offset_ns = votes.at[best_first + best / 2].t_ns;
  free(votes.at);
  return status;
}

// ── what is looked at ───────────────────────────────────────────────────────────────────────────────────────────────

static wm_status restrict_sources(const char *path, const wm_assembly *assembly, const said_list *stamps,
                                  wm_time_ns offset_ns, wm_error *err) {
  for (size_t i = 0; i < wm_vision_count(assembly->vision); i++) {
    const wm_source *source = wm_vision_source(assembly->vision, i);
    size_t k = 0;
    while (k < assembly->source_count && assembly->sources[k].source != source) k++;
    if (k == assembly->source_count) continue;  // not used
    if (stamps[k].count == 0)
      return wm_fail(err, WM_BAD_DATA, "%s: has nothing of '%s': its run saw no picture of it", path, source->name);
    wm_seen *seen = calloc(stamps[k].count, sizeof *seen);
    if (!seen) return wm_fail(err, WM_IO, "no memory for %zu stamps", stamps[k].count);
    for (size_t n = 0; n < stamps[k].count; n++)
      seen[n] = (wm_seen){stamps[k].at[n].t_ns - offset_ns, (wm_time_ns)stamps[k].at[n].what - offset_ns};
    wm_vision_look_only_at(assembly->vision, i, seen, stamps[k].count);
  }
  return WM_OK;
}

wm_status seen_frames_apply(const char *path, wm_recording *recording, wm_assembly *assembly, wm_time_ns *offset_ns,
                            wm_error *err) {
  said_list recorded = {0}, logged = {0}, stamps[WM_SOURCES_MAX] = {{0}};
  wm_status status = read_recorded_motion(recording, assembly->config, &recorded, err);
  if (status == WM_OK) status = read_log(path, assembly, &logged, stamps, err);
  if (status == WM_OK && recorded.count > 0) qsort(recorded.at, recorded.count, sizeof *recorded.at, by_what);
  if (status == WM_OK) status = find_offset(path, &recorded, &logged, offset_ns, err);
  for (size_t i = 0; i < WM_SOURCES_MAX; i++)
    if (stamps[i].count > 0) qsort(stamps[i].at, stamps[i].count, sizeof *stamps[i].at, by_time);
  if (status == WM_OK) status = restrict_sources(path, assembly, stamps, *offset_ns, err);
  for (size_t i = 0; i < WM_SOURCES_MAX; i++) free(stamps[i].at);
  free(recorded.at);
  free(logged.at);
  return status;
}
