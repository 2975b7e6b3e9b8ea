// SPDX-License-Identifier: Apache-2.0
#include "cli/check/comparisons.h"

#include <math.h>
#include <string.h>

#define LAG_WINDOWS 4        // a robot obeys within a second
#define LAG_GAIN 0.02        // of the correlation, for a lag that is not 0
#define PAIRS_MIN 20         // windows in common
#define COVER_MIN 0.8        // share of a window that has data
#define TURN_MIN_RAD 0.5     // a drive that turns less shows neither sign nor factor
#define TURN_RMS_MIN 0.02    // rad/s
#define WAY_MIN_M 5.0        // likewise of a speed
#define WAY_RMS_MIN 0.05     // m/s
#define CORRELATION_MIN 0.5  // of a sign
#define FIT_MIN 0.8          // of an axis, and of two that agree
// Tyres, tracks and slip make some per cent, a skid-steer base's slip a half.
#define FACTOR_MIN 1.5
#define NEAR 0.1            // of a factor that is named: 57.3 within 10 %
#define NOTHING_SHARE 0.15  // of the other's root mean square, over NOTHING_WINDOWS together: shows no turn
#define NOTHING_WINDOWS 8
#define LONE_ZEROS_MIN 0.2   // share of the values; a wheel that turns slowly has a few
#define OBEYED 0.98          // a command that fits better is no command
#define BIAS_MAX_RADPS 0.05  // of a gyro beside another sensor's turn; below, the estimators' states hold it
#define APART_SHARE 0.005    // of the time's sum, that the way leaves: a speed that varies by 7 %, or stops
#define OPPOSED_MIN_M 10.0   // of each wheel: on the spot, with a track of half a metre, six whole turns
#define OPPOSED_SHARE 0.9
#define DEGREES (180 / M_PI)
#define KMH 3.6
#define MPH 2.237

typedef struct fit {
  double aa, bb, ab;  // sums over the windows
  double a, b;
  double total[2];   // of the sizes: rad or m
  double coarse[2];  // root mean square over several windows together, of a rate
  double r;          // correlation about zero
  double lag_s;      // by which b is later
  size_t count;
} fit;

static int has_window(const channel *c, size_t i) {
  return i < c->windows && (double)c->cover[i] >= COVER_MIN * WINDOW_S;
}

// Speeds of vehicles and of wheels may be without a sign; others are positive forwards.
static int has_sign(const channel *c) {
  return c->least < 0 || (c->kind != CHANNEL_VEHICLE_WAY && c->kind != CHANNEL_WHEELS_WAY);
}

static fit fit_at(const channel *a, const channel *b, int lag) {
  const int are_sizes = channel_is_way(a->kind) && !(has_sign(a) && has_sign(b));
  fit out = {.lag_s = lag * WINDOW_S};
  double block[2] = {0, 0};
  size_t in_block = 0, blocks = 0;
  for (size_t i = LAG_WINDOWS; i < a->windows; i++) {
    const size_t k = (size_t)((long)i + lag);
    if (!has_window(a, i) || !has_window(b, k)) continue;
    const double x = are_sizes ? fabs((double)a->sum[i]) : (double)a->sum[i];
    const double y = are_sizes ? fabs((double)b->sum[k]) : (double)b->sum[k];
    out.aa += x * x;
    out.bb += y * y;
    out.ab += x * y;
    out.a += x;
    out.b += y;
    out.total[0] += fabs(x);
    out.total[1] += fabs(y);
    out.count++;
    block[0] += x;
    block[1] += y;
    if (++in_block < NOTHING_WINDOWS) continue;
    for (int s = 0; s < 2; s++) {
      out.coarse[s] += block[s] * block[s];
      block[s] = 0;
    }
    in_block = 0;
    blocks++;
  }
  for (int s = 0; s < 2; s++)
    out.coarse[s] = blocks > 0 ? sqrt(out.coarse[s] / (double)blocks) / (NOTHING_WINDOWS * WINDOW_S) : 0;
  const double size = sqrt(out.aa * out.bb);
  out.r = size > 0 ? out.ab / size : 0;
  return out;
}

static fit best_fit(const channel *a, const channel *b) {
  fit best = fit_at(a, b, 0);
  const double at_zero = fabs(best.r);
  for (int lag = -LAG_WINDOWS; lag <= LAG_WINDOWS; lag++) {
    const fit other = fit_at(a, b, lag);
    if (other.count >= PAIRS_MIN && fabs(other.r) > fmax(fabs(best.r), at_zero + LAG_GAIN)) best = other;
  }
  return best;
}

