// SPDX-License-Identifier: Apache-2.0
// The view of a run as a page for a browser on this computer: one page without anything from elsewhere, the state as
// JSON, the raster map as grey bytes. A few requests a second, one at a time; a client that is slow or silent is cut
// off.
#ifndef WAYMARK_CLI_WATCH_WEB_H
#define WAYMARK_CLI_WATCH_WEB_H

#include "cli/watch/watch.h"
#include "waymark/setup.h"
#include "waymark/status.h"

typedef struct web {
  int listening;                        // socket
  const wm_raster *map;                 // NULL: none
  uint8_t *picture;                     // the map's, of at most WEB_MAP_EDGE pixels along an edge
  uint32_t width_px, height_px, every;  // of how many pixels of the map each is one
  uint64_t refused;                     // requests that were none of ours
} web;

#define WEB_MAP_EDGE 2000u

// `address` "127.0.0.1" keeps it on this computer. `map` (may be NULL) outlives it. Allocates.
wm_status web_open(web *self, const char *address, int port, const wm_raster *map, wm_error *err);
// Answers what has been asked; returns after at most `wait_ms` where nothing was. Requests whose Host is no name of
// this computer are refused while it listens on 127.0.0.1: another site's page must not read the robot's state.
void web_serve(web *self, const watch *seen, int wait_ms);
void web_close(web *self);

// The answer's body for `path` ("/", "/state.json", "/map.json") into `out`; its length, 0 where there is none such.
size_t web_answer(const web *self, const watch *seen, wm_time_ns now_ns, const char *path, char *out, size_t capacity);

extern const char kWebPage[];

#endif
