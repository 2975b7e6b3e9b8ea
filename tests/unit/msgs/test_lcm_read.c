// SPDX-License-Identifier: Apache-2.0
// Messages of a run, read again by a viewer: each field comes back as it was, and names from strangers are made
// harmless.
#include "common/suite.h"
#include "waymark/event_fields.h"
#include "waymark/lcm_messages.h"
#include "waymark/lcm_streams.h"
#include "waymark_health_t.h"

static uint8_t bytes[WM_LCM_MESSAGE_MAX];

TEST(pose) {
  wm_published p = {.made_ns = 11,
                    .fused_until_ns = 7,
                    .jumps = 3,
                    .last_jump_m = 0.5,
                    .last_jump_rad = -0.25,
                    .status_flags = WM_PUB_JUMPED,
                    .pose_odom_base = {1, 2, 3},
                    .deadlines_missed = 4,
                    .utc_offset_ns = 5,
                    .utc_uncertainty_ns = -1};
  p.now = (wm_estimate){.t_ns = 99, .resets = 6, .dof = 3, .state = WM_STATE_LOST, .lost_probability = 0.75};
  for (int i = 0; i < 36; i++) p.now.covariance[i] = 1 + i;
  for (int i = 0; i < 3; i++) {
    p.now.pose_map_base.p_m[i] = 10 + i;
    p.now.v_mps[i] = 20 + i;
    p.now.w_radps[i] = 30 + i;
  }
  for (int i = 0; i < 4; i++) p.now.pose_map_base.q_xyzw[i] = 0.1 * i;
  const size_t length = wm_lcm_pose(&p, 12, bytes, sizeof bytes);
  wm_published read;
  memset(&read, 0x55, sizeof read);
  TEST_ASSERT_NULL(wm_lcm_read_pose(bytes, length, &read));
  TEST_ASSERT_EQUAL_INT64(p.made_ns, read.made_ns);
  TEST_ASSERT_EQUAL_INT64(p.fused_until_ns, read.fused_until_ns);
  TEST_ASSERT_EQUAL_MEMORY(&p.pose_odom_base, &read.pose_odom_base, sizeof p.pose_odom_base);
  TEST_ASSERT_EQUAL(p.jumps, read.jumps);
  TEST_ASSERT_EQUAL_DOUBLE(p.last_jump_m, read.last_jump_m);
  TEST_ASSERT_EQUAL_DOUBLE(p.last_jump_rad, read.last_jump_rad);
  TEST_ASSERT_EQUAL_HEX32(p.status_flags, read.status_flags);
  TEST_ASSERT_EQUAL(p.deadlines_missed, read.deadlines_missed);
  TEST_ASSERT_EQUAL_INT64(p.utc_offset_ns, read.utc_offset_ns);
  TEST_ASSERT_EQUAL_INT64(p.utc_uncertainty_ns, read.utc_uncertainty_ns);
  TEST_ASSERT_EQUAL_INT64(99, read.now.t_ns);
  TEST_ASSERT_EQUAL_MEMORY(&p.now.pose_map_base, &read.now.pose_map_base, sizeof p.now.pose_map_base);
  TEST_ASSERT_EQUAL_MEMORY(p.now.covariance, read.now.covariance, sizeof p.now.covariance);
  TEST_ASSERT_EQUAL_MEMORY(p.now.v_mps, read.now.v_mps, sizeof p.now.v_mps);
  TEST_ASSERT_EQUAL_MEMORY(p.now.w_radps, read.now.w_radps, sizeof p.now.w_radps);
  TEST_ASSERT_EQUAL(6, read.now.resets);
  TEST_ASSERT_EQUAL(3, read.now.dof);
  TEST_ASSERT_EQUAL(WM_STATE_LOST, read.now.state);
  TEST_ASSERT_EQUAL(-1, read.now.cause_source);
  TEST_ASSERT_EQUAL_DOUBLE(0.75, read.now.lost_probability);
  for (size_t cut = 0; cut < length; cut++) TEST_ASSERT_NOT_NULL(wm_lcm_read_pose(bytes, cut, &read));
}

