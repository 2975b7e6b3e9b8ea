// SPDX-License-Identifier: Apache-2.0
#include "cli/watch/watch.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "waymark/lcm_messages.h"

#define SILENT_NS (2 * WM_NS_PER_S)  // without a pose: a run sends 20 to 50 a second

void watch_pose(watch *self, const void *message, size_t length, wm_time_ns now_ns) {
  if (wm_lcm_read_pose(message, length, &self->pose)) {
    self->not_understood++;
    return;
  }
  if (self->has_pose && now_ns > self->pose_at_ns) {
    // The mean of the intervals: poses that arrive together make no higher rate.
    double interval_s = (double)(now_ns - self->pose_at_ns) * 1e-9;
    double mean_s = self->rate_hz > 0 ? 1 / self->rate_hz : interval_s;
    self->rate_hz = 1 / (mean_s + 0.05 * (interval_s - mean_s));
  }
  self->has_pose = 1;
  self->pose_at_ns = now_ns;
}

void watch_bound(watch *self, const void *message, size_t length) {
  if (wm_lcm_read_bound(message, length, &self->bound))
    self->not_understood++;
  else
    self->has_bound = 1;
}

void watch_refused(watch *self, const void *message, size_t length) {
  char source[WM_HEALTH_NAME_MAX], reason[WM_HEALTH_REASON_MAX];
  if (wm_lcm_read_refused(message, length, source, reason)) {
    self->not_understood++;
    return;
  }
  watch_reason *to = self->reasons;
  const watch_reason *end = self->reasons + WM_HEALTH_SOURCES_MAX;
  while (to < end && to->source[0] && strcmp(to->source, source) != 0) to++;
  if (to == end) return;  // a run has no more sources
  memcpy(to->source, source, sizeof source);
  memcpy(to->reason, reason, sizeof reason);
}

// A health message has no texts.
static void add_reasons(watch *self) {
  for (uint32_t i = 0; i < self->health.source_count; i++)
    for (const watch_reason *from = self->reasons; from < self->reasons + WM_HEALTH_SOURCES_MAX; from++)
      if (from->source[0] && strcmp(from->source, self->health.sources[i].name) == 0)
        memcpy(self->health.refused_because[i], from->reason, sizeof from->reason);
}

void watch_health(watch *self, const void *message, size_t length, wm_time_ns now_ns) {
  if (wm_lcm_read_health(message, length, &self->health)) {
    self->not_understood++;
    return;
  }
  add_reasons(self);
  self->found.count = self->found.dropped = 0;
  wm_health_findings(&self->health, &self->found);
  self->has_health = 1;
  self->health_at_ns = now_ns;
}

void watch_innovation(watch *self, const void *message, size_t length) {
  wm_innovation i;
  if (wm_lcm_read_innovation(message, length, &i)) {
    self->not_understood++;
    return;
  }
  double off = i.observed - i.expected;
  if (i.verdict != WM_FUSED || !(i.variance > 0) || !isfinite(off)) return;
  if (i.residual == WM_RESIDUAL_BEARING || i.residual == WM_RESIDUAL_HEADING) off = remainder(off, 2 * M_PI);
  double weight = self->innovations < 100 ? 1 / (double)(self->innovations + 1) : 0.01;
  self->nis += weight * (off * off / i.variance - self->nis);
  self->innovations++;
}

// Limits: chi-squared of about a hundred, widened for the gate, which cuts the tails.
const char *watch_consistency(const watch *self) {
  if (self->innovations < 50) return "too few observations to tell";
  if (self->nis > 1.6) return "observations are further off than the covariance allows";
  if (self->nis < 0.3) return "observations are nearer than the covariance allows: the noises are too large";
  return "consistent";
}

static void add(char *why, size_t why_bytes, const char *name, const char *what) {
  size_t used = strlen(why);
  (void)snprintf(why + used, why_bytes - used, "%s%s %s", used ? ", " : "", name, what);
}

