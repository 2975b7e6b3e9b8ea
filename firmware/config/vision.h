// SPDX-License-Identifier: Apache-2.0
#ifndef WM_CONFIG_VISION_H
#define WM_CONFIG_VISION_H

#include "waymark/config.h"
#include "waymark/yaml.h"

// Reads `vision:`. Allocates the detectors' parameters, which wm_config_free frees.
wm_status config_read_vision(const wm_yaml_node *root, wm_config *out, wm_error *err);

#endif
