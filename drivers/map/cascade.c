// SPDX-License-Identifier: Apache-2.0
// OpenCV's cascade files: XML with elements and text only. At an element's end its path in the tree gives the meaning
// of its numbers.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "waymark/cascade_file.h"
#include "waymark/text.h"

#define DEPTH_MAX 16        // of elements; OpenCV's files are less deep
#define NAME_MAX_BYTES 32   // of an element
#define ITEMS_MAX 1000000u  // nodes, leaves or rectangles: bounds the memory of a malformed file
#define NUMBERS_MAX 4096    // of one element

typedef struct slice {
  const char *at;
  size_t length;
} slice;

typedef struct reader {
  const char *at, *end, *path;
  long line;
  char names[DEPTH_MAX][NAME_MAX_BYTES];
  int depth;
  double numbers[NUMBERS_MAX];
  size_t number_count;
  wm_cascade *out;
  int has_kind, rects;
  wm_error *err;
} reader;

static wm_status fail(reader *r, const char *what) {
  return wm_fail(r->err, WM_BAD_CONFIG, "%s:%ld: %s", r->path, r->line, what);
}

// Room for one more item; NULL without memory.
static void *more(void **list, size_t *count, size_t item_bytes) {
  const size_t n = *count;
  if (n == ITEMS_MAX) return NULL;
  if ((n & (n - 1)) == 0) {  // a power of two is full
    void *grown = realloc(*list, (n ? 2 * n : 1) * item_bytes);
    if (!grown) return NULL;
    *list = grown;
  }
  *count = n + 1;
  void *item = (char *)*list + n * item_bytes;
  memset(item, 0, item_bytes);
  return item;
}

#define MORE(r, list, count) more((void **)(void *)&(r)->out->list, &(r)->out->count, sizeof *(r)->out->list)

static int is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

static wm_status numbers_of(reader *r, slice text) {
  r->number_count = 0;
  for (size_t i = 0; i < text.length;) {
    if (is_blank(text.at[i])) {
      i++;
      continue;
    }
    const size_t from = i;
    while (i < text.length && !is_blank(text.at[i])) i++;
    size_t length = i - from;
    if (length > 1 && text.at[i - 1] == '.') length--;  // OpenCV writes "-1."
    if (r->number_count == NUMBERS_MAX) return fail(r, "more numbers than a cascade has in one place");
    if (wm_text_to_f64(text.at + from, length, &r->numbers[r->number_count++]) != WM_TEXT_OK) {
      char shown[WM_SHOW_TEXT_MAX];
      return wm_fail(r->err, WM_BAD_CONFIG, "%s:%ld: %s: '%s' is not a number", r->path, r->line,
                     r->names[r->depth - 1], wm_show_text(text.at + from, i - from, shown, sizeof shown));
    }
  }
  return WM_OK;
}

static int is_whole(double value, double min, double max) {
  return value >= min && value <= max && value == floor(value);
}

static wm_status one_number(reader *r, double min, double max, double *out) {
  if (r->number_count != 1 || !(r->numbers[0] >= min && r->numbers[0] <= max))
    return wm_fail(r->err, WM_BAD_CONFIG, "%s:%ld: %s: one number from %g to %g is needed", r->path, r->line,
                   r->names[r->depth - 1], min, max);
  *out = r->numbers[0];
  return WM_OK;
}

static int text_is(slice text, const char *word) {
  while (text.length > 0 && is_blank(*text.at)) text.at++, text.length--;
  while (text.length > 0 && is_blank(text.at[text.length - 1])) text.length--;
  return text.length == strlen(word) && memcmp(text.at, word, text.length) == 0;
}

