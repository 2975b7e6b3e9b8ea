// SPDX-License-Identifier: Apache-2.0
#include <png.h>
#include <stdlib.h>
#include <string.h>

#include "picture.h"
#include "waymark/text.h"

#define FILE_BYTES_MAX ((size_t)1 << 30)  // above the largest map that is read (400 million pixels)

static wm_status check_size(uint64_t width, uint64_t height, const char *path, wm_error *err) {
  if (width == 0 || height == 0) return wm_fail(err, WM_BAD_DATA, "%s: a picture without pixels", path);
  if (width > WM_MAP_EDGE_MAX || height > WM_MAP_EDGE_MAX || width * height > WM_MAP_PIXELS_MAX)
    return wm_fail(err, WM_OUT_OF_RANGE,
                   "%s: %llu x %llu pixels are too many: at most %u along an edge and %u in all; cut the map or take a "
                   "coarser resolution",
                   path, (unsigned long long)width, (unsigned long long)height, WM_MAP_EDGE_MAX, WM_MAP_PIXELS_MAX);
  return WM_OK;
}

wm_status picture_allocate(uint64_t width, uint64_t height, const char *path, wm_grey *out, wm_error *err) {
  wm_status status = check_size(width, height, path, err);
  if (status != WM_OK) return status;
  out->width_px = (uint32_t)width;
  out->height_px = (uint32_t)height;
  out->pixels = malloc((size_t)width * height + 1);
  return out->pixels ? WM_OK : wm_fail(err, WM_IO, "%s: no memory for its pixels", path);
}

// ── PGM ─────────────────────────────────────────────────────────────────────────────────────────────────────────────

typedef struct text_at {
  const uint8_t *bytes;
  size_t size, at;
} text_at;

static int is_space(uint8_t c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

// The next number, after white space and comments (from # to the end of the line).
static int next_number(text_at *t, uint32_t max, uint32_t *out) {
  while (t->at < t->size && (is_space(t->bytes[t->at]) || t->bytes[t->at] == '#')) {
    if (t->bytes[t->at] == '#')
      while (t->at < t->size && t->bytes[t->at] != '\n') t->at++;
    else
      t->at++;
  }
  uint64_t value = 0;
  size_t digits = 0;
  for (; t->at < t->size && t->bytes[t->at] >= '0' && t->bytes[t->at] <= '9'; t->at++, digits++) {
    value = value * 10 + (uint64_t)(t->bytes[t->at] - '0');
    if (value > max) return 0;
  }
  *out = (uint32_t)value;
  return digits > 0;
}

static wm_status read_pgm(const uint8_t *bytes, size_t size, const char *path, wm_grey *out, wm_error *err) {
  const int plain = bytes[1] == '2';
  text_at t = {bytes, size, 2};
  uint32_t width, height, white;
  if (!next_number(&t, UINT32_MAX, &width) || !next_number(&t, UINT32_MAX, &height) ||
      !next_number(&t, 65535, &white) || white == 0 || t.at >= size || !is_space(bytes[t.at]))
    return wm_fail(err, WM_BAD_DATA,
                   "%s: the head of the PGM is broken: width, height and white (1 to 65535) follow P%c", path,
                   bytes[1]);
  t.at++;
  wm_status status = check_size(width, height, path, err);
  if (status != WM_OK) return status;
  const size_t count = (size_t)width * height, depth = white > 255 ? 2 : 1;
  // A plain number takes two bytes at least, so memory is allocated only where the file is long enough.
  if ((size - t.at) < (plain ? 2 * count - 1 : depth * count))
    return wm_fail(err, WM_BAD_DATA,
                   "%s: the PGM is truncated: its head states %zu pixels of %zu bytes, but %zu bytes are left", path,
                   count, depth, size - t.at);
  status = picture_allocate(width, height, path, out, err);
  if (status != WM_OK) return status;
  for (size_t i = 0; i < count; i++) {
    uint32_t value = 0;
    if (plain) {
      if (!next_number(&t, white, &value))
        return wm_fail(err, WM_BAD_DATA, "%s: pixel %zu of the PGM is not a number up to %u", path, i, white);
    } else {
      value = depth == 1 ? bytes[t.at + i] : (uint32_t)bytes[t.at + 2 * i] << 8 | bytes[t.at + 2 * i + 1];
      if (value > white) value = white;
    }
    out->pixels[i] = white == 255 ? (uint8_t)value : (uint8_t)((value * 255u + white / 2) / white);
  }
  return WM_OK;
}

// ── either ──────────────────────────────────────────────────────────────────────────────────────────────────────────

wm_status picture_decode(const void *data, size_t size, const char *path, picture_use use, wm_grey *out,
                         uint8_t **opaque, wm_error *err) {
  const uint8_t *bytes = data;
  wm_status status;
  *out = (wm_grey){0};
  if (opaque) *opaque = NULL;
  if (size >= 2 && bytes[0] == 'P' && (bytes[1] == '2' || bytes[1] == '5'))
    status = read_pgm(bytes, size, path, out, err);
  else if (size >= 4 && memcmp(bytes, "\x89PNG", 4) == 0)
    status = png_decode(bytes, size, path, use, out, opaque, err);
  else
    return wm_fail(err, WM_BAD_DATA, "%s: %s", path,
                   size == 0 ? "is empty" : "neither PNG nor PGM (P2, P5); save it as one of these");
  if (status == WM_OK) return WM_OK;
  free(out->pixels);
  *out = (wm_grey){0};
  return status;
}

wm_status picture_load(const char *path, picture_use use, wm_grey *out, uint8_t **opaque, wm_error *err) {
  char *bytes;
  size_t size;
  *out = (wm_grey){0};
  if (opaque) *opaque = NULL;
  wm_status status = wm_text_read_file(path, FILE_BYTES_MAX, &bytes, &size, err);
  if (status != WM_OK) return status;
  status = picture_decode(bytes, size, path, use, out, opaque, err);
  free(bytes);
  return status;
}

wm_status wm_grey_decode(const void *data, size_t size, const char *path, wm_grey *out, wm_error *err) {
  return picture_decode(data, size, path, PICTURE_SEEN, out, NULL, err);
}

wm_status wm_grey_load(const char *path, wm_grey *out, wm_error *err) {
  return picture_load(path, PICTURE_SEEN, out, NULL, err);
}

wm_status wm_grey_encode(const wm_grey *grey, const char *path, void **out, size_t *size, wm_error *err) {
  png_image png = {
      .version = PNG_IMAGE_VERSION, .width = grey->width_px, .height = grey->height_px, .format = PNG_FORMAT_GRAY};
  png_alloc_size_t needed = PNG_IMAGE_PNG_SIZE_MAX(png);
  *out = malloc(needed);
  if (!*out || !png_image_write_to_memory(&png, *out, &needed, 0, grey->pixels, 0, NULL)) {
    free(*out);
    *out = NULL;
    return wm_fail(err, WM_IO, "%s: can't be written as a PNG: %s", path, png.message);
  }
  *size = needed;
  return WM_OK;
}
