// SPDX-License-Identifier: Apache-2.0
// `devices:` of a configuration.
#include "devices.h"

#include <stdio.h>
#include <string.h>

wm_status config_path(const wm_yaml_node *node, const char *config_path, char out[WM_PATH_MAX], wm_error *err) {
  char name[WM_PATH_MAX];
  wm_status status = wm_yaml_string(node, name, sizeof name, err);
  if (status != WM_OK) return status;
  const char *slash = strrchr(config_path, '/');
  int folder = name[0] == '/' || !slash ? 0 : (int)(slash - config_path) + 1;
  if (snprintf(out, WM_PATH_MAX, "%.*s%s", folder, config_path, name) >= WM_PATH_MAX)
    return wm_yaml_fail(node, err, "the path is longer than %d bytes", WM_PATH_MAX - 1);
  return WM_OK;
}

// The interface's own file, else the configuration's.
static wm_status file_of(const wm_yaml_node *item, const char *key, const char *otherwise, const wm_config *config,
                         char out[WM_PATH_MAX], wm_error *err) {
  wm_yaml_node node = wm_yaml_get(item, key);
  if (wm_yaml_there(&node)) return config_path(&node, config->path, out, err);
  if (!otherwise[0])
    return wm_yaml_fail(item, err, "%s: is missing; name one here or at the top of the configuration", key);
  snprintf(out, WM_PATH_MAX, "%s", otherwise);
  return WM_OK;
}

static wm_status read_can(const wm_yaml_node *item, wm_config *config, wm_error *err) {
  static const char *const kKeys[] = {"interface", "dbc", "can_signals", NULL};
  wm_can_device_config *out = &config->devices.can[config->devices.can_count];
  out->line = wm_yaml_line(item);
  if (!wm_yaml_is_map(item)) return wm_yaml_fail(item, err, "a map {interface: can0, ...} is needed");
  wm_status status = wm_yaml_check_keys(item, kKeys, WM_YAML_STRICT, NULL, err);
  if (status != WM_OK) return status;
  wm_yaml_node interface = wm_yaml_get(item, "interface");
  if (!wm_yaml_there(&interface)) return wm_yaml_fail(item, err, "interface: is missing; `ip link` lists them");
  status = wm_yaml_string(&interface, out->interface, sizeof out->interface, err);
  if (status != WM_OK) return status;
  for (size_t i = 0; i < config->devices.can_count; i++)
    if (strcmp(config->devices.can[i].interface, out->interface) == 0)
      return wm_yaml_fail(&interface, err, "'%s' stands there twice (first in line %d)", out->interface,
                          config->devices.can[i].line);
  status = file_of(item, "dbc", config->overrides.dbc, config, out->dbc, err);
  if (status == WM_OK)
    status = file_of(item, "can_signals", config->overrides.can_signals, config, out->can_signals, err);
  config->devices.can_count++;
  return status;
}

static wm_status read_list(const wm_yaml_node *list, size_t max, const char *what,
                           wm_status (*read)(const wm_yaml_node *, wm_config *, wm_error *), wm_config *config,
                           wm_error *err) {
  if (!wm_yaml_there(list)) return WM_OK;
  if (!wm_yaml_is_list(list)) return wm_yaml_fail(list, err, "a list of %s is needed", what);
  if (wm_yaml_count(list) > max) return wm_yaml_fail(list, err, "more than %zu", max);
  wm_status status = WM_OK;
  for (size_t i = 0; status == WM_OK && i < wm_yaml_count(list); i++) {
    wm_yaml_node item = wm_yaml_item(list, i);
    status = read(&item, config, err);
  }
  return status;
}

wm_status config_read_devices(const wm_yaml_node *root, wm_config *out, wm_error *err) {
  static const char *const kKeys[] = {"can", NULL};
  wm_yaml_node devices = wm_yaml_get(root, "devices"), can = wm_yaml_get(root, "devices.can");
  if (!wm_yaml_there(&devices)) return WM_OK;
  wm_status status = wm_yaml_check_keys(&devices, kKeys, WM_YAML_STRICT, NULL, err);
  if (status == WM_OK) status = read_list(&can, WM_CAN_DEVICES_MAX, "{interface: NAME, ...}", read_can, out, err);
  return status;
}
