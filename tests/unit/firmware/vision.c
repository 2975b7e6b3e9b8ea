// SPDX-License-Identifier: Apache-2.0
// Detectors as sources: pictures in, events out, in their order, whoever works ahead; what is asked for and isn't
// there.
#include <dirent.h>
#include <malloc.h>
#include <stdatomic.h>
#include <turbojpeg.h>

#include "common/folder.h"
#include "common/suite.h"
#include "sources/vision.h"

#define W 320
#define H 180
#define FRAMES 12

static const char *dir;
static wm_error err;
static wm_config config;
static wm_recording *recording;
static wm_estimator taker;
static wm_vision *vision;
static wm_arena arena;

static void write_jpeg(const char *name, const uint8_t *pixels) {
  tjhandle handle = tjInitCompress();
  unsigned char *made = NULL;
  unsigned long size = 0;
  TEST_ASSERT_EQUAL(0, tjCompress2(handle, pixels, W, 0, H, TJPF_GRAY, &made, &size, TJSAMP_GRAY, 95, 0));
  folder_write_bytes(name, (const char *)made, size);
  tjFree(made);
  (void)tjDestroy(handle);
}

// A floor that ends in row 90 + i, or nothing at all in every third picture.
static void write_pictures(const char *camera) {
  static uint8_t pixels[W * H];
  char name[64], csv[1024] = "frame,t_ns,exposure_ns,arrival_ns\n", row[80];
  for (int i = 0; i < FRAMES; i++) {
    for (int k = 0; k < W * H; k++) pixels[k] = (uint8_t)(i % 3 == 2 ? 100 + i : k / W < 90 + i ? 60 : 150);
    (void)snprintf(name, sizeof name, "video/%s/%06d.jpg", camera, i);
    write_jpeg(name, pixels);
    (void)snprintf(row, sizeof row, "%d,%d,0,%d\n", i, 100000000 * (i + 1), 100000000 * (i + 1) + 30000000);
    (void)strcat(csv, row);
  }
  (void)snprintf(name, sizeof name, "video/%s.csv", camera);
  folder_write(name, csv);
}

#define CAMERA(name)                                                           \
  "  " name                                                                    \
  ": {model: equidistant, size: [320, 180], intrinsics: [130, 130, 160, 90], " \
  "distortion: [0, 0, 0, 0], mounting: {xyz_m: [0.5, 0, 0.4], rpy_deg: [0, 22, 0]}}\n"

void setUp(void) {
  dir = folder_make();
  folder_write("recording.yaml", "format: waymark-recording/1\n");
  folder_write("motion.csv", "t_ns,v_mps,w_radps\n0,0,0\n");
  folder_write("calibration.yaml", "cameras:\n" CAMERA("front") CAMERA("rear"));
  write_pictures("front");
  write_pictures("rear");
  memset(&config, 0, sizeof config);
  recording = NULL;
  vision = NULL;
  memset(&arena, 0, sizeof arena);
}

void tearDown(void) {
  wm_vision_close(vision);
  wm_recording_close(recording);
  wm_config_free(&config);
  wm_arena_close(&arena);
  folder_remove();
}

static void parse(const char *section, uint32_t takes) {
  char text[512];
  (void)snprintf(text, sizeof text, "format: waymark-config/1\nestimator: odometry\n%s", section);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(text, strlen(text), "test.yaml", &config, &err), err.text);
  taker = *config.estimator;
  taker.takes |= takes;
  config.estimator = &taker;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_recording_open(dir, NULL, NULL, NULL, &recording, &err), err.text);
}

static void open_it(const char *section, uint32_t takes) {
  wm_arena_need needs[WM_VISION_NEEDS];
  parse(section, takes);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_vision_open(&config, recording, NULL, NULL, &vision, &err), err.text);
  size_t count = wm_vision_needs(vision, needs);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_arena_fill(&arena, needs, count, 0, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_vision_start(vision, &err), err.text);
}

// Linked in the place of jpeg_decode (--wrap), which it counts.
// NOLINTBEGIN(bugprone-reserved-identifier)
static atomic_int decodings;
int __real_jpeg_decode(void *, const uint8_t *, size_t, uint32_t, uint32_t, uint8_t *, uint32_t, char *, size_t);
int __wrap_jpeg_decode(void *self, const uint8_t *data, size_t length, uint32_t width_px, uint32_t height_px,
                       uint8_t *grey, uint32_t stride_bytes, char *why, size_t why_bytes);