// a over b: beyond the limit whichever of the two is the noisy one, else 1. Noise of b makes ab/bb too small, noise of
// a makes aa/ab too large: the factor is in between.
static double factor_of(const fit *f) {
  const double ab = fabs(f->ab);
  if (!(ab > 0) || !(f->bb > 0)) return 1;
  const double least = ab / f->bb, most = f->aa / ab;
  return least > FACTOR_MIN || most < 1 / FACTOR_MIN ? sqrt(least * most) : 1;
}

static int is_excited(const fit *f, int is_way) {
  const double rms = sqrt(fmax(f->aa, f->bb) / (double)(f->count ? f->count : 1)) / WINDOW_S;
  const double total = fmax(f->total[0], f->total[1]);
  return f->count >= PAIRS_MIN && total >= (is_way ? WAY_MIN_M : TURN_MIN_RAD) &&
         rms >= (is_way ? WAY_RMS_MIN : TURN_RMS_MIN);
}

// ── what two channels say of each other ─────────────────────────────────────────────────────────────────────────────

typedef enum contradiction {
  UNKNOWN,  // the drive doesn't show it
  AGREE,
  OTHER_SIGN,
  OTHER_FACTOR,
  FIRST_SHOWS_NOTHING,
  SECOND_SHOWS_NOTHING
} contradiction;

static contradiction compare(const channel *a, const channel *b, fit *f) {
  const int is_way = channel_is_way(a->kind);
  *f = best_fit(a, b);
  if (!is_excited(f, is_way)) return UNKNOWN;
  const int may_be_quiet = a->has_scale && b->has_scale && fabs(f->r) < FIT_MIN;  // else its scale is wrong
  if (may_be_quiet && f->coarse[0] < NOTHING_SHARE * f->coarse[1]) return FIRST_SHOWS_NOTHING;
  if (may_be_quiet && f->coarse[1] < NOTHING_SHARE * f->coarse[0]) return SECOND_SHOWS_NOTHING;
  if (f->r < -CORRELATION_MIN) return OTHER_SIGN;
  if (f->r < CORRELATION_MIN) return UNKNOWN;
  if (a->has_scale && b->has_scale && factor_of(f) != 1) return OTHER_FACTOR;
  return f->r > FIT_MIN ? AGREE : UNKNOWN;
}

// Which of two is believed, where no third one decides: what counts wheels or integrates over what measures a rate.
static int rank(const channel *c) {
  static const int kRanks[CHANNEL_KINDS] = {
      [CHANNEL_YAW_RATE] = 2,     [CHANNEL_TWIST_TURN] = 5,    [CHANNEL_WHEELS_TURN] = 4,
      [CHANNEL_TICKS_TURN] = 3,   [CHANNEL_STEERING_TURN] = 1, [CHANNEL_INCREMENT_TURN] = 6,
      [CHANNEL_HEADING_TURN] = 0, [CHANNEL_VEHICLE_WAY] = 1,   [CHANNEL_WHEELS_WAY] = 3,
      [CHANNEL_TICKS_WAY] = 2,    [CHANNEL_TWIST_WAY] = 4,     [CHANNEL_INCREMENT_WAY] = 5};
  return kRanks[c->kind];
}

// ── names and lines ─────────────────────────────────────────────────────────────────────────────────────────────────

static const char *source_of(const channel *c, const wm_assembly *assembly) {
  return wm_assembly_source_name(assembly, c->source);
}

static int is_can(const channel *c, const wm_assembly *assembly) {
  return strncmp(source_of(c, assembly), "can", 3) == 0;
}

int comparisons_is_broken(const channel *c, const wm_assembly *assembly, const wm_findings *found) {
  static const wm_finding_id kOfClock[] = {WM_FOUND_CLOCK_JUMPED, WM_FOUND_CLOCK_COARSE, WM_FOUND_CLOCKS_APART};
  const char *name = source_of(c, assembly);
  for (size_t i = 0; i < sizeof kOfClock / sizeof kOfClock[0]; i++)
    if (wm_findings_has(found, kOfClock[i], name)) return 1;
  const int counts = c->kind == CHANNEL_TICKS_TURN || c->kind == CHANNEL_TICKS_WAY;
  return c->is_stuck || (counts && (wm_findings_has(found, WM_FOUND_COUNTER_RESTARTS, name) ||
                                    wm_findings_has(found, WM_FOUND_MOTION_SENSOR, name)));
}

