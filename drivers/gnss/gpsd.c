// SPDX-License-Identifier: Apache-2.0
// Positions and headings of a receiver by gpsd's socket.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "gpsd_report.h"
#include "waymark/devices.h"
#include "waymark/foreign_clock.h"
#include "waymark/line_socket.h"
#include "waymark/local_frame.h"

// UTC of a receiver on a computer whose own clock is set by it, or by a time server: farther off, one of them is wrong.
#define AHEAD_MAX_NS (10 * WM_NS_PER_MS)
#define BEHIND_MAX_NS (10 * WM_NS_PER_S)
// Delay of a receiver beyond the smallest seen and beyond latency_ms: 20 to 100 ms by data sheets and baud rate.
#define DELAY_UNCERTAINTY_NS (50 * WM_NS_PER_MS)
// Sigma of an axis without a stated accuracy, by the fix: usual figures of data sheets.
#define SIGMA_RTK_FIXED_M 0.05
#define SIGMA_RTK_FLOAT_M 0.5
#define SIGMA_DGPS_M 2.0
#define SIGMA_PLAIN_M 5.0
#define UP_SIGMAS 2.0                    // the altitude's sigma in horizontal ones, by the satellites' geometry
#define DEVIATIONS_NS (3 * WM_NS_PER_S)  // receivers send theirs with each position, or once a second
#define VELOCITY_SIGMA_MPS 0.1           // of a receiver's speed over ground, by data sheets
#define TURN_MEAN_S 1.0                  // of the turn rate by courses: they come 1 to 10 times a second
#define DEGREE (M_PI / 180.0)

typedef struct gpsd {
  wm_row_device base;
  wm_gpsd_device_config config;
  double origin[3];
  double ahead_m;                 // of the antenna in base_link; 0 where it is not given
  wm_time_ns course_ns;           // of the newest course; WM_TIME_NONE: none
  double course_rad, turn_radps;  // that course, and the mean turn rate by the courses
  line_socket lines;
  char question[160];  // asks for reports, once connected
  foreign_clock receiver;
  int fix;                             // gpsd_fix; -1: none
  int is_stored;                       // what a receiver for time reports is a stored place
  wm_time_ns taken_ns;                 // UTC of the last row; WM_TIME_NONE: none
  wm_time_ns deviations_ns;            // when the receiver's own sigmas came; WM_TIME_NONE: none
  double deviation_m, deviation_up_m;  // of an axis, and of the altitude
  char gone[100];                      // why there is no fix
} gpsd;

static wm_time_ns clock_ns(clockid_t clock) {
  struct timespec now;
  (void)clock_gettime(clock, &now);
  return (wm_time_ns)now.tv_sec * WM_NS_PER_S + now.tv_nsec;
}

// Of a connection that has ended.
static void forget(gpsd *self) {
  self->fix = -1;
  self->is_stored = 0;
  self->deviations_ns = self->taken_ns = self->course_ns = WM_TIME_NONE;
  self->gone[0] = '\0';
}

// ── reports ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static void set_fix(gpsd *self, int fix, const char *why, wm_source_counts *counts) {
  if (fix != self->fix) {
    counts->news++;
    // Those that came before the first report of a fix are of the same fix.
    if (self->fix >= 0) self->deviations_ns = WM_TIME_NONE;
  }
  self->fix = fix;
  (void)snprintf(self->gone, sizeof self->gone, "%s", why);
}

