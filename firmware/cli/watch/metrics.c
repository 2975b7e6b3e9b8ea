// SPDX-License-Identifier: Apache-2.0
#include "cli/watch/metrics.h"

#include <inttypes.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#define SILENT_NS (2 * WM_NS_PER_S)  // as in watch.c

static void head(FILE *to, const char *name, const char *type, const char *about) {
  (void)fprintf(to, "# HELP waymark_%s %s\n# TYPE waymark_%s %s\n", name, about, name, type);
}

static void value(FILE *to, double number) {
  if (isnan(number))
    (void)fputs(" NaN\n", to);
  else if (isinf(number))
    (void)fputs(number > 0 ? " +Inf\n" : " -Inf\n", to);
  else
    (void)fprintf(to, " %.10g\n", number);
}

static void gauge(FILE *to, const char *name, const char *about, double number) {
  head(to, name, "gauge", about);
  (void)fprintf(to, "waymark_%s", name);
  value(to, number);
}

// Of the format: a backslash before backslash, quote and line feed. Names have no line feeds (lcm_read.c).
static void label(FILE *to, const char *key, const char *text) {
  (void)fprintf(to, "%s=\"", key);
  for (; *text; text++) {
    if (*text == '\\' || *text == '"') (void)fputc('\\', to);
    (void)fputc(*text, to);
  }
  (void)fputc('"', to);
}

static void of_pose(const watch *self, wm_time_ns now_ns, FILE *to) {
  const wm_estimate *e = &self->pose.now;
  const double *c = e->covariance;
  const double xx = c[wm_cov_index(0, 0)], yy = c[wm_cov_index(1, 1)], tt = c[wm_cov_index(5, 5)];
  gauge(to, "pose_age_seconds", "Since the newest pose came.", (double)(now_ns - self->pose_at_ns) * 1e-9);
  gauge(to, "pose_rate_hertz", "Poses a second, smoothed.", self->rate_hz);
  gauge(to, "pose_x_meters", "Position in the map.", e->pose_map_base.p_m[0]);
  gauge(to, "pose_y_meters", "Position in the map.", e->pose_map_base.p_m[1]);
  gauge(to, "pose_heading_radians", "Heading in the map, positive to the left of its x axis.", watch_heading(e));
  gauge(to, "pose_sigma_meters", "Standard deviation of the position, of both axes together.", sqrt(fmax(xx + yy, 0)));
  gauge(to, "pose_heading_sigma_radians", "Standard deviation of the heading.", sqrt(fmax(tt, 0)));
  gauge(to, "pose_fused_age_seconds", "From the newest fused datum to the pose.",
        (double)(e->t_ns - self->pose.fused_until_ns) * 1e-9);
}

static void of_bound(const wm_bound *b, FILE *to) {
  gauge(to, "pose_usable", "1 where both bounds are within the alert limits.", b->usable);
  gauge(to, "pose_bound_meters", "How far the position may be off at that risk.", b->horizontal_m);
  gauge(to, "pose_bound_heading_radians", "How far the heading may be off at that risk.", b->heading_rad);
  gauge(to, "pose_bound_risk", "Probability that the pose is off by more.", b->risk);
}

static void of_state(const watch *self, FILE *to) {
  head(to, "state", "gauge", "1 for the state of the pose, 0 for the others.");
  for (unsigned i = 0; strcmp(wm_state_name(i), "?") != 0; i++) {
    (void)fputs("waymark_state{", to);
    label(to, "state", wm_state_name(i));
    (void)fprintf(to, "} %d\n", self->health.state == i);
  }
  head(to, "findings", "gauge", "Things that are wrong now, by severity.");
  for (unsigned i = WM_SEVERITY_NOTE; i <= WM_SEVERITY_BAD; i++)
    (void)fprintf(to, "waymark_findings{severity=\"%s\"} %zu\n", wm_severity_name(i),
                  wm_findings_of(&self->found, (wm_severity)i));
  head(to, "run_info", "gauge", "The run: its computer, process and number.");
  (void)fputs("waymark_run_info{", to);
  label(to, "host", self->health.host);
  (void)fprintf(to, ",pid=\"%" PRId32 "\",run=\"%016" PRIx64 "\"} 1\n", self->health.pid, self->health.run_id);
}

#define AT(member) offsetof(wm_health, member)
#define OF(member) offsetof(wm_source_health, member)

// Whole numbers of 64 bits; counters since the start of the run.
typedef struct counted {
  const char *name, *about;
  size_t at;
} counted;

static const counted kOfRun[] = {
    {"loops_total", "Cycles of the estimator.", AT(loops)},
    {"deadlines_missed_total", "Cycles that were too late.", AT(deadlines_missed)},
    {"poses_published_total", "Poses made.", AT(published)},
    {"outputs_lost_total", "Records that a slow disk or network had no room for.", AT(outputs_lost)},
    {"lines_lost_total", "Lines of text that a blocked disk had no room for.", AT(lines_lost)}};
static const counted kOfSource[] = {{"received", "Data that came.", OF(received)},
                                    {"fused", "Updates of the pose.", OF(fused)},
                                    {"late", "Data behind what was fused.", OF(late)},
                                    {"dropped", "Data without room in a queue.", OF(dropped)},
                                    {"duplicates", "Data that came twice.", OF(duplicates)},
                                    {"future", "Data with stamps ahead of their arrival.", OF(future)},
                                    {"lost", "Data that are missing by the sender's count.", OF(lost)},
                                    {"malformed", "Data that could not be read.", OF(malformed)},
                                    {"not_finite", "Data with numbers that cannot be.", OF(not_finite)},
                                    {"out_of_order", "Data older than the one before.", OF(out_of_order)},
                                    {"frozen", "Data of a sender that stands still.", OF(frozen)},
                                    {"overflows", "Data that the kernel dropped.", OF(overflows)},
                                    {"bus_errors", "Error frames of the bus.", OF(bus_errors)}};
