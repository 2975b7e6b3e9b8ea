// SPDX-License-Identifier: Apache-2.0
// All memory of a run, taken once: one mmap whose size is known before the start, handed out in named parts, touched,
// locked and then sealed. After the seal nothing more is given. One thread, at start.
#ifndef WAYMARK_RT_ARENA_H
#define WAYMARK_RT_ARENA_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/status.h"

#define WM_ARENA_PARTS_MAX 96
#define WM_ARENA_ALIGN 64

typedef struct wm_arena_part {
  char name[40];
  size_t bytes;
} wm_arena_part;

typedef struct wm_arena {
  uint8_t *base;
  size_t bytes, used;
  wm_arena_part parts[WM_ARENA_PARTS_MAX];
  size_t part_count;
  int sealed;
  int locked;
} wm_arena;

// A line of a table of needs: how much, and where its address goes.
typedef struct wm_arena_need {
  const char *name;
  size_t bytes;
  void **where;
} wm_arena_need;

// Maps `bytes` (rounded up to pages). WM_IO with the system's reason.
wm_status wm_arena_open(wm_arena *self, size_t bytes, wm_error *err);
// Zeroed memory, aligned to a cache line. WM_FULL with the number that would do, or because the arena is sealed.
wm_status wm_arena_take(wm_arena *self, const char *name, size_t bytes, void **out, wm_error *err);
// Touches every page and, where `lock`, keeps them in memory. A lock that isn't allowed is no failure: self->locked
// says how it went.
void wm_arena_seal(wm_arena *self, int lock);
void wm_arena_close(wm_arena *self);

// Bytes that a table needs, alignment included.
size_t wm_arena_sum(const wm_arena_need *needs, size_t count);
// Opens an arena of exactly that size, fills the table's addresses and seals it.
wm_status wm_arena_fill(wm_arena *self, const wm_arena_need *needs, size_t count, int lock, wm_error *err);

#endif