// The row's stamp. NULL, or the fault.
static const char *stamp(gpsd *self, wm_time_ns utc_ns, wm_stream_row *out, wm_source_counts *counts) {
  const wm_time_ns latency_ns = (wm_time_ns)(self->config.latency_ms * 1e6);
  counts->stamp_uncertainty_ns = DELAY_UNCERTAINTY_NS;
  out->t_ns = out->arrival_ns - latency_ns;
  if (utc_ns == WM_TIME_NONE) return NULL;
  if (self->config.clock == WM_GPSD_CLOCK_RECEIVER) {
    out->t_ns = foreign_clock_map(&self->receiver, utc_ns, out->arrival_ns, latency_ns);
    counts->stamp_uncertainty_ns += foreign_clock_uncertainty(&self->receiver);
    return NULL;
  }
  const wm_time_ns now_utc_ns = clock_ns(CLOCK_REALTIME);
  if (utc_ns > now_utc_ns + AHEAD_MAX_NS || utc_ns < now_utc_ns - BEHIND_MAX_NS)
    return "the receiver's UTC and this computer's clock are apart: set the clock (chrony), or `clock: receiver`";
  out->t_ns = utc_ns - (now_utc_ns - clock_ns(CLOCK_MONOTONIC));
  counts->stamp_uncertainty_ns = AHEAD_MAX_NS;
  return NULL;
}

// Standard deviations of the receiver's own (NMEA GST), of the same type of fix; gpsd's estimates come from the
// satellites' geometry alone.
static int has_deviations(const gpsd *self, wm_time_ns now_ns) {
  return self->deviations_ns != WM_TIME_NONE && now_ns - self->deviations_ns < DEVIATIONS_NS;
}

// `accuracy_scale` is for gpsd's estimates: what the receiver states, and the usual figures, are sigmas already.
static double sigma_of(const gpsd *self, const gpsd_report *report, wm_time_ns now_ns) {
  const double scale = self->config.accuracy_scale;
  if (has_deviations(self, now_ns)) return self->deviation_m;
  // gpsd's estimates are without RTK: 19 m times the dilution of precision (H_UERE_NO_DGPS of gpsd 3.22).
  const double most_m = report->status == GPSD_FIX_RTK_FIXED   ? SIGMA_RTK_FIXED_M
                        : report->status == GPSD_FIX_RTK_FLOAT ? SIGMA_RTK_FLOAT_M
                                                               : HUGE_VAL;
  if (report->east_m > 0.0 && report->north_m > 0.0)
    return fmin(scale * hypot(report->east_m, report->north_m) / M_SQRT2, most_m);
  if (report->across_m > 0.0) return fmin(scale * report->across_m, most_m);
  if (most_m < HUGE_VAL) return most_m;
  return report->status == GPSD_FIX_DGPS ? SIGMA_DGPS_M : SIGMA_PLAIN_M;
}

// Its altitude where the report has none: that of the origin, and the row's is empty.
static void position(const gpsd *self, const gpsd_report *report, wm_stream_row *out) {
  const int has_altitude = report->mode >= 3.0 && isfinite(report->ellipsoid_m);
  const double place[3] = {report->latitude_deg, report->longitude_deg,
                           has_altitude ? report->ellipsoid_m : self->origin[2]};
  local_frame(self->origin, place, out->number);
  const double sigma_m = sigma_of(self, report, out->arrival_ns);
  const double stated_m =
      has_deviations(self, out->arrival_ns) ? self->deviation_up_m : self->config.accuracy_scale * report->up_m;
  const double up_m = stated_m > 0.0 ? stated_m : UP_SIGMAS * sigma_m;
  if (!has_altitude) out->number[2] = (double)NAN;
  out->number[3] = sigma_m;
  out->number[4] = has_altitude ? up_m : (double)NAN;
}

static void watch_turn(gpsd *self, double course_rad, wm_time_ns t_ns) {
  const double dt_s = self->course_ns == WM_TIME_NONE ? HUGE_VAL : wm_seconds_between(self->course_ns, t_ns);
  if (dt_s > 0.0 && dt_s <= 2.0 * TURN_MEAN_S) {
    const double rate_radps = remainder(course_rad - self->course_rad, 2.0 * M_PI) / dt_s;
    self->turn_radps += (rate_radps - self->turn_radps) * fmin(dt_s / TURN_MEAN_S, 1.0);
  } else if (dt_s != 0.0) {
    self->turn_radps = 0.0;
  }
  self->course_ns = t_ns;
  self->course_rad = course_rad;
}

