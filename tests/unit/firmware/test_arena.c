// SPDX-License-Identifier: Apache-2.0
#include <pthread.h>

#include "common/suite.h"
#include "rt/arena.h"
#include "rt/histogram.h"
#include "rt/memory.h"

static wm_arena arena;
static wm_error err;

TEST(parts_are_aligned_zeroed_and_apart) {
  void *a, *b;
  wm_arena_need needs[] = {{"a", 100, &a}, {"b", 1 << 20, &b}};
  TEST_ASSERT_EQUAL(WM_OK, wm_arena_fill(&arena, needs, 2, 0, &err));
  TEST_ASSERT_EQUAL(0, (uintptr_t)a % 64);
  TEST_ASSERT_EQUAL(0, (uintptr_t)b % 64);
  TEST_ASSERT_TRUE((uint8_t *)b >= (uint8_t *)a + 100);
  for (size_t i = 0; i < 1 << 20; i++) TEST_ASSERT_EQUAL(0, ((uint8_t *)b)[i]);
  TEST_ASSERT_EQUAL_STRING("b", arena.parts[1].name);
  wm_arena_close(&arena);
}

TEST(after_the_seal_nothing_is_given) {
  void *a;
  wm_arena_need needs[] = {{"a", 100, &a}};
  TEST_ASSERT_EQUAL(WM_OK, wm_arena_fill(&arena, needs, 1, 0, &err));
  TEST_ASSERT_EQUAL(WM_FULL, wm_arena_take(&arena, "late", 8, &a, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "'late' needs 8 bytes after the start"));
  wm_arena_close(&arena);
}

TEST(what_does_not_fit_is_told_the_number_that_would) {
  void *a;
  TEST_ASSERT_EQUAL(WM_OK, wm_arena_open(&arena, 4096, &err));
  TEST_ASSERT_EQUAL(WM_OK, wm_arena_take(&arena, "a", 4000, &a, &err));
  TEST_ASSERT_EQUAL(WM_FULL, wm_arena_take(&arena, "b", 640, &a, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "4672 would suffice"));
  TEST_ASSERT_EQUAL(WM_FULL, wm_arena_take(&arena, "c", SIZE_MAX, &a, &err));
  wm_arena_close(&arena);
}

TEST(touched_memory_faults_no_more) {
  void *a;
  wm_arena_need needs[] = {{"a", 8 << 20, &a}};
  TEST_ASSERT_EQUAL(WM_OK, wm_arena_fill(&arena, needs, 1, 0, &err));
  int64_t before = wm_page_faults_of_this_thread();
  for (size_t i = 0; i < 8 << 20; i += 64) ((volatile uint8_t *)a)[i] = 1;
  int64_t faults = wm_page_faults_of_this_thread() - before;
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  TEST_ASSERT_LESS_OR_EQUAL(1, faults);
#else
  (void)faults;
#endif
  wm_arena_close(&arena);
}

static void *allocate_elsewhere(void *out) {
  int64_t before = wm_allocations_of_this_thread();
  void *volatile p = malloc(10);
  p = realloc(p, 20);
  void *volatile q = calloc(1, 3);
  *(int64_t *)out = wm_allocations_of_this_thread() - before;
  free(p);
  free(q);
  return NULL;
}

TEST(allocations_are_counted_for_each_thread) {
  if (wm_allocations_of_this_thread() < 0) TEST_IGNORE_MESSAGE("a sanitizer's malloc is in place");
  pthread_t thread;
  int64_t there = -1;
  TEST_ASSERT_EQUAL(0, pthread_create(&thread, NULL, allocate_elsewhere, &there));
  pthread_join(thread, NULL);
  int64_t before = wm_allocations_of_this_thread();
  TEST_ASSERT_EQUAL_INT64(3, there);
  TEST_ASSERT_EQUAL_INT64(before, wm_allocations_of_this_thread());
  void *volatile p = malloc(1);
  TEST_ASSERT_EQUAL_INT64(before + 1, wm_allocations_of_this_thread());
  free(p);
}

TEST(quantiles_are_within_six_per_cent) {
  static wm_histogram h;
  for (wm_time_ns v = 1; v <= 100000; v++) wm_histogram_add(&h, v);
  TEST_ASSERT_EQUAL_UINT64(100000, h.count);
  TEST_ASSERT_DOUBLE_WITHIN(0.065 * 50000, 50000, (double)wm_histogram_quantile(&h, 0.5));
  TEST_ASSERT_DOUBLE_WITHIN(0.065 * 99000, 99000, (double)wm_histogram_quantile(&h, 0.99));
  TEST_ASSERT_EQUAL_INT64(100000, wm_histogram_quantile(&h, 1.0));
  wm_histogram_add(&h, INT64_MAX);
  wm_histogram_add(&h, -5);
  TEST_ASSERT_EQUAL_INT64(INT64_MAX, h.max_ns);
}
