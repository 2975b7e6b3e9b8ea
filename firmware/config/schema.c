// SPDX-License-Identifier: Apache-2.0
// Prints the keys of a configuration as a JSON schema (draft 7, which editors' YAML servers read).
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "config/detectors.h"
#include "config/keys.h"
#include "waymark/streams.h"
#include "waymark/text.h"

#define ENTRIES_MAX 1024

// A key or a section: one of `param` and `other`, or neither for a section.
typedef struct entry {
  char key[CONFIG_KEY_MAX];
  const wm_param *param;
  const config_key *other;
  const char *about;
} entry;

typedef struct schema {
  FILE *to;
  entry *at;
  size_t count;
} schema;

static void add(schema *self, const char *prefix, const char *key, entry of) {
  if (self->count == ENTRIES_MAX) return;
  snprintf(of.key, sizeof of.key, "%s%s", prefix, key);
  self->at[self->count++] = of;
}

static void collect(schema *self) {
  static const config_key kCameras = {"cameras", CONFIG_LIST, "all", .about = "Names of cameras in calibration.yaml.",
                                      .max = WM_CAMERAS_MAX};
  config_section sections[CONFIG_SECTIONS_MAX];
  const size_t count = config_sections(sections);
  for (const config_key *key = kConfigKeys; key->key; key++) add(self, "", key->key, (entry){.other = key});
  for (size_t i = 0; i < count; i++) {
    const config_section *const of = &sections[i];
    const size_t n = strlen(of->prefix);
    char name[CONFIG_KEY_MAX];
    snprintf(name, sizeof name, "%.*s", n ? (int)n - 1 : 0, of->prefix);
    if (n) add(self, "", name, (entry){.about = of->about});
    for (size_t p = 0; p < of->table->count; p++)
      add(self, of->prefix, of->table->params[p].key, (entry){.param = &of->table->params[p]});
    const wm_detector *const detector = strncmp(name, "vision.", 7) == 0 ? config_detector_find(name + 7) : NULL;
    if (detector && detector->pictures != 2) add(self, of->prefix, kCameras.key, (entry){.other = &kCameras});
  }
}

static void limits(FILE *to, double min, double max) {
  if (min == DBL_MIN)
    fprintf(to, ", \"exclusiveMinimum\": 0");
  else if (isfinite(min))
    fprintf(to, ", \"minimum\": %.10g", min);
  if (isfinite(max)) fprintf(to, ", \"maximum\": %.10g", max);
}

// A choice as YAML reads it: true and false are no texts.
static void print_name(FILE *to, const char *name) {
  if (strcmp(name, "true") == 0 || strcmp(name, "false") == 0)
    (void)fputs(name, to);
  else
    wm_json_text(name, to);
}

static void list_of_names(FILE *to, const char *const *names) {
  fprintf(to, "\"enum\": [");
  for (size_t i = 0; names[i]; i++) {
    if (i) fprintf(to, ", ");
    print_name(to, names[i]);
  }
  fprintf(to, "]");
}

static void describe(FILE *to, const char *about, const char *initial) {
  char text[1024];
  snprintf(text, sizeof text, "%s%s%s", about, initial ? " Default: " : "", initial ? initial : "");
  fprintf(to, ", \"description\": ");
  wm_json_text(text, to);
}

static void print_param(FILE *to, const wm_param *p) {
  fprintf(to, "{");
  switch (p->type) {
    case WM_PARAM_F64:
    case WM_PARAM_I32:
      fprintf(to, "\"type\": \"%s\"", p->type == WM_PARAM_F64 ? "number" : "integer");
      limits(to, p->min, p->max);
      if (isfinite(p->initial)) fprintf(to, ", \"default\": %.10g", p->initial);
      break;
    case WM_PARAM_BOOL:
      fprintf(to, "\"type\": \"boolean\", \"default\": %s", p->initial != 0 ? "true" : "false");
      break;
    case WM_PARAM_ENUM:
      list_of_names(to, p->names);
      fprintf(to, ", \"default\": ");
      print_name(to, p->names[(int)p->initial]);
      break;
  }
  describe(to, p->about, NULL);
  fprintf(to, "}");
}

