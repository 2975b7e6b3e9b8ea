// SPDX-License-Identifier: Apache-2.0
// The order of the data: the earliest of all files, begins and ends of faults, and frames that faults add.
#include "player.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "about.h"
#include "waymark/video.h"

#define PASS_GAP_NS (100 * WM_NS_PER_MS)  // from the last datum of a pass to the first of the next

// ── opening ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status add_file(wm_play *self, play_file *file, wm_error *err) {
  if (!file) return WM_OK;
  if (self->file_count == WM_PLAY_STREAMS_MAX || self->stream_count + file->stream_count > WM_PLAY_STREAMS_MAX) {
    file->ops->close(file);
    return wm_fail(err, WM_FULL, "%s: more than %d streams", self->dir, WM_PLAY_STREAMS_MAX);
  }
  self->file[self->file_count++] = file;
  file->first_stream = (uint16_t)self->stream_count;
  for (size_t i = 0; i < file->stream_count; i++) {
    play_state *state = &self->state[self->stream_count];
    state->file = file;
    state->is_left_out = file->stream[i].lacking != NULL;
    (void)snprintf(state->format, sizeof state->format, "%s", file->stream[i].format);
    self->stream[self->stream_count++] = file->stream[i];
  }
  return WM_OK;
}

static int is_stamps(const struct dirent *entry) {
  const size_t length = strlen(entry->d_name);
  return length > 4 && length < WM_NAME_MAX + 4 && strcmp(entry->d_name + length - 4, ".csv") == 0;
}

// Cameras by their stamps, video/CAMERA.csv, in the order of their names.
static wm_status add_cameras(wm_play *self, wm_error *err) {
  char path[WM_PATH_MAX + 8];
  struct dirent **entry = NULL;
  (void)snprintf(path, sizeof path, "%s/video", self->dir);
  const int count = scandir(path, &entry, is_stamps, alphasort);
  wm_status status = WM_OK;
  for (int i = 0; i < count; i++) {
    char camera[WM_NAME_MAX];
    play_file *file = NULL;
    (void)snprintf(camera, sizeof camera, "%.*s", (int)(strlen(entry[i]->d_name) - 4), entry[i]->d_name);
    if (status == WM_OK && wm_video_there(self->dir, camera)) {
      status = play_pictures_open(self->dir, camera, &self->options, &file, err);
      if (status == WM_OK) status = add_file(self, file, err);
    }
    free(entry[i]);
  }
  free(entry);
  return status;
}

static wm_status add_rows(wm_play *self, wm_error *err) {
  int is_last = 0;
  for (size_t index = 0; !is_last; index++) {
    int more = 1;
    for (size_t sensor = 0; more; sensor++) {
      play_file *file;
      wm_status status = play_rows_open(self->dir, index, sensor, &file, &is_last, &more, err);
      if (status == WM_OK) status = add_file(self, file, err);
      if (status != WM_OK) return status;
    }
  }
  return WM_OK;
}

static wm_status read_about(wm_play *self, wm_error *err) {
  char path[WM_PATH_MAX + 32];
  wm_yaml *about;
  (void)snprintf(path, sizeof path, "%s/recording.yaml", self->dir);
  wm_status status = wm_yaml_load(path, &about, err);
  if (status == WM_NOT_FOUND)
    return wm_fail(err, WM_NOT_FOUND, "%s: there is no recording.yaml in it: is it a recording's folder?", self->dir);
  if (status != WM_OK) return status;
  const wm_yaml_node root = wm_yaml_root(about), duration = wm_yaml_get(&root, "duration_s");
  self->duration_s = (double)NAN;
  if (!wm_yaml_is_map(&root))
    status = wm_yaml_fail(&root, err, "a map that begins with 'format: waymark-recording/1' is needed");
  else
    status = recording_check_format(&root, err);
  if (status == WM_OK && wm_yaml_there(&duration)) status = wm_yaml_f64(&duration, 0, 1e9, &self->duration_s, err);
  wm_yaml_free(about);
  return status;
}

// ── the next datum of a file ────────────────────────────────────────────────────────────────────────────────────────

static wm_status read_ahead(play_file *self, wm_error *err) {
  wm_status status = self->ops->read(self, &self->ahead, err);
  self->has_ahead = status == WM_OK;
  return status;
}

