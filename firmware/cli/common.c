// SPDX-License-Identifier: Apache-2.0
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cli/commands.h"
#include "cli/journal.h"
#include "findings/findings.h"
#include "rt/clock.h"

int exit_code(wm_status status) {
  if (status == WM_OK) return EXIT_DONE;
  return status == WM_BAD_USAGE || status == WM_BAD_CONFIG ? EXIT_USAGE : EXIT_WORK_FAILED;
}

int complain(const wm_error *err) {
  journal_line(JOURNAL_ERROR, "waymark", err->text);
  return exit_code(err->status);
}

void print_note(void *context, const char *text) {
  (void)context;
  journal_line(JOURNAL_NOTICE, "note", text);
}

void print_warning(void *context, wm_note note, const char *text) {
  (void)note;
  print_note(context, text);
}

wm_status override_path(char out[WM_PATH_MAX], const char *path, wm_error *err) {
  if (!path) return WM_OK;
  size_t length = strlen(path);
  if (length >= WM_PATH_MAX) return wm_fail(err, WM_BAD_USAGE, "'%.60s...': the path is too long", path);
  memcpy(out, path, length + 1);
  return WM_OK;
}

wm_status check_out_dir(const char *out_dir, const char *input, wm_error *err) {
  char path[WM_PATH_MAX + 32];
  struct stat inside, read;
  (void)snprintf(path, sizeof path, "%s/recording.yaml", out_dir);
  if (stat(path, &inside) == 0)
    return wm_fail(err, WM_BAD_USAGE, "--out: %s is a recording; a run is written to a folder of its own", out_dir);
  (void)snprintf(path, sizeof path, "%s/events.wmlog", out_dir);
  if (stat(path, &inside) == 0 && stat(input, &read) == 0 && inside.st_ino == read.st_ino &&
      inside.st_dev == read.st_dev)
    return wm_fail(err, WM_BAD_USAGE, "--out: %s has the log that is replayed; choose another folder", out_dir);
  return WM_OK;
}

// Whether the log is of a run of `recording`. One that can't be read is taken for that.
static int is_log_of(const char *path, const char *recording) {
  wm_log_reader *log;
  if (wm_log_open(path, &log, NULL) != WM_OK) return 1;
  const int is_same = strcmp(wm_log_reader_head(log)->recording, recording) == 0;
  wm_log_reader_close(log);
  return is_same;
}

#define ASIDE_MAX 9999  // runs put aside beside a folder

wm_status put_run_aside(const char *out_dir, const char *recording, wm_error *err) {
  char path[WM_PATH_MAX + 48], note[2 * WM_PATH_MAX + 96];
  struct stat there;
  (void)snprintf(path, sizeof path, "%s/events.wmlog", out_dir);
  if (stat(path, &there) != 0 || (recording && is_log_of(path, recording))) return WM_OK;
  size_t length = strlen(out_dir);
  while (length > 1 && out_dir[length - 1] == '/') length--;
  for (int i = 1; i <= ASIDE_MAX; i++) {
    (void)snprintf(path, sizeof path, "%.*s.before-%d", (int)length, out_dir, i);
    if (stat(path, &there) == 0) continue;
    if (rename(out_dir, path) != 0)
      return wm_fail(err, WM_IO, "--out: %s has another run, which can't be renamed to %s: %s; --force overwrites it",
                     out_dir, path, strerror(errno));
    (void)snprintf(note, sizeof note, "%s had another run, which was renamed to %s (--force overwrites it)", out_dir,
                   path);
    print_note(NULL, note);
    return WM_OK;
  }
  return wm_fail(err, WM_BAD_USAGE, "--out: %s: %d runs were renamed already; choose another folder", out_dir,
                 ASIDE_MAX);
}

static void print_source(const wm_source_health *s) {
  (void)printf("  %-20s %8" PRIu64 " received  %8" PRIu64 " fused", s->name, s->received, s->fused);
  for (unsigned i = 1; i < WM_VERDICT_COUNT; i++)
    if (s->rejected[i]) (void)printf("  %" PRIu64 " %s", s->rejected[i], wm_verdict_name(i));
  for (unsigned i = 1; i < WM_STATUS_COUNT; i++)
    if (s->refused[i]) (void)printf("  %" PRIu64 " %s", s->refused[i], wm_status_text((wm_status)i));
  if (s->late) (void)printf("  %" PRIu64 " late", s->late);
  if (s->dropped) (void)printf("  %" PRIu64 " dropped", s->dropped);
  (void)putchar('\n');
  char looks[300];
  if (wm_looks_text(s->looks, looks, sizeof looks)) (void)printf("    %s\n", looks);
}

