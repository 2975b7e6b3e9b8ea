// SPDX-License-Identifier: Apache-2.0
// What a recorder writes is read again: candump's lines, and an AVI that was cut at any byte.
#include <sys/stat.h>
#include <unistd.h>

#include "common/folder.h"
#include "common/suite.h"
#include "live/copy_map.h"
#include "live/record.h"
#include "output/avi_writer.h"
#include "waymark/can.h"
#include "waymark/video.h"

static const char *folder;
static wm_error err;

void setUp(void) {
  folder = folder_make();
  TEST_ASSERT_EQUAL(0, mkdir(folder_path("video"), 0777));
}
void tearDown(void) { folder_remove(); }

static void expect_again(const char *line) {
  wm_can_frame frame;
  char written[256];
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_candump_parse(line, strlen(line), &frame, &err), err.text);
  size_t length = wm_candump_write(&frame, written, sizeof written);
  TEST_ASSERT_EQUAL(strlen(line) + 1, length);
  TEST_ASSERT_EQUAL_STRING_LEN(line, written, strlen(line));
}

TEST(lines_of_candump_are_written_as_they_were_read) {
  expect_again("(1700000000.002500) can0 101#0CFEFFFF00000000");
  expect_again("(0.000000) vcan12 7FF#");
  expect_again("(5.999999) can0 12345678#01");
  expect_again("(5.000001) can0 123#R8");
  expect_again("(5.000001) can0 123#R");
  expect_again("(5.000001) can0 20000004#0010000000000000");
  expect_again("(5.000001) can0 123##1112233445566778899AABBCC");
  expect_again("(-0.000001) can0 123#00");
  wm_can_frame frame = {.length = 64, .is_fd = 1, .iface = "can0"};
  char tight[100];
  TEST_ASSERT_EQUAL(0, wm_candump_write(&frame, tight, sizeof tight));
}

#define W 18
#define H 5
#define PICTURES 4

static size_t write_video(void) {
  uint8_t grey[20 * H];
  FILE *f = fopen(folder_path("video/front.avi"), "wb"), *csv = fopen(folder_path("video/front.csv"), "w");
  TEST_ASSERT_TRUE(f && csv);
  TEST_ASSERT_EQUAL(0, avi_begin(f, "Y800", W, H, 30));
  (void)fputs("frame,t_ns,exposure_ns,arrival_ns\n", csv);
  for (int i = 0; i < PICTURES; i++) {
    memset(grey, 10 + i, sizeof grey);
    TEST_ASSERT_EQUAL(0, avi_picture(f, grey, W, H, 20));
    (void)fprintf(csv, "%d,%d,0,%d\n", i, 1000 + i * 33000000, 2000 + i * 33000000);
  }
  size_t length = (size_t)ftell(f);
  (void)fclose(f);
  (void)fclose(csv);
  return length;
}

static int pictures_in(void) {
  wm_video *opened;
  wm_frame frame;
  wm_camera camera = {.name = "front", .width_px = W, .height_px = H};
  int count = 0;
  if (wm_video_open(folder, &camera, 0, NULL, NULL, &opened, &err) != WM_OK) return -1;
  while (wm_video_next(opened, &frame, &err) == WM_OK) {
    TEST_ASSERT_EQUAL_UINT8(10 + count, frame.grey[(H - 1) * frame.stride_bytes + W - 1]);
    count++;
  }
  wm_video_close(opened);
  return count;
}

TEST(a_video_that_was_cut_anywhere_is_read_up_to_there) {
  size_t length = write_video(), picture = 8 + W * H;
  TEST_ASSERT_EQUAL(PICTURES, pictures_in());
  for (size_t cut = length; cut-- > length - picture * 2 - 3;) {
    TEST_ASSERT_EQUAL(0, truncate(folder_path("video/front.avi"), (off_t)cut));
    int whole = cut >= length - picture ? PICTURES - 1 : cut >= length - 2 * picture ? PICTURES - 2 : PICTURES - 3;
    TEST_ASSERT_EQUAL(whole, pictures_in());
  }
}

