// SPDX-License-Identifier: Apache-2.0
// A recording in, files out: the same bytes every time, whatever arrives late, and an account of every datum.
#include "common/folder.h"
#include "common/suite.h"
#include "findings/findings.h"
#include "output/event_log.h"
#include "small_recording.h"

#define MS WM_NS_PER_MS

static const char kConfig[] = "format: waymark-config/1\nestimator: landmark_ekf\n";
static const char kConfig300[] =
    "format: waymark-config/1\nestimator: landmark_ekf\nsources:\n  - {name: sightings, lateness_max_ms: 300}\n";

static wm_run_report report;

void tearDown(void) { folder_remove(); }

static const wm_source_health *source(const char *name) {
  for (uint32_t i = 0; i < report.health.source_count; i++)
    if (strcmp(report.health.sources[i].name, name) == 0) return &report.health.sources[i];
  TEST_FAIL_MESSAGE(name);
  return NULL;
}

TEST(the_same_replay_twice_gives_the_same_bytes) {
  small_recording_write("rec", &(small_recording){.seconds = 20});
  replay_into("rec", kConfig, "one", &report);
  replay_into("rec", kConfig, "two", &report);
  static const char *const kFiles[] = {"trajectory.csv", "trajectory.tum",  "published.csv",
                                       "events.wmlog",   "innovations.csv", "health.json"};
  for (size_t i = 0; i < sizeof kFiles / sizeof kFiles[0]; i++) assert_same_file("one", "two", kFiles[i]);
  TEST_ASSERT_EQUAL_UINT64(400, report.poses);  // one at each of the driving stream's stamps
}

TEST(nothing_is_allocated_and_no_page_is_missing_after_the_start) {
  small_recording_write("rec", &(small_recording){.seconds = 20});
  replay_into("rec", kConfig, "run", &report);
  if (report.allocations_after_start < 0) TEST_IGNORE_MESSAGE("a sanitizer's malloc is in place");
  TEST_ASSERT_EQUAL_INT64(0, report.allocations_after_start);
  TEST_ASSERT_EQUAL_INT64(0, report.page_faults_after_start);
  size_t length;
  char *timing = read_all(folder_path("run/timing.json"), &length);
  TEST_ASSERT_NOT_NULL(strstr(timing, "\"allocations_after_start\": 0,"));
  TEST_ASSERT_NOT_NULL(strstr(timing, "\"page_faults_after_start\": 0,"));
  free(timing);
}

TEST(the_event_log_gives_the_same_poses_without_the_recording) {
  small_recording_write("rec", &(small_recording){.seconds = 20});
  replay_into("rec", kConfig, "run", &report);
  replay_log_into("run/events.wmlog", "again", &report);
  TEST_ASSERT_EQUAL(0, report.log_was_cut);
  assert_same_file("run", "again", "trajectory.csv");
  assert_same_file("run", "again", "trajectory.tum");
  assert_same_file("run", "again", "innovations.csv");
  assert_same_file("run", "again", "events.wmlog");
}

// ── late frames ─────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_time_ns all_150(size_t frame) { return (void)frame, 150 * MS; }
static wm_time_ns all_250(size_t frame) { return (void)frame, 250 * MS; }
static wm_time_ns one_in_seven_150(size_t frame) { return frame % 7 == 3 ? 150 * MS : 5 * MS; }
static wm_time_ns one_in_nine_250(size_t frame) { return frame % 9 == 4 ? 250 * MS : 20 * MS; }
static wm_time_ns all_200(size_t frame) { return (void)frame, 200 * MS; }

static void compare_late(wm_time_ns (*late_ns)(size_t), const char *config) {
  small_recording_write("fresh", &(small_recording){.seconds = 20});
  small_recording_write("late", &(small_recording){.seconds = 20, .late_ns = late_ns});
  replay_into("fresh", config, "fresh-run", &report);
  replay_into("late", config, "late-run", &report);
  assert_same_file("fresh-run", "late-run", "trajectory.csv");
  assert_same_file("fresh-run", "late-run", "innovations.csv");
  TEST_ASSERT_EQUAL_UINT64(0, source("sightings:eye")->late);
}

TEST(frames_that_are_all_150_ms_late_change_nothing) { compare_late(all_150, kConfig); }
TEST(a_single_frame_150_ms_late_changes_nothing) { compare_late(one_in_seven_150, kConfig); }
TEST(frames_that_are_all_250_ms_late_change_nothing) { compare_late(all_250, kConfig300); }
TEST(a_single_frame_250_ms_late_changes_nothing) { compare_late(one_in_nine_250, kConfig300); }

