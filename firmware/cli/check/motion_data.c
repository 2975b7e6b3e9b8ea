// SPDX-License-Identifier: Apache-2.0
// The values of the motion's quantities by themselves: other units than in the binding, bits of another type, counters
// that stand or wrap, messages that never arrive.
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli/check/check.h"

#define ABOUT "can"
#define FASTEST_MPS 70.0        // 250 km/h
#define FASTEST_TURN_RADPS 6.0  // about a turn a second
#define VALUES_MIN 100
// Of raw bits that are a float's: what a speed, a rate or an angle may be.
#define FLOAT_LEAST 1e-5
#define FLOAT_MOST 1e3
#define FLOAT_SHARE 0.9
// Steps of a counter: a jump is so many of the steps beside it, and counts, and comes at least twice.
#define WRAP_STEPS 10.0
#define WRAP_COUNTS 100.0
#define WRAP_ALIKE 0.05
#define RESTART_CYCLE \
  65536.0                // CAN's counts go on by the shorter side of their bits: a restart at 0 is at whole cycles
#define FOLD_COUNTS 2.0  // of a wheel that stands, where its counter trembles about its end

void motion_data_init(motion_data *self, const wm_wheels *wheels) {
  memset(self, 0, sizeof *self);
  self->wheels = wheels;
  self->ticks_ns = WM_TIME_NONE;
}

const char *motion_data_column(const char *source, unsigned quantity) {
  static const struct {
    const char *source, *column;
    wm_quantity quantity;
  } kColumns[] = {{"ticks", "left", WM_Q_WHEEL_TICKS_LEFT},
                  {"ticks", "right", WM_Q_WHEEL_TICKS_RIGHT},
                  {"speeds", "left_mps", WM_Q_WHEEL_SPEED_REAR_LEFT},
                  {"speeds", "right_mps", WM_Q_WHEEL_SPEED_REAR_RIGHT},
                  {"steering", "v_mps", WM_Q_VEHICLE_SPEED},
                  {"steering", "road_wheel_rad", WM_Q_ROAD_WHEEL},
                  {"imu", "wz_radps", WM_Q_YAW_RATE},
                  {"imu", "wx_radps", WM_Q_ROLL_RATE},
                  {"imu", "wy_radps", WM_Q_PITCH_RATE}};
  for (size_t i = 0; i < sizeof kColumns / sizeof kColumns[0]; i++)
    if (strcmp(source, kColumns[i].source) == 0 && quantity == kColumns[i].quantity) return kColumns[i].column;
  return NULL;
}

// ── counters that wrap ──────────────────────────────────────────────────────────────────────────────────────────────

// A jump, less the step that the wheel has made meanwhile.
static void take_jump(ticks_wrap *self, double jump) {
  if (self->jumps++ == 0)
    self->first_jump = fabs(jump);
  else
    self->between += fabs(self->since);
  self->alike += fabs(fabs(jump) - self->first_jump) < WRAP_ALIKE * self->first_jump + WRAP_COUNTS;
  self->since = 0;
}

static const int kBits[WRAP_BITS] = {8, 10, 12, 16, 24, 32};

// A step of more than half a cycle, against the way of the steps beside it, that is one of them less a cycle. Returns
// whether it is one of any cycle.
static int take_fold(ticks_wrap *self, double after, int is_restart) {
  const double size = fmax(fabs(self->step_before), fabs(after)), by = (self->step_before + after) / 2;
  int is_fold = 0;
  for (int k = 0; k < WRAP_BITS; k++) {
    const double cycle = ldexp(1, kBits[k]);
    if (fabs(self->step) <= cycle / 2) continue;
    const double left = fabs(self->step - copysign(cycle, self->step) - by);
    const int fits = size < cycle / 4 && self->step * by <= 0 && left <= size + FOLD_COUNTS;
    self->folds[k] += fits;
    self->misfits[k] += !fits && !is_restart;
    is_fold |= fits;
  }
  return is_fold;
}

