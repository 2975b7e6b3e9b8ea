// SPDX-License-Identifier: Apache-2.0
// A raster map's files into a recording.
#ifndef WAYMARK_LIVE_COPY_MAP_H
#define WAYMARK_LIVE_COPY_MAP_H

#include "waymark/status.h"

// `map_yaml` and the pictures that it names into OUT_DIR/map, which is made; there they lie side by side, and the YAML
// names them so. A picture that isn't there is left out: the reader of the map reports it. WM_IO, WM_BAD_CONFIG.
// Allocates.
wm_status copy_map(const char *map_yaml, const char *out_dir, wm_error *err);

#endif
