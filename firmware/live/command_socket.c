// SPDX-License-Identifier: Apache-2.0
#include "live/command_socket.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "live/lcm_stamp.h"
#include "live/lcm_subscriber.h"
#include "waymark/devices.h"
#include "waymark/lcm_messages.h"

#define LATENESS_MS 20     // from a message's arrival until it is in the merge
#define DATAGRAM_MAX 1024  // set_pose_t has 88 bytes

typedef struct command_socket {
  wm_source base;
  const wm_floors *floors;
  int fd;
  struct sockaddr_un at;
  uint32_t seq;
} command_socket;

static wm_status next_command(wm_source *base, wm_event *out, wm_error *err) {
  (void)err;
  command_socket *self = (command_socket *)base;
  uint8_t datagram[DATAGRAM_MAX];
  struct pollfd wanted = {.fd = self->fd, .events = POLLIN};
  base->counts.device = WM_DEVICE_WORKS;
  if (poll(&wanted, 1, WM_DEVICE_WAIT_MS) <= 0) return WM_AGAIN;
  const ssize_t bytes = recv(self->fd, datagram, sizeof datagram, MSG_DONTWAIT);
  if (bytes < 0) return WM_AGAIN;
  const char *why = wm_lcm_read_set_pose(datagram, (size_t)bytes, out);
  if (why && !wm_lcm_read_reset(datagram, (size_t)bytes, out)) why = NULL;
  char floor[WM_NAME_MAX];
  if (why && !wm_lcm_read_set_floor(datagram, (size_t)bytes, floor, out)) why = lcm_floor_of(self->floors, floor, out);
  char text[160];
  if (!why) why = lcm_stamp_command(out, text, sizeof text);
  if (why) {
    wm_source_refuse(&base->counts, self->at.sun_path, why);
    return WM_AGAIN;
  }
  out->seq = self->seq++;
  out->source = base->index;
  base->counts.received++;
  return WM_OK;
}

static void close_socket(wm_source *base) {
  command_socket *self = (command_socket *)base;
  if (self->fd >= 0) {
    (void)close(self->fd);
    (void)unlink(self->at.sun_path);
  }
  free(self);
}

static const wm_source_ops kOps = {next_command, close_socket};

// A socket's file without a process behind it, of a run that was killed, is removed.
static wm_status make_room(const struct sockaddr_un *at, wm_error *err) {
  struct stat file;
  if (lstat(at->sun_path, &file) != 0) return WM_OK;
  if (!S_ISSOCK(file.st_mode))
    return wm_fail(err, WM_IO, "commands.socket: %s is there and is not a socket", at->sun_path);
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int is_used = fd >= 0 && connect(fd, (const struct sockaddr *)at, sizeof *at) == 0;
  if (fd >= 0) (void)close(fd);
  if (is_used) return wm_fail(err, WM_IO, "commands.socket: another process listens on %s", at->sun_path);
  (void)unlink(at->sun_path);
  return WM_OK;
}

// Never wider than in the end: the file is made for its owner, then opened to the group.
static wm_status listen_on(command_socket *self, wm_error *err) {
  wm_status status = make_room(&self->at, err);
  if (status != WM_OK) return status;
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd >= 0 && fchmod(fd, 0600) == 0 && bind(fd, (const struct sockaddr *)&self->at, sizeof self->at) == 0) {
    self->fd = fd;
    if (chmod(self->at.sun_path, 0660) == 0) return WM_OK;
  }
  status = wm_fail(err, WM_IO, "commands.socket: %s cannot be created: %s", self->at.sun_path, strerror(errno));
  if (fd >= 0 && self->fd < 0) (void)close(fd);
  return status;
}

wm_status command_socket_open(const char *path, const wm_floors *floors, wm_source **out, wm_error *err) {
  *out = NULL;
  command_socket *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory to listen to commands");
  self->base.ops = &kOps;
  self->base.is_live = self->base.event_driven = 1;
  self->base.lateness_max_ms = LATENESS_MS;
  self->base.kinds = WM_COMMAND_EVENTS;
  self->floors = floors;
  self->fd = -1;
  self->at.sun_family = AF_UNIX;
  (void)snprintf(self->base.name, sizeof self->base.name, "commands:local");
  const int length = snprintf(self->at.sun_path, sizeof self->at.sun_path, "%s", path);
  wm_status status = length < (int)sizeof self->at.sun_path
                         ? listen_on(self, err)
                         : wm_fail(err, WM_BAD_CONFIG, "commands.socket: %s is longer than %zu bytes", path,
                                   sizeof self->at.sun_path - 1);
  if (status == WM_OK) {
    *out = &self->base;
  } else {
    close_socket(&self->base);
  }
  return status;
}
