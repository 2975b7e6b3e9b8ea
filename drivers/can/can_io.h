// SPDX-License-Identifier: Apache-2.0
// The system calls of a CAN device as a table: SocketCAN's, or a test's.
#ifndef WM_CAN_IO_H
#define WM_CAN_IO_H

#include <sys/socket.h>

#include "waymark/can.h"

// The result of one reading of the socket.
typedef struct can_received {
  wm_can_frame frame;      // t_ns unset
  wm_time_ns software_ns;  // CLOCK_REALTIME, by the kernel at reception; 0: none
  wm_time_ns hardware_ns;  // the adapter's own clock; 0: none
  uint32_t queue_dropped;  // frames that the socket's queue lost since it was opened (SO_RXQ_OVFL)
  int has_queue_dropped;
} can_received;

typedef struct can_io {
  // Index of the interface of this name, 0 without one; *is_up by its flags.
  unsigned (*find)(void *context, const char *interface, int *is_up);
  // A bound raw socket for these frames (none: for all) and all error frames: its number, or -errno.
  int (*open)(void *context, unsigned interface_index, const wm_can_match *filters, size_t count);
  // 1: *out is filled; 0: no frame within `wait_ms`; -errno.
  int (*receive)(void *context, int socket, int wait_ms, can_received *out);
  void (*close)(void *context, int socket);
  void (*sleep_ms)(void *context, int ms);
  wm_time_ns (*monotonic_ns)(void *context);
  wm_time_ns (*realtime_ns)(void *context);
} can_io;

extern const can_io kSocketCan;

// The kernel reserves about 0.8 kB for a frame, and twice the requested bytes: half a second of a full bus of 500
// kbit/s.
#define CAN_QUEUE_BYTES (1 << 20)
// Requests so many bytes for a socket's queue, beyond the limit where allowed. Returns the granted bytes.
int can_queue_grow(int socket, int bytes);

// Parses a message of `bytes` bytes from the kernel (struct can_frame or canfd_frame, stamps and drop count in the
// control data) into *out. 0 where it is none. Pure.
int can_message_read(const struct msghdr *message, size_t bytes, can_received *out);

#endif
