// SPDX-License-Identifier: Apache-2.0
#include "pixels.h"

#include <string.h>

#include "waymark/devices.h"

static const char *const kNames[] = {"GREY", "YUYV", "UYVY", "NV12", "Y10 ", "Y16 ", "MJPG", "RGB3", "BGR3"};
_Static_assert(sizeof kNames / sizeof kNames[0] == PIXELS_FORMATS, "a name for each format");

const char *const wm_camera_formats[] = {"GREY", "YUYV", "UYVY", "NV12", "Y10", "Y16", "MJPG", "RGB3", "BGR3", NULL};

int pixels_find(const char *name) {
  char padded[5] = "    ";
  size_t length = strlen(name);
  if (length == 0 || length > 4) return strcmp(name, "MJPEG") == 0 ? PIXELS_MJPEG : -1;
  memcpy(padded, name, length);
  for (int i = 0; i < PIXELS_FORMATS; i++)
    if (strcmp(kNames[i], padded) == 0) return i;
  return -1;
}

const char *pixels_name(int format) { return format >= 0 && format < PIXELS_FORMATS ? kNames[format] : "?"; }

uint32_t pixels_fourcc(int format) {
  const char *n = pixels_name(format);
  return (uint32_t)(uint8_t)n[0] | (uint32_t)(uint8_t)n[1] << 8 | (uint32_t)(uint8_t)n[2] << 16 |
         (uint32_t)(uint8_t)n[3] << 24;
}

int pixels_of_fourcc(uint32_t fourcc) {
  for (int i = 0; i < PIXELS_FORMATS; i++)
    if (pixels_fourcc(i) == fourcc) return i;
  return -1;
}

static size_t row_bytes(int format, uint32_t width) {
  switch (format) {
    case PIXELS_GREY:
    case PIXELS_NV12: return width;
    case PIXELS_MJPEG: return 0;
    case PIXELS_RGB:
    case PIXELS_BGR: return (size_t)width * 3;
    default: return (size_t)width * 2;
  }
}

// The last row may lack its padding, and of NV12 only the luma is needed.
size_t pixels_bytes(int format, uint32_t width, uint32_t height, uint32_t stride) {
  size_t row = row_bytes(format, width);
  if (row == 0 || height == 0) return 0;
  return (size_t)(height - 1) * stride + row;
}

int pixels_are_grey(int format) { return format == PIXELS_GREY || format == PIXELS_NV12; }

static uint8_t luma(unsigned red, unsigned green, unsigned blue) {
  return (uint8_t)((77 * red + 150 * green + 29 * blue + 128) >> 8);
}

static void row_to_grey(int format, const uint8_t *from, uint32_t width, uint8_t *grey) {
  switch (format) {
    case PIXELS_YUYV:
      for (uint32_t x = 0; x < width; x++) grey[x] = from[2 * (size_t)x];
      break;
    case PIXELS_UYVY:
    case PIXELS_Y16:  // the high byte is the second
      for (uint32_t x = 0; x < width; x++) grey[x] = from[2 * (size_t)x + 1];
      break;
    case PIXELS_Y10:
      for (uint32_t x = 0; x < width; x++) {
        unsigned value = from[2 * (size_t)x] | (unsigned)from[2 * (size_t)x + 1] << 8;
        grey[x] = (uint8_t)(value > 1023 ? 255 : value >> 2);
      }
      break;
    case PIXELS_RGB:
      for (uint32_t x = 0; x < width; x++, from += 3) grey[x] = luma(from[0], from[1], from[2]);
      break;
    case PIXELS_BGR:
      for (uint32_t x = 0; x < width; x++, from += 3) grey[x] = luma(from[2], from[1], from[0]);
      break;
    default: memcpy(grey, from, width);
  }
}

void pixels_to_grey(int format, const uint8_t *from, uint32_t width, uint32_t height, uint32_t stride, uint8_t *grey) {
  for (uint32_t y = 0; y < height; y++) row_to_grey(format, from + (size_t)y * stride, width, grey + (size_t)y * width);
}

uint64_t pixels_fingerprint(const uint8_t *data, size_t length) {
  uint64_t sum = length, word;
  // An odd step, so that all columns are sampled over the rows.
  for (size_t i = 0; i + sizeof word <= length; i += 61) {
    memcpy(&word, data + i, sizeof word);
    sum = (sum ^ word) * UINT64_C(0x9E3779B97F4A7C15);
    sum ^= sum >> 29;
  }
  return sum;
}