static void print_estimators(FILE *to) {
  size_t count;
  const wm_estimator *const *all = wm_estimators(&count);
  fprintf(to, "\"enum\": [");
  for (size_t i = 0; i < count; i++) fprintf(to, "%s\"%s\"", i ? ", " : "", all[i]->name);
  fprintf(to, "]");
}

// A source's name alone, or with a sensor, an interface or a camera behind a colon.
static void print_source(FILE *to) {
  const wm_detector *seen;
  fprintf(to, "\"anyOf\": [{");
  list_of_names(to, wm_source_names);
  fprintf(to, "}, {\"pattern\": \"^(sightings|markers|can):.\"}");
  for (size_t i = 0; (seen = config_detector(i)) != NULL; i++)
    fprintf(to, ", {\"pattern\": \"^%s(:.+)?$\"}", seen->name);
  fprintf(to, "]");
}

static int is_needed(const config_key *key) { return key && strcmp(key->initial, CONFIG_NEEDED) == 0; }

static void print_keys(FILE *to, const config_key *keys);

static void print_map(FILE *to, const config_key *key) {
  if (key->of) {
    print_keys(to, key->of);
    return;
  }
  fprintf(to, "\"type\": \"object\", ");
  if (!key->names) {
    fprintf(to, "\"additionalProperties\": {\"type\": \"integer\"}");
    return;
  }
  fprintf(to, "\"additionalProperties\": false, \"properties\": {");
  for (size_t i = 0; key->names[i]; i++) fprintf(to, "%s\"%s\": {\"type\": \"number\"}", i ? ", " : "", key->names[i]);
  fprintf(to, "}");
}

static void print_key(FILE *to, const config_key *key) {
  fprintf(to, "{");
  switch (key->kind) {
    case CONFIG_TEXT:
    case CONFIG_FILE:
    case CONFIG_PATH: fprintf(to, "\"type\": [\"string\", \"number\"]"); break;  // a name may be 0
    case CONFIG_ESTIMATOR: print_estimators(to); break;
    case CONFIG_SOURCE: print_source(to); break;
    case CONFIG_BOOL: fprintf(to, "\"type\": \"boolean\""); break;
    case CONFIG_NUMBER:
    case CONFIG_WHOLE:
      fprintf(to, "\"type\": \"%s\"", key->kind == CONFIG_NUMBER ? "number" : "integer");
      limits(to, key->min, key->max);
      break;
    case CONFIG_CHOICE: list_of_names(to, key->names); break;
    case CONFIG_LIST:
      fprintf(to, "\"type\": \"array\", ");
      if (key->max > 0) fprintf(to, "\"maxItems\": %.0f, ", key->max);
      fprintf(to, "\"items\": {");
      if (key->of)
        print_keys(to, key->of);
      else
        fprintf(to, "\"type\": [\"string\", \"number\"]");
      fprintf(to, "}");
      break;
    case CONFIG_MAP: print_map(to, key); break;
  }
  describe(to, key->about, is_needed(key) ? NULL : key->initial);
  fprintf(to, "}");
}

// The inside of an object with these keys.
static void print_keys(FILE *to, const config_key *keys) {
  fprintf(to, "\"type\": \"object\", \"additionalProperties\": false, \"required\": [");
  for (size_t i = 0, needed = 0; keys[i].key; i++)
    if (is_needed(&keys[i])) fprintf(to, "%s\"%s\"", needed++ ? ", " : "", keys[i].key);
  fprintf(to, "], \"properties\": {");
  for (size_t i = 0; keys[i].key; i++) {
    fprintf(to, "%s\"%s\": ", i ? ", " : "", keys[i].key);
    print_key(to, &keys[i]);
  }
  fprintf(to, "}");
}

