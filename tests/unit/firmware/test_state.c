// SPDX-License-Identifier: Apache-2.0
// The last pose on disk, and how far dead reckoning would carry.
#include <sys/stat.h>
#include <unistd.h>

#include "common/folder.h"
#include "common/suite.h"
#include "config/config.h"
#include "fusion/budget.h"
#include "output/saved_map.h"
#include "output/saved_pose.h"
#include "waymark/keeper.h"

static char path[512];
static wm_error err;
static wm_config slam;
static wm_motion_params *motion;  // defaults: noise.hold_mps2 1, noise.hold_radps2 0.5, hold_max_s 2

void setUp(void) {
  motion = malloc(wm_motion_params_table.bytes);
  TEST_ASSERT_NOT_NULL(motion);
  wm_params_defaults(&wm_motion_params_table, motion);
  (void)snprintf(path, sizeof path, "%s", folder_path("pose.yaml"));
}
void tearDown(void) {
  wm_config_free(&slam);
  free(motion);
  folder_remove();
}

static wm_estimate tracking(double x_m, double sigma_m) {
  wm_estimate e = {.state = WM_STATE_TRACKING, .heading_rad = M_PI / 2, .dof = 3};
  e.pose_map_base = (wm_pose3){{x_m, -2, 0.5}, {0, 0, sqrt(0.5), sqrt(0.5)}};
  e.covariance[wm_cov_index(0, 0)] = sigma_m * sigma_m;
  e.covariance[wm_cov_index(1, 1)] = sigma_m * sigma_m / 4;
  e.covariance[wm_cov_index(5, 5)] = 0.01 * 0.01;
  return e;
}

static wm_saved_pose saved;
static wm_start start;

// Saves a pose and reads it again.
static void save(const wm_estimate *e, double utc_s) {
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_saved_pose_write(path, e, NULL, utc_s, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_saved_pose_read(path, &saved, &err), err.text);
}

TEST(a_pose_is_there_again) {
  wm_estimate e = tracking(12.25, 0.3);
  save(&e, 1000);
  e.pose_map_base.p_m[0] = 13.5;
  save(&e, 2000);
  TEST_ASSERT_EQUAL_DOUBLE(13.5, saved.start.p_m[0]);
  TEST_ASSERT_EQUAL_DOUBLE(2000, saved.utc_s);
  TEST_ASSERT_DOUBLE_WITHIN(1e-8, M_PI / 2, saved.start.heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-5, 0.3, saved.start.sigma_xy_m);
  TEST_ASSERT_EQUAL_INT64(WM_TIME_NONE, saved.start.t_ns);

  TEST_ASSERT_TRUE(wm_saved_pose_start(&saved, 2100, 600, 0.4, 0, motion, &start));
  TEST_ASSERT_DOUBLE_WITHIN(1e-5, 0.5, start.sigma_xy_m);
  TEST_ASSERT_TRUE(wm_saved_pose_start(&saved, 5, 600, 0, 0, motion, &start));  // the clock isn't set yet
  TEST_ASSERT_FALSE(wm_saved_pose_start(&saved, 2700, 600, 0, 0, motion, &start));
}

TEST(the_floor_of_a_pose_is_there_again) {
  const wm_estimate e = tracking(1, 0.1);
  const char *const floors[] = {"first", "", "the cook's \"own\""};
  save(&e, 1);
  TEST_ASSERT_FALSE(saved.has_floor);
  for (size_t i = 0; i < sizeof floors / sizeof floors[0]; i++) {
    TEST_ASSERT_EQUAL(WM_OK, wm_saved_pose_write(path, &e, floors[i], 1, &err));
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_saved_pose_read(path, &saved, &err), err.text);
    TEST_ASSERT_TRUE(saved.has_floor);
    TEST_ASSERT_EQUAL_STRING(floors[i], saved.floor);
  }
}

// Killed while it drove: it is where it would be by now, as far off as it may have driven. An hour later it stands.
TEST(a_pose_that_was_moving_goes_on) {
  wm_estimate e = tracking(10, 0.3);
  e.v_mps[0] = 2;
  e.w_radps[2] = M_PI / 4;
  save(&e, 1000);
  TEST_ASSERT_TRUE(wm_saved_pose_start(&saved, 1000.5, 600, 0.4, 0, motion, &start));
  double half = M_PI / 16;  // of the turn
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 10 + 1 * cos(M_PI / 2 + half), start.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, -2 + 1 * sin(M_PI / 2 + half), start.p_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, M_PI / 2 + 2 * half, start.heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, sin(M_PI / 4 + half), start.q_xyzw[2]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, cos(M_PI / 4 + half), start.q_xyzw[3]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, sqrt(0.09 + 0.16 + 1 + 0.125 * 0.125), start.sigma_xy_m);
  TEST_ASSERT_TRUE(wm_saved_pose_start(&saved, 4600, 6000, 0, 0, motion, &start));
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 10, start.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, sqrt(0.09 + 16), start.sigma_xy_m);
}

