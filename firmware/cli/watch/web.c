// SPDX-License-Identifier: Apache-2.0
#include "cli/watch/web.h"

#include <arpa/inet.h>
#include <errno.h>
#include <math.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "rt/clock.h"

#define REQUEST_MAX 4096
#define ANSWER_MAX 32768
#define CLIENT_MS 500

// ── the state as JSON ───────────────────────────────────────────────────────────────────────────────────────────────

typedef struct text {
  char *out;
  size_t used, capacity;
} text;

__attribute__((format(printf, 2, 3))) static void put(text *self, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  int n = vsnprintf(self->out + self->used, self->capacity - self->used, format, arguments);
  va_end(arguments);
  if (n > 0) self->used = self->used + (size_t)n < self->capacity ? self->used + (size_t)n : self->capacity - 1;
}

// Names come over the network: what isn't plain is left out.
static void put_string(text *self, const char *value) {
  put(self, "\"");
  for (; *value; value++)
    if ((unsigned char)*value >= 0x20 && *value != '"' && *value != '\\' && *value != '<') put(self, "%c", *value);
  put(self, "\"");
}

static void put_number(text *self, const char *key, double value) {
  if (isfinite(value))
    put(self, ", \"%s\": %.9g", key, value);
  else
    put(self, ", \"%s\": null", key);
}

static void put_pose(text *self, const watch *seen) {
  const wm_estimate *e = &seen->pose.now;
  const double *q = e->pose_map_base.q_xyzw, *c = e->covariance;
  put(self, ", \"pose\": {\"state\": %d", (int)e->state);
  put_number(self, "x_m", e->pose_map_base.p_m[0]);
  put_number(self, "y_m", e->pose_map_base.p_m[1]);
  put_number(self, "heading_rad", atan2(2 * (q[3] * q[2] + q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2])));
  put_number(self, "cov_xx", c[wm_cov_index(0, 0)]);
  put_number(self, "cov_xy", c[wm_cov_index(0, 1)]);
  put_number(self, "cov_yy", c[wm_cov_index(1, 1)]);
  put_number(self, "sigma_heading_rad", sqrt(fmax(c[wm_cov_index(5, 5)], 0)));
  put_number(self, "speed_mps", e->v_mps[0]);
  put_number(self, "fused_ms_ago", (double)(e->t_ns - seen->pose.fused_until_ns) * 1e-6);
  put(self, ", \"jumps\": %u}", (unsigned)seen->pose.jumps);
}

static void put_health(text *self, const watch *seen) {
  const wm_health *h = &seen->health;
  put_number(self, "lost_probability", h->lost_probability);
  put_number(self, "left_m", h->reckoning_left_m);
  put_number(self, "left_s", h->reckoning_left_s);
  put(self, ", \"deadlines_missed\": %llu, \"sources\": [", (unsigned long long)h->deadlines_missed);
  for (uint32_t i = 0; i < h->source_count; i++) {
    const wm_source_health *s = &h->sources[i];
    uint64_t rejected = 0, lost = s->lost + s->overflows + s->dropped;
    for (int k = 1; k < WM_VERDICT_COUNT; k++) rejected += s->rejected[k];
    put(self, "%s{\"name\": ", i ? ", " : "");
    put_string(self, s->name);
    put(self, ", \"device\": ");
    put_string(self, s->device ? wm_device_state_name(s->device) : s->stale ? "silent" : "");
    put_number(self, "age_s", (double)s->silent_ns * 1e-9);
    char looks[300];
    (void)wm_looks_text(s->looks, looks, sizeof looks);
    put(self, ", \"looks\": ");
    put_string(self, looks);
    put(self, ", \"fused\": %llu, \"rejected\": %llu, \"late\": %llu, \"lost\": %llu}", (unsigned long long)s->fused,
        (unsigned long long)rejected, (unsigned long long)s->late, (unsigned long long)lost);
  }
  put(self, "]");
}

