// SPDX-License-Identifier: Apache-2.0
#include "common/suite.h"
#include "fusion/bound.h"
#include "fusion/fuser.h"
#include "tiny_estimator.h"

#define MS WM_NS_PER_MS

static tiny_state state;
static wm_fuser fuser;
static char said[4096];

// What came out, as text: "E10" an event, "P10:0.5" a pose with its x, "I10" an innovation.
static void put(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  (void)context, (void)bytes;
  char word[64] = "";
  const wm_estimate *pose = record;
  const wm_event *event = record;
  const wm_innovation *innovation = record;
  if (kind == WM_OUTPUT_EVENT) (void)snprintf(word, sizeof word, "E%lld ", (long long)(event->t_ns / MS));
  if (kind == WM_OUTPUT_INNOVATION) (void)snprintf(word, sizeof word, "I%lld ", (long long)(innovation->t_ns / MS));
  if (kind == WM_OUTPUT_POSE)
    (void)snprintf(word, sizeof word, "P%lld:%g,%g ", (long long)(pose->t_ns / MS), pose->pose_map_base.p_m[0],
                   pose->pose_map_base.p_m[1]);
  strncat(said, word, sizeof said - strlen(said) - 1);
}

static void begin(const wm_estimator *estimator, void (*to)(void *, wm_output_kind, const void *, size_t)) {
  wm_fuser_init(&fuser, estimator, &state, wm_driving_choose(WM_EVENT_BIT(WM_EVENT_TWIST2), 0), (wm_output){to, NULL});
}

void setUp(void) {
  said[0] = '\0';
  (void)tiny_init(&state, NULL, NULL);
  begin(&kTiny, put);
}

static void twist(wm_time_ns ms, double v) {
  wm_event e = {.t_ns = ms * MS, .arrival_ns = ms * MS, .kind = WM_EVENT_TWIST2};
  e.as.twist2.v_mps = v;
  wm_fuser_feed(&fuser, &e);
}

static void sighting(wm_time_ns ms, double bearing) {
  wm_event e = {.t_ns = ms * MS, .arrival_ns = ms * MS, .kind = WM_EVENT_SIGHTING, .source = 1};
  e.as.sighting.bearing_rad = bearing;
  wm_fuser_feed(&fuser, &e);
}

TEST(a_row_holds_the_state_after_all_events_up_to_its_stamp) {
  twist(0, 1);
  sighting(0, 0.5);  // at the row's stamp: in the row
  sighting(50, 0.5);
  twist(100, 1);
  wm_fuser_finish(&fuser);
  TEST_ASSERT_EQUAL_STRING("E0 E0 I0 P0:0,0.25 E50 I50 E100 P100:0.1,0.5 ", said);
  TEST_ASSERT_EQUAL_UINT64(2, fuser.poses);
}

TEST(refused_motion_makes_no_row) {
  twist(0, 1);
  twist(100, NAN);
  twist(50, 1);
  twist(20, 1);
  wm_fuser_finish(&fuser);
  TEST_ASSERT_EQUAL_STRING("E0 P0:0,0 E100 E50 E20 P50:0.05,0 ", said);
  TEST_ASSERT_EQUAL_UINT64(1, fuser.counts[0].refused[WM_NOT_FINITE]);
  TEST_ASSERT_EQUAL_UINT64(1, fuser.counts[0].refused[WM_TIME_RAN_BACK]);
  TEST_ASSERT_EQUAL_UINT64(2, fuser.counts[0].fused);
  TEST_ASSERT_EQUAL(WM_NOT_FINITE, fuser.counts[0].first_unused.status);  // the first one alone is kept
  TEST_ASSERT_EQUAL_INT64(100 * MS, fuser.counts[0].first_unused.t_ns);
}

