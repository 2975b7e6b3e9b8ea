// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>

#include "commands.h"
#include "options.h"
#include "waymark/clock.h"
#include "waymark/robot.h"
#include "waymark/run.h"

static const char kHelp[] =
    "usage: waymark run --config FILE [--recording RECORDING] [options]\n"
    "\n"
    "Localizes live: a thread a source, the estimator on a real-time thread, poses over LCM (channel WAYMARK_POSE) "
    "and,\n"
    "with --out, into files and an event log. The sources are the configuration's devices or, with --recording, a\n"
    "recording's, played at real speed. Ends with the recording, after --duration, or by Ctrl-C (SIGTERM), and writes\n"
    "everything then.\n"
    "\n"
    "  --config FILE          which estimator, and its parameters\n"
    "  --recording RECORDING  what the sensors say, instead of devices\n"
    "  --out FOLDER           trajectory, published poses, event log, health and timing\n"
    "  --duration S           seconds, then stop\n"
    "  --speed X              times real speed (default 1)\n"
    "  --seed N               of random numbers (default 1)\n"
    "  --landmarks FILE       instead of the recording's map\n"
    "  --map FILE             a map.yaml instead of the recording's\n"
    "  --calibration FILE     instead of the recording's\n"
    "\n"
    "example:\n"
    "  waymark run --config /etc/waymark/robot.yaml\n"
    "  waymark run --config config/starry-night-plan.yaml --recording RECORDING --out out/run --duration 60\n";

typedef struct arguments {
  const char *config, *recording, *landmarks, *calibration, *map;
  wm_run_options run;
} arguments;

static atomic_int stop;

static void on_signal(int number) {
  (void)number;
  atomic_store(&stop, 1);
}

static void catch_signals(void) {
  struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_RESTART};
  (void)sigaction(SIGINT, &action, NULL);
  (void)sigaction(SIGTERM, &action, NULL);
  (void)signal(SIGPIPE, SIG_IGN);
}

static void print_times(const wm_live_report *r) {
  (void)printf("  %s, %s; %" PRIu64 " of %" PRIu64
               " deadlines missed; wakes late by %.3f ms (p99), %.3f at most; a cycle "
               "takes %.3f ms (p99), %.3f at most; poses are %.3f ms old when sent (p99)\n",
               r->is_realtime ? "real-time priority" : "normal priority",
               r->memory_locked ? "memory locked" : "memory not locked", r->deadlines_missed, r->deadlines_total,
               (double)r->wake_p99_ns * 1e-6, (double)r->wake_max_ns * 1e-6, (double)r->loop_p99_ns * 1e-6,
               (double)r->loop_max_ns * 1e-6, (double)r->age_p99_ns * 1e-6);
}

static int run(const arguments *args) {
  wm_error err = {0};
  wm_config config;
  if (wm_config_load(args->config, &config, &err) != WM_OK) {
    (void)complain(&err);
    return EXIT_USAGE;
  }
  wm_recording *recording = NULL;
  wm_status status = override_path(config.overrides.landmarks, args->landmarks, &err);
  if (status == WM_OK) status = override_path(config.overrides.calibration, args->calibration, &err);
  if (status == WM_OK) status = override_path(config.overrides.map, args->map, &err);
  if (status == WM_OK)
    status = args->recording ? wm_recording_open(args->recording, &config.overrides, print_note, NULL, &recording, &err)
                             : wm_robot_open(&config, print_note, NULL, &recording, &err);
  if (status == WM_OK) {
    static wm_live_report report;
    wm_time_ns begin_ns = wm_monotonic_ns();
    catch_signals();
    status = wm_run_live(&config, recording, &args->run, &report, &err);
    if (status == WM_OK) {
      print_report(&report.run, wm_recording_name(recording), args->run.out_dir ? args->run.out_dir : "nowhere",
                   wm_seconds_between(begin_ns, wm_monotonic_ns()));
      print_times(&report);
    }
  }
  wm_recording_close(recording);
  wm_config_free(&config);
  return status == WM_OK ? EXIT_DONE : complain(&err);
}

int command_run(int argc, char *const *argv) {
  arguments args = {.run = {.seed = 1, .speed = 1, .stop = &stop, .say = print_note}};
  int help = 0;
  const option options[] = {{"--config", OPTION_TEXT, &args.config},
                            {"--recording", OPTION_TEXT, &args.recording},
                            {"--out", OPTION_TEXT, &args.run.out_dir},
                            {"--duration", OPTION_F64, &args.run.duration_s},
                            {"--speed", OPTION_F64, &args.run.speed},
                            {"--seed", OPTION_U64, &args.run.seed},
                            {"--landmarks", OPTION_TEXT, &args.landmarks},
                            {"--calibration", OPTION_TEXT, &args.calibration},
                            {"--map", OPTION_TEXT, &args.map},
                            {"--help", OPTION_FLAG, &help},
                            {"-h", OPTION_FLAG, &help}};
  wm_error err = {0};
  size_t words;
  if (options_parse(argc, argv, options, sizeof options / sizeof options[0], NULL, 0, &words, &err) != WM_OK)
    return complain(&err);
  if (help) {
    (void)fputs(kHelp, stdout);
    return EXIT_DONE;
  }
  if (!args.config) {
    (void)fprintf(stderr, "waymark: run needs --config FILE\n\n%s", kHelp);
    return EXIT_USAGE;
  }
  if (!args.recording && args.run.speed != 1) {
    (void)wm_fail(&err, WM_BAD_USAGE, "--speed: devices run at real speed; it is for a recording (--recording)");
    return complain(&err);
  }
  if (args.run.out_dir && check_out_dir(args.run.out_dir, args.recording ? args.recording : "", &err) != WM_OK)
    return complain(&err);
  return run(&args);
}
