// SPDX-License-Identifier: Apache-2.0
#include "sources/frame_hub.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "rt/clock.h"

// A buffer of the pool. The hub's thread writes it only while it has no reader.
typedef struct picture {
  struct picture *next;
  uint32_t readers;  // subscriptions that hold it or have it waiting
  wm_frame frame;
  wm_time_ns decoded_in_ns;
  wm_camera_raw raw;  // `data` is raw_bytes, or NULL
  uint8_t *pixels, *raw_bytes;
  size_t raw_capacity;
} picture;

typedef struct subscription {
  wm_frame_source base;
  frame_hub *hub;
  struct subscription *next;
  wm_frame_wishes wishes;
  picture *waiting[FRAME_HUB_WAITING_MAX];  // the oldest first
  uint32_t waiting_count;
  picture *held;
  int is_peeked;  // held, but not yet returned by `next`
  uint64_t dropped, alone;
} subscription;

struct frame_hub {
  wm_frame_source *source;
  uint32_t width_px, height_px;
  pthread_mutex_t lock;    // of all below
  pthread_cond_t changed;  // a picture arrived, or the source ended
  picture *pool;
  size_t pool_count, pool_needed;
  subscription *subscriptions;
  uint32_t subscription_count, raw_wanted;
  wm_source_counts counts;  // of the source, as of its newest picture
  wm_status ended;          // WM_OK: not ended
  wm_error why;
};

static void lock(frame_hub *self) { (void)pthread_mutex_lock(&self->lock); }
static void unlock(frame_hub *self) { (void)pthread_mutex_unlock(&self->lock); }

// ── the pool ────────────────────────────────────────────────────────────────────────────────────────────────────────

static void free_picture(picture *p) {
  free(p->pixels);
  free(p->raw_bytes);
  free(p);
}

static wm_status add_picture(frame_hub *self, wm_error *err) {
  picture *p = calloc(1, sizeof *p);
  if (p) p->pixels = calloc((size_t)self->width_px * self->height_px + 1, 1);
  if (!p || !p->pixels) {
    free(p);
    return wm_fail(err, WM_IO, "no memory for a camera's pictures");
  }
  p->next = self->pool;
  self->pool = p;
  self->pool_count++;
  return WM_OK;
}

// Adjusts the pool to pool_needed; buffers that are read at the moment stay.
static wm_status fit_pool(frame_hub *self, wm_error *err) {
  for (picture **at = &self->pool; *at && self->pool_count > self->pool_needed;) {
    picture *p = *at;
    if (p->readers > 0) {
      at = &p->next;
      continue;
    }
    *at = p->next;
    free_picture(p);
    self->pool_count--;
  }
  wm_status status = WM_OK;
  while (status == WM_OK && self->pool_count < self->pool_needed) status = add_picture(self, err);
  return status;
}

// Never NULL: the pool has one buffer more than all subscribers can hold.
static picture *unread(frame_hub *self) {
  picture *p = self->pool;
  while (p && p->readers > 0) p = p->next;
  return p;
}

// Most buffers that a subscription can hold: those that wait, and the one that it reads.
static size_t most_held(const wm_frame_wishes *wishes) { return wishes->waiting_max + 1; }

// ── the hub's thread ────────────────────────────────────────────────────────────────────────────────────────────────

// JPEGs differ in size: a buffer grows to 1.5 times the picture that did not fit.
static void keep_raw(frame_hub *self, picture *p) {
  wm_camera_raw raw = {0};
  self->source->ops->raw(self->source, &raw);
  p->raw = raw;
  p->raw.data = NULL;
  if (!raw.is_jpeg || !raw.data) return;
  if (raw.bytes > p->raw_capacity) {
    size_t capacity = (size_t)raw.bytes + raw.bytes / 2;
    uint8_t *larger = realloc(p->raw_bytes, capacity);
    if (!larger) return;
    p->raw_bytes = larger;
    p->raw_capacity = capacity;
  }
  memcpy(p->raw_bytes, raw.data, raw.bytes);
  p->raw.data = p->raw_bytes;
}

