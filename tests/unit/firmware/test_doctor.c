// SPDX-License-Identifier: Apache-2.0
// The doctor's findings on a computer that the test breaks.
#include <sys/timex.h>

#include "cli/doctor/doctor.h"
#include "common/folder.h"
#include "common/suite.h"

static const char *root;
static wm_findings found;

void setUp(void) {
  memset(&found, 0, sizeof found);
  root = folder_make();
}
void tearDown(void) { folder_remove(); }

static void put(const char *path, const char *text) { folder_write(path + 1, text); }

static const wm_finding *about(const char *what) {
  for (size_t i = 0; i < found.count; i++)
    if (strcmp(found.at[i].about, what) == 0) return &found.at[i];
  TEST_FAIL_MESSAGE(what);
  return NULL;
}

static wm_finding_id id_of(const char *what) {
  static const struct {
    const char *begins;
    wm_finding_id id;
  } kIds[] = {{"kernel", WM_FOUND_COMPUTER_REALTIME},
              {"throttling", WM_FOUND_COMPUTER_REALTIME},
              {"interrupts", WM_FOUND_COMPUTER_REALTIME},
              {"latency", WM_FOUND_COMPUTER_REALTIME},
              {"clock", WM_FOUND_COMPUTER_CLOCK},
              {"ptp", WM_FOUND_COMPUTER_CLOCK},
              {"governor", WM_FOUND_COMPUTER_SLOW},
              {"temperature", WM_FOUND_COMPUTER_SLOW},
              {"memory l", WM_FOUND_COMPUTER_MEMORY},
              {"processor quota", WM_FOUND_COMPUTER_REALTIME},
              {"can ", WM_FOUND_CAN_INTERFACE},
              {"camera ", WM_FOUND_CAMERA_DEVICE},
              {"lcm", WM_FOUND_LCM_ROUTE}};
  for (size_t i = 0; i < sizeof kIds / sizeof kIds[0]; i++)
    if (strncmp(what, kIds[i].begins, strlen(kIds[i].begins)) == 0) return kIds[i].id;
  TEST_FAIL_MESSAGE(what);
  return WM_FOUND_COUNT;
}

// Everything that isn't good says what to do.
static void expect(const char *what, wm_severity level, const char *text) {
  const wm_finding *f = about(what);
  TEST_ASSERT_EQUAL_MESSAGE(level, f->severity, f->text);
  TEST_ASSERT_EQUAL_MESSAGE(id_of(what), f->id, f->text);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(f->text, text), f->text);
  TEST_ASSERT_EQUAL_MESSAGE(level == WM_SEVERITY_GOOD, f->fix[0] == '\0', f->fix);
}

TEST(clocks_of_ptp) {
  struct timex state = {0};
  (void)adjtimex(&state);
  put("/sys/class/ptp/ptp0/clock_name", "igb\n");
  put("/sys/class/ptp/ptp3/clock_name", "mlx5_p2p\n");
  doctor_clocks(root, &found);
  const wm_severity level = state.tai ? WM_SEVERITY_GOOD : WM_SEVERITY_NOTE;
  expect("ptp", level, "/dev/ptp0 (igb), /dev/ptp3 (mlx5_p2p)");
  expect("ptp", level, state.tai ? "s ahead of UTC" : "does not know by how much TAI is ahead of UTC");
}

TEST(limits_of_the_control_group_and_of_those_around_it) {
  put("/proc/self/cgroup", "0::/robot/waymark.service\n");
  put("/sys/fs/cgroup/robot/waymark.service/cpu.max", "max 100000\n");
  put("/sys/fs/cgroup/robot/waymark.service/memory.max", "64000000\n");
  put("/sys/fs/cgroup/robot/memory.max", "max\n");
  doctor_group(root, &found);
  TEST_ASSERT_EQUAL_size_t(1, found.count);
  expect("memory limit", WM_SEVERITY_NOTE, "may have 64 MB");
  put("/sys/fs/cgroup/robot/cpu.max", "20000 100000\n");
  put("/sys/fs/cgroup/memory.max", "20000000\n");  // a container's own root
  memset(&found, 0, sizeof found);
  doctor_group(root, &found);
  expect("processor quota", WM_SEVERITY_BAD, "0.2 CPUs");
  expect("memory limit", WM_SEVERITY_NOTE, "may have 20 MB");
}

TEST(a_good_computer_is_found_good) {
  put("/sys/kernel/realtime", "1\n");
  put("/proc/sys/kernel/sched_rt_runtime_us", "950000\n");
  put("/sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n");
  put("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n");
  put("/sys/class/thermal/thermal_zone0/temp", "45000\n");
  doctor_kernel(root, &found);
  doctor_group(root, &found);
  doctor_clocks(root, &found);
  doctor_power(root, &found);
  expect("kernel", WM_SEVERITY_GOOD, "PREEMPT_RT");
  expect("throttling", WM_SEVERITY_GOOD, "95 %");
  expect("clock", WM_SEVERITY_GOOD, "tsc");
  expect("governor", WM_SEVERITY_GOOD, "performance");
  expect("temperature", WM_SEVERITY_GOOD, "45 degrees");
}

TEST(what_is_broken_is_found) {
  put("/proc/sys/kernel/sched_rt_runtime_us", "-1\n");
  put("/sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet\n");
  put("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n");
  put("/sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave\n");
  put("/sys/class/thermal/thermal_zone0/temp", "45000\n");
  put("/sys/class/thermal/thermal_zone1/temp", "91000\n");
  doctor_kernel(root, &found);
  doctor_clocks(root, &found);
  doctor_power(root, &found);
  expect("kernel", WM_SEVERITY_NOTE, "is not PREEMPT_RT");
  expect("throttling", WM_SEVERITY_NOTE, "is off");
  expect("clock", WM_SEVERITY_BAD, "hpet");
  expect("governor", WM_SEVERITY_BAD, "1 of 2 CPUs have the governor powersave");
  expect("temperature", WM_SEVERITY_BAD, "91 degrees");
}

