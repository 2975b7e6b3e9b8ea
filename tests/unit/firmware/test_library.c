// SPDX-License-Identifier: Apache-2.0
// A session gives what the replay of the same data gives, bit by bit: rows, events, CAN frames, pictures. Then changed
// values, event logs, sizes and refusals.
#include <unistd.h>

#include "library_robot.h"
#include "rt/memory.h"
#include "waymark/codec.h"

static uint32_t source;

// Hash and count of the records by kind.
typedef struct taken {
  uint64_t hash[WAYMARK_RECORD_BOUND + 1], count[WAYMARK_RECORD_BOUND + 1];
  wm_estimate last;
} taken;

static void take(void *context, waymark_record kind, const void *record, size_t bytes) {
  static uint8_t encoded[WM_EVENT_ENCODED_MAX];
  taken *self = context;
  uint64_t *hash = &self->hash[kind];
  self->count[kind]++;
  (void)bytes;
  if (kind == WAYMARK_RECORD_EVENT) {
    *hash = wm_hash(*hash, encoded, wm_event_encode(record, encoded, sizeof encoded));
  } else if (kind == WAYMARK_RECORD_INNOVATION) {
    *hash = wm_hash(*hash, encoded, wm_innovation_encode(record, encoded, sizeof encoded));
  } else if (kind == WAYMARK_RECORD_FUSED) {
    const wm_estimate *e = record;
    self->last = *e;
    *hash = wm_hash(*hash, &e->t_ns, sizeof e->t_ns);
    *hash = wm_hash(*hash, &e->pose_map_base, sizeof e->pose_map_base);
    *hash = wm_hash(*hash, e->covariance, sizeof e->covariance);
  }
}

void setUp(void) { robot_write(); }
void tearDown(void) { folder_remove(); }

static waymark_session *open_taking(taken *into, const char *changes, const char *out) {
  waymark_session *session;
  const waymark_options options = {.bytes = sizeof options,
                                   .config = config,
                                   .changes = changes,
                                   .site = dir,
                                   .out = out,
                                   .seed = 1,
                                   .take = take,
                                   .context = into};
  memset(into, 0, sizeof *into);
  ok(waymark_open(&options, &session, &err));
  return session;
}

static void replay(taken *into, const char *input, const char *changes, const char *out) {
  waymark_report report;
  const waymark_replay_options options = {.bytes = sizeof options,
                                          .input = input,
                                          .config = input == dir ? config : NULL,
                                          .changes = changes,
                                          .out = out,
                                          .seed = 1,
                                          .take = take,
                                          .context = into};
  memset(into, 0, sizeof *into);
  ok(waymark_replay(&options, &report, sizeof report, &err));
  TEST_ASSERT_EQUAL_UINT64(into->count[WAYMARK_RECORD_FUSED], report.poses);
  TEST_ASSERT_EQUAL_UINT64(into->count[WAYMARK_RECORD_EVENT], report.events);
}

static void same(const taken *a, const taken *b) {
  for (int kind = WAYMARK_RECORD_EVENT; kind <= WAYMARK_RECORD_INNOVATION; kind++) {
    TEST_ASSERT_GREATER_THAN_UINT64(5, a->count[kind]);
    TEST_ASSERT_EQUAL_UINT64(a->count[kind], b->count[kind]);
    TEST_ASSERT_EQUAL_UINT64(a->hash[kind], b->hash[kind]);
  }
}

// ── rows and events ─────────────────────────────────────────────────────────────────────────────────────────────────

#define STEPS 400      // of 20 ms: 8 s
#define FIRST_POSE 20  // step: lateness_max_ms after the first datum, nothing is final before
#define STEP_NS (20 * WM_NS_PER_MS)

static wm_event sighting_at(int i) {
  const double x = 5.0 - 0.01 * i - 0.1, y = i % 2 ? 1.0 : -3.0;
  wm_event e = {.t_ns = i * STEP_NS,
                .arrival_ns = i * STEP_NS + 70 * WM_NS_PER_MS,
                .kind = WM_EVENT_SIGHTING,
                .as.sighting = wm_sighting_without_numbers()};
  e.as.sighting.landmark_id = i % 2 ? 1 : 2;
  e.as.sighting.bearing_rad = round(1e6 * atan2(y, x)) / 1e6;
  e.as.sighting.range_m = round(1e6 * sqrt(x * x + y * y)) / 1e6;
  return e;
}

