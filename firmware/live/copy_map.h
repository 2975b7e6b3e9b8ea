// SPDX-License-Identifier: Apache-2.0
// Copies a raster map's files into a recording.
#ifndef WAYMARK_LIVE_COPY_MAP_H
#define WAYMARK_LIVE_COPY_MAP_H

#include "waymark/status.h"

// `map_yaml` and its pictures into OUT_DIR/map, which is created; there they lie side by side, with their names in the
// YAML. A missing picture is left out; the map's reader reports it. WM_IO, WM_BAD_CONFIG. Allocates.
wm_status copy_map(const char *map_yaml, const char *out_dir, wm_error *err);

#endif