// A step that is far larger than the one before and the one behind it is a jump. To 0, it may be a restart.
static void take_count(ticks_wrap *self, double value, wm_time_ns t_ns, int is_doubtful) {
  const double step = value - self->last, around = fabs(self->step_before) + fabs(step), to = self->last;
  const double at_s = wm_seconds_between(self->first_ns, self->last_ns);
  self->last = value;
  self->last_ns = t_ns;
  if (self->counts++ == 0) self->first_ns = t_ns;
  if (self->counts == 1 || is_doubtful) return;
  const int is_jump = fabs(self->step) > WRAP_STEPS * around + WRAP_COUNTS;
  const int to_zero = is_jump && fabs(remainder(to, RESTART_CYCLE)) <= around + FOLD_COUNTS;
  const int is_fold = self->counts > 4 && take_fold(self, step, to_zero);
  if (is_jump)
    take_jump(self, self->step - (self->step_before + step) / 2);
  else
    self->since += self->step;
  if (to_zero && !is_fold && self->restarts++ == 0) {
    self->restart_from = to - self->step;
    self->restart_s = at_s;
  }
  self->step_before = self->step;
  self->step = step;
}

// Bits after which it starts anew, and how often it did; 0: none of the usual numbers.
static int bits_of(const ticks_wrap *self, uint64_t *folds) {
  for (int k = 0; k < WRAP_BITS; k++) {
    *folds = self->folds[k];
    if (self->folds[k] > 0 && self->misfits[k] == 0) return kBits[k];
  }
  return 0;
}

// 0: it does not wrap. A counter of M that starts anew at m jumps by M - m where it is taken for one of M.
static double wraps_at(const ticks_wrap *self) {
  uint64_t folds = 0;
  const int bits = bits_of(self, &folds);
  if (bits > 0) return ldexp(1, bits);
  if (self->jumps < 2 || (double)self->alike < 0.8 * (double)self->jumps) return 0;
  const double between = self->between / (double)(self->jumps - 1);
  if (fabs(between - self->first_jump) < WRAP_ALIKE * between) return rint(self->first_jump);
  const double whole = exp2(rint(log2(between + self->first_jump)));
  return fabs(between + self->first_jump - whole) < WRAP_ALIKE * whole ? rint(whole - self->first_jump) : 0;
}

// As the recording has it: "left", or "wheel_ticks_left" on CAN.
static const char *name_of(const char *about, int side) {
  const wm_quantity quantity = side ? WM_Q_WHEEL_TICKS_RIGHT : WM_Q_WHEEL_TICKS_LEFT;
  const char *column = motion_data_column(about, quantity);
  return column ? column : wm_quantity_name(quantity);
}

static int restarted(const ticks_wrap *self) {
  uint64_t folds = 0;
  return self->restarts > 0 && (bits_of(self, &folds) > 0 || wraps_at(self) == 0);
}

static void judge_wrap(const motion_data *self, int side, const char *about, wm_findings *out) {
  const double at = wraps_at(&self->wraps[side]);
  uint64_t folds = 0;
  const int bits = bits_of(&self->wraps[side], &folds);
  const char *name = name_of(about, side);
  if (at == 0) return;
  if (bits > 0) {
    char fix[WM_FINDING_FIX_MAX];
    if (strncmp(about, ABOUT, strlen(ABOUT)) == 0)
      (void)snprintf(fix, sizeof fix,
                     "vehicle.dbc: the signal has %d bits, the lower ones: `SG_ NAME : FIRST|%d@1+` (of @0 FIRST moves "
                     "by those that go)",
                     bits, bits);
    else
      (void)snprintf(fix, sizeof fix,
                     "%s.csv: counts that go on: %s plus %.0f from each row on at which it falls by more than %.0f, "
                     "less where it rises so",
                     about, name, at, at / 2);
    wm_find(out, WM_FOUND_COUNTER_RESTARTS, WM_SEVERITY_BAD, about, fix,
            "%s starts anew after %.0f counts, %" PRIu64 " times: a counter of %d bits, read as a longer one", name, at,
            folds, bits)
        ->size = at;
    return;
  }
  wm_find(out, WM_FOUND_COUNTER_RESTARTS, WM_SEVERITY_BAD, about,
          "let the sender count on to the last of the signal's bits, or write the unwrapped counts to ticks.csv",
          "%s jumps by about %.0f counts, %" PRIu64
          " times, %.0f counts apart: the counter starts anew at about %.0f, not "
          "at the end of its bits",
          name, self->wraps[side].first_jump, self->wraps[side].jumps,
          self->wraps[side].between / (double)(self->wraps[side].jumps - 1), at)
      ->size = at;
}

