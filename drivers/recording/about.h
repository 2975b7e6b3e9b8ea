// SPDX-License-Identifier: Apache-2.0
// recording.yaml.
#ifndef WM_RECORDING_ABOUT_H
#define WM_RECORDING_ABOUT_H

#include "waymark/status.h"
#include "waymark/yaml.h"

// WM_BAD_CONFIG with file and line where it is not of this format.
wm_status recording_check_format(const wm_yaml_node *root, wm_error *err);

#endif