// Into self->now. A stamp far ahead of the one after it, or far behind both, is corrupt, and left out.
static wm_status fill(play_file *self, wm_error *err) {
  if (self->has_now || self->ended) return WM_OK;
  wm_status status = self->has_ahead ? WM_OK : read_ahead(self, err);
  while (status == WM_OK) {
    self->now = self->ahead;
    status = read_ahead(self, err);
    if (status != WM_OK && status != WM_END) return status;
    const wm_time_ns next_ns = self->has_ahead ? self->ahead.due_ns : self->now.due_ns;
    if (!arrival_order_leaps(&self->order, self->now.due_ns, next_ns)) {
      wm_source_counts counts = {0};
      self->now.due_ns = arrival_order_next(&self->order, self->now.due_ns, &counts);
      self->has_now = 1;
      return WM_OK;
    }
    play_file_count(self, "a stamp is more than 10 s off the next one; the datum is skipped");
  }
  self->ended = status == WM_END;
  return status == WM_END ? WM_OK : status;
}

static wm_status start_files(wm_play *self, wm_error *err) {
  self->first_ns = INT64_MAX;
  for (size_t i = 0; i < self->file_count; i++) {
    wm_status status = fill(self->file[i], err);
    if (status != WM_OK) return status;
    if (self->file[i]->has_now && self->file[i]->now.due_ns < self->first_ns)
      self->first_ns = self->file[i]->now.due_ns;
  }
  if (self->first_ns == INT64_MAX)
    return wm_fail(err, WM_BAD_DATA, "%s: has no CAN frame, picture or row that can be played", self->dir);
  return WM_OK;
}

static wm_status open_all(wm_play *self, wm_error *err) {
  play_file *can;
  wm_status status = read_about(self, err);
  if (status == WM_OK) status = play_can_open(self->dir, &can, err);
  if (status == WM_OK) status = add_file(self, can, err);
  if (status == WM_OK) status = add_cameras(self, err);
  if (status == WM_OK) status = add_rows(self, err);
  if (status == WM_OK) status = start_files(self, err);
  if (status == WM_OK) status = play_faults_begin(self, err);
  return status;
}

wm_status wm_play_open(const char *dir, const wm_play_options *options, wm_play **out, wm_error *err) {
  *out = NULL;
  wm_play *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "%s: no memory to play it", dir);
  self->options = *options;
  self->from_ns = wm_ns_from_seconds(options->from_s);
  self->until_ns = options->until_s > 0 ? wm_ns_from_seconds(options->until_s) : INT64_MAX;
  self->last_ns = self->from_ns;
  wm_status status = WM_OK;
  if (snprintf(self->dir, sizeof self->dir, "%s", dir) >= (int)sizeof self->dir)
    status = wm_fail(err, WM_BAD_USAGE, "%s: the path is longer than %d bytes", dir, WM_PATH_MAX - 1);
  if (status == WM_OK) status = open_all(self, err);
  if (status == WM_OK)
    *out = self;
  else
    wm_play_close(self);
  return status;
}

void wm_play_close(wm_play *self) {
  if (!self) return;
  for (size_t i = 0; i < self->file_count; i++) self->file[i]->ops->close(self->file[i]);
  jpeg_close(&self->jpeg);
  free(self->edge);
  free(self->stored);
  free(self->grey);
  free(self->made);
  free(self);
}

// ── what it is ──────────────────────────────────────────────────────────────────────────────────────────────────────

const wm_play_stream *wm_play_streams(const wm_play *self, size_t *count) {
  *count = self->stream_count;
  return self->stream;
}

int wm_play_find(const wm_play *self, const char *name) {
  for (size_t i = 0; i < self->stream_count; i++)
    if (strcmp(self->stream[i].name, name) == 0) return (int)i;
  return -1;
}

void wm_play_leave_out(wm_play *self, size_t stream) { self->state[stream].is_left_out = 1; }

wm_status wm_play_set_format(wm_play *self, size_t stream, const char *format, wm_error *err) {
  static const char *const kFormats[] = {"GREY", "MJPG", "YUYV"};
  for (size_t i = 0; i < sizeof kFormats / sizeof kFormats[0]; i++) {
    if (strcmp(format, kFormats[i]) != 0) continue;
    (void)snprintf(self->state[stream].format, sizeof self->state[stream].format, "%s", format);
    return WM_OK;
  }
  return wm_fail(err, WM_UNSUPPORTED, "%s: pictures are not played as %s; GREY, MJPG and YUYV are",
                 self->stream[stream].name, format);
}

void wm_play_set_delay(wm_play *self, size_t stream, wm_time_ns delay_ns) { self->state[stream].delay_ns = delay_ns; }

wm_time_ns wm_play_first_ns(const wm_play *self) { return self->first_ns; }

