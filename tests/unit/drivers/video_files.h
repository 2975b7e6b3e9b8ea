// SPDX-License-Identifier: Apache-2.0
// Small videos of the test's making, in memory.
#pragma once

#include <stddef.h>
#include <stdint.h>

typedef struct bytes {
  uint8_t data[1 << 18];
  size_t size;
} bytes;

void bytes_put(bytes *self, const void *data, size_t size);
void bytes_le(bytes *self, uint32_t value, int count);

// A JPEG of width x height, grey `level` on the left, 255 - level on the right; returns its size in `out`.
size_t make_jpeg(int width, int height, int level, uint8_t *out, size_t capacity);
size_t make_colour_jpeg(int width, int height, uint8_t *out, size_t capacity);

// AVI: head of one video stream (behind an audio stream where `audio`), up to the movi list; then chunks; sizes of the
// lists are 0, as a writer that was cut leaves them.
void avi_head(bytes *self, const char *code, uint32_t width, uint32_t height, int audio);
void avi_chunk(bytes *self, const char *id, const void *data, size_t size);

// Matroska with a track of this codec; then blocks.
void mkv_head(bytes *self, const char *codec, uint32_t width, uint32_t height);
void mkv_block(bytes *self, int track, const void *data, size_t size);
