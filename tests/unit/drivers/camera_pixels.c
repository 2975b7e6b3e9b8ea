// SPDX-License-Identifier: Apache-2.0
// Formats of cameras as grey, stamps, and numbers of pictures.
#include "common/suite.h"
#include "frame_clock.h"
#include "pixels.h"

#define W 4
#define H 3
static const uint8_t kGrey[W * H] = {0, 1, 2, 3, 50, 60, 70, 80, 252, 253, 254, 255};

// Rows of `stride` bytes, the pixel's luma where the format has it and rubbish elsewhere.
static void expect_grey(const char *format, uint32_t stride, uint32_t bytes_per_pixel, uint32_t luma_at) {
  uint8_t from[H * 32], grey[W * H];
  memset(from, 0xA5, sizeof from);
  for (uint32_t y = 0; y < H; y++)
    for (uint32_t x = 0; x < W; x++) from[y * stride + x * bytes_per_pixel + luma_at] = kGrey[y * W + x];
  int f = pixels_find(format);
  TEST_ASSERT_GREATER_OR_EQUAL_MESSAGE(0, f, format);
  TEST_ASSERT_EQUAL_MESSAGE((H - 1) * stride + W * bytes_per_pixel, pixels_bytes(f, W, H, stride), format);
  pixels_to_grey(f, from, W, H, stride, grey);
  TEST_ASSERT_EQUAL_UINT8_ARRAY_MESSAGE(kGrey, grey, W * H, format);
  TEST_ASSERT_EQUAL(f, pixels_of_fourcc(pixels_fourcc(f)));
}

TEST(each_format_has_its_luma_where_it_should_be) {
  expect_grey("GREY", 4, 1, 0);
  expect_grey("GREY", 9, 1, 0);
  expect_grey("NV12", 6, 1, 0);
  expect_grey("YUYV", 8, 2, 0);
  expect_grey("UYVY", 10, 2, 1);
  expect_grey("Y16", 8, 2, 1);
}

TEST(ten_bits_keep_their_upper_eight) {
  const uint8_t from[8] = {0x03, 0x00, 0x04, 0x00, 0xff, 0x03, 0xff, 0xff};  // 3, 4, 1023, rubbish above
  uint8_t grey[4];
  pixels_to_grey(pixels_find("Y10"), from, 4, 1, 8, grey);
  const uint8_t expected[4] = {0, 1, 255, 255};
  TEST_ASSERT_EQUAL_UINT8_ARRAY(expected, grey, 4);
}

TEST(colours_weigh_as_the_eye_sees_them) {
  const uint8_t from[12] = {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255};
  const uint8_t rgb[4] = {77, 149, 29, 255}, bgr[4] = {29, 149, 77, 255};
  uint8_t grey[4];
  pixels_to_grey(pixels_find("RGB3"), from, 4, 1, 12, grey);
  TEST_ASSERT_EQUAL_UINT8_ARRAY(rgb, grey, 4);
  pixels_to_grey(pixels_find("BGR3"), from, 4, 1, 12, grey);
  TEST_ASSERT_EQUAL_UINT8_ARRAY(bgr, grey, 4);
  TEST_ASSERT_EQUAL(2 * 15 + 12, pixels_bytes(pixels_find("RGB3"), 4, 3, 15));
  TEST_ASSERT_EQUAL(0, pixels_are_grey(PIXELS_RGB));
}

TEST(names_of_formats) {
  TEST_ASSERT_EQUAL(PIXELS_MJPEG, pixels_find("MJPEG"));
  TEST_ASSERT_EQUAL(PIXELS_MJPEG, pixels_find("MJPG"));
  TEST_ASSERT_EQUAL_HEX32(0x59455247, pixels_fourcc(PIXELS_GREY));
  TEST_ASSERT_EQUAL(-1, pixels_find("RGB4"));
  TEST_ASSERT_EQUAL(-1, pixels_find(""));
  TEST_ASSERT_EQUAL(-1, pixels_of_fourcc(0));
}

TEST(a_changed_picture_has_another_fingerprint) {
  uint8_t *picture = calloc(640 * 400, 1);
  uint64_t before = pixels_fingerprint(picture, 640 * 400);
  TEST_ASSERT_EQUAL_HEX64(before, pixels_fingerprint(picture, 640 * 400));
  memset(picture + 640 * 200, 1, 640);  // one line
  TEST_ASSERT_TRUE(before != pixels_fingerprint(picture, 640 * 400));
  free(picture);
}

// ── stamps ──────────────────────────────────────────────────────────────────────────────────────────────────────────

#define MS WM_NS_PER_MS
#define NOW (1000 * WM_NS_PER_S)

