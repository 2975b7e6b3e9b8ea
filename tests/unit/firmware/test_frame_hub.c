// SPDX-License-Identifier: Apache-2.0
// A camera with many readers, on a recorded video: each picture is decoded once, whoever is slow holds nobody up, and
// nothing is lost without being counted.
#include <malloc.h>
#include <pthread.h>
#include <stdatomic.h>
#include <sys/stat.h>

#include "common/folder.h"
#include "common/suite.h"
#include "output/avi_writer.h"
#include "sources/frame_hub.h"
#include "waymark/devices.h"
#include "waymark/video.h"

#define W 20
#define H 6
#define PICTURES 200

static const char *folder;
static wm_error err;
static frame_hub *hub;

// Picture i is of grey i everywhere.
static void write_video(void) {
  uint8_t grey[W * H];
  TEST_ASSERT_EQUAL(0, mkdir(folder_path("video"), 0777));
  FILE *video = fopen(folder_path("video/front.avi"), "wb");
  FILE *stamps = fopen(folder_path("video/front.csv"), "w");
  TEST_ASSERT_TRUE(video && stamps);
  TEST_ASSERT_EQUAL(0, avi_begin(video, "Y800", W, H, 30));
  (void)fputs("frame,t_ns\n", stamps);
  for (int i = 0; i < PICTURES; i++) {
    memset(grey, i, sizeof grey);
    TEST_ASSERT_EQUAL(0, avi_picture(video, grey, W, H, W));
    (void)fprintf(stamps, "%d,%d\n", i, 1000 * (i + 1));
  }
  (void)fclose(video);
  (void)fclose(stamps);
}

static void open_hub(void) {
  const wm_camera camera = {.name = "front", .width_px = W, .height_px = H};
  wm_video *video;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_video_open(folder, &camera, 0, NULL, NULL, &video, &err), err.text);
  TEST_ASSERT_EQUAL(WM_OK, frame_hub_open(wm_video_frames(video), W, H, &hub, &err));
}

void setUp(void) {
  folder = folder_make();
  write_video();
  open_hub();
}

void tearDown(void) {
  frame_hub_close(hub);
  folder_remove();
}

static wm_frame_source *subscribe(uint32_t waiting_max, int wait_ms) {
  wm_frame_source *out;
  const wm_frame_wishes wishes = {.waiting_max = waiting_max, .wait_ms = wait_ms, .wants_raw = 1};
  TEST_ASSERT_EQUAL(WM_OK, frame_hub_subscribe(hub, &wishes, &out, &err));
  return out;
}

static wm_frame next(wm_frame_source *reader) {
  wm_frame frame = {0};
  TEST_ASSERT_EQUAL(WM_OK, reader->ops->next(reader, &frame, &err));
  return frame;
}

static uint64_t overflows(const wm_frame_source *reader) {
  wm_source_counts counts;
  reader->ops->counts(reader, &counts);
  return counts.overflows;
}

TEST(a_picture_is_decoded_once_for_all) {
  wm_frame_source *a = subscribe(1, 0), *b = subscribe(1, 0);
  for (int i = 0; i < 5; i++) {
    TEST_ASSERT_EQUAL(WM_OK, frame_hub_take(hub, &err));
    wm_frame head, of_a, of_b;
    TEST_ASSERT_EQUAL(WM_OK, a->ops->peek(a, &head, &err));
    TEST_ASSERT_NULL(head.grey);
    of_a = next(a);
    of_b = next(b);
    TEST_ASSERT_EQUAL_INT64(1000 * (i + 1), head.t_ns);
    TEST_ASSERT_EQUAL_INT64(head.t_ns, of_a.t_ns);
    TEST_ASSERT_EQUAL_PTR(of_a.grey, of_b.grey);
    TEST_ASSERT_EACH_EQUAL_UINT8(i, of_a.grey, W * H);
    TEST_ASSERT_EQUAL(WM_AGAIN, a->ops->next(a, &of_a, &err));
  }
  a->ops->close(a);
  b->ops->close(b);
}

TEST(a_slow_reader_holds_nobody_up_and_its_losses_are_counted) {
  wm_frame_source *slow = subscribe(1, 0), *quick = subscribe(1, 0), *queue = subscribe(3, 0);
  TEST_ASSERT_EQUAL(WM_OK, frame_hub_take(hub, &err));
  const wm_frame held = next(slow);  // and keeps it
  (void)next(quick);
  for (int i = 1; i < 20; i++) {
    TEST_ASSERT_EQUAL(WM_OK, frame_hub_take(hub, &err));
    TEST_ASSERT_EQUAL_INT64(1000 * (i + 1), next(quick).t_ns);
  }
  TEST_ASSERT_EACH_EQUAL_UINT8(0, held.grey, W * H);
  TEST_ASSERT_EQUAL_INT64(20000, next(slow).t_ns);  // the newest
  TEST_ASSERT_EQUAL_UINT64(18, overflows(slow));
  TEST_ASSERT_EQUAL_UINT64(0, overflows(quick));
  for (int i = 18; i <= 20; i++) TEST_ASSERT_EQUAL_INT64(1000 * i, next(queue).t_ns);
  TEST_ASSERT_EQUAL_UINT64(17, overflows(queue));
  slow->ops->close(slow);
  quick->ops->close(quick);
  queue->ops->close(queue);
}