// Counters that jumped to 0, and not at each end of their bits: their sender started anew.
static void judge_restarts(const motion_data *self, const char *about, wm_findings *out) {
  const ticks_wrap *w[2] = {&self->wraps[0], &self->wraps[1]};
  const int is[2] = {restarted(w[0]), restarted(w[1])}, first = !is[0];
  if (!is[0] && !is[1]) return;
  wm_find(out, WM_FOUND_COUNTER_RESTARTS, WM_SEVERITY_NOTE, about,
          "did the motor controller start anew? Its first step is refused, and the drive goes on; what was driven "
          "meanwhile is not counted. Until its counts go on, they are not compared with other sensors",
          "%s%s%s: the counter restarts at 0, %.3f s after its first count, from %.0f%s", name_of(about, first),
          is[0] && is[1] ? " and " : "", is[0] && is[1] ? name_of(about, 1) : "", w[first]->restart_s,
          w[first]->restart_from, w[first]->restarts > 1 ? " (the first of several times)" : "")
      ->size = w[first]->restart_s;
}

// ── what arrives ────────────────────────────────────────────────────────────────────────────────────────────────────

static void take_ticks(motion_data *self, const quantity_seen *seen, wm_time_ns t_ns) {
  if (seen[WM_Q_WHEEL_TICKS_LEFT].count == 0 || seen[WM_Q_WHEEL_TICKS_RIGHT].count == 0) return;
  const double now[2] = {seen[WM_Q_WHEEL_TICKS_LEFT].last, seen[WM_Q_WHEEL_TICKS_RIGHT].last};
  const wm_time_ns half_ns = self->ticks_ns == WM_TIME_NONE ? -1 : t_ns / 2 - self->ticks_ns / 2;
  const double dt_s = (double)half_ns * 2e-9;
  if (dt_s >= 0 && dt_s < 0.05) return;  // single ticks give no speed
  const double m = 2 * M_PI * self->wheels->radius_m / self->wheels->ticks_per_turn;
  for (int side = 0; side < 2 && dt_s > 0 && dt_s < 1; side++)
    self->fastest_mps = fmax(self->fastest_mps, fabs((now[side] - self->ticks[side]) * m / dt_s));
  self->ticks_ns = t_ns;
  memcpy(self->ticks, now, sizeof now);
}

static int is_float(double value) {
  float as;
  if (value != rint(value) || fabs(value) > 4294967295.0) return 0;
  const uint32_t bits = (uint32_t)(int64_t)value;
  memcpy(&as, &bits, sizeof as);
  return fabs((double)as) > FLOAT_LEAST && fabs((double)as) < FLOAT_MOST;
}

