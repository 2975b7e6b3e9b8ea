// SPDX-License-Identifier: Apache-2.0
// Videos of a recording: what is there becomes frames with their stamps, what isn't right is counted.
#include <unistd.h>

#include "common/folder.h"
#include "common/suite.h"
#include "video_files.h"
#include "waymark/video.h"

#define W 64
#define H 48

static wm_video *video;
static wm_error err;
static bytes file;
static uint8_t jpeg[65536];
static const char *dir;
static wm_camera camera;

void setUp(void) {
  dir = folder_make();
  camera = (wm_camera){.name = "front", .width_px = W, .height_px = H};
  video = NULL;
  file.size = 0;
}

void tearDown(void) {
  wm_video_close(video);
  folder_remove();
}

static void rows(const char *text) { folder_write("video/front.csv", text); }

static void numbered_rows(int count) {
  char text[4096] = "frame,t_ns,exposure_ns,arrival_ns\n", row[80];
  for (int i = 0; i < count; i++) {
    (void)snprintf(row, sizeof row, "%d,%d00000000,5000000,%d30000000\n", i, i + 1, i + 1);
    strcat(text, row);
  }
  rows(text);
}

static void save(const char *name) { folder_write_bytes(name, (const char *)file.data, file.size); }

static void add_to(const char *chunk, int level) {
  const size_t size = make_jpeg(W, H, level, jpeg, sizeof jpeg);
  avi_chunk(&file, chunk, jpeg, size);
}
static void add_jpeg(int level) { add_to("00dc", level); }

static void open_it(void) {
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_video_open(dir, &camera, 3, NULL, NULL, &video, &err), err.text);
}

static void open_video(const char *name, int count) {
  save(name);
  numbered_rows(count);
  open_it();
}

// The next frame; its left half has this level.
static wm_frame expect_frame(uint64_t number, int level) {
  wm_frame frame;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_video_next(video, &frame, &err), wm_video_counted(video)->first_problem);
  TEST_ASSERT_EQUAL_UINT64(number, frame.number);
  TEST_ASSERT_EQUAL(W, frame.width_px);
  TEST_ASSERT_EQUAL(H, frame.height_px);
  TEST_ASSERT_INT_WITHIN(4, level, frame.grey[5 * frame.stride_bytes + 5]);
  TEST_ASSERT_INT_WITHIN(4, 255 - level, frame.grey[5 * frame.stride_bytes + W - 5]);
  return frame;
}

static void expect_end(void) {
  wm_frame frame;
  TEST_ASSERT_EQUAL(WM_END, wm_video_next(video, &frame, &err));
  TEST_ASSERT_EQUAL(WM_END, wm_video_next(video, &frame, &err));
  TEST_ASSERT_EQUAL(WM_END, wm_video_peek(video, &frame, &err));
}

TEST(avi_of_jpegs) {
  avi_head(&file, "MJPG", W, H, 1);
  avi_chunk(&file, "00wb", "sound", 5);
  add_to("01dc", 20);
  bytes_put(&file, "LIST\0\0\0\0rec ", 12);
  add_to("01dc", 60);
  bytes_put(&file, "RIFF\0\0\0\0AVIXLIST\0\0\0\0movi", 24);
  add_to("01dc", 90);
  avi_chunk(&file, "idx1", "whatever", 8);
  save("video/front.avi");
  numbered_rows(3);
  TEST_ASSERT_TRUE(wm_video_there(dir, "front"));
  TEST_ASSERT_FALSE(wm_video_there(dir, "rear"));
  open_it();
  wm_frame head;
  TEST_ASSERT_EQUAL(WM_OK, wm_video_peek(video, &head, &err));
  TEST_ASSERT_NULL(head.grey);
  TEST_ASSERT_EQUAL_INT64(100000000, head.t_ns);
  wm_frame frame = expect_frame(0, 20);
  TEST_ASSERT_EQUAL_INT64(100000000, frame.t_ns);
  TEST_ASSERT_EQUAL_INT64(130000000, frame.arrival_ns);
  TEST_ASSERT_EQUAL_INT64(5000000, frame.exposure_ns);
  TEST_ASSERT_EQUAL(3, frame.camera);
  TEST_ASSERT_EQUAL(WM_OK, wm_video_skip(video, &err));
  expect_frame(2, 90);
  expect_end();
  TEST_ASSERT_EQUAL_UINT64(2, wm_video_counted(video)->frames);
  TEST_ASSERT_EQUAL_UINT64(1, wm_video_counted(video)->skipped);
  TEST_ASSERT_EQUAL_STRING("", wm_video_counted(video)->first_problem);
}