static size_t state_json(const watch *seen, wm_time_ns now_ns, char *out, size_t capacity) {
  char why[240];
  text json = {out, 0, capacity};
  put(&json, "{\"state\": ");
  put_string(&json, watch_state(seen, now_ns, why, sizeof why));
  put(&json, ", \"why\": ");
  put_string(&json, why);
  put(&json, ", \"consistency\": ");
  put_string(&json, watch_consistency(seen));
  if (seen->has_pose) put_pose(&json, seen);
  if (seen->has_health) put_health(&json, seen);
  put(&json, "}\n");
  return json.used;
}

static size_t map_json(const web *self, char *out, size_t capacity) {
  text json = {out, 0, capacity};
  if (!self->map) return 0;
  put(&json, "{\"width\": %u, \"height\": %u, \"metres_a_pixel\": %.9g, \"origin\": [%.9g, %.9g, %.9g]}\n",
      self->width_px, self->height_px, self->map->resolution_m * self->every, self->map->origin_x_m,
      self->map->origin_y_m, self->map->origin_yaw_rad);
  return json.used;
}

size_t web_answer(const web *self, const watch *seen, wm_time_ns now_ns, const char *path, char *out, size_t capacity) {
  if (strcmp(path, "/state.json") == 0) return state_json(seen, now_ns, out, capacity);
  if (strcmp(path, "/map.json") == 0) return map_json(self, out, capacity);
  if (strcmp(path, "/") != 0) return 0;
  text page = {out, 0, capacity};
  put(&page, "%s", kWebPage);
  return page.used;
}

// ── the map's picture ───────────────────────────────────────────────────────────────────────────────────────────────

// 255 an edge, 60 where one can drive, 0 elsewhere; a pixel stands for `every` x `every` of the map's.
static wm_status draw_map(web *self, wm_error *err) {
  const wm_raster *m = self->map;
  uint32_t longer = m->width_px > m->height_px ? m->width_px : m->height_px;
  self->every = (longer + WEB_MAP_EDGE - 1) / WEB_MAP_EDGE;
  self->width_px = m->width_px / self->every;
  self->height_px = m->height_px / self->every;
  self->picture = calloc((size_t)self->width_px * self->height_px + 1, 1);
  if (!self->picture) return wm_fail(err, WM_IO, "no memory for the map's picture");
  for (uint32_t y = 0; y < self->height_px * self->every; y++)
    for (uint32_t x = 0; x < self->width_px * self->every; x++) {
      size_t from = (size_t)y * m->width_px + x, to = (size_t)(y / self->every) * self->width_px + x / self->every;
      uint8_t grey = m->edges && m->edges[from] ? 255 : m->drivable && m->drivable[from] ? 60 : 0;
      if (grey > self->picture[to]) self->picture[to] = grey;
    }
  return WM_OK;
}

// ── requests ────────────────────────────────────────────────────────────────────────────────────────────────────────

wm_status web_open(web *self, const char *address, int port, const wm_raster *map, wm_error *err) {
  memset(self, 0, sizeof *self);
  self->map = map;
  self->listening = -1;
  struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
  if (inet_pton(AF_INET, address, &at.sin_addr) != 1)
    return wm_fail(err, WM_BAD_USAGE, "--bind: '%s' is no IPv4 address; 127.0.0.1 is this computer", address);
  wm_status status = map ? draw_map(self, err) : WM_OK;
  if (status != WM_OK) return status;
  int again = 1;
  self->listening = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (self->listening >= 0) (void)setsockopt(self->listening, SOL_SOCKET, SO_REUSEADDR, &again, sizeof again);
  if (self->listening < 0 || bind(self->listening, (struct sockaddr *)&at, sizeof at) != 0 ||
      listen(self->listening, 8) != 0) {
    status = wm_fail(err, WM_IO, "%s:%d: can't listen there: %s", address, port, strerror(errno));
    web_close(self);
  }
  return status;
}

