// SPDX-License-Identifier: Apache-2.0
// Pictures for viewers. Without a request nothing is copied. Readers get a detector's result. A reader that stops
// reading blocks neither the detector nor another reader.
#include <errno.h>
#include <pthread.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "common/suite.h"
#include "live/picture_server.h"
#include "rt/clock.h"
#include "sources/onlooker.h"
#include "sources/picture_socket.h"
#include "waymark/codec.h"

#define WIDTH 640u
#define HEIGHT 400u
#define SOURCES 2

// ── two detectors in the place of a run's ───────────────────────────────────────────────────────────────────────────

static onlooker shown[SOURCES];
static wm_source sources[SOURCES];
static const wm_camera cameras[SOURCES] = {{.name = "front", .width_px = WIDTH, .height_px = HEIGHT},
                                           {.name = "rear", .width_px = WIDTH, .height_px = HEIGHT}};

size_t wm_vision_count(const wm_vision *self) { return self ? SOURCES : 0; }
wm_source *wm_vision_source(wm_vision *self, size_t i) {
  (void)self;
  return &sources[i];
}
onlooker *wm_vision_onlooker(wm_vision *self, size_t i, const wm_camera **camera) {
  (void)self;
  *camera = &cameras[i];
  return &shown[i];
}

static wm_config config;
static picture_server *server;
static wm_error err;

static void *a_vision(void) { return &sources; }

void setUp(void) {
  for (int i = 0; i < SOURCES; i++) onlooker_open(&shown[i]);
  (void)snprintf(sources[0].name, sizeof sources[0].name, "edges:front");
  (void)snprintf(sources[1].name, sizeof sources[1].name, "apriltag:rear");
  (void)snprintf(config.picture_socket, sizeof config.picture_socket, "/tmp/waymark-pictures-%d", (int)getpid());
  TEST_ASSERT_EQUAL(WM_OK, picture_server_start(&config, a_vision(), &server, &err));
}

void tearDown(void) {
  picture_server_close(server);
  for (int i = 0; i < SOURCES; i++) onlooker_close(&shown[i]);
}

static uint8_t pixels[WIDTH * HEIGHT];

// A detector looks at a picture of this grey, in which it found a point at (grey, 1).
static void look(int source, uint8_t grey) {
  wm_event event = {.kind = WM_EVENT_POINTS, .t_ns = grey};
  event.as.points.count = 1;
  event.as.points.x_m[0] = grey;
  event.as.points.y_m[0] = 1;
  memset(pixels, grey, sizeof pixels);
  const wm_frame frame = {.grey = pixels, .width_px = WIDTH, .height_px = HEIGHT, .stride_bytes = WIDTH, .t_ns = grey};
  onlooker_show(&shown[source], &frame, &event, 1);
}

