// SPDX-License-Identifier: Apache-2.0
// Motion over CAN: other units than in the binding, wrong signs, messages that never arrive. Found by comparing two
// sensors of the same motion.
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "cli/check/check.h"

#define ABOUT "can"
#define FASTEST_MPS 70.0        // 250 km/h
#define FASTEST_TURN_RADPS 6.0  // about a turn a second
#define PAIRS_MIN 100           // a correlation of fewer pairs is too uncertain
#define TURN_RMS_MIN 0.02       // rad/s: a drive straight ahead has no information

void motion_data_init(motion_data *self, const wm_wheels *wheels) {
  memset(self, 0, sizeof *self);
  self->wheels = wheels;
  self->ticks_ns = WM_TIME_NONE;
  self->turn_by_ticks = self->speed_by_ticks = (double)NAN;
  for (unsigned q = 0; q < WM_Q_COUNT; q++) self->last[q] = (double)NAN;
}

void agreement_add(agreement *self, double a, double b) {
  if (isnan(a) || isnan(b)) return;
  self->aa += a * a;
  self->bb += b * b;
  self->ab += a * b;
  self->count++;
}

double agreement_correlation(const agreement *self) {
  const double size = sqrt(self->aa * self->bb);
  return size > 0 ? self->ab / size : 0;
}

double agreement_ratio(const agreement *self, double limit) {
  if (!(self->ab > 0) || !(self->bb > 0)) return 1;
  // Noise of b makes ab/bb smaller than the true ratio, noise of a makes aa/ab larger: it is in between.
  const double least = self->ab / self->bb, most = self->aa / self->ab;
  return least > limit || most < 1 / limit ? sqrt(least * most) : 1;
}

static void take_ticks(motion_data *self, wm_time_ns t_ns) {
  double left = self->last[WM_Q_WHEEL_TICKS_LEFT], right = self->last[WM_Q_WHEEL_TICKS_RIGHT];
  if (isnan(left) || isnan(right)) return;
  double dt_s = self->ticks_ns == WM_TIME_NONE ? -1 : wm_seconds_between(self->ticks_ns, t_ns);
  if (dt_s >= 0 && dt_s < 0.05) return;  // single ticks give no speed
  if (dt_s > 0 && dt_s < 1) {
    double m = 2 * M_PI * self->wheels->radius_m / self->wheels->ticks_per_turn;
    double l = (left - self->ticks[0]) * m / dt_s, r = (right - self->ticks[1]) * m / dt_s;
    self->fastest_mps = fmax(self->fastest_mps, fmax(fabs(l), fabs(r)));
    self->turn_by_ticks = (r - l) / self->wheels->track_m;
    self->speed_by_ticks = (l + r) / 2;
  }
  self->ticks_ns = t_ns;
  self->ticks[0] = left;
  self->ticks[1] = right;
}

static double wheel_speed(const motion_data *self, int is_right) {
  double rear = self->last[is_right ? WM_Q_WHEEL_SPEED_REAR_RIGHT : WM_Q_WHEEL_SPEED_REAR_LEFT];
  return isnan(rear) ? self->last[is_right ? WM_Q_WHEEL_SPEED_FRONT_RIGHT : WM_Q_WHEEL_SPEED_FRONT_LEFT] : rear;
}

// The sign by the gear, where there is one: wheel speeds may have none.
static double direction(const motion_data *self) { return self->last[WM_Q_GEAR] < 0 ? -1 : 1; }

static void take_turn(motion_data *self) {
  double gyro = self->last[WM_Q_YAW_RATE], left = wheel_speed(self, 0), right = wheel_speed(self, 1);
  double speed = isnan(left) || isnan(right) ? self->last[WM_Q_VEHICLE_SPEED] : (left + right) / 2;
  double sign = speed < 0 ? 1 : direction(self);
  double steering = isnan(self->last[WM_Q_ROAD_WHEEL]) ? self->last[WM_Q_STEERING_WHEEL] : self->last[WM_Q_ROAD_WHEEL];
  agreement_add(&self->turn_wheels, gyro, sign * (right - left));
  agreement_add(&self->turn_ticks, gyro, self->turn_by_ticks);
  agreement_add(&self->turn_steering, gyro, sign * speed * steering);
}

