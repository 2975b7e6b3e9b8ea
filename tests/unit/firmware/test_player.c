// SPDX-License-Identifier: Apache-2.0
// The player keeps the times: 2000 CAN frames a second and two cameras at 30 Hz, nothing lost, each datum in its order.
#include <errno.h>
#include <unistd.h>

#include "../drivers/video_files.h"
#include "cli/play/player.h"
#include "common/folder.h"
#include "common/suite.h"
#include "rt/clock.h"

#define FRAMES_HZ 2000
#define PICTURES_HZ 30
#define SECONDS 3
#define W 320
#define H 200

static const char *dir;
static bytes file;
static uint8_t jpeg[1 << 17];
static player self;
static wm_faults faults;
static wm_error err;

// Takes all items, and checks what it can see of them.
typedef struct counting_sink {
  play_sink base;
  uint64_t taken, out_of_order, edges;
  uint32_t next;
  int fails;
} counting_sink;
static counting_sink sink[WM_PLAY_STREAMS_MAX];

static int take(play_sink *base, wm_play_item *item, wm_time_ns stamp_ns) {
  counting_sink *s = (counting_sink *)base;
  (void)stamp_ns;
  s->taken++;
  s->out_of_order += item->number != s->next;
  s->next = item->number + 1;
  return s->fails ? -ENOBUFS : 0;
}

static int edge(play_sink *base, const wm_fault *fault, int begins) {
  (void)fault, (void)begins;
  ((counting_sink *)base)->edges++;
  return 0;
}

static void keep(play_sink *base) { (void)base; }
static const play_sink_ops kCounting = {take, edge, NULL, keep};

static void write_recording(void) {
  char name[64], row[96];
  char *text = calloc(1, 1 << 20);
  size_t used = 0;
  folder_write("recording.yaml", "format: waymark-recording/1\n");
  for (int i = 0; i < FRAMES_HZ * SECONDS; i++)
    used += (size_t)sprintf(text + used, "(%d.%06d) can0 1A0#%08X\n", 5 + i / FRAMES_HZ,
                            i % FRAMES_HZ * (1000000 / FRAMES_HZ), i);
  folder_write("can.log", text);
  for (int c = 0; c < 2; c++) {
    file.size = 0;
    avi_head(&file, "MJPG", W, H, 0);
    used = (size_t)sprintf(text, "frame,t_ns\n");
    for (int i = 0; i < PICTURES_HZ * SECONDS; i++) {
      const size_t size = make_jpeg(W, H, i, jpeg, sizeof jpeg);
      avi_chunk(&file, "00dc", jpeg, size);
      (void)sprintf(row, "%d,%lld\n", i, 5000000000LL + i * (1000000000LL / PICTURES_HZ));
      used += (size_t)sprintf(text + used, "%s", row);
    }
    (void)sprintf(name, "video/cam%d.csv", c);
    folder_write(name, text);
    (void)sprintf(name, "video/cam%d.avi", c);
    folder_write_bytes(name, (const char *)file.data, file.size);
  }
  free(text);
}

void setUp(void) {
  dir = folder_make();
  write_recording();
  memset(&self, 0, sizeof self);
  memset(sink, 0, sizeof sink);
}

void tearDown(void) {
  wm_play_close(self.play);
  wm_faults_free(&faults);
  folder_remove();
}

static void start(double speed) {
  const wm_play_options options = {.faults = &faults};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_play_open(dir, &options, &self.play, &err), err.text);
  size_t count;
  (void)wm_play_streams(self.play, &count);
  TEST_ASSERT_EQUAL(3, count);
  for (size_t i = 0; i < count; i++) {
    sink[i].base.ops = &kCounting;
    self.sink[i] = &sink[i].base;
  }
  self.faults = &faults;
  self.speed = speed;
  self.begin_ns = wm_monotonic_ns() + 200 * WM_NS_PER_MS;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, player_start(&self, &err), err.text);
}

