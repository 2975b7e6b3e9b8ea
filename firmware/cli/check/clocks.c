// SPDX-License-Identifier: Apache-2.0
#include "cli/check/clocks.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Before this time of 1970 no robot drove; a clock that starts at boot stays below it, too.
#define CLOCK_SET_NS (INT64_C(1000000000) * WM_NS_PER_S)  // September 2001
#define JUMP_MIN_NS (500 * WM_NS_PER_MS)                  // NTP sets a clock that is off by more than 0.128 s
#define GAP_MIN_NS (2 * WM_NS_PER_S)
#define GAP_PERIODS 50.0              // a gap is so many of the source's mean periods
#define PAUSE_NS (600 * WM_NS_PER_S)  // longer: a clock was set, or recordings were put together
#define OVERLAP_MAX_S 0.25            // of two parts of rows in disorder: late rows at their ends
#define EVENTS_MIN 20
#define SAME_STAMP_NOTE 0.2  // share of the rows that have the stamp of the one before
#define SAME_STAMP_BAD 0.5
#define MANY 4  // rows of one stamp, in the mean
#define TWICE_NOTE 0.01
#define UNUSED_BAD 0.02            // share of a source that a run drops or ignores
#define LATE_OBSERVATIONS_BAD 0.1  // of observations that a slow transport brings too late: the rest is right
#define STAMP_MAX_NS (INT64_MAX / 4)
#define DIFFERENCE_MAX_NS (60 * WM_NS_PER_S)  // differences of stamps are below it

void clock_data_init(clock_data *self, const wm_assembly *assembly) {
  memset(self, 0, sizeof *self);
  self->assembly = assembly;
  for (size_t s = 0; s < WM_SOURCES_MAX; s++)
    for (size_t k = 0; k < sizeof self->at[s].stamp_ns / sizeof self->at[s].stamp_ns[0]; k++)
      self->at[s].stamp_ns[k] = WM_TIME_NONE;
}

// What is measured once at a time: of CAN a quantity, else the kind. Negative: several at a time are usual.
static int measured_once(const wm_event *event) {
  switch (event->kind) {
    case WM_EVENT_QUANTITIES:
      return event->as.quantities.count > 0 && event->as.quantities.id[0] < WM_Q_COUNT
                 ? WM_EVENT_KIND_COUNT + event->as.quantities.id[0]
                 : -1;
    case WM_EVENT_TWIST2:
    case WM_EVENT_TWIST6:
    case WM_EVENT_INCREMENT:
    case WM_EVENT_POSITION:
    case WM_EVENT_HEADING: return event->kind;
    default: return -1;
  }
}

static void take_grid(clock_facts *f, const wm_event *event) {
  const int what = measured_once(event);
  if (what < 0) return;
  f->measured++;
  if (f->stamp_ns[what] == event->t_ns)
    f->same_stamp++;
  else
    f->stamps++;
  f->stamp_ns[what] = event->t_ns;
}

static void take_step(clock_facts *f, const wm_event *event) {
  const wm_time_ns step_ns = event->t_ns - f->before_ns;
  const double into_s = wm_seconds_between(f->first_ns, f->before_ns);
  if (step_ns < -JUMP_MIN_NS) {
    f->backs++;
    if (-step_ns > f->back_ns) {
      f->back_ns = -step_ns;
      f->back_s = into_s;
    }
  } else if (step_ns > GAP_MIN_NS) {
    f->forwards++;
    if (step_ns > f->forward_ns) {
      f->forward_ns = step_ns;
      f->forward_arrival_ns = event->arrival_ns - f->arrived_ns;
      f->forward_s = into_s;
      if (event->t_ns > CLOCK_SET_NS && f->before_ns < CLOCK_SET_NS) f->since_1970 = f->events;
    }
  } else if (step_ns > 0) {
    f->covered_s += (double)step_ns * 1e-9;
  }
}

static void take_part(clock_facts *f, wm_time_ns t_ns) {
  const size_t most = sizeof f->part / sizeof f->part[0];
  const int goes_back = f->events > 0 && t_ns - f->before_ns < -JUMP_MIN_NS;
  const int is_newest_again = f->newest_ns - f->before_ns > JUMP_MIN_NS && t_ns >= f->newest_ns;
  if (f->events == 0 || goes_back || is_newest_again) {
    if (f->parts < most) f->part[f->parts].oldest_ns = f->part[f->parts].newest_ns = t_ns;
    f->parts++;
  }
  if (f->parts > most) return;
  if (t_ns < f->part[f->parts - 1].oldest_ns) f->part[f->parts - 1].oldest_ns = t_ns;
  if (t_ns > f->part[f->parts - 1].newest_ns) f->part[f->parts - 1].newest_ns = t_ns;
}