static void fill(wm_source_health *s) {
  uint64_t n = 1;
  strcpy(s->name, "sightings:laser");
  s->received = n++, s->fused = n++, s->late = n++, s->dropped = n++, s->duplicates = n++, s->future = n++,
  s->lost = n++;
  s->malformed = n++, s->not_finite = n++, s->out_of_order = n++, s->ignored = n++, s->frozen = n++, s->overflows = n++;
  s->bus_errors = n++;
  for (int i = 0; i < WM_VERDICT_COUNT; i++) s->rejected[i] = n++;
  for (int i = 0; i < WM_STATUS_COUNT; i++) s->refused[i] = n++;
  for (int i = 0; i < WM_LOOK_COUNT; i++) s->looks[i] = n++;
  s->lateness_p99_ns = 101, s->lateness_max_ns = 102, s->lateness_worst_ns = 103, s->newest_ns = 104,
  s->silent_ns = 105;
  s->stamp_uncertainty_ns = 106, s->stale = 1, s->device = WM_DEVICE_STATE_COUNT - 1;
}

TEST(health) {
  static wm_health h, read;
  h = (wm_health){.t_ns = 1,
                  .fused_until_ns = 2,
                  .state = WM_STATE_DEGRADED,
                  .cause = 3,
                  .cause_source = 4,
                  .resets = 5,
                  .jumps = 6,
                  .motion_health = 7,
                  .loops = 8,
                  .deadlines_missed = 9,
                  .outputs_lost = 10,
                  .published = 11,
                  .send_p99_ns = 12,
                  .lines_lost = 13,
                  .run_id = 14,
                  .pid = 15,
                  .other_runs = 16,
                  .other_runs_total = 17,
                  .lost_probability = 0.5,
                  .reckoning_left_m = 18.5,
                  .reckoning_left_s = 19.5,
                  .source_count = 2,
                  .calibration_count = 2,
                  .counter_count = 2};
  strcpy(h.host, "robot");
  fill(&h.sources[1]);
  strcpy(h.calibration[1].name, "laser.yaw_rad");
  h.calibration[1].value = 0.08;
  h.calibration[1].sigma = 0.01;
  h.counters[1] = (wm_counter){WM_COUNTER_LANDMARKS_MOVED, 7, 3};
  const size_t length = wm_lcm_health(&h, bytes, sizeof bytes);
  memset(&read, 0x55, sizeof read);
  TEST_ASSERT_NULL(wm_lcm_read_health(bytes, length, &read));
  TEST_ASSERT_EQUAL_MEMORY(&h.sources, &read.sources, 2 * sizeof *h.sources);
  TEST_ASSERT_EQUAL_MEMORY(&h, &read, sizeof h);
  TEST_ASSERT_NOT_NULL(wm_lcm_read_health(bytes, length - 1, &read));
}

// As many sources, values and counters as there is room for come back; of more, those that have room.
TEST(a_full_health) {
  static wm_health h, read;
  static waymark_health_t m;
  h = (wm_health){.source_count = WM_HEALTH_SOURCES_MAX,
                  .calibration_count = WM_HEALTH_CALIBRATION_MAX,
                  .counter_count = WM_HEALTH_COUNTERS_MAX,
                  .loops = 21};
  for (int i = 0; i < WM_HEALTH_SOURCES_MAX; i++) fill(&h.sources[i]);
  for (int i = 0; i < WM_HEALTH_CALIBRATION_MAX; i++) h.calibration[i].value = i;
  for (int i = 0; i < WM_HEALTH_COUNTERS_MAX; i++) h.counters[i] = (wm_counter){WM_COUNTER_LANDMARKS, i, 3};
  const size_t length = wm_lcm_health(&h, bytes, sizeof bytes);
  TEST_ASSERT_NULL(wm_lcm_read_health(bytes, length, &read));
  TEST_ASSERT_EQUAL_MEMORY(&h, &read, sizeof h);

  TEST_ASSERT_EQUAL((int)length, waymark_health_t_decode(bytes, 0, (int)length, &m));
  m.source_count = m.calibration_count = m.counter_count = INT32_MAX;
  TEST_ASSERT_EQUAL((int)length, waymark_health_t_encode(bytes, 0, sizeof bytes, &m));
  TEST_ASSERT_NULL(wm_lcm_read_health(bytes, length, &read));
  TEST_ASSERT_EQUAL(WM_HEALTH_SOURCES_MAX, read.source_count);
  TEST_ASSERT_EQUAL(WM_HEALTH_CALIBRATION_MAX, read.calibration_count);
  TEST_ASSERT_EQUAL(WM_HEALTH_COUNTERS_MAX, read.counter_count);
  TEST_ASSERT_EQUAL_UINT64(21, read.loops);
}

