// SPDX-License-Identifier: Apache-2.0
#include "live/notify.h"

#include <errno.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "rt/clock.h"

#define READY_WITHOUT_POSE_NS (10 * WM_NS_PER_S)  // a start without input must not be taken for a failed one

static void send_text(const notify *self, const char *text) {
  if (self->socket >= 0) (void)send(self->socket, text, strlen(text), MSG_NOSIGNAL | MSG_DONTWAIT);
}

static int connect_to(const char *path) {
  struct sockaddr_un address = {.sun_family = AF_UNIX};
  size_t length = strlen(path);
  if (length == 0 || length >= sizeof address.sun_path || (path[0] != '/' && path[0] != '@')) return -1;
  memcpy(address.sun_path, path, length);
  if (path[0] == '@') address.sun_path[0] = '\0';  // an abstract socket
  int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return -1;
  if (connect(fd, (const struct sockaddr *)&address, (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length)) !=
      0) {
    (void)close(fd);
    return -1;
  }
  return fd;
}

// WATCHDOG_USEC applies to this process only if WATCHDOG_PID is its own, or absent.
static wm_time_ns watchdog_period_ns(void) {
  const char *usec = getenv("WATCHDOG_USEC"), *pid = getenv("WATCHDOG_PID");
  if (!usec || (pid && strtol(pid, NULL, 10) != (long)getpid())) return 0;
  long long us = strtoll(usec, NULL, 10);
  return us > 0 && us < INT64_MAX / WM_NS_PER_US ? us * WM_NS_PER_US : 0;
}

void notify_open(notify *self) {
  memset(self, 0, sizeof *self);
  const char *path = getenv("NOTIFY_SOCKET");
  self->socket = path ? connect_to(path) : -1;
  self->feed_every_ns = watchdog_period_ns() / 2;
  self->opened_ns = wm_monotonic_ns();
}

void notify_pose(notify *self) {
  if (self->said_ready) return;
  send_text(self, "READY=1");
  self->said_ready = 1;
}

void notify_alive(notify *self, uint64_t loops) {
  if (loops == self->loops) return;
  self->loops = loops;
  self->is_alive = 1;
}

void notify_status(notify *self, const char *text) {
  if (strncmp(self->status, text, sizeof self->status - 1) == 0) return;
  char line[NOTIFY_STATUS_BYTES + 8];
  (void)snprintf(self->status, sizeof self->status, "%s", text);
  (void)snprintf(line, sizeof line, "STATUS=%s", self->status);
  send_text(self, line);
}

void notify_tick(notify *self, wm_time_ns now_ns) {
  if (!self->said_ready && now_ns - self->opened_ns > READY_WITHOUT_POSE_NS) {
    send_text(self, "READY=1");  // STATUS has the reason
    self->said_ready = 1;
  }
  if (self->feed_every_ns == 0 || now_ns < self->next_feed_ns || !self->is_alive) return;
  send_text(self, "WATCHDOG=1");
  self->is_alive = 0;
  self->next_feed_ns = now_ns + self->feed_every_ns;
}

void notify_stopping(notify *self) { send_text(self, "STOPPING=1"); }

void notify_close(notify *self) {
  if (self->socket >= 0) (void)close(self->socket);
  self->socket = -1;
}
