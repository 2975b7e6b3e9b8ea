// SPDX-License-Identifier: Apache-2.0
// A ring of fixed slots between exactly one producer thread and one consumer thread [Lamport1983]. No lock, no system
// call, no allocation after init. When it is full the newest record is dropped and counted. docs/runtime.md lists what
// else threads share.
#ifndef WAYMARK_RT_RING_H
#define WAYMARK_RT_RING_H

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

#include "rt/realtime.h"

#define WM_CACHE_LINE 64  // bytes on x86-64 and most ARM processors

typedef struct wm_ring {
  // Constant after init.
  uint8_t *slots;
  size_t slot_bytes;
  uint64_t mask;
  // The producer's cache line: next slot to write, and the consumer's position as last read.
  _Alignas(WM_CACHE_LINE) _Atomic uint64_t head;
  uint64_t tail_seen;
  _Atomic uint64_t dropped;
  // The consumer's cache line.
  _Alignas(WM_CACHE_LINE) _Atomic uint64_t tail;
  uint64_t head_seen;
} wm_ring;

// `slots` rounded up to a power of two, at least 1.
size_t wm_ring_slots(size_t slots);
// Bytes of memory for `slots` of `slot_bytes` each (each rounded up to 8).
size_t wm_ring_bytes(size_t slots, size_t slot_bytes);
// `memory` is 8-byte aligned, wm_ring_bytes long and outlives the ring. Before the threads start.
void wm_ring_init(wm_ring *self, void *memory, size_t slots, size_t slot_bytes);

// Producer. The next free slot, for a record of `bytes`; NULL when the ring is full or the slot too small (both
// counted). Commit follows. Constant time.
WM_REALTIME void *wm_ring_reserve(wm_ring *self, size_t bytes);
WM_REALTIME void wm_ring_commit(wm_ring *self);

// Consumer. The oldest record, or NULL when there is none; pop follows. Constant time.
WM_REALTIME const void *wm_ring_front(wm_ring *self);
WM_REALTIME void wm_ring_pop(wm_ring *self);

// Records dropped for lack of room. Any thread.
WM_REALTIME uint64_t wm_ring_dropped(const wm_ring *self);

#endif