TEST(matroska) {
  mkv_head(&file, "V_MJPEG", W, H);
  for (int i = 0; i < 3; i++) {
    size_t size = make_jpeg(W, H, 30 * i, jpeg, sizeof jpeg);
    mkv_block(&file, 1, "sound", 5);
    mkv_block(&file, 2, jpeg, size);
    if (i == 1) mkv_block(&file, 2, jpeg, 0);
  }
  open_video("video/front.mkv", 3);
  for (int i = 0; i < 3; i++) expect_frame((uint64_t)i, 30 * i);
  expect_end();
  TEST_ASSERT_EQUAL_UINT64(1, wm_video_counted(video)->empty);
}

TEST(uncompressed) {
  uint8_t pixels[W * H];
  avi_head(&file, "Y800", W, H, 0);
  for (int i = 0; i < 2; i++) {
    for (int y = 0; y < H; y++)
      for (int x = 0; x < W; x++) pixels[y * W + x] = (uint8_t)(x < W / 2 ? 40 + i : 215 - i);
    avi_chunk(&file, "00db", pixels, sizeof pixels);
  }
  avi_chunk(&file, "00db", pixels, sizeof pixels - 1);
  save("video/front.avi");
  numbered_rows(3);
  camera.width_px = camera.height_px = 0;  // the container says it
  open_it();
  expect_frame(0, 40);
  expect_frame(1, 41);
  expect_end();
  TEST_ASSERT_EQUAL_UINT64(1, wm_video_counted(video)->wrong_size);
}

TEST(a_folder_of_files) {
  for (int i = 0; i < 4; i++) {
    char name[64];
    size_t size = make_jpeg(W, H, 10 * i, jpeg, sizeof jpeg);
    (void)snprintf(name, sizeof name, "video/front/%06d.jpg", i);
    if (i != 2) folder_write_bytes(name, (const char *)jpeg, size);
  }
  numbered_rows(4);
  camera.width_px = camera.height_px = 0;  // the first picture says it
  open_it();
  wm_frame first;
  TEST_ASSERT_EQUAL(WM_OK, wm_video_peek(video, &first, NULL));
  TEST_ASSERT_EQUAL(W, first.width_px);
  expect_frame(0, 0);
  expect_frame(1, 10);
  expect_frame(3, 30);
  expect_end();
  TEST_ASSERT_EQUAL_UINT64(1, wm_video_counted(video)->without_picture);
}

TEST(colour_is_its_luma) {
  avi_head(&file, "MJPG", W, H, 0);
  size_t size = make_colour_jpeg(W, H, jpeg, sizeof jpeg);
  avi_chunk(&file, "00dc", jpeg, size);
  open_video("video/front.avi", 1);
  wm_frame frame;
  TEST_ASSERT_EQUAL(WM_OK, wm_video_next(video, &frame, &err));
  TEST_ASSERT_INT_WITHIN(3, 95, frame.grey[100]);  // 0.299 * 200 + 0.701 * 50
}

