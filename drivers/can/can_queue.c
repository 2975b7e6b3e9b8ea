// SPDX-License-Identifier: Apache-2.0
#include <linux/can.h>
#include <sys/socket.h>
#include <unistd.h>

#include "can_io.h"
#include "waymark/devices.h"

// Without the right to more (CAP_NET_ADMIN) the kernel grants net.core.rmem_max at most, without an error.
int can_queue_grow(int fd, int bytes) {
  int granted = 0;
  socklen_t length = sizeof granted;
  if (setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes) != 0)
    (void)setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
  if (getsockopt(fd, SOL_SOCKET, SO_RCVBUF, &granted, &length) != 0) return 0;
  return granted / 2;
}

int wm_can_queue_bytes(int *wanted) {
  int fd = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  *wanted = CAN_QUEUE_BYTES;
  if (fd < 0) return 0;
  int granted = can_queue_grow(fd, CAN_QUEUE_BYTES);
  (void)close(fd);
  return granted;
}