static wm_status end_nodes(reader *r) {
  if (!r->has_kind) return fail(r, "featureType must stand before the stages");
  const size_t each = r->out->is_lbp ? 11 : 4;
  if (r->number_count == 0 || r->number_count % each != 0)
    return wm_fail(r->err, WM_BAD_CONFIG, "%s:%ld: internalNodes: a node of %s features has %zu numbers", r->path,
                   r->line, r->out->is_lbp ? "LBP" : "HAAR", each);
  const int nodes = (int)(r->number_count / each);
  wm_cascade_tree *tree = MORE(r, trees, tree_count);
  if (!tree) return fail(r, "too many trees");
  tree->first_node = (uint32_t)r->out->node_count;
  tree->first_leaf = (uint32_t)r->out->leaf_count;
  for (int i = 0; i < nodes; i++) {
    const double *n = r->numbers + (size_t)i * each;
    wm_cascade_node *node = MORE(r, nodes, node_count);
    if (!node) return fail(r, "too many nodes");
    for (int k = 0; k < 2; k++) {
      // Nodes may only point ahead, so that evaluation ends.
      if (!is_whole(n[k], -nodes, nodes - 1) || (n[k] > 0 && n[k] <= i))
        return fail(r, "internalNodes: a node must lead to a later one of its tree or to a leaf");
      node->next[k] = (int16_t)n[k];
    }
    if (!is_whole(n[2], 0, ITEMS_MAX)) return fail(r, "internalNodes: a feature's number is needed in the third place");
    node->feature = (uint32_t)n[2];
    node->threshold = (float)n[3];
    if (!isfinite(node->threshold)) return fail(r, "internalNodes: a number is too large");
    for (size_t k = 3; k < each && r->out->is_lbp; k++) {
      if (!is_whole(n[k], -2147483648.0, 4294967295.0)) return fail(r, "internalNodes: a set of codes is 8 integers");
      node->codes[k - 3] = (uint32_t)(int64_t)n[k];
    }
  }
  return WM_OK;
}

static wm_status end_leaves(reader *r) {
  if (r->out->tree_count == 0) return fail(r, "leafValues before internalNodes");
  const wm_cascade_tree *tree = &r->out->trees[r->out->tree_count - 1];
  if (tree->first_leaf != r->out->leaf_count || r->number_count != r->out->node_count - tree->first_node + 1)
    return fail(r, "leafValues: a tree has one leaf more than nodes");
  for (size_t i = 0; i < r->number_count; i++) {
    float *leaf = MORE(r, leaves, leaf_count);
    if (!leaf) return fail(r, "too many leaves");
    *leaf = (float)r->numbers[i];
    if (!isfinite(*leaf)) return fail(r, "leafValues: a number is too large");
  }
  return WM_OK;
}

// A stage begins with its threshold, before its trees.
static wm_status end_threshold(reader *r) {
  double value = 0;
  wm_status status = one_number(r, -1e6, 1e6, &value);
  if (status != WM_OK) return status;
  wm_cascade_stage *stage = MORE(r, stages, stage_count);
  if (!stage) return fail(r, "too many stages");
  stage->first_tree = (uint32_t)r->out->tree_count;
  stage->threshold = (float)value - 1e-5f;  // OpenCV's tolerance for rounded sums
  return WM_OK;
}

static wm_status end_stage(reader *r) {
  if (r->out->stage_count == 0) return fail(r, "a stage without stageThreshold");
  wm_cascade_stage *stage = &r->out->stages[r->out->stage_count - 1];
  if (stage->trees != 0 || r->out->tree_count <= stage->first_tree)
    return fail(r, "a stage needs its stageThreshold and then weakClassifiers");
  stage->trees = (uint32_t)r->out->tree_count - stage->first_tree;
  return WM_OK;
}

static wm_status end_rect(reader *r) {
  if (!r->has_kind) return fail(r, "featureType must stand before the features");
  const size_t need = r->out->is_lbp ? 4 : 5;
  if (r->number_count != need || r->rects == (r->out->is_lbp ? 1 : WM_CASCADE_RECTS))
    return fail(r, r->out->is_lbp ? "an LBP feature has one rectangle of 4 numbers"
                                  : "a HAAR feature has at most 3 rectangles of 5 numbers");
  if (r->rects == 0 && !MORE(r, features, feature_count)) return fail(r, "too many features");
  wm_cascade_feature *f = &r->out->features[r->out->feature_count - 1];
  const double *n = r->numbers, times = r->out->is_lbp ? 3 : 1;
  const double width = r->out->width_px, height = r->out->height_px;
  if (!(width > 0 && height > 0)) return fail(r, "width and height must stand before the features");
  if (!is_whole(n[0], 0, width) || !is_whole(n[1], 0, height) || !is_whole(n[2], 1, width) ||
      !is_whole(n[3], 1, height) || n[0] + times * n[2] > width || n[1] + times * n[3] > height)
    return fail(r, "a rectangle lies outside of the window");
  f->x[r->rects] = (uint8_t)n[0];
  f->y[r->rects] = (uint8_t)n[1];
  f->width[r->rects] = (uint8_t)n[2];
  f->height[r->rects] = (uint8_t)n[3];
  f->weight[r->rects] = need == 5 ? (float)n[4] : 1.0f;
  if (!(fabs((double)f->weight[r->rects]) < 1e6)) return fail(r, "a rectangle's weight is too large");
  r->rects++;
  return WM_OK;
}

