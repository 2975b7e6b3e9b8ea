// SPDX-License-Identifier: Apache-2.0
// systemd's notification protocol: datagrams to the socket that NOTIFY_SOCKET names. Without a service manager nothing
// happens. Source: sd_notify(3), "Notes": the protocol is stable and may be spoken without libsystemd.
#ifndef WAYMARK_LIVE_NOTIFY_H
#define WAYMARK_LIVE_NOTIFY_H

#include <stdint.h>

#include "waymark/time.h"

#define NOTIFY_STATUS_BYTES 160

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
// A pose went out: READY=1 with the first one.
void notify_pose(notify *self);
// Count of the estimator thread's loops. The watchdog is fed where it advanced: it proves that the threads run, and
// nothing else. A restart repairs no silent bus, absent camera or blocked disk; those are reported in health.
void notify_alive(notify *self, uint64_t loops);
// STATUS= where it changed. The service manager shows it.
void notify_status(notify *self, const char *text);
// Called often: feeds the watchdog when it is due and the estimator lives; READY=1 with a stated reason when no pose
// has come for 10 s.
void notify_tick(notify *self, wm_time_ns now_ns);
void notify_stopping(notify *self);
void notify_close(notify *self);

#endif
