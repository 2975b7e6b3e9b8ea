// SPDX-License-Identifier: Apache-2.0
// A run on devices with its real threads and the real clock; the CAN interface behind the socket is the test's.
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "can_device.h"
#include "small_recording.h"
#include "unity.h"
#include "waymark/clock.h"
#include "waymark/eventlog.h"
#include "waymark/robot.h"
#include "waymark/run.h"
#include "waymark/saved_pose.h"

static const char kConfig[] =
    "format: waymark-config/1\nestimator: odometry\npublish: {lcm_url: \"memq://\"}\n"
    "initial_pose: {x_m: 1, y_m: 2, heading_rad: 0}\n"
    "realtime: {priority: 0, lock_memory: false}\nmotion: {model: speed_yaw_rate}\n";
static const char kDbc[] =
    "BO_ 256 Motion: 4 X\n SG_ V : 0|16@1+ (0.001,0) [0|65] \"m/s\" X\n SG_ W : 16|16@1- (0.001,0) [-32|32] \"rad/s\" "
    "X\n";
static const char kSignals[] =
    "- {quantity: vehicle_speed, message: Motion, signal: V}\n- {quantity: yaw_rate, message: Motion, signal: W}\n";

#define FRAME_NS (10 * WM_NS_PER_MS)
#define DOWN_FROM_NS (1000 * WM_NS_PER_MS)
#define DOWN_UNTIL_NS (1800 * WM_NS_PER_MS)

// Drives at 1 m/s, 100 frames a second; the interface is down for a while.
typedef struct bus {
  wm_time_ns begin_ns, next_ns;
  int said_down;
} bus;

static wm_run_report report;
static wm_live_report live;
static char said[4096];

void setUp(void) { said[0] = '\0'; }
void tearDown(void) { test_folder_remove(); }

static int is_down(const bus *self, wm_time_ns now_ns) {
  return now_ns - self->begin_ns >= DOWN_FROM_NS && now_ns - self->begin_ns < DOWN_UNTIL_NS;
}

