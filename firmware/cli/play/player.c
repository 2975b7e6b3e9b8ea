// SPDX-License-Identifier: Apache-2.0
#include "cli/play/player.h"

#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>

#include "rt/clock.h"

#define AHEAD_ITEMS 4096                    // two seconds of a bus at full load
#define AHEAD_BYTES (64u << 20)             // pictures that wait
#define LOOK_EVERY_NS (100 * WM_NS_PER_MS)  // for `stop`

typedef struct waiting {
  wm_play_item item;
  uint8_t *data;  // its own copy of item.data
} waiting;

struct player_threads {
  pthread_t reader, sender;
  pthread_mutex_t lock;
  pthread_cond_t changed;
  waiting *queue;
  size_t first, count, bytes;
  int is_read;  // all items are in the queue
  wm_status status;
  wm_error err;
};

wm_time_ns player_monotonic_ns(const player *self, wm_time_ns since_first_ns) {
  const wm_time_ns after_ns = since_first_ns - wm_ns_from_seconds(self->from_s);
  if (self->speed == 1.0) return self->begin_ns + after_ns;
  return self->begin_ns + (wm_time_ns)((double)after_ns / self->speed);
}

// ── reading ahead ───────────────────────────────────────────────────────────────────────────────────────────────────

// Puts a copy into the queue; waits while it is full.
static void put(player *self, const wm_play_item *item, uint8_t *copy) {
  struct player_threads *t = self->threads;
  (void)pthread_mutex_lock(&t->lock);
  while (!atomic_load(&self->stop) && (t->count == AHEAD_ITEMS || (t->count > 0 && t->bytes > AHEAD_BYTES)))
    (void)pthread_cond_wait(&t->changed, &t->lock);
  waiting *w = &t->queue[(t->first + t->count) % AHEAD_ITEMS];
  if (t->count < AHEAD_ITEMS) {
    *w = (waiting){*item, copy};
    w->item.data = copy;
    t->count++;
    t->bytes += item->bytes;
  } else {
    free(copy);
  }
  (void)pthread_cond_broadcast(&t->changed);
  (void)pthread_mutex_unlock(&t->lock);
}

// Under a real-time policy (chrt) decoding and encoding must not keep the sending thread waiting. Who sets the policy
// later takes the sending thread alone, by its name.
static void step_back(void) {
  int policy;
  struct sched_param param;
  if (pthread_getschedparam(pthread_self(), &policy, &param) != 0 || policy == SCHED_OTHER) return;
  if (param.sched_priority > 1) param.sched_priority--;
  (void)pthread_setschedparam(pthread_self(), policy, &param);
}

static void *read_ahead(void *context) {
  player *self = context;
  struct player_threads *t = self->threads;
  (void)prctl(PR_SET_NAME, "wm-play-read", 0UL, 0UL, 0UL);
  step_back();
  wm_status status = WM_OK;
  while (status == WM_OK && !atomic_load(&self->stop)) {
    wm_play_item item;
    status = wm_play_next(self->play, &item, &t->err);
    if (status != WM_OK) break;
    uint8_t *copy = NULL;
    if (item.bytes > 0) {
      copy = malloc(item.bytes);
      if (!copy) {
        status = wm_fail(&t->err, WM_IO, "no memory for a picture of %u bytes", item.bytes);
        break;
      }
      memcpy(copy, item.data, item.bytes);
    }
    put(self, &item, copy);
  }
  (void)pthread_mutex_lock(&t->lock);
  t->is_read = 1;
  t->status = status == WM_END ? WM_OK : status;
  (void)pthread_cond_broadcast(&t->changed);
  (void)pthread_mutex_unlock(&t->lock);
  return NULL;
}

// ── sending ─────────────────────────────────────────────────────────────────────────────────────────────────────────

// The next one; 0: there is none any more.
static int take(player *self, waiting *out) {
  struct player_threads *t = self->threads;
  (void)pthread_mutex_lock(&t->lock);
  while (t->count == 0 && !t->is_read && !atomic_load(&self->stop)) (void)pthread_cond_wait(&t->changed, &t->lock);
  const int is_there = t->count > 0;
  if (is_there) {
    *out = t->queue[t->first];
    t->first = (t->first + 1) % AHEAD_ITEMS;
    t->count--;
    t->bytes -= out->item.bytes;
    (void)pthread_cond_broadcast(&t->changed);
  }
  (void)pthread_mutex_unlock(&t->lock);
  return is_there;
}

