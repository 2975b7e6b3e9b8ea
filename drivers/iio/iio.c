// SPDX-License-Identifier: Apache-2.0
// An IMU by the buffer of an IIO device.
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "iio_setup.h"
#include "waymark/foreign_clock.h"

#define TRY_AGAIN_NS (500 * WM_NS_PER_MS)
#define OLDEST_NS (2 * WM_NS_PER_S)                // longer than any scan waits in the buffer
#define STAMP_UNCERTAINTY_NS (250 * WM_NS_PER_US)  // interrupt to stamp, with threaded interrupts
#define CLOCK_STEP_NS (100 * WM_NS_PER_US)         // two clocks read one after the other differ by less
#define TEMPERATURE_UNIT 1e-3                      // sysfs has thousandths of a degree

typedef struct iio {
  wm_row_device base;
  wm_iio_device_config config;
  iio_setup setup;
  const char *root;
  int fd;
  uint8_t bytes[IIO_SCAN_BYTES_MAX * 4];
  size_t used, taken;  // bytes read, and those of them that are handed out
  wm_time_ns next_try_ns, read_ns;
  wm_time_ns offset_ns;  // of the stamps' clock to the monotonic one
  foreign_clock clock;   // of stamps that are of no clock of this computer
  unsigned state;        // wm_device_state
  char fault[160];
} iio;

static wm_time_ns clock_ns(clockid_t clock) {
  struct timespec now;
  (void)clock_gettime(clock, &now);
  return (wm_time_ns)now.tv_sec * WM_NS_PER_S + now.tv_nsec;
}

static void leave(iio *self, unsigned state) {
  if (self->fd >= 0) (void)close(self->fd);
  self->fd = -1;
  self->used = self->taken = 0;
  self->state = state;
}

static void try_open(iio *self, wm_time_ns now_ns) {
  char path[200];
  if (now_ns < self->next_try_ns) return;
  self->next_try_ns = now_ns + TRY_AGAIN_NS;
  if (iio_setup_read(&self->config, self->root, 1, &self->setup, self->fault, sizeof self->fault)) {
    self->state = self->setup.is_there ? WM_DEVICE_DOWN : WM_DEVICE_ABSENT;
    return;
  }
  (void)snprintf(path, sizeof path, "%s/dev/%s", self->root, self->setup.name);
  self->fd = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  self->state = self->fd >= 0 ? WM_DEVICE_WORKS : WM_DEVICE_DOWN;
  if (self->fd < 0)
    (void)snprintf(self->fault, sizeof self->fault, "%.60s can't be opened: %s%s", path, strerror(errno),
                   errno == EBUSY    ? ": another program reads it"
                   : errno == EACCES ? ": a udev rule gives it to a group (docs/imu-gnss.md)"
                                     : "");
}

static void read_more(iio *self) {
  const size_t scan = self->setup.scan_bytes;
  memmove(self->bytes, self->bytes + self->taken, self->used - self->taken);
  self->used -= self->taken;
  self->taken = 0;
  const size_t whole = (sizeof self->bytes - self->used) / scan * scan;
  const ssize_t got = read(self->fd, self->bytes + self->used, whole - self->used % scan);
  self->read_ns = clock_ns(CLOCK_MONOTONIC);
  if (got > 0) {
    self->used += (size_t)got;
    return;
  }
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
  (void)snprintf(self->fault, sizeof self->fault, "%s: %s", self->setup.name,
                 got == 0 ? "its buffer has ended" : strerror(errno));
  leave(self, WM_DEVICE_ABSENT);
  self->next_try_ns = self->read_ns + TRY_AGAIN_NS;
}

static void wait_for_bytes(iio *self) {
  if (self->fd < 0) try_open(self, clock_ns(CLOCK_MONOTONIC));
  struct pollfd ready = {.fd = self->fd, .events = POLLIN};
  const int count = poll(&ready, 1, WM_DEVICE_WAIT_MS);
  if (count > 0 && self->fd >= 0) read_more(self);
}

