// SPDX-License-Identifier: Apache-2.0
#include "common/suite.h"
#include "fusion/predictor.h"

#define MS WM_NS_PER_MS

static const wm_predictor_params kParams = {
    .jump_m = 0.1, .jump_rad = 0.05, .motion_stale_ns = 200 * MS, .fusion_stale_ns = 300 * MS};
static const wm_motion_calibration kNeutral = {{1, 1, 0, 1, 1, 1, 0, 0, 0}};
static wm_predictor predictor;
static wm_odometry *odometry;
static wm_motion_params *motion;
static wm_published p;

void setUp(void) {
  wm_wheels wheels;
  memset(&wheels, 0, sizeof wheels);
  wheels.radius_m = wheels.ticks_per_turn = wheels.track_m = wheels.wheelbase_m = wheels.steering_ratio = NAN;
  motion = malloc(wm_motion_params_table.bytes);
  wm_params_defaults(&wm_motion_params_table, motion);
  odometry = aligned_alloc(64, (wm_odometry_bytes() + 63) / 64 * 64);
  TEST_ASSERT_EQUAL(WM_OK, wm_odometry_init(odometry, motion, &wheels));
  wm_predictor_init(&predictor, &kParams, odometry);
}

void tearDown(void) {
  free(odometry);
  free(motion);
}

// Makes `p` what is published at this time.
static int publish(wm_time_ns ms) { return wm_predictor_publish(&predictor, ms * MS, &p); }

static void move(wm_time_ns ms, double v, double w) {
  wm_event e = {.t_ns = ms * MS, .arrival_ns = ms * MS, .kind = WM_EVENT_TWIST2};
  e.as.twist2 = (wm_twist2){v, w};
  wm_predictor_motion(&predictor, &e);
}

static void fuse(wm_time_ns ms, double x, double y, double heading, uint32_t resets) {
  wm_estimate e = {.t_ns = ms * MS, .heading_rad = heading, .dof = 3, .state = WM_STATE_TRACKING, .resets = resets};
  e.pose_map_base = (wm_pose3){{x, y, 0}, {0, 0, sin(heading / 2), cos(heading / 2)}};
  for (int i = 0; i < 6; i++) e.covariance[wm_cov_index(i, i)] = 1e-4;
  wm_predictor_fused(&predictor, &e, &kNeutral);
}

TEST(it_carries_the_fused_pose_to_now) {
  TEST_ASSERT_EQUAL(0, wm_predictor_publish(&predictor, 0, &p));  // nothing known yet
  for (int ms = 0; ms <= 200; ms += 10) move(ms, 1, 0);
  fuse(100, 5, 2, M_PI / 2, 0);
  TEST_ASSERT_EQUAL(1, publish(220));
  TEST_ASSERT_EQUAL_INT64(220 * MS, p.now.t_ns);
  TEST_ASSERT_EQUAL_INT64(100 * MS, p.fused_until_ns);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 5, p.now.pose_map_base.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.12, p.now.pose_map_base.p_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.22, p.pose_odom_base.x_m);
  TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(1e-4, p.now.covariance[wm_cov_index(1, 1)]);
  TEST_ASSERT_EQUAL_UINT32(0, p.status_flags);
}

// A speed that comes 100 ms later than a gyro's rates, as over a slow bus, holds from when it comes; a row of its own
// past is refused.
TEST(data_that_are_later_than_another_sensor_s_count) {
  for (int ms = 0; ms <= 1000; ms += 10) {
    wm_event gyro = {.t_ns = ms * MS, .arrival_ns = ms * MS, .kind = WM_EVENT_QUANTITIES, .source = 1};
    gyro.as.quantities = (wm_quantities){.count = 1, .id = {WM_Q_YAW_RATE}, .value = {0.5}};
    wm_predictor_motion(&predictor, &gyro);
    if (ms >= 100) move(ms - 100, 1, 0.2);
  }
  TEST_ASSERT_EQUAL_UINT64(0, predictor.odometry_refused);
  fuse(900, 0, 0, 0, 0);
  TEST_ASSERT_EQUAL(1, publish(1000));
  TEST_ASSERT_DOUBLE_WITHIN(0.002, 0.1, p.now.pose_map_base.p_m[0]);
  move(400, 5, 0);
  TEST_ASSERT_EQUAL_UINT64(1, predictor.odometry_refused);
}

TEST(stamps_rise_strictly) {
  move(0, 1, 0);
  fuse(0, 0, 0, 0, 0);
  TEST_ASSERT_EQUAL(1, publish(20));
  TEST_ASSERT_EQUAL(0, publish(20));
  TEST_ASSERT_EQUAL(0, publish(10));
  TEST_ASSERT_EQUAL(1, publish(21));
}

