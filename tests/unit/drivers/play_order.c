// SPDX-License-Identifier: Apache-2.0
// A recording's data in the order of their times, with faults; the same items each time, and from later on.
#include "waymark/play.h"

#include <unistd.h>

#include "common/folder.h"
#include "common/suite.h"
#include "video_files.h"
#include "waymark/lcm_messages.h"
#include "waymark/lcm_streams.h"

#define W 32
#define H 24

static wm_play *play;
static wm_faults faults;
static wm_error err;
static wm_play_item item;
static const char *dir;
static bytes file;
static uint8_t jpeg[65536];

// Two buses at 20 and 10 Hz, two cameras at 10 Hz with the same stamps, an IMU, sightings, and points, for 4 s from
// 100 s on.
static void write_recording(void) {
  char text[65536] = "", row[160];
  folder_write("recording.yaml", "format: waymark-recording/1\nduration_s: 4\n");
  for (int i = 0; i < 80; i++) {
    (void)snprintf(row, sizeof row, "(%d.%06d) can0 1A0#%02X00112233445566\n", 100 + i / 20, i % 20 * 50000, i);
    strcat(text, row);
    if (i % 2 == 0)
      (void)snprintf(row, sizeof row, "(%d.%06d) can1 18FF0102##1%02X000102030405060708090A\n", 100 + i / 20,
                     i % 20 * 50000 + 1000, i);
    if (i % 2 == 0) strcat(text, row);
  }
  strcat(text, "(104.000000) can0 20000080#0000000000000000\n(104.001000) can0 7FF#R4\nrubbish\n");
  folder_write("can.log", text);
  static const char *const kCameras[] = {"left", "right"};
  for (int c = 0; c < 2; c++) {
    char name[64];
    file.size = 0;
    avi_head(&file, "MJPG", W, H, 0);
    (void)strcpy(text, "frame,t_ns,arrival_ns\n");
    for (int i = 0; i < 40; i++) {
      const size_t size = make_jpeg(W, H, 3 * i + 100 * c, jpeg, sizeof jpeg);
      avi_chunk(&file, "00dc", jpeg, size);
      (void)snprintf(row, sizeof row, "%d,%lld,%lld\n", i, 100010000000LL + i * 100000000LL,
                     100050000000LL + i * 100000000LL);
      strcat(text, row);
    }
    (void)snprintf(name, sizeof name, "video/%s.csv", kCameras[c]);
    folder_write(name, text);
    (void)snprintf(name, sizeof name, "video/%s.avi", kCameras[c]);
    folder_write_bytes(name, (const char *)file.data, file.size);
  }
  (void)strcpy(text, "t_ns,arrival_ns,wx_radps,wy_radps,wz_radps\n");
  for (int i = 0; i < 100; i++) {
    (void)snprintf(row, sizeof row, "%lld,%lld,0,0,%d\n", 100000000000LL + i * 40000000LL,
                   100005000000LL + i * 40000000LL, i);
    strcat(text, row);
  }
  folder_write("imu.csv", text);
  folder_write("sightings.csv",
               "t_ns,sensor,id,bearing_rad,range_m,arrival_ns\n101000000000,eye,1,0.1,2,101100000000\n"
               "101000000000,eye,2,0.2,3,101100000000\n102000000000,eye,3,0.3,4,102100000000\n"
               "102000000000,ear,4,,5,102100000000\n");
  folder_write("points.csv", "t_ns,x_m,y_m\n100000000000,1,2\n");
}

void setUp(void) {
  dir = folder_make();
  write_recording();
  play = NULL;
  memset(&faults, 0, sizeof faults);
}

void tearDown(void) {
  wm_play_close(play);
  wm_faults_free(&faults);
  folder_remove();
}

static void open_at(double from_s, double until_s, uint32_t passes) {
  const wm_play_options options = {.from_s = from_s, .until_s = until_s, .passes = passes, .faults = &faults};
  wm_play_close(play);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_play_open(dir, &options, &play, &err), err.text);
}

static void break_it(const char *list) {
  char text[4096];
  (void)snprintf(text, sizeof text, "format: waymark-faults/1\nfaults:\n%s", list);
  wm_faults_free(&faults);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_faults_parse(text, strlen(text), "f.yaml", &faults, &err), err.text);
}

