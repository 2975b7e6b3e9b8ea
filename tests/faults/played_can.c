// SPDX-License-Identifier: Apache-2.0
// SocketCAN's place: the interfaces of a recording, and what the kernel gives to a socket that asked for error frames.
#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <pthread.h>
#include <string.h>
#include <time.h>

#include "can_io.h"
#include "played_world.h"

// Each socket has its own thread: a run's, and one that records beside it.
typedef struct played_socket {
  played_cursor cursor;
  int is_open, was_down, was_off;
} played_socket;
#define SOCKETS_MAX 16
#define SOCKET_FIRST 1000
#define INTERFACES_MAX 8
#define INDEX_FIRST 3
static played_socket sockets[SOCKETS_MAX];
static char interfaces[INTERFACES_MAX][WM_CAN_IFACE_MAX];
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;  // of is_open and interfaces

// 0: no room for another one.
static unsigned index_of(const char *interface) {
  unsigned i = 0;
  (void)pthread_mutex_lock(&lock);
  while (i < INTERFACES_MAX && interfaces[i][0] && strcmp(interfaces[i], interface) != 0) i++;
  if (i < INTERFACES_MAX) (void)strncpy(interfaces[i], interface, WM_CAN_IFACE_MAX - 1);
  (void)pthread_mutex_unlock(&lock);
  return i < INTERFACES_MAX ? INDEX_FIRST + i : 0;
}

static unsigned find(void *context, const char *interface, int *is_up) {
  (void)context;
  wm_play_stream about;
  if (!played_find(interface, WM_PLAY_CAN, &about)) return 0;
  *is_up = !played_fault(WM_FAULT_BUS_DOWN, about.of);
  return played_fault(WM_FAULT_BUS_REMOVED, about.of) ? 0 : index_of(interface);
}

static int open_socket(void *context, unsigned index, const wm_can_match *filters, size_t count) {
  (void)context, (void)filters, (void)count;
  int i = 0;
  wm_play_stream about;
  if (!played_find(interfaces[index - INDEX_FIRST], WM_PLAY_CAN, &about)) return -ENODEV;
  (void)pthread_mutex_lock(&lock);
  while (i < SOCKETS_MAX && sockets[i].is_open) i++;
  if (i < SOCKETS_MAX) sockets[i] = (played_socket){.is_open = 1, .cursor = {.about = about}};
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
  const char *of = s->cursor.about.of;
  (void)context;
  wm_time_ns due_ns = 0;
  int is_down = played_fault(WM_FAULT_BUS_DOWN, of), is_off = played_fault(WM_FAULT_BUS_OFF, of);
  if (played_fault(WM_FAULT_BUS_REMOVED, of)) return -ENODEV;
  if (is_down && !s->was_down) {
    s->was_down = 1;
    return -ENETDOWN;
  }
  s->was_down = is_down;
  if (is_off != s->was_off) {
    s->was_off = is_off;
    return error_frame(is_off ? CAN_ERR_BUSOFF : CAN_ERR_RESTARTED, out);
  }
  const wm_play_item *item = is_down || is_off ? NULL : played_next(&s->cursor, &due_ns);
  if (!played_sleep(item ? due_ns : INT64_MAX, wait_ms)) return 0;
  // Stamped when it came, by the kernel, however long it waited in the socket's queue.
  *out = (can_received){.frame = item->frame, .software_ns = realtime_ns(NULL) - (played_now_ns() - due_ns)};
  played_taken(&s->cursor);
  return 1;
}

static void close_socket(void *context, int number) {
  (void)context;
  played_close(&sockets[number - SOCKET_FIRST].cursor);
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