void motion_data_take(motion_data *self, const wm_event *event) {
  if (event->kind != WM_EVENT_QUANTITIES || event->source >= WM_SOURCES_MAX) return;
  const wm_quantities *q = &event->as.quantities;
  quantity_seen *seen = self->at[event->source];
  int has_ticks = 0;
  for (uint8_t i = 0; i < q->count; i++) {
    const unsigned id = q->id[i];
    const double value = q->value[i];
    if (id >= WM_Q_COUNT || !isfinite(value)) continue;
    if (seen[id].count++ == 0) seen[id].least = seen[id].most = value;
    seen[id].least = fmin(seen[id].least, value);
    seen[id].most = fmax(seen[id].most, value);
    seen[id].last = value;
    seen[id].as_float += is_float(value);
    seen[id].zeros += value == 0;
    has_ticks |= id <= WM_Q_WHEEL_TICKS_RIGHT;
    if (id <= WM_Q_WHEEL_TICKS_RIGHT) take_count(&self->wraps[id], value, event->t_ns, q->doubt != 0);
  }
  if (has_ticks) take_ticks(self, seen, event->t_ns);
}

// ── findings ───────────────────────────────────────────────────────────────────────────────────────────────────────

typedef struct limit {
  wm_quantity first, last;
  double most;
  const char *si, *unit, *of_can;
} limit;
static const limit kLimits[] = {
    {WM_Q_WHEEL_SPEED_FRONT_LEFT, WM_Q_VEHICLE_SPEED, FASTEST_MPS, "m/s", "km/h",
     "is its unit km/h? Write `unit: km/h`"},
    {WM_Q_YAW_RATE, WM_Q_YAW_RATE, FASTEST_TURN_RADPS, "rad/s", "deg/s", "is its unit deg/s? Write `unit: deg/s`"},
    {WM_Q_STEERING_WHEEL, WM_Q_STEERING_WHEEL, 20, "rad", "degrees", "is its unit degrees? Write `unit: deg`"},
    {WM_Q_ROAD_WHEEL, WM_Q_ROAD_WHEEL, 1.4, "rad", "degrees", "is its unit degrees, or is it the steering wheel?"},
};

static void judge_range(const quantity_seen *seen, const limit *of, unsigned quantity, const char *source,
                        wm_findings *out) {
  const double most = fmax(fabs(seen->least), fabs(seen->most));
  const uint64_t values = seen->count - seen->zeros;
  if (seen->count == 0 || most <= of->most) return;
  const int is_can = strncmp(source, "can", 3) == 0;
  const char *column = motion_data_column(source, quantity);
  const char *name = column ? column : wm_quantity_name(quantity);
  char fix[WM_FINDING_FIX_MAX];
  if ((double)seen->as_float > FLOAT_SHARE * (double)values) {
    float as = 0;
    const uint32_t bits = (uint32_t)(int64_t)(fabs(seen->most) >= fabs(seen->least) ? seen->most : seen->least);
    memcpy(&as, &bits, sizeof as);
    wm_find(out, WM_FOUND_VALUE_IMPLAUSIBLE, WM_SEVERITY_BAD, source,
            "the DBC lacks the type of this signal: `SIG_VALTYPE_ ID SIGNAL : 1;` (ID of its BO_ line)",
            "%s: the largest value is %.4g, whose bits are %.4g as a float", name, most, (double)as);
    return;
  }
  if (!is_can) (void)snprintf(fix, sizeof fix, "is it in %s? %s of %s.csv is in %s", of->unit, name, source, of->si);
  wm_find(out, WM_FOUND_VALUE_IMPLAUSIBLE, WM_SEVERITY_BAD, source, is_can ? of->of_can : fix,
          "%s: the largest value is %.4g %s", name, most, of->si);
}

