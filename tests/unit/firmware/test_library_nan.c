// SPDX-License-Identifier: Apache-2.0
// A NaN in each number that a session takes: the datum is refused, or the number counts as absent. Poses stay finite
// and right.
#include "library_robot.h"
#include "waymark/event_fields.h"
#include "waymark/streams.h"

#define STEPS 200  // of 20 ms
#define STEP_NS (20 * WM_NS_PER_MS)
#define SPEED_MPS 0.5
#define EVERY 5          // steps from an observation to the next
#define BROKEN_STEP 100  // of which the datum has the NaN
#define FAR_OFF_M 0.1    // more than any right run is from the truth

static wm_estimate last;
static size_t not_finite;

static void take(void *context, waymark_record kind, const void *record, size_t bytes) {
  (void)context, (void)bytes;
  if (kind != WAYMARK_RECORD_FUSED) return;
  memcpy(&last, record, sizeof last);
  for (int i = 0; i < 3; i++) not_finite += !isfinite(last.pose_map_base.p_m[i]);
  for (size_t i = 0; i < sizeof last.covariance / sizeof last.covariance[0]; i++)
    not_finite += !isfinite(last.covariance[i]);
}

void setUp(void) {
  robot_write();
  folder_write("landmarks.csv", "id,x_m,y_m,z_m,sigma_m,yaw_rad\n1,5,1,0,0.01,0\n");
}

void tearDown(void) { folder_remove(); }

// What a source gives of a robot that drives along x: a row, or an event.
typedef struct given {
  const char *source;
  size_t numbers;  // of a row; 0: an event
  int is_motion;   // it moves the robot itself
  void (*row)(int step, double *numbers);
  void (*event)(int step, wm_event *out);
  const char *outcome;  // of a NaN in each number: r refused by name, a absent, e either
  size_t offset[8];     // of an event's numbers
} given;

static void motion(int step, double *n) { (void)step, n[0] = SPEED_MPS, n[1] = 0, n[2] = 0; }
static void motion6(int step, double *n) {
  (void)step;
  for (int i = 0; i < 7; i++) n[i] = i == 0 ? SPEED_MPS : i == 6 ? 0.02 : 0;
}
static void ticks(int step, double *n) { n[0] = n[1] = round(step * 0.02 * SPEED_MPS / (2 * M_PI * 0.05) * 1000); }
static void steering(int step, double *n) { (void)step, n[0] = SPEED_MPS, n[1] = 0; }
static void heading(int step, double *n) { (void)step, n[0] = 0, n[1] = 0.02; }
static void gnss(int step, double *n) { n[0] = step * 0.02 * SPEED_MPS, n[1] = 0, n[2] = 0, n[3] = 0.05, n[4] = 0.1; }
static void localizer(int step, double *n) {
  const double row[] = {step * 0.02 * SPEED_MPS, 0, 0, 0.01, 0, 0.01, 0, 0, 1e-3, 1};
  memcpy(n, row, sizeof row);
}
static void imu(int step, double *n) {
  (void)step;
  for (int i = 0; i < 6; i++) n[i] = i == 5 ? 9.81 : 0;
}
static void sighting(int step, wm_event *out) {
  const double x = 5.0 - step * 0.02 * SPEED_MPS - 0.1;
  out->kind = WM_EVENT_SIGHTING;
  out->as.sighting = wm_sighting_without_numbers();
  out->as.sighting.landmark_id = 1;
  out->as.sighting.bearing_rad = atan2(1.0, x), out->as.sighting.range_m = hypot(1.0, x);
  out->as.sighting.bearing_sigma_rad = 0.01, out->as.sighting.range_sigma_m = 0.05;
}
static void marker(int step, wm_event *out) {
  out->kind = WM_EVENT_MARKER;
  out->as.marker = (wm_marker){.poses = 1, .id = 1, .along_sigma_m = 0.02, .yaw_sigma_rad = 0.05};
  out->as.marker.p_m[0] = 5.0 - step * 0.02 * SPEED_MPS - 0.1, out->as.marker.p_m[1] = 1.0;
}
static void increment(int step, wm_event *out) {
  out->kind = WM_EVENT_INCREMENT;
  out->as.increment = (wm_increment){
      .from_ns = (step - 1) * STEP_NS, .dx_m = 0.02 * SPEED_MPS, .covariance = {1e-6, 0, 1e-6, 0, 0, 1e-6}};
}

