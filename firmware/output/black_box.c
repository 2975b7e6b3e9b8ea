// SPDX-License-Identifier: Apache-2.0
#include "output/black_box.h"

#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "output/replace_file.h"
#include "output/saved_pose.h"

#define NAME_MAX_BYTES (WM_PATH_MAX + 40)
// Deaths in intervals below this are one crash loop: a restart takes a second, other faults are rarer. Not swept.
#define CRASH_LOOP_S 600.0
#define NUMBER_MOST UINT64_C(999999999999999999)  // 18 digits: no counting reaches it
static const char *const kParts[] = {"before", "now"};

static void say(black_box *self, const char *text, const char *what) {
  char line[NAME_MAX_BYTES + 160];
  (void)snprintf(line, sizeof line, "black box: %s%s", text, what);
  if (self->say) self->say(self->say_context, line);
}

static void unwritable(black_box *self, const char *why) {
  if (!self->said_unwritable) say(self, "can't be written; localization continues: ", why);
  self->said_unwritable = 1;
}

static void path_of(const black_box *self, const char *name, char out[NAME_MAX_BYTES]) {
  (void)snprintf(out, NAME_MAX_BYTES, "%s/%s.wmlog", self->folder, name);
}

// ── what is kept ────────────────────────────────────────────────────────────────────────────────────────────────────

// Number of a kept file ("lost-0012-now.wmlog", "died-0012-front-a.avi"); 0 for other names.
static uint64_t number_of(const char *name) {
  uint64_t number = 0;
  char what[8], after = '\0';
  if (sscanf(name, "%4[a-z]-%18" SCNu64 "%c", what, &number, &after) != 3 || after != '-') return 0;
  if (number > NUMBER_MOST) return 0;  // a sign was read, too
  return strcmp(what, "lost") == 0 || strcmp(what, "died") == 0 ? number : 0;
}

// The largest number in the folder; files older than the newest BLACK_BOX_KEPT_MAX are removed.
static uint64_t tidy(black_box *self) {
  uint64_t newest = 0;
  for (int pass = 0; pass < 2; pass++) {
    DIR *folder = opendir(self->folder);
    if (!folder) return 0;
    for (struct dirent *entry; (entry = readdir(folder)) != NULL;) {
      uint64_t number = number_of(entry->d_name);
      char path[NAME_MAX_BYTES + 260];
      if (pass == 0 && number > newest) newest = number;
      if (pass == 0 || number == 0 || number + BLACK_BOX_KEPT_MAX > newest + 1) continue;
      (void)snprintf(path, sizeof path, "%s/%s", self->folder, entry->d_name);
      (void)unlink(path);
    }
    (void)closedir(folder);
  }
  return newest;
}

static void remove_kept(const black_box *self, uint64_t number) {
  DIR *folder = opendir(self->folder);
  if (!folder) return;
  for (struct dirent *entry; (entry = readdir(folder)) != NULL;) {
    char path[NAME_MAX_BYTES + 260];
    if (number_of(entry->d_name) != number) continue;
    (void)snprintf(path, sizeof path, "%s/%s", self->folder, entry->d_name);
    (void)unlink(path);
  }
  (void)closedir(folder);
}

// Time of the last write to the log of death `number`, in s; 0: there is none. Number 0 is the present log.
static double died_at(const black_box *self, uint64_t number) {
  char name[40], path[NAME_MAX_BYTES];
  struct stat file;
  (void)snprintf(name, sizeof name, number ? "died-%04" PRIu64 "-now" : "now", number);
  path_of(self, name, path);
  return stat(path, &file) == 0 ? (double)file.st_mtim.tv_sec : 0;
}

// In a crash loop only the first and the newest death are kept, so that older incidents are not evicted: the previous
// death of the loop is removed. Returns the number of the new one.
static uint64_t number_of_death(black_box *self, uint64_t newest) {
  const double now_s = died_at(self, 0), last_s = newest > 1 ? died_at(self, newest) : 0,
               before_s = newest > 1 ? died_at(self, newest - 1) : 0;
  if (now_s == 0 || last_s == 0 || before_s == 0) return newest + 1;
  if (fabs(now_s - last_s) > CRASH_LOOP_S || fabs(last_s - before_s) > CRASH_LOOP_S) return newest + 1;
  remove_kept(self, newest);
  return newest;
}

static void keep(black_box *self, const char *what) {
  const uint64_t newest = tidy(self);
  const uint64_t number = strcmp(what, "died") == 0 ? number_of_death(self, newest) : newest + 1;
  char from[NAME_MAX_BYTES], to[NAME_MAX_BYTES], name[40];
  for (size_t i = 0; i < 2; i++) {
    path_of(self, kParts[i], from);
    (void)snprintf(name, sizeof name, "%s-%04" PRIu64 "-%s", what, number, kParts[i]);
    path_of(self, name, to);
    const int failed = rename_through(from, to);
    if (failed && failed != ENOENT) unwritable(self, strerror(failed));
  }
  int failed = black_box_video_keep(self->folder, what, number);
  if (failed) unwritable(self, strerror(failed));
  say(self, "kept as ", to);
}

// A log without its end record is of a run that was killed. Not read as a whole: that would delay the start.
static int has_died(const char *path) { return access(path, F_OK) == 0 && !wm_log_is_closed(path); }