// A heading in the map, whose x axis points east. The course is the antenna's. One that is x ahead of base_link moves
// to the side by w x in a turn, so that sin(course - heading) = w x / speed.
static int course(gpsd *self, const gpsd_report *report, wm_stream_row *out) {
  if (!(report->speed_mps >= self->config.course_min_mps) || isnan(report->track_deg)) return 0;
  const double course_rad = M_PI_2 - report->track_deg * DEGREE, lever_s = self->ahead_m / report->speed_mps;
  const double sigma_rad = report->track_error_deg > 0.0
                               ? self->config.accuracy_scale * report->track_error_deg * DEGREE
                               : atan2(VELOCITY_SIGMA_MPS, report->speed_mps);
  watch_turn(self, course_rad, report->time_ns != WM_TIME_NONE ? report->time_ns : out->arrival_ns);
  out->number[0] = course_rad - asin(fmax(-1.0, fmin(lever_s * self->turn_radps, 1.0)));
  out->number[1] = sigma_rad * hypot(1.0, lever_s / TURN_MEAN_S);
  return 1;
}

static int by_antennas(const gpsd *self, const gpsd_report *report, wm_stream_row *out) {
  if (isnan(report->heading_deg)) return 0;
  out->number[0] = M_PI_2 - report->heading_deg * DEGREE;
  out->number[1] = self->config.sigma_deg * DEGREE;
  return 1;
}

static int has_place(const gpsd_report *report) {
  if (!(report->mode >= 2.0)) return 0;
  if (!(fabs(report->latitude_deg) < 90.0) || !(fabs(report->longitude_deg) <= 180.0)) return 0;
  return report->latitude_deg != 0.0 || report->longitude_deg != 0.0;  // what a receiver without a fix may give
}

static void take_deviations(gpsd *self, const gpsd_report *report) {
  const double sigma_m = hypot(report->latitude_deg, report->longitude_deg) / M_SQRT2;
  if (!(sigma_m > 0.0)) return;
  self->deviation_m = sigma_m;
  self->deviation_up_m = report->alt_m;
  self->deviations_ns = self->lines.read_ns;
}

// 1: the row has its numbers.
static int take(gpsd *self, const gpsd_report *report, wm_stream_row *out, wm_source_counts *counts) {
  if (report->kind == GPSD_ERROR) {
    set_fix(self, -1, report->message[0] ? report->message : "it reports an error", counts);
    return 0;
  }
  if (report->kind == GPSD_DEVICE && report->activated == 0.0) {
    set_fix(self, -1, "its receiver was unplugged", counts);
    return 0;
  }
  if (report->kind == GPSD_GST) take_deviations(self, report);
  if (report->kind == GPSD_ATT && self->config.from == WM_GPSD_ANTENNAS) {
    const int is_there = by_antennas(self, report, out);
    set_fix(self, is_there ? GPSD_FIX_UNKNOWN : -1, "its receiver gives no heading", counts);
    return is_there;
  }
  if (report->kind != GPSD_TPV || self->config.from == WM_GPSD_ANTENNAS) return 0;
  if (!has_place(report)) {
    set_fix(self, -1, "its receiver has no fix: too few satellites are seen", counts);
    counts->ignored++;
    return 0;
  }
  if (report->status > GPSD_FIX_UNKNOWN) self->is_stored = report->status == GPSD_FIX_TIME;
  if (self->is_stored) {
    set_fix(self, -1, "its receiver is one for time and reports a stored place", counts);
    counts->ignored++;
    return 0;
  }
  // Several sentences of a receiver make several reports of one epoch: the follower of its clock may move between them.
  if (report->time_ns != WM_TIME_NONE && report->time_ns == self->taken_ns) {
    counts->ignored++;
    return 0;
  }
  set_fix(self, report->status >= 0.0 && report->status < GPSD_FIX_COUNT ? (int)report->status : GPSD_FIX_UNKNOWN, "",
          counts);
  if (self->config.from == WM_GPSD_COURSE) return course(self, report, out);
  position(self, report, out);
  return 1;
}

