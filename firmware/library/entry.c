// SPDX-License-Identifier: Apache-2.0
#include "library/entry.h"

#include <stdatomic.h>
#include <stdint.h>

// A handle, from its lowest bit: 1 (no address of an object is odd), row, generation; with 64 bits a number above that
// no pointer of a program has in its high bits.
#define ROW_BITS 10
#define GENERATION_SHIFT (ROW_BITS + 1)
#if UINTPTR_MAX > UINT32_MAX
#define MAGIC_SHIFT 48
#define MAGIC ((uintptr_t)0x574d << MAGIC_SHIFT)
#define GENERATION_BITS (MAGIC_SHIFT - GENERATION_SHIFT)
#else
#define MAGIC ((uintptr_t)0)
#define GENERATION_BITS (32 - GENERATION_SHIFT)
#endif
#define GENERATION_MASK (((uintptr_t)1 << GENERATION_BITS) - 1)

_Static_assert(ENTRY_HANDLES_MAX == 1 << ROW_BITS, "a row for each handle");

// State of a row: its generation above two bits.
enum { CLOSED = 0, OPEN = 1, HELD = 2, STATE_BITS = 2 };

static struct {
  atomic_uintptr_t state;
  entry_kind kind;  // kind and object stay as they are while the row is open or held
  void *object;
} rows[ENTRY_HANDLES_MAX];
static atomic_uint next_row;

static uintptr_t state_of(uintptr_t generation, uintptr_t state) {
  return (generation & GENERATION_MASK) << STATE_BITS | state;
}

// 0: it is no handle of this library.
static int parse(const void *handle, size_t *row, uintptr_t *generation) {
  const uintptr_t value = (uintptr_t)handle;
  *row = value >> 1 & (ENTRY_HANDLES_MAX - 1);
  *generation = value >> GENERATION_SHIFT & GENERATION_MASK;
  return (value & 1) && (value & ~((((uintptr_t)1 << GENERATION_SHIFT) << GENERATION_BITS) - 1)) == MAGIC;
}

wm_status entry_check(const char *function, const entry_argument *given, wm_error *err) {
  for (; given->name; given++)
    if (!given->is_there) return wm_fail(err, WM_BAD_USAGE, "%s: `%s` is NULL", function, given->name);
  return WM_OK;
}

wm_status entry_begin(entry_kind kind, const char *function, const void *handle, const entry_argument *given,
                      void **object, wm_error *err) {
  const char *what = kind == ENTRY_SESSION ? "session" : "log";
  size_t row;
  uintptr_t generation;
  if (!handle) return wm_fail(err, WM_BAD_USAGE, "%s: `%s` is NULL: open it first", function, what);
  wm_status status = entry_check(function, given, err);
  if (status != WM_OK) return status;
  if (!parse(handle, &row, &generation) || generation == 0)
    return wm_fail(err, WM_BAD_USAGE, "%s: %p is no %s of this library", function, handle, what);
  uintptr_t expected = state_of(generation, OPEN);
  if (!atomic_compare_exchange_strong_explicit(&rows[row].state, &expected, state_of(generation, HELD),
                                               memory_order_acquire, memory_order_relaxed)) {
    if (expected == state_of(generation, HELD))
      return wm_fail(err, WM_BAD_USAGE,
                     "%s: another call of this %s has not returned: a callback may not call it, and a handle is for "
                     "one thread at a time",
                     function, what);
    return wm_fail(err, WM_BAD_USAGE, "%s: this %s was closed before", function, what);
  }
  if (rows[row].kind != kind) {
    entry_leave(handle);
    return wm_fail(err, WM_BAD_USAGE, "%s: %p is no %s of this library", function, handle, what);
  }
  *object = rows[row].object;
  return WM_OK;
}

void entry_leave(const void *handle) {
  size_t row;
  uintptr_t generation;
  (void)parse(handle, &row, &generation);
  atomic_store_explicit(&rows[row].state, state_of(generation, OPEN), memory_order_release);
}

wm_status entry_open(entry_kind kind, void *object, void **handle, wm_error *err) {
  for (size_t i = 0; i < ENTRY_HANDLES_MAX; i++) {
    const size_t row = atomic_fetch_add_explicit(&next_row, 1, memory_order_relaxed) % ENTRY_HANDLES_MAX;
    uintptr_t was = atomic_load_explicit(&rows[row].state, memory_order_relaxed);
    if ((was & (OPEN | HELD)) != CLOSED) continue;
    uintptr_t generation = ((was >> STATE_BITS) + 1) & GENERATION_MASK;
    generation += generation == 0;
    if (!atomic_compare_exchange_strong_explicit(&rows[row].state, &was, state_of(generation, HELD),
                                                 memory_order_acquire, memory_order_relaxed))
      continue;
    rows[row].kind = kind;
    rows[row].object = object;
    // Never read through: a name of the row. NOLINTNEXTLINE(performance-no-int-to-ptr)
    *handle = (void *)(MAGIC | generation << GENERATION_SHIFT | (uintptr_t)row << 1 | 1);
    entry_leave(*handle);
    return WM_OK;
  }
  return wm_fail(err, WM_FULL, "%d sessions and logs are open: close those that are done", ENTRY_HANDLES_MAX);
}

void entry_close(const void *handle) {
  size_t row;
  uintptr_t generation;
  (void)parse(handle, &row, &generation);
  rows[row].object = NULL;
  atomic_store_explicit(&rows[row].state, state_of(generation, CLOSED), memory_order_release);
}

const void *entry_look(entry_kind kind, const void *handle) {
  size_t row;
  uintptr_t generation;
  if (!handle || !parse(handle, &row, &generation) || generation == 0) return NULL;
  const uintptr_t state = atomic_load_explicit(&rows[row].state, memory_order_acquire);
  if (state != state_of(generation, OPEN) && state != state_of(generation, HELD)) return NULL;
  return rows[row].kind == kind ? rows[row].object : NULL;
}