int __wrap_jpeg_decode(void *self, const uint8_t *data, size_t length, uint32_t width_px, uint32_t height_px,
                       uint8_t *grey, uint32_t stride_bytes, char *why, size_t why_bytes) {
  atomic_fetch_add(&decodings, 1);
  return __real_jpeg_decode(self, data, length, width_px, height_px, grey, stride_bytes, why, why_bytes);
}
// NOLINTEND(bugprone-reserved-identifier)

#define POINTS WM_EVENT_BIT(WM_EVENT_POINTS)
#define LOOKED WM_EVENT_BIT(WM_EVENT_LOOKED)

// All events of the source, one after another, as bytes.
static size_t drain(wm_source *source, uint8_t *out, size_t capacity) {
  static wm_event event;
  size_t used = 0;
  int i = 0;
  while (source->ops->next(source, &event, &err) == WM_OK) {
    TEST_ASSERT_EQUAL_INT64(100000000 * (i + 1), event.t_ns);
    TEST_ASSERT_EQUAL_INT64(event.t_ns + 30000000, event.arrival_ns);
    TEST_ASSERT_EQUAL(i, event.seq);
    TEST_ASSERT_EQUAL(i % 3 == 2 ? WM_EVENT_LOOKED : WM_EVENT_POINTS, event.kind);
    if (event.kind == WM_EVENT_POINTS) TEST_ASSERT_GREATER_THAN(20, event.as.points.count);
    size_t n = wm_event_bytes(&event);
    TEST_ASSERT_LESS_OR_EQUAL(capacity - used, n);
    memcpy(out + used, &event, n);
    used += n;
    i++;
  }
  TEST_ASSERT_EQUAL(FRAMES, i);
  TEST_ASSERT_EQUAL_UINT64(FRAMES, source->counts.received);
  return used;
}

TEST(events_of_pictures) {
  static uint8_t here[FRAMES * sizeof(wm_event)], ahead[FRAMES * sizeof(wm_event)];
  open_it("vision: {edges: {cameras: [front], rays: {range_max_m: 5}}}\n", POINTS | LOOKED);
  TEST_ASSERT_EQUAL(1, wm_vision_count(vision));
  wm_source *source = wm_vision_source(vision, 0);
  TEST_ASSERT_EQUAL_STRING("edges:front", source->name);
  TEST_ASSERT_TRUE(source->in_order);
  TEST_ASSERT_EQUAL_HEX32(POINTS | LOOKED, source->kinds);
  size_t bytes = drain(source, here, sizeof here);
  tearDown();
  setUp();
  open_it("vision: {edges: {cameras: [front], rays: {range_max_m: 5}}}\n", POINTS | LOOKED);
  TEST_ASSERT_EQUAL(WM_OK, wm_vision_start_prefetch(vision, &err));
  TEST_ASSERT_EQUAL(bytes, drain(wm_vision_source(vision, 0), ahead, sizeof ahead));
  TEST_ASSERT_EQUAL_MEMORY(here, ahead, bytes);
}

// GIVEN two detectors on one recorded camera WHEN a replay reads both, in the order of their events THEN each picture
// is decoded once, whether threads work ahead or not.
TEST(two_detectors_on_one_camera_decode_a_picture_once) {
  for (int ahead = 0; ahead < 2; ahead++) {
    static wm_event event[2];
    int counts[2] = {0}, has[2] = {1, 1};
    if (ahead) {
      tearDown();
      setUp();
    }
    open_it("vision: {edges: {cameras: [front]}, apriltag: {family: tag36h11, size_m: 0.2, cameras: [front]}}\n",
            POINTS | LOOKED | WM_EVENT_BIT(WM_EVENT_MARKER));
    TEST_ASSERT_EQUAL(2, wm_vision_count(vision));
    atomic_store(&decodings, 0);
    if (ahead) TEST_ASSERT_EQUAL(WM_OK, wm_vision_start_prefetch(vision, &err));
    for (int i = 0; i < 2; i++) {
      wm_source *source = wm_vision_source(vision, (size_t)i);
      has[i] = source->ops->next(source, &event[i], &err) == WM_OK;
    }
    while (has[0] || has[1]) {
      const int i = !has[0] || (has[1] && event[1].arrival_ns < event[0].arrival_ns);
      wm_source *source = wm_vision_source(vision, (size_t)i);
      counts[i]++;
      has[i] = source->ops->next(source, &event[i], &err) == WM_OK;
    }
    TEST_ASSERT_EQUAL(FRAMES, counts[0]);
    TEST_ASSERT_EQUAL(FRAMES, counts[1]);
    TEST_ASSERT_EQUAL(FRAMES, atomic_load(&decodings));
  }
}

