// SPDX-License-Identifier: Apache-2.0
// The last pose on disk, so that a robot that was switched off or a run that was killed begins where it ended.
#ifndef WAYMARK_OUTPUT_SAVED_POSE_H
#define WAYMARK_OUTPUT_SAVED_POSE_H

#include "waymark/pose.h"
#include "waymark/setup.h"
#include "waymark/status.h"

typedef struct wm_saved_pose {
  wm_start start;                // t_ns is WM_TIME_NONE: the first motion
  double utc_s;                  // when it was saved, by this computer's clock then
  double speed_mps, rate_radps;  // of base_link then, along its x axis and about z
} wm_saved_pose;

// Writes beside `path` and renames: at every moment there is the old file or the new one, also after a power cut. A few
// ms, on a memory card up to seconds: not for the real-time thread. WM_IO with the reason.
wm_status wm_saved_pose_write(const char *path, const wm_estimate *pose, double utc_s, wm_error *err);
// WM_NOT_FOUND: there is none. WM_BAD_CONFIG: it can't be read. Allocates.
wm_status wm_saved_pose_read(const char *path, wm_saved_pose *out, wm_error *err);
// Whether a pose is fit to begin with: finite, not searching, not lost, sigma below 50 m and 1.5 rad.
int wm_saved_pose_is_worth_it(const wm_estimate *pose);
// The same as a start at once, in this process: `blind_s` of motion at its speed are added to its sigma.
void wm_start_from_estimate(const wm_estimate *pose, double blind_s, wm_start *out);
// As a start: older than max_age_s (by `utc_s` now) it is none: 0. The robot may have been moved since: moved_m and
// moved_rad are added to its sigmas. Where it drove, a run that died may be back within a second: for so long, two
// seconds at most, it is taken to have gone on, and for ten as having done anything between standing and twice that;
// later it has come to a stand, within two seconds of driving.
int wm_saved_pose_start(const wm_saved_pose *saved, double utc_s, double max_age_s, double moved_m, double moved_rad,
                        wm_start *out);

#endif
