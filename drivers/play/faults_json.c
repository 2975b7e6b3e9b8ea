// SPDX-License-Identifier: Apache-2.0
// faults.yaml as JSON: checked, with all defaults, for programs that judge a run.
#include <math.h>

#include "waymark/faults.h"
#include "waymark/text.h"

static void put_value(double value, FILE *to) {
  if (isfinite(value))
    (void)fprintf(to, "%.12g", value);
  else
    (void)fputs("null", to);
}

static void put_number(const char *key, double value, FILE *to) {
  (void)fprintf(to, ", \"%s\": ", key);
  put_value(value, to);
}

static void put_text(const char *key, const char *text, FILE *to) {
  (void)fprintf(to, ", \"%s\": ", key);
  if (text[0])
    wm_json_text(text, to);
  else
    (void)fputs("null", to);
}

static void put_states(const wm_fault *f, FILE *to) {
  static const char *const kKinds[] = {"device", "flag", "state", "cause", "counter", "text"};
  (void)fputs(", \"health\": [", to);
  for (size_t i = 0; i < f->state_count; i++) {
    const wm_statement *s = &f->states[i];
    (void)fprintf(to, "%s{\"what\": \"%s\"", i ? ", " : "", kKinds[s->kind]);
    put_text("value", s->what, to);
    put_text("source", s->source, to);
    put_number("within_s", s->within_s, to);
    put_number("cleared_within_s", s->cleared_within_s, to);
    put_number("at_least", s->at_least, to);
    put_number("at_most", s->at_most, to);
    (void)fputc('}', to);
  }
  (void)fputc(']', to);
}

static void put_pose(const wm_fault *f, FILE *to) {
  const wm_pose_bound *p = &f->pose;
  (void)fputs(", \"pose\": ", to);
  if (!f->has_pose) {
    (void)fputs("null", to);
    return;
  }
  const struct {
    const char *key;
    double value;
  } bounds[] = {{"position_m", p->position_m}, {"heading_deg", p->heading_deg}, {"error_sigmas", p->error_sigmas},
                {"sigma_m", p->sigma_m},       {"sigma_deg", p->sigma_deg},     {"sigma_grows", p->sigma_grows},
                {"rate_hz", p->rate_hz},       {"gap_max_s", p->gap_max_s},     {"within_s", p->within_s}};
  for (size_t i = 0; i < sizeof bounds / sizeof bounds[0]; i++) {
    (void)fprintf(to, "%s\"%s\": ", i ? ", " : "{", bounds[i].key);
    put_value(bounds[i].value, to);
  }
  (void)fputc('}', to);
}

static void put_fault(const wm_fault *f, FILE *to) {
  const wm_fault_kind_row *row = wm_fault_kind_of(f->kind);
  (void)fputs("{\"name\": ", to);
  wm_json_text(f->name, to);
  (void)fprintf(to, ", \"fault\": \"%s\", \"by\": \"%s\", \"by_played_driver\": %s, \"line\": %d", row->name,
                row->by & WM_FAULT_BY_PLAYER   ? "player"
                : row->by & WM_FAULT_BY_RUNNER ? "runner"
                                               : "played driver",
                row->by & WM_FAULT_BY_PLAYED_DRIVER ? "true" : "false", f->line);
  put_number("from_s", f->from_s, to);
  put_number("until_s", f->until_s, to);
  if (row->of) put_text(row->of, f->of, to);
  for (size_t i = 0; i < WM_FAULT_PARAMS_MAX && row->params[i].name; i++)
    put_number(row->params[i].name, f->param[i], to);
  if (row->text_key) put_text(row->text_key, f->text, to);
  if (row->takes_ids) {
    (void)fputs(", \"ids\": [", to);
    for (size_t i = 0; i < f->id_count; i++) (void)fprintf(to, "%s%u", i ? ", " : "", f->ids[i]);
    (void)fputc(']', to);
  }
  put_states(f, to);
  put_pose(f, to);
  (void)fputc('}', to);
}

void wm_faults_json(const wm_faults *self, FILE *to) {
  (void)fputs("{\"format\": \"waymark-faults/1\", \"file\": ", to);
  wm_json_text(self->path, to);
  (void)fputs(", \"faults\": [", to);
  for (size_t i = 0; i < self->count; i++) {
    (void)fputs(i ? ",\n  " : "\n  ", to);
    put_fault(&self->fault[i], to);
  }
  (void)fputs("\n]}\n", to);
}