static int next(void) {
  const wm_status status = wm_play_next(play, &item, &err);
  TEST_ASSERT_TRUE_MESSAGE(status == WM_OK || status == WM_END, err.text);
  return status == WM_OK;
}

static double at_s(void) { return (double)item.due_ns * 1e-9; }

static const char *name(void) {
  size_t count;
  return wm_play_streams(play, &count)[item.stream].name;
}

static int is(const char *stream) { return item.kind != WM_PLAY_FAULT && strcmp(name(), stream) == 0; }

// Items of the stream that are due in [from_s, until_s).
static int count_of(const char *stream, double from_s, double until_s) {
  int n = 0;
  open_at(0, 0, 1);
  while (next()) n += is(stream) && at_s() >= from_s && at_s() < until_s;
  return n;
}

TEST(all_data_come_in_the_order_of_their_times) {
  int can0 = 0, can1 = 0, pictures = 0, messages = 0;
  wm_time_ns before_ns = 0;
  size_t count;
  open_at(0, 0, 1);
  (void)wm_play_streams(play, &count);
  TEST_ASSERT_EQUAL(8, count);
  TEST_ASSERT_EQUAL_INT64(100000000000LL, wm_play_first_ns(play));
  for (; next(); before_ns = item.due_ns) {
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(before_ns, item.due_ns);
    can0 += is("can:can0");
    can1 += is("can:can1");
    pictures += item.kind == WM_PLAY_PICTURE;
    messages += item.kind == WM_PLAY_MESSAGE;
    if (is("can:can1") && item.number == 3) {
      TEST_ASSERT_EQUAL_INT64(301000000, item.due_ns);
      TEST_ASSERT_EQUAL_HEX32(0x18FF0102, item.frame.id);
      TEST_ASSERT_TRUE(item.frame.is_extended && item.frame.is_fd && item.frame.length == 12);
    }
  }
  TEST_ASSERT_EQUAL(82, can0);  // an error frame and a remote one among them
  TEST_ASSERT_EQUAL(40, can1);
  TEST_ASSERT_EQUAL(80, pictures);
  TEST_ASSERT_EQUAL(100 + 3, messages);
  const char *problem;
  TEST_ASSERT_EQUAL_UINT64(1, wm_play_unreadable(play, &problem));
  TEST_ASSERT_NOT_NULL(strstr(problem, "can.log:123"));
  TEST_ASSERT_NOT_NULL(wm_play_streams(play, &count)[wm_play_find(play, "points")].lacking);
}

TEST(pictures_of_a_trigger_follow_each_other) {
  open_at(0, 0, 1);
  while (next()) {
    if (!is("camera:left")) continue;
    const wm_time_ns left_ns = item.due_ns;
    TEST_ASSERT_TRUE(next() && is("camera:right"));
    TEST_ASSERT_EQUAL_INT64(left_ns, item.due_ns);
  }
}

TEST(messages_come_at_their_arrival_with_their_stamp) {
  wm_stream_row row;
  wm_sighting seen[WM_LCM_OBSERVATIONS_MAX];
  char sensor[32];
  size_t count;
  wm_time_ns t_ns;
  uint8_t message[8192];
  open_at(0, 0, 1);
  do TEST_ASSERT_TRUE(next());
  while (!is("imu") || item.number < 7);
  TEST_ASSERT_EQUAL_INT64(285000000, item.due_ns);
  TEST_ASSERT_EQUAL_INT64(280000000, item.t_ns);
  memcpy(message, item.data, item.bytes);
  wm_play_stamp(message, item.bytes, 123456789);
  TEST_ASSERT_NULL(wm_lcm_read_row("imu", message, item.bytes, &row));
  TEST_ASSERT_EQUAL_INT64(123456789, row.t_ns);
  TEST_ASSERT_EQUAL_DOUBLE(7, row.number[2]);
  do TEST_ASSERT_TRUE(next());
  while (!is("sightings:eye"));
  memcpy(message, item.data, item.bytes);
  wm_play_stamp(message, item.bytes, 55);
  TEST_ASSERT_NULL(wm_lcm_read_sightings(message, item.bytes, sensor, &t_ns, seen, &count));
  TEST_ASSERT_EQUAL(2, count);
  TEST_ASSERT_EQUAL_INT64(55, t_ns);
  TEST_ASSERT_EQUAL_STRING("eye", sensor);
  TEST_ASSERT_EQUAL_DOUBLE(0.2, seen[1].bearing_rad);
  TEST_ASSERT_EQUAL_INT64(1100000000, item.due_ns);
  TEST_ASSERT_EQUAL_INT64(1000000000, item.t_ns);
}

