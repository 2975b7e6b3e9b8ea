// SPDX-License-Identifier: Apache-2.0
// Prints the keys of a configuration from the tables that read it.
#include <float.h>
#include <math.h>
#include <string.h>

#include "config/keys.h"

static void print_type(FILE *to, const wm_param *p) {
  switch (p->type) {
    case WM_PARAM_F64:
      if (p->min == DBL_MIN)
        fprintf(to, "number above 0%s", isfinite(p->max) ? "" : " |");
      else
        fprintf(to, isfinite(p->max) ? "number from %.10g" : "number of at least %.10g |", p->min);
      if (isfinite(p->max)) fprintf(to, " to %.10g |", p->max);
      break;
    case WM_PARAM_I32: fprintf(to, "whole number from %.0f to %.0f |", p->min, p->max); break;
    case WM_PARAM_BOOL: fprintf(to, "true or false |"); break;
    case WM_PARAM_ENUM:
      for (size_t i = 0; p->names[i]; i++) fprintf(to, "%s`%s`", i ? ", " : "", p->names[i]);
      fprintf(to, " |");
      break;
  }
}

static void print_initial(FILE *to, const wm_param *p) {
  if (p->type == WM_PARAM_ENUM)
    fprintf(to, " %s |", p->names[(int)p->initial]);
  else if (p->type == WM_PARAM_BOOL)
    fprintf(to, " %s |", p->initial != 0.0 ? "true" : "false");
  else
    fprintf(to, " %.10g |", p->initial);
}

static void print_keys(FILE *to, const config_key *keys) {
  fprintf(to, "| key | value | default | meaning |\n| --- | --- | --- | --- |\n");
  for (; keys->key; keys++) fprintf(to, "| `%s` | %s | %s | %s |\n", keys->key, keys->type, keys->initial, keys->about);
}

// A former key and the new one, with their sections.
static void print_old(FILE *to, const config_section *section, const wm_param_old *old) {
  fprintf(to, "| `%s%s` | ", section->prefix, old->key);
  if (!old->new_key) {
    fprintf(to, "removed: %s |\n", old->about);
    return;
  }
  const int is_shared = *old->new_key == '/';
  fprintf(to, "`%s%s`%s%s |\n", is_shared ? "" : section->prefix, old->new_key + is_shared, old->about ? "; " : "",
          old->about ? old->about : "");
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
  if (!section->table->old || !section->table->old->key) return;
  fprintf(to, "\nFormer keys, which are read with a warning:\n\n| key | now |\n| --- | --- |\n");
  for (const wm_param_old *old = section->table->old; old->key; old++) print_old(to, section, old);
}

void wm_config_reference(FILE *to) {
  config_section sections[CONFIG_SECTIONS_MAX];
  size_t count = config_sections(sections);
  fprintf(to, "## At the top\n\n");
  print_keys(to, kConfigKeys);
  fprintf(to, "\n## Each entry of `sources`\n\n");
  print_keys(to, kConfigSourceKeys);
  fprintf(to, "\n## Each entry of `devices.can`\n\n");
  print_keys(to, kConfigCanDeviceKeys);
  fprintf(to, "\n## Each entry of `devices.lcm`\n\n");
  print_keys(to, kConfigLcmDeviceKeys);
  fprintf(to, "\n## Each entry of `devices.gpsd`\n\n");
  print_keys(to, kConfigGpsdDeviceKeys);
  fprintf(to, "\n## `devices.iio`\n\n");
  print_keys(to, kConfigIioDeviceKeys);
  fprintf(to, "\n## Each entry of `devices.cameras`\n\n");
  print_keys(to, kConfigCameraDeviceKeys);
  fprintf(to, "\n## `merge`, `publish`, `commands`, `realtime`, `start`, `black_box`\n\n");
  print_table(to, &sections[0], 0);
  for (size_t i = 1; i < count; i++) {
    int is_vision = strncmp(sections[i].prefix, "vision.", 7) == 0;
    fprintf(to, "\n## `%s%s`\n\n%s\n\n", is_vision ? "vision." : "", sections[i].name, sections[i].about);
    print_table(to, &sections[i], i <= WM_CONFIG_SHARED);
  }
}
