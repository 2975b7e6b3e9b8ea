// SPDX-License-Identifier: Apache-2.0
// The publish thread: LCM (memq: published and received in one process) and systemd's protocol.
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "common/suite.h"
#include "live/lcm_commands.h"
#include "live/lcm_sightings.h"
#include "live/lcm_sink.h"
#include "live/notify.h"
#include "log_fixture.h"
#include "rt/clock.h"
#include "waymark_bound_t.h"
#include "waymark_health_t.h"
#include "waymark_innovation_t.h"
#include "waymark_landmarks_t.h"
#include "waymark_observations_t.h"
#include "waymark_pose_t.h"
#include "waymark_reset_t.h"

// ── LCM ─────────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_config config;
static wm_assembly assembly;
static lcm_sink sink;
static waymark_pose_t pose;
static waymark_observations_t observations;
static waymark_landmarks_t landmarks;
static int poses, bounds, innovations, healths, observed, maps;

static void received(const lcm_recv_buf_t *b, const char *channel, void *user) {
  (void)user;
  int n = (int)b->data_size;
  static waymark_innovation_t innovation;
  static waymark_health_t health;
  if (strcmp(channel, "TEST_POSE") == 0) poses += waymark_pose_t_decode(b->data, 0, n, &pose) == n;
  static waymark_bound_t bound;
  if (strcmp(channel, "TEST_POSE_BOUND") == 0) bounds += waymark_bound_t_decode(b->data, 0, n, &bound) == n;
  if (strcmp(channel, "TEST_INNOVATION") == 0)
    innovations += waymark_innovation_t_decode(b->data, 0, n, &innovation) == n;
  if (strcmp(channel, "TEST_HEALTH") == 0) healths += waymark_health_t_decode(b->data, 0, n, &health) == n;
  if (strcmp(channel, "TEST_OBSERVATIONS") == 0)
    observed += waymark_observations_t_decode(b->data, 0, n, &observations) == n;
  if (strcmp(channel, "TEST_LANDMARKS") == 0) maps += waymark_landmarks_t_decode(b->data, 0, n, &landmarks) == n;
}

static char said[1000];
static int lines;
static void say(void *context, const char *line) {
  (void)context;
  (void)snprintf(said, sizeof said, "%s", line);
  lines++;
}

TEST(messages_arrive_over_memq) {
  fixture_assembly(&config, &assembly);
  lcm_t *lcm = lcm_create("memq://");
  TEST_ASSERT_NOT_NULL(lcm);
  lcm_subscribe(lcm, "TEST_.*", received, NULL);
  lcm_sink_open(&sink, 1, "memq://", "TEST_", &assembly, say, NULL, lcm);

  wm_published p = {.made_ns = 12};
  p.now.t_ns = 11;
  lcm_sink_bound(&sink, &(wm_bound){.t_ns = 11});
  lcm_sink_pose(&sink, &p, 13);
  wm_innovation i = {.t_ns = 3};
  lcm_sink_innovation(&sink, &i);
  static wm_health h;
  lcm_sink_health(&sink, &h);
  lcm_sink_landmarks(&sink, 5);
  for (uint32_t k = 1; k < 8; k += 2) {  // four sightings, the last at another stamp
    wm_event e = fixture_event(k);
    e.t_ns = k < 7 ? 100 : 200;
    lcm_sink_event(&sink, &e);
  }
  wm_event motion = fixture_event(0);
  lcm_sink_event(&sink, &motion);
  while (lcm_handle_timeout(lcm, 10) > 0) {
  }
  TEST_ASSERT_EQUAL(1, poses);
  TEST_ASSERT_EQUAL(1, bounds);
  TEST_ASSERT_EQUAL_INT64(11, pose.t_ns);
  TEST_ASSERT_EQUAL(1, innovations);
  TEST_ASSERT_EQUAL(1, healths);
  TEST_ASSERT_EQUAL(1, maps);
  TEST_ASSERT_EQUAL(3, landmarks.total);
  TEST_ASSERT_EQUAL(2, observed);  // three at 100, one at 200
  TEST_ASSERT_EQUAL(1, observations.count);
  TEST_ASSERT_EQUAL_STRING("left", (const char *)observations.sensor);
  TEST_ASSERT_EQUAL_UINT64(7, sink.sent);
  lcm_sink_close(&sink);
  lcm_destroy(lcm);
}

