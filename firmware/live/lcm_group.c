// SPDX-License-Identifier: Apache-2.0
#include "live/lcm_group.h"

#include <arpa/inet.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "live/lcm_connect.h"

void lcm_group_open(lcm_group *self, const char *url) {
  char address[64];
  int port;
  memset(self, 0, sizeof *self);
  self->fd = -1;
  self->is_wanted = sscanf(lcm_connect_url(url), "udpm://%63[0-9.]:%d", address, &port) == 2 &&
                    inet_pton(AF_INET, address, &self->address) == 1;
}

// By a new socket each time: one can join 20 times (net.ipv4.igmp_max_memberships), and memberships of interfaces that
// are gone count. The old one is closed later, so that the group is never left.
void lcm_group_tick(lcm_group *self, wm_time_ns monotonic_ns) {
  if (!self->is_wanted || monotonic_ns < self->next_ns) return;
  self->next_ns = monotonic_ns + LCM_TRY_AGAIN_NS;
  const struct ip_mreq group = {.imr_multiaddr = self->address, .imr_interface.s_addr = htonl(INADDR_ANY)};
  int fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) return;
  if (setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) != 0) {
    (void)close(fd);  // no route for multicast at present
    return;
  }
  lcm_group_close(self);
  self->fd = fd;
}

void lcm_group_close(lcm_group *self) {
  if (self->fd >= 0) (void)close(self->fd);
  self->fd = -1;
}
