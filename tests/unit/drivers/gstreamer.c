// SPDX-License-Identifier: Apache-2.0
// Cameras by GStreamer: real pipelines of videotestsrc, in this process. Pixels are those that gst-launch-1.0 writes
// into a file; stamps, drops, errors, the end and a second start.
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "camera_io.h"
#include "common/folder.h"
#include "common/suite.h"
#include "pixels.h"

#define WIDTH 320
#define HEIGHT 240
#define SIZE "width=320,height=240"
#define WAIT_MS 2000

static const camera_io *const kIo = &kGstreamer;
static void *camera;
static camera_mode mode;
static camera_buffer buffer;

static int open_pipeline(const char *text, int format) {
  camera_identity identity = {.path = ""};
  (void)snprintf(identity.path, sizeof identity.path, "%s", text);
  camera = NULL;
  const int failed = kIo->open(NULL, &identity, &camera);
  if (failed) return failed;
  mode = (camera_mode){.fourcc = format < 0 ? 0 : pixels_fourcc(format), .width = 1, .height = 1};
  return kIo->set_mode(camera, &mode);
}

static void shut(void) {
  if (camera) kIo->close(camera);
  camera = NULL;
}

void setUp(void) {}
void tearDown(void) { shut(); }

static wm_time_ns now(void) { return kIo->monotonic_ns(NULL); }

static void next(void) { TEST_ASSERT_EQUAL(1, kIo->take(camera, WAIT_MS, &buffer)); }

// Five pictures of a format against those that gst-launch-1.0 writes: the first plane, row by row.
static void same_as_launched(const char *name, int format, size_t row_bytes, size_t picture_bytes) {
  char pipeline[300], command[700];
  (void)folder_make();
  (void)snprintf(pipeline, sizeof pipeline,
                 "videotestsrc num-buffers=5 pattern=ball ! video/x-raw,format=%s,framerate=50/1," SIZE, name);
  (void)snprintf(command, sizeof command, "gst-launch-1.0 -q %s ! filesink location=%s", pipeline, folder_path("raw"));
  TEST_ASSERT_EQUAL(0, system(command));
  FILE *file = fopen(folder_path("raw"), "rb");
  TEST_ASSERT_NOT_NULL(file);
  static uint8_t wanted[WIDTH * HEIGHT * 3];
  TEST_ASSERT_EQUAL(0, open_pipeline(pipeline, -1));
  TEST_ASSERT_EQUAL_HEX32(pixels_fourcc(format), mode.fourcc);
  TEST_ASSERT_EQUAL(WIDTH, mode.width);
  TEST_ASSERT_EQUAL(HEIGHT, mode.height);
  TEST_ASSERT_EQUAL_DOUBLE(50, mode.rate_hz);
  for (uint32_t i = 0; i < 5; i++) {
    TEST_ASSERT_EQUAL_size_t(picture_bytes, fread(wanted, 1, picture_bytes, file));
    next();
    TEST_ASSERT_EQUAL_UINT32(i, buffer.sequence);
    TEST_ASSERT_GREATER_OR_EQUAL_size_t(pixels_bytes(format, WIDTH, HEIGHT, mode.stride), buffer.bytes);
    for (size_t y = 0; y < HEIGHT; y++)
      TEST_ASSERT_EQUAL_MEMORY(wanted + y * row_bytes, buffer.data + y * mode.stride, row_bytes);
    TEST_ASSERT_EQUAL(0, kIo->give_back(camera, buffer.index));
  }
  TEST_ASSERT_EQUAL(-ENODEV, kIo->take(camera, WAIT_MS, &buffer));  // its end
  (void)fclose(file);
  folder_remove();
  shut();
}

TEST(pixels_are_those_of_the_pipeline) {
  same_as_launched("NV12", PIXELS_NV12, WIDTH, WIDTH * HEIGHT * 3 / 2);
  same_as_launched("GRAY8", PIXELS_GREY, WIDTH, WIDTH * HEIGHT);
  same_as_launched("YUY2", PIXELS_YUYV, 2 * WIDTH, 2 * WIDTH * HEIGHT);
  same_as_launched("BGR", PIXELS_BGR, 3 * WIDTH, 3 * WIDTH * HEIGHT);
  same_as_launched("GRAY16_LE", PIXELS_Y16, 2 * WIDTH, 2 * WIDTH * HEIGHT);
}