void motion_data_take(motion_data *self, const wm_event *event) {
  if (event->kind != WM_EVENT_QUANTITIES) return;
  const wm_quantities *q = &event->as.quantities;
  int has_ticks = 0, has_turn = 0, has_speed = 0;
  for (uint8_t i = 0; i < q->count; i++) {
    unsigned id = q->id[i];
    double value = q->value[i];
    if (id >= WM_Q_COUNT) continue;
    if (self->count[id]++ == 0) self->least[id] = self->most[id] = value;
    self->least[id] = fmin(self->least[id], value);
    self->most[id] = fmax(self->most[id], value);
    self->last[id] = value;
    has_ticks |= id <= WM_Q_WHEEL_TICKS_RIGHT;
    has_turn |= id == WM_Q_YAW_RATE;
    has_speed |= id == WM_Q_VEHICLE_SPEED;
  }
  if (has_ticks) take_ticks(self, event->t_ns);
  if (has_turn) take_turn(self);
  if (has_speed) agreement_add(&self->speed_ticks, fabs(self->last[WM_Q_VEHICLE_SPEED]), fabs(self->speed_by_ticks));
  if (has_speed)
    agreement_add(&self->speed_wheels, fabs(self->last[WM_Q_VEHICLE_SPEED]),
                  (fabs(wheel_speed(self, 0)) + fabs(wheel_speed(self, 1))) / 2);
}

// ── findings ───────────────────────────────────────────────────────────────────────────────────────────────────────

static void ranges(const motion_data *self, wm_findings *out) {
  static const struct {
    wm_quantity first, last;
    double most;
    const char *unit, *fix;
  } kLimits[] = {
      {WM_Q_WHEEL_SPEED_FRONT_LEFT, WM_Q_VEHICLE_SPEED, FASTEST_MPS, "m/s", "is its unit km/h? Write `unit: km/h`"},
      {WM_Q_YAW_RATE, WM_Q_YAW_RATE, FASTEST_TURN_RADPS, "rad/s", "is its unit deg/s? Write `unit: deg/s`"},
      {WM_Q_STEERING_WHEEL, WM_Q_STEERING_WHEEL, 20, "rad", "is its unit degrees? Write `unit: deg`"},
      {WM_Q_ROAD_WHEEL, WM_Q_ROAD_WHEEL, 1.4, "rad", "is its unit degrees, or is it the steering wheel?"},
  };
  for (size_t i = 0; i < sizeof kLimits / sizeof kLimits[0]; i++)
    for (unsigned q = kLimits[i].first; q <= kLimits[i].last; q++) {
      double most = fmax(fabs(self->least[q]), fabs(self->most[q]));
      if (self->count[q] > 0 && most > kLimits[i].most)
        wm_find(out, WM_FOUND_VALUE_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT, kLimits[i].fix,
                "%s: the largest value is %.4g %s", wm_quantity_name(q), most, kLimits[i].unit);
    }
  if (self->fastest_mps > FASTEST_MPS)
    wm_find(out, WM_FOUND_VALUE_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "look at wheels.ticks_per_turn and radius_m, and at the signal's bits and sign",
            "the wheels' ticks would be %.0f m/s", self->fastest_mps);
  const wm_wheels *w = self->wheels;
  unsigned q = WM_Q_STEERING_ACTUATOR;
  if (self->count[q] > 0 && w->steering_table_count > 0 &&
      (self->least[q] < w->actuator_m[0] - 0.02 || self->most[q] > w->actuator_m[w->steering_table_count - 1] + 0.02))
    wm_find(out, WM_FOUND_VALUE_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "look at the signal's unit and offset, or measure the table's ends",
            "steering_actuator: %.1f to %.1f mm, but wheels.steering_table is of %.1f to %.1f", self->least[q] * 1e3,
            self->most[q] * 1e3, w->actuator_m[0] * 1e3, w->actuator_m[w->steering_table_count - 1] * 1e3);
}

// A gyro and two wheels measure the same turn: their ratio is that of the track, or of a wheel's scale.
static void track(const motion_data *self, wm_findings *out) {
  const agreement *a = &self->turn_ticks;
  if (a->count < PAIRS_MIN || sqrt(a->aa / (double)a->count) < TURN_RMS_MIN || a->bb <= 0) return;
  const double ratio = agreement_ratio(a, 1.5);
  if (agreement_correlation(a) < 0.5 || ratio == 1) return;
  char mend[160];
  (void)snprintf(mend, sizeof mend,
                 "measure it again (`wheels: {track_m: %.3g}` would agree), or look at the gyro's unit",
                 self->wheels->track_m / ratio);
  wm_find(out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, "calibration", mend,
          "yaw_rate is %.2f times the turn rate by the wheels' ticks with wheels.track_m %.3g", ratio,
          self->wheels->track_m);
}