static void write_rows(void) {
  static char motion[STEPS * 40], sightings[STEPS * 80];
  size_t m = (size_t)sprintf(motion, "t_ns,v_mps,w_radps\n");
  size_t s = (size_t)sprintf(sightings, "t_ns,sensor,id,bearing_rad,range_m,arrival_ns\n");
  for (int i = 0; i < STEPS; i++) {
    m += (size_t)sprintf(motion + m, "%lld,0.5,0\n", (long long)(i * STEP_NS));
    if (i % 5) continue;
    const wm_event e = sighting_at(i);
    s += (size_t)sprintf(sightings + s, "%lld,eye,%d,%.6f,%.6f,%lld\n", (long long)e.t_ns, e.as.sighting.landmark_id,
                         e.as.sighting.bearing_rad, e.as.sighting.range_m, (long long)e.arrival_ns);
  }
  folder_write("motion.csv", motion);
  folder_write("sightings.csv", sightings);
}

// In the order of the arrivals: a sighting comes 70 ms after its stamp.
static void push_rows(waymark_session *session) {
  uint32_t motion, eye;
  ok(waymark_add_source(session, "motion", &motion, &err));
  ok(waymark_add_source(session, "sightings:eye", &eye, &err));
  ok(waymark_start(session, &err));
  const int64_t allocations = wm_allocations_of_this_thread();
  for (int i = 0; i < STEPS + 4; i++) {
    const double row[3] = {0.5, (double)NAN, 0.0};
    wm_published pose;
    if (i < STEPS) ok(waymark_push_row(session, motion, i * STEP_NS, WM_TIME_NONE, row, 3, &err));
    const int seen = i - 3;  // its arrival lies between rows i and i + 1
    if (seen >= 0 && seen < STEPS && seen % 5 == 0) {
      const wm_event e = sighting_at(seen);
      ok(waymark_push_event(session, eye, &e, sizeof e, &err));
    }
    const wm_status status = waymark_pose(session, i * STEP_NS + 15 * WM_NS_PER_MS, &pose, sizeof pose, &err);
    TEST_ASSERT_TRUE(status == WM_OK || status == WM_AGAIN);
    if (i > FIRST_POSE) TEST_ASSERT_EQUAL(WM_OK, status);
  }
  TEST_ASSERT_EQUAL_INT64(allocations, wm_allocations_of_this_thread());
}

TEST(test_rows_and_events_give_the_replay_s_bits) {
  taken pushed, replayed;
  write_rows();
  waymark_session *session = open_taking(&pushed, NULL, NULL);
  push_rows(session);
  wm_health health;
  ok(waymark_health(session, &health, sizeof health, &err));
  TEST_ASSERT_EQUAL(2, health.source_count);
  TEST_ASSERT_EQUAL_STRING("sightings:eye", waymark_source_name(session, 1));
  TEST_ASSERT_EQUAL_UINT64(STEPS / 5, health.sources[1].received);
  TEST_ASSERT_EQUAL_STRING("tracking", waymark_name(WAYMARK_NAMES_STATE, health.state));
  wm_bound bound;
  ok(waymark_bound(session, &bound, sizeof bound, &err));
  TEST_ASSERT_EQUAL_INT64((STEPS + 3) * STEP_NS + 15 * WM_NS_PER_MS, bound.t_ns);
  TEST_ASSERT_EQUAL_DOUBLE(1e-4, bound.risk);
  TEST_ASSERT_EQUAL(1, bound.usable);
  TEST_ASSERT_EQUAL_STRING("", waymark_name(WAYMARK_NAMES_UNUSABLE, bound.why));
  ok(waymark_close(session, &err));
  replay(&replayed, dir, NULL, NULL);
  same(&pushed, &replayed);
  TEST_ASSERT_EQUAL_UINT64(pushed.count[WAYMARK_RECORD_PUBLISHED], pushed.count[WAYMARK_RECORD_BOUND]);
  TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.5 * (STEPS - 1) * 0.02, pushed.last.pose_map_base.p_m[0]);
  TEST_ASSERT_GREATER_THAN_UINT64(STEPS - FIRST_POSE, pushed.count[WAYMARK_RECORD_PUBLISHED]);
}