static void send_all(int client, const void *bytes, size_t length) {
  const char *at = bytes;
  while (length > 0) {
    ssize_t sent = send(client, at, length, MSG_NOSIGNAL);
    if (sent <= 0) return;
    at += sent;
    length -= (size_t)sent;
  }
}

static void answer(int client, const char *status, const char *type, const void *body, size_t length) {
  char head[400];
  int n = snprintf(head, sizeof head,
                   "HTTP/1.1 %s\r\nContent-Type: %s\r\nContent-Length: %zu\r\nCache-Control: no-store\r\n"
                   "Content-Security-Policy: default-src 'self' 'unsafe-inline'\r\nX-Content-Type-Options: nosniff\r\n"
                   "Connection: close\r\n\r\n",
                   status, type, length);
  send_all(client, head, (size_t)n);
  send_all(client, body, length);
}

// The head of a request; 0 where none came in time.
static int read_request(int client, char request[REQUEST_MAX]) {
  size_t used = 0;
  const struct timeval patience = {.tv_usec = CLIENT_MS * 1000};
  (void)setsockopt(client, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  (void)setsockopt(client, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  while (used < REQUEST_MAX - 1) {
    ssize_t got = recv(client, request + used, REQUEST_MAX - 1 - used, 0);
    if (got <= 0) return 0;
    used += (size_t)got;
    request[used] = '\0';
    if (strstr(request, "\r\n\r\n")) return 1;
  }
  return 0;
}

// A page of another site whose name was made to point here has that name as its Host.
static int is_for_us(int client, const char *request) {
  struct sockaddr_in own = {0};
  socklen_t length = sizeof own;
  const char *host = strcasestr(request, "\r\nHost:");
  if (getsockname(client, (struct sockaddr *)&own, &length) != 0) return 0;
  if (ntohl(own.sin_addr.s_addr) != INADDR_LOOPBACK) return 1;
  if (!host) return 0;
  host += strspn(host + 7, " ") + 7;
  return strncmp(host, "localhost:", 10) == 0 || strncmp(host, "127.0.0.1:", 10) == 0 ||
         strncmp(host, "localhost\r", 10) == 0 || strncmp(host, "127.0.0.1\r", 10) == 0;
}

static void serve_client(web *self, int client, const watch *seen) {
  static char request[REQUEST_MAX], body[ANSWER_MAX];
  char path[64] = "";
  if (!read_request(client, request)) return;
  if (sscanf(request, "GET %63[^ ?] HTTP/1.", path) != 1 && sscanf(request, "GET %63[^ ?]?", path) != 1) path[0] = '\0';
  if (!path[0] || !is_for_us(client, request)) {
    self->refused++;
    answer(client, "403 Forbidden", "text/plain", "", 0);
    return;
  }
  if (strcmp(path, "/map.raw") == 0 && self->map) {
    answer(client, "200 OK", "application/octet-stream", self->picture, (size_t)self->width_px * self->height_px);
    return;
  }
  size_t length = web_answer(self, seen, wm_monotonic_ns(), path, body, sizeof body);
  if (length > 0)
    answer(client, "200 OK", strcmp(path, "/") == 0 ? "text/html; charset=utf-8" : "application/json", body, length);
  else
    answer(client, "404 Not Found", "text/plain", "", 0);
}

void web_serve(web *self, const watch *seen, int wait_ms) {
  struct pollfd ready = {.fd = self->listening, .events = POLLIN};
  for (int i = 0; i < 8 && poll(&ready, 1, i == 0 ? wait_ms : 0) == 1; i++) {
    int client = accept4(self->listening, NULL, NULL, SOCK_CLOEXEC);
    if (client < 0) return;
    serve_client(self, client, seen);
    (void)close(client);
  }
}

void web_close(web *self) {
  if (self->listening >= 0) (void)close(self->listening);
  self->listening = -1;
  free(self->picture);
  self->picture = NULL;
}
