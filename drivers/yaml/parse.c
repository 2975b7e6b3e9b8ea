// SPDX-License-Identifier: Apache-2.0
// libyaml's events to a tree with line numbers. An alias refers to the anchored node itself, without a copy; its
// expanded size is counted and bounded.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

#include "document.h"
#include "waymark/text.h"

typedef struct anchor {
  char *name;
  int id;  // 0 while the node is still open
} anchor;

typedef struct builder {
  wm_yaml *doc;
  yaml_parser_t parser;
  const char *text;
  anchor *anchors;
  size_t anchor_count, anchor_capacity;
  int *stack;  // children of the collections that are open
  size_t stack_count, stack_capacity;
  size_t expanded;
  wm_error *err;
} builder;

// Grows `*array` so that one more element of `size` bytes fits. 0 where there is no memory.
static int room_for(void *array, size_t *capacity, size_t needed, size_t size) {
  if (needed <= *capacity) return 1;
  size_t larger = *capacity ? *capacity * 2 : 64;
  while (larger < needed) larger *= 2;
  void *old;
  memcpy(&old, array, sizeof old);
  void *fresh = realloc(old, larger * size);
  if (!fresh) return 0;
  memcpy(array, &fresh, sizeof fresh);
  *capacity = larger;
  return 1;
}

static int fail_at(builder *b, size_t line, const char *what) {
  (void)wm_fail(b->err, WM_BAD_CONFIG, "%s:%zu: %s", b->doc->file, line, what);
  return 0;
}

static int no_memory(builder *b) {
  (void)wm_fail(b->err, WM_IO, "%s: no memory to read it", b->doc->file);
  return 0;
}

static int fail_syntax(builder *b) {
  const yaml_parser_t *p = &b->parser;
  if (p->error == YAML_MEMORY_ERROR) return no_memory(b);
  size_t line = p->problem_mark.line + 1;
  if (p->error == YAML_READER_ERROR) {  // has an offset only
    line = 1;
    for (size_t i = 0; i < p->problem_offset; i++) line += b->text[i] == '\n';
  }
  char what[160];
  const char *problem = p->problem ? p->problem : "cannot be read";
  if (p->context && p->context_mark.line + 1 != line)
    snprintf(what, sizeof what, "not valid YAML: %s, %s that begins in line %zu", problem, p->context,
             p->context_mark.line + 1);
  else
    snprintf(what, sizeof what, "not valid YAML: %s%s%s", problem, p->context ? ", " : "",
             p->context ? p->context : "");
  return fail_at(b, line, what);
}

static int next_event(builder *b, yaml_event_t *event) {
  return yaml_parser_parse(&b->parser, event) ? 1 : fail_syntax(b);
}

static int add_node(builder *b, yaml_kind kind, size_t line) {
  wm_yaml *doc = b->doc;
  if (doc->node_count >= WM_YAML_NODES_MAX) return fail_at(b, line, "more than 1000000 values: too large");
  if (!room_for(&doc->nodes, &doc->node_capacity, doc->node_count + 1, sizeof *doc->nodes)) return no_memory(b);
  doc->nodes[doc->node_count] = (yaml_tree_node){.kind = (uint8_t)kind, .line = (int)line, .expanded = 1};
  return (int)doc->node_count++;
}

static int push(builder *b, int id) {
  if (!room_for(&b->stack, &b->stack_capacity, b->stack_count + 1, sizeof *b->stack)) return no_memory(b);
  b->stack[b->stack_count++] = id;
  return 1;
}

// Stores the anchor and returns its index + 1; 0 on failure. A redefined name has its last value.
static size_t add_anchor(builder *b, const yaml_char_t *name, size_t line) {
  if (b->anchor_count >= WM_YAML_ANCHORS_MAX) return (size_t)fail_at(b, line, "more than 1000 anchors");
  if (!room_for(&b->anchors, &b->anchor_capacity, b->anchor_count + 1, sizeof *b->anchors)) return (size_t)no_memory(b);
  char *copy = strdup((const char *)name);
  if (!copy) return (size_t)no_memory(b);
  b->anchors[b->anchor_count++] = (anchor){.name = copy};
  return b->anchor_count;
}

static int find_alias(builder *b, const yaml_event_t *event) {
  size_t line = event->start_mark.line + 1;
  for (size_t i = b->anchor_count; i-- > 0;) {
    if (strcmp(b->anchors[i].name, (const char *)event->data.alias.anchor) != 0) continue;
    if (b->anchors[i].id == 0) return fail_at(b, line, "an alias is inside its own anchor, which has no end");
    return b->anchors[i].id;
  }
  return fail_at(b, line, "an alias whose anchor (&NAME) doesn't stand before it");
}

