// SPDX-License-Identifier: Apache-2.0
#include "stream_kinds.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "waymark/event_fields.h"
#include "waymark/streams.h"

// Limits of what is read. Where they are wider than those of events (event_fields.h), a table in another unit is still
// read, and `check` names the unit.
#define SPEED -1000.0, 1000.0
#define RATE -1000.0, 1000.0
#define ACCELERATION -10000.0, 10000.0
#define TEMPERATURE -273.15, 1000.0
#define ANGLE WM_ANGLE_LIMITS
#define PLACE -1e8, 1e8
#define SIGMA WM_SIGMA_LIMITS
#define PIXEL WM_PIXEL_LIMITS
#define VARIANCE 0.0, 1e12
#define COVARIANCE WM_COVARIANCE_LIMITS
#define ANY_ID 0.0, 2147483647.0
#define ID_OR_UNKNOWN -1.0, 2147483647.0

#define STAMPS \
  {"t_ns", CSV_TIME, CSV_NEEDED, 0, 0}, { "arrival_ns", CSV_TIME, CSV_OPTIONAL, 0, 0 }

#define SENSED \
  STAMPS, { "sensor", CSV_NAME, CSV_NEEDED, 0, 0 }
#define NEEDED(name, limits) \
  { name, CSV_NUMBER, CSV_NEEDED, limits }
#define OPTIONAL(name, limits) \
  { name, CSV_NUMBER, CSV_OPTIONAL, limits }

static const char *fill_motion(const fill_context *self, const csv_row *row, wm_event *out) {
  (void)self;
  const double v_mps = row->number[FIRST], vy_mps = row->number[FIRST + 1], w_radps = row->number[FIRST + 2];
  if (isnan(vy_mps)) {
    out->as.twist2 = (wm_twist2){v_mps, w_radps};
    return NULL;
  }
  out->kind = WM_EVENT_TWIST6;
  out->as.twist6 = (wm_twist6){
      .v_mps = {v_mps, vy_mps, 0.0}, .w_radps = {0.0, 0.0, w_radps}, .v_sigma_mps = (double)NAN, .arm_m = {0}};
  return NULL;
}

static double on_axis(const double axis[3], const double v[3]) {
  return axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2];
}

// Number of empty fields from `first` on.
static int count_empty(const csv_row *row, int first, int count) {
  int empty = 0;
  for (int i = 0; i < count; i++) empty += isnan(row->number[first + i]);
  return empty;
}

static const char *fill_motion6(const fill_context *self, const csv_row *row, wm_event *out) {
  const double *v = &row->number[FIRST], *w = v + 3;
  const int empty = count_empty(row, FIRST + 3, 3);
  if (empty != 0 && empty != 3) return "wx_radps, wy_radps and wz_radps: all or none are empty";
  for (int i = 0; i < 3; i++) {
    out->as.twist6.v_mps[i] = on_axis(self->motion6_axes[i], v);
    out->as.twist6.w_radps[i] = on_axis(self->motion6_axes[i], w);
    out->as.twist6.arm_m[i] = self->motion6_arm_m[i];
  }
  out->as.twist6.v_sigma_mps = w[3];
  return NULL;
}

static const char *fill_increment(const fill_context *self, const csv_row *row, wm_event *out) {
  (void)self;
  const double *n = &row->number[FIRST + 1];
  const int empty = count_empty(row, FIRST + 4, 6);
  if (row->whole[FIRST] >= row->whole[T]) return "from_ns is not before t_ns";
  if (empty != 0 && empty != 6) return "a part of the covariance is empty";
  out->as.increment = (wm_increment){.from_ns = row->whole[FIRST], .dx_m = n[0], .dy_m = n[1], .dheading_rad = n[2]};
  memcpy(out->as.increment.covariance, &n[3], sizeof out->as.increment.covariance);
  return NULL;
}

// Into (-pi, pi]; the argument is at most one turn beyond.
static double wrapped(double angle_rad) {
  if (angle_rad > M_PI) return angle_rad - 2.0 * M_PI;
  if (angle_rad <= -M_PI) return angle_rad + 2.0 * M_PI;
  return angle_rad;
}

