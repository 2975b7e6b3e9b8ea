// SPDX-License-Identifier: Apache-2.0
// A pair of the robot's cameras: pictures of one instant together, others alone and counted.
#include <errno.h>

#include "../drivers/fake_camera.h"
#include "camera_device.h"
#include "common/folder.h"
#include "common/suite.h"
#include "rt/arena.h"
#include "rt/clock.h"
#include "sources/frame_hub.h"
#include "sources/vision.h"

#define MS WM_NS_PER_MS
#define AT(ms) (FAKE_BOOT_NS + (ms)*MS)

static fake_camera fakes[2];
static fake_step steps[2][60];
static size_t step_count[2];
static frame_hub *hubs[2];
static wm_config config;
static wm_recording *robot;
static wm_estimator taker;
static wm_vision *vision;
static wm_arena arena;
static wm_error err;

// A detector of a pair: it tells the stamps of what it is shown.
static size_t pair_bytes(const void *params, const wm_view *view, const char **why) {
  (void)params, (void)view, (void)why;
  return 64;
}
static wm_status pair_init(void *state, const void *params, const wm_view *view) {
  (void)state, (void)params, (void)view;
  return WM_OK;
}
static wm_time_ns seen_ns[2], detected_ns;
static wm_status pair_detect(void *state, const wm_frame *frames, const wm_estimate *prediction, wm_event *out,
                             size_t capacity, size_t *count) {
  (void)state, (void)prediction;
  TEST_ASSERT_TRUE(capacity > 0 && frames[0].grey && frames[1].grey);
  for (int i = 0; i < 2; i++) seen_ns[i] = frames[i].t_ns;
  memset(out, 0, WM_EVENT_SMALL_BYTES);
  out->kind = WM_EVENT_STEREO;
  out->t_ns = frames[0].t_ns;
  *count = 1;
  detected_ns = wm_monotonic_ns();
  return WM_OK;
}
static const wm_detector kPair = {.name = "pair",
                                  .gives = WM_EVENT_BIT(WM_EVENT_STEREO),
                                  .pictures = 2,
                                  .state_bytes = pair_bytes,
                                  .init = pair_init,
                                  .detect = pair_detect};

static void add(int side, fake_what what, wm_time_ns at_ns, uint32_t sequence) {
  size_t i = step_count[side]++;
  steps[side][i] = (fake_step){
      .at_ns = at_ns + 5 * MS, .what = what, .sequence = sequence, .stamp_ns = at_ns, .grey = (uint8_t)(i + 1)};
  steps[side][i + 1] = (fake_step){.at_ns = INT64_MAX, .what = FAKE_END};
}

static int has_both(const wm_pictures *base, const char *camera) {
  (void)base, (void)camera;
  return 1;
}

static wm_status open_one(wm_pictures *base, const wm_camera *camera, int32_t index, const wm_frame_wishes *wishes,
                          wm_frame_source **out, wm_error *error) {
  wm_camera_device_config device = {.format = "GREY"};
  wm_camera_device *made;
  (void)base;
  (void)snprintf(device.name, sizeof device.name, "%s", camera->name);
  TEST_ASSERT_EQUAL(WM_OK,
                    camera_device_make(&device, camera, index, NULL, NULL, &kFakeCamera, &fakes[index], &made, error));
  TEST_ASSERT_EQUAL(
      WM_OK, frame_hub_open(wm_camera_device_frames(made), camera->width_px, camera->height_px, &hubs[index], error));
  const wm_frame_wishes without_waiting = {.waiting_max = wishes->waiting_max};
  return frame_hub_subscribe(hubs[index], &without_waiting, out, error);
}

static void close_both(wm_pictures *base) {
  (void)base;
  for (int i = 0; i < 2; i++) {
    frame_hub_close(hubs[i]);
    hubs[i] = NULL;
  }
}

static void make(void) {
  static const wm_pictures_ops kOps = {.has = has_both, .open = open_one, .close = close_both};
  static wm_pictures pictures = {.ops = &kOps};
  static const char text[] = "format: waymark-config/1\nestimator: odometry\n";
  wm_arena_need needs[WM_VISION_NEEDS];
  TEST_ASSERT_EQUAL(WM_OK, wm_config_parse(text, strlen(text), "pair.yaml", &config, &err));
  (void)snprintf(config.overrides.calibration, sizeof config.overrides.calibration, "%s", folder_path("pair.yaml"));
  config.vision[0].detector = &kPair;
  config.vision_count = 1;
  taker = *config.estimator;
  taker.takes |= kPair.gives;
  config.estimator = &taker;
  wm_site *site;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_site_open(NULL, &config.overrides, NULL, NULL, &site, &err), err.text);
  TEST_ASSERT_EQUAL(WM_OK, wm_recording_of_site("robot", site, &robot, &err));
  wm_recording_set_pictures(robot, &pictures);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_vision_open(&config, robot, NULL, NULL, &vision, &err), err.text);
  TEST_ASSERT_EQUAL(WM_OK, wm_arena_fill(&arena, needs, wm_vision_needs(vision, needs), 0, &err));
  TEST_ASSERT_EQUAL(WM_OK, wm_vision_start(vision, &err));
  TEST_ASSERT_TRUE(wm_vision_source(vision, 0)->is_live);
  for (int i = 0; i < 2; i++) wm_vision_source(vision, 0)->until_ns = INT64_MAX;
}

