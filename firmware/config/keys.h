// SPDX-License-Identifier: Apache-2.0
// The keys that a configuration may have, and the reading of a section by its table.
#ifndef WAYMARK_CONFIG_KEYS_H
#define WAYMARK_CONFIG_KEYS_H

#include "config/config.h"
#include "waymark/yaml.h"

typedef enum config_kind {
  CONFIG_TEXT,
  CONFIG_FILE,
  CONFIG_PATH,
  CONFIG_ESTIMATOR,  // name of one
  CONFIG_SOURCE,     // name of one, or NAME:SENSOR
  CONFIG_BOOL,
  CONFIG_NUMBER,
  CONFIG_WHOLE,
  CONFIG_CHOICE,
  CONFIG_LIST,
  CONFIG_MAP
} config_kind;

// A key of a configuration that no table of parameters has.
typedef struct config_key {
  const char *key;  // dotted, from the top or from the entry of a list
  config_kind kind;
  const char *initial;  // for the reference; CONFIG_NEEDED
  const char *about;
  const char *const *names;     // CHOICE: its values; MAP without `of`: its keys, of numbers. NULL-terminated
  double min, max;              // NUMBER, WHOLE: inclusive limits; LIST: max entries, 0: any
  const struct config_key *of;  // LIST: keys of each entry; MAP: its own; NULL: any
} config_key;
#define CONFIG_NEEDED "needed"
#define CONFIG_KEY_MAX 96  // bytes of a dotted key

// Ends with a NULL key.
extern const config_key kConfigKeys[];
extern const config_key kConfigSourceKeys[];
extern const config_key kConfigClassKeys[];
extern const config_key kConfigDevicesKeys[];
extern const config_key kConfigCanDeviceKeys[];
extern const config_key kConfigLcmDeviceKeys[];
extern const config_key kConfigGpsdDeviceKeys[];
extern const config_key kConfigIioDeviceKeys[];
extern const config_key kConfigDvlDeviceKeys[];
extern const config_key kConfigCameraDeviceKeys[];

// Reading by these tables. `map` has no other keys.
wm_status config_check_keys(const wm_yaml_node *map, const config_key *keys, wm_error *err);
// A NUMBER, WHOLE or CHOICE of `map`, within its limits; *out is unchanged where it isn't given.
wm_status config_number(const wm_yaml_node *map, const config_key *keys, const char *key, double *out, wm_error *err);
wm_status config_whole(const wm_yaml_node *map, const config_key *keys, const char *key, int32_t *out, wm_error *err);
wm_status config_choice(const wm_yaml_node *map, const config_key *keys, const char *key, int32_t *out, wm_error *err);

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