TEST(observations_are_counted_by_their_verdict) {
  twist(0, 1);
  sighting(1, 0.5);
  sighting(2, 2);
  sighting(3, 2);
  TEST_ASSERT_EQUAL_UINT64(1, fuser.counts[1].fused);
  TEST_ASSERT_EQUAL_UINT64(2, fuser.counts[1].rejected[WM_REJECTED_GATE]);
}

TEST(without_a_pose_there_is_no_row) {
  state.state = WM_STATE_SEARCHING;
  twist(0, 1);
  twist(10, 1);
  state.state = WM_STATE_TRACKING;
  twist(20, 1);
  wm_fuser_finish(&fuser);
  TEST_ASSERT_EQUAL_STRING("E0 E10 P10:0.01,0 E20 P20:0.02,0 ", said);
}

TEST(ticks_drive_before_yaw_rate_before_speed_before_twists) {
  uint32_t q = WM_EVENT_BIT(WM_EVENT_QUANTITIES), t = WM_EVENT_BIT(WM_EVENT_TWIST2);
  uint32_t ticks = 1u << WM_Q_WHEEL_TICKS_LEFT, yaw = 1u << WM_Q_YAW_RATE, speed = 1u << WM_Q_VEHICLE_SPEED;
  TEST_ASSERT_TRUE(wm_driving_choose(q | t, ticks | yaw | speed).quantities & ticks);
  TEST_ASSERT_EQUAL_UINT32(yaw, wm_driving_choose(q | t, yaw | speed).quantities);
  TEST_ASSERT_TRUE(wm_driving_choose(q | t, speed).quantities & speed);
  TEST_ASSERT_TRUE(wm_driving_choose(q | t, 1u << WM_Q_GEAR).kinds & t);
  TEST_ASSERT_TRUE(wm_driving_choose(t, ticks).kinds & t);
  wm_driving driving = wm_driving_choose(q, yaw | speed);
  wm_event e = {.kind = WM_EVENT_QUANTITIES};
  e.as.quantities.count = 1;
  e.as.quantities.id[0] = WM_Q_VEHICLE_SPEED;
  TEST_ASSERT_FALSE(wm_driving_is(&driving, &e));
  e.as.quantities.count = 2;
  e.as.quantities.id[1] = WM_Q_YAW_RATE;
  TEST_ASSERT_TRUE(wm_driving_is(&driving, &e));
  e.as.quantities.count = 1;  // what an event before left behind the last one is none of it
  TEST_ASSERT_EQUAL(0, wm_driving_is(&driving, &e));
}

// Like snprintf: how many there would be, of which those that fit are written.
static size_t many_values(const void *self, wm_calibration_value *out, size_t capacity) {
  (void)self;
  for (size_t i = 0; i < capacity && i < 1000; i++) out[i] = (wm_calibration_value){.name = "laser.x_m"};
  return 1000;
}

static size_t many_counters(const void *self, wm_counter *out, size_t capacity) {
  (void)self;
  for (size_t i = 0; i < capacity && i < 1000; i++) out[i] = (wm_counter){.kind = WM_COUNTER_MAP_FULL};
  return 1000;
}

static size_t many_alarms(const void *self, wm_alarm *out, size_t capacity) {
  (void)self;
  for (size_t i = 0; i < capacity && i < 1000; i++) out[i] = (wm_alarm){WM_ALARM_TURN, (int32_t)i, 1};
  return 1000;
}

TEST(health_holds_no_more_values_than_it_has_room_for) {
  static wm_health health;
  wm_estimator generous = kTiny;
  generous.calibration = many_values;
  generous.counters = many_counters;
  generous.alarms = many_alarms;
  begin(&generous, put);
  twist(10, 1);
  wm_fuser_health(&fuser, &health);
  TEST_ASSERT_EQUAL(WM_HEALTH_CALIBRATION_MAX, health.calibration_count);
  TEST_ASSERT_EQUAL(WM_HEALTH_CALIBRATION_MAX, health.more_count);
  TEST_ASSERT_EQUAL(WM_ALARMS_MAX, health.alarm_count);
  TEST_ASSERT_TRUE(wm_health_has_alarm(&health, WM_ALARM_TURN, WM_ALARMS_MAX - 1));
  TEST_ASSERT_EQUAL(WM_HEALTH_COUNTERS_MAX, health.counter_count);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, health.state);
  TEST_ASSERT_EQUAL_INT64(10 * MS, health.fused_until_ns);
  TEST_ASSERT_NULL(wm_health_counter(&health, WM_COUNTER_LANDMARKS));
  TEST_ASSERT_NOT_NULL(wm_health_counter(&health, WM_COUNTER_MAP_FULL));
}

