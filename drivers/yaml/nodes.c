// SPDX-License-Identifier: Apache-2.0
// Access to the tree, and typed reads with messages.
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "document.h"
#include "waymark/text.h"

static const yaml_tree_node *at(const wm_yaml_node *node) { return &node->doc->nodes[node->id]; }

// The node of a map's value (`key`) or of a list's item (`key` NULL).
static wm_yaml_node child(const wm_yaml_node *parent, int id, const char *key, size_t index) {
  wm_yaml_node node = {.doc = parent->doc, .id = id};
  char shown[WM_SHOW_TEXT_MAX];
  if (key)
    snprintf(node.path, sizeof node.path, "%s%s%s", parent->path, *parent->path ? "." : "",
             wm_show_text(key, strlen(key), shown, sizeof shown));
  else
    snprintf(node.path, sizeof node.path, "%s[%zu]", parent->path, index);
  return node;
}

wm_yaml_node wm_yaml_root(const wm_yaml *doc) { return (wm_yaml_node){.doc = doc, .id = doc->root}; }
int wm_yaml_is_map(const wm_yaml_node *node) { return at(node)->kind == YAML_KIND_MAP; }
int wm_yaml_is_list(const wm_yaml_node *node) { return at(node)->kind == YAML_KIND_LIST; }
int wm_yaml_is_scalar(const wm_yaml_node *node) { return at(node)->kind == YAML_KIND_SCALAR; }
int wm_yaml_line(const wm_yaml_node *node) { return at(node)->line; }
const char *wm_yaml_file(const wm_yaml_node *node) { return node->doc->file; }

size_t wm_yaml_count(const wm_yaml_node *node) {
  return wm_yaml_is_map(node) || wm_yaml_is_list(node) ? at(node)->count : 0;
}

wm_yaml_node wm_yaml_item(const wm_yaml_node *list, size_t i) {
  int id = wm_yaml_is_list(list) && i < at(list)->count ? list->doc->links[at(list)->first + i] : 0;
  return child(list, id, NULL, i);
}

wm_yaml_node wm_yaml_value(const wm_yaml_node *map, size_t i, const char **key, int *key_line) {
  int there = wm_yaml_is_map(map) && i < at(map)->count;
  const int *pair = there ? map->doc->links + at(map)->first + 2 * i : NULL;
  const char *name = there ? yaml_text(map->doc, pair[0]) : "";
  if (key) *key = name;
  if (key_line) *key_line = there ? map->doc->nodes[pair[0]].line : wm_yaml_line(map);
  return child(map, there ? pair[1] : 0, name, 0);
}

static wm_yaml_node get_one(const wm_yaml_node *map, const char *key, size_t length) {
  char name[128];
  snprintf(name, sizeof name, "%.*s", (int)length, key);
  size_t count = wm_yaml_is_map(map) ? at(map)->count : 0;
  for (size_t i = 0; i < count; i++) {
    const int *pair = map->doc->links + at(map)->first + 2 * i;
    if (strcmp(yaml_text(map->doc, pair[0]), name) != 0) continue;
    return child(map, map->doc->nodes[pair[1]].kind == YAML_KIND_NULL ? 0 : pair[1], name, 0);
  }
  return child(map, 0, name, 0);
}

wm_yaml_node wm_yaml_get(const wm_yaml_node *map, const char *key) {
  wm_yaml_node node = *map;
  for (;;) {
    size_t length = strcspn(key, ".");
    node = get_one(&node, key, length);
    if (key[length] == '\0') return node;
    key += length + 1;
  }
}

wm_status wm_yaml_fail(const wm_yaml_node *node, wm_error *err, const char *format, ...) {
  char text[512];
  va_list args;
  va_start(args, format);
  (void)vsnprintf(text, sizeof text, format, args);
  va_end(args);
  int line = wm_yaml_line(node);
  return wm_fail(err, WM_BAD_CONFIG, "%s:%d: %s%s%s", node->doc->file, line > 0 ? line : 1, node->path,
                 *node->path ? ": " : "", text);
}

// "'abc'", "a list", "nothing": a node's content for messages.
static const char *what_is(const wm_yaml_node *node, char out[WM_SHOW_TEXT_MAX + 16]) {
  char shown[WM_SHOW_TEXT_MAX];
  switch (at(node)->kind) {
    case YAML_KIND_SCALAR:
      snprintf(out, WM_SHOW_TEXT_MAX + 16, "%s'%s'", at(node)->quoted ? "the text " : "",
               wm_show_text(yaml_text(node->doc, node->id), at(node)->count, shown, sizeof shown));
      return out;
    case YAML_KIND_LIST: return "a list";
    case YAML_KIND_MAP: return "a map";
    default: return "nothing";
  }
}

