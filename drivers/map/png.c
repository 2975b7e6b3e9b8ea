// SPDX-License-Identifier: Apache-2.0
// PNG by libpng, row by row: palettes and 1, 2, 4 and 16 bits become 8, colours and transparency become a grey level.
#include <png.h>
#include <stdlib.h>
#include <string.h>

#include "picture.h"

typedef struct png_reader {
  png_structp png;
  png_infop info;
  const uint8_t *at;
  size_t left;
  const char *path;
  picture_use use;
  wm_grey *out;
  uint8_t *opaque;  // NULL: none is transparent
  uint8_t *rows;    // one row, or of an interlaced picture all
  png_uint_32 width, height;
  size_t channels, row_bytes;
  wm_status status;
  wm_error *err;
} png_reader;

static void take_bytes(png_structp png, png_bytep out, size_t count) {
  png_reader *self = png_get_io_ptr(png);
  if (count > self->left) png_error(png, "cut off");
  memcpy(out, self->at, count);
  self->at += count;
  self->left -= count;
}

static void stop(png_structp png, png_const_charp why) {
  (void)why;
  png_longjmp(png, 1);
}

static void pass_over(png_structp png, png_const_charp why) { (void)png, (void)why; }

// Grey levels of a row of pixels with 1 (grey), 2 (grey, alpha), 3 (RGB) or 4 (RGBA) bytes.
static void reduce(const png_reader *self, const uint8_t *row, uint32_t y) {
  const int has_alpha = self->channels % 2 == 0, is_colour = self->channels > 2;
  uint8_t *grey = self->out->pixels + (size_t)y * self->width;
  for (uint32_t x = 0; x < self->width; x++, row += self->channels) {
    uint32_t level = row[0];
    // BT.601: 0.299, 0.587 and 0.114 of 65536
    if (is_colour && self->use == PICTURE_SEEN)
      level = (19595u * row[0] + 38470u * row[1] + 7471u * row[2] + 32768u) >> 16;
    else if (is_colour)
      level = (2u * (row[0] + (uint32_t)row[1] + row[2]) + 3u) / 6u;
    const uint32_t alpha = has_alpha ? row[self->channels - 1] : 255;
    if (self->use == PICTURE_SEEN) level = (level * alpha + 255u * (255u - alpha) + 127u) / 255u;
    if (self->opaque) self->opaque[(size_t)y * self->width + x] = alpha == 255;
    grey[x] = (uint8_t)level;
  }
}

static void ask_for_bytes(png_reader *self) {
  png_set_expand(self->png);    // palettes, fewer bits, a transparent colour
  png_set_scale_16(self->png);  // rounded, not cut
  (void)png_set_interlace_handling(self->png);
  png_read_update_info(self->png, self->info);
  self->channels = png_get_channels(self->png, self->info);
  self->row_bytes = png_get_rowbytes(self->png, self->info);
}

static wm_status no_memory(const png_reader *self) {
  return wm_fail(self->err, WM_IO, "%s: no memory for its pixels", self->path);
}

static wm_status allocate(png_reader *self) {
  wm_status status = picture_allocate(self->width, self->height, self->path, self->out, self->err);
  if (status != WM_OK) return status;
  const int interlaced = png_get_interlace_type(self->png, self->info) != PNG_INTERLACE_NONE;
  self->rows = calloc(interlaced ? self->height : 1, self->row_bytes);
  if (!self->rows) return no_memory(self);
  if (self->use != PICTURE_MAP || self->channels % 2 != 0) return WM_OK;
  self->opaque = malloc((size_t)self->width * self->height);
  return self->opaque ? WM_OK : no_memory(self);
}

static void read_rows(png_reader *self) {
  const int passes = png_get_interlace_type(self->png, self->info) != PNG_INTERLACE_NONE ? 7 : 1;
  for (int pass = 0; pass < passes; pass++)
    for (png_uint_32 y = 0; y < self->height; y++) {
      uint8_t *row = self->rows + (passes > 1 ? y * self->row_bytes : 0);
      png_read_row(self->png, row, NULL);
      if (pass == passes - 1) reduce(self, row, y);
    }
}

// All state is in *self, which a jump of libpng leaves as it is.
static void read_all(png_reader *self) {
  if (setjmp(png_jmpbuf(self->png)) != 0) {
    if (self->status == WM_OK)
      self->status =
          wm_fail(self->err, WM_BAD_DATA, "%s: a broken PNG: it is cut off, or its bytes are damaged", self->path);
    return;
  }
  png_set_user_limits(self->png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);  // ours are checked below
  png_set_read_fn(self->png, self, take_bytes);
  png_read_info(self->png, self->info);
  self->width = png_get_image_width(self->png, self->info);
  self->height = png_get_image_height(self->png, self->info);
  ask_for_bytes(self);
  self->status = allocate(self);
  if (self->status == WM_OK) read_rows(self);
}

wm_status png_decode(const uint8_t *bytes, size_t size, const char *path, picture_use use, wm_grey *out,
                     uint8_t **opaque, wm_error *err) {
  png_reader self = {.at = bytes, .left = size, .path = path, .use = use, .out = out, .err = err};
  self.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, NULL, stop, pass_over);
  self.info = self.png ? png_create_info_struct(self.png) : NULL;
  if (self.info)
    read_all(&self);
  else
    self.status = no_memory(&self);
  png_destroy_read_struct(&self.png, &self.info, NULL);
  free(self.rows);
  if (self.status == WM_OK && opaque)
    *opaque = self.opaque;
  else
    free(self.opaque);
  return self.status;
}
