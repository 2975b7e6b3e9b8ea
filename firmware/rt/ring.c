// SPDX-License-Identifier: Apache-2.0
#include "rt/ring.h"

static size_t slot_size(size_t slot_bytes) { return (slot_bytes + 7) & ~(size_t)7; }

size_t wm_ring_slots(size_t slots) {
  size_t n = 1;
  while (n < slots) n *= 2;
  return n;
}

size_t wm_ring_bytes(size_t slots, size_t slot_bytes) { return wm_ring_slots(slots) * slot_size(slot_bytes); }

void wm_ring_init(wm_ring *self, void *memory, size_t slots, size_t slot_bytes) {
  self->slots = memory;
  self->slot_bytes = slot_size(slot_bytes);
  self->mask = wm_ring_slots(slots) - 1;
  self->tail_seen = 0;
  self->head_seen = 0;
  atomic_init(&self->head, 0);
  atomic_init(&self->tail, 0);
  atomic_init(&self->dropped, 0);
}

static uint8_t *slot(const wm_ring *self, uint64_t position) {
  return self->slots + (position & self->mask) * self->slot_bytes;
}

void *wm_ring_reserve(wm_ring *self, size_t bytes) {
  uint64_t head = atomic_load_explicit(&self->head, memory_order_relaxed);  // the producer's own
  if (head - self->tail_seen > self->mask) {
    // Acquire: the consumer has left the slot before it is written.
    self->tail_seen = atomic_load_explicit(&self->tail, memory_order_acquire);
  }
  if (head - self->tail_seen > self->mask || bytes > self->slot_bytes) {
    atomic_fetch_add_explicit(&self->dropped, 1, memory_order_relaxed);
    return NULL;
  }
  return slot(self, head);
}

void wm_ring_commit(wm_ring *self) {
  uint64_t head = atomic_load_explicit(&self->head, memory_order_relaxed);
  atomic_store_explicit(&self->head, head + 1, memory_order_release);  // release: the record before the position
}

const void *wm_ring_front(wm_ring *self) {
  uint64_t tail = atomic_load_explicit(&self->tail, memory_order_relaxed);  // the consumer's own
  if (tail == self->head_seen) {
    self->head_seen = atomic_load_explicit(&self->head, memory_order_acquire);
    if (tail == self->head_seen) return NULL;
  }
  return slot(self, tail);
}

void wm_ring_pop(wm_ring *self) {
  uint64_t tail = atomic_load_explicit(&self->tail, memory_order_relaxed);
  atomic_store_explicit(&self->tail, tail + 1, memory_order_release);
}

uint64_t wm_ring_dropped(const wm_ring *self) { return atomic_load_explicit(&self->dropped, memory_order_relaxed); }
