// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "cli/commands.h"
#include "cli/doctor/doctor.h"
#include "cli/options.h"
#include "live/lcm_connect.h"

#define RECEIVER_S 3.0  // GNSS receivers report once a second or more often

static const char kHelp[] =
    "usage: waymark doctor [CONFIG] [options]\n"
    "\n"
    "Checks this computer and states how to correct what it finds: kernel, real-time rights, clocks, governors,\n"
    "temperature, LCM's route; with a configuration also its CAN interfaces, cameras,\n"
    "IMU and GNSS receiver. Measures for 5 s how late a\n"
    "thread wakes. Changes nothing. Exit code 1 where something is bad.\n"
    "\n"
    "  --json       for programs\n"
    "  --seconds S  of measuring (default 5)\n"
    "\n"
    "example:\n"
    "  waymark doctor /etc/waymark/robot.yaml\n";

static void print_json(const wm_findings *found, const wm_histogram *wake_ns) {
  (void)fputs("{\n  \"findings\": ", stdout);
  wm_findings_json(found, stdout);
  (void)printf(",\n  \"wake_ms\": {\"p50\": %.6f, \"p99\": %.6f, \"p999\": %.6f, \"max\": %.6f, \"count\": %llu}\n}\n",
               (double)wm_histogram_quantile(wake_ns, 0.5) * 1e-6, (double)wm_histogram_quantile(wake_ns, 0.99) * 1e-6,
               (double)wm_histogram_quantile(wake_ns, 0.999) * 1e-6, (double)wake_ns->max_ns * 1e-6,
               (unsigned long long)wake_ns->count);
}

static int look(const wm_config *config, double seconds, int as_json) {
  static wm_findings found;
  static wm_histogram wake_ns;
  int is_realtime, priority = config ? config->runtime.realtime_priority : 80;
  doctor_kernel("", &found);
  doctor_clocks("", &found);
  doctor_power("", &found);
  doctor_limits(&found);
  doctor_group("", &found);
  doctor_lcm(lcm_connect_url(config ? config->lcm_url : ""), &found);
  doctor_can("", config, &found);
  int wanted, granted = wm_can_queue_bytes(&wanted);
  if (config && config->devices.can_count > 0 && granted > 0) doctor_can_queue(wanted, granted, &found);
  doctor_interrupts("", config, sysconf(_SC_NPROCESSORS_ONLN), &found);
  doctor_cameras(config, &found);
  doctor_imu("", config, &found);
  doctor_gnss(config, RECEIVER_S, &found);
  doctor_dvl(config, RECEIVER_S, &found);
  doctor_latency(seconds, priority, &wake_ns, &is_realtime);
  doctor_judge_latency(&wake_ns, is_realtime, &found);
  if (as_json) {
    print_json(&found, &wake_ns);
  } else {
    wm_findings_print(&found, stdout);
  }
  return wm_findings_of(&found, WM_SEVERITY_BAD) > 0 ? EXIT_WORK_FAILED : EXIT_DONE;
}

int command_doctor(int argc, char *const *argv) {
  const char *words[1];
  double seconds = 5;
  int help = 0, as_json = 0;
  const option options[] = {{"--json", OPTION_FLAG, &as_json},
                            {"--seconds", OPTION_F64, &seconds},
                            {"--help", OPTION_FLAG, &help},
                            {"-h", OPTION_FLAG, &help}};
  wm_error err = {0};
  size_t count;
  if (options_parse(argc, argv, options, sizeof options / sizeof options[0], words, 1, &count, &err) != WM_OK)
    return complain(&err);
  if (help) {
    (void)fputs(kHelp, stdout);
    return EXIT_DONE;
  }
  if (seconds > 3600) {
    (void)wm_fail(&err, WM_BAD_USAGE, "--seconds: %g is more than an hour", seconds);
    return complain(&err);
  }
  if (count == 0) return look(NULL, seconds, as_json);
  wm_config config;
  if (wm_config_load_undecided(words[0], &config, &err) != WM_OK) {
    (void)complain(&err);
    return EXIT_USAGE;
  }
  wm_config_each_warning(&config, print_note, NULL);
  int result = look(&config, seconds, as_json);
  wm_config_free(&config);
  return result;
}
