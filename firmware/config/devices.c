// SPDX-License-Identifier: Apache-2.0
// `devices:` of a configuration.
#include "config/devices.h"
#include "config/keys.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

#include "waymark/streams.h"

wm_status config_path(const wm_yaml_node *node, const char *config_path, char out[WM_PATH_MAX], wm_error *err) {
  char name[WM_PATH_MAX];
  wm_status status = wm_yaml_string(node, name, sizeof name, err);
  if (status != WM_OK) return status;
  const char *slash = strrchr(config_path, '/');
  int folder = name[0] == '/' || !slash ? 0 : (int)(slash - config_path) + 1;
  if (snprintf(out, WM_PATH_MAX, "%.*s%s", folder, config_path, name) >= WM_PATH_MAX)
    return wm_yaml_fail(node, err, "the path is longer than %d bytes", WM_PATH_MAX - 1);
  return WM_OK;
}

// The interface's own file, else the configuration's.
static wm_status file_of(const wm_yaml_node *item, const char *key, const char *otherwise, const wm_config *config,
                         char out[WM_PATH_MAX], wm_error *err) {
  wm_yaml_node node = wm_yaml_get(item, key);
  if (wm_yaml_there(&node)) return config_path(&node, config->path, out, err);
  if (!otherwise[0])
    return wm_yaml_fail(item, err, "%s: is missing; name one here or at the top of the configuration", key);
  snprintf(out, WM_PATH_MAX, "%s", otherwise);
  return WM_OK;
}

static wm_status read_can(const wm_yaml_node *item, wm_config *config, wm_error *err) {
  wm_can_device_config *out = &config->devices.can[config->devices.can_count];
  out->line = wm_yaml_line(item);
  if (!wm_yaml_is_map(item)) return wm_yaml_fail(item, err, "a map {interface: can0, ...} is needed");
  wm_status status = config_check_keys(item, kConfigCanDeviceKeys, err);
  if (status != WM_OK) return status;
  wm_yaml_node interface = wm_yaml_get(item, "interface");
  if (!wm_yaml_there(&interface)) return wm_yaml_fail(item, err, "interface: is missing; `ip link` lists them");
  status = wm_yaml_string(&interface, out->interface, sizeof out->interface, err);
  if (status != WM_OK) return status;
  for (size_t i = 0; i < config->devices.can_count; i++)
    if (strcmp(config->devices.can[i].interface, out->interface) == 0)
      return wm_yaml_fail(&interface, err, "'%s' appears twice (first in line %d)", out->interface,
                          config->devices.can[i].line);
  status = file_of(item, "dbc", config->overrides.dbc, config, out->dbc, err);
  if (status == WM_OK)
    status = file_of(item, "can_signals", config->overrides.can_signals, config, out->can_signals, err);
  config->devices.can_count++;
  return status;
}

// Reads the text where there is one; else *out is unchanged.
static wm_status text(const wm_yaml_node *item, const char *key, char *out, size_t capacity, wm_error *err) {
  wm_yaml_node node = wm_yaml_get(item, key);
  return wm_yaml_there(&node) ? wm_yaml_string(&node, out, capacity, err) : WM_OK;
}

static wm_status read_controls(const wm_yaml_node *item, wm_camera_device_config *out, wm_error *err) {
  wm_yaml_node controls = wm_yaml_get(item, "controls");
  if (!wm_yaml_there(&controls)) return WM_OK;
  if (!wm_yaml_is_map(&controls)) return wm_yaml_fail(&controls, err, "a map {CONTROL: VALUE} is needed");
  if (wm_yaml_count(&controls) > WM_CAMERA_CONTROLS_MAX)
    return wm_yaml_fail(&controls, err, "more than %d controls", WM_CAMERA_CONTROLS_MAX);
  for (size_t i = 0; i < wm_yaml_count(&controls); i++) {
    const char *name;
    int line;
    int64_t value;
    wm_yaml_node node = wm_yaml_value(&controls, i, &name, &line);
    wm_status status = wm_yaml_i64(&node, INT32_MIN, INT32_MAX, &value, err);
    if (status != WM_OK) return status;
    if (snprintf(out->controls[i].name, sizeof out->controls[i].name, "%s", name) >= (int)sizeof out->controls[i].name)
      return wm_yaml_fail(&node, err, "no control has such a long name (`v4l2-ctl -l` lists them)");
    out->controls[i].value = (int32_t)value;
    out->control_count++;
  }
  return WM_OK;
}

