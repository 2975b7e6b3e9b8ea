// SPDX-License-Identifier: Apache-2.0
#include "cli/check/trials.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include "cli/check/changed_copy.h"
#include "output/drive_evidence.h"
#include "rt/forked.h"
#include "waymark/recording.h"

// After this time no further round is begun. It is counted in the processors' time, which other programs on the same
// computer do not lengthen. A round's first and second pass and all pairs may take these shares of what is left of it:
// of longer recordings a part is driven.
#define BUDGET_S 50.0
#define FIRST_SHARE 0.4
#define SECOND_SHARE 0.3
#define LONGEST_SHARE 0.6  // of a first pass that takes longer than expected
#define PAIRS_SHARE 0.8
#define LEAST_S 3.0
#define PART_MIN_S 10.0
#define PART_MAX_S 60.0
#define PART_STEP_S 5.0  // parts are multiples of it: the same for drives that took nearly the same time
// A change explains the observations if each update gains so much of log likelihood, nats, and most updates are fused.
#define GAIN_MIN 0.1
#define EXPLAINED_MIN 0.85
#define EQUAL_MOST 0.01     // nats an update: the drives of two changes with the same effect differ by less
#define EXPLAINED_ALL 0.97  // then nothing is left to explain
#define FINALISTS 8
#define FIRSTS 4           // changes of which each is tried together with all others where none helps alone
#define YAW_GAIN_MIN 0.02  // nats an update; below, the round value is kept: the filter's own state takes the rest
// A drive that drops half of the observations is no better for it.
#define UPDATES_MIN 0.5
// nats an update, for each state of calibration beyond these limits: more than GAIN_MIN, less than wrong poses cost.
#define CALIBRATION_COST 0.2
#define DOUBT_COST 0.2  // likewise, of a drive that is degraded or lost from its beginning to its end
#define CALIBRATION_SIGMAS 3.0
#define SCALE_MAX 1.5
#define OFFSET_MAX_S 0.25
#define YAW_MAX_RAD 0.5

// ── one trial, in a process of its own ──────────────────────────────────────────────────────────────────────────────

typedef struct trial {
  drive_evidence evidence;
  id_votes votes;
} trial;

typedef struct trial_message {
  trial_result result;
  id_table table;
} trial_message;

static void arrived(void *context, const wm_event *event) { id_votes_arrived(&((trial *)context)->votes, event); }

static void put(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  trial *self = context;
  (void)bytes;
  evidence_put(&self->evidence, kind, record);
  if (kind == WM_OUTPUT_INNOVATION && self->votes.given) id_votes_take(&self->votes, record);
}

// States that ended beyond these limits, and by more than their own sigma explains.
static double calibration_cost(const wm_assembly *assembly, const wm_health *health) {
  int count = 0;
  for (uint32_t i = 0; i < health->calibration_count; i++) {
    const wm_calibration_value *c = &health->calibration[i];
    const int is_scale = strstr(c->name, "_scale") != NULL;
    if (fabs(c->value - is_scale) < CALIBRATION_SIGMAS * c->sigma) continue;
    if (is_scale)
      count += c->value < 1 / SCALE_MAX || c->value > SCALE_MAX || evidence_scale_contradicts(assembly, c);
    else if (strstr(c->name, ".time_offset_s"))
      count += fabs(c->value) > OFFSET_MAX_S;
    else if (strstr(c->name, ".yaw_rad"))
      count += fabs(c->value) > YAW_MAX_RAD;
  }
  return CALIBRATION_COST * count;
}

// What the monitor finds, as the turn's sign, costs no likelihood: time-correlated errors and noise take it up.
static double doubt_cost(const drive_evidence *self) {
  const uint64_t doubted = self->states[WM_STATE_DEGRADED] + self->states[WM_STATE_LOST];
  return self->published > 0 ? DOUBT_COST * (double)doubted / (double)self->published : 0;
}