void print_report(const wm_run_report *r, const char *name, const char *out_dir, double took_s) {
  (void)printf("%s: %.1f s, %" PRIu64 " events, %" PRIu64 " poses; %.1f MB of memory; took %.2f s\n", name,
               r->recorded_s, r->events, r->poses, (double)r->memory_bytes * 1e-6, took_s);
  for (uint32_t i = 0; i < r->health.source_count; i++) print_source(&r->health.sources[i]);
  for (uint32_t i = 0; i < wm_health_calibration_count(&r->health); i++) {
    const wm_calibration_value *v = wm_health_calibration(&r->health, i);
    (void)printf("  %-32s %10.5g", v->name, v->value);
    if (v->sigma > 0.0) (void)printf("  +- %.2g", v->sigma);
    (void)putchar('\n');
  }
  for (uint32_t i = 0; i < r->health.counter_count; i++) {
    const wm_counter *c = &r->health.counters[i];
    (void)printf("  %-32s %10" PRIu64, wm_counter_name(c->kind), c->count);
    if (c->landmark_id >= 0) (void)printf("  (landmark %" PRId32 ")", c->landmark_id);
    (void)putchar('\n');
  }
  if (!isnan(r->health.lost_probability))
    (void)printf("  %-32s %10.3g\n", "lost_probability", r->health.lost_probability);
  (void)printf("  %s at the end; written to %s\n", wm_state_name(r->health.state), out_dir);
  (void)fflush(stdout);
  journal_findings(&r->findings);
}

// ── progress ────────────────────────────────────────────────────────────────────────────────────────────────────────

void progress_begin(progress_line *self) { *self = (progress_line){.begin_ns = wm_monotonic_ns()}; }

void progress_show(void *context, double done) {
  progress_line *self = context;
  double elapsed_s = wm_seconds_between(self->begin_ns, wm_monotonic_ns());
  if (elapsed_s < 2.0 || !isatty(STDERR_FILENO)) return;
  self->shown = 1;
  if (done > 0 && done <= 1) {
    (void)fprintf(stderr, "\r\033[K%3.0f %%, %.0f s left", done * 100, elapsed_s * (1 - done) / done);
  } else {
    (void)fprintf(stderr, "\r\033[K%.0f s", elapsed_s);
  }
}

void progress_end(progress_line *self) {
  if (self->shown) (void)fputs("\r\033[K", stderr);
}

// The program beside this one; "" where this one's place is not known.
static void path_beside(const char *command, char *out, size_t capacity) {
  char self[WM_PATH_MAX];
  ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
  out[0] = '\0';
  if (length <= 0) return;
  self[length] = '\0';
  char *slash = strrchr(self, '/');
  if (slash) *slash = '\0';
  (void)snprintf(out, capacity, "%s/waymark-%s", self, command);
}

int desk_command_is_there(const char *command) {
  char path[WM_PATH_MAX + 80];
  path_beside(command, path, sizeof path);
  if (path[0] && access(path, X_OK) == 0) return 1;
  const char *folders = getenv("PATH");
  while (folders && *folders) {
    size_t length = strcspn(folders, ":");
    (void)snprintf(path, sizeof path, "%.*s/waymark-%s", (int)(length < WM_PATH_MAX ? length : 0), folders, command);
    if (length > 0 && access(path, X_OK) == 0) return 1;
    folders += length + (folders[length] == ':');
  }
  return 0;
}

void run_desk_command(const char *command, char *const *argv) {
  if (strchr(command, '/')) return;
  char path[WM_PATH_MAX + 80];
  path_beside(command, path, sizeof path);
  if (path[0]) (void)execv(path, argv);
  (void)snprintf(path, sizeof path, "waymark-%s", command);
  (void)execvp(path, argv);
}