static const char *word_of(const channel *c, const wm_assembly *assembly) {
  static const char *const kOfCan[CHANNEL_KINDS] = {[CHANNEL_YAW_RATE] = "yaw_rate",
                                                    [CHANNEL_ROLL_RATE] = "roll_rate",
                                                    [CHANNEL_PITCH_RATE] = "pitch_rate",
                                                    [CHANNEL_VEHICLE_WAY] = "vehicle_speed"};
  static const char *const kOfFile[CHANNEL_KINDS] = {[CHANNEL_YAW_RATE] = "wz_radps",
                                                     [CHANNEL_ROLL_RATE] = "wx_radps",
                                                     [CHANNEL_PITCH_RATE] = "wy_radps",
                                                     [CHANNEL_VEHICLE_WAY] = "v_mps"};
  static const char *const kOfBoth[CHANNEL_KINDS] = {[CHANNEL_TWIST_TURN] = "w_radps",
                                                     [CHANNEL_WHEELS_TURN] = "the difference of the wheels' speeds",
                                                     [CHANNEL_TICKS_TURN] = "the difference of the wheels' ticks",
                                                     [CHANNEL_STEERING_TURN] = "the steering",
                                                     [CHANNEL_INCREMENT_TURN] = "dheading_rad",
                                                     [CHANNEL_HEADING_TURN] = "heading_rad",
                                                     [CHANNEL_WHEELS_WAY] = "the wheels' speeds",
                                                     [CHANNEL_TICKS_WAY] = "the speed by the wheels' ticks",
                                                     [CHANNEL_TWIST_WAY] = "v_mps",
                                                     [CHANNEL_INCREMENT_WAY] = "dx_m"};
  const char *of_both = kOfBoth[c->kind];
  return of_both ? of_both : is_can(c, assembly) ? kOfCan[c->kind] : kOfFile[c->kind];
}

// "wz_radps of imu"; of CAN the quantity alone.
const char *comparisons_name(const channel *c, const wm_assembly *assembly, char *out, size_t capacity) {
  const char *word = word_of(c, assembly), *source = source_of(c, assembly);
  (void)(is_can(c, assembly) ? snprintf(out, capacity, "%s", word)
                             : snprintf(out, capacity, "%s of %.40s", word, source));
  return out;
}

// Of a and b without their means: what a shows where b is 0 (rad/s), where the two are alike otherwise; else 0.
static double bias_of(const fit *f) {
  const double n = (double)f->count;
  if (n < PAIRS_MIN) return 0;
  const double aa = f->aa - f->a * f->a / n, bb = f->bb - f->b * f->b / n, ab = f->ab - f->a * f->b / n;
  const int b_is_steady = bb < 1e-3 * f->aa, a_is_steady = aa < 0.1 * f->a * f->a / n;
  if (b_is_steady) return a_is_steady && fabs(f->b) < 0.2 * fabs(f->a) ? f->a / n / WINDOW_S : 0;
  const double factor = ab / bb;
  if (ab < FIT_MIN * sqrt(aa * bb) || factor > FACTOR_MIN || factor < 1 / FACTOR_MIN) return 0;
  return (f->a - factor * f->b) / n / WINDOW_S;
}

typedef struct scene {
  const channels *all;
  const wm_assembly *assembly;
  wm_findings *out;
} scene;

static void sign_line(const scene *s, const channel *c, char *fix, size_t capacity) {
  const char *source = source_of(c, s->assembly);
  char line[96];
  if (is_can(c, s->assembly))
    (void)snprintf(fix, capacity,
                   channel_is_way(c->kind)
                       ? "`scale: -1` at the one that is not positive forwards"
                       : "`scale: -1` at the one that is not positive to the left; or left and right are swapped");
  else if (c->kind == CHANNEL_YAW_RATE && gravity_is_below(s->all, c->source))
    (void)snprintf(fix, capacity, "it hangs upside down. calibration.yaml: %s",
                   gravity_mounting(s->assembly, 180, 0, line, sizeof line));
  else if (c->kind == CHANNEL_YAW_RATE)
    (void)snprintf(
        fix, capacity,
        "calibration.yaml: %s where it hangs upside down; else %s.csv: wz_radps times -1: positive is to the left",
        gravity_mounting(s->assembly, 180, 0, line, sizeof line), source);
  else
    (void)snprintf(fix, capacity, "%s.csv: %s times -1: positive is %s", source, word_of(c, s->assembly),
                   channel_is_way(c->kind) ? "forwards" : "to the left");
}