#define AT(part) offsetof(wm_event, as) + offsetof(__typeof__(((wm_event *)0)->as), part)
static const given kGiven[] = {
    {"motion", 3, 1, motion, NULL, "rar", {0}},
    {"motion6", 7, 1, motion6, NULL, "rrrrrra", {0}},
    {"ticks", 2, 1, ticks, NULL, "rr", {0}},
    {"steering", 2, 1, steering, NULL, "rr", {0}},
    {"heading", 2, 0, heading, NULL, "rr", {0}},
    {"gnss", 5, 0, gnss, NULL, "rrara", {0}},
    {"localizer", 10, 0, localizer, NULL, "rra", {0}},
    {"imu", 6, 0, imu, NULL, "rrraaa", {0}},
    {"increments",
     0,
     1,
     NULL,
     increment,
     "rrrarrr",
     {AT(increment.dx_m), AT(increment.dy_m), AT(increment.dheading_rad), AT(increment.covariance[0]),
      AT(increment.covariance[1]), AT(increment.covariance[2]), AT(increment.covariance[5])}},
    {"sightings:eye",
     0,
     0,
     NULL,
     sighting,
     "aaaaaa",
     {AT(sighting.bearing_rad), AT(sighting.range_m), AT(sighting.bearing_sigma_rad), AT(sighting.range_sigma_m),
      AT(sighting.elevation_rad), AT(sighting.elevation_sigma_rad)}},
    {"markers:eye",
     0,
     0,
     NULL,
     marker,
     "rreeaaa",
     {AT(marker.p_m[0]), AT(marker.p_m[1]), AT(marker.p_m[2]), AT(marker.yaw_rad), AT(marker.along_sigma_m),
      AT(marker.yaw_sigma_rad), AT(marker.bloom_px)}},
};

// A datum of `of` at a step; its number `broken` is NaN at BROKEN_STEP. What the session says to it.
static wm_status push(waymark_session *session, uint32_t source, const given *of, int step, int broken) {
  const int is_broken = step == BROKEN_STEP && broken >= 0;
  if (of->row) {
    double row[WM_STREAM_NUMBERS_MAX];
    of->row(step, row);
    if (is_broken) row[broken] = (double)NAN;
    return waymark_push_row(session, source, step * STEP_NS, WM_TIME_NONE, row, of->numbers, &err);
  }
  wm_event event = {.t_ns = step * STEP_NS, .arrival_ns = step * STEP_NS};
  of->event(step, &event);
  const double nan_value = (double)NAN;
  if (is_broken) memcpy((char *)&event + of->offset[broken], &nan_value, sizeof nan_value);
  return waymark_push_event(session, source, &event, sizeof event, &err);
}

// Whether the datum with the NaN was refused by name: by the call, or counted in the health.
static int drive(const given *of, int broken) {
  waymark_session *session;
  uint32_t moved = 0, source;
  wm_status said = WM_OK;
  const waymark_options options = {.bytes = sizeof options, .config = config, .site = dir, .seed = 1, .take = take};
  not_finite = 0;
  ok(waymark_open(&options, &session, &err));
  if (!of->is_motion) ok(waymark_add_source(session, "motion", &moved, &err));
  ok(waymark_add_source(session, of->source, &source, &err));
  ok(waymark_start(session, &err));
  for (int step = 1; step <= STEPS; step++) {
    if (!of->is_motion) ok(push(session, moved, &kGiven[0], step, -1));
    if (!of->is_motion && step % EVERY) continue;
    const wm_status status = push(session, source, of, step, broken);
    if (step == BROKEN_STEP)
      said = status;
    else
      ok(status);
  }
  wm_health health;
  ok(waymark_health(session, &health, sizeof health, &err));
  ok(waymark_close(session, &err));
  const wm_source_health *counted = &health.sources[health.source_count - 1];
  TEST_ASSERT_TRUE(said == WM_OK || said == WM_NOT_FINITE ||
                   said == WM_BAD_DATA);  // the last: of some that go together
  return said != WM_OK || counted->refused[WM_NOT_FINITE] > 0 || counted->rejected[WM_REJECTED_NOT_FINITE] > 0;
}

// `left_out`: a source that the estimator does not take, which a session refuses by name.
static void refused_or_absent(const char *estimator, const char *left_out) {
  char text[100];
  (void)snprintf(text, sizeof text, "format: waymark-config/1\nestimator: %s\n", estimator);
  folder_write("robot.yaml", text);
  for (size_t k = 0; k < sizeof kGiven / sizeof kGiven[0]; k++) {
    const given *of = &kGiven[k];
    if (strstr(left_out, of->source)) continue;
    for (int broken = -1; broken < (int)strlen(of->outcome); broken++) {
      char what[80];
      (void)snprintf(what, sizeof what, "%s, number %d", of->source, broken);
      const int refused = drive(of, broken);
      TEST_ASSERT_EQUAL_size_t_MESSAGE(0, not_finite, what);
      TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(FAR_OFF_M, STEPS * 0.02 * SPEED_MPS, last.pose_map_base.p_m[0], what);
      TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(FAR_OFF_M, 0, last.pose_map_base.p_m[1], what);
      if (broken >= 0 && of->outcome[broken] == 'e') continue;
      TEST_ASSERT_EQUAL_INT_MESSAGE(broken >= 0 && of->outcome[broken] == 'r', refused, what);
    }
  }
}

TEST(test_landmark_ekf) { refused_or_absent("landmark_ekf", ""); }
TEST(test_slam) { refused_or_absent("slam", "heading gnss"); }

