// SPDX-License-Identifier: Apache-2.0
// A camera in a process of its own, whose library ends that process. This program is both: with one argument the
// camera.
#include "camera_process.h"

#include <dirent.h>
#include <errno.h>

#include "common/suite.h"

#define WIDTH 8
#define HEIGHT 4
#define PICTURES_UNTIL_THE_END 3

static char kThisProgram[] = "/proc/self/exe";

// ── the library ─────────────────────────────────────────────────────────────────────────────────────────────────────

static struct {
  uint8_t picture[WIDTH * HEIGHT];
  uint32_t taken, given_back;
  int is_fragile;
} library;

static int library_open(void *context, camera_identity *wanted, void **camera) {
  (void)context;
  if (strcmp(wanted->path, "absent") == 0) return -ENODEV;
  library.is_fragile = strcmp(wanted->path, "fragile") == 0;
  (void)strcpy(wanted->card, "Film");
  *camera = &library;
  return 0;
}

static int library_set_mode(void *camera, camera_mode *mode) {
  (void)camera;
  *mode = (camera_mode){.fourcc = mode->fourcc, .width = WIDTH, .height = HEIGHT, .stride = WIDTH, .rate_hz = 5};
  mode->image_bytes = WIDTH * HEIGHT;
  return 0;
}

static int library_set_control(void *camera, camera_control *control) {
  (void)camera;
  if (strcmp(control->name, "gain") != 0) return -EINVAL;
  control->value = 7;
  return -ERANGE;
}

static wm_time_ns library_exposure_ns(void *camera) {
  (void)camera;
  return 8000000;
}

static int library_start(void *camera, uint32_t buffers) {
  (void)camera;
  return buffers == 4 ? 0 : -EINVAL;
}

static int library_take(void *camera, int wait_ms, camera_buffer *out) {
  (void)camera;
  if (wait_ms == 0) return 0;
  if (library.is_fragile && library.taken == PICTURES_UNTIL_THE_END) _Exit(1);  // as abort() in a failed assertion
  memset(library.picture, (int)++library.taken, sizeof library.picture);
  *out = (camera_buffer){.index = library.taken % 4, .bytes = sizeof library.picture, .sequence = library.given_back};
  out->data = library.picture;
  out->stamp_ns = 1000 + library.taken;
  return 1;
}

static int library_give_back(void *camera, uint32_t index) {
  (void)camera;
  library.given_back += index == library.taken % 4;
  return 0;
}

static void library_close(void *camera) { (void)camera; }

static const camera_io kLibrary = {.open = library_open,
                                   .set_mode = library_set_mode,
                                   .set_control = library_set_control,
                                   .exposure_ns = library_exposure_ns,
                                   .start = library_start,
                                   .take = library_take,
                                   .give_back = library_give_back,
                                   .close = library_close};

// ── tests ───────────────────────────────────────────────────────────────────────────────────────────────────────────

static void *camera;
static const camera_io *const kIo = &kCameraProcess;

void setUp(void) { camera = NULL; }

static void begin(const char *path) {
  camera_identity identity = {0};
  camera_mode mode = {.fourcc = 42};
  (void)strcpy(identity.path, path);
  TEST_ASSERT_EQUAL(0, kIo->open(kThisProgram, &identity, &camera));
  TEST_ASSERT_EQUAL_STRING("Film", identity.card);
  TEST_ASSERT_EQUAL(0, kIo->set_mode(camera, &mode));
  TEST_ASSERT_EQUAL(42, mode.fourcc);
  TEST_ASSERT_EQUAL(WIDTH, mode.width);
  TEST_ASSERT_EQUAL(0, kIo->start(camera, 4));
}

static void expect_picture(uint32_t number) {
  camera_buffer b;
  TEST_ASSERT_EQUAL(1, kIo->take(camera, 10, &b));
  TEST_ASSERT_EQUAL(number, b.data[0]);
  TEST_ASSERT_EQUAL(number, b.data[WIDTH * HEIGHT - 1]);
  TEST_ASSERT_EQUAL(WIDTH * HEIGHT, b.bytes);
  TEST_ASSERT_EQUAL_INT64(1000 + number, b.stamp_ns);
  TEST_ASSERT_EQUAL(number - 1, b.sequence);  // as many as were given back
  TEST_ASSERT_EQUAL(0, kIo->give_back(camera, b.index));
}

TEST(calls_and_pictures_come_through) {
  camera_buffer b;
  camera_control gain = {.name = "gain", .value = 99}, other = {.name = "other"};
  begin("whole");
  TEST_ASSERT_EQUAL(-ERANGE, kIo->set_control(camera, &gain));
  TEST_ASSERT_EQUAL(7, gain.value);
  TEST_ASSERT_EQUAL(-EINVAL, kIo->set_control(camera, &other));
  TEST_ASSERT_EQUAL(0, kIo->take(camera, 0, &b));
  for (uint32_t i = 1; i <= 10; i++) expect_picture(i);
  TEST_ASSERT_EQUAL_INT64(8000000, kIo->exposure_ns(camera));
  kIo->close(camera);
}

TEST(a_library_that_ends_its_process_is_a_camera_that_is_gone) {
  camera_buffer b;
  for (int times = 0; times < 2; times++) {  // and it may come back
    begin("fragile");
    for (uint32_t i = 1; i <= PICTURES_UNTIL_THE_END; i++) expect_picture(i);
    TEST_ASSERT_EQUAL(-ENODEV, kIo->take(camera, 10, &b));
    TEST_ASSERT_EQUAL(-ENODEV, kIo->take(camera, 10, &b));
    TEST_ASSERT_EQUAL(-ENODEV, kIo->give_back(camera, 0));
    kIo->close(camera);
  }
}

static int open_files(void) {
  int count = 0;
  DIR *folder = opendir("/proc/self/fd");
  while (readdir(folder)) count++;
  (void)closedir(folder);
  return count;
}

TEST(nothing_is_left_of_cameras_that_were_closed) {
  const int before = open_files();
  for (int i = 0; i < 20; i++) {
    camera_identity absent = {.path = "absent"};
    TEST_ASSERT_EQUAL(-ENODEV, kIo->open(kThisProgram, &absent, &camera));
    begin("whole");
    expect_picture(1);
    kIo->close(camera);
  }
  TEST_ASSERT_EQUAL(before, open_files());
}

int suite_begin(int argc, char **argv) {
  if (argc == 2 && strcmp(argv[1], CAMERA_PROCESS) == 0) {
    camera_process_serve(&kLibrary);
    return 0;
  }
  return SUITE_RUNS;
}