static picture *oldest_waiting(subscription *self) {
  picture *oldest = self->waiting[0];
  self->waiting_count--;
  for (uint32_t i = 0; i < self->waiting_count; i++) self->waiting[i] = self->waiting[i + 1];
  return oldest;
}

static void hand_out(subscription *self, picture *p) {
  if (self->waiting_count == self->wishes.waiting_max) {
    oldest_waiting(self)->readers--;
    self->dropped++;
  }
  self->waiting[self->waiting_count++] = p;
  p->readers++;
}

wm_status frame_hub_take(frame_hub *self, wm_error *err) {
  wm_error why = {0};
  wm_frame head;
  wm_status status = self->source->ops->peek(self->source, &head, &why);
  lock(self);
  picture *p = status == WM_OK ? unread(self) : NULL;
  if (p) p->readers++;  // held by this thread until it is handed out
  int wants_raw = self->raw_wanted > 0;
  unlock(self);
  if (p) {
    self->source->into = p->pixels;
    wm_time_ns begin_ns = wm_monotonic_ns();
    status = self->source->ops->next(self->source, &p->frame, &why);
    p->decoded_in_ns = wm_monotonic_ns() - begin_ns;
    p->raw = (wm_camera_raw){0};
    if (status == WM_OK && wants_raw) keep_raw(self, p);
  } else if (status == WM_OK) {  // no subscriber
    status = self->source->ops->skip(self->source, &why);
  }
  lock(self);
  self->source->ops->counts(self->source, &self->counts);
  for (subscription *s = self->subscriptions; p && status == WM_OK && s; s = s->next) hand_out(s, p);
  if (p) p->readers--;
  if (status != WM_OK && status != WM_AGAIN) {
    self->ended = status;
    self->why = why;
  }
  (void)pthread_cond_broadcast(&self->changed);
  unlock(self);
  if (status != WM_OK && err) *err = why;
  return status;
}

// ── a subscriber's thread ───────────────────────────────────────────────────────────────────────────────────────────

static void let_go(subscription *self) {
  if (self->held) self->held->readers--;
  self->held = NULL;
  self->is_peeked = 0;
}

// Under the lock: the oldest waiting picture becomes the held one.
static wm_status hold_next(subscription *self, wm_error *err) {
  frame_hub *hub = self->hub;
  if (self->is_peeked) return WM_OK;
  let_go(self);
  wm_time_ns until_ns = wm_monotonic_ns() + self->wishes.wait_ms * WM_NS_PER_MS;
  const struct timespec until = {.tv_sec = until_ns / WM_NS_PER_S, .tv_nsec = until_ns % WM_NS_PER_S};
  while (self->waiting_count == 0 && hub->ended == WM_OK && self->wishes.wait_ms > 0)
    if (pthread_cond_timedwait(&hub->changed, &hub->lock, &until) != 0) break;
  if (self->waiting_count == 0) {
    if (hub->ended != WM_OK && err) *err = hub->why;
    return hub->ended != WM_OK ? hub->ended : WM_AGAIN;
  }
  self->held = oldest_waiting(self);
  self->is_peeked = 1;
  return WM_OK;
}

static wm_status peek(wm_frame_source *base, wm_frame *out, wm_error *err) {
  subscription *self = (subscription *)base;
  lock(self->hub);
  wm_status status = hold_next(self, err);
  unlock(self->hub);
  if (status != WM_OK) return status;
  *out = self->held->frame;
  out->grey = NULL;
  return WM_OK;
}

static wm_status next(wm_frame_source *base, wm_frame *out, wm_error *err) {
  subscription *self = (subscription *)base;
  lock(self->hub);
  wm_status status = hold_next(self, err);
  self->is_peeked = 0;
  unlock(self->hub);
  if (status != WM_OK) return status;
  *out = self->held->frame;
  base->decoded_in_ns = self->held->decoded_in_ns;
  return WM_OK;
}

static wm_status skip(wm_frame_source *base, wm_error *err) {
  subscription *self = (subscription *)base;
  lock(self->hub);
  wm_status status = hold_next(self, err);
  self->alone += status == WM_OK;
  let_go(self);
  unlock(self->hub);
  return status;
}

