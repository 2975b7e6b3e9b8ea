// SPDX-License-Identifier: Apache-2.0
#include "sources/onlooker.h"

#include <stdlib.h>
#include <string.h>

#include "waymark/codec.h"

void onlooker_open(onlooker *self) {
  memset(self, 0, sizeof *self);
  (void)pthread_mutex_init(&self->lock, NULL);
}

void onlooker_close(onlooker *self) {
  free(self->message);
  (void)pthread_mutex_destroy(&self->lock);
}

size_t onlooker_bytes(uint32_t width_px, uint32_t height_px) {
  return sizeof(wm_picture_head) + WM_PICTURE_EVENTS_MAX + (size_t)width_px * height_px;
}

// Those that have room; a detector's of one picture have.
static void put_events(onlooker *self, wm_picture_head *head, const wm_event *events, size_t count) {
  for (size_t i = 0; i < count; i++) {
    size_t bytes = wm_event_encode(&events[i], self->message + self->bytes, WM_PICTURE_EVENTS_MAX - head->event_bytes);
    if (bytes == 0) return;
    self->bytes += bytes;
    head->event_bytes += (uint32_t)bytes;
    head->event_count++;
  }
}

static void copy(onlooker *self, const wm_frame *frame, const wm_event *events, size_t count) {
  wm_picture_head head = {.magic = WM_PICTURE_MAGIC, .t_ns = frame->t_ns};
  head.width_px = frame->width_px;
  head.height_px = frame->height_px;
  self->bytes = sizeof head;
  put_events(self, &head, events, count);
  for (uint32_t row = 0; row < frame->height_px; row++) {
    memcpy(self->message + self->bytes, frame->grey + (size_t)row * frame->stride_bytes, frame->width_px);
    self->bytes += frame->width_px;
  }
  memcpy(self->message, &head, sizeof head);
  self->is_filled = 1;
  self->copied++;
}

void onlooker_show(onlooker *self, const wm_frame *frame, const wm_event *events, size_t count) {
  if (!atomic_load_explicit(&self->wanted, memory_order_relaxed) || !frame->grey) return;
  if (pthread_mutex_trylock(&self->lock) != 0) return;  // the reader is at it: the next picture will do
  if (self->message && onlooker_bytes(frame->width_px, frame->height_px) <= self->capacity) {
    copy(self, frame, events, count);
    atomic_store_explicit(&self->wanted, 0, memory_order_relaxed);
  }
  (void)pthread_mutex_unlock(&self->lock);
}

int onlooker_ask(onlooker *self, uint32_t width_px, uint32_t height_px) {
  (void)pthread_mutex_lock(&self->lock);
  const size_t needed = onlooker_bytes(width_px, height_px);
  if (self->capacity < needed) {
    free(self->message);
    self->message = malloc(needed);
    self->capacity = self->message ? needed : 0;
  }
  const int has_memory = self->message != NULL;
  self->is_filled = 0;
  (void)pthread_mutex_unlock(&self->lock);
  atomic_store_explicit(&self->wanted, has_memory, memory_order_relaxed);
  return has_memory;
}

size_t onlooker_take(onlooker *self, uint8_t *out, size_t capacity) {
  (void)pthread_mutex_lock(&self->lock);
  const size_t bytes = self->is_filled && self->bytes <= capacity ? self->bytes : 0;
  if (bytes > 0) memcpy(out, self->message, bytes);
  if (bytes > 0) self->is_filled = 0;
  (void)pthread_mutex_unlock(&self->lock);
  return bytes;
}

void onlooker_rest(onlooker *self) {
  atomic_store_explicit(&self->wanted, 0, memory_order_relaxed);
  (void)pthread_mutex_lock(&self->lock);
  free(self->message);
  self->message = NULL;
  self->capacity = 0;
  self->is_filled = 0;
  (void)pthread_mutex_unlock(&self->lock);
}
