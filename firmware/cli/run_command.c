// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>

#include "cli/commands.h"
#include "cli/options.h"
#include "fusion/choice.h"
#include "live/record.h"
#include "live/robot.h"
#include "live/run.h"
#include "output/saved_pose.h"
#include "rt/clock.h"

static const char kHelp[] =
    "usage: waymark run --config FILE [--recording RECORDING] [options]\n"
    "\n"
    "Localizes live: a thread a source, the estimator on a real-time thread, poses over LCM (channel WAYMARK_POSE) "
    "and,\n"
    "with --out, into files and an event log. The sources are the configuration's devices or, with --recording, a\n"
    "recording's, played at real speed. Ends with the recording, after --duration, or by Ctrl-C (SIGTERM), and writes\n"
    "everything then. On devices SIGHUP reads the configuration again: a good one is taken, from the present pose and\n"
    "into FOLDER.2 ...; a wrong one is reported, and the run continues.\n"
    "\n"
    "  --config FILE          which estimator, and its parameters\n"
    "  --recording RECORDING  play this recording instead of devices\n"
    "  --out FOLDER           trajectory, published poses, event log, health and timing\n"
    "                         a run that is there is put aside as FOLDER.before-1 ... (one of the same recording is\n"
    "                         written over)\n"
    "  --record NEW           records the devices meanwhile, into a new folder, as `waymark record` does\n"
    "  --force                write over what is there\n"
    "  --out-max-mb N         tables and log below so much: at half of it they are put aside as trajectory.1.csv ...,\n"
    "                         and a run that is there already is written over\n"
    "  --duration S           seconds, then stop\n"
    "  --speed X              times real speed (default 1)\n"
    "  --seed N               of random numbers (default 1)\n"
    "  --resume               with a recording, too: begin where the run before ended (start.saved_pose,\n"
    "                         start.saved_map), keep both, and write the black box\n"
    "  --landmarks FILE       instead of the recording's map\n"
    "  --map FILE             a map.yaml instead of the recording's\n"
    "  --calibration FILE     instead of the recording's\n"
    "\n"
    "example:\n"
    "  waymark run --config /etc/waymark/robot.yaml\n"
    "  waymark run --config config/robot.yaml --recording first-drive --out out/run --duration 60\n";

typedef struct arguments {
  const char *config, *recording, *record, *landmarks, *calibration, *map;
  int resumes, force;
  wm_run_options run;
} arguments;

#define RECORD_FREE_MB 500  // free space left on the disk, the default of `waymark record`
#define BLIND_S 0.5         // from the end of one run to the first motion of the next, in one process

static atomic_int stop, reload_asked;

static void on_signal(int number) {
  (void)number;
  atomic_store(&stop, 1);
}

static void on_hangup(int number) {
  (void)number;
  atomic_store(&reload_asked, 1);
}