TEST(what_waits_is_read_before_the_end_is_told) {
  wm_frame_source *reader = subscribe(16, WM_DEVICE_WAIT_MS);
  wm_frame frame;
  int taken = 0;
  for (wm_status status = WM_OK; status == WM_OK; taken += status == WM_OK) status = frame_hub_take(hub, &err);
  TEST_ASSERT_EQUAL(PICTURES, taken);
  for (int i = PICTURES - 15; i <= PICTURES; i++) TEST_ASSERT_EQUAL_INT64(1000 * i, next(reader).t_ns);
  TEST_ASSERT_EQUAL(WM_END, reader->ops->peek(reader, &frame, &err));
  TEST_ASSERT_EQUAL(WM_END, reader->ops->next(reader, &frame, &err));
  reader->ops->close(reader);
}

// A pair's half without the other one is counted as lost.
TEST(what_is_passed_over_is_counted) {
  wm_frame_source *reader = subscribe(2, 0);
  wm_source_counts counts;
  for (int i = 0; i < 2; i++) TEST_ASSERT_EQUAL(WM_OK, frame_hub_take(hub, &err));
  TEST_ASSERT_EQUAL(WM_OK, reader->ops->skip(reader, &err));
  TEST_ASSERT_EQUAL_INT64(2000, next(reader).t_ns);
  reader->ops->counts(reader, &counts);
  TEST_ASSERT_EQUAL_UINT64(1, counts.lost);
  reader->ops->close(reader);
}

TEST(readers_come_and_go_without_growth) {
  wm_frame_source *stays = subscribe(1, 0);
  size_t before = 0;
  for (int i = 0; i < 1000; i++) {
    wm_frame_source *some[3];
    for (int k = 0; k < 3; k++) some[k] = subscribe(1 + (uint32_t)k, 0);
    if (i % 10 == 0) (void)frame_hub_take(hub, &err);
    if (i % 20 == 0) (void)next(some[1]);
    for (int k = 0; k < 3; k++) some[k]->ops->close(some[k]);
    if (i == 500) before = mallinfo2().uordblks;
  }
  TEST_ASSERT_EQUAL(before, mallinfo2().uordblks);
  stays->ops->close(stays);
}

TEST(no_more_readers_than_there_is_room_for) {
  wm_frame_source *readers[FRAME_HUB_SUBSCRIBERS_MAX], *more;
  const wm_frame_wishes wishes = {.waiting_max = 1};
  for (int i = 0; i < FRAME_HUB_SUBSCRIBERS_MAX; i++) readers[i] = subscribe(1, 0);
  TEST_ASSERT_EQUAL(WM_FULL, frame_hub_subscribe(hub, &wishes, &more, &err));
  for (int i = 0; i < FRAME_HUB_SUBSCRIBERS_MAX; i++) readers[i]->ops->close(readers[i]);
}

static atomic_int go;

static void *take_all(void *argument) {
  (void)argument;
  while (!atomic_load(&go)) {
  }
  while (frame_hub_take(hub, NULL) == WM_OK) {
  }
  return NULL;
}

typedef struct reading {
  wm_frame_source *reader;
  uint64_t frames;
  int is_wrong;
} reading;

static void *read_all(void *argument) {
  reading *self = argument;
  wm_time_ns before_ns = 0;
  for (;;) {
    wm_frame frame;
    wm_status status = self->reader->ops->next(self->reader, &frame, NULL);
    if (status == WM_END) return NULL;
    if (status == WM_AGAIN) continue;
    // Whole, and in order, while others come, go and fall behind.
    const uint8_t level = (uint8_t)(frame.t_ns / 1000 - 1);
    self->is_wrong |= frame.t_ns <= before_ns;
    for (int i = 0; i < W * H; i++) self->is_wrong |= frame.grey[i] != level;
    before_ns = frame.t_ns;
    self->frames++;
  }
}

TEST(threads_of_their_own) {
  reading readings[3] = {{subscribe(1, 50), 0, 0}, {subscribe(4, 50), 0, 0}, {subscribe(16, 50), 0, 0}};
  pthread_t hub_thread, threads[3];
  TEST_ASSERT_EQUAL(0, pthread_create(&hub_thread, NULL, take_all, NULL));
  for (int i = 0; i < 3; i++) TEST_ASSERT_EQUAL(0, pthread_create(&threads[i], NULL, read_all, &readings[i]));
  atomic_store(&go, 1);
  for (int i = 0; i < 50; i++) {
    wm_frame_source *passing = subscribe(2, 0);
    wm_frame frame;
    (void)passing->ops->next(passing, &frame, NULL);
    passing->ops->close(passing);
  }
  (void)pthread_join(hub_thread, NULL);
  for (int i = 0; i < 3; i++) {
    (void)pthread_join(threads[i], NULL);
    TEST_ASSERT_FALSE(readings[i].is_wrong);
    TEST_ASSERT_EQUAL_UINT64(PICTURES, readings[i].frames + overflows(readings[i].reader));
    readings[i].reader->ops->close(readings[i].reader);
  }
}