static wm_status next_row(wm_row_device *base, wm_stream_row *out, wm_source_counts *counts) {
  gpsd *self = (gpsd *)base;
  gpsd_report report;
  size_t length;
  wm_status status = WM_AGAIN;
  const char *line = line_socket_read(&self->lines, &length);
  if (!self->lines.is_connected) forget(self);
  while (line && status == WM_AGAIN) {
    const char *why = gpsd_report_read(line, length, &report);
    out->arrival_ns = self->lines.read_ns;
    if (!why && take(self, &report, out, counts)) {
      why = stamp(self, report.time_ns, out, counts);
      self->taken_ns = report.time_ns;
      if (!why) status = WM_OK;
    }
    if (why) wm_source_refuse(counts, base->where, why);
    if (status == WM_AGAIN) line = line_socket_next(&self->lines, &length);
  }
  const char *fault = line_socket_fault(&self->lines);
  if (fault) wm_source_refuse(counts, base->where, fault);
  counts->device = !self->lines.is_connected ? WM_DEVICE_ABSENT : self->gone[0] ? WM_DEVICE_DOWN : WM_DEVICE_WORKS;
  return status;
}

static unsigned note(const wm_row_device *base, unsigned state, int has_come, char *text, size_t room) {
  const gpsd *self = (const gpsd *)base;
  if (state == WM_DEVICE_ABSENT)
    (void)snprintf(text, room, "no gpsd answers at %s: does it run? (systemctl status gpsd)", base->where);
  else if (state == WM_DEVICE_DOWN)
    (void)snprintf(text, room, "gpsd at %s: %s", base->where, self->gone);
  else if (state == WM_DEVICE_STALLED)
    (void)snprintf(text, room, "gpsd at %s gives no %s: is its receiver plugged in? (`gpspipe -w` shows reports)",
                   base->where, base->stream);
  else if (has_come && self->fix >= 0)
    (void)snprintf(text, room, "gpsd at %s: %s", base->where, gpsd_fix_name(self->fix));
  else
    (void)snprintf(text, room, "connected to gpsd at %s", base->where);
  return state;
}

static void close_gpsd(wm_row_device *base) {
  line_socket_close(&((gpsd *)base)->lines);
  free(base);
}

static const wm_row_device_ops kGpsd = {next_row, note, close_gpsd};

wm_status wm_gpsd_open(const wm_gpsd_device_config *config, const double origin[3], double ahead_m, wm_row_device **out,
                       wm_error *err) {
  *out = NULL;
  if (config->from == WM_GPSD_POSITION && isnan(origin[0] + origin[1] + origin[2]))
    return wm_fail(err, WM_BAD_CONFIG,
                   "devices.gpsd: calibration.yaml has no `gnss: {origin: [LATITUDE, LONGITUDE, ALTITUDE]}` (degrees, "
                   "metres above the ellipsoid): the place of the map's zero is needed");
  gpsd *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for gpsd's reports");
  self->config = *config;
  memcpy(self->origin, origin, sizeof self->origin);
  self->ahead_m = isnan(ahead_m) ? 0.0 : ahead_m;
  (void)snprintf(self->question, sizeof self->question, "?WATCH={\"enable\":true,\"json\":true%s%s%s};\n",
                 config->device[0] ? ",\"device\":\"" : "", config->device, config->device[0] ? "\"" : "");
  line_socket_init(&self->lines, config->host, config->port, self->question);
  forget(self);
  self->base.ops = &kGpsd;
  (void)snprintf(self->base.stream, sizeof self->base.stream, "%s", wm_gpsd_stream(config));
  (void)snprintf(self->base.where, sizeof self->base.where, "%.50s:%d", config->host, (int)config->port);
  *out = &self->base;
  return WM_OK;
}