static void doubtful(const void *self, wm_estimate *out) {
  tiny_estimate(self, out);
  out->state = WM_STATE_LOST;
  out->cause = WM_CAUSE_COUNT - 1;
  out->cause_source = 5;
  out->lost_probability = 0.75;
  out->resets = 3;
}

TEST(health_has_what_the_estimate_has) {
  static wm_health health;
  wm_estimator doubting = kTiny;
  doubting.estimate = doubtful;
  begin(&doubting, put);
  twist(10, 1);
  wm_fuser_health(&fuser, &health);
  TEST_ASSERT_EQUAL(WM_STATE_LOST, health.state);
  TEST_ASSERT_EQUAL(WM_CAUSE_COUNT - 1, health.cause);
  TEST_ASSERT_EQUAL(5, health.cause_source);
  TEST_ASSERT_EQUAL_DOUBLE(0.75, health.lost_probability);
  TEST_ASSERT_EQUAL(3, health.resets);
}

// Ten sightings a second, which the estimator fuses, or refuses above 1 rad.
static const wm_health *health_after_a_minute(double bearing) {
  static wm_health health;
  setUp();
  wm_fuser_watch(&fuser, &(wm_setup){0}, 1u << 1);
  for (wm_time_ns ms = 0; ms < 60000; ms += 100) {
    twist(ms, 0);
    sighting(ms, bearing);
  }
  wm_fuser_health(&fuser, &health);
  return &health;
}

TEST(a_pose_whose_observations_are_refused_is_lost) {
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, health_after_a_minute(0.5)->state);
  const wm_health *health = health_after_a_minute(2.0);
  TEST_ASSERT_EQUAL(WM_STATE_LOST, health->state);
  TEST_ASSERT_EQUAL(WM_CAUSE_REFUSED, health->cause);
  TEST_ASSERT_EQUAL(1, health->cause_source);
}

static double lost, image_x_m, image_weight;

static void sure(const void *s, wm_estimate *out) {
  kTiny.estimate(s, out);
  out->covariance[wm_cov_index(0, 0)] = out->covariance[wm_cov_index(1, 1)] = 0.01;
  out->covariance[wm_cov_index(5, 5)] = 1e-4;
  out->lost_probability = lost;
}

static wm_status fits(void *s, const wm_event *e, wm_innovation *out, size_t capacity, size_t *count) {
  const wm_status status = kTiny.correct(s, e, out, capacity, count);
  if (*count > 0) out[0].variance = 1;
  return status;
}

// Twelve poses at the same place, of which eight count one by one.
static size_t other_places(const void *s, wm_hypothesis *out, size_t capacity) {
  (void)s;
  for (size_t i = 0; i < capacity && i < 12; i++)
    out[i] = (wm_hypothesis){.x_m = image_x_m, .covariance = {1e-4, 0, 1e-4, 0, 0, 1e-4}, .weight = image_weight};
  return 12;
}

static wm_bound bound_after(wm_time_ns until_ms) {
  static wm_estimator watched;
  const wm_integrity integrity = {.risk = 1e-4};
  wm_estimate fused;
  wm_bound bound;
  watched = kTiny;
  watched.estimate = sure;
  watched.correct = fits;
  watched.hypotheses = other_places;
  setUp();
  begin(&watched, put);
  wm_fuser_watch(&fuser, &(wm_setup){0}, 1u << 1);
  for (wm_time_ns ms = 0; ms < until_ms; ms += 100) {
    twist(ms, 0);
    sighting(ms, 0.0);
  }
  wm_fuser_estimate(&fuser, &fused);
  wm_fuser_bound(&fuser, &integrity, &fused, &fused, &bound);
  return bound;
}

