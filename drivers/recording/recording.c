// SPDX-License-Identifier: Apache-2.0
#include "waymark/recording.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "about.h"
#include "calibration.h"
#include "can_stream.h"
#include "streams.h"
#include "waymark/map.h"
#include "waymark/text.h"
#include "waymark/yaml.h"

struct wm_recording {
  char dir[WM_PATH_MAX];
  char name[128];
  double duration_s;
  wm_site *site;
  wm_yaml *about;  // recording.yaml; NULL: no folder, sources are added
  wm_recording_overrides overrides;
  warner warn;
  sensor_names sighting_sensors, marker_sensors, corner_sensors;
  wm_corner_reader *corners[WM_SENSORS_MAX];  // by corner_sensors
  uint32_t quantities;
  wm_source *sources[WM_SOURCES_MAX];
  size_t source_count;
  wm_pictures *pictures;  // NULL: the folder's videos
};

static wm_status path_of(const wm_recording *self, const char *file, char out[WM_PATH_MAX], wm_error *err) {
  if (snprintf(out, WM_PATH_MAX, "%s/%s", self->dir, file) >= WM_PATH_MAX)
    return wm_fail(err, WM_BAD_USAGE, "%s/%s: the path is longer than %d bytes", self->dir, file, WM_PATH_MAX - 1);
  return WM_OK;
}

// The override where there is one, else the recording's own file; `*there`: whether it exists.
static wm_status choose(const wm_recording *self, const char *override, const char *file, char out[WM_PATH_MAX],
                        int *there, wm_error *err) {
  if (*override) {
    *there = 1;
    snprintf(out, WM_PATH_MAX, "%s", override);
    return WM_OK;
  }
  wm_status status = path_of(self, file, out, err);
  *there = status == WM_OK && access(out, F_OK) == 0;
  return status;
}

wm_status recording_check_format(const wm_yaml_node *root, wm_error *err) {
  char format[64];
  wm_yaml_node node = wm_yaml_get(root, "format");
  if (!wm_yaml_there(&node))
    return wm_yaml_fail(root, err, "format: is missing; 'format: waymark-recording/1' is needed");
  wm_status status = wm_yaml_string(&node, format, sizeof format, err);
  if (status == WM_OK && strcmp(format, "waymark-recording/1") != 0)
    return wm_yaml_fail(&node, err, "'%s' is not a format that this program reads; it reads waymark-recording/1",
                        format);
  return status;
}

static int is_read(const char *file) {
  static const char *const kOthers[] = {"can.log",       "vehicle.dbc",      "can-signals.yaml",
                                        "landmarks.csv", "calibration.yaml", NULL};
  for (size_t i = 0; kOthers[i]; i++)
    if (strcmp(file, kOthers[i]) == 0) return 1;
  for (size_t i = 0; kStreams[i]; i++)
    if (strcmp(file, kStreams[i]->file) == 0) return 1;
  return 0;
}

// Every file under `streams` must exist; for files that are not read here (videos, truth) a warning suffices.
static wm_status check_streams(const wm_recording *self, const wm_yaml_node *streams, wm_error *err) {
  if (wm_yaml_there(streams) && !wm_yaml_is_list(streams))
    return wm_yaml_fail(streams, err, "a list of the files that are there is needed");
  for (size_t i = 0; i < wm_yaml_count(streams); i++) {
    char file[256], path[WM_PATH_MAX];
    wm_yaml_node item = wm_yaml_item(streams, i);
    wm_status status = wm_yaml_string(&item, file, sizeof file, err);
    if (status == WM_OK) status = path_of(self, file, path, err);
    if (status != WM_OK) return status;
    if (access(path, F_OK) == 0) continue;
    if (is_read(file))
      return wm_yaml_fail(&item, err, "'%s' is not in the folder; put it there or take it off the list", file);
    warn_line(&self->warn, WM_NOTE_UNUSED, "%s:%d: streams: '%s' is not in the folder; nothing here reads it",
              wm_yaml_file(&item), wm_yaml_line(&item), file);
  }
  return WM_OK;
}