TEST(stamps_of_start_and_end_become_the_middle_of_the_middle_row) {
  frame_clock clock = {.readout_ns = 10 * MS, .latency_ns = 2 * MS};
  wm_time_ns t_ns;
  // Exposure of 6 ms; the first row begins at 0, the last one ends at 16, the middle of all is 8.
  TEST_ASSERT_EQUAL(STAMP_GOOD, frame_clock_stamp(&clock, NOW + 2 * MS, STAMP_START, NOW + 30 * MS, 6 * MS, &t_ns));
  TEST_ASSERT_EQUAL_INT64(NOW + 8 * MS, t_ns);
  TEST_ASSERT_EQUAL(STAMP_GOOD, frame_clock_stamp(&clock, NOW + 18 * MS, STAMP_END, NOW + 30 * MS, 6 * MS, &t_ns));
  TEST_ASSERT_EQUAL_INT64(NOW + 8 * MS, t_ns);
}

TEST(without_a_stamp_the_arrival_is_its_end) {
  frame_clock clock = {0};
  wm_time_ns t_ns;
  TEST_ASSERT_EQUAL(STAMP_GUESSED, frame_clock_stamp(&clock, 0, STAMP_START, NOW, 6 * MS, &t_ns));
  TEST_ASSERT_EQUAL_INT64(NOW - 3 * MS, t_ns);
  TEST_ASSERT_GREATER_THAN_INT64(10 * MS, clock.uncertainty_ns);
}

// A camera whose clock is 29 s ahead (or behind, or near the end of the numbers) is followed by its own clock.
static void follow(wm_time_ns offset_ns, wm_time_ns limit_ns) {
  frame_clock clock = {0};
  int turned = 0;
  for (int i = 0; i < 300; i++) {
    wm_time_ns taken_ns = NOW + i * 33 * MS, late_ns = (5 + (i * 7) % 20) * MS, t_ns;
    stamp_verdict v = frame_clock_stamp(&clock, taken_ns + offset_ns, STAMP_END, taken_ns + late_ns, 0, &t_ns);
    turned += v == STAMP_NOW_FOREIGN;
    if (i < 30) continue;
    TEST_ASSERT_EQUAL(STAMP_GOOD, v);
    TEST_ASSERT_INT64_WITHIN(limit_ns, taken_ns + 5 * MS, t_ns);  // 5 ms are not seen by anyone
  }
  TEST_ASSERT_EQUAL(1, turned);
  TEST_ASSERT_TRUE(clock.is_foreign);
}

TEST(a_camera_with_a_clock_of_its_own_is_followed) {
  follow(29 * WM_NS_PER_S, MS);
  follow(-29 * WM_NS_PER_S, MS);
  follow(INT64_MAX - NOW - 20 * WM_NS_PER_S, MS);  // as vivid's wrap_timestamp: 16 s below 2^63
}

TEST(one_absurd_stamp_changes_no_belief) {
  frame_clock clock = {0};
  wm_time_ns t_ns;
  for (int i = 0; i < 10; i++) {
    wm_time_ns taken_ns = NOW + i * 33 * MS;
    wm_time_ns stamp_ns = i == 5 ? taken_ns - 900 * WM_NS_PER_S : taken_ns;
    stamp_verdict v = frame_clock_stamp(&clock, stamp_ns, STAMP_END, taken_ns + 10 * MS, 0, &t_ns);
    TEST_ASSERT_EQUAL(i == 5 ? STAMP_GUESSED : STAMP_GOOD, v);
  }
  TEST_ASSERT_FALSE(clock.is_foreign);
  TEST_ASSERT_EQUAL_UINT64(1, clock.implausible);
}

// ── numbers ─────────────────────────────────────────────────────────────────────────────────────────────────────────

TEST(gaps_are_counted_and_wraps_are_none) {
  frame_count count = {0};
  uint64_t lost;
  TEST_ASSERT_EQUAL(COUNT_NEXT, frame_count_take(&count, 4294967294u, &lost));
  TEST_ASSERT_EQUAL(COUNT_NEXT, frame_count_take(&count, 4294967295u, &lost));
  TEST_ASSERT_EQUAL(COUNT_NEXT, frame_count_take(&count, 0, &lost));
  TEST_ASSERT_EQUAL_UINT64(0, lost);
  TEST_ASSERT_EQUAL(COUNT_NEXT, frame_count_take(&count, 3, &lost));
  TEST_ASSERT_EQUAL_UINT64(2, lost);
  TEST_ASSERT_EQUAL_UINT64(5, count.number);
  TEST_ASSERT_EQUAL(COUNT_SAME, frame_count_take(&count, 3, &lost));
  TEST_ASSERT_EQUAL(COUNT_RESTARTED, frame_count_take(&count, 1, &lost));
  TEST_ASSERT_EQUAL_UINT64(0, lost);
}
