// SPDX-License-Identifier: Apache-2.0
// What is left of the last seconds, after a loss, a death, and an end in order.
#include <fcntl.h>
#include <glob.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/folder.h"
#include "common/suite.h"
#include "output/black_box.h"

static const char kConfig[] = "format: waymark-config/1\nestimator: odometry\n";
static const char *folder;
static char said[4096];
static wm_config config;
static wm_assembly assembly;
static black_box box;
static double x_m;
static wm_time_ns now_ns;

static void hear(void *context, const char *line) {
  (void)context;
  (void)snprintf(said + strlen(said), sizeof said - strlen(said), "%s\n", line);
}

void setUp(void) {
  wm_error err;
  said[0] = '\0';
  folder = folder_make();
  TEST_ASSERT_EQUAL(WM_OK, wm_config_parse(kConfig, strlen(kConfig), "robot.yaml", &config, &err));
  memset(&assembly, 0, sizeof assembly);
  assembly.config = &config;
  assembly.calibration_text = "";
  assembly.setup.motion = config.motion;
  assembly.kinds = WM_EVENT_BIT(WM_EVENT_TWIST2);
  assembly.source_count = 1;
  (void)snprintf(assembly.sources[0].name, sizeof assembly.sources[0].name, "motion");
  assembly.sources[0].kinds = assembly.kinds;
  x_m = 0;
  now_ns = 1000 * WM_NS_PER_S;
}

void tearDown(void) {
  wm_config_free(&config);
  folder_remove();
}

static void open_box(void) { black_box_open(&box, folder, 10, 2, &assembly, hear, NULL); }

// Ten events and a pose a second.
static void drive(int seconds, wm_state state) {
  for (int i = 0; i < seconds * 10; i++) {
    wm_event event = {.kind = WM_EVENT_TWIST2, .t_ns = now_ns, .arrival_ns = now_ns, .as.twist2 = {1, 0}};
    wm_estimate pose = {.t_ns = now_ns, .state = (uint8_t)state, .dof = 3};
    pose.pose_map_base.p_m[0] = x_m;
    pose.pose_map_base.q_xyzw[3] = 1;
    black_box_pose(&box, &pose, -1, now_ns);
    black_box_event(&box, &event);
    if (i % 10 == 0) black_box_flush(&box);
    x_m += 0.1;
    now_ns += WM_NS_PER_S / 10;
  }
}

static size_t files(const char *pattern) {
  glob_t found;
  size_t count = glob(folder_path(pattern), 0, NULL, &found) == 0 ? found.gl_pathc : 0;
  globfree(&found);
  return count;
}

// Events of a log, and where it begins.
static int events_of(const char *name, double *begins_x_m) {
  wm_error err;
  wm_log_reader *log;
  static wm_event event;
  uint64_t missing = 0;
  int cut = 0, count = 0;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_log_open(folder_path(name), &log, &err), name);
  *begins_x_m = wm_log_reader_head(log)->start.p_m[0];
  while (wm_log_next(log, &event, &missing, &cut, &err) == WM_OK) count++;
  wm_log_reader_close(log);
  return count;
}

TEST(a_loss_is_kept_with_what_was_before_and_after) {
  double begins_x_m;
  open_box();
  drive(34, WM_STATE_TRACKING);
  TEST_ASSERT_EQUAL(2, files("*.wmlog"));
  drive(2, WM_STATE_LOST);
  TEST_ASSERT_EQUAL(0, files("lost-*"));  // a quarter of the time after it
  drive(1, WM_STATE_LOST);
  TEST_ASSERT_EQUAL(2, files("lost-0001-*.wmlog"));
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, "black box: kept as"), said);
  TEST_ASSERT_EQUAL(100, events_of("lost-0001-before.wmlog", &begins_x_m));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 20, begins_x_m);
  TEST_ASSERT_EQUAL(65, events_of("lost-0001-now.wmlog", &begins_x_m));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 30, begins_x_m);
  drive(30, WM_STATE_LOST);  // still the same loss
  TEST_ASSERT_EQUAL(2, files("lost-*"));
  drive(30, WM_STATE_TRACKING);
  drive(3, WM_STATE_LOST);
  TEST_ASSERT_EQUAL(2, files("lost-0002-*"));
  black_box_close(&box);
}

