// SPDX-License-Identifier: Apache-2.0
#include "jpeg.h"

#include <stdio.h>
#include <string.h>
#include <turbojpeg.h>

wm_status jpeg_open(jpeg_decoder *self, wm_error *err) {
  self->handle = tjInitDecompress();
  return self->handle ? WM_OK : wm_fail(err, WM_IO, "no memory for a JPEG decoder");
}

void jpeg_close(jpeg_decoder *self) {
  if (self->handle) (void)tjDestroy(self->handle);
  self->handle = NULL;
}

size_t jpeg_bytes_max(uint32_t width_px, uint32_t height_px) {
  return tjBufSize((int)width_px, (int)height_px, TJSAMP_444);
}

#define QUALITY 95  // errors of some grey levels at most

size_t jpeg_encode_grey(const uint8_t *grey, uint32_t width_px, uint32_t height_px, uint8_t *out) {
  unsigned long length = tjBufSize((int)width_px, (int)height_px, TJSAMP_444);
  tjhandle handle = tjInitCompress();
  if (!handle) return 0;
  const int failed = tjCompress2(handle, grey, (int)width_px, (int)width_px, (int)height_px, TJPF_GRAY, &out, &length,
                                 TJSAMP_GRAY, QUALITY, TJFLAG_ACCURATEDCT | TJFLAG_NOREALLOC);
  (void)tjDestroy(handle);
  return failed ? 0 : length;
}

static jpeg_verdict header(jpeg_decoder *self, const uint8_t *data, size_t length, uint32_t *width_px,
                           uint32_t *height_px, int *space) {
  int width, height, sampling;
  if (tjDecompressHeader3(self->handle, data, length, &width, &height, &sampling, space) != 0 || width < 1 ||
      height < 1)
    return JPEG_DAMAGED;
  *width_px = (uint32_t)width;
  *height_px = (uint32_t)height;
  return JPEG_GOOD;
}

jpeg_verdict jpeg_size(jpeg_decoder *self, const uint8_t *data, size_t length, uint32_t *width_px,
                       uint32_t *height_px) {
  int space;
  return header(self, data, length, width_px, height_px, &space);
}

jpeg_verdict jpeg_decode(jpeg_decoder *self, const uint8_t *data, size_t length, uint32_t width_px, uint32_t height_px,
                         uint8_t *grey, uint32_t stride_bytes, char *why, size_t why_bytes) {
  uint32_t width, height;
  int space = TJCS_GRAY;
  if (!self->handle) self->handle = tjInitDecompress();
  if (!self->handle || header(self, data, length, &width, &height, &space) != JPEG_GOOD) {
    (void)snprintf(why, why_bytes, "its %zu bytes have no head of a JPEG that can be read", length);
    jpeg_close(self);  // libjpeg-turbo 2.1 otherwise reads the next header as this one's continuation
    return JPEG_DAMAGED;
  }
  if (width != width_px || height != height_px) {
    (void)snprintf(why, why_bytes, "has %u x %u pixels, the camera %u x %u", width, height, width_px, height_px);
    return JPEG_WRONG_SIZE;
  }
  if (tjDecompress2(self->handle, data, length, grey, (int)width_px, (int)stride_bytes, (int)height_px, TJPF_GRAY,
                    TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS) == 0)
    return JPEG_GOOD;
  // Stray bytes between the parts of a picture are harmless, and some cameras always write them.
  const char *said = tjGetErrorStr2(self->handle);
  if (tjGetErrorCode(self->handle) == TJERR_WARNING && strstr(said, "extraneous bytes")) return JPEG_GOOD;
  if (space == TJCS_CMYK || space == TJCS_YCCK)
    (void)snprintf(why, why_bytes, "is a JPEG of four inks (CMYK), which is not read; save it in grey or in RGB");
  else
    (void)snprintf(why, why_bytes, "is cut or damaged: not all of its %zu bytes are a JPEG's", length);
  return JPEG_DAMAGED;
}