TEST(what_is_too_late_is_counted_and_the_number_that_is_told_would_do) {
  char stated[192], config[256];
  (void)snprintf(stated, sizeof stated, "%smerge: {lateness_max_ms: 150}\n", kConfig);
  small_recording_write("rec", &(small_recording){.seconds = 10, .late_ns = all_200});
  replay_into("rec", stated, "run", &report);
  const wm_source_health *eye = source("sightings:eye");
  TEST_ASSERT_GREATER_THAN(100, eye->received);
  TEST_ASSERT_EQUAL_UINT64(eye->received, eye->late);
  TEST_ASSERT_TRUE(wm_findings_has(&report.findings, WM_FOUND_DATA_LATE, "sightings:eye"));
  const char *number = NULL;
  for (size_t i = 0; i < report.findings.count; i++)
    if (report.findings.at[i].id == WM_FOUND_DATA_LATE)
      number = strstr(report.findings.at[i].fix, "`lateness_max_ms: ");
  TEST_ASSERT_NOT_NULL(number);
  (void)snprintf(config, sizeof config, "%ssources:\n  - {name: sightings, lateness_max_ms: %d}\n", stated,
                 atoi(number + strlen("`lateness_max_ms: ")));
  replay_into("rec", config, "mended", &report);
  TEST_ASSERT_EQUAL_UINT64(0, source("sightings:eye")->late);
}

TEST(where_no_bound_is_stated_three_late_data_raise_it) {
  small_recording_write("rec", &(small_recording){.seconds = 10, .late_ns = all_200});
  replay_into("rec", kConfig, "run", &report);
  const wm_source_health *eye = source("sightings:eye");
  TEST_ASSERT_GREATER_THAN(100, eye->received);
  TEST_ASSERT_EQUAL_UINT64(3, eye->late);
  TEST_ASSERT_EQUAL_INT64(220 * MS, eye->lateness_max_ns);
}

TEST(landmarks_that_moved_are_told) {
  static const wm_health health = {.counter_count = 2,
                                   .counters = {{.kind = WM_COUNTER_LANDMARKS_MOVED, .landmark_id = 7, .count = 2},
                                                {.kind = WM_COUNTER_IDENTITIES_AMBIGUOUS, .landmark_id = -1}}};
  static wm_findings found;
  char line[400];
  wm_health_findings(&health, &found);
  TEST_ASSERT_EQUAL(1, found.count);
  (void)wm_finding_line(&found.at[0], line, sizeof line);
  TEST_ASSERT_EQUAL_STRING(
      "map: 2 times a landmark was elsewhere than before; the last one is 7; fix: `waymark map survey RUN --poses RUN` "
      "lists what moved [landmark-moved]",
      line);
}

// ── silence ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_time_ns all_140(size_t frame) { return (void)frame, 140 * MS; }

TEST(the_first_datum_after_a_silence_is_fused) {
  small_recording_write(
      "rec", &(small_recording){.seconds = 20, .late_ns = all_140, .silent_from_s = 5, .silent_until_s = 12});
  replay_into("rec", kConfig, "run", &report);
  TEST_ASSERT_EQUAL_UINT64(0, source("sightings:eye")->late);
  size_t length;
  char *innovations = read_all(folder_path("run/innovations.csv"), &length);
  const char *first = strstr(innovations, "\n12000000000,sightings:eye,");
  TEST_ASSERT_NOT_NULL(first);
  const char *end = strchr(first + 1, '\n');
  TEST_ASSERT_NOT_NULL(end);
  TEST_ASSERT_EQUAL_STRING_LEN(",fused\n", end - 6, 7);
  TEST_ASSERT_NULL(strstr(innovations, "\n8000000000,"));
  free(innovations);
}

// In the silence the fused time lags by lateness_max, and poses go on being published for now.
TEST(silence_costs_the_published_pose_nothing) {
  small_recording_write("rec", &(small_recording){.seconds = 20, .silent_from_s = 5, .silent_until_s = 12});
  replay_into("rec", kConfig, "run", &report);
  size_t length;
  char *published = read_all(folder_path("run/published.csv"), &length);
  int64_t last_ns = INT64_MIN, rows = 0, in_silence = 0;
  for (char *line = strchr(published, '\n'); line && line[1]; line = strchr(line + 1, '\n')) {
    int64_t t_ns, sent_ns, fused_ns;
    TEST_ASSERT_EQUAL(3, sscanf(line + 1, "%" SCNd64 ",%" SCNd64 ",%" SCNd64, &t_ns, &sent_ns, &fused_ns));
    TEST_ASSERT_GREATER_THAN_INT64(last_ns, t_ns);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(10 * MS, sent_ns - t_ns);
    last_ns = t_ns;
    rows++;
    if (t_ns <= 6 * WM_NS_PER_S || t_ns > 12 * WM_NS_PER_S) continue;
    in_silence++;
    TEST_ASSERT_LESS_OR_EQUAL_INT64(200 * MS, t_ns - fused_ns);  // lateness_max and a motion period
  }
  TEST_ASSERT_GREATER_THAN(950, rows);
  TEST_ASSERT_EQUAL_INT64(300, in_silence);
  free(published);
}

// ── accounts ────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_time_ns some_too_late(size_t frame) { return (wm_time_ns)(frame % 11) * 40 * MS; }