static void catch_signals(void) {
  struct sigaction hangup = {.sa_handler = on_hangup, .sa_flags = SA_RESTART};
  (void)sigaction(SIGHUP, &hangup, NULL);
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

// A configuration with its opened sources.
typedef struct opened {
  wm_config config;
  wm_recording *recording;
} opened;

static void close_all(opened *self) {
  wm_recording_close(self->recording);
  wm_config_free(&self->config);
  self->recording = NULL;
}

// A played recording replaces the robot's devices; the robot's saved state is not used, except with --resume.
static void without_robot(wm_config *config, int resumes) {
  if (!resumes) config->saved_pose[0] = config->saved_map[0] = config->black_box[0] = '\0';
  config->devices.sightings_by_lcm = 0;
}

static wm_status open_all(const arguments *args, opened *out, wm_error *err) {
  wm_config *config = &out->config;
  memset(out, 0, sizeof *out);
  wm_status status = wm_config_load_undecided(args->config, config, err);
  if (status != WM_OK) return err->status = WM_BAD_CONFIG;  // also for a missing file
  if (config->estimator) wm_config_each_warning(config, print_note, NULL);
  if (args->recording) without_robot(config, args->resumes);
  status = override_path(config->overrides.landmarks, args->landmarks, err);
  if (status == WM_OK) status = override_path(config->overrides.calibration, args->calibration, err);
  if (status == WM_OK) status = override_path(config->overrides.map, args->map, err);
  if (status == WM_OK)
    status = args->recording
                 ? wm_recording_open(args->recording, &config->overrides, print_warning, NULL, &out->recording, err)
                 : wm_robot_open(config, print_warning, NULL, &out->recording, err);
  if (status == WM_OK) status = wm_choose_estimator(config, out->recording, print_note, NULL, err);
  if (status != WM_OK) close_all(out);
  return status;
}

// Another configuration, opened and checked while the present run continues.
typedef struct reloading {
  const arguments *args;
  opened next;
} reloading;

static wm_status open_next(void *context, wm_error *err) {
  reloading *self = context;
  static wm_assembly assembly;
  wm_status status = open_all(self->args, &self->next, err);
  if (status != WM_OK) return status;
  status = wm_assemble(&self->next.config, self->next.recording, self->args->run.seed, &assembly, err);
  wm_assembly_close(&assembly);
  if (status != WM_OK) close_all(&self->next);
  return status;
}

// ── recording meanwhile ─────────────────────────────────────────────────────────────────────────────────────────────

typedef struct recorder {
  const wm_config *config;
  wm_record_options options;
  wm_record_report report;
  atomic_int stop;
  wm_status status;
  wm_error error;
  pthread_t thread;
  int is_started;
} recorder;

static void *record(void *argument) {
  recorder *self = argument;
  self->status = wm_record(self->config, &self->options, &self->report, &self->error);
  if (self->status != WM_OK) {
    char line[sizeof self->error.text + 60];
    (void)snprintf(line, sizeof line, "record: %s. Localization continues", self->error.text);
    print_note(NULL, line);
  }
  return NULL;
}

// Signals are handled by the first thread.
static void recorder_start(recorder *self, const opened *with, const char *out_dir) {
  sigset_t all, before;
  memset(self, 0, sizeof *self);
  if (!out_dir) return;
  self->config = &with->config;
  self->options = (wm_record_options){.robot = with->recording,
                                      .out_dir = out_dir,
                                      .bytes_free_min = RECORD_FREE_MB * UINT64_C(1000000),
                                      .stop = &self->stop,
                                      .say = print_note};
  (void)sigfillset(&all);
  (void)pthread_sigmask(SIG_SETMASK, &all, &before);
  self->is_started = pthread_create(&self->thread, NULL, record, self) == 0;
  (void)pthread_sigmask(SIG_SETMASK, &before, NULL);
  if (!self->is_started) self->status = wm_fail(&self->error, WM_IO, "the recorder's thread can't be started");
}

static wm_status recorder_end(recorder *self, wm_error *err) {
  atomic_store(&self->stop, 1);
  if (!self->is_started) return self->status;
  (void)pthread_join(self->thread, NULL);
  (void)printf("%s: %" PRIu64 " CAN frames, %" PRIu64 " rows, %" PRIu64 " pictures, %.1f MB; %" PRIu64 " lost\n",
               self->options.out_dir, self->report.frames, self->report.rows, self->report.pictures,
               (double)self->report.bytes * 1e-6, self->report.lost);
  if (self->status != WM_OK) *err = self->error;
  return self->status;
}

// ── one configuration's run ─────────────────────────────────────────────────────────────────────────────────────────

static wm_status run_once(const opened *with, const char *record_dir, const wm_run_options *options,
                          wm_live_report *report, wm_error *err) {
  static recorder beside;
  wm_error record_error = {0};
  wm_time_ns begin_ns = wm_monotonic_ns();
  recorder_start(&beside, with, record_dir);
  wm_status status = wm_run_live(&with->config, with->recording, options, report, err);
  wm_status recorded = recorder_end(&beside, &record_error);
  if (status != WM_OK) return status;
  if (recorded != WM_OK) *err = record_error;
  print_report(&report->run, wm_recording_name(with->recording), options->out_dir ? options->out_dir : "nowhere",
               wm_seconds_between(begin_ns, wm_monotonic_ns()));
  print_times(report);
  return recorded;
}

// A disk with less than this has no room for the files of another part of a run.
#define OUT_FREE_MB 1

static int has_room(const char *folder) {
  char parent[WM_PATH_MAX + 16];
  (void)snprintf(parent, sizeof parent, "%s", folder);
  char *slash = strrchr(parent, '/');
  if (slash) slash[slash == parent] = '\0';
  struct statvfs disk;
  return statvfs(slash ? parent : ".", &disk) != 0 ||
         (uint64_t)disk.f_bavail * disk.f_frsize >= OUT_FREE_MB * UINT64_C(1000000);
}

// Faults of the files of earlier parts of a run. Localization continues; the exit code and the last line report the
// first.
typedef struct trouble {
  wm_status status;
  wm_error first;
} trouble;

static void remember(trouble *self, wm_status status, const wm_error *err) {
  if (status == WM_OK) return;
  char line[sizeof err->text + 40];
  (void)snprintf(line, sizeof line, "%s. Localization continues", err->text);
  print_note(NULL, line);
  if (self->status == WM_OK) *self = (trouble){status, *err};
}

// The folder of a part; NULL where there is none, or no room for it.
static const char *folder_of(const arguments *args, int part, int puts_aside, char *out, size_t capacity,
                             trouble *so_far) {
  if (!args->run.out_dir) return NULL;
  (void)snprintf(out, capacity, "%s.%d", args->run.out_dir, part);
  wm_error err = {0};
  wm_status status =
      has_room(out) ? WM_OK : wm_fail(&err, WM_IO, "%s: not written, the disk is full: free some of it", out);
  if (status == WM_OK && puts_aside) status = put_run_aside(out, NULL, &err);
  remember(so_far, status, &err);
  return status == WM_OK ? out : NULL;
}

static int run(const arguments *args) {
  static opened now;
  static reloading reload;
  static wm_live_report report;
  wm_error err = {0};
  if (open_all(args, &now, &err) != WM_OK) return complain(&err);
  wm_run_options options = args->run;
  wm_start start;
  char out_dir[WM_PATH_MAX + 16], record_dir[WM_PATH_MAX + 16], last_floor[WM_NAME_MAX];
  reload.args = args;
  options.reload = open_next;
  options.reload_context = &reload;
  options.reload_asked = args->recording ? NULL : &reload_asked;
  catch_signals();
  const int puts_aside = !args->force && args->run.out_max_mb <= 0 && args->run.out_dir;
  trouble so_far = {0};
  wm_status status = WM_OK;
  if (puts_aside)
    status = put_run_aside(options.out_dir, args->recording ? wm_recording_name(now.recording) : NULL, &err);
  if (status == WM_OK) status = run_once(&now, args->record, &options, &report, &err);
  for (int part = 2; report.wants_restart; part++) {
    remember(&so_far, status, &err);
    close_all(&now);
    now = reload.next;
    options.start = NULL;
    options.start_floor = report.has_floors ? last_floor : NULL;
    (void)snprintf(last_floor, sizeof last_floor, "%s", report.last_floor);
    if (report.has_last && wm_saved_pose_is_worth_it(&report.last)) {
      wm_start_from_estimate(&report.last, now.config.motion, BLIND_S, &start);
      options.start = &start;
    }
    // A log and a recording hold one configuration each.
    options.out_dir = folder_of(args, part, puts_aside, out_dir, sizeof out_dir, &so_far);
    (void)snprintf(record_dir, sizeof record_dir, "%s.%d", args->record ? args->record : "", part);
    status = run_once(&now, args->record ? record_dir : NULL, &options, &report, &err);
  }
  close_all(&now);
  if (status == WM_OK && so_far.status != WM_OK) return complain(&so_far.first);
  return status == WM_OK ? EXIT_DONE : complain(&err);
}

static wm_status check_new_recording(const char *folder, const char *played, wm_error *err) {
  struct stat there;
  if (played) return wm_fail(err, WM_BAD_USAGE, "--record: records devices; with --recording there are none");
  if (stat(folder, &there) == 0)
    return wm_fail(err, WM_BAD_USAGE, "--record: %s exists already; a recording is never overwritten", folder);
  return WM_OK;
}

int command_run(int argc, char *const *argv) {
  static arguments args = {.run = {.seed = 1, .speed = 1, .stop = &stop, .say = print_note}};
  int help = 0;
  const option options[] = {{"--config", OPTION_TEXT, &args.config},
                            {"--recording", OPTION_TEXT, &args.recording},
                            {"--out", OPTION_TEXT, &args.run.out_dir},
                            {"--record", OPTION_TEXT, &args.record},
                            {"--out-max-mb", OPTION_F64, &args.run.out_max_mb},
                            {"--duration", OPTION_F64, &args.run.duration_s},
                            {"--speed", OPTION_F64, &args.run.speed},
                            {"--seed", OPTION_U64, &args.run.seed},
                            {"--resume", OPTION_FLAG, &args.resumes},
                            {"--force", OPTION_FLAG, &args.force},
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
  if (args.record && check_new_recording(args.record, args.recording, &err) != WM_OK) return complain(&err);
  if (args.run.out_dir && check_out_dir(args.run.out_dir, args.recording ? args.recording : "", &err) != WM_OK)
    return complain(&err);
  return run(&args);
}