// Rows that a program wrote one landmark after the other have a step back between two.
static void take_identity(clock_facts *f, const wm_event *event) {
  const int is_known = event->kind == WM_EVENT_SIGHTING && event->as.sighting.landmark_id >= 0;
  const uint64_t id = is_known ? UINT64_C(1) << (event->as.sighting.landmark_id % 64) : 0;
  if (f->events > 0 && event->t_ns - f->before_ns < -JUMP_MIN_NS) {
    f->ids_before |= f->ids;
    f->ids = 0;
  }
  f->ids |= id;
  f->is_mixed |= id == 0 || (f->ids_before & id) != 0;
}

void clock_data_take(clock_data *self, const wm_event *event) {
  clock_facts *f = &self->at[event->source];
  if (event->source >= WM_SOURCES_MAX || llabs(event->t_ns) > STAMP_MAX_NS || llabs(event->arrival_ns) > STAMP_MAX_NS)
    return;
  take_part(f, event->t_ns);
  take_identity(f, event);
  if (f->events == 0)
    f->first_ns = f->newest_ns = event->t_ns;
  else
    take_step(f, event);
  take_grid(f, event);
  f->behind += event->t_ns < f->newest_ns;
  if (f->newest_ns - event->t_ns > f->behind_ns) f->behind_ns = f->newest_ns - event->t_ns;
  if (event->t_ns > f->newest_ns) f->newest_ns = event->t_ns;
  f->events++;
  f->before_ns = event->t_ns;
  f->arrived_ns = event->arrival_ns;
}

static double period_s(const clock_facts *f) { return f->events > 1 ? f->covered_s / (double)(f->events - 1) : 0; }

// Whether the parts, in the order of time, follow each other without an overlap or a gap. Where a clock was set back
// the stamps of some time come twice.
static int parts_follow(const clock_facts *f) {
  const double gap_s = fmax(GAP_MIN_NS * 1e-9, GAP_PERIODS * period_s(f));
  if (f->parts > sizeof f->part / sizeof f->part[0]) return 0;
  for (size_t i = 0; i < f->parts; i++) {
    const wm_time_ns end_ns = f->part[i].newest_ns;
    if (end_ns == f->newest_ns) continue;  // the last one
    size_t followers = 0;
    for (size_t k = 0; k < f->parts; k++) {
      if (k == i) continue;
      const double after_s = wm_seconds_between(end_ns, f->part[k].oldest_ns);
      const double before_s = wm_seconds_between(f->part[k].newest_ns, f->part[i].oldest_ns);
      if (after_s < -OVERLAP_MAX_S && before_s < -OVERLAP_MAX_S) return 0;
      followers += after_s >= -OVERLAP_MAX_S && after_s <= gap_s;
    }
    if (followers == 0) return 0;
  }
  return 1;
}

// `out_of_order`: rows whose arrival is before that of the row above, of the whole file. A clock makes a few steps, and
// no small ones that go back together.
static int is_disordered(const clock_facts *f, uint64_t out_of_order) {
  if (f->events < EVENTS_MIN || out_of_order == 0 || f->behind_ns <= JUMP_MIN_NS) return 0;
  return f->backs == 0 || f->backs > CLOCK_BACKS_MAX || !f->is_mixed || parts_follow(f);
}

static int jumps_back(const clock_facts *f) {
  return f->backs > 0 && f->backs <= CLOCK_BACKS_MAX && f->behind > f->backs * 2 && f->events >= EVENTS_MIN;
}

// A step of the stamps that the arrivals don't make.
static int contradicts_arrival(const clock_facts *f) {
  return f->forward_arrival_ns > 0 && f->forward_arrival_ns < f->forward_ns / 4;
}

static int is_gap(const clock_facts *f) { return f->forward_ns <= PAUSE_NS && !contradicts_arrival(f); }

static int jumps_forward(const clock_facts *f, int is_motion) {
  if (f->events < EVENTS_MIN || f->forward_ns == 0) return 0;
  if (f->forward_ns > PAUSE_NS || contradicts_arrival(f)) return 1;
  return is_motion && (double)f->forward_ns * 1e-9 > GAP_PERIODS * period_s(f);
}

