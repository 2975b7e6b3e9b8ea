// SPDX-License-Identifier: Apache-2.0
#include "config/config.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "config/devices.h"
#include "config/keys.h"
#include "config/sources.h"
#include "config/vision.h"
#include "waymark/cascade_file.h"
#include "waymark/text.h"
#include "waymark/yaml.h"

#define CONFIG_BYTES_MAX (1u << 20)  // usual files are some kB

static wm_status check_format(const wm_yaml_node *root, wm_error *err) {
  char format[64];
  wm_yaml_node node = wm_yaml_get(root, "format");
  if (!wm_yaml_there(&node)) return wm_yaml_fail(root, err, "format: is missing; 'format: waymark-config/1' is needed");
  wm_status status = wm_yaml_string(&node, format, sizeof format, err);
  if (status == WM_OK && strcmp(format, "waymark-config/1") != 0)
    return wm_yaml_fail(&node, err, "'%s' is not a format that this program reads; it reads waymark-config/1", format);
  return status;
}

static wm_status read_estimator(const wm_yaml_node *root, int may_be_undecided, wm_config *out, wm_error *err) {
  const char *names[CONFIG_SECTIONS_MAX + 1] = {NULL};
  size_t count;
  const wm_estimator *const *all = wm_estimators(&count);
  for (size_t i = 0; i < count && i < CONFIG_SECTIONS_MAX; i++) names[i] = all[i]->name;
  wm_yaml_node node = wm_yaml_get(root, "estimator");
  int32_t chosen;
  if (!wm_yaml_there(&node) && may_be_undecided) return WM_OK;
  wm_status status = wm_yaml_choice(&node, names, &chosen, err);
  if (status == WM_OK) out->estimator = all[chosen];
  return status;
}

const wm_shared_section wm_config_shared[WM_CONFIG_SHARED] = {
    [WM_CONFIG_MOTION] = {"motion", "motion.", "For every estimator: the motion sensors, and their calibration states.",
                          &wm_motion_params_table, offsetof(wm_config, motion)},
    [WM_CONFIG_SIGHTINGS] = {"sightings", "sightings.",
                             "For every estimator that takes sightings of landmarks: their noise, the sensors' "
                             "calibration states, time-correlated errors and gates.",
                             &wm_sighting_params_table, offsetof(wm_config, sightings)},
    [WM_CONFIG_POSITIONS] = {"positions", "positions.",
                             "For every estimator that takes positions (GNSS) and headings (compass, two antennas): "
                             "their noise, the receiver's states, time-correlated errors.",
                             &wm_position_params_table, offsetof(wm_config, positions)},
    [WM_CONFIG_MARKERS] = {"markers", "markers.", "For every estimator that takes coded markers (tags): their noise.",
                           &wm_marker_params_table, offsetof(wm_config, markers)},
    [WM_CONFIG_LOCALIZER] = {"localizer", "localizer.",
                             "For every estimator that takes poses of another localizer: their frame and noise.",
                             &wm_localizer_params_table, offsetof(wm_config, localizer)},
};

void *wm_config_params(const wm_config *config, int i) {
  void *out;
  memcpy(&out, (const char *)config + wm_config_shared[i].offset, sizeof out);
  return out;
}

static void set_params(wm_config *config, int i, void *params) {
  memcpy((char *)config + wm_config_shared[i].offset, &params, sizeof params);
}

void wm_config_give_params(const wm_config *config, wm_setup *setup) {
  setup->motion = config->motion;
  setup->sightings = config->sightings;
  setup->positions = config->positions;
  setup->markers = config->markers;
  setup->localizer = config->localizer;
}

// Opens the shared sections with these structs of theirs.
static void open_shared(config_shared *self, void *const params[WM_CONFIG_SHARED], const wm_estimator *reader) {
  memset(self, 0, sizeof *self);
  self->reader = reader;
  for (int i = 0; i < WM_CONFIG_SHARED; i++)
    self->of[i] =
        (config_filling){.prefix = wm_config_shared[i].prefix, .table = wm_config_shared[i].table, .out = params[i]};
}

static wm_status fill_estimator(const wm_yaml_node *section, const wm_estimator *estimator, void *out,
                                config_shared *shared, char *warnings, wm_error *err) {
  char prefix[WM_NAME_MAX + 2];
  snprintf(prefix, sizeof prefix, "%s.", estimator->name);
  config_filling own = {.prefix = prefix, .table = &estimator->params, .out = out};
  return config_fill(section, &own, "", shared, warnings, err);
}

