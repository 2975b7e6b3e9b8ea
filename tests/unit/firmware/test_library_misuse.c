// SPDX-License-Identifier: Apache-2.0
// The C interface, misused: NULL, handles that were closed or are none, numbers and times that cannot be, calls in the
// wrong order. Each call answers with a status and a text that says what is wrong; none crashes or changes what
// follows. Prints the table.
#include <float.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "library_robot.h"

#define INFV ((double)INFINITY)

// An open session that has started and is at 1 s; one that has not; one that was closed. A log, and one that was
// closed.
static waymark_session *started, *fresh, *closed;
// Of other estimators, started: a stereo pair's, and one with a map of edges.
static waymark_session *of_pair, *of_map;
static waymark_log *opened_log, *closed_log;
static uint32_t motion, eye, gnss, heading, increments, markers, commands, stereo, points;
static wm_event event;
static wm_published pose;
static wm_bound bound;
static wm_health health;
static wm_innovation innovation;
static uint32_t number;
static const double kRow[3] = {0.5, NAN, 0.0};

// ── what is misused ─────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status open_with(const char *config_path, const char *site, const char *changes) {
  waymark_session *session = NULL;
  const waymark_options options = {
      .bytes = sizeof options, .config = config_path, .site = site, .changes = changes, .seed = 1};
  const wm_status status = waymark_open(&options, &session, &err);
  TEST_ASSERT_NULL(session);
  return status;
}

static wm_status open_sized(size_t bytes) {
  waymark_session *session = NULL;
  const waymark_options options = {.bytes = bytes, .config = config, .site = dir};
  return waymark_open(&options, &session, &err);
}

static wm_status open_out_twice(void) {
  waymark_session *session[2] = {NULL, NULL};
  char out[300];
  uint32_t source;
  (void)snprintf(out, sizeof out, "%s/out", dir);
  const waymark_options options = {.bytes = sizeof options, .config = config, .site = dir, .out = out};
  wm_status status = WM_OK;
  for (int i = 0; i < 2; i++) {
    TEST_ASSERT_EQUAL(WM_OK, waymark_open(&options, &session[i], &err));
    TEST_ASSERT_EQUAL(WM_OK, waymark_add_source(session[i], "motion", &source, &err));
    status = waymark_start(session[i], &err);
  }
  wm_error not_this;
  for (int i = 0; i < 2; i++) (void)waymark_close(session[i], &not_this);
  return status;
}

static wm_status push_to(waymark_session *session, uint32_t source) {
  event.t_ns = NS(1), event.arrival_ns = WM_TIME_NONE;
  return waymark_push_event(session, source, &event, sizeof event, &err);
}

static wm_status push(uint32_t source) { return push_to(started, source); }

static wm_status sighting(double bearing_rad, double range_m, double sigma_rad, double elevation_rad) {
  event = (wm_event){.kind = WM_EVENT_SIGHTING, .as.sighting = wm_sighting_without_numbers()};
  wm_sighting *s = &event.as.sighting;
  s->landmark_id = 1, s->bearing_rad = bearing_rad, s->range_m = range_m, s->bearing_sigma_rad = sigma_rad;
  s->elevation_rad = elevation_rad, s->elevation_sigma_rad = 0.01;
  return push(eye);
}

static wm_status marker(double x_m, double yaw_rad, double sigma_m) {
  event =
      (wm_event){.kind = WM_EVENT_MARKER,
                 .as.marker = {.poses = 1, .id = 1, .p_m = {x_m, 0, 0}, .yaw_rad = yaw_rad, .along_sigma_m = sigma_m}};
  event.as.marker.yaw_sigma_rad = event.as.marker.bloom_px = NANV;
  return push(markers);
}

static wm_status marker_of(uint16_t poses) {
  event = (wm_event){.kind = WM_EVENT_MARKER, .as.marker = {.poses = poses, .id = 1, .p_m = {1, 0, 0}}};
  return push(markers);
}

static wm_status increment(double from_s, double dx_m, double dheading_rad) {
  event = (wm_event){.kind = WM_EVENT_INCREMENT,
                     .as.increment = {.from_ns = NS(from_s), .dx_m = dx_m, .dheading_rad = dheading_rad}};
  return push(increments);
}

static wm_status position(double x_m, double sigma_m) {
  event = (wm_event){.kind = WM_EVENT_POSITION, .as.position = {{x_m, 0, NANV}, sigma_m, NANV}};
  return push(gnss);
}

static wm_status set_pose(double x_m, double qw, double sigma_m) {
  event = (wm_event){.kind = WM_EVENT_SET_POSE, .as.set_pose = {.sigma_xy_m = sigma_m, .sigma_heading_rad = 0.1}};
  event.as.set_pose.pose_map_base.p_m[0] = x_m, event.as.set_pose.pose_map_base.q_xyzw[3] = qw;
  return push(commands);
}

static wm_status point(uint32_t count, float x_m, float sigma_m) {
  memset(&event, 0, sizeof event);
  event.kind = WM_EVENT_POINTS, event.as.points.count = count;
  event.as.points.x_m[0] = x_m, event.as.points.sigma_m[0] = sigma_m;
  return push_to(of_map, points);
}

