// SPDX-License-Identifier: Apache-2.0
// Opening, starting and closing of a session.
#include "library/session.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <wm_version.h>
#include "fusion/choice.h"
#include "library/changed_config.h"
#include "waymark/yaml.h"

enum { OPTIONS_MAX_BYTES = 4096 };  // more than options ever have; less than what an unset `bytes` usually is

// ── sizes ───────────────────────────────────────────────────────────────────────────────────────────────────────────

wm_status library_take_options(const char *function, const void *given, size_t bytes, void *out, size_t full_bytes,
                               wm_error *err) {
  if (!given || bytes < sizeof bytes || bytes > OPTIONS_MAX_BYTES)
    return wm_fail(err, WM_BAD_USAGE, "%s: its options have %zu bytes, this library's %zu: set `bytes` to their sizeof",
                   function, given ? bytes : 0, full_bytes);
  for (size_t i = full_bytes; i < bytes;
       i++)  // of a program with a newer header: fine while it doesn't use the new part
    if (((const unsigned char *)given)[i] != 0)
      return wm_fail(err, WM_BAD_USAGE,
                     "%s: its options have %zu bytes and use what this library (%s) lacks, at byte %zu: install the "
                     "version of the program's headers",
                     function, bytes, WM_VERSION, i);
  memset(out, 0, full_bytes);
  memcpy(out, given, bytes < full_bytes ? bytes : full_bytes);
  return WM_OK;
}

wm_status library_check_size(const char *function, const void *out, size_t bytes, size_t right_bytes, wm_error *err) {
  if (out && bytes == right_bytes) return WM_OK;
  return wm_fail(err, WM_BAD_USAGE,
                 "%s: its struct has %zu bytes, this library's %zu: compile the program with this library's headers",
                 function, out ? bytes : 0, right_bytes);
}

wm_status library_put_health(const char *function, const wm_health *health, void *out, size_t bytes, wm_error *err) {
  const size_t of_0_2 = offsetof(wm_health, more_count);
  wm_status status = library_check_size(function, out, bytes, bytes == of_0_2 ? of_0_2 : sizeof *health, err);
  if (status == WM_OK) memcpy(out, health, bytes);
  return status;
}

waymark_record library_record(wm_output_kind kind) {
  switch (kind) {
    case WM_OUTPUT_EVENT: return WAYMARK_RECORD_EVENT;
    case WM_OUTPUT_POSE: return WAYMARK_RECORD_FUSED;
    case WM_OUTPUT_INNOVATION: return WAYMARK_RECORD_INNOVATION;
    case WM_OUTPUT_PUBLISHED: return WAYMARK_RECORD_PUBLISHED;
    case WM_OUTPUT_BOUND: return WAYMARK_RECORD_BOUND;
    default: return 0;
  }
}

// ── open ────────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status keep_path(const char *path, char out[WM_PATH_MAX], wm_error *err) {
  const size_t length = path ? strlen(path) : 0;
  if (length >= WM_PATH_MAX) return wm_fail(err, WM_BAD_USAGE, "'%.60s...': the path is too long", path);
  memcpy(out, path ? path : "", length + 1);
  return WM_OK;
}

// The start pose of the folder's recording.yaml, where there is one.
static wm_status read_start(const char *folder, wm_site *site, wm_error *err) {
  char path[WM_PATH_MAX + 32];
  wm_yaml *about;
  (void)snprintf(path, sizeof path, "%s/recording.yaml", folder);
  if (access(path, F_OK) != 0) return WM_OK;
  wm_status status = wm_yaml_load(path, &about, err);
  if (status != WM_OK) return status;
  const wm_yaml_node root = wm_yaml_root(about), pose = wm_yaml_get(&root, "vehicle.initial_pose");
  wm_start start;
  if (wm_yaml_there(&pose)) {
    status = wm_start_read(&pose, &start, err);
    if (status == WM_OK) wm_site_set_start(site, &start);
  }
  wm_yaml_free(about);
  return status;
}

static void pass_warning(void *context, wm_note note, const char *text) {
  const waymark_options *options = &((const session *)context)->options;
  (void)note;
  if (options->note) options->note(options->context, text);
}

static wm_status open_robot(session *self, wm_error *err) {
  wm_site *site;
  const char *folder = self->site[0] ? self->site : NULL;
  wm_status status = wm_site_open(folder, &self->config.overrides, pass_warning, self, &site, err);
  if (status != WM_OK) return status;
  status = folder ? read_start(folder, site, err) : WM_OK;
  if (status != WM_OK) {
    wm_site_close(site);
    return status;
  }
  status = wm_recording_of_site("robot", site, &self->robot, err);
  if (status != WM_OK) return status;
  self->pictures = pushed_pictures_make();
  if (!self->pictures) return wm_fail(err, WM_IO, "no memory for cameras");
  wm_recording_set_pictures(self->robot, pushed_pictures_base(self->pictures));
  return WM_OK;
}

