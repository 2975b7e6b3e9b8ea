// SPDX-License-Identifier: Apache-2.0
// A camera as a giver of frames: sequences of buffers as real drivers gave them (v4l2loopback, vivid), and what befalls
// a camera on a robot.
#include "camera_device.h"

#include <errno.h>
#include <turbojpeg.h>

#include "common/suite.h"
#include "fake_camera.h"

static fake_camera fake;
static wm_camera_device *device;
static wm_camera_device_config config;
static wm_camera calibrated;
static wm_frame frame;
static wm_error err;
static char warned[1024];
static fake_step steps[200];
static size_t step_count;

static void hear(void *context, wm_note note, const char *line) {
  (void)context;
  (void)note;
  size_t used = strlen(warned);
  (void)snprintf(warned + used, sizeof warned - used, "%s\n", line);
}

void setUp(void) {
  device = NULL;
  step_count = 0;
  warned[0] = '\0';
  config = (wm_camera_device_config){.name = "front", .device = "/dev/video0", .format = "GREY", .rate_hz = 30};
  calibrated = (wm_camera){.width_px = FAKE_WIDTH, .height_px = FAKE_HEIGHT};
  fake_camera_init(&fake, steps);
}
void tearDown(void) { wm_camera_device_close(device); }

#define MS WM_NS_PER_MS
#define AT(ms) (FAKE_BOOT_NS + (ms)*MS)

static fake_step *add(fake_what what, wm_time_ns at_ns) {
  steps[step_count + 1] = (fake_step){.at_ns = INT64_MAX, .what = FAKE_END};
  steps[step_count] = (fake_step){.at_ns = at_ns, .what = what};
  return &steps[step_count++];
}

// A picture that was taken at `taken_ns` and is ready 8 ms later.
static fake_step *picture(wm_time_ns taken_ns, uint32_t sequence) {
  fake_step *s = add(FAKE_PICTURE, taken_ns + 8 * MS);
  s->sequence = sequence;
  s->stamp_ns = taken_ns;
  s->grey = (uint8_t)(step_count * 37 + 1);
  return s;
}

// Four buffers from before the start, which it throws away, the newest of number `last`.
static void stale(wm_time_ns at_ns, uint32_t last) {
  for (uint32_t i = 0; i < 4; i++) picture(at_ns - 1000 * MS, last - 3 + i)->at_ns = at_ns;
}

static void make(void) {
  TEST_ASSERT_EQUAL_MESSAGE(
      WM_OK, camera_device_make(&config, &calibrated, 2, hear, NULL, &kFakeCamera, &fake, &device, &err), err.text);
}

static const wm_camera_counts *counts(void) { return wm_camera_device_counted(device); }
static wm_status next(void) { return wm_camera_device_next(device, &frame, &err); }

static wm_status next_within(wm_time_ns within_ns) {
  wm_status status;
  wm_time_ns end_ns = fake.now_ns + within_ns;
  while ((status = next()) == WM_AGAIN && fake.now_ns < end_ns) {
  }
  return status;
}

static void expect_picture_of(wm_time_ns taken_ns) {
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, next_within(10 * WM_NS_PER_S), counts()->device_note);
  TEST_ASSERT_EQUAL_INT64(taken_ns, frame.t_ns);
}

static void expect_state(wm_device_state state, const char *note) {
  TEST_ASSERT_EQUAL_MESSAGE(state, counts()->device, counts()->device_note);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(counts()->device_note, note), counts()->device_note);
}

TEST(pictures_become_frames) {
  stale(AT(0), 0);
  picture(AT(10), 1);
  picture(AT(43), 2);
  make();
  expect_picture_of(AT(10));
  TEST_ASSERT_EQUAL_INT64(AT(18), frame.arrival_ns);
  TEST_ASSERT_EQUAL(2, frame.camera);
  TEST_ASSERT_EQUAL(FAKE_WIDTH, frame.width_px);
  TEST_ASSERT_EQUAL(FAKE_HEIGHT, frame.height_px);
  TEST_ASSERT_EQUAL(FAKE_STRIDE, frame.stride_bytes);
  TEST_ASSERT_EQUAL_UINT8(steps[4].grey, frame.grey[(FAKE_HEIGHT - 1) * FAKE_STRIDE + FAKE_WIDTH - 1]);
  expect_picture_of(AT(43));
  TEST_ASSERT_EQUAL_UINT64(1, frame.number);
  expect_state(WM_DEVICE_WORKS, "front");
  TEST_ASSERT_EQUAL(WM_AGAIN, next());
  TEST_ASSERT_EQUAL_UINT32(fake.given, fake.taken_back);
  TEST_ASSERT_EQUAL_STRING("", warned);
}

