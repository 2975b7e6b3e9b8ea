// SPDX-License-Identifier: Apache-2.0
#include "can_device.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "can_clock.h"
#include "waymark/devices.h"

#define FILTERS_MAX WM_CAN_COUNT            // a bound message has one quantity at least
#define LOOK_EVERY_NS (500 * WM_NS_PER_MS)  // for an absent interface, or another one by the same name

typedef struct can_device {
  wm_source base;
  char interface[WM_CAN_IFACE_MAX];
  wm_can_decoder *decoder;
  wm_can_match filters[FILTERS_MAX];
  size_t filter_count;
  const can_io *io;
  void *io_context;
  int socket;  // -1: not open
  unsigned interface_index;
  wm_time_ns next_look_ns;
  can_clock clock;
  uint32_t queue_dropped;
  uint32_t seq;
  wm_can_gnss gnss;
} can_device;

static void set_state(can_device *self, wm_device_state state, const char *note) {
  wm_source_counts *counts = &self->base.counts;
  if (counts->device == state) return;
  counts->device = (uint8_t)state;
  (void)snprintf(counts->device_note, sizeof counts->device_note, "%s %s", self->interface, note);
}

// ── the interface comes and goes ────────────────────────────────────────────────────────────────────────────────────

static void drop_socket(can_device *self) {
  if (self->socket >= 0) self->io->close(self->io_context, self->socket);
  self->socket = -1;
  self->queue_dropped = 0;
}

// An interface that was open is no longer there: found by its socket, or by looking.
static void lose_it(can_device *self, int reason) {
  char note[120];
  drop_socket(self);
  (void)snprintf(note, sizeof note, "is gone (%s); looking for it", strerror(reason));
  set_state(self, WM_DEVICE_ABSENT, note);
}

static void refused(can_device *self, int reason) {
  char note[120];
  (void)snprintf(note, sizeof note, "can't be opened: %s; trying again", strerror(reason));
  set_state(self, WM_DEVICE_ABSENT, note);
}

static void open_it(can_device *self, unsigned index) {
  int fd = self->io->open(self->io_context, index, self->filters, self->filter_count);
  if (fd < 0) {
    refused(self, -fd);
    return;
  }
  self->socket = fd;
  self->interface_index = index;
}

// A replugged adapter has the same name and another index; the old socket would wait forever.
static void look_for_interface(can_device *self, wm_time_ns now_ns) {
  if (now_ns < self->next_look_ns) return;
  self->next_look_ns = now_ns + LOOK_EVERY_NS;
  int is_up = 0;
  unsigned index = self->io->find(self->io_context, self->interface, &is_up);
  if (self->socket >= 0 && index == 0) {
    lose_it(self, ENODEV);
    return;
  }
  if (self->socket >= 0 && index != self->interface_index) drop_socket(self);
  if (index == 0) {
    set_state(self, WM_DEVICE_ABSENT, "is not there (adapter unplugged, or its driver not loaded); looking for it");
    return;
  }
  if (self->socket < 0) open_it(self, index);
  if (self->socket < 0) return;
  int was_away = self->base.counts.device == WM_DEVICE_ABSENT || self->base.counts.device == WM_DEVICE_DOWN;
  if (!is_up) {
    set_state(self, WM_DEVICE_DOWN, "is down (`ip link set ... up type can bitrate ...`); waiting");
  } else if (was_away || self->base.counts.device == WM_DEVICE_NONE) {
    set_state(self, WM_DEVICE_WORKS, "is up");
  }
}

static void take_failure(can_device *self, int reason) {
  if (reason == ENETDOWN)  // the same socket receives again once it is up
    set_state(self, WM_DEVICE_DOWN, "went down; waiting for it");
  else
    lose_it(self, reason);
}

// ── frames ──────────────────────────────────────────────────────────────────────────────────────────────────────────

static void count_queue(can_device *self, const can_received *received) {
  if (!received->has_queue_dropped) return;
  self->base.counts.overflows += (uint32_t)(received->queue_dropped - self->queue_dropped);
  self->queue_dropped = received->queue_dropped;
}

// Stamps and counts a frame; an error frame changes the state. *when_ns: time of reading.
static void look_at_frame(can_device *self, can_received *received, wm_time_ns *when_ns) {
  wm_source_counts *counts = &self->base.counts;
  wm_can_frame *frame = &received->frame;
  wm_time_ns arrival_ns = self->io->monotonic_ns(self->io_context);
  *when_ns = arrival_ns;
  frame->t_ns = can_clock_stamp(&self->clock, received, arrival_ns, self->io->realtime_ns(self->io_context));
  counts->stamp_uncertainty_ns = self->clock.uncertainty_ns;
  (void)snprintf(frame->iface, sizeof frame->iface, "%s", self->interface);
  count_queue(self, received);
  if (frame->is_error) {
    can_error_take(frame, self->interface, counts);
  } else if (counts->device != WM_DEVICE_PASSIVE) {
    set_state(self, WM_DEVICE_WORKS, "receives again");
  }
}