TEST(what_is_not_right_is_counted) {
  avi_head(&file, "MJPG", W, H, 0);
  add_jpeg(10);                                     // 0
  avi_chunk(&file, "00dc", "", 0);                  // no picture
  add_jpeg(10);                                     // 1: the same again
  avi_chunk(&file, "00dc", "this is no JPEG", 15);  // 2
  size_t size = make_jpeg(W, H, 77, jpeg, sizeof jpeg);
  avi_chunk(&file, "00dc", jpeg, size / 2);  // 3: cut
  size = make_jpeg(2 * W, H, 77, jpeg, sizeof jpeg);
  avi_chunk(&file, "00dc", jpeg, size);  // 4: too wide
  add_jpeg(50);                          // 5
  add_jpeg(60);                          // 6: no row
  add_jpeg(70);                          // 7
  add_jpeg(80);                          // 8: at the stamp of 7
  add_jpeg(90);                          // 9: no row
  save("video/front.avi");
  rows("frame,t_ns,exposure_ns\n0,100,\n1,200,\n2,300,\n3,400,\n4,500,\nx,1,\n5,1000,\n4,1050,\n7,1100,\n8,1100,\n");
  open_it();
  expect_frame(0, 10);
  expect_frame(5, 50);
  expect_frame(7, 70);
  expect_end();
  const wm_video_counts *c = wm_video_counted(video);
  TEST_ASSERT_EQUAL_UINT64(3, c->frames);
  TEST_ASSERT_EQUAL_UINT64(1, c->empty);
  TEST_ASSERT_EQUAL_UINT64(2, c->duplicated);
  TEST_ASSERT_EQUAL_UINT64(2, c->damaged);
  TEST_ASSERT_EQUAL_UINT64(1, c->wrong_size);
  TEST_ASSERT_EQUAL_UINT64(2, c->malformed);
  TEST_ASSERT_EQUAL_UINT64(2, c->without_stamp);
  TEST_ASSERT_EQUAL_UINT64(4, c->lost);  // 500 to 1000 at a period of 100
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(c->first_problem, "frame 1 is the one before"), c->first_problem);
}

TEST(a_row_of_a_wrong_number_or_stamp_costs_itself) {
  avi_head(&file, "MJPG", W, H, 0);
  for (int i = 0; i < 11; i++) add_jpeg(10 * i + 10);
  save("video/front.avi");
  char text[512] = "frame,t_ns,exposure_ns\n", row[64];
  for (int i = 0; i < 11; i++) {
    (void)snprintf(row, sizeof row, "%d,%d,\n", i == 5 ? 99999 : i, (i == 8 ? 1 : i + 1) * 100000000 + (i == 8));
    strcat(text, row);
  }
  rows(text);
  open_it();
  for (int i = 0; i < 11; i++)
    if (i != 5) expect_frame((uint64_t)i, 10 * i + 10);
  expect_end();
  const wm_video_counts *c = wm_video_counted(video);
  TEST_ASSERT_EQUAL_UINT64(1, c->malformed);
  TEST_ASSERT_EQUAL_UINT64(1, c->without_stamp);
  TEST_ASSERT_EQUAL_UINT64(1, c->out_of_order);
  TEST_ASSERT_EQUAL_UINT64(2, c->lost);  // those two
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(c->first_problem, "front.csv:7: frame: 99999 before 6; the row is skipped"),
                               c->first_problem);
}

TEST(a_damaged_container_ends_the_pictures) {
  avi_head(&file, "MJPG", W, H, 0);
  add_jpeg(10);
  bytes_put(&file, "\0\1\2\3\4\5\6\7\10", 9);
  add_jpeg(20);
  open_video("video/front.avi", 2);
  expect_frame(0, 10);
  expect_end();
  TEST_ASSERT_EQUAL_UINT64(1, wm_video_counted(video)->damaged);
  TEST_ASSERT_EQUAL_UINT64(1, wm_video_counted(video)->without_picture);
  TEST_ASSERT_NOT_NULL(strstr(wm_video_counted(video)->first_problem, "the file is damaged"));
}

TEST(cut_files_end_where_they_end) {
  for (int is_mkv = 0; is_mkv < 2; is_mkv++) {
    if (is_mkv) {
      mkv_head(&file, "V_MJPEG", W, H);
    } else {
      avi_head(&file, "MJPG", W, H, 0);
    }
    size_t head = file.size;
    for (int i = 0; i < 2; i++) {
      size_t size = make_jpeg(W, H, 10 + i, jpeg, sizeof jpeg);
      if (is_mkv) {
        mkv_block(&file, 2, jpeg, size);
      } else {
        avi_chunk(&file, "00dc", jpeg, size);
      }
    }
    numbered_rows(2);
    const char *name = is_mkv ? "video/front.mkv" : "video/front.avi";
    for (size_t n = 0; n < file.size; n += 7) {
      folder_write_bytes(name, (const char *)file.data, n);
      wm_status status = wm_video_open(dir, &camera, 0, NULL, NULL, &video, &err);
      TEST_ASSERT_TRUE(status == WM_OK || (n < head && err.text[0]));
      wm_frame frame;
      uint64_t frames = 0;
      while (status == WM_OK && wm_video_next(video, &frame, &err) == WM_OK) frames++;
      if (status == WM_OK) {
        const wm_video_counts *c = wm_video_counted(video);
        TEST_ASSERT_LESS_THAN(2, frames);
        TEST_ASSERT_TRUE(frames + c->without_picture + c->damaged >= 2);
      }
      wm_video_close(video);
      video = NULL;
    }
    (void)unlink(folder_path(name));
  }
}