static wm_status read_start(wm_recording *self, wm_error *err) {
  const wm_yaml_node root_node = wm_yaml_root(self->about), *root = &root_node;
  wm_error said;
  size_t unknown;
  wm_start start;
  wm_start_init(&start);
  wm_yaml_node pose = wm_yaml_get(root, "vehicle.initial_pose");
  wm_yaml_node misplaced = wm_yaml_get(root, "initial_pose");
  if (wm_yaml_there(&misplaced))
    warn_line(&self->warn, WM_NOTE_FILE, "%s:%d: initial_pose: belongs under vehicle; here it is ignored",
              wm_yaml_file(root), wm_yaml_line(&misplaced));
  if (!wm_yaml_there(&pose)) return WM_OK;
  // Unknown keys are allowed in recording.yaml; a misspelt one gets a warning.
  const int is_near = wm_yaml_check_keys(&pose, wm_start_keys, WM_YAML_NEAR, &unknown, &said) != WM_OK;
  if (is_near || unknown) warn_line(&self->warn, is_near ? WM_NOTE_MISSPELT : WM_NOTE_FILE, "%s", said.text);
  wm_status status = wm_start_read(&pose, &start, err);
  if (status == WM_OK) wm_site_set_start(self->site, &start);
  return status;
}

// A replay of a run's log has no recording.yaml: the kind of the rows must be in the configuration.
static void refuse_motion_kind(wm_recording *self) {
  const wm_yaml_node root = wm_yaml_root(self->about), kind = wm_yaml_get(&root, "vehicle.motion_kind");
  if (!wm_yaml_there(&kind)) return;
  warn_line(&self->warn, WM_NOTE_FILE,
            "%s:%d: vehicle.motion_kind: is not read; whether the rows of motion.csv are commands or measured is found "
            "from them, unless motion.twist in the configuration states it",
            wm_yaml_file(&root), wm_yaml_line(&kind));
}

static wm_status read_about(wm_recording *self, wm_error *err) {
  char path[WM_PATH_MAX];
  wm_status status = path_of(self, "recording.yaml", path, err);
  if (status != WM_OK) return status;
  status = wm_yaml_load(path, &self->about, err);
  if (status == WM_NOT_FOUND)
    return wm_fail(err, WM_NOT_FOUND, "%s: there is no recording.yaml in it: is it a recording's folder?", self->dir);
  if (status != WM_OK) return status;
  wm_yaml_node root = wm_yaml_root(self->about);
  if (!wm_yaml_is_map(&root))
    return wm_yaml_fail(&root, err, "a map that begins with 'format: waymark-recording/1' is needed");
  wm_yaml_node name = wm_yaml_get(&root, "name"), duration = wm_yaml_get(&root, "duration_s"),
               offset = wm_yaml_get(&root, "truth_offset_m"), streams = wm_yaml_get(&root, "streams");
  double offset_m[3];
  status = recording_check_format(&root, err);
  if (status == WM_OK && wm_yaml_there(&name)) status = wm_yaml_string(&name, self->name, sizeof self->name, err);
  if (status == WM_OK && wm_yaml_there(&duration)) status = wm_yaml_f64(&duration, 0, 1e9, &self->duration_s, err);
  if (status == WM_OK && wm_yaml_there(&offset)) status = wm_yaml_f64_list(&offset, 3, 3, offset_m, NULL, err);
  if (status == WM_OK) status = check_streams(self, &streams, err);
  return status;
}

static int is_listed(const wm_recording *self, const char *file) {
  wm_yaml_node root = wm_yaml_root(self->about), streams = wm_yaml_get(&root, "streams");
  for (size_t i = 0; i < wm_yaml_count(&streams); i++) {
    char listed[256];
    wm_yaml_node item = wm_yaml_item(&streams, i);
    if (wm_yaml_string(&item, listed, sizeof listed, NULL) == WM_OK && strcmp(listed, file) == 0) return 1;
  }
  return !wm_yaml_there(&streams);
}

// Whether the stream's file is in the folder. It is read also where `streams` omits it.
static wm_status find_stream(const wm_recording *self, const char *file, char path[WM_PATH_MAX], int *there,
                             wm_error *err) {
  wm_status status = choose(self, "", file, path, there, err);
  if (status == WM_OK && *there && !is_listed(self, file))
    warn_line(&self->warn, WM_NOTE_FILE, "%s: is not listed under streams in recording.yaml, but there: it is read",
              path);
  return status;
}

static wm_status add_source(wm_recording *self, wm_source *source, wm_error *err) {
  if (self->source_count == WM_SOURCES_MAX) {
    source->ops->close(source);
    return wm_fail(err, WM_FULL, "%s: more than %d sources (a sensor in a file is one)", self->dir, WM_SOURCES_MAX);
  }
  source->index = (uint16_t)self->source_count;
  self->sources[self->source_count++] = source;
  return WM_OK;
}

static wm_status add_stream(wm_recording *self, const stream_kind *kind, wm_error *err) {
  char path[WM_PATH_MAX];
  int there;
  wm_source *source;
  wm_status status = find_stream(self, kind->file, path, &there, err);
  if (status != WM_OK || !there) return status;
  status = stream_open(path, kind, NULL, 0, NULL, 0, NULL, self->warn.fn, self->warn.context, &source, err);
  if (status != WM_OK) return status;
  stream_mount(source, wm_site_row_mountings(self->site));
  self->quantities |= source->quantities;
  return add_source(self, source, err);
}