// A stamp of the kernel on the monotonic clock: moved by what both clocks are now. One that can't be is of another
// clock (a sensor's own), which is followed.
static wm_time_ns stamp(iio *self, wm_time_ns device_ns, wm_source_counts *counts) {
  wm_time_ns mapped_ns;
  const wm_time_ns now_ns = clock_ns(CLOCK_MONOTONIC), offset_ns = clock_ns(self->setup.clock) - now_ns;
  const wm_time_ns apart_ns = offset_ns - self->offset_ns;
  if (apart_ns > CLOCK_STEP_NS || apart_ns < -CLOCK_STEP_NS) self->offset_ns = offset_ns;
  counts->stamp_uncertainty_ns = STAMP_UNCERTAINTY_NS;
  if (!__builtin_sub_overflow(device_ns, self->offset_ns, &mapped_ns) && mapped_ns < now_ns + WM_NS_PER_MS &&
      mapped_ns > now_ns - OLDEST_NS)
    return mapped_ns < now_ns ? mapped_ns : now_ns;
  mapped_ns = foreign_clock_map(&self->clock, device_ns, self->read_ns, 0);
  counts->stamp_uncertainty_ns += foreign_clock_uncertainty(&self->clock);
  return mapped_ns;
}

static double value(const iio *self, int channel, const uint8_t *scan) {
  const iio_channel *c = &self->setup.channels[channel];
  if (!c->is_there) return (double)NAN;
  return c->scale * ((double)iio_type_raw(&c->element.type, scan + c->element.at) + c->offset);
}

static void to_board(const iio *self, int first, const double matrix[9], const uint8_t *scan, double out[3]) {
  double v[3];
  for (int i = 0; i < 3; i++) v[i] = value(self, first + i, scan);
  for (int i = 0; i < 3; i++) out[i] = matrix[3 * i] * v[0] + matrix[3 * i + 1] * v[1] + matrix[3 * i + 2] * v[2];
}

static void take(iio *self, const uint8_t *scan, wm_stream_row *out, wm_source_counts *counts) {
  const iio_channel *stamps = &self->setup.channels[IIO_TIMESTAMP];
  for (int i = 0; i < WM_STREAM_NUMBERS_MAX; i++) out->number[i] = (double)NAN;
  out->arrival_ns = self->read_ns;
  out->t_ns = stamp(self, iio_type_raw(&stamps->element.type, scan + stamps->element.at), counts);
  to_board(self, IIO_WX, self->setup.gyro_to_board, scan, &out->number[0]);
  to_board(self, IIO_AX, self->setup.acceleration_to_board, scan, &out->number[3]);
  out->number[12] = TEMPERATURE_UNIT * value(self, IIO_TEMPERATURE, scan);
}

static wm_status next_row(wm_row_device *base, wm_stream_row *out, wm_source_counts *counts) {
  iio *self = (iio *)base;
  const int is_open = self->fd >= 0;
  if (!is_open || self->used - self->taken < self->setup.scan_bytes) wait_for_bytes(self);
  counts->device = (uint8_t)self->state;
  if (self->fd < 0 || self->used - self->taken < self->setup.scan_bytes) return WM_AGAIN;
  take(self, self->bytes + self->taken, out, counts);
  self->taken += self->setup.scan_bytes;
  return WM_OK;
}

static unsigned note(const wm_row_device *base, unsigned state, int has_come, char *text, size_t room) {
  const iio *self = (const iio *)base;
  if (state == WM_DEVICE_STALLED)
    (void)snprintf(text, room, "%s (%s) gives no samples: does its trigger or its interrupt fire?", self->setup.name,
                   base->where);
  else if (state != WM_DEVICE_WORKS)
    (void)snprintf(text, room, "%s", self->fault);
  else
    (void)snprintf(text, room, "%s (%s) is %s", self->setup.name, base->where, has_come ? "read" : "open");
  return state;
}

static void close_iio(wm_row_device *base) {
  leave((iio *)base, WM_DEVICE_ABSENT);
  free(base);
}

static const wm_row_device_ops kIio = {next_row, note, close_iio};

wm_status wm_iio_open(const wm_iio_device_config *config, const char *root, wm_row_device **out, wm_error *err) {
  *out = NULL;
  iio *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for an IIO device");
  self->config = *config;
  self->root = root;
  self->fd = -1;
  self->state = WM_DEVICE_ABSENT;
  self->base.ops = &kIio;
  self->base.is_exclusive = 1;
  (void)snprintf(self->base.stream, sizeof self->base.stream, "imu");
  (void)snprintf(self->base.where, sizeof self->base.where, "%s", config->device);
  *out = &self->base;
  return WM_OK;
}
