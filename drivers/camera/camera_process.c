// SPDX-License-Identifier: Apache-2.0
#include "camera_process.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

// In the camera's process.
#define SOCKET 3
#define PICTURES 4
#define FREE_FD 10      // above both
#define ANSWER_MS 3000  // longer than any call takes but those that start hardware
#define START_MS 20000  // firmware of an image processor is loaded
#define END_MS 2000     // for an orderly end
#define END_LOOK_MS 10

typedef enum what { OPEN, SET_MODE, SET_CONTROL, START, TAKE, GIVE_BACK } what;

// A call, and with the same members its result.
typedef struct message {
  what what;
  int32_t result, value;  // of `take` the milliseconds, of `start` the buffers, of `give_back` the buffer
  uint32_t room_bytes;    // of a picture in the shared memory
  camera_identity identity;
  camera_mode mode;
  camera_control control;
  camera_buffer buffer;
  wm_time_ns exposure_ns;
} message;

// ── in the camera's process ─────────────────────────────────────────────────────────────────────────────────────────

typedef struct server {
  const camera_io *io;
  void *camera;
  uint8_t *pictures;
  uint32_t room_bytes;
} server;

static int start_camera(server *self, message *m) {
  const size_t bytes = m->mode.image_bytes ? m->mode.image_bytes : (size_t)m->mode.stride * m->mode.height * 2;
  if (bytes == 0 || bytes > UINT32_MAX / CAMERA_BUFFERS_MAX) return -EINVAL;
  if (ftruncate(PICTURES, (off_t)(bytes * CAMERA_BUFFERS_MAX)) != 0) return -errno;
  void *pictures = mmap(NULL, bytes * CAMERA_BUFFERS_MAX, PROT_READ | PROT_WRITE, MAP_SHARED, PICTURES, 0);
  if (pictures == MAP_FAILED) return -errno;
  self->pictures = pictures;
  m->room_bytes = self->room_bytes = (uint32_t)bytes;
  return self->io->start(self->camera, (uint32_t)m->value);
}

// The driver's memory is read here and nowhere else.
static int take_picture(server *self, message *m) {
  int got = self->io->take(self->camera, m->value, &m->buffer);
  if (got != 1) return got;
  if (m->buffer.index >= CAMERA_BUFFERS_MAX) return -EIO;
  if (m->buffer.bytes > self->room_bytes) m->buffer.bytes = self->room_bytes;
  memcpy(self->pictures + (size_t)m->buffer.index * self->room_bytes, m->buffer.data, m->buffer.bytes);
  m->buffer.data = NULL;
  m->exposure_ns = self->io->exposure_ns(self->camera);
  return got;
}

static int answer(server *self, message *m) {
  if (m->what == OPEN) return self->camera ? -EBUSY : self->io->open(NULL, &m->identity, &self->camera);
  if (!self->camera) return -ENODEV;
  switch (m->what) {
    case SET_MODE: return self->io->set_mode(self->camera, &m->mode);
    case SET_CONTROL: return self->io->set_control(self->camera, &m->control);
    case START: return self->pictures ? -EBUSY : start_camera(self, m);
    case TAKE: return self->pictures ? take_picture(self, m) : -EINVAL;
    case GIVE_BACK: return self->io->give_back(self->camera, (uint32_t)m->value);
    default: return -EINVAL;
  }
}

void camera_process_serve(const camera_io *io) {
  server self = {.io = io};
  message m;
  (void)close_range(PICTURES + 1, UINT_MAX, 0);  // what libraries of the other process left open
  while (recv(SOCKET, &m, sizeof m, 0) == (ssize_t)sizeof m) {
    m.result = answer(&self, &m);
    if (send(SOCKET, &m, sizeof m, MSG_NOSIGNAL) != (ssize_t)sizeof m) break;
  }
  if (self.camera) io->close(self.camera);
}

// ── in the program's own ────────────────────────────────────────────────────────────────────────────────────────────

typedef struct camera_process {
  pid_t pid;
  int socket, memory;
  const uint8_t *pictures;
  uint32_t room_bytes;
  camera_mode mode;
  wm_time_ns exposure_ns;
} camera_process;

// An answer that comes too late would be taken for that of the next call: no further call is made then.
static int ask(camera_process *self, message *m, int within_ms) {
  struct pollfd waiting = {self->socket, POLLIN, 0};
  if (self->socket < 0) return -ENODEV;
  if (send(self->socket, m, sizeof *m, MSG_NOSIGNAL) == (ssize_t)sizeof *m && poll(&waiting, 1, within_ms) == 1 &&
      recv(self->socket, m, sizeof *m, 0) == (ssize_t)sizeof *m)
    return m->result;
  (void)close(self->socket);
  self->socket = -1;
  return -ENODEV;
}

// Of this program's folder: bin/waymark and lib/waymark/waymark-camera are installed, and built, side by side.
static int path_of_program(const char *name, char out[PATH_MAX]) {
  char beside_bin[64];
  (void)snprintf(beside_bin, sizeof beside_bin, "/../lib/waymark/%s", name);
  const ssize_t length = readlink("/proc/self/exe", out, PATH_MAX - 1);
  if (length <= 0) return -errno;
  out[length] = '\0';
  char *end = strrchr(out, '/');
  if (!end || (size_t)(end - out) + sizeof beside_bin > PATH_MAX) return -ENAMETOOLONG;
  memcpy(end, beside_bin, sizeof beside_bin);
  return 0;
}

