// SPDX-License-Identifier: Apache-2.0
// The last pose on disk: start pose after a power cycle or a kill.
#ifndef WAYMARK_OUTPUT_SAVED_POSE_H
#define WAYMARK_OUTPUT_SAVED_POSE_H

#include "waymark/motion.h"
#include "waymark/pose.h"
#include "waymark/setup.h"
#include "waymark/status.h"

typedef struct wm_saved_pose {
  wm_start start;                // t_ns is WM_TIME_NONE: the first motion
  double utc_s;                  // when it was saved, by this computer's clock at that time
  double speed_mps, rate_radps;  // of base_link at that time, along its x axis and about z
  int is_lost;                   // the pose was lost, or too vague for a start
  int has_floor;                 // of a building with several
  char floor[WM_NAME_MAX];       // "": unknown
} wm_saved_pose;

// Replaces the file atomically (output/replace_file.h), marked as lost where the pose is not worth it. A few ms, on a
// memory card up to seconds: not on the real-time thread. WM_IO with the reason. `floor`: its name, "" where it is not
// known, NULL where there is one.
wm_status wm_saved_pose_write(const char *path, const wm_estimate *pose, const char *floor, double utc_s,
                              wm_error *err);
// WM_NOT_FOUND: no file. WM_BAD_CONFIG: it can't be read. Allocates.
wm_status wm_saved_pose_read(const char *path, wm_saved_pose *out, wm_error *err);
// Whether there is a pose: finite, not searching.
int wm_saved_pose_is_one(const wm_estimate *pose);
// Whether it can be a start: not lost, sigma below 50 m and pi.
int wm_saved_pose_is_worth_it(const wm_estimate *pose);
// The estimate as a start in this process: `blind_s` of motion at its speed, or of another one that began since
// (wm_motion_unseen), is added to its sigmas.
void wm_start_from_estimate(const wm_estimate *pose, const wm_motion_params *motion, double blind_s, wm_start *out);
// The saved pose as a start; 0 where it is lost or older than max_age_s (`utc_s` is now). Sigmas grow by moved_m and
// moved_rad for a motion while the robot was off. A robot that drove at the save is carried on at its speed for its
// age, two seconds at most. For ten seconds its speed is taken as anything between zero and twice that, and it may have
// braked, accelerated or begun to turn since (wm_motion_unseen); after that it is taken to have stopped within two
// seconds of driving.
int wm_saved_pose_start(const wm_saved_pose *saved, double utc_s, double max_age_s, double moved_m, double moved_rad,
                        const wm_motion_params *motion, wm_start *out);

#endif
