// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <string.h>

#include "can_stream.h"

static wm_status read_file(const wm_yaml_node *item, const char *key, const char *otherwise, const char *dir,
                           char out[WM_PATH_MAX], wm_error *err) {
  char name[WM_PATH_MAX];
  wm_yaml_node node = wm_yaml_get(item, key);
  snprintf(name, sizeof name, "%s", otherwise);
  wm_status status = wm_yaml_there(&node) ? wm_yaml_string(&node, name, sizeof name, err) : WM_OK;
  if (status == WM_OK && snprintf(out, WM_PATH_MAX, "%s/%s", dir, name) >= WM_PATH_MAX)
    return wm_yaml_fail(&node, err, "the path is longer than %d bytes", WM_PATH_MAX - 1);
  return status;
}

wm_status can_buses_read(const wm_yaml_node *list, const char *dir, can_buses *out, wm_error *err) {
  memset(out, 0, sizeof *out);
  if (!wm_yaml_there(list)) return WM_OK;
  if (!wm_yaml_is_list(list)) return wm_yaml_fail(list, err, "a list of {interface: can0, dbc: FILE, ...} is needed");
  if (wm_yaml_count(list) > WM_CAN_DEVICES_MAX)
    return wm_yaml_fail(list, err, "more than %d buses", WM_CAN_DEVICES_MAX);
  for (size_t i = 0; i < wm_yaml_count(list); i++) {
    can_bus *bus = &out->bus[i];
    wm_yaml_node item = wm_yaml_item(list, i), interface = wm_yaml_get(&item, "interface");
    if (!wm_yaml_there(&interface))
      return wm_yaml_fail(&item, err, "interface: is missing; can.log names it in each line");
    wm_status status = wm_yaml_string(&interface, bus->interface, sizeof bus->interface, err);
    for (size_t k = 0; status == WM_OK && k < i; k++)
      if (strcmp(out->bus[k].interface, bus->interface) == 0)
        return wm_yaml_fail(&interface, err, "'%s' appears twice", bus->interface);
    if (status == WM_OK) status = read_file(&item, "dbc", "vehicle.dbc", dir, bus->dbc, err);
    if (status == WM_OK) status = read_file(&item, "signals", "can-signals.yaml", dir, bus->signals, err);
    if (status != WM_OK) return status;
    out->count = i + 1;
  }
  return WM_OK;
}
