// SPDX-License-Identifier: Apache-2.0
// Conversion of camera formats (by V4L2's four letters) to grey. Colour is dropped and the luma unchanged; formats
// without luma get BT.601's.
// Pure.
#ifndef WM_CAMERA_PIXELS_H
#define WM_CAMERA_PIXELS_H

#include <stddef.h>
#include <stdint.h>

typedef enum pixel_format {
  PIXELS_GREY,   // 8 bits
  PIXELS_YUYV,   // luma at even bytes
  PIXELS_UYVY,   // luma at odd bytes
  PIXELS_NV12,   // a plane of luma, then colour at half size
  PIXELS_Y10,    // 10 bits in 16, little-endian
  PIXELS_Y16,    // 16 bits, little-endian
  PIXELS_MJPEG,  // a JPEG a picture
  PIXELS_RGB,    // bytes red, green, blue
  PIXELS_BGR,    // bytes blue, green, red
  PIXELS_FORMATS
} pixel_format;

// By the configuration's name ("GREY", "MJPG" ...), or -1.
int pixels_find(const char *name);
const char *pixels_name(int format);
// V4L2's number of a format ("GREY" as little-endian bytes), and back (-1).
uint32_t pixels_fourcc(int format);
int pixels_of_fourcc(uint32_t fourcc);

// Least bytes of `height` rows of `stride` bytes of this format, up to the last pixel; 0 for MJPEG.
size_t pixels_bytes(int format, uint32_t width, uint32_t height, uint32_t stride);
// Whether the first plane is grey, so that no conversion is needed.
int pixels_are_grey(int format);
// Rows of `stride` bytes into rows of `width` bytes of grey. The caller has checked the length with pixels_bytes.
// Not for MJPEG. Linear in the pixels.
void pixels_to_grey(int format, const uint8_t *from, uint32_t width, uint32_t height, uint32_t stride, uint8_t *grey);

// A fingerprint of the picture from some of its bytes (about 1 in 8, all lines): 30 us for 640x400.
uint64_t pixels_fingerprint(const uint8_t *data, size_t length);

#endif
