// SPDX-License-Identifier: Apache-2.0
// A pair of the robot's cameras: pictures of one instant together, others alone and counted.
#include "camera_set.h"

#include <errno.h>
#include <string.h>

#include "../drivers/fake_camera.h"
#include "camera_device.h"
#include "unity.h"

#define MS WM_NS_PER_MS
#define AT(ms) (FAKE_BOOT_NS + (ms)*MS)

static fake_camera fakes[2];
static fake_step steps[2][60];
static size_t step_count[2];
static camera_set set;
static wm_frame frames[2];
static wm_error err;

static void add(int side, fake_what what, wm_time_ns at_ns, uint32_t sequence) {
  size_t i = step_count[side]++;
  steps[side][i] = (fake_step){
      .at_ns = at_ns + 5 * MS, .what = what, .sequence = sequence, .stamp_ns = at_ns, .grey = (uint8_t)(i + 1)};
  steps[side][i + 1] = (fake_step){.at_ns = INT64_MAX, .what = FAKE_END};
}

static void make(void) {
  static const wm_camera_device_config kConfigs[2] = {{.name = "left", .device = "/dev/video0", .format = "GREY"},
                                                      {.name = "right", .device = "/dev/video1", .format = "GREY"}};
  const wm_camera camera = {.width_px = FAKE_WIDTH, .height_px = FAKE_HEIGHT};
  for (int i = 0; i < 2; i++)
    TEST_ASSERT_EQUAL(WM_OK, camera_device_make(&kConfigs[i], &camera, i, NULL, NULL, &kFakeCamera, &fakes[i],
                                                &set.devices[i], &err));
  set.count = 2;
}

void setUp(void) {
  memset(&set, 0, sizeof set);
  for (int i = 0; i < 2; i++) {
    step_count[i] = 0;
    fake_camera_init(&fakes[i], steps[i]);
    for (uint32_t n = 0; n < 4; n++) add(i, FAKE_PICTURE, AT(0), n);  // which every start throws away
  }
}
void tearDown(void) { camera_set_close(&set); }

static wm_status next(void) {
  wm_status status = WM_AGAIN;
  for (int i = 0; i < 40 && status == WM_AGAIN; i++) status = camera_set_next(&set, frames, &err);
  return status;
}

static void expect_pair(wm_time_ns left_ns, wm_time_ns right_ns) {
  TEST_ASSERT_EQUAL(WM_OK, next());
  TEST_ASSERT_EQUAL_INT64(left_ns, frames[0].t_ns);
  TEST_ASSERT_EQUAL_INT64(right_ns, frames[1].t_ns);
}

static void pictures_of_one_instant_are_given_together(void) {
  for (uint32_t i = 0; i < 3; i++) {
    add(0, FAKE_PICTURE, AT(100 + 100 * i), 4 + i);
    add(1, FAKE_PICTURE, AT(100 + 100 * i) + MS, 4 + i);
  }
  make();
  for (uint32_t i = 0; i < 3; i++) expect_pair(AT(100 + 100 * i), AT(100 + 100 * i) + MS);
  TEST_ASSERT_EQUAL(WM_AGAIN, next());
  TEST_ASSERT_EQUAL_UINT64(0, set.alone);
}

static void a_picture_without_its_other_half_is_counted(void) {
  wm_source_counts counts = {0};
  for (uint32_t i = 0; i < 3; i++) {
    add(0, FAKE_PICTURE, AT(100 + 100 * i), 4 + i);
    if (i != 1) add(1, FAKE_PICTURE, AT(100 + 100 * i), 4 + i);
  }
  make();
  expect_pair(AT(100), AT(100));
  expect_pair(AT(300), AT(300));
  camera_set_counts(&set, &counts);
  TEST_ASSERT_EQUAL_UINT64(1, set.alone);
  TEST_ASSERT_EQUAL_UINT64(2, counts.lost);  // the one that is alone, and the one that the driver lost
  TEST_ASSERT_EQUAL(WM_DEVICE_WORKS, counts.device);
}

static void one_that_is_unplugged_is_said_and_comes_back(void) {
  wm_source_counts counts = {0};
  add(0, FAKE_PICTURE, AT(100), 4);
  add(1, FAKE_PICTURE, AT(100), 4);
  add(1, FAKE_FAILS, AT(150), 0);
  steps[1][step_count[1] - 1].reason = ENODEV;
  add(1, FAKE_REMOVED, AT(151), 0);
  add(1, FAKE_BACK, AT(1000), 0);
  make();
  expect_pair(AT(100), AT(100));
  TEST_ASSERT_EQUAL(WM_AGAIN, next());
  camera_set_counts(&set, &counts);
  TEST_ASSERT_TRUE_MESSAGE(counts.device != WM_DEVICE_WORKS, counts.device_note);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(pictures_of_one_instant_are_given_together);
  RUN_TEST(a_picture_without_its_other_half_is_counted);
  RUN_TEST(one_that_is_unplugged_is_said_and_comes_back);
  return UNITY_END();
}
