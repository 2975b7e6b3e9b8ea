// SPDX-License-Identifier: Apache-2.0
// One camera, many readers. One thread takes pictures from a frame source into a small pool of buffers that count their
// readers, and hands each to all subscribers: a picture is decoded once. A slow subscriber drops its oldest waiting
// picture and counts it (overflows); it holds nobody up. The pool has room for what all subscribers can hold at once.
//
//                                ┌► subscription (1 waits)  ── detector's thread
//   device ── hub's thread ── pool ─► subscription (1 waits)  ── another detector's thread
//                                └► subscription (8 wait)   ── recorder's thread
#ifndef WAYMARK_SOURCES_FRAME_HUB_H
#define WAYMARK_SOURCES_FRAME_HUB_H

#include "waymark/frame_source.h"

#define FRAME_HUB_SUBSCRIBERS_MAX 16
#define FRAME_HUB_WAITING_MAX 16  // largest waiting_max of a subscriber

typedef struct frame_hub frame_hub;

// Takes `source` over, also where it fails. Its pictures are of width x height pixels. Allocates.
wm_status frame_hub_open(wm_frame_source *source, uint32_t width_px, uint32_t height_px, frame_hub **out,
                         wm_error *err);
// A subscriber from the next picture on. It is closed before the hub. Allocates what it may hold. Any thread, at any
// time. WM_FULL: there are too many.
wm_status frame_hub_subscribe(frame_hub *self, const wm_frame_wishes *wishes, wm_frame_source **out, wm_error *err);
// One picture from the source to all subscribers; waits as the source does. WM_OK, WM_AGAIN, WM_END or WM_IO, which
// subscribers get, too, once they have taken what waits. The hub's thread.
wm_status frame_hub_take(frame_hub *self, wm_error *err);
// When its thread has ended; closes the source.
void frame_hub_close(frame_hub *self);  // NULL is fine

#endif