TEST(no_way_out_is_said_once_and_tried_again) {
  fixture_assembly(&config, &assembly);
  lines = 0;
  lcm_sink_open(&sink, 1, "udpm://0.0.0.300:7667", "TEST_", &assembly, say, NULL, NULL);
  lcm_sink_close(&sink);  // never opened: nothing to close
  lcm_sink_open(&sink, 1, "nosuchprovider://", "TEST_", &assembly, say, NULL, NULL);
  for (wm_time_ns t = 0; t < 10 * WM_NS_PER_S; t += 500 * WM_NS_PER_MS) lcm_sink_tick(&sink, t);
  TEST_ASSERT_EQUAL(1, lines);
  TEST_ASSERT_NOT_NULL(strstr(said, "Localization continues"));
  wm_published p = {.made_ns = 1};
  lcm_sink_pose(&sink, &p, 13);
  TEST_ASSERT_EQUAL_UINT64(1, sink.not_sent);
  TEST_ASSERT_EQUAL(1, lines);
  lcm_sink_close(&sink);
}

// ── systemd ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static int manager;
static char heard[256];

static const char *hear(void) {
  ssize_t n = recv(manager, heard, sizeof heard - 1, MSG_DONTWAIT);
  heard[n > 0 ? n : 0] = '\0';
  return heard;
}

static void open_manager(notify *n, const char *watchdog_usec) {
  struct sockaddr_un address = {.sun_family = AF_UNIX};
  int length = snprintf(address.sun_path + 1, sizeof address.sun_path - 1, "waymark-test-%d", (int)getpid());
  manager = socket(AF_UNIX, SOCK_DGRAM, 0);
  TEST_ASSERT_EQUAL(0, bind(manager, (struct sockaddr *)&address,
                            (socklen_t)(offsetof(struct sockaddr_un, sun_path) + 1 + (size_t)length)));
  char name[64];
  (void)snprintf(name, sizeof name, "@%s", address.sun_path + 1);
  setenv("NOTIFY_SOCKET", name, 1);
  setenv("WATCHDOG_USEC", watchdog_usec, 1);
  unsetenv("WATCHDOG_PID");
  notify_open(n);
}

static void close_manager(notify *n) {
  notify_close(n);
  (void)close(manager);
  unsetenv("NOTIFY_SOCKET");
  unsetenv("WATCHDOG_USEC");
}

TEST(the_watchdog_is_fed_while_the_estimators_loops_advance) {
  notify n;
  open_manager(&n, "2000000");
  TEST_ASSERT_GREATER_OR_EQUAL(0, n.socket);
  wm_time_ns now = n.opened_ns;
  notify_tick(&n, now);
  TEST_ASSERT_EQUAL_STRING("", hear());
  notify_alive(&n, 200);
  notify_tick(&n, now += WM_NS_PER_S);
  TEST_ASSERT_EQUAL_STRING("WATCHDOG=1", hear());
  notify_alive(&n, 200);  // the loop stands still
  notify_tick(&n, now += 2 * WM_NS_PER_S);
  TEST_ASSERT_EQUAL_STRING("", hear());
  notify_alive(&n, 400);
  notify_tick(&n, now += WM_NS_PER_S);
  TEST_ASSERT_EQUAL_STRING("WATCHDOG=1", hear());
  notify_alive(&n, 600);
  notify_tick(&n, now + WM_NS_PER_S / 2);  // not yet due
  TEST_ASSERT_EQUAL_STRING("", hear());
  notify_stopping(&n);
  TEST_ASSERT_EQUAL_STRING("STOPPING=1", hear());
  close_manager(&n);
}

TEST(the_first_pose_makes_ready_and_a_change_of_status_is_sent_once) {
  notify n;
  open_manager(&n, "2000000");
  notify_status(&n, "tracking");
  TEST_ASSERT_EQUAL_STRING("STATUS=tracking", hear());
  notify_status(&n, "tracking");
  TEST_ASSERT_EQUAL_STRING("", hear());
  notify_pose(&n);
  TEST_ASSERT_EQUAL_STRING("READY=1", hear());
  notify_pose(&n);
  TEST_ASSERT_EQUAL_STRING("", hear());
  notify_status(&n, "dead_reckoning; silent: can");
  TEST_ASSERT_EQUAL_STRING("STATUS=dead_reckoning; silent: can", hear());
  close_manager(&n);
}

