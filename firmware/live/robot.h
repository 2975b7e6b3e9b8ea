// SPDX-License-Identifier: Apache-2.0
// The devices of a configuration, opened: the input of `waymark run` without a recording.
#ifndef WAYMARK_LIVE_ROBOT_H
#define WAYMARK_LIVE_ROBOT_H

#include "config/config.h"
#include "waymark/recording.h"
#include "waymark/status.h"

// The site of the configuration (calibration, landmarks, map) and its cameras; no other source.
wm_status wm_robot_open_site(const wm_config *config, wm_warn_fn warn, void *context, wm_recording **out,
                             wm_error *err);
// The same with a source for each device. An absent device is no error (it may come later); a wrong DBC is.
// WM_BAD_CONFIG where the configuration has no `devices`.
wm_status wm_robot_open(const wm_config *config, wm_warn_fn warn, void *context, wm_recording **out, wm_error *err);

#endif