static wm_status end_kind(reader *r, slice text) {
  r->has_kind = 1;
  r->out->is_lbp = (uint32_t)text_is(text, "LBP");
  if (r->out->is_lbp || text_is(text, "HAAR")) return WM_OK;
  char shown[WM_SHOW_TEXT_MAX];
  return wm_fail(r->err, WM_BAD_CONFIG, "%s:%ld: featureType: '%s' is unknown: LBP or HAAR is needed", r->path, r->line,
                 wm_show_text(text.at, text.length, shown, sizeof shown));
}

static int stands_in(const reader *r, int up, const char *name) {
  return r->depth > up && strcmp(r->names[r->depth - 1 - up], name) == 0;
}

// End of an element; `text` is its direct content.
static wm_status end_element(reader *r, slice text) {
  const char *name = r->names[r->depth - 1];
  double value = 0;
  wm_status status = WM_OK;
  if (stands_in(r, 1, "cascade") && r->depth == 3) {
    if (strcmp(name, "featureType") == 0) return end_kind(r, text);
    if (strcmp(name, "stageType") == 0 && !text_is(text, "BOOST")) return fail(r, "stageType: BOOST is needed");
    const int is_width = strcmp(name, "width") == 0;
    if (!is_width && strcmp(name, "height") != 0) return WM_OK;
    status = numbers_of(r, text);
    if (status == WM_OK) status = one_number(r, 3, WM_CASCADE_SIDE_MAX, &value);
    if (status == WM_OK && !is_whole(value, 3, WM_CASCADE_SIDE_MAX)) return fail(r, "a window has whole pixels");
    if (status == WM_OK && r->out->feature_count > 0)
      return fail(r, "the window's size must stand before the features");
    if (status == WM_OK) *(is_width ? &r->out->width_px : &r->out->height_px) = (uint32_t)value;
    return status;
  }
  const int is_nodes = strcmp(name, "internalNodes") == 0, is_leaves = strcmp(name, "leafValues") == 0,
            is_threshold = strcmp(name, "stageThreshold") == 0, is_tilted = strcmp(name, "tilted") == 0;
  const int is_rect = strcmp(name, "rect") == 0 || (strcmp(name, "_") == 0 && stands_in(r, 1, "rects"));
  if (strcmp(name, "_") == 0 && stands_in(r, 1, "stages")) return end_stage(r);
  if (strcmp(name, "_") == 0 && stands_in(r, 1, "features")) {
    if (r->rects == 0) return fail(r, "a feature without a rectangle");
    r->rects = 0;
    return WM_OK;
  }
  if (!is_nodes && !is_leaves && !is_threshold && !is_tilted && !is_rect) return WM_OK;
  status = numbers_of(r, text);
  if (status != WM_OK) return status;
  if (is_tilted && r->number_count == 1 && r->numbers[0] != 0)
    return fail(r, "tilted HAAR features are not supported: train without them (opencv_traincascade -mode BASIC)");
  return is_nodes       ? end_nodes(r)
         : is_leaves    ? end_leaves(r)
         : is_threshold ? end_threshold(r)
         : is_rect      ? end_rect(r)
                        : WM_OK;
}

// Skips up to and including `mark`, counting lines. 0 where it is missing.
static int skip_over(reader *r, const char *mark) {
  const size_t length = strlen(mark);
  for (; (size_t)(r->end - r->at) >= length; r->at++) {
    if (memcmp(r->at, mark, length) == 0) {
      r->at += length;
      return 1;
    }
    r->line += *r->at == '\n';
  }
  return 0;
}

static wm_status begin_element(reader *r, slice tag) {
  size_t length = 0;
  while (length < tag.length && !is_blank(tag.at[length])) length++;
  if (length == 0 || length >= NAME_MAX_BYTES) return fail(r, "this is not a cascade: an element's name is too long");
  if (r->depth == DEPTH_MAX) return fail(r, "this is not a cascade: elements are nested too deep");
  char *name = r->names[r->depth++];
  memcpy(name, tag.at, length);
  name[length] = 0;
  static const char kOld[] = "opencv-haar-classifier";
  for (size_t i = length; i + sizeof kOld - 1 <= tag.length; i++)
    if (memcmp(tag.at + i, kOld, sizeof kOld - 1) == 0)
      return fail(r,
                  "a cascade in the format of OpenCV 1 (opencv-haar-classifier): write it anew with today's OpenCV, "
                  "CascadeClassifier::convert");
  return WM_OK;
}

