// SPDX-License-Identifier: Apache-2.0
#include "fake_can.h"

#include <errno.h>
#include <string.h>

void fake_can_init(fake_can *self, fake_step *steps) {
  *self = (fake_can){.now_ns = FAKE_BOOT_NS, .utc_offset_ns = FAKE_UTC_NS, .steps = steps, .index = 3, .is_up = 1};
}

can_received fake_frame(wm_time_ns at_ns, uint16_t speed) {
  can_received r = {.software_ns = at_ns + FAKE_UTC_NS};
  r.frame.id = 0x100;
  r.frame.length = 2;
  r.frame.data[0] = (uint8_t)(speed & 0xff);
  r.frame.data[1] = (uint8_t)(speed >> 8);
  return r;
}

can_received fake_error_frame(wm_time_ns at_ns, uint32_t id, uint8_t controller) {
  can_received r = fake_frame(at_ns, 0);
  r.frame.id = id;
  r.frame.is_error = 1;
  r.frame.length = 8;
  r.frame.data[1] = controller;
  return r;
}

// Steps that change the interface happen by themselves, whoever waits.
static void let_happen(fake_can *self) {
  for (; self->steps[self->next].at_ns <= self->now_ns; self->next++) {
    switch (self->steps[self->next].what) {
      case FAKE_DOWN: self->is_up = 0; break;
      case FAKE_UP: self->is_up = 1; break;
      case FAKE_REMOVED: self->index = 0; break;
      case FAKE_BACK: self->index = 9; break;
      default: return;
    }
  }
}

static unsigned find(void *context, const char *interface, int *is_up) {
  (void)interface;
  fake_can *self = context;
  let_happen(self);
  *is_up = self->is_up;
  return self->index;
}

static int open_socket(void *context, unsigned index, const wm_can_match *filters, size_t count) {
  (void)filters;
  fake_can *self = context;
  if (index == 0 || index != self->index) return -ENODEV;
  self->is_open = 1;
  self->opened++;
  self->filters = count;
  return 5;
}

static int receive(void *context, int socket, int wait_ms, can_received *out) {
  (void)socket;
  fake_can *self = context;
  wm_time_ns until_ns = self->now_ns + wait_ms * WM_NS_PER_MS;
  let_happen(self);
  fake_step *step = &self->steps[self->next];
  wm_time_ns ready_ns = step->at_ns + self->reads_late_ns;
  if (step->what == FAKE_END || ready_ns > until_ns) {
    self->now_ns = until_ns;
    let_happen(self);
    return 0;
  }
  if (ready_ns > self->now_ns) self->now_ns = ready_ns;
  if (step->what != FAKE_FRAME && step->what != FAKE_FAILS) {
    let_happen(self);
    return 0;
  }
  self->next++;
  if (step->what == FAKE_FAILS) return -step->reason;
  *out = step->received;
  return 1;
}

static void close_socket(void *context, int socket) {
  (void)socket;
  ((fake_can *)context)->is_open = 0;
}

static void sleep_ms(void *context, int ms) { ((fake_can *)context)->now_ns += ms * WM_NS_PER_MS; }
static wm_time_ns monotonic_ns(void *context) { return ((fake_can *)context)->now_ns; }
static wm_time_ns realtime_ns(void *context) {
  return ((fake_can *)context)->now_ns + ((fake_can *)context)->utc_offset_ns;
}

const can_io kFakeCan = {find, open_socket, receive, close_socket, sleep_ms, monotonic_ns, realtime_ns};