TEST(ready_comes_without_a_pose_after_ten_seconds) {
  notify n;
  open_manager(&n, "junk");
  TEST_ASSERT_EQUAL_INT64(0, n.feed_every_ns);
  notify_tick(&n, n.opened_ns + 11 * WM_NS_PER_S);
  TEST_ASSERT_EQUAL_STRING("READY=1", hear());
  close_manager(&n);
}

TEST(without_a_service_manager_nothing_happens) {
  notify n;
  unsetenv("NOTIFY_SOCKET");
  notify_open(&n);
  TEST_ASSERT_EQUAL(-1, n.socket);
  notify_pose(&n);
  notify_tick(&n, n.opened_ns + WM_NS_PER_S);
  notify_close(&n);
  setenv("NOTIFY_SOCKET", "not/absolute", 1);
  notify_open(&n);
  TEST_ASSERT_EQUAL(-1, n.socket);
  unsetenv("NOTIFY_SOCKET");
}

// ── commands ────────────────────────────────────────────────────────────────────────────────────────────────────────

static lcm_t *lcm;
static wm_source *source;
static wm_event event;
static wm_error err;
static uint8_t bytes[4096];

static void close_source(void) {
  source->ops->close(source);
  lcm_destroy(lcm);
}

static void open_commands(void) {
  lcm = lcm_create("memq://");
  TEST_ASSERT_EQUAL(WM_OK, lcm_commands_open("memq://", "T_", NULL, lcm, &source, &err));
}

static void publish(const char *channel, size_t length) { lcm_publish(lcm, channel, bytes, (unsigned)length); }

static void expect_refusal(const char *why) {
  TEST_ASSERT_EQUAL(WM_AGAIN, source->ops->next(source, &event, &err));
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(source->counts.first_problem, why), source->counts.first_problem);
}

TEST(poses_and_resets_that_are_told_become_events) {
  wm_set_pose there = {.pose_map_base = {{1, -2, 0}, {0, 0, 0, 1}}, .sigma_xy_m = 0.5, .sigma_heading_rad = 0.1};
  open_commands();
  TEST_ASSERT_TRUE(source->is_live && source->event_driven);
  wm_time_ns before_ns = wm_monotonic_ns();
  publish("T_SET_POSE", wm_lcm_set_pose(&there, 0, bytes, sizeof bytes));
  TEST_ASSERT_EQUAL(WM_OK, source->ops->next(source, &event, &err));
  TEST_ASSERT_EQUAL(WM_EVENT_SET_POSE, event.kind);
  TEST_ASSERT_GREATER_OR_EQUAL_INT64(before_ns, event.t_ns);
  TEST_ASSERT_LESS_OR_EQUAL_INT64(wm_monotonic_ns(), event.t_ns);
  TEST_ASSERT_EQUAL_INT64(event.t_ns, event.arrival_ns);
  TEST_ASSERT_EQUAL_DOUBLE(-2, event.as.set_pose.pose_map_base.p_m[1]);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, event.as.set_pose.sigma_xy_m);

  waymark_reset_t reset = {.t_ns = before_ns};
  publish("T_RESET", (size_t)waymark_reset_t_encode(bytes, 0, sizeof bytes, &reset));
  TEST_ASSERT_EQUAL(WM_OK, source->ops->next(source, &event, &err));
  TEST_ASSERT_EQUAL(WM_EVENT_RESET, event.kind);
  TEST_ASSERT_EQUAL_INT64(before_ns, event.t_ns);
  TEST_ASSERT_EQUAL_UINT32(1, event.seq);
  close_source();
}