static wm_status close_element(reader *r, slice tag, slice text) {
  while (tag.length > 0 && is_blank(tag.at[tag.length - 1])) tag.length--;
  if (r->depth == 0 || strlen(r->names[r->depth - 1]) != tag.length ||
      memcmp(r->names[r->depth - 1], tag.at, tag.length) != 0)
    return fail(r, "this is not XML: an element ends that hasn't begun");
  wm_status status = end_element(r, text);
  r->depth--;
  return status;
}

static wm_status read_elements(reader *r) {
  const char *text = r->at;
  while (r->at < r->end) {
    if (*r->at != '<') {
      r->line += *r->at++ == '\n';
      continue;
    }
    const slice before = {text, (size_t)(r->at - text)};
    const size_t left = (size_t)(r->end - r->at);
    if (left >= 4 && memcmp(r->at, "<!--", 4) == 0) {
      if (!skip_over(r, "-->")) return fail(r, "a comment doesn't end: is the file cut?");
      text = r->at;
      continue;
    }
    const char *tag = r->at + 1;
    if (!skip_over(r, ">")) return fail(r, "an element doesn't end: is the file cut?");
    const slice inner = {tag, (size_t)(r->at - 1 - tag)};
    wm_status status = WM_OK;
    if (inner.length > 0 && *tag == '/')
      status = close_element(r, (slice){tag + 1, inner.length - 1}, before);
    else if (inner.length > 0 && *tag != '?' && *tag != '!' && tag[inner.length - 1] != '/')
      status = begin_element(r, inner);
    if (status != WM_OK) return status;
    text = r->at;
  }
  return r->depth == 0 ? WM_OK : fail(r, "ends within an element: is the file cut?");
}

static wm_status check_whole(reader *r) {
  wm_cascade *c = r->out;
  if (c->stage_count == 0 || c->feature_count == 0)
    return fail(
        r,
        "this is not a cascade: <opencv_storage><cascade type_id=\"opencv-cascade-classifier\"> with stages and "
        "features is needed, as opencv_traincascade writes it");
  uint32_t trees = 0;
  for (size_t i = 0; i < c->stage_count; i++) {
    if (c->stages[i].trees == 0 || c->stages[i].first_tree != trees) return fail(r, "a stage is not complete");
    trees += c->stages[i].trees;
  }
  if (trees != c->tree_count) return fail(r, "trees stand outside of a stage");
  if (c->leaf_count != c->node_count + c->tree_count) return fail(r, "a tree has no leafValues");
  for (size_t i = 0; i < c->node_count; i++)
    if (c->nodes[i].feature >= c->feature_count)
      return wm_fail(r->err, WM_BAD_CONFIG, "%s: a node uses feature %u of %zu: is the file truncated?", r->path,
                     (unsigned)c->nodes[i].feature, c->feature_count);
  return WM_OK;
}

wm_status wm_cascade_parse(const char *text, size_t length, const char *path, wm_cascade *out, wm_error *err) {
  memset(out, 0, sizeof *out);
  reader *r = calloc(1, sizeof *r);
  if (!r) return wm_fail(err, WM_IO, "%s: no memory to read it", path);
  r->at = text;
  r->end = text + length;
  r->path = path;
  r->line = 1;
  r->out = out;
  r->err = err;
  wm_status status = read_elements(r);
  if (status == WM_OK) status = check_whole(r);
  free(r);
  if (status != WM_OK) wm_cascade_free(out);
  return status;
}

wm_status wm_cascade_load(const char *path, wm_cascade *out, wm_error *err) {
  char *text;
  size_t length;
  memset(out, 0, sizeof *out);
  wm_status status = wm_text_read_file(path, WM_CASCADE_BYTES_MAX, &text, &length, err);
  if (status != WM_OK) return status;
  status = wm_cascade_parse(text, length, path, out, err);
  free(text);
  return status;
}

void wm_cascade_free(wm_cascade *self) {
  free(self->features);
  free(self->nodes);
  free(self->leaves);
  free(self->trees);
  free(self->stages);
  memset(self, 0, sizeof *self);
}