static wm_status camera_is_new(const wm_yaml_node *item, const wm_config *config, const wm_camera_device_config *camera,
                               wm_error *err) {
  for (size_t i = 0; i < config->devices.camera_count; i++) {
    const wm_camera_device_config *other = &config->devices.cameras[i];
    if (strcmp(other->name, camera->name) == 0)
      return wm_yaml_fail(item, err, "the camera '%s' appears twice (first in line %d)", camera->name, other->line);
    if (camera->libcamera[0] && strcmp(other->libcamera, camera->libcamera) == 0)
      return wm_yaml_fail(item, err, "libcamera's '%s' appears twice (first in line %d)", camera->libcamera,
                          other->line);
    if (camera->gst[0] && strcmp(other->gst, camera->gst) == 0)
      return wm_yaml_fail(item, err, "the pipeline '%s' appears twice (first in line %d)", camera->gst, other->line);
    if (camera->device[0] && strcmp(other->device, camera->device) == 0)
      return wm_yaml_fail(item, err, "the device '%s' appears twice (first in line %d)", camera->device, other->line);
  }
  return WM_OK;
}

// Which camera: by libcamera's identifier, a pipeline, or V4L2's path, card or bus.
static wm_status read_which(const wm_yaml_node *item, wm_camera_device_config *out, wm_error *err) {
  wm_status status = text(item, "device", out->device, sizeof out->device, err);
  if (status == WM_OK) status = text(item, "card", out->card, sizeof out->card, err);
  if (status == WM_OK) status = text(item, "bus", out->bus, sizeof out->bus, err);
  if (status == WM_OK) status = text(item, "libcamera", out->libcamera, sizeof out->libcamera, err);
  if (status == WM_OK) status = text(item, "gst", out->gst, sizeof out->gst, err);
  if (status != WM_OK) return status;
  int is_v4l2 = out->device[0] || out->card[0] || out->bus[0];
  if (!is_v4l2 && !out->libcamera[0] && !out->gst[0])
    return wm_yaml_fail(
        item, err,
        "device: is missing: a path (/dev/v4l/by-id/... stays the same when it is plugged in again), or "
        "card or bus as `v4l2-ctl -D` prints them, or libcamera: an identifier as `cam -l` prints it, or gst: a "
        "pipeline");
  wm_yaml_node node = wm_yaml_get(item, out->libcamera[0] ? "libcamera" : "gst");
  if (is_v4l2 + !!out->libcamera[0] + !!out->gst[0] > 1)
    return wm_yaml_fail(&node, err,
                        "device, card and bus are V4L2's; name the camera by them, or by libcamera:, or by gst:");
  if (out->libcamera[0] && !wm_camera_has_libcamera()) return wm_yaml_fail(&node, err, WM_WITHOUT_LIBCAMERA);
  return WM_OK;
}

static wm_status read_camera(const wm_yaml_node *item, wm_config *config, wm_error *err) {
  wm_camera_device_config *out = &config->devices.cameras[config->devices.camera_count];
  int32_t format = -1;
  out->line = wm_yaml_line(item);
  if (!wm_yaml_is_map(item)) return wm_yaml_fail(item, err, "a map {name: CAMERA, device: /dev/video0, ...} is needed");
  wm_status status = config_check_keys(item, kConfigCameraDeviceKeys, err);
  if (status == WM_OK) status = text(item, "name", out->name, sizeof out->name, err);
  if (status == WM_OK && !out->name[0])
    return wm_yaml_fail(item, err, "name: is missing: the camera's name in calibration.yaml");
  if (status == WM_OK) status = read_which(item, out, err);
  if (status == WM_OK) status = config_choice(item, kConfigCameraDeviceKeys, "format", &format, err);
  if (format >= 0) snprintf(out->format, sizeof out->format, "%s", wm_camera_formats[format]);
  if (status == WM_OK) status = config_number(item, kConfigCameraDeviceKeys, "rate_hz", &out->rate_hz, err);
  if (status == WM_OK) status = config_number(item, kConfigCameraDeviceKeys, "exposure_ms", &out->exposure_ms, err);
  if (status == WM_OK) status = config_number(item, kConfigCameraDeviceKeys, "latency_ms", &out->latency_ms, err);
  if (status == WM_OK) status = config_choice(item, kConfigCameraDeviceKeys, "stamp", &out->stamp, err);
  if (status == WM_OK) status = read_controls(item, out, err);
  if (status == WM_OK) status = camera_is_new(item, config, out, err);
  config->devices.camera_count++;
  return status;
}