// Sections of other estimators are checked, too: they may be chosen later.
static wm_status check_other_estimator(const wm_yaml_node *section, const wm_estimator *estimator, wm_config *out,
                                       wm_error *err) {
  void *scratch[WM_CONFIG_SHARED + 1] = {NULL};  // the last: the estimator's own
  wm_status status = WM_OK;
  for (int i = 0; i <= WM_CONFIG_SHARED; i++) {
    const wm_param_table *table = i < WM_CONFIG_SHARED ? wm_config_shared[i].table : &estimator->params;
    scratch[i] = calloc(1, table->bytes + 1);
    if (!scratch[i]) status = wm_fail(err, WM_IO, "%s: no memory to read it", wm_yaml_file(section));
  }
  config_shared shared;
  open_shared(&shared, scratch, NULL);
  if (status == WM_OK)
    status = fill_estimator(section, estimator, scratch[WM_CONFIG_SHARED], &shared, out->warnings, err);
  for (int i = 0; i <= WM_CONFIG_SHARED; i++) free(scratch[i]);
  return status;
}

// Limits between parameters, beyond those of each.
static wm_status check_motion(const wm_yaml_node *section, const wm_config *config, wm_error *err) {
  const char *key, *clash = wm_motion_params_clash(config->motion, &key);
  if (!clash) return WM_OK;
  wm_yaml_node node = wm_yaml_get(section, key);
  if (!wm_yaml_there(&node)) node.id = section->id;  // its key is dotted: the section's line is named
  return wm_yaml_fail(&node, err, "%s", clash);
}

static int shared_section(const char *key) {  // -1: none of them
  for (int i = 0; i < WM_CONFIG_SHARED; i++)
    if (strcmp(key, wm_config_shared[i].name) == 0) return i;
  return -1;
}

static wm_status read_section(const wm_yaml_node *value, const char *key, config_shared *shared, wm_config *out,
                              wm_error *err) {
  const wm_estimator *estimator = wm_estimator_find(key);
  if (estimator && estimator == out->estimator)
    return fill_estimator(value, estimator, out->estimator_params, shared, out->warnings, err);
  if (estimator) return check_other_estimator(value, estimator, out, err);
  const int of = shared_section(key);
  if (of < 0) return WM_OK;
  wm_status status = config_fill(value, &shared->of[of], "", shared, out->warnings, err);
  return status == WM_OK && of == WM_CONFIG_MOTION ? check_motion(value, out, err) : status;
}

static wm_status read_sections(const wm_yaml_node *root, wm_config *out, wm_error *err) {
  config_shared shared;
  void *params[WM_CONFIG_SHARED];
  for (int i = 0; i < WM_CONFIG_SHARED; i++) params[i] = wm_config_params(out, i);
  open_shared(&shared, params, out->estimator);
  wm_status status = WM_OK;
  for (size_t i = 0; status == WM_OK && i < wm_yaml_count(root); i++) {
    const char *key;
    int line;
    wm_yaml_node value = wm_yaml_value(root, i, &key, &line);
    status = read_section(&value, key, &shared, out, err);
  }
  return status;
}

// All keys at the top: sections of estimators and those that they share are read by read_sections.
static wm_status check_top(const wm_yaml_node *root, wm_config *out, wm_error *err) {
  static const char *const kGroups[] = {"merge",    "publish", "integrity", "commands",
                                        "realtime", "start",   "black_box", NULL};
  for (size_t i = 0; i < wm_yaml_count(root); i++) {
    const char *key;
    int line, known = 0;
    wm_yaml_node value = wm_yaml_value(root, i, &key, &line);
    for (size_t k = 0; kConfigKeys[k].key; k++) known |= strcmp(kConfigKeys[k].key, key) == 0;
    if (known || shared_section(key) >= 0 || wm_estimator_find(key)) continue;
    for (size_t g = 0; kGroups[g]; g++) {
      if (strcmp(kGroups[g], key) != 0) continue;
      char prefix[16];
      snprintf(prefix, sizeof prefix, "%s.", key);
      config_filling runtime = {.prefix = "", .table = &wm_runtime_params_table, .out = &out->runtime};
      wm_status status = config_fill(&value, &runtime, prefix, NULL, out->warnings, err);
      if (status != WM_OK) return status;
      known = 1;
    }
    if (!known) return config_unknown(&value, line, err);
  }
  return WM_OK;
}

