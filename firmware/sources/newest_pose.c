// SPDX-License-Identifier: Apache-2.0
#include "sources/newest_pose.h"

#include <string.h>

void newest_pose_put(newest_pose *self, const wm_estimate *pose) {
  uint64_t words[NEWEST_POSE_WORDS];
  memcpy(words, pose, sizeof words);
  const uint32_t turn = atomic_load_explicit(&self->turn, memory_order_relaxed);
  atomic_store_explicit(&self->turn, turn + 1, memory_order_relaxed);
  for (size_t i = 0; i < NEWEST_POSE_WORDS; i++) {
    // Release: a reader of a new word also reads the odd turn.
    atomic_store_explicit(&self->word[i], words[i], memory_order_release);
  }
  atomic_store_explicit(&self->turn, turn + 2 ? turn + 2 : 2, memory_order_release);
}

int newest_pose_get(newest_pose *self, wm_estimate *out) {
  uint64_t words[NEWEST_POSE_WORDS];
  for (;;) {
    const uint32_t before = atomic_load_explicit(&self->turn, memory_order_acquire);
    if (before == 0) return 0;
    if (before & 1u) continue;
    for (size_t i = 0; i < NEWEST_POSE_WORDS; i++)
      words[i] = atomic_load_explicit(&self->word[i], memory_order_acquire);
    if (atomic_load_explicit(&self->turn, memory_order_relaxed) != before) continue;
    memcpy(out, words, sizeof words);
    return 1;
  }
}