TEST(a_floor_that_is_told_by_its_name_becomes_an_event) {
  static wm_floors floors = {.floor_count = 2, .floors = {{.name = "ground"}, {.name = "first"}}};
  lcm = lcm_create("memq://");
  TEST_ASSERT_EQUAL(WM_OK, lcm_commands_open("memq://", "T_", &floors, lcm, &source, &err));
  TEST_ASSERT_TRUE(source->kinds & WM_EVENT_BIT(WM_EVENT_SET_FLOOR));
  publish("T_SET_FLOOR", wm_lcm_set_floor("first", 0, bytes, sizeof bytes));
  TEST_ASSERT_EQUAL(WM_OK, source->ops->next(source, &event, &err));
  TEST_ASSERT_EQUAL(WM_EVENT_SET_FLOOR, event.kind);
  TEST_ASSERT_EQUAL(1, event.as.set_floor.floor);
  publish("T_SET_FLOOR", wm_lcm_set_floor("attic", 0, bytes, sizeof bytes));
  expect_refusal("T_SET_FLOOR: is of a floor that site.yaml does not have");
  close_source();
  open_commands();
  publish("T_SET_FLOOR", wm_lcm_set_floor("first", 0, bytes, sizeof bytes));
  expect_refusal("T_SET_FLOOR: sets a floor; the configuration has no `site`");
  close_source();
}

TEST(nonsense_that_is_told_is_refused) {
  const wm_set_pose wrong[] = {
      {.pose_map_base = {{NAN, 0, 0}, {0, 0, 0, 1}}, .sigma_xy_m = 1, .sigma_heading_rad = 1},
      {.pose_map_base = {{1, 0, 0}, {0, 0, 0, 0}}, .sigma_xy_m = 1, .sigma_heading_rad = 1},
      {.pose_map_base = {{1, 0, 0}, {0, 0, 0, 1}}, .sigma_xy_m = -1, .sigma_heading_rad = 1},
      {.pose_map_base = {{1, 0, 0}, {0, 0, 0, 1}}, .sigma_xy_m = 1, .sigma_heading_rad = NAN},
  };
  open_commands();
  for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
    publish("T_SET_POSE", wm_lcm_set_pose(&wrong[i], 0, bytes, sizeof bytes));
    expect_refusal("");
    TEST_ASSERT_EQUAL_UINT64(i + 1, source->counts.malformed);
  }
  lcm_publish(lcm, "T_SET_POSE", "rubbish", 7);
  expect_refusal("T_SET_POSE: position_m is not finite");
  close_source();
}

TEST(commands_of_another_clock_are_refused) {
  const struct {
    wm_time_ns off_ns;
    const char *why;
  } wrong[] = {{1700000000 * WM_NS_PER_S, "T_SET_POSE: t_ns is 1.7e+09 s ahead of this computer's CLOCK_MONOTONIC"},
               {50 * WM_NS_PER_MS, " s ahead of"},
               {-11 * WM_NS_PER_S, "11 s behind"}};
  const wm_set_pose there = {.pose_map_base = {.q_xyzw = {0, 0, 0, 1}}, .sigma_xy_m = 1, .sigma_heading_rad = 1};
  for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
    open_commands();
    publish("T_SET_POSE", wm_lcm_set_pose(&there, wm_monotonic_ns() + wrong[i].off_ns, bytes, sizeof bytes));
    expect_refusal(wrong[i].why);
    close_source();
  }
}

static const wm_sensor kEyes[] = {{.name = "left"}, {.name = "right"}};

