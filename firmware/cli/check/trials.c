// SPDX-License-Identifier: Apache-2.0
#include "cli/check/trials.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "rt/clock.h"
#include "waymark/recording.h"

// All trials together take about so long: of longer recordings a part is driven.
#define BUDGET_S 40.0
#define PART_MIN_S 30.0
// A change explains the observations if each update gains so much of log likelihood, nats, and most updates are fused.
#define GAIN_MIN 0.1
#define EXPLAINED_MIN 0.85
#define FINALISTS 8

// ── one trial, in a process of its own ──────────────────────────────────────────────────────────────────────────────

typedef struct trial {
  suspects_applied applied;
  drive_evidence evidence;
} trial;

static void prepare(void *context, wm_assembly *assembly) { suspects_prepare(&((trial *)context)->applied, assembly); }
static void change(void *context, wm_event *event) { suspects_change(&((trial *)context)->applied, event); }
static void put(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  (void)bytes;
  evidence_put(&((trial *)context)->evidence, kind, record);
}

static trial_result drive(const trials_plan *plan, double until_s, const suspect *changes, size_t count) {
  static trial self;
  static wm_run_report report;
  self.applied = (suspects_applied){.of = changes, .count = count};
  wm_recording *recording = NULL;
  wm_error err = {0};
  if (wm_recording_open(plan->dir, &plan->config->overrides, NULL, NULL, &recording, &err) != WM_OK)
    return (trial_result){0};
  const wm_replay_watch watch = {.context = &self, .prepare = prepare, .change = change, .put = put};
  const wm_replay_options options = {.watch = &watch, .seed = 1, .until_s = until_s};
  const wm_status status = wm_replay_recording(plan->config, recording, &options, &report, &err);
  wm_recording_close(recording);
  suspects_release(&self.applied);
  if (status != WM_OK || self.evidence.updates == 0) return (trial_result){0};
  return (trial_result){1, evidence_score(&self.evidence), (double)self.evidence.fused / (double)self.evidence.updates};
}

// ── many ────────────────────────────────────────────────────────────────────────────────────────────────────────────

typedef struct pool {
  const trials_plan *plan;
  double until_s;
  const suspect *fixed;  // changes of all trials
  size_t fixed_count;
  size_t done, total;  // for the progress
} pool;

// Starts the trial; returns the end to read its result from, or -1.
static int start(const pool *self, const suspect *one) {
  int ends[2];
  if (pipe(ends) != 0) return -1;
  const pid_t pid = fork();
  if (pid == 0) {
    suspect changes[TRIALS_FOUND_MAX + 1];
    memcpy(changes, self->fixed, self->fixed_count * sizeof *changes);
    changes[self->fixed_count] = *one;
    (void)close(ends[0]);
    const trial_result result = drive(self->plan, self->until_s, changes, self->fixed_count + 1);
    _exit(write(ends[1], &result, sizeof result) == sizeof result ? 0 : 1);
  }
  (void)close(ends[1]);
  if (pid > 0) return ends[0];
  (void)close(ends[0]);
  return -1;
}

static trial_result finish(int end) {
  trial_result result = {0};
  if (end < 0) return result;
  if (read(end, &result, sizeof result) != sizeof result) result = (trial_result){0};
  (void)close(end);
  (void)wait(NULL);
  return result;
}

static void run_all(pool *self, const suspect *of, size_t count, trial_result *results) {
  const long processors = sysconf(_SC_NPROCESSORS_ONLN);
  const size_t at_once = processors > 1 ? (size_t)processors : 1;
  int ends[SUSPECTS_MAX];
  for (size_t started = 0, read = 0; read < count; read++) {
    while (started < count && started < read + at_once) {
      ends[started] = start(self, &of[started]);
      started++;
    }
    results[read] = finish(ends[read]);
    if (self->plan->progress)
      self->plan->progress(self->plan->progress_context, (double)++self->done / (double)self->total);
  }
}

static size_t best_of(const trial_result *results, size_t count) {
  size_t best = 0;
  for (size_t i = 1; i < count; i++)
    if (results[i].is_valid && (!results[best].is_valid || results[i].score > results[best].score)) best = i;
  return best;
}

// A clock's offset between the steps of the list: thrice to a third of the step.
static void refine_time(pool *self, suspect *one, trial_result *result) {
  double step_s = fmax(0.05, 0.25 * fabs(one->value));
  for (int round = 0; round < 3; round++, step_s /= 3) {
    const suspect near[] = {{one->kind, one->source, one->sensor, one->value - step_s},
                            {one->kind, one->source, one->sensor, one->value + step_s},
                            {one->kind, one->source, one->sensor, one->value - step_s / 2},
                            {one->kind, one->source, one->sensor, one->value + step_s / 2}};
    trial_result results[4];
    run_all(self, near, 4, results);
    const size_t best = best_of(results, 4);
    if (!results[best].is_valid || results[best].score <= result->score) continue;
    *one = near[best];
    *result = results[best];
  }
}

// In two rounds: all of them over a part of the recording, then the best and the unchanged one over all of it.
static size_t race(pool *self, double part_s, double whole_s, suspect *best, trial_result *unchanged,
                   trial_result *result) {
  trial_result results[SUSPECTS_MAX];
  suspect finalists[FINALISTS];
  size_t count = 1;
  self->until_s = part_s;
  run_all(self, self->plan->suspects, self->plan->count, results);
  finalists[0] = self->plan->suspects[0];
  for (results[0].is_valid = 0; count < FINALISTS; count++) {
    const size_t i = best_of(results, self->plan->count);
    if (!results[i].is_valid) break;
    finalists[count] = self->plan->suspects[i];
    results[i].is_valid = 0;
  }
  self->until_s = whole_s;
  run_all(self, finalists, count, results);
  const size_t i = best_of(results, count);
  *unchanged = results[0];
  *result = results[i];
  *best = finalists[i];
  return i;
}

size_t trials_run(const trials_plan *plan, suspect found[TRIALS_FOUND_MAX], trial_result *before, trial_result *after) {
  const long processors = sysconf(_SC_NPROCESSORS_ONLN);
  const double all_s = plan->drive_s * (double)plan->count / (double)(processors > 0 ? processors : 1);
  pool self = {.plan = plan, .fixed = found, .total = plan->count + FINALISTS};
  const double share = fmin(1, BUDGET_S / all_s);
  const double part_s = fmax(PART_MIN_S, 0.25 * share * plan->recorded_s);
  const double whole_s = share < 1 ? fmax(PART_MIN_S, share * plan->recorded_s) : 0;
  *before = *after = (trial_result){0};
  while (self.fixed_count < TRIALS_FOUND_MAX) {
    self.done = 0;
    suspect *one = &found[self.fixed_count];
    trial_result unchanged, result;
    const size_t best = race(&self, part_s, whole_s, one, &unchanged, &result);
    if (self.fixed_count == 0) *before = *after = unchanged;
    if (best == 0 || result.score < after->score + GAIN_MIN) break;
    *after = result;
    if (one->kind == SUSPECT_TIME) refine_time(&self, one, after);
    self.fixed_count++;
    if (after->explained > 0.97) break;  // nothing is left to explain
  }
  return after->explained >= EXPLAINED_MIN ? self.fixed_count : 0;
}
