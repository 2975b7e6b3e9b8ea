// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <wm_version.h>
#include "cli/commands.h"
#include "cli/options.h"
#include "fusion/choice.h"
#include "output/event_log.h"
#include "rt/clock.h"
#include "waymark/codec.h"
#include "waymark/map.h"

static const char kHelp[] =
    "usage: waymark replay RECORDING --config FILE --out FOLDER [options]\n"
    "       waymark replay events.wmlog --out FOLDER [options]\n"
    "\n"
    "Localizes from a recording (docs/recording-format.md), or makes the trajectory of a run again, bit by bit, from "
    "its\n"
    "event log, which needs no recording. Ctrl-C stops it; the folder then has the run up to there (exit code 1).\n"
    "\n"
    "  --config FILE       which estimator, and its parameters; of an event log: another one than its own\n"
    "  --out FOLDER        where trajectory, published poses, event log, health and timing are written\n"
    "  --seed N            of random numbers (default 1; an event log brings its own)\n"
    "  --landmarks FILE    instead of the recording's map; an event log refuses any map but its own\n"
    "  --calibration FILE  instead of the recording's\n"
    "  --map FILE          a map.yaml instead of the recording's; an event log refuses any but its own\n"
    "  --frames-of LOG     only the pictures that a run fed from this recording saw, by its event log: what it lost\n"
    "                      is lost here, too, and its poses can be compared\n"
    "  --timing-of RUN     detectors take the time that they took in that run (median, by its timing.json); without "
    "it\n"
    "                      none, or `sources: [{name: DETECTOR, ready_after_ms: 40}]`\n"
    "  --from S, --until S only this part of the recording, s from its first stamp\n"
    "  --lost              begin without a start pose, even if the recording has one\n"
    "  --force             write over a run of another recording in FOLDER; else it is put aside (FOLDER.before-1)\n"
    "  --reference         also reference.csv: all of the drive looked at as a whole (edges on a raster map; at a "
    "desk)\n"
    "\n"
    "example:\n"
    "  waymark replay first-drive --config config/robot.yaml --out out/run\n"
    "  waymark replay out/run/events.wmlog --out out/again\n";

typedef struct arguments {
  const char *config, *out, *landmarks, *calibration, *map, *frames_of, *timing_of;
  uint64_t seed;
  double from_s, until_s;
  int lost, reference, force;
  const char *what;
} arguments;

static volatile sig_atomic_t stop_asked;

static void on_signal(int number) {
  (void)number;
  stop_asked = 1;
}

// The second one ends the program at once.
static void catch_signals(void) {
  struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_RESTART | (int)SA_RESETHAND};
  (void)sigaction(SIGINT, &action, NULL);
  (void)sigaction(SIGTERM, &action, NULL);
}

static int finished(const wm_run_report *report, const char *out_dir) {
  if (!report->was_stopped) return EXIT_DONE;
  (void)fprintf(stderr, "note: stopped at %.1f s of the recording; %s has the run up to there\n", report->recorded_s,
                out_dir);
  return EXIT_WORK_FAILED;
}

// What the recording has and the estimator doesn't take, or needs and lacks.
static void tell_assembled(void *context, const wm_assembly *assembly, wm_status status) {
  (void)context;
  if (status == WM_OK && wm_assembly_lacks_start(assembly)) print_note(NULL, wm_assembly_lacks_start(assembly));
  if (status != WM_OK || !wm_assembly_observes(assembly)) return;
  for (size_t i = 0; i < assembly->unused_count; i++) {
    const wm_unused *one = &assembly->unused[i];
    char line[sizeof *one + 32];
    (void)snprintf(line, sizeof line, "%s is not used: %s", one->name, one->text);
    if (one->why == WM_UNUSED_BY_ESTIMATOR) print_note(NULL, line);
  }
}

