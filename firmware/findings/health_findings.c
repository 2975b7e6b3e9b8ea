// SPDX-License-Identifier: Apache-2.0
// Findings by the health of a run: what a robot, a viewer and a report can derive alike.
#include <inttypes.h>
#include <math.h>

#include "findings/findings.h"

#define OBSERVATIONS_MIN 20
// Shares of a source's observations that the gate refused. With good configurations at most 14 % (docs/check.md).
#define REFUSED_NOTE 0.07
#define REFUSED_BAD 0.20
// Detectors with this share of false detections exist (echoes, misread codes), and a drive draws more or fewer. Beyond
// so many standard deviations of the draw, less than one of a thousand drives has as many.
#define REFUSED_SIGMAS 3.1
// Of the estimator's cycles. A robot's loop misses none; a computer that is shared with other work misses a few.
#define DEADLINES_NOTE 0.001

// Later than any transport, so that no lateness_max_ms is to be advised.
#define LATE_BY_CLOCK_NS (10 * WM_NS_PER_S)

// The lateness_max_ms that covers this lateness, in whole 10 ms.
static double would_do_ms(wm_time_ns lateness_ns) { return ceil((double)lateness_ns * 1e-7) * 10; }

static void about_lateness(const wm_source_health *s, wm_findings *out) {
  if (s->late == 0 && s->lateness_p99_ns <= s->lateness_max_ns) return;
  const double bound_ms = (double)s->lateness_max_ns * 1e-6;
  const int is_usual = s->lateness_p99_ns > s->lateness_max_ns;
  const int is_clock = s->lateness_p99_ns > LATE_BY_CLOCK_NS;
  char fix[WM_FINDING_FIX_MAX] = "the rows of a source have to be in the order of their stamps";
  if (is_clock)
    (void)snprintf(fix, sizeof fix, "its stamps are of another clock than their arrivals, or the clock was set");
  else if (s->lateness_worst_ns > s->lateness_max_ns && s->lateness_worst_ns < LATE_BY_CLOCK_NS)
    (void)snprintf(
        fix, sizeof fix,
        "`lateness_max_ms: %.0f` for this source would suffice for all, %.0f for 99 of 100; merge.horizon_ms "
        "has to be as large",
        would_do_ms(s->lateness_worst_ns), would_do_ms(s->lateness_p99_ns));
  else if (is_usual)
    (void)snprintf(fix, sizeof fix,
                   "`lateness_max_ms: %.0f` for this source would suffice; merge.horizon_ms has to be as large",
                   would_do_ms(s->lateness_p99_ns));
  wm_finding *f =
      is_usual ? wm_find(out, WM_FOUND_DATA_LATE, WM_SEVERITY_NOTE, s->name, fix,
                         "its lateness is %.0f ms (99 of 100 at most), lateness_max_ms is %.0f; %" PRIu64 " of %" PRIu64
                         " came too late and were dropped",
                         (double)s->lateness_p99_ns * 1e-6, bound_ms, s->late, s->received)
               : wm_find(out, WM_FOUND_DATA_LATE, WM_SEVERITY_NOTE, s->name, fix,
                         "%" PRIu64 " of %" PRIu64
                         " arrived after newer data had been fused (out of the source's order, or later than its "
                         "lateness_max_ms of %.0f, at worst %.0f ms) and were dropped",
                         s->late, s->received, bound_ms, (double)s->lateness_worst_ns * 1e-6);
  f->size = s->received > 0 ? (double)s->late / (double)s->received : 0;
}

static uint64_t refused_by_estimator(const wm_source_health *s) {
  uint64_t sum = 0;
  for (size_t i = 0; i < WM_STATUS_COUNT; i++) sum += s->refused[i];
  return sum;
}

