// SPDX-License-Identifier: Apache-2.0
// A source's clock that runs fast, slow or apart, by the turns that two sources show: moved onto each other by a delay
// and a rate they are alike, as they are stamped they are not.
#include <math.h>
#include <stdio.h>

#include "cli/check/comparisons.h"

#define WINDOWS_MOST 2400  // ten minutes of a drive tell a clock
#define WINDOWS_MIN 40
#define RATE_MOST 0.06     // of a clock: quartz is off by 1e-4, a sampling rate that is stated wrong by some per cent
#define DELAY_MOST 24      // windows
#define APART_MIN_S 0.7    // at one end of the drive; below, a filter's or a robot's own lag
#define LIKE 0.8           // correlation of turns that are the same
#define ALIKE 0.98         // so that no clock has to be looked for
#define REST 0.5           // share of what was unlike that may be left for another clock to be believed
#define TURN_RMS_MIN 0.02  // rad/s
#define STEP_WINDOWS 2.0   // of a search, at the end of the drive
#define FINE 8             // parts of a step
#define RATE_SEEN 0.0015   // below, over ten minutes, a delay alone
#define SOURCES_MOST 8

typedef struct clock_fit {
  double r;      // size of the correlation
  double delay;  // windows by which b is later at the beginning
  double rate;   // by which b's clock is faster
} clock_fit;

// Mean of b over the window that begins at `at`; NaN: not covered.
static double held(const channel *b, double at) {
  if (!(at >= 0) || at + 1 >= (double)b->windows) return (double)NAN;
  const size_t k = (size_t)at;
  const double part = at - (double)k;
  if ((double)b->cover[k] < 0.8 * WINDOW_S || (double)b->cover[k + 1] < 0.8 * WINDOW_S) return (double)NAN;
  return (1 - part) * (double)b->sum[k] + part * (double)b->sum[k + 1];
}

static double likeness(const channel *a, const channel *b, size_t first, size_t count, double delay, double rate) {
  double aa = 0, bb = 0, ab = 0;
  size_t pairs = 0;
  for (size_t i = 0; i < count; i++) {
    const double x = held(a, (double)(first + i)), y = held(b, (double)first + (double)i * (1 + rate) + delay);
    if (isnan(x) || isnan(y)) continue;
    aa += x * x;
    bb += y * y;
    ab += x * y;
    pairs++;
  }
  const double rms = sqrt(fmin(aa, bb) / (double)(pairs ? pairs : 1)) / WINDOW_S;
  return pairs < WINDOWS_MIN || 2 * pairs < count || rms < TURN_RMS_MIN ? 0 : fabs(ab) / sqrt(aa * bb);
}

// The best of a grid about a delay and a rate.
static void search(const channel *a, const channel *b, size_t first, size_t count, const double most[2],
                   const double step[2], clock_fit *best) {
  const clock_fit middle = *best;
  for (double rate = -most[1]; rate <= most[1] + 1e-12; rate += step[1])
    for (double delay = -most[0]; delay <= most[0] + 1e-9; delay += step[0]) {
      const double r = likeness(a, b, first, count, middle.delay + delay, middle.rate + rate);
      if (r > best->r) *best = (clock_fit){r, middle.delay + delay, middle.rate + rate};
      if (step[0] <= 0) break;
    }
}

// Whether b's clock is another one than a's, and which; `before`: the likeness as they are stamped.
static int is_apart(const channel *a, const channel *b, clock_fit *out, double *before) {
  size_t first = 0, end = a->windows < b->windows ? a->windows : b->windows;
  while (first < end && !((double)a->cover[first] > 0 && (double)b->cover[first] > 0)) first++;
  while (end > first && !((double)a->cover[end - 1] > 0 && (double)b->cover[end - 1] > 0)) end--;
  const size_t count = end - first < WINDOWS_MOST ? end - first : WINDOWS_MOST;
  if (count < WINDOWS_MIN) return 0;
  *out = (clock_fit){likeness(a, b, first, count, 0, 0), 0, 0};
  search(a, b, first, count, (double[2]){APART_MIN_S / WINDOW_S, 0}, (double[2]){0.5, 1}, out);
  *before = out->r;
  if (*before > ALIKE) return 0;
  const double rate_step = STEP_WINDOWS / (double)count;
  search(a, b, first, count, (double[2]){DELAY_MOST, RATE_MOST}, (double[2]){STEP_WINDOWS, rate_step}, out);
  search(a, b, first, count, (double[2]){STEP_WINDOWS, rate_step}, (double[2]){STEP_WINDOWS / FINE, rate_step / FINE},
         out);
  const double end_windows = out->delay + out->rate * (double)count;
  if (!(out->r > LIKE) || 1 - out->r > REST * (1 - *before)) return 0;
  return fmax(fabs(out->delay), fabs(end_windows)) * WINDOW_S > APART_MIN_S;
}

