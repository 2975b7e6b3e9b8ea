// SPDX-License-Identifier: Apache-2.0
#include "rt/forked.h"

#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define AT_ONCE_MAX 64

typedef struct running {
  int end;  // to read the result from, -1: not started
  pid_t pid;
  size_t index;
} running;

static int write_all(int to, const char *bytes, size_t count) {
  while (count > 0) {
    const ssize_t written = write(to, bytes, count);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return 0;
    bytes += written;
    count -= (size_t)written;
  }
  return 1;
}

static int read_all(int from, char *bytes, size_t count) {
  while (count > 0) {
    const ssize_t got = read(from, bytes, count);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return 0;
    bytes += got;
    count -= (size_t)got;
  }
  return 1;
}

// The result is made in the caller's own place for it, which a process of its own does not share.
static running start(const wm_forked *work, size_t index, char *result) {
  running self = {.end = -1, .index = index};
  int ends[2];
  if (pipe(ends) != 0) return self;
  self.pid = fork();
  if (self.pid == 0) {
    (void)close(ends[0]);
    work->job(work->context, index, result);
    _exit(write_all(ends[1], result, work->result_bytes) ? 0 : 1);
  }
  (void)close(ends[1]);
  if (self.pid > 0)
    self.end = ends[0];
  else
    (void)close(ends[0]);
  return self;
}

static void finish(const running *self, char *result, size_t bytes) {
  if (!read_all(self->end, result, bytes)) memset(result, 0, bytes);
  (void)close(self->end);
  (void)waitpid(self->pid, NULL, 0);
}

// The place of a job that has ended; one that is not started has failed.
static size_t wait_for_one(const running *jobs, size_t count) {
  struct pollfd ends[AT_ONCE_MAX];
  for (size_t i = 0; i < count; i++) {
    if (jobs[i].end < 0) return i;
    ends[i] = (struct pollfd){.fd = jobs[i].end, .events = POLLIN};
  }
  while (poll(ends, count, -1) < 0)
    if (errno != EINTR) return 0;
  for (size_t i = 0; i < count; i++)
    if (ends[i].revents) return i;
  return 0;
}

void wm_forked_run(const wm_forked *work, size_t count, void *results) {
  const long processors = sysconf(_SC_NPROCESSORS_ONLN);
  size_t at_once = processors > 1 ? (size_t)processors : 1, running_count = 0;
  if (at_once > AT_ONCE_MAX) at_once = AT_ONCE_MAX;
  running jobs[AT_ONCE_MAX];
  char *at = results;
  if (count > 0) memset(at, 0, count * work->result_bytes);  // without jobs `results` may be NULL
  for (size_t started = 0, ended = 0; ended < count; ended++) {
    for (; started < count && running_count < at_once; started++)
      jobs[running_count++] = start(work, started, at + started * work->result_bytes);
    const size_t one = wait_for_one(jobs, running_count);
    if (jobs[one].end >= 0) finish(&jobs[one], at + jobs[one].index * work->result_bytes, work->result_bytes);
    jobs[one] = jobs[--running_count];
    if (work->done) work->done(work->context);
  }
}
