// SPDX-License-Identifier: Apache-2.0
// A thread that processes pictures ahead of a replay, up to PREFETCH_EVENTS events.
#include <stdio.h>
#include <string.h>

#include "sources/vision_source.h"

static void *work(void *argument) {
  vision_source *self = argument;
  vision_prefetch *a = &self->prefetch;
  (void)pthread_mutex_lock(&a->lock);
  for (;;) {
    while (!a->stop && a->count == PREFETCH_EVENTS) (void)pthread_cond_wait(&a->changed, &a->lock);
    if (a->stop) break;
    wm_event *slot = &a->events[(a->first + a->count) % PREFETCH_EVENTS];
    (void)pthread_mutex_unlock(&a->lock);
    wm_error error = {0};
    wm_status status = vision_next(self, slot, &error);
    (void)pthread_mutex_lock(&a->lock);
    a->counts = self->counts;
    if (status == WM_OK) {
      a->count++;
    } else {
      a->ended = 1;
      a->status = status;
      a->error = error;
    }
    (void)pthread_cond_broadcast(&a->changed);
    if (a->ended) break;
  }
  (void)pthread_mutex_unlock(&a->lock);
  return NULL;
}

wm_status vision_prefetch_start(vision_source *self, wm_error *err) {
  vision_prefetch *a = &self->prefetch;
  if (pthread_mutex_init(&a->lock, NULL) != 0 || pthread_cond_init(&a->changed, NULL) != 0)
    return wm_fail(err, WM_IO, "%s: a lock cannot be created", self->base.name);
  if (pthread_create(&a->thread, NULL, work, self) != 0)
    return wm_fail(err, WM_IO, "%s: a thread can't be started", self->base.name);
  char name[16];
  (void)snprintf(name, sizeof name, "wm-%.12s", self->base.name);
  (void)pthread_setname_np(a->thread, name);
  a->started = 1;
  return WM_OK;
}

void vision_prefetch_stop(vision_source *self) {
  vision_prefetch *a = &self->prefetch;
  if (!a->started) return;
  (void)pthread_mutex_lock(&a->lock);
  a->stop = 1;
  (void)pthread_cond_broadcast(&a->changed);
  (void)pthread_mutex_unlock(&a->lock);
  (void)pthread_join(a->thread, NULL);
  a->started = 0;
}

wm_status vision_prefetch_next(vision_source *self, wm_event *out, wm_error *err) {
  vision_prefetch *a = &self->prefetch;
  (void)pthread_mutex_lock(&a->lock);
  while (a->count == 0 && !a->ended) (void)pthread_cond_wait(&a->changed, &a->lock);
  wm_status status = WM_OK;
  if (a->count > 0) {
    const wm_event *event = &a->events[a->first];
    memcpy(out, event, wm_event_bytes(event));
    a->first = (a->first + 1) % PREFETCH_EVENTS;
    a->count--;
  } else {
    status = a->status;
    if (err && status != WM_END) *err = a->error;
  }
  self->base.counts = a->counts;
  (void)pthread_cond_broadcast(&a->changed);
  (void)pthread_mutex_unlock(&a->lock);
  return status;
}
