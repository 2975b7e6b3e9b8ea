// SPDX-License-Identifier: Apache-2.0
// A live source of rows under test: its newest event, what it counts, its device, and a TCP server that a test plays.
#ifndef WAYMARK_TESTS_LIVE_SOURCE_H
#define WAYMARK_TESTS_LIVE_SOURCE_H

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include "common/suite.h"
#include "live/row_source.h"
#include "rt/clock.h"

#define MS WM_NS_PER_MS

static wm_source *source;
static wm_event event;
static wm_error err;

static inline void source_open(wm_row_device *device, const wm_row_mountings *mountings) {
  TEST_ASSERT_EQUAL(WM_OK, row_source_open(device, mountings, &source, &err));
}

static inline void source_close(void) {
  if (source) source->ops->close(source);
  source = NULL;
}

static inline wm_status next(void) { return source->ops->next(source, &event, &err); }

static inline void expect(wm_status status) {
  const wm_status got = next();
  TEST_ASSERT_EQUAL_MESSAGE(status, got, source->counts.first_problem);
}

static inline void expect_problem(const char *text) {
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(source->counts.first_problem, text), source->counts.first_problem);
}

static inline void expect_device(unsigned state, const char *note) {
  TEST_ASSERT_EQUAL_MESSAGE(state, source->counts.device, source->counts.device_note);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(source->counts.device_note, note), source->counts.device_note);
}

// Up to 10 s.
static inline void wait_for(unsigned state, const char *note) {
  const wm_time_ns until_ns = wm_monotonic_ns() + 10 * WM_NS_PER_S;
  while (source->counts.device != state && wm_monotonic_ns() < until_ns) (void)next();
  expect_device(state, note);
}

// ---- the other side of a connection ----

static int server = -1, client = -1;

// Listens at the loopback's port; at 0, on a free one, which it becomes.
static inline void listen_at(int *port) {
  struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((uint16_t)*port)};
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int yes = 1;
  socklen_t length = sizeof at;
  server = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
  TEST_ASSERT_EQUAL(0, setsockopt(server, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes));
  TEST_ASSERT_EQUAL(0, bind(server, (struct sockaddr *)&at, sizeof at));
  TEST_ASSERT_EQUAL(0, listen(server, 2));
  TEST_ASSERT_EQUAL(0, getsockname(server, (struct sockaddr *)&at, &length));
  *port = ntohs(at.sin_port);
}

static inline void hang_up(void) {
  if (client >= 0) (void)close(client);
  if (server >= 0) (void)close(server);
  server = client = -1;
}

// Until the run has connected. Its device is then as stated.
static inline void accept_run(void) {
  const wm_time_ns until_ns = wm_monotonic_ns() + 10 * WM_NS_PER_S;
  while (client < 0 && wm_monotonic_ns() < until_ns) {
    (void)next();
    client = accept(server, NULL, NULL);
  }
  TEST_ASSERT_GREATER_OR_EQUAL(0, client);
}

static inline void say(const char *text) {
  TEST_ASSERT_EQUAL((int)strlen(text), send(client, text, strlen(text), MSG_NOSIGNAL));
}

// A kilobyte without an end of line, forty times, then the end: one malformed line.
static inline void flood(void) {
  char line[1000];
  memset(line, 'x', sizeof line - 1);
  line[sizeof line - 1] = '\0';
  for (int i = 0; i < 40; i++) {
    say(line);
    expect(WM_AGAIN);
  }
  say("\r\n");
}

#endif
