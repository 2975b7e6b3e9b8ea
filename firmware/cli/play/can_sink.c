// SPDX-License-Identifier: Apache-2.0
// Frames into a SocketCAN interface.
#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/ethtool.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "cli/play/sink.h"

#define FULL_WAIT_NS 200000  // a frame of 8 bytes takes 0.22 ms at 500 kbit/s
#define FULL_TRIES_MAX 500   // 0.1 s

typedef struct can_sink {
  play_sink base;
  char interface[IFNAMSIZ];
  int fd;
  int is_virtual;  // takes error frames
} can_sink;

static void name_request(struct ifreq *r, const char *interface) {
  memset(r, 0, sizeof *r);
  (void)snprintf(r->ifr_name, sizeof r->ifr_name, "%s", interface);
}

// Error frames come from a controller; only virtual interfaces carry those that a program sends.
static int is_virtual(int fd, const char *interface) {
  struct ifreq r;
  struct ethtool_drvinfo about = {.cmd = ETHTOOL_GDRVINFO};
  name_request(&r, interface);
  r.ifr_data = (char *)&about;
  if (ioctl(fd, SIOCETHTOOL, &r) == 0 && about.driver[0])
    return strcmp(about.driver, "vcan") == 0 || strcmp(about.driver, "vxcan") == 0;
  return strncmp(interface, "vcan", 4) == 0 || strncmp(interface, "vxcan", 5) == 0;
}

static int write_frame(can_sink *self, const struct canfd_frame *raw, size_t bytes) {
  for (int tries = 0;; tries++) {
    if (write(self->fd, raw, bytes) == (ssize_t)bytes) return 0;
    if (errno == ENETDOWN && tries == 0) continue;  // of the past: a socket keeps it until it is reported once
    if ((errno != ENOBUFS && errno != EAGAIN && errno != EINTR) || tries == FULL_TRIES_MAX) return -errno;
    const struct timespec a_while = {.tv_nsec = FULL_WAIT_NS};  // its queue is full: the bus is slower
    (void)nanosleep(&a_while, NULL);
  }
}

static int send_frame(play_sink *base, wm_play_item *item, wm_time_ns stamp_ns) {
  can_sink *self = (can_sink *)base;
  const wm_can_frame *frame = &item->frame;
  struct canfd_frame raw = {.can_id = frame->id, .len = frame->length};
  (void)stamp_ns;
  if (frame->is_error && !self->is_virtual) return -EOPNOTSUPP;
  if (frame->is_extended) raw.can_id |= CAN_EFF_FLAG;
  if (frame->is_remote) raw.can_id |= CAN_RTR_FLAG;
  if (frame->is_error) raw.can_id |= CAN_ERR_FLAG;
  if (frame->is_fd) raw.flags = frame->fd_flags;
  memcpy(raw.data, frame->data, frame->length);
  return write_frame(self, &raw, frame->is_fd ? CANFD_MTU : CAN_MTU);
}

static int set_up(const can_sink *self, const char *interface, int up) {
  struct ifreq r;
  name_request(&r, interface);
  if (ioctl(self->fd, SIOCGIFFLAGS, &r) != 0) return -errno;
  r.ifr_flags = (short)(up ? r.ifr_flags | IFF_UP : r.ifr_flags & ~IFF_UP);
  return ioctl(self->fd, SIOCSIFFLAGS, &r) == 0 ? 0 : -errno;
}

static const char *interface_of(const can_sink *self, const wm_fault *fault) {
  return fault->text[0] ? fault->text : self->interface;
}

static int cause(play_sink *base, const wm_fault *fault, int begins) {
  can_sink *self = (can_sink *)base;
  if (fault->kind == WM_FAULT_BUS_DOWN) return set_up(self, interface_of(self, fault), !begins);
  if (fault->kind != WM_FAULT_BUS_OFF) return 0;
  const struct canfd_frame raw = {.can_id = CAN_ERR_FLAG | (begins ? CAN_ERR_BUSOFF : CAN_ERR_RESTARTED),
                                  .len = CAN_ERR_DLC};
  return write_frame(self, &raw, CAN_MTU);
}

static const char *lacks(play_sink *base, const wm_fault *fault, char *text, size_t room) {
  can_sink *self = (can_sink *)base;
  if (fault->kind == WM_FAULT_BUS_OFF && !self->is_virtual) {
    (void)snprintf(text, room, "%s is not a virtual interface; error frames can be sent on virtual ones only",
                   self->interface);
    return text;
  }
  if (fault->kind != WM_FAULT_BUS_DOWN) return NULL;
  const int failed = set_up(self, interface_of(self, fault), 1);
  if (!failed) return NULL;
  (void)snprintf(text, room, "%s can't be set down and up: %s%s", interface_of(self, fault), strerror(-failed),
                 failed == -EPERM ? "; run it as root, or `setcap cap_net_admin+ep` the program" : "");
  return text;
}

static void close_sink(play_sink *base) {
  (void)close(((can_sink *)base)->fd);
  free(base);
}

static const play_sink_ops kCan = {send_frame, cause, lacks, close_sink};

static wm_status open_socket(can_sink *self, wm_error *err) {
  const int yes = 1;
  struct ifreq r;
  self->fd = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  if (self->fd < 0)
    return wm_fail(err, WM_IO, "%s: this kernel has no SocketCAN (`modprobe can-raw`): %s", self->interface,
                   strerror(errno));
  const struct sockaddr_can at = {.can_family = AF_CAN, .can_ifindex = (int)if_nametoindex(self->interface)};
  if (at.can_ifindex == 0)
    return wm_fail(err, WM_NOT_FOUND, "%s: there is no such interface; `ip link add %s type vcan` makes a virtual one",
                   self->interface, self->interface);
  // Nothing is received; frames of CAN FD may be sent.
  (void)setsockopt(self->fd, SOL_CAN_RAW, CAN_RAW_FILTER, NULL, 0);
  (void)setsockopt(self->fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &yes, sizeof yes);
  if (bind(self->fd, (const struct sockaddr *)&at, sizeof at) != 0)
    return wm_fail(err, WM_IO, "%s: can't be opened: %s", self->interface, strerror(errno));
  name_request(&r, self->interface);
  if (ioctl(self->fd, SIOCGIFFLAGS, &r) == 0 && !(r.ifr_flags & IFF_UP))
    return wm_fail(err, WM_IO, "%s: is down: `ip link set %s up` (a real adapter: `... up type can bitrate 500000`)",
                   self->interface, self->interface);
  self->is_virtual = is_virtual(self->fd, self->interface);
  return WM_OK;
}

wm_status can_sink_open(const char *interface, play_sink **out, wm_error *err) {
  *out = NULL;
  if (strlen(interface) >= IFNAMSIZ)
    return wm_fail(err, WM_BAD_USAGE, "'%.40s' is too long for an interface's name (at most %d letters)", interface,
                   IFNAMSIZ - 1);
  can_sink *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "%s: no memory to open it", interface);
  self->base.ops = &kCan;
  (void)snprintf(self->interface, sizeof self->interface, "%s", interface);
  (void)snprintf(self->base.where, sizeof self->base.where, "%s", interface);
  wm_status status = open_socket(self, err);
  if (status == WM_OK)
    *out = &self->base;
  else if (self->fd >= 0)
    close_sink(&self->base);
  else
    free(self);
  return status;
}
