// SPDX-License-Identifier: Apache-2.0
#include "cli/check/facts.h"

#include <inttypes.h>
#include <math.h>

static double rate_hz(const source_facts *facts) {
  const double seconds = facts->events > 1 ? wm_seconds_between(facts->first_ns, facts->last_ns) : 0;
  return seconds > 0 ? (double)(facts->events - 1) / seconds : 0;
}

static double late_ms(const source_facts *facts) {
  return facts->events > 0 ? fmax(0, (double)facts->latest_ns * 1e-6) : 0;
}

// ── for a person ────────────────────────────────────────────────────────────────────────────────────────────────────

void facts_print_source(const wm_assembled_source *source, const source_facts *facts, FILE *to) {
  if (source->source->is_live) {
    (void)fprintf(to, "source       %-20s a device (`waymark doctor` finds out whether it is there)\n", source->name);
    return;
  }
  (void)fprintf(to, "source       %-20s %8" PRIu64 " data", source->name, facts->events);
  if (rate_hz(facts) > 0) (void)fprintf(to, ", %.1f a second", rate_hz(facts));
  if (facts->events > 0) (void)fprintf(to, ", at most %.0f ms late", late_ms(facts));
  (void)fputc('\n', to);
}

static double percent(const drive_facts *self, wm_state state) {
  return 100 * evidence_share(self->evidence, state, self->due);
}

static double unusable(const drive_facts *self, wm_unusable why) {
  return self->due > 0 ? (double)self->evidence->unusable[why] / (double)self->due : 0;
}

// How much of the drive a machine may act on, and what takes the rest.
static void print_usable(const drive_facts *self, FILE *to) {
  const wm_runtime_params *limits = &self->assembly->config->runtime;
  (void)fprintf(to, "usable       %.1f %% of the drive, at a risk of %g", 100 * unusable(self, WM_UNUSABLE_NOT),
                limits->integrity_risk_per_pose);
  if (limits->integrity_alert_limit_m > 0) (void)fprintf(to, ", within %g m", limits->integrity_alert_limit_m);
  if (limits->integrity_alert_limit_heading_deg > 0)
    (void)fprintf(to, ", within %g deg", limits->integrity_alert_limit_heading_deg);
  const char *before = "; not, by ";
  for (unsigned why = WM_UNUSABLE_NOT + 1; why < WM_UNUSABLE_COUNT; why++) {
    if (self->evidence->unusable[why] == 0) continue;
    (void)fprintf(to, "%s%s %.1f %%", before, wm_unusable_name(why), 100 * unusable(self, why));
    before = ", ";
  }
  (void)fputc('\n', to);
}

void facts_print(const drive_facts *self, FILE *to) {
  for (size_t i = 0; i < self->assembly->source_count; i++)
    facts_print_source(&self->assembly->sources[i], &self->sources[i], to);
  (void)fprintf(to,
                "drive        %.1f s: tracking %.1f %%, degraded %.1f %%, dead reckoning %.1f %%, lost %.1f %%, no "
                "pose %.1f %%\n",
                self->recorded_s, percent(self, WM_STATE_TRACKING), percent(self, WM_STATE_DEGRADED),
                percent(self, WM_STATE_DEAD_RECKONING), percent(self, WM_STATE_LOST),
                percent(self, WM_STATE_SEARCHING));
  print_usable(self, to);
  for (size_t i = 0; i < self->assembly->source_count; i++)
    for (unsigned k = 0; k < WM_RESIDUAL_COUNT; k++) {
      const residual_evidence *r = &self->evidence->residuals[i][k];
      const double all = (double)(r->fused + r->refused), n = (double)r->fused;
      if (all < 1 || k == WM_RESIDUAL_STANDSTILL) continue;
      (void)fprintf(to, "fit          %-20s %-9s %5.1f %% of %.0f refused", self->assembly->sources[i].name,
                    wm_residual_name(k), 100 * (double)r->refused / all, all);
      if (n > 0) (void)fprintf(to, "; innovations %.2f of their sigma, mean %+.2f", sqrt(r->squares / n), r->sum / n);
      (void)fputc('\n', to);
    }
}

// ── for programs ────────────────────────────────────────────────────────────────────────────────────────────────────

static void json_sources(const drive_facts *self, FILE *to) {
  (void)fputs(",\n    \"sources\": [", to);
  for (size_t i = 0; i < self->assembly->source_count; i++) {
    const source_facts *facts = &self->sources[i];
    (void)fputs(i ? ",\n      {" : "\n      {", to);
    wm_json_string(to, "name", self->assembly->sources[i].name);
    (void)fprintf(to, ", \"data\": %" PRIu64 ", \"rate_hz\": %.6g, \"late_ms\": %.6g}", facts->events, rate_hz(facts),
                  late_ms(facts));
  }
  (void)fputc(']', to);
}

static void json_states(const drive_facts *self, FILE *to) {
  (void)fputs(",\n    \"states\": {", to);
  for (unsigned state = 0; state < WM_STATE_COUNT; state++)
    (void)fprintf(to, "%s\"%s\": %.6g", state ? ", " : "", wm_state_name(state),
                  evidence_share(self->evidence, (wm_state)state, self->due));
  (void)fputc('}', to);
}

static void json_usable(const drive_facts *self, FILE *to) {
  (void)fprintf(to, ",\n    \"usable\": {\"share\": %.6g", unusable(self, WM_UNUSABLE_NOT));
  for (unsigned why = WM_UNUSABLE_NOT + 1; why < WM_UNUSABLE_COUNT; why++)
    (void)fprintf(to, ", \"%s\": %.6g", wm_unusable_name(why), unusable(self, why));
  (void)fputc('}', to);
}

static void json_fit(const drive_facts *self, FILE *to) {
  int count = 0;
  (void)fputs(",\n    \"fit\": [", to);
  for (size_t i = 0; i < self->assembly->source_count; i++)
    for (unsigned k = 0; k < WM_RESIDUAL_COUNT; k++) {
      const residual_evidence *r = &self->evidence->residuals[i][k];
      if (r->fused + r->refused == 0 || k == WM_RESIDUAL_STANDSTILL) continue;
      (void)fputs(count++ ? ",\n      {" : "\n      {", to);
      wm_json_string(to, "source", self->assembly->sources[i].name);
      (void)fprintf(to, ", \"of\": \"%s\", \"fused\": %" PRIu64 ", \"refused\": %" PRIu64, wm_residual_name(k),
                    r->fused, r->refused);
      if (r->fused > 0)  // of the innovations over their sigma
        (void)fprintf(to, ", \"root_mean_square\": %.6g, \"mean\": %.6g", sqrt(r->squares / (double)r->fused),
                      r->sum / (double)r->fused);
      (void)fputc('}', to);
    }
  (void)fputc(']', to);
}

void facts_json(const drive_facts *self, FILE *to) {
  (void)fputs("{\n    ", to);
  wm_json_string(to, "estimator", self->assembly->config->estimator->name);
  (void)fputs(", ", to);
  wm_json_string(to, "estimator_because", self->assembly->config->estimator_because);
  (void)fputs(", ", to);
  wm_json_string(to, "recording", self->assembly->recording);
  (void)fprintf(to, ", \"duration_s\": %.6g", self->recorded_s);
  json_sources(self, to);
  json_states(self, to);
  json_usable(self, to);
  json_fit(self, to);
  (void)fputs("\n  }", to);
}
