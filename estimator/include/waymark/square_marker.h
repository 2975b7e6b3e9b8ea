// SPDX-License-Identifier: Apache-2.0
// Square coded markers of any family (AprilTag, ArUco) in raw pictures: regions of the picture whose outline is a
// square seen askew, their modules, the nearest code, edges and pose by waymark/marker_fit.h. A family's codes are
// given by whoever has them.
#ifndef WAYMARK_SQUARE_MARKER_H
#define WAYMARK_SQUARE_MARKER_H

#include <stddef.h>

#include "waymark/event.h"
#include "waymark/frame.h"
#include "waymark/setup.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_SQUARE_BITS_MAX 64
#define WM_SQUARE_ACROSS_MAX 11

// A square of `border` x `border` modules whose outermost ones are a ring. The ring is black in a white rim of a
// module, or white in a black ring (`is_white_inside`), beyond which there may be more modules of the code.
typedef struct wm_square_family {
  int32_t border;
  int32_t across;           // modules of the whole code: `border`, or more with a white ring
  int32_t is_white_inside;  // whether the ring is white
  int32_t bits;             // at most WM_SQUARE_BITS_MAX
  // Bit i of a code, the highest first: its module, from the ring's upper left one on, x right, y down.
  int32_t x[WM_SQUARE_BITS_MAX], y[WM_SQUARE_BITS_MAX];
  uint32_t count;         // codes; a set bit is white
  const uint64_t *codes;  // of which each one's index is its identity
  int32_t distance;       // Hamming distance of any two codes in any rotation
  int32_t half_turned;    // whether readers see it the other way up than the codes' modules are
} wm_square_family;

typedef struct wm_square_reader wm_square_reader;

size_t wm_square_reader_bytes(const wm_camera *camera, const wm_square_family *family, const char **why);
// `self` has 64-byte aligned wm_square_reader_bytes. Copies the codes. `size_m`: edge of the ring's outer border.
// NULL, or the reason why it is impossible (a constant string).
const char *wm_square_reader_init(wm_square_reader *self, const wm_camera *camera, const wm_square_family *family,
                                  double size_m, int contrast_min);
// Writes an event a marker; ids are the codes' plus `id_offset`. No allocation.
wm_status wm_square_reader_read(wm_square_reader *self, const wm_frame *frame, int32_t id_offset, wm_event *out,
                                size_t capacity, size_t *count);
// Bits of a code that are corrected: at most two, less than half of the distance, and so few that a random pattern is a
// code with a probability of at most 2e-4 (0 where even the codes themselves are more).
int wm_square_corrected(const wm_square_family *family);

#ifdef __cplusplus
}
#endif

#endif
