// SPDX-License-Identifier: Apache-2.0
// systemd's notification protocol: datagrams to the socket that NOTIFY_SOCKET names. Without a service manager nothing
// happens. Source: sd_notify(3), "Notes": the protocol is stable and may be spoken without libsystemd.
#ifndef WAYMARK_FIRMWARE_NOTIFY_H
#define WAYMARK_FIRMWARE_NOTIFY_H

#include "waymark/pose.h"
#include "waymark/time.h"

typedef struct notify {
  int socket;  // -1: no service manager
  int said_ready;
  wm_time_ns opened_ns;
  wm_time_ns feed_every_ns;  // half of WATCHDOG_USEC; 0: no watchdog
  wm_time_ns next_feed_ns;
  wm_time_ns fused_until_ns;  // of the pose that the dog was last fed with
  int is_fresh;               // fused time advanced, with fresh motion, since it was last fed
} notify;

void notify_open(notify *self);
// A pose went out. READY=1 with the first one; the rest as notify_progress.
void notify_pose(notify *self, const wm_published *published);
// How far is fused, and whether motion is fresh: the watchdog is fed only for what advanced with fresh motion. Also
// while no pose is known yet: searching is no reason to be restarted.
void notify_progress(notify *self, wm_time_ns fused_until_ns, int motion_is_fresh);
// Called often: feeds the watchdog when it is due and deserved; says READY=1 in a stated degraded state when no pose
// has come for a while.
void notify_tick(notify *self, wm_time_ns now_ns);
void notify_stopping(notify *self);
void notify_close(notify *self);

#endif
