// SPDX-License-Identifier: Apache-2.0
// Changes of a recording's files for the trials of check, and the table of identities by place.
#include <stdlib.h>
#include <string.h>

#include "cli/check/edits.h"
#include "cli/check/identities.h"
#include "unity.h"
#include "waymark/map.h"

void setUp(void) {}
void tearDown(void) {}

static wm_error err;

static void edited(const file_edit *edit, const char *text, const char *expected) {
  char *out;
  size_t length;
  TEST_ASSERT_EQUAL(WM_OK, edit_text(edit, text, strlen(text), "", &out, &length, &err));
  TEST_ASSERT_EQUAL(strlen(expected), length);
  TEST_ASSERT_EQUAL_STRING_LEN(expected, out, length);
  free(out);
}

static const char kTable[] = "t_ns,sensor,id,range_m\n5,a,1,2.5\n3,b,2,\n";

static void columns(void) {
  edited(&(file_edit){.kind = EDIT_COLUMN, .name = "range_m", .factor = 2}, kTable,
         "t_ns,sensor,id,range_m\n5,a,1,5\n3,b,2,\n");
  edited(&(file_edit){.kind = EDIT_COLUMN, .name = "t_ns", .factor = 1, .offset = -7e9, .only = "b"}, kTable,
         "t_ns,sensor,id,range_m\n5,a,1,2.5\n-6999999997,b,2,\n");
  edited(&(file_edit){.kind = EDIT_SWAP, .name = "sensor", .text = "id"}, kTable,
         "t_ns,sensor,id,range_m\n5,1,a,2.5\n3,2,b,\n");
  edited(&(file_edit){.kind = EDIT_SORT, .name = "t_ns"}, kTable, "t_ns,sensor,id,range_m\n3,b,2,\n5,a,1,2.5\n");
  const id_table ids = {.from = {1, 2}, .to = {2, 1}, .count = 2};
  edited(&(file_edit){.kind = EDIT_IDS, .name = "id", .ids = &ids}, kTable,
         "t_ns,sensor,id,range_m\n5,a,2,2.5\n3,b,1,\n");
}

static void columns_that_are_missing(void) {
  const file_edit edit = {.kind = EDIT_COLUMN, .name = "arrival_ns", .factor = 1};
  char *out;
  size_t length;
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, edit_text(&edit, kTable, sizeof kTable - 1, "", &out, &length, &err));
  TEST_ASSERT_NULL(out);
}

static const char kDbc[] =
    "BO_ 1 A: 8 X\n SG_ S : 0|16@1- (1,0) [0|0] \"\" Y\nBO_ 2 B: 8 X\n SG_ S : 7|16@0+ (0.5,1) [0|0] \"\" Y\n";

static void signals(void) {
  edited(&(file_edit){.kind = EDIT_SIGNAL, .name = "S", .only = "B", .factor = 1, .layout = LAYOUT_ORDER}, kDbc,
         "BO_ 1 A: 8 X\n SG_ S : 0|16@1- (1,0) [0|0] \"\" Y\nBO_ 2 B: 8 X\n SG_ S : 0|16@1+ (0.5,1) [0|0] \"\" Y\n");
  edited(&(file_edit){.kind = EDIT_SIGNAL, .name = "S", .only = "A", .factor = 10, .layout = LAYOUT_SIGN, .offset = 8},
         kDbc,
         "BO_ 1 A: 8 X\n SG_ S : 8|16@1+ (10,0) [0|0] \"\" Y\nBO_ 2 B: 8 X\n SG_ S : 7|16@0+ (0.5,1) [0|0] \"\" Y\n");
}

static void is_mirrored(double factor, const uint8_t expected[6]) {
  uint8_t pixels[6] = {1, 2, 3, 4, 5, 6};
  const wm_grey before = {.width_px = 3, .height_px = 2, .pixels = pixels};
  const file_edit edit = {.kind = EDIT_MIRROR, .file = "map/edges.png", .factor = factor};
  void *png;
  char *out;
  size_t length;
  wm_grey after;
  TEST_ASSERT_EQUAL(WM_OK, wm_grey_encode(&before, edit.file, &png, &length, &err));
  TEST_ASSERT_EQUAL(WM_OK, edit_text(&edit, png, length, "", &out, &length, &err));
  TEST_ASSERT_EQUAL(WM_OK, wm_grey_decode(out, length, edit.file, &after, &err));
  TEST_ASSERT_EQUAL(3, after.width_px);
  TEST_ASSERT_EQUAL_UINT8_ARRAY(expected, after.pixels, 6);
  free(after.pixels);
  free(out);
  free(png);
}

static void pictures(void) {
  is_mirrored(1, (const uint8_t[]){3, 2, 1, 6, 5, 4});
  is_mirrored(-1, (const uint8_t[]){4, 5, 6, 1, 2, 3});
}

// Three identities, each seen eight times; the third has no landmark that most of its sightings fit.
static void identities_by_place(void) {
  static given_ids given;
  static id_votes votes;
  static const int32_t kSeen[3][4] = {{7, 7, 7, 7}, {2, 2, 2, 9}, {1, 3, 4, 5}};
  votes.given = &given;
  for (uint32_t k = 0; k < 24; k++) {
    wm_event event = {.t_ns = (wm_time_ns)k, .kind = WM_EVENT_SIGHTING, .seq = k};
    event.as.sighting = (wm_sighting){.landmark_id = (int32_t)(k % 3), .bearing_rad = 0.1 * k, .range_m = 1};
    given_ids_take(&given, &event);
    event.as.sighting.landmark_id = -1;
    id_votes_arrived(&votes, &event);
    const wm_innovation in = {.t_ns = (wm_time_ns)k,
                              .landmark_id = kSeen[k % 3][k / 3 % 4],
                              .residual = WM_RESIDUAL_BEARING,
                              .verdict = WM_FUSED,
                              .observed = 0.1 * k};
    id_votes_take(&votes, &in);
  }
  id_table table;
  id_votes_table(&votes, &table);
  TEST_ASSERT_EQUAL(2, table.count);
  TEST_ASSERT_EQUAL(0, table.from[0]);
  TEST_ASSERT_EQUAL(7, table.to[0]);
  TEST_ASSERT_EQUAL(1, table.from[1]);
  TEST_ASSERT_EQUAL(2, table.to[1]);
  given_ids_free(&given);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(columns);
  RUN_TEST(columns_that_are_missing);
  RUN_TEST(signals);
  RUN_TEST(pictures);
  RUN_TEST(identities_by_place);
  return UNITY_END();
}
