// SPDX-License-Identifier: Apache-2.0
#include "output/black_box_video.h"

#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <string.h>
#include <unistd.h>

#include "output/avi_writer.h"
#include "output/new_file.h"

#define PREFIX "pictures-"
#define PATH_BYTES (WM_PATH_MAX + 300)

// Removes the pictures of the run before that were not kept.
static void remove_old(const char *folder) {
  char path[PATH_BYTES];
  DIR *there = opendir(folder);
  if (!there) return;
  for (struct dirent *entry; (entry = readdir(there)) != NULL;) {
    if (strncmp(entry->d_name, PREFIX, strlen(PREFIX)) != 0) continue;
    (void)snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
    (void)unlink(path);
  }
  (void)closedir(there);
}

void black_box_video_open(black_box_video *self, const char *folder, double keep_s, double rate_hz) {
  memset(self, 0, sizeof *self);
  if (!folder[0]) return;
  remove_old(folder);
  if (rate_hz <= 0) return;
  (void)snprintf(self->folder, sizeof self->folder, "%s", folder);
  self->keep_ns = wm_ns_from_seconds(keep_s);
  self->period_ns = wm_ns_from_seconds(1 / rate_hz);
}

// A new file of this name: the old one may have a hard link and stays unchanged.
static FILE *begin_file(const black_box_video *self, const black_box_camera *camera, const char *ending) {
  char path[PATH_BYTES];
  (void)snprintf(path, sizeof path, "%s/" PREFIX "%s-%c.%s", self->folder, camera->name, 'a' + camera->part, ending);
  (void)unlink(path);
  return new_file(path);
}

static void close_files(black_box_camera *camera) {
  if (camera->video) (void)fclose(camera->video);
  if (camera->stamps) (void)fclose(camera->stamps);
  camera->video = camera->stamps = NULL;
}

static int begin(black_box_video *self, black_box_camera *camera, const wm_frame *frame, const wm_camera_raw *raw) {
  close_files(camera);
  camera->part = !camera->part;
  camera->count = 0;
  camera->rotate_ns = frame->arrival_ns + self->keep_ns;
  camera->video = begin_file(self, camera, "avi");
  camera->stamps = begin_file(self, camera, "csv");
  if (!camera->video || !camera->stamps) return errno;
  if (fputs("frame,t_ns,exposure_ns,arrival_ns\n", camera->stamps) < 0) return errno;
  return avi_begin(camera->video, raw->is_jpeg ? "MJPG" : "Y800", frame->width_px, frame->height_px,
                   1e9 / (double)self->period_ns);
}

static int put(black_box_camera *camera, const wm_frame *frame, const wm_camera_raw *raw) {
  int failed = raw->is_jpeg
                   ? avi_picture(camera->video, raw->data, raw->bytes, 1, 0)
                   : avi_picture(camera->video, frame->grey, frame->width_px, frame->height_px, frame->stride_bytes);
  // Flushed at once, the picture before its stamp: a killed run leaves both.
  if (!failed && fflush(camera->video) != 0) failed = errno;
  if (!failed && fprintf(camera->stamps, "%" PRIu64 ",%" PRId64 ",%" PRId64 ",%" PRId64 "\n", camera->count,
                         frame->t_ns, frame->exposure_ns, frame->arrival_ns) < 0)
    failed = errno;
  if (!failed && fflush(camera->stamps) != 0) failed = errno;
  camera->count++;
  return failed;
}

static int take_picture(black_box_video *self, black_box_camera *camera, const wm_frame *frame) {
  if (frame->arrival_ns < camera->next_ns) return 0;
  camera->next_ns = frame->arrival_ns + self->period_ns;
  wm_camera_raw raw;
  camera->frames->ops->raw(camera->frames, &raw);
  int failed = 0;
  if (raw.is_jpeg && !raw.data) return ENOMEM;
  if (!camera->video || !camera->stamps || frame->arrival_ns >= camera->rotate_ns)
    failed = begin(self, camera, frame, &raw);
  if (!failed) failed = put(camera, frame, &raw);
  if (failed) close_files(camera);  // tried again with the next picture
  return failed;
}

int black_box_video_take(black_box_video *self) {
  int failed = 0;
  for (size_t i = 0; i < self->camera_count; i++) {
    black_box_camera *camera = &self->cameras[i];
    wm_frame frame;
    if (camera->frames->ops->next(camera->frames, &frame, NULL) != WM_OK) continue;
    int reason = take_picture(self, camera, &frame);
    if (reason) failed = reason;
  }
  return failed;
}

wm_status black_box_video_subscribe(black_box_video *self, wm_pictures *pictures, const wm_rig *rig, wm_error *err) {
  const wm_frame_wishes wishes = {.waiting_max = 1, .wait_ms = 0, .wants_raw = 1};
  wm_status status = WM_OK;
  if (!self->folder[0]) return WM_OK;
  for (uint32_t i = 0; status == WM_OK && i < rig->camera_count && self->camera_count < WM_CAMERA_DEVICES_MAX; i++) {
    black_box_camera *camera = &self->cameras[self->camera_count];
    if (!pictures->ops->has(pictures, rig->cameras[i].name)) continue;
    (void)snprintf(camera->name, sizeof camera->name, "%s", rig->cameras[i].name);
    status = pictures->ops->open(pictures, &rig->cameras[i], (int32_t)i, &wishes, &camera->frames, err);
    self->camera_count += status == WM_OK;
  }
  return status;
}

int black_box_video_keep(const char *folder, const char *what, uint64_t number) {
  char from[PATH_BYTES], to[PATH_BYTES];
  int failed = 0;
  DIR *there = opendir(folder);
  if (!there) return errno;
  for (struct dirent *entry; (entry = readdir(there)) != NULL;) {
    if (strncmp(entry->d_name, PREFIX, strlen(PREFIX)) != 0) continue;
    (void)snprintf(from, sizeof from, "%s/%s", folder, entry->d_name);
    (void)snprintf(to, sizeof to, "%s/%s-%04" PRIu64 "-%s", folder, what, number, entry->d_name + strlen(PREFIX));
    if (link(from, to) != 0 && errno != EEXIST) failed = errno;
  }
  (void)closedir(there);
  return failed;
}

void black_box_video_close(black_box_video *self) {
  for (size_t i = 0; i < self->camera_count; i++) {
    black_box_camera *camera = &self->cameras[i];
    close_files(camera);
    camera->frames->ops->close(camera->frames);
  }
  self->camera_count = 0;
}
