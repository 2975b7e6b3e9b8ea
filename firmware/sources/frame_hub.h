// SPDX-License-Identifier: Apache-2.0
// One camera, many readers. One thread takes pictures from a frame source into a pool of buffers that count their
// readers, and hands each to all subscribers: a picture is decoded once. A slow subscriber loses its oldest waiting
// picture, which is counted (overflows), and delays no other. The pool has room for all pictures that subscribers can
// hold at once.
//
//                                ┌► subscription (1 waits)  ── detector's thread
//   device ── hub's thread ── pool ─► subscription (1 waits)  ── another detector's thread
//                                └► subscription (8 wait)   ── recorder's thread
#ifndef WAYMARK_SOURCES_FRAME_HUB_H
#define WAYMARK_SOURCES_FRAME_HUB_H

#include "waymark/frame_source.h"

#define FRAME_HUB_SUBSCRIBERS_MAX 16  // 8 detectors, black box, recorder, live view
#define FRAME_HUB_WAITING_MAX 16      // largest waiting_max of a subscriber

typedef struct frame_hub frame_hub;

// Takes ownership of `source`, also on failure. Its pictures are of width x height pixels. Allocates.
wm_status frame_hub_open(wm_frame_source *source, uint32_t width_px, uint32_t height_px, frame_hub **out,
                         wm_error *err);
// Subscribes from the next picture on; to be closed before the hub. Allocates its buffers. Any thread, at any time.
// WM_FULL: too many subscribers.
wm_status frame_hub_subscribe(frame_hub *self, const wm_frame_wishes *wishes, wm_frame_source **out, wm_error *err);
// One picture from the source to all subscribers; blocks as the source does. Subscribers get a status other than WM_OK
// and WM_AGAIN after their waiting pictures. On the hub's thread.
wm_status frame_hub_take(frame_hub *self, wm_error *err);
// After its thread has ended; closes the source.
void frame_hub_close(frame_hub *self);  // NULL is fine

#endif
