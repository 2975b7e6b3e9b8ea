// SPDX-License-Identifier: Apache-2.0
#include "output/json_files.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "output/new_file.h"
#include "waymark/motion.h"

// ── a few words of JSON ─────────────────────────────────────────────────────────────────────────────────────────────

static void string(FILE *f, const char *text) {
  (void)fputc('"', f);
  for (; *text; text++) {
    unsigned char c = (unsigned char)*text;
    if (c == '"' || c == '\\') {
      (void)fprintf(f, "\\%c", c);
    } else if (c < 0x20) {
      (void)fprintf(f, "\\u%04x", c);
    } else {
      (void)fputc(c, f);
    }
  }
  (void)fputc('"', f);
}

static void number(FILE *f, double value) {
  if (isfinite(value)) {
    (void)fprintf(f, "%.9g", value);
  } else {
    (void)fputs("null", f);
  }
}

static void time_or_null(FILE *f, wm_time_ns t_ns) {
  if (t_ns == WM_TIME_NONE) {
    (void)fputs("null", f);
  } else {
    (void)fprintf(f, "%" PRId64, t_ns);
  }
}

static FILE *open_json(const char *dir, const char *name, char *path, size_t capacity, wm_error *err) {
  (void)snprintf(path, capacity, "%s/%s", dir, name);
  FILE *f = new_file(path);
  if (!f) (void)wm_fail(err, WM_IO, "%s: can't be written: %s", path, strerror(errno));
  return f;
}

static wm_status close_json(FILE *f, const char *path, wm_error *err) {
  int failed = ferror(f);
  if (fclose(f) != 0 || failed)
    return wm_fail(err, WM_IO, "%s: could not be written completely: %s", path, strerror(errno));
  return WM_OK;
}

// ── health ──────────────────────────────────────────────────────────────────────────────────────────────────────────

static void put_rejected(FILE *f, const wm_source_health *s) {
  const char *comma = "";
  (void)fputs("\"rejected\": {", f);
  for (unsigned i = 1; i < WM_VERDICT_COUNT; i++) {
    if (s->rejected[i] == 0) continue;
    (void)fprintf(f, "%s\"%s\": %" PRIu64, comma, wm_verdict_name(i), s->rejected[i]);
    comma = ", ";
  }
  for (unsigned i = 1; i < WM_STATUS_COUNT; i++) {
    if (s->refused[i] == 0) continue;
    (void)fprintf(f, "%s\"%s\": %" PRIu64, comma, wm_status_text((wm_status)i), s->refused[i]);
    comma = ", ";
  }
  (void)fputs("}", f);
}

// Search outcomes of a detector of known landmarks.
static void put_looks(FILE *f, const wm_source_health *s) {
  const char *before = ", \"looks\": {";
  for (unsigned i = 0; i < WM_LOOK_COUNT; i++) {
    if (s->looks[i] == 0) continue;
    (void)fprintf(f, "%s\"%s\": %" PRIu64, before, wm_look_name(i), s->looks[i]);
    before = ", ";
  }
  if (before[2] == '\0') (void)fputs("}", f);
}

static void put_source(FILE *f, const wm_source_health *s, const char *reason) {
  (void)fputs("    ", f);
  string(f, s->name);
  (void)fprintf(f, ": {\"received\": %" PRIu64 ", \"fused\": %" PRIu64 ", ", s->received, s->fused);
  put_rejected(f, s);
  (void)fprintf(f,
                ", \"late\": %" PRIu64 ", \"dropped\": %" PRIu64 ", \"lost\": %" PRIu64 ", \"duplicates\": %" PRIu64
                ", \"future\": %" PRIu64 ", \"malformed\": %" PRIu64 ", \"not_finite\": %" PRIu64
                ", \"out_of_order\": %" PRIu64 ", \"ignored\": %" PRIu64 ", \"frozen\": %" PRIu64,
                s->late, s->dropped, s->lost, s->duplicates, s->future, s->malformed, s->not_finite, s->out_of_order,
                s->ignored, s->frozen);
  if (reason[0]) {
    (void)fputs(", \"refused_because\": ", f);
    string(f, reason);
  }
  put_looks(f, s);
  if (s->device != WM_DEVICE_NONE)
    (void)fprintf(f,
                  ", \"device\": \"%s\", \"overflows\": %" PRIu64 ", \"bus_errors\": %" PRIu64
                  ", \"stamp_uncertainty_ms\": %.9g",
                  wm_device_state_name(s->device), s->overflows, s->bus_errors, (double)s->stamp_uncertainty_ns * 1e-6);
  (void)fprintf(f, ", \"lateness_p99_ms\": %.9g, \"lateness_worst_ms\": %.9g, \"lateness_max_ms\": %.9g",
                (double)s->lateness_p99_ns * 1e-6, (double)s->lateness_worst_ns * 1e-6,
                (double)s->lateness_max_ns * 1e-6);
  (void)fputs(", \"newest_ns\": ", f);
  time_or_null(f, s->newest_ns);
  (void)fprintf(f, ", \"silent_s\": %.9g, \"stale\": %s}", (double)s->silent_ns * 1e-9, s->stale ? "true" : "false");
}

