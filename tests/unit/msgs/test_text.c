// SPDX-License-Identifier: Apache-2.0
// Texts of statuses, errors and enumerations.
#include "common/suite.h"
#include "waymark/event.h"
#include "waymark/health.h"
#include "waymark/look.h"
#include "waymark/pose.h"
#include "waymark/status.h"

TEST(each_status_has_its_text) {
  for (unsigned a = 0; a < WM_STATUS_COUNT; a++) {
    const char *text = wm_status_text((wm_status)a);
    TEST_ASSERT_GREATER_THAN(1, strlen(text));
    for (unsigned b = 0; b < a; b++) TEST_ASSERT_NOT_EQUAL(0, strcmp(text, wm_status_text((wm_status)b)));
  }
  TEST_ASSERT_EQUAL_STRING("ok", wm_status_text(WM_OK));
  TEST_ASSERT_EQUAL_STRING("internal error", wm_status_text(WM_INTERNAL));
  TEST_ASSERT_EQUAL_STRING("?", wm_status_text((wm_status)WM_STATUS_COUNT));
}

TEST(errors_are_cut_to_their_room) {
  wm_error err = {0};
  char word[2 * WM_ERROR_TEXT_MAX];
  memset(word, 'a', sizeof word - 1);
  word[sizeof word - 1] = '\0';
  TEST_ASSERT_EQUAL(WM_IO, wm_fail(&err, WM_IO, "%s:%d", "file", 7));
  TEST_ASSERT_EQUAL(WM_IO, err.status);
  TEST_ASSERT_EQUAL_STRING("file:7", err.text);
  TEST_ASSERT_EQUAL(WM_IO, wm_fail_in(&err, "reading %d", 3));
  TEST_ASSERT_EQUAL_STRING("reading 3: file:7", err.text);
  TEST_ASSERT_EQUAL(WM_IO, wm_fail_in(&err, "%s", word));
  TEST_ASSERT_EQUAL(sizeof err.text - 1, strlen(err.text));
  TEST_ASSERT_EQUAL(WM_FULL, wm_fail(&err, WM_FULL, "%s", word));
  TEST_ASSERT_EQUAL(sizeof err.text - 1, strlen(err.text));
  TEST_ASSERT_EQUAL(WM_FULL, wm_fail(NULL, WM_FULL, "nobody asks"));
  TEST_ASSERT_EQUAL(WM_INTERNAL, wm_fail_in(NULL, "nobody asks"));
}

static void check_names(const char *(*name)(unsigned), unsigned count, const char *first, const char *last) {
  TEST_ASSERT_EQUAL_STRING(first, name(0));
  TEST_ASSERT_EQUAL_STRING(last, name(count - 1));
  TEST_ASSERT_EQUAL_STRING("?", name(count));
  TEST_ASSERT_EQUAL_STRING("?", name(~0u));
  for (unsigned i = 1; i < count; i++) TEST_ASSERT_NOT_EQUAL(0, strcmp(name(i - 1), name(i)));
}

TEST(names_have_bounds) {
  check_names(wm_quantity_name, WM_Q_COUNT, "wheel_ticks_left", "acceleration_z");
  check_names(wm_state_name, WM_STATE_COUNT, "searching", "degraded");
  check_names(wm_cause_name, WM_CAUSE_COUNT, "", "floor");
  check_names(wm_residual_name, WM_RESIDUAL_COUNT, "bearing", "elevation");
  check_names(wm_verdict_name, WM_VERDICT_COUNT, "fused", "numeric");
  check_names(wm_counter_name, WM_COUNTER_KIND_COUNT, "landmarks", "explained_permille");
  check_names(wm_device_state_name, WM_DEVICE_STATE_COUNT, "", "frozen");
  check_names(wm_look_name, WM_LOOK_COUNT, "found", "ambiguous");
}

TEST(quantities_are_found_by_name) {
  for (int i = 0; i < WM_Q_COUNT; i++) TEST_ASSERT_EQUAL(i, wm_quantity_find(wm_quantity_name((unsigned)i)));
  TEST_ASSERT_EQUAL(-1, wm_quantity_find("yaw"));
}

TEST(looks_are_counted_in_words) {
  char out[200];
  uint64_t looks[WM_LOOK_COUNT] = {0};
  TEST_ASSERT_EQUAL(0, wm_looks_text(looks, out, sizeof out));
  TEST_ASSERT_EQUAL_STRING("", out);
  for (unsigned i = 0; i < WM_LOOK_COUNT; i++) looks[i] = i + 1;
  uint64_t expected = 0;
  for (unsigned i = 0; i < WM_LOOK_COUNT; i++) expected += wm_look_is_expected(i) ? i + 1 : 0;
  char head[40];
  (void)snprintf(head, sizeof head, "expected %u: 1 found, ", (unsigned)expected);
  const size_t length = wm_looks_text(looks, out, sizeof out);
  TEST_ASSERT_EQUAL(strlen(out), length);
  TEST_ASSERT_EQUAL_STRING_LEN(head, out, strlen(head));
  TEST_ASSERT_NOT_NULL(strstr(out, "; else 2 not in view, "));
  TEST_ASSERT_NOT_NULL(strstr(out, "7 blurred"));
  TEST_ASSERT_NULL(strchr(out, '_'));
  for (size_t room = 0; room < length; room++) {
    char less[200];
    memset(less, 0x7e, sizeof less);
    const size_t used = wm_looks_text(looks, less, room);
    TEST_ASSERT_EQUAL_HEX8(0x7e, less[room]);
    if (room == 0) continue;
    TEST_ASSERT_EQUAL(room - 1, used);
    TEST_ASSERT_EQUAL_STRING_LEN(out, less, used);
    TEST_ASSERT_EQUAL('\0', less[used]);
  }
}
