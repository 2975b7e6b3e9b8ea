// SPDX-License-Identifier: Apache-2.0
// YAML with line numbers, for configuration and calibration: a document read whole (libyaml), typed getters with file,
// line and key in their errors, and a check for unknown keys with "did you mean". Not for a real-time thread:
// allocates.
#ifndef WAYMARK_YAML_H
#define WAYMARK_YAML_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_yaml wm_yaml;
// A node of a document; cheap to copy. `id` 0 is an absent node. `path` is the dotted key for messages.
typedef struct wm_yaml_node {
  const wm_yaml *doc;
  int id;
  char path[128];
} wm_yaml_node;

// Refuses duplicate keys, endless expansion of anchors, and files above 16 MB.
wm_status wm_yaml_load(const char *path, wm_yaml **out, wm_error *err);
wm_status wm_yaml_parse(const char *text, size_t length, const char *path_for_messages, wm_yaml **out, wm_error *err);
void wm_yaml_free(wm_yaml *doc);

wm_yaml_node wm_yaml_root(const wm_yaml *doc);
int wm_yaml_is_map(const wm_yaml_node *node);
int wm_yaml_is_list(const wm_yaml_node *node);
int wm_yaml_is_scalar(const wm_yaml_node *node);
int wm_yaml_line(const wm_yaml_node *node);  // from 1
const char *wm_yaml_file(const wm_yaml_node *node);
size_t wm_yaml_count(const wm_yaml_node *node);  // items of a list, pairs of a map
// Items and values are returned also where they are null.
wm_yaml_node wm_yaml_item(const wm_yaml_node *list, size_t i);
wm_yaml_node wm_yaml_value(const wm_yaml_node *map, size_t i, const char **key, int *key_line);
// Child by key ("a.b" descends); id 0 where it is absent or null.
wm_yaml_node wm_yaml_get(const wm_yaml_node *map, const char *key);
static inline int wm_yaml_there(const wm_yaml_node *node) { return node->id != 0; }

// Typed reads. Wrong type or range: WM_BAD_CONFIG and a message with file, line, key, value and what is allowed. Limits
// are inclusive; a min of DBL_MIN reads "above 0", an infinite limit is none.
wm_status wm_yaml_f64(const wm_yaml_node *node, double min, double max, double *out, wm_error *err);
wm_status wm_yaml_i64(const wm_yaml_node *node, int64_t min, int64_t max, int64_t *out, wm_error *err);
wm_status wm_yaml_bool(const wm_yaml_node *node, int *out, wm_error *err);
wm_status wm_yaml_string(const wm_yaml_node *node, char *out, size_t capacity, wm_error *err);
wm_status wm_yaml_choice(const wm_yaml_node *node, const char *const *names, int32_t *out, wm_error *err);
wm_status wm_yaml_f64_list(const wm_yaml_node *node, size_t min_count, size_t max_count, double *out, size_t *count,
                           wm_error *err);

// Error "FILE:LINE: KEY: ..." at this node; returns WM_BAD_CONFIG.
wm_status wm_yaml_fail(const wm_yaml_node *node, wm_error *err, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// Unknown keys of a map. `known` is NULL-terminated. STRICT: any unknown key is an error (config). NEAR
// (calibration.yaml): an error where it is within two letters of a known one, else counted in *unknown with a line for
// each in err->text and WM_OK; keys that begin with "x_" are free. Other nodes than maps are an error, an absent one is
// not.
typedef enum wm_yaml_strictness { WM_YAML_STRICT, WM_YAML_NEAR } wm_yaml_strictness;
wm_status wm_yaml_check_keys(const wm_yaml_node *map, const char *const *known, wm_yaml_strictness strictness,
                             size_t *unknown, wm_error *err);

// A changed value.
typedef struct wm_yaml_change {
  char path[128];    // as in wm_yaml_node: "devices.can[0].dbc"; a missing key of an existing map is added
  const char *text;  // of a scalar; NULL: it is left out
} wm_yaml_change;
// Writes the document with changes: the same values, without comments. WM_IO.
wm_status wm_yaml_write(const wm_yaml *doc, const wm_yaml_change *changes, size_t count, FILE *to, wm_error *err);
// `text` with the value at `path` ("wheels.radius_m", "[2].scale") replaced by `value` (YAML in one line); all other
// characters stay. Missing keys are added to the deepest map of the path that is there. `comment` ("": none) ends the
// changed line. The caller frees *out. WM_BAD_CONFIG where there is no such map.
wm_status wm_yaml_edit(const char *text, size_t length, const char *path, const char *value, const char *comment,
                       char **out, size_t *out_length, wm_error *err);

#ifdef __cplusplus
}
#endif

#endif
