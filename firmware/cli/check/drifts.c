// SPDX-License-Identifier: Apache-2.0
// A source's clock that runs fast, slow or apart, by the turns that two sources show. Each block of the drive gives the
// delay of one turn rate against the other by least squares. The line through the blocks' delays is the clock's offset
// and rate; the delays' scatter about the line gives their sigmas.
#include <math.h>
#include <stdio.h>

#include "cli/check/comparisons.h"

#define WINDOWS_MOST 2400  // ten minutes of a drive tell a clock
#define WINDOWS_MIN 40
#define BLOCKS 20
#define WEIGHT_MIN 0.1  // of the mean block's: a block with hardly a turn has no delay
// By how much a lag differs from turn to turn, before the blocks say so: a period of a slow sensor. As good as so many
// blocks: the scatter of a few turns is hardly known.
#define LAG_S 0.05
#define LAG_BLOCKS 8
#define CHANCE_SIGMAS 3.9  // of a normal distribution: one of 10,000 by chance
#define APART_MIN_S 0.7    // at one end of the drive; below, a filter's or a robot's own lag
#define GROWN_MIN_S 0.25   // over the drive: a lag does not grow; at 1 rad/s the heading is off by 14 degrees
#define RATE_MOST 0.06     // of a clock: quartz is off by 1e-4, a sampling rate that is stated wrong by some per cent
#define DELAY_MOST 24      // windows
#define LIKE 0.8           // correlation of turns that are the same
#define ALIKE 0.98         // so that no clock has to be looked for far away
#define TURN_RMS_MIN 0.02  // rad/s
#define AWAY (0.1 / DELAY_MOST)  // of r, a window: of turns that repeat themselves the nearest delay is taken
#define STEP_WINDOWS 2.0         // of a search; of the rate, at the end of the drive
#define SLOPE_WINDOWS 2.0        // to each side of a slope
#define ROUNDS 8                 // of least squares
#define SOURCES_MOST 8
#define ENDS_MIN_S 0.5    // by which a clock that runs by itself ends later than another source
#define ENDS_KNOWN_S 0.1  // of a stream that begins and ends with its recorder
#define ENDS_SHARE 0.25   // by which the turns' delay may differ from that of such a clock

// Two turn rates over the windows that both have.
typedef struct pair {
  const channel *a, *b;
  size_t first, count;
} pair;

typedef struct clock_fit {
  double delay, rate;                               // b is later: windows at the first window, windows a window
  double r;                                         // correlation of the turns, moved so
  double gain, zero;                                // b is gain times a, plus zero
  double freedom, delay_sigma, rate_sigma, middle;  // of the delay at `middle`, windows, where it is best known
} clock_fit;

// Mean of b over the window that begins at `at`; NaN: not covered.
static double held(const channel *b, double at) {
  if (!(at >= 0) || at + 1 >= (double)b->windows) return (double)NAN;
  const size_t k = (size_t)at;
  const double part = at - (double)k;
  if ((double)b->cover[k] < 0.8 * WINDOW_S || (double)b->cover[k + 1] < 0.8 * WINDOW_S) return (double)NAN;
  return (1 - part) * (double)b->sum[k] + part * (double)b->sum[k + 1];
}

// Of b, where it shows what a shows at window i.
static double moved(const pair *p, const clock_fit *f, size_t i) {
  return (double)p->first + (double)i * (1 + f->rate) + f->delay;
}

typedef struct sums {
  double n, x, y, xx, xy, yy;
} sums;

static void add(sums *s, double weight, double x, double y) {
  s->n += weight;
  s->x += weight * x;
  s->y += weight * y;
  s->xx += weight * x * x;
  s->xy += weight * x * y;
  s->yy += weight * y * y;
}

// Means, and the squares about them.
static sums centred(const sums *s) {
  const double x = s->x / s->n, y = s->y / s->n;
  return (sums){s->n, x, y, s->xx - s->x * x, s->xy - s->x * y, s->yy - s->y * y};
}

// Fills in r, gain and zero.
static void compare(const pair *p, clock_fit *f) {
  sums all = {0};
  for (size_t i = 0; i < p->count; i++) {
    const double x = held(p->a, (double)(p->first + i)), y = held(p->b, moved(p, f, i));
    if (!isnan(x) && !isnan(y)) add(&all, 1, x, y);
  }
  const sums c = centred(&all);
  const int is_known =
      c.n >= WINDOWS_MIN && 2 * c.n >= (double)p->count && sqrt(fmin(c.xx, c.yy) / c.n) >= TURN_RMS_MIN * WINDOW_S;
  f->r = is_known ? fabs(c.xy) / sqrt(c.xx * c.yy) : 0;
  f->gain = is_known ? c.xy / c.xx : 0;
  f->zero = c.y - f->gain * c.x;
}

