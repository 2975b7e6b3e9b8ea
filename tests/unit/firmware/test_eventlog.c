// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>

#include <wm_version.h>
#include "common/folder.h"
#include "common/suite.h"
#include "log_fixture.h"
#include "output/run_folder.h"

static wm_error err;

static wm_status open_bytes(uint8_t *bytes, size_t length, wm_log_reader **out) {
  FILE *file = fmemopen(bytes, length ? length : 1, "rb");
  TEST_ASSERT_NOT_NULL(file);
  return wm_log_open_file(file, "log", out, &err);
}

TEST(what_was_written_is_read) {
  size_t length;
  uint8_t *bytes = fixture_log(100, 0, &length);
  wm_log_reader *log;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, open_bytes(bytes, length, &log), err.text);
  const wm_log_head *head = wm_log_reader_head(log);
  TEST_ASSERT_EQUAL_STRING(WM_VERSION, head->program);
  TEST_ASSERT_EQUAL_STRING("tiny", head->estimator);
  TEST_ASSERT_EQUAL_STRING("fixture", head->recording);
  TEST_ASSERT_EQUAL_STRING("libjpeg-turbo of the fixture", head->decoder);
  TEST_ASSERT_EQUAL_STRING(fixture_config_text, head->config_text);
  TEST_ASSERT_EQUAL_STRING("sensors: {}\n", head->calibration_text);
  TEST_ASSERT_EQUAL_UINT64(77, head->seed);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, head->wheels.track_m);
  TEST_ASSERT_EQUAL_DOUBLE(0.25, head->start.heading_rad);
  TEST_ASSERT_EQUAL(2, head->sensor_count);
  TEST_ASSERT_EQUAL_STRING("right", head->sensors[1].name);
  TEST_ASSERT_EQUAL(3, head->landmark_count);
  TEST_ASSERT_EQUAL_UINT64(wm_landmarks_hash(fixture_landmarks, 3), head->landmark_hash);
  TEST_ASSERT_EQUAL(2, head->source_count);
  TEST_ASSERT_EQUAL_STRING("sightings:left", head->sources[1].name);

  static wm_event e;
  uint64_t missing = 0;
  int cut = 0;
  for (uint32_t i = 0; i < 100; i++) {
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_log_next(log, &e, &missing, &cut, &err), err.text);
    wm_event wanted = fixture_event(i);
    TEST_ASSERT_EQUAL_MEMORY(&wanted, &e, WM_EVENT_SMALL_BYTES);
  }
  TEST_ASSERT_EQUAL(WM_END, wm_log_next(log, &e, &missing, &cut, &err));
  TEST_ASSERT_EQUAL(0, cut);
  TEST_ASSERT_EQUAL_UINT64(0, missing);
  wm_log_reader_close(log);
  free(bytes);
}

TEST(a_gap_is_told) {
  size_t length;
  uint8_t *bytes = fixture_log(10, 4, &length);
  wm_log_reader *log;
  TEST_ASSERT_EQUAL(WM_OK, open_bytes(bytes, length, &log));
  static wm_event e;
  uint64_t missing = 0;
  int cut = 0, events = 0;
  while (wm_log_next(log, &e, &missing, &cut, &err) == WM_OK) events++;
  TEST_ASSERT_EQUAL(10, events);
  TEST_ASSERT_EQUAL_UINT64(13, missing);
  wm_log_reader_close(log);
  free(bytes);
}

// Returns the events that could be read; *status is how it ended.
static int count_events(uint8_t *bytes, size_t length, wm_status *status, int *cut) {
  wm_log_reader *log;
  *cut = 0;
  *status = open_bytes(bytes, length, &log);
  if (*status != WM_OK) return -1;
  static wm_event e;
  uint64_t missing = 0;
  int events = 0;
  while ((*status = wm_log_next(log, &e, &missing, cut, &err)) == WM_OK) events++;
  wm_log_reader_close(log);
  return events;
}

