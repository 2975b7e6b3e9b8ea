// SPDX-License-Identifier: Apache-2.0
// The devices of a configuration, opened: what `waymark run` localizes by when there is no recording.
#ifndef WAYMARK_LIVE_ROBOT_H
#define WAYMARK_LIVE_ROBOT_H

#include "config/config.h"
#include "waymark/recording.h"
#include "waymark/status.h"

// What is known of a place (calibration, landmarks, map) as the configuration names it, and its cameras; no other
// source.
wm_status wm_robot_open_site(const wm_config *config, wm_warn_fn warn, void *context, wm_recording **out,
                             wm_error *err);
// The same with a source a device. Calibration and landmarks as the configuration names them, and a source a device. A
// device that isn't there is no error (it may come); a wrong DBC is. WM_BAD_CONFIG where the configuration has no
// `devices`.
wm_status wm_robot_open(const wm_config *config, wm_warn_fn warn, void *context, wm_recording **out, wm_error *err);

#endif