// The best of a grid about a delay and a rate.
static clock_fit search(const pair *p, double most_delay, double most_rate) {
  clock_fit best = {0};
  compare(p, &best);
  const double rate_step = STEP_WINDOWS / (double)p->count;
  for (double rate = -most_rate; rate <= most_rate + 1e-12; rate += rate_step)
    for (double delay = -most_delay; delay <= most_delay; delay += STEP_WINDOWS) {
      clock_fit f = {.delay = delay, .rate = rate};
      compare(p, &f);
      if (f.r - AWAY * fabs(f.delay) > best.r - AWAY * fabs(best.delay)) best = f;
    }
  return best;
}

// Change of a turn over SLOPE_WINDOWS to each side, a window.
static double slope_of(const channel *c, double at) {
  return (held(c, at + SLOPE_WINDOWS) - held(c, at - SLOPE_WINDOWS)) / (2 * SLOPE_WINDOWS);
}

// A step of least squares: the delay that is left in each block, and the line through them. The slope of a is the
// instrument for that of b, so that the noise of neither adds to the weights. 0: too few blocks turn.
static int step(const pair *p, clock_fit *f) {
  double weight[BLOCKS] = {0}, left[BLOCKS] = {0}, whole = 0;
  sums line = {0};
  int blocks = 0;
  for (size_t i = 0; i < p->count; i++) {
    const double from = (double)(p->first + i), to = moved(p, f, i);
    const double slope = f->gain * slope_of(p->a, from), both = slope * slope_of(p->b, to);
    const double off = slope * (f->gain * held(p->a, from) + f->zero - held(p->b, to));
    if (isnan(both) || isnan(off)) continue;
    weight[i * BLOCKS / p->count] += both;
    left[i * BLOCKS / p->count] += off;
    whole += both;
  }
  for (int k = 0; k < BLOCKS; k++) {
    if (!(weight[k] > WEIGHT_MIN * whole / BLOCKS)) continue;
    add(&line, weight[k], (k + 0.5) * (double)p->count / BLOCKS, left[k] / weight[k]);
    blocks++;
  }
  const sums c = centred(&line);
  if (blocks < 3 || !(c.xx > 0)) return 0;
  const double rate = c.xy / c.xx, lag = LAG_S / WINDOW_S, freedom = LAG_BLOCKS + blocks - 2;
  const double scatter = (LAG_BLOCKS * lag * lag * c.n / blocks + fmax(0, c.yy - rate * c.xy)) / freedom;
  f->delay += c.y - rate * c.x;
  f->rate += rate;
  f->middle = c.x;
  f->freedom = freedom;
  f->delay_sigma = sqrt(scatter / c.n);
  f->rate_sigma = sqrt(scatter / c.xx);
  return fabs(f->rate) < 2 * RATE_MOST && fabs(f->delay) < 2 * DELAY_MOST;
}

static clock_fit refined(const pair *p, clock_fit f) {
  for (int k = 0; k < ROUNDS; k++) {
    if (!step(p, &f)) return (clock_fit){0};
    compare(p, &f);
  }
  return f;
}

// Sigmas by chance of Student's distribution [Wallace1959].
static double sigmas_by_chance(double freedom) {
  const double z = CHANCE_SIGMAS * (8 * freedom + 3) / (8 * freedom + 1);
  return sqrt(freedom * expm1(z * z / freedom));
}

// First and last time that is covered, windows.
static void extent_of(const channel *c, double at[2]) {
  size_t first = 0, last = c->windows;
  while (first < last && !((double)c->cover[first] > 0)) first++;
  while (last > first && !((double)c->cover[last - 1] > 0)) last--;
  at[0] = (double)first + 1 - (last > first ? (double)c->cover[first] / WINDOW_S : 1);
  at[1] = last > first ? (double)last - 1 + (double)c->cover[last - 1] / WINDOW_S : (double)last;
}

// A drive with a turn or two shows a delay alone. A stream that begins with another one and ends later, by as much as
// the turns' delay grows to, has a clock that runs.
static int runs_by_ends(const pair *p, clock_fit *f) {
  double a[2], b[2], weight = 0, left = 0, late = 0;
  extent_of(p->a, a);
  extent_of(p->b, b);
  const double span = a[1] - a[0], ends = b[1] - a[1];
  *f = (clock_fit){.rate = ends / span, .rate_sigma = ENDS_KNOWN_S / WINDOW_S / span};
  f->delay = b[0] - a[0] + f->rate * ((double)p->first - a[0]);
  if (fabs(ends) < ENDS_MIN_S / WINDOW_S || fabs(b[0] - a[0]) > ENDS_KNOWN_S / WINDOW_S || fabs(f->rate) > RATE_MOST)
    return 0;
  compare(p, f);
  for (size_t i = 0; i < p->count; i++) {
    const double from = (double)(p->first + i), to = moved(p, f, i);
    const double slope = f->gain * slope_of(p->a, from), both = slope * slope_of(p->b, to);
    const double off = slope * (f->gain * held(p->a, from) + f->zero - held(p->b, to));
    if (isnan(both) || isnan(off)) continue;
    weight += both;
    left += off;
    late += both * (to - from);
  }
  return f->r > ALIKE && weight > 0 && fabs(late / weight) > ENDS_KNOWN_S / WINDOW_S &&
         fabs(left) < ENDS_SHARE * fabs(late);
}