static const char *number_needed(const char *noun, double min, double max, char out[96]) {
  if (max < DBL_MAX && min == DBL_MIN)
    snprintf(out, 96, "%s above 0 and up to %.10g", noun, max);
  else if (min > -DBL_MAX && max < DBL_MAX)
    snprintf(out, 96, "%s from %.10g to %.10g", noun, min, max);
  else if (min == DBL_MIN)
    snprintf(out, 96, "%s above 0", noun);
  else if (min > -DBL_MAX)
    snprintf(out, 96, "%s of at least %.10g", noun, min);
  else if (max < DBL_MAX)
    snprintf(out, 96, "%s of at most %.10g", noun, max);
  else
    snprintf(out, 96, "%s", noun);
  return out;
}

// Absent, or empty after the colon.
static int is_null(const wm_yaml_node *node) { return at(node)->kind == YAML_KIND_NULL; }
static int is_plain(const wm_yaml_node *node) { return wm_yaml_is_scalar(node) && !at(node)->quoted; }

wm_status wm_yaml_f64(const wm_yaml_node *node, double min, double max, double *out, wm_error *err) {
  char is[WM_SHOW_TEXT_MAX + 16], needed[96];
  double value = 0.0;
  wm_text_number kind = WM_TEXT_NOT_A_NUMBER;
  if (is_plain(node)) kind = wm_text_to_f64(yaml_text(node->doc, node->id), at(node)->count, &value);
  if (kind == WM_TEXT_NOT_FINITE && isinf(value) && isinf(value > 0 ? max : min)) kind = WM_TEXT_OK;
  if (kind == WM_TEXT_OK && value >= min && value <= max) {
    *out = value;
    return WM_OK;
  }
  number_needed("a number", min, max, needed);
  if (is_null(node)) return wm_yaml_fail(node, err, "has no value; %s is needed", needed);
  if (kind == WM_TEXT_OK || kind == WM_TEXT_TOO_LARGE)
    return wm_yaml_fail(node, err, "%s is out of range; %s is needed", what_is(node, is), needed);
  if (kind == WM_TEXT_NOT_FINITE)
    return wm_yaml_fail(node, err, "%s is not a finite number; %s is needed", what_is(node, is), needed);
  return wm_yaml_fail(node, err, "%s is not a number; %s is needed", what_is(node, is), needed);
}

wm_status wm_yaml_i64(const wm_yaml_node *node, int64_t min, int64_t max, int64_t *out, wm_error *err) {
  char is[WM_SHOW_TEXT_MAX + 16], needed[96] = "a whole number";
  int64_t value = 0;
  wm_text_number kind = WM_TEXT_NOT_A_NUMBER;
  if (is_plain(node)) kind = wm_text_to_i64(yaml_text(node->doc, node->id), at(node)->count, &value);
  if (kind == WM_TEXT_OK && value >= min && value <= max) {
    *out = value;
    return WM_OK;
  }
  if (min != INT64_MIN || max != INT64_MAX)
    snprintf(needed, sizeof needed, "a whole number from %lld to %lld", (long long)min, (long long)max);
  if (is_null(node)) return wm_yaml_fail(node, err, "has no value; %s is needed", needed);
  return wm_yaml_fail(node, err, "%s is %s; %s is needed", what_is(node, is),
                      kind == WM_TEXT_NOT_A_NUMBER ? "not a whole number" : "out of range", needed);
}

wm_status wm_yaml_bool(const wm_yaml_node *node, int *out, wm_error *err) {
  char is[WM_SHOW_TEXT_MAX + 16];
  const char *text = is_plain(node) ? yaml_text(node->doc, node->id) : "";
  int yes = strcasecmp(text, "true") == 0;
  if (is_null(node)) return wm_yaml_fail(node, err, "has no value; true or false is needed");
  if (!yes && strcasecmp(text, "false") != 0)
    return wm_yaml_fail(node, err, "%s is neither true nor false", what_is(node, is));
  *out = yes;
  return WM_OK;
}

wm_status wm_yaml_string(const wm_yaml_node *node, char *out, size_t capacity, wm_error *err) {
  char is[WM_SHOW_TEXT_MAX + 16];
  if (is_null(node)) return wm_yaml_fail(node, err, "has no value; text is needed");
  if (!wm_yaml_is_scalar(node)) return wm_yaml_fail(node, err, "%s is not text", what_is(node, is));
  const char *text = yaml_text(node->doc, node->id);
  if (strlen(text) != at(node)->count) return wm_yaml_fail(node, err, "the text holds a zero byte");
  if (at(node)->count >= capacity)
    return wm_yaml_fail(node, err, "%s is longer than the %zu bytes that are allowed", what_is(node, is), capacity - 1);
  memcpy(out, text, at(node)->count + 1);
  return WM_OK;
}

