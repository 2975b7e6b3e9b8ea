// SPDX-License-Identifier: Apache-2.0
// The program's commands. Each takes the arguments after its name and returns the exit code.
#ifndef WAYMARK_CLI_COMMANDS_H
#define WAYMARK_CLI_COMMANDS_H

#include "config/config.h"
#include "replay/replay.h"
#include "waymark/status.h"

enum { EXIT_DONE = 0, EXIT_WORK_FAILED = 1, EXIT_USAGE = 2 };

int command_run(int argc, char *const *argv);
int command_replay(int argc, char *const *argv);
int command_check(int argc, char *const *argv);
int command_record(int argc, char *const *argv);
int command_watch(int argc, char *const *argv);
int command_doctor(int argc, char *const *argv);
int command_stamps(int argc, char *const *argv);
int command_config(int argc, char *const *argv);

// ── shared by the commands ──────────────────────────────────────────────────────────────────────────────────────────

// Exit code of a status: configuration and usage are 2, the rest is 1.
int exit_code(wm_status status);
// "waymark: TEXT" on standard error; returns the exit code of the error.
int complain(const wm_error *err);
// A wm_line_fn, and a wm_warn_fn: "note: TEXT" on standard error.
void print_note(void *context, const char *text);
void print_warning(void *context, wm_note note, const char *text);
// `--landmarks` and `--calibration` replace the configuration's files.
wm_status override_path(char out[WM_PATH_MAX], const char *path, wm_error *err);
// Refuses an output folder whose files would overwrite the input: a recording, or the log that is replayed.
wm_status check_out_dir(const char *out_dir, const char *input, wm_error *err);
// A run of another recording than `recording` in `out_dir` is renamed to OUT.before-1, -2 ..., with a note. NULL: any
// run, since what devices gave does not come again.
wm_status put_run_aside(const char *out_dir, const char *recording, wm_error *err);
// Prints counts and state of a run on standard output.
void print_report(const wm_run_report *report, const char *name, const char *out_dir, double took_s);

// Whether run_desk_command would find it.
int desk_command_is_there(const char *command);
// Executes a desk's command in place of this program: waymark-COMMAND in this program's folder, else in PATH, as git
// does. Returns only where there is none.
void run_desk_command(const char *command, char *const *argv);

// A line on a terminal with the remaining time, after two seconds; nothing where the output is no terminal.
typedef struct progress_line {
  wm_time_ns begin_ns;
  int shown;
} progress_line;
void progress_begin(progress_line *self);
void progress_show(void *self, double done);  // a wm_progress_fn
void progress_end(progress_line *self);

#endif