int clock_data_jumps(const clock_data *self, size_t source) {
  const clock_facts *f = &self->at[source];
  return is_disordered(f, self->assembly->sources[source].source->counts.out_of_order) || jumps_back(f) ||
         f->forward_ns > PAUSE_NS;
}

// ── findings ────────────────────────────────────────────────────────────────────────────────────────────────────────

static void judge_forward(const clock_facts *f, const char *name, wm_findings *out) {
  const double size_s = (double)f->forward_ns * 1e-9;
  char fix[WM_FINDING_FIX_MAX];
  if (f->since_1970 > 0) {
    (void)snprintf(fix, sizeof fix,
                   "the clock was set while it recorded: leave the first %" PRIu64
                   " rows out, or add about %.9g s to their stamps",
                   f->since_1970, size_s);
    wm_find(out, WM_FOUND_CLOCK_JUMPED, WM_SEVERITY_BAD, name, fix,
            "its first %" PRIu64
            " rows have stamps of %s1970; then they jump forwards by %.9g s, %.3f s after the first",
            f->since_1970, f->first_ns == 0 ? "0 or of " : "", size_s, f->forward_s)
        ->size = size_s;
    return;
  }
  const int is_clock = f->forward_ns > PAUSE_NS || contradicts_arrival(f);
  (void)snprintf(fix, sizeof fix,
                 is_clock
                     ? "if the clock was set, subtract %.9g s from the stamps after it; if two recordings were put "
                       "together, drive each on its own"
                     : "did the sensor or its recorder stop for %.9g s, or was the clock set?",
                 size_s);
  wm_find(out, WM_FOUND_CLOCK_JUMPED, is_clock ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE, name, fix,
          "its stamps jump forwards by %.9g s, %.3f s after the first%s", size_s, f->forward_s,
          contradicts_arrival(f) ? ", while they arrive without a gap" : "")
      ->size = size_s;
}

static void judge_back(const clock_facts *f, const char *name, wm_findings *out) {
  char fix[WM_FINDING_FIX_MAX];
  const double size_s = (double)f->back_ns * 1e-9;
  (void)snprintf(
      fix, sizeof fix,
      "the clock was set, or two recordings were put together: add %.9g s to the stamps after it, or drive each "
      "part on its own",
      size_s);
  wm_find(out, WM_FOUND_CLOCK_JUMPED, WM_SEVERITY_BAD, name, fix,
          "its stamps jump back by %.9g s, %.3f s after the first%s; %" PRIu64 " of %" PRIu64
          " rows are older than rows before them",
          size_s, f->back_s, f->backs > 1 ? " (the largest of several)" : "", f->behind, f->events)
      ->size = -size_s;
}

static void judge_disorder(const clock_facts *f, const char *name, wm_findings *out) {
  const double share = (double)f->behind / (double)f->events;
  wm_find(out, WM_FOUND_ROWS_DISORDERED, share > UNUSED_BAD ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE, name,
          "sort the rows by t_ns",
          "its rows are not in the order of time: %" PRIu64 " of %" PRIu64
          " are older than rows before them, by up to %.9g s",
          f->behind, f->events, (double)f->behind_ns * 1e-9)
      ->size = share;
}

// `twice`: rows that are the one before again, which a coarse clock does not make.
static void judge_grid(const clock_facts *f, uint64_t twice, const char *name, wm_findings *out) {
  if (f->measured < EVENTS_MIN || f->stamps == 0) return;
  const double span_s = wm_seconds_between(f->first_ns, f->newest_ns);
  char fix[WM_FINDING_FIX_MAX];
  const int are_many = f->stamps * MANY < f->measured;  // more than of two programs that send the same
  // Differences are a period each: their span is the jitter of the period.
  const int are_differences = are_many && span_s < 0.001 * (double)f->measured && f->first_ns < DIFFERENCE_MAX_NS;
  const uint64_t same = are_many || f->same_stamp < twice ? f->same_stamp : f->same_stamp - twice;
  const double share = (double)same / (double)f->measured;
  if (share < SAME_STAMP_NOTE) return;
  (void)snprintf(
      fix, sizeof fix,
      are_differences ? "are they differences to the row before (candump -td)? Add them up, or record again with -ta"
      : span_s == 0   ? "did its clock stand, or were they written with too few digits? Write whole nanoseconds"
                      : "its stamps have a grid of about %.3g s: stamp with a finer clock, in nanoseconds",
      f->stamps > 1 ? span_s / (double)(f->stamps - 1) : span_s);
  wm_find(out, WM_FOUND_CLOCK_COARSE, share > SAME_STAMP_BAD ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE, name, fix,
          "%" PRIu64 " of %" PRIu64 " rows have the stamp of the one before; all are within %.4g s", same, f->measured,
          span_s)
      ->size = share;
}

