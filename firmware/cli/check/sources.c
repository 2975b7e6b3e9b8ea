// SPDX-License-Identifier: Apache-2.0
// The data of each source, and of the sources beside each other.
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "cli/check/check.h"

static int is_landmark(const wm_setup *setup, int32_t id) {
  for (size_t i = 0; i < setup->landmark_count; i++)
    if (setup->landmarks[i].id == id) return 1;
  return 0;
}

static void take(source_facts *facts, const wm_assembly *assembly, const wm_event *event) {
  if (facts->events++ == 0) facts->first_ns = event->t_ns;
  facts->stamps += facts->last_ns != event->t_ns;
  facts->last_ns = event->t_ns;
  wm_time_ns late_ns;
  if (!__builtin_sub_overflow(event->arrival_ns, event->t_ns, &late_ns)) {
    if (late_ns > facts->latest_ns) facts->latest_ns = late_ns;
    facts->ahead += (double)late_ns < -1e6 * assembly->config->runtime.merge_horizon_ms;
  }
  int32_t id = event->kind == WM_EVENT_SIGHTING ? event->as.sighting.landmark_id
               : event->kind == WM_EVENT_MARKER ? event->as.marker.id
                                                : -1;
  if (id < 0) return;
  facts->bare_ranges += event->kind == WM_EVENT_SIGHTING && isnan(event->as.sighting.bearing_rad);
  facts->sightings++;
  facts->unknown_landmarks += !is_landmark(&assembly->setup, id);
}

static void take_range(source_facts *facts, const wm_setup *setup, const wm_event *event) {
  if (event->kind != WM_EVENT_SIGHTING || event->as.sighting.sensor >= setup->sensor_count) return;
  const double range_m = event->as.sighting.range_m;
  facts->ranges += !isnan(range_m);
  facts->far_ranges += range_m > setup->sensors[event->as.sighting.sensor].max_range_m;
}

#define ABSENT_BAD 50  // of 100: a sensor that hardly ever has a value

static uint64_t of_hundred(uint64_t part, uint64_t whole) { return whole > 0 ? part * 100 / whole : 0; }

// Frames whose sender marks that it has no value are no damage.
static int are_absent(const wm_source *source) {
  const wm_source_counts *c = &source->counts;
  return source->is_bus && c->malformed == 0 && c->not_finite > 0 && c->first_problem_kind == WM_ROW_OTHER;
}

// The fix for rows that can't be read, by the first of them.
static const char *mend_rows(const wm_source *source) {
  const wm_source_counts *c = &source->counts;
  if (c->first_problem_kind == WM_ROW_STAMP_OF_SECONDS)
    return "are the stamps in seconds? t_ns and arrival_ns are whole nanoseconds: multiply by 1e9";
  if (c->first_problem_kind == WM_ROW_ANGLE && c->not_finite > c->malformed)
    return "are the angles in degrees? The column is in radians: multiply by 0.0174533 (pi/180)";
  if (c->first_problem_kind == WM_ROW_STAMP_APART)
    return "its stamp is damaged, or was not set: look at what writes it";
  if (c->first_problem_kind == WM_ROW_SENDER)
    return "several units send it: for a certain one write its whole id into the DBC's BO_ line (docs/can.md, J1939)";
  if (c->first_problem_kind == WM_ROW_VALUE || c->first_problem_kind == WM_ROW_ANGLE)
    return "is it in the unit of the column's name? Leave a field empty where nothing was measured";
  if (are_absent(source)) return "its sender has no value then, as a receiver without a fix, or a sensor that is off";
  return source->is_bus ? "the DBC and what is on the bus are not the same; or the file is damaged"
                        : "the file is damaged, or its columns differ from its first line";
}