TEST(an_empty_configuration_is_refused) {
  static wm_config config;
  wm_record_report report;
  const wm_record_options options = {.out_dir = folder};
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_record(&config, &options, &report, &err));
}

static void expect_text(const char *name, const char *text) {
  char there[400] = "";
  FILE *f = fopen(folder_path(name), "r");
  TEST_ASSERT_NOT_NULL_MESSAGE(f, name);
  there[fread(there, 1, sizeof there - 1, f)] = '\0';
  (void)fclose(f);
  TEST_ASSERT_EQUAL_STRING(text, there);
}

// A bus that isn't there: the folder is a recording all the same, from its beginning on; its configuration names its
// own files.
TEST(without_its_devices_a_recording_is_begun_and_ended) {
  const char *text =
      "format: waymark-config/1\nestimator: odometry\n"
      "dbc: /dev/null\ndevices: {can: [{interface: nocan7}]}\ncan_signals: /dev/null  # which is none";
  char out[128], path[160];
  wm_config config;
  wm_record_report report;
  (void)snprintf(out, sizeof out, "%s/rec", folder);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(text, strlen(text), "x.yaml", &config, &err), err.text);
  const wm_record_options options = {.out_dir = out, .duration_s = 0.3};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_record(&config, &options, &report, &err), err.text);
  const char *const files[] = {"recording.yaml", "config.yaml", "can.log"};
  for (size_t i = 0; i < 3; i++) {
    (void)snprintf(path, sizeof path, "%s/%s", out, files[i]);
    TEST_ASSERT_EQUAL_MESSAGE(0, access(path, R_OK), path);
  }
  expect_text("rec/config.yaml",
              "format: waymark-config/1\nestimator: odometry\ndbc: vehicle.dbc\n"
              "devices: {can: [{interface: nocan7, dbc: vehicle.dbc, can_signals: can-signals.yaml}]}\n"
              "can_signals: can-signals.yaml\n");
  wm_config_free(&config);
}

#define SIGNALS(quantity, signal) "- {quantity: " quantity ", message: Motion, signal: " signal "}\n"

