// SPDX-License-Identifier: Apache-2.0
#include "cli/doctor/findings.h"

#include <stdarg.h>
#include <string.h>

void find(findings *out, finding_level level, const char *about, const char *mend, const char *format, ...) {
  if (out->count == FINDINGS_MAX) return;
  finding *f = &out->at[out->count++];
  f->level = level;
  (void)snprintf(f->about, sizeof f->about, "%s", about);
  (void)snprintf(f->mend, sizeof f->mend, "%s", mend);
  va_list arguments;
  va_start(arguments, format);
  (void)vsnprintf(f->text, sizeof f->text, format, arguments);
  va_end(arguments);
}

void find_error(findings *out, const char *about, const wm_error *err) {
  const char *mend = NULL;
  for (const char *at = err->text; (at = strstr(at, "; ")) != NULL; at += 2) mend = at;
  int length = mend ? (int)(mend - err->text) : (int)strlen(err->text);
  if (mend)
    mend += 2;
  else if (err->status == WM_NOT_FOUND || err->status == WM_IO)
    mend = "put the file there so that it can be read, or name another one";
  else
    mend = "put right what stands there; docs/config.md has what may stand in a configuration";
  find(out, FINDING_BAD, about, mend, "%.*s", length, err->text);
}

size_t findings_of(const findings *self, finding_level level) {
  size_t count = 0;
  for (size_t i = 0; i < self->count; i++) count += self->at[i].level == level;
  return count;
}

void findings_to_front(findings *self, size_t from) {
  for (size_t i = from, to = 0; i < self->count; i++, to++) {
    const finding moved = self->at[i];
    memmove(&self->at[to + 1], &self->at[to], (i - to) * sizeof self->at[0]);
    self->at[to] = moved;
  }
}

static const char *const kLevels[] = {"good", "note", "bad"};

void findings_print(const findings *self, FILE *to) {
  for (size_t i = 0; i < self->count; i++) {
    const finding *f = &self->at[i];
    (void)fprintf(to, "%-5s %-14s %s%s%s\n", kLevels[f->level], f->about, f->text, f->mend[0] ? "; mend: " : "",
                  f->mend);
  }
}

static void json_string(FILE *to, const char *text) {
  (void)fputc('"', to);
  for (; *text; text++) {
    unsigned char c = (unsigned char)*text;
    if (c == '"' || c == '\\')
      (void)fprintf(to, "\\%c", c);
    else if (c < 0x20)
      (void)fprintf(to, "\\u%04x", c);
    else
      (void)fputc(c, to);
  }
  (void)fputc('"', to);
}

void findings_json(const findings *self, FILE *to) {
  (void)fputc('[', to);
  for (size_t i = 0; i < self->count; i++) {
    const finding *f = &self->at[i];
    (void)fprintf(to, "%s\n    {\"level\": \"%s\", \"about\": ", i ? "," : "", kLevels[f->level]);
    json_string(to, f->about);
    (void)fputs(", \"text\": ", to);
    json_string(to, f->text);
    (void)fputs(", \"mend\": ", to);
    json_string(to, f->mend);
    (void)fputc('}', to);
  }
  (void)fputs("\n  ]", to);
}