// A file that the configuration names, relative to the configuration's folder.
static wm_status read_file_name(const wm_yaml_node *root, const char *key, const char *path, char out[WM_PATH_MAX],
                                int must_be_there, wm_error *err) {
  wm_yaml_node node = wm_yaml_get(root, key);
  if (!wm_yaml_there(&node)) return WM_OK;
  wm_status status = config_path(&node, path, out, err);
  if (status != WM_OK || !must_be_there || access(out, R_OK) == 0) return status;
  char name[WM_PATH_MAX] = "";
  (void)wm_yaml_string(&node, name, sizeof name, NULL);
  return wm_yaml_fail(&node, err, "'%s' cannot be read (looked for %s)", name, out);
}

static wm_status read_files(const wm_yaml_node *root, int must_be_there, wm_config *out, wm_error *err) {
  const struct {
    const char *key;
    char *path;
  } files[] = {{"calibration", out->overrides.calibration},
               {"landmarks", out->overrides.landmarks},
               {"dbc", out->overrides.dbc},
               {"can_signals", out->overrides.can_signals},
               {"map", out->overrides.map}};
  wm_status status = WM_OK;
  for (size_t i = 0; status == WM_OK && i < sizeof files / sizeof files[0]; i++)
    status = read_file_name(root, files[i].key, out->path, files[i].path, must_be_there, err);
  return status;
}

// The floor's files where the configuration names none itself.
static wm_status take_floor(const wm_yaml_node *site, const char *key, const char *of_floor, char file[WM_PATH_MAX],
                            wm_error *err) {
  if (of_floor[0] && file[0])
    return wm_yaml_fail(site, err, "the floor has %s of its own (%s); leave the key '%s' out", key, of_floor, key);
  if (of_floor[0]) (void)snprintf(file, WM_PATH_MAX, "%s", of_floor);
  return WM_OK;
}

static wm_status read_site(const wm_yaml_node *root, wm_config *out, wm_error *err) {
  char path[WM_PATH_MAX];
  wm_error why = {0};
  wm_yaml_node site = wm_yaml_get(root, "site");
  if (!wm_yaml_there(&site)) return WM_OK;
  wm_status status = config_path(&site, out->path, path, err);
  if (status == WM_OK && wm_floor_choose(path, &out->floor, &why) != WM_OK)
    return wm_yaml_fail(&site, err, "%s", why.text);
  const wm_floor *floor = &out->floor.floor;
  if (status == WM_OK) status = take_floor(&site, "landmarks", floor->landmarks, out->overrides.landmarks, err);
  if (status == WM_OK) status = take_floor(&site, "map", floor->map, out->overrides.map, err);
  out->overrides.has_origin = isfinite(floor->origin[0]);
  memcpy(out->overrides.origin, floor->origin, sizeof out->overrides.origin);
  return status;
}

static wm_status read_start(const wm_yaml_node *root, wm_config *out, wm_error *err) {
  wm_start_init(&out->initial_pose);
  wm_yaml_node pose = wm_yaml_get(root, "initial_pose");
  if (!wm_yaml_there(&pose)) return WM_OK;
  out->has_initial_pose = 1;
  wm_status status = wm_yaml_check_keys(&pose, wm_start_keys, WM_YAML_STRICT, NULL, err);
  return status == WM_OK ? wm_start_read(&pose, &out->initial_pose, err) : status;
}

// LCM's subscriptions take regular expressions: a name with other characters would match other channels, or none.
static wm_status read_prefix(const wm_yaml_node *node, wm_config *out, wm_error *err) {
  static const char kAllowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-/";
  wm_status status = wm_yaml_string(node, out->channel_prefix, sizeof out->channel_prefix, err);
  if (status != WM_OK || out->channel_prefix[strspn(out->channel_prefix, kAllowed)] == '\0') return status;
  return wm_yaml_fail(node, err, "'%s': letters, digits, '_', '-' and '/' are possible", out->channel_prefix);
}