static void ranges(const motion_data *self, const wm_assembly *assembly, const char *counter, wm_findings *out) {
  for (size_t s = 0; s < assembly->source_count && s < WM_SOURCES_MAX; s++)
    for (size_t i = 0; i < sizeof kLimits / sizeof kLimits[0]; i++)
      for (unsigned q = kLimits[i].first; q <= kLimits[i].last; q++)
        judge_range(&self->at[s][q], &kLimits[i], q, assembly->sources[s].name, out);
  if (self->fastest_mps > FASTEST_MPS && !wm_findings_has(out, WM_FOUND_COUNTER_RESTARTS, counter))
    wm_find(out, WM_FOUND_VALUE_IMPLAUSIBLE, WM_SEVERITY_BAD, counter,
            "look at wheels.ticks_per_turn and radius_m, and at the signal's bits and sign",
            "the wheels' ticks would be %.0f m/s", self->fastest_mps);
  const wm_wheels *w = self->wheels;
  for (size_t s = 0; s < assembly->source_count && s < WM_SOURCES_MAX && w->steering_table_count > 0; s++) {
    const quantity_seen *q = &self->at[s][WM_Q_STEERING_ACTUATOR];
    if (q->count > 0 &&
        (q->least < w->actuator_m[0] - 0.02 || q->most > w->actuator_m[w->steering_table_count - 1] + 0.02))
      wm_find(out, WM_FOUND_VALUE_IMPLAUSIBLE, WM_SEVERITY_BAD, assembly->sources[s].name,
              "look at the signal's unit and offset, or measure the table's ends",
              "steering_actuator: %.1f to %.1f mm, but wheels.steering_table is of %.1f to %.1f", q->least * 1e3,
              q->most * 1e3, w->actuator_m[0] * 1e3, w->actuator_m[w->steering_table_count - 1] * 1e3);
  }
}

// A counter that stands while the other one counts a turn of its wheel.
static void dead(const motion_data *self, const quantity_seen *seen, const char *source, wm_findings *out) {
  for (unsigned q = WM_Q_WHEEL_TICKS_LEFT; q <= WM_Q_WHEEL_TICKS_RIGHT; q++) {
    const unsigned other = WM_Q_WHEEL_TICKS_LEFT + WM_Q_WHEEL_TICKS_RIGHT - q;
    const double counted = seen[other].most - seen[other].least;
    if (seen[q].count >= VALUES_MIN && seen[q].most == seen[q].least && counted > fabs(self->wheels->ticks_per_turn))
      wm_find(out, WM_FOUND_MOTION_SENSOR, WM_SEVERITY_BAD, source,
              "look at the encoder and its cable, and at the signal's place in the DBC",
              "%s is %.10g in all of its %" PRIu64 " data, while %s counts %.10g", wm_quantity_name(q), seen[q].last,
              seen[q].count, wm_quantity_name(other), counted);
  }
}

void motion_data_judge(const motion_data *self, const wm_assembly *assembly, uint32_t bound, wm_findings *out) {
  uint64_t count[WM_Q_COUNT] = {0};
  uint32_t elsewhere = 0;  // quantities of CAN that another source gives
  const char *counter = ABOUT;
  int has_can = 0;  // another source without any datum has a finding of its own
  for (size_t s = 0; s < assembly->source_count && s < WM_SOURCES_MAX; s++) {
    elsewhere |= assembly->sources[s].drops;
    has_can |= strncmp(assembly->sources[s].name, ABOUT, strlen(ABOUT)) == 0;
    for (unsigned q = 0; q < WM_Q_COUNT; q++) count[q] += self->at[s][q].count;
    if (self->at[s][WM_Q_WHEEL_TICKS_LEFT].count > 0) counter = assembly->sources[s].name;
  }
  for (unsigned q = 0; q < WM_Q_COUNT; q++)
    if (has_can && ((bound >> q) & 1u) && count[q] == 0 && !((elsewhere >> q) & 1u))
      wm_find(out, WM_FOUND_NO_DATA, WM_SEVERITY_BAD, ABOUT,
              "look at message and bus in can-signals.yaml, and at what candump receives",
              "%s is bound, but no frame with a value of it came", wm_quantity_name(q));
  for (int side = 0; side < 2; side++) judge_wrap(self, side, counter, out);
  judge_restarts(self, counter, out);
  ranges(self, assembly, counter, out);
  for (size_t s = 0; s < assembly->source_count && s < WM_SOURCES_MAX; s++)
    dead(self, self->at[s], assembly->sources[s].name, out);
}