static wm_status corner(double u_px) {
  event = (wm_event){.kind = WM_EVENT_STEREO, .as.stereo = {.left_px = {u_px, 0}, .right_px = {NANV, NANV}}};
  return push_to(of_pair, stereo);
}

static wm_status of_kind(uint8_t kind, uint32_t source, uint16_t sensor) {
  event = (wm_event){.kind = kind};
  if (kind == WM_EVENT_SIGHTING) event.as.sighting = (wm_sighting){.sensor = sensor, .range_m = 1};
  return push(source);
}

static wm_status arrives(double t_s, double arrival_s) {
  return waymark_push_row(started, motion, NS(t_s), NS(arrival_s), kRow, 3, &err);
}

static wm_status can(const char *interface, uint32_t id, int is_extended, size_t length) {
  static const char kData[80] = "";
  return waymark_push_can(started, NS(1), interface, id, is_extended, kData, length, &err);
}

static wm_status picture(const char *camera, uint32_t width_px, uint32_t stride_bytes, int has_pixels) {
  static const uint8_t kGrey[64 * 48];
  const wm_frame frame = {.t_ns = NS(1),
                          .arrival_ns = NS(1),
                          .width_px = width_px,
                          .height_px = 48,
                          .stride_bytes = stride_bytes,
                          .grey = has_pixels ? kGrey : NULL};
  return waymark_push_picture(started, camera, &frame, sizeof frame, &err);
}

static wm_status replay(const char *input, const char *with_config, double from_s, double until_s) {
  waymark_report report;
  const waymark_replay_options options = {
      .bytes = sizeof options, .input = input, .config = with_config, .from_s = from_s, .until_s = until_s};
  return waymark_replay(&options, &report, sizeof report, &err);
}

static void take_parameter(void *context, const waymark_parameter *parameter) { (void)context, (void)parameter; }

static wm_status said_in_callback;
static waymark_session *caller;
static void call_again(void *context, waymark_record kind, const void *record, size_t bytes) {
  (void)context, (void)kind, (void)record, (void)bytes;
  TEST_ASSERT_EQUAL_STRING("motion", waymark_source_name(caller, 0));  // names may be asked for
  said_in_callback = waymark_advance(caller, NS(2), &err);
}
static wm_status from_its_callback(void) {
  const waymark_options options = {.bytes = sizeof options, .config = config, .site = dir, .take = call_again};
  uint32_t source;
  wm_error not_this;
  TEST_ASSERT_EQUAL(WM_OK, waymark_open(&options, &caller, &not_this));
  TEST_ASSERT_EQUAL(WM_OK, waymark_add_source(caller, "motion", &source, &not_this));
  TEST_ASSERT_EQUAL(WM_OK, waymark_start(caller, &not_this));
  TEST_ASSERT_EQUAL(WM_OK, waymark_push_row(caller, source, 0, WM_TIME_NONE, kRow, 3, &not_this));
  TEST_ASSERT_EQUAL(WM_OK, waymark_advance(caller, NS(1), &not_this));
  TEST_ASSERT_EQUAL(WM_OK, waymark_close(caller, &not_this));
  return said_in_callback;
}

static void *as_session(uintptr_t value) { return (void *)value; }

// ── the table ───────────────────────────────────────────────────────────────────────────────────────────────────────

typedef struct row_of_table {
  const char *call;
  wm_status status, wanted;
  const char *words;  // of the text
  char text[WM_ERROR_TEXT_MAX];
} row_of_table;

#define ROWS_MAX 200
static row_of_table rows[ROWS_MAX];
static size_t row_count;

static void note(const char *call, wm_status status, wm_status wanted, const char *words) {
  TEST_ASSERT_LESS_THAN_size_t(ROWS_MAX, row_count);
  row_of_table *to = &rows[row_count++];
  *to = (row_of_table){.call = call, .status = status, .wanted = wanted, .words = words};
  (void)snprintf(to->text, sizeof to->text, "%s", err.text);
}