// A factor that is nearly one with a usual cause is that one.
static double usual_factor(double factor) {
  static const double kUsual[] = {DEGREES, 1 / DEGREES, 2, 0.5, KMH, 1 / KMH, 1000, 0.001, 100, 0.01};
  for (size_t i = 0; i < sizeof kUsual / sizeof kUsual[0]; i++)
    if (fabs(factor / kUsual[i] - 1) < NEAR / 2) return kUsual[i];
  return factor;
}

// A factor with a usual cause: of `a` over `b`, and what a is then.
static const char *unit_of(double factor, int is_way) {
  static const struct {
    double factor;
    int is_way;
    const char *what;
  } kKnown[] = {{DEGREES, 0, "deg/s"}, {KMH, 1, "km/h"}, {MPH, 1, "mph"}, {1000, 1, "mm/s"}, {100, 1, "cm/s"}};
  for (size_t i = 0; i < sizeof kKnown / sizeof kKnown[0]; i++)
    if (kKnown[i].is_way == is_way && fabs(factor / kKnown[i].factor - 1) < NEAR) return kKnown[i].what;
  return NULL;
}

// The difference of two wheels, whose turn is that over the track.
static int is_of_track(const channel *c) { return c->kind == CHANNEL_TICKS_TURN || c->kind == CHANNEL_WHEELS_TURN; }

// The unit that two wheels' speeds may have where their turn is off by its factor, to either side; NULL: none.
static const char *wheels_unit(const channel *c, const channel *other, double factor) {
  if (c->kind != CHANNEL_WHEELS_TURN && other->kind != CHANNEL_WHEELS_TURN) return NULL;
  const double size = fmax(factor, 1 / factor);
  return fabs(size / KMH - 1) < NEAR ? "km/h" : fabs(size / MPH - 1) < NEAR ? "mph" : NULL;
}

static void factor_line(const scene *s, const channel *c, const channel *other, double measured, char *fix,
                        size_t capacity) {
  const double factor = usual_factor(measured);
  const char *unit = unit_of(factor, channel_is_way(c->kind)), *source = source_of(c, s->assembly);
  const wm_wheels *w = s->all->wheels;
  const char *of_speeds = wheels_unit(c, other, factor);
  if (of_speeds)
    (void)snprintf(fix, capacity,
                   "are the wheels' speeds in %s, or m/s that are read as that? Their `unit:`, or columns, times %.4g "
                   "would agree; else measure the track again",
                   of_speeds, is_of_track(c) ? 1 / factor : factor);
  else if (is_of_track(c))
    (void)snprintf(fix, capacity,
                   "measure the track again (`wheels: {track_m: %.3g}` would agree), or look at the gyro's unit",
                   w->track_m * factor);
  else if (is_of_track(other) && c->kind == CHANNEL_YAW_RATE && !unit)
    (void)snprintf(fix, capacity,
                   "measure the track again (`wheels: {track_m: %.3g}` would agree), or look at the gyro's range and "
                   "unit: %s times %.3g would agree, too",
                   w->track_m / factor, word_of(c, s->assembly), 1 / factor);
  else if (c->kind == CHANNEL_TICKS_WAY)
    (void)snprintf(fix, capacity,
                   "one of them is wrong: the speed's unit, or the wheels' (`radius_m: %.4g` or `ticks_per_turn: %.6g` "
                   "would agree)",
                   w->radius_m / factor, w->ticks_per_turn * factor);
  else if (is_can(c, s->assembly) && unit)
    (void)snprintf(fix, capacity, "its unit is %s. can-signals.yaml: `unit: %s` at %s", unit, unit,
                   word_of(c, s->assembly));
  else if (is_can(c, s->assembly))
    (void)snprintf(
        fix, capacity,
        "can-signals.yaml: `scale: %.3g` at %s if the other one is right; compare its unit and bits with the DBC",
        1 / factor, word_of(c, s->assembly));
  else
    (void)snprintf(fix, capacity, "%s%s%s%s.csv: %s times %.4g if the other one is right", unit ? "it is in " : "",
                   unit ? unit : "", unit ? ". " : "", source, word_of(c, s->assembly), 1 / factor);
}

// ── findings ────────────────────────────────────────────────────────────────────────────────────────────────────────

