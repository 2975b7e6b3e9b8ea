// SPDX-License-Identifier: Apache-2.0
// A run on devices with its real threads and the real clock; the CAN interface behind the socket is the test's.
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <time.h>
#include <unistd.h>

#include "can_device.h"
#include "common/folder.h"
#include "common/suite.h"
#include "live/robot.h"
#include "live/run.h"
#include "output/event_log.h"
#include "output/saved_pose.h"
#include "rt/clock.h"
#include "small_recording.h"

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
#define LONGEST_S \
  60  // a run ends when its bus has given all its frames; a busy machine takes longer, and that is no fault

// Drives at 1 m/s, 100 frames a second, stamped as they are given. Where it is asked for, the interface goes down after
// `down_after` frames and comes back when it was looked for twice. What happens depends on frames and looks alone,
// never on how long anything took.
typedef struct bus {
  int frames, down_after;  // down_after -1: never
  int given, went_down, is_down, looks_while_down;
  wm_time_ns first_ns;
} bus;

static wm_run_report report;
static wm_live_report live;
static char said[4096];
static atomic_int over;        // ends the run
static const char *is_enough;  // so does this line, when it is heard

void setUp(void) {
  said[0] = '\0';
  is_enough = NULL;
  atomic_store(&over, 0);
}
void tearDown(void) { folder_remove(); }

static void sleep_for(wm_time_ns duration_ns) {
  struct timespec left = {duration_ns / WM_NS_PER_S, duration_ns % WM_NS_PER_S};
  (void)clock_nanosleep(CLOCK_MONOTONIC, 0, &left, NULL);
}

static unsigned bus_find(void *context, const char *interface, int *is_up) {
  bus *self = context;
  (void)interface;
  if (self->is_down && ++self->looks_while_down == 2) self->is_down = 0;
  *is_up = !self->is_down;
  return 3;
}

static int bus_open(void *context, unsigned index, const wm_can_match *filters, size_t count) {
  (void)context, (void)index, (void)filters, (void)count;
  return 5;
}

static int bus_receive(void *context, int fd, int wait_ms, can_received *out) {
  (void)fd;
  bus *self = context;
  if (self->given == self->down_after && !self->went_down) {
    self->went_down = self->is_down = 1;
    return -ENETDOWN;
  }
  if (self->is_down || self->given == self->frames) {
    sleep_for(wait_ms * WM_NS_PER_MS);
    return 0;
  }
  sleep_for(FRAME_NS);
  *out = (can_received){.software_ns = kSocketCan.realtime_ns(NULL)};
  if (self->given++ == 0) self->first_ns = wm_monotonic_ns();
  out->frame.id = 256;
  out->frame.length = 4;
  out->frame.data[0] = 1000 & 0xff;
  out->frame.data[1] = 1000 >> 8;
  if (self->given == self->frames) atomic_store(&over, 1);
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
  if (is_enough && strstr(line, is_enough)) atomic_store(&over, 1);
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
  wm_site *site;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_site_open(NULL, &config->overrides, NULL, NULL, &site, &err), err.text);
  TEST_ASSERT_EQUAL(WM_OK, wm_recording_of_site("robot", site, &robot, &err));
  TEST_ASSERT_EQUAL(WM_OK, can_device_make("can0", decoder, &io, can, &source, &err));
  TEST_ASSERT_EQUAL(WM_OK,
                    wm_recording_add_device(robot, source, 1u << WM_Q_VEHICLE_SPEED | 1u << WM_Q_YAW_RATE, &err));
  return robot;
}

static void a_run_on_can_survives_an_interface_that_goes_down(void) {
  wm_error err = {0};
  wm_config config;
  bus can = {.frames = 200, .down_after = 100};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(kConfig, strlen(kConfig), "test.yaml", &config, &err), err.text);
  wm_recording *robot = robot_on(&can, &config);
  const wm_run_options options = {
      .out_dir = folder_path("run"), .seed = 1, .speed = 1, .duration_s = LONGEST_S, .stop = &over, .say = hear};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_run_live(&config, robot, &options, &live, &err), err.text);
  wm_recording_close(robot);
  wm_config_free(&config);

  const char *down = strstr(said, "can: can0 went down");
  TEST_ASSERT_NOT_NULL_MESSAGE(down, said);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(down, "can: can0 is up"), said);
  const wm_source_health *health = &live.run.health.sources[0];
  TEST_ASSERT_EQUAL_STRING("can", health->name);
  TEST_ASSERT_EQUAL(WM_DEVICE_WORKS, health->device);
  // Each frame ended in one place, most of them in the pose; a thread that is held up for 150 ms makes some late.
  TEST_ASSERT_EQUAL_UINT64(200, health->received);
  TEST_ASSERT_EQUAL_UINT64(200, health->fused + health->late);
  TEST_ASSERT_GREATER_THAN_UINT64(100, health->fused);
  TEST_ASSERT_GREATER_THAN_UINT64(10, live.run.health.published);
}

TEST(the_log_of_a_run_on_devices_gives_its_poses_again) {
  a_run_on_can_survives_an_interface_that_goes_down();
  replay_log_into("run/events.wmlog", "again", &report);
  assert_same_file("run", "again", "trajectory.csv");
}

