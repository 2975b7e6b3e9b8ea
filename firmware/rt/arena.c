// SPDX-License-Identifier: Apache-2.0
#include "rt/arena.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

static size_t round_up(size_t bytes, size_t to) { return (bytes + to - 1) / to * to; }

wm_status wm_arena_open(wm_arena *self, size_t bytes, wm_error *err) {
  memset(self, 0, sizeof *self);
  size_t size = round_up(bytes ? bytes : 1, (size_t)sysconf(_SC_PAGESIZE));
  void *base = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (base == MAP_FAILED)
    return wm_fail(err, WM_IO,
                   "memory: %zu bytes are needed and the system refused: %s; smaller queues and rings "
                   "(merge.queue_events, realtime.ring_events) need less",
                   size, strerror(errno));
  self->base = base;
  self->bytes = size;
  return WM_OK;
}

wm_status wm_arena_take(wm_arena *self, const char *name, size_t bytes, void **out, wm_error *err) {
  if (self->sealed)
    return wm_fail(err, WM_FULL, "memory: '%s' needs %zu bytes after the start, but all memory is allocated before",
                   name, bytes);
  size_t need = round_up(bytes, WM_ARENA_ALIGN);
  if (need < bytes || need > self->bytes - self->used)
    return wm_fail(err, WM_FULL, "memory: '%s' needs %zu bytes and %zu of %zu are left; %zu would suffice", name, bytes,
                   self->bytes - self->used, self->bytes, self->used + need);
  if (self->part_count == WM_ARENA_PARTS_MAX)
    return wm_fail(err, WM_FULL, "memory: '%s' would be part %d; %d are possible", name, WM_ARENA_PARTS_MAX + 1,
                   WM_ARENA_PARTS_MAX);
  wm_arena_part *part = &self->parts[self->part_count++];
  (void)snprintf(part->name, sizeof part->name, "%s", name);
  part->bytes = bytes;
  *out = self->base + self->used;
  self->used += need;
  return WM_OK;
}

void wm_arena_seal(wm_arena *self, int lock) {
  memset(self->base + self->used, 0, self->bytes - self->used);
  volatile uint8_t *byte = self->base;
  size_t page = (size_t)sysconf(_SC_PAGESIZE);
  for (size_t i = 0; i < self->bytes; i += page) byte[i] = byte[i];  // present even where MAP_POPULATE found no memory
  if (lock) self->locked = mlock(self->base, self->bytes) == 0;
  self->sealed = 1;
}

void wm_arena_close(wm_arena *self) {
  if (self->base) munmap(self->base, self->bytes);
  memset(self, 0, sizeof *self);
}

size_t wm_arena_sum(const wm_arena_need *needs, size_t count) {
  size_t sum = 0;
  for (size_t i = 0; i < count; i++) sum += round_up(needs[i].bytes, WM_ARENA_ALIGN);
  return sum;
}

wm_status wm_arena_fill(wm_arena *self, const wm_arena_need *needs, size_t count, int lock, wm_error *err) {
  wm_status status = wm_arena_open(self, wm_arena_sum(needs, count), err);
  for (size_t i = 0; status == WM_OK && i < count; i++)
    status = wm_arena_take(self, needs[i].name, needs[i].bytes, needs[i].where, err);
  if (status == WM_OK) {
    wm_arena_seal(self, lock);
  } else {
    wm_arena_close(self);
  }
  return status;
}