// At 4 Hz four pictures are a second of blindness.
TEST(the_first_picture_of_a_camera_with_an_empty_ring_is_used) {
  picture(AT(100), 1);
  picture(AT(350), 2);
  make();
  expect_picture_of(AT(100));
  expect_picture_of(AT(350));
  TEST_ASSERT_EQUAL_UINT64(0, counts()->stale);
}

// v4l2loopback: a burst of what was in its ring, with old stamps, then the count leaps.
TEST(what_was_in_the_ring_before_the_start_is_thrown_away) {
  for (uint32_t i = 0; i < 4; i++) picture(AT(-3000 + 33 * (int)i), 4 + i)->at_ns = AT(1);
  picture(AT(20), 60);
  picture(AT(53), 61);
  make();
  expect_picture_of(AT(20));
  expect_picture_of(AT(53));
  TEST_ASSERT_EQUAL_UINT64(4, counts()->stale);
  TEST_ASSERT_EQUAL_UINT64(0, counts()->lost);
  TEST_ASSERT_EQUAL_UINT64(0, counts()->bad_stamps);
}

// v4l2loopback stamps the buffers that it has anew, and numbers them 0, while a reader sets it up.
TEST(what_was_stamped_anew_before_the_start_is_thrown_away) {
  fake.start_takes_ns = 5 * MS;
  picture(AT(2), 0)->at_ns = AT(6);
  picture(AT(20), 60);
  picture(AT(53), 61);
  make();
  expect_picture_of(AT(20));
  expect_picture_of(AT(53));
  TEST_ASSERT_EQUAL_UINT64(1, counts()->stale);
  TEST_ASSERT_EQUAL_UINT64(0, counts()->lost);
}

// vivid, percentage_of_dropped_buffers=30: 7 -> 10, 15 -> 17; and numbers near their wrap (wrap_sequence_number).
TEST(gaps_in_the_drivers_count_are_lost_pictures) {
  stale(AT(0), 4294967290u);
  const uint32_t numbers[] = {4294967293u, 4294967295u, 0, 3};
  for (int i = 0; i < 4; i++) picture(AT(10 + 33 * i), numbers[i]);
  make();
  for (int i = 0; i < 4; i++) expect_picture_of(AT(10 + 33 * i));
  TEST_ASSERT_EQUAL_UINT64(3, counts()->lost);
  TEST_ASSERT_EQUAL_UINT64(6, frame.number);
}

// vivid, inject_v4l2_buf_flag_error; v4l2loopback with a producer of another size.
TEST(damaged_buffers_are_counted_and_passed_over) {
  stale(AT(0), 0);
  picture(AT(10), 1)->flags = CAMERA_BUFFER_ERROR;
  picture(AT(43), 2)->bytes = 100;
  picture(AT(76), 3);
  make();
  expect_picture_of(AT(76));
  TEST_ASSERT_EQUAL_UINT64(2, counts()->damaged);
  TEST_ASSERT_EQUAL_UINT64(0, counts()->lost);
}

TEST(only_the_newest_of_what_waits_is_handed_out) {
  stale(AT(0), 0);
  for (uint32_t i = 0; i < 3; i++) picture(AT(10 + 10 * (int)i), 1 + i)->at_ns = AT(40);
  make();
  expect_picture_of(AT(30));
  TEST_ASSERT_EQUAL_UINT64(2, counts()->skipped);
  TEST_ASSERT_EQUAL_UINT64(0, counts()->lost);
}

// v4l2loopback whose producer was killed: no error, no buffer. Then a new producer on the open device.
TEST(a_stalled_camera_is_noticed_and_switched_off_and_on) {
  stale(AT(0), 0);
  picture(AT(10), 1);
  stale(AT(9000), 5);
  picture(AT(9100), 9);
  make();
  expect_picture_of(AT(10));
  TEST_ASSERT_EQUAL(WM_AGAIN, next_within(2 * WM_NS_PER_S));
  expect_state(WM_DEVICE_STALLED, "gives no pictures");
  expect_picture_of(AT(9100));
  expect_state(WM_DEVICE_WORKS, "gives pictures");
  TEST_ASSERT_GREATER_OR_EQUAL_UINT64(1, counts()->restarts);
}

