// SPDX-License-Identifier: Apache-2.0
// What our encoder writes, the decoders that lcm-gen makes read back.
#include <ctype.h>

#include "common/suite.h"
#include "waymark/event_fields.h"
#include "waymark/lcm_messages.h"
#include "waymark_health_t.h"
#include "waymark_innovation_t.h"
#include "waymark_landmarks_t.h"
#include "waymark_observations_t.h"
#include "waymark_pose_t.h"
#include "waymark_set_pose_t.h"

static uint8_t bytes[WM_LCM_MESSAGE_MAX];

// What is read of a message of sightings, and why not.
static wm_sighting seen[WM_LCM_OBSERVATIONS_MAX];
static size_t seen_count;
static const char *read_sightings(size_t length) {
  char sensor[WM_NAME_MAX];
  wm_time_ns t_ns;
  return wm_lcm_read_sightings(bytes, length, sensor, &t_ns, seen, &seen_count);
}

TEST(a_pose_arrives_whole) {
  wm_published p = {.made_ns = 11,
                    .fused_until_ns = 7,
                    .jumps = 3,
                    .last_jump_m = 0.5,
                    .status_flags = WM_PUB_JUMPED,
                    .pose_odom_base = {1, 2, 3},
                    .deadlines_missed = 4,
                    .utc_offset_ns = 5,
                    .utc_uncertainty_ns = -1};
  p.now.t_ns = INT64_C(1234567890123456789);
  p.now.state = WM_STATE_DEAD_RECKONING;
  p.now.dof = 3;
  p.now.lost_probability = 0.25;
  for (int i = 0; i < 36; i++) p.now.covariance[i] = i;
  p.now.pose_map_base.q_xyzw[3] = 1;
  size_t length = wm_lcm_pose(&p, 12, bytes, sizeof bytes);
  waymark_pose_t m;
  TEST_ASSERT_EQUAL(length, waymark_pose_t_decode(bytes, 0, (int)length, &m));
  TEST_ASSERT_EQUAL_INT64(INT64_C(1234567890123456789), m.t_ns);
  TEST_ASSERT_EQUAL_DOUBLE(8, m.covariance[1][2]);
  TEST_ASSERT_EQUAL(WAYMARK_POSE_T_STATE_DEAD_RECKONING, m.state);
  TEST_ASSERT_EQUAL(WAYMARK_POSE_T_STATUS_JUMPED, m.status_flags);
  TEST_ASSERT_EQUAL(3, m.jumps);
  TEST_ASSERT_EQUAL_DOUBLE(0.25, m.lost_probability);
  TEST_ASSERT_EQUAL_DOUBLE(3, m.odom_heading_rad);
  TEST_ASSERT_EQUAL_INT64(-1, m.utc_uncertainty_ns);
  TEST_ASSERT_EQUAL_INT64(11, m.made_ns);
  TEST_ASSERT_EQUAL_INT64(12, m.sent_ns);
  TEST_ASSERT_EQUAL(0, wm_lcm_pose(&p, 12, bytes, length - 1));
}

TEST(health_arrives_with_its_sources) {
  static wm_health h;
  h = (wm_health){.t_ns = 1, .source_count = 2, .calibration_count = 1, .loops = 77, .send_p99_ns = 8, .lines_lost = 9};
  strcpy(h.sources[1].name, "sightings:laser");
  h.sources[1].rejected[WM_REJECTED_GATE] = 5;
  h.sources[1].stale = 1;
  strcpy(h.calibration[0].name, "laser.yaw_rad");
  h.calibration[0].value = 0.08;
  h.lost_probability = 0.5;
  h.counter_count = 1;
  h.counters[0] = (wm_counter){WM_COUNTER_LANDMARKS_MOVED, 7, 3};
  size_t length = wm_lcm_health(&h, bytes, sizeof bytes);
  TEST_ASSERT_GREATER_THAN(0, length);
  static waymark_health_t m;
  TEST_ASSERT_EQUAL(length, waymark_health_t_decode(bytes, 0, (int)length, &m));
  TEST_ASSERT_EQUAL(2, m.source_count);
  TEST_ASSERT_EQUAL_STRING("sightings:laser", (const char *)m.sources[1].name);
  TEST_ASSERT_EQUAL_INT64(5, m.sources[1].rejected[WAYMARK_INNOVATION_T_REJECTED_GATE]);
  TEST_ASSERT_EQUAL_DOUBLE(0.08, m.calibration[0].value);
  TEST_ASSERT_EQUAL_INT64(77, m.loops);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, m.lost_probability);
  TEST_ASSERT_EQUAL(1, m.counter_count);
  TEST_ASSERT_EQUAL(WAYMARK_COUNTER_T_LANDMARKS_MOVED, m.counters[0].kind);
  TEST_ASSERT_EQUAL(7, m.counters[0].landmark_id);
  TEST_ASSERT_EQUAL_INT64(3, m.counters[0].count);
  TEST_ASSERT_EQUAL_INT64(8, m.send_p99_ns);
  TEST_ASSERT_EQUAL_INT64(9, m.lines_lost);
}