TEST(nothing_is_lost_and_the_times_are_kept) {
  start(1);
  TEST_ASSERT_EQUAL(WM_OK, player_join(&self, &err));
  const double took_s = wm_seconds_between(self.begin_ns, wm_monotonic_ns());
  const int can = wm_play_find(self.play, "can:can0"),
            cameras[] = {wm_play_find(self.play, "camera:cam0"), wm_play_find(self.play, "camera:cam1")};
  TEST_ASSERT_EQUAL_UINT64(FRAMES_HZ * SECONDS, sink[can].taken);
  TEST_ASSERT_EQUAL_UINT64(FRAMES_HZ * SECONDS, self.counts[can].sent);
  TEST_ASSERT_EQUAL_UINT64(0, sink[can].out_of_order);
  for (int i = 0; i < 2; i++) {
    TEST_ASSERT_EQUAL_UINT64(PICTURES_HZ * SECONDS, sink[cameras[i]].taken);
    TEST_ASSERT_EQUAL_UINT64(0, sink[cameras[i]].out_of_order);
  }
  TEST_ASSERT_GREATER_THAN_DOUBLE(SECONDS - 0.01, took_s);
  TEST_ASSERT_LESS_THAN_DOUBLE(SECONDS + 2, took_s);
  for (int i = 0; i < 3; i++)
    (void)printf("%s: p50 %.1f us, p99 %.1f us, largest %.1f us late\n", i == 0 ? "can" : "camera",
                 (double)wm_histogram_quantile(&self.counts[i].late, 0.5) * 1e-3,
                 (double)wm_histogram_quantile(&self.counts[i].late, 0.99) * 1e-3,
                 (double)self.counts[i].late.max_ns * 1e-3);
  // A busy desk wakes threads late; half of them are in time everywhere.
  TEST_ASSERT_LESS_THAN_DOUBLE(20 * WM_NS_PER_MS, wm_histogram_quantile(&self.counts[can].late, 0.5));
}

TEST(a_stop_ends_it_soon_and_failures_are_counted) {
  sink[0].fails = 1;
  start(1);
  while (atomic_load(&self.at_ns) < 300 * WM_NS_PER_MS) (void)usleep(1000);
  atomic_store(&self.stop, 1);
  const wm_time_ns asked_ns = wm_monotonic_ns();
  TEST_ASSERT_EQUAL(WM_OK, player_join(&self, &err));
  TEST_ASSERT_LESS_THAN_DOUBLE(1, wm_seconds_between(asked_ns, wm_monotonic_ns()));
  TEST_ASSERT_TRUE(sink[0].taken > 500 && sink[0].taken < FRAMES_HZ * SECONDS);
  TEST_ASSERT_EQUAL_UINT64(sink[0].taken, self.counts[0].failed);
  TEST_ASSERT_EQUAL(ENOBUFS, self.counts[0].first_failure);
}

TEST(faults_go_to_the_sinks_of_their_streams) {
  static const char kText[] =
      "format: waymark-faults/1\nfaults:\n- {name: a, fault: camera_unplugged, camera: cam1, from_s: 1, until_s: 2}\n"
      "- {name: b, fault: process_killed, from_s: 1}\n";
  TEST_ASSERT_EQUAL(WM_OK, wm_faults_parse(kText, strlen(kText), "f.yaml", &faults, &err));
  start(10);
  TEST_ASSERT_EQUAL(WM_OK, player_join(&self, &err));
  TEST_ASSERT_EQUAL_UINT64(0, sink[wm_play_find(self.play, "camera:cam0")].edges);
  TEST_ASSERT_EQUAL_UINT64(2, sink[wm_play_find(self.play, "camera:cam1")].edges);
  TEST_ASSERT_EQUAL(FAULT_DONE, self.progress[0]);
  TEST_ASSERT_EQUAL_UINT64(PICTURES_HZ * (SECONDS - 1), self.counts[wm_play_find(self.play, "camera:cam1")].sent);
  TEST_ASSERT_EQUAL_INT64(self.begin_ns + 100 * WM_NS_PER_MS, player_monotonic_ns(&self, WM_NS_PER_S));
}