// Whether b's clock is another one than a's, and which. A rate that is none is 0.
static int is_apart(const channel *a, const channel *b, clock_fit *out) {
  size_t first = 0, end = a->windows < b->windows ? a->windows : b->windows;
  while (first < end && !((double)a->cover[first] > 0 && (double)b->cover[first] > 0)) first++;
  while (end > first && !((double)a->cover[end - 1] > 0 && (double)b->cover[end - 1] > 0)) end--;
  const pair p = {a, b, first, end - first < WINDOWS_MOST ? end - first : WINDOWS_MOST};
  if (p.count < WINDOWS_MIN) return 0;
  *out = search(&p, APART_MIN_S / WINDOW_S, 0);
  if (out->r < ALIKE) *out = search(&p, DELAY_MOST, RATE_MOST);
  *out = refined(&p, *out);
  const double sigmas = sigmas_by_chance(out->freedom);
  const double grown_s = fabs(out->rate) * (double)p.count * WINDOW_S;
  const double middle_s = fabs(out->delay + out->rate * out->middle) * WINDOW_S;
  const int runs = fabs(out->rate) > sigmas * out->rate_sigma && grown_s > GROWN_MIN_S;
  const int is_late = middle_s > APART_MIN_S && middle_s > sigmas * out->delay_sigma * WINDOW_S;
  clock_fit by_ends;
  if (!runs && runs_by_ends(&p, &by_ends)) {
    *out = by_ends;
    return 1;
  }
  if (!runs) out->delay += out->rate * out->middle;
  if (!runs) out->rate = 0;
  return out->r > LIKE && (runs || is_late);
}

// The turn that a source shows best: of a twist, else of what is integrated, else of a gyro. NULL: none, a command, or
// or of a clock, a counter or a scale that is known to be broken.
static const channel *turn_of(const channels *all, uint16_t source, const wm_assembly *assembly,
                              const wm_findings *found) {
  static const channel_kind kBest[] = {CHANNEL_TWIST_TURN, CHANNEL_INCREMENT_TURN, CHANNEL_YAW_RATE, CHANNEL_TICKS_TURN,
                                       CHANNEL_WHEELS_TURN};
  if (wm_findings_has(found, WM_FOUND_SENSORS_DISAGREE, wm_assembly_source_name(assembly, source))) return NULL;
  for (size_t k = 0; k < sizeof kBest / sizeof kBest[0]; k++)
    for (size_t i = 0; i < all->count; i++)
      if (all->at[i].kind == kBest[k] && all->at[i].source == source &&
          !comparisons_is_broken(&all->at[i], assembly, found))
        return channels_are_commands(all, &all->at[i]) ? NULL : &all->at[i];
  return NULL;
}

static void says(const char *name, const char *other, const clock_fit *f, wm_findings *out) {
  char fix[WM_FINDING_FIX_MAX], runs[64] = "", later[48] = "", by_rate[64] = "", by_delay[48] = "";
  const double delay_s = f->delay * WINDOW_S;
  const int has_rate = f->rate != 0, has_delay = fabs(delay_s) > WINDOW_S || !has_rate;
  if (has_rate) {
    (void)snprintf(runs, sizeof runs, "runs %.2g %% %s (sigma %.2g %%)", 100 * fabs(f->rate),
                   f->rate > 0 ? "fast" : "slow", 100 * f->rate_sigma);
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
          "its clock %s%s against that of %s: moved so, their turns are alike (r %.2f)", runs, later, other, f->r)
      ->size = has_rate ? f->rate : delay_s;
}

// Of two sources the one that fewer others agree with is named, else the later one of the recording's.
void drifts_judge(const channels *self, const wm_assembly *assembly, wm_findings *out) {
  const channel *of[SOURCES_MOST];
  clock_fit fit;
  int apart[SOURCES_MOST] = {0};
  size_t count = 0, best = 0;
  for (uint16_t source = 0; source < assembly->source_count && count < SOURCES_MOST; source++)
    if ((of[count] = turn_of(self, source, assembly, out)) != NULL && of[count]->windows > 0) count++;
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < count; k++) apart[i] += k != i && is_apart(of[k], of[i], &fit);
  for (size_t i = 1; i < count; i++)
    if (apart[i] < apart[best]) best = i;
  for (size_t i = 0; i < count; i++)
    if (i != best && is_apart(of[best], of[i], &fit))
      says(wm_assembly_source_name(assembly, of[i]->source), wm_assembly_source_name(assembly, of[best]->source), &fit,
           out);
}
