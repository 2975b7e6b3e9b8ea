// SPDX-License-Identifier: Apache-2.0
#include <stddef.h>

#include "config/config.h"

#define F64(key, field, initial, min, max, about) \
  { key, WM_PARAM_F64, offsetof(wm_runtime_params, field), initial, min, max, NULL, about }
#define I32(key, field, initial, min, max, about) \
  { key, WM_PARAM_I32, offsetof(wm_runtime_params, field), initial, min, max, NULL, about }
#define BOOL(key, field, initial, about) \
  { key, WM_PARAM_BOOL, offsetof(wm_runtime_params, field), initial, 0, 1, NULL, about }

static const wm_param kParams[] = {
    F64("merge.horizon_ms", merge_horizon_ms, 300, 1, 60000,
        "ms. Largest lateness_max_ms that a source may have, and how far in the future a stamp may lie. The fused time "
        "is never older than this, so it bounds what the published pose owes to odometry."),
    F64("merge.lateness_max_ms", merge_lateness_max_ms, 150, 0, 60000,
        "ms. Default of the sources: a datum that reaches this computer later than this after its stamp is late, and "
        "dropped. A camera's exposure, transfer and detection take 50 to 150 ms."),
    I32("merge.queue_events", merge_queue_events, 4096, 16, 1048576,
        "Events that may wait in the merge. 300 ms of a busy CAN bus (2000 frames/s) and cameras are under 1000."),
    F64("publish.rate_hz", publish_rate_hz, 50, 0.1, 1000,
        "Hz. How often the pose is sent, carried on to the moment of sending. Controllers of slow robots run at 20 to "
        "50."),
    F64("publish.jump_m", publish_jump_m, 0.1, 0, 1000,
        "m. A correction that moves the map pose against odom by more than this is announced as a jump."),
    F64("publish.jump_deg", publish_jump_deg, 2.0, 0, 360, "degrees. As jump_m, for the heading."),
    F64("publish.motion_stale_ms", publish_motion_stale_ms, 200, 1, 60000,
        "ms. Motion older than this sets the flag MOTION_STALE: the pose is carried on by old speeds. Wheel encoders "
        "send every 10 to 50 ms."),
    BOOL("publish.lcm", publish_lcm, 1, "Whether poses are sent over LCM. Without a network the run continues."),
    BOOL("commands.lcm", commands_lcm, 0,
         "Whether SET_POSE, SET_FLOOR and RESET are taken over LCM. Any program that reaches its port can then move "
         "the pose: LCM "
         "listens on all of this computer's networks, whatever its ttl."),
    F64("publish.useless_m", publish_useless_m, 1.0, 1e-3, 1000,
        "m. Sigma of the position above which a pose is useless: health has the metres and seconds of dead reckoning "
        "until then."),
    F64("integrity.risk_per_pose", integrity_risk_per_pose, 1e-4, 1e-4, 0.1,
        "Probability that a pose is off by more than its bound: 1e-4 is the smallest that drives could test "
        "(docs/usable.md)."),
    F64("integrity.alert_limit_m", integrity_alert_limit_m, 0, 0, 1e6,
        "m. A pose whose horizontal bound is larger is not usable; 0: each bound is."),
    F64("integrity.alert_limit_heading_deg", integrity_alert_limit_heading_deg, 0, 0, 180,
        "degrees. As alert_limit_m, for the heading."),
    F64("start.max_age_s", start_max_age_s, 86400, 0, 1e9,
        "s. A saved pose that is older than this is not used: the robot may have been moved since."),
    F64("start.moved_m", start_moved_m, 0.2, 0, 1000,
        "m. Sigma of a motion of the robot while it was off, added to the saved pose's."),
    F64("start.moved_deg", start_moved_deg, 3.0, 0, 180, "degrees. As moved_m, for the heading."),
    F64("start.save_every_s", start_save_every_s, 1.0, 0.1, 3600,
        "s. Interval between saves of the pose. After a kill the start pose is at most this old. Each save is a write "
        "to the disk."),
    F64("start.save_map_every_s", start_save_map_every_s, 10.0, 0.1, 3600,
        "s. Interval between saves of the map while the pose is not in doubt; it is saved at the end, too. After a "
        "kill the changes since the last save are lost. 50 markers are 0.2 MB."),
    F64("black_box.keep_s", black_box_keep_s, 60, 1, 3600,
        "s. Length of the event log on the disk, which is one to two times this, for a loss or the death of a run; "
        "after a loss a quarter of it is added."),
    F64("black_box.pictures_hz", black_box_pictures_hz, 0, 0, 100,
        "Hz. Rate at which pictures of each camera with a detector are kept with the log; 0: none. A picture of 640 x "
        "400 is 256 kB (grey), or about 40 kB (MJPEG)."),
    I32("realtime.loop_hz", realtime_loop_hz, 200, 1, 10000,
        "Hz. How often the estimator's thread wakes. At 200 a datum waits 5 ms at most."),
    I32("realtime.priority", realtime_priority, 80, 0, 98,
        "SCHED_FIFO priority of the estimator's thread; 0 is a normal thread. 80 is above the kernel's threaded "
        "interrupts (50); 99 is the kernel's own."),
    I32("realtime.cpu", realtime_cpu, -1, -1, 1023, "The CPU that the estimator's thread is bound to; -1 is any."),
    BOOL("realtime.lock_memory", realtime_lock_memory, 1,
         "Whether memory is locked (mlockall), so that no page fault stops the estimator's thread."),
    I32("realtime.ring_events", realtime_ring_events, 1024, 16, 1048576,
        "Slots of the ring between a source's thread and the estimator's. 1024 is half a second of a busy CAN bus."),
};

const wm_param_table wm_runtime_params_table = {kParams, sizeof kParams / sizeof *kParams, sizeof(wm_runtime_params),
                                                NULL};