// A stream has one device.
static wm_status stream_is_new(const wm_yaml_node *item, const wm_config *config, const char *stream, wm_error *err) {
  const wm_devices_config *devices = &config->devices;
  int line = 0;
  for (size_t i = 0; i < devices->lcm_count; i++)
    if (strcmp(devices->lcm[i].stream, stream) == 0) line = devices->lcm[i].line;
  for (size_t i = 0; i < devices->gpsd_count; i++)
    if (strcmp(wm_gpsd_stream(&devices->gpsd[i]), stream) == 0) line = devices->gpsd[i].line;
  if (devices->dvl.host[0] && strcmp("motion6", stream) == 0) line = devices->dvl.line;
  return line == 0 ? WM_OK : wm_yaml_fail(item, err, "the stream '%s' appears twice (first in line %d)", stream, line);
}

static wm_status read_lcm(const wm_yaml_node *item, wm_config *config, wm_error *err) {
  wm_lcm_device_config *out = &config->devices.lcm[config->devices.lcm_count];
  int32_t stream = -1;
  *out = (wm_lcm_device_config){.line = wm_yaml_line(item), .rate_max_hz = 1000};
  if (!wm_yaml_is_map(item)) return wm_yaml_fail(item, err, "a map {stream: motion, ...} is needed");
  wm_status status = config_check_keys(item, kConfigLcmDeviceKeys, err);
  if (status == WM_OK) status = config_choice(item, kConfigLcmDeviceKeys, "stream", &stream, err);
  if (status != WM_OK) return status;
  if (stream < 0) return wm_yaml_fail(item, err, "stream: is missing, e.g. {stream: motion}");
  const char *name = wm_stream_names[stream];
  status = stream_is_new(item, config, name, err);
  if (status != WM_OK) return status;
  snprintf(out->stream, sizeof out->stream, "%s", name);
  for (size_t i = 0; out->stream[i]; i++) out->channel[i] = (char)toupper((unsigned char)out->stream[i]);
  status = text(item, "channel", out->channel, sizeof out->channel, err);
  if (status == WM_OK) status = config_choice(item, kConfigLcmDeviceKeys, "clock", &out->clock, err);
  if (status == WM_OK) status = config_number(item, kConfigLcmDeviceKeys, "rate_max_hz", &out->rate_max_hz, err);
  config->devices.lcm_count++;
  return status;
}

static wm_status read_gpsd(const wm_yaml_node *item, wm_config *config, wm_error *err) {
  wm_gpsd_device_config *out = &config->devices.gpsd[config->devices.gpsd_count];
  // 2947 is gpsd's port by IANA. A velocity of 1 m/s has a direction to 6 degrees where its error is 0.1 m/s; antennas
  // 1 m apart reach 0.2 degrees.
  *out = (wm_gpsd_device_config){.line = wm_yaml_line(item),
                                 .host = "localhost",
                                 .port = 2947,
                                 .accuracy_scale = 1,
                                 .course_min_mps = 1,
                                 .sigma_deg = 1};
  if (!wm_yaml_is_map(item)) return wm_yaml_fail(item, err, "a map {take: position, ...} is needed");
  wm_status status = config_check_keys(item, kConfigGpsdDeviceKeys, err);
  if (status == WM_OK) status = config_choice(item, kConfigGpsdDeviceKeys, "take", &out->from, err);
  if (status == WM_OK) status = text(item, "host", out->host, sizeof out->host, err);
  if (status == WM_OK) status = config_whole(item, kConfigGpsdDeviceKeys, "port", &out->port, err);
  if (status == WM_OK) status = text(item, "device", out->device, sizeof out->device, err);
  wm_yaml_node node = wm_yaml_get(item, "device");
  if (status == WM_OK && strpbrk(out->device, "\"\\"))
    status = wm_yaml_fail(&node, err, "no path has a quote or a backslash");
  if (status == WM_OK) status = config_choice(item, kConfigGpsdDeviceKeys, "clock", &out->clock, err);
  if (status == WM_OK) status = config_number(item, kConfigGpsdDeviceKeys, "latency_ms", &out->latency_ms, err);
  if (status == WM_OK) status = config_number(item, kConfigGpsdDeviceKeys, "accuracy_scale", &out->accuracy_scale, err);
  if (status == WM_OK) status = config_number(item, kConfigGpsdDeviceKeys, "course_min_mps", &out->course_min_mps, err);
  if (status == WM_OK) status = config_number(item, kConfigGpsdDeviceKeys, "sigma_deg", &out->sigma_deg, err);
  if (status == WM_OK) status = stream_is_new(item, config, wm_gpsd_stream(out), err);
  config->devices.gpsd_count++;
  return status;
}