// Rows that a run drops or ignores: the largest reason is named.
static void judge_unused(const wm_source_health *s, int is_motion, wm_findings *out) {
  const struct {
    uint64_t count;
    const char *what;
  } kReasons[] = {{s->late, "came later than lateness_max_ms allows, or are older than what was fused"},
                  {s->future, "are stamped later than they arrive"},
                  {s->dropped, "found the queue full"},
                  {s->refused[WM_OUT_OF_RANGE], "are outside of what can be"},
                  {s->refused[WM_TIME_RAN_BACK], "go back in time"},
                  {s->malformed, "cannot be read"},
                  {s->not_finite, "are no finite numbers, or impossible"},
                  {s->frozen, "come with a counter that does not change"}};
  uint64_t unused = 0;
  size_t most = 0;
  for (size_t i = 0; i < sizeof kReasons / sizeof kReasons[0]; i++) {
    unused += kReasons[i].count;
    if (kReasons[i].count > kReasons[most].count) most = i;
  }
  const uint64_t all = s->received + s->malformed + s->not_finite + s->frozen;
  const double most_share = !is_motion && most == 0 ? LATE_OBSERVATIONS_BAD : UNUSED_BAD;
  if (all < EVENTS_MIN || (double)unused <= most_share * (double)all) return;
  for (size_t i = 0; i < out->count; i++)
    if (out->at[i].severity == WM_SEVERITY_BAD && strcmp(out->at[i].about, s->name) == 0 &&
        out->at[i].id != WM_FOUND_OBSERVATIONS_REFUSED)
      return;  // reported already
  wm_find(out, WM_FOUND_ROWS_UNUSED, WM_SEVERITY_BAD, s->name, NULL,
          "%" PRIu64 " of %" PRIu64 " rows are not used: %" PRIu64 " %s", unused, all, kReasons[most].count,
          kReasons[most].what)
      ->size = (double)unused / (double)all;
}

static void judge_twice(const wm_source_health *s, wm_findings *out) {
  const double share = (double)s->duplicates / (double)s->received;
  if (s->received < EVENTS_MIN || share <= TWICE_NOTE) return;
  wm_find(out, WM_FOUND_ROWS_DISORDERED, share > UNUSED_BAD ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE, s->name,
          "look for two programs that send or record the same data; each is used once",
          "%" PRIu64 " of %" PRIu64 " rows come twice", s->duplicates, s->received)
      ->size = share;
}

void clock_data_judge(const clock_data *self, const wm_health *health, wm_findings *out) {
  for (size_t i = 0; i < self->assembly->source_count && i < health->source_count; i++) {
    const clock_facts *f = &self->at[i];
    const wm_assembled_source *s = &self->assembly->sources[i];
    if (f->events == 0 || s->source->is_live) continue;
    if (is_disordered(f, s->source->counts.out_of_order)) {
      judge_disorder(f, s->name, out);
      continue;
    }
    if (jumps_back(f)) judge_back(f, s->name, out);
    const double skipped = (double)(s->source->counts.malformed + s->source->counts.not_finite);
    const int is_skipped = is_gap(f) && skipped > UNUSED_BAD * (double)f->events;  // the rows of the gap: found as such
    if (jumps_forward(f, (s->kinds & WM_MOTION_EVENTS) != 0) && !is_skipped) judge_forward(f, s->name, out);
    judge_grid(f, health->sources[i].duplicates, s->name, out);
    if (!wm_findings_has(out, WM_FOUND_CLOCK_COARSE, s->name)) judge_twice(&health->sources[i], out);
  }
}

void clock_data_judge_unused(const clock_data *self, const wm_health *health, wm_findings *out) {
  for (size_t i = 0; i < self->assembly->source_count && i < health->source_count; i++)
    judge_unused(&health->sources[i], (self->assembly->sources[i].kinds & WM_MOTION_EVENTS) != 0, out);
}