#define CAMERA                                                                                                      \
  "{model: equidistant, size: [64, 48], intrinsics: [30, 30, 32, 24], distortion: [0, 0, 0, 0], mounting: {xyz_m: " \
  "[0, 0, 0], rpy_deg: [0, 0, 0]}}\n"

void setUp(void) {
  (void)folder_make();
  folder_write("pair.yaml",
               "cameras:\n  left: " CAMERA "  right: " CAMERA "stereo: {left: left, right: right, baseline_m: 0.1}\n");
  memset(&arena, 0, sizeof arena);
  for (int i = 0; i < 2; i++) {
    step_count[i] = 0;
    fake_camera_init(&fakes[i], steps[i]);
    for (uint32_t n = 0; n < 4; n++) add(i, FAKE_PICTURE, AT(0), n);  // which every start throws away
  }
}

void tearDown(void) {
  wm_vision_close(vision);
  wm_recording_close(robot);
  config.vision_count = 0;
  wm_config_free(&config);
  wm_arena_close(&arena);
  folder_remove();
}

static wm_event event;

static wm_status next(void) {
  wm_source *source = wm_vision_source(vision, 0);
  wm_status status = WM_AGAIN;
  for (int i = 0; i < 40 && status == WM_AGAIN; i++) {
    for (int k = 0; k < 2; k++) (void)frame_hub_take(hubs[k], &err);
    status = source->ops->next(source, &event, &err);
  }
  return status;
}

static void expect_pair(wm_time_ns left_ns, wm_time_ns right_ns) {
  TEST_ASSERT_EQUAL(WM_OK, next());
  TEST_ASSERT_EQUAL_INT64(left_ns, seen_ns[0]);
  TEST_ASSERT_EQUAL_INT64(right_ns, seen_ns[1]);
}

TEST(pictures_of_one_instant_are_given_together) {
  for (uint32_t i = 0; i < 3; i++) {
    add(0, FAKE_PICTURE, AT(100 + 100 * i), 4 + i);
    add(1, FAKE_PICTURE, AT(100 + 100 * i) + MS, 4 + i);
  }
  make();
  for (uint32_t i = 0; i < 3; i++) expect_pair(AT(100 + 100 * i), AT(100 + 100 * i) + MS);
  TEST_ASSERT_EQUAL(WM_AGAIN, next());
  TEST_ASSERT_EQUAL_UINT64(0, wm_vision_source(vision, 0)->counts.lost);
}

TEST(a_picture_without_its_other_half_is_counted) {
  for (uint32_t i = 0; i < 3; i++) {
    add(0, FAKE_PICTURE, AT(100 + 100 * i), 4 + i);
    if (i != 1) add(1, FAKE_PICTURE, AT(100 + 100 * i), 4 + i);
  }
  make();
  expect_pair(AT(100), AT(100));
  expect_pair(AT(300), AT(300));
  const wm_source_counts counts = wm_vision_source(vision, 0)->counts;
  TEST_ASSERT_EQUAL_UINT64(2, counts.lost);  // the one that is alone, and the one that the driver lost
  TEST_ASSERT_EQUAL(WM_DEVICE_WORKS, counts.device);
}

// Lateness is that of the observation: a detector's time counts.
TEST(observations_arrive_when_they_are_ready) {
  for (int i = 0; i < 2; i++) add(i, FAKE_PICTURE, AT(100), 4);
  make();
  expect_pair(AT(100), AT(100));
  TEST_ASSERT_EQUAL_INT64(AT(100), event.t_ns);
  TEST_ASSERT_GREATER_OR_EQUAL_INT64(detected_ns, event.arrival_ns);
  TEST_ASSERT_LESS_OR_EQUAL_INT64(wm_monotonic_ns(), event.arrival_ns);
}

TEST(one_that_is_unplugged_is_said_and_comes_back) {
  add(0, FAKE_PICTURE, AT(100), 4);
  add(1, FAKE_PICTURE, AT(100), 4);
  add(1, FAKE_FAILS, AT(150), 0);
  steps[1][step_count[1] - 1].reason = ENODEV;
  add(1, FAKE_REMOVED, AT(151), 0);
  add(1, FAKE_BACK, AT(1000), 0);
  make();
  expect_pair(AT(100), AT(100));
  TEST_ASSERT_EQUAL(WM_AGAIN, next());
  const wm_source_counts counts = wm_vision_source(vision, 0)->counts;
  TEST_ASSERT_TRUE_MESSAGE(counts.device != WM_DEVICE_WORKS, counts.device_note);
}