TEST(test_files_of_a_session_are_a_run_and_its_log_gives_the_same_bits) {
  taken pushed, again;
  char out[300], log[320];
  (void)snprintf(out, sizeof out, "%s/out", dir);
  (void)snprintf(log, sizeof log, "%s/events.wmlog", out);
  waymark_session *session = open_taking(&pushed, NULL, out);
  push_rows(session);
  ok(waymark_close(session, &err));
  replay(&again, log, NULL, NULL);
  same(&pushed, &again);
  TEST_ASSERT_EQUAL(0, access(folder_path("out/health.json"), F_OK));

  waymark_log *reader;
  wm_event event;
  uint64_t events = 0, missing = 0;
  ok(waymark_log_open(log, &reader, &err));
  TEST_ASSERT_EQUAL_STRING("landmark_ekf", waymark_log_get_text(reader, WAYMARK_LOG_ESTIMATOR));
  TEST_ASSERT_EQUAL_STRING("motion", waymark_log_source_name(reader, 0));
  TEST_ASSERT_EQUAL_STRING("eye", waymark_log_sensor_name(reader, 0));
  TEST_ASSERT_EQUAL_STRING("", waymark_log_sensor_name(reader, 1));
  TEST_ASSERT_NOT_NULL(strstr(waymark_log_get_text(reader, WAYMARK_LOG_CONFIG), "landmark_ekf"));
  wm_status status;
  while ((status = waymark_log_next(reader, &event, sizeof event, &missing, &err)) == WM_OK) events++;
  TEST_ASSERT_EQUAL(WM_END, status);
  TEST_ASSERT_EQUAL_UINT64(pushed.count[WAYMARK_RECORD_EVENT], events);
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_log_next(reader, &event, sizeof event - 8, NULL, &err));
  waymark_log_close(reader);
}

TEST(test_a_changed_value_changes_what_it_should) {
  taken one, other, back;
  write_rows();
  replay(&one, dir, NULL, NULL);
  replay(&other, dir, "sightings.noise.bearing_factor: 3\n\nmotion.noise.speed_mps: 0.3", NULL);
  TEST_ASSERT_EQUAL_UINT64(one.count[WAYMARK_RECORD_EVENT], other.count[WAYMARK_RECORD_EVENT]);
  TEST_ASSERT_TRUE(one.hash[WAYMARK_RECORD_FUSED] != other.hash[WAYMARK_RECORD_FUSED]);
  replay(&back, dir, "estimator: landmark_ekf", NULL);
  same(&one, &back);
}

// ── CAN ─────────────────────────────────────────────────────────────────────────────────────────────────────────────

static void can_data(int i, uint8_t data[8]) {
  const int32_t ticks = 32 * i;
  for (int k = 0; k < 8; k++) data[k] = (uint8_t)(ticks >> (8 * (k % 4)));
}

TEST(test_can_frames_give_the_replay_s_bits) {
  static char log[STEPS * 60];
  taken pushed, replayed;
  size_t n = 0;
  folder_write("vehicle.dbc",
               "VERSION \"\"\n\nBU_: A\n\nBO_ 256 ODOMETRY: 8 A\n"
               " SG_ LEFT : 0|32@1- (1,0) [0|0] \"\" A\n SG_ RIGHT : 32|32@1- (1,0) [0|0] \"\" A\n");
  folder_write("can-signals.yaml",
               "- {quantity: wheel_ticks_left, message: ODOMETRY, signal: LEFT}\n"
               "- {quantity: wheel_ticks_right, message: ODOMETRY, signal: RIGHT}\n");
  folder_write("robot.yaml", "format: waymark-config/1\nestimator: odometry\n");
  uint8_t data[8];
  for (int i = 0; i < STEPS; i++) {
    can_data(i, data);
    n += (size_t)sprintf(log + n, "(%d.%06d) can0 100#", i / 50, i % 50 * 20000);
    for (int k = 0; k < 8; k++) n += (size_t)sprintf(log + n, "%02X", data[k]);
    n += (size_t)sprintf(log + n, "\n");
  }
  folder_write("can.log", log);
  waymark_session *session = open_taking(&pushed, NULL, NULL);
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, waymark_add_source(session, "can:can7", &source, &err));
  ok(waymark_add_source(session, "can", &source, &err));
  ok(waymark_start(session, &err));
  for (int i = 0; i < STEPS; i++) {
    can_data(i, data);
    ok(waymark_push_can(session, i * STEP_NS, "can0", 0x100, 0, data, 8, &err));
    ok(waymark_push_can(session, i * STEP_NS, "can0", 0x123, 0, data, 8, &err));  // of nobody
  }
  TEST_ASSERT_EQUAL(WM_BAD_DATA, waymark_push_can(session, STEPS * STEP_NS, "can0", 0x100, 0, data, 1, &err));
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "can: "), err.text);
  static wm_health health;
  ok(waymark_health(session, &health, sizeof health, &err));
  TEST_ASSERT_EQUAL_UINT64(1, health.sources[0].malformed);
  TEST_ASSERT_EQUAL_STRING(err.text, health.refused_because[0]);
  TEST_ASSERT_EQUAL(WM_BAD_DATA, waymark_push_can(session, 0, "can0", 0x800, 0, data, 8, &err));
  TEST_ASSERT_EQUAL(WM_BAD_DATA, waymark_push_can(session, 0, "can0", 0x100, 0, data, 65, &err));
  ok(waymark_close(session, &err));
  replay(&replayed, dir, NULL, NULL);
  TEST_ASSERT_EQUAL_UINT64(pushed.hash[WAYMARK_RECORD_EVENT], replayed.hash[WAYMARK_RECORD_EVENT]);
  TEST_ASSERT_EQUAL_UINT64(pushed.hash[WAYMARK_RECORD_FUSED], replayed.hash[WAYMARK_RECORD_FUSED]);
  TEST_ASSERT_EQUAL_UINT64(STEPS, pushed.count[WAYMARK_RECORD_FUSED]);
}

