// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_CONFIG_DEVICES_H
#define WAYMARK_CONFIG_DEVICES_H

#include "config/config.h"
#include "waymark/yaml.h"

// Reads `devices:`; out->overrides are already there (a CAN interface's DBC and binding are the configuration's where
// it names none of its own).
wm_status config_read_devices(const wm_yaml_node *root, wm_config *out, wm_error *err);

// `name` relative to the configuration's folder. WM_BAD_CONFIG where it is too long.
wm_status config_path(const wm_yaml_node *node, const char *config_path, char out[WM_PATH_MAX], wm_error *err);

#endif