static int new_reader(void) {
  struct sockaddr_un at = {.sun_family = AF_UNIX};
  (void)snprintf(at.sun_path, sizeof at.sun_path, "%s", config.picture_socket);
  int reader = socket(AF_UNIX, SOCK_STREAM, 0);
  const struct timeval patience = {.tv_sec = 20};
  (void)setsockopt(reader, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  TEST_ASSERT_EQUAL_MESSAGE(0, connect(reader, (const struct sockaddr *)&at, sizeof at), strerror(errno));
  return reader;
}

static void ask(int reader, uint32_t source) {
  const wm_picture_request request = {.magic = WM_PICTURE_MAGIC, .source = source};
  TEST_ASSERT_EQUAL(sizeof request, send(reader, &request, sizeof request, MSG_NOSIGNAL));
}

static void read_whole(int reader, void *out, size_t bytes) {
  if (bytes > 0) TEST_ASSERT_EQUAL(bytes, recv(reader, out, bytes, MSG_WAITALL));
}

static uint8_t body[WIDTH * HEIGHT + WM_PICTURE_EVENTS_MAX];

static wm_picture_head read_picture(int reader) {
  wm_picture_head head;
  read_whole(reader, &head, sizeof head);
  TEST_ASSERT_LESS_OR_EQUAL(sizeof body, wm_picture_body_bytes(&head));
  read_whole(reader, body, wm_picture_body_bytes(&head));
  return head;
}

static int is_filled(int source) {
  (void)pthread_mutex_lock(&shown[source].lock);
  const int is = shown[source].is_filled;
  (void)pthread_mutex_unlock(&shown[source].lock);
  return is;
}

// Until the server has it: who asks later gets another one.
static void look_until_it_is_taken(int source, uint8_t grey) {
  for (uint64_t before = shown[source].copied; shown[source].copied == before;) {
    look(source, grey);
    (void)usleep(1000);
  }
  while (is_filled(source)) (void)usleep(1000);
}

static int has_memory(int source) {
  (void)pthread_mutex_lock(&shown[source].lock);
  const int has = shown[source].message != NULL;
  (void)pthread_mutex_unlock(&shown[source].lock);
  return has;
}

TEST(nothing_is_copied_while_nobody_asks) {
  for (int i = 0; i < 100; i++) look(0, 1);
  int reader = new_reader();  // that alone is no question
  (void)usleep(50000);
  for (int i = 0; i < 100; i++) look(0, 1);
  TEST_ASSERT_EQUAL(0, shown[0].copied);
  TEST_ASSERT_FALSE(has_memory(0));
  (void)close(reader);
}

TEST(a_reader_gets_a_picture_with_what_was_found) {
  int reader = new_reader();
  ask(reader, 0);
  look_until_it_is_taken(0, 77);
  const wm_picture_head head = read_picture(reader);
  TEST_ASSERT_EQUAL_STRING("edges:front", head.source_name);
  TEST_ASSERT_EQUAL_STRING("front", head.camera);
  TEST_ASSERT_EQUAL(SOURCES, head.source_count);
  TEST_ASSERT_EQUAL(1, head.event_count);
  TEST_ASSERT_EQUAL_INT64(77, head.t_ns);
  wm_event event;
  size_t used;
  TEST_ASSERT_EQUAL(WM_OK, wm_event_decode(body, head.event_bytes, &event, &used));
  TEST_ASSERT_EQUAL(head.event_bytes, used);
  TEST_ASSERT_EQUAL_FLOAT(77, event.as.points.x_m[0]);
  TEST_ASSERT_EACH_EQUAL_UINT8(77, body + head.event_bytes, WIDTH * HEIGHT);
  // One question, one picture.
  for (int i = 0; i < 100; i++) look(0, 78);
  TEST_ASSERT_EQUAL(1, shown[0].copied);
  (void)close(reader);
  // It went: the memory goes, too.
  for (int i = 0; i < 1000 && has_memory(0); i++) (void)usleep(10000);
  TEST_ASSERT_FALSE(has_memory(0));
}

TEST(pictures_come_twice_a_second_at_most) {
  int reader = new_reader();
  wm_time_ns begin_ns = wm_monotonic_ns();
  for (int i = 0; i < 3; i++) {
    ask(reader, 0);
    look_until_it_is_taken(0, (uint8_t)i);
    (void)read_picture(reader);
  }
  TEST_ASSERT_GREATER_OR_EQUAL_INT64(WM_NS_PER_S, wm_monotonic_ns() - begin_ns);
  (void)close(reader);
}

TEST(one_that_does_not_read_holds_nobody_up) {
  int stuck = new_reader(), other = new_reader();
  const int small = 4096;  // no room for a picture
  (void)setsockopt(stuck, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
  ask(stuck, 0);
  look_until_it_is_taken(0, 1);
  for (int i = 2; i < 5; i++) {
    ask(other, 0);
    look_until_it_is_taken(0, (uint8_t)i);
    TEST_ASSERT_EQUAL_INT64(i, read_picture(other).t_ns);
  }
  // It reads at last, and hears what it missed.
  TEST_ASSERT_EQUAL_INT64(1, read_picture(stuck).t_ns);
  ask(stuck, 0);
  look_until_it_is_taken(0, 9);
  const wm_picture_head head = read_picture(stuck);
  TEST_ASSERT_EQUAL_INT64(9, head.t_ns);
  TEST_ASSERT_GREATER_THAN(0, head.missed);
  (void)close(stuck);
  (void)close(other);
}

TEST(strangers_are_sent_away) {
  int stranger = new_reader(), reader = new_reader();
  char rest[8];
  TEST_ASSERT_EQUAL(16, send(stranger, "GET / HTTP/1.1\r\n", 16, MSG_NOSIGNAL));
  TEST_ASSERT_EQUAL(0, recv(stranger, rest, sizeof rest, 0));
  ask(reader, 99);  // there is no such source
  const wm_picture_head head = read_picture(reader);
  TEST_ASSERT_EQUAL(0, head.width_px);
  TEST_ASSERT_EQUAL(SOURCES, head.source_count);
  int more[8];
  for (int i = 0; i < 8; i++) more[i] = new_reader();  // more than there is room for
  ask(reader, 1);
  look_until_it_is_taken(1, 5);
  TEST_ASSERT_EQUAL_STRING("apriltag:rear", read_picture(reader).source_name);
  for (int i = 0; i < 8; i++) (void)close(more[i]);
  (void)close(stranger);
  (void)close(reader);
}

TEST(the_socket_is_for_owner_and_group) {
  struct stat what;
  TEST_ASSERT_EQUAL(0, stat(config.picture_socket, &what));
  TEST_ASSERT_EQUAL(0660, what.st_mode & 0777);
  picture_server *second;
  TEST_ASSERT_EQUAL(WM_IO, picture_server_start(&config, a_vision(), &second, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "another run"));
  picture_server_close(server);
  TEST_ASSERT_NOT_EQUAL(0, stat(config.picture_socket, &what));
  // One that was killed leaves its socket behind.
  struct sockaddr_un at = {.sun_family = AF_UNIX};
  (void)snprintf(at.sun_path, sizeof at.sun_path, "%s", config.picture_socket);
  int dead = socket(AF_UNIX, SOCK_STREAM, 0);
  TEST_ASSERT_EQUAL(0, bind(dead, (const struct sockaddr *)&at, sizeof at));
  (void)close(dead);
  TEST_ASSERT_EQUAL(WM_OK, picture_server_start(&config, a_vision(), &server, &err));
  (void)close(new_reader());
  // A file of another kind is not removed.
  picture_server_close(server);
  FILE *file = fopen(config.picture_socket, "w");
  TEST_ASSERT_NOT_NULL(file);
  (void)fclose(file);
  TEST_ASSERT_EQUAL(WM_IO, picture_server_start(&config, a_vision(), &server, &err));
  TEST_ASSERT_EQUAL(0, stat(config.picture_socket, &what));
  (void)unlink(config.picture_socket);
  TEST_ASSERT_EQUAL(WM_OK, picture_server_start(&config, a_vision(), &server, &err));
}
