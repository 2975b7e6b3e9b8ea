// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_CONFIG_VISION_H
#define WAYMARK_CONFIG_VISION_H

#include "config/config.h"
#include "waymark/yaml.h"

// Reads `vision:`. Allocates the detectors' parameters and cascades, which wm_config_free frees. Reads their files
// where `files_must_be_there`.
wm_status config_read_vision(const wm_yaml_node *root, int files_must_be_there, wm_config *out, wm_error *err);

#endif
