// SPDX-License-Identifier: Apache-2.0
#include "findings/findings.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

const char *wm_severity_name(unsigned severity) {
  static const char *const kNames[] = {"good", "note", "bad"};
  return severity < sizeof kNames / sizeof kNames[0] ? kNames[severity] : "?";
}

wm_finding *wm_find(wm_findings *out, wm_finding_id id, wm_severity severity, const char *about, const char *fix,
                    const char *format, ...) {
  const int has_room = out->count < WM_FINDINGS_MAX;
  wm_finding *f = has_room ? &out->at[out->count++] : &out->spare;
  out->dropped += !has_room;
  f->id = id;
  f->severity = severity;
  f->size = (double)NAN;
  (void)snprintf(f->about, sizeof f->about, "%s", about);
  (void)snprintf(f->fix, sizeof f->fix, "%s", fix ? fix : kFindingKinds[id].fix);
  va_list arguments;
  va_start(arguments, format);
  (void)vsnprintf(f->text, sizeof f->text, format, arguments);
  va_end(arguments);
  return f;
}

void wm_find_error(wm_findings *out, const char *about, const wm_error *err) {
  const int is_missing = err->status == WM_NOT_FOUND || err->status == WM_IO;
  wm_find(out, WM_FOUND_REFUSED_INPUT, WM_SEVERITY_BAD, about,
          is_missing ? "put the file there so that it can be read, or name another one" : NULL, "%s", err->text);
}

size_t wm_findings_of(const wm_findings *self, wm_severity severity) {
  size_t count = 0;
  for (size_t i = 0; i < self->count; i++) count += self->at[i].severity == severity;
  return count;
}

int wm_findings_has(const wm_findings *self, wm_finding_id id, const char *about) {
  for (size_t i = 0; i < self->count; i++)
    if (self->at[i].id == id && strcmp(self->at[i].about, about) == 0) return 1;
  return 0;
}

void wm_findings_to_front(wm_findings *self, size_t from) {
  for (size_t i = from, to = 0; i < self->count; i++, to++) {
    const wm_finding moved = self->at[i];
    memmove(&self->at[to + 1], &self->at[to], (i - to) * sizeof self->at[0]);
    self->at[to] = moved;
  }
}

// ── text ────────────────────────────────────────────────────────────────────────────────────────────────────────────

int wm_finding_line(const wm_finding *self, char *out, size_t capacity) {
  return snprintf(out, capacity, "%s: %s%s%s [%s]", self->about, self->text, self->fix[0] ? "; fix: " : "", self->fix,
                  kFindingKinds[self->id].identifier);
}

void wm_findings_print(const wm_findings *self, FILE *to) {
  for (size_t i = 0; i < self->count; i++) {
    const wm_finding *f = &self->at[i];
    (void)fprintf(to, "%-5s %-14s %s", wm_severity_name(f->severity), f->about, f->text);
    if (f->severity != WM_SEVERITY_GOOD)
      (void)fprintf(to, "%s%s [%s]", f->fix[0] ? "; fix: " : "", f->fix, kFindingKinds[f->id].identifier);
    (void)fputc('\n', to);
  }
  if (self->dropped > 0) (void)fprintf(to, "      and %zu more\n", self->dropped);
  if (wm_findings_of(self, WM_SEVERITY_GOOD) < self->count)
    (void)fputs("      Each [name] is a section of " WM_FINDINGS_PAGE ".\n", to);
}

// ── JSON ────────────────────────────────────────────────────────────────────────────────────────────────────────────

void wm_json_string(FILE *to, const char *key, const char *text) {
  (void)fprintf(to, "\"%s\": \"", key);
  for (; *text; text++) {
    const unsigned char c = (unsigned char)*text;
    if (c == '"' || c == '\\')
      (void)fprintf(to, "\\%c", c);
    else if (c < 0x20)
      (void)fprintf(to, "\\u%04x", c);
    else
      (void)fputc(c, to);
  }
  (void)fputc('"', to);
}

void wm_findings_json(const wm_findings *self, FILE *to) {
  (void)fputc('[', to);
  for (size_t i = 0; i < self->count; i++) {
    const wm_finding *f = &self->at[i];
    const wm_finding_kind *kind = &kFindingKinds[f->id];
    (void)fprintf(to, "%s\n    {\"id\": \"%s\", \"severity\": \"%s\", \"size\": ", i ? "," : "", kind->identifier,
                  wm_severity_name(f->severity));
    (void)(isfinite(f->size) ? fprintf(to, "%.6g", f->size) : fprintf(to, "null"));
    const struct {
      const char *key, *value;
    } texts[] = {{"about", f->about}, {"text", f->text}, {"cause", kind->cause}, {"fix", f->fix}};
    for (size_t k = 0; k < sizeof texts / sizeof texts[0]; k++) {
      (void)fputs(", ", to);
      wm_json_string(to, texts[k].key, texts[k].value);
    }
    (void)fprintf(to, ", \"link\": \"" WM_FINDINGS_PAGE "#%s\"}", kind->identifier);
  }
  (void)fputs(self->count ? "\n  ]" : "]", to);
}