// The roll or pitch rate of the same IMU that shows the other's turn; NULL: none.
static const channel *other_axis(const channels *all, const channel *gyro, const channel *other, double *r) {
  for (size_t i = 0; i < all->count; i++) {
    const channel *c = &all->at[i];
    if (c->source != gyro->source || !channel_is_tilt(c->kind)) continue;
    const fit f = best_fit(c, other);
    *r = f.r;
    if (is_excited(&f, 0) && fabs(f.r) > FIT_MIN && factor_of(&f) == 1) return c;
  }
  return NULL;
}

// The mounting by which the axis that turns, by its sign, becomes z.
static const char *turned_mounting(const scene *s, const channel *axis, double r, char *out, size_t capacity) {
  const double by_deg = r > 0 ? 90 : -90;
  return axis->kind == CHANNEL_ROLL_RATE ? gravity_mounting(s->assembly, 0, -by_deg, out, capacity)
                                         : gravity_mounting(s->assembly, by_deg, 0, out, capacity);
}

// The way of the wheels whose difference is this turn; NULL: it is none.
static const channel *way_of_wheels(const channels *all, const channel *turn) {
  const channel_kind kind = turn->kind == CHANNEL_TICKS_TURN    ? CHANNEL_TICKS_WAY
                            : turn->kind == CHANNEL_WHEELS_TURN ? CHANNEL_WHEELS_WAY
                                                                : CHANNEL_KINDS;
  for (size_t i = 0; i < all->count; i++)
    if (all->at[i].kind == kind && all->at[i].source == turn->source) return &all->at[i];
  return NULL;
}

// Where one of two counters runs backwards, their sum is what the robot turns: 2 / track for each metre of the mean. A
// gyro's zero follows the way as well, by far less. Makes the finding.
static int counts_backwards(const scene *s, const channel *quiet, const channel *turn) {
  const channel *way = turn->kind == CHANNEL_TICKS_TURN ? way_of_wheels(s->all, turn) : NULL;
  if (!way || !way->has_scale || !turn->has_scale) return 0;
  const fit f = best_fit(quiet, way);
  const double share = fabs(f.ab / f.bb) * s->all->wheels->track_m / 2;
  if (!is_excited(&f, 0) || fabs(f.r) < FIT_MIN || !(share > 0.5 && share < 2)) return 0;
  const char *source = source_of(turn, s->assembly), *side = f.r > 0 ? "left" : "right";
  char name[96], fix[WM_FINDING_FIX_MAX];
  (void)(is_can(turn, s->assembly) ? snprintf(fix, sizeof fix, "can-signals.yaml: `scale: -1` at wheel_ticks_%s", side)
                                   : snprintf(fix, sizeof fix, "%s.csv: %s times -1", source, side));
  wm_find(s->out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, source, fix,
          "the sum of the wheels' ticks follows %s, as their difference should (r %.2f): the %s wheel's counter runs "
          "backwards",
          comparisons_name(quiet, s->assembly, name, sizeof name), fabs(f.r), side)
      ->size = f.r;
  return 1;
}

static void shows_nothing(const scene *s, const channel *quiet, const channel *other, const fit *f) {
  const double turned = fmax(f->total[0], f->total[1]);
  const char *what = channel_is_way(quiet->kind) ? "m of way" : "rad of turn", *about = source_of(quiet, s->assembly);
  char name[96], of[96], fix[WM_FINDING_FIX_MAX];
  double r = 0;
  (void)snprintf(fix, sizeof fix, "look at the %s, and at the signal's place in the DBC",
                 quiet->kind == CHANNEL_YAW_RATE ? "gyro" : "sensor");
  (void)comparisons_name(quiet, s->assembly, name, sizeof name);
  (void)comparisons_name(other, s->assembly, of, sizeof of);
  // A speed beside a gyro, as of a DVL, has no turn rate of its own: the column is filled with zeros, and not read.
  if (quiet->kind == CHANNEL_TWIST_TURN && quiet->zeros == quiet->values && other->kind == CHANNEL_YAW_RATE) return;
  if (counts_backwards(s, quiet, other)) return;
  const int is_constant = quiet->least == quiet->most;
  const wm_severity severity =
      channels_are_commands(s->all, other) && !is_constant ? WM_SEVERITY_NOTE : WM_SEVERITY_BAD;
  const channel *axis = quiet->kind == CHANNEL_YAW_RATE ? other_axis(s->all, quiet, other, &r) : NULL;
  if (axis) {
    char line[96];
    (void)snprintf(fix, sizeof fix, "calibration.yaml: %s", turned_mounting(s, axis, r, line, sizeof line));
    wm_find(s->out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, about, fix,
            "%s shows no turn where %s turns (%.1f rad), but its %s does (r %.2f): its %s axis is up", name, of, turned,
            word_of(axis, s->assembly), r, axis->kind == CHANNEL_ROLL_RATE ? "x" : "y");
    return;
  }
  if (quiet->kind == CHANNEL_YAW_RATE && !is_can(quiet, s->assembly))
    (void)snprintf(
        fix, sizeof fix,
        is_constant ? "is the gyro switched on? Leave the source out (`use: false`), and the motion's own turn is taken"
                    : "is another of its axes up? calibration.yaml: `imu: {mounting: {rpy_deg: [90, 0, 0]}}` (y up), "
                      "`[0, -90, 0]` (x up)");
  if (is_constant)
    wm_find(s->out, WM_FOUND_MOTION_SENSOR, severity, about, fix,
            "%s is %.10g in all of its %llu data, while %s has %.1f %s", name, quiet->last,
            (unsigned long long)quiet->values, of, turned, what);
  else
    wm_find(s->out, WM_FOUND_SENSORS_DISAGREE, severity, about, fix, "%s shows %.2f times the %s of %s (%.1f)", name,
            fmin(f->coarse[0], f->coarse[1]) / fmax(f->coarse[0], f->coarse[1]),
            channel_is_way(quiet->kind) ? "way" : "turn", of, turned);
}