static const char *list_of(const char *const *names, char *out, size_t capacity) {
  size_t used = 0;
  out[0] = '\0';
  for (size_t i = 0; names[i] && used + 1 < capacity; i++) {
    int n = snprintf(out + used, capacity - used, "%s%s", i ? ", " : "", names[i]);
    used += n > 0 ? (size_t)n : 0;
  }
  return out;
}

wm_status wm_yaml_choice(const wm_yaml_node *node, const char *const *names, int32_t *out, wm_error *err) {
  char is[WM_SHOW_TEXT_MAX + 16], all[512];
  const char *text = wm_yaml_is_scalar(node) ? yaml_text(node->doc, node->id) : "";
  for (int32_t i = 0; names[i]; i++) {
    if (strcmp(text, names[i]) != 0) continue;
    *out = i;
    return WM_OK;
  }
  list_of(names, all, sizeof all);
  if (is_null(node)) return wm_yaml_fail(node, err, "is missing; one of these is needed: %s", all);
  const char *nearest = wm_word_nearest(text, names);
  if (nearest)
    return wm_yaml_fail(node, err, "%s is unknown; did you mean '%s'? (one of: %s)", what_is(node, is), nearest, all);
  return wm_yaml_fail(node, err, "%s is unknown; one of these is needed: %s", what_is(node, is), all);
}

wm_status wm_yaml_f64_list(const wm_yaml_node *node, size_t min_count, size_t max_count, double *out, size_t *count,
                           wm_error *err) {
  char is[WM_SHOW_TEXT_MAX + 16], many[64];
  if (min_count == max_count)
    snprintf(many, sizeof many, "%zu", min_count);
  else
    snprintf(many, sizeof many, "%zu to %zu", min_count, max_count);
  if (!wm_yaml_is_list(node))
    return wm_yaml_fail(node, err, "%s is not a list; a list of %s numbers is needed", what_is(node, is), many);
  size_t n = wm_yaml_count(node);
  if (n < min_count || n > max_count)
    return wm_yaml_fail(node, err, "has %zu values; a list of %s numbers is needed", n, many);
  for (size_t i = 0; i < n; i++) {
    wm_yaml_node item = wm_yaml_item(node, i);
    wm_status status = wm_yaml_f64(&item, -DBL_MAX, DBL_MAX, &out[i], err);
    if (status != WM_OK) return status;
  }
  if (count) *count = n;
  return WM_OK;
}

static int is_known(const char *key, const char *const *known) {
  for (; *known; known++)
    if (strcmp(key, *known) == 0) return 1;
  return 0;
}

wm_status wm_yaml_check_keys(const wm_yaml_node *map, const char *const *known, wm_yaml_strictness strictness,
                             size_t *unknown, wm_error *err) {
  char is[WM_SHOW_TEXT_MAX + 16], all[384], ignored[384] = "";
  size_t found = 0, used = 0;
  if (unknown) *unknown = 0;
  if (!wm_yaml_is_map(map) && wm_yaml_there(map))
    return wm_yaml_fail(map, err, "%s is not a map (KEY: VALUE)", what_is(map, is));
  for (size_t i = 0; i < wm_yaml_count(map); i++) {
    const char *key;
    int line;
    wm_yaml_node value = wm_yaml_value(map, i, &key, &line);
    if (is_known(key, known) || (strictness == WM_YAML_NEAR && strncmp(key, "x_", 2) == 0)) continue;
    const char *nearest = wm_word_nearest(key, known);
    if (nearest)
      return wm_fail(err, WM_BAD_CONFIG, "%s:%d: %s: unknown key; did you mean '%s'?", map->doc->file, line, value.path,
                     nearest);
    if (strictness == WM_YAML_STRICT)
      return wm_fail(err, WM_BAD_CONFIG, "%s:%d: %s: unknown key; known are: %s", map->doc->file, line, value.path,
                     list_of(known, all, sizeof all));
    int n = snprintf(ignored + used, sizeof ignored - used, "%s%s:%d: %s: unknown key, ignored", found ? "\n" : "",
                     map->doc->file, line, value.path);
    used += n > 0 && used + (size_t)n < sizeof ignored ? (size_t)n : sizeof ignored - 1 - used;
    found++;
  }
  if (unknown) *unknown = found;
  if (found && err) snprintf(err->text, sizeof err->text, "%s", ignored);
  return WM_OK;
}
