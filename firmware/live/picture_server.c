// SPDX-License-Identifier: Apache-2.0
#include "live/picture_server.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "live/threads.h"
#include "rt/clock.h"
#include "rt/memory.h"
#include "sources/onlooker.h"
#include "sources/picture_socket.h"

#define READERS_MAX 4
#define PICTURE_EVERY_NS (WM_NS_PER_S / 2)
#define PATIENCE_NS (5 * WM_NS_PER_S)  // with a reader that takes nothing
#define WAITING_MS 10                  // how often it is looked whether a picture came
#define IDLE_MS 200                    // how soon it ends

typedef struct reader {
  int socket;  // -1: free
  wm_picture_request request;
  size_t request_bytes;
  int is_asking;  // for source request.source
  uint64_t missed;
  uint8_t *message;
  size_t capacity, bytes, sent;
  wm_time_ns moved_ns;  // when it took something last
} reader;

struct picture_server {
  const wm_config *config;
  wm_vision *vision;
  char path[WM_PATH_MAX];
  int listening;
  reader readers[READERS_MAX];
  wm_time_ns next_ns[WM_VISION_SOURCES_MAX];  // a picture of this source is not asked for before
  int is_asked[WM_VISION_SOURCES_MAX];
  atomic_int stop;
  pthread_t thread;
};

// ── readers ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static void send_away(reader *self) {
  (void)close(self->socket);
  free(self->message);
  *self = (reader){.socket = -1};
}

static int has_reader(const picture_server *self) {
  for (int i = 0; i < READERS_MAX; i++)
    if (self->readers[i].socket >= 0) return 1;
  return 0;
}