// Two buses with the same id for another meaning: each has its DBC and binding, in the recording, too.
TEST(two_buses_are_recorded_and_read_again) {
  char text[1000], path[200], out[128];
  wm_config config;
  wm_record_report report;
  wm_recording *recording;
  folder_write("fast.dbc", "BO_ 256 Motion: 2 X\n SG_ V : 0|16@1+ (0.001,0) [0|65] \"m/s\" X\n");
  folder_write("fast.yaml", SIGNALS("vehicle_speed", "V"));
  folder_write("body.dbc", "BO_ 256 Motion: 2 X\n SG_ W : 0|16@1- (0.001,0) [-32|32] \"rad/s\" X\n");
  folder_write("body.yaml", SIGNALS("yaw_rate", "W"));
  // Any style: a map in lines, a list in brackets, the second bus by the files at the top.
  (void)snprintf(
      text, sizeof text,
      "{format: waymark-config/1, estimator: odometry, dbc: body.dbc,\n  can_signals: \"body.yaml\", devices:\n"
      "    {can: [{dbc: fast.dbc, interface: nocan7, can_signals: fast.yaml}, {interface: nocan8}]}}\n");
  (void)snprintf(path, sizeof path, "%s/robot.yaml", folder);
  (void)snprintf(out, sizeof out, "%s/rec", folder);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(text, strlen(text), path, &config, &err), err.text);
  const wm_record_options options = {.out_dir = out, .duration_s = 0.2};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_record(&config, &options, &report, &err), err.text);
  wm_config_free(&config);
  folder_write("rec/can.log", "(1.000000) nocan7 100#E803\n(1.010000) nocan8 100#9CFF\n(1.020000) nocan9 100#0000\n");

  // What was written is a configuration, and names the recording's own files.
  (void)snprintf(path, sizeof path, "%s/config.yaml", out);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_load(path, &config, &err), err.text);
  TEST_ASSERT_EQUAL(2, config.devices.can_count);
  TEST_ASSERT_NOT_NULL(strstr(config.devices.can[0].dbc, "rec/vehicle.dbc"));
  TEST_ASSERT_NOT_NULL(strstr(config.devices.can[1].dbc, "rec/nocan8.dbc"));
  TEST_ASSERT_NOT_NULL(strstr(config.devices.can[1].can_signals, "rec/nocan8-signals.yaml"));
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_recording_open(out, &config.overrides, NULL, NULL, &recording, &err), err.text);
  wm_config_free(&config);
  size_t count;
  wm_source *const *sources = wm_recording_sources(recording, &count);
  TEST_ASSERT_EQUAL(2, count);
  TEST_ASSERT_EQUAL_HEX32(1u << WM_Q_VEHICLE_SPEED | 1u << WM_Q_YAW_RATE, wm_recording_quantities(recording));
  const double expected[] = {1.0, -0.1};
  for (size_t i = 0; i < 2; i++) {
    static wm_event event;
    TEST_ASSERT_EQUAL_STRING(i ? "can:nocan8" : "can:nocan7", sources[i]->name);
    TEST_ASSERT_EQUAL(WM_OK, sources[i]->ops->next(sources[i], &event, &err));
    TEST_ASSERT_EQUAL(1, event.as.quantities.count);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected[i], event.as.quantities.value[0]);
    TEST_ASSERT_EQUAL(WM_END, sources[i]->ops->next(sources[i], &event, &err));
  }
  TEST_ASSERT_EQUAL_UINT64(1, sources[0]->counts.ignored);  // of no source
  TEST_ASSERT_EQUAL_UINT64(0, sources[1]->counts.ignored);
  wm_recording_close(recording);
}

// Wherever its pictures lie, in the recording they lie beside it.
TEST(a_map_is_copied_with_its_pictures) {
  char yaml[512], out[128], from[160];
  (void)snprintf(out, sizeof out, "%s/rec", folder);
  TEST_ASSERT_EQUAL(0, mkdir(out, 0777));
  folder_write("plans/floor.png", "floor");
  folder_write("floor.png", "edges");
  (void)snprintf(yaml, sizeof yaml,
                 "resolution: 0.05\norigin: [0, 0, 0]  # at the door\nimage: nowhere.png\n"
                 "layers: {edges: %s/floor.png, drivable: plans/floor.png}\n",
                 folder);
  folder_write("map.yaml", yaml);
  (void)snprintf(from, sizeof from, "%s/map.yaml", folder);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, copy_map(from, out, &err), err.text);
  expect_text("rec/map/map.yaml",
              "resolution: 0.05\norigin: [0, 0, 0]  # at the door\nimage: nowhere.png\n"
              "layers: {edges: floor.png, drivable: 1-floor.png}\n");
  expect_text("rec/map/floor.png", "edges");
  expect_text("rec/map/1-floor.png", "floor");
  (void)snprintf(from, sizeof from, "%s/none.yaml", folder);
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, copy_map(from, out, &err));
}

// A disk that is full from the beginning.
TEST(a_full_disk_ends_it_and_says_so) {
  const char *text =
      "format: waymark-config/1\nestimator: odometry\n"
      "dbc: /dev/null\ndevices: {can: [{interface: nocan7}]}\ncan_signals: /dev/null  # which is none";
  char out[128];
  wm_config config;
  wm_record_report report;
  (void)snprintf(out, sizeof out, "%s/rec", folder);
  TEST_ASSERT_EQUAL(WM_OK, wm_config_parse(text, strlen(text), "x.yaml", &config, &err));
  const wm_record_options options = {.out_dir = out, .bytes_free_min = UINT64_MAX};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_record(&config, &options, &report, &err), err.text);
  TEST_ASSERT_TRUE(report.is_full);
  wm_config_free(&config);
}
