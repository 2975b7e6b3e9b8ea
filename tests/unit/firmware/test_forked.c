// SPDX-License-Identifier: Apache-2.0
// Jobs in processes of their own.
#include <poll.h>
#include <stdint.h>
#include <stdlib.h>
#include <unistd.h>

#include "common/suite.h"
#include "rt/forked.h"

#define JOBS 5
#define LONGEST_MS 20000  // then the first job gives up, and the test fails

static int ends[2];
static size_t done_count;

void setUp(void) {
  done_count = 0;
  TEST_ASSERT_EQUAL(0, pipe(ends));
}
void tearDown(void) {
  (void)close(ends[0]);
  (void)close(ends[1]);
}

static void one_done(void *context) {
  (void)context;
  done_count++;
}

static void square(void *context, size_t index, void *result) {
  (void)context;
  if (index == 3) abort();
  *(uint64_t *)result = 100 + index * index;
}

TEST(results_at_the_places_of_their_jobs) {
  uint64_t results[JOBS];
  wm_forked_run(&(wm_forked){NULL, square, sizeof *results, one_done}, JOBS, results);
  for (size_t i = 0; i < JOBS; i++) TEST_ASSERT_EQUAL(i == 3 ? 0 : 100 + i * i, results[i]);
  TEST_ASSERT_EQUAL(JOBS, done_count);
}

TEST(no_jobs_need_no_results) {
  wm_forked_run(&(wm_forked){NULL, square, sizeof(uint64_t), one_done}, 0, NULL);
  TEST_ASSERT_EQUAL(0, done_count);
}

// The first job ends after the last one.
static void wait_for_last(void *context, size_t index, void *result) {
  (void)context;
  struct pollfd end = {.fd = ends[0], .events = POLLIN};
  char byte = 1;
  if (index == 0) *(uint64_t *)result = poll(&end, 1, LONGEST_MS) == 1;
  if (index > 0) *(uint64_t *)result = index + 1;
  if (index == JOBS - 1) (void)!write(ends[1], &byte, 1);
}

TEST(a_long_job_holds_no_other_back) {
  uint64_t results[JOBS];
  if (sysconf(_SC_NPROCESSORS_ONLN) < 2) TEST_IGNORE_MESSAGE("one processor");
  wm_forked_run(&(wm_forked){NULL, wait_for_last, sizeof *results, NULL}, JOBS, results);
  for (size_t i = 0; i < JOBS; i++) TEST_ASSERT_EQUAL(i + 1, results[i]);
}
