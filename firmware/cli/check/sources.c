// SPDX-License-Identifier: Apache-2.0
// Checks a source's data to their end.
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "cli/check/check.h"

static int is_landmark(const wm_setup *setup, int32_t id) {
  for (size_t i = 0; i < setup->landmark_count; i++)
    if (setup->landmarks[i].id == id) return 1;
  return 0;
}

static void take(source_facts *facts, const wm_setup *setup, const wm_event *event) {
  if (facts->events++ == 0) facts->first_ns = event->t_ns;
  facts->last_ns = event->t_ns;
  wm_time_ns late_ns;
  if (!__builtin_sub_overflow(event->arrival_ns, event->t_ns, &late_ns) && late_ns > facts->latest_ns)
    facts->latest_ns = late_ns;
  int32_t id = event->kind == WM_EVENT_SIGHTING ? event->as.sighting.landmark_id
               : event->kind == WM_EVENT_MARKER ? event->as.marker.id
                                                : -1;
  if (id < 0) return;
  facts->bare_ranges += event->kind == WM_EVENT_SIGHTING && isnan(event->as.sighting.bearing_rad);
  facts->sightings++;
  facts->unknown_landmarks += !is_landmark(setup, id);
}

static uint64_t of_hundred(uint64_t part, uint64_t whole) { return whole > 0 ? part * 100 / whole : 0; }

static void counted(const wm_assembled_source *s, const source_facts *facts, findings *out) {
  const wm_source_counts *c = &s->source->counts;
  uint64_t all = facts->events + c->malformed;
  if (c->first_problem[0])
    find(out, of_hundred(c->malformed, all) >= 5 ? FINDING_BAD : FINDING_NOTE, s->name,
         s->source->is_motion ? "the DBC and what is on the bus are not the same; or the file is damaged"
                              : "the file is damaged, or its columns differ from its first line",
         "%s (%" PRIu64 " like it, %" PRIu64 " of 100)", c->first_problem, c->malformed, of_hundred(c->malformed, all));
  if (of_hundred(c->lost, facts->events + c->lost) >= 1)
    find(out, FINDING_NOTE, s->name, "a bus or a recorder that is too slow: look at its load and at `waymark doctor`",
         "%" PRIu64 " of 100 are missing by the sender's count or stamps",
         of_hundred(c->lost, facts->events + c->lost));
  if (of_hundred(c->frozen, all) >= 1)
    find(out, FINDING_NOTE, s->name, "the sender is stuck: its values are not used while it is",
         "%" PRIu64 " of 100 equal the one before, which noise makes impossible", of_hundred(c->frozen, all));
  if (of_hundred(c->out_of_order, all) >= 1)
    find(out, FINDING_NOTE, s->name, "the recorder's clock was set, or two recordings were put together",
         "%" PRIu64 " of 100 are older than the one before", of_hundred(c->out_of_order, all));
}

// Adds the time of detection to the lateness of a picture: its observations arrive when they are ready.
static wm_time_ns look_ns(const wm_assembly *assembly, const wm_source *source) {
  for (size_t i = 0; i < wm_vision_count(assembly->vision); i++)
    if (wm_vision_source(assembly->vision, i) == source)
      return wm_histogram_quantile(wm_vision_look_ns(assembly->vision, i), 0.99);
  return 0;
}

static void judge(const wm_assembly *assembly, const wm_assembled_source *s, const source_facts *facts, findings *out) {
  if (facts->events == 0) {
    const char *why = s->source->counts.first_problem;
    find(out, FINDING_BAD, s->name, "record again, or leave it out (`use: false`)", "holds no datum%s%s",
         why[0] ? ": " : "", why);
    return;
  }
  counted(s, facts, out);
  if (facts->latest_ns > s->merge.lateness_max_ns) {
    char mend[120], with_look[80] = "";
    if (facts->look_ns > 0)
      (void)snprintf(with_look, sizeof with_look, " with the %.0f ms that detection takes on this computer",
                     (double)facts->look_ns * 1e-6);
    (void)snprintf(mend, sizeof mend, "sources: [{name: %.40s, lateness_max_ms: %.0f}]", s->name,
                   ceil((double)facts->latest_ns * 1e-7) * 10);
    find(out, FINDING_NOTE, s->name, mend, "as much as %.0f ms late%s, more than its lateness_max_ms (%.0f)",
         (double)facts->latest_ns * 1e-6, with_look, (double)s->merge.lateness_max_ns * 1e-6);
  }
  if (facts->bare_ranges > 0 && strcmp(assembly->config->estimator->name, "slam") == 0)
    find(out, FINDING_NOTE, s->name,
         "drive curves within reach of each: a straight way leaves a landmark and its mirror image open",
         "%" PRIu64
         " of 100 sightings are ranges without a bearing: such a landmark begins as a circle and joins the "
         "map once its place is decided",
         of_hundred(facts->bare_ranges, facts->sightings));
  int needs_landmarks = assembly->setup.landmark_count > 0;
  if (needs_landmarks && of_hundred(facts->unknown_landmarks, facts->sightings) > 50)
    find(out, FINDING_BAD, s->name, "are they the landmarks of this place, by these ids?",
         "%" PRIu64 " of 100 sightings are of ids that landmarks.csv doesn't have",
         of_hundred(facts->unknown_landmarks, facts->sightings));
}

void check_source(const wm_assembly *assembly, const wm_assembled_source *source, uint32_t bound, source_facts *facts,
                  findings *out) {
  static wm_event event;
  static motion_data motion;
  wm_error err = {0};
  wm_status status;
  *facts = (source_facts){.first_ns = WM_TIME_NONE, .last_ns = WM_TIME_NONE, .latest_ns = INT64_MIN};
  motion_data_init(&motion, &assembly->setup.wheels);
  while ((status = source->source->ops->next(source->source, &event, &err)) == WM_OK) {
    if (event.kind == WM_EVENT_NONE) continue;  // a picture's arrival
    take(facts, &assembly->setup, &event);
    motion_data_take(&motion, &event);
  }
  facts->look_ns = look_ns(assembly, source->source);
  if (facts->events > 0) facts->latest_ns += facts->look_ns;
  if (status != WM_END && status != WM_AGAIN) find_error(out, source->name, &err);
  judge(assembly, source, facts, out);
  if (source->kinds & WM_EVENT_BIT(WM_EVENT_QUANTITIES)) motion_data_judge(&motion, bound, out);
}