TEST(can_interfaces_are_looked_at) {
  static wm_config config;
  const char *const names[] = {"can0", "can1", "can2", "eth0"};
  for (size_t i = 0; i < 4; i++)
    (void)snprintf(config.devices.can[i].interface, sizeof config.devices.can[i].interface, "%s", names[i]);
  config.devices.can_count = 4;
  put("/sys/class/net/can0/type", "280\n");
  put("/sys/class/net/can0/flags", "0x40c1\n");
  put("/sys/class/net/can0/statistics/rx_over_errors", "7\n");
  put("/sys/class/net/can1/type", "280\n");
  put("/sys/class/net/can1/flags", "0x40c0\n");
  put("/sys/class/net/eth0/type", "1\n");
  doctor_can(root, &config, &found);
  expect("can can0", WM_SEVERITY_BAD, "lost 7 frames");
  expect("can can1", WM_SEVERITY_BAD, "is down");
  expect("can can2", WM_SEVERITY_BAD, "no interface");
  expect("can eth0", WM_SEVERITY_BAD, "is not a CAN interface");
}

TEST(interrupts_below_the_estimator_are_found) {
  static wm_config config;
  config.devices.can_count = 1;
  (void)snprintf(config.devices.can[0].interface, sizeof config.devices.can[0].interface, "can0");
  put("/proc/1/comm", "init\n");
  put("/proc/77/comm", "irq/23-can0\n");
  put("/proc/77/stat",
      "77 (irq/23-can0) S 2 0 0 0 -1 2129984 0 0 0 0 0 5 0 0 -51 0 1 0 400 0 0 18446744073709551615 0 0 0 0 "
      "0 0 0 2147483647 0 0 0 0 17 0 50 1 0 0 0 0 0 0 0 0 0 0 0\n");
  config.runtime.realtime_priority = 80;
  doctor_interrupts(root, &config, 1, &found);
  expect("interrupts", WM_SEVERITY_BAD, "irq/23-can0 at priority 50 is not above the estimator (80)");
  memset(&found, 0, sizeof found);
  doctor_interrupts(root, &config, 4, &found);
  expect("interrupts", WM_SEVERITY_NOTE, "where both are on one processor");
  memset(&found, 0, sizeof found);
  config.runtime.realtime_priority = 40;
  doctor_interrupts(root, &config, 1, &found);
  expect("interrupts", WM_SEVERITY_GOOD, "is above");
}

TEST(cameras_are_looked_at) {
  static wm_config config;
  config.devices.camera_count = 2;
  (void)snprintf(config.devices.cameras[0].name, WM_NAME_MAX, "front");
  (void)snprintf(config.devices.cameras[0].device, sizeof config.devices.cameras[0].device, "/dev/nosuchvideo");
  (void)snprintf(config.devices.cameras[1].name, WM_NAME_MAX, "rear");
  (void)snprintf(config.devices.cameras[1].device, sizeof config.devices.cameras[1].device, "/dev/null");
  doctor_cameras(&config, &found);
  expect("camera front", WM_SEVERITY_BAD, "No such file");
  expect("camera rear", WM_SEVERITY_GOOD, "/dev/null is present");
}

TEST(no_way_for_messages_is_found) {
  doctor_lcm("udpm://239.255.76.67:7667?ttl=1", &found);
  const wm_finding *f = about("lcm");
  TEST_ASSERT_EQUAL(WM_FOUND_LCM_ROUTE, f->id);
  TEST_ASSERT_TRUE(f->severity == WM_SEVERITY_NOTE ||
                   f->severity == WM_SEVERITY_BAD);  // without a network it is the latter
  TEST_ASSERT_TRUE(f->fix[0] != '\0');
}

TEST(latency_is_measured) {
  static wm_histogram wake_ns;
  int is_realtime;
  doctor_latency(0.2, 0, &wake_ns, &is_realtime);
  TEST_ASSERT_FALSE(is_realtime);
  TEST_ASSERT_GREATER_THAN_UINT64(20, wake_ns.count);
  TEST_ASSERT_GREATER_THAN_INT64(0, wake_ns.max_ns);
  doctor_judge_latency(&wake_ns, 0, &found);
  TEST_ASSERT_NOT_NULL(strstr(about("latency")->text, "a normal thread wakes late by"));
  memset(&wake_ns, 0, sizeof wake_ns);
  memset(&found, 0, sizeof found);
  wm_histogram_add(&wake_ns, 20 * WM_NS_PER_MS);
  doctor_judge_latency(&wake_ns, 1, &found);
  expect("latency", WM_SEVERITY_BAD, "a real-time thread");
}

TEST(a_short_can_queue_is_found) {
  doctor_can_queue(1 << 20, 212992, &found);
  expect("can queue", WM_SEVERITY_NOTE, "holds 139 ms of a full bus (208 kB of the 1024 that are asked for)");
  TEST_ASSERT_NOT_NULL(strstr(about("can queue")->fix, "net.core.rmem_max=1048576"));
  memset(&found, 0, sizeof found);
  doctor_can_queue(1 << 20, 1 << 20, &found);
  expect("can queue", WM_SEVERITY_GOOD, "holds 683 ms");
}
