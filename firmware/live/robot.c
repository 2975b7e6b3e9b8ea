// SPDX-License-Identifier: Apache-2.0
#include "live/robot.h"

#include <stdio.h>
#include <string.h>

#include "live/cameras.h"
#include "live/row_source.h"

// The source of one interface; with several interfaces its name ends with theirs: "can:can1".
static wm_status add_interface(const wm_can_device_config *device, int is_one, wm_can_part part, wm_recording *robot,
                               wm_error *err) {
  wm_source *source;
  uint32_t quantities = 0;
  wm_status status =
      wm_can_device_open(device, part, wm_site_gnss_origin(wm_recording_site(robot)), &source, &quantities, err);
  if (status != WM_OK || !source) return status;
  const size_t end = strlen(source->name);
  if (!is_one) snprintf(source->name + end, sizeof source->name - end, ":%s", device->interface);
  return wm_recording_add_device(robot, source, quantities, err);
}

static wm_status add_can(const wm_config *config, wm_recording *robot, wm_error *err) {
  const wm_devices_config *devices = &config->devices;
  wm_status status = WM_OK;
  for (size_t i = 0; status == WM_OK && i < devices->can_count; i++) {
    const int is_one = devices->can_count == 1;
    status = add_interface(&devices->can[i], is_one, WM_CAN_MOTION, robot, err);
    if (status == WM_OK) status = add_interface(&devices->can[i], is_one, WM_CAN_GNSS, robot, err);
  }
  return status;
}

static wm_status add_rows(const wm_config *config, wm_recording *robot, wm_error *err) {
  wm_source *sources[WM_ROW_DEVICES_MAX];
  size_t count;
  wm_status status = row_sources_open(config, wm_recording_site(robot), sources, &count, err);
  for (size_t i = 0; i < count; i++) {  // added one after the other: each is the recording's, or closed
    if (status != WM_OK)
      sources[i]->ops->close(sources[i]);
    else
      status = wm_recording_add_device(robot, sources[i], wm_stream_quantities(row_source_stream(sources[i])), err);
  }
  return status;
}

// A camera is opened with the first reader of its pictures.
static wm_status check_cameras(const wm_config *config, const wm_recording *robot, wm_error *err) {
  const wm_devices_config *devices = &config->devices;
  for (size_t i = 0; i < devices->camera_count; i++) {
    int index = wm_rig_find_camera(wm_site_rig(wm_recording_site(robot)), devices->cameras[i].name);
    if (index < 0)
      return wm_fail(err, WM_BAD_CONFIG, "%s:%d: devices.cameras[%zu].name: '%s' is not a camera of the calibration",
                     config->path, devices->cameras[i].line, i, devices->cameras[i].name);
    if (wm_site_rig(wm_recording_site(robot))->cameras[index].width_px == 0)
      return wm_fail(err, WM_BAD_CONFIG, "%s:%d: devices.cameras[%zu]: the calibration of '%s' has no image_size",
                     config->path, devices->cameras[i].line, i, devices->cameras[i].name);
  }
  return WM_OK;
}

wm_status wm_robot_open_site(const wm_config *config, wm_warn_fn warn, void *context, wm_recording **out,
                             wm_error *err) {
  wm_recording *robot;
  wm_site *site;
  wm_pictures *pictures;
  *out = NULL;
  wm_status status = wm_site_open(NULL, &config->overrides, warn, context, &site, err);
  if (status == WM_OK) status = wm_recording_of_site("robot", site, &robot, err);
  if (status != WM_OK) return status;
  status = check_cameras(config, robot, err);
  if (status == WM_OK) status = cameras_open(config, warn, context, &pictures, err);
  if (status != WM_OK) {
    wm_recording_close(robot);
    return status;
  }
  wm_recording_set_pictures(robot, pictures);
  *out = robot;
  return WM_OK;
}

wm_status wm_robot_open(const wm_config *config, wm_warn_fn warn, void *context, wm_recording **out, wm_error *err) {
  *out = NULL;
  if (wm_devices_count(&config->devices) == 0)
    return wm_fail(err, WM_BAD_CONFIG,
                   "%s: devices: is missing, and no recording is given: name the robot's devices (devices: {can: "
                   "[{interface: can0}]}, or {lcm: [{stream: motion}]}) or --recording",
                   config->path);
  wm_recording *robot;
  wm_status status = wm_robot_open_site(config, warn, context, &robot, err);
  if (status != WM_OK) return status;
  if (config->devices.camera_count > 0 && config->vision_count == 0 && warn)
    warn(context, WM_NOTE_UNUSED, "devices.cameras: their pictures are not used: `vision:` names no detector");
  status = add_can(config, robot, err);
  if (status == WM_OK) status = add_rows(config, robot, err);
  if (status != WM_OK) {
    wm_recording_close(robot);
    return status;
  }
  *out = robot;
  return WM_OK;
}