static wm_status read_iio(const wm_yaml_node *item, wm_config *config, wm_error *err) {
  wm_iio_device_config *out = &config->devices.iio;
  if (!wm_yaml_there(item)) return WM_OK;
  out->line = wm_yaml_line(item);
  if (!wm_yaml_is_map(item)) return wm_yaml_fail(item, err, "a map {device: NAME, ...} is needed");
  wm_status status = config_check_keys(item, kConfigIioDeviceKeys, err);
  if (status == WM_OK) status = text(item, "device", out->device, sizeof out->device, err);
  if (status == WM_OK && !out->device[0])
    return wm_yaml_fail(item, err,
                        "device: is missing: a name as `cat /sys/bus/iio/devices/*/name` prints them, e.g. bmi160");
  if (status == WM_OK) status = text(item, "trigger", out->trigger, sizeof out->trigger, err);
  if (status == WM_OK) status = config_number(item, kConfigIioDeviceKeys, "rate_hz", &out->rate_hz, err);
  return status == WM_OK ? stream_is_new(item, config, "imu", err) : status;
}

static wm_status read_dvl(const wm_yaml_node *item, wm_config *config, wm_error *err) {
  wm_dvl_device_config *out = &config->devices.dvl;
  if (!wm_yaml_there(item)) return WM_OK;
  wm_dvl_device_config found = {.line = wm_yaml_line(item), .port = 16171};
  if (!wm_yaml_is_map(item)) return wm_yaml_fail(item, err, "a map {host: ADDRESS, ...} is needed");
  wm_status status = config_check_keys(item, kConfigDvlDeviceKeys, err);
  if (status == WM_OK) status = text(item, "host", found.host, sizeof found.host, err);
  if (status == WM_OK && !found.host[0])
    return wm_yaml_fail(item, err, "host: is missing: the log's address, e.g. 192.168.194.95");
  if (status == WM_OK) status = config_whole(item, kConfigDvlDeviceKeys, "port", &found.port, err);
  if (status == WM_OK) status = stream_is_new(item, config, "motion6", err);
  *out = found;
  return status;
}

static wm_status read_list(const wm_yaml_node *list, size_t max, const char *what,
                           wm_status (*read)(const wm_yaml_node *, wm_config *, wm_error *), wm_config *config,
                           wm_error *err) {
  if (!wm_yaml_there(list)) return WM_OK;
  if (!wm_yaml_is_list(list)) return wm_yaml_fail(list, err, "a list of %s is needed", what);
  if (wm_yaml_count(list) > max) return wm_yaml_fail(list, err, "more than %zu", max);
  wm_status status = WM_OK;
  for (size_t i = 0; status == WM_OK && i < wm_yaml_count(list); i++) {
    wm_yaml_node item = wm_yaml_item(list, i);
    status = read(&item, config, err);
  }
  return status;
}

wm_status config_read_devices(const wm_yaml_node *root, wm_config *out, wm_error *err) {
  wm_yaml_node devices = wm_yaml_get(root, "devices"), can = wm_yaml_get(root, "devices.can"),
               cameras = wm_yaml_get(root, "devices.cameras"), lcm = wm_yaml_get(root, "devices.lcm"),
               gpsd = wm_yaml_get(root, "devices.gpsd"), iio = wm_yaml_get(root, "devices.iio"),
               dvl = wm_yaml_get(root, "devices.dvl");
  if (!wm_yaml_there(&devices)) return WM_OK;
  wm_status status = config_check_keys(&devices, kConfigDevicesKeys, err);
  if (status == WM_OK) status = read_list(&can, WM_CAN_DEVICES_MAX, "{interface: NAME, ...}", read_can, out, err);
  if (status == WM_OK)
    status = read_list(&cameras, WM_CAMERA_DEVICES_MAX, "{name: CAMERA, device: PATH, ...}", read_camera, out, err);
  if (status == WM_OK) status = read_list(&lcm, WM_LCM_DEVICES_MAX, "{stream: NAME, ...}", read_lcm, out, err);
  if (status == WM_OK) status = read_list(&gpsd, WM_GPSD_DEVICES_MAX, "{take: position, ...}", read_gpsd, out, err);
  if (status == WM_OK) status = read_iio(&iio, out, err);
  if (status == WM_OK) status = read_dvl(&dvl, out, err);
  if (status == WM_OK)
    status = config_choice(&devices, kConfigDevicesKeys, "sightings", &out->devices.sightings_by_lcm, err);
  return status;
}