size_t trials_edits(const trials_plan *plan, const suspect *of, size_t count, file_edit out[TRIAL_EDITS_MAX]) {
  size_t used = 0;
  for (size_t i = 0; i < count; i++) {
    if (of[i].kind == SUSPECT_NONE) continue;
    const size_t n = suspect_edits(&of[i], plan->assembly, plan->files, out + used);
    if (n == 0) return 0;
    used += n;
  }
  return used;
}

static wm_status open_changed(const trials_plan *plan, const file_edit *edits, size_t count, const char *folder,
                              wm_recording **out, wm_error *err) {
  if (count == 0) return wm_recording_open(plan->dir, &plan->config->overrides, NULL, NULL, out, err);
  changed_copy copy = {.dir = plan->dir};
  (void)snprintf(copy.out, sizeof copy.out, "%s", folder);
  wm_status status = changed_copy_make(&copy, &plan->config->overrides, edits, count, "", err);
  return status == WM_OK ? wm_recording_open(copy.out, &copy.overrides, NULL, NULL, out, err) : status;
}

// The plan's configuration, or one with the edits.
static const wm_config *config_of(const trials_plan *plan, const file_edit *edits, size_t count, wm_config *changed,
                                  wm_error *err) {
  char *text;
  size_t length;
  if (changed_config(edits, count, "", &text, &length, err) != WM_OK) return NULL;
  if (!text) return plan->config;
  const wm_status status = wm_config_parse(text, length, plan->config->path, changed, err);
  changed->overrides = plan->config->overrides;
  free(text);
  return status == WM_OK ? changed : NULL;
}

static trial_message drive(const trials_plan *plan, const char *folder, double until_s, const suspect *changes,
                           size_t count) {
  static trial self;
  static wm_run_report report;
  trial_message none = {0}, done = {0};
  file_edit edits[TRIAL_EDITS_MAX];
  wm_recording *recording = NULL;
  wm_error err = {0};
  const size_t edit_count = trials_edits(plan, changes, count, edits);
  if (edit_count == 0 && changes[count - 1].kind != SUSPECT_NONE) return none;
  static wm_config changed;
  const wm_config *config = config_of(plan, edits, edit_count, &changed, &err);
  if (!config || open_changed(plan, edits, edit_count, folder, &recording, &err) != WM_OK) return none;
  if (changes[count - 1].kind == SUSPECT_NO_IDENTITY) self.votes.given = plan->ids;
  const wm_replay_watch watch = {.context = &self, .arrived = self.votes.given ? arrived : NULL, .put = put};
  const wm_replay_options options = {.watch = &watch, .seed = 1, .until_s = until_s};
  const wm_status status = wm_replay_recording(config, recording, &options, &report, &err);
  wm_recording_close(recording);
  if (status != WM_OK || self.evidence.updates == 0) return none;
  done.result = (trial_result){.is_valid = 1,
                               .updates = self.evidence.updates,
                               .score = evidence_score(&self.evidence) -
                                        calibration_cost(plan->assembly, &report.health) - doubt_cost(&self.evidence),
                               .explained = (double)self.evidence.fused / (double)self.evidence.updates};
  if (self.votes.given) id_votes_table(&self.votes, &done.table);
  return done;
}

// ── many ────────────────────────────────────────────────────────────────────────────────────────────────────────────

typedef struct pool {
  const trials_plan *plan;
  char folder[64];  // of the copies
  double until_s;
  const suspect *fixed;  // changes of all trials
  size_t fixed_count;
  const suspect *of;   // one a trial, beside these
  size_t done, total;  // for the progress
  size_t started;
  id_table *table;     // of the trial without identities
  double begin_s;      // of spent_s
  double at_once;      // processes
  double used_s;       // of the budget, when the last trial ended
  double pass_left_s;  // of left_s where a pass ends: trials of it that have not begun are left out
} pool;