static void let_in(picture_server *self) {
  int socket = accept4(self->listening, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (socket < 0) return;
  for (int i = 0; i < READERS_MAX; i++) {
    if (self->readers[i].socket >= 0) continue;
    self->readers[i] = (reader){.socket = socket, .moved_ns = wm_monotonic_ns()};
    return;
  }
  (void)close(socket);
}

static int make_room(reader *self, size_t bytes) {
  if (self->capacity >= bytes) return 1;
  free(self->message);
  self->message = malloc(bytes);
  self->capacity = self->message ? bytes : 0;
  return self->message != NULL;
}

static void fill_head(picture_server *self, reader *to) {
  wm_picture_head head;
  memcpy(&head, to->message, sizeof head);
  head.source = to->request.source;
  head.source_count = (uint32_t)wm_vision_count(self->vision);
  head.missed = to->missed;
  if (head.width_px > 0) {
    const wm_camera *camera;
    (void)wm_vision_onlooker(self->vision, head.source, &camera);
    (void)snprintf(head.source_name, sizeof head.source_name, "%s", wm_vision_source(self->vision, head.source)->name);
    (void)snprintf(head.camera, sizeof head.camera, "%s", camera->name);
  }
  memcpy(to->message, &head, sizeof head);
}

static void begin_answer(reader *self, size_t bytes) {
  self->bytes = bytes;
  self->sent = 0;
  self->is_asking = 0;
  self->moved_ns = wm_monotonic_ns();
}

// There is no such source: a head alone.
static void answer_none(picture_server *self, reader *to) {
  const wm_picture_head none = {.magic = WM_PICTURE_MAGIC};
  if (!make_room(to, sizeof none)) return;
  memcpy(to->message, &none, sizeof none);
  fill_head(self, to);
  begin_answer(to, sizeof none);
}

static void hear(picture_server *self, reader *from) {
  uint8_t *at = (uint8_t *)&from->request;
  ssize_t got = recv(from->socket, at + from->request_bytes, sizeof from->request - from->request_bytes, 0);
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (got <= 0) {
    send_away(from);
    return;
  }
  from->request_bytes += (size_t)got;
  if (from->request_bytes < sizeof from->request) return;
  from->request_bytes = 0;
  if (memcmp(from->request.magic, WM_PICTURE_MAGIC, sizeof from->request.magic) != 0 || from->sent < from->bytes) {
    send_away(from);  // another program, or one that asks before it took what it asked for
    return;
  }
  if (from->request.source < wm_vision_count(self->vision)) {
    from->is_asking = 1;
  } else {
    answer_none(self, from);
  }
}

static void send_on(reader *self, wm_time_ns now_ns) {
  while (self->sent < self->bytes) {
    ssize_t n = send(self->socket, self->message + self->sent, self->bytes - self->sent, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && errno == EAGAIN) {
      if (now_ns - self->moved_ns > PATIENCE_NS) send_away(self);
      return;
    }
    if (n <= 0) {
      send_away(self);
      return;
    }
    self->sent += (size_t)n;
    self->moved_ns = now_ns;
  }
}

// ── pictures ────────────────────────────────────────────────────────────────────────────────────────────────────────

static int is_asked_for(const picture_server *self, uint32_t source) {
  for (int i = 0; i < READERS_MAX; i++)
    if (self->readers[i].socket >= 0 && self->readers[i].is_asking && self->readers[i].request.source == source)
      return 1;
  return 0;
}

// To all that asked for it; those that are still at the one before missed it.
static void hand_out(picture_server *self, uint32_t source, onlooker *from, size_t most) {
  reader *first = NULL;
  for (int i = 0; i < READERS_MAX; i++) {
    reader *r = &self->readers[i];
    if (r->socket < 0 || r->request.source != source) continue;
    if (!r->is_asking) {
      r->missed += r->sent < r->bytes;
      continue;
    }
    if (!make_room(r, most)) continue;
    size_t bytes = first ? first->bytes : onlooker_take(from, r->message, r->capacity);
    if (bytes == 0) return;
    if (first) memcpy(r->message, first->message, bytes);
    if (!first) first = r;
    fill_head(self, r);
    begin_answer(r, bytes);
  }
  self->is_asked[source] = 0;
}

static void take_pictures(picture_server *self, wm_time_ns now_ns) {
  for (uint32_t source = 0; source < wm_vision_count(self->vision); source++) {
    const wm_camera *camera;
    onlooker *from = wm_vision_onlooker(self->vision, source, &camera);
    const size_t most = onlooker_bytes(camera->width_px, camera->height_px);
    if (self->is_asked[source]) hand_out(self, source, from, most);
    if (self->is_asked[source] || now_ns < self->next_ns[source] || !is_asked_for(self, source)) continue;
    self->is_asked[source] = onlooker_ask(from, camera->width_px, camera->height_px);
    self->next_ns[source] = now_ns + PICTURE_EVERY_NS;
  }
}

static void rest(picture_server *self) {
  for (uint32_t source = 0; source < wm_vision_count(self->vision); source++) {
    const wm_camera *camera;
    onlooker_rest(wm_vision_onlooker(self->vision, source, &camera));
    self->is_asked[source] = 0;
  }
}

// ── the thread ──────────────────────────────────────────────────────────────────────────────────────────────────────

static void wait_for_readers(picture_server *self) {
  struct pollfd list[READERS_MAX + 1] = {{.fd = self->listening, .events = POLLIN}};
  int wait_ms = IDLE_MS;
  for (int i = 0; i < READERS_MAX; i++) {
    const reader *r = &self->readers[i];
    list[i + 1] = (struct pollfd){.fd = r->socket, .events = (short)(POLLIN | (r->sent < r->bytes ? POLLOUT : 0))};
    if (r->is_asking) wait_ms = WAITING_MS;
  }
  if (poll(list, READERS_MAX + 1, wait_ms) <= 0) return;
  for (int i = 0; i < READERS_MAX; i++)
    if (self->readers[i].socket >= 0 && (list[i + 1].revents & (POLLIN | POLLERR | POLLHUP)))
      hear(self, &self->readers[i]);
  if (list[0].revents & POLLIN) let_in(self);
}

static void *serve(void *argument) {
  picture_server *self = argument;
  int was_looked_at = 0;
  wm_prefault_stack(THREAD_TOUCHED_BYTES);
  while (!atomic_load_explicit(&self->stop, memory_order_relaxed)) {
    wait_for_readers(self);
    const wm_time_ns now_ns = wm_monotonic_ns();
    take_pictures(self, now_ns);
    for (int i = 0; i < READERS_MAX; i++)
      if (self->readers[i].socket >= 0) send_on(&self->readers[i], now_ns);
    const int is_looked_at = has_reader(self);
    if (was_looked_at && !is_looked_at) rest(self);
    was_looked_at = is_looked_at;
  }
  return NULL;
}

// A socket that a run left behind when it was killed is taken away; one that another run listens on is not.
static wm_status listen_at(picture_server *self, wm_error *err) {
  struct sockaddr_un at = {.sun_family = AF_UNIX};
  if (strlen(self->path) >= sizeof at.sun_path)
    return wm_fail(err, WM_BAD_CONFIG, "%s: publish.picture_socket: '%s' is longer than %zu letters",
                   self->config->path, self->path, sizeof at.sun_path - 1);
  memcpy(at.sun_path, self->path, strlen(self->path));
  int probe = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int is_used = probe >= 0 && connect(probe, (const struct sockaddr *)&at, sizeof at) == 0;
  const int was_left = !is_used && errno == ECONNREFUSED;
  if (probe >= 0) (void)close(probe);
  if (is_used) return wm_fail(err, WM_IO, "%s: another run has this picture socket", self->path);
  struct stat what;
  if (was_left && lstat(self->path, &what) == 0 && S_ISSOCK(what.st_mode)) (void)unlink(self->path);
  self->listening = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (self->listening < 0 || bind(self->listening, (const struct sockaddr *)&at, sizeof at) != 0 ||
      chmod(self->path, S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP) != 0 || listen(self->listening, READERS_MAX) != 0)
    return wm_fail(err, WM_IO, "%s: the picture socket cannot be created: %s", self->path, strerror(errno));
  return WM_OK;
}

wm_status picture_server_start(const wm_config *config, wm_vision *vision, picture_server **out, wm_error *err) {
  *out = NULL;
  if (!config->picture_socket[0] || wm_vision_count(vision) == 0) return WM_OK;
  picture_server *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for the picture socket");
  self->config = config;
  self->vision = vision;
  self->listening = -1;
  memcpy(self->path, config->picture_socket, sizeof self->path);
  for (int i = 0; i < READERS_MAX; i++) self->readers[i].socket = -1;
  int is_realtime;
  wm_status status = listen_at(self, err);
  if (status == WM_OK) status = thread_start(THREAD_PICTURES, 0, config, serve, self, &self->thread, &is_realtime, err);
  if (status == WM_OK) {
    *out = self;
  } else {
    if (self->listening >= 0) (void)close(self->listening);
    free(self);
  }
  return status;
}

void picture_server_close(picture_server *self) {
  if (!self) return;
  atomic_store(&self->stop, 1);
  (void)pthread_join(self->thread, NULL);
  for (int i = 0; i < READERS_MAX; i++)
    if (self->readers[i].socket >= 0) send_away(&self->readers[i]);
  rest(self);
  (void)unlink(self->path);
  (void)close(self->listening);
  free(self);
}
