// SPDX-License-Identifier: Apache-2.0
#include <string.h>

#include "waymark/bytes.h"
#include "waymark/codec.h"
#include "waymark/map.h"

// Layers are long runs of one value: hashing only the changes is as specific and costs a tenth of hashing every pixel.
static uint64_t hash_layer(uint64_t hash, const uint8_t *pixels, size_t count) {
  uint8_t there = pixels != NULL;
  hash = wm_hash(hash, &there, 1);
  if (!there) return hash;
  uint8_t value = 0;
  for (size_t i = 0; i < count;) {
    uint64_t same, here;
    memset(&same, value, sizeof same);
    while (i + sizeof here <= count) {
      memcpy(&here, pixels + i, sizeof here);
      if (here != same) break;
      i += sizeof here;
    }
    while (i < count && pixels[i] == value) i++;
    if (i == count) break;
    value = pixels[i];
    uint8_t bytes[9];
    wm_writer w = wm_writer_of(bytes, sizeof bytes);
    wm_put_u64(&w, i);
    wm_put_u8(&w, value);
    hash = wm_hash(hash, bytes, w.used);
  }
  return hash;
}

uint64_t wm_raster_hash(const wm_raster *raster) {
  uint8_t bytes[40];
  wm_writer w = wm_writer_of(bytes, sizeof bytes);
  wm_put_u32(&w, raster->width_px);
  wm_put_u32(&w, raster->height_px);
  wm_put_f64(&w, raster->resolution_m);
  wm_put_f64(&w, raster->origin_x_m);
  wm_put_f64(&w, raster->origin_y_m);
  wm_put_f64(&w, raster->origin_yaw_rad);
  const size_t count = (size_t)raster->width_px * raster->height_px;
  uint64_t hash = wm_hash(WM_HASH_START, bytes, w.used);
  hash = hash_layer(hash, raster->edges, count);
  return hash_layer(hash, raster->drivable, count);
}