static void counted(const wm_assembled_source *s, const source_facts *facts, wm_findings *out) {
  const wm_source_counts *c = &s->source->counts;
  const uint64_t skipped = c->malformed + c->not_finite, all = facts->events + skipped + c->frozen;
  if (c->first_problem[0] && skipped + c->frozen == 0)  // of the whole file, not of a row
    wm_find(out, WM_FOUND_NO_DATA, WM_SEVERITY_NOTE, s->name, mend_rows(s->source), "%s", c->first_problem);
  else if (c->first_problem[0] && skipped > 0)
    wm_find(out, WM_FOUND_ROWS_SKIPPED,
            of_hundred(skipped, all) >= (are_absent(s->source) ? ABSENT_BAD : 2) ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE,
            s->name, mend_rows(s->source), "%s (%" PRIu64 " like it, %" PRIu64 " of 100)", c->first_problem, skipped,
            of_hundred(skipped, all));
  if (c->bus_errors > 0)
    wm_find(out, WM_FOUND_DEVICE_TROUBLE, WM_SEVERITY_NOTE, s->name,
            "look at wiring, termination (60 ohms) and bit rate: frames are lost or delayed by them",
            "%" PRIu64 " error frames on the bus", c->bus_errors)
        ->size = (double)c->bus_errors;
  if (c->news > 0 && c->device_note[0])
    wm_find(out, WM_FOUND_SENDER_CHANGED, WM_SEVERITY_NOTE, s->name, NULL, "%s%s", c->device_note,
            c->news > 1 ? "; it is the last of several changes" : "")
        ->size = c->news;
  if (of_hundred(c->lost, facts->events + c->lost) >= 1)
    wm_find(out, WM_FOUND_DATA_MISSING, WM_SEVERITY_NOTE, s->name,
            "a bus or a recorder that is too slow: look at its load and at `waymark doctor`",
            "%" PRIu64 " of 100 are missing by the sender's count or stamps",
            of_hundred(c->lost, facts->events + c->lost));
  if (of_hundred(c->frozen, all) >= 1)
    wm_find(out, WM_FOUND_VALUES_FROZEN, WM_SEVERITY_NOTE, s->name,
            "the sender is stuck: its values are not used meanwhile",
            "%" PRIu64 " of 100 equal the one before, which noise makes impossible", of_hundred(c->frozen, all));
  if (of_hundred(c->out_of_order, all) >= 1 && !facts->jumps)
    wm_find(out, WM_FOUND_ROWS_DISORDERED, WM_SEVERITY_NOTE, s->name,
            "sort the rows by t_ns; or state arrival_ns, where the transport changes their order",
            "%" PRIu64 " of 100 are older than the one before", of_hundred(c->out_of_order, all));
  if (of_hundred(facts->ahead, all) >= 1)
    wm_find(out, WM_FOUND_CLOCKS_APART, of_hundred(facts->ahead, all) >= 5 ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE,
            s->name, "arrival_ns has to be of the clock of t_ns, and later; or leave the column out",
            "%" PRIu64 " of 100 arrive before their stamp (arrival_ns is less than t_ns) and are not used",
            of_hundred(facts->ahead, all));
}

// A source of fewer data has no rate.
#define EVENTS_MIN 20
// Of distinct stamps. The fastest sensor of a robot, a gyro, gives 8000 samples a second.
#define RATE_MAX_HZ 20000.0
// Of what is no IMU's and no bus's, where its stamps would be of 2001 to 2096 as microseconds. As nanoseconds they are
// of a computer that runs for 11 to 46 days.
#define SLOW_MAX_HZ 500.0
#define MICROS_FIRST_NS INT64_C(1000000000000000)
#define MICROS_LAST_NS INT64_C(4000000000000000)

static double most_hz(const wm_assembled_source *s, const source_facts *facts) {
  const int may_be_us = facts->first_ns >= MICROS_FIRST_NS && facts->first_ns <= MICROS_LAST_NS;
  return may_be_us && !(s->kinds & WM_EVENT_BIT(WM_EVENT_QUANTITIES)) ? SLOW_MAX_HZ : RATE_MAX_HZ;
}

static void rate(const wm_assembled_source *s, const source_facts *facts, wm_findings *out) {
  const double seconds = wm_seconds_between(facts->first_ns, facts->last_ns);
  if (facts->events < EVENTS_MIN || facts->stamps < 2 || seconds <= 0) {
    if (facts->events >= EVENTS_MIN && facts->stamps < 2 && s->source->is_motion)
      wm_find(out, WM_FOUND_RATE_IMPLAUSIBLE, WM_SEVERITY_BAD, s->name, NULL,
              "all of its %" PRIu64 " data have the same stamp", facts->events);
    return;
  }
  const double hz = (double)(facts->stamps - 1) / seconds;
  if (hz > most_hz(s, facts))
    wm_find(out, WM_FOUND_RATE_IMPLAUSIBLE, WM_SEVERITY_BAD, s->name, NULL,
            "%.0f data a second: are its stamps in us, ms or s? t_ns is in nanoseconds", hz)
        ->size = hz;
}