// Processor time of all trials that have ended, s.
static double spent_s(void) {
  struct rusage all;
  if (getrusage(RUSAGE_CHILDREN, &all) != 0) return 0;
  return (double)(all.ru_utime.tv_sec + all.ru_stime.tv_sec) +
         1e-6 * (double)(all.ru_utime.tv_usec + all.ru_stime.tv_usec);
}

static double left_s(const pool *self) { return BUDGET_S - self->used_s; }

// Ends this process after so much processor time.
static void limit_s(double most_s) {
  const struct itimerval limit = {.it_value = {.tv_sec = (time_t)ceil(most_s)}};
  (void)setitimer(ITIMER_PROF, &limit, NULL);
}

// Of the recording, s: what `count` drives take in `most_s`.
static double part_of(const pool *self, size_t count, double most_s) {
  const double all_s = self->plan->drive_s * (double)count / self->at_once;
  if (all_s <= most_s) return fmax(PART_MIN_S, self->plan->recorded_s);
  return fmax(PART_MIN_S, PART_STEP_S * floor(self->plan->recorded_s * most_s / all_s / PART_STEP_S));
}

static void job(void *context, size_t index, void *result) {
  const pool *self = context;
  char folder[96];
  (void)snprintf(folder, sizeof folder, "%s/%zu", self->folder, self->started + index);
  suspect changes[TRIALS_FOUND_MAX + 2];
  if (self->fixed_count > 0) memcpy(changes, self->fixed, self->fixed_count * sizeof *changes);
  changes[self->fixed_count] = self->of[index];
  // A change may make a drive endless.
  if (left_s(self) < self->pass_left_s) return;
  limit_s(fmax(LEAST_S, fmin(10 + 4 * self->plan->drive_s, self->at_once * left_s(self))));
  *(trial_message *)result = drive(self->plan, folder, self->until_s, changes, self->fixed_count + 1);
  changed_copy made = {.dir = self->plan->dir};
  (void)snprintf(made.out, sizeof made.out, "%s", folder);
  changed_copy_remove(&made);
}

static void one_done(void *context) {
  pool *self = context;
  self->used_s = (spent_s() - self->begin_s) / self->at_once;
  self->done++;
  if (self->plan->progress)
    self->plan->progress(self->plan->progress_context, fmin(1, (double)self->done / (double)self->total));
}

static void run_all(pool *self, const suspect *of, size_t count, trial_result *results) {
  static trial_message messages[SUSPECTS_MAX];
  self->of = of;
  wm_forked_run(&(wm_forked){self, job, sizeof *messages, one_done}, count, messages);
  self->started += count;
  for (size_t i = 0; i < count; i++) {
    results[i] = messages[i].result;
    if (of[i].kind == SUSPECT_NO_IDENTITY) *self->table = messages[i].table;
  }
}

// The first with the best score; an invalid one only where all are.
static size_t best_of(const trial_result *results, size_t count) {
  size_t best = 0;
  for (size_t i = 1; i < count; i++)
    if (results[i].is_valid && (!results[best].is_valid || results[i].score > results[best].score)) best = i;
  return best;
}

static double refine_step(const suspect *one) {
  if (one->kind == SUSPECT_TIME) return fmin(1, fmax(0.05, 0.25 * fabs(one->value)));
  if (one->kind == SUSPECT_MOUNTING_YAW) return 0.3;
  if (one->kind == SUSPECT_MOUNTING_X || one->kind == SUSPECT_MOUNTING_Y) return 0.15;
  return 0;
}

// A value between the steps of the list, by ever smaller steps to both sides.
static void refine(pool *self, suspect *one, trial_result *result) {
  const suspect begun = *one;
  const trial_result at_first = *result;
  double step = refine_step(one);
  for (int round = 0; round < 4 && step > 0 && left_s(self) > LEAST_S; round++, step /= 3) {
    suspect near[4] = {*one, *one, *one, *one};
    const double sides[4] = {-step, step, -step / 2, step / 2};
    trial_result results[4];
    for (int i = 0; i < 4; i++) near[i].value += sides[i];
    run_all(self, near, 4, results);
    const size_t best = best_of(results, 4);
    if (!results[best].is_valid || results[best].score <= result->score) continue;
    *one = near[best];
    *result = results[best];
  }
  if (begun.kind != SUSPECT_MOUNTING_YAW || result->score >= at_first.score + YAW_GAIN_MIN) return;
  *one = begun;
  *result = at_first;
}

