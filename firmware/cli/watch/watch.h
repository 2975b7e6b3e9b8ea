// SPDX-License-Identifier: Apache-2.0
// A run as a person sees it in a terminal, from its messages.
#ifndef WAYMARK_CLI_WATCH_WATCH_H
#define WAYMARK_CLI_WATCH_WATCH_H

#include <stdio.h>

#include "waymark/health.h"
#include "waymark/pose.h"

typedef struct watch {
  wm_published pose;
  wm_health health;
  int has_pose, has_health;
  wm_time_ns pose_at_ns, health_at_ns;  // when they came, on this computer's clock
  double rate_hz;                       // of poses, smoothed
  double nis;  // mean squared innovation by its own variance, of about the last hundred; 1 is expected
  uint64_t innovations;
  uint64_t not_understood;  // messages of another version
} watch;

void watch_pose(watch *self, const void *message, size_t length, wm_time_ns now_ns);
void watch_health(watch *self, const void *message, size_t length, wm_time_ns now_ns);
void watch_innovation(watch *self, const void *message, size_t length);
// Whether the observations agree with the estimator's covariance: a verdict in words.
const char *watch_consistency(const watch *self);
// One word for how it stands ("tracking", "degraded", "lost" ...), and why, as far as health has the reason.
const char *watch_state(const watch *self, wm_time_ns now_ns, char *why, size_t why_bytes);
// The whole view, some lines.
void watch_print(const watch *self, wm_time_ns now_ns, FILE *to);

#endif
