// SPDX-License-Identifier: Apache-2.0
// SocketCAN's place. Faults: can_down, can_removed, bus_off (what the kernel gives to a socket that asked for error
// frames), can_lost PERCENT.
#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <pthread.h>
#include <string.h>
#include <time.h>

#include "can_io.h"
#include "played_world.h"

// One interface; each socket has its own thread: a run's, and one that records beside it.
typedef struct played_socket {
  size_t next;
  wm_time_ns listens_ns;  // since when; what was on the bus before is gone
  int is_open, was_down, was_off;
} played_socket;
#define SOCKETS_MAX 8
#define SOCKET_FIRST 1000
static played_socket sockets[SOCKETS_MAX];
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;  // of is_open

static unsigned find(void *context, const char *interface, int *is_up) {
  (void)context, (void)interface;
  *is_up = !played_fault("can_down", NULL);
  return played_fault("can_removed", NULL) ? 0 : 3;
}

static int open_socket(void *context, unsigned index, const uint32_t *ids, const uint8_t *is_extended, size_t count) {
  (void)context, (void)index, (void)ids, (void)is_extended, (void)count;
  int i = 0;
  (void)pthread_mutex_lock(&lock);
  while (i < SOCKETS_MAX && sockets[i].is_open) i++;
  if (i < SOCKETS_MAX) sockets[i] = (played_socket){.is_open = 1, .listens_ns = played_now_ns()};
  (void)pthread_mutex_unlock(&lock);
  return i < SOCKETS_MAX ? SOCKET_FIRST + i : -EMFILE;
}

static wm_time_ns clock_ns(clockid_t clock) {
  struct timespec now;
  clock_gettime(clock, &now);
  return (wm_time_ns)now.tv_sec * WM_NS_PER_S + now.tv_nsec;
}

static wm_time_ns realtime_ns(void *context) {
  (void)context;
  return clock_ns(CLOCK_REALTIME);
}

static int error_frame(uint32_t class, can_received *out) {
  *out = (can_received){.software_ns = realtime_ns(NULL)};
  out->frame.id = class;
  out->frame.length = 8;
  out->frame.is_error = 1;
  return 1;
}

static int receive(void *context, int number, int wait_ms, can_received *out) {
  played_socket *s = &sockets[number - SOCKET_FIRST];
  (void)context;
  double percent = 0;
  int is_down = played_fault("can_down", NULL), is_off = played_fault("bus_off", NULL);
  if (played_fault("can_removed", NULL)) return -ENODEV;
  if (is_down && !s->was_down) {
    s->was_down = 1;
    return -ENETDOWN;
  }
  s->was_down = is_down;
  if (is_off != s->was_off) {
    s->was_off = is_off;
    return error_frame(is_off ? CAN_ERR_BUSOFF : CAN_ERR_RESTARTED, out);
  }
  if (is_down || is_off) {
    (void)played_sleep(INT64_MAX, wait_ms);
    s->listens_ns = played_now_ns();
    return 0;
  }
  const played_item *item = played_next('c', s->listens_ns, &s->next);
  while (item && played_fault("can_lost", &percent) && played_is_hit(item->number, percent)) {
    s->next++;
    item = played_next('c', s->listens_ns, &s->next);
  }
  if (!played_sleep(item ? played_due_ns(item) : INT64_MAX, wait_ms)) return 0;
  s->next++;
  // Stamped when it came, by the kernel, however long it waited in the socket's queue.
  wm_time_ns waited_ns = played_now_ns() - played_due_ns(item);
  *out = (can_received){.frame = item->frame, .software_ns = realtime_ns(NULL) - waited_ns};
  return 1;
}

static void close_socket(void *context, int number) {
  (void)context;
  (void)pthread_mutex_lock(&lock);
  sockets[number - SOCKET_FIRST].is_open = 0;
  (void)pthread_mutex_unlock(&lock);
}

static void sleep_ms(void *context, int ms) {
  (void)context;
  (void)played_sleep(INT64_MAX, ms);
}

static wm_time_ns monotonic_ns(void *context) {
  (void)context;
  return played_now_ns();
}

const can_io kSocketCan = {find, open_socket, receive, close_socket, sleep_ms, monotonic_ns, realtime_ns};