static void disagrees(const scene *s, const channel *c, const channel *other, const fit *f, contradiction how) {
  const int is_way = channel_is_way(c->kind);
  const double factor = factor_of(f), sign = f->r < 0 ? -1 : 1;
  const double size = factor != 1 || f->ab == 0 ? factor : sqrt(f->aa / f->bb);
  char name[96], of[96], fix[WM_FINDING_FIX_MAX];
  (void)comparisons_name(c, s->assembly, name, sizeof name);
  (void)comparisons_name(other, s->assembly, of, sizeof of);
  const int is_unit = unit_of(factor, is_way) != NULL || unit_of(1 / factor, is_way) != NULL;
  const int is_weak =
      (channels_are_commands(s->all, c) || channels_are_commands(s->all, other)) && !is_unit && f->r < OBEYED;
  if (how == OTHER_SIGN) {
    sign_line(s, c, fix, sizeof fix);
    wm_find(s->out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, source_of(c, s->assembly), fix,
            is_way ? "%s goes forwards where %s goes backwards: %.2f times its way (r %.2f, %.1f m in all)"
                   : "%s turns left where %s turns right: %.2f times its turn (r %.2f, %.1f rad in all)",
            name, of, sign * size, f->r, f->total[1])
        ->size = sign * size;
    return;
  }
  const double lone = c->values > 0 ? (double)c->lone_zeros / (double)c->values : 0;
  factor_line(s, c, other, factor, fix, sizeof fix);
  if (lone > LONE_ZEROS_MIN)
    (void)snprintf(fix, sizeof fix, "%.0f of 100 of its values are 0 between others: leave those rows out of %s",
                   100 * lone, source_of(c, s->assembly));
  wm_find(s->out, WM_FOUND_SENSORS_DISAGREE, is_weak ? WM_SEVERITY_NOTE : WM_SEVERITY_BAD, source_of(c, s->assembly),
          fix, "%s is %.2f times %s%s (r %.2f, %.1f %s in all)", name, factor, is_way ? "" : "the turn rate by ", of,
          f->r, f->total[1], is_way ? "m" : "rad")
      ->size = factor;
}

// Of a gyro beside the wheels' difference: what it shows at rest, rad/s, by least squares over turn, time and way. A
// wheel that is larger than the other one turns with the way. 0 where the drive does not tell the two apart.
static double bias_at_rest(const channel *gyro, const channel *turn, const channel *way) {
  double m[3][4] = {{0}};
  for (size_t i = 0; i < gyro->windows; i++) {
    if (!has_window(gyro, i) || !has_window(turn, i) || !has_window(way, i)) continue;
    const double row[4] = {(double)turn->sum[i], (double)way->sum[i], WINDOW_S, (double)gyro->sum[i]};
    for (int j = 0; j < 3; j++)
      for (int k = 0; k < 4; k++) m[j][k] += row[j] * row[k];
  }
  const double time_alone = m[2][2];
  for (int j = 0; j < 3; j++) {
    if (m[j][j] <= APART_SHARE * (j == 2 ? time_alone : 1e-12)) return 0;
    for (int i = j + 1; i < 3; i++)
      for (int k = 3; k >= j; k--) m[i][k] -= m[i][j] / m[j][j] * m[j][k];
  }
  return m[2][3] / m[2][2];
}