TEST(stamps_are_of_the_monotonic_clock) {
  const wm_time_ns begin_ns = now();
  TEST_ASSERT_EQUAL(
      0, open_pipeline("videotestsrc is-live=true ! video/x-raw,format=GRAY8,framerate=50/1," SIZE " ! appsink",
                       PIXELS_GREY));
  wm_time_ns before_ns = 0;
  for (int i = 0; i < 25; i++) {
    next();
    TEST_ASSERT_GREATER_THAN_INT64(begin_ns, buffer.stamp_ns);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(now(), buffer.stamp_ns);
    if (before_ns) TEST_ASSERT_EQUAL_INT64(20000000, buffer.stamp_ns - before_ns);
    before_ns = buffer.stamp_ns;
    TEST_ASSERT_EQUAL(0, kIo->give_back(camera, buffer.index));
  }
}

TEST(what_the_sink_drops_is_missing_in_the_numbers) {
  TEST_ASSERT_EQUAL(
      0, open_pipeline("videotestsrc is-live=true ! video/x-raw,format=NV12,framerate=50/1," SIZE, PIXELS_NV12));
  next();
  const uint32_t first = buffer.sequence;
  TEST_ASSERT_EQUAL(0, kIo->give_back(camera, buffer.index));
  kIo->sleep_ms(NULL, 600);
  next();
  TEST_ASSERT_GREATER_THAN_UINT32(first + 10, buffer.sequence);
  TEST_ASSERT_EQUAL(0, kIo->give_back(camera, buffer.index));
  TEST_ASSERT_EQUAL(-EINVAL, kIo->give_back(camera, buffer.index));
}

TEST(a_file_comes_at_its_own_speed) {
  const wm_time_ns begin_ns = now();
  TEST_ASSERT_EQUAL(
      0, open_pipeline("videotestsrc num-buffers=26 ! video/x-raw,format=GRAY8,framerate=50/1," SIZE, PIXELS_GREY));
  for (int i = 0; i < 26; i++) {
    next();
    TEST_ASSERT_EQUAL(0, kIo->give_back(camera, buffer.index));
  }
  TEST_ASSERT_GREATER_THAN_INT64(490000000, now() - begin_ns);
}

TEST(jpegs_are_handed_on) {
  TEST_ASSERT_EQUAL(0, open_pipeline("videotestsrc num-buffers=3 ! video/x-raw," SIZE " ! jpegenc", PIXELS_MJPEG));
  TEST_ASSERT_EQUAL_HEX32(pixels_fourcc(PIXELS_MJPEG), mode.fourcc);
  next();
  TEST_ASSERT_EQUAL_HEX8(0xFF, buffer.data[0]);
  TEST_ASSERT_EQUAL_HEX8(0xD8, buffer.data[1]);
}

TEST(errors_and_another_try) {
  TEST_ASSERT_EQUAL(-EINVAL, open_pipeline("no-such-element", -1));
  TEST_ASSERT_EQUAL(-EINVAL, open_pipeline("videotestsrc ! ", -1));
  TEST_ASSERT_EQUAL(-EINVAL, open_pipeline("", -1));
  TEST_ASSERT_EQUAL(-ENODEV, open_pipeline("filesrc location=/nowhere/video.avi ! avidemux", -1));
  shut();
  TEST_ASSERT_EQUAL(
      -ENODEV, open_pipeline("videotestsrc ! video/x-raw,format=RGB16," SIZE, -1));  // a format that is not supported
  shut();
  for (int i = 0; i < 3; i++) {
    TEST_ASSERT_EQUAL(0, open_pipeline("videotestsrc is-live=true ! video/x-raw,format=GRAY8," SIZE, -1));
    next();
    shut();
  }
}
