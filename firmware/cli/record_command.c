// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <sys/stat.h>

#include "cli/commands.h"
#include "cli/options.h"
#include "live/record.h"

static const char kHelp[] =
    "usage: waymark record --config FILE --out RECORDING [options]\n"
    "\n"
    "Writes the data of the robot's devices into a recording: all CAN frames, streams and sightings over LCM, rows\n"
    "of an IMU and a GNSS receiver, cameras' pictures (MJPEG as it is, others as uncompressed grey), calibration, DBC\n"
    "and configuration. It is valid at every moment, also after a power cut. Ends after --duration, by Ctrl-C "
    "(SIGTERM), or when its room is used up.\n"
    "\n"
    "  --config FILE    its `devices:`\n"
    "  --out RECORDING  a new folder\n"
    "  --duration S     seconds, then stop\n"
    "  --max-mb N       so much at most\n"
    "  --free-mb N      so much is left free on the disk (default 500)\n"
    "\n"
    "example:\n"
    "  waymark record --config /etc/waymark/robot.yaml --out /data/drive-1\n";

static atomic_int stop;

static void on_signal(int number) {
  (void)number;
  atomic_store(&stop, 1);
}

int command_record(int argc, char *const *argv) {
  const char *config_path = NULL;
  uint64_t max_mb = 0, free_mb = 500;
  int help = 0;
  wm_record_options record = {.stop = &stop, .say = print_note};
  const option options[] = {{"--config", OPTION_TEXT, &config_path},
                            {"--out", OPTION_TEXT, &record.out_dir},
                            {"--duration", OPTION_F64, &record.duration_s},
                            {"--max-mb", OPTION_U64, &max_mb},
                            {"--free-mb", OPTION_U64, &free_mb},
                            {"--help", OPTION_FLAG, &help},
                            {"-h", OPTION_FLAG, &help}};
  wm_error err = {0};
  size_t words;
  struct stat there;
  if (options_parse(argc, argv, options, sizeof options / sizeof options[0], NULL, 0, &words, &err) != WM_OK)
    return complain(&err);
  if (help) {
    (void)fputs(kHelp, stdout);
    return EXIT_DONE;
  }
  if (!config_path || !record.out_dir) {
    (void)fprintf(stderr, "waymark: record needs %s\n\n%s", config_path ? "--out RECORDING" : "--config FILE", kHelp);
    return EXIT_USAGE;
  }
  if (stat(record.out_dir, &there) == 0) {
    (void)wm_fail(&err, WM_BAD_USAGE, "--out: %s exists already; a recording is never overwritten", record.out_dir);
    return complain(&err);
  }
  record.bytes_max = (max_mb < UINT64_MAX / 1000000 ? max_mb : UINT64_MAX / 1000000) * 1000000;
  record.bytes_free_min = (free_mb < UINT64_MAX / 1000000 ? free_mb : UINT64_MAX / 1000000) * 1000000;
  struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_RESTART};
  (void)sigaction(SIGINT, &action, NULL);
  (void)sigaction(SIGTERM, &action, NULL);
  wm_config config;
  if (wm_config_load_undecided(config_path, &config, &err) != WM_OK) {
    (void)complain(&err);
    return EXIT_USAGE;
  }
  wm_config_each_warning(&config, print_note, NULL);
  wm_record_report report;
  wm_status status = wm_record(&config, &record, &report, &err);
  wm_config_free(&config);
  (void)printf("%s: %" PRIu64 " CAN frames, %" PRIu64 " rows, %" PRIu64 " pictures, %.1f MB; %" PRIu64 " lost\n",
               record.out_dir, report.frames, report.rows, report.pictures, (double)report.bytes * 1e-6, report.lost);
  return status == WM_OK ? EXIT_DONE : complain(&err);
}