static void put_names(FILE *f, const char *key, const char *const *names, const int *wanted, size_t count) {
  const char *comma = "";
  (void)fprintf(f, "  \"%s\": [", key);
  for (size_t i = 0; i < count; i++) {
    if (!wanted[i]) continue;
    (void)fputs(comma, f);
    string(f, names[i]);
    comma = ", ";
  }
  (void)fputs("],\n", f);
}

static void put_motion_health(FILE *f, uint32_t bits) {
  static const char *const kNames[] = {"encoder_left_dead",
                                       "encoder_right_dead",
                                       "counter_frozen",
                                       "yaw_rate_stuck",
                                       "implausible",
                                       "not_planar",
                                       "roll_rate_stuck",
                                       "pitch_rate_stuck",
                                       "accelerometer_stuck",
                                       "speed_silent",
                                       "turn_silent",
                                       "wheels_spin",
                                       "one_wheel_spins",
                                       "pushed",
                                       "lifted"};
  enum { kCount = sizeof kNames / sizeof kNames[0] };
  int wanted[kCount];
  for (unsigned i = 0; i < kCount; i++) wanted[i] = (bits >> i) & 1u;
  put_names(f, "motion_health", kNames, wanted, kCount);
}

static void put_stale(FILE *f, const wm_health *h) {
  const char *names[WM_HEALTH_SOURCES_MAX];
  int wanted[WM_HEALTH_SOURCES_MAX];
  for (uint32_t i = 0; i < h->source_count; i++) {
    names[i] = h->sources[i].name;
    wanted[i] = h->sources[i].stale;
  }
  put_names(f, "stale", names, wanted, h->source_count);
}

static void put_calibration(FILE *f, const wm_health *h) {
  (void)fputs("  \"calibration\": {", f);
  const uint32_t count = wm_health_calibration_count(h);
  for (uint32_t i = 0; i < count; i++) {
    const wm_calibration_value *c = wm_health_calibration(h, i);
    (void)fputs(i ? ",\n    " : "\n    ", f);
    string(f, c->name);
    (void)fputs(": {\"value\": ", f);
    number(f, c->value);
    (void)fputs(", \"sigma\": ", f);
    number(f, c->sigma);
    (void)fputs("}", f);
  }
  (void)fputs(count ? "\n  },\n" : "},\n", f);
}

static void put_alarms(FILE *f, const wm_health *h) {
  (void)fputs("  \"alarms\": [", f);
  for (uint32_t i = 0; i < h->alarm_count; i++) {
    const wm_alarm *a = &h->alarms[i];
    (void)fprintf(f, "%s{\"kind\": \"%s\", \"value\": ", i ? ", " : "", wm_alarm_name(a->kind));
    number(f, a->value);
    if (a->calibration >= 0) {
      (void)fputs(", \"calibration\": ", f);
      string(f, wm_health_calibration(h, (uint32_t)a->calibration)->name);
    }
    (void)fputs("}", f);
  }
  (void)fputs("],\n", f);
}

static void put_counters(FILE *f, const wm_health *h) {
  (void)fputs("  \"counters\": {", f);
  for (uint32_t i = 0; i < h->counter_count; i++) {
    const wm_counter *c = &h->counters[i];
    (void)fprintf(f, "%s\n    \"%s\": {\"count\": %" PRIu64, i ? "," : "", wm_counter_name(c->kind), c->count);
    if (c->landmark_id >= 0) (void)fprintf(f, ", \"landmark_id\": %" PRId32, c->landmark_id);
    (void)fputs("}", f);
  }
  (void)fputs(h->counter_count ? "\n  },\n" : "},\n", f);
}