// Killed while it drove straight on: within the second since then it may have begun to turn, and braked or accelerated.
// Later than two seconds nothing is known of the motion. A robot that was off for an hour stands.
TEST(a_turn_that_began_after_the_save_is_within_sigma) {
  wm_estimate e = tracking(10, 0.01);
  e.v_mps[0] = 0.3;
  save(&e, 1000);
  TEST_ASSERT_TRUE(wm_saved_pose_start(&saved, 1001.2, 600, 0, 0, motion, &start));
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, sqrt(0.01 * 0.01 + 0.36 * 0.36), start.sigma_heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, sqrt(0.01 * 0.01 + 0.36 * 0.36 + 0.72 * 0.72), start.sigma_xy_m);
  TEST_ASSERT_TRUE(wm_saved_pose_start(&saved, 1006, 600, 0, 0, motion, &start));
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, sqrt(0.01 * 0.01 + 1 + 0.3 * 0.3 * 4), start.sigma_heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, sqrt(0.01 * 0.01 + 1.8 * 1.8 + 6 * 6), start.sigma_xy_m);
  TEST_ASSERT_TRUE(wm_saved_pose_start(&saved, 4600, 6000, 0, 0, motion, &start));
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.01, start.sigma_heading_rad);
}

// A run that lost its pose does not leave the one from before, with a sigma of then: the next run searches.
TEST(a_lost_pose_replaces_the_one_before) {
  wm_estimate e = tracking(12.25, 0.3);
  save(&e, 1000);
  for (int vague = 0; vague < 2; vague++) {
    e = tracking(13, vague ? 60 : 8);
    if (!vague) e.state = WM_STATE_LOST;
    TEST_ASSERT_TRUE(wm_saved_pose_is_one(&e));
    save(&e, 1001);
    TEST_ASSERT_TRUE(saved.is_lost);
    TEST_ASSERT_FALSE(wm_saved_pose_start(&saved, 1002, 600, 0, 0, motion, &start));
  }
  e = tracking(14, 8);
  e.covariance[wm_cov_index(5, 5)] = 1.6 * 1.6;
  e.w_radps[2] = 1.0;
  save(&e, 1002);
  TEST_ASSERT_TRUE(wm_saved_pose_start(&saved, 1004, 600, 0, 0, motion, &start));
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, sqrt(64 + 4), start.sigma_xy_m);           // 2 s later
  TEST_ASSERT_DOUBLE_WITHIN(0.01, M_PI / sqrt(3), start.sigma_heading_rad);  // any heading
}

TEST(a_pose_that_is_worth_nothing_is_not_kept) {
  wm_estimate good = tracking(1, 0.3), e = good;
  TEST_ASSERT_TRUE(wm_saved_pose_is_worth_it(&good));
  e.state = WM_STATE_LOST;
  TEST_ASSERT_FALSE(wm_saved_pose_is_worth_it(&e));
  e = tracking(1, 3);
  TEST_ASSERT_TRUE(wm_saved_pose_is_worth_it(&e));
  e = tracking(1, 60);
  TEST_ASSERT_FALSE(wm_saved_pose_is_worth_it(&e));
  e = tracking(NAN, 0.3);
  TEST_ASSERT_FALSE(wm_saved_pose_is_worth_it(&e));
}

static void put(const char *text) {
  FILE *f = fopen(path, "w");
  TEST_ASSERT_NOT_NULL(f);
  (void)fputs(text, f);
  (void)fclose(f);
}

TEST(a_file_that_is_none_is_refused_with_its_line) {
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, wm_saved_pose_read(path, &saved, &err));
  const char *const wrong[] = {"",
                               "hello",
                               "format: waymark-pose/2\nutc_s: 1\npose: {x_m: 1, y_m: 1, heading_rad: 0}\n",
                               "format: waymark-pose/1\nutc_s: 1\npose: {x_m: 1, heading_rad: 0}\n",
                               "format: waymark-pose/1\nutc_s: 1\npose: {x_m: .nan, y_m: 1, heading_rad: 0}\n",
                               "format: waymark-pose/1\nutc_s: 1\npose: {x_m: 1, y_m"};
  for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
    put(wrong[i]);
    TEST_ASSERT_TRUE_MESSAGE(wm_saved_pose_read(path, &saved, &err) != WM_OK, wrong[i]);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "pose.yaml"), err.text);
  }
}