static int is_null_word(const char *text) {
  return *text == '\0' || strcmp(text, "~") == 0 || strcmp(text, "null") == 0 || strcmp(text, "Null") == 0 ||
         strcmp(text, "NULL") == 0;
}

static int add_scalar(builder *b, const yaml_event_t *event) {
  wm_yaml *doc = b->doc;
  size_t length = event->data.scalar.length;
  int plain = event->data.scalar.style == YAML_PLAIN_SCALAR_STYLE;
  int id = add_node(b, YAML_KIND_SCALAR, event->start_mark.line + 1);
  if (!id) return 0;
  if (!room_for(&doc->pool, &doc->pool_capacity, doc->pool_used + length + 1, 1)) return no_memory(b);
  char *text = doc->pool + doc->pool_used;
  memcpy(text, event->data.scalar.value, length);
  text[length] = '\0';
  yaml_tree_node *node = &doc->nodes[id];
  node->first = doc->pool_used;
  node->count = length;
  node->quoted = !plain;
  if (plain && is_null_word(text)) node->kind = YAML_KIND_NULL;
  doc->pool_used += length + 1;
  return id;
}

static int compare_keys(const void *a, const void *b, void *context) {
  const wm_yaml *doc = context;
  int x = *(const int *)a, y = *(const int *)b;
  int order = strcmp(yaml_text(doc, x), yaml_text(doc, y));
  return order ? order : x - y;
}

static int fail_twice(builder *b, int first, int second) {
  char shown[WM_SHOW_TEXT_MAX], what[160];
  wm_show_text(yaml_text(b->doc, first), b->doc->nodes[first].count, shown, sizeof shown);
  snprintf(what, sizeof what, "%s: the key appears twice (first in line %d)", shown, b->doc->nodes[first].line);
  return fail_at(b, (size_t)b->doc->nodes[second].line, what);
}

// Keys must be scalars, each once. `keys` is a scratch copy of them.
static int check_map(builder *b, const int *pairs, size_t count) {
  wm_yaml *doc = b->doc;
  for (size_t i = 0; i < count; i++) {
    const yaml_tree_node *key = &doc->nodes[pairs[2 * i]];
    if (key->kind == YAML_KIND_LIST || key->kind == YAML_KIND_MAP || strlen(yaml_text(doc, pairs[2 * i])) != key->count)
      return fail_at(b, (size_t)key->line, "a key must be plain text");
  }
  int *keys = malloc((count + 1) * sizeof *keys);
  if (!keys) return no_memory(b);
  for (size_t i = 0; i < count; i++) keys[i] = pairs[2 * i];
  qsort_r(keys, count, sizeof *keys, compare_keys, doc);
  int ok = 1;
  for (size_t i = 1; ok && i < count; i++)
    if (strcmp(yaml_text(doc, keys[i - 1]), yaml_text(doc, keys[i])) == 0) ok = fail_twice(b, keys[i - 1], keys[i]);
  free(keys);
  return ok;
}

static int build(builder *b, yaml_event_t *event, int depth);

static int add_collection(builder *b, const yaml_event_t *start, int depth) {
  int is_map = start->type == YAML_MAPPING_START_EVENT;
  size_t line = start->start_mark.line + 1;
  if (depth >= WM_YAML_DEPTH_MAX) return fail_at(b, line, "nested deeper than 64 levels");
  int id = add_node(b, is_map ? YAML_KIND_MAP : YAML_KIND_LIST, line);
  if (!id) return 0;
  size_t base = b->stack_count;
  for (;;) {
    yaml_event_t event;
    if (!next_event(b, &event)) return 0;
    int done = event.type == YAML_MAPPING_END_EVENT || event.type == YAML_SEQUENCE_END_EVENT;
    int child = done ? 1 : build(b, &event, depth + 1);
    yaml_event_delete(&event);
    if (done) break;
    if (!child || !push(b, child)) return 0;
  }
  wm_yaml *doc = b->doc;
  size_t count = b->stack_count - base;
  if (is_map && count > 0 && !check_map(b, b->stack + base, count / 2)) return 0;
  if (!room_for(&doc->links, &doc->link_capacity, doc->link_count + count + 1, sizeof *doc->links)) return no_memory(b);
  size_t expanded = 1;
  for (size_t i = 0; i < count; i++) {
    doc->links[doc->link_count + i] = b->stack[base + i];
    expanded += doc->nodes[b->stack[base + i]].expanded;
  }
  if (expanded > WM_YAML_NODES_MAX) return fail_at(b, line, "aliases written out make more than 1000000 values");
  doc->nodes[id].first = doc->link_count;
  doc->nodes[id].count = is_map ? count / 2 : count;
  doc->nodes[id].expanded = expanded;
  doc->link_count += count;
  b->stack_count = base;
  return id;
}