TEST(a_pose_is_usable_once_observations_have_fitted_for_5_s) {
  lost = image_weight = 0;
  TEST_ASSERT_EQUAL(WM_UNUSABLE_UNTESTED, bound_after(4000).why);
  const wm_bound bound = bound_after(8000);
  TEST_ASSERT_EQUAL(WM_UNUSABLE_NOT, bound.why);
  TEST_ASSERT_TRUE(bound.usable && bound.horizontal_m > 0.7 && bound.horizontal_m < 0.8);
}

TEST(a_bound_reaches_the_other_poses_that_are_known) {
  image_x_m = 3;
  image_weight = 4e-5;
  lost = 12 * image_weight;
  // Eight are known, four count as a pose anywhere: 1.6e-4, of which the evidence's floor is 1.2e-4.
  const wm_bound bound = bound_after(8000);
  TEST_ASSERT_TRUE(bound.usable && bound.horizontal_m > 3.0 && bound.horizontal_m < 3.2);
  lost += 1e-4;
  TEST_ASSERT_EQUAL(WM_UNUSABLE_DOUBT, bound_after(8000).why);
}

static wm_status take_points(void *self, const wm_event *e, wm_innovation *out, size_t capacity, size_t *count) {
  (void)self, (void)out, (void)capacity;
  *count = 0;
  return e->kind == WM_EVENT_POINTS ? WM_OK : WM_UNSUPPORTED;
}

static size_t particle_count, hypothesis_count, hypotheses_seen;

static size_t some_particles(const void *self, wm_particle *out, size_t capacity) {
  (void)self;
  for (size_t i = 0; i < capacity && i < particle_count; i++) out[i] = (wm_particle){0};
  return particle_count;
}

static size_t some_hypotheses(const void *self, wm_hypothesis *out, size_t capacity) {
  (void)self;
  for (size_t i = 0; i < capacity && i < hypothesis_count; i++) out[i] = (wm_hypothesis){.weight = (double)i};
  return hypothesis_count;
}

// What came out of clouds: "C10:3/5" 3 particles of 5 at 10 ms, "H10:2" two hypotheses.
static void put_cloud(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  char word[64] = "";
  (void)context;
  const wm_particle_set *cloud = record;
  const wm_hypothesis_set *list = record;
  if (kind == WM_OUTPUT_PARTICLES) {
    (void)snprintf(word, sizeof word, "C%lld:%u/%u ", (long long)(cloud->t_ns / MS), (unsigned)cloud->count,
                   (unsigned)cloud->total);
    TEST_ASSERT_EQUAL(sizeof *cloud, bytes);
  }
  if (kind == WM_OUTPUT_HYPOTHESES) {
    (void)snprintf(word, sizeof word, "H%lld:%u ", (long long)(list->t_ns / MS), (unsigned)list->count);
    for (size_t i = 0; i < list->count; i++, hypotheses_seen++)
      TEST_ASSERT_EQUAL_DOUBLE((double)hypotheses_seen, list->places[i].weight);
  }
  strncat(said, word, sizeof said - strlen(said) - 1);
}

static void points(wm_time_ns ms) {
  static wm_event e;
  e = (wm_event){.t_ns = ms * MS, .arrival_ns = ms * MS, .kind = WM_EVENT_POINTS, .source = 1};
  wm_fuser_feed(&fuser, &e);
}

