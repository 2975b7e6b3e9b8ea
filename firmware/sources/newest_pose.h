// SPDX-License-Identifier: Apache-2.0
// The newest pose, from the estimator's thread to the detectors' threads: a sequence lock over atomic words. The writer
// never waits; a reader that overlaps a write tries again.
#ifndef WAYMARK_SOURCES_NEWEST_POSE_H
#define WAYMARK_SOURCES_NEWEST_POSE_H

#include <stdatomic.h>
#include <stdint.h>

#include "rt/realtime.h"
#include "waymark/pose.h"

#define NEWEST_POSE_WORDS (sizeof(wm_estimate) / sizeof(uint64_t))
_Static_assert(sizeof(wm_estimate) % sizeof(uint64_t) == 0, "a pose is whole words");

typedef struct newest_pose {
  _Atomic uint32_t turn;  // odd: being written; 0: none yet
  _Atomic uint64_t word[NEWEST_POSE_WORDS];
} newest_pose;

WM_REALTIME void newest_pose_put(newest_pose *self, const wm_estimate *pose);
// 0 where no pose was put yet.
int newest_pose_get(newest_pose *self, wm_estimate *out);

#endif