// Of more values than a message has room for, those with an alarm come first, and the last one states how many are
// left.
TEST(a_health_with_more_values_than_room) {
  static wm_health h, read;
  h = (wm_health){.calibration_count = WM_HEALTH_CALIBRATION_MAX, .more_count = 3, .alarm_count = 2};
  for (int i = 0; i < WM_HEALTH_CALIBRATION_MAX; i++) h.calibration[i].value = i;
  for (int i = 0; i < 3; i++) h.more_calibration[i].value = WM_HEALTH_CALIBRATION_MAX + i;
  h.alarms[0] = (wm_alarm){WM_ALARM_TURN, WM_HEALTH_CALIBRATION_MAX + 2, -1};
  h.alarms[1] = (wm_alarm){WM_ALARM_LENGTHS, -1, 4};
  const size_t length = wm_lcm_health(&h, bytes, sizeof bytes);
  TEST_ASSERT_NULL(wm_lcm_read_health(bytes, length, &read));
  TEST_ASSERT_EQUAL(WM_HEALTH_CALIBRATION_MAX, read.calibration_count);
  TEST_ASSERT_EQUAL(0, read.more_count);
  TEST_ASSERT_EQUAL_DOUBLE(WM_HEALTH_CALIBRATION_MAX + 2, read.calibration[0].value);
  for (int i = 1; i < WM_HEALTH_CALIBRATION_MAX - 1; i++) TEST_ASSERT_EQUAL_DOUBLE(i - 1, read.calibration[i].value);
  TEST_ASSERT_EQUAL_STRING(WM_LCM_CALIBRATION_LEFT, read.calibration[WM_HEALTH_CALIBRATION_MAX - 1].name);
  TEST_ASSERT_EQUAL_DOUBLE(4, read.calibration[WM_HEALTH_CALIBRATION_MAX - 1].value);
}

TEST(innovation) {
  const wm_innovation i = {.t_ns = 1,
                           .source = 2,
                           .sensor = 3,
                           .landmark_id = -4,
                           .residual = WM_RESIDUAL_COUNT - 1,
                           .verdict = WM_VERDICT_COUNT - 1,
                           .observed = 5,
                           .expected = 6,
                           .variance = 7,
                           .nis = 8,
                           .gate = 9,
                           .gate_dof = 2};
  const size_t length = wm_lcm_innovation(&i, bytes, sizeof bytes);
  wm_innovation read;
  TEST_ASSERT_NULL(wm_lcm_read_innovation(bytes, length, &read));
  TEST_ASSERT_EQUAL_INT64(1, read.t_ns);
  TEST_ASSERT_EQUAL(2, read.source);
  TEST_ASSERT_EQUAL(3, read.sensor);
  TEST_ASSERT_EQUAL(-4, read.landmark_id);
  TEST_ASSERT_EQUAL(WM_RESIDUAL_COUNT - 1, read.residual);
  TEST_ASSERT_EQUAL(WM_VERDICT_COUNT - 1, read.verdict);
  TEST_ASSERT_EQUAL_DOUBLE(5, read.observed);
  TEST_ASSERT_EQUAL_DOUBLE(6, read.expected);
  TEST_ASSERT_EQUAL_DOUBLE(7, read.variance);
  TEST_ASSERT_EQUAL_DOUBLE(8, read.nis);
  TEST_ASSERT_EQUAL_DOUBLE(9, read.gate);
  TEST_ASSERT_EQUAL(2, read.gate_dof);
  for (size_t cut = 0; cut < length; cut++) TEST_ASSERT_NOT_NULL(wm_lcm_read_innovation(bytes, cut, &read));
}