static void expect_kept(const char *name, const char *map, double begins_x_m) {
  wm_error err;
  wm_log_reader *log;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_log_open(folder_path(name), &log, &err), name);
  const wm_log_head *head = wm_log_reader_head(log);
  TEST_ASSERT_EQUAL(strlen(map), head->kept_bytes);
  TEST_ASSERT_EQUAL_MEMORY(map, head->kept, strlen(map));
  TEST_ASSERT_EQUAL_DOUBLE(begins_x_m, head->start.p_m[0]);
  wm_log_reader_close(log);
}

// GIVEN a run that took a map up WHEN it is logged THEN the first log begins as the run did, with all events, and later
// ones with the newest map.
TEST(logs_have_the_map_that_they_begin_with) {
  double begins_x_m;
  wm_event early = {.kind = WM_EVENT_TWIST2, .t_ns = now_ns, .arrival_ns = now_ns};
  assembly.kept = "a map of the run before";
  assembly.kept_bytes = strlen(assembly.kept);
  assembly.setup.start.p_m[0] = -7;
  open_box();
  black_box_event(&box, &early);  // before there is a pose
  drive(5, WM_STATE_TRACKING);
  black_box_map(&box, "a map of now", 12);
  black_box_map(&box, "a larger map of now, after a while", 34);
  drive(6, WM_STATE_TRACKING);
  black_box_flush(&box);
  TEST_ASSERT_EQUAL(101, events_of("before.wmlog", &begins_x_m));
  expect_kept("before.wmlog", "a map of the run before", -7);
  expect_kept("now.wmlog", "a larger map of now, after a while", begins_x_m = 10);
  black_box_close(&box);
}

// A robot that waits for hours for its first pose fills no disk.
TEST(a_log_without_a_pose_begins_again) {
  double begins_x_m;
  open_box();
  for (int i = 0; i < 1000; i++) {
    wm_event event = {.kind = WM_EVENT_TWIST2, .t_ns = now_ns, .arrival_ns = now_ns};
    black_box_event(&box, &event);
    now_ns += WM_NS_PER_S / 10;
  }
  black_box_flush(&box);
  TEST_ASSERT_LESS_OR_EQUAL(101, events_of("now.wmlog", &begins_x_m));
  black_box_close(&box);
}

TEST(a_run_that_died_leaves_its_last_seconds) {
  double begins_x_m;
  open_box();
  drive(15, WM_STATE_TRACKING);
  (void)fclose(box.log.file);  // as the kernel does at a death: no end is written
  open_box();
  TEST_ASSERT_EQUAL(2, files("died-0001-*"));
  TEST_ASSERT_GREATER_THAN(40, events_of("died-0001-now.wmlog", &begins_x_m));
  drive(1, WM_STATE_TRACKING);
  black_box_close(&box);
}

TEST(an_end_in_order_leaves_nothing_to_keep) {
  open_box();
  drive(15, WM_STATE_TRACKING);
  black_box_close(&box);
  open_box();
  drive(1, WM_STATE_TRACKING);
  black_box_close(&box);
  TEST_ASSERT_EQUAL(0, files("died-*") + files("lost-*"));
}

TEST(an_end_soon_after_a_loss_keeps_it) {
  open_box();
  drive(5, WM_STATE_TRACKING);
  drive(1, WM_STATE_LOST);
  black_box_close(&box);
  TEST_ASSERT_EQUAL(1, files("lost-0001-*"));
}