static void raw(const wm_frame_source *base, wm_camera_raw *out) {
  const subscription *self = (const subscription *)base;
  *out = self->held ? self->held->raw : (wm_camera_raw){0};
}

static void count(const wm_frame_source *base, wm_source_counts *out) {
  const subscription *self = (const subscription *)base;
  lock(self->hub);
  *out = self->hub->counts;
  out->overflows += self->dropped;
  out->lost += self->alone;
  unlock(self->hub);
}

static void close_subscription(wm_frame_source *base) {
  subscription *self = (subscription *)base;
  frame_hub *hub = self->hub;
  lock(hub);
  let_go(self);
  for (uint32_t i = 0; i < self->waiting_count; i++) self->waiting[i]->readers--;
  subscription **at = &hub->subscriptions;
  while (*at != self) at = &(*at)->next;
  *at = self->next;
  hub->subscription_count--;
  hub->raw_wanted -= self->wishes.wants_raw != 0;
  hub->pool_needed -= most_held(&self->wishes);
  (void)fit_pool(hub, NULL);  // it only shrinks
  unlock(hub);
  free(self);
}

static const wm_frame_source_ops kSubscription = {peek, next, skip, NULL, raw, count, close_subscription};

wm_status frame_hub_subscribe(frame_hub *self, const wm_frame_wishes *wishes, wm_frame_source **out, wm_error *err) {
  *out = NULL;
  subscription *s = calloc(1, sizeof *s);
  if (!s) return wm_fail(err, WM_IO, "no memory for a reader of a camera");
  s->base = (wm_frame_source){.ops = &kSubscription, .is_live = self->source->is_live};
  s->hub = self;
  s->wishes = *wishes;
  if (s->wishes.waiting_max < 1) s->wishes.waiting_max = 1;
  if (s->wishes.waiting_max > FRAME_HUB_WAITING_MAX) s->wishes.waiting_max = FRAME_HUB_WAITING_MAX;
  lock(self);
  wm_status status = self->subscription_count < FRAME_HUB_SUBSCRIBERS_MAX
                         ? WM_OK
                         : wm_fail(err, WM_FULL, "a camera has more than %d readers", FRAME_HUB_SUBSCRIBERS_MAX);
  if (status == WM_OK) {
    self->pool_needed += most_held(&s->wishes);
    status = fit_pool(self, err);
    if (status != WM_OK) self->pool_needed -= most_held(&s->wishes);
  }
  if (status == WM_OK) {
    s->next = self->subscriptions;
    self->subscriptions = s;
    self->subscription_count++;
    self->raw_wanted += s->wishes.wants_raw != 0;
    *out = &s->base;
  }
  unlock(self);
  if (status != WM_OK) free(s);
  return status;
}

// ── opening ─────────────────────────────────────────────────────────────────────────────────────────────────────────

wm_status frame_hub_open(wm_frame_source *source, uint32_t width_px, uint32_t height_px, frame_hub **out,
                         wm_error *err) {
  *out = NULL;
  frame_hub *self = calloc(1, sizeof *self);
  if (!self) {
    source->ops->close(source);
    return wm_fail(err, WM_IO, "no memory for a camera");
  }
  self->source = source;
  self->width_px = width_px;
  self->height_px = height_px;
  self->pool_needed = 1;  // the one that is being filled
  pthread_condattr_t clock;
  (void)pthread_condattr_init(&clock);
  (void)pthread_condattr_setclock(&clock, CLOCK_MONOTONIC);
  (void)pthread_mutex_init(&self->lock, NULL);
  (void)pthread_cond_init(&self->changed, &clock);
  (void)pthread_condattr_destroy(&clock);
  *out = self;
  return WM_OK;
}

void frame_hub_close(frame_hub *self) {
  if (!self) return;
  self->source->ops->close(self->source);
  while (self->pool) {
    picture *p = self->pool;
    self->pool = p->next;
    free_picture(p);
  }
  (void)pthread_cond_destroy(&self->changed);
  (void)pthread_mutex_destroy(&self->lock);
  free(self);
}
