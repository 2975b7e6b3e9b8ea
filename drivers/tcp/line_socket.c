// SPDX-License-Identifier: Apache-2.0
#include "waymark/line_socket.h"

#include <errno.h>
#include <netdb.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "waymark/source.h"

#define TRY_AGAIN_NS (500 * WM_NS_PER_MS)
// Without a byte for so long the connection is made anew: a computer that was switched off closes none.
#define DEAD_NS (10 * WM_NS_PER_S)

static wm_time_ns now(void) {
  struct timespec at;
  (void)clock_gettime(CLOCK_MONOTONIC, &at);
  return (wm_time_ns)at.tv_sec * WM_NS_PER_S + at.tv_nsec;
}

void line_socket_init(line_socket *self, const char *host, int32_t port, const char *greeting) {
  memset(self, 0, sizeof *self);
  (void)snprintf(self->host, sizeof self->host, "%s", host);
  self->port = port;
  self->greeting = greeting;
  self->fd = -1;
}

void line_socket_close(line_socket *self) {
  if (self->fd >= 0) (void)close(self->fd);
  if (self->used > self->taken) self->fault = "the connection ended within a line";
  self->fd = -1;
  self->is_connected = self->skips = 0;
  self->used = self->taken = 0;
}

static void begin(line_socket *self, wm_time_ns now_ns) {
  char port[12];
  struct addrinfo *found = NULL;
  const struct addrinfo wanted = {.ai_family = AF_INET, .ai_socktype = SOCK_STREAM};
  self->next_try_ns = now_ns + TRY_AGAIN_NS;
  self->read_ns = now_ns;
  (void)snprintf(port, sizeof port, "%d", (int)self->port);
  if (getaddrinfo(self->host, port, &wanted, &found) != 0) return;
  self->fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (self->fd >= 0 && connect(self->fd, found->ai_addr, found->ai_addrlen) != 0 && errno != EINPROGRESS)
    line_socket_close(self);
  freeaddrinfo(found);
}

static void greet(line_socket *self) {
  int problem = 0;
  socklen_t length = sizeof problem;
  const size_t bytes = self->greeting ? strlen(self->greeting) : 0;
  if (getsockopt(self->fd, SOL_SOCKET, SO_ERROR, &problem, &length) != 0 || problem != 0 ||
      (bytes > 0 && send(self->fd, self->greeting, bytes, MSG_NOSIGNAL) != (ssize_t)bytes)) {
    line_socket_close(self);
    return;
  }
  self->is_connected = 1;
}

static void read_more(line_socket *self, wm_time_ns now_ns) {
  memmove(self->bytes, self->bytes + self->taken, self->used - self->taken);
  self->used -= self->taken;
  self->taken = 0;
  if (self->used == sizeof self->bytes) {
    self->skips = 1;
    self->used = 0;
  }
  const ssize_t got = recv(self->fd, self->bytes + self->used, sizeof self->bytes - self->used, 0);
  if (got > 0) {
    self->used += (size_t)got;
    self->read_ns = now_ns;
  } else if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
    line_socket_close(self);
  }
}

static void wait_for_more(line_socket *self) {
  const wm_time_ns now_ns = now();
  if (self->fd >= 0 && now_ns - self->read_ns > DEAD_NS) line_socket_close(self);
  if (self->fd < 0 && now_ns >= self->next_try_ns) begin(self, now_ns);
  struct pollfd ready = {.fd = self->fd, .events = self->is_connected ? POLLIN : POLLOUT};
  if (poll(&ready, 1, WM_DEVICE_WAIT_MS) <= 0 || self->fd < 0) return;  // without a socket it only waits
  if (self->is_connected)
    read_more(self, now());
  else
    greet(self);
}

const char *line_socket_next(line_socket *self, size_t *length) {
  for (;;) {
    const char *line = self->bytes + self->taken;
    const char *end = memchr(line, '\n', self->used - self->taken);
    if (!end) return NULL;
    *length = (size_t)(end - line);
    self->taken += *length + 1;
    if (!self->skips) return line;
    self->skips = 0;
    self->fault = "a line is longer than 16384 bytes";
  }
}

const char *line_socket_read(line_socket *self, size_t *length) {
  const char *line = line_socket_next(self, length);
  if (line) return line;
  wait_for_more(self);
  return line_socket_next(self, length);
}

const char *line_socket_fault(line_socket *self) {
  const char *fault = self->fault;
  self->fault = NULL;
  return fault;
}
