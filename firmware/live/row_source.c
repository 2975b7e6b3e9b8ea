// SPDX-License-Identifier: Apache-2.0
#include "live/row_source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "live/lcm_device.h"
#include "rt/clock.h"
#include "rt/ring.h"

// Without a row for so long the device is silent: longer than the period of the slowest (GNSS, 1 s).
#define SILENT_NS (2 * WM_NS_PER_S)
// Rows of a recorder that is held up by its disk: a quarter of a second at 1 kHz.
#define COPIES 256

typedef struct row_source {
  wm_source base;
  wm_row_device *device;
  const wm_stream *stream;
  wm_row_mountings mountings;
  wm_stream_row row;
  int has_come;         // a usable row since the start
  unsigned state;       // the device's own
  wm_time_ns last_ns;   // stamp of the last event; WM_TIME_NONE before the first
  wm_time_ns heard_ns;  // when the last usable row came, or the device was found
  wm_time_ns taken_ns;  // arrival of the last event
  uint32_t seq;
  atomic_int wants_copies;
  wm_ring copies;
  uint64_t copies_lost;  // of the copies' reader
  _Alignas(8) uint8_t copy_memory[COPIES * sizeof(wm_stream_row)];
} row_source;

static const wm_source_ops kRows;

// 1: *out is the row's event.
static int take(row_source *self, wm_event *out) {
  wm_source_counts *counts = &self->base.counts;
  wm_error err;
  if (self->last_ns != WM_TIME_NONE && self->row.t_ns <= self->last_ns) {
    // Some senders report a measurement several times. A stamp that stands still longer than a period is stuck.
    const int stuck = self->row.arrival_ns - self->taken_ns > SILENT_NS;
    *(self->row.t_ns < self->last_ns ? &counts->out_of_order : stuck ? &counts->frozen : &counts->ignored) += 1;
    return 0;
  }
  const wm_status status = wm_stream_event(self->stream, &self->row, &self->mountings, out, &err);
  if (status != WM_OK) {
    wm_source_refuse(counts, self->device->where, err.text);
    if (status != WM_BAD_DATA) counts->malformed--, counts->not_finite++;
    return 0;
  }
  self->last_ns = self->row.t_ns;
  self->taken_ns = self->row.arrival_ns;
  self->heard_ns = wm_monotonic_ns();
  self->has_come = 1;
  return 1;
}

static void keep_copy(row_source *self) {
  if (!atomic_load_explicit(&self->wants_copies, memory_order_acquire)) return;
  void *slot = wm_ring_reserve(&self->copies, sizeof self->row);
  if (!slot) return;  // counted by the ring
  memcpy(slot, &self->row, sizeof self->row);
  wm_ring_commit(&self->copies);
}

static void note(row_source *self) {
  wm_source_counts *counts = &self->base.counts;
  unsigned state = counts->device;
  if (state == WM_DEVICE_WORKS && self->state != WM_DEVICE_WORKS) self->heard_ns = wm_monotonic_ns();
  self->state = state;
  if (state == WM_DEVICE_WORKS && wm_monotonic_ns() - self->heard_ns > SILENT_NS) state = WM_DEVICE_STALLED;
  counts->device = (uint8_t)self->device->ops->note(self->device, state, self->has_come, counts->device_note,
                                                    sizeof counts->device_note);
}

static wm_status next_event(wm_source *base, wm_event *out, wm_error *err) {
  (void)err;
  row_source *self = (row_source *)base;
  const int has_event = self->device->ops->next(self->device, &self->row, &base->counts) == WM_OK && take(self, out);
  note(self);
  if (!has_event) return WM_AGAIN;
  keep_copy(self);
  out->source = base->index;
  out->seq = self->seq++;
  base->counts.received++;
  return WM_OK;
}

static void close_source(wm_source *base) {
  row_source *self = (row_source *)base;
  self->device->ops->close(self->device);
  free(self);
}

static const wm_source_ops kRows = {next_event, close_source};

wm_status row_source_open(wm_row_device *device, const wm_row_mountings *mountings, wm_source **out, wm_error *err) {
  *out = NULL;
  row_source *self = aligned_alloc(WM_CACHE_LINE, (sizeof *self + WM_CACHE_LINE - 1) / WM_CACHE_LINE * WM_CACHE_LINE);
  if (!self) {
    device->ops->close(device);
    return wm_fail(err, WM_IO, "no memory for a device");
  }
  memset(self, 0, sizeof *self);
  self->device = device;
  self->stream = wm_stream_find(device->stream);
  self->mountings = *mountings;
  self->last_ns = WM_TIME_NONE;
  self->heard_ns = wm_monotonic_ns();
  self->state = WM_DEVICE_WORKS;
  wm_ring_init(&self->copies, self->copy_memory, COPIES, sizeof self->row);
  self->base.ops = &kRows;
  self->base.is_live = self->base.in_order = 1;
  self->base.kinds = wm_stream_kinds(self->stream);
  self->base.is_motion = (self->base.kinds & WM_MOTION_EVENTS) != 0;
  (void)snprintf(self->base.name, sizeof self->base.name, "%s", device->stream);
  *out = &self->base;
  return WM_OK;
}

const wm_stream *row_source_stream(const wm_source *source) {
  return source->ops == &kRows ? ((const row_source *)source)->stream : NULL;
}
const wm_stream_row *row_source_row(const wm_source *source) { return &((const row_source *)source)->row; }
int row_source_is_exclusive(const wm_source *source) { return ((const row_source *)source)->device->is_exclusive; }

int row_source_copy(wm_source *source, wm_stream_row *out, uint64_t *lost) {
  row_source *self = (row_source *)source;
  atomic_store_explicit(&self->wants_copies, 1, memory_order_release);
  const uint64_t dropped = wm_ring_dropped(&self->copies);
  *lost += dropped - self->copies_lost;
  self->copies_lost = dropped;
  const void *front = wm_ring_front(&self->copies);
  if (!front) return 0;
  memcpy(out, front, sizeof *out);
  wm_ring_pop(&self->copies);
  return 1;
}

// ── of a configuration ──────────────────────────────────────────────────────────────────────────────────────────────

static wm_status open_device(const wm_config *config, const wm_site *site, size_t index, wm_row_device **out,
                             wm_error *err) {
  const wm_devices_config *devices = &config->devices;
  if (index < devices->lcm_count)
    return lcm_device_open(&devices->lcm[index], config->lcm_url, config->channel_prefix, NULL, out, err);
  index -= devices->lcm_count;
  if (index < devices->gpsd_count)
    return wm_gpsd_open(&devices->gpsd[index], wm_site_gnss_origin(site), wm_site_rig(site)->antenna_m[0], out, err);
  index -= devices->gpsd_count;
  if (index == 0 && devices->iio.device[0]) return wm_iio_open(&devices->iio, "", out, err);
  return wm_dvl_open(&devices->dvl, out, err);
}

wm_status row_sources_open(const wm_config *config, const wm_site *site, wm_source *out[WM_ROW_DEVICES_MAX],
                           size_t *count, wm_error *err) {
  const size_t wanted = wm_devices_rows(&config->devices);
  wm_status status = WM_OK;
  for (*count = 0; status == WM_OK && *count < wanted;) {
    wm_row_device *device;
    status = open_device(config, site, *count, &device, err);
    if (status == WM_OK) status = row_source_open(device, wm_site_row_mountings(site), &out[*count], err);
    if (status == WM_OK) ++*count;
  }
  while (status != WM_OK && *count > 0) {
    --*count;
    if (out[*count]) out[*count]->ops->close(out[*count]);
  }
  return status;
}