// The map is turned against odom: a fast drive along a curve is no jump, and a jump has its true size.
TEST(odom_is_turned_into_the_map) {
  const double turns[] = {0.4, 2.0, -1.2, M_PI};
  for (size_t i = 0; i < sizeof turns / sizeof turns[0]; i++) {
    tearDown();
    setUp();
    for (int ms = 0; ms <= 400; ms += 10) move(ms, 10, 1.5);
    fuse(0, 5, -3, turns[i], 0);
    for (int ms = 20; ms <= 400; ms += 20) {
      TEST_ASSERT_EQUAL(1, publish(ms));
      TEST_ASSERT_EQUAL_HEX32(0, p.status_flags & WM_PUB_JUMPED);
    }
    TEST_ASSERT_EQUAL_UINT32(0, p.jumps);
    const wm_pose3 at = p.now.pose_map_base;
    fuse(400, at.p_m[0] + 0.3, at.p_m[1] - 0.4, p.now.heading_rad, 0);
    TEST_ASSERT_EQUAL(1, publish(410));
    TEST_ASSERT_EQUAL_UINT32(1, p.jumps);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.5, p.last_jump_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0, p.last_jump_rad);
  }
}

// The same bits on every machine: numbers that another sine or cosine rounds otherwise would differ.
TEST(a_jump_is_measured_by_the_estimators_own_algebra) {
  const wm_pose2 map_before = {1.25, -0.5, 3.0}, odom_before = {10.0, 4.0, -3.0}, odom_now = {10.5, 4.25, 3.0};
  const wm_pose2 map_now = {1.75, -0.25, -3.0};
  const wm_pose2 by = wm_odometry_jump(&map_before, &odom_before, &map_now, &odom_now);
  // In double precision by another library: odom moved by R(3) (0.5, 0.25), turned by 6 - 2 pi; map as far, turned by
  // 2 pi - 6.
  const double turn = 6.0 - 2.0 * M_PI;
  const double dx = cos(3.0) * 0.5 - sin(3.0) * 0.25, dy = sin(3.0) * 0.5 + cos(3.0) * 0.25;
  const double x = 1.25 + cos(3.0) * dx - sin(3.0) * dy, y = -0.5 + sin(3.0) * dx + cos(3.0) * dy, h = 3.0 + turn;
  TEST_ASSERT_DOUBLE_WITHIN(1e-14, cos(h) * (1.75 - x) + sin(h) * (-0.25 - y), by.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-14, cos(h) * (-0.25 - y) - sin(h) * (1.75 - x), by.y_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-14, -2.0 * turn, by.heading_rad);
}

TEST(a_move_of_map_against_odom_is_announced_once) {
  for (int ms = 0; ms <= 100; ms += 10) move(ms, 1, 0.5);
  fuse(50, 0, 0, 0.3, 0);
  TEST_ASSERT_EQUAL(1, publish(100));
  TEST_ASSERT_EQUAL_UINT32(0, p.jumps);  // the first message is no jump
  fuse(51, 0.001, 0, 0.3005, 0);
  TEST_ASSERT_EQUAL(1, publish(120));
  TEST_ASSERT_EQUAL_UINT32(0, p.jumps);  // driving and small corrections are none
  wm_pose2 odom_before = p.pose_odom_base;
  fuse(52, 0.5, 0, 0.3, 0);
  TEST_ASSERT_EQUAL(1, publish(140));
  TEST_ASSERT_EQUAL_UINT32(1, p.jumps);
  TEST_ASSERT_TRUE(p.status_flags & WM_PUB_JUMPED);
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.5, p.last_jump_m);
  TEST_ASSERT_DOUBLE_WITHIN(2e-3, 0.0, p.last_jump_rad);
  TEST_ASSERT_DOUBLE_WITHIN(0.03, odom_before.x_m, p.pose_odom_base.x_m);  // odom goes on as it was
  TEST_ASSERT_EQUAL(1, publish(160));
  TEST_ASSERT_EQUAL_UINT32(1, p.jumps);
  TEST_ASSERT_FALSE(p.status_flags & WM_PUB_JUMPED);
  fuse(53, 0.5, 0, 0.4, 0);  // a turn is one, too
  TEST_ASSERT_EQUAL(1, publish(180));
  TEST_ASSERT_EQUAL_UINT32(2, p.jumps);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.1, p.last_jump_rad);
}