// 1: an event.
static int take_frame(can_device *self, const wm_can_frame *frame, wm_time_ns arrival_ns, wm_event *out) {
  wm_source_counts *counts = &self->base.counts;
  wm_error why = {0};
  if (frame->is_error) return 0;
  const wm_can_part part = self->base.is_motion ? WM_CAN_MOTION : WM_CAN_GNSS;
  wm_status status = wm_can_event(self->decoder, part, &self->gnss, frame, out, counts, &why);
  if (status == WM_BAD_DATA && !counts->first_problem[0])
    (void)snprintf(counts->first_problem, sizeof counts->first_problem, "%.255s", why.text);
  if (status != WM_OK) return 0;
  out->source = self->base.index;
  out->arrival_ns = arrival_ns;
  out->seq = self->seq++;
  counts->received++;
  return 1;
}

// The next frame of any kind; WM_AGAIN without one until `end_ns`.
static wm_status next_frame(can_device *self, wm_time_ns end_ns, can_received *received, wm_time_ns *arrival_ns) {
  wm_time_ns now_ns = self->io->monotonic_ns(self->io_context);
  if (now_ns >= end_ns) return WM_AGAIN;
  look_for_interface(self, now_ns);
  if (self->socket < 0) {
    self->io->sleep_ms(self->io_context, WM_DEVICE_WAIT_MS);
    return WM_AGAIN;
  }
  int got = self->io->receive(self->io_context, self->socket, WM_DEVICE_WAIT_MS, received);
  if (got < 0) {
    take_failure(self, -got);
    self->io->sleep_ms(self->io_context, 10);  // a socket that only fails must not spin
  }
  if (got <= 0) return WM_AGAIN;
  look_at_frame(self, received, arrival_ns);
  return WM_OK;
}

static wm_time_ns until(const can_device *self) {
  return self->io->monotonic_ns(self->io_context) + WM_DEVICE_WAIT_MS * WM_NS_PER_MS;
}

static wm_status next_quantities(wm_source *base, wm_event *out, wm_error *err) {
  (void)err;
  can_device *self = (can_device *)base;
  can_received received;
  wm_time_ns arrival_ns = 0, end_ns = until(self);
  wm_status status;
  while ((status = next_frame(self, end_ns, &received, &arrival_ns)) == WM_OK) {
    if (take_frame(self, &received.frame, arrival_ns, out)) return WM_OK;
    if (received.frame.is_error) return WM_AGAIN;  // so that each change of the controller is reported
  }
  return status;
}

static void close_device(wm_source *base) {
  can_device *self = (can_device *)base;
  drop_socket(self);
  wm_can_decoder_free(self->decoder);
  free(self);
}

static const wm_source_ops kCanDevice = {next_quantities, close_device};

wm_status can_device_make(const char *interface, wm_can_decoder *decoder, const can_io *io, void *io_context,
                          wm_source **out, wm_error *err) {
  *out = NULL;
  can_device *self = calloc(1, sizeof *self);
  if (!self) {
    wm_can_decoder_free(decoder);
    return wm_fail(err, WM_IO, "%s: no memory to open it", interface);
  }
  self->base.ops = &kCanDevice;
  self->base.is_motion = self->base.is_live = self->base.in_order = self->base.is_bus = 1;
  self->base.kinds = WM_EVENT_BIT(WM_EVENT_QUANTITIES);
  self->decoder = decoder;
  self->io = io;
  self->io_context = io_context;
  self->socket = -1;
  (void)snprintf(self->base.name, sizeof self->base.name, "can");
  (void)snprintf(self->interface, sizeof self->interface, "%s", interface);
  if (decoder) self->filter_count = wm_can_decoder_matches(decoder, self->filters, FILTERS_MAX);
  *out = &self->base;
  return WM_OK;
}

void can_device_gives_positions(wm_source *device, const double gnss_origin[3]) {
  device->is_motion = 0;
  device->kinds = WM_EVENT_BIT(WM_EVENT_POSITION);
  (void)snprintf(device->name, sizeof device->name, "can-gnss");
  wm_can_gnss_init(&((can_device *)device)->gnss, gnss_origin);
}

// ── all frames, as they are ─────────────────────────────────────────────────────────────────────────────────────────

wm_status wm_can_listener_open(const char *interface, wm_can_listener **out, wm_error *err) {
  wm_source *source;
  wm_status status = can_device_make(interface, NULL, &kSocketCan, NULL, &source, err);
  *out = (wm_can_listener *)source;
  return status;
}

wm_status wm_can_listener_next(wm_can_listener *self, wm_can_frame *out, wm_error *err) {
  (void)err;
  can_device *device = (can_device *)self;
  can_received received;
  wm_time_ns arrival_ns;
  wm_status status = next_frame(device, until(device), &received, &arrival_ns);
  if (status == WM_OK) *out = received.frame;
  return status;
}

const wm_source_counts *wm_can_listener_counted(const wm_can_listener *self) {
  return &((const can_device *)self)->base.counts;
}

void wm_can_listener_close(wm_can_listener *self) {
  if (self) close_device((wm_source *)self);
}