// The turn that a source shows best: of a twist, else of what is integrated, else of a gyro. NULL: none, a command, or
// of a clock that jumps or is coarse.
static const channel *turn_of(const channels *all, uint16_t source, const char *name, const wm_findings *found) {
  static const channel_kind kBest[] = {CHANNEL_TWIST_TURN, CHANNEL_INCREMENT_TURN, CHANNEL_YAW_RATE, CHANNEL_TICKS_TURN,
                                       CHANNEL_WHEELS_TURN};
  const wm_finding_id said[] = {WM_FOUND_CLOCK_JUMPED, WM_FOUND_CLOCK_COARSE, WM_FOUND_CLOCKS_APART};
  for (size_t i = 0; i < sizeof said / sizeof said[0]; i++)
    if (wm_findings_has(found, said[i], name)) return NULL;
  for (size_t k = 0; k < sizeof kBest / sizeof kBest[0]; k++)
    for (size_t i = 0; i < all->count; i++)
      if (all->at[i].kind == kBest[k] && all->at[i].source == source)
        return channels_are_commands(all, &all->at[i]) ? NULL : &all->at[i];
  return NULL;
}

static void says(const char *name, const char *other, const clock_fit *f, double before, wm_findings *out) {
  char fix[WM_FINDING_FIX_MAX], runs[48] = "", later[48] = "", by_rate[64] = "", by_delay[48] = "";
  const double delay_s = f->delay * WINDOW_S;
  const int has_rate = fabs(f->rate) > RATE_SEEN, has_delay = fabs(delay_s) > WINDOW_S || !has_rate;
  if (has_rate) {
    (void)snprintf(runs, sizeof runs, "runs %.2g %% %s", 100 * fabs(f->rate), f->rate > 0 ? "fast" : "slow");
    (void)snprintf(by_rate, sizeof by_rate, " less %.3g times the time since the first row", f->rate / (1 + f->rate));
  }
  if (has_delay) {
    (void)snprintf(later, sizeof later, "%sis %.2f s %s", has_rate ? " and " : "", fabs(delay_s),
                   delay_s > 0 ? "late" : "early");
    (void)snprintf(by_delay, sizeof by_delay, "%s less %.2f s", has_rate ? "," : "", delay_s);
  }
  (void)snprintf(fix, sizeof fix,
                 "t_ns of %.40s%s%s; or that of %.40s is wrong, the other way round. Stamp both by one clock", name,
                 by_rate, by_delay, other);
  wm_find(out, WM_FOUND_CLOCK_DRIFTS, WM_SEVERITY_BAD, name, fix,
          "its clock %s%s against that of %s: moved so, their turns are alike (r %.2f), as they are stamped less so "
          "(r %.2f)",
          runs, later, other, f->r, before)
      ->size = has_rate ? f->rate : delay_s;
}

// Of two sources the one that fewer others agree with is named, else the later one of the recording's.
void drifts_judge(const channels *self, const wm_assembly *assembly, wm_findings *out) {
  const channel *of[SOURCES_MOST];
  clock_fit fit;
  double before = 0;
  int apart[SOURCES_MOST] = {0};
  size_t count = 0, best = 0;
  for (uint16_t source = 0; source < assembly->source_count && count < SOURCES_MOST; source++)
    if ((of[count] = turn_of(self, source, wm_assembly_source_name(assembly, source), out)) != NULL &&
        of[count]->windows > 0)
      count++;
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < count; k++) apart[i] += k != i && is_apart(of[k], of[i], &fit, &before);
  for (size_t i = 1; i < count; i++)
    if (apart[i] < apart[best]) best = i;
  for (size_t i = 0; i < count; i++)
    if (i != best && is_apart(of[best], of[i], &fit, &before))
      says(wm_assembly_source_name(assembly, of[i]->source), wm_assembly_source_name(assembly, of[best]->source), &fit,
           before, out);
}