// 0: it was stopped before.
static int sleep_until(player *self, wm_time_ns due_ns) {
  for (;;) {
    const wm_time_ns now_ns = wm_monotonic_ns();
    if (atomic_load(&self->stop)) return 0;
    if (now_ns >= due_ns) return 1;
    const wm_time_ns until_ns = due_ns - now_ns > LOOK_EVERY_NS ? now_ns + LOOK_EVERY_NS : due_ns;
    const struct timespec until = {until_ns / WM_NS_PER_S, until_ns % WM_NS_PER_S};
    (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
  }
}

// A fault of a camera or bus goes to the sinks of its streams.
static void cause(player *self, const wm_play_item *item) {
  const wm_fault *f = &self->faults->fault[item->fault];
  const wm_fault_kind_row *row = wm_fault_kind_of(f->kind);
  self->progress[item->fault] = (uint8_t)(item->begins ? FAULT_LASTS : FAULT_DONE);
  if (!(row->by & WM_FAULT_BY_PLAYER)) return;
  size_t count;
  const wm_play_stream *streams = wm_play_streams(self->play, &count);
  for (size_t i = 0; i < count; i++) {
    play_sink *sink = self->sink[i];
    if (!sink || !sink->ops->fault || (f->of[0] && strcmp(f->of, streams[i].of) != 0)) continue;
    const int failed = sink->ops->fault(sink, f, item->begins);
    if (failed && !self->fault_failure[item->fault]) self->fault_failure[item->fault] = -failed;
  }
}

static void give_out(player *self, wm_play_item *item, wm_time_ns due_ns) {
  if (item->kind == WM_PLAY_FAULT) {
    cause(self, item);
    return;
  }
  player_counts *counts = &self->counts[item->stream];
  const wm_time_ns stamp_ns = item->kind == WM_PLAY_MESSAGE ? player_monotonic_ns(self, item->t_ns) : due_ns;
  const int failed = self->sink[item->stream]->ops->send(self->sink[item->stream], item, stamp_ns);
  const wm_time_ns late_ns = wm_monotonic_ns() - due_ns;
  wm_histogram_add(&counts->late, late_ns);
  if (late_ns > atomic_load(&self->late_max_ns)) atomic_store(&self->late_max_ns, late_ns);
  if (!failed) {
    counts->sent++;
    return;
  }
  counts->failed++;
  if (!counts->first_failure) counts->first_failure = -failed;
}

static void *send_in_time(void *context) {
  player *self = context;
  waiting w;
  (void)prctl(PR_SET_NAME, "wm-play-send", 0UL, 0UL, 0UL);
  (void)prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);  // else sleeps end up to 50 us late
  while (take(self, &w)) {
    const wm_time_ns due_ns = player_monotonic_ns(self, w.item.due_ns);
    atomic_store(&self->next_ns, due_ns);
    if (sleep_until(self, due_ns)) give_out(self, &w.item, due_ns);
    atomic_store(&self->at_ns, w.item.due_ns);
    free(w.data);
  }
  atomic_store(&self->ended, 1);
  return NULL;
}

// ── both ────────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status start_threads(player *self, wm_error *err) {
  struct player_threads *t = self->threads;
  sigset_t all, before;
  (void)sigfillset(&all);  // signals are the caller's
  (void)pthread_sigmask(SIG_SETMASK, &all, &before);
  int failed = pthread_create(&t->reader, NULL, read_ahead, self);
  if (!failed) {
    failed = pthread_create(&t->sender, NULL, send_in_time, self);
    if (failed) {
      atomic_store(&self->stop, 1);
      (void)pthread_cond_broadcast(&t->changed);
      (void)pthread_join(t->reader, NULL);
    }
  }
  (void)pthread_sigmask(SIG_SETMASK, &before, NULL);
  return failed ? wm_fail(err, WM_IO, "no thread to play: %s", strerror(failed)) : WM_OK;
}

wm_status player_start(player *self, wm_error *err) {
  struct player_threads *t = self->threads = calloc(1, sizeof *t);
  if (!t) return wm_fail(err, WM_IO, "no memory to play");
  t->queue = calloc(AHEAD_ITEMS, sizeof *t->queue);
  (void)pthread_mutex_init(&t->lock, NULL);
  (void)pthread_cond_init(&t->changed, NULL);
  wm_status status = t->queue ? start_threads(self, err) : wm_fail(err, WM_IO, "no memory to play");
  if (status == WM_OK) return WM_OK;
  free(t->queue);
  free(t);
  self->threads = NULL;
  return status;
}

wm_status player_join(player *self, wm_error *err) {
  struct player_threads *t = self->threads;
  if (atomic_load(&self->stop)) {
    (void)pthread_mutex_lock(&t->lock);
    (void)pthread_cond_broadcast(&t->changed);
    (void)pthread_mutex_unlock(&t->lock);
  }
  (void)pthread_join(t->sender, NULL);
  atomic_store(&self->stop, 1);
  (void)pthread_mutex_lock(&t->lock);
  (void)pthread_cond_broadcast(&t->changed);
  (void)pthread_mutex_unlock(&t->lock);
  (void)pthread_join(t->reader, NULL);
  for (; t->count > 0; t->count--, t->first = (t->first + 1) % AHEAD_ITEMS) free(t->queue[t->first].data);
  wm_status status = t->status;
  if (status != WM_OK && err) *err = t->err;
  free(t->queue);
  free(t);
  self->threads = NULL;
  return status;
}
