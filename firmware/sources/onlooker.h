// SPDX-License-Identifier: Apache-2.0
// The newest picture of a detector with what it found, for viewers. The detector's thread copies one
// where it was asked for, and never waits; the reader's thread asks, and takes it.
#ifndef WAYMARK_SOURCES_ONLOOKER_H
#define WAYMARK_SOURCES_ONLOOKER_H

#include <pthread.h>
#include <stdatomic.h>

#include "sources/picture_socket.h"
#include "sources/vision.h"
#include "waymark/event.h"
#include "waymark/frame.h"

struct onlooker {
  pthread_mutex_t lock;  // of all below but `wanted`
  atomic_int wanted;     // a picture is asked for
  int is_filled;
  size_t capacity, bytes;
  uint8_t *message;  // head, events, pixels; NULL without a viewer
  uint64_t copied;   // pictures, since the start
};

void onlooker_open(onlooker *self);
void onlooker_close(onlooker *self);

// The detector's thread, after each picture. Does nothing without a request.
void onlooker_show(onlooker *self, const wm_frame *frame, const wm_event *events, size_t count);

// The reader's thread. Asks for the next picture of width x height; allocates with the first. 0: no memory.
int onlooker_ask(onlooker *self, uint32_t width_px, uint32_t height_px);
// The picture that was asked for, head and body, its source and names not filled; 0 while there is none. `out` has room
// for onlooker_bytes.
size_t onlooker_take(onlooker *self, uint8_t *out, size_t capacity);
size_t onlooker_bytes(uint32_t width_px, uint32_t height_px);
// The last viewer has gone: frees the memory.
void onlooker_rest(onlooker *self);

#endif
