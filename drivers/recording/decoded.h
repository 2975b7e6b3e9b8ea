// SPDX-License-Identifier: Apache-2.0
// Decoded pictures of one video that several readers share: the first reader that needs a picture decodes it, the
// others take the pixels. Each reader keeps its own position in the video. A reader waits only while another one
// decodes the same picture; one that lags by more than DECODED_KEPT pictures decodes for itself.
#ifndef WM_RECORDING_DECODED_H
#define WM_RECORDING_DECODED_H

#include "jpeg.h"
#include "waymark/time.h"

// In a replay each detector is at most 8 events ahead (PREFETCH_EVENTS), one is taken and one picture is in work; two
// more for readers in between.
#define DECODED_KEPT 12

typedef struct decoded_picture {
  uint64_t frame;
  uint32_t readers;  // that hold it
  enum { DECODED_EMPTY, DECODED_IN_WORK, DECODED_READY } state;
  jpeg_verdict verdict;
  char why[256];
  wm_time_ns began_ns, took_ns;
  uint8_t *grey;  // rows of width_px bytes
} decoded_picture;

typedef struct decoded_pictures decoded_pictures;

// One user; the last user's close frees it. WM_IO: no memory.
wm_status decoded_open(uint32_t width_px, uint32_t height_px, decoded_pictures **out, wm_error *err);
void decoded_join(decoded_pictures *self);   // one user more
void decoded_close(decoded_pictures *self);  // NULL is fine

// The picture, held until decoded_let_go. *is_mine: the caller decodes it into `grey`, fills verdict and why, and calls
// decoded_done. Else *elsewhere_ns is another reader's decoding time beyond the wait for it. NULL: no room; the caller
// decodes for itself. Any thread.
decoded_picture *decoded_hold(decoded_pictures *self, uint64_t frame, int *is_mine, wm_time_ns *elsewhere_ns);
void decoded_done(decoded_pictures *self, decoded_picture *picture);
void decoded_let_go(decoded_pictures *self, decoded_picture *picture);  // NULL is fine

#endif