static int replay_recording(const arguments *args) {
  wm_error err = {0};
  wm_config config;
  if (wm_config_load_undecided(args->config, &config, &err) != WM_OK) {
    (void)complain(&err);
    return EXIT_USAGE;
  }
  if (config.estimator) wm_config_each_warning(&config, print_note, NULL);
  if (args->lost) {
    config.has_initial_pose = 1;
    wm_start_init(&config.initial_pose);
  }
  wm_recording *recording = NULL;
  wm_status status = override_path(config.overrides.landmarks, args->landmarks, &err);
  if (status == WM_OK) status = override_path(config.overrides.calibration, args->calibration, &err);
  if (status == WM_OK) status = override_path(config.overrides.map, args->map, &err);
  if (status == WM_OK) status = wm_recording_open(args->what, &config.overrides, print_warning, NULL, &recording, &err);
  if (status == WM_OK) status = wm_choose_estimator(&config, recording, print_note, NULL, &err);
  if (status == WM_OK && !args->force) status = put_run_aside(args->out, wm_recording_name(recording), &err);
  int code = EXIT_DONE;
  if (status == WM_OK) {
    progress_line progress;
    progress_begin(&progress);
    const wm_replay_watch watch = {.assembled = tell_assembled};
    const wm_replay_options options = {.out_dir = args->out,
                                       .watch = &watch,
                                       .seed = args->seed,
                                       .progress = progress_show,
                                       .progress_context = &progress,
                                       .frames_of = args->frames_of,
                                       .timing_of = args->timing_of,
                                       .stop = &stop_asked,
                                       .from_s = args->from_s,
                                       .until_s = args->until_s};
    static wm_run_report report;
    status = wm_replay_recording(&config, recording, &options, &report, &err);
    progress_end(&progress);
    if (status == WM_OK)
      print_report(&report, wm_recording_name(recording), args->out,
                   wm_seconds_between(progress.begin_ns, wm_monotonic_ns()));
    if (status == WM_OK && args->frames_of)
      (void)printf("  %s: its clock is %" PRId64 " ns ahead of the recording's\n", args->frames_of,
                   report.log_ahead_ns);
    if (status == WM_OK) code = finished(&report, args->out);
  }
  wm_recording_close(recording);
  wm_config_free(&config);
  return status == WM_OK ? code : complain(&err);
}

// A log's poses belong to its map: another map is refused.
static wm_status check_map(const char *file, const wm_log_head *head, const char *log, wm_error *err) {
  if (!file) return WM_OK;
  wm_landmark *landmarks;
  size_t count;
  wm_status status = wm_landmarks_load(file, print_warning, NULL, &landmarks, &count, err);
  if (status != WM_OK) return status;
  uint64_t hash = wm_landmarks_hash(landmarks, count);
  free(landmarks);
  if (hash == head->landmark_hash) return WM_OK;
  return wm_fail(err, WM_BAD_CONFIG,
                 "%s: was made with another map: its %zu landmarks have the hash %016" PRIx64
                 ", the %zu of %s have "
                 "%016" PRIx64 ". Without --landmarks the log's own map is used; a new map needs the recording",
                 log, head->landmark_count, head->landmark_hash, count, file, hash);
}

// The raster map of the log, from its path there or from --map.
static wm_status load_map(const char *file, const wm_log_head *head, wm_map **out, wm_error *err) {
  *out = NULL;
  if (!head->map_hash) return WM_OK;
  return wm_map_load(file ? file : head->map_path, print_warning, NULL, out, err);
}

static int replay_log(const arguments *args) {
  wm_error err = {0};
  wm_log_reader *log;
  if (args->calibration) {
    (void)fputs("waymark: --calibration: an event log brings its own; another one needs the recording\n", stderr);
    return EXIT_USAGE;
  }
  if (wm_log_open(args->what, &log, &err) != WM_OK) return complain(&err);
  const wm_log_head *head = wm_log_reader_head(log);
  wm_status status = check_map(args->landmarks, head, args->what, &err);
  if (status == WM_OK && !args->force) status = put_run_aside(args->out, head->recording, &err);
  int code = EXIT_DONE;
  wm_map *map = NULL;
  if (status == WM_OK) status = load_map(args->map, head, &map, &err);
  wm_config config;
  memset(&config, 0, sizeof config);
  if (status == WM_OK)
    status = args->config
                 ? wm_config_load(args->config, &config, &err)
                 : wm_config_parse_logged(head->config_text, head->config_length, head->config_path, &config, &err);
  if (status == WM_OK) {
    wm_config_each_warning(&config, print_note, NULL);
    if (strcmp(head->program, WM_VERSION) != 0)
      (void)fprintf(stderr, "note: %s was written by waymark %s; this is %s: the last bits may differ\n", args->what,
                    head->program, WM_VERSION);
    wm_time_ns begin_ns = wm_monotonic_ns();
    const wm_replay_options options = {
        .out_dir = args->out, .map = map ? wm_map_raster(map) : NULL, .stop = &stop_asked};
    static wm_run_report report;
    status = wm_replay_log(&config, log, &options, &report, &err);
    if (report.log_was_cut)
      (void)fprintf(stderr, "note: %s has no regular end (power cut?); it has the events up to there\n", args->what);
    if (report.events_missing > 0)
      (void)fprintf(stderr, "note: %s lacks %" PRIu64 " events: poses after them differ from those of the run\n",
                    args->what, report.events_missing);
    if (status == WM_OK)
      print_report(&report, head->recording, args->out, wm_seconds_between(begin_ns, wm_monotonic_ns()));
    if (status == WM_OK) code = finished(&report, args->out);
  }
  wm_config_free(&config);
  wm_map_free(map);
  wm_log_reader_close(log);
  return status == WM_OK ? code : complain(&err);
}

