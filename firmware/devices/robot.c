// SPDX-License-Identifier: Apache-2.0
#include "waymark/robot.h"

#include <stdio.h>
#include <string.h>

// "can" for the only interface, "can:can1" where there are several.
static wm_status add_can(const wm_config *config, wm_recording *robot, wm_error *err) {
  const wm_devices_config *devices = &config->devices;
  wm_status status = WM_OK;
  for (size_t i = 0; status == WM_OK && i < devices->can_count; i++) {
    wm_source *source;
    uint32_t quantities = 0;
    status = wm_can_device_open(&devices->can[i], &source, &quantities, err);
    if (status != WM_OK) return status;
    if (devices->can_count > 1) snprintf(source->name, sizeof source->name, "can:%s", devices->can[i].interface);
    status = wm_recording_add_device(robot, source, quantities, err);
  }
  return status;
}

wm_status wm_robot_open(const wm_config *config, wm_warn_fn warn, void *context, wm_recording **out, wm_error *err) {
  *out = NULL;
  if (config->devices.can_count == 0)
    return wm_fail(err, WM_BAD_CONFIG,
                   "%s: devices: is missing, and no recording is given: name the robot's devices (devices: {can: "
                   "[{interface: can0}]}) or --recording",
                   config->path);
  wm_recording *robot;
  wm_status status = wm_recording_open_robot("robot", &config->overrides, warn, context, &robot, err);
  if (status != WM_OK) return status;
  for (size_t i = 0; i < config->devices.camera_count && warn; i++) {
    char line[160];
    snprintf(line, sizeof line, "camera %s: nothing looks at its pictures in a run yet; it is not opened",
             config->devices.cameras[i].name);
    warn(context, line);
  }
  status = add_can(config, robot, err);
  if (status != WM_OK) {
    wm_recording_close(robot);
    return status;
  }
  *out = robot;
  return WM_OK;
}