TEST(where_it_cant_be_written_the_old_one_stays) {
  wm_estimate e = tracking(1, 0.3);
  TEST_ASSERT_EQUAL(WM_IO, wm_saved_pose_write("/proc/nowhere/pose.yaml", &e, NULL, 1, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "/proc/nowhere/pose.yaml: can't be written"));
}

// ── budget ──────────────────────────────────────────────────────────────────────────────────────────────────────────

// Drives straight at 1 m/s for `seconds`; the odometry's variances grow per metre as told.
static void drive(wm_budget *budget, wm_estimate *e, int seconds, double along_m2, double heading_rad2) {
  for (int i = 0; i < seconds; i++) {
    wm_odom_point odom = {.t_ns = i * WM_NS_PER_S,
                          .pose_odom_base = {i, 0, 0},
                          .v_mps = 1,
                          .along_var_m2 = along_m2 * i,
                          .heading_var_rad2 = heading_rad2 * i};
    wm_budget_take(budget, e, &odom);
  }
}

TEST(the_way_left_is_where_the_variance_reaches_the_limit) {
  wm_budget budget;
  wm_estimate e = tracking(0, 0.1);
  double way_m, time_s;
  e.covariance[wm_cov_index(5, 5)] = 0;
  wm_budget_init(&budget, 1.0);
  drive(&budget, &e, 20, 0.01, 0);
  wm_budget_left(&budget, &e, &way_m, &time_s);
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 99, way_m);  // 0.1^2 + 0.01 d = 1
  TEST_ASSERT_DOUBLE_WITHIN(0.2, 99, time_s);

  e.covariance[wm_cov_index(5, 5)] = 0.1 * 0.1;  // six degrees: a metre after ten
  wm_budget_left(&budget, &e, &way_m, &time_s);
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 9.46, way_m);  // 0.01 + 0.01 d + 0.01 d^2 = 1
  e = tracking(0, 2);
  wm_budget_left(&budget, &e, &way_m, &time_s);
  TEST_ASSERT_EQUAL_DOUBLE(0, way_m);
  TEST_ASSERT_EQUAL_DOUBLE(0, time_s);
}

TEST(a_robot_that_stands_has_time_without_end) {
  wm_budget budget;
  wm_estimate e = tracking(0, 0.1);
  double way_m, time_s;
  wm_budget_init(&budget, 1.0);
  for (int i = 0; i < 10; i++) wm_budget_take(&budget, &e, &(wm_odom_point){.t_ns = i * WM_NS_PER_S});
  wm_budget_left(&budget, &e, &way_m, &time_s);
  TEST_ASSERT_DOUBLE_IS_INF(time_s);
}

// The estimator's covariance grows faster than the odometry's noise alone (scales, biases): that is believed.
TEST(growth_that_is_seen_while_reckoning_counts) {
  wm_budget budget;
  wm_estimate e = tracking(0, 0.1);
  double way_m, time_s;
  e.covariance[wm_cov_index(5, 5)] = 0;
  wm_budget_init(&budget, 1.0);
  e.state = WM_STATE_DEAD_RECKONING;
  drive(&budget, &e, 11, 0.001, 0);
  e.covariance[wm_cov_index(0, 0)] += 0.5;
  wm_budget_left(&budget, &e, &way_m, &time_s);
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 9.8, way_m);  // 0.05 a metre, 0.49 left
}

// ── the saved map ───────────────────────────────────────────────────────────────────────────────────────────────────

static wm_sensor eye = {.name = "eye", .bearing_sigma_rad = 0.01, .range_sigma_m = 0.03};
static uint8_t image[1 << 14];

static wm_setup setup_of_slam(const char *parameters) {
  char text[300];
  wm_config_free(&slam);
  int n = snprintf(text, sizeof text, "format: waymark-config/1\nestimator: slam\n%s", parameters);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(text, (size_t)n, "slam.yaml", &slam, &err), err.text);
  wm_setup setup = {.motion = slam.motion, .sightings = slam.sightings, .sensors = &eye, .sensor_count = 1};
  wm_start_init(&setup.start);
  return setup;
}

static size_t image_of(const wm_setup *setup) {
  const char *why;
  const size_t bytes = slam.estimator->state_bytes(slam.estimator_params, setup, &why);
  void *state = aligned_alloc(64, (bytes + 63) / 64 * 64);
  TEST_ASSERT_EQUAL(WM_OK, slam.estimator->init(state, slam.estimator_params, setup));
  const size_t kept = wm_keeper_of(slam.estimator)->keep(state, image, sizeof image);
  free(state);
  TEST_ASSERT_GREATER_THAN(100, kept);
  return kept;
}