static wm_status make_corner_reader(wm_recording *self, const char *path, const char *name, wm_corner_reader **out,
                                    wm_error *err) {
  const wm_rig *rig = wm_site_rig(self->site);
  const int32_t camera = wm_rig_find_camera(rig, name);
  if (camera < 0)
    return wm_fail(err, WM_BAD_CONFIG, "%s: the sensor '%s' is not a camera of calibration.yaml; corners need its lens",
                   path, name);
  return wm_corner_reader_make(path, name, &rig->cameras[camera], rig->marker_size_m, out, err);
}

// One source for each sensor: each reads the file by itself, so that memory stays bounded at any order of reading.
static wm_status add_sensor_streams(wm_recording *self, const stream_kind *kind, sensor_names *names, wm_error *err) {
  char path[WM_PATH_MAX];
  int there;
  wm_status status = find_stream(self, kind->file, path, &there, err);
  if (status != WM_OK || !there) return status;
  status = stream_find_sensors(path, kind, names, err);
  for (size_t i = 0; status == WM_OK && i < names->count; i++) {
    uint16_t index;
    wm_source *source;
    status = wm_site_sensor(self->site, path, names->name[i], &index, err);
    wm_corner_reader **corners = kind == &kStreamCorners ? &self->corners[i] : NULL;
    if (status == WM_OK && corners) status = make_corner_reader(self, path, names->name[i], corners, err);
    if (status != WM_OK) break;
    status = stream_open(path, kind, names->name[i], index, names, i == 0, corners ? *corners : NULL,
                         i == 0 ? self->warn.fn : NULL, self->warn.context, &source, err);
    if (status == WM_OK) status = add_source(self, source, err);
  }
  return status;
}

// The buses of recording.yaml, or one for all. With one bus a configuration's DBC and binding replace the recording's;
// several buses have files of their own.
static wm_status find_buses(const wm_recording *self, can_buses *out, wm_error *err) {
  int there;
  wm_yaml_node root = wm_yaml_root(self->about), list = wm_yaml_get(&root, "can");
  wm_status status = can_buses_read(&list, self->dir, out, err);
  if (status == WM_OK && out->count > 1 && (self->overrides.dbc[0] || self->overrides.can_signals[0]))
    warn_line(&self->warn, WM_NOTE_FILE,
              "%s: has %zu CAN buses with files of their own; the configuration's dbc and can_signals are "
              "not taken",
              self->dir, out->count);
  if (status != WM_OK || out->count > 1) return status;
  can_bus *bus = &out->bus[0];
  if (out->count == 0 || self->overrides.dbc[0])
    status = choose(self, self->overrides.dbc, "vehicle.dbc", bus->dbc, &there, err);
  if (status == WM_OK && (out->count == 0 || self->overrides.can_signals[0]))
    status = choose(self, self->overrides.can_signals, "can-signals.yaml", bus->signals, &there, err);
  return status;
}

// The recording's first missing file; NULL: none.
static const char *missing_of(const wm_recording *self, const can_buses *buses) {
  for (size_t i = 0; i == 0 || i < buses->count; i++) {
    const char *dbc = buses->bus[i].dbc, *signals = buses->bus[i].signals;
    if (strcmp(dbc, self->overrides.dbc) != 0 && access(dbc, F_OK) != 0) return dbc;
    if (strcmp(signals, self->overrides.can_signals) != 0 && access(signals, F_OK) != 0) return signals;
  }
  return NULL;
}

static wm_status add_bus(wm_recording *self, const char *log, const can_buses *buses, size_t bus, wm_can_part part,
                         wm_error *err) {
  wm_source *source;
  uint32_t quantities = 0;
  wm_status status = can_stream_open(log, buses, bus, part, wm_site_gnss_origin(self->site), self->warn.fn,
                                     self->warn.context, &source, &quantities, err);
  self->quantities |= quantities;
  if (status == WM_OK && source) source->quantities = quantities;
  return status == WM_OK && source ? add_source(self, source, err) : status;
}