#define SHARED 40
// GIVEN two readers of one video WHEN one is ahead, far ahead (beyond what is kept), or skips THEN each has the pixels
// and counts that it has alone.
TEST(readers_share_what_is_decoded) {
  wm_video *other;
  wm_frame frame;
  avi_head(&file, "MJPG", W, H, 0);
  for (int i = 0; i < SHARED; i++) {
    if (i == 7) {
      avi_chunk(&file, "00dc", "this is no JPEG", 15);
    } else {
      add_jpeg(2 * i);
    }
  }
  open_video("video/front.avi", SHARED);
  TEST_ASSERT_EQUAL(WM_OK, wm_video_open(dir, &camera, 3, NULL, NULL, &other, &err));
  TEST_ASSERT_EQUAL(WM_OK, wm_video_share(other, video, &err));
  for (int i = 0; i < 30; i++)
    if (i != 7) expect_frame((uint64_t)i, 2 * i);
  for (int i = 0; i < SHARED; i++) {
    if (i == 7) continue;
    if (i == 20) {
      TEST_ASSERT_EQUAL(WM_OK, wm_video_skip(other, &err));
      continue;
    }
    TEST_ASSERT_EQUAL(WM_OK, wm_video_next(other, &frame, &err));
    TEST_ASSERT_EQUAL_UINT64(i, frame.number);
    TEST_ASSERT_INT_WITHIN(4, 2 * i, frame.grey[5 * frame.stride_bytes + 5]);
    if (i >= 30) {
      const uint8_t *held = frame.grey;
      expect_frame((uint64_t)i, 2 * i);
      TEST_ASSERT_INT_WITHIN(4, 2 * i, held[5 * frame.stride_bytes + 5]);
    }
  }
  expect_end();
  TEST_ASSERT_EQUAL(WM_END, wm_video_next(other, &frame, &err));
  TEST_ASSERT_EQUAL_UINT64(SHARED - 1, wm_video_counted(video)->frames);
  TEST_ASSERT_EQUAL_UINT64(SHARED - 2, wm_video_counted(other)->frames);
  TEST_ASSERT_EQUAL_UINT64(1, wm_video_counted(other)->skipped);
  TEST_ASSERT_EQUAL_UINT64(1, wm_video_counted(video)->damaged);
  TEST_ASSERT_EQUAL_UINT64(1, wm_video_counted(other)->damaged);
  TEST_ASSERT_EQUAL_STRING(wm_video_counted(video)->first_problem, wm_video_counted(other)->first_problem);
  wm_video_close(video);  // whoever opened it first
  video = other;
}

static void refused(wm_status status, const char *text) {
  TEST_ASSERT_EQUAL_MESSAGE(status, wm_video_open(dir, &camera, 0, NULL, NULL, &video, &err), err.text);
  TEST_ASSERT_NULL(video);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, text), err.text);
}

TEST(what_is_refused) {
  refused(WM_NOT_FOUND, "no pictures of the camera 'front'");
  folder_write("video/front.mp4", "....ftypisom....");
  refused(WM_UNSUPPORTED, "waymark import");
  avi_head(&file, "H264", W, H, 0);
  save("video/front.avi");
  refused(WM_UNSUPPORTED, "'H264'");
  mkv_head(&file, "V_MPEG4/ISO/AVC", W, H);
  save("video/front.avi");  // by its bytes, not by its name
  refused(WM_UNSUPPORTED, "V_MPEG4/ISO/AVC");
  avi_head(&file, "MJPG", W, H, 0);
  add_jpeg(1);
  save("video/front.avi");
  refused(WM_NOT_FOUND, "it holds the stamp of each picture");
  rows("frame,exposure_ns\n");
  refused(WM_BAD_CONFIG, "t_ns");
  folder_write("video/front.avi", "RIFF");
  refused(WM_BAD_DATA, "not a video");
}
