// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_CONFIG_SOURCES_H
#define WAYMARK_CONFIG_SOURCES_H

#include "config/config.h"
#include "waymark/yaml.h"

// Reads `sources:`; out->runtime is read already, and limits lateness to its horizon.
wm_status config_read_sources(const wm_yaml_node *root, wm_config *out, wm_error *err);

#endif