static wm_status read_texts(const wm_yaml_node *root, wm_config *out, wm_error *err) {
  snprintf(out->channel_prefix, sizeof out->channel_prefix, "WAYMARK_");
  wm_yaml_node url = wm_yaml_get(root, "publish.lcm_url"), prefix = wm_yaml_get(root, "publish.channel_prefix");
  wm_status status = WM_OK;
  wm_yaml_node saved = wm_yaml_get(root, "start.saved_pose");
  if (wm_yaml_there(&saved)) status = config_path(&saved, out->path, out->saved_pose, err);
  wm_yaml_node map = wm_yaml_get(root, "start.saved_map");
  if (status == WM_OK && wm_yaml_there(&map)) status = config_path(&map, out->path, out->saved_map, err);
  wm_yaml_node pictures = wm_yaml_get(root, "publish.picture_socket");
  if (status == WM_OK && wm_yaml_there(&pictures)) status = config_path(&pictures, out->path, out->picture_socket, err);
  wm_yaml_node box = wm_yaml_get(root, "black_box.folder");
  if (status == WM_OK && wm_yaml_there(&box)) status = config_path(&box, out->path, out->black_box, err);
  wm_yaml_node commands = wm_yaml_get(root, "commands.socket");
  if (status == WM_OK && wm_yaml_there(&commands)) status = config_path(&commands, out->path, out->commands, err);
  if (status == WM_OK && wm_yaml_there(&url)) status = wm_yaml_string(&url, out->lcm_url, sizeof out->lcm_url, err);
  if (status == WM_OK && wm_yaml_there(&prefix)) status = read_prefix(&prefix, out, err);
  return status;
}

static wm_status allocate(wm_config *out, wm_error *err) {
  static const wm_param_table kNone;  // undecided
  const wm_param_table *table = out->estimator ? &out->estimator->params : &kNone;
  out->estimator_params = calloc(1, table->bytes + 1);
  if (!out->estimator_params) return wm_fail(err, WM_IO, "%s: no memory to read it", out->path);
  wm_params_defaults(table, out->estimator_params);
  for (int i = 0; i < WM_CONFIG_SHARED; i++) {
    void *const params = calloc(1, wm_config_shared[i].table->bytes + 1);
    if (!params) return wm_fail(err, WM_IO, "%s: no memory to read it", out->path);
    wm_params_defaults(wm_config_shared[i].table, params);
    set_params(out, i, params);
  }
  return WM_OK;
}

static wm_status read_all(const wm_yaml_node *root, int files_must_be_there, int may_be_undecided, wm_config *out,
                          wm_error *err) {
  if (!wm_yaml_is_map(root))
    return wm_yaml_fail(root, err, "a map that begins with 'format: waymark-config/1' is needed");
  wm_params_defaults(&wm_runtime_params_table, &out->runtime);
  wm_status status = check_format(root, err);
  if (status == WM_OK) status = check_top(root, out, err);
  if (status == WM_OK) status = read_estimator(root, may_be_undecided, out, err);
  if (status == WM_OK) status = allocate(out, err);
  if (status == WM_OK) status = read_sections(root, out, err);
  if (status == WM_OK) status = config_read_sources(root, out, err);
  if (status == WM_OK) status = config_read_vision(root, files_must_be_there, out, err);
  if (status == WM_OK) status = read_files(root, files_must_be_there, out, err);
  if (status == WM_OK && files_must_be_there) status = read_site(root, out, err);
  if (status == WM_OK) status = config_read_devices(root, out, err);
  if (status == WM_OK) status = read_texts(root, out, err);
  return status == WM_OK ? read_start(root, out, err) : status;
}

static wm_status parse(const char *text, size_t length, const char *path, int files_must_be_there, int may_be_undecided,
                       wm_config *out, wm_error *err) {
  memset(out, 0, sizeof *out);
  snprintf(out->path, sizeof out->path, "%s", path);
  wm_yaml *doc;
  wm_status status = wm_yaml_parse(text, length, path, &doc, err);
  if (status != WM_OK) return status;
  wm_yaml_node root = wm_yaml_root(doc);
  status = read_all(&root, files_must_be_there, may_be_undecided, out, err);
  wm_yaml_free(doc);
  char *kept = malloc(length + 1);
  if (status != WM_OK || !kept) {
    free(kept);
    wm_config_free(out);
    return status != WM_OK ? status : wm_fail(err, WM_IO, "%s: no memory to keep it", path);
  }
  memcpy(kept, text, length);
  kept[length] = '\0';
  out->text = kept;
  out->text_length = out->stated_length = length;
  return WM_OK;
}

wm_status wm_config_parse(const char *text, size_t length, const char *path, wm_config *out, wm_error *err) {
  return parse(text, length, path, 1, 0, out, err);
}

wm_status wm_config_parse_undecided(const char *text, size_t length, const char *path, wm_config *out, wm_error *err) {
  return parse(text, length, path, 1, 1, out, err);
}

wm_status wm_config_parse_logged(const char *text, size_t length, const char *path, wm_config *out, wm_error *err) {
  const wm_status status = parse(text, length, path, 0, 0, out, err);
  if (status == WM_OK || !err) return status;
  const wm_error inside = *err;
  return wm_fail(err, status, "the event log's copy of %s", inside.text);
}