static void about_losses(const wm_source_health *s, const char *reason, wm_findings *out) {
  const struct {
    wm_finding_id id;
    uint64_t count;
    const char *what, *fix;
  } kinds[] = {
      {WM_FOUND_DATA_MISSING, s->dropped, "dropped because a queue was full",
       "raise merge.queue_events and realtime.ring_events, or give the run more of the computer"},
      {WM_FOUND_DATA_MISSING, s->lost, "missing by the sender's own count (pictures: by their stamps)", NULL},
      {WM_FOUND_ROWS_SKIPPED, s->malformed, "could not be read", NULL},
      {WM_FOUND_ROWS_SKIPPED, s->not_finite, "were no finite numbers, or outside of what can be", NULL},
      {WM_FOUND_ROWS_SKIPPED, refused_by_estimator(s), "were of no use to the estimator", NULL},
      {WM_FOUND_ROWS_DISORDERED, s->out_of_order, "were older than the one before", NULL},
      {WM_FOUND_ROWS_DISORDERED, s->duplicates, "were sent twice and fused once",
       "look for two programs that send or record the same data"},
      {WM_FOUND_CLOCKS_APART, s->future, "had stamps from the future", NULL},
      {WM_FOUND_VALUES_FROZEN, s->frozen, "equal the one before, or have a counter that does not change", NULL},
      {WM_FOUND_DATA_MISSING, s->overflows,
       "were dropped by the kernel or the device because they were not read in time", NULL},
      {WM_FOUND_DEVICE_TROUBLE, s->bus_errors, "error frames on the bus",
       "look at wiring, termination (60 ohms) and bit rate: `ip -d -s link show`"}};
  for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
    if (kinds[i].count == 0) continue;
    const int is_refused = kinds[i].id == WM_FOUND_ROWS_SKIPPED;
    const int has_reason = is_refused || kinds[i].id == WM_FOUND_CLOCKS_APART;
    const int is_apart = kinds[i].id == WM_FOUND_DATA_MISSING || kinds[i].id == WM_FOUND_VALUES_FROZEN;
    // What was refused, is missing or repeats the one before is not among those received.
    const uint64_t all = s->received + (is_refused ? s->malformed + s->not_finite : is_apart ? kinds[i].count : 0);
    wm_find(out, kinds[i].id, WM_SEVERITY_NOTE, s->name, kinds[i].fix, "%" PRIu64 " of %" PRIu64 " %s%s%s",
            kinds[i].count, all, kinds[i].what, has_reason && reason[0] ? "; the first: " : "",
            has_reason ? reason : "")
        ->size = all > 0 ? (double)kinds[i].count / (double)all : 0;
    if (has_reason) reason = "";  // it is of one of them
  }
}

static void about_silence(const wm_source_health *s, wm_findings *out) {
  if (!s->stale) return;
  if (s->received == 0)
    wm_find(out, WM_FOUND_NO_DATA, WM_SEVERITY_BAD, s->name, NULL, "gave no data");
  else
    wm_find(out, WM_FOUND_SOURCE_SILENT, WM_SEVERITY_NOTE, s->name, NULL, "silent for the last %.1f s",
            (double)s->silent_ns * 1e-9)
        ->size = (double)s->silent_ns * 1e-9;
}

static void about_device(const wm_source_health *s, const char *reason, wm_findings *out) {
  if (s->device == WM_DEVICE_NONE || s->device == WM_DEVICE_WORKS) return;
  if (s->device == WM_DEVICE_ABSENT && reason[0])
    wm_find(out, WM_FOUND_DEVICE_TROUBLE, WM_SEVERITY_BAD, s->name, reason, "nothing that came from it is usable");
  else
    wm_find(out, WM_FOUND_DEVICE_TROUBLE, WM_SEVERITY_BAD, s->name, NULL, "its device is %s",
            wm_device_state_name(s->device));
}

wm_severity wm_refused_severity(uint64_t refused, uint64_t updates) {
  const double n = (double)updates, share = updates > 0 ? (double)refused / n : 0;
  if (share <= REFUSED_NOTE) return WM_SEVERITY_GOOD;
  const double drawn = updates > 0 ? REFUSED_SIGMAS * sqrt(REFUSED_BAD * (1 - REFUSED_BAD) / n) : 0;
  return share > REFUSED_BAD + drawn ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE;
}