TEST(the_oldest_go) {
  open_box();
  for (int i = 0; i < 25; i++) {
    drive(1, WM_STATE_TRACKING);
    drive(4, WM_STATE_LOST);
  }
  black_box_close(&box);
  TEST_ASSERT_EQUAL(1, files("lost-0025-now.wmlog"));
  TEST_ASSERT_EQUAL(0, files("lost-0001-*"));
  TEST_ASSERT_EQUAL(BLACK_BOX_KEPT_MAX, files("lost-*-now.wmlog"));
}

static void die(double at_s) {
  open_box();
  drive(2, WM_STATE_TRACKING);
  (void)fclose(box.log.file);
  const struct timespec when[2] = {{.tv_sec = (time_t)at_s}, {.tv_sec = (time_t)at_s}};
  TEST_ASSERT_EQUAL(0, utimensat(AT_FDCWD, folder_path("now.wmlog"), when, 0));
}

// GIVEN an old incident WHEN a run dies again and again THEN the incident stays, with the loop's first and newest
// death.
TEST(a_crash_loop_evicts_no_old_incident) {
  open_box();
  drive(5, WM_STATE_TRACKING);
  drive(1, WM_STATE_LOST);
  black_box_close(&box);
  for (int i = 0; i < 30; i++) die(1000000 + 2 * i);
  open_box();  // keeps the last death
  black_box_close(&box);
  TEST_ASSERT_EQUAL(1, files("lost-0001-now.wmlog"));
  TEST_ASSERT_EQUAL(2, files("died-*-now.wmlog"));
  die(1010000);  // hours later: another fault
  open_box();
  black_box_close(&box);
  TEST_ASSERT_EQUAL(3, files("died-*-now.wmlog"));
  TEST_ASSERT_EQUAL(1, files("lost-0001-now.wmlog"));
}

TEST(a_link_in_its_folder_is_not_followed) {
  TEST_ASSERT_EQUAL(0, symlink(folder_path("other"), folder_path("now.wmlog")));
  open_box();
  drive(1, WM_STATE_TRACKING);
  black_box_close(&box);
  TEST_ASSERT_EQUAL(0, files("other"));
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, "symbolic link"), said);
}

static void touch(const char *name) {
  FILE *f = fopen(folder_path(name), "w");
  TEST_ASSERT_NOT_NULL(f);
  (void)fclose(f);
}

// WHEN there is an incident of this number THEN the next two have the next numbers, and all stay.
static void numbers_follow(uint64_t number) {
  char name[64];
  (void)snprintf(name, sizeof name, "lost-%" PRIu64 "-now.wmlog", number);
  touch(name);
  for (int i = 0; i < 2; i++) {
    open_box();
    drive(5, WM_STATE_TRACKING);
    drive(1, WM_STATE_LOST);
    black_box_close(&box);
  }
  for (uint64_t i = 0; i < 3; i++) {
    (void)snprintf(name, sizeof name, "lost-%" PRIu64 "-now.wmlog", number + i);
    TEST_ASSERT_EQUAL_MESSAGE(1, files(name), name);
  }
}

// After 9999 incidents the newest are not taken for old ones.
TEST(numbers_go_on_beyond_four_digits) { numbers_follow(10041); }
TEST(numbers_go_on_beyond_32_bits) { numbers_follow(UINT32_MAX); }

// A number that is none of a black box does not end its counting.
TEST(a_number_without_end_is_no_number) {
  touch("lost-99999999999999999999-now.wmlog");
  numbers_follow(20041);
}

// A camera whose newest picture is as the test says.
static wm_frame shown;
static int is_new;
static uint8_t grey[16 * 4];

static wm_status next_shown(wm_frame_source *base, wm_frame *out, wm_error *err) {
  (void)base, (void)err;
  if (!is_new) return WM_AGAIN;
  is_new = 0;
  *out = shown;
  return WM_OK;
}

static void raw_shown(const wm_frame_source *base, wm_camera_raw *out) {
  (void)base;
  *out = (wm_camera_raw){.data = grey, .bytes = sizeof grey};
}

