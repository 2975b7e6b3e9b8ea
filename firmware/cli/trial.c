// SPDX-License-Identifier: Apache-2.0
#include "cli/trial.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "output/replace_file.h"
#include "waymark/codec.h"

#define LOOK_EVERY_NS WM_NS_PER_S
#define CONFIG_BYTES_MAX ((size_t)1 << 20)  // a file of 1 MB is no configuration

static void path_of(const char *config_path, const char *end, char out[TRIAL_PATH_MAX]) {
  (void)snprintf(out, TRIAL_PATH_MAX, "%s%s", config_path, end);
}

// ── of the run ──────────────────────────────────────────────────────────────────────────────────────────────────────

void trial_open(trial *self, const char *config_path) {
  memset(self, 0, sizeof *self);
  self->config_path = config_path;
  path_of(config_path, ".trial", self->path);
}

void trial_end(trial *self) { self->is_on = 0; }

// A renamed file keeps these; a new one may have the number of a removed one.
static int is_same(const struct stat *a, const struct stat *b) {
  return a->st_dev == b->st_dev && a->st_ino == b->st_ino && a->st_mtim.tv_sec == b->st_mtim.tv_sec &&
         a->st_mtim.tv_nsec == b->st_mtim.tv_nsec;
}

// Whether FILE.trial is there with its lock; *file is what it is.
static int is_held(const char *path, struct stat *file) {
  const int fd = open(path, O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
  if (fd < 0) return 0;
  const int is_locked = fstat(fd, file) == 0 && flock(fd, LOCK_SH | LOCK_NB) != 0;
  (void)close(fd);  // a lock with it
  return is_locked;
}

trial_news trial_look(trial *self, wm_time_ns now_ns) {
  struct stat file = {0};
  if (now_ns < self->next_look_ns) return TRIAL_NOTHING;
  self->next_look_ns = now_ns + LOOK_EVERY_NS;
  const int held = is_held(self->path, &file), was_on = self->is_on;
  if (held && is_same(&self->file, &file)) return TRIAL_NOTHING;
  self->is_on = held;
  if (held) {
    self->file = file;
    return TRIAL_BEGINS;
  }
  if (!was_on) return TRIAL_NOTHING;
  return stat(self->config_path, &file) == 0 && is_same(&self->file, &file) ? TRIAL_TAKEN : TRIAL_WITHDRAWN;
}

// ── of who puts one there ───────────────────────────────────────────────────────────────────────────────────────────

// What a program that was killed left may go; what another one holds may not.
static wm_status make_way(const char *path, wm_error *err) {
  struct stat file;
  if (is_held(path, &file)) return wm_fail(err, WM_IO, "%s: another configuration is on trial: wait for its end", path);
  (void)unlink(path);
  return WM_OK;
}

wm_status trial_write(const char *config_path, const void *bytes, size_t count, int *fd, wm_error *err) {
  char path[TRIAL_PATH_MAX], beside[TRIAL_PATH_MAX];
  path_of(config_path, ".trial", path);
  path_of(config_path, ".trial.new", beside);
  wm_status status = make_way(path, err);
  if (status == WM_OK) status = make_way(beside, err);
  if (status != WM_OK) return status;
  struct stat before;
  const mode_t mode =
      stat(config_path, &before) == 0 ? before.st_mode & 0777 : 0644;  // the run reads it as it reads FILE
  *fd = open(beside, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode);
  if (*fd >= 0 && fchmod(*fd, mode) == 0 && flock(*fd, LOCK_EX | LOCK_NB) == 0 &&
      write(*fd, bytes, count) == (ssize_t)count && fsync(*fd) == 0)
    return WM_OK;
  status = wm_fail(err, WM_IO, "%s: can't be written: %s", beside, strerror(errno));
  if (*fd >= 0) {
    (void)unlink(beside);
    (void)close(*fd);
  }
  return status;
}

static wm_status move(const char *config_path, const char *from_end, const char *to_end, wm_error *err) {
  char from[TRIAL_PATH_MAX], to[TRIAL_PATH_MAX];
  path_of(config_path, from_end, from);
  path_of(config_path, to_end, to);
  const int failed = rename_through(from, to);
  return failed ? wm_fail(err, WM_IO, "%s: can't be renamed to %s: %s", from, to, strerror(failed)) : WM_OK;
}

wm_status trial_begin(const char *config_path, wm_error *err) { return move(config_path, ".trial.new", ".trial", err); }

void trial_remove(const char *config_path) {
  char path[TRIAL_PATH_MAX];
  path_of(config_path, ".trial.new", path);
  (void)unlink(path);
  path_of(config_path, ".trial", path);
  (void)unlink(path);
}

// ── versions ────────────────────────────────────────────────────────────────────────────────────────────────────────

wm_status read_whole(const char *path, void **bytes, size_t *count, wm_error *err) {
  FILE *file = fopen(path, "rbe");
  if (!file) return wm_fail(err, WM_IO, "%s: can't be read: %s", path, strerror(errno));
  *bytes = malloc(CONFIG_BYTES_MAX + 1);
  *count = *bytes ? fread(*bytes, 1, CONFIG_BYTES_MAX + 1, file) : 0;
  const int is_read = *bytes && !ferror(file);
  (void)fclose(file);
  if (is_read && *count <= CONFIG_BYTES_MAX) return WM_OK;
  free(*bytes);
  return wm_fail(err, WM_IO, is_read ? "%s: has more than 1 MB: no configuration" : "%s: can't be read", path);
}

static int newest_first(const void *a, const void *b) { return strcmp(b, a); }

wm_status versions_list(const char *config_path, char (**names)[VERSION_NAME_MAX], size_t *count, wm_error *err) {
  char folder[TRIAL_PATH_MAX];
  path_of(config_path, ".versions", folder);
  *names = NULL, *count = 0;
  DIR *dir = opendir(folder);
  if (!dir) return errno == ENOENT ? WM_OK : wm_fail(err, WM_IO, "%s: can't be read: %s", folder, strerror(errno));
  for (const struct dirent *entry; (entry = readdir(dir)) != NULL;) {
    const size_t length = strlen(entry->d_name);
    if (entry->d_name[0] == '.' || length < 5 || length >= VERSION_NAME_MAX ||
        strcmp(entry->d_name + length - 5, ".yaml") != 0)
      continue;
    void *more = realloc(*names, (*count + 1) * VERSION_NAME_MAX);
    if (!more) break;
    *names = more;
    (void)snprintf((*names)[(*count)++], VERSION_NAME_MAX, "%s", entry->d_name);
  }
  (void)closedir(dir);
  if (*count > 0) qsort(*names, *count, VERSION_NAME_MAX, newest_first);
  return WM_OK;
}

static wm_status keep_version(const char *config_path, wm_error *err) {
  char folder[TRIAL_PATH_MAX], path[TRIAL_PATH_MAX + VERSION_NAME_MAX], now[24];
  void *bytes;
  size_t count;
  if (access(config_path, F_OK) != 0) return WM_OK;  // the first one
  wm_status status = read_whole(config_path, &bytes, &count, err);
  if (status != WM_OK) return status;
  path_of(config_path, ".versions", folder);
  if (mkdir(folder, 0755) != 0 && errno != EEXIST)
    status = wm_fail(err, WM_IO, "%s: can't be made: %s", folder, strerror(errno));
  const time_t utc = time(NULL);
  struct tm parts;
  (void)strftime(now, sizeof now, "%Y%m%dT%H%M%SZ", gmtime_r(&utc, &parts));
  (void)snprintf(path, sizeof path, "%s/%s-%016" PRIx64 ".yaml", folder, now, wm_hash(WM_HASH_START, bytes, count));
  if (status == WM_OK) status = replace_file(path, &(file_part){bytes, count}, 1, err);
  free(bytes);
  return status;
}

static void remove_oldest(const char *config_path, unsigned keep) {
  char(*names)[VERSION_NAME_MAX];
  size_t count;
  if (versions_list(config_path, &names, &count, NULL) != WM_OK) return;
  for (size_t i = keep; i < count; i++) {
    char path[TRIAL_PATH_MAX + VERSION_NAME_MAX];
    (void)snprintf(path, sizeof path, "%s.versions/%s", config_path, names[i]);
    (void)unlink(path);
  }
  free(names);
}

wm_status trial_take(const char *config_path, unsigned keep, wm_error *err) {
  wm_status status = keep_version(config_path, err);
  if (status == WM_OK) status = move(config_path, ".trial", "", err);
  if (status == WM_OK) remove_oldest(config_path, keep);
  return status;
}