// Configurations of data sets lay beside those of robots up to version 0.1. If there is no file at `path`, but one of
// this name in the folder datasets/ beside it, its path is written into `moved`, and true is returned.
static int has_moved(const char *path, char moved[WM_PATH_MAX]) {
  const char *slash = strrchr(path, '/');
  const size_t folder = slash ? (size_t)(slash - path) + 1 : 0;
  const int length = snprintf(moved, WM_PATH_MAX, "%.*sdatasets/%s", (int)folder, path, path + folder);
  return length > 0 && length < WM_PATH_MAX && access(path, F_OK) != 0 && access(moved, R_OK) == 0;
}

static wm_status load(const char *path, int may_be_undecided, wm_config *out, wm_error *err) {
  char *text, moved[WM_PATH_MAX];
  size_t length;
  memset(out, 0, sizeof *out);
  const int from_elsewhere = has_moved(path, moved);
  const char *file = from_elsewhere ? moved : path;
  wm_status status = wm_text_read_file(file, CONFIG_BYTES_MAX, &text, &length, err);
  if (status != WM_OK) return status;
  status = parse(text, length, file, 1, may_be_undecided, out, err);
  free(text);
  const size_t used = strlen(out->warnings);
  if (from_elsewhere)
    (void)snprintf(out->warnings + used, sizeof out->warnings - used, "%s: has moved to %s, write that\n", path, moved);
  return status;
}

wm_status wm_config_load(const char *path, wm_config *out, wm_error *err) { return load(path, 0, out, err); }

wm_status wm_config_load_undecided(const char *path, wm_config *out, wm_error *err) { return load(path, 1, out, err); }

// What `next` has read with its estimator; all else stays. Takes over, and leaves `next` to be freed.
static void take_estimator(wm_config *self, wm_config *next) {
  void *const params = self->estimator_params;
  char *const text = self->text;
  self->estimator = next->estimator;
  self->estimator_params = next->estimator_params;
  self->text = next->text;
  self->text_length = next->text_length;
  memcpy(self->warnings, next->warnings, sizeof self->warnings);
  next->estimator_params = params;
  for (int i = 0; i < WM_CONFIG_SHARED; i++) {
    void *const own = wm_config_params(self, i);
    set_params(self, i, wm_config_params(next, i));
    set_params(next, i, own);
  }
  next->text = text;
}

wm_status wm_config_decide(wm_config *config, const wm_estimator *estimator, const char *because, wm_error *err) {
  const size_t capacity = config->stated_length + WM_NAME_MAX + 16;
  char *text = malloc(capacity);
  wm_config *next = malloc(sizeof *next);
  wm_status status = WM_OK;
  if (!text || !next) {
    status = wm_fail(err, WM_IO, "%s: no memory to read it", config->path);
  } else {
    memcpy(text, config->text, config->stated_length);
    const int added =
        snprintf(text + config->stated_length, capacity - config->stated_length, "\nestimator: %s\n", estimator->name);
    status = parse(text, config->stated_length + (size_t)added, config->path, 0, 0, next, NULL);
    if (status != WM_OK)  // the file's end takes no further key: it is in braces, or ends with `...`
      status = wm_fail(err, WM_BAD_CONFIG,
                       "%s: estimator: is left out, and can't be added at the file's end; write "
                       "`estimator: %s`",
                       config->path, estimator->name);
  }
  if (status == WM_OK) {
    take_estimator(config, next);
    (void)snprintf(config->estimator_because, sizeof config->estimator_because, "%s", because);
    wm_config_free(next);
  }
  free(text);
  free(next);
  return status;
}

void wm_config_free(wm_config *config) {
  free(config->text);
  free(config->estimator_params);
  free(config->floor.site);
  config->floor.site = NULL;
  for (int i = 0; i < WM_CONFIG_SHARED; i++) {
    free(wm_config_params(config, i));
    set_params(config, i, NULL);
  }
  for (size_t i = 0; i < config->vision_count; i++) {
    free(config->vision[i].params);
    for (size_t k = 0; k < config->vision[i].cascade_count; k++) wm_cascade_free(&config->vision[i].cascades[k]);
  }
  config->text = NULL;
  config->estimator_params = NULL;
  config->vision_count = 0;
}

void wm_config_each_warning(const wm_config *config, void (*say)(void *context, const char *line), void *context) {
  char line[WM_CONFIG_WARNINGS_MAX];
  for (const char *at = config->warnings; *at;) {
    size_t length = strcspn(at, "\n");
    memcpy(line, at, length);
    line[length] = '\0';
    say(context, line);
    at += length + (at[length] == '\n');
  }
}