static void about_refused(const wm_source_health *s, wm_findings *out) {
  const uint64_t refused = s->rejected[WM_REJECTED_GATE], all = refused + s->fused;
  const uint64_t unknown = s->rejected[WM_REJECTED_UNKNOWN_ID];
  const double share = all > 0 ? (double)refused / (double)all : 0;
  const wm_severity severity = wm_refused_severity(refused, all);
  if (all >= OBSERVATIONS_MIN && severity != WM_SEVERITY_GOOD &&
      !wm_findings_has(out, WM_FOUND_OBSERVATIONS_REFUSED, s->name))
    wm_find(out, WM_FOUND_OBSERVATIONS_REFUSED, severity, s->name, NULL,
            "%.0f of 100 of its observations contradict the pose and were refused", 100 * share)
        ->size = share;
  if (unknown >= OBSERVATIONS_MIN && unknown > s->received / 2)
    wm_find(out, WM_FOUND_IDENTITIES_UNKNOWN, WM_SEVERITY_BAD, s->name, NULL,
            "%" PRIu64 " of %" PRIu64 " observations are of ids that the map doesn't have", unknown, s->received)
        ->size = (double)unknown / (double)s->received;
}

static const char *const kMotionTexts[] = {
    "the left encoder stood still while the robot moved (dead?)",
    "the right encoder stood still while the robot moved (dead?)",
    "a message's counter stood still: its sender is stuck; its values were not used",
    "the yaw rate never changed (stuck sensor?)",
    "samples of the last seconds exceeded the plausible acceleration and were refused (motion.limits)",
    "the vehicle rose, rolled or pitched for seconds, which an estimator in the plane does not model",
    "the gyro's roll rate never changed (stuck sensor?); it is not used",
    "the gyro's pitch rate never changed (stuck sensor?); it is not used",
    "the accelerometer gave one and the same value (stuck sensor?); it is not used",
    "the speed is silent while other sensors of the motion go on; the last one holds for a while",
    "the gyro, or the steering, is silent while the speed comes; the wheels or another sensor stand in",
    "the wheels turn and the robot stands: a hole, a wall; its speed is unknown meanwhile",
    "one wheel spins, by the gyro; the speed is unknown meanwhile",
    "the robot moves and its wheels stand: it is pushed, or carried; its speed is unknown meanwhile",
    "the robot moves otherwise than its wheels turn: lifted, or sliding; its speed is unknown meanwhile"};
#define FIRST_OF_WHEELS 11  // from here on the ground is to blame, and no sensor
enum { kMotionTextCount = sizeof kMotionTexts / sizeof kMotionTexts[0] };

const char *wm_motion_health_text(uint32_t bits) {
  for (unsigned i = 0; i < kMotionTextCount; i++)
    if ((bits >> i) & 1u) return kMotionTexts[i];
  return "";
}

static void about_motion(uint32_t bits, wm_findings *out) {
  for (unsigned i = 0; i < kMotionTextCount; i++)
    if ((bits >> i) & 1u)
      wm_find(out, WM_FOUND_MOTION_SENSOR, i < FIRST_OF_WHEELS ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE, "motion",
              i < FIRST_OF_WHEELS ? NULL : "", "%s", kMotionTexts[i]);
}

// Landmarks at other places than in the map, or without capacity in the map.
const char *wm_cause_text(unsigned cause) {
  static const char *const kTexts[WM_CAUSE_COUNT] = {"",
                                                     "contradicts the pose",
                                                     "is refused",
                                                     "has innovations that are larger than stated",
                                                     "has biased innovations",
                                                     "contradicted the last pose; the one found since is on probation",
                                                     "has unknown identities",
                                                     "is silent",
                                                     "does not reach the pose",
                                                     "turns to the other side than the motion, or by a fraction of it",
                                                     "fit other floors, too"};
  return cause < WM_CAUSE_COUNT ? kTexts[cause] : "";
}