TEST(a_log_that_was_cut_anywhere_gives_what_stands_before) {
  size_t length;
  uint8_t *bytes = fixture_log(20, 0, &length);
  int last = -1, cut;
  wm_status status;
  for (size_t at = 0; at < length; at++) {
    int events = count_events(bytes, at, &status, &cut);
    if (events < 0) {
      TEST_ASSERT_EQUAL(WM_BAD_DATA, status);
      TEST_ASSERT_EQUAL(-1, last);  // only while within the head
      continue;
    }
    TEST_ASSERT_EQUAL(WM_END, status);
    TEST_ASSERT_EQUAL(1, cut);
    TEST_ASSERT_GREATER_OR_EQUAL(last, events);
    last = events;
  }
  TEST_ASSERT_EQUAL(20, last);
  TEST_ASSERT_EQUAL(20, count_events(bytes, length, &status, &cut));
  TEST_ASSERT_EQUAL(0, cut);
  free(bytes);
}

TEST(zeros_that_a_power_cut_left_are_a_cut) {
  size_t length;
  uint8_t *bytes = fixture_log(20, 0, &length), *longer = calloc(1, length + 4096);
  wm_status status;
  int cut;
  memcpy(longer, bytes, length - 17);  // without the closing record
  TEST_ASSERT_EQUAL(20, count_events(longer, length + 4096, &status, &cut));
  TEST_ASSERT_EQUAL(WM_END, status);
  TEST_ASSERT_EQUAL(1, cut);
  free(longer);
  free(bytes);
}

TEST(a_flipped_bit_is_found_wherever_it_is) {
  size_t length;
  uint8_t *bytes = fixture_log(6, 0, &length);
  wm_status status;
  int cut;
  for (size_t at = 0; at < length; at++) {
    bytes[at] ^= (uint8_t)(1u << (at % 8));
    int events = count_events(bytes, length, &status, &cut);
    bytes[at] ^= (uint8_t)(1u << (at % 8));
    TEST_ASSERT_TRUE_MESSAGE(status == WM_BAD_DATA || cut, "a damage went unnoticed");
    TEST_ASSERT_LESS_OR_EQUAL(6, events);
    if (status == WM_BAD_DATA) TEST_ASSERT_NOT_NULL(strstr(err.text, "log: "));
  }
  free(bytes);
}

TEST(what_is_no_log_is_said_to_be_none) {
  wm_log_reader *log;
  uint8_t text[] = "t_ns,v_mps,w_radps\n0,1,2\n";
  TEST_ASSERT_EQUAL(WM_BAD_DATA, open_bytes(text, sizeof text - 1, &log));
  TEST_ASSERT_EQUAL_STRING("log: not an event log (it should begin with \"WMLOG 2\")", err.text);
  TEST_ASSERT_NULL(log);
  TEST_ASSERT_EQUAL(WM_IO, wm_log_open("/nowhere/events.wmlog", &log, &err));
}

TEST(a_full_disk_is_told_at_the_end) {
  static wm_log_writer writer;
  wm_config config;
  static wm_assembly assembly;
  fixture_assembly(&config, &assembly);
  if (access("/dev/full", W_OK) != 0) TEST_IGNORE_MESSAGE("no /dev/full");
  TEST_ASSERT_EQUAL(WM_OK, wm_log_create(&writer, "/dev/full", &assembly, &err));
  wm_event e = fixture_event(0);
  for (int i = 0; i < 5000; i++) wm_log_write_event(&writer, &e);
  TEST_ASSERT_EQUAL(WM_IO, wm_log_close(&writer, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "No space left"));
}