typedef struct race_result {
  suspect finalists[FINALISTS];  // the unchanged one first
  trial_result results[FINALISTS];
  size_t count, best;
} race_result;

// In two passes: all of them over a part of the recording, in at most `most_s`, then the best and the unchanged one
// over `whole_s` of it; 0: one pass.
static void race(pool *self, double most_s, double part_s, double whole_s, race_result *out) {
  static trial_result results[SUSPECTS_MAX];
  const trials_plan *plan = self->plan;
  suspect by_table = {0};
  int is_apart = 0;  // clocks: then the parts of two drives are not of the same time
  out->count = 1;
  self->until_s = part_s;
  self->table->count = 0;
  self->pass_left_s = left_s(self) - most_s;
  run_all(self, plan->suspects, plan->count, results);
  self->pass_left_s = 0;
  for (size_t i = 0; i < plan->count; i++) is_apart |= plan->suspects[i].kind == SUSPECT_TIME_FACTOR;
  const uint64_t enough = is_apart ? 1 : (uint64_t)(UPDATES_MIN * (double)results[0].updates);
  out->finalists[0] = plan->suspects[0];
  out->results[0] = results[0];
  results[0].is_valid = 0;
  for (size_t i = 1; i < plan->count; i++) {
    const int is_no_identity = plan->suspects[i].kind == SUSPECT_NO_IDENTITY;
    results[i].is_valid &= results[i].updates >= enough && !is_no_identity;
    if (!is_no_identity || whole_s <= 0) continue;
    // The table needs each landmark: over all of the recording.
    trial_result unused;
    self->until_s = whole_s;
    run_all(self, &plan->suspects[i], 1, &unused);
    self->until_s = part_s;
    if (self->table->count == 0) continue;
    by_table = plan->suspects[i];
    by_table.kind = SUSPECT_IDENTITY_TABLE;
    by_table.ids = self->table;
  }
  const size_t places = by_table.kind == SUSPECT_NONE ? FINALISTS : FINALISTS - 1;
  for (; out->count < places; out->count++) {
    const size_t i = best_of(results, plan->count);
    if (!results[i].is_valid) break;
    out->finalists[out->count] = plan->suspects[i];
    out->results[out->count] = results[i];
    results[i].is_valid = 0;
  }
  if (by_table.kind != SUSPECT_NONE) out->finalists[out->count++] = by_table;  // last: a plain shift stands before it
  self->until_s = whole_s;
  if (whole_s > 0) run_all(self, out->finalists, out->count, out->results);
  out->best = best_of(out->results, out->count);
}

// Two mistakes of which neither helps alone: each of the best first ones together with all.
static int race_pairs(pool *self, const race_result *alone, suspect *found, trial_result *result) {
  suspect pairs[FIRSTS][2];
  trial_result results[FIRSTS];
  static race_result second;
  size_t count = 0;
  const suspect *const fixed = self->fixed;
  const double pairs_s = left_s(self);
  const double part_s = fmin(PART_MAX_S, part_of(self, FIRSTS * self->plan->count, PAIRS_SHARE * pairs_s));
  for (size_t i = 1; i < alone->count && count < FIRSTS && left_s(self) > LEAST_S; i++) {
    pairs[count][0] = alone->finalists[i];
    if (pairs[count][0].kind == SUSPECT_IDENTITY_TABLE) continue;
    self->fixed = pairs[count];
    self->fixed_count = 1;
    race(self, PAIRS_SHARE / FIRSTS * pairs_s, part_s, 0, &second);
    pairs[count][1] = second.finalists[second.best];
    count++;
  }
  self->until_s = part_of(self, FIRSTS, SECOND_SHARE * BUDGET_S);
  for (size_t i = 0; i < count; i++) {
    self->fixed = pairs[i];
    self->fixed_count = 1;
    run_all(self, &pairs[i][1], 1, &results[i]);
  }
  self->fixed = fixed;
  self->fixed_count = 0;
  const size_t best = count > 0 ? best_of(results, count) : 0;
  if (count == 0 || !results[best].is_valid || results[best].score < alone->results[0].score + GAIN_MIN) return 0;
  memcpy(found, pairs[best], sizeof pairs[best]);
  *result = results[best];
  return pairs[best][1].kind == SUSPECT_NONE ? 1 : 2;
}