double wm_play_duration_s(const wm_play *self) {
  const uint32_t passes = self->options.passes > 1 ? self->options.passes : 1;
  double until_s = self->duration_s;
  if (self->options.until_s > 0 && !(until_s < self->options.until_s)) until_s = self->options.until_s;
  const double pass_s = until_s - self->options.from_s;
  return passes * (pass_s > 0 ? pass_s : 0) + (passes - 1) * 1e-9 * (double)PASS_GAP_NS;
}

uint64_t wm_play_unreadable(const wm_play *self, const char **first_problem) {
  uint64_t count = 0;
  *first_problem = "";
  for (size_t i = 0; i < self->file_count; i++) {
    count += self->file[i]->unreadable;
    if (!(*first_problem)[0]) *first_problem = self->file[i]->first_problem;
  }
  return count;
}

// ── the next item ───────────────────────────────────────────────────────────────────────────────────────────────────

// The file with the earliest datum of this pass; at equal times the first. NULL: the pass is over.
static play_file *earliest(wm_play *self, wm_time_ns *due_ns, wm_status *status, wm_error *err) {
  play_file *best = NULL;
  *due_ns = INT64_MAX;
  for (size_t i = 0; i < self->file_count; i++) {
    play_file *file = self->file[i];
    *status = fill(file, err);
    if (*status != WM_OK) return NULL;
    if (!file->has_now) continue;
    const wm_time_ns at_ns = file->now.due_ns - self->first_ns;
    if (at_ns >= self->until_ns) continue;
    const wm_time_ns shown_ns = at_ns + self->state[file->first_stream].delay_ns;
    if (best && shown_ns >= *due_ns) continue;
    best = file;
    *due_ns = shown_ns;
  }
  return best;
}

static wm_status next_pass(wm_play *self, wm_error *err) {
  if (++self->pass >= self->options.passes) return WM_END;
  self->base_ns = self->last_ns + PASS_GAP_NS - self->from_ns;
  for (size_t i = 0; i < self->file_count; i++) {
    play_file *file = self->file[i];
    wm_status status = file->ops->rewind(file, err);
    if (status != WM_OK) return status;
    file->has_now = file->has_ahead = file->ended = 0;
    file->order = (arrival_order){0};
  }
  return WM_OK;
}

// One datum with its faults. WM_AGAIN: it is missing.
static wm_status take(wm_play *self, play_file *file, wm_time_ns due_ns, wm_play_item *out, wm_error *err) {
  self->datum = file->now;
  file->has_now = 0;
  const uint16_t stream = (uint16_t)(file->first_stream + self->datum.stream);
  const uint32_t number = self->state[stream].next_number++;
  const int is_before = due_ns < self->from_ns;
  due_ns += self->base_ns;
  const int is_there = play_apply(self, stream, number, due_ns, out);
  if (is_before) return WM_AGAIN;
  if (due_ns > self->last_ns) self->last_ns = due_ns;
  if (!is_there || self->state[stream].is_left_out) return WM_AGAIN;
  if (out->kind != WM_PLAY_PICTURE) return WM_OK;
  const double at_s = (double)due_ns * 1e-9;
  const wm_fault *dark = wm_faults_at(self->options.faults, WM_FAULT_CAMERA_DARK, self->stream[stream].of, at_s);
  const payload *picture = self->state[stream].has_held ? &self->state[stream].held : &self->datum.picture;
  wm_status status = play_convert(self, picture, out, dark ? dark->param[0] : 1.0, err);
  if (status != WM_BAD_DATA) return status;
  play_file_count(file, err ? err->text : "");
  return WM_AGAIN;
}

wm_status wm_play_next(wm_play *self, wm_play_item *out, wm_error *err) {
  for (;;) {
    wm_status status = WM_OK;
    wm_time_ns due_ns;
    if (self->has_again) {
      *out = self->again;
      self->has_again = 0;
      return WM_OK;
    }
    play_file *file = earliest(self, &due_ns, &status, err);
    if (status != WM_OK) return status;
    const wm_time_ns fault_ns = play_fault_due_ns(self);
    if (file && (fault_ns == INT64_MAX || due_ns < self->from_ns || due_ns + self->base_ns < fault_ns)) {
      status = take(self, file, due_ns, out, err);
      if (status != WM_AGAIN) return status;
      continue;
    }
    if (file && fault_ns <= due_ns + self->base_ns) {
      play_fault_item(self, out);
      return WM_OK;
    }
    status = next_pass(self, err);
    if (status != WM_OK) return status;
  }
}

void wm_play_stamp(uint8_t *message, uint32_t bytes, wm_time_ns t_ns) {
  for (int i = 0; i < 8 && bytes >= 16; i++) message[8 + i] = (uint8_t)((uint64_t)t_ns >> (56 - 8 * i));
}
