// SPDX-License-Identifier: Apache-2.0
// The newest pose for detectors: each read is of one write, also where the count of writes wraps.
#include <pthread.h>

#include "common/suite.h"
#include "sources/newest_pose.h"

#define WRITES 400000

static newest_pose newest;

static void put(wm_time_ns t_ns) {
  wm_estimate e = {.t_ns = t_ns};
  for (int i = 0; i < 36; i++) e.covariance[i] = (double)t_ns;
  newest_pose_put(&newest, &e);
}

TEST(the_newest_is_read) {
  wm_estimate e;
  newest = (newest_pose){0};
  TEST_ASSERT_EQUAL(0, newest_pose_get(&newest, &e));
  for (wm_time_ns t_ns = 1; t_ns < 4; t_ns++) {
    put(t_ns);
    TEST_ASSERT_EQUAL(1, newest_pose_get(&newest, &e));
    TEST_ASSERT_EQUAL_INT64(t_ns, e.t_ns);
    TEST_ASSERT_EQUAL_DOUBLE((double)t_ns, e.covariance[35]);
  }
}

// A turn of 0 means that there is no pose yet: the count never comes back to it.
TEST(after_its_count_wraps_there_is_a_pose) {
  wm_estimate e;
  newest = (newest_pose){0};
  atomic_store(&newest.turn, UINT32_MAX - 5);  // even, as between two writes
  for (wm_time_ns t_ns = 1; t_ns < 8; t_ns++) {
    put(t_ns);
    TEST_ASSERT_EQUAL(1, newest_pose_get(&newest, &e));
    TEST_ASSERT_EQUAL_INT64(t_ns, e.t_ns);
  }
  TEST_ASSERT_LESS_THAN_UINT32(100, atomic_load(&newest.turn));
}

static void *writes(void *nothing) {
  for (wm_time_ns t_ns = 1; t_ns <= WRITES; t_ns++) put(t_ns);
  return nothing;
}

TEST(a_reader_sees_whole_poses_while_the_count_wraps) {
  pthread_t writer;
  wm_estimate e = {.t_ns = 0};
  wm_time_ns before_ns = 0;
  newest = (newest_pose){0};
  put(0);
  atomic_store(&newest.turn, UINT32_MAX - WRITES + 1 - WRITES % 2);
  TEST_ASSERT_EQUAL(0, atomic_load(&newest.turn) % 2);
  TEST_ASSERT_EQUAL(0, pthread_create(&writer, NULL, writes, NULL));
  while (e.t_ns < WRITES) {
    TEST_ASSERT_EQUAL(1, newest_pose_get(&newest, &e));
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(before_ns, e.t_ns);
    for (int i = 0; i < 36; i++) TEST_ASSERT_EQUAL_DOUBLE((double)e.t_ns, e.covariance[i]);
    before_ns = e.t_ns;
  }
  TEST_ASSERT_EQUAL(0, pthread_join(writer, NULL));
  TEST_ASSERT_LESS_THAN_UINT32(2 * WRITES, atomic_load(&newest.turn));
}