TEST(a_pose_that_is_set) {
  const wm_set_pose pose = {
      .pose_map_base = {.p_m = {1, 2, 3}, .q_xyzw = {0, 0, 0.6, 0.8}}, .sigma_xy_m = 0.5, .sigma_heading_rad = 0.25};
  const size_t length = wm_lcm_set_pose(&pose, 77, bytes, sizeof bytes);
  wm_event read;
  memset(&read, 0x55, sizeof read);
  TEST_ASSERT_NULL(wm_lcm_read_set_pose(bytes, length, &read));
  TEST_ASSERT_EQUAL(WM_EVENT_SET_POSE, read.kind);
  TEST_ASSERT_EQUAL_INT64(0, read.arrival_ns);
  TEST_ASSERT_EQUAL(0, read.source);
  TEST_ASSERT_EQUAL(0, read.seq);
  TEST_ASSERT_EQUAL_INT64(77, read.t_ns);
  TEST_ASSERT_EQUAL_MEMORY(pose.pose_map_base.p_m, read.as.set_pose.pose_map_base.p_m, sizeof pose.pose_map_base.p_m);
  for (int i = 0; i < 4; i++)
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, pose.pose_map_base.q_xyzw[i], read.as.set_pose.pose_map_base.q_xyzw[i]);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, read.as.set_pose.sigma_xy_m);
  TEST_ASSERT_EQUAL_DOUBLE(0.25, read.as.set_pose.sigma_heading_rad);
  TEST_ASSERT_EQUAL(0, wm_lcm_set_pose(&pose, 77, bytes, length - 1));
  TEST_ASSERT_NOT_NULL(wm_lcm_read_set_pose(bytes, length - 1, &read));
}

TEST(a_floor_goes_there_and_back_by_its_name) {
  char name[WM_NAME_MAX];
  wm_event read;
  const size_t length = wm_lcm_set_floor("first floor", 77, bytes, sizeof bytes);
  TEST_ASSERT_NULL(wm_lcm_read_set_floor(bytes, length, name, &read));
  TEST_ASSERT_EQUAL_STRING("first floor", name);
  TEST_ASSERT_EQUAL(WM_EVENT_SET_FLOOR, read.kind);
  TEST_ASSERT_EQUAL_INT64(77, read.t_ns);
  TEST_ASSERT_EQUAL(0, wm_lcm_set_floor("first floor", 77, bytes, length - 1));
  TEST_ASSERT_NOT_NULL(wm_lcm_read_set_floor(bytes, length - 1, name, &read));
}

static const char *set_pose_with(double sigma_xy_m, double sigma_heading_rad) {
  const wm_set_pose pose = {
      .pose_map_base.q_xyzw = {0, 0, 0, 1}, .sigma_xy_m = sigma_xy_m, .sigma_heading_rad = sigma_heading_rad};
  wm_event read;
  return wm_lcm_read_set_pose(bytes, wm_lcm_set_pose(&pose, 1, bytes, sizeof bytes), &read);
}

TEST(sigmas_of_a_pose_have_limits) {
  TEST_ASSERT_NULL(set_pose_with(999999, 9.99));
  TEST_ASSERT_NULL(set_pose_with(1e-6, 1e-6));
  TEST_ASSERT_NOT_NULL(set_pose_with(1e6, 1));
  TEST_ASSERT_NOT_NULL(set_pose_with(1, 10));
  TEST_ASSERT_NOT_NULL(set_pose_with(0, 1));
  TEST_ASSERT_NOT_NULL(set_pose_with(1, 0));
  TEST_ASSERT_NOT_NULL(set_pose_with(NAN, 1));
  TEST_ASSERT_NOT_NULL(set_pose_with(1, NAN));
}

static char sensor[WM_NAME_MAX];
static wm_time_ns read_ns;
static wm_sighting seen[WM_LCM_OBSERVATIONS_MAX];
static size_t seen_count;

static const char *read_one(const wm_event *sent) {
  return wm_lcm_read_sightings(bytes, wm_lcm_observations("laser", sent, 1, bytes, sizeof bytes), sensor, &read_ns,
                               seen, &seen_count);
}