// Why the pose is doubtful, with the source.
static void add_cause(const wm_health *h, char *why, size_t why_bytes) {
  const uint32_t i = (uint32_t)h->cause_source;  // -1 becomes a number beyond all sources
  const char *name = i < h->source_count            ? h->sources[i].name
                     : h->cause == WM_CAUSE_OFF_MAP ? "the map"
                                                    : "observations";
  add(why, why_bytes, name, wm_cause_text(h->cause));
}

// Every source with a fault or in silence; returns how many faults there are. Silence is none: a sensor may be there
// only in places. Where it is the motion's, no fresh motion comes.
static int list_troubles(const watch *self, char *why, size_t why_bytes) {
  const wm_health *h = &self->health;
  int faults = 0;
  for (uint32_t i = 0; i < h->source_count; i++) {
    const wm_source_health *s = &h->sources[i];
    if (s->device > WM_DEVICE_WORKS)
      add(why, why_bytes, s->name, wm_device_state_name(s->device)), faults++;
    else if (s->stale)
      add(why, why_bytes, s->name, s->received ? "silent" : "never spoke");
  }
  if (h->cause) add_cause(h, why, why_bytes), faults++;
  if (self->has_pose && (self->pose.status_flags & WM_PUB_MOTION_STALE))
    add(why, why_bytes, "motion", "stale"), faults++;
  if (h->motion_health) add(why, why_bytes, "motion", wm_motion_health_text(h->motion_health)), faults++;
  if (h->other_runs > 0) add(why, why_bytes, "another run", "on the same channels"), faults++;
  return faults;
}

const char *watch_state(const watch *self, wm_time_ns now_ns, char *why, size_t why_bytes) {
  why[0] = '\0';
  if (!self->has_health || now_ns - self->health_at_ns > SILENT_NS) return self->has_health ? "silent" : "waiting";
  const int faults = list_troubles(self, why, why_bytes);
  switch (self->health.state) {
    case WM_STATE_SEARCHING: return why[0] ? "waiting for sensors" : "searching";
    case WM_STATE_LOST: return "lost";
    case WM_STATE_DEGRADED: return "degraded";
    case WM_STATE_TRACKING: return faults ? "degraded" : "tracking";
    default: return faults ? "degraded" : "dead reckoning";
  }
}

double watch_heading(const wm_estimate *pose) {
  const double *q = pose->pose_map_base.q_xyzw;
  return atan2(2 * (q[3] * q[2] + q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2]));
}

static void print_pose(const wm_published *p, double rate_hz, FILE *to) {
  const wm_estimate *e = &p->now;
  const double *c = e->covariance;
  (void)fprintf(to, "pose       x %8.2f m  y %8.2f m  heading %7.1f deg   (sigma %.2f, %.2f m, %.1f deg)\n",
                e->pose_map_base.p_m[0], e->pose_map_base.p_m[1], watch_heading(e) * 180 / M_PI,
                sqrt(fmax(c[wm_cov_index(0, 0)], 0)), sqrt(fmax(c[wm_cov_index(1, 1)], 0)),
                sqrt(fmax(c[wm_cov_index(5, 5)], 0)) * 180 / M_PI);
  (void)fprintf(to, "           %.2f m/s  %.1f deg/s   fused until %.0f ms ago   %.0f a second   %" PRIu32 " jumps\n",
                e->v_mps[0], e->w_radps[2] * 180 / M_PI, (double)(e->t_ns - p->fused_until_ns) * 1e-6, rate_hz,
                p->jumps);
}

static void print_number(double value, double unit, const char *name, FILE *to) {
  (void)(isfinite(value) ? fprintf(to, "%.2f %s", value / unit, name) : fprintf(to, "no bound"));
}