TEST(every_datum_is_accounted_for) {
  small_recording_write("rec", &(small_recording){.seconds = 30, .late_ns = some_too_late});
  replay_into("rec", kConfig, "run", &report);
  for (uint32_t i = 0; i < report.health.source_count; i++) {
    const wm_source_health *s = &report.health.sources[i];
    uint64_t sum = s->fused + s->late + s->dropped + s->duplicates + s->future;
    for (int k = 0; k < WM_VERDICT_COUNT; k++) sum += s->rejected[k];
    for (int k = 0; k < WM_STATUS_COUNT; k++) sum += s->refused[k];
    TEST_ASSERT_GREATER_THAN(0, s->received);
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(s->received, sum, s->name);
  }
  TEST_ASSERT_GREATER_THAN(0, source("sightings:eye")->late);
}

// What is wrong outside of the part is not the part's.
TEST(from_and_until_take_a_part_of_a_source) {
  small_recording_write("rec", &(small_recording){.seconds = 20});
  FILE *f = fopen(folder_path("rec/sightings.csv"), "a");
  TEST_ASSERT_NOT_NULL(f);
  (void)fputs("20000000000,eye,1,nothing,3,20000000000\n", f);
  (void)fclose(f);
  replay_into("rec", kConfig, "whole", &report);
  TEST_ASSERT_EQUAL_UINT64(1, source("sightings:eye")->malformed);
  replay_into("rec",
              "format: waymark-config/1\nestimator: landmark_ekf\nsources:\n"
              "  - {name: sightings, from_s: 2, until_s: 5}\n",
              "run", &report);
  TEST_ASSERT_EQUAL_UINT64(0, source("sightings:eye")->malformed);
  size_t length;
  char *innovations = read_all(folder_path("run/innovations.csv"), &length);
  TEST_ASSERT_NOT_NULL(strstr(innovations, "\n2000000000,"));
  TEST_ASSERT_NULL(strstr(innovations, "\n1900000000,"));
  TEST_ASSERT_NULL(strstr(innovations, "\n5100000000,"));
  free(innovations);
  TEST_ASSERT_GREATER_THAN(0, source("sightings:eye")->ignored);
}

TEST(a_source_that_is_not_used_does_not_hold_time_back) {
  small_recording_write("rec", &(small_recording){.seconds = 5});
  replay_into("rec", "format: waymark-config/1\nestimator: odometry\n", "run", &report);
  TEST_ASSERT_EQUAL_UINT32(1, report.health.source_count);
  TEST_ASSERT_EQUAL_UINT64(100, report.poses);
}

static FILE *create(const char *file) {
  FILE *f = fopen(folder_path(file), "w");
  TEST_ASSERT_NOT_NULL(f);
  return f;
}

static double last_heading_rad(const char *run) {
  char path[64];
  size_t length;
  double q[8];
  (void)snprintf(path, sizeof path, "%s/trajectory.csv", run);
  char *text = read_all(folder_path(path), &length);
  const char *row = text + length - 1;
  while (row > text && row[-1] != '\n') row--;
  for (int i = 0; i < 8; i++) {
    char *end;
    q[i] = strtod(row, &end);
    row = end + 1;
  }
  free(text);
  return 2 * atan2(q[6], q[7]);
}

// CAN turns at 0.5 rad/s, the IMU at 0.1: mixed, the two would be one gyro.
TEST(a_streams_turn_rate_is_taken_instead_of_cans) {
  small_recording_write("rec", &(small_recording){.seconds = 1});
  TEST_ASSERT_EQUAL(0, remove(folder_path("rec/motion.csv")) | remove(folder_path("rec/sightings.csv")));
  FILE *f = create("rec/recording.yaml");
  fputs("format: waymark-recording/1\nvehicle: {initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}}\n", f);
  fclose(f);
  f = create("rec/vehicle.dbc");
  fputs(
      "VERSION \"\"\nBU_: CAR\nBO_ 256 MOTION: 4 CAR\n SG_ SPEED : 0|16@1- (0.01,0) [-300|300] \"m/s\" CAR\n"
      " SG_ YAW : 16|16@1- (0.001,0) [-30|30] \"rad/s\" CAR\n",
      f);
  fclose(f);
  f = create("rec/can-signals.yaml");
  fputs("- {quantity: vehicle_speed, message: MOTION, signal: SPEED}\n", f);
  fputs("- {quantity: yaw_rate, message: MOTION, signal: YAW}\n", f);
  fclose(f);
  f = create("rec/can.log");
  FILE *imu = create("rec/imu.csv");
  fputs("t_ns,wx_radps,wy_radps,wz_radps\n", imu);
  for (int i = 0; i <= 200; i++) {
    fprintf(f, "(%d.%06d) can0 100#6400F401\n", i / 50, i % 50 * 20000);
    fprintf(imu, "%lld,0,0,0.1\n", i * 20000000LL);
  }
  fclose(f);
  fclose(imu);
  replay_into("rec", "format: waymark-config/1\nestimator: odometry\n", "stream", &report);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.4, last_heading_rad("stream"));
  size_t length;
  char *health = read_all(folder_path("stream/health.json"), &length);
  TEST_ASSERT_NOT_NULL(strstr(health, "can: yaw_rate is taken from imu"));
  free(health);
  replay_into("rec", "format: waymark-config/1\nestimator: odometry\nsources: [{name: imu, use: false}]\n", "can",
              &report);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 2.0, last_heading_rad("can"));
}