// Adds the time of detection to the lateness of a picture: its observations arrive when they are ready.
static wm_time_ns look_ns(const wm_assembly *assembly, const wm_source *source) {
  for (size_t i = 0; i < wm_vision_count(assembly->vision); i++)
    if (wm_vision_source(assembly->vision, i) == source)
      return wm_histogram_quantile(wm_vision_look_ns(assembly->vision, i), 0.99);
  return 0;
}

// No sensor and no network is so late; rows in disorder are.
#define IMPLAUSIBLE_LATENESS_NS (30 * WM_NS_PER_S)
// So late is a clock that was set, not a queue.
#define LATE_BY_CLOCK_NS (2 * WM_NS_PER_S)

static void judge(const wm_assembly *assembly, const wm_assembled_source *s, const source_facts *facts,
                  wm_findings *out) {
  if (facts->events == 0) {
    const char *why = s->source->counts.first_problem;
    wm_find(out, WM_FOUND_NO_DATA, WM_SEVERITY_BAD, s->name,
            why[0] ? mend_rows(s->source) : "record again, or leave it out (`use: false`)", "holds no datum%s%s",
            why[0] ? ": " : "", why);
    return;
  }
  counted(s, facts, out);
  rate(s, facts, out);
  if (facts->latest_ns > IMPLAUSIBLE_LATENESS_NS && !facts->jumps) {
    wm_find(out, WM_FOUND_ROWS_DISORDERED, WM_SEVERITY_BAD, s->name,
            "sort the rows by t_ns; or correct arrival_ns, which has to be of the same clock",
            "rows arrive up to %.1f s after newer ones", (double)facts->latest_ns * 1e-9);
  } else if (facts->latest_ns > s->merge.lateness_max_ns && facts->latest_ns > s->merge.lateness_most_ns &&
             !facts->jumps) {
    char mend[WM_FINDING_FIX_MAX], with_look[80] = "";
    const double late_ms = ceil((double)facts->latest_ns * 1e-7) * 10;
    if (facts->look_ns > 0)
      (void)snprintf(with_look, sizeof with_look, " with the %.0f ms that detection takes on this computer",
                     (double)facts->look_ns * 1e-6);
    if (late_ms <= assembly->config->runtime.merge_horizon_ms)
      (void)snprintf(mend, sizeof mend, "sources: [{name: %.40s, lateness_max_ms: %.0f}]", s->name, late_ms);
    else if (facts->latest_ns < LATE_BY_CLOCK_NS)
      (void)snprintf(
          mend, sizeof mend,
          "merge: {horizon_ms: %.0f} and sources: [{name: %.40s, lateness_max_ms: %.0f}], which delays every "
          "pose; better, send it sooner",
          late_ms, s->name, late_ms);
    else
      (void)snprintf(mend, sizeof mend,
                     "no transport takes that long: are t_ns and arrival_ns of one clock, and was it set meanwhile?");
    wm_find(out, WM_FOUND_DATA_LATE, WM_SEVERITY_NOTE, s->name, mend,
            "as much as %.0f ms late%s, more than its lateness_max_ms (%.0f)", (double)facts->latest_ns * 1e-6,
            with_look, (double)s->merge.lateness_max_ns * 1e-6);
  }
  if (facts->bare_ranges > 0 && strcmp(assembly->config->estimator->name, "slam") == 0)
    wm_find(out, WM_FOUND_BARE_RANGES, WM_SEVERITY_NOTE, s->name,
            "drive curves within reach of each: a straight way leaves a landmark and its mirror image open",
            "%" PRIu64
            " of 100 sightings are ranges without a bearing: such a landmark begins as a circle and joins the "
            "map once its place is decided",
            of_hundred(facts->bare_ranges, facts->sightings));
  if (of_hundred(facts->far_ranges, facts->ranges) > 50)
    wm_find(out, WM_FOUND_VALUE_IMPLAUSIBLE, WM_SEVERITY_BAD, s->name,
            "are they in mm or cm? range_m is in metres; or correct the sensor's max_range_m in calibration.yaml",
            "%" PRIu64 " of 100 ranges are beyond the sensor's max_range_m and not used",
            of_hundred(facts->far_ranges, facts->ranges))
        ->size = (double)facts->far_ranges / (double)facts->ranges;
  int needs_landmarks = assembly->setup.landmark_count > 0;
  if (needs_landmarks && of_hundred(facts->unknown_landmarks, facts->sightings) > 50)
    wm_find(out, WM_FOUND_IDENTITIES_UNKNOWN, WM_SEVERITY_BAD, s->name,
            "are they the landmarks of this place, by these ids?",
            "%" PRIu64 " of 100 sightings are of ids that landmarks.csv doesn't have",
            of_hundred(facts->unknown_landmarks, facts->sightings));
}