int camera_process_is_there(const char *program) {
  char path[PATH_MAX];
  return path_of_program(program, path) == 0 && access(path, X_OK) == 0;
}

static int spawn(camera_process *self, const char *program, int its_socket) {
  posix_spawn_file_actions_t files;
  char path[PATH_MAX], argument[] = CAMERA_PROCESS;
  char *const arguments[] = {path, argument, NULL};
  if (strchr(program, '/')) {
    (void)snprintf(path, sizeof path, "%s", program);
  } else {
    const int unknown = path_of_program(program, path);
    if (unknown) return unknown;
  }
  if (posix_spawn_file_actions_init(&files) != 0) return -ENOMEM;
  int failed = posix_spawn_file_actions_adddup2(&files, its_socket, SOCKET);
  if (!failed) failed = posix_spawn_file_actions_adddup2(&files, self->memory, PICTURES);
  if (!failed) failed = posix_spawn(&self->pid, path, &files, NULL, arguments, environ);
  (void)posix_spawn_file_actions_destroy(&files);
  return -failed;
}

// Moved above the numbers that they get in the other process.
static int above(int fd) {
  int moved = fd < 0 ? -1 : fcntl(fd, F_DUPFD_CLOEXEC, FREE_FD);
  if (fd >= 0) (void)close(fd);
  return moved;
}

static int begin(camera_process *self, const char *program) {
  int ends[2] = {-1, -1};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) return -errno;
  self->socket = ends[0];
  const int its_socket = above(ends[1]);
  self->memory = above(memfd_create("waymark-pictures", MFD_CLOEXEC));
  int failed = its_socket < 0 || self->memory < 0 ? -EMFILE : spawn(self, program, its_socket);
  if (its_socket >= 0) (void)close(its_socket);
  return failed;
}

static void end(const camera_process *self) {
  int waited_ms = 0;
  while (self->pid > 0 && waitpid(self->pid, NULL, WNOHANG) == 0) {
    if (waited_ms >= END_MS) (void)kill(self->pid, SIGKILL);
    kV4l2.sleep_ms(NULL, END_LOOK_MS);
    waited_ms += END_LOOK_MS;
  }
}

static void close_camera(void *camera) {
  camera_process *self = camera;
  if (self->socket >= 0) (void)close(self->socket);
  end(self);
  if (self->pictures) (void)munmap((void *)self->pictures, (size_t)self->room_bytes * CAMERA_BUFFERS_MAX);
  if (self->memory >= 0) (void)close(self->memory);
  free(self);
}

static int open_camera(void *context, camera_identity *wanted, void **camera) {
  camera_process *self = calloc(1, sizeof *self);
  if (!self) return -ENOMEM;
  self->socket = self->memory = -1;
  message m = {.what = OPEN, .identity = *wanted};
  int failed = begin(self, context);
  if (!failed) failed = ask(self, &m, START_MS);
  if (failed) {
    close_camera(self);
    return failed;
  }
  *wanted = m.identity;
  *camera = self;
  return 0;
}

static int set_mode(void *camera, camera_mode *mode) {
  camera_process *self = camera;
  message m = {.what = SET_MODE, .mode = *mode};
  int failed = ask(self, &m, START_MS);
  *mode = self->mode = m.mode;
  return failed;
}

static int set_control(void *camera, camera_control *control) {
  message m = {.what = SET_CONTROL, .control = *control};
  int failed = ask(camera, &m, ANSWER_MS);
  *control = m.control;
  return failed;
}

static wm_time_ns exposure_ns(void *camera) { return ((camera_process *)camera)->exposure_ns; }

static int start(void *camera, uint32_t buffers) {
  camera_process *self = camera;
  message m = {.what = START, .value = (int32_t)buffers, .mode = self->mode};
  int failed = ask(self, &m, START_MS);
  if (failed) return failed;
  void *pictures = mmap(NULL, (size_t)m.room_bytes * CAMERA_BUFFERS_MAX, PROT_READ, MAP_SHARED, self->memory, 0);
  if (pictures == MAP_FAILED) return -errno;
  self->pictures = pictures;
  self->room_bytes = m.room_bytes;
  return 0;
}

static int take(void *camera, int wait_ms, camera_buffer *out) {
  camera_process *self = camera;
  message m = {.what = TAKE, .value = wait_ms};
  int got = ask(self, &m, wait_ms + ANSWER_MS);
  if (got != 1) return got;
  if (m.buffer.index >= CAMERA_BUFFERS_MAX || m.buffer.bytes > self->room_bytes) return -EIO;
  *out = m.buffer;
  out->data = self->pictures + (size_t)out->index * self->room_bytes;
  self->exposure_ns = m.exposure_ns;
  return 1;
}

static int give_back(void *camera, uint32_t index) {
  message m = {.what = GIVE_BACK, .value = (int32_t)index};
  return ask(camera, &m, ANSWER_MS);
}

static void sleep_ms(void *context, int ms) { kV4l2.sleep_ms(context, ms); }

static wm_time_ns monotonic_ns(void *context) { return kV4l2.monotonic_ns(context); }

const camera_io kCameraProcess = {open_camera, set_mode,  set_control,  exposure_ns, start,
                                  take,        give_back, close_camera, sleep_ms,    monotonic_ns};
