// SPDX-License-Identifier: Apache-2.0
// Messages for viewers: what is written is read again, and what no run could have written is refused.
#include "common/suite.h"
#include "waymark/lcm_messages.h"
#include "waymark/lcm_views.h"
#include "waymark_map_t.h"

static uint8_t bytes[WM_LCM_MESSAGE_MAX];

TEST(places_arrive_whole) {
  wm_place sent[WM_LCM_PLACES_MAX + 1], heard[WM_LCM_PLACES_MAX];
  for (size_t i = 0; i <= WM_LCM_PLACES_MAX; i++) {
    sent[i] = (wm_place){4e6 + (double)i, -0.25, 0.5, 0.125, {(double)NAN, 0, 0, 0, 0, 0.25}};
  }
  wm_lcm_part part;
  size_t length = wm_lcm_places(sent, WM_LCM_PLACES_MAX + 1, 1000, 7, bytes, sizeof bytes);
  TEST_ASSERT_GREATER_THAN(0, length);
  TEST_ASSERT_NULL(wm_lcm_read_places(bytes, length, &part, heard));
  TEST_ASSERT_EQUAL(WM_LCM_PLACES_MAX, part.count);
  TEST_ASSERT_EQUAL(1000, part.total);
  TEST_ASSERT_EQUAL_INT64(7, part.t_ns);
  TEST_ASSERT_EQUAL_DOUBLE(4e6 + 239, heard[239].x_m);
  TEST_ASSERT_EQUAL_DOUBLE(-0.25, heard[0].y_m);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, heard[0].heading_rad);
  TEST_ASSERT_EQUAL_DOUBLE(0.125, heard[0].weight);
  TEST_ASSERT_DOUBLE_IS_NAN(heard[0].covariance[0]);
  TEST_ASSERT_EQUAL_DOUBLE(0.25, heard[0].covariance[5]);
  TEST_ASSERT_EQUAL(0, wm_lcm_places(sent, 2, 2, 7, bytes, 100));
  for (size_t all = 0; all < 3; all++) {  // a list that is whole in one message
    length = wm_lcm_places(sent, all, all, 7, bytes, sizeof bytes);
    TEST_ASSERT_NULL(wm_lcm_read_places(bytes, length, &part, heard));
    TEST_ASSERT_EQUAL(all, part.total);
    TEST_ASSERT_EQUAL(all, part.count);
  }
}

// A short list behind a long one has the same bytes as before it.
TEST(lists_forget_the_one_before) {
  static uint8_t again[WM_LCM_MESSAGE_MAX];
  static wm_place many[WM_LCM_PLACES_MAX];
  for (size_t i = 0; i < WM_LCM_PLACES_MAX; i++) many[i] = (wm_place){1, 2, 3, 4, {5, 6, 7, 8, 9, 10}};
  const size_t length = wm_lcm_places(many, 1, 1, 7, bytes, sizeof bytes);
  TEST_ASSERT_GREATER_THAN(0, wm_lcm_places(many, WM_LCM_PLACES_MAX, WM_LCM_PLACES_MAX, 7, again, sizeof again));
  TEST_ASSERT_EQUAL(length, wm_lcm_places(many, 1, 1, 7, again, sizeof again));
  TEST_ASSERT_EQUAL_MEMORY(bytes, again, length);
}

TEST(a_map_arrives_in_parts) {
  static wm_landmark sent[300], heard[WM_LCM_LANDMARKS_MAX];
  static double covariance[300][4];
  for (int i = 0; i < 300; i++) {
    sent[i].id = i;
    sent[i].p_m[0] = i * 0.5;
    covariance[i][1] = -i;
    covariance[i][3] = i % 2 ? 0.0625 : (double)NAN;
  }
  size_t seen = 0;
  for (size_t first = 0; first < 300; first += WM_LCM_LANDMARKS_MAX) {
    wm_lcm_part part;
    size_t length = wm_lcm_map(sent, (const double(*)[4])covariance, 300, first, 9, bytes, sizeof bytes);
    TEST_ASSERT_NULL(wm_lcm_read_map(bytes, length, &part, heard));
    TEST_ASSERT_EQUAL(first, part.first);
    TEST_ASSERT_EQUAL(300, part.total);
    for (size_t i = 0; i < part.count; i++) {
      TEST_ASSERT_EQUAL(first + i, heard[i].id);
      TEST_ASSERT_EQUAL_DOUBLE(-(double)(first + i), heard[i].cov_m2[1]);
      if ((first + i) % 2)
        TEST_ASSERT_EQUAL_DOUBLE(0.25, heard[i].yaw_sigma_rad);
      else
        TEST_ASSERT_DOUBLE_IS_NAN(heard[i].yaw_sigma_rad);
      seen++;
    }
  }
  TEST_ASSERT_EQUAL(300, seen);
}

TEST(landmarks_are_read_as_they_were_sent) {
  const wm_landmark sent[2] = {{.id = 4, .p_m = {1, 2, 3}, .sigma_m = 0.5}, {.id = -1}};
  wm_landmark heard[WM_LCM_LANDMARKS_MAX];
  wm_lcm_part part;
  size_t length = wm_lcm_landmarks(sent, 2, 0, 5, bytes, sizeof bytes);
  TEST_ASSERT_NULL(wm_lcm_read_landmarks(bytes, length, &part, heard));
  TEST_ASSERT_EQUAL(2, part.count);
  TEST_ASSERT_EQUAL(4, heard[0].id);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, heard[0].sigma_m);
  TEST_ASSERT_DOUBLE_IS_NAN(heard[0].cov_m2[0]);
}

// A map of which nothing is known yet is an empty list, not a wrong one.
TEST(an_empty_map_is_a_map) {
  wm_landmark heard[WM_LCM_LANDMARKS_MAX];
  wm_lcm_part part = {1, 2, 3, 4};
  static waymark_map_t m;
  m.t_ns = 9;
  const int length = waymark_map_t_encode(bytes, 0, sizeof bytes, &m);
  TEST_ASSERT_NULL(wm_lcm_read_map(bytes, (size_t)length, &part, heard));
  TEST_ASSERT_EQUAL_INT64(9, part.t_ns);
  TEST_ASSERT_EQUAL_size_t(0, part.total);
  TEST_ASSERT_EQUAL_size_t(0, part.first);
  TEST_ASSERT_EQUAL_size_t(0, part.count);
}

TEST(counts_beyond_the_room_are_refused) {
  wm_landmark heard[WM_LCM_LANDMARKS_MAX];
  wm_place places[WM_LCM_PLACES_MAX];
  wm_lcm_part part;
  const int32_t wrong[][3] = {{300, 0, 257}, {10, 9, 2}, {10, -1, 2}, {-1, 0, 0}, {10, 0, -3}, {5, INT32_MAX, 6}};
  for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
    static waymark_map_t m;
    m.total = wrong[i][0];
    m.first = wrong[i][1];
    m.count = wrong[i][2];
    int length = waymark_map_t_encode(bytes, 0, sizeof bytes, &m);
    TEST_ASSERT_NOT_NULL(wm_lcm_read_map(bytes, (size_t)length, &part, heard));
  }
  TEST_ASSERT_NOT_NULL(wm_lcm_read_map("", 0, &part, heard));
  TEST_ASSERT_NOT_NULL(wm_lcm_read_places("nothing of ours", 15, &part, places));
}