static wm_status add_can(wm_recording *self, wm_error *err) {
  char log[WM_PATH_MAX], motion[WM_PATH_MAX];
  int have_log, have_motion = 0;
  can_buses buses;
  wm_status status = find_stream(self, "can.log", log, &have_log, err);
  if (status != WM_OK || !have_log) return status;
  status = find_buses(self, &buses, err);
  const stream_kind *const others[] = {&kStreamMotion, &kStreamMotion6, &kStreamIncrements};
  for (size_t i = 0; status == WM_OK && !have_motion && i < sizeof others / sizeof others[0]; i++)
    status = choose(self, "", others[i]->file, motion, &have_motion, err);
  if (status != WM_OK) return status;
  const char *missing = missing_of(self, &buses);
  if (missing && !have_motion)
    return wm_fail(err, WM_NOT_FOUND,
                   "%s: is not there, but needed to read can.log; name one in the configuration or put "
                   "it into the folder",
                   missing);
  if (missing) warn_line(&self->warn, WM_NOTE_FILE, "%s: is not there; can.log is not read", missing);
  for (size_t i = 0; !missing && status == WM_OK && (i == 0 || i < buses.count); i++) {
    status = add_bus(self, log, &buses, i, WM_CAN_MOTION, err);
    if (status == WM_OK) status = add_bus(self, log, &buses, i, WM_CAN_GNSS, err);
  }
  return status;
}

static wm_status add_sources(wm_recording *self, wm_error *err) {
  wm_status status = add_can(self, err);
  sensor_names *names[] = {&self->sighting_sensors, &self->marker_sensors, &self->corner_sensors};
  for (size_t i = 0, with_sensors = 0; status == WM_OK && kStreams[i]; i++)
    status = kStreams[i]->has_sensors ? add_sensor_streams(self, kStreams[i], names[with_sensors++], err)
                                      : add_stream(self, kStreams[i], err);
  return status;
}

wm_status wm_recording_open(const char *dir, const wm_recording_overrides *overrides, wm_warn_fn warn, void *context,
                            wm_recording **out, wm_error *err) {
  *out = NULL;
  wm_recording *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "%s: no memory to open it", dir);
  size_t length = strlen(dir);
  while (length > 1 && dir[length - 1] == '/') length--;
  snprintf(self->dir, sizeof self->dir, "%.*s", (int)(length < WM_PATH_MAX ? length : WM_PATH_MAX - 1), dir);
  const char *slash = strrchr(self->dir, '/');
  snprintf(self->name, sizeof self->name, "%s", slash && slash[1] ? slash + 1 : self->dir);
  self->duration_s = (double)NAN;
  self->warn = (warner){warn, context};
  if (overrides) self->overrides = *overrides;
  wm_status status = read_about(self, err);
  if (status == WM_OK) status = wm_site_open(self->dir, &self->overrides, warn, context, &self->site, err);
  if (status == WM_OK) status = read_start(self, err);
  if (status == WM_OK) refuse_motion_kind(self);
  if (status == WM_OK) status = add_sources(self, err);
  if (status != WM_OK) {
    wm_recording_close(self);
    return status;
  }
  *out = self;
  return WM_OK;
}

wm_status wm_recording_of_site(const char *name, wm_site *site, wm_recording **out, wm_error *err) {
  wm_recording *self = calloc(1, sizeof *self);
  *out = self;
  if (!self) {
    wm_site_close(site);
    return wm_fail(err, WM_IO, "%s: no memory for it", name);
  }
  snprintf(self->name, sizeof self->name, "%s", name);
  snprintf(self->dir, sizeof self->dir, "%s", name);
  self->duration_s = (double)NAN;
  self->site = site;
  return WM_OK;
}

wm_status wm_recording_add_device(wm_recording *self, wm_source *device, uint32_t quantities, wm_error *err) {
  self->quantities |= device->quantities = quantities;
  return add_source(self, device, err);
}

void wm_recording_set_pictures(wm_recording *self, wm_pictures *pictures) { self->pictures = pictures; }

wm_pictures *wm_recording_pictures(const wm_recording *self) { return self->pictures; }

void wm_recording_close(wm_recording *self) {
  if (!self) return;
  for (size_t i = 0; i < self->source_count; i++) self->sources[i]->ops->close(self->sources[i]);
  for (size_t i = 0; i < WM_SENSORS_MAX; i++) wm_corner_reader_free(self->corners[i]);
  if (self->pictures) self->pictures->ops->close(self->pictures);
  wm_yaml_free(self->about);
  wm_site_close(self->site);
  free(self);
}

const char *wm_recording_name(const wm_recording *self) { return self->name; }
const char *wm_recording_dir(const wm_recording *self) { return self->dir; }
double wm_recording_duration_s(const wm_recording *self) { return self->duration_s; }
wm_site *wm_recording_site(const wm_recording *self) { return self->site; }
uint32_t wm_recording_quantities(const wm_recording *self) { return self->quantities; }

wm_source *const *wm_recording_sources(wm_recording *self, size_t *count) {
  *count = self->source_count;
  return self->sources;
}
