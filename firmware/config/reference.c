// SPDX-License-Identifier: Apache-2.0
// Prints the keys of a configuration from the tables that read it.
#include <float.h>
#include <math.h>
#include <string.h>

#include "config/keys.h"

static void print_number(FILE *to, double min, double max) {
  if (isinf(min))
    fprintf(to, "number");
  else if (min == DBL_MIN)
    fprintf(to, "number above 0");
  else
    fprintf(to, isfinite(max) ? "number from %.10g" : "number of at least %.10g", min);
  if (isfinite(min) && isfinite(max)) fprintf(to, " to %.10g", max);
}

static void print_whole(FILE *to, double min, double max) { fprintf(to, "whole number from %.0f to %.0f", min, max); }

static void print_names(FILE *to, const char *const *names) {
  for (size_t i = 0; names[i]; i++) fprintf(to, "%s`%s`", i ? ", " : "", names[i]);
}

static void print_type(FILE *to, const wm_param *p) {
  switch (p->type) {
    case WM_PARAM_F64: print_number(to, p->min, p->max); break;
    case WM_PARAM_I32: print_whole(to, p->min, p->max); break;
    case WM_PARAM_BOOL: fprintf(to, "true or false"); break;
    case WM_PARAM_ENUM: print_names(to, p->names); break;
  }
}

static void print_kind(FILE *to, const config_key *key) {
  switch (key->kind) {
    case CONFIG_ESTIMATOR:
    case CONFIG_SOURCE:
    case CONFIG_TEXT: fprintf(to, "text"); break;
    case CONFIG_FILE: fprintf(to, "file"); break;
    case CONFIG_PATH: fprintf(to, "path"); break;
    case CONFIG_BOOL: fprintf(to, "true or false"); break;
    case CONFIG_NUMBER: print_number(to, key->min, key->max); break;
    case CONFIG_WHOLE: print_whole(to, key->min, key->max); break;
    case CONFIG_CHOICE: print_names(to, key->names); break;
    case CONFIG_LIST: fprintf(to, "list"); break;
    case CONFIG_MAP: fprintf(to, "map"); break;
  }
}

static void print_initial(FILE *to, const wm_param *p) {
  if (p->type == WM_PARAM_ENUM)
    fprintf(to, " | %s |", p->names[(int)p->initial]);
  else if (p->type == WM_PARAM_BOOL)
    fprintf(to, " | %s |", p->initial != 0.0 ? "true" : "false");
  else
    fprintf(to, " | %.10g |", p->initial);
}

// A table, and those of the keys that have keys of their own.
static void print_keys(FILE *to, const char *title, const config_key *keys) {
  fprintf(to, "%s\n\n| key | value | default | meaning |\n| --- | --- | --- | --- |\n", title);
  for (const config_key *key = keys; key->key; key++) {
    fprintf(to, "| `%s` | ", key->key);
    print_kind(to, key);
    fprintf(to, " | %s | %s |\n", key->initial, key->about);
  }
  fprintf(to, "\n");
  for (const config_key *key = keys; key->key; key++) {
    char below[CONFIG_KEY_MAX + 32];
    const char *const in = keys == kConfigDevicesKeys ? "devices." : "";
    if (!key->of) continue;
    snprintf(below, sizeof below, "## %s`%s%s`", key->kind == CONFIG_LIST ? "Each entry of " : "", in, key->key);
    print_keys(to, below, key->of);
  }
}

// Former keys in one paragraph: the new ones first, then what is gone.
static void print_old(FILE *to, const config_section *section) {
  const wm_param_old *const all = section->table->old;
  size_t count = 0;
  if (!all || !all->key) return;
  fprintf(to, "\nFormer keys, read with a warning: ");
  for (const wm_param_old *old = all; old->key; old++) {
    fprintf(to, "%s`%s`", count++ ? "; " : "", old->key);
    if (!old->new_key) {
      fprintf(to, " removed (%s)", old->about);
      continue;
    }
    const int is_shared = *old->new_key == '/';
    fprintf(to, " → `%s`%s%s%s", old->new_key + is_shared, old->about ? " (" : "", old->about ? old->about : "",
            old->about ? ")" : "");
  }
  fprintf(to, ".\n");
}

// The estimators that take a parameter of a shared section.
static void print_takers(FILE *to, const config_section *section, const wm_param *p) {
  size_t count, taking = 0;
  char key[128];
  const wm_estimator *const *all = wm_estimators(&count);
  snprintf(key, sizeof key, "%s%s", section->prefix, p->key);
  for (size_t i = 0; i < count; i++)
    if (wm_estimator_reads(all[i], key)) fprintf(to, "%s`%s`", taking++ ? ", " : " ", all[i]->name);
  fprintf(to, " |");
}

static void print_table(FILE *to, const config_section *section, int is_shared) {
  if (section->table->count > 0)
    fprintf(to, "| key | value | default | meaning |%s\n| --- | --- | --- | --- |%s\n", is_shared ? " taken by |" : "",
            is_shared ? " --- |" : "");
  else
    fprintf(to, "It has no parameters of its own.\n");
  for (size_t i = 0; i < section->table->count; i++) {
    const wm_param *p = &section->table->params[i];
    fprintf(to, "| `%s%s` | ", section->prefix, p->key);
    print_type(to, p);
    print_initial(to, p);
    fprintf(to, " %s |", p->about);
    if (is_shared) print_takers(to, section, p);
    fprintf(to, "\n");
  }
  print_old(to, section);
}

void wm_config_reference(FILE *to) {
  config_section sections[CONFIG_SECTIONS_MAX];
  size_t count = config_sections(sections);
  print_keys(to, "## At the top", kConfigKeys);
  fprintf(to, "## `merge`, `publish`, `integrity`, `commands`, `realtime`, `start`, `black_box`\n\n");
  print_table(to, &sections[0], 0);
  for (size_t i = 1; i < count; i++) {
    int is_vision = strncmp(sections[i].prefix, "vision.", 7) == 0;
    fprintf(to, "\n## `%s%s`\n\n%s\n\n", is_vision ? "vision." : "", sections[i].name, sections[i].about);
    print_table(to, &sections[i], i <= WM_CONFIG_SHARED);
  }
}