// By the table: each number is taken at its limits, and refused one step beyond.
TEST(limits_of_a_sighting) {
  wm_event sent = {.t_ns = 1, .kind = WM_EVENT_SIGHTING};
  wm_sighting *s = &sent.as.sighting;
#define TRY(member, value, is_good)     \
  *s = wm_sighting_without_numbers();   \
  s->bearing_rad = 0.5, s->range_m = 1; \
  s->member = value;                    \
  TEST_ASSERT_EQUAL_MESSAGE(is_good, read_one(&sent) == NULL, #member " " #value);
#define IN_MESSAGE(member, least, most)       \
  TRY(member, least, 1)                       \
  TRY(member, most, 1)                        \
  TRY(member, nextafter(least, -INFINITY), 0) \
  TRY(member, nextafter(most, INFINITY), 0)
#define NOT_IN_MESSAGE(member, least, most)
#define BOTH(member, need, least, most, limits, since, zero_until, message) message(member, least, most)
  WM_SIGHTING_NUMBERS(BOTH)
}

// -1: a landmark without identity; anything below is a fault.
TEST(identities_of_sightings) {
  wm_event sent = {.t_ns = 9, .kind = WM_EVENT_SIGHTING};
  sent.as.sighting = wm_sighting_without_numbers();
  sent.as.sighting.bearing_rad = 0.5;
  for (int id = -2; id < 2; id++) {
    sent.as.sighting.landmark_id = id;
    const char *why = read_one(&sent);
    if (id == -2) {
      TEST_ASSERT_EQUAL_STRING("landmark_id is below -1", why);
      continue;
    }
    TEST_ASSERT_NULL(why);
    TEST_ASSERT_EQUAL(1, seen_count);
    TEST_ASSERT_EQUAL(id, seen[0].landmark_id);
    TEST_ASSERT_EQUAL_INT64(9, read_ns);
    TEST_ASSERT_EQUAL_STRING("laser", sensor);
  }
}

TEST(bound) {
  const wm_bound b = {.t_ns = 99,
                      .risk = 1e-4,
                      .horizontal_m = (double)INFINITY,
                      .heading_rad = 0.25,
                      .limit_m = 0.5,
                      .limit_rad = 0.75,
                      .heading_after_m = 2,
                      .why = WM_UNUSABLE_DOUBT,
                      .cause = WM_CAUSE_REFUSED,
                      .cause_source = -1};
  const size_t length = wm_lcm_bound(&b, bytes, sizeof bytes);
  wm_bound read;
  memset(&read, 0x55, sizeof read);
  TEST_ASSERT_NULL(wm_lcm_read_bound(bytes, length, &read));
  TEST_ASSERT_EQUAL_MEMORY(&b, &read, sizeof b);
  wm_bound usable = b;
  usable.usable = 1;
  TEST_ASSERT_NULL(wm_lcm_read_bound(bytes, wm_lcm_bound(&usable, bytes, sizeof bytes), &read));
  TEST_ASSERT_EQUAL(1, read.usable);
  for (size_t cut = 0; cut < length; cut++) TEST_ASSERT_NOT_NULL(wm_lcm_read_bound(bytes, cut, &read));
}

TEST(no_message_is_not_read) {
  static wm_bound bound;
  static wm_published p;
  static wm_health h;
  static wm_innovation in;
  static char name[WM_HEALTH_NAME_MAX], reason[WM_HEALTH_REASON_MAX];
  static wm_event event;
  static wm_stream_row row;
  for (size_t length = 0; length < 100; length += 8) {
    TEST_ASSERT_NOT_NULL(wm_lcm_read_pose(NULL, length, &p));
    TEST_ASSERT_NOT_NULL(wm_lcm_read_bound(NULL, length, &bound));
    TEST_ASSERT_NOT_NULL(wm_lcm_read_health(NULL, length, &h));
    TEST_ASSERT_NOT_NULL(wm_lcm_read_innovation(NULL, length, &in));
    TEST_ASSERT_NOT_NULL(wm_lcm_read_refused(NULL, length, name, reason));
    TEST_ASSERT_NOT_NULL(wm_lcm_read_set_pose(NULL, length, &event));
    TEST_ASSERT_NOT_NULL(wm_lcm_read_reset(NULL, length, &event));
    TEST_ASSERT_NOT_NULL(wm_lcm_read_sightings(NULL, length, name, &read_ns, seen, &seen_count));
    TEST_ASSERT_NOT_NULL(wm_lcm_read_row("motion", NULL, length, &row));
  }
  TEST_ASSERT_NOT_NULL(wm_lcm_read_row(NULL, bytes, 8, &row));
  TEST_ASSERT_NOT_NULL(wm_lcm_read_pose(bytes, SIZE_MAX, &p));
}

// A terminal obeys control characters: C0, DEL, and C1 in UTF-8.
TEST(control_characters_of_names) {
  static wm_health h, read;
  h = (wm_health){.source_count = 1};
  const char name[] = "a\x01\x1f \x7f\xc2\x80\xc2\x9f\xc2\xa0\xc3\x80~\xff\xe2\x82";
  strcpy(h.sources[0].name, name);
  memset(h.host, 'h', sizeof h.host);
  const size_t length = wm_lcm_health(&h, bytes, sizeof bytes);
  TEST_ASSERT_NULL(wm_lcm_read_health(bytes, length, &read));
  TEST_ASSERT_EQUAL_STRING("a?? ?????\xc2\xa0\xc3\x80~???", read.sources[0].name);
  TEST_ASSERT_EQUAL(sizeof read.host - 1, strlen(read.host));
}

// Of 32 bits, with a sign in the message.
TEST(counts_of_a_pose_that_wrap) {
  const uint32_t counts[] = {INT32_MAX, (uint32_t)INT32_MAX + 1, UINT32_MAX, 0};
  for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
    wm_published p = {.jumps = counts[i], .now = {.resets = counts[i], .dof = 3}}, read;
    TEST_ASSERT_NULL(wm_lcm_read_pose(bytes, wm_lcm_pose(&p, 12, bytes, sizeof bytes), &read));
    TEST_ASSERT_EQUAL_UINT32(counts[i], read.jumps);
    TEST_ASSERT_EQUAL_UINT32(counts[i], read.now.resets);
  }
}