TEST(sightings_of_another_program_become_events) {
  const wm_time_ns t_ns = wm_monotonic_ns();
  wm_event seen[2] = {{.t_ns = t_ns}, {.t_ns = t_ns}};
  seen[0].as.sighting = (wm_sighting){
      .landmark_id = 3, .bearing_rad = 3.5, .range_m = NAN, .elevation_rad = -0.125, .elevation_sigma_rad = 0.01};
  seen[1].as.sighting = (wm_sighting){.landmark_id = -1, .bearing_rad = NAN, .range_m = 4};
  lcm = lcm_create("memq://");
  TEST_ASSERT_EQUAL(WM_OK, lcm_sightings_open("memq://", "T_", kEyes, 2, lcm, &source, &err));
  publish("T_SIGHTINGS", wm_lcm_observations("right", seen, 2, bytes, sizeof bytes));
  for (uint32_t i = 0; i < 2; i++) {
    TEST_ASSERT_EQUAL(WM_OK, source->ops->next(source, &event, &err));
    TEST_ASSERT_EQUAL(WM_EVENT_SIGHTING, event.kind);
    TEST_ASSERT_EQUAL_INT64(t_ns, event.t_ns);
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(t_ns, event.arrival_ns);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(wm_monotonic_ns(), event.arrival_ns);
    TEST_ASSERT_EQUAL_UINT32(i, event.seq);
    TEST_ASSERT_EQUAL_UINT16(1, event.as.sighting.sensor);
    TEST_ASSERT_EQUAL_INT32(seen[i].as.sighting.landmark_id, event.as.sighting.landmark_id);
    if (i == 0) TEST_ASSERT_EQUAL_DOUBLE(3.5 - 2 * M_PI, event.as.sighting.bearing_rad);
    if (i == 1) TEST_ASSERT_EQUAL_DOUBLE(4, event.as.sighting.range_m);
    if (i == 0) TEST_ASSERT_EQUAL_DOUBLE(-0.125, event.as.sighting.elevation_rad);
    TEST_ASSERT_EQUAL(i == 0, wm_sighting_has_elevation(&event.as.sighting));
    TEST_ASSERT_DOUBLE_IS_NAN(event.as.sighting.bearing_sigma_rad);
    TEST_ASSERT_DOUBLE_IS_NAN(event.as.sighting.range_sigma_m);
  }
  TEST_ASSERT_EQUAL(WM_AGAIN, source->ops->next(source, &event, &err));
  TEST_ASSERT_EQUAL_UINT64(2, source->counts.received);
  close_source();
}

TEST(sightings_that_cannot_be_are_refused) {
  const wm_time_ns now_ns = wm_monotonic_ns();
  const struct {
    const char *sensor, *why;
    wm_event event;
  } wrong[] = {
      {"nose", "'nose' is not a sensor", {.t_ns = now_ns, .as.sighting = {.bearing_rad = 1, .range_m = 1}}},
      {"no\033[2J\xff", "'no?[2J?' is not a sensor", {.t_ns = now_ns, .as.sighting = {.range_m = 1}}},
      {"left",
       "3.6e+03 s ahead of this computer's CLOCK_MONOTONIC",
       {.t_ns = now_ns + 3600 * WM_NS_PER_S, .as.sighting = {.range_m = 1}}},
      {"left", "20 s behind", {.t_ns = now_ns - 20 * WM_NS_PER_S, .as.sighting = {.range_m = 1}}},
      {"left", "t_ns is not above 0", {.t_ns = 0, .as.sighting = {.bearing_rad = 1, .range_m = 1}}},
      {"left", "one of bearing_rad and range_m", {.t_ns = now_ns, .as.sighting = {.bearing_rad = NAN, .range_m = NAN}}},
      {"left",
       "bearing_rad has to be within a turn",
       {.t_ns = now_ns, .as.sighting = {.bearing_rad = INFINITY, .range_m = 1}}},
      {"left", "range_m has to be", {.t_ns = now_ns, .as.sighting = {.bearing_rad = 1, .range_m = -1}}},
      {"left",
       "beyond the vertical",
       {.t_ns = now_ns, .as.sighting = {.bearing_rad = 1, .range_m = 1, .elevation_rad = 2, .elevation_sigma_rad = 1}}},
      {"left",
       "elevation_sigma_rad",
       {.t_ns = now_ns,
        .as.sighting = {.bearing_rad = 1, .range_m = 1, .elevation_rad = 1, .elevation_sigma_rad = -1}}},
      {"left", "below -1", {.t_ns = now_ns, .as.sighting = {.landmark_id = -2, .bearing_rad = 1, .range_m = 1}}},
  };
  for (size_t i = 0; i <= sizeof wrong / sizeof wrong[0]; i++) {
    int is_rubbish = i == sizeof wrong / sizeof wrong[0];
    lcm = lcm_create("memq://");
    TEST_ASSERT_EQUAL(WM_OK, lcm_sightings_open("memq://", "T_", kEyes, 2, lcm, &source, &err));
    (void)strcpy((char *)bytes, "rubbish");
    publish("T_SIGHTINGS",
            is_rubbish ? 7 : wm_lcm_observations(wrong[i].sensor, &wrong[i].event, 1, bytes, sizeof bytes));
    expect_refusal(is_rubbish ? "observations_t" : wrong[i].why);
    TEST_ASSERT_EQUAL_UINT64(1, source->counts.malformed);
    close_source();
  }
}