// ── pictures ────────────────────────────────────────────────────────────────────────────────────────────────────────

#define W 320
#define H 180
#define PICTURES 12

// A wall that comes nearer, or nothing at all in every third picture; as an uncompressed picture.
static void draw(int i, uint8_t *pixels) {
  for (int k = 0; k < W * H; k++) pixels[k] = (uint8_t)(i % 3 == 2 ? 100 + i : k / W < 90 + i ? 60 : 150);
}

static void put32(uint8_t *at, uint32_t value) {
  for (int i = 0; i < 4; i++) at[i] = (uint8_t)(value >> (8 * i));
}

static uint8_t *put_text(uint8_t *at, const char *text) {
  while (*text) *at++ = (uint8_t)*text++;
  return at;
}

static uint8_t *put_head(uint8_t *at, const char *name, uint32_t bytes) {
  put32(put_text(at, name), bytes);
  return at + strlen(name) + 4;
}

// Y800 in AVI: lists of headers, then a chunk a picture.
static void write_video(void) {
  enum { STRF = 40, STRH = 56, AVIH = 56, STRL = 4 + 8 + STRH + 8 + STRF, HDRL = 4 + 8 + AVIH + 8 + STRL };
  enum { MOVI = 4 + PICTURES * (8 + W * H), ALL = 12 + 8 + HDRL + 8 + MOVI };
  uint8_t *file = calloc(1, ALL), *at = file;
  TEST_ASSERT_NOT_NULL(file);
  at = put_text(put_head(at, "RIFF", ALL - 8), "AVI ");
  at = put_head(put_head(at, "LIST", HDRL), "hdrlavih", AVIH);
  put32(at + 16, PICTURES), put32(at + 24, 1), put32(at + 32, W), put32(at + 36, H), at += AVIH;
  at = put_head(put_head(at, "LIST", STRL), "strlstrh", STRH);
  (void)put_text(at, "vidsY800"), put32(at + 20, 1), put32(at + 24, 10), at += STRH;
  at = put_head(at, "strf", STRF);
  put32(at, STRF), put32(at + 4, W), put32(at + 8, H), put32(at + 12, 1 | 8 << 16);
  (void)put_text(at + 16, "Y800"), put32(at + 20, W * H), at += STRF;
  at = put_text(put_head(at, "LIST", MOVI), "movi");
  for (int i = 0; i < PICTURES; i++) {
    at = put_head(at, "00db", W * H);
    draw(i, at);
    at += W * H;
  }
  folder_write_bytes("video/front.avi", (const char *)file, ALL);
  free(file);
  char rows[PICTURES * 60];
  size_t n = (size_t)sprintf(rows, "frame,t_ns,exposure_ns,arrival_ns\n");
  for (int i = 0; i < PICTURES; i++)
    n += (size_t)sprintf(rows + n, "%d,%d,0,%d\n", i, 100000000 * (i + 1), 100000000 * (i + 1) + 30000000);
  folder_write("video/front.csv", rows);
}

