// SPDX-License-Identifier: Apache-2.0
// What the files of a recording and its configuration state, as far as a suspect changes it.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "cli/check/suspects.h"
#include "waymark/yaml.h"

// Within this factor of its default a number is a choice; beyond, its unit may be another one.
#define UNUSUAL_FACTOR 10.0

static void read_binding(const wm_yaml_node *item, binding_seen *out) {
  wm_yaml_node node = wm_yaml_get(item, "quantity");
  (void)wm_yaml_string(&node, out->quantity_name, sizeof out->quantity_name, NULL);
  out->quantity = wm_quantity_find(out->quantity_name);
  node = wm_yaml_get(item, "message");
  (void)wm_yaml_string(&node, out->message, sizeof out->message, NULL);
  node = wm_yaml_get(item, "signal");
  if (wm_yaml_is_scalar(&node)) (void)wm_yaml_string(&node, out->signal, sizeof out->signal, NULL);
  node = wm_yaml_get(item, "scale");
  if (!wm_yaml_there(&node) || wm_yaml_f64(&node, -1e9, 1e9, &out->scale, NULL) != WM_OK) out->scale = 1;
}

static void read_bindings(suspect_files *self, const char *path) {
  wm_yaml *doc;
  if (wm_yaml_load(path, &doc, NULL) != WM_OK) return;
  const wm_yaml_node root = wm_yaml_root(doc);
  for (size_t i = 0; i < wm_yaml_count(&root) && i < BINDINGS_SEEN_MAX; i++) {
    const wm_yaml_node item = wm_yaml_item(&root, i);
    read_binding(&item, &self->bindings[self->binding_count++]);
  }
  wm_yaml_free(doc);
}

static void read_origin(suspect_files *self, const char *path) {
  wm_yaml *doc;
  size_t count;
  for (int k = 0; k < 3; k++) self->origin[k] = (double)NAN;
  if (wm_yaml_load(path, &doc, NULL) != WM_OK) return;
  const wm_yaml_node root = wm_yaml_root(doc), gnss = wm_yaml_get(&root, "gnss"), origin = wm_yaml_get(&gnss, "origin");
  if (wm_yaml_there(&origin)) (void)wm_yaml_f64_list(&origin, 3, 3, self->origin, &count, NULL);
  wm_yaml_free(doc);
}

// Pictures in sub-folders or elsewhere are left out.
static void add_picture(suspect_files *self, const wm_yaml_node *node) {
  char name[WM_NAME_MAX];
  if (!wm_yaml_there(node) || wm_yaml_string(node, name, sizeof name, NULL) != WM_OK || strchr(name, '/')) return;
  char path[sizeof self->plan_pictures[0]];
  (void)snprintf(path, sizeof path, "map/%s", name);
  for (size_t i = 0; i < self->plan_picture_count; i++)
    if (strcmp(self->plan_pictures[i], path) == 0) return;
  memcpy(self->plan_pictures[self->plan_picture_count++], path, sizeof path);
}

static void read_plan(suspect_files *self, const char *path) {
  wm_yaml *doc;
  if (wm_yaml_load(path, &doc, NULL) != WM_OK) return;
  const wm_yaml_node root = wm_yaml_root(doc), layers = wm_yaml_get(&root, "layers");
  const wm_yaml_node pictures[3] = {wm_yaml_get(&root, "image"), wm_yaml_get(&layers, "edges"),
                                    wm_yaml_get(&layers, "drivable")};
  for (int i = 0; i < 3; i++) add_picture(self, &pictures[i]);
  wm_yaml_free(doc);
}

static void add_settings(suspect_files *self, const char *owner, const wm_param_table *table, const void *params) {
  for (size_t i = 0; i < table->count && self->setting_count < SETTINGS_SEEN_MAX; i++) {
    const wm_param *p = &table->params[i];
    double value;
    if (p->type != WM_PARAM_F64) continue;
    memcpy(&value, (const char *)params + p->offset, sizeof value);
    const double factor = value / p->initial;
    if (!isfinite(factor) || factor == 0 || (fabs(factor) < UNUSUAL_FACTOR && fabs(factor) > 1 / UNUSUAL_FACTOR))
      continue;
    setting_seen *one = &self->settings[self->setting_count++];
    (void)snprintf(one->path, sizeof one->path, "%s.%s", owner, p->key);
    one->value = value;
    one->usual = p->initial;
  }
}

static void read_tags(suspect_files *self, const wm_vision_config *vision) {
  const wm_param_table *table = &vision->detector->params;
  for (size_t i = 0; i < table->count; i++) {
    const wm_param *p = &table->params[i];
    const char *at = (const char *)vision->params + p->offset;
    int32_t family = 0;
    if (strcmp(p->key, "size_m") == 0) memcpy(&self->tag_size_m, at, sizeof self->tag_size_m);
    if (strcmp(p->key, "family") == 0) memcpy(&family, at, sizeof family);
    if (family > 0) self->tag_family = family;
  }
}

static void read_settings(suspect_files *self, const wm_config *config) {
  add_settings(self, config->estimator->name, &config->estimator->params, config->estimator_params);
  add_settings(self, "motion", &wm_motion_params_table, config->motion);
  add_settings(self, "sightings", &wm_sighting_params_table, config->sightings);
  for (size_t i = 0; i < config->vision_count; i++) {
    const wm_vision_config *vision = &config->vision[i];
    char owner[48];
    (void)snprintf(owner, sizeof owner, "vision.%s", vision->detector->name);
    add_settings(self, owner, &vision->detector->params, vision->params);
    if (strcmp(vision->detector->name, "apriltag") == 0) read_tags(self, vision);
  }
}

void suspect_files_read(suspect_files *self, const wm_config *config, const char *dir) {
  char path[WM_PATH_MAX];
  const wm_recording_overrides *named = &config->overrides;
  memset(self, 0, sizeof *self);
  self->config = config;
  (void)snprintf(path, sizeof path, "%s%s", named->can_signals[0] ? named->can_signals : dir,
                 named->can_signals[0] ? "" : "/can-signals.yaml");
  read_bindings(self, path);
  (void)snprintf(path, sizeof path, "%s%s", named->calibration[0] ? named->calibration : dir,
                 named->calibration[0] ? "" : "/calibration.yaml");
  read_origin(self, path);
  (void)snprintf(path, sizeof path, "%s/map/map.yaml", dir);
  if (!named->map[0]) read_plan(self, path);
  read_settings(self, config);
}