// ── the same each time ──────────────────────────────────────────────────────────────────────────────────────────────

static uint64_t mix(uint64_t hash, const void *data, size_t length) {  // FNV-1a
  const uint8_t *at = data;
  for (size_t i = 0; i < length; i++) hash = (hash ^ at[i]) * 1099511628211u;
  return hash;
}

// Of all items due from `from_s` on, begins of faults apart.
static uint64_t hash_of(double open_s, double from_s, int *count) {
  uint64_t hash = 14695981039346656037u;
  *count = 0;
  open_at(open_s, 0, 1);
  while (next()) {
    TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(open_s, at_s());
    if (at_s() < from_s || item.kind == WM_PLAY_FAULT) continue;
    hash = mix(hash, &item.due_ns, sizeof item.due_ns);
    hash = mix(hash, &item.t_ns, sizeof item.t_ns);
    hash = mix(hash, &item.ahead_ns, sizeof item.ahead_ns);
    hash = mix(hash, &item.stream, sizeof item.stream);
    hash = mix(hash, &item.number, sizeof item.number);
    hash = mix(hash, item.frame.data, item.frame.length);
    if (item.bytes) hash = mix(hash, item.data, item.bytes);
    ++*count;
  }
  return hash;
}

TEST(the_same_items_come_again_also_from_later_on) {
  int n[4];
  break_it(
      "- {name: a, fault: camera_frozen, camera: left, from_s: 1.2, until_s: 2.9}\n"
      "- {name: b, fault: camera_dropped, camera: right, share: 0.3, from_s: 0.5, until_s: 3}\n"
      "- {name: c, fault: bus_duplicated, bus: can0, share: 0.5, from_s: 1, until_s: 3.5}\n"
      "- {name: d, fault: bus_load, bus: can1, rate_hz: 333, from_s: 1, until_s: 3}\n"
      "- {name: e, fault: stream_clock_ahead, stream: imu, ahead_s: 7, from_s: 1.5, until_s: 2.5}\n"
      "- {name: f, fault: camera_dark, camera: right, from_s: 1.5, until_s: 2.5}\n");
  const uint64_t once = hash_of(0, 2, &n[0]), again = hash_of(0, 2, &n[1]), later = hash_of(2, 2, &n[2]);
  TEST_ASSERT_EQUAL(n[0], n[1]);
  TEST_ASSERT_EQUAL(n[0], n[2]);
  TEST_ASSERT_GREATER_THAN(333, n[0]);
  TEST_ASSERT_EQUAL_HEX64(once, again);
  TEST_ASSERT_EQUAL_HEX64(once, later);
  TEST_ASSERT_NOT_EQUAL_HEX64(once, hash_of(0, 0, &n[3]));
}

TEST(passes_follow_each_other) {
  int n = 0;
  wm_time_ns before_ns = -1;
  open_at(1, 2, 3);
  for (; next(); before_ns = item.due_ns, n++) TEST_ASSERT_GREATER_OR_EQUAL_INT64(before_ns, item.due_ns);
  open_at(1, 2, 1);
  int once = 0;
  while (next()) once++;
  TEST_ASSERT_EQUAL(3 * once, n);
  TEST_ASSERT_GREATER_THAN_INT64(3900000000, before_ns);
  TEST_ASSERT_LESS_THAN_INT64(4200000000, before_ns);
}

// ── faults ──────────────────────────────────────────────────────────────────────────────────────────────────────────

