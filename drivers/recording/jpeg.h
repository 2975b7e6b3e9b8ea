// SPDX-License-Identifier: Apache-2.0
// JPEG to grey, and grey to JPEG, by libturbojpeg.
#ifndef WM_RECORDING_JPEG_H
#define WM_RECORDING_JPEG_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/status.h"

typedef enum jpeg_verdict {
  JPEG_GOOD,
  JPEG_DAMAGED,    // cut, or not a JPEG
  JPEG_WRONG_SIZE  // of another size than asked for; *why has it
} jpeg_verdict;

typedef struct jpeg_decoder {
  void *handle;
} jpeg_decoder;

wm_status jpeg_open(jpeg_decoder *self, wm_error *err);
void jpeg_close(jpeg_decoder *self);
// Size by the header.
jpeg_verdict jpeg_size(jpeg_decoder *self, const uint8_t *data, size_t length, uint32_t *width_px, uint32_t *height_px);
// Decodes into rows of stride_bytes. The luma unchanged, by the accurate transform, which gives the same bytes with
// SIMD and without. `why` gets the reason of a verdict that isn't good.
jpeg_verdict jpeg_decode(jpeg_decoder *self, const uint8_t *data, size_t length, uint32_t width_px, uint32_t height_px,
                         uint8_t *grey, uint32_t stride_bytes, char *why, size_t why_bytes);
// Encodes packed rows of grey pixels at the quality 95; `out` holds jpeg_bytes_max. Returns the length, 0 on failure.
size_t jpeg_encode_grey(const uint8_t *grey, uint32_t width_px, uint32_t height_px, uint8_t *out);
// Most bytes of a JPEG of this size: a larger one is invalid.
size_t jpeg_bytes_max(uint32_t width_px, uint32_t height_px);

#endif