static void about_state(const wm_health *h, wm_findings *out) {
  if ((h->state != WM_STATE_DEGRADED && h->state != WM_STATE_LOST) || h->cause == WM_CAUSE_NONE) return;
  const int has_source = h->cause_source >= 0 && (uint32_t)h->cause_source < h->source_count;
  const char *name = has_source                     ? h->sources[h->cause_source].name
                     : h->cause == WM_CAUSE_OFF_MAP ? "map"
                                                    : "observations";
  if (wm_findings_has(out, WM_FOUND_POSE_DOUBTFUL, name)) return;
  wm_find(out, WM_FOUND_POSE_DOUBTFUL, WM_SEVERITY_BAD, name, NULL, "%s: the pose is %s now", wm_cause_text(h->cause),
          wm_state_name(h->state));
}

void wm_health_map_findings(const wm_health *health, wm_findings *out) {
  static const struct {
    wm_counter_kind kind;
    wm_finding_id id;
    const char *what;
  } kCounts[] = {{WM_COUNTER_LANDMARKS_MOVED, WM_FOUND_LANDMARK_MOVED, "times a landmark was elsewhere than before"},
                 {WM_COUNTER_IDENTITIES_AMBIGUOUS, WM_FOUND_IDENTITIES_AMBIGUOUS,
                  "sightings whose identity (or, of a line, its track's number) stood for two landmarks"},
                 {WM_COUNTER_MAP_FULL, WM_FOUND_CAPACITY_REACHED, "times a new landmark found no room"}};
  for (size_t k = 0; k < sizeof kCounts / sizeof kCounts[0]; k++) {
    const wm_counter *counter = wm_health_counter(health, kCounts[k].kind);
    if (!counter || counter->count == 0) continue;
    char last[40] = "";
    if (counter->landmark_id >= 0)
      (void)snprintf(last, sizeof last, "; the last one is %" PRId32, counter->landmark_id);
    wm_find(out, kCounts[k].id, WM_SEVERITY_NOTE, "map", NULL, "%" PRIu64 " %s%s", counter->count, kCounts[k].what,
            last)
        ->size = (double)counter->count;
  }
}

static void about_program(const wm_health *h, wm_findings *out) {
  const double all = (double)(h->loops + h->deadlines_missed), missed = (double)h->deadlines_missed;
  if (h->other_runs_total > 0)
    wm_find(out, WM_FOUND_OTHER_RUN, WM_SEVERITY_BAD, "messages", NULL,
            "other runs published on the same channels meanwhile (%" PRIu32 ")", h->other_runs_total);
  if (h->outputs_lost > 0)
    wm_find(out, WM_FOUND_OUTPUTS_LOST, WM_SEVERITY_NOTE, "outputs", NULL,
            "%" PRIu64 " records were lost because the disk or LCM was too slow", h->outputs_lost)
        ->size = (double)h->outputs_lost;
  if (missed > DEADLINES_NOTE * all)
    wm_find(out, WM_FOUND_DEADLINES_MISSED, WM_SEVERITY_NOTE, "computer", NULL,
            "%.2g %% of the estimator's cycles began or ended too late", 100 * missed / all)
        ->size = missed / all;
}

void wm_health_findings(const wm_health *health, wm_findings *out) {
  for (uint32_t i = 0; i < health->source_count && i < WM_HEALTH_SOURCES_MAX; i++) {
    const wm_source_health *s = &health->sources[i];
    about_refused(s, out);
    about_lateness(s, out);
    about_losses(s, health->refused_because[i], out);
    about_silence(s, out);
    about_device(s, health->refused_because[i], out);
  }
  about_state(health, out);
  about_motion(health->motion_health, out);
  wm_health_map_findings(health, out);
  about_program(health, out);
}
