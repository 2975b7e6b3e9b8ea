// SPDX-License-Identifier: Apache-2.0
// All memory of a run, allocated once: one mmap of a size computed before the start, divided into named parts,
// prefaulted, locked and then sealed. After the seal no part can be taken. One thread, at start.
#ifndef WAYMARK_RT_ARENA_H
#define WAYMARK_RT_ARENA_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/status.h"

#define WM_ARENA_PARTS_MAX 96  // rings of 32 sources, two parts of each detector, and the rest
#define WM_ARENA_ALIGN 64      // a cache line

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

// A line of a table of needs: size, and where its address is stored.
typedef struct wm_arena_need {
  const char *name;
  size_t bytes;
  void **where;
} wm_arena_need;

// Maps `bytes` (rounded up to pages). WM_IO with the system's reason.
wm_status wm_arena_open(wm_arena *self, size_t bytes, wm_error *err);
// Zeroed memory, aligned to a cache line. WM_FULL with the size that would suffice, or because the arena is sealed.
wm_status wm_arena_take(wm_arena *self, const char *name, size_t bytes, void **out, wm_error *err);
// Prefaults every page and, where `lock`, locks them in memory. A refused lock is no failure: self->locked is then 0.
void wm_arena_seal(wm_arena *self, int lock);
void wm_arena_close(wm_arena *self);

// Bytes for a table, alignment included.
size_t wm_arena_sum(const wm_arena_need *needs, size_t count);
// Opens an arena of exactly that size, stores the table's addresses and seals it.
wm_status wm_arena_fill(wm_arena *self, const wm_arena_need *needs, size_t count, int lock, wm_error *err);

#endif
