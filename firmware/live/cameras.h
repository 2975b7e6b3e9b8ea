// SPDX-License-Identifier: Apache-2.0
// A robot's cameras (`devices.cameras`) as pictures with many readers: a frame hub and a thread for each device.
#ifndef WAYMARK_LIVE_CAMERAS_H
#define WAYMARK_LIVE_CAMERAS_H

#include "config/config.h"
#include "waymark/frame_source.h"
#include "waymark/recording.h"

// `config` outlives it. A device is opened with its first reader. `warn` (may be NULL) gets the driver's changes of the
// requested mode.
wm_status cameras_open(const wm_config *config, wm_warn_fn warn, void *context, wm_pictures **out, wm_error *err);

#endif
