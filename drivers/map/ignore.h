// SPDX-License-Identifier: Apache-2.0
// `ignore` of map.yaml: polygons in the map's axes, within which edges don't count.
#ifndef WM_MAP_IGNORE_H
#define WM_MAP_IGNORE_H

#include "waymark/map.h"
#include "waymark/yaml.h"

// Takes the edges within the areas out of `edges` (which may have no pixels). `place`: their size and where they lie.
// WM_BAD_CONFIG where an area is no polygon. Cost: rows times corners of an area.
wm_status map_ignore(const wm_yaml_node *root, const wm_raster *place, wm_grey *edges, wm_error *err);

#endif
