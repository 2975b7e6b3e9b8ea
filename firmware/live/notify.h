// SPDX-License-Identifier: Apache-2.0
// systemd's notification protocol: datagrams to the socket of NOTIFY_SOCKET. Without a service manager nothing happens.
// Source: sd_notify(3), "Notes": the protocol is stable and may be used without libsystemd.
#ifndef WAYMARK_LIVE_NOTIFY_H
#define WAYMARK_LIVE_NOTIFY_H

#include <stdint.h>

#include "waymark/time.h"

#define NOTIFY_STATUS_BYTES 160  // state and the names of silent inputs

typedef struct notify {
  int socket;  // -1: no service manager
  int said_ready;
  wm_time_ns opened_ns;
  wm_time_ns feed_every_ns;  // half of WATCHDOG_USEC; 0: no watchdog
  wm_time_ns next_feed_ns;
  uint64_t loops;  // of the estimator's thread, as last reported
  int is_alive;    // they advanced since the watchdog was last fed
  char status[NOTIFY_STATUS_BYTES];
} notify;

void notify_open(notify *self);
// A pose was sent: READY=1 with the first one.
void notify_pose(notify *self);
// Count of the estimator thread's loops; the watchdog is triggered where it advanced. The watchdog proves that the
// threads run, and nothing else. A restart repairs no silent bus, absent camera or blocked disk; those are reported in
// health.
void notify_alive(notify *self, uint64_t loops);
// Sends STATUS= when it changed.
void notify_status(notify *self, const char *text);
// Called often: triggers the watchdog when due while the estimator's loop advances; sends READY=1 with a reason after
// 10 s without a pose.
void notify_tick(notify *self, wm_time_ns now_ns);
void notify_stopping(notify *self);
void notify_close(notify *self);

#endif