// Sigmas of bearing and range from the covariance of the position in the sensor's frame; their correlation is dropped.
static const char *polar_sigmas(const csv_row *row, int first, wm_sighting *s) {
  const double *cov = &row->number[first];
  const int empty = count_empty(row, first, 3);
  if (empty == 3) return NULL;
  if (empty > 0) return "a part of the covariance is empty";
  if (isnan(s->bearing_rad) || isnan(s->range_m)) return "a covariance needs both bearing_rad and range_m";
  if (!(cov[0] * cov[2] > cov[1] * cov[1])) return "the covariance is not positive definite";
  const double x = cos(s->bearing_rad), y = sin(s->bearing_rad);
  const double along = x * x * cov[0] + 2.0 * x * y * cov[1] + y * y * cov[2];
  const double across = y * y * cov[0] - 2.0 * x * y * cov[1] + x * x * cov[2];
  if (isnan(s->bearing_sigma_rad)) s->bearing_sigma_rad = sqrt(across) / s->range_m;
  if (isnan(s->range_sigma_m)) s->range_sigma_m = sqrt(along);
  return NULL;
}

// The columns behind a sighting's sensor and identity: its numbers (event_fields.h), then a covariance.
#define SIGHTING_COLUMN(member, need, least, most, limits, since, zero_until, message) \
  {#member, CSV_NUMBER, CSV_##need, least, most},
#define SIGHTING_OFFSET(member, need, least, most, limits, since, zero_until, message) offsetof(wm_sighting, member),

static const char *fill_sighting(const fill_context *self, const csv_row *row, wm_event *out) {
  static const size_t kOffsets[] = {WM_SIGHTING_NUMBERS(SIGHTING_OFFSET)};
  enum { kNumbers = sizeof kOffsets / sizeof kOffsets[0] };
  const int64_t id = row->whole[FIRST + 1];
  const double *n = &row->number[FIRST + 2];
  wm_sighting *s = &out->as.sighting;
  *s = wm_sighting_without_numbers();
  s->sensor = self->sensor_index;
  if (id != WM_TIME_NONE) s->landmark_id = (int32_t)id;
  for (size_t i = 0; i < kNumbers; i++) memcpy((char *)s + kOffsets[i], &n[i], sizeof n[i]);
  if (isnan(s->bearing_rad) && isnan(s->range_m)) return "bearing_rad and range_m are both empty";
  if (isnan(s->elevation_rad) != isnan(s->elevation_sigma_rad))
    return "one of elevation_rad and elevation_sigma_rad is empty";
  s->bearing_rad = wrapped(s->bearing_rad);
  return polar_sigmas(row, FIRST + 2 + kNumbers, s);
}

static const char *fill_marker(const fill_context *self, const csv_row *row, wm_event *out) {
  const double *p = &row->number[FIRST + 2], *other = p + 6;
  wm_marker *m = &out->as.marker;
  *m = (wm_marker){.sensor = self->sensor_index,
                   .id = (int32_t)row->whole[FIRST + 1],
                   .p_m = {p[0], p[1], p[2]},
                   .yaw_rad = wrapped(p[3]),
                   .along_sigma_m = p[4],
                   .yaw_sigma_rad = p[5],
                   .bloom_px = (double)NAN};
  const int empty = count_empty(row, FIRST + 8, 4);
  if (empty == 4) return NULL;
  if (empty > 0) return "one of other_x_m, other_y_m, other_z_m, other_yaw_rad is empty";
  m->poses = 2;
  memcpy(m->other_p_m, other, sizeof m->other_p_m);
  m->other_yaw_rad = wrapped(other[3]);
  return NULL;
}

static const char *fill_corners(const fill_context *self, const csv_row *row, wm_event *out) {
  double px[4][2];
  memcpy(px, &row->number[FIRST + 2], sizeof px);
  out->as.marker = (wm_marker){.sensor = self->sensor_index, .id = (int32_t)row->whole[FIRST + 1]};
  return wm_corner_reader_pose(self->corners, px, row->number[FIRST + 10], &out->as.marker);
}

// 64 hexadecimal digits, the first word's first; nothing: none. False: neither.
static int read_appearance(const csv_row *row, uint64_t out[4]) {
  memset(out, 0, 4 * sizeof out[0]);
  if (row->name_length == 0) return 1;
  if (row->name_length != 64) return 0;
  for (size_t i = 0; i < 64; i++) {
    const char c = row->name[i];
    const int digit = c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
    if (digit < 0) return 0;
    out[i / 16] = out[i / 16] << 4 | (uint64_t)digit;
  }
  return 1;
}

static const char *fill_stereo(const fill_context *self, const csv_row *row, wm_event *out) {
  (void)self;
  const double *px = &row->number[FIRST + 1];
  if (isnan(px[0]) != isnan(px[1]) || isnan(px[2]) != isnan(px[3])) return "one of u and v is empty";
  if (isnan(px[0]) && isnan(px[2])) return "no camera sees the point";
  out->as.stereo = (wm_stereo){.id = (int32_t)row->whole[FIRST], .left_px = {px[0], px[1]}, .right_px = {px[2], px[3]}};
  if (!read_appearance(row, out->as.stereo.appearance)) return "appearance is not 64 hexadecimal digits (0-9, a-f)";
  return NULL;
}

static const char *fill_gnss(const fill_context *self, const csv_row *row, wm_event *out) {
  (void)self;
  const double *n = &row->number[FIRST];
  out->as.position = (wm_position){.p_m = {n[0], n[1], n[2]}, .sigma_xy_m = n[3], .sigma_z_m = n[4]};
  return NULL;
}

static const char *fill_point(const fill_context *self, const csv_row *row, wm_event *out) {
  (void)self;
  wm_points *points = &out->as.points;
  if (points->count >= WM_POINTS_MAX) {
    points->dropped++;
    return NULL;
  }
  points->camera = -1;
  points->normal_rad[points->count] = points->sigma_m[points->count] = NAN;
  points->x_m[points->count] = (float)row->number[FIRST];
  points->y_m[points->count++] = (float)row->number[FIRST + 1];
  return NULL;
}

// Two quantities of one message.
static const char *fill_two(const csv_row *row, wm_quantity first, wm_quantity second, wm_event *out) {
  out->as.quantities = (wm_quantities){.count = 2, .id = {(uint8_t)first, (uint8_t)second}};
  memcpy(out->as.quantities.value, &row->number[FIRST], 2 * sizeof(double));
  return NULL;
}

static const char *fill_ticks(const fill_context *self, const csv_row *row, wm_event *out) {
  (void)self;
  return fill_two(row, WM_Q_WHEEL_TICKS_LEFT, WM_Q_WHEEL_TICKS_RIGHT, out);
}

static const char *fill_speeds(const fill_context *self, const csv_row *row, wm_event *out) {
  (void)self;
  return fill_two(row, WM_Q_WHEEL_SPEED_REAR_LEFT, WM_Q_WHEEL_SPEED_REAR_RIGHT, out);
}

static const char *fill_steering(const fill_context *self, const csv_row *row, wm_event *out) {
  (void)self;
  return fill_two(row, WM_Q_VEHICLE_SPEED, WM_Q_ROAD_WHEEL, out);
}

static const char *fill_heading(const fill_context *self, const csv_row *row, wm_event *out) {
  (void)self;
  out->as.heading = (wm_heading){.heading_rad = wrapped(row->number[FIRST]), .sigma_rad = row->number[FIRST + 1]};
  return NULL;
}

static const char *fill_localizer(const fill_context *self, const csv_row *row, wm_event *out) {
  (void)self;
  const double *n = &row->number[FIRST], *cov = n + 3;
  const int empty = count_empty(row, FIRST + 3, 6);
  if (empty != 0 && empty != 6) return "a part of the covariance is empty";
  if (empty == 0 && !(cov[0] > 0 && cov[2] > 0 && cov[5] > 0 && cov[0] * cov[2] > cov[1] * cov[1]))
    return "the covariance is not positive definite";
  out->as.localized = (wm_localized){.p_m = {n[0], n[1]}, .heading_rad = wrapped(n[2]), .reset = n[9]};
  memcpy(out->as.localized.covariance, cov, sizeof out->as.localized.covariance);
  return NULL;
}

static const char *fill_depth(const fill_context *self, const csv_row *row, wm_event *out) {
  (void)self;
  out->as.position = (wm_position){.p_m = {(double)NAN, (double)NAN, -row->number[FIRST]},
                                   .sigma_xy_m = (double)NAN,
                                   .sigma_z_m = row->number[FIRST + 1]};
  return NULL;
}

static const char *fill_imu(const fill_context *self, const csv_row *row, wm_event *out) {
  static const uint8_t kOrder[] = {WM_Q_YAW_RATE,       WM_Q_ROLL_RATE,      WM_Q_PITCH_RATE,
                                   WM_Q_ACCELERATION_X, WM_Q_ACCELERATION_Y, WM_Q_ACCELERATION_Z};
  static const uint8_t kAxis[] = {2, 0, 1, 0, 1, 2};
  const double *w = &row->number[FIRST], *a = w + 3;
  const int whole = isfinite(a[0]) && isfinite(a[1]) && isfinite(a[2]);
  wm_quantities *q = &out->as.quantities;
  *q = (wm_quantities){.count = whole ? 6 : 3};
  for (uint8_t i = 0; i < q->count; i++) {
    q->id[i] = kOrder[i];
    q->value[i] = on_axis(self->imu_axes[kAxis[i]], i < 3 ? w : a);
  }
  return NULL;
}

const stream_kind kStreamMotion = {
    "motion.csv",          "motion",
    WM_EVENT_TWIST2,       {{STAMPS, NEEDED("v_mps", SPEED), OPTIONAL("vy_mps", SPEED), NEEDED("w_radps", RATE)}},
    .fill = fill_motion,   .also = WM_EVENT_TWIST6,
    .also_with = FIRST + 1};

const stream_kind kStreamMotion6 = {
    "motion6.csv",
    "motion6",
    WM_EVENT_TWIST6,
    {{STAMPS, NEEDED("vx_mps", SPEED), NEEDED("vy_mps", SPEED), NEEDED("vz_mps", SPEED), OPTIONAL("wx_radps", RATE),
      OPTIONAL("wy_radps", RATE), OPTIONAL("wz_radps", RATE), OPTIONAL("sigma_v_mps", SIGMA)}},
    .fill = fill_motion6};

#define TICKS -1e15, 1e15     // doubles still count singly there
#define ROAD_WHEEL -1.5, 1.5  // its tangent is finite; no wheel is turned across
#define BIT(quantity) (UINT32_C(1) << (quantity))

static const stream_kind kStreamTicks = {
    "ticks.csv",         "ticks",
    WM_EVENT_QUANTITIES, {{STAMPS, NEEDED("left", TICKS), NEEDED("right", TICKS)}},
    .fill = fill_ticks,  .quantities = BIT(WM_Q_WHEEL_TICKS_LEFT) | BIT(WM_Q_WHEEL_TICKS_RIGHT)};

static const stream_kind kStreamSpeeds = {
    "speeds.csv",        "speeds",
    WM_EVENT_QUANTITIES, {{STAMPS, NEEDED("left_mps", SPEED), NEEDED("right_mps", SPEED)}},
    .fill = fill_speeds, .quantities = BIT(WM_Q_WHEEL_SPEED_REAR_LEFT) | BIT(WM_Q_WHEEL_SPEED_REAR_RIGHT)};

static const stream_kind kStreamSteering = {
    "steering.csv",        "steering",
    WM_EVENT_QUANTITIES,   {{STAMPS, NEEDED("v_mps", SPEED), NEEDED("road_wheel_rad", ROAD_WHEEL)}},
    .fill = fill_steering, .quantities = BIT(WM_Q_VEHICLE_SPEED) | BIT(WM_Q_ROAD_WHEEL)};

static const stream_kind kStreamHeading = {"heading.csv",
                                           "heading",
                                           WM_EVENT_HEADING,
                                           {{STAMPS, NEEDED("heading_rad", ANGLE), NEEDED("sigma_rad", SIGMA)}},
                                           .fill = fill_heading};

static const stream_kind kStreamLocalizer = {
    "localizer.csv",
    "localizer",
    WM_EVENT_LOCALIZED,
    {{STAMPS, NEEDED("x_m", PLACE), NEEDED("y_m", PLACE), OPTIONAL("heading_rad", ANGLE), OPTIONAL("cov_xx", VARIANCE),
      OPTIONAL("cov_xy", COVARIANCE), OPTIONAL("cov_yy", VARIANCE), OPTIONAL("cov_xt", COVARIANCE),
      OPTIONAL("cov_yt", COVARIANCE), OPTIONAL("cov_tt", VARIANCE), OPTIONAL("reset", PLACE)}},
    .fill = fill_localizer};

static const stream_kind kStreamDepth = {"depth.csv",
                                         "depth",
                                         WM_EVENT_POSITION,
                                         {{STAMPS, NEEDED("depth_m", PLACE), NEEDED("sigma_m", SIGMA)}},
                                         .fill = fill_depth};

const stream_kind kStreamImu = {
    "imu.csv",
    "imu",
    WM_EVENT_QUANTITIES,
    {{STAMPS, NEEDED("wx_radps", RATE), NEEDED("wy_radps", RATE), NEEDED("wz_radps", RATE),
      OPTIONAL("ax_mps2", ACCELERATION), OPTIONAL("ay_mps2", ACCELERATION), OPTIONAL("az_mps2", ACCELERATION),
      OPTIONAL("sigma_wx_radps", SIGMA), OPTIONAL("sigma_wy_radps", SIGMA), OPTIONAL("sigma_wz_radps", SIGMA),
      OPTIONAL("sigma_ax_mps2", SIGMA), OPTIONAL("sigma_ay_mps2", SIGMA), OPTIONAL("sigma_az_mps2", SIGMA),
      OPTIONAL("temperature_c", TEMPERATURE)}},
    .fill = fill_imu,
    .quantities = BIT(WM_Q_YAW_RATE) | BIT(WM_Q_ROLL_RATE) | BIT(WM_Q_PITCH_RATE) | BIT(WM_Q_ACCELERATION_X) |
                  BIT(WM_Q_ACCELERATION_Y) | BIT(WM_Q_ACCELERATION_Z),
    .quantities_with = BIT(WM_Q_ACCELERATION_X) | BIT(WM_Q_ACCELERATION_Y) | BIT(WM_Q_ACCELERATION_Z),
    .with = FIRST + 3};

const stream_kind kStreamSightings = {"sightings.csv",
                                      "sightings",
                                      WM_EVENT_SIGHTING,
                                      {{SENSED,
                                        {"id", CSV_WHOLE, CSV_MAY_EMPTY, ID_OR_UNKNOWN},
                                        WM_SIGHTING_NUMBERS(SIGHTING_COLUMN) OPTIONAL("cov_xx_m2", VARIANCE),
                                        OPTIONAL("cov_xy_m2", COVARIANCE),
                                        OPTIONAL("cov_yy_m2", VARIANCE)}},
                                      .fill = fill_sighting,
                                      .has_sensors = 1};

const stream_kind kStreamIncrements = {"increments.csv",
                                       "increments",
                                       WM_EVENT_INCREMENT,
                                       {{STAMPS,
                                         {"from_ns", CSV_TIME, CSV_NEEDED, 0, 0},
                                         NEEDED("dx_m", PLACE),
                                         NEEDED("dy_m", PLACE),
                                         NEEDED("dheading_rad", ANGLE),
                                         OPTIONAL("cov_xx", VARIANCE),
                                         OPTIONAL("cov_xy", COVARIANCE),
                                         OPTIONAL("cov_yy", VARIANCE),
                                         OPTIONAL("cov_xt", COVARIANCE),
                                         OPTIONAL("cov_yt", COVARIANCE),
                                         OPTIONAL("cov_tt", VARIANCE)}},
                                       .fill = fill_increment};

const stream_kind kStreamMarkers = {"markers.csv",
                                    "markers",
                                    WM_EVENT_MARKER,
                                    {{SENSED,
                                      {"id", CSV_WHOLE, CSV_NEEDED, ANY_ID},
                                      NEEDED("x_m", PLACE),
                                      NEEDED("y_m", PLACE),
                                      NEEDED("z_m", PLACE),
                                      NEEDED("yaw_rad", ANGLE),
                                      OPTIONAL("along_sigma_m", SIGMA),
                                      OPTIONAL("yaw_sigma_rad", SIGMA),
                                      OPTIONAL("other_x_m", PLACE),
                                      OPTIONAL("other_y_m", PLACE),
                                      OPTIONAL("other_z_m", PLACE),
                                      OPTIONAL("other_yaw_rad", ANGLE)}},
                                    .fill = fill_marker,
                                    .has_sensors = 1};

const stream_kind kStreamCorners = {"marker-corners.csv",
                                    "corners",
                                    WM_EVENT_MARKER,
                                    {{SENSED,
                                      {"id", CSV_WHOLE, CSV_NEEDED, ANY_ID},
                                      NEEDED("u0_px", PIXEL),
                                      NEEDED("v0_px", PIXEL),
                                      NEEDED("u1_px", PIXEL),
                                      NEEDED("v1_px", PIXEL),
                                      NEEDED("u2_px", PIXEL),
                                      NEEDED("v2_px", PIXEL),
                                      NEEDED("u3_px", PIXEL),
                                      NEEDED("v3_px", PIXEL),
                                      OPTIONAL("sigma_px", SIGMA)}},
                                    .fill = fill_corners,
                                    .has_sensors = 1};

const stream_kind kStreamStereo = {"stereo.csv",
                                   "stereo",
                                   WM_EVENT_STEREO,
                                   {{STAMPS,
                                     {"id", CSV_WHOLE, CSV_NEEDED, ID_OR_UNKNOWN},
                                     {"ul_px", CSV_NUMBER, CSV_MAY_EMPTY, PIXEL},
                                     {"vl_px", CSV_NUMBER, CSV_MAY_EMPTY, PIXEL},
                                     {"ur_px", CSV_NUMBER, CSV_MAY_EMPTY, PIXEL},
                                     {"vr_px", CSV_NUMBER, CSV_MAY_EMPTY, PIXEL},
                                     {"appearance", CSV_NAME, CSV_OPTIONAL, 0, 0}}},
                                   .fill = fill_stereo};

const stream_kind kStreamPoints = {"points.csv",
                                   "points",
                                   WM_EVENT_POINTS,
                                   {{STAMPS, NEEDED("x_m", PLACE), NEEDED("y_m", PLACE)}},
                                   .fill = fill_point};

const stream_kind kStreamGnss = {"gnss.csv",
                                 "gnss",
                                 WM_EVENT_POSITION,
                                 {{STAMPS, NEEDED("x_m", PLACE), NEEDED("y_m", PLACE), OPTIONAL("z_m", PLACE),
                                   NEEDED("sigma_xy_m", SIGMA), OPTIONAL("sigma_z_m", SIGMA)}},
                                 .fill = fill_gnss};

// base_link's x, y and z axis in the axes of what is mounted so.
static void axes_of(const wm_mounting *mounting, double out[3][3]) {
  const double *rpy = mounting->rpy_rad;
  const double sr = sin(rpy[0]), cr = cos(rpy[0]), sp = sin(rpy[1]), cp = cos(rpy[1]), sy = sin(rpy[2]),
               cy = cos(rpy[2]);
  const double axes[3][3] = {{cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr},
                             {sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr},
                             {-sp, cp * sr, cp * cr}};
  memcpy(out, axes, sizeof axes);
}

void fill_context_mount(fill_context *self, const wm_row_mountings *mountings) {
  axes_of(&mountings->imu, self->imu_axes);
  axes_of(&mountings->motion6, self->motion6_axes);
  memcpy(self->motion6_arm_m, mountings->motion6.xyz_m, sizeof self->motion6_arm_m);
}

// ── rows from elsewhere ─────────────────────────────────────────────────────────────────────────────────────────────

const stream_kind *const kStreams[] = {&kStreamMotion,
                                       &kStreamMotion6,
                                       &kStreamIncrements,
                                       &kStreamTicks,
                                       &kStreamSpeeds,
                                       &kStreamSteering,
                                       &kStreamImu,
                                       &kStreamHeading,
                                       &kStreamDepth,
                                       &kStreamSightings,
                                       &kStreamMarkers,
                                       &kStreamCorners,
                                       &kStreamStereo,
                                       &kStreamPoints,
                                       &kStreamGnss,
                                       &kStreamLocalizer,
                                       NULL};

// Names for a configuration; the corners of markers have those of the markers.
const char *const wm_source_names[] = {"can",      "motion", "motion6", "increments", "ticks",     "speeds",
                                       "steering", "imu",    "heading", "depth",      "sightings", "markers",
                                       "stereo",   "points", "gnss",    "localizer",  NULL};
const char *const wm_stream_names[] = {"motion",  "motion6", "ticks", "speeds",    "steering", "imu",
                                       "heading", "depth",   "gnss",  "localizer", NULL};

const wm_stream *wm_stream_find(const char *name) {
  for (size_t i = 0; wm_stream_names[i]; i++)
    if (strcmp(wm_stream_names[i], name) == 0)
      for (size_t k = 0; kStreams[k]; k++)
        if (strcmp(kStreams[k]->name, name) == 0) return kStreams[k];
  return NULL;
}

const char *wm_stream_name(const wm_stream *self) { return self->name; }
const char *wm_stream_file(const wm_stream *self) { return self->file; }
uint32_t wm_stream_quantities(const wm_stream *self) { return self->quantities; }

uint32_t wm_stream_kinds(const wm_stream *self) {
  return WM_EVENT_BIT(self->event) | (self->also ? WM_EVENT_BIT(self->also) : 0);
}

const char *wm_stream_number(const wm_stream *self, size_t index) {
  const size_t column = FIRST + index;
  return column < CSV_COLUMNS_MAX ? self->format.columns[column].name : NULL;
}

wm_status wm_stream_event(const wm_stream *self, const wm_stream_row *row, const wm_row_mountings *mountings,
                          wm_event *out, wm_error *err) {
  csv_row values;
  fill_context context = {0};
  fill_context_mount(&context, mountings);
  for (size_t i = 0; wm_stream_number(self, i); i++) {
    const csv_column *column = &self->format.columns[FIRST + i];
    const double value = values.number[FIRST + i] = row->number[i];
    if (isnan(value) && column->need < CSV_NEEDED) continue;
    if (!isfinite(value)) return wm_fail(err, WM_NOT_FINITE, "%s is not a finite number", column->name);
    if (!(value >= column->min && value <= column->max))
      return wm_fail(err, WM_OUT_OF_RANGE, "%s: %.10g is outside of what can be (%s%.10g to %.10g)", column->name,
                     value, column->min == DBL_MIN ? "above " : "", column->min == DBL_MIN ? 0.0 : column->min,
                     column->max);
  }
  memset(out, 0, WM_EVENT_SMALL_BYTES);
  out->t_ns = row->t_ns;
  out->arrival_ns = row->arrival_ns;
  out->kind = (uint8_t)self->event;
  const char *problem = self->fill(&context, &values, out);
  return problem ? wm_fail(err, WM_BAD_DATA, "%s", problem) : wm_event_check(out, err);
}