static void turns(const agreement *a, const char *other, wm_findings *out) {
  if (a->count < PAIRS_MIN || sqrt(a->aa / (double)a->count) < TURN_RMS_MIN || a->bb <= 0) return;
  if (agreement_correlation(a) < -0.5)
    wm_find(out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, ABOUT,
            "`scale: -1` at the one that is not positive to the left; or left and right are swapped",
            "yaw_rate turns left where %s turns right (correlation %.2f)", other, agreement_correlation(a));
}

static void speeds(const motion_data *self, wm_findings *out) {
  const agreement *s = &self->speed_ticks;
  const double ratio = agreement_ratio(s, 1.5);
  if (s->count < PAIRS_MIN || s->bb / (double)s->count < 0.01 || ratio == 1) return;
  char fix[WM_FINDING_FIX_MAX];
  (void)snprintf(fix, sizeof fix,
                 "one of them is wrong: the speed's unit, or the wheels' (`radius_m: %.4g` or `ticks_per_turn: %.6g` "
                 "would agree)",
                 self->wheels->radius_m * ratio, self->wheels->ticks_per_turn / ratio);
  wm_find(out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, ABOUT, fix,
          "vehicle_speed is %.2f times the speed by the wheels' ticks", ratio)
      ->size = ratio;
}

static int stands(const motion_data *self, unsigned q) {
  return self->count[q] >= PAIRS_MIN && self->most[q] == self->least[q];
}

// A counter that stands while the other one counts a turn of its wheel, and a gyro that shows the same while the wheels
// turn the robot.
static void dead(const motion_data *self, wm_findings *out) {
  for (unsigned q = WM_Q_WHEEL_TICKS_LEFT; q <= WM_Q_WHEEL_TICKS_RIGHT; q++) {
    const unsigned other = WM_Q_WHEEL_TICKS_LEFT + WM_Q_WHEEL_TICKS_RIGHT - q;
    const double counted = self->most[other] - self->least[other];
    if (stands(self, q) && counted > fabs(self->wheels->ticks_per_turn))
      wm_find(out, WM_FOUND_MOTION_SENSOR, WM_SEVERITY_BAD, ABOUT,
              "look at the encoder and its cable, and at the signal's place in the DBC",
              "%s is %.10g in all of its %" PRIu64 " data, while %s counts %.10g", wm_quantity_name(q), self->last[q],
              self->count[q], wm_quantity_name(other), counted);
  }
  const agreement *a = &self->turn_ticks;
  if (stands(self, WM_Q_YAW_RATE) && a->count >= PAIRS_MIN && sqrt(a->bb / (double)a->count) > TURN_RMS_MIN)
    wm_find(out, WM_FOUND_MOTION_SENSOR, WM_SEVERITY_BAD, ABOUT,
            "look at the gyro, and at the signal's place in the DBC",
            "yaw_rate is %.10g rad/s in all of its %" PRIu64 " data, while the wheels turn the robot",
            self->last[WM_Q_YAW_RATE], self->count[WM_Q_YAW_RATE]);
}

void motion_data_judge(const motion_data *self, uint32_t bound, wm_findings *out) {
  for (unsigned q = 0; q < WM_Q_COUNT; q++)
    if (((bound >> q) & 1u) && self->count[q] == 0)
      wm_find(out, WM_FOUND_NO_DATA, WM_SEVERITY_BAD, ABOUT,
              "look at message and bus in can-signals.yaml, and at what candump receives",
              "%s is bound, but no frame with a value of it came", wm_quantity_name(q));
  ranges(self, out);
  dead(self, out);
  track(self, out);
  turns(&self->turn_wheels, "the difference of the wheels' speeds", out);
  turns(&self->turn_ticks, "the difference of the wheels' ticks", out);
  turns(&self->turn_steering, "the steering", out);
  speeds(self, out);
  const agreement *s = &self->speed_wheels;
  const double ratio = agreement_ratio(s, 1.6);
  if (s->count >= PAIRS_MIN && s->bb / (double)s->count > 0.01 && ratio != 1)
    wm_find(out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, ABOUT,
            "one of them has another unit than its binding states (km/h is 3.6 times m/s): write `unit:`",
            "vehicle_speed is %.2f times the wheels' speeds", ratio);
}