// Without a start: nothing is fused, no file is written.
static void free_session(session *self) {
  wm_assembly_close(&self->assembly);
  wm_arena_close(&self->arena);
  if (self->robot) wm_recording_close(self->robot);
  wm_config_free(&self->config);
  free(self);
}

static wm_status check_site(const char *site, wm_error *err) {
  struct stat there;
  if (!site[0] || (stat(site, &there) == 0 && S_ISDIR(there.st_mode))) return WM_OK;
  return wm_fail(err, WM_NOT_FOUND, "%s: options.site: there is no such folder", site);
}

wm_status session_open(const waymark_options *taken, session **out, wm_error *err) {
  session *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for a session");
  self->options = *taken;
  self->now_ns = self->ahead_from_ns = self->ahead_to_ns = WM_TIME_NONE;
  wm_status status = keep_path(taken->site, self->site, err);
  if (status == WM_OK) status = keep_path(taken->out, self->out, err);
  if (status == WM_OK) status = check_site(self->site, err);
  if (status == WM_OK)
    status = changed_config_load(taken->config, taken->changes, taken->note, taken->context, &self->config, err);
  if (status == WM_OK) status = open_robot(self, err);
  self->options.config = self->options.changes = self->options.site = self->options.out = NULL;
  if (status != WM_OK) {
    free_session(self);
    return status;
  }
  *out = self;
  return WM_OK;
}

// ── sources ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status add(session *self, pushed_source *source, wm_error *err) {
  // The recording takes ownership, also where it fails.
  wm_status status = wm_recording_add_device(self->robot, &source->base, source->quantities, err);
  if (status == WM_OK) self->sources[self->source_count++] = source;
  return status;
}

// Motion and GNSS of one bus. `out`: the first of them.
static wm_status add_bus(session *self, const char *name, const char *interface, const char *dbc, const char *signals,
                         uint32_t *out, wm_error *err) {
  const wm_can_part kParts[] = {WM_CAN_MOTION, WM_CAN_GNSS};
  char gnss_name[WM_SOURCE_NAME_MAX];
  (void)snprintf(gnss_name, sizeof gnss_name, "can-gnss%.*s", WM_SOURCE_NAME_MAX - 12, name + strlen("can"));
  const char *names[] = {name, gnss_name};
  *out = (uint32_t)self->source_count;
  for (size_t i = 0; i < 2; i++) {
    pushed_source *source;
    wm_status status = pushed_can_open(names[i], interface, dbc, signals, kParts[i],
                                       wm_site_gnss_origin(wm_recording_site(self->robot)), &source, err);
    if (status == WM_OK && source) status = add(self, source, err);
    if (status != WM_OK) return status;
  }
  return WM_OK;
}

// "can": of `devices: can`, else of the site's files; "can:IFACE": of that device.
static wm_status add_can(session *self, const char *name, uint32_t *out, wm_error *err) {
  const wm_devices_config *devices = &self->config.devices;
  const char *interface = name[3] == ':' ? name + 4 : NULL;
  for (size_t i = 0; i < devices->can_count; i++) {
    const wm_can_device_config *device = &devices->can[i];
    if (interface ? strcmp(interface, device->interface) != 0 : devices->can_count > 1) continue;
    return add_bus(self, name, device->interface, device->dbc, device->can_signals, out, err);
  }
  if (interface || devices->can_count > 0)
    return wm_fail(err, WM_NOT_FOUND, "%s: `devices: can` of %s has %zu interfaces: \"can:INTERFACE\" is one of them",
                   name, self->config.path, devices->can_count);
  char dbc[WM_PATH_MAX + 32], signals[WM_PATH_MAX + 32];
  const wm_recording_overrides *files = &self->config.overrides;
  (void)snprintf(dbc, sizeof dbc, "%s%s", files->dbc[0] ? files->dbc : self->site, files->dbc[0] ? "" : "/vehicle.dbc");
  (void)snprintf(signals, sizeof signals, "%s%s", files->can_signals[0] ? files->can_signals : self->site,
                 files->can_signals[0] ? "" : "/can-signals.yaml");
  return add_bus(self, name, "", dbc, signals, out, err);
}