// ── sources beside each other ───────────────────────────────────────────────────────────────────────────────────────

// Share of the shorter span that both have in common; both of the same unit.
static double overlap(double a0, double a1, double b0, double b1) {
  const double both = fmin(a1, b1) - fmax(a0, b0), shorter = fmin(a1 - a0, b1 - b0);
  return both <= 0 ? 0 : shorter > 0 ? both / shorter : 1;
}

// A source whose time span has little in common with that of the motion has stamps of another clock or unit.
#define OVERLAP_MIN 0.5

// A tenth of the drive without a source is worth a note; a sensor's start takes some seconds.
#define SILENT_SHARE 0.1
#define SILENT_MIN_S 5.0

static void silent_at_an_end(const char *name, const source_facts *facts, const source_facts *motion,
                             wm_findings *out) {
  const double whole_s = wm_seconds_between(motion->first_ns, motion->last_ns);
  const double silent_s[2] = {wm_seconds_between(motion->first_ns, facts->first_ns),
                              wm_seconds_between(facts->last_ns, motion->last_ns)};
  for (int end = 0; facts->events >= EVENTS_MIN && end < 2; end++)
    if (silent_s[end] > SILENT_MIN_S && silent_s[end] > SILENT_SHARE * whole_s)
      wm_find(out, WM_FOUND_SOURCE_SILENT, WM_SEVERITY_NOTE, name,
              "was there nothing to see, did its program start late or stop early, or was its file cut?",
              "silent for the %s %.1f s of %.1f s of motion", end ? "last" : "first", silent_s[end], whole_s)
          ->size = silent_s[end];
}

static int is_motion(const wm_assembled_source *s) { return (s->kinds & WM_MOTION_EVENTS) != 0; }

// A recorder begins and ends its streams together. One that begins and ends later than the motion, or earlier, by as
// much is of a clock that is off by that: by a second at least, and known to a tenth by its rate. Of two motions turns
// show it.
#define SHIFT_MIN_S 1.0
#define SHIFT_ALIKE 0.1

static double period_s(const source_facts *facts) {
  if (facts->stamps < 2) return (double)INFINITY;
  return wm_seconds_between(facts->first_ns, facts->last_ns) / (double)(facts->stamps - 1);
}

static int shifted_as_a_whole(const char *name, const source_facts *facts, const source_facts *motion,
                              wm_findings *out) {
  const double begins_s = wm_seconds_between(motion->first_ns, facts->first_ns);
  const double ends_s = wm_seconds_between(motion->last_ns, facts->last_ns), shift_s = (begins_s + ends_s) / 2;
  const double known_s = SHIFT_ALIKE * fabs(shift_s);
  if (fmin(fabs(begins_s), fabs(ends_s)) < SHIFT_MIN_S || !(fabs(begins_s - ends_s) <= known_s) ||
      facts->events < EVENTS_MIN || fmax(period_s(facts), period_s(motion)) > known_s)
    return 0;
  char mend[160];
  (void)snprintf(mend, sizeof mend,
                 "all stamps must be of one clock: add %.2f s to its t_ns and arrival_ns, if that is why", -shift_s);
  wm_find(out, WM_FOUND_CLOCKS_APART, WM_SEVERITY_BAD, name, mend,
          "it begins %.2f s %s the motion, and ends %.2f s %s it, as if its stamps were %.1f s too %s", fabs(begins_s),
          shift_s > 0 ? "after" : "before", fabs(ends_s), shift_s > 0 ? "after" : "before", fabs(shift_s),
          shift_s > 0 ? "late" : "early")
      ->size = shift_s;
  return 1;
}