// The second run begins where the first one ended, whatever the configuration says, or as far on as it may have driven
// since.
TEST(a_run_begins_where_the_last_one_ended) {
  wm_error err = {0};
  wm_config config;
  char text[1200];
  double ended_x_m = 1;
  wm_time_ns saved_ns = 0;  // at the earliest
  (void)snprintf(text, sizeof text, "%sstart: {saved_pose: %s, save_every_s: 0.1}\n", kConfig,
                 folder_path("pose.yaml"));
  for (int run = 0; run < 2; run++) {
    bus can = {.frames = 60, .down_after = -1};
    wm_saved_pose saved;
    setUp();
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(text, strlen(text), "test.yaml", &config, &err), err.text);
    wm_recording *robot = robot_on(&can, &config);
    const wm_run_options options = {.seed = 1, .speed = 1, .duration_s = LONGEST_S, .stop = &over, .say = hear};
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_run_live(&config, robot, &options, &live, &err), err.text);
    wm_time_ns first_ns = run == 0 ? can.first_ns : saved_ns;
    double longest_m = wm_seconds_between(first_ns, wm_monotonic_ns());
    wm_recording_close(robot);
    wm_config_free(&config);
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_saved_pose_read(folder_path("pose.yaml"), &saved, &err), err.text);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 2, saved.start.p_m[1]);
    TEST_ASSERT_GREATER_THAN_DOUBLE(ended_x_m, saved.start.p_m[0]);
    TEST_ASSERT_LESS_THAN_DOUBLE(ended_x_m + longest_m, saved.start.p_m[0]);
    if (run == 1) {
      double began_x_m = 0;
      const char *start = strstr(said, "start: saved pose of");
      TEST_ASSERT_NOT_NULL_MESSAGE(start, said);
      TEST_ASSERT_EQUAL_MESSAGE(1, sscanf(strchr(start, 'x'), "x %lf", &began_x_m), start);
      TEST_ASSERT_GREATER_THAN_DOUBLE(ended_x_m - 0.0051, began_x_m);  // it is said in centimetres
      TEST_ASSERT_LESS_THAN_DOUBLE(ended_x_m + wm_seconds_between(saved_ns, can.first_ns) + 0.0051, began_x_m);
    }
    ended_x_m = saved.start.p_m[0];
    saved_ns = can.first_ns;
  }
}

static int is_asked(void *context) { return atomic_exchange((atomic_int *)context, 0); }

static int reloads;
static wm_status refuse_then_take(void *context, wm_error *err) {
  atomic_int *asked = context;
  if (reloads++ > 0) return WM_OK;
  atomic_store(asked, 1);  // and again
  return wm_fail(err, WM_BAD_CONFIG, "robot.yaml:3: is wrong");
}

// A wrong configuration is told and nothing else; a good one ends the run, which says where it is.
TEST(another_configuration_is_taken_while_it_drives) {
  wm_error err = {0};
  wm_config config;
  wm_start start;
  bus can = {.frames = 60, .down_after = -1};
  atomic_int asked = 0;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(kConfig, strlen(kConfig), "test.yaml", &config, &err), err.text);
  wm_recording *robot = robot_on(&can, &config);
  wm_run_options options = {.seed = 1, .speed = 1, .duration_s = LONGEST_S, .stop = &over, .say = hear};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_run_live(&config, robot, &options, &live, &err), err.text);
  TEST_ASSERT_TRUE(live.has_last && !live.wants_restart);
  wm_start_from_estimate(&live.last, config.motion, 0.5, &start);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, live.last.pose_map_base.p_m[0], start.p_m[0]);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.45, start.sigma_xy_m);  // half a second at 1 m/s
  wm_recording_close(robot);

  robot = robot_on(&can, &config);
  options = (wm_run_options){.seed = 1, .speed = 1, .duration_s = LONGEST_S, .say = hear, .start = &start};
  atomic_store(&asked, 1);
  options.wants_reload = is_asked;
  options.reload = refuse_then_take;
  options.reload_context = &asked;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_run_live(&config, robot, &options, &live, &err), err.text);
  TEST_ASSERT_EQUAL(2, reloads);
  TEST_ASSERT_TRUE(live.wants_restart);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, "robot.yaml:3: is wrong. The run continues unchanged"), said);
  wm_recording_close(robot);
  wm_config_free(&config);
}

// An interface that isn't there, by the configuration and the real kernel.
TEST(a_run_without_its_interface_waits_and_says_so) {
  wm_error err = {0};
  wm_config config;
  wm_recording *robot;
  char path[600], text[900];
  FILE *f = fopen(folder_path("car.dbc"), "w");
  TEST_ASSERT_NOT_NULL(f);
  (void)fputs(kDbc, f);
  (void)fclose(f);
  f = fopen(folder_path("signals.yaml"), "w");
  TEST_ASSERT_NOT_NULL(f);
  (void)fputs(kSignals, f);
  (void)fclose(f);
  (void)snprintf(path, sizeof path, "%s", folder_path("robot.yaml"));
  (void)snprintf(text, sizeof text,
                 "%sdevices: {can: [{interface: nocan7, dbc: car.dbc, can_signals: signals.yaml}]}\n", kConfig);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(text, strlen(text), path, &config, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_robot_open(&config, NULL, NULL, &robot, &err), err.text);
  is_enough = "nocan7 is not there";
  const wm_run_options options = {.seed = 1, .speed = 1, .duration_s = LONGEST_S, .stop = &over, .say = hear};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_run_live(&config, robot, &options, &live, &err), err.text);
  wm_recording_close(robot);
  wm_config_free(&config);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, is_enough), said);
  TEST_ASSERT_EQUAL(WM_DEVICE_ABSENT, live.run.health.sources[0].device);
}
