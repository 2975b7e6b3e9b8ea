// SPDX-License-Identifier: Apache-2.0
#include <pthread.h>
#include <sched.h>

#include "common/suite.h"
#include "rt/ring.h"

typedef struct record {
  uint64_t number, copies[7];
} record;

static _Alignas(64) uint8_t memory[1 << 16];
static wm_ring ring;

static int push(uint64_t number) {
  record *slot = wm_ring_reserve(&ring, sizeof(record));
  if (!slot) return 0;
  slot->number = number;
  for (int i = 0; i < 7; i++) slot->copies[i] = number * 3;
  wm_ring_commit(&ring);
  return 1;
}

TEST(it_hands_out_in_order_and_then_nothing) {
  wm_ring_init(&ring, memory, 8, sizeof(record));
  TEST_ASSERT_NULL(wm_ring_front(&ring));
  for (uint64_t round = 0; round < 100; round++) {
    for (uint64_t i = 0; i < 5; i++) TEST_ASSERT_TRUE(push(round * 5 + i));
    for (uint64_t i = 0; i < 5; i++) {
      const record *r = wm_ring_front(&ring);
      TEST_ASSERT_NOT_NULL(r);
      TEST_ASSERT_EQUAL_UINT64(round * 5 + i, r->number);
      wm_ring_pop(&ring);
    }
    TEST_ASSERT_NULL(wm_ring_front(&ring));
  }
}

TEST(when_full_the_newest_is_dropped_and_counted) {
  wm_ring_init(&ring, memory, 8, sizeof(record));
  for (uint64_t i = 0; i < 8; i++) TEST_ASSERT_TRUE(push(i));
  TEST_ASSERT_FALSE(push(8));
  TEST_ASSERT_FALSE(push(9));
  TEST_ASSERT_EQUAL_UINT64(2, wm_ring_dropped(&ring));
  TEST_ASSERT_EQUAL_UINT64(0, ((const record *)wm_ring_front(&ring))->number);
  wm_ring_pop(&ring);
  TEST_ASSERT_TRUE(push(10));
}

TEST(a_ring_of_one_slot_holds_one_record) {
  static uint8_t few[64];
  wm_ring_init(&ring, few, 1, sizeof(record));
  TEST_ASSERT_TRUE(push(1));
  TEST_ASSERT_FALSE(push(2));
  TEST_ASSERT_EQUAL_UINT64(1, ((const record *)wm_ring_front(&ring))->number);
  TEST_ASSERT_FALSE(push(3));  // still being read
  wm_ring_pop(&ring);
  TEST_ASSERT_TRUE(push(4));
  TEST_ASSERT_EQUAL_UINT64(2, wm_ring_dropped(&ring));
}

TEST(a_record_larger_than_a_slot_finds_no_place) {
  static uint8_t few[64];
  wm_ring_init(&ring, few, 2, sizeof(record));
  TEST_ASSERT_NULL(wm_ring_reserve(&ring, ring.slot_bytes + 1));
  TEST_ASSERT_EQUAL_UINT64(1, wm_ring_dropped(&ring));
  TEST_ASSERT_TRUE(push(1));
}

TEST(slots_are_a_power_of_two) {
  TEST_ASSERT_EQUAL(1, wm_ring_slots(0));
  TEST_ASSERT_EQUAL(8, wm_ring_slots(5));
  TEST_ASSERT_EQUAL(8, wm_ring_slots(8));
  TEST_ASSERT_EQUAL(8 * 16, wm_ring_bytes(7, 9));
}

#define STRESS UINT64_C(400000)

static void *producer(void *unused) {
  (void)unused;
  for (uint64_t i = 0; i < STRESS;) {
    if (push(i)) {
      i++;
    } else {
      sched_yield();
    }
  }
  return NULL;
}

TEST(two_threads_lose_nothing_and_see_whole_records) {
  wm_ring_init(&ring, memory, 64, sizeof(record));
  pthread_t thread;
  TEST_ASSERT_EQUAL(0, pthread_create(&thread, NULL, producer, NULL));
  uint64_t wrong = 0;
  for (uint64_t i = 0; i < STRESS;) {
    const record *r = wm_ring_front(&ring);
    if (!r) {
      sched_yield();
      continue;
    }
    if (r->number != i) wrong++;
    for (int k = 0; k < 7; k++)
      if (r->copies[k] != i * 3) wrong++;
    wm_ring_pop(&ring);
    i++;
  }
  pthread_join(thread, NULL);
  TEST_ASSERT_EQUAL_UINT64(0, wrong);
}
