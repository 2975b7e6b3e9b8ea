// SPDX-License-Identifier: Apache-2.0
// A value of a YAML text replaced or added in place: all other characters and comments stay.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

#include "waymark/yaml.h"

typedef struct editing {
  yaml_document_t doc;
  const char *text;
  size_t length;
} editing;

// Bytes of the text before a character; marks of libyaml count characters after a byte order mark.
static size_t byte_of(const editing *self, size_t character) {
  size_t at = self->length >= 3 && memcmp(self->text, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
  for (; at < self->length; at++) {
    if (((unsigned char)self->text[at] & 0xC0u) == 0x80u) continue;
    if (character-- == 0) break;
  }
  return at;
}

// Takes the first step ("key" or "[3]") off *path into `step`; 0 where it is too long or there is none.
static int take_step(const char **path, char *step, size_t capacity) {
  if (**path == '.') (*path)++;
  const size_t used = **path == '[' ? strcspn(*path, "]") + 1 : strcspn(*path, ".[");
  if (used == 0 || used >= capacity || used > strlen(*path)) return 0;
  memcpy(step, *path, used);
  step[used] = '\0';
  *path += used;
  return 1;
}

static yaml_node_t *child(editing *self, const yaml_node_t *node, const char *step) {
  if (step[0] == '[' && node->type == YAML_SEQUENCE_NODE) {
    const long i = strtol(step + 1, NULL, 10), count = node->data.sequence.items.top - node->data.sequence.items.start;
    return i >= 0 && i < count ? yaml_document_get_node(&self->doc, node->data.sequence.items.start[i]) : NULL;
  }
  if (node->type != YAML_MAPPING_NODE) return NULL;
  for (const yaml_node_pair_t *p = node->data.mapping.pairs.start; p < node->data.mapping.pairs.top; p++) {
    const yaml_node_t *key = yaml_document_get_node(&self->doc, p->key);
    if (key->type == YAML_SCALAR_NODE && strcmp((const char *)key->data.scalar.value, step) == 0)
      return yaml_document_get_node(&self->doc, p->value);
  }
  return NULL;
}

// Text with [begin, end) replaced; a comment is added at the end of the new line.
static char *put(const editing *self, size_t begin, size_t end, const char *value, const char *comment,
                 size_t *out_length) {
  const char *rest = self->text + end;
  const size_t tail = self->length - end;
  const char *line_end = memchr(rest, '\n', tail);
  size_t to_end = strchr(value, '\n') ? 0 : line_end ? (size_t)(line_end - rest) : tail;
  if (to_end > 0 && rest[to_end - 1] == '\r') to_end--;
  const size_t room = self->length + strlen(value) + strlen(comment) + 8;
  char *out = malloc(room);
  if (!out) return NULL;
  const int has_comment = comment[0] && !strchr(value, '\n');
  const int n = snprintf(out, room, "%.*s%s%.*s%s%s%.*s", (int)begin, self->text, value, (int)to_end, rest,
                         has_comment ? "  # " : "", has_comment ? comment : "", (int)(tail - to_end), rest + to_end);
  *out_length = n > 0 ? (size_t)n : 0;
  return out;
}

// A missing key: at the beginning of the map, in its style.
static char *add_to(const editing *self, const yaml_node_t *map, const char *step, const char *path, const char *value,
                    const char *comment, size_t *out_length) {
  char inner[320], rest[64], added[480];
  int depth = 0, used = 0;
  while (take_step(&path, rest, sizeof rest) && depth++ < 8)
    used += snprintf(inner + used, sizeof inner - (size_t)used, "{%s: ", rest);
  (void)snprintf(inner + used, sizeof inner - (size_t)used, "%s%.*s", value, depth, "}}}}}}}}");
  const size_t begin = byte_of(self, map->start_mark.index);
  if (map->data.mapping.style == YAML_FLOW_MAPPING_STYLE) {
    const int is_empty = map->data.mapping.pairs.top == map->data.mapping.pairs.start;
    (void)snprintf(added, sizeof added, "%s: %s%s", step, inner, is_empty ? "" : ", ");
    return put(self, begin + 1, begin + 1, added, comment, out_length);
  }
  (void)snprintf(added, sizeof added, "%s: %s%s%s\n%*s", step, inner, comment[0] ? "  # " : "", comment,
                 (int)map->start_mark.column, "");
  return put(self, begin, begin, added, comment, out_length);
}

static char *edit(editing *self, const char *path, const char *value, const char *comment, size_t *out_length) {
  yaml_node_t *node = yaml_document_get_root_node(&self->doc);
  char step[64];
  while (node && take_step(&path, step, sizeof step)) {
    yaml_node_t *next = child(self, node, step);
    if (!next)
      return node->type == YAML_MAPPING_NODE ? add_to(self, node, step, path, value, comment, out_length) : NULL;
    node = next;
  }
  if (!node) return NULL;
  const size_t begin = byte_of(self, node->start_mark.index);
  size_t end = byte_of(self, node->end_mark.index);
  while (end > begin && strchr(" \t\r\n", self->text[end - 1])) end--;
  return put(self, begin, end, value, comment, out_length);
}

wm_status wm_yaml_edit(const char *text, size_t length, const char *path, const char *value, const char *comment,
                       char **out, size_t *out_length, wm_error *err) {
  editing self = {.text = text, .length = length};
  yaml_parser_t parser;
  *out = NULL;
  if (!yaml_parser_initialize(&parser)) return wm_fail(err, WM_IO, "no memory to edit a file");
  yaml_parser_set_input_string(&parser, (const unsigned char *)text, length);
  if (yaml_parser_load(&parser, &self.doc)) {
    *out = edit(&self, path, value, comment, out_length);
    yaml_document_delete(&self.doc);
  }
  yaml_parser_delete(&parser);
  return *out ? WM_OK : wm_fail(err, WM_BAD_CONFIG, "%s: there is no place for this key", path);
}