static void print_bound(const wm_bound *b, const wm_health *h, FILE *to) {
  static const char *const kWhy[WM_UNUSABLE_COUNT] = {
      [WM_UNUSABLE_NOT] = "usable",
      [WM_UNUSABLE_NO_POSE] = "not usable: there is no pose yet",
      [WM_UNUSABLE_UNMONITORED] = "not usable: this estimator does not watch its pose",
      [WM_UNUSABLE_DOUBT] = "not usable: the pose may be wrong",
      [WM_UNUSABLE_UNTESTED] = "not usable yet: observations have to fit for 5 s",
      [WM_UNUSABLE_POSITION] = "not usable: the position is not known well enough",
      [WM_UNUSABLE_HEADING] = "not usable: the heading is not known well enough"};
  (void)fputs("bound      position ", to);
  print_number(b->horizontal_m, 1, "m", to);
  (void)fputs(", heading ", to);
  print_number(b->heading_rad, M_PI / 180, "deg", to);
  (void)fprintf(to, " at a risk of %g: %s", b->risk, b->why < WM_UNUSABLE_COUNT ? kWhy[b->why] : "not usable");
  if (b->why == WM_UNUSABLE_DOUBT && h && !isnan(h->lost_probability))
    (void)fprintf(to, " with probability %.2g: %s", h->lost_probability,
                  h->cause ? wm_cause_text(h->cause) : "each observation that fits makes it less");
  (void)fputc('\n', to);
  if (b->heading_after_m > 0)
    (void)fprintf(to, "heading    not known well enough: drive %.1f m straight on\n", b->heading_after_m);
}

static void print_source(const wm_source_health *s, FILE *to) {
  uint64_t rejected = 0;
  for (int i = 1; i < WM_VERDICT_COUNT; i++) rejected += s->rejected[i];
  (void)fprintf(to,
                "  %-18.18s %-14s %6.1f s ago %10" PRIu64 " fused %8" PRIu64 " rejected %6" PRIu64 " late %6" PRIu64
                " lost\n",
                s->name,
                s->device  ? wm_device_state_name(s->device)
                : s->stale ? "silent"
                           : "",
                (double)s->silent_ns * 1e-9, s->fused, rejected, s->late, s->lost + s->overflows + s->dropped);
  char looks[300];
  if (wm_looks_text(s->looks, looks, sizeof looks)) (void)fprintf(to, "    %s\n", looks);
}

static void print_left(const wm_health *h, FILE *to) {
  if (isnan(h->reckoning_left_m)) return;
  (void)fprintf(to, "left       without observations useful for ");
  (void)(isinf(h->reckoning_left_m) ? fprintf(to, "any way") : fprintf(to, "%.0f m", h->reckoning_left_m));
  (void)(isinf(h->reckoning_left_s) ? fprintf(to, ", and as long as it stands\n")
                                    : fprintf(to, ", %.0f s at this speed\n", h->reckoning_left_s));
}

// Aliased poses are no fault, but matter to the user who has just placed the robot.
static void print_aliased(const wm_health *h, FILE *to) {
  const wm_counter *aliased = wm_health_counter(h, WM_COUNTER_ALIASED_POSES);
  if (aliased && aliased->count > 0)
    (void)fprintf(to, "aliased    %" PRIu64 " other places look the same\n", aliased->count);
}

void watch_print(const watch *self, wm_time_ns now_ns, FILE *to) {
  char why[240];
  const char *state = watch_state(self, now_ns, why, sizeof why);
  (void)fprintf(to, "state      %s%s%s", state, why[0] ? ": " : "", why);
  if (self->has_health && !isnan(self->health.lost_probability))
    (void)fprintf(to, "   (lost with probability %.3g)", self->health.lost_probability);
  (void)fputc('\n', to);
  if (self->has_pose) print_pose(&self->pose, self->rate_hz, to);
  if (self->has_bound) print_bound(&self->bound, self->has_health ? &self->health : NULL, to);
  if (self->innovations > 0)
    (void)fprintf(to, "consistency %s (mean squared innovation %.2f of its variance)\n", watch_consistency(self),
                  self->nis);
  if (self->has_health) {
    print_aliased(&self->health, to);
    print_left(&self->health, to);
    (void)fprintf(to, "deadlines  %" PRIu64 " of %" PRIu64 " missed\nsources\n", self->health.deadlines_missed,
                  self->health.loops + self->health.deadlines_missed);
    for (uint32_t i = 0; i < self->health.source_count; i++) print_source(&self->health.sources[i], to);
    if (self->found.count > 0) (void)fputs("findings\n", to);
    wm_findings_print(&self->found, to);
  }
  if (self->not_understood > 0)
    (void)fprintf(to, "%" PRIu64 " messages are of another version of waymark\n", self->not_understood);
}
