// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>

#include "cli/commands.h"
#include "cli/opened.h"
#include "cli/options.h"
#include "cli/trial.h"
#include "live/record.h"
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
    "into FOLDER.2 ...; a wrong one is reported, and the run continues. `waymark config set` tries one.\n"
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
  opened_choice opened;
  const char *record;
  int force;
  wm_run_options run;
} arguments;

#define RECORD_FREE_MB 500  // free space left on the disk, the default of `waymark record`
#define BLIND_S 0.5         // from the end of one run to the first motion of the next, in one process

static atomic_int stop, reload_asked, is_on_trial;

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

// The configuration that comes next, opened and checked while the present run continues.
typedef struct reloading {
  const arguments *args;
  trial trial;
  const char *path;  // of the next one
  opened next;
  // The pose before a trial, and when that was: what a wrong configuration made of it is not gone on with.
  wm_estimate before;
  int has_before, is_back;
  wm_time_ns before_ns;
} reloading;

static int wants_reload(void *context) {
  reloading *self = context;
  char line[2 * TRIAL_PATH_MAX + 64];
  const char *of_robot = self->args->opened.config;
  self->path = of_robot;
  self->is_back = self->trial.is_on;
  if (atomic_exchange(&reload_asked, 0)) {
    trial_end(&self->trial);
    return 1;
  }
  const trial_news news = trial_look(&self->trial, wm_monotonic_ns());
  if (news == TRIAL_NOTHING) return 0;
  if (news == TRIAL_BEGINS) self->path = self->trial.path;
  self->is_back = news == TRIAL_WITHDRAWN;
  if (news == TRIAL_TAKEN) atomic_store(&is_on_trial, 0);
  const char *is = news == TRIAL_BEGINS      ? "is on trial"
                   : news == TRIAL_WITHDRAWN ? "was not good enough or was given up: back to the configuration before"
                                             : "is the robot's now";
  (void)snprintf(line, sizeof line, "configuration: %s %s", self->trial.path, is);
  print_note(NULL, line);
  return news != TRIAL_TAKEN;
}

static wm_status open_next(void *context, wm_error *err) {
  reloading *self = context;
  opened_choice choice = self->args->opened;
  choice.config = self->path;
  wm_status status = opened_open_to_run(&choice, self->args->run.seed, &self->next, err);
  if (status != WM_OK) trial_end(&self->trial);  // the run goes on with the robot's own
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

// A run that doesn't start with the configuration on trial: the robot's own is opened anew.
static int goes_back(reloading *self, wm_status status, wm_error *err) {
  if (status == WM_OK || !self->trial.is_on) return 0;
  wm_error why = *err;
  trial_end(&self->trial);
  self->path = self->args->opened.config;
  self->is_back = 1;
  char line[sizeof why.text + TRIAL_PATH_MAX + 40];
  (void)snprintf(line, sizeof line, "configuration: %s: %s. Back to the configuration before", self->trial.path,
                 why.text);
  print_note(NULL, line);
  return open_next(self, err) == WM_OK;
}

// From the last pose; after a trial from the one before it, with the motion since then in its sigmas. 0: no pose is
// worth it.
static int start_of_next(reloading *self, const wm_live_report *report, const wm_motion_params *motion, wm_start *out) {
  const wm_time_ns now_ns = wm_monotonic_ns();
  if (!self->is_back) {
    self->has_before = report->has_last && wm_saved_pose_is_worth_it(&report->last);
    self->before = report->last;
    self->before_ns = now_ns;
  }
  if (self->has_before)
    wm_start_from_estimate(&self->before, motion, BLIND_S + wm_seconds_between(self->before_ns, now_ns), out);
  return self->has_before;
}

static int run(const arguments *args) {
  static opened now;
  static reloading reload;
  static wm_live_report report;
  wm_error err = {0};
  if (opened_open(&args->opened, &now, &err) != WM_OK) return complain(&err);
  wm_run_options options = args->run;
  wm_start start;
  char out_dir[WM_PATH_MAX + 16], record_dir[WM_PATH_MAX + 16], last_floor[WM_NAME_MAX];
  reload.args = args;
  options.reload = open_next;
  options.reload_context = &reload;
  options.on_trial = &is_on_trial;
  options.wants_reload = args->opened.recording ? NULL : wants_reload;
  trial_open(&reload.trial, args->opened.config);
  catch_signals();
  const int puts_aside = !args->force && args->run.out_max_mb <= 0 && args->run.out_dir;
  trouble so_far = {0};
  wm_status status = WM_OK;
  if (puts_aside)
    status = put_run_aside(options.out_dir, args->opened.recording ? wm_recording_name(now.recording) : NULL, &err);
  if (status == WM_OK) status = run_once(&now, args->record, &options, &report, &err);
  for (int part = 2; report.wants_restart || goes_back(&reload, status, &err); part++) {
    if (report.wants_restart) remember(&so_far, status, &err);
    opened_close(&now);
    now = reload.next;
    options.start = start_of_next(&reload, &report, now.config.motion, &start) ? &start : NULL;
    options.start_floor = report.has_floors ? last_floor : NULL;
    (void)snprintf(last_floor, sizeof last_floor, "%s", report.last_floor);
    // A log and a recording hold one configuration each.
    options.out_dir = folder_of(args, part, puts_aside, out_dir, sizeof out_dir, &so_far);
    (void)snprintf(record_dir, sizeof record_dir, "%s.%d", args->record ? args->record : "", part);
    atomic_store(&is_on_trial, reload.trial.is_on);
    status = run_once(&now, args->record ? record_dir : NULL, &options, &report, &err);
  }
  opened_close(&now);
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
  const option options[] = {{"--config", OPTION_TEXT, &args.opened.config},
                            {"--recording", OPTION_TEXT, &args.opened.recording},
                            {"--out", OPTION_TEXT, &args.run.out_dir},
                            {"--record", OPTION_TEXT, &args.record},
                            {"--out-max-mb", OPTION_F64, &args.run.out_max_mb},
                            {"--duration", OPTION_F64, &args.run.duration_s},
                            {"--speed", OPTION_F64, &args.run.speed},
                            {"--seed", OPTION_U64, &args.run.seed},
                            {"--resume", OPTION_FLAG, &args.opened.resumes},
                            {"--force", OPTION_FLAG, &args.force},
                            {"--landmarks", OPTION_TEXT, &args.opened.landmarks},
                            {"--calibration", OPTION_TEXT, &args.opened.calibration},
                            {"--map", OPTION_TEXT, &args.opened.map},
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
  if (!args.opened.config) {
    (void)fprintf(stderr, "waymark: run needs --config FILE\n\n%s", kHelp);
    return EXIT_USAGE;
  }
  if (!args.opened.recording && args.run.speed != 1) {
    (void)wm_fail(&err, WM_BAD_USAGE, "--speed: devices run at real speed; it is for a recording (--recording)");
    return complain(&err);
  }
  if (args.record && check_new_recording(args.record, args.opened.recording, &err) != WM_OK) return complain(&err);
  if (args.run.out_dir &&
      check_out_dir(args.run.out_dir, args.opened.recording ? args.opened.recording : "", &err) != WM_OK)
    return complain(&err);
  return run(&args);
}