static void close_shown(wm_frame_source *base) { (void)base; }

static const wm_frame_source_ops kShown = {.next = next_shown, .raw = raw_shown, .close = close_shown};

static int has_front(const wm_pictures *base, const char *camera) {
  (void)base;
  return strcmp(camera, "front") == 0;
}

static wm_status open_front(wm_pictures *base, const wm_camera *camera, int32_t index, const wm_frame_wishes *wishes,
                            wm_frame_source **out, wm_error *err) {
  static wm_frame_source source = {.ops = &kShown};
  (void)base, (void)camera, (void)index, (void)err;
  TEST_ASSERT_EQUAL(0, wishes->wait_ms);
  TEST_ASSERT_TRUE(wishes->wants_raw);
  *out = &source;
  return WM_OK;
}

static void open_camera(void) {
  static const wm_pictures_ops kOps = {.has = has_front, .open = open_front};
  static wm_pictures pictures = {.ops = &kOps};
  static wm_rig rig = {.camera_count = 2};
  wm_error err;
  (void)snprintf(rig.cameras[0].name, sizeof rig.cameras[0].name, "rear");
  (void)snprintf(rig.cameras[1].name, sizeof rig.cameras[1].name, "front");
  TEST_ASSERT_EQUAL(WM_OK, black_box_open_pictures(&box, &pictures, &rig, &err));
}

// Ten pictures a second come, two are kept.
static void see(int seconds) {
  for (int i = 0; i < seconds * 10; i++) {
    wm_time_ns t_ns = now_ns + i * (WM_NS_PER_S / 10);
    shown =
        (wm_frame){.t_ns = t_ns, .arrival_ns = t_ns, .width_px = 16, .height_px = 4, .stride_bytes = 16, .grey = grey};
    is_new = 1;
    black_box_take_pictures(&box);
    black_box_take_pictures(&box);
  }
}

static int lines_of(const char *name) {
  int lines = 0;
  FILE *f = fopen(folder_path(name), "r");
  if (!f) return -1;
  for (int c; (c = fgetc(f)) != EOF;) lines += c == '\n';
  (void)fclose(f);
  return lines;
}

TEST(pictures_are_kept_with_it) {
  open_box();
  open_camera();
  for (int i = 0; i < 7; i++) {  // of two seconds each: the videos take turns after ten
    see(2);
    drive(2, WM_STATE_TRACKING);
  }
  see(3);
  drive(3, WM_STATE_LOST);
  TEST_ASSERT_EQUAL(21, lines_of("lost-0001-front-b.csv"));  // the first ten seconds, and a head
  TEST_ASSERT_EQUAL(15, lines_of("lost-0001-front-a.csv"));  // the seven that followed
  TEST_ASSERT_EQUAL(4, files("lost-0001-front-*"));
  // What is kept stays as it is when its place is taken again.
  for (int i = 0; i < 3; i++) {
    see(10);
    drive(10, WM_STATE_TRACKING);
  }
  TEST_ASSERT_EQUAL(21, lines_of("lost-0001-front-b.csv"));
  // A run that dies leaves its own, and the next one begins without them.
  (void)fclose(box.log.file);
  open_box();
  TEST_ASSERT_EQUAL(4, files("died-0002-front-*"));
  TEST_ASSERT_EQUAL(0, files("pictures-*"));
  drive(1, WM_STATE_TRACKING);
  black_box_close(&box);
}

TEST(a_disk_that_takes_nothing_is_said_once) {
  black_box_open(&box, "/proc/nowhere", 10, 2, &assembly, hear, NULL);
  drive(25, WM_STATE_TRACKING);
  black_box_close(&box);
  const char *first = strstr(said, "black box: can't be written");
  TEST_ASSERT_NOT_NULL_MESSAGE(first, said);
  TEST_ASSERT_NULL_MESSAGE(strstr(first + 1, "black box: can't be written"), said);
}
