// SPDX-License-Identifier: Apache-2.0
// This computer's membership in LCM's multicast group. The kernel drops a socket's membership with the network
// interface (a USB adapter), multicast may move to another one with the default route, and liblcm joins
// once. As liblcm's sockets take what any socket of the computer has joined, one that joins anew keeps all
// subscriptions alive.
#ifndef WAYMARK_LIVE_LCM_GROUP_H
#define WAYMARK_LIVE_LCM_GROUP_H

#include <netinet/in.h>

#include "waymark/time.h"

typedef struct lcm_group {
  int fd;  // -1: not joined
  int is_wanted;
  struct in_addr address;
  wm_time_ns next_ns;
} lcm_group;

// `url` as publish.lcm_url has it. Only UDP multicast has groups.
void lcm_group_open(lcm_group *self, const char *url);
// Joins anew when due. Called often; never waits.
void lcm_group_tick(lcm_group *self, wm_time_ns monotonic_ns);
void lcm_group_close(lcm_group *self);

#endif
