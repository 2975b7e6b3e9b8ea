// SPDX-License-Identifier: Apache-2.0
// A thread that was held up while messages came over LCM: it gets all of a second's, and more are no silent loss.
// Needs the right to a network of its own (else 77).
#include <sched.h>
#include <time.h>

#include "common/suite.h"
#include "live/lcm_connect.h"
#include "live/lcm_subscriber.h"
#include "rt/clock.h"

#define URL "udpm://239.255.76.67:7667?ttl=0"

static lcm_subscriber subscriber;
static wm_source_counts counts;
static lcm_t *sender;
static int heard;

static void hear(const lcm_recv_buf_t *message, const char *name, void *context) {
  (void)message, (void)name, (void)context;
  heard++;
}

static void subscribe(lcm_subscriber *self) { lcm_subscriber_add(self, "IMU", hear, NULL); }

static void sleep_ms(long ms) {
  struct timespec duration = {.tv_nsec = ms * 1000000};
  (void)nanosleep(&duration, NULL);
}

// In bursts that the kernel's buffer holds.
static void send(int count) {
  for (int i = 0; i < count; i++) {
    TEST_ASSERT_EQUAL(0, lcm_publish(sender, "T_IMU", "12345678", 8));
    if (i % 20 == 0) sleep_ms(2);
  }
  sleep_ms(200);
}

static void hear_all(void) {
  for (int before = -1; before != heard;) {
    before = heard;
    lcm_subscriber_wait(&subscriber, &counts);
  }
}

void setUp(void) {
  const char *why = "";
  counts = (wm_source_counts){0};
  heard = 0;
  lcm_subscriber_open(&subscriber, URL, "T_", NULL, subscribe);
  lcm_subscriber_wait(&subscriber, &counts);
  TEST_ASSERT_NOT_NULL(subscriber.lcm);
  sender = lcm_connect(URL, &why);
  TEST_ASSERT_NOT_NULL_MESSAGE(sender, why);
}

void tearDown(void) {
  lcm_destroy(sender);
  lcm_subscriber_close(&subscriber);
}

TEST(a_second_of_an_imu_waits) {
  for (int round = 1; round <= 3; round++) {
    send(900);
    hear_all();
    TEST_ASSERT_EQUAL(900 * round, heard);
  }
  TEST_ASSERT_EQUAL_UINT64(0, counts.overflows);
}

TEST(more_than_that_is_counted) {
  send(1500);
  hear_all();
  TEST_ASSERT_EQUAL(LCM_QUEUED + 1, heard);  // LCM keeps one more than the capacity
  TEST_ASSERT_EQUAL_UINT64(1, counts.overflows);
  send(10);
  hear_all();
  TEST_ASSERT_EQUAL(LCM_QUEUED + 11, heard);
  TEST_ASSERT_EQUAL_UINT64(1, counts.overflows);
}

int suite_begin(int argc, char **argv) {
  (void)argc, (void)argv;
  if (unshare(CLONE_NEWNET) != 0 || system("ip link set lo up && ip route add 224.0.0.0/4 dev lo") != 0) {
    (void)printf("skipped: no right to a network of its own, or no ip\n");
    return 77;
  }
  return SUITE_RUNS;
}