// waymark-reference continues after the replay.
static int make_reference(const arguments *args) {
  char program[] = "waymark-reference", map[] = "--map";
  char *const words[] = {program, (char *)args->out, (char *)args->what, args->map ? map : NULL, (char *)args->map,
                         NULL};
  (void)fflush(stdout);
  run_desk_command("reference", words);
  (void)fputs("waymark: --reference needs the desk's program waymark-reference (package waymark-tools)\n", stderr);
  return EXIT_WORK_FAILED;
}

// A run's folder in place of a recording: its log can be replayed.
static int is_run_folder(const char *dir) {
  char recording[WM_PATH_MAX + 32], log[WM_PATH_MAX + 32];
  struct stat there;
  (void)snprintf(recording, sizeof recording, "%s/recording.yaml", dir);
  (void)snprintf(log, sizeof log, "%s/events.wmlog", dir);
  return stat(recording, &there) != 0 && stat(log, &there) == 0;
}

int command_replay(int argc, char *const *argv) {
  arguments args = {.seed = 1};
  int help = 0;
  const option options[] = {{"--config", OPTION_TEXT, &args.config},
                            {"--out", OPTION_TEXT, &args.out},
                            {"--seed", OPTION_U64, &args.seed},
                            {"--landmarks", OPTION_TEXT, &args.landmarks},
                            {"--calibration", OPTION_TEXT, &args.calibration},
                            {"--map", OPTION_TEXT, &args.map},
                            {"--frames-of", OPTION_TEXT, &args.frames_of},
                            {"--timing-of", OPTION_TEXT, &args.timing_of},
                            {"--from", OPTION_F64, &args.from_s},
                            {"--until", OPTION_F64, &args.until_s},
                            {"--lost", OPTION_FLAG, &args.lost},
                            {"--force", OPTION_FLAG, &args.force},
                            {"--reference", OPTION_FLAG, &args.reference},
                            {"--help", OPTION_FLAG, &help},
                            {"-h", OPTION_FLAG, &help}};
  wm_error err = {0};
  size_t words;
  if (options_parse(argc, argv, options, sizeof options / sizeof options[0], &args.what, 1, &words, &err) != WM_OK)
    return complain(&err);
  if (help) {
    (void)fputs(kHelp, stdout);
    return EXIT_DONE;
  }
  struct stat there;
  if (words == 0 || !args.out) {
    (void)fprintf(stderr, "waymark: replay needs %s\n\n%s", words == 0 ? "a recording or an event log" : "--out FOLDER",
                  kHelp);
    return EXIT_USAGE;
  }
  catch_signals();
  if (check_out_dir(args.out, args.what, &err) != WM_OK) return complain(&err);
  if (is_run_folder(args.what)) {
    (void)fprintf(stderr, "waymark: %s is a run, not a recording; did you mean its log, %s/events.wmlog?\n", args.what,
                  args.what);
    return EXIT_USAGE;
  }
  if (stat(args.what, &there) == 0 && !S_ISDIR(there.st_mode)) {
    const int part = args.from_s > 0 || args.until_s > 0 || args.lost;
    if (!args.reference && !args.frames_of && !args.timing_of && !part) return replay_log(&args);
    (void)fprintf(stderr, "waymark: %s needs the recording; a log holds the whole run\n",
                  args.reference   ? "--reference"
                  : args.frames_of ? "--frames-of"
                  : args.timing_of ? "--timing-of"
                                   : "a part of a drive (--from, --until, --lost)");
    return EXIT_USAGE;
  }
  if (args.from_s < 0 || args.until_s < 0 || (args.until_s > 0 && args.until_s <= args.from_s)) {
    (void)fprintf(stderr,
                  "waymark: --from %g, --until %g: seconds from the recording's first stamp, the later one last\n",
                  args.from_s, args.until_s);
    return EXIT_USAGE;
  }
  if (!args.config) {
    (void)fprintf(stderr, "waymark: replay of a recording needs --config FILE\n\n%s", kHelp);
    return EXIT_USAGE;
  }
  const int code = replay_recording(&args);
  return code == EXIT_DONE && args.reference ? make_reference(&args) : code;
}
