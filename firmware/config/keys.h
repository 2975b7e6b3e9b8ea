// SPDX-License-Identifier: Apache-2.0
// The keys that a configuration may have, and the reading of a section by its table.
#ifndef WAYMARK_CONFIG_KEYS_H
#define WAYMARK_CONFIG_KEYS_H

#include "config/config.h"
#include "waymark/yaml.h"

// A key of a configuration that no table has.
typedef struct config_key {
  const char *key;      // dotted, from the top
  const char *type;     // "text", "list", "map", "file"
  const char *initial;  // for the reference
  const char *about;
} config_key;

// Ends with a NULL key.
extern const config_key kConfigKeys[];
extern const config_key kConfigSourceKeys[];
extern const config_key kConfigCanDeviceKeys[];
extern const config_key kConfigLcmDeviceKeys[];
extern const config_key kConfigGpsdDeviceKeys[];
extern const config_key kConfigIioDeviceKeys[];
extern const config_key kConfigCameraDeviceKeys[];

// A table and where it stands in the file: `prefix` is "" for the runtime's, else "motion.", "ESTIMATOR."
// or "vision.DETECTOR.".
typedef struct config_section {
  const char *name, *about;
  char prefix[WM_NAME_MAX + 10];
  const wm_param_table *table;
} config_section;

#define CONFIG_SECTIONS_MAX 32  // tables: runtime, shared ones, estimators, detectors
// All tables: the runtime's, the shared ones, each registered estimator's and detector's. Returns how many there are.
size_t config_sections(config_section out[CONFIG_SECTIONS_MAX]);

// "FILE:LINE: KEY: unknown key" with the nearest known key. WM_BAD_CONFIG.
wm_status config_unknown(const wm_yaml_node *value, int line, wm_error *err);

#define CONFIG_PARAMS_MAX 128  // parameters of a table

// A table's struct while it is filled.
typedef struct config_filling {
  const char *prefix;  // of the section, as in config_section
  const wm_param_table *table;
  void *out;                    // has its defaults
  int line[CONFIG_PARAMS_MAX];  // on which each parameter is given; 0: nowhere
  char is_old[CONFIG_PARAMS_MAX];
} config_filling;

// The shared sections. They stay open while the estimator's section is read, which may hold former keys of theirs.
typedef struct config_shared {
  config_filling of[WM_CONFIG_SHARED];
  const wm_estimator *reader;  // a warning is due for parameters that it does not read; NULL: values are not kept
} config_shared;

// Reads `map`, which stands at `prefix` of the table. Each key must be one of the table, a former one (a warning), or
// one of kConfigKeys, which are left alone. `shared` may be NULL.
wm_status config_fill(const wm_yaml_node *map, config_filling *self, const char *prefix, config_shared *shared,
                      char warnings[WM_CONFIG_WARNINGS_MAX], wm_error *err);

#endif