// Whether a gyro shows a turn where another sensor shows none, in the mean of the drive. Makes the finding.
static int has_bias(const scene *s, const channel *c, const channel *other) {
  if (c->kind != CHANNEL_YAW_RATE || !other->has_scale || channels_are_commands(s->all, other)) return 0;
  const fit f = best_fit(c, other);
  const channel *way = way_of_wheels(s->all, other);
  double bias = bias_of(&f);
  if (way && fabs(bias) > BIAS_MAX_RADPS) bias = bias_at_rest(c, other, way);
  if (!(fabs(bias) > BIAS_MAX_RADPS)) return 0;
  char name[96], of[96], fix[WM_FINDING_FIX_MAX];
  if (is_can(c, s->assembly))
    (void)snprintf(fix, sizeof fix,
                   "can-signals.yaml: `offset: %.3g` at yaw_rate; and let the gyro find its zero at rest", -bias);
  else
    (void)snprintf(fix, sizeof fix, "%s.csv: wz_radps less %.3g; and let the gyro find its zero at rest",
                   source_of(c, s->assembly), bias);
  wm_find(s->out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, source_of(c, s->assembly), fix,
          "%s shows %.3f rad/s where %s shows no turn: its zero is off",
          comparisons_name(c, s->assembly, name, sizeof name), bias,
          comparisons_name(other, s->assembly, of, sizeof of))
      ->size = bias;
  return 1;
}

// Channels of one quantity. The one that agrees with most of the others is the measure of them.
static void judge_quantity(const scene *s, int of_way) {
  const channel *of[CHANNELS_MAX];
  int votes[CHANNELS_MAX] = {0};
  size_t count = 0, best = 0;
  fit f;
  for (size_t i = 0; i < s->all->count; i++) {
    const channel *c = &s->all->at[i];
    if (channel_is_way(c->kind) == of_way && !channel_is_tilt(c->kind) && c->values > 0 &&
        !comparisons_is_broken(c, s->assembly, s->out))
      of[count++] = c;
  }
  for (size_t i = 0; i < count; i++)
    for (size_t k = i + 1; k < count; k++) {
      const contradiction how = compare(of[i], of[k], &f);
      votes[i] += how == AGREE ? 2 : how == FIRST_SHOWS_NOTHING ? -2 : how > AGREE ? -1 : 0;
      votes[k] += how == AGREE ? 2 : how == SECOND_SHOWS_NOTHING ? -2 : how > AGREE ? -1 : 0;
    }
  for (size_t i = 1; i < count; i++)
    if (votes[i] > votes[best] || (votes[i] == votes[best] && rank(of[i]) > rank(of[best]))) best = i;
  for (size_t i = 0; i < count; i++) {
    if (i == best) continue;
    const contradiction how = compare(of[i], of[best], &f);
    if (how != OTHER_SIGN && (has_bias(s, of[i], of[best]) || has_bias(s, of[best], of[i]))) continue;
    if (how == FIRST_SHOWS_NOTHING && !comparisons_is_noisy(of[best], s->assembly))
      shows_nothing(s, of[i], of[best], &f);
    else if (how == SECOND_SHOWS_NOTHING && !comparisons_is_noisy(of[i], s->assembly))
      shows_nothing(s, of[best], of[i], &f);
    else if (how == OTHER_SIGN || how == OTHER_FACTOR)
      disagrees(s, of[i], of[best], &f, how);
  }
}

// Sensors of the turn that a straight drive doesn't compare: a sign or a unit of them would not show.
static void judge_straight(const scene *s) {
  const channel *seen[2] = {NULL, NULL};
  double turned = 0;
  fit f;
  for (size_t i = 0; i < s->all->count; i++)
    for (size_t k = i + 1; k < s->all->count; k++) {
      const channel *a = &s->all->at[i], *b = &s->all->at[k];
      if (channel_is_way(a->kind) || channel_is_way(b->kind) || channel_is_tilt(a->kind) || channel_is_tilt(b->kind))
        continue;
      f = best_fit(a, b);
      if (f.count < PAIRS_MIN) continue;
      if (is_excited(&f, 0)) return;
      seen[0] = a;
      seen[1] = b;
      turned = fmax(f.total[0], f.total[1]);
    }
  if (!seen[0]) return;
  char name[96], of[96];
  wm_find(s->out, WM_FOUND_NOT_OBSERVABLE, WM_SEVERITY_NOTE, "motion", "record a drive with turns to both sides",
          "it turns by %.2g rad in all: sign and scale of %s against %s are not observable in this drive", turned,
          comparisons_name(seen[0], s->assembly, name, sizeof name),
          comparisons_name(seen[1], s->assembly, of, sizeof of))
      ->size = turned;
}