// Senders from before NaN stood for every absent number have elevations with a sigma of 0.
TEST(a_sighting_with_an_elevation_sigma_of_zero_has_no_elevation) {
  waymark_observations_t m = {.t_ns = 1, .count = 2, .elevation_sigma_rad = {0, 0.5}};
  strcpy((char *)m.sensor, "front");
  m.range_m[0] = m.range_m[1] = 1;
  TEST_ASSERT_NULL(read_sightings((size_t)waymark_observations_t_encode(bytes, 0, sizeof bytes, &m)));
  TEST_ASSERT_EQUAL(2, seen_count);
  TEST_ASSERT_DOUBLE_IS_NAN(seen[0].elevation_sigma_rad);
  TEST_ASSERT_TRUE(!wm_sighting_has_elevation(&seen[0]));
  TEST_ASSERT_TRUE(wm_sighting_has_elevation(&seen[1]));
}

// So many sightings as a message has room for, and no count beyond it.
TEST(counts_of_sightings_beyond_the_room_are_refused) {
  static waymark_observations_t m;
  m.t_ns = 1;
  for (int i = 0; i < WM_LCM_OBSERVATIONS_MAX; i++) m.range_m[i] = 1;
  const int32_t counts[] = {0, WM_LCM_OBSERVATIONS_MAX, -1, WM_LCM_OBSERVATIONS_MAX + 1, INT32_MIN, INT32_MAX};
  for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
    seen_count = 99;
    m.count = counts[i];
    const char *why = read_sightings((size_t)waymark_observations_t_encode(bytes, 0, sizeof bytes, &m));
    TEST_ASSERT_EQUAL_STRING(i < 2 ? NULL : "count is not in 0 to 64", why);
    TEST_ASSERT_EQUAL_size_t(i < 2 ? (size_t)counts[i] : 0, seen_count);
  }
}

// As a sender makes it whose name is not padded, or whose lists are short; and another type.
TEST(short_sightings_are_called_short) {
  static const waymark_observations_t kNone;
  const size_t length = (size_t)waymark_observations_t_encode(bytes, 0, sizeof bytes, &kNone);
  seen_count = 99;
  TEST_ASSERT_EQUAL_STRING(
      "is shorter than observations_t of this version: the name has 32 bytes, padded with zeros, and each list 64 "
      "numbers",
      read_sightings(length - 27));
  TEST_ASSERT_EQUAL_size_t(0, seen_count);
  bytes[0] ^= 1;
  TEST_ASSERT_EQUAL_STRING("is not an observations_t of this version", read_sightings(length));
  TEST_ASSERT_EQUAL_STRING("is not an observations_t of this version", read_sightings(0));
}

// By the table: what travels arrives, the rest is absent.
TEST(each_number_of_a_sighting_arrives) {
  wm_event sent = {.t_ns = 1, .kind = WM_EVENT_SIGHTING, .as.sighting = {.landmark_id = 7}};
  wm_sighting *given = &sent.as.sighting;
  double step = 0;
#define SET(member, need, least, most, limits, since, zero_until, message) \
  given->member = 0.5 * (fmax(least, -1) + fmin(most, 2)) + (step += 0.01);
  WM_SIGHTING_NUMBERS(SET)
  TEST_ASSERT_NULL(read_sightings(wm_lcm_observations("front", &sent, 1, bytes, sizeof bytes)));
  TEST_ASSERT_EQUAL(1, seen_count);
  TEST_ASSERT_EQUAL(7, seen[0].landmark_id);
#define IN_MESSAGE(member) TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(given->member, seen[0].member, #member);
#define NOT_IN_MESSAGE(member) TEST_ASSERT_TRUE_MESSAGE(isnan(seen[0].member), #member);
#define COMPARE(member, need, least, most, limits, since, zero_until, message) message(member)
  WM_SIGHTING_NUMBERS(COMPARE)
}

// ── constants ───────────────────────────────────────────────────────────────────────────────────────────────────────

// Whether a constant of this value stands in msgs/lcm/FILE: PREFIX and the name in upper case.
static void has_constant(const char *file, const char *prefix, const char *name, unsigned value) {
  char path[512], text[8192], wanted[100];
  snprintf(path, sizeof path, "%s/%s", WM_LCM_DIR, file);
  FILE *f = fopen(path, "r");
  TEST_ASSERT_NOT_NULL_MESSAGE(f, path);
  text[fread(text, 1, sizeof text - 1, f)] = '\0';
  fclose(f);
  snprintf(wanted, sizeof wanted, " %s%s = %u", prefix, name, value);
  for (char *c = wanted; *c; c++) *c = (char)toupper((unsigned char)*c);
  const char *at = strstr(text, wanted);
  TEST_ASSERT_TRUE_MESSAGE(at && !isdigit((unsigned char)at[strlen(wanted)]), wanted);
}