// A move is a jump beyond its bounds, not at them.
TEST(a_move_as_large_as_the_bounds_is_no_jump) {
  wm_predictor_params params = kParams;
  params.jump_m = 0.125;
  params.jump_rad = 0.0625;
  const struct {
    double x_m, heading_rad;
    uint32_t jumps;
  } rows[] = {{0.125, 0.0, 0}, {0.0, 0.0625, 0}, {0.1251, 0.0, 1}, {0.0, 0.0626, 1}, {0.0, -0.0626, 1}};
  for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
    tearDown();
    setUp();
    wm_predictor_init(&predictor, &params, odometry);
    move(0, 0, 0);
    fuse(0, 0, 0, 0, 0);
    TEST_ASSERT_EQUAL(1, publish(20));
    fuse(1, rows[i].x_m, 0, rows[i].heading_rad, 0);
    TEST_ASSERT_EQUAL(1, publish(40));
    TEST_ASSERT_EQUAL_UINT32(rows[i].jumps, p.jumps);
  }
}

// Whatever the memory held before: the same message.
TEST(a_message_overwrites_all_of_its_memory) {
  static wm_published messages[2];
  memset(&messages[1], 0xff, sizeof messages[1]);
  for (int ms = 0; ms <= 100; ms += 10) move(ms, 1, 0.5);
  fuse(50, 3, 4, 0.3, 0);
  for (int i = 0; i < 2; i++) {
    wm_predictor copy = predictor;
    TEST_ASSERT_EQUAL(1, wm_predictor_publish(&copy, 120 * MS, &messages[i]));
  }
  TEST_ASSERT_EQUAL_MEMORY(&messages[0], &messages[1], sizeof messages[0]);
}

TEST(a_pose_set_anew_is_announced_however_small_the_move) {
  move(0, 0, 0);
  fuse(0, 1, 1, 0, 1);
  TEST_ASSERT_EQUAL(1, publish(20));
  fuse(1, 1, 1, 0, 2);
  TEST_ASSERT_EQUAL(1, publish(40));
  TEST_ASSERT_EQUAL_UINT32(1, p.jumps);
}

TEST(counts_of_resets_and_jumps_wrap) {
  move(0, 0, 0);
  fuse(0, 1, 1, 0, UINT32_MAX);
  TEST_ASSERT_EQUAL(1, publish(20));
  predictor.jumps = UINT32_MAX;
  fuse(1, 1, 1, 0, UINT32_MAX);
  TEST_ASSERT_EQUAL(1, publish(40));
  TEST_ASSERT_EQUAL_HEX32(0, p.status_flags & WM_PUB_JUMPED);
  fuse(2, 1, 1, 0, 0);  // one reset more
  TEST_ASSERT_EQUAL(1, publish(60));
  TEST_ASSERT_EQUAL_HEX32(WM_PUB_JUMPED, p.status_flags & WM_PUB_JUMPED);
  TEST_ASSERT_EQUAL_UINT32(0, p.jumps);
}

TEST(pictures_are_told_the_pose_or_the_motion_alone) {
  wm_estimate e;
  TEST_ASSERT_EQUAL(0, wm_predictor_expect(&predictor, 0, &e));
  for (int ms = 0; ms <= 100; ms += 10) move(ms, 1, 0.5);
  TEST_ASSERT_EQUAL(0, publish(110));
  TEST_ASSERT_EQUAL(1, wm_predictor_expect(&predictor, 110 * MS, &e));
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, e.state);
  TEST_ASSERT_EQUAL_INT64(110 * MS, e.t_ns);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1, e.v_mps[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, e.w_radps[2]);
  fuse(50, 3, 4, 0.3, 0);
  TEST_ASSERT_EQUAL(1, wm_predictor_expect(&predictor, 120 * MS, &e));
  TEST_ASSERT_EQUAL(1, publish(120));
  TEST_ASSERT_EQUAL_MEMORY(&p.now, &e, sizeof e);
}

TEST(old_motion_and_old_fusion_are_said) {
  move(0, 0, 0);
  fuse(0, 1, 1, 0, 0);
  TEST_ASSERT_EQUAL(1, publish(150));
  TEST_ASSERT_EQUAL_UINT32(0, p.status_flags);
  TEST_ASSERT_EQUAL(1, publish(250));
  TEST_ASSERT_EQUAL_UINT32(WM_PUB_MOTION_STALE, p.status_flags);
  TEST_ASSERT_EQUAL(1, publish(300));  // as old as it may be
  TEST_ASSERT_EQUAL_UINT32(WM_PUB_MOTION_STALE, p.status_flags);
  TEST_ASSERT_EQUAL(1, publish(350));
  TEST_ASSERT_EQUAL_UINT32(WM_PUB_MOTION_STALE | WM_PUB_FUSION_STALE, p.status_flags);
}

TEST(without_a_pose_nothing_is_said) {
  move(0, 0, 0);
  wm_estimate e = {.t_ns = 0, .state = WM_STATE_SEARCHING};
  wm_predictor_fused(&predictor, &e, &kNeutral);
  TEST_ASSERT_EQUAL(0, publish(20));
  fuse(0, NAN, 1, 0, 0);
  TEST_ASSERT_EQUAL(0, publish(40));
}
