// SPDX-License-Identifier: Apache-2.0
#include "output/avi_writer.h"

#include <errno.h>
#include <string.h>

static uint8_t *u32(uint8_t *at, uint32_t value) {
  for (int i = 0; i < 4; i++) *at++ = (uint8_t)(value >> (8 * i));
  return at;
}

static uint8_t *u16(uint8_t *at, unsigned value) {
  *at++ = (uint8_t)value;
  *at++ = (uint8_t)(value >> 8);
  return at;
}

static uint8_t *text(uint8_t *at, const char *four) {
  memcpy(at, four, 4);
  return at + 4;
}

static int put(FILE *file, const void *data, size_t length) {
  if (length == 0 || fwrite(data, 1, length, file) == length) return 0;
  return errno ? errno : EIO;
}

int avi_begin(FILE *file, const char fourcc[4], uint32_t width, uint32_t height, double rate_hz) {
  enum { STRH = 56, STRF = 40, AVIH = 56, STRL = 4 + 8 + STRH + 8 + STRF, HDRL = 4 + 8 + AVIH + 8 + STRL };
  uint8_t head[12 + 8 + HDRL + 12] = {0}, *at = head;
  uint32_t rate = rate_hz > 0 ? (uint32_t)(rate_hz * 1000 + 0.5) : 30000;
  at = text(u32(text(at, "RIFF"), 0), "AVI ");
  at = text(u32(text(at, "LIST"), HDRL), "hdrl");
  at = u32(text(at, "avih"), AVIH);
  uint8_t *avih = at;
  (void)u32(avih, (uint32_t)(1e9 / rate));
  (void)u32(avih + 24, 1);  // streams
  (void)u32(u32(avih + 32, width), height);
  at = text(u32(text(at + AVIH, "LIST"), STRL), "strl");
  at = u32(text(at, "strh"), STRH);
  (void)text(text(at, "vids"), fourcc);
  (void)u32(u32(at + 20, 1000), rate);
  at = u32(text(at + STRH, "strf"), STRF);
  (void)u32(u32(u32(at, STRF), width), height);
  (void)text(u16(u16(at + 12, 1), memcmp(fourcc, "MJPG", 4) == 0 ? 24 : 8), fourcc);
  at = text(u32(text(at + STRF, "LIST"), 0), "movi");
  return put(file, head, (size_t)(at - head));
}

int avi_picture(FILE *file, const uint8_t *data, size_t row_bytes, size_t rows, size_t stride) {
  uint8_t head[8];
  size_t length = row_bytes * rows;
  (void)u32(text(head, "00dc"), (uint32_t)length);
  int failed = put(file, head, sizeof head);
  for (size_t y = 0; !failed && y < rows; y++) failed = put(file, data + y * stride, row_bytes);
  return failed || !(length & 1) ? failed : put(file, "", 1);
}
