// SPDX-License-Identifier: Apache-2.0
#include "live/other_runs.h"

#include <arpa/inet.h>
#include <inttypes.h>
#include <linux/filter.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <unistd.h>

#include "live/lcm_connect.h"

#define LOOK_EVERY_NS (100 * WM_NS_PER_MS)
#define PACKETS_MAX 16                   // a look: eight runs send as many in two seconds
#define GONE_AFTER_NS (4 * WM_NS_PER_S)  // without HEALTH, which comes once a second
// A message of LCM in one datagram: "LC02", number u32, channel's name with its zero, content.
#define LCM_MAGIC 0x4c433032u
#define LCM_HEAD_BYTES 8
#define UDP_HEAD_BYTES 8  // a filter of a UDP socket sees it; a reader does not

// ── the socket ──────────────────────────────────────────────────────────────────────────────────────────────────────

// Passes datagrams of this channel alone: its name is compared by words, its end and its zero by bytes.
static int filter_channel(int fd, const char *channel) {
  struct sock_filter code[3 * (sizeof((other_runs *)0)->channel + 2)];
  unsigned n = 0;
  const unsigned length = (unsigned)strlen(channel) + 1, from = UDP_HEAD_BYTES + LCM_HEAD_BYTES;
  code[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, UDP_HEAD_BYTES);
  code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, LCM_MAGIC, 1, 0);
  code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, 0);
  for (unsigned i = 0; i < length;) {
    const int is_word = length - i >= 4;
    uint32_t wanted = (uint8_t)channel[i];
    if (is_word) {
      memcpy(&wanted, channel + i, sizeof wanted);
      wanted = ntohl(wanted);
    }
    code[n++] = (struct sock_filter)BPF_STMT(BPF_LD | (is_word ? BPF_W : BPF_B) | BPF_ABS, from + i);
    code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, wanted, 1, 0);
    code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, 0);
    i += is_word ? 4 : 1;
  }
  code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, UINT32_MAX);
  const struct sock_fprog program = {.len = (unsigned short)n, .filter = code};
  return setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) == 0;
}

static int join(int fd, const char *address, int port) {
  const int yes = 1;
  struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
  struct ip_mreq group = {.imr_interface.s_addr = htonl(INADDR_ANY)};
  if (inet_pton(AF_INET, address, &at.sin_addr) != 1) return 0;
  group.imr_multiaddr = at.sin_addr;
  // As liblcm does: all programs of a computer share the port.
  return setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) == 0 &&
         setsockopt(fd, SOL_SOCKET, SO_REUSEPORT, &yes, sizeof yes) == 0 &&
         bind(fd, (const struct sockaddr *)&at, sizeof at) == 0 &&
         setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) == 0;
}

static void try_open(other_runs *self) {
  self->fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (self->fd < 0) return;
  if (filter_channel(self->fd, self->channel) && join(self->fd, self->address, self->port)) return;
  (void)close(self->fd);  // no route for multicast yet
  self->fd = -1;
}

void other_runs_open(other_runs *self, int is_on, const char *url, const char *prefix, wm_line_fn say,
                     void *say_context) {
  memset(self, 0, sizeof *self);
  self->fd = -1;
  self->say = say;
  self->say_context = say_context;
  (void)snprintf(self->channel, sizeof self->channel, "%.55sHEALTH", prefix);
  if (getrandom(&self->own_id, sizeof self->own_id, GRND_NONBLOCK) != sizeof self->own_id || self->own_id == 0)
    self->own_id = (uint64_t)getpid();
  self->is_wanted = is_on && sscanf(lcm_connect_url(url), "udpm://%63[0-9.]:%d", self->address, &self->port) == 2;
}

void other_runs_close(other_runs *self) {
  if (self->fd >= 0) (void)close(self->fd);
  self->fd = -1;
}

// ── other runs ────────────────────────────────────────────────────────────────────────────────────────────────────

static void tell(const other_runs *self, const other_run *run, const char *what) {
  char line[300];
  (void)snprintf(line, sizeof line, "another run, process %" PRId32 " on '%s', %s", run->pid, run->host, what);
  self->say(self->say_context, line);
}

static void take(other_runs *self, wm_time_ns now_ns) {
  other_run *place = NULL;
  for (size_t i = 0; i < OTHER_RUNS_MAX; i++) {
    other_run *run = &self->known[i];
    if (run->id == self->heard.run_id) {
      run->heard_ns = now_ns;
      return;
    }
    if (run->id == 0 && !place) place = run;
  }
  if (!place) return;
  *place = (other_run){.id = self->heard.run_id, .pid = self->heard.pid, .heard_ns = now_ns};
  memcpy(place->host, self->heard.host, sizeof place->host);
  self->total++;
  char what[200];
  (void)snprintf(what, sizeof what,
                 "publishes on the same channels (%.*s...): listeners get the poses of both, and both take commands. "
                 "Stop one, or give it another publish.channel_prefix",
                 (int)(strlen(self->channel) - strlen("HEALTH")), self->channel);
  tell(self, place, what);
}

static void look(other_runs *self, wm_time_ns now_ns) {
  const size_t head = LCM_HEAD_BYTES + strlen(self->channel) + 1;
  for (int i = 0; i < PACKETS_MAX; i++) {
    const ssize_t bytes = recv(self->fd, self->packet, sizeof self->packet, MSG_DONTWAIT);
    if (bytes < 0) break;
    if ((size_t)bytes <= head) continue;
    // Of another version: no identity, no process, but another run.
    if (wm_lcm_read_health(self->packet + head, (size_t)bytes - head, &self->heard)) {
      memset(&self->heard, 0, sizeof self->heard);
      self->heard.run_id = 1;
      (void)snprintf(self->heard.host, sizeof self->heard.host, "?");
    }
    if (self->heard.run_id != self->own_id && self->heard.run_id != 0) take(self, now_ns);
  }
  for (size_t i = 0; i < OTHER_RUNS_MAX; i++) {
    other_run *run = &self->known[i];
    if (run->id == 0 || now_ns - run->heard_ns < GONE_AFTER_NS) continue;
    tell(self, run, "is gone");
    run->id = 0;
  }
}

void other_runs_tick(other_runs *self, wm_time_ns now_ns) {
  if (!self->is_wanted || now_ns < self->next_ns) return;
  self->next_ns = now_ns + LOOK_EVERY_NS;
  if (self->fd < 0) {
    try_open(self);
    if (self->fd < 0) self->next_ns = now_ns + LCM_TRY_AGAIN_NS;
  }
  if (self->fd >= 0) look(self, now_ns);
}

void other_runs_health(const other_runs *self, wm_health *health) {
  health->run_id = self->own_id;
  health->pid = (int32_t)getpid();
  if (gethostname(health->host, sizeof health->host) != 0) health->host[0] = '\0';
  health->host[sizeof health->host - 1] = '\0';
  health->other_runs_total = self->total;
  health->other_runs = 0;
  for (size_t i = 0; i < OTHER_RUNS_MAX; i++) health->other_runs += self->known[i].id != 0;
}
