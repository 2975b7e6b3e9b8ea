// SPDX-License-Identifier: Apache-2.0
// Pictures of files as grey levels, as they are stored: an 8-bit level of 205 is the 16-bit level 205 * 257, whatever
// gamma the file states.
#ifndef WM_MAP_PICTURE_H
#define WM_MAP_PICTURE_H

#include "waymark/map.h"

typedef enum picture_use {
  PICTURE_SEEN,  // as one sees it: brightness of colours (ITU-R BT.601), transparency over white
  PICTURE_MAP    // as map_server reads it: the mean of the colours; transparency is reported
} picture_use;

// *opaque (may be NULL): a byte a pixel, 1 where it is not transparent at all; NULL where all are. Both are the
// caller's to free. Messages name `path`.
wm_status picture_decode(const void *data, size_t size, const char *path, picture_use use, wm_grey *out,
                         uint8_t **opaque, wm_error *err);
wm_status picture_load(const char *path, picture_use use, wm_grey *out, uint8_t **opaque, wm_error *err);

// The picture's memory, where its size is allowed.
wm_status picture_allocate(uint64_t width, uint64_t height, const char *path, wm_grey *out, wm_error *err);
wm_status png_decode(const uint8_t *bytes, size_t size, const char *path, picture_use use, wm_grey *out,
                     uint8_t **opaque, wm_error *err);

#endif
