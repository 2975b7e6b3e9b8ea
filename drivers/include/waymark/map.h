// SPDX-License-Identifier: Apache-2.0
// A raster map in ROS map_server's YAML with layers (recording-format: map/map.yaml): `image`, `resolution`, `origin`
// with its rotation, `mode` (trinary, scale, raw), `negate`, `occupied_thresh`, `free_thresh`, and `layers: {edges:
// FILE, drivable: FILE}`; `ignore: [[[x, y], ...], ...]`, polygons in the map's axes within which edges don't count.
// Pictures are PNG of any kind, or PGM (P2, P5, 8 or 16 bit). Start only; allocates.
#ifndef WAYMARK_MAP_H
#define WAYMARK_MAP_H

#include "waymark/recording.h"
#include "waymark/setup.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// Pixels along an edge, and in all: 20000 x 20000.
#define WM_MAP_EDGE_MAX 32768u
#define WM_MAP_PIXELS_MAX 400000000u

typedef struct wm_map wm_map;

// Reads map.yaml and its layers; their pixels become 255 (grey of 128 and more, not transparent) or 0. Without
// `layers.drivable` the free cells of `image` are drivable; `image` is read only for that. Without
// `layers.edges` the raster has no edges (estimators that need them refuse it). WM_BAD_CONFIG, WM_NOT_FOUND, WM_IO with
// file, line and key: missing keys, a resolution that isn't above 0, layers of different sizes, broken or too large
// pictures. `warn` (may be NULL) gets unknown keys. Cost: linear in the pixels.
wm_status wm_map_load(const char *path, wm_warn_fn warn, void *context, wm_map **out, wm_error *err);
void wm_map_free(wm_map *self);
// Valid as long as the map.
const wm_raster *wm_map_raster(const wm_map *self);

// The cells of `image` as map_server has them: an occupancy of (255 - grey)/255, or grey/255 with `negate`, below
// free_thresh is free, above occupied_thresh occupied. Mode raw: the grey level is per cent, above 100 unknown. A pixel
// that is transparent is unknown. Row 0 is the top; *cells is the caller's to free. *place has no layers.
enum { WM_CELL_UNKNOWN = -1, WM_CELL_FREE = 0, WM_CELL_OCCUPIED = 100 };  // as in nav_msgs/OccupancyGrid
wm_status wm_map_cells_load(const char *path, wm_raster *place, int8_t **cells, wm_error *err);

// Hash of a raster's geometry and layers, for the event log; the layers' pixels must be 0 or 255. Linear.
uint64_t wm_raster_hash(const wm_raster *raster);

// A grey picture, row 0 at the top.
typedef struct wm_grey {
  uint32_t width_px, height_px;
  uint8_t *pixels;  // width x height; the caller's to free
} wm_grey;

// Reads a PNG (brightness of colours by ITU-R BT.601; transparency becomes white; gamma is not applied) or a PGM.
// `path` is for messages. WM_BAD_DATA for other, broken or truncated files; WM_OUT_OF_RANGE beyond the limits above.
wm_status wm_grey_load(const char *path, wm_grey *out, wm_error *err);
wm_status wm_grey_decode(const void *bytes, size_t size, const char *path, wm_grey *out, wm_error *err);
// The bytes of a PNG; the caller frees *out. WM_IO without memory.
wm_status wm_grey_encode(const wm_grey *grey, const char *path, void **out, size_t *size, wm_error *err);

#ifdef __cplusplus
}
#endif

#endif
