// SPDX-License-Identifier: Apache-2.0
// A run with its real threads: its log gives its poses, it stops when told, LCM goes on without a way out.
#include <pthread.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/folder.h"
#include "common/suite.h"
#include "live/run.h"
#include "output/event_log.h"
#include "small_recording.h"

static const char kConfig[] =
    "format: waymark-config/1\nestimator: landmark_ekf\npublish: {lcm_url: \"memq://\"}\n"
    "realtime: {priority: 0, lock_memory: false}\n";

static wm_live_report live;
static wm_run_report report;

void tearDown(void) { folder_remove(); }

static wm_time_ns some_late(size_t frame) { return (wm_time_ns)(frame % 5) * 30 * WM_NS_PER_MS; }

static void run_live(const char *recording, const char *config_text, const wm_run_options *options) {
  wm_error err = {0};
  wm_config config;
  wm_recording *opened = NULL;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(config_text, strlen(config_text), "test.yaml", &config, &err),
                            err.text);
  TEST_ASSERT_EQUAL_MESSAGE(
      WM_OK, wm_recording_open(folder_path(recording), &config.overrides, NULL, NULL, &opened, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_run_live(&config, opened, options, &live, &err), err.text);
  wm_recording_close(opened);
  wm_config_free(&config);
}

TEST(the_log_of_a_run_gives_exactly_its_fused_poses) {
  small_recording_write("rec",
                        &(small_recording){.seconds = 3, .late_ns = some_late, .frame_hz = 20, .motion_hz = 100});
  const wm_run_options options = {.out_dir = folder_path("run"), .seed = 1, .speed = 1};
  run_live("rec", kConfig, &options);
  TEST_ASSERT_GREATER_THAN(200, live.run.poses);  // 300 where no thread was held up
  TEST_ASSERT_EQUAL_UINT64(0, live.run.health.outputs_lost);
  replay_log_into("run/events.wmlog", "again", &report);
  TEST_ASSERT_EQUAL(0, report.log_was_cut);
  TEST_ASSERT_EQUAL_UINT64(live.run.events, report.events);
  assert_same_file("run", "again", "trajectory.csv");
  assert_same_file("run", "again", "innovations.csv");
}

TEST(the_estimators_thread_allocates_nothing_and_misses_no_page) {
  small_recording_write("rec", &(small_recording){.seconds = 2, .motion_hz = 100});
  const wm_run_options options = {.out_dir = folder_path("run"), .seed = 1, .speed = 1};
  run_live("rec", kConfig, &options);
  TEST_ASSERT_GREATER_THAN(100, live.deadlines_total);
  if (live.run.allocations_after_start < 0) TEST_IGNORE_MESSAGE("a sanitizer's malloc is in place");
  TEST_ASSERT_EQUAL_INT64(0, live.run.allocations_after_start);
  if (getenv("WM_FEWER")) return;  // in an emulator: the page faults are its own
  TEST_ASSERT_EQUAL_INT64(0, live.run.page_faults_after_start);
}

// Nothing that arrived is lost between the threads, at sixteen times real speed, where a thread may be held up for two
// seconds.
TEST(everything_that_arrived_is_fused) {
  small_recording_write("rec", &(small_recording){.seconds = 30, .motion_hz = 100});
  const wm_run_options options = {.out_dir = folder_path("run"), .seed = 1, .speed = 16};
  run_live("rec",
           "format: waymark-config/1\nestimator: landmark_ekf\npublish: {lcm: false}\n"
           "merge: {horizon_ms: 30000, lateness_max_ms: 30000}\nrealtime: {priority: 0, lock_memory: false}\n",
           &options);
  for (uint32_t i = 0; i < live.run.health.source_count; i++) {
    const wm_source_health *s = &live.run.health.sources[i];
    TEST_ASSERT_GREATER_THAN(500, s->received);
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(0, s->dropped + s->late + s->duplicates, s->name);
  }
  TEST_ASSERT_EQUAL_UINT64(3000, live.run.poses);
}

// Once poses are on the disk, however long that takes on a busy machine.
static atomic_int stop;
static void *stop_when_poses_are_written(void *path) {
  struct stat file;
  for (int i = 0; i < 3000 && (stat(path, &file) != 0 || file.st_size < 1000); i++) (void)usleep(10000);
  atomic_store(&stop, 1);
  return NULL;
}

TEST(a_stop_ends_the_run_and_everything_is_written) {
  small_recording_write("rec", &(small_recording){.seconds = 60});
  pthread_t thread;
  char path[600];
  (void)snprintf(path, sizeof path, "%s", folder_path("run/trajectory.csv"));
  atomic_store(&stop, 0);
  TEST_ASSERT_EQUAL(0, pthread_create(&thread, NULL, stop_when_poses_are_written, path));
  const wm_run_options options = {.out_dir = folder_path("run"), .seed = 1, .speed = 1, .stop = &stop};
  run_live("rec", kConfig, &options);
  pthread_join(thread, NULL);
  TEST_ASSERT_LESS_THAN_DOUBLE(60, live.run.recorded_s);
  TEST_ASSERT_GREATER_THAN(2, live.run.poses);
  replay_log_into("run/events.wmlog", "again", &report);
  TEST_ASSERT_EQUAL(0, report.log_was_cut);
  assert_same_file("run", "again", "trajectory.csv");
}

TEST(a_duration_ends_the_run) {
  small_recording_write("rec", &(small_recording){.seconds = 60});
  const wm_run_options options = {.seed = 1, .speed = 1, .duration_s = 2};  // and nothing is written
  run_live("rec", kConfig, &options);
  TEST_ASSERT_LESS_THAN_DOUBLE(20, live.run.recorded_s);
  TEST_ASSERT_GREATER_THAN(2, live.run.poses);
}