TEST(test_pictures_give_the_replay_s_bits) {
  static uint8_t pixels[W * H];
  static char motion[70 * 40];
  taken pushed, replayed;
  size_t n = (size_t)sprintf(motion, "t_ns,v_mps,w_radps\n");
  for (int i = 0; i < 65; i++) n += (size_t)sprintf(motion + n, "%d,0.1,0\n", 20000000 * i);
  folder_write("motion.csv", motion);
  folder_write("calibration.yaml",
               "cameras:\n  front: {model: equidistant, size: [320, 180], intrinsics: [130, 130, 160, 90], "
               "distortion: [0, 0, 0, 0], mounting: {xyz_m: [0.5, 0, 0.4], rpy_deg: [0, 22, 0]}}\n");
  write_video();
  robot_map(100, 80);
  folder_write("robot.yaml", "format: waymark-config/1\nestimator: edge_mcl\nvision: {edges: {}}\n");
  waymark_session *session = open_taking(&pushed, NULL, NULL);
  uint32_t to;
  ok(waymark_add_source(session, "motion", &to, &err));
  ok(waymark_start(session, &err));
  wm_frame frame = {.width_px = W, .height_px = H, .stride_bytes = W, .grey = pixels, .arrival_ns = WM_TIME_NONE};
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, waymark_push_picture(session, "rear", &frame, sizeof frame, &err));
  for (int i = 0; i < 65 + 5; i++) {
    const double row[3] = {0.1, (double)NAN, 0.0};
    if (i < 65) ok(waymark_push_row(session, to, 20000000 * i, WM_TIME_NONE, row, 3, &err));
    const int k = (i - 1) / 5 - 1;  // arrives 30 ms after its stamp, between rows 5 (k + 1) + 1 and + 2
    if (i % 5 != 1 || k < 0 || k >= PICTURES) continue;
    draw(k, pixels);
    frame.t_ns = 100000000 * (k + 1);
    frame.arrival_ns = frame.t_ns + 30000000;
    ok(waymark_push_picture(session, "front", &frame, sizeof frame, &err));
  }
  frame.width_px = W / 2;
  TEST_ASSERT_EQUAL(WM_BAD_DATA, waymark_push_picture(session, "front", &frame, sizeof frame, &err));
  ok(waymark_close(session, &err));
  replay(&replayed, dir, NULL, NULL);
  TEST_ASSERT_EQUAL_UINT64(65 + PICTURES, replayed.count[WAYMARK_RECORD_EVENT]);
  same(&pushed, &replayed);
}

// ── what is refused ─────────────────────────────────────────────────────────────────────────────────────────────────

TEST(test_a_bound_asked_for_wrongly_is_refused) {
  taken into;
  wm_bound bound;
  waymark_session *session = open_taking(&into, NULL, NULL);
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_bound(NULL, &bound, sizeof bound, &err));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_bound(session, &bound, sizeof bound, &err));  // not started
  ok(waymark_add_source(session, "sightings:eye", &source, &err));
  ok(waymark_add_source(session, "motion", &source, &err));
  ok(waymark_start(session, &err));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_bound(session, NULL, sizeof bound, &err));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_bound(session, &bound, sizeof bound + 8, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "waymark_bound"));
  TEST_ASSERT_EQUAL(WM_AGAIN, waymark_bound(session, &bound, sizeof bound, &err));  // without a pose
  ok(waymark_close(session, &err));
  TEST_ASSERT_EQUAL(WM_BAD_DATA, waymark_read_bound("", 0, &bound, sizeof bound, &err));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_read_bound(NULL, 10, &bound, sizeof bound, &err));
}

TEST(test_sizes_are_checked) {
  taken into;
  waymark_session *session;
  struct {
    waymark_options options;
    uint64_t further;  // of a program with a newer header
  } newer = {{.bytes = sizeof newer, .config = config, .site = dir}, 1};
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_open(&newer.options, &session, &err));
  TEST_ASSERT_NULL(session);
  TEST_ASSERT_NOT_NULL(strstr(err.text, "lacks"));
  newer.further = 0;
  ok(waymark_open(&newer.options, &session, &err));
  ok(waymark_close(session, &err));
  newer.options.bytes = SIZE_MAX;
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_open(&newer.options, &session, &err));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_open(NULL, &session, &err));
  waymark_options options = {.bytes = offsetof(waymark_options, take), .config = config};  // with an older header
  options.site = dir;
  ok(waymark_open(&options, &session, &err));
  ok(waymark_close(session, &err));

  session = open_taking(&into, NULL, NULL);
  ok(waymark_add_source(session, "sightings:eye", &source, &err));
  const wm_event event = sighting_at(0);
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_push_event(session, source, &event, sizeof event, &err));  // not started
  uint32_t motion;
  ok(waymark_add_source(session, "motion", &motion, &err));
  ok(waymark_start(session, &err));
  wm_published pose;
  wm_health health;
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_pose(session, 0, &pose, sizeof pose - 8, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "waymark_pose"));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_health(session, &health, sizeof health + 8, &err));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_push_event(session, source, &event, sizeof event + 8, &err));
  TEST_ASSERT_EQUAL(WM_AGAIN, waymark_pose(session, 0, &pose, sizeof pose, &err));
  // A program of 0.2 knows the beginning of wm_health: that is filled, and nothing behind it.
  const size_t known = offsetof(wm_health, more_count);
  memset(&health, 0x55, sizeof health);
  ok(waymark_health(session, &health, known, &err));
  TEST_ASSERT_EQUAL(2, health.source_count);
  TEST_ASSERT_EACH_EQUAL_HEX8(0x55, (char *)&health + known, sizeof health - known);
  ok(waymark_close(session, &err));
}