// The node that begins with `event`; 0 where it fails.
static int build(builder *b, yaml_event_t *event, int depth) {
  if (event->type == YAML_ALIAS_EVENT) return find_alias(b, event);
  const yaml_char_t *name = NULL;
  if (event->type == YAML_SCALAR_EVENT) name = event->data.scalar.anchor;
  if (event->type == YAML_SEQUENCE_START_EVENT) name = event->data.sequence_start.anchor;
  if (event->type == YAML_MAPPING_START_EVENT) name = event->data.mapping_start.anchor;
  size_t place = 0;
  if (name && !(place = add_anchor(b, name, event->start_mark.line + 1))) return 0;
  int id = event->type == YAML_SCALAR_EVENT ? add_scalar(b, event) : add_collection(b, event, depth);
  if (place) b->anchors[place - 1].id = id;
  return id;
}

// STREAM-START [DOCUMENT-START node DOCUMENT-END] STREAM-END
static int build_document(builder *b) {
  for (;;) {
    yaml_event_t event;
    if (!next_event(b, &event)) return 0;
    yaml_event_type_t type = event.type;
    size_t line = event.start_mark.line + 1;
    int ok = 1;
    if (type == YAML_DOCUMENT_START_EVENT && b->doc->root)
      ok = fail_at(b, line, "a second document (---) in the file; one is needed");
    if (type == YAML_SCALAR_EVENT || type == YAML_SEQUENCE_START_EVENT || type == YAML_MAPPING_START_EVENT ||
        type == YAML_ALIAS_EVENT)
      ok = b->doc->root = build(b, &event, 0);
    yaml_event_delete(&event);
    if (!ok || type == YAML_STREAM_END_EVENT) return ok;
  }
}

wm_status wm_yaml_parse(const char *text, size_t length, const char *path, wm_yaml **out, wm_error *err) {
  *out = NULL;
  wm_error local;
  builder b = {.text = text, .err = err ? err : &local};
  if (length > WM_YAML_BYTES_MAX) return wm_fail(err, WM_BAD_CONFIG, "%s: larger than 16 MB", path);
  if (length >= 2 && (memcmp(text, "\xFF\xFE", 2) == 0 || memcmp(text, "\xFE\xFF", 2) == 0))
    return wm_fail(err, WM_BAD_CONFIG, "%s:1: the file is in UTF-16; save it as UTF-8", path);
  if (length >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0) {  // UTF-8's byte order mark, which YAML allows
    b.text = text += 3;
    length -= 3;
  }
  b.doc = calloc(1, sizeof *b.doc);
  if (!b.doc) return wm_fail(err, WM_IO, "%s: no memory to read it", path);
  snprintf(b.doc->file, sizeof b.doc->file, "%s", path);
  b.err->status = WM_BAD_CONFIG;
  int ok = 0;
  if (yaml_parser_initialize(&b.parser)) {
    yaml_parser_set_encoding(&b.parser, YAML_UTF8_ENCODING);
    yaml_parser_set_input_string(&b.parser, (const unsigned char *)text, length);
    (void)add_node(&b, YAML_KIND_NULL, 1);  // index 0: absent
    ok = b.doc->node_count == 1 && build_document(&b);
    yaml_parser_delete(&b.parser);
  } else {
    (void)no_memory(&b);
  }
  for (size_t i = 0; i < b.anchor_count; i++) free(b.anchors[i].name);
  free(b.anchors);
  free(b.stack);
  if (!ok) {
    wm_yaml_free(b.doc);
    return b.err->status;
  }
  *out = b.doc;
  return WM_OK;
}

wm_status wm_yaml_load(const char *path, wm_yaml **out, wm_error *err) {
  char *text;
  size_t length;
  *out = NULL;
  wm_status status = wm_text_read_file(path, WM_YAML_BYTES_MAX, &text, &length, err);
  if (status != WM_OK) return status;
  status = wm_yaml_parse(text, length, path, out, err);
  free(text);
  return status;
}

void wm_yaml_free(wm_yaml *doc) {
  if (!doc) return;
  free(doc->nodes);
  free(doc->links);
  free(doc->pool);
  free(doc);
}
