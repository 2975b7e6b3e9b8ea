// SPDX-License-Identifier: Apache-2.0
// An AVI of pictures that is only appended to: no index, no sizes. A truncated file is valid up to its last complete
// picture. Source: Microsoft, "AVI RIFF File Reference".
#ifndef WAYMARK_OUTPUT_AVI_WRITER_H
#define WAYMARK_OUTPUT_AVI_WRITER_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

// 0, or errno. `fourcc`: "MJPG" or "Y800".
int avi_begin(FILE *file, const char fourcc[4], uint32_t width, uint32_t height, double rate_hz);
// One picture: `rows` rows of `row_bytes`, `stride` apart (1, the length and 0 for a JPEG).
int avi_picture(FILE *file, const uint8_t *data, size_t row_bytes, size_t rows, size_t stride);

#endif
