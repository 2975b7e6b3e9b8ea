// SPDX-License-Identifier: Apache-2.0
#include "cli/options.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "waymark/text.h"

#define OPTIONS_MAX 24  // of a command

static const option *find(const option *options, size_t count, const char *name, size_t length) {
  for (size_t i = 0; i < count; i++)
    if (strlen(options[i].name) == length && memcmp(options[i].name, name, length) == 0) return &options[i];
  return NULL;
}

static wm_status unknown(const option *options, size_t count, const char *word, wm_error *err) {
  const char *names[OPTIONS_MAX + 1] = {NULL};
  for (size_t i = 0; i < count && i < OPTIONS_MAX; i++) names[i] = options[i].name;
  char name[64] = "";
  strncat(name, word, strcspn(word, "=") < sizeof name ? strcspn(word, "=") : sizeof name - 1);
  const char *nearest = wm_word_nearest(name, names);
  if (nearest) return wm_fail(err, WM_BAD_USAGE, "option '%s' is unknown; did you mean '%s'?", name, nearest);
  return wm_fail(err, WM_BAD_USAGE, "option '%s' is unknown", name);
}

static wm_status set(const option *o, const char *value, wm_error *err) {
  char *rest;
  errno = 0;
  switch (o->kind) {
    case OPTION_TEXT:
      if (!*value) return wm_fail(err, WM_BAD_USAGE, "%s: is empty", o->name);
      *(const char **)o->out = value;
      return WM_OK;
    case OPTION_TEXTS: {
      option_texts *texts = o->out;
      if (!*value) return wm_fail(err, WM_BAD_USAGE, "%s: is empty", o->name);
      if (texts->count == OPTION_TEXTS_MAX)
        return wm_fail(err, WM_BAD_USAGE, "%s: appears more than %d times", o->name, OPTION_TEXTS_MAX);
      texts->text[texts->count++] = value;
      return WM_OK;
    }
    case OPTION_U64: {
      unsigned long long v = strtoull(value, &rest, 10);
      if (*value < '0' || *value > '9' || *rest || errno)
        return wm_fail(err, WM_BAD_USAGE, "%s: '%s' is not a whole number from 0 on, or is too large", o->name, value);
      *(uint64_t *)o->out = v;
      return WM_OK;
    }
    case OPTION_F64:
    case OPTION_F64_FROM_0: {
      double v = strtod(value, &rest);
      if (!*value || *rest || !isfinite(v) || v < 0 || (v == 0 && o->kind == OPTION_F64))
        return wm_fail(err, WM_BAD_USAGE, "%s: '%s' is not a number %s", o->name, value,
                       o->kind == OPTION_F64 ? "above 0" : "from 0 on");
      *(double *)o->out = v;
      return WM_OK;
    }
    case OPTION_FLAG: break;
  }
  return wm_fail(err, WM_BAD_USAGE, "%s: takes no value", o->name);
}

wm_status options_parse(int argc, char *const *argv, const option *options, size_t count, const char **words,
                        size_t capacity, size_t *word_count, wm_error *err) {
  *word_count = 0;
  int only_words = 0;
  for (int i = 0; i < argc; i++) {
    const char *word = argv[i];
    if (only_words || word[0] != '-' || word[1] == '\0') {
      if (*word_count == capacity) return wm_fail(err, WM_BAD_USAGE, "unexpected argument '%s'", word);
      words[(*word_count)++] = word;
      continue;
    }
    if (strcmp(word, "--") == 0) {
      only_words = 1;
      continue;
    }
    size_t length = strcspn(word, "=");
    const option *o = find(options, count, word, length);
    if (!o) return unknown(options, count, word, err);
    if (o->kind == OPTION_FLAG && word[length] == '\0') {
      *(int *)o->out = 1;
      continue;
    }
    const char *value = word[length] == '=' ? word + length + 1 : NULL;
    if (!value) {
      if (i + 1 == argc) return wm_fail(err, WM_BAD_USAGE, "%s: its value is missing", o->name);
      value = argv[++i];
    }
    wm_status status = set(o, value, err);
    if (status != WM_OK) return status;
  }
  return WM_OK;
}