#define MISUSE(call, wanted, words)   \
  do {                                \
    err.text[0] = '\0';               \
    const wm_status said = (call);    \
    note(#call, said, wanted, words); \
  } while (0)

static void misuse_handles(void) {
  uint8_t mine[64] = {1};
  waymark_session *const foreign = (waymark_session *)(void *)mine, *const log = (waymark_session *)(void *)opened_log;
  waymark_log *const session = (waymark_log *)(void *)started;
  MISUSE(waymark_add_source(NULL, "motion", &number, &err), WM_BAD_USAGE, "`session` is NULL");
  MISUSE(waymark_start(NULL, &err), WM_BAD_USAGE, "`session` is NULL");
  MISUSE(row(NULL, motion, 1, 0.5, NANV, 0), WM_BAD_USAGE, "waymark_push_row: `session` is NULL");
  MISUSE(waymark_push_event(NULL, eye, &event, sizeof event, &err), WM_BAD_USAGE, "`session` is NULL");
  MISUSE(waymark_push_can(NULL, 0, "can0", 1, 0, "", 0, &err), WM_BAD_USAGE, "`session` is NULL");
  MISUSE(waymark_push_picture(NULL, "front", &(wm_frame){0}, sizeof(wm_frame), &err), WM_BAD_USAGE, "is NULL");
  MISUSE(waymark_advance(NULL, 0, &err), WM_BAD_USAGE, "`session` is NULL");
  MISUSE(waymark_pose(NULL, 0, &pose, sizeof pose, &err), WM_BAD_USAGE, "waymark_pose: `session` is NULL");
  MISUSE(waymark_health(NULL, &health, sizeof health, &err), WM_BAD_USAGE, "`session` is NULL");
  MISUSE(waymark_bound(NULL, &bound, sizeof bound, &err), WM_BAD_USAGE, "`session` is NULL");
  MISUSE(waymark_log_next(NULL, &event, sizeof event, NULL, &err), WM_BAD_USAGE, "`log` is NULL");
  MISUSE(waymark_add_source(closed, "motion", &number, &err), WM_BAD_USAGE, "was closed before");
  MISUSE(waymark_start(closed, &err), WM_BAD_USAGE, "was closed before");
  MISUSE(row(closed, motion, 1, 0.5, NANV, 0), WM_BAD_USAGE, "was closed before");
  MISUSE(waymark_push_event(closed, eye, &event, sizeof event, &err), WM_BAD_USAGE, "was closed before");
  MISUSE(waymark_push_can(closed, 0, "can0", 1, 0, "", 0, &err), WM_BAD_USAGE, "was closed before");
  MISUSE(waymark_advance(closed, 0, &err), WM_BAD_USAGE, "was closed before");
  MISUSE(waymark_pose(closed, 0, &pose, sizeof pose, &err), WM_BAD_USAGE, "was closed before");
  MISUSE(waymark_health(closed, &health, sizeof health, &err), WM_BAD_USAGE, "was closed before");
  MISUSE(waymark_bound(closed, &bound, sizeof bound, &err), WM_BAD_USAGE, "was closed before");
  MISUSE(waymark_push_picture(closed, "front", &(wm_frame){0}, sizeof(wm_frame), &err), WM_BAD_USAGE, "closed before");
  MISUSE(waymark_close(closed, &err), WM_BAD_USAGE, "was closed before");
  MISUSE(waymark_log_next(closed_log, &event, sizeof event, NULL, &err), WM_BAD_USAGE, "this log was closed before");
  MISUSE(row(foreign, motion, 1, 0.5, NANV, 0), WM_BAD_USAGE, "is no session of this library");
  MISUSE(waymark_close(foreign, &err), WM_BAD_USAGE, "is no session of this library");
  MISUSE(waymark_start(as_session(1), &err), WM_BAD_USAGE, "is no session of this library");
  MISUSE(waymark_start(as_session(UINTPTR_MAX), &err), WM_BAD_USAGE, "no session");
  MISUSE(waymark_start(as_session((uintptr_t)fresh + 2), &err), WM_BAD_USAGE, "session");
  MISUSE(waymark_advance(log, 0, &err), WM_BAD_USAGE, "is no session of this library");
  MISUSE(waymark_bound(log, &bound, sizeof bound, &err), WM_BAD_USAGE, "is no session of this library");
  MISUSE(waymark_log_next(session, &event, sizeof event, NULL, &err), WM_BAD_USAGE, "is no log of this library");
  MISUSE(from_its_callback(), WM_BAD_USAGE, "a callback may not call it");
}

static void misuse_pointers(void) {
  char long_name[100], long_path[5000];
  memset(long_name, 'x', sizeof long_name - 1), memset(long_path, 'x', sizeof long_path - 1);
  long_name[sizeof long_name - 1] = long_path[sizeof long_path - 1] = '\0';
  waymark_session *out = NULL;
  waymark_log *log = NULL;
  MISUSE(open_into(NULL), WM_BAD_USAGE, "`out` is NULL");
  MISUSE(waymark_open(NULL, &out, &err), WM_BAD_USAGE, "0 bytes");
  MISUSE(open_with(NULL, NULL, NULL), WM_BAD_USAGE, "options.config");
  MISUSE(open_with("", NULL, NULL), WM_BAD_USAGE, "options.config");
  MISUSE(open_sized(0), WM_BAD_USAGE, "its options have 0 bytes");
  MISUSE(open_sized(SIZE_MAX), WM_BAD_USAGE, "set `bytes` to their sizeof");
  MISUSE(open_with("/nowhere/robot.yaml", NULL, NULL), WM_NOT_FOUND, "/nowhere/robot.yaml");
  MISUSE(open_with(config, "/nowhere", NULL), WM_NOT_FOUND, "options.site: there is no such folder");
  MISUSE(open_with(config, config, NULL), WM_NOT_FOUND, "options.site: there is no such folder");
  MISUSE(open_with(config, long_path, NULL), WM_BAD_USAGE, "too long");
  MISUSE(open_with(config, dir, "no colon"), WM_BAD_USAGE, "KEY: VALUE");
  MISUSE(open_with(config, dir, "motion.sped: 1"), WM_BAD_CONFIG, "with options.changes: ");
  MISUSE(open_with(config, dir, "integrity.risk_per_pose: 1e-6"), WM_BAD_CONFIG, "from 0.0001 to 0.1 is needed");
  MISUSE(open_with(dir, dir, NULL), WM_IO, dir);
  MISUSE(open_out_twice(), WM_BAD_USAGE, "another run writes to this folder");
  MISUSE(waymark_add_source(fresh, NULL, &number, &err), WM_BAD_USAGE, "`name` is NULL");
  MISUSE(waymark_add_source(fresh, "motion", NULL, &err), WM_BAD_USAGE, "`out` is NULL");
  MISUSE(waymark_add_source(fresh, "", &number, &err), WM_NOT_FOUND, "'' is not a source");
  MISUSE(waymark_add_source(fresh, long_name, &number, &err), WM_BAD_USAGE, "47 bytes at most");
  MISUSE(waymark_add_source(fresh, "sonar", &number, &err), WM_NOT_FOUND, "'sonar' is not a source");
  MISUSE(waymark_add_source(fresh, "sightings:", &number, &err), WM_NOT_FOUND, "'sightings:' is not a source");
  MISUSE(waymark_add_source(fresh, "can:can9", &number, &err), WM_NOT_FOUND, "can9");
  MISUSE(waymark_push_row(started, motion, NS(1), WM_TIME_NONE, NULL, 3, &err), WM_BAD_USAGE, "`numbers` is NULL");
  MISUSE(waymark_push_event(started, eye, NULL, sizeof event, &err), WM_BAD_USAGE, "`event` is NULL");
  MISUSE(waymark_push_can(started, 0, NULL, 1, 0, "", 0, &err), WM_BAD_USAGE, "`interface` is NULL");
  MISUSE(waymark_push_can(started, 0, "can0", 1, 0, NULL, 8, &err), WM_BAD_USAGE, "`data` is NULL");
  MISUSE(waymark_push_picture(started, NULL, &(wm_frame){0}, sizeof(wm_frame), &err), WM_BAD_USAGE, "`camera` is NULL");
  MISUSE(waymark_push_picture(started, "front", NULL, 0, &err), WM_BAD_USAGE, "`frame` is NULL");
  MISUSE(picture("front", 64, 64, 0), WM_BAD_DATA, "front: a picture");
  MISUSE(waymark_pose(started, NS(1), NULL, sizeof pose, &err), WM_BAD_USAGE, "`out` is NULL");
  MISUSE(waymark_health(started, NULL, sizeof health, &err), WM_BAD_USAGE, "`out` is NULL");
  MISUSE(waymark_bound(started, NULL, sizeof bound, &err), WM_BAD_USAGE, "`out` is NULL");
  MISUSE(waymark_log_open(NULL, &log, &err), WM_BAD_USAGE, "`path` is NULL");
  MISUSE(waymark_log_open(config, NULL, &err), WM_BAD_USAGE, "`out` is NULL");
  MISUSE(waymark_log_open(config, &log, &err), WM_BAD_DATA, config);
  MISUSE(waymark_log_open("/nowhere.wmlog", &log, &err), WM_IO, "/nowhere.wmlog");
  MISUSE(waymark_log_next(opened_log, NULL, sizeof event, NULL, &err), WM_BAD_USAGE, "`out` is NULL");
  MISUSE(waymark_read_pose(NULL, 10, &pose, sizeof pose, &err), WM_BAD_USAGE, "`message` is NULL");
  MISUSE(waymark_read_pose("abc", 3, NULL, sizeof pose, &err), WM_BAD_USAGE, "`out` is NULL");
  MISUSE(waymark_read_pose("abc", 3, &pose, sizeof pose, &err), WM_BAD_DATA, "pose_t");
  MISUSE(waymark_read_bound(NULL, 10, &bound, sizeof bound, &err), WM_BAD_USAGE, "`message` is NULL");
  MISUSE(waymark_read_bound("abc", 3, NULL, sizeof bound, &err), WM_BAD_USAGE, "`out` is NULL");
  MISUSE(waymark_read_bound("abc", 3, &bound, sizeof bound, &err), WM_BAD_DATA, "bound_t");
  MISUSE(waymark_read_health("abc", 3, NULL, sizeof health, &err), WM_BAD_USAGE, "`out` is NULL");
  MISUSE(waymark_read_innovation("abc", 3, NULL, sizeof innovation, &err), WM_BAD_USAGE, "`out` is NULL");
  MISUSE(waymark_read_health(NULL, 10, &health, sizeof health, &err), WM_BAD_USAGE, "`message` is NULL");
  MISUSE(waymark_read_health("", 0, &health, sizeof health, &err), WM_BAD_DATA, "health_t");
  MISUSE(waymark_read_innovation(NULL, 1, &innovation, sizeof innovation, &err), WM_BAD_USAGE, "`message` is NULL");
  MISUSE(waymark_read_innovation("x", SIZE_MAX, &innovation, sizeof innovation, &err), WM_BAD_DATA, "innovation_t");
  MISUSE(waymark_replay(NULL, NULL, 0, &err), WM_BAD_USAGE, "`options` is NULL");
  MISUSE(replay(NULL, config, 0, 0), WM_BAD_USAGE, "options.input");
  MISUSE(replay("", config, 0, 0), WM_BAD_USAGE, "options.input");
  MISUSE(replay(dir, NULL, 0, 0), WM_BAD_USAGE, "needs a configuration");
  MISUSE(replay(dir, config, NANV, 0), WM_NOT_FINITE, "from_s and until_s");
  MISUSE(replay(dir, config, -1, 0), WM_OUT_OF_RANGE, "no part of a recording");
  MISUSE(replay(dir, config, 5, 2), WM_OUT_OF_RANGE, "no part of a recording");
  MISUSE(replay(dir, config, 1e300, 0), WM_OUT_OF_RANGE, "from_s 1e+300");
  MISUSE(replay(dir, config, 0, DBL_MAX), WM_OUT_OF_RANGE, "no part of a recording");
  MISUSE(waymark_parameters(NULL, take_parameter, NULL, &err), WM_BAD_USAGE, "a text and a function");
  MISUSE(waymark_parameters("estimator: slam", NULL, NULL, &err), WM_BAD_USAGE, "a text and a function");
  MISUSE(waymark_parameters("", take_parameter, NULL, &err), WM_BAD_CONFIG, "format: waymark-config/1");
  MISUSE(waymark_parameters("format: waymark-config/1\n", take_parameter, NULL, &err), WM_BAD_CONFIG, "estimator");
}

static void misuse_order_and_sizes(void) {
  MISUSE(waymark_start(fresh, &err), WM_BAD_CONFIG, "");
  MISUSE(row(fresh, 0, 1, 0.5, NANV, 0), WM_BAD_USAGE, "waymark_start has to be called before");
  MISUSE(waymark_pose(fresh, 0, &pose, sizeof pose, &err), WM_BAD_USAGE, "waymark_pose: waymark_start");
  MISUSE(waymark_advance(fresh, 0, &err), WM_BAD_USAGE, "waymark_advance: waymark_start");
  MISUSE(waymark_health(fresh, &health, sizeof health, &err), WM_BAD_USAGE, "waymark_start has to be called before");
  MISUSE(waymark_bound(fresh, &bound, sizeof bound, &err), WM_BAD_USAGE, "waymark_bound: waymark_start");
  MISUSE(waymark_bound(started, &bound, 3, &err), WM_BAD_USAGE, "its struct has 3 bytes");
  MISUSE(waymark_push_event(fresh, 0, &event, sizeof event, &err), WM_BAD_USAGE, "waymark_push_event: waymark_start");
  MISUSE(waymark_push_can(fresh, 0, "can0", 1, 0, "", 0, &err), WM_BAD_USAGE, "waymark_push_can: waymark_start");
  MISUSE(waymark_start(started, &err), WM_BAD_USAGE, "has started already");
  MISUSE(waymark_add_source(started, "imu", &number, &err), WM_BAD_USAGE, "added before waymark_start");
  MISUSE(row(started, 99, 1, 0.5, NANV, 0), WM_NOT_FOUND, "99 is not a source");
  MISUSE(row(started, eye, 1, 0.5, NANV, 0), WM_BAD_USAGE, "takes events");
  MISUSE(waymark_push_row(started, motion, NS(1), WM_TIME_NONE, kRow, 1000000, &err), WM_BAD_USAGE, "3 columns");
  MISUSE(waymark_push_row(started, motion, NS(1), WM_TIME_NONE, kRow, 0, &err), WM_NOT_FINITE, "v_mps");
  MISUSE(waymark_push_event(started, eye, &event, 8, &err), WM_BAD_USAGE, "8 bytes");
  MISUSE(waymark_pose(started, NS(1), &pose, sizeof pose + 8, &err), WM_BAD_USAGE, "its struct has");
  MISUSE(waymark_health(started, &health, SIZE_MAX, &err), WM_BAD_USAGE, "its struct has");
  MISUSE(waymark_push_picture(started, "front", &(wm_frame){0}, 8, &err), WM_BAD_USAGE, "8 bytes");
  MISUSE(picture("rear", 64, 64, 1), WM_NOT_FOUND, "'rear' is not a camera");
  MISUSE(picture("front", 64, 64, 1), WM_NOT_FOUND, "no detector of `vision:` looks at the camera 'front'");
  MISUSE(picture("front", 640, 640, 1), WM_BAD_DATA, "calibration.yaml has 64 x 48");
  MISUSE(picture("front", 64, 3, 1), WM_BAD_DATA, "rows of 3 bytes");
  MISUSE(can("can0", 0x800, 0, 8), WM_BAD_DATA, "id 800");
  MISUSE(can("can0", 0x20000000, 1, 8), WM_BAD_DATA, "id 20000000");
  MISUSE(can("can0", 1, 0, 65), WM_BAD_DATA, "65 bytes");
  MISUSE(can("can0", 1, 0, 8), WM_NOT_FOUND, "no source for 'can0': add");
  MISUSE(of_kind(0, eye, 0), WM_BAD_DATA, "none");
  MISUSE(of_kind(200, eye, 0), WM_BAD_DATA, "kind ?");
  MISUSE(of_kind(WM_EVENT_POSITION, eye, 0), WM_BAD_DATA, "no events of the kind position");
}

static void misuse_numbers(void) {
  MISUSE(row(started, motion, 1, NANV, NANV, 0), WM_NOT_FINITE, "motion: v_mps is not a finite number");
  MISUSE(row(started, motion, 1, INFV, NANV, 0), WM_NOT_FINITE, "v_mps is not a finite number");
  MISUSE(row(started, motion, 1, 1e4, NANV, 0), WM_OUT_OF_RANGE, "v_mps: 10000 is outside of what can be");
  MISUSE(row(started, motion, 1, 900, NANV, 0), WM_OUT_OF_RANGE, "v_mps: 900 is outside of what can be (-150 to 150)");
  MISUSE(row(started, motion, 1, 0, NANV, 60), WM_OUT_OF_RANGE, "w_radps: 60 is outside of what can be (-50 to 50)");
  MISUSE(row(started, motion, 1, 0, INFV, 0), WM_NOT_FINITE, "vy_mps");
  MISUSE(row(started, motion, 1, 0, NANV, -DBL_MAX), WM_OUT_OF_RANGE, "w_radps");
  MISUSE(row(started, gnss, 1, 1e300, 0, NANV), WM_OUT_OF_RANGE, "x_m");
  MISUSE(row(started, heading, 1, 360, 0.1, 0), WM_BAD_USAGE, "2 columns");
  MISUSE(waymark_push_row(started, heading, NS(1), WM_TIME_NONE, (double[]){360, 0.1}, 2, &err), WM_OUT_OF_RANGE,
         "heading_rad: 360");
  MISUSE(waymark_push_row(started, heading, NS(1), WM_TIME_NONE, (double[]){1, -0.1}, 2, &err), WM_OUT_OF_RANGE,
         "sigma_rad: -0.1");
  MISUSE(sighting(0.1, -5, NANV, NANV), WM_OUT_OF_RANGE, "range_m: -5 is outside of what can be");
  MISUSE(sighting(0.1, 0, NANV, NANV), WM_OUT_OF_RANGE, "range_m: 0");
  MISUSE(sighting(0.1, 1e308, NANV, NANV), WM_OUT_OF_RANGE, "range_m");
  MISUSE(sighting(INFV, 5, NANV, NANV), WM_NOT_FINITE, "bearing_rad is not a finite number");
  MISUSE(sighting(90, 5, NANV, NANV), WM_OUT_OF_RANGE, "bearing_rad: 90");
  MISUSE(sighting(0.1, 5, -1, NANV), WM_OUT_OF_RANGE, "bearing_sigma_rad: -1");
  MISUSE(sighting(0.1, 5, 0, NANV), WM_OUT_OF_RANGE, "bearing_sigma_rad: 0");
  MISUSE(sighting(0.1, 5, 1e-9, NANV), WM_OUT_OF_RANGE, "bearing_sigma_rad: 1e-09");
  MISUSE(sighting(0.1, 5, 0.01, 2), WM_OUT_OF_RANGE, "elevation_rad: 2");
  MISUSE(sighting(NANV, NANV, NANV, NANV), WM_BAD_DATA, "both absent");
  MISUSE(marker(NANV, 0, 0.1), WM_NOT_FINITE, "p_m");
  MISUSE(marker(1, 0, 0), WM_OUT_OF_RANGE, "along_sigma_m: 0");
  MISUSE(marker(1e5, 0, 0.1), WM_OUT_OF_RANGE, "p_m: 100000");
  MISUSE(marker_of(0), WM_BAD_DATA, "markers:eye: 0 poses; a marker has 1, or 2");
  MISUSE(marker_of(7), WM_BAD_DATA, "7 poses");
  MISUSE(marker(1, INFV, 0.1), WM_NOT_FINITE, "yaw_rad");
  MISUSE(increment(0.9, NANV, 0), WM_NOT_FINITE, "dx_m");
  MISUSE(increment(0.9, 0.1, 1e9), WM_OUT_OF_RANGE, "dheading_rad");
  MISUSE(increment(1.0, 0.1, 0), WM_BAD_DATA, "from_ns is not before t_ns");
  MISUSE(position(INFV, 1), WM_NOT_FINITE, "p_m");
  MISUSE(position(1, -1), WM_OUT_OF_RANGE, "sigma_xy_m: -1");
  MISUSE(position(1, 0), WM_OUT_OF_RANGE, "sigma_xy_m: 0");
  MISUSE(position(1, 1e-9), WM_OUT_OF_RANGE, "sigma_xy_m: 1e-09 is outside of what can be (1e-06");
  MISUSE(position(5e7, 1), WM_OUT_OF_RANGE, "p_m: 50000000");
  MISUSE(set_pose(NANV, 1, 0.1), WM_NOT_FINITE, "p_m");
  MISUSE(set_pose(0, 1e9, 0.1), WM_OUT_OF_RANGE, "q_xyzw");
  MISUSE(set_pose(0, 0, 0.1), WM_OUT_OF_RANGE, "q_xyzw: its length is 0, of a rotation it is 1");
  MISUSE(set_pose(0, 1, NANV), WM_NOT_FINITE, "sigma_xy_m");
  MISUSE(set_pose(0, 1, -1), WM_OUT_OF_RANGE, "sigma_xy_m");
  MISUSE(point(WM_POINTS_MAX + 1, 0, 0.1f), WM_BAD_DATA, "513 points");
  MISUSE(point(UINT32_MAX, 0, 0.1f), WM_BAD_DATA, "4294967295 points");
  MISUSE(point(1, INFINITY, 0.1f), WM_NOT_FINITE, "x_m");
  MISUSE(point(1, 0, -1), WM_OUT_OF_RANGE, "sigma_m");
  MISUSE(corner(1e9), WM_OUT_OF_RANGE, "left_px");
}

static void misuse_times(void) {
  MISUSE(waymark_push_row(started, motion, INT64_MAX, WM_TIME_NONE, kRow, 3, &err), WM_OUT_OF_RANGE, "is not a time");
  MISUSE(waymark_push_row(started, motion, WM_TIME_NONE, WM_TIME_NONE, kRow, 3, &err), WM_OUT_OF_RANGE, "not a time");
  MISUSE(waymark_push_row(started, motion, NS(1), INT64_MAX, kRow, 3, &err), WM_OUT_OF_RANGE, "arrival_ns");
  MISUSE(waymark_advance(started, INT64_MAX, &err), WM_OUT_OF_RANGE, "is not a time");
  MISUSE(waymark_pose(started, INT64_MIN, &pose, sizeof pose, &err), WM_OUT_OF_RANGE, "is not a time");
  MISUSE(waymark_push_can(started, INT64_MAX, "can0", 1, 0, "", 0, &err), WM_OUT_OF_RANGE, "is not a time");
  MISUSE(row(started, motion, 61, 0.5, NANV, 0), WM_OUT_OF_RANGE, "motion: t_ns: 60.000 s ahead of the newest time");
  MISUSE(waymark_pose(started, NS(3601), &pose, sizeof pose, &err), WM_OUT_OF_RANGE, "3600.000 s ahead");
  MISUSE(waymark_advance(started, NS(3601), &err), WM_OUT_OF_RANGE, "at most 10 s can be");
  MISUSE(waymark_pose(started, NS(-10), &pose, sizeof pose, &err), WM_TIME_RAN_BACK,
         "now_ns: 11.000 s behind the newest");
  MISUSE(waymark_advance(started, NS(-3600), &err), WM_TIME_RAN_BACK, "is it of another clock?");
  MISUSE(arrives(1, -3600), WM_TIME_RAN_BACK, "motion: arrival_ns: 3601.000 s behind");
  MISUSE(arrives(1, 61), WM_OUT_OF_RANGE, "motion: arrival_ns: 60.000 s ahead");
  MISUSE(arrives(1.7e9, 1), WM_OUT_OF_RANGE, "later than its arrival");
  MISUSE(arrives(3, 1), WM_OUT_OF_RANGE, "its stamp is 2.000 s later than its arrival");
  MISUSE(arrives(-3600, 1), WM_TIME_RAN_BACK, "3601.000 s behind the newest time of this session: is one of another");
  MISUSE(row(started, motion, 0.1, 0.5, NANV, 0), WM_TIME_RAN_BACK, "push in the order of the stamps");
  MISUSE(row(started, motion, 1, 0.5, NANV, 0), WM_BAD_DATA, "the same datum was pushed before");
}

// ── the tests ───────────────────────────────────────────────────────────────────────────────────────────────────────

// With every source that its estimator takes; odometry up to 1 s.
static waymark_session *start_with_all(void) {
  static const char *const kNames[] = {"motion",     "sightings:eye", "gnss",    "heading",
                                       "increments", "markers:eye",   "commands"};
  uint32_t *const numbers[] = {&motion, &eye, &gnss, &heading, &increments, &markers, &commands};
  waymark_session *session = open_session();
  for (size_t i = 0; i < sizeof kNames / sizeof kNames[0]; i++)
    ok(waymark_add_source(session, kNames[i], numbers[i], &err));
  ok(waymark_start(session, &err));
  for (int i = 0; i <= 50; i++) ok(row(session, motion, i * 0.02, 0.5, NANV, 0));
  return session;
}

// With odometry and one more source.
static waymark_session *start_other(const char *changes, const char *source, uint32_t *out) {
  waymark_session *session = NULL;
  const waymark_options options = {.bytes = sizeof options, .config = config, .site = dir, .changes = changes};
  ok(waymark_open(&options, &session, &err));
  ok(waymark_add_source(session, "motion", out, &err));
  ok(waymark_add_source(session, source, out, &err));
  ok(waymark_start(session, &err));
  return session;
}

void setUp(void) {
  robot_write();
  closed = open_session();
  ok(waymark_close(closed, &err));
  fresh = open_session();
  started = start_with_all();
  of_pair = start_other("estimator: stereo_ekf", "stereo", &stereo);
  robot_map(20, 15);
  of_map = start_other("estimator: edge_mcl", "points", &points);

  char log[320];
  waymark_session *writer = NULL;
  char out[300];
  (void)snprintf(out, sizeof out, "%s/logged", dir), (void)snprintf(log, sizeof log, "%s/events.wmlog", out);
  const waymark_options options = {.bytes = sizeof options, .config = config, .site = dir, .out = out};
  ok(waymark_open(&options, &writer, &err));
  ok(waymark_add_source(writer, "motion", &number, &err));
  ok(waymark_start(writer, &err));
  ok(row(writer, number, 0, 0.5, NANV, 0));
  ok(waymark_close(writer, &err));
  ok(waymark_log_open(log, &closed_log, &err));
  waymark_log_close(closed_log);
  ok(waymark_log_open(log, &opened_log, &err));
}

void tearDown(void) {
  waymark_log_close(opened_log);
  waymark_log_close(closed_log);  // again: no effect
  ok(waymark_close(fresh, &err));
  ok(waymark_close(started, &err));
  ok(waymark_close(of_pair, &err));
  ok(waymark_close(of_map, &err));
  folder_remove();
}

TEST(test_each_misuse_has_a_status_and_a_text) {
  row_count = 0;
  misuse_handles(), misuse_pointers(), misuse_order_and_sizes(), misuse_numbers(), misuse_times();
  size_t wrong = 0;
  for (size_t i = 0; i < row_count; i++) {
    const row_of_table *r = &rows[i];
    const int is_right = r->status == r->wanted && r->text[0] && strstr(r->text, r->words);
    wrong += !is_right;
    (void)printf("%s%-34s %-90s %s\n", is_right ? "  " : "! ", wm_status_text(r->status), r->call, r->text);
    if (!is_right) (void)printf("    wanted: %s, \"%s\"\n", wm_status_text(r->wanted), r->words);
  }
  (void)printf("%zu misuses\n", row_count);
  TEST_ASSERT_EQUAL_size_t(0, wrong);
  TEST_ASSERT_GREATER_OR_EQUAL_size_t(100, row_count);
  // Names have no status: "" where there are none.
  const waymark_session *no_session[] = {NULL, closed, (waymark_session *)(void *)opened_log};
  for (size_t i = 0; i < 3; i++) TEST_ASSERT_EQUAL_STRING("", waymark_source_name(no_session[i], 0));
  for (size_t i = 0; i < 3; i++) TEST_ASSERT_EQUAL_STRING("", waymark_floor_name(no_session[i], 0));
  const waymark_log *no_log[] = {NULL, closed_log, (waymark_log *)(void *)started};
  for (size_t i = 0; i < 3; i++) {
    TEST_ASSERT_EQUAL_STRING("", waymark_log_source_name(no_log[i], 0));
    TEST_ASSERT_EQUAL_STRING("", waymark_log_sensor_name(no_log[i], 0));
    TEST_ASSERT_EQUAL_STRING("", waymark_log_get_text(no_log[i], WAYMARK_LOG_CONFIG));
  }
  TEST_ASSERT_EQUAL_STRING("", waymark_log_get_text(opened_log, (waymark_log_text)77));
  TEST_ASSERT_EQUAL_STRING("?", waymark_name((waymark_names)77, 0));
  // What was refused has changed nothing: the pose is that of a session which was never misused.
  waymark_session *const misused = started;
  started = start_with_all();
  ok(row(started, motion, 1.02, 0.5, NANV, 0));
  ok(row(misused, motion, 1.02, 0.5, NANV, 0));
  wm_published other;
  ok(waymark_pose(started, NS(1.3), &pose, sizeof pose, &err));
  ok(waymark_pose(misused, NS(1.3), &other, sizeof other, &err));
  TEST_ASSERT_EQUAL_MEMORY(&pose.now.pose_map_base, &other.now.pose_map_base, sizeof pose.now.pose_map_base);
  TEST_ASSERT_EQUAL(pose.now.state, other.now.state);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.65, pose.now.pose_map_base.p_m[0]);
  ok(waymark_close(misused, &err));
}