TEST(every_value_of_an_enum_has_its_constant) {
  for (unsigned i = 0; i < WM_RESIDUAL_COUNT; i++)
    has_constant("innovation_t.lcm", "RESIDUAL_", wm_residual_name(i), i);
  for (unsigned i = 0; i < WM_VERDICT_COUNT; i++)
    has_constant("innovation_t.lcm", i == WM_FUSED ? "" : "REJECTED_", wm_verdict_name(i), i);
  for (unsigned i = 0; i < WM_STATE_COUNT; i++) has_constant("pose_t.lcm", "STATE_", wm_state_name(i), i);
  for (unsigned i = WM_CAUSE_CONTRADICTED; i < WM_CAUSE_COUNT; i++)
    has_constant("pose_t.lcm", "CAUSE_", wm_cause_name(i), i);
  for (unsigned i = 0; i < WM_COUNTER_KIND_COUNT; i++) has_constant("counter_t.lcm", "", wm_counter_name(i), i);
  TEST_ASSERT_EQUAL_STRING("?", wm_state_name(WM_STATE_COUNT));
  TEST_ASSERT_EQUAL_STRING("?", wm_cause_name(WM_CAUSE_COUNT));
}

TEST(a_pose_beyond_all_bounds_is_no_command) {
  static const double kFar[][3] = {{1e300, -1e300, 0}, {0, NAN, 0}, {-2e9, 2e9, 0}, {INFINITY, -INFINITY, 0}};
  wm_event out;
  waymark_set_pose_t m = {.orientation_xyzw = {0, 0, 0, 1}, .sigma_xy_m = 1, .sigma_heading_rad = 1};
  for (int i = 0; i < 5; i++) {
    if (i < 4) memcpy(m.position_m, kFar[i], sizeof m.position_m);
    if (i == 4) memset(m.position_m, 0, sizeof m.position_m);
    int length = waymark_set_pose_t_encode(bytes, 0, sizeof bytes, &m);
    const char *why = wm_lcm_read_set_pose(bytes, (size_t)length, &out);
    if (i < 4) TEST_ASSERT_EQUAL_STRING("position_m is not finite, or farther than 1e9 m", why);
    if (i == 4) TEST_ASSERT_NULL(why);
  }
}

TEST(an_innovation_arrives) {
  wm_innovation i = {.t_ns = 3,
                     .landmark_id = -1,
                     .verdict = WM_REJECTED_SINGULAR,
                     .residual = WM_RESIDUAL_BEARING,
                     .observed = 1,
                     .expected = 2,
                     .variance = 3,
                     .nis = 4,
                     .gate = 5,
                     .gate_dof = 1};
  size_t length = wm_lcm_innovation(&i, bytes, sizeof bytes);
  waymark_innovation_t m;
  TEST_ASSERT_EQUAL(length, waymark_innovation_t_decode(bytes, 0, (int)length, &m));
  TEST_ASSERT_EQUAL(WAYMARK_INNOVATION_T_REJECTED_SINGULAR, m.verdict);
  TEST_ASSERT_EQUAL_DOUBLE(5, m.gate);
}

TEST(more_sightings_than_fit_are_counted) {
  static wm_event sightings[70];
  for (int i = 0; i < 70; i++) {
    sightings[i] = (wm_event){.t_ns = 9, .kind = WM_EVENT_SIGHTING};
    sightings[i].as.sighting = (wm_sighting){.landmark_id = i, .bearing_rad = i, .range_m = NAN};
  }
  size_t length = wm_lcm_observations("front", sightings, 70, bytes, sizeof bytes);
  static waymark_observations_t m;
  TEST_ASSERT_EQUAL(length, waymark_observations_t_decode(bytes, 0, (int)length, &m));
  TEST_ASSERT_EQUAL(64, m.count);
  TEST_ASSERT_EQUAL(6, m.dropped);
  TEST_ASSERT_EQUAL(63, m.landmark_id[63]);
  TEST_ASSERT_DOUBLE_IS_NAN(m.range_m[0]);
  TEST_ASSERT_EQUAL_STRING("front", (const char *)m.sensor);
}

TEST(a_large_map_goes_in_pieces) {
  static wm_landmark map[300];
  for (int i = 0; i < 300; i++) map[i] = (wm_landmark){.id = i, .p_m = {i, 0, 1}, .sigma_m = 0.1};
  static waymark_landmarks_t m;
  size_t length = wm_lcm_landmarks(map, 300, 256, 11, bytes, sizeof bytes);
  TEST_ASSERT_EQUAL(length, waymark_landmarks_t_decode(bytes, 0, (int)length, &m));
  TEST_ASSERT_EQUAL(44, m.count);
  TEST_ASSERT_EQUAL(300, m.total);
  TEST_ASSERT_EQUAL(299, m.id[43]);
  TEST_ASSERT_GREATER_THAN(0, wm_lcm_landmarks(map, 300, 0, 11, bytes, sizeof bytes));
}