static void sleep_to(wm_time_ns t_ns) {
  struct timespec until = {t_ns / WM_NS_PER_S, t_ns % WM_NS_PER_S};
  (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
}

static unsigned bus_find(void *context, const char *interface, int *is_up) {
  (void)interface;
  *is_up = !is_down(context, wm_monotonic_ns());
  return 3;
}

static int bus_open(void *context, unsigned index, const uint32_t *ids, const uint8_t *is_extended, size_t count) {
  (void)context, (void)index, (void)ids, (void)is_extended, (void)count;
  return 5;
}

static int bus_receive(void *context, int fd, int wait_ms, can_received *out) {
  (void)fd;
  bus *self = context;
  wm_time_ns now_ns = wm_monotonic_ns();
  if (is_down(self, now_ns)) {
    if (!self->said_down) {
      self->said_down = 1;
      return -ENETDOWN;
    }
    sleep_to(now_ns + wait_ms * WM_NS_PER_MS);
    self->next_ns = wm_monotonic_ns();
    return 0;
  }
  sleep_to(self->next_ns);
  *out = (can_received){.software_ns = self->next_ns + kSocketCan.realtime_ns(NULL) - kSocketCan.monotonic_ns(NULL)};
  out->frame.id = 256;
  out->frame.length = 4;
  out->frame.data[0] = 1000 & 0xff;
  out->frame.data[1] = 1000 >> 8;
  self->next_ns += FRAME_NS;
  return 1;
}

static void bus_close(void *context, int fd) { (void)context, (void)fd; }

// From any of the run's threads.
static void hear(void *context, const char *line) {
  (void)context;
  static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
  pthread_mutex_lock(&lock);
  size_t used = strlen(said);
  (void)snprintf(said + used, sizeof said - used, "%s\n", line);
  pthread_mutex_unlock(&lock);
}

static wm_recording *robot_on(bus *can, const wm_config *config) {
  wm_error err;
  wm_dbc *dbc;
  wm_can_decoder *decoder;
  wm_recording *robot;
  wm_source *source;
  static can_io io;
  io = kSocketCan;
  io.find = bus_find;
  io.open = bus_open;
  io.receive = bus_receive;
  io.close = bus_close;
  wm_can_binding bindings[2] = {{.quantity = WM_Q_VEHICLE_SPEED, .signal = {"V"}},
                                {.quantity = WM_Q_YAW_RATE, .signal = {"W"}}};
  for (int i = 0; i < 2; i++) {
    bindings[i].scale = 1;
    bindings[i].signal_count = 1;
    (void)snprintf(bindings[i].message, sizeof bindings[i].message, "Motion");
  }
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_dbc_parse(kDbc, strlen(kDbc), "car.dbc", &dbc, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_can_decoder_make(dbc, bindings, 2, &decoder, &err), err.text);
  wm_dbc_free(dbc);
  TEST_ASSERT_EQUAL(WM_OK, wm_recording_open_robot("robot", &config->overrides, NULL, NULL, &robot, &err));
  TEST_ASSERT_EQUAL(WM_OK, can_device_make("can0", decoder, &io, can, &source, &err));
  TEST_ASSERT_EQUAL(WM_OK,
                    wm_recording_add_device(robot, source, 1u << WM_Q_VEHICLE_SPEED | 1u << WM_Q_YAW_RATE, &err));
  can->begin_ns = can->next_ns = wm_monotonic_ns();
  return robot;
}

static void a_run_on_can_survives_an_interface_that_goes_down(void) {
  wm_error err = {0};
  wm_config config;
  bus can = {0};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(kConfig, strlen(kConfig), "test.yaml", &config, &err), err.text);
  wm_recording *robot = robot_on(&can, &config);
  const wm_run_options options = {.out_dir = in_folder("run"), .seed = 1, .speed = 1, .duration_s = 3, .say = hear};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_run_live(&config, robot, &options, &live, &err), err.text);
  wm_recording_close(robot);
  wm_config_free(&config);

  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, "can: can0 went down"), said);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, "can: can0 is up"), said);
  const wm_source_health *health = &live.run.health.sources[0];
  TEST_ASSERT_EQUAL_STRING("can", health->name);
  TEST_ASSERT_EQUAL(WM_DEVICE_WORKS, health->device);
  TEST_ASSERT_GREATER_THAN_UINT64(100, health->fused);
  TEST_ASSERT_EQUAL_UINT64(0, health->dropped + health->future);
  TEST_ASSERT_LESS_THAN_UINT64(health->received / 4, health->late);  // of a thread that was held up for 150 ms
  TEST_ASSERT_GREATER_THAN_UINT64(40, live.run.health.published);    // 50 a second, where no thread was held up
}

static void the_log_of_a_run_on_devices_gives_its_poses_again(void) {
  a_run_on_can_survives_an_interface_that_goes_down();
  wm_error err;
  wm_log_reader *log;
  wm_config config;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_log_open(in_folder("run/events.wmlog"), &log, &err), err.text);
  const wm_log_head *head = wm_log_reader_head(log);
  TEST_ASSERT_EQUAL(WM_OK,
                    wm_config_parse_logged(head->config_text, head->config_length, head->config_path, &config, &err));
  const wm_replay_options options = {.out_dir = in_folder("again")};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_replay_log(&config, log, &options, &report, &err), err.text);
  wm_config_free(&config);
  wm_log_reader_close(log);
  assert_same_file("run", "again", "trajectory.csv");
}

// The second run begins where the first one ended, whatever the configuration says.
static void a_run_begins_where_the_last_one_ended(void) {
  wm_error err = {0};
  wm_config config;
  char text[1200];
  double ended_x_m = 0;
  (void)snprintf(text, sizeof text, "%sstart: {saved_pose: %s, save_every_s: 0.1}\n", kConfig, in_folder("pose.yaml"));
  for (int run = 0; run < 2; run++) {
    bus can = {0};
    wm_saved_pose saved;
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(text, strlen(text), "test.yaml", &config, &err), err.text);
    wm_recording *robot = robot_on(&can, &config);
    const wm_run_options options = {.seed = 1, .speed = 1, .duration_s = 0.8, .say = hear};
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_run_live(&config, robot, &options, &live, &err), err.text);
    wm_recording_close(robot);
    wm_config_free(&config);
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_saved_pose_read(in_folder("pose.yaml"), &saved, &err), err.text);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 2, saved.start.p_m[1]);
    TEST_ASSERT_DOUBLE_WITHIN(0.75, ended_x_m + (run ? 0.8 : 1.8), saved.start.p_m[0]);
    ended_x_m = saved.start.p_m[0];
  }
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, "start: where it was"), said);
}