// Two wheels of which one counts backwards: the robot would turn on the spot all the time.
static void judge_wheels(const scene *s, const channel *turn) {
  const channel *way = way_of_wheels(s->all, turn);
  const double track_m = turn->has_scale ? s->all->wheels->track_m : 1;
  double moved = 0, opposed = 0, by_wheel[2] = {0, 0};
  for (size_t i = 0; way && way->has_scale && i < turn->windows; i++) {
    if (!has_window(turn, i) || !has_window(way, i)) continue;
    const double half = (double)turn->sum[i] * track_m / 2;
    const double left = (double)way->sum[i] - half, right = (double)way->sum[i] + half;
    moved += fabs(left) + fabs(right);
    opposed += left * right < 0 ? fabs(left) + fabs(right) : 0;
    by_wheel[0] += left;
    by_wheel[1] += right;
  }
  const int falls = by_wheel[1] < by_wheel[0];  // the wheel that goes backwards: 0 the left one, 1 the right one
  if (moved < 2 * OPPOSED_MIN_M || opposed < OPPOSED_SHARE * moved || by_wheel[0] * by_wheel[1] >= 0) return;
  fit f;
  for (size_t i = 0; i < s->all->count; i++) {
    const channel *c = &s->all->at[i];
    if (c != turn && !channel_is_way(c->kind) && !channel_is_tilt(c->kind) && compare(c, turn, &f) == AGREE) return;
  }
  const char *wheel = falls ? "right" : "left";
  char fix[WM_FINDING_FIX_MAX];
  if (is_can(turn, s->assembly))
    (void)snprintf(fix, sizeof fix, "can-signals.yaml: `scale: -1` at the %s wheel, or at the other one", wheel);
  else
    (void)snprintf(fix, sizeof fix, "%s.csv: %s times -1, or the other one", source_of(turn, s->assembly), wheel);
  wm_find(s->out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, source_of(turn, s->assembly), fix,
          "its wheels turn against each other on %.0f %% of their way (left %.1f m, right %.1f m): one of them counts "
          "backwards, or the robot turned on the spot all the time",
          100 * opposed / moved, by_wheel[0], by_wheel[1])
      ->size = opposed / moved;
}

void comparisons_judge(const channels *self, const wm_assembly *assembly, wm_findings *out) {
  const scene s = {self, assembly, out};
  for (size_t i = 0; i < self->count; i++)
    if (is_of_track(&self->at[i]) && !comparisons_is_broken(&self->at[i], assembly, out))
      judge_wheels(&s, &self->at[i]);
  judge_quantity(&s, 0);
  judge_quantity(&s, 1);
  judge_straight(&s);
  gravity_judge(self, assembly, out);
}

void comparisons_print(const channels *self, const wm_assembly *assembly, FILE *to) {
  char name[96], of[96];
  for (size_t i = 0; i < self->count; i++)
    for (size_t k = i + 1; k < self->count; k++) {
      const channel *a = &self->at[i], *b = &self->at[k];
      if (channel_is_way(a->kind) != channel_is_way(b->kind) || channel_is_tilt(a->kind) || channel_is_tilt(b->kind))
        continue;
      fit f;
      const contradiction how = compare(a, b, &f);
      (void)fprintf(to, "compared     %s with %s: ", comparisons_name(a, assembly, name, sizeof name),
                    comparisons_name(b, assembly, of, sizeof of));
      if (how == UNKNOWN && !is_excited(&f, channel_is_way(a->kind)))
        (void)fprintf(to, "not observable in this drive\n");
      else if (fabs(f.r) > CORRELATION_MIN && a->has_scale && b->has_scale)
        (void)fprintf(to, "%.2f times, r %.2f, lag %.2f s\n", f.bb > 0 ? copysign(sqrt(f.aa / f.bb), f.r) : 0, f.r,
                      f.lag_s);
      else
        (void)fprintf(to, "r %.2f, lag %.2f s\n", f.r, f.lag_s);
    }
}
