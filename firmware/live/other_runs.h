// SPDX-License-Identifier: Apache-2.0
// Other runs that publish on the same channels: two runs with one prefix send poses of both to every listener, and both
// take a command. Each run sends its identity with HEALTH once a second, and listens to HEALTH by a socket of its own,
// which the kernel filters: a thread of liblcm would take all of LCM's traffic. Of the publish thread; never waits.
#ifndef WAYMARK_LIVE_OTHER_RUNS_H
#define WAYMARK_LIVE_OTHER_RUNS_H

#include "findings/findings.h"
#include "waymark/health.h"
#include "waymark/lcm_messages.h"

#define OTHER_RUNS_MAX 8  // known at a time

typedef struct other_run {
  uint64_t id;  // 0: no run is here
  int32_t pid;
  char host[WM_HEALTH_HOST_MAX];
  wm_time_ns heard_ns;
} other_run;

typedef struct other_runs {
  int fd;         // -1: nothing is listened to
  int is_wanted;  // LCM is on, and by UDP
  char address[64], channel[64];
  int port;
  uint64_t own_id;
  wm_time_ns next_ns;
  other_run known[OTHER_RUNS_MAX];
  uint32_t total;
  wm_line_fn say;
  void *say_context;
  uint8_t packet[WM_LCM_MESSAGE_MAX + 128];
  wm_health heard;
} other_runs;

// `url` as publish.lcm_url has it. Only UDP multicast, LCM's usual way, is listened to.
void other_runs_open(other_runs *self, int is_on, const char *url, const char *prefix, wm_line_fn say,
                     void *say_context);
// Takes what came. Called often.
void other_runs_tick(other_runs *self, wm_time_ns monotonic_ns);
// Who this run is, and how many others there are.
void other_runs_health(const other_runs *self, wm_health *health);
void other_runs_close(other_runs *self);

#endif