wm_status wm_write_health_json(const char *dir, const wm_assembly *assembly, const wm_health *h,
                               const wm_findings *found, wm_error *err) {
  char path[WM_PATH_MAX + 32];
  FILE *f = open_json(dir, "health.json", path, sizeof path, err);
  if (!f) return WM_IO;
  (void)fputs("{\n  \"recording\": ", f);
  string(f, assembly->recording);
  (void)fputs(",\n  \"estimator\": ", f);
  string(f, assembly->config->estimator->name);
  (void)fputs(",\n  \"estimator_because\": ", f);  // "": the configuration names it
  string(f, assembly->config->estimator_because);
  if (assembly->decoder[0]) {
    (void)fputs(",\n  \"decoder\": ", f);
    string(f, assembly->decoder);
  }
  (void)fputs(",\n  \"state\": ", f);
  string(f, wm_state_name(h->state));
  (void)fputs(",\n  \"cause\": ", f);
  string(f, wm_cause_name(h->cause));
  (void)fputs(",\n  \"lost_probability\": ", f);
  number(f, h->lost_probability);
  if (h->floor_count > 0) {
    (void)fputs(",\n  \"floor\": ", f);
    string(f, h->floor_name);
    (void)fputs(",\n  \"floor_probability\": ", f);
    number(f, h->floor_probability);
  }
  (void)fputs(",\n  \"t_ns\": ", f);
  time_or_null(f, h->t_ns);
  (void)fputs(",\n  \"reckoning_left_m\": ", f);
  number(f, h->reckoning_left_m);
  (void)fputs(",\n  \"reckoning_left_s\": ", f);
  number(f, h->reckoning_left_s);
  (void)fprintf(f, ",\n  \"send_p99_ms\": %.6g,\n  \"lines_lost\": %" PRIu64 ",\n  \"other_runs\": %" PRIu32,
                (double)h->send_p99_ns * 1e-6, h->lines_lost, h->other_runs_total);
  (void)fputs(",\n  \"fused_until_ns\": ", f);
  time_or_null(f, h->fused_until_ns);
  (void)fprintf(f,
                ",\n  \"resets\": %" PRIu32 ",\n  \"jumps\": %" PRIu32 ",\n  \"published\": %" PRIu64
                ",\n  \"outputs_lost\": %" PRIu64 ",\n",
                h->resets, h->jumps, h->published, h->outputs_lost);
  put_motion_health(f, h->motion_health);
  put_stale(f, h);
  put_calibration(f, h);
  put_alarms(f, h);
  put_counters(f, h);
  (void)fputs("  \"unused\": [", f);
  for (size_t i = 0; i < assembly->unused_count; i++) {
    (void)fputs(i ? ", " : "", f);
    char line[sizeof(wm_unused)];
    (void)snprintf(line, sizeof line, "%s: %s", assembly->unused[i].name, assembly->unused[i].text);
    string(f, line);
  }
  (void)fputs("],\n  \"sources\": {\n", f);
  for (uint32_t i = 0; i < h->source_count; i++) {
    put_source(f, &h->sources[i], h->refused_because[i]);
    (void)fputs(i + 1 < h->source_count ? ",\n" : "\n", f);
  }
  (void)fputs("  },\n  \"findings\": ", f);
  wm_findings_json(found, f);
  (void)fputs("\n}\n", f);
  return close_json(f, path, err);
}

// ── timing ──────────────────────────────────────────────────────────────────────────────────────────────────────────

static void put_stage(FILE *f, const char *name, const wm_histogram *h) {
  static const double kQuantiles[] = {0.5, 0.9, 0.99, 0.999};
  static const char *const kNames[] = {"p50_us", "p90_us", "p99_us", "p999_us"};
  (void)fputs("  ", f);
  string(f, name);
  (void)fprintf(f, ": {\"count\": %" PRIu64, h->count);
  for (int q = 0; q < 4; q++)
    (void)fprintf(f, ", \"%s\": %.3f", kNames[q], (double)wm_histogram_quantile(h, kQuantiles[q]) * 1e-3);
  (void)fprintf(f, ", \"max_us\": %.3f},\n", (double)h->max_ns * 1e-3);
}

static void put_vision_stages(FILE *f, const wm_vision *vision) {
  wm_histogram decode_ns, detect_ns;
  wm_vision_times(vision, &decode_ns, &detect_ns);
  put_stage(f, "decode", &decode_ns);
  put_stage(f, "detect", &detect_ns);
  for (size_t i = 0; i < wm_vision_count(vision); i++) {
    char name[WM_SOURCE_NAME_MAX + sizeof WM_TIMING_LOOK];
    (void)snprintf(name, sizeof name, WM_TIMING_LOOK "%s", wm_vision_name(vision, i));
    put_stage(f, name, wm_vision_look_ns(vision, i));
  }
}

wm_status wm_write_timing_json(const char *dir, const wm_timing *t, wm_error *err) {
  char path[WM_PATH_MAX + 32];
  FILE *f = open_json(dir, "timing.json", path, sizeof path, err);
  if (!f) return WM_IO;
  (void)fputs("{\n", f);
  put_vision_stages(f, t->vision);
  for (size_t i = 0; i < t->stage_count; i++) put_stage(f, t->stages[i].name, t->stages[i].histogram);
  (void)fputs("  \"allocations_after_start\": ", f);
  if (t->allocations_after_start < 0) {
    (void)fputs("null", f);
  } else {
    (void)fprintf(f, "%" PRId64, t->allocations_after_start);
  }
  (void)fprintf(f,
                ",\n  \"page_faults_after_start\": %" PRId64 ",\n  \"deadlines_missed\": %" PRIu64
                ",\n  \"deadlines_total\": %" PRIu64 ",\n  \"memory_bytes\": %zu\n}\n",
                t->page_faults_after_start, t->deadlines_missed, t->deadlines_total, t->memory_bytes);
  return close_json(f, path, err);
}