// Times, ns.
static const counted kTimesOfSource[] = {
    {"silent", "Since its newest datum came.", OF(silent_ns)},
    {"lateness_p99", "From a stamp to its arrival, 99 of 100.", OF(lateness_p99_ns)},
    {"lateness_max", "What its data are waited for.", OF(lateness_max_ns)}};

static uint64_t count_at(const void *of, size_t at) {
  uint64_t count;
  memcpy(&count, (const char *)of + at, sizeof count);
  return count;
}

static void of_run(const wm_health *h, FILE *to) {
  for (const counted *c = kOfRun; c < kOfRun + sizeof kOfRun / sizeof kOfRun[0]; c++) {
    head(to, c->name, "counter", c->about);
    (void)fprintf(to, "waymark_%s %" PRIu64 "\n", c->name, count_at(h, c->at));
  }
  head(to, "resets_total", "counter", "New starts of the estimator.");
  (void)fprintf(to, "waymark_resets_total %" PRIu32 "\n", h->resets);
  head(to, "jumps_total", "counter", "Steps of the pose in the map.");
  (void)fprintf(to, "waymark_jumps_total %" PRIu32 "\n", h->jumps);
  gauge(to, "lost_probability", "That the pose is wrong.", h->lost_probability);
  gauge(to, "reckoning_left_meters", "Way without observations until the pose is too uncertain.", h->reckoning_left_m);
  gauge(to, "send_p99_seconds", "From a pose made to its message handed over, 99 of 100.",
        (double)h->send_p99_ns * 1e-9);
  gauge(to, "other_runs", "Runs on the same channels.", h->other_runs);
  gauge(to, "motion_sensors_broken", "1 where an odometry sensor is dead, stuck or silent, or wheels slip.",
        h->motion_health != 0);
}

static void source_head(FILE *to, const char *name, const wm_source_health *s) {
  (void)fprintf(to, "waymark_source_%s{", name);
  label(to, "source", s->name);
}

// Nothing where the count is 0.
static void count_of(FILE *to, const char *name, const wm_source_health *s, const char *key, const char *word,
                     uint64_t count) {
  if (count == 0) return;
  source_head(to, name, s);
  (void)fputc(',', to);
  label(to, key, word);
  (void)fprintf(to, "} %" PRIu64 "\n", count);
}

static void of_sources(const wm_health *h, FILE *to) {
  char name[48];
  const wm_source_health *end = h->sources + h->source_count;
  for (const counted *c = kOfSource; c < kOfSource + sizeof kOfSource / sizeof kOfSource[0]; c++) {
    (void)snprintf(name, sizeof name, "source_%s_total", c->name);
    head(to, name, "counter", c->about);
    for (const wm_source_health *s = h->sources; s < end; s++) {
      source_head(to, name + strlen("source_"), s);
      (void)fprintf(to, "} %" PRIu64 "\n", count_at(s, c->at));
    }
  }
  head(to, "source_rejected_total", "counter", "Updates that were refused, by verdict.");
  for (const wm_source_health *s = h->sources; s < end; s++)
    for (unsigned i = 1; i < WM_VERDICT_COUNT; i++)
      count_of(to, "rejected_total", s, "verdict", wm_verdict_name(i), s->rejected[i]);
  head(to, "source_refused_total", "counter", "Data that the estimator could not use, by status.");
  for (const wm_source_health *s = h->sources; s < end; s++)
    for (unsigned i = 1; i < WM_STATUS_COUNT; i++)
      count_of(to, "refused_total", s, "status", wm_status_text((wm_status)i), s->refused[i]);
  for (const counted *c = kTimesOfSource; c < kTimesOfSource + sizeof kTimesOfSource / sizeof kTimesOfSource[0]; c++) {
    (void)snprintf(name, sizeof name, "source_%s_seconds", c->name);
    head(to, name, "gauge", c->about);
    for (const wm_source_health *s = h->sources; s < end; s++) {
      source_head(to, name + strlen("source_"), s);
      (void)fputc('}', to);
      value(to, (double)(wm_time_ns)count_at(s, c->at) * 1e-9);
    }
  }
  head(to, "source_device", "gauge", "1 for the state of its device.");
  for (const wm_source_health *s = h->sources; s < end; s++)
    count_of(to, "device", s, "state", wm_device_state_name(s->device), s->device != WM_DEVICE_NONE);
}

void watch_metrics(const watch *self, wm_time_ns now_ns, FILE *to) {
  const int is_up = self->has_health && now_ns - self->health_at_ns <= SILENT_NS;
  gauge(to, "up", "1 where a run is heard.", is_up);
  if (!is_up) return;
  if (self->has_pose) of_pose(self, now_ns, to);
  if (self->has_bound) of_bound(&self->bound, to);
  of_state(self, to);
  of_run(&self->health, to);
  of_sources(&self->health, to);
  if (self->innovations > 0)
    gauge(to, "consistency_ratio", "Mean squared innovation by its variance; 1 is expected.", self->nis);
}