// Into a row that was used before: nothing of it stays. Columns that the message has not are absent.
TEST(rows_of_streams) {
  static const struct {
    const char *stream, *type;
    int numbers;
    uint32_t zero_is_absent;  // a bit for each number whose 0 means that there is none
  } rows[] = {{"motion", "motion_t", 3, 0},
              {"imu", "imu_t", 13, 0xfc0},
              {"gnss", "gnss_t", 5, 0x10},
              {"localizer", "localizer_t", 10, 0}};
  wm_stream_row read;
  for (size_t r = 0; r < sizeof rows / sizeof rows[0]; r++) {
    TEST_ASSERT_EQUAL_STRING(rows[r].type, wm_lcm_stream_type(rows[r].stream));
    wm_stream_row sent = {.t_ns = 42}, none = {.t_ns = -1};
    for (int i = 0; i < WM_STREAM_NUMBERS_MAX; i++) sent.number[i] = i < rows[r].numbers ? 0.5 + i : (double)NAN;
    size_t length = wm_lcm_row(rows[r].stream, &sent, bytes, sizeof bytes);
    memset(&read, 0x55, sizeof read);
    TEST_ASSERT_NULL(wm_lcm_read_row(rows[r].stream, bytes, length, &read));
    TEST_ASSERT_EQUAL_MEMORY(&sent, &read, sizeof read);
    for (size_t cut = 0; cut < length; cut++) TEST_ASSERT_NOT_NULL(wm_lcm_read_row(rows[r].stream, bytes, cut, &read));
    length = wm_lcm_row(rows[r].stream, &none, bytes, sizeof bytes);
    TEST_ASSERT_NULL(wm_lcm_read_row(rows[r].stream, bytes, length, &read));
    for (int i = 0; i < WM_STREAM_NUMBERS_MAX; i++)
      TEST_ASSERT_EQUAL_MESSAGE(i >= rows[r].numbers || (rows[r].zero_is_absent >> i) & 1, isnan(read.number[i]) != 0,
                                rows[r].stream);
  }
  TEST_ASSERT_NULL(wm_lcm_stream_type("of nobody"));
  TEST_ASSERT_EQUAL_STRING("is of no stream", wm_lcm_read_row("of nobody", bytes, sizeof bytes, &read));
  TEST_ASSERT_EQUAL(0, wm_lcm_row("of nobody", &read, bytes, sizeof bytes));
}