TEST(clouds_are_written_once_a_second) {
  wm_estimator clouds = kTiny;
  clouds.correct = take_points;
  clouds.particles = some_particles;
  begin(&clouds, put_cloud);
  particle_count = 3;
  points(0);
  points(999);
  particle_count = WM_PARTICLES_MAX + 5;
  points(1000);
  twist(2500, 1);  // no points
  char expected[80];
  (void)snprintf(expected, sizeof expected, "C0:3/3 C1000:%u/%u ", (unsigned)WM_PARTICLES_MAX,
                 (unsigned)WM_PARTICLES_MAX + 5);
  TEST_ASSERT_EQUAL_STRING(expected, said);
  TEST_ASSERT_EQUAL_UINT64(3, fuser.counts[1].fused);
  sighting(2600, 0.5);
  TEST_ASSERT_EQUAL_UINT64(1, fuser.counts[1].refused[WM_UNSUPPORTED]);
  TEST_ASSERT_EQUAL_UINT64(3, fuser.counts[1].fused);
}

TEST(hypotheses_come_in_sets) {
  wm_estimator clouds = kTiny;
  clouds.correct = take_points;
  clouds.particles = some_particles;
  clouds.hypotheses = some_hypotheses;
  begin(&clouds, put_cloud);
  particle_count = 0;
  const size_t most = sizeof fuser.listed / sizeof fuser.listed[0];
  hypothesis_count = WM_HYPOTHESES_MAX + 50, hypotheses_seen = 0;
  points(0);
  TEST_ASSERT_EQUAL_STRING("C0:0/0 H0:100 H0:50 ", said);
  said[0] = '\0';
  begin(&clouds, put_cloud);
  hypothesis_count = most + 100, hypotheses_seen = 0;
  points(0);
  char expected[4096] = "C0:0/0 ";
  for (size_t left = most; left > 0;) {
    const size_t set = left < WM_HYPOTHESES_MAX ? left : WM_HYPOTHESES_MAX;
    (void)snprintf(expected + strlen(expected), sizeof expected - strlen(expected), "H0:%u ", (unsigned)set);
    left -= set;
  }
  TEST_ASSERT_EQUAL_STRING(expected, said);
}

TEST(records_have_room_for_points_where_there_are_some) {
  TEST_ASSERT_EQUAL(sizeof(wm_event), wm_output_bytes(WM_EVENT_BIT(WM_EVENT_POINTS) | WM_EVENT_BIT(WM_EVENT_TWIST2)));
  const size_t small = wm_output_bytes(WM_EVENT_BIT(WM_EVENT_TWIST2));
  TEST_ASSERT_GREATER_OR_EQUAL(sizeof(wm_published), small);
  TEST_ASSERT_GREATER_OR_EQUAL(WM_EVENT_SMALL_BYTES, small);
  TEST_ASSERT_LESS_THAN(sizeof(wm_event), small);
}

TEST(increments_drive_and_twists_before_a_gyro) {
  const uint32_t q = WM_EVENT_BIT(WM_EVENT_QUANTITIES), t = WM_EVENT_BIT(WM_EVENT_TWIST2),
                 i = WM_EVENT_BIT(WM_EVENT_INCREMENT);
  const uint32_t yaw = 1u << WM_Q_YAW_RATE;
  TEST_ASSERT_EQUAL_HEX32(i, wm_driving_choose(i | q | t, yaw).kinds);
  TEST_ASSERT_EQUAL_HEX32(WM_TWIST_EVENTS, wm_driving_choose(q | t, yaw).kinds);
  TEST_ASSERT_EQUAL_HEX32(q, wm_driving_choose(q | t, yaw | 1u << WM_Q_VEHICLE_SPEED).kinds);
  TEST_ASSERT_EQUAL_HEX32(q, wm_driving_choose(q, yaw).kinds);
  TEST_ASSERT_EQUAL_HEX32(yaw, wm_driving_choose(q, yaw).quantities);
  TEST_ASSERT_EQUAL_HEX32(WM_EVENT_BIT(WM_EVENT_SIGHTING), wm_driving_choose(WM_EVENT_BIT(WM_EVENT_SIGHTING), 0).kinds);
}
