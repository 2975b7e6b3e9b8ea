// SPDX-License-Identifier: Apache-2.0
// Velocities of a Doppler log over TCP.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "dvl_report.h"
#include "waymark/devices.h"
#include "waymark/foreign_clock.h"
#include "waymark/line_socket.h"

#define NS_PER_US 1000
// From the echo to the sending: the way back of the sound and computing, 0.2 s; more is a clock that was set between.
#define TRANSIT_MOST_NS (2 * WM_NS_PER_S)
#define TRANSIT_NS (200 * WM_NS_PER_MS)
// From the sending to the arrival, which the smallest delay does not show [WaterLinkedND].
#define NETWORK_NS (4 * WM_NS_PER_MS)
// Resolution of a velocity by the A50's data sheet: no figure of merit is better.
#define RESOLUTION_MPS 1e-4

typedef struct dvl {
  wm_row_device base;
  line_socket lines;
  foreign_clock clock;
  dvl_report last;              // the newest velocity, valid or not
  int has_last;                 // since the connection
  uint64_t skipped[DVL_KINDS];  // reports that are no measurement, by kind; of velocities those without bottom lock
} dvl;

// Numbers that a report lacks are alike, too.
static int is_alike(double a, double b) { return a == b || (isnan(a) && isnan(b)); }

// A log that is polled, or two of its threads, send a report several times.
static int is_repeat(const dvl *self, const dvl_report *report) {
  const dvl_report *last = &self->last;
  if (!self->has_last) return 0;
  if (report->validity_us != DVL_NO_TIME) return report->validity_us == last->validity_us;
  int is_same = report->is_valid == last->is_valid && is_alike(report->since_ms, last->since_ms) &&
                is_alike(report->sigma_mps, last->sigma_mps);
  for (int i = 0; i < 3; i++) is_same = is_same && is_alike(report->v_mps[i], last->v_mps[i]);
  return is_same;
}

// The row's stamp: that of the echo. Its clock is followed by the stamps of sending, which have the shortest delay.
// NULL, or the fault.
static const char *stamp(dvl *self, const dvl_report *report, wm_stream_row *out, wm_source_counts *counts) {
  const int64_t sent_us = report->transmission_us != DVL_NO_TIME ? report->transmission_us : report->validity_us;
  out->t_ns = out->arrival_ns;
  counts->stamp_uncertainty_ns = TRANSIT_NS;
  if (report->validity_us == DVL_NO_TIME) return NULL;  // json_v1 and json_v2
  const wm_time_ns transit_ns = (sent_us - report->validity_us) * NS_PER_US;
  if (transit_ns < 0 || transit_ns > TRANSIT_MOST_NS)
    return "time_of_transmission is not within 2 s behind time_of_validity: was the log's clock set?";
  out->t_ns = foreign_clock_map(&self->clock, sent_us * NS_PER_US, out->arrival_ns, 0) - transit_ns;
  counts->stamp_uncertainty_ns = NETWORK_NS + foreign_clock_uncertainty(&self->clock);
  return NULL;
}

// 1: the row is a measurement.
static int take(dvl *self, const dvl_report *report, wm_stream_row *out, wm_source_counts *counts) {
  int is_measured = 0;
  if (report->kind != DVL_VELOCITY) {
    self->skipped[report->kind]++;
  } else if (!is_repeat(self, report)) {
    counts->news += self->has_last && report->is_hot != self->last.is_hot;
    self->last = *report;
    self->has_last = 1;
    self->skipped[DVL_VELOCITY] += (uint64_t)!report->is_valid;
    is_measured = report->is_valid;
  }
  counts->ignored += (uint64_t)!is_measured;
  if (!is_measured) return 0;
  for (int i = 0; i < WM_STREAM_NUMBERS_MAX; i++) out->number[i] = (double)NAN;
  out->number[0] = report->v_mps[0];
  out->number[1] = -report->v_mps[1];
  out->number[2] = -report->v_mps[2];
  out->number[6] = fmax(report->sigma_mps, RESOLUTION_MPS);
  return 1;
}

static wm_status next_row(wm_row_device *base, wm_stream_row *out, wm_source_counts *counts) {
  dvl *self = (dvl *)base;
  dvl_report report;
  size_t length;
  wm_status status = WM_AGAIN;
  const char *line = line_socket_read(&self->lines, &length);
  while (line && status == WM_AGAIN) {
    const char *why = dvl_report_read(line, length, &report);
    out->arrival_ns = self->lines.read_ns;
    if (!why && take(self, &report, out, counts)) {
      why = stamp(self, &report, out, counts);
      if (!why) status = WM_OK;
    }
    if (why) wm_source_refuse(counts, base->where, why);
    if (status == WM_AGAIN) line = line_socket_next(&self->lines, &length);
  }
  const char *fault = line_socket_fault(&self->lines);
  if (fault) wm_source_refuse(counts, base->where, fault);
  if (!self->lines.is_connected) self->has_last = 0;
  counts->device = self->lines.is_connected ? WM_DEVICE_WORKS : WM_DEVICE_ABSENT;
  return status;
}

static unsigned note(const wm_row_device *base, unsigned state, int has_come, char *text, size_t room) {
  const dvl *self = (const dvl *)base;
  const uint64_t *n = self->skipped;
  if (state == WM_DEVICE_ABSENT) {
    (void)snprintf(text, room, "no velocity log answers at %s: has it power, and is that its address?", base->where);
  } else if (state == WM_DEVICE_STALLED && self->has_last && !self->last.is_valid) {
    (void)snprintf(text, room, "the velocity log at %s has no lock on the bottom: too near, too far, or out of water",
                   base->where);
    return WM_DEVICE_DOWN;
  } else if (state == WM_DEVICE_STALLED) {
    (void)snprintf(text, room, "the velocity log at %s sends no velocity over ground: is acoustic_enabled on?",
                   base->where);
  } else if (!has_come) {
    (void)snprintf(text, room, "connected to the velocity log at %s", base->where);
  } else {
    (void)snprintf(text, room, "%.60s%s; not taken: %llu without bottom lock, %llu velocity_water, %llu position_local",
                   base->where, self->last.is_hot ? " is hot and will switch off" : "",
                   (unsigned long long)n[DVL_VELOCITY], (unsigned long long)n[DVL_WATER],
                   (unsigned long long)n[DVL_POSITION]);
  }
  return state;
}

static void close_dvl(wm_row_device *base) {
  line_socket_close(&((dvl *)base)->lines);
  free(base);
}

static const wm_row_device_ops kDvl = {next_row, note, close_dvl};

wm_status wm_dvl_open(const wm_dvl_device_config *config, wm_row_device **out, wm_error *err) {
  *out = NULL;
  dvl *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for a velocity log");
  line_socket_init(&self->lines, config->host, config->port, NULL);
  self->base.ops = &kDvl;
  self->base.is_exclusive = 1;  // how many connections a log serves is not documented
  (void)snprintf(self->base.stream, sizeof self->base.stream, "motion6");
  (void)snprintf(self->base.where, sizeof self->base.where, "%.50s:%d", config->host, (int)config->port);
  *out = &self->base;
  return WM_OK;
}
