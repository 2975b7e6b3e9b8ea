// SPDX-License-Identifier: Apache-2.0
// Parameters with their descriptions: the config reader fills the struct from YAML by this table, checks the range,
// and the documentation is printed from it. A new parameter is one line here and nowhere else.
#ifndef WAYMARK_PARAMS_H
#define WAYMARK_PARAMS_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum wm_param_type {
  WM_PARAM_F64,   // field is double
  WM_PARAM_I32,   // field is int32_t
  WM_PARAM_BOOL,  // field is int32_t, 0 or 1
  WM_PARAM_ENUM   // field is int32_t, index into names
} wm_param_type;

typedef struct wm_param {
  const char *key;  // YAML key, dots for nesting: "states.sensor_yaw_sigma_rad"
  wm_param_type type;
  uint32_t offset;           // offsetof(struct, field)
  double initial, min, max;  // default and inclusive limits
  const char *const *names;  // ENUM: NULL-terminated
  const char *about;         // meaning, unit, reason of the default; one sentence or two
} wm_param;

// A key that the table had before. The config reader takes a renamed key for the new one, with a warning; of a removed
// key it warns with the sentence and goes on. Old and new key together are an error. The first row that fits holds.
// A row with `*` at the end of both keys is a rule for all keys that begin so; it fits where the new key exists.
typedef struct wm_param_old {
  const char *key;      // the old key; NULL ends the list
  const char *new_key;  // a key of the table, or "/SECTION.KEY" of a shared one; unit and meaning stay; NULL: removed
  const char *about;    // removed: why, and what to use; renamed: NULL, or what else changed
} wm_param_old;

typedef struct wm_param_table {
  const wm_param *params;
  size_t count;
  size_t bytes;             // sizeof the struct
  const wm_param_old *old;  // ends with a NULL key; NULL: none
} wm_param_table;

// Writes every parameter's default. `out` has table->bytes bytes.
void wm_params_defaults(const wm_param_table *table, void *out);

#ifdef __cplusplus
}
#endif

#endif