// Changes of another kind with the same effect as the best one: the recording cannot tell which of them is right.
static void take_equals(const race_result *round, trials_found *out) {
  const trial_result *best = &round->results[round->best];
  for (size_t i = 1; i < round->count && out->equal_count < TRIALS_EQUAL_MAX; i++) {
    const trial_result *r = &round->results[i];
    const suspect *one = &round->finalists[i];  // a table of identities is also any shift of them
    const int is_other =
        i != round->best && one->kind != round->finalists[round->best].kind && one->kind != SUSPECT_IDENTITY_TABLE;
    if (is_other && r->is_valid && r->explained >= EXPLAINED_MIN && r->score > best->score - EQUAL_MOST)
      out->equal[out->equal_count++] = round->finalists[i];
  }
}

static void search(pool *self, trials_found *out) {
  trial_result *after = &out->after;
  static race_result round;
  while (self->fixed_count < TRIALS_FOUND_MAX && left_s(self) > LEAST_S) {
    suspect *one = &out->at[self->fixed_count];
    self->done = 0;
    race(self, LONGEST_SHARE * left_s(self),
         fmin(PART_MAX_S, part_of(self, self->plan->count, FIRST_SHARE * left_s(self))),
         part_of(self, FINALISTS, SECOND_SHARE * left_s(self)), &round);
    if (self->fixed_count == 0) out->before = *after = round.results[0];
    const trial_result *best = &round.results[round.best];
    if (round.best == 0 || !best->is_valid || (after->is_valid && best->score < after->score + GAIN_MIN)) {
      if (self->fixed_count > 0 || after->explained >= EXPLAINED_MIN) break;
      self->total = FIRSTS * self->plan->count;
      self->done = 0;
      self->fixed_count = (size_t)race_pairs(self, &round, out->at, after);
      break;
    }
    *after = *best;
    *one = round.finalists[round.best];
    if (self->fixed_count == 0) take_equals(&round, out);
    refine(self, one, after);
    self->fixed_count++;
    if (after->explained > EXPLAINED_ALL || one->kind == SUSPECT_IDENTITY_TABLE) break;
  }
}

void trials_run(const trials_plan *plan, trials_found *out) {
  const long processors = sysconf(_SC_NPROCESSORS_ONLN);
  *out = (trials_found){0};
  pool self = {.plan = plan,
               .fixed = out->at,
               .total = plan->count + FINALISTS,
               .table = &out->table,
               .begin_s = spent_s(),
               .at_once = (double)(processors > 0 ? processors : 1)};
  const char *temporary = getenv("TMPDIR");
  (void)snprintf(self.folder, sizeof self.folder, "%.40s/waymark-check-XXXXXX", temporary ? temporary : "/tmp");
  if (!mkdtemp(self.folder)) return;
  search(&self, out);
  changed_copy folder = {.dir = plan->dir};
  (void)snprintf(folder.out, sizeof folder.out, "%s", self.folder);
  changed_copy_remove(&folder);
  if (out->after.explained >= EXPLAINED_MIN) out->count = self.fixed_count;
  if (out->count != 1) out->equal_count = 0;  // one of several causes: each of them was tried with the others
}