static void spans(const source_data *self, size_t i, const source_facts *motion, wm_findings *out) {
  static const struct {
    double factor;
    const char *unit;
  } kUnits[] = {{1e3, "us"}, {1e6, "ms"}, {1e9, "s"}};
  const source_facts *f = &self->facts[i];
  const char *name = self->assembly->sources[i].name;
  const double m0 = (double)motion->first_ns, m1 = (double)motion->last_ns;
  const double t0 = (double)f->first_ns, t1 = (double)f->last_ns;
  if (overlap(t0, t1, m0, m1) >= OVERLAP_MIN) {
    if (is_motion(&self->assembly->sources[i]) || !shifted_as_a_whole(name, f, motion, out))
      silent_at_an_end(name, f, motion, out);
    return;
  }
  for (size_t k = 0; k < sizeof kUnits / sizeof kUnits[0]; k++)
    if (overlap(t0 * kUnits[k].factor, t1 * kUnits[k].factor, m0, m1) >= OVERLAP_MIN) {
      char mend[160];
      (void)snprintf(mend, sizeof mend, "multiply its t_ns (and arrival_ns) by %.0f: they are in %s", kUnits[k].factor,
                     kUnits[k].unit);
      wm_find(out, WM_FOUND_CLOCKS_APART, WM_SEVERITY_BAD, name, mend,
              "its stamps overlap those of the motion only if they are read as %s", kUnits[k].unit);
      return;
    }
  wm_find(out, WM_FOUND_CLOCKS_APART, WM_SEVERITY_BAD, name,
          "all stamps must be of one clock: add the clocks' difference to t_ns and arrival_ns",
          "its stamps and those of the motion don't overlap: it begins %.3f s after the motion and lasts %.1f s, the "
          "motion lasts %.1f s",
          (t0 - m0) * 1e-9, (t1 - t0) * 1e-9, (m1 - m0) * 1e-9);
}

// ── interface ───────────────────────────────────────────────────────────────────────────────────────────────────────

void source_data_init(source_data *self, const wm_assembly *assembly) {
  self->assembly = assembly;
  for (size_t i = 0; i < WM_SOURCES_MAX; i++)
    self->facts[i] = (source_facts){.first_ns = WM_TIME_NONE, .last_ns = WM_TIME_NONE, .latest_ns = INT64_MIN};
  motion_data_init(&self->motion, &assembly->setup.wheels);
  channels_init(&self->channels, &assembly->setup.wheels);
  clock_data_init(&self->clocks, assembly);
  course_data_init(&self->course);
}

void source_data_take(source_data *self, const wm_event *event) {
  take(&self->facts[event->source], self->assembly, event);
  take_range(&self->facts[event->source], &self->assembly->setup, event);
  motion_data_take(&self->motion, event);
  channels_take(&self->channels, event);
  clock_data_take(&self->clocks, event);
  course_data_take(&self->course, event);
}

void source_data_free(source_data *self) { channels_free(&self->channels); }

void source_data_judge(source_data *self, uint32_t bound, const wm_health *health, wm_findings *out) {
  const source_facts *motion = NULL;
  uint32_t kinds = 0;
  clock_data_judge(&self->clocks, health, out);
  for (size_t i = 0; i < self->assembly->source_count; i++) {
    const wm_assembled_source *s = &self->assembly->sources[i];
    source_facts *facts = &self->facts[i];
    if (s->source->is_live) continue;
    facts->look_ns = look_ns(self->assembly, s->source);
    facts->jumps = clock_data_jumps(&self->clocks, i);
    if (facts->events > 0) facts->latest_ns += facts->look_ns;
    judge(self->assembly, s, facts, out);
    kinds |= s->kinds;
    if (is_motion(s) && facts->events > 1 && !facts->jumps && !motion) motion = facts;
  }
  for (size_t i = 0; motion && i < self->assembly->source_count; i++)
    if (self->facts[i].events > 1 && &self->facts[i] != motion && !self->facts[i].jumps) spans(self, i, motion, out);
  course_data_judge(&self->course, out);
  if (kinds & WM_EVENT_BIT(WM_EVENT_QUANTITIES)) motion_data_judge(&self->motion, self->assembly, bound, out);
  stuck_judge(&self->channels, self->assembly, out);
  noise_judge(&self->channels, self->assembly, out);
  comparisons_judge(&self->channels, self->assembly, out);
  drifts_judge(&self->channels, self->assembly, out);
}
