// SPDX-License-Identifier: Apache-2.0
#include "decoded.h"

#include <pthread.h>
#include <stdlib.h>
#include <time.h>

struct decoded_pictures {
  pthread_mutex_t lock;    // of all below
  pthread_cond_t changed;  // a picture was decoded
  uint32_t users;
  decoded_picture kept[DECODED_KEPT];
};

static wm_time_ns now_ns(void) {
  struct timespec now;
  (void)clock_gettime(CLOCK_MONOTONIC, &now);
  return (wm_time_ns)now.tv_sec * WM_NS_PER_S + now.tv_nsec;
}

static void lock(decoded_pictures *self) { (void)pthread_mutex_lock(&self->lock); }
static void unlock(decoded_pictures *self) { (void)pthread_mutex_unlock(&self->lock); }

wm_status decoded_open(uint32_t width_px, uint32_t height_px, decoded_pictures **out, wm_error *err) {
  *out = NULL;
  decoded_pictures *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for decoded pictures");
  (void)pthread_mutex_init(&self->lock, NULL);
  (void)pthread_cond_init(&self->changed, NULL);
  self->users = 1;
  for (size_t i = 0; i < DECODED_KEPT; i++) {
    self->kept[i].grey = malloc((size_t)width_px * height_px);
    if (self->kept[i].grey) continue;
    decoded_close(self);
    return wm_fail(err, WM_IO, "no memory for decoded pictures");
  }
  *out = self;
  return WM_OK;
}

void decoded_join(decoded_pictures *self) {
  lock(self);
  self->users++;
  unlock(self);
}

void decoded_close(decoded_pictures *self) {
  if (!self) return;
  lock(self);
  const uint32_t left = --self->users;
  unlock(self);
  if (left > 0) return;
  for (size_t i = 0; i < DECODED_KEPT; i++) free(self->kept[i].grey);
  (void)pthread_cond_destroy(&self->changed);
  (void)pthread_mutex_destroy(&self->lock);
  free(self);
}

// A slot for `frame`: an empty one, or that of the earliest picture without a holder. NULL where only later pictures
// could be evicted: this reader still needs those, and the others will not come back to `frame`.
static decoded_picture *room_for(decoded_pictures *self, uint64_t frame) {
  decoded_picture *earliest = NULL;
  for (size_t i = 0; i < DECODED_KEPT; i++) {
    decoded_picture *p = &self->kept[i];
    if (p->readers > 0) continue;
    if (p->state == DECODED_EMPTY) return p;
    if (!earliest || p->frame < earliest->frame) earliest = p;
  }
  return earliest && earliest->frame < frame ? earliest : NULL;
}

decoded_picture *decoded_hold(decoded_pictures *self, uint64_t frame, int *is_mine, wm_time_ns *elsewhere_ns) {
  decoded_picture *found = NULL;
  const wm_time_ns begin_ns = now_ns();
  *is_mine = 0;
  *elsewhere_ns = 0;
  lock(self);
  for (size_t i = 0; i < DECODED_KEPT && !found; i++)
    if (self->kept[i].state != DECODED_EMPTY && self->kept[i].frame == frame) found = &self->kept[i];
  if (!found && (found = room_for(self, frame))) {
    *is_mine = 1;
    found->frame = frame;
    found->state = DECODED_IN_WORK;
    found->began_ns = begin_ns;
  }
  if (found) found->readers++;
  while (found && !*is_mine && found->state == DECODED_IN_WORK) (void)pthread_cond_wait(&self->changed, &self->lock);
  if (found && !*is_mine) {
    const wm_time_ns waited_ns = now_ns() - begin_ns;
    if (found->took_ns > waited_ns) *elsewhere_ns = found->took_ns - waited_ns;
  }
  unlock(self);
  return found;
}

void decoded_done(decoded_pictures *self, decoded_picture *picture) {
  lock(self);
  picture->state = DECODED_READY;
  picture->took_ns = now_ns() - picture->began_ns;
  (void)pthread_cond_broadcast(&self->changed);
  unlock(self);
}

void decoded_let_go(decoded_pictures *self, decoded_picture *picture) {
  if (!picture) return;
  lock(self);
  picture->readers--;
  unlock(self);
}