// A fuzzer whose seeds are refused at the door finds nothing: after a change of the format they must be made anew
// (`waymark replay --until 0.4` of a simulated crossing, loops with markers, points under water).
TEST(the_fuzzers_seeds_are_read_to_their_ends) {
  const char *const names[] = {"crossing", "slam", "seabed"};
  for (int i = 0; i < 3; i++) {
    char path[1024];
    snprintf(path, sizeof path, "%s/tests/fuzz/corpus/fuzz_wmlog/%s", getenv("WM_SOURCE_DIR"), names[i]);
    wm_log_reader *log;
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_log_open(path, &log, &err), err.text);
    static wm_event e;
    uint64_t missing = 0;
    int cut = 0, events = 0;
    while (wm_log_next(log, &e, &missing, &cut, &err) == WM_OK) events++;
    TEST_ASSERT_EQUAL(0, cut);
    TEST_ASSERT_GREATER_THAN(10, events);
    wm_log_reader_close(log);
  }
}

// ── a run folder below its limit ────────────────────────────────────────────────────────────────────────────────────

static long size_of(const char *name) {
  struct stat file;
  return stat(folder_path(name), &file) == 0 ? (long)file.st_size : -1;
}

static void first_line(const char *name, char out[200]) {
  FILE *f = fopen(folder_path(name), "r");
  TEST_ASSERT_NOT_NULL(f);
  TEST_ASSERT_NOT_NULL(fgets(out, 200, f));
  fclose(f);
}

// GIVEN a limit of 400 kB WHEN a run writes for long THEN tables and log rotate, and the log goes on from the newest
// pose.
TEST(tables_and_log_rotate_by_their_size) {
  char head[200], again[200];
  static wm_config config;
  static wm_assembly assembly;
  fixture_assembly(&config, &assembly);
  wm_run_folder *folder;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_run_folder_open(folder_make(), &assembly, &folder, &err), err.text);
  wm_run_folder_limit(folder, 400000);
  wm_output out = wm_run_folder_output(folder);
  for (int second = 0; second < 100; second++) {
    for (int i = 0; i < 50; i++) {
      wm_published p = {.now = {.t_ns = second * WM_NS_PER_S + i, .state = WM_STATE_TRACKING, .dof = 3}};
      p.now.pose_map_base.p_m[0] = second;
      p.now.pose_map_base.q_xyzw[3] = 1;
      out.put(out.context, WM_OUTPUT_POSE, &p.now, sizeof p.now);
      out.put(out.context, WM_OUTPUT_PUBLISHED, &p, sizeof p);
      wm_event e = fixture_event((uint32_t)(second * 50 + i));
      out.put(out.context, WM_OUTPUT_EVENT, &e, wm_event_bytes(&e));
    }
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_run_folder_flush(folder, &err), err.text);
  }
  TEST_ASSERT_EQUAL(WM_OK, wm_run_folder_close(folder, &err));
  static const char *const kNames[] = {"trajectory.csv",    "trajectory.tum",   "published.csv",    "innovations.csv",
                                       "events.wmlog",      "trajectory.1.csv", "trajectory.1.tum", "published.1.csv",
                                       "innovations.1.csv", "events.1.wmlog"};
  long bytes = 0;
  for (size_t i = 0; i < sizeof kNames / sizeof kNames[0]; i++) {
    TEST_ASSERT_GREATER_THAN_MESSAGE(0, size_of(kNames[i]), kNames[i]);
    bytes += size_of(kNames[i]);
  }
  TEST_ASSERT_LESS_THAN(440000, bytes);  // a second more on each side
  first_line("published.csv", head);
  first_line("published.1.csv", again);
  TEST_ASSERT_EQUAL_STRING(head, again);
  for (int part = 0; part < 2; part++) {
    wm_log_reader *log;
    const char *path = folder_path(part ? "events.1.wmlog" : "events.wmlog");
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_log_open(path, &log, &err), err.text);
    TEST_ASSERT_GREATER_THAN_DOUBLE(1, wm_log_reader_head(log)->start.p_m[0]);
    wm_log_reader_close(log);
  }
  folder_remove();
}
