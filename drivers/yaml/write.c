// SPDX-License-Identifier: Apache-2.0
// Writes a document as text: a line for each top-level key, flow style below.
#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "document.h"

typedef struct writer {
  const wm_yaml_change *changes;
  size_t count;
  FILE *to;
} writer;

static const wm_yaml_change *change_of(const writer *self, const char *path) {
  for (size_t i = 0; i < self->count; i++)
    if (strcmp(self->changes[i].path, path) == 0) return &self->changes[i];
  return NULL;
}

// The key that a change adds to the map at `path`: the rest of its path, if that is a single part.
static const char *key_below(const char *path, const char *changed) {
  size_t length = strlen(path);
  if (strncmp(changed, path, length) != 0) return NULL;
  const char *key = changed + length;
  if (length > 0 && *key++ != '.') return NULL;
  return *key && !strpbrk(key, ".[") ? key : NULL;
}

// Text that needs no quotes. Other text is never a number, so quotes don't change it.
static int is_plain(const char *text, size_t length) {
  if (length == 0 || text[length - 1] == ':' || strcmp(text, "-") == 0) return 0;
  for (size_t i = 0; i < length; i++)
    if (!isalnum((unsigned char)text[i]) && !strchr("_./+-:", text[i])) return 0;
  return 1;
}

static void write_text(const writer *self, const char *text, size_t length, int is_quoted) {
  if (!is_quoted && is_plain(text, length)) {
    (void)fwrite(text, 1, length, self->to);
    return;
  }
  (void)fputc('"', self->to);
  for (size_t i = 0; i < length; i++) {
    const unsigned char c = (unsigned char)text[i];
    if (c == '"' || c == '\\')
      (void)fprintf(self->to, "\\%c", c);
    else if (c < 32 || c == 127)
      (void)fprintf(self->to, "\\x%02X", c);
    else
      (void)fputc(c, self->to);
  }
  (void)fputc('"', self->to);
}

static void write_node(const writer *self, const wm_yaml_node *node);

static void write_pair(const writer *self, const char *key, const wm_yaml_node *value, const wm_yaml_change *change) {
  write_text(self, key, strlen(key), 0);
  (void)fputs(": ", self->to);
  if (change)
    write_text(self, change->text, strlen(change->text), 0);
  else
    write_node(self, value);
}

// The pairs of a map with its changes, with `between` two of them and `end` after the last.
static void write_pairs(const writer *self, const wm_yaml_node *map, const char *between, const char *end) {
  int written = 0;
  for (size_t i = 0; i < wm_yaml_count(map); i++) {
    const char *key;
    const wm_yaml_node value = wm_yaml_value(map, i, &key, NULL);
    const wm_yaml_change *change = change_of(self, value.path);
    if (change && !change->text) continue;
    if (written++) (void)fputs(between, self->to);
    write_pair(self, key, &value, change);
  }
  for (size_t i = 0; i < self->count; i++) {
    const char *key = key_below(map->path, self->changes[i].path);
    if (!key || !self->changes[i].text) continue;
    const wm_yaml_node there = wm_yaml_get(map, key);
    if (wm_yaml_there(&there)) continue;
    if (written++) (void)fputs(between, self->to);
    write_pair(self, key, NULL, &self->changes[i]);
  }
  (void)fputs(end, self->to);
}

static void write_node(const writer *self, const wm_yaml_node *node) {
  const yaml_tree_node *at = &node->doc->nodes[node->id];
  if (at->kind == YAML_KIND_MAP) {
    (void)fputc('{', self->to);
    write_pairs(self, node, ", ", "}");
  } else if (at->kind == YAML_KIND_LIST) {
    (void)fputc('[', self->to);
    for (size_t i = 0; i < at->count; i++) {
      const wm_yaml_node item = wm_yaml_item(node, i);
      if (i > 0) (void)fputs(", ", self->to);
      write_node(self, &item);
    }
    (void)fputc(']', self->to);
  } else if (at->kind == YAML_KIND_SCALAR) {
    write_text(self, yaml_text(node->doc, node->id), at->count, at->quoted);
  } else {
    (void)fputs("null", self->to);
  }
}

wm_status wm_yaml_write(const wm_yaml *doc, const wm_yaml_change *changes, size_t count, FILE *to, wm_error *err) {
  const writer self = {changes, count, to};
  const wm_yaml_node root = wm_yaml_root(doc);
  if (wm_yaml_is_map(&root)) {
    write_pairs(&self, &root, "\n", "\n");
  } else {
    write_node(&self, &root);
    (void)fputc('\n', to);
  }
  return ferror(to) ? wm_fail(err, WM_IO, "%s: can't be written: %s", doc->file, strerror(errno)) : WM_OK;
}