static void refused_as(const wm_setup *setup, const char *why) {
  wm_saved_map map;
  TEST_ASSERT_NOT_EQUAL(WM_OK, wm_saved_map_read(path, &slam, setup, &map, &err));
  TEST_ASSERT_NULL(map.image);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, why), err.text);
}

static void write_file(const void *bytes, size_t count) {
  FILE *f = fopen(path, "wb");
  TEST_ASSERT_EQUAL(count, fwrite(bytes, 1, count, f));
  fclose(f);
}

TEST(a_map_is_there_again_and_a_damaged_one_is_refused) {
  wm_setup setup = setup_of_slam("");
  const wm_map_identity of = wm_map_identity_of(&slam, &setup);
  static uint8_t whole[1 << 14];
  wm_saved_map map;
  refused_as(&setup, "is not there");
  const size_t bytes = image_of(&setup);
  for (int i = 0; i < 2; i++)
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_saved_map_write(path, &of, 1000 + i, image, bytes, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_saved_map_read(path, &slam, &setup, &map, &err), err.text);
  TEST_ASSERT_EQUAL(bytes, map.bytes);
  TEST_ASSERT_EQUAL_MEMORY(image, map.image, bytes);
  TEST_ASSERT_EQUAL_DOUBLE(1001, map.utc_s);
  free(map.image);

  FILE *f = fopen(path, "rb");
  const size_t length = fread(whole, 1, sizeof whole, f);
  fclose(f);
  for (size_t cut = 0; cut < length; cut += 1 + cut / 50) {
    write_file(whole, cut);
    refused_as(&setup, "it is truncated");
  }
  for (size_t at = 8; at < length; at += 1 + at / 50) {
    whole[at] ^= 0x40;
    write_file(whole, length);
    refused_as(&setup, at < 32 || at >= 40 ? "checksum is wrong" : "it is truncated");
    whole[at] ^= 0x40;
  }
  TEST_ASSERT_EQUAL(WM_FULL, wm_saved_map_write(path, &of, 1, image, WM_SAVED_MAP_BYTES_MAX + 1, &err));
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "more than a saved map may have"), err.text);
  whole[6] = '2';
  write_file(whole, length);
  refused_as(&setup, "another version");
}

TEST(a_map_of_another_configuration_or_robot_is_refused) {
  wm_setup setup = setup_of_slam("");
  const wm_map_identity of = wm_map_identity_of(&slam, &setup);
  const size_t bytes = image_of(&setup);
  TEST_ASSERT_EQUAL(WM_OK, wm_saved_map_write(path, &of, 1, image, bytes, &err));
  eye.mounting.xyz_m[0] = 0.1;
  refused_as(&setup, "another calibration");
  eye.mounting.xyz_m[0] = 0;
  setup = setup_of_slam("publish: {rate_hz: 20}\n");  // of the runtime: the map is the same
  wm_saved_map map;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_saved_map_read(path, &slam, &setup, &map, &err), err.text);
  free(map.image);
  setup = setup_of_slam("slam: {landmarks: {confirm_seen: 7}}\n");
  refused_as(&setup, "another configuration");
  setup = setup_of_slam("motion: {noise: {speed_mps: 0.33}}\n");
  refused_as(&setup, "another configuration");
}

// What is wrong inside is found though the sum is right.
TEST(a_map_with_nan_is_refused) {
  wm_setup setup = setup_of_slam("");
  const wm_map_identity of = wm_map_identity_of(&slam, &setup);
  const size_t bytes = image_of(&setup);
  const double nan = NAN;
  memcpy(image + bytes - sizeof nan, &nan, sizeof nan);
  TEST_ASSERT_EQUAL(WM_OK, wm_saved_map_write(path, &of, 1, image, bytes, &err));
  refused_as(&setup, "not finite");
}

// Who may write into the folder may lay links there, which a program with more rights must not follow.
TEST(links_are_not_followed) {
  char beside[160], other[160];
  (void)snprintf(beside, sizeof beside, "%s.new", path);
  (void)snprintf(other, sizeof other, "%s", folder_path("other"));
  FILE *f = fopen(other, "w");
  fputs("precious", f);
  fclose(f);
  TEST_ASSERT_EQUAL(0, symlink(other, beside));
  wm_estimate e = tracking(1, 0.1);
  save(&e, 1000);
  char text[16] = {0};
  f = fopen(other, "r");
  TEST_ASSERT_NOT_NULL(fgets(text, sizeof text, f));
  fclose(f);
  TEST_ASSERT_EQUAL_STRING("precious", text);
  (void)unlink(other);
}