// What stands behind `prefix` in a key, or NULL.
static const char *behind(const char *key, const char *prefix) {
  const size_t n = strlen(prefix);
  return strncmp(key, prefix, n) == 0 && key[n] ? key + n : NULL;
}

// Whether an earlier entry begins with the same part.
static int is_seen(const schema *self, size_t index, const char *prefix, size_t length) {
  const char *const name = behind(self->at[index].key, prefix);
  for (size_t i = 0; i < index; i++) {
    const char *const other = behind(self->at[i].key, prefix);
    if (other && strncmp(other, name, length) == 0 && (other[length] == '.' || other[length] == '\0')) return 1;
  }
  return 0;
}

// A parameter's dots may stand in the file, too: `recover.on: true` for `recover: {on: true}`.
static void print_dotted(const schema *self, const char *prefix) {
  size_t count = 0;
  for (size_t i = 0; i < self->count; i++) {
    const char *const name = behind(self->at[i].key, prefix);
    if (!name || !self->at[i].param || !strchr(name, '.')) continue;
    fprintf(self->to, "%s\"^", count++ ? ", " : ", \"patternProperties\": {");
    for (const char *c = name; *c; c++) fprintf(self->to, *c == '.' ? "\\\\." : "%c", *c);
    fprintf(self->to, "$\": {\"$ref\": \"#");
    for (const char *part = self->at[i].key; *part; part += strcspn(part, "."), part += *part == '.')
      fprintf(self->to, "/properties/%.*s", (int)strcspn(part, "."), part);
    fprintf(self->to, "\"}");
  }
  if (count) fprintf(self->to, "}");
}

// Properties of the object whose keys begin with `prefix`: "" or "motion.".
static void print_members(const schema *self, const char *prefix) {
  size_t count = 0, needed = 0;
  fprintf(self->to, "\"additionalProperties\": false, \"required\": [");
  for (size_t i = 0; i < self->count; i++) {
    const char *const name = behind(self->at[i].key, prefix);
    if (name && !strchr(name, '.') && is_needed(self->at[i].other))
      fprintf(self->to, "%s\"%s\"", needed++ ? ", " : "", name);
  }
  fprintf(self->to, "], \"properties\": {");
  for (size_t i = 0; i < self->count; i++) {
    const char *const name = behind(self->at[i].key, prefix);
    const size_t length = name ? strcspn(name, ".") : 0;
    if (!name || is_seen(self, i, prefix, length)) continue;
    char full[CONFIG_KEY_MAX], deeper[CONFIG_KEY_MAX + 1];
    snprintf(full, sizeof full, "%s%.*s", prefix, (int)length, name);
    snprintf(deeper, sizeof deeper, "%s.", full);
    const entry *own = NULL;
    int is_group = 0;
    for (size_t k = 0; k < self->count; k++) {
      if (strcmp(self->at[k].key, full) == 0) own = &self->at[k];
      is_group |= behind(self->at[k].key, deeper) != NULL;
    }
    fprintf(self->to, "%s\n\"%.*s\": ", count++ ? "," : "", (int)length, name);
    if (!is_group && own && own->param) {
      print_param(self->to, own->param);
    } else if (!is_group && own && own->other) {
      print_key(self->to, own->other);
    } else {
      fprintf(self->to, "{\"type\": [\"object\", \"null\"], ");
      print_members(self, deeper);
      if (strcmp(full, "vision") != 0) print_dotted(self, deeper);
      if (own) describe(self->to, own->other ? own->other->about : own->about, NULL);
      fprintf(self->to, "}");
    }
  }
  fprintf(self->to, "}");
}

void wm_config_schema(FILE *to) {
  schema self = {.to = to, .at = calloc(ENTRIES_MAX, sizeof(entry))};
  if (!self.at) return;
  collect(&self);
  fprintf(to,
          "{\"$schema\": \"http://json-schema.org/draft-07/schema#\", \"title\": \"Waymark's configuration\", "
          "\"type\": \"object\", ");
  print_members(&self, "");
  fprintf(to, "}\n");
  free(self.at);
}