// v4l2loopback with `timeout`: the last picture again, the same number, the same stamp.
TEST(a_frozen_camera_gives_no_frames) {
  stale(AT(0), 0);
  picture(AT(10), 1);
  for (int i = 0; i < 60; i++) {
    fake_step *again = picture(AT(10), 1);
    again->at_ns = AT(50 + 33 * i);
    again->grey = steps[4].grey;
  }
  picture(AT(3000), 2);
  make();
  expect_picture_of(AT(10));
  TEST_ASSERT_EQUAL(WM_AGAIN, next_within(1500 * MS));
  expect_state(WM_DEVICE_FROZEN, "the same picture");
  expect_picture_of(AT(3000));
  expect_state(WM_DEVICE_WORKS, "gives pictures");
  TEST_ASSERT_EQUAL_UINT64(60, counts()->duplicated);
}

// The same picture with new stamps and numbers: frozen all the same.
TEST(a_camera_that_repeats_its_picture_with_new_stamps_is_frozen) {
  stale(AT(0), 0);
  for (int i = 0; i < 50; i++) picture(AT(10 + 33 * i), 1 + (uint32_t)i)->grey = 77;
  make();
  expect_picture_of(AT(10));
  TEST_ASSERT_EQUAL(WM_AGAIN, next_within(1600 * MS));
  TEST_ASSERT_EQUAL(WM_DEVICE_FROZEN, counts()->device);
}

static void unplug(int reason, const char *bus_after) {
  setUp();
  stale(AT(0), 0);
  picture(AT(10), 1);
  add(FAKE_REMOVED, AT(40));
  add(FAKE_FAILS, AT(40))->reason = reason;
  add(FAKE_BACK, AT(5040));
  stale(AT(6000), 3);
  picture(AT(6033), 4);
  make();
  expect_picture_of(AT(10));
  TEST_ASSERT_EQUAL(WM_AGAIN, next_within(2 * WM_NS_PER_S));
  expect_state(WM_DEVICE_ABSENT, "looking for it");
  TEST_ASSERT_FALSE(fake.is_open);
  (void)snprintf(fake.bus, sizeof fake.bus, "%s", bus_after);
}

TEST(an_unplugged_camera_is_taken_again_when_it_is_back) {
  const int reasons[] = {ENODEV, EINVAL, EIO};  // uvcvideo; vivid's unbind; a fatal streaming error
  for (int i = 0; i < 3; i++) {
    unplug(reasons[i], "usb-1");
    expect_picture_of(AT(6033));
    TEST_ASSERT_EQUAL(2, fake.opened);
    wm_camera_device_close(device);
    device = NULL;
  }
}

TEST(another_camera_in_its_place_is_not_taken) {
  unplug(ENODEV, "usb-2");
  TEST_ASSERT_EQUAL(WM_AGAIN, next_within(8 * WM_NS_PER_S));
  expect_state(WM_DEVICE_ABSENT, "looking for it");
  TEST_ASSERT_EQUAL(1, fake.opened);
}

TEST(what_the_driver_changed_is_said) {
  config.control_count = 3;
  (void)snprintf(config.controls[0].name, 32, "gain");
  config.controls[0].value = 500;
  (void)snprintf(config.controls[1].name, 32, "gian");
  (void)snprintf(config.controls[2].name, 32, "auto_exposure");
  fake.changes_to = (camera_mode){.width = FAKE_WIDTH, .height = FAKE_HEIGHT, .rate_hz = 5};
  memcpy(&fake.changes_to.fourcc, "NV12", 4);
  stale(AT(0), 0);
  picture(AT(10), 1);
  make();
  expect_picture_of(AT(10));
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(warned, "gives NV12 instead of GREY"), warned);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(warned, "5 pictures a second instead of 30"), warned);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(warned, "'gain': 500 is beyond its limits; 100 was set"), warned);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(warned, "no control 'gian'"), warned);
  TEST_ASSERT_EQUAL(1, fake.set_count);
}

TEST(another_size_than_the_calibrations_is_refused) {
  fake.changes_to = (camera_mode){.width = 32, .height = FAKE_HEIGHT};
  stale(AT(0), 0);
  picture(AT(10), 1);
  make();
  TEST_ASSERT_EQUAL(WM_AGAIN, next_within(2 * WM_NS_PER_S));
  expect_state(WM_DEVICE_DOWN, "gives 32x48 pixels, but is calibrated for 64x48");
  TEST_ASSERT_EQUAL(0, fake.started);
}