TEST(a_camera_breaks_in_its_ways) {
  break_it(
      "- {name: a, fault: camera_unplugged, camera: left, from_s: 0.5, until_s: 1}\n"
      "- {name: b, fault: camera_stalled, camera: right, from_s: 1, until_s: 2}\n"
      "- {name: c, fault: camera_dropped, share: 0.4, from_s: 2, until_s: 3}\n"
      "- {name: d, fault: camera_damaged, share: 1, camera: left, from_s: 3, until_s: 3.5}\n"
      "- {name: e, fault: camera_clock_ahead, ahead_s: 29, camera: right, from_s: 3, until_s: 4}\n");
  TEST_ASSERT_EQUAL(0, count_of("camera:left", 0.5, 1));
  TEST_ASSERT_EQUAL(5, count_of("camera:right", 0.5, 1));
  TEST_ASSERT_EQUAL(0, count_of("camera:right", 1, 2));
  const int left = count_of("camera:left", 2, 3);
  TEST_ASSERT_TRUE(left > 2 && left < 10);
  TEST_ASSERT_EQUAL(left, count_of("camera:right", 2, 3));  // by the number alone
  open_at(3, 0, 1);
  int damaged = 0, ahead = 0, edges = 0;
  while (next()) {
    damaged += is("camera:left") && item.is_damaged && item.data[item.bytes - 1] != 0xD9;
    ahead += is("camera:right") && item.ahead_ns == 29 * WM_NS_PER_S;
    edges += item.kind == WM_PLAY_FAULT;
  }
  TEST_ASSERT_EQUAL(5, damaged);
  TEST_ASSERT_EQUAL(10, ahead);
  TEST_ASSERT_EQUAL(4, edges);  // d and e begin and end; the others are over
}

TEST(a_frozen_camera_gives_its_last_picture) {
  uint8_t last[65536];
  uint32_t bytes_of_last = 0;
  int same = 0, others = 0;
  break_it("- {name: a, fault: camera_frozen, camera: left, from_s: 1, until_s: 2}\n");
  open_at(0, 0, 1);
  while (next()) {
    if (!is("camera:left")) continue;
    if (at_s() < 1) {
      memcpy(last, item.data, item.bytes);
      bytes_of_last = item.bytes;
      continue;
    }
    const int is_same = item.bytes == bytes_of_last && memcmp(item.data, last, item.bytes) == 0;
    same += is_same && at_s() < 2;
    others += !is_same && at_s() >= 2;
  }
  TEST_ASSERT_EQUAL(10, same);
  TEST_ASSERT_EQUAL(20, others);
}

TEST(a_dark_camera_keeps_its_share_of_light) {
  uint8_t bright = 0, dark = 0;
  break_it("- {name: a, fault: camera_dark, brightness: 0.1, camera: left, from_s: 2, until_s: 4}\n");
  open_at(0, 0, 1);
  TEST_ASSERT_EQUAL(WM_OK, wm_play_set_format(play, (size_t)wm_play_find(play, "camera:left"), "GREY", &err));
  TEST_ASSERT_EQUAL(WM_UNSUPPORTED, wm_play_set_format(play, 0, "NV12", &err));
  while (next()) {
    if (!is("camera:left") || (item.number != 19 && item.number != 20)) continue;
    TEST_ASSERT_EQUAL(W * H, item.bytes);
    *(item.number == 19 ? &bright : &dark) = item.data[W - 1];
  }
  TEST_ASSERT_INT_WITHIN(4, 255 - 57, bright);
  TEST_ASSERT_INT_WITHIN(1, 20, dark);
}

TEST(pictures_have_the_format_that_is_asked_for) {
  open_at(0, 0, 1);
  const int left = wm_play_find(play, "camera:left");
  TEST_ASSERT_EQUAL(WM_OK, wm_play_set_format(play, (size_t)left, "YUYV", &err));
  do TEST_ASSERT_TRUE(next());
  while (!is("camera:left"));
  TEST_ASSERT_EQUAL(2 * W * H, item.bytes);
  TEST_ASSERT_EQUAL(128, item.data[1]);
  wm_play_set_delay(play, (size_t)left, 7000000);
  do TEST_ASSERT_TRUE(next());
  while (!is("camera:left"));
  TEST_ASSERT_EQUAL_INT64(117000000, item.due_ns);
}