// In a run a recorded picture is looked at when it arrives: detection delays what it finds.
TEST(a_run_looks_at_a_recorded_picture_when_it_arrives) {
  static wm_event event;
  open_it("vision: {edges: {cameras: [front]}}\n", POINTS | LOOKED);
  wm_vision_look_at_arrival(vision);
  wm_source *source = wm_vision_source(vision, 0);
  atomic_store(&decodings, 0);
  for (int i = 0; i < FRAMES; i++) {
    TEST_ASSERT_EQUAL(WM_OK, source->ops->next(source, &event, &err));
    TEST_ASSERT_EQUAL(WM_EVENT_NONE, event.kind);
    TEST_ASSERT_EQUAL_INT64(100000000 * (i + 1) + 30000000, event.arrival_ns);
    TEST_ASSERT_EQUAL(i, atomic_load(&decodings));  // not looked at yet
    TEST_ASSERT_EQUAL(WM_OK, source->ops->next(source, &event, &err));
    TEST_ASSERT_EQUAL_INT64(100000000 * (i + 1), event.t_ns);
    TEST_ASSERT_EQUAL(i + 1, atomic_load(&decodings));
  }
  TEST_ASSERT_EQUAL(WM_END, source->ops->next(source, &event, &err));
  TEST_ASSERT_EQUAL_UINT64(FRAMES, wm_vision_look_ns(vision, 0)->count);
}

TEST(ended_in_the_middle) {
  open_it("vision: {edges: {}}\n", POINTS);
  TEST_ASSERT_EQUAL(2, wm_vision_count(vision));  // both cameras have pictures
  TEST_ASSERT_EQUAL(WM_OK, wm_vision_start_prefetch(vision, &err));
  static wm_event event;
  wm_source *source = wm_vision_source(vision, 1);
  TEST_ASSERT_EQUAL_STRING("edges:rear", source->name);
  for (int i = 0; i < 3; i++) TEST_ASSERT_EQUAL(WM_OK, source->ops->next(source, &event, &err));
  // Nothing is told of a picture with nothing in it to an estimator that doesn't ask for that: 0, 1, 3.
  TEST_ASSERT_EQUAL_INT64(400000000, event.t_ns);
}

TEST(old_pictures_are_passed_over) {
  open_it("vision: {edges: {cameras: [front]}}\n", POINTS);
  static wm_event event;
  wm_source *source = wm_vision_source(vision, 0);
  TEST_ASSERT_EQUAL(WM_OK, source->ops->next(source, &event, &err));
  source->skip_to(source, 535000000);  // the fifth has arrived
  TEST_ASSERT_EQUAL(WM_OK, source->ops->next(source, &event, &err));
  TEST_ASSERT_EQUAL_INT64(500000000, event.t_ns);
  TEST_ASSERT_EQUAL_UINT64(3, source->counts.overflows);
  source->skip_to(source, INT64_MAX);
  TEST_ASSERT_EQUAL(WM_END, source->ops->next(source, &event, &err));  // the last one shows nothing
}

// What a detector would take on the robot, in a replay.
TEST(observations_arrive_after_the_time_that_detection_takes) {
  static wm_event event;
  open_it("vision: {edges: {cameras: [front]}}\nsources: [{name: edges, ready_after_ms: 40}]\n", POINTS);
  wm_source *source = wm_vision_source(vision, 0);
  wm_source_config wanted;
  int rank;
  wm_config_source(&config, source->name, &wanted, &rank);
  TEST_ASSERT_EQUAL_DOUBLE(40, wanted.ready_after_ms);
  source->ready_after_ns = wm_ns_from_seconds(wanted.ready_after_ms * 1e-3);
  TEST_ASSERT_EQUAL(WM_OK, source->ops->next(source, &event, &err));
  TEST_ASSERT_EQUAL_INT64(100000000, event.t_ns);
  TEST_ASSERT_EQUAL_INT64(170000000, event.arrival_ns);
}