wm_status session_add_source(session *self, const char *name, uint32_t *out, wm_error *err) {
  if (self->has_started) return wm_fail(err, WM_BAD_USAGE, "%s: sources are added before waymark_start", name);
  if (strlen(name) >= WM_SOURCE_NAME_MAX)
    return wm_fail(err, WM_BAD_USAGE, "'%.40s...': the name of a source has %d bytes at most", name,
                   WM_SOURCE_NAME_MAX - 1);
  for (size_t i = 0; i < self->source_count; i++)
    if (strcmp(self->sources[i]->base.name, name) == 0) return wm_fail(err, WM_BAD_USAGE, "%s: is there already", name);
  if (strncmp(name, "can", 3) == 0 && (name[3] == '\0' || name[3] == ':')) return add_can(self, name, out, err);
  pushed_source *source;
  wm_status status = pushed_source_open(name, wm_recording_site(self->robot), &source, err);
  if (status != WM_OK) return status;
  *out = (uint32_t)self->source_count;
  return add(self, source, err);
}

// ── start ───────────────────────────────────────────────────────────────────────────────────────────────────────────

static void put(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  session *self = context;
  if (self->file.put) self->file.put(self->file.context, kind, record, bytes);
  const waymark_record known = library_record(kind);
  if (self->options.take && known) self->options.take(self->options.context, known, record, bytes);
}

static wm_status take_memory(session *self, wm_error *err) {
  wm_arena_need needs[WM_PIPELINE_NEEDS + 1 + WM_VISION_NEEDS];
  size_t count = WM_PIPELINE_NEEDS;
  wm_pipeline_needs(&self->pipeline, &self->assembly, needs);
  needs[count++] =
      (wm_arena_need){"readers", self->assembly.source_count * sizeof *self->readers, (void **)&self->readers};
  count += wm_vision_needs(self->assembly.vision, needs + count);
  return wm_arena_fill(&self->arena, needs, count, 0, err);
}

wm_status session_start(session *self, wm_error *err) {
  if (self->has_started) return wm_fail(err, WM_BAD_USAGE, "waymark_start: this session has started already");
  wm_status status = wm_choose_estimator(&self->config, self->robot, self->options.note, self->options.context, err);
  if (status == WM_OK) status = wm_assemble(&self->config, self->robot, self->options.seed, &self->assembly, err);
  if (status == WM_OK) status = take_memory(self, err);
  if (status == WM_OK && self->out[0]) status = wm_run_folder_open(self->out, &self->assembly, &self->folder, err);
  if (status == WM_OK && self->folder) self->file = wm_run_folder_output(self->folder);
  if (status == WM_OK) status = wm_pipeline_start(&self->pipeline, (wm_output){put, self}, err);
  if (status == WM_OK) status = wm_vision_start(self->assembly.vision, err);
  if (status != WM_OK) {  // may be tried again, with other sources
    (void)wm_run_folder_close(self->folder, NULL);
    self->folder = NULL;
    self->file.put = NULL;
    wm_assembly_close(&self->assembly);
    wm_arena_close(&self->arena);
    return status;
  }
  for (size_t i = 0; self->options.note && i < self->assembly.unused_count; i++) {
    char line[sizeof(wm_unused)];
    (void)snprintf(line, sizeof line, "%s: %s", self->assembly.unused[i].name, self->assembly.unused[i].text);
    self->options.note(self->options.context, line);
  }
  // A program pushes what its detectors take: their time is its own.
  for (size_t i = 0; i < wm_vision_count(self->assembly.vision); i++)
    wm_vision_source(self->assembly.vision, i)->ready_after_ns = 0;
  self->has_started = 1;
  return WM_OK;
}

// ── close ───────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status write_summary(session *self, wm_error *err) {
  wm_findings *found = calloc(1, sizeof *found);
  wm_health *health = calloc(1, sizeof *health);
  wm_status status = found && health ? session_health(self, health, err)
                                     : wm_fail(err, WM_IO, "%s: no memory for health.json", self->out);
  if (status == WM_OK) status = wm_run_folder_health(self->folder, health, found, err);
  if (status == WM_OK) status = wm_run_folder_map(self->folder, self->pipeline.fuser.state, err);
  free(health);
  free(found);
  return status;
}

wm_status session_close(session *self, wm_error *err) {
  wm_status status = WM_OK;
  if (self->has_started) {
    wm_pipeline_finish(&self->pipeline);
    session_note_unused(self);
    if (self->folder) status = write_summary(self, err);
    wm_error close_error;
    const wm_status closed = wm_run_folder_close(self->folder, &close_error);
    if (status == WM_OK && closed != WM_OK) {
      status = closed;
      if (err) *err = close_error;
    }
  }
  free_session(self);
  return status;
}