TEST(a_bus_breaks_in_its_ways) {
  break_it(
      "- {name: a, fault: bus_down, bus: can0, from_s: 0.5, until_s: 1}\n"
      "- {name: b, fault: bus_silent, bus: can0, ids: [1A1], from_s: 1, until_s: 1.5}\n"
      "- {name: c, fault: bus_silent, bus: can0, ids: [1A0], from_s: 1.5, until_s: 2}\n"
      "- {name: d, fault: bus_duplicated, bus: can0, from_s: 2, until_s: 2.5}\n"
      "- {name: e, fault: bus_dropped, bus: can1, share: 0.5, from_s: 0, until_s: 4}\n"
      "- {name: f, fault: bus_off, bus: can1, from_s: 3, until_s: 3.5}\n"
      "- {name: g, fault: bus_load, bus: can0, rate_hz: 1000, from_s: 3, until_s: 4}\n");
  TEST_ASSERT_EQUAL(0, count_of("can:can0", 0.5, 1));
  TEST_ASSERT_EQUAL(10, count_of("can:can0", 1, 1.5));
  TEST_ASSERT_EQUAL(0, count_of("can:can0", 1.5, 2));
  TEST_ASSERT_EQUAL(20, count_of("can:can0", 2, 2.5));
  const int left = count_of("can:can1", 0, 3);
  TEST_ASSERT_TRUE(left > 8 && left < 22);
  TEST_ASSERT_EQUAL(0, count_of("can:can1", 3, 3.5));
  TEST_ASSERT_EQUAL(1000 + 20, count_of("can:can0", 3, 4));
}

TEST(a_stream_breaks_in_its_ways) {
  int ahead = 0;
  break_it(
      "- {name: a, fault: stream_silent, stream: imu, from_s: 0, until_s: 1}\n"
      "- {name: b, fault: stream_dropped, stream: imu, share: 0.5, from_s: 1, until_s: 2}\n"
      "- {name: c, fault: stream_clock_ahead, stream: imu, ahead_s: -7, from_s: 2, until_s: 3}\n");
  TEST_ASSERT_EQUAL(0, count_of("imu", 0, 1));
  const int left = count_of("imu", 1, 2);
  TEST_ASSERT_TRUE(left > 4 && left < 21);
  open_at(2, 3.5, 1);
  while (next()) ahead += is("imu") && item.t_ns == item.due_ns - 5000000 - 7 * WM_NS_PER_S;
  TEST_ASSERT_EQUAL(25, ahead);
}

TEST(bytes_of_words_are_reversed) {
  break_it("- {name: a, fault: bus_wrong_byte_order, bus: can0, word_bytes: 4, from_s: 0, until_s: 2}\n");
  open_at(0, 0, 1);
  const uint8_t swapped[] = {0x22, 0x11, 0x00, 0x00, 0x66, 0x55, 0x44, 0x33};
  do TEST_ASSERT_TRUE(next());
  while (!is("can:can0"));
  TEST_ASSERT_EQUAL_HEX8_ARRAY(swapped, item.frame.data, 8);
}

TEST(a_fault_of_what_is_not_there_is_refused) {
  break_it("- {name: no, fault: camera_frozen, camera: lft, from_s: 1}\n");
  const wm_play_options options = {.faults = &faults};
  char message[512];
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_play_open(dir, &options, &play, &err));
  (void)snprintf(message, sizeof message, "f.yaml:3: no: %s has no camera 'lft'; it has left, right", dir);
  TEST_ASSERT_EQUAL_STRING(message, err.text);
}

TEST(a_folder_that_is_no_recording_is_refused) {
  const wm_play_options options = {0};
  char message[512];
  (void)snprintf(message, sizeof message, "%s: has no CAN frame, picture or row that can be played", dir);
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, wm_play_open("/nowhere", &options, &play, &err));
  TEST_ASSERT_EQUAL_STRING("/nowhere: there is no recording.yaml in it: is it a recording's folder?", err.text);
  folder_write("can.log", "rubbish\n");
  folder_write("imu.csv", "t_ns,wx_radps,wy_radps,wz_radps\n");
  folder_write("sightings.csv", "t_ns,sensor,id,bearing_rad,range_m\n");
  static const char *const kFiles[] = {"left.csv", "left.avi", "right.csv", "right.avi"};
  for (size_t i = 0; i < 4; i++) {
    char name_of_it[64];
    (void)snprintf(name_of_it, sizeof name_of_it, "video/%s", kFiles[i]);
    (void)unlink(folder_path(name_of_it));
  }
  TEST_ASSERT_EQUAL(WM_BAD_DATA, wm_play_open(dir, &options, &play, &err));
  TEST_ASSERT_EQUAL_STRING(message, err.text);
}