TEST(only_for_who_takes_it) {
  parse("vision: {edges: {cameras: [front]}}\n", 0);
  TEST_ASSERT_EQUAL(WM_OK, wm_vision_open(&config, recording, NULL, NULL, &vision, &err));
  TEST_ASSERT_NULL(vision);
  TEST_ASSERT_EQUAL(0, wm_vision_count(vision));
}

static void refused(const char *section, const char *text) {
  wm_recording_close(recording);
  wm_config_free(&config);
  parse(section, POINTS);
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_vision_open(&config, recording, NULL, NULL, &vision, &err));
  TEST_ASSERT_NULL(vision);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, text), err.text);
}

TEST(what_is_not_there) {
  refused("vision: {edges: {cameras: [left]}}\n", "test.yaml:3: vision.edges.cameras: 'left' is not a camera");
  folder_write("calibration.yaml", "cameras:\n" CAMERA("side"));
  refused("vision: {edges: {}}\n", "has no pictures");
  folder_write("calibration.yaml",
               "cameras:\n  front: {model: equidistant, size: [320, 180], intrinsics: [130, 130, 160, 90], "
               "mounting: {xyz_m: [0.5, 0, 0.4], rpy_deg: [0, -80, 0]}}\n");
  refused("vision: {edges: {}}\n", "sees no floor");
}

static size_t open_files(void) {
  size_t count = 0;
  DIR *folder = opendir("/proc/self/fd");
  TEST_ASSERT_NOT_NULL(folder);
  while (readdir(folder)) count++;
  (void)closedir(folder);
  return count;
}

// Bytes that malloc has handed out; 0 under a sanitizer, which finds what is lost by itself.
static size_t heap_bytes(void) { return mallinfo2().uordblks; }

// Detectors and pictures end with what opened them: a robot's configuration may be taken anew for years.
TEST(opened_and_closed_without_growth) {
  size_t files = 0, bytes = 0;
  parse("vision: {apriltag: {family: tag36h11, size_m: 0.2}}\n", WM_EVENT_BIT(WM_EVENT_MARKER));
  for (int i = 0; i < 1000; i++) {
    wm_arena_need needs[WM_VISION_NEEDS];
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_vision_open(&config, recording, NULL, NULL, &vision, &err), err.text);
    TEST_ASSERT_EQUAL(2, wm_vision_count(vision));
    // Tables take long, and lie in memory that is given: some of the rounds make them.
    if (i % 100 == 1) {
      size_t count = wm_vision_needs(vision, needs);
      TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_arena_fill(&arena, needs, count, 0, &err), err.text);
      TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_vision_start(vision, &err), err.text);
    }
    wm_vision_close(vision);
    wm_arena_close(&arena);
    vision = NULL;
    memset(&arena, 0, sizeof arena);
    if (i == 10) {
      files = open_files();
      bytes = heap_bytes();
    }
  }
  TEST_ASSERT_EQUAL(files, open_files());
  TEST_ASSERT_EQUAL(bytes, heap_bytes());
}

static void wrong_text(const char *section, const char *text) {
  char all[512];
  (void)snprintf(all, sizeof all, "format: waymark-config/1\nestimator: odometry\n%s", section);
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_config_parse(all, strlen(all), "test.yaml", &config, &err));
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, text), err.text);
}

TEST(wrong_configurations) {
  wrong_text("vision: {edgs: {}}\n", "did you mean 'vision.edges'");
  wrong_text("vision: {edges: {rays: {range_max: 5}}}\n", "did you mean 'vision.edges.rays.range_max_m'");
  wrong_text("vision: {edges: {cameras: front}}\n", "a list of cameras");
  wrong_text("vision: [edges]\n", "a map of detectors");
  wrong_text("vision: {edges: {rays: {range_max_m: -1}}}\n", "vision.edges.rays.range_max_m");
}