TEST(test_many_handles) {
  waymark_session *sessions[1100] = {NULL};
  size_t open = 0;
  wm_status status = WM_OK;
  while (open < 1100 && (status = open_into(&sessions[open])) == WM_OK) open++;
  TEST_ASSERT_EQUAL(WM_FULL, status);
  TEST_ASSERT_NOT_NULL(strstr(err.text, "close those that are done"));
  TEST_ASSERT_GREATER_THAN_size_t(1000, open);
  for (size_t i = 0; i < open; i++) ok(waymark_close(sessions[i], &err));
  for (int i = 0; i < 3000; i++) ok(waymark_close(open_session(), &err));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_start(sessions[0], &err));
}

static void *hammer(void *context) {
  wm_error mine;
  size_t *counts = context;
  for (int i = 0; i < 20000; i++) {
    const wm_status status = waymark_advance(started, NS(1), &mine);
    counts[status == WM_OK ? 0 : status == WM_BAD_USAGE ? 1 : 2]++;
  }
  return NULL;
}

TEST(test_two_threads_with_one_handle_are_told) {
  size_t counts[2][3] = {{0}};
  pthread_t threads[2];
  for (int i = 0; i < 2; i++) TEST_ASSERT_EQUAL(0, pthread_create(&threads[i], NULL, hammer, counts[i]));
  for (int i = 0; i < 2; i++) TEST_ASSERT_EQUAL(0, pthread_join(threads[i], NULL));
  TEST_ASSERT_EQUAL_size_t(0, counts[0][2] + counts[1][2]);
  TEST_ASSERT_EQUAL_size_t(40000, counts[0][0] + counts[0][1] + counts[1][0] + counts[1][1]);
  TEST_ASSERT_GREATER_THAN_size_t(0, counts[0][0] + counts[1][0]);
}
