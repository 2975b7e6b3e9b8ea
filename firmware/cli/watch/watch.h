// SPDX-License-Identifier: Apache-2.0
// The view of a run in a terminal, from its messages.
#ifndef WAYMARK_CLI_WATCH_WATCH_H
#define WAYMARK_CLI_WATCH_WATCH_H

#include <stdio.h>

#include "findings/findings.h"
#include "waymark/bound.h"
#include "waymark/health.h"
#include "waymark/pose.h"

// Why data of a source are refused.
typedef struct watch_reason {
  char source[WM_HEALTH_NAME_MAX], reason[WM_HEALTH_REASON_MAX];
} watch_reason;

typedef struct watch {
  wm_published pose;
  wm_bound bound;
  wm_health health;
  wm_findings found;  // of that health
  int has_pose, has_health, has_bound;
  wm_time_ns pose_at_ns, health_at_ns;  // arrival, on this computer's clock
  double rate_hz;                       // of poses, smoothed
  double nis;  // mean squared innovation by its own variance, of about the last hundred; 1 is expected
  uint64_t innovations;
  uint64_t not_understood;  // messages of another version
  watch_reason reasons[WM_HEALTH_SOURCES_MAX];
} watch;

void watch_pose(watch *self, const void *message, size_t length, wm_time_ns now_ns);
void watch_bound(watch *self, const void *message, size_t length);
void watch_health(watch *self, const void *message, size_t length, wm_time_ns now_ns);
void watch_refused(watch *self, const void *message, size_t length);
void watch_innovation(watch *self, const void *message, size_t length);
// Heading of base_link in the map, rad.
double watch_heading(const wm_estimate *pose);
// Whether the observations agree with the estimator's covariance, in words.
const char *watch_consistency(const watch *self);
// State in a word ("tracking", "degraded", "lost" ...), with the reason where health has it.
const char *watch_state(const watch *self, wm_time_ns now_ns, char *why, size_t why_bytes);
// The whole view, some lines.
void watch_print(const watch *self, wm_time_ns now_ns, FILE *to);

#endif
