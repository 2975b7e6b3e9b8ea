// SPDX-License-Identifier: Apache-2.0
#include "log_fixture.h"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static wm_error err;

static wm_status open_bytes(uint8_t *bytes, size_t length, wm_log_reader **out) {
  FILE *file = fmemopen(bytes, length ? length : 1, "rb");
  TEST_ASSERT_NOT_NULL(file);
  return wm_log_open_file(file, "log", out, &err);
}

static void what_was_written_is_read(void) {
  size_t length;
  uint8_t *bytes = fixture_log(100, 0, &length);
  wm_log_reader *log;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, open_bytes(bytes, length, &log), err.text);
  const wm_log_head *head = wm_log_reader_head(log);
  TEST_ASSERT_EQUAL_STRING(WM_VERSION, head->program);
  TEST_ASSERT_EQUAL_STRING("tiny", head->estimator);
  TEST_ASSERT_EQUAL_STRING("fixture", head->recording);
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

static void a_gap_is_told(void) {
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

static void a_log_that_was_cut_anywhere_gives_what_stands_before(void) {
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

static void zeros_that_a_power_cut_left_are_a_cut(void) {
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

static void a_flipped_bit_is_found_wherever_it_is(void) {
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

static void what_is_no_log_is_said_to_be_none(void) {
  wm_log_reader *log;
  uint8_t text[] = "t_ns,v_mps,w_radps\n0,1,2\n";
  TEST_ASSERT_EQUAL(WM_BAD_DATA, open_bytes(text, sizeof text - 1, &log));
  TEST_ASSERT_EQUAL_STRING("log: not an event log (it should begin with \"WMLOG 2\")", err.text);
  TEST_ASSERT_NULL(log);
  TEST_ASSERT_EQUAL(WM_IO, wm_log_open("/nowhere/events.wmlog", &log, &err));
}

static void a_full_disk_is_told_at_the_end(void) {
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
static void the_fuzzers_seeds_are_read_to_their_ends(void) {
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

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(what_was_written_is_read);
  RUN_TEST(a_gap_is_told);
  RUN_TEST(a_log_that_was_cut_anywhere_gives_what_stands_before);
  RUN_TEST(zeros_that_a_power_cut_left_are_a_cut);
  RUN_TEST(a_flipped_bit_is_found_wherever_it_is);
  RUN_TEST(what_is_no_log_is_said_to_be_none);
  RUN_TEST(a_full_disk_is_told_at_the_end);
  RUN_TEST(the_fuzzers_seeds_are_read_to_their_ends);
  return UNITY_END();
}