TEST(the_exposure_the_driver_tells_moves_the_stamp) {
  fake.exposure_ns = 6 * MS;
  calibrated.readout_ns = 10 * MS;
  stale(AT(0), 0);
  picture(AT(20), 1);
  picture(AT(53), 2)->flags = CAMERA_STAMP_START;
  make();
  expect_picture_of(AT(12));
  TEST_ASSERT_EQUAL_INT64(6 * MS, frame.exposure_ns);
  expect_picture_of(AT(61));
}

TEST(a_camera_clock_29_s_off_is_followed_and_said) {
  stale(AT(0), 0);
  for (int i = 0; i < 60; i++) picture(AT(10 + 33 * i), 1 + (uint32_t)i)->stamp_ns += 29 * WM_NS_PER_S;
  make();
  wm_time_ns last_ns = 0;
  for (int i = 0; next_within(200 * MS) == WM_OK; i++) last_ns = frame.t_ns;
  TEST_ASSERT_INT64_WITHIN(10 * MS, AT(10 + 33 * 59), last_ns);
  TEST_ASSERT_TRUE(counts()->is_foreign_clock);
  TEST_ASSERT_INT64_WITHIN(20 * MS, -29 * WM_NS_PER_S, counts()->clock_offset_ns);
  TEST_ASSERT_LESS_OR_EQUAL_UINT64(3, counts()->bad_stamps);
}

// PTP's stamps count TAI. A grandmaster that is set by an hour costs a few pictures, and gives none a wrong time.
static void follow_over_a_step(wm_time_ns step_ns, uint64_t most_lost) {
  stale(AT(0), 0);
  for (int i = 0; i < 60; i++)
    picture(AT(10 + 33 * i), 1 + (uint32_t)i)->stamp_ns += 1800000037 * WM_NS_PER_S + (i < 30 ? 0 : step_ns);
  make();
  uint64_t given = 0;
  wm_time_ns last_ns = 0;
  while (next_within(500 * MS) == WM_OK) {
    const wm_time_ns since_ns = (frame.t_ns - AT(10)) % (33 * MS);
    TEST_ASSERT_TRUE_MESSAGE(since_ns < 10 * MS || since_ns > 23 * MS, "between two pictures");
    TEST_ASSERT_TRUE(frame.t_ns > last_ns && frame.t_ns < AT(10 + 33 * 60));
    last_ns = frame.t_ns, given++;
  }
  TEST_ASSERT_INT64_WITHIN(10 * MS, AT(10 + 33 * 59), last_ns);
  TEST_ASSERT_GREATER_OR_EQUAL_UINT64(60 - most_lost, given);
  TEST_ASSERT_TRUE(counts()->is_foreign_clock);
}

TEST(a_clock_of_ptp_that_is_set_ahead_by_an_hour) { follow_over_a_step(3600 * WM_NS_PER_S, 1); }
TEST(a_clock_of_ptp_that_is_set_back_by_an_hour) { follow_over_a_step(-3600 * WM_NS_PER_S, 8); }

TEST(jpegs_are_decoded_and_garbage_is_not) {
  static uint8_t grey[FAKE_WIDTH * FAKE_HEIGHT];
  unsigned char *jpeg = NULL;
  unsigned long jpeg_bytes = 0;
  memset(grey, 200, sizeof grey);
  tjhandle handle = tjInitCompress();
  TEST_ASSERT_EQUAL(
      0, tjCompress2(handle, grey, FAKE_WIDTH, 0, FAKE_HEIGHT, TJPF_GRAY, &jpeg, &jpeg_bytes, TJSAMP_GRAY, 95, 0));
  (void)snprintf(config.format, sizeof config.format, "MJPG");
  fake.jpeg = jpeg;
  fake.jpeg_bytes = (uint32_t)jpeg_bytes;
  stale(AT(0), 0);
  picture(AT(10), 1)->bytes = 3000;  // garbage, as the loopback's first
  picture(AT(43), 2);
  make();
  expect_picture_of(AT(43));
  TEST_ASSERT_UINT8_WITHIN(2, 200, frame.grey[FAKE_WIDTH * 20 + 7]);
  TEST_ASSERT_EQUAL(FAKE_WIDTH, frame.stride_bytes);
  TEST_ASSERT_EQUAL_UINT64(1, counts()->damaged);
  tjFree(jpeg);
  (void)tjDestroy(handle);
}
