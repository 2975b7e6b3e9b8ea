// SPDX-License-Identifier: Apache-2.0
#include "cli/journal.h"

#include <inttypes.h>
#include <pthread.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "rt/clock.h"
#include "waymark/status.h"

// A source that fails and comes back writes two lines a second at most. A start with all its notes is below the first.
#define AT_ONCE 200.0
#define PER_S 2.0

static const char kFix[] = "; fix: ";

// JOURNAL_STREAM names the file that systemd gave as standard error; what redirects it leaves the variable behind.
static int is_journal(void) {
  const char *stream = getenv("JOURNAL_STREAM");
  struct stat error;
  char own[64];
  if (!stream || fstat(STDERR_FILENO, &error) != 0) return 0;
  (void)snprintf(own, sizeof own, "%ju:%ju", (uintmax_t)error.st_dev, (uintmax_t)error.st_ino);
  return strcmp(stream, own) == 0;
}

static int open_journal(void) {
  const struct sockaddr_un address = {.sun_family = AF_UNIX, .sun_path = "/run/systemd/journal/socket"};
  int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return -1;
  if (connect(fd, (const struct sockaddr *)&address, sizeof address) == 0) return fd;
  (void)close(fd);
  return -1;
}

// One field: NAME=TEXT. A line's end in the text would need the other form, with its length: it becomes a space.
static void put(FILE *to, const char *name, const char *text, size_t length) {
  (void)fprintf(to, "%s%s", name, name[0] ? "=" : "");
  for (size_t i = 0; i < length; i++) (void)fputc(text[i] == '\n' ? ' ' : text[i], to);
  (void)fputc('\n', to);
}

// "ABOUT: TEXT; fix: FIX [IDENTIFIER]" of wm_finding_line. Other lines have an ABOUT at most. Whether it is a finding.
static int put_parts(FILE *to, const char *line) {
  const size_t length = strlen(line), word = strcspn(line, " ");
  if (word > 1 && word < length && line[word - 1] == ':') put(to, "WAYMARK_ABOUT", line, word - 1);
  const char *name = strrchr(line, '[');
  const size_t spelt = name ? strspn(name + 1, "abcdefghijklmnopqrstuvwxyz-") : 0;
  if (spelt == 0 || strcmp(name + 1 + spelt, "]") != 0) return 0;
  put(to, "WAYMARK_FINDING", name + 1, spelt);
  const char *fix = strstr(line, kFix);
  if (fix && fix < name) put(to, "WAYMARK_FIX", fix + strlen(kFix), (size_t)(name - 1 - fix) - strlen(kFix));
  return 1;
}

static int send_entry(int fd, journal_level level, const char *start, const char *line, uint64_t left_out) {
  char entry[4 * WM_ERROR_TEXT_MAX];
  FILE *to = fmemopen(entry, sizeof entry, "w");
  if (!to) return 0;
  (void)fprintf(to, "SYSLOG_IDENTIFIER=waymark\nMESSAGE=%s: ", start);
  put(to, "", line, strlen(line));
  const int is_finding = put_parts(to, line);
  (void)fprintf(to, "PRIORITY=%d\n", level == JOURNAL_NOTICE && is_finding ? JOURNAL_WARNING : level);
  if (left_out > 0) (void)fprintf(to, "WAYMARK_LEFT_OUT=%" PRIu64 "\n", left_out);
  const long bytes = ftell(to);
  const int is_whole = fclose(to) == 0 && bytes > 0 && bytes < (long)sizeof entry;
  return is_whole && send(fd, entry, (size_t)bytes, MSG_NOSIGNAL) == bytes;
}

// Of notices and warnings: a bucket that fills. An error ends the program, and is always written.
static int has_room(journal_level level, wm_time_ns now_ns) {
  static double room = AT_ONCE;
  static wm_time_ns before_ns;
  if (before_ns > 0) room += PER_S * wm_seconds_between(before_ns, now_ns);
  if (room > AT_ONCE) room = AT_ONCE;
  before_ns = now_ns;
  if (level == JOURNAL_ERROR) return 1;
  if (room < 1) return 0;
  room -= 1;
  return 1;
}

// The journal's socket; -1: standard error it is.
static int journal(void) {
  static int fd = -2;  // not looked for yet
  if (fd == -2) fd = is_journal() ? open_journal() : -1;
  return fd;
}

static pthread_mutex_t *lock(void) {
  static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
  return &mutex;
}

void journal_line(journal_level level, const char *start, const char *line) {
  static uint64_t left_out;
  (void)pthread_mutex_lock(lock());
  const int fd = journal();
  if (fd >= 0 && !has_room(level, wm_monotonic_ns())) {
    left_out++;
  } else {
    if (fd < 0 || !send_entry(fd, level, start, line, left_out)) (void)fprintf(stderr, "%s: %s\n", start, line);
    left_out = 0;
  }
  (void)pthread_mutex_unlock(lock());
}

void journal_findings(const wm_findings *findings) {
  char line[sizeof(wm_finding)];
  (void)pthread_mutex_lock(lock());
  const int fd = journal();
  (void)pthread_mutex_unlock(lock());
  if (fd < 0) wm_findings_print(findings, stderr);
  for (size_t i = 0; fd >= 0 && i < findings->count; i++) {
    (void)wm_finding_line(&findings->at[i], line, sizeof line);
    journal_line(JOURNAL_NOTICE, wm_severity_name(findings->at[i].severity), line);
  }
}