// An event of a kind whose numbers can all be.
static wm_event possible(unsigned kind) {
  wm_event out = {.kind = (uint8_t)kind, .t_ns = STEP_NS};
  size_t count;
  const wm_event_field *fields = wm_event_fields(kind, &count);
  for (const wm_event_field *field = fields; field && field < fields + count; field++) {
    const double value = field->least > 0 ? 1.0 : 0.0;
    for (size_t i = 0; field->type == WM_FIELD_F64 && i < field->count; i++)
      memcpy((char *)&out + field->offset + i * sizeof value, &value, sizeof value);
  }
  if (kind == WM_EVENT_MARKER) out.as.marker.poses = 2;
  if (kind == WM_EVENT_SET_POSE) out.as.set_pose.pose_map_base.q_xyzw[3] = 1.0;
  if (kind == WM_EVENT_QUANTITIES) out.as.quantities = (wm_quantities){.count = 1, .id = {WM_Q_VEHICLE_SPEED}};
  if (kind == WM_EVENT_POINTS) {
    out.as.points.count = 1;
    out.as.points.sigma_m[0] = 1.0F;
  }
  return out;
}

static void refused(const wm_event *event, int is_needed, const char *name) {
  TEST_ASSERT_EQUAL_MESSAGE(is_needed ? WM_NOT_FINITE : WM_OK, wm_event_check(event, &err), name);
  if (is_needed) TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, name), err.text);
}

// All kinds of events with all their numbers: one that is needed is refused by its name, any other one is absent.
TEST(test_each_number_of_each_kind) {
  for (unsigned kind = 1; kind < WM_EVENT_KIND_COUNT; kind++) {
    const wm_event good = possible(kind);
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_event_check(&good, &err), err.text);
    size_t count;
    const wm_event_field *fields = wm_event_fields(kind, &count);
    for (const wm_event_field *field = fields; field && field < fields + count; field++)
      for (size_t i = 0; field->type == WM_FIELD_F64 && i < field->count; i++) {
        wm_event event = good;
        const double nan_value = (double)NAN;
        memcpy((char *)&event + field->offset + i * sizeof nan_value, &nan_value, sizeof nan_value);
        refused(&event, i < field->needed, field->name);
      }
  }
  wm_event event = possible(WM_EVENT_QUANTITIES);
  event.as.quantities.value[0] = (double)NAN;
  refused(&event, 1, "vehicle_speed");
  float *const numbers[] = {event.as.points.x_m, event.as.points.y_m, event.as.points.normal_rad,
                            event.as.points.sigma_m};
  static const char *const kNames[] = {"x_m", "y_m", "normal_rad", "sigma_m"};
  for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
    event = possible(WM_EVENT_POINTS);
    numbers[i][0] = NAN;
    refused(&event, i < 2, kNames[i]);
  }
}

// How many numbers of an event are there.
static size_t numbers_of(const wm_event *event) {
  size_t count, out = event->kind == WM_EVENT_QUANTITIES ? event->as.quantities.count : 0;
  const wm_event_field *fields = wm_event_fields(event->kind, &count);
  for (const wm_event_field *field = fields; field && field < fields + count; field++)
    for (size_t i = 0; field->type == WM_FIELD_F64 && i < field->count; i++) {
      double value;
      memcpy(&value, (const char *)event + field->offset + i * sizeof value, sizeof value);
      out += !isnan(value);
    }
  return out;
}

// Numbers that are a row of each stream: the covariance is the identity.
static double usual(const wm_stream *stream, size_t column) {
  const char *name = wm_stream_number(stream, column);
  return name && (strcmp(name, "cov_xy") == 0 || strcmp(name, "cov_xt") == 0 || strcmp(name, "cov_yt") == 0) ? 0.0
                                                                                                             : 1.0;
}

static wm_status event_of(const wm_stream *stream, size_t column, double number, wm_event *out) {
  wm_stream_row row = {.t_ns = STEP_NS, .arrival_ns = STEP_NS};
  for (size_t i = 0; i < WM_STREAM_NUMBERS_MAX; i++) row.number[i] = usual(stream, i);
  row.number[column] = number;
  memset(out, 0, sizeof *out);
  return wm_stream_event(stream, &row, &(wm_row_mountings){0}, out, &err);
}

// All streams with all their columns: a row without a number is refused, or its event has fewer numbers, or the number
// is in no event.
TEST(test_each_column_of_each_stream) {
  for (size_t s = 0; wm_stream_names[s]; s++) {
    const wm_stream *stream = wm_stream_find(wm_stream_names[s]);
    for (size_t i = 0; wm_stream_number(stream, i); i++) {
      const char *name = wm_stream_number(stream, i);
      wm_event whole, other, lacking;
      ok(event_of(stream, i, usual(stream, i), &whole));
      const wm_status status = event_of(stream, i, (double)NAN, &lacking);
      ok(event_of(stream, i, 0.5, &other));
      if (status != WM_OK)
        TEST_ASSERT_TRUE_MESSAGE(status == WM_NOT_FINITE || status == WM_BAD_DATA, err.text);
      else if (memcmp(&whole, &other, wm_event_bytes(&whole)) != 0)
        TEST_ASSERT_LESS_THAN_MESSAGE(numbers_of(&whole), numbers_of(&lacking), name);
    }
  }
}