// ── writing ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static void close_log(black_box *self) {
  wm_error err = {0};
  if (self->is_open && wm_log_close(&self->log, &err) != WM_OK) unwritable(self, err.text);
  self->is_open = 0;
}

static void create_log(black_box *self) {
  char now[NAME_MAX_BYTES];
  wm_error err = {0};
  path_of(self, "now", now);
  self->begun_ns = WM_TIME_NONE;
  self->is_open = wm_log_create(&self->log, now, &self->assembly, &err) == WM_OK;
  if (self->is_open)
    wm_log_flush(&self->log);  // of a run that is killed at once, the head at least
  else
    unwritable(self, err.text);
}

// Starts a new log at this pose; the previous one is renamed to "before".
static void begin_log(black_box *self, const wm_estimate *pose, int floor, wm_time_ns now_ns) {
  char now[NAME_MAX_BYTES], before[NAME_MAX_BYTES];
  path_of(self, "now", now);
  path_of(self, "before", before);
  close_log(self);
  if (self->rotate_ns != WM_TIME_NONE && rename(now, before) != 0 && errno != ENOENT) unwritable(self, strerror(errno));
  self->rotate_ns = now_ns + self->keep_ns;
  if (pose->state == WM_STATE_TRACKING || pose->state == WM_STATE_DEAD_RECKONING) {
    wm_start_from_estimate(pose, self->assembly.setup.motion, 0, &self->assembly.setup.start);
    self->assembly.start_floor = floor;
  }
  create_log(self);
}

void black_box_open(black_box *self, const char *folder, double keep_s, double pictures_hz, const wm_assembly *assembly,
                    wm_line_fn tell, void *say_context) {
  memset(self, 0, sizeof *self);
  self->say = tell;
  self->say_context = say_context;
  self->rotate_ns = self->kept_from_ns = WM_TIME_NONE;
  if (!folder[0]) return;
  char now[NAME_MAX_BYTES];
  (void)snprintf(self->folder, sizeof self->folder, "%s", folder);
  self->keep_ns = wm_ns_from_seconds(keep_s);
  self->assembly = *assembly;
  if (mkdir(folder, 0777) != 0 && errno != EEXIST) unwritable(self, strerror(errno));
  path_of(self, "now", now);
  if (has_died(now)) keep(self, "died");
  black_box_video_open(&self->pictures, folder, keep_s, pictures_hz);
  create_log(self);
}

// Without a pose nothing is rotated: a log that has grown for so long begins again.
static void begin_again(black_box *self, wm_time_ns arrival_ns) {
  if (self->rotate_ns != WM_TIME_NONE) return;
  if (self->begun_ns == WM_TIME_NONE) self->begun_ns = arrival_ns;
  if (arrival_ns - self->begun_ns < self->keep_ns) return;
  close_log(self);
  create_log(self);
  self->begun_ns = arrival_ns;
}

void black_box_event(black_box *self, const wm_event *event) {
  if (!self->is_open) return;
  begin_again(self, event->arrival_ns);
  if (self->is_open) wm_log_write_event(&self->log, event);
}

void black_box_map(black_box *self, const void *image, size_t bytes) {
  if (!self->folder[0]) return;
  if (bytes > self->map_capacity) {
    void *larger = realloc(self->map, bytes);
    if (!larger) return;  // the map of before stays
    self->map = larger;
    self->map_capacity = bytes;
  }
  memcpy(self->map, image, bytes);
  self->assembly.kept = self->map;
  self->assembly.kept_bytes = bytes;
}

void black_box_pose(black_box *self, const wm_estimate *pose, int floor, wm_time_ns now_ns) {
  if (!self->folder[0]) return;
  if (self->rotate_ns == WM_TIME_NONE && self->is_open)
    self->rotate_ns = now_ns + self->keep_ns;  // the run's first log
  else if (self->rotate_ns == WM_TIME_NONE || now_ns >= self->rotate_ns)
    begin_log(self, pose, floor, now_ns);
  int is_lost = pose->state == WM_STATE_LOST;
  // After a fault the log goes on for a quarter of keep_s.
  if (is_lost && self->was_tracking && self->kept_from_ns == WM_TIME_NONE)
    self->kept_from_ns = now_ns + self->keep_ns / 4;
  self->was_tracking = pose->state == WM_STATE_TRACKING || pose->state == WM_STATE_DEAD_RECKONING;
  if (self->kept_from_ns == WM_TIME_NONE || now_ns < self->kept_from_ns) return;
  close_log(self);
  keep(self, "lost");
  self->kept_from_ns = self->rotate_ns = WM_TIME_NONE;
}

wm_status black_box_open_pictures(black_box *self, wm_pictures *pictures, const wm_rig *rig, wm_error *err) {
  return black_box_video_subscribe(&self->pictures, pictures, rig, err);
}

void black_box_take_pictures(black_box *self) {
  int failed = black_box_video_take(&self->pictures);
  if (failed) unwritable(self, strerror(failed));
}

void black_box_flush(black_box *self) {
  if (!self->is_open) return;
  wm_log_flush(&self->log);
  if (self->log.failed) unwritable(self, strerror(self->log.failed));
}

void black_box_close(black_box *self) {
  if (!self->folder[0]) return;
  close_log(self);
  if (self->kept_from_ns != WM_TIME_NONE) keep(self, "lost");
  black_box_video_close(&self->pictures);
  free(self->map);
  self->map = NULL;
  self->folder[0] = '\0';
}