TEST(test_data_that_cannot_be_are_refused_and_change_nothing) {
  taken into;
  waymark_session *session = open_taking(&into, NULL, NULL);
  uint32_t motion, eye;
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, waymark_add_source(session, "sonar", &motion, &err));
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, waymark_add_source(session, "sightings:", &motion, &err));
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, waymark_start(session, &err));  // no data at all
  ok(waymark_add_source(session, "motion", &motion, &err));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_add_source(session, "motion", &motion, &err));
  ok(waymark_add_source(session, "sightings:eye", &eye, &err));
  ok(waymark_start(session, &err));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_start(session, &err));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_add_source(session, "gnss", &motion, &err));

  const double fast[3] = {1e9, (double)NAN, 0.0}, row[4] = {0.5, (double)NAN, 0.0, 0.0};
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, waymark_push_row(session, motion, 0, WM_TIME_NONE, fast, 3, &err));
  TEST_ASSERT_EQUAL(WM_NOT_FINITE, waymark_push_row(session, motion, 0, WM_TIME_NONE, row, 1, &err));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_push_row(session, motion, 0, WM_TIME_NONE, row, 4, &err));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_push_row(session, eye, 0, WM_TIME_NONE, row, 3, &err));
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, waymark_push_row(session, 7, 0, WM_TIME_NONE, row, 3, &err));
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, waymark_push_row(session, motion, INT64_MAX, WM_TIME_NONE, row, 3, &err));
  wm_event event = sighting_at(0);
  event.kind = WM_EVENT_POSITION;
  TEST_ASSERT_EQUAL(WM_BAD_DATA, waymark_push_event(session, eye, &event, sizeof event, &err));
  event.kind = 200;
  TEST_ASSERT_EQUAL(WM_BAD_DATA, waymark_push_event(session, eye, &event, sizeof event, &err));
  TEST_ASSERT_EQUAL_UINT64(0, into.count[WAYMARK_RECORD_EVENT]);
  ok(waymark_push_row(session, motion, 0, WM_TIME_NONE, row, 3, &err));
  ok(waymark_advance(session, WM_NS_PER_S, &err));
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, waymark_advance(session, INT64_MAX, &err));
  TEST_ASSERT_EQUAL_UINT64(1, into.count[WAYMARK_RECORD_EVENT]);
  ok(waymark_close(session, &err));
}

TEST(test_errors_have_a_place) {
  waymark_session *session;
  waymark_report report;
  waymark_options options = {.bytes = sizeof options, .config = "/nowhere/robot.yaml"};
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, waymark_open(&options, &session, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "/nowhere/robot.yaml"));
  options.config = config;
  options.changes = "landmark_ekf";
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_open(&options, &session, &err));
  options.changes = "motion.noise.sped_mps: 1";
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, waymark_open(&options, &session, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "sped_mps"));
  waymark_replay_options how = {.bytes = sizeof how, .input = dir};
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_replay(&how, &report, sizeof report, &err));
  how.input = config;  // no event log
  TEST_ASSERT_EQUAL(WM_BAD_DATA, waymark_replay(&how, &report, sizeof report, &err));
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, waymark_replay(&how, &report, 8, &err));
  wm_published pose;
  TEST_ASSERT_EQUAL(WM_BAD_DATA, waymark_read_pose("abc", 3, &pose, sizeof pose, &err));
  ok(waymark_close(NULL, &err));
  TEST_ASSERT_EQUAL_STRING("?", waymark_name(WAYMARK_NAMES_VERDICT, 99));
}
