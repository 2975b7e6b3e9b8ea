// SPDX-License-Identifier: Apache-2.0
// SocketCAN by system calls. Sources: the kernel's Documentation/networking/can.rst and timestamping.rst.
#include <time.h>  // before errqueue.h, which needs it

#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <net/if.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "can_io.h"

static unsigned find_interface(void *context, const char *interface, int *is_up) {
  (void)context;
  struct ifreq request = {0};
  unsigned index = if_nametoindex(interface);
  *is_up = 0;
  if (index == 0) return 0;
  (void)snprintf(request.ifr_name, sizeof request.ifr_name, "%s", interface);
  int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return index;
  *is_up = ioctl(fd, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP);
  (void)close(fd);
  return index;
}

// Kernel filters for the bound ids. With more ids than the kernel takes, all frames pass, and the decoder sorts them
// out.
static int set_filters(int fd, const wm_can_match *wanted, size_t count) {
  struct can_filter filters[CAN_RAW_FILTER_MAX];
  if (count == 0 || count > CAN_RAW_FILTER_MAX) return 0;
  for (size_t i = 0; i < count; i++) {
    filters[i].can_id = wanted[i].id | (wanted[i].is_extended ? CAN_EFF_FLAG : 0);
    filters[i].can_mask = wanted[i].mask | CAN_EFF_FLAG | CAN_RTR_FLAG;
  }
  return setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters, (socklen_t)(count * sizeof filters[0]));
}

// Optional socket options: failures on an old kernel or adapter are ignored. Only the filters are mandatory.
static void ask_for_more(int fd) {
  int one = 1;
  can_err_mask_t errors = CAN_ERR_MASK;
  int stamps = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE | SOF_TIMESTAMPING_RX_HARDWARE |
               SOF_TIMESTAMPING_RAW_HARDWARE;
  (void)setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &one, sizeof one);
  (void)setsockopt(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
  (void)setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPING, &stamps, sizeof stamps);
  (void)setsockopt(fd, SOL_SOCKET, SO_RXQ_OVFL, &one, sizeof one);
  (void)can_queue_grow(fd, CAN_QUEUE_BYTES);
}

static int open_socket(void *context, unsigned interface_index, const wm_can_match *filters, size_t count) {
  (void)context;
  int fd = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW);
  if (fd < 0) return -errno;
  ask_for_more(fd);
  struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = (int)interface_index};
  if (set_filters(fd, filters, count) != 0 || bind(fd, (const struct sockaddr *)&address, sizeof address) != 0) {
    int reason = errno;
    (void)close(fd);
    return -reason;
  }
  return fd;
}

static wm_time_ns ns_of(const struct timespec *t) { return (wm_time_ns)t->tv_sec * WM_NS_PER_S + t->tv_nsec; }

static void read_beside(const struct msghdr *message, can_received *out) {
  struct msghdr *m = (struct msghdr *)message;  // CMSG_NXTHDR only reads it
  for (struct cmsghdr *c = CMSG_FIRSTHDR(m); c; c = CMSG_NXTHDR(m, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SO_TIMESTAMPING && c->cmsg_len >= CMSG_LEN(sizeof(struct scm_timestamping))) {
      struct scm_timestamping stamps;
      memcpy(&stamps, CMSG_DATA(c), sizeof stamps);
      out->software_ns = ns_of(&stamps.ts[0]);
      out->hardware_ns = ns_of(&stamps.ts[2]);
    } else if (c->cmsg_type == SO_RXQ_OVFL && c->cmsg_len >= CMSG_LEN(sizeof out->queue_dropped)) {
      memcpy(&out->queue_dropped, CMSG_DATA(c), sizeof out->queue_dropped);
      out->has_queue_dropped = 1;
    }
  }
}

int can_message_read(const struct msghdr *message, size_t bytes, can_received *out) {
  struct canfd_frame raw;  // a classic frame begins the same
  memset(out, 0, sizeof *out);
  if (message->msg_iovlen != 1 || (bytes != CAN_MTU && bytes != CANFD_MTU)) return 0;
  memset(&raw, 0, sizeof raw);
  memcpy(&raw, message->msg_iov[0].iov_base, bytes);
  wm_can_frame *frame = &out->frame;
  frame->is_fd = bytes == CANFD_MTU;
  frame->is_error = (raw.can_id & CAN_ERR_FLAG) != 0;
  frame->is_remote = (raw.can_id & CAN_RTR_FLAG) != 0;
  frame->is_extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  frame->id = raw.can_id & (frame->is_error || frame->is_extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame->fd_flags = frame->is_fd ? raw.flags & 0x0f : 0;
  size_t most = frame->is_fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN;
  frame->length = (uint8_t)(raw.len < most ? raw.len : most);
  if (!frame->is_remote) memcpy(frame->data, raw.data, frame->length);
  read_beside(message, out);
  return 1;
}

static int receive(void *context, int fd, int wait_ms, can_received *out) {
  (void)context;
  struct canfd_frame frame;
  _Alignas(struct cmsghdr) char beside[256];
  struct iovec io = {&frame, sizeof frame};
  for (int waited = 0;; waited = 1) {
    struct msghdr message = {.msg_iov = &io, .msg_iovlen = 1, .msg_control = beside, .msg_controllen = sizeof beside};
    ssize_t bytes = recvmsg(fd, &message, MSG_DONTWAIT);
    if (bytes >= 0) return can_message_read(&message, (size_t)bytes, out);
    if (errno == EINTR) continue;
    if (errno != EAGAIN) return -errno;
    if (waited) return 0;
    struct pollfd waiting = {.fd = fd, .events = POLLIN};
    if (poll(&waiting, 1, wait_ms) <= 0) return 0;
  }
}

static void close_socket(void *context, int fd) {
  (void)context;
  (void)close(fd);
}

static void sleep_ms(void *context, int ms) {
  (void)context;
  struct timespec duration = {.tv_sec = ms / 1000, .tv_nsec = (long)(ms % 1000) * 1000000};
  (void)nanosleep(&duration, NULL);
}

static wm_time_ns clock_ns(clockid_t clock) {
  struct timespec now;
  clock_gettime(clock, &now);
  return ns_of(&now);
}

static wm_time_ns monotonic_ns(void *context) {
  (void)context;
  return clock_ns(CLOCK_MONOTONIC);
}

static wm_time_ns realtime_ns(void *context) {
  (void)context;
  return clock_ns(CLOCK_REALTIME);
}

const can_io kSocketCan = {find_interface, open_socket, receive, close_socket, sleep_ms, monotonic_ns, realtime_ns};
