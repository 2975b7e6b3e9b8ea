// SPDX-License-Identifier: Apache-2.0
// What the kernel grants a socket's queue is read back, on a socket that every kernel has.
#include <sys/socket.h>
#include <unistd.h>

#include "can_io.h"
#include "common/suite.h"
#include "waymark/devices.h"

static int granted_of(int bytes) {
  int fd = socket(AF_UNIX, SOCK_DGRAM, 0), there = 0;
  socklen_t length = sizeof there;
  TEST_ASSERT_GREATER_OR_EQUAL(0, fd);
  const int granted = can_queue_grow(fd, bytes);
  TEST_ASSERT_EQUAL(0, getsockopt(fd, SOL_SOCKET, SO_RCVBUF, &there, &length));
  TEST_ASSERT_EQUAL(there / 2, granted);
  (void)close(fd);
  return granted;
}

TEST(what_is_granted_is_read_back) {
  TEST_ASSERT_EQUAL(60000, granted_of(60000));
  TEST_ASSERT_EQUAL(0, can_queue_grow(-1, 60000));
}

TEST(a_kernel_without_can_grants_nothing) {
  int wanted = 0, fd = socket(AF_CAN, SOCK_RAW, 1), granted = wm_can_queue_bytes(&wanted);
  TEST_ASSERT_EQUAL(CAN_QUEUE_BYTES, wanted);
  if (fd < 0) TEST_ASSERT_EQUAL(0, granted);
  if (fd >= 0) TEST_ASSERT_GREATER_THAN(0, granted);
  if (fd >= 0) (void)close(fd);
}
