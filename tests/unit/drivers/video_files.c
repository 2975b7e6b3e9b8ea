// SPDX-License-Identifier: Apache-2.0
#include "video_files.h"

#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

void bytes_put(bytes *self, const void *data, size_t size) {
  if (size > sizeof self->data - self->size) abort();
  memcpy(self->data + self->size, data, size);
  self->size += size;
}

void bytes_le(bytes *self, uint32_t value, int count) {
  for (int i = 0; i < count; i++) {
    uint8_t byte = (uint8_t)(value >> (8 * i));
    bytes_put(self, &byte, 1);
  }
}

static size_t compress(const uint8_t *pixels, int width, int height, int format, int sampling, uint8_t *out,
                       size_t capacity) {
  tjhandle handle = tjInitCompress();
  unsigned char *made = NULL;
  unsigned long size = 0;
  if (!handle || tjCompress2(handle, pixels, width, 0, height, format, &made, &size, sampling, 90, 0) != 0) abort();
  if (size > capacity) abort();
  memcpy(out, made, size);
  tjFree(made);
  (void)tjDestroy(handle);
  return size;
}

size_t make_jpeg(int width, int height, int level, uint8_t *out, size_t capacity) {
  uint8_t *pixels = malloc((size_t)(width * height));
  if (!pixels) abort();
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) pixels[y * width + x] = (uint8_t)(x < width / 2 ? level : 255 - level);
  size_t size = compress(pixels, width, height, TJPF_GRAY, TJSAMP_GRAY, out, capacity);
  free(pixels);
  return size;
}

size_t make_colour_jpeg(int width, int height, uint8_t *out, size_t capacity) {
  uint8_t *pixels = malloc((size_t)(width * height * 3));
  if (!pixels) abort();
  for (int i = 0; i < width * height; i++) {
    pixels[3 * i] = 200;
    pixels[3 * i + 1] = pixels[3 * i + 2] = 50;
  }
  size_t size = compress(pixels, width, height, TJPF_RGB, TJSAMP_420, out, capacity);
  free(pixels);
  return size;
}

static void stream(bytes *self, const char *kind, const char *code, uint32_t width, uint32_t height) {
  static const uint8_t zeros[56];
  bytes_put(self, "LIST\0\0\0\0strlstrh", 16);
  bytes_le(self, 56, 4);
  bytes_put(self, kind, 4);
  bytes_put(self, code, 4);
  bytes_put(self, zeros, 48);
  bytes_put(self, "strf", 4);
  bytes_le(self, 40, 4);
  bytes_le(self, 40, 4);
  bytes_le(self, width, 4);
  bytes_le(self, height, 4);
  bytes_le(self, 1, 2);
  bytes_le(self, 24, 2);
  bytes_put(self, code, 4);
  bytes_put(self, zeros, 20);
}

void avi_head(bytes *self, const char *code, uint32_t width, uint32_t height, int audio) {
  self->size = 0;
  bytes_put(self, "RIFF\0\0\0\0AVI LIST\0\0\0\0hdrlavih\4\0\0\0abcd", 36);
  if (audio) stream(self, "auds", "\0\0\0\0", 0, 0);
  stream(self, "vids", code, width, height);
  bytes_put(self, "JUNK\3\0\0\0xyz\0", 12);
  bytes_put(self, "LIST\0\0\0\0movi", 12);
}

void avi_chunk(bytes *self, const char *id, const void *data, size_t size) {
  bytes_put(self, id, 4);
  bytes_le(self, (uint32_t)size, 4);
  bytes_put(self, data, size);
  if (size & 1) bytes_le(self, 0, 1);
}

static void element(bytes *self, uint32_t id, int id_bytes, const void *data, size_t size) {
  for (int i = id_bytes - 1; i >= 0; i--) bytes_le(self, id >> (8 * i), 1);
  bytes_le(self, 0x10, 1);  // a size of four bytes
  for (int i = 2; i >= 0; i--) bytes_le(self, (uint32_t)(size >> (8 * i)), 1);
  bytes_put(self, data, size);
}

void mkv_head(bytes *self, const char *codec, uint32_t width, uint32_t height) {
  const uint8_t wide[2] = {(uint8_t)(width >> 8), (uint8_t)width}, high[2] = {(uint8_t)(height >> 8), (uint8_t)height};
  self->size = 0;
  element(self, 0x1A45DFA3, 4, "\x42\x82\x88matroska", 11);
  bytes_put(self, "\x18\x53\x80\x67\x01\xFF\xFF\xFF\xFF\xFF\xFF\xFF", 12);  // segment of unknown size
  element(self, 0xEC, 1, "void", 4);
  bytes_put(self, "\x16\x54\xAE\x6B\x01\xFF\xFF\xFF\xFF\xFF\xFF\xFF", 12);  // tracks
  bytes_put(self, "\xAE\x01\xFF\xFF\xFF\xFF\xFF\xFF\xFF", 9);               // an audio track
  element(self, 0xD7, 1, "\x01", 1);
  element(self, 0x83, 1, "\x02", 1);
  element(self, 0x86, 1, "A_PCM/INT/LIT", 13);
  bytes_put(self, "\xAE\x01\xFF\xFF\xFF\xFF\xFF\xFF\xFF", 9);
  element(self, 0xD7, 1, "\x02", 1);
  element(self, 0x83, 1, "\x01", 1);
  element(self, 0x86, 1, codec, strlen(codec));
  bytes_put(self, "\xE0\x01\xFF\xFF\xFF\xFF\xFF\xFF\xFF", 9);
  element(self, 0xB0, 1, wide, 2);
  element(self, 0xBA, 1, high, 2);
  element(self, 0x2EB524, 3, "Y800", 4);
  bytes_put(self, "\x1F\x43\xB6\x75\x01\xFF\xFF\xFF\xFF\xFF\xFF\xFF", 12);  // cluster
  element(self, 0xE7, 1, "\x00", 1);
}

void mkv_block(bytes *self, int track, const void *data, size_t size) {
  bytes block;
  block.size = 0;
  bytes_le(&block, 0x80u | (uint32_t)track, 1);
  bytes_put(&block, "\0\0\0", 3);
  bytes_put(&block, data, size);
  element(self, 0xA3, 1, block.data, block.size);
}
