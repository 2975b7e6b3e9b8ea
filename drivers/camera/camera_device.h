// SPDX-License-Identifier: Apache-2.0
// A camera on any system (camera_io.h).
#ifndef WM_CAMERA_DEVICE_H
#define WM_CAMERA_DEVICE_H

#include "camera_io.h"
#include "waymark/devices.h"

wm_status camera_device_make(const wm_camera_device_config *config, const wm_camera *camera, int32_t index,
                             wm_warn_fn warn, void *context, const camera_io *io, void *io_context,
                             wm_camera_device **out, wm_error *err);

#endif