static int reloads;
static wm_status refuse_then_take(void *context, wm_error *err) {
  atomic_int *asked = context;
  if (reloads++ > 0) return WM_OK;
  atomic_store(asked, 1);  // and again
  return wm_fail(err, WM_BAD_CONFIG, "robot.yaml:3: is wrong");
}

// A wrong configuration is told and nothing else; a good one ends the run, which says where it is.
static void another_configuration_is_taken_while_it_drives(void) {
  wm_error err = {0};
  wm_config config;
  wm_start start;
  bus can = {0};
  atomic_int asked = 0;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(kConfig, strlen(kConfig), "test.yaml", &config, &err), err.text);
  wm_recording *robot = robot_on(&can, &config);
  wm_run_options options = {.seed = 1, .speed = 1, .duration_s = 0.6, .say = hear};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_run_live(&config, robot, &options, &live, &err), err.text);
  TEST_ASSERT_TRUE(live.has_last && !live.wants_restart);
  wm_start_from_estimate(&live.last, 0.5, &start);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, live.last.pose_map_base.p_m[0], start.p_m[0]);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.45, start.sigma_xy_m);  // half a second at 1 m/s
  wm_recording_close(robot);

  robot = robot_on(&can, &config);
  options = (wm_run_options){.seed = 1, .speed = 1, .duration_s = 30, .say = hear, .start = &start};
  atomic_store(&asked, 1);
  options.reload_asked = &asked;
  options.reload = refuse_then_take;
  options.reload_context = &asked;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_run_live(&config, robot, &options, &live, &err), err.text);
  TEST_ASSERT_EQUAL(2, reloads);
  TEST_ASSERT_TRUE(live.wants_restart);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, "robot.yaml:3: is wrong. The run goes on as it was"), said);
  wm_recording_close(robot);
  wm_config_free(&config);
}

// An interface that isn't there, by the configuration and the real kernel.
static void a_run_without_its_interface_waits_and_says_so(void) {
  wm_error err = {0};
  wm_config config;
  wm_recording *robot;
  char path[600], text[900];
  FILE *f = fopen(in_folder("car.dbc"), "w");
  TEST_ASSERT_NOT_NULL(f);
  (void)fputs(kDbc, f);
  (void)fclose(f);
  f = fopen(in_folder("signals.yaml"), "w");
  TEST_ASSERT_NOT_NULL(f);
  (void)fputs(kSignals, f);
  (void)fclose(f);
  (void)snprintf(path, sizeof path, "%s", in_folder("robot.yaml"));
  (void)snprintf(text, sizeof text,
                 "%sdevices: {can: [{interface: nocan7, dbc: car.dbc, can_signals: signals.yaml}]}\n", kConfig);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(text, strlen(text), path, &config, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_robot_open(&config, NULL, NULL, &robot, &err), err.text);
  const wm_run_options options = {.seed = 1, .speed = 1, .duration_s = 0.5, .say = hear};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_run_live(&config, robot, &options, &live, &err), err.text);
  wm_recording_close(robot);
  wm_config_free(&config);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, "nocan7 is not there"), said);
  TEST_ASSERT_EQUAL(WM_DEVICE_ABSENT, live.run.health.sources[0].device);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(the_log_of_a_run_on_devices_gives_its_poses_again);
  RUN_TEST(a_run_begins_where_the_last_one_ended);
  RUN_TEST(another_configuration_is_taken_while_it_drives);
  RUN_TEST(a_run_without_its_interface_waits_and_says_so);
  return UNITY_END();
}
