// SPDX-License-Identifier: Apache-2.0
// Motion, positions and headings against each other: the way and the turn between two positions by the motion sensors,
// against their distance and the change of their direction; a heading against the direction of the way.
#include <math.h>
#include <string.h>

#include "cli/check/check.h"

#define STEP_SIGMAS 6.0  // a step between two positions is this many of their sigmas, so that its direction is known
#define STEP_MIN_M 1.0
#define STEP_MAX_S 5.0    // longer, a way is not straight
#define WITHIN_MIN 3      // positions of such a time, which therefore is no silence of the receiver
#define STOOD_MIN 3       // such times, in which the positions stand and the motion goes on
#define STEPS_MIN 30      // of a judgement
#define TURN_MIN_RAD 0.1  // root mean square of the turns: a straight drive has no information
// A receiver, wheels and a map agree within some per cent; units differ by 1.6 (miles), 3.6 (km/h) and more.
#define WAY_RATIO_MAX 1.5
#define CORRELATION_MIN 0.5
// Mean of cos and sin of the difference, below which heading and way have no fixed angle.
#define FIXED_ANGLE_MIN 0.8
#define HEADING_OFF_RAD 0.35  // a mounting that is seen with the naked eye

static void agreement_add(agreement *self, double a, double b) {
  if (isnan(a) || isnan(b)) return;
  self->aa += a * a;
  self->bb += b * b;
  self->ab += a * b;
  self->count++;
}

static double agreement_correlation(const agreement *self) {
  const double size = sqrt(self->aa * self->bb);
  return size > 0 ? self->ab / size : 0;
}

void course_data_init(course_data *self) {
  memset(self, 0, sizeof *self);
  self->motion_ns = self->from_ns = WM_TIME_NONE;
  self->heading_rad = self->last_course_rad = (double)NAN;
  self->speed_mps = self->turn_radps = (double)NAN;
}

// The motion holds from its stamp to the next one.
static void integrate(course_data *self, wm_time_ns t_ns) {
  const double dt_s = self->motion_ns == WM_TIME_NONE ? 0 : wm_seconds_between(self->motion_ns, t_ns);
  if (dt_s > 0 && dt_s < 1) {
    if (isfinite(self->speed_mps)) self->way_m += self->speed_mps * dt_s;
    if (isfinite(self->turn_radps)) self->turn_rad += self->turn_radps * dt_s;
  }
  if (dt_s >= 0) self->motion_ns = t_ns;
}

static void take_motion(course_data *self, const wm_event *event) {
  integrate(self, event->t_ns);
  if (event->kind == WM_EVENT_TWIST2) {
    self->speed_mps = event->as.twist2.v_mps;
    self->turn_radps = event->as.twist2.w_radps;
  } else if (event->kind == WM_EVENT_TWIST6) {
    self->speed_mps = hypot(event->as.twist6.v_mps[0], event->as.twist6.v_mps[1]);
    if (!isnan(event->as.twist6.w_radps[2])) self->turn_radps = event->as.twist6.w_radps[2];  // else the gyro's
  }
  for (uint8_t i = 0; event->kind == WM_EVENT_QUANTITIES && i < event->as.quantities.count; i++) {
    const double value = event->as.quantities.value[i];
    if (event->as.quantities.id[i] == WM_Q_VEHICLE_SPEED) self->speed_mps = value;
    if (event->as.quantities.id[i] == WM_Q_YAW_RATE) self->turn_radps = value;
  }
}

static void take_step(course_data *self, const double step_m[2]) {
  const double course_rad = atan2(step_m[1], step_m[0]);
  if (isfinite(self->speed_mps)) agreement_add(&self->way, hypot(step_m[0], step_m[1]), fabs(self->way_m));
  // The direction of a step is that of its middle: a turn from middle to middle is half of both steps' turns.
  const double turned_rad = (self->turn_rad + self->last_turn_rad) / 2;
  const int is_forwards = !(self->way_m < 0) && !(self->last_way_m < 0);
  if (isfinite(self->last_course_rad) && isfinite(self->turn_radps) && is_forwards && fabs(turned_rad) < 2)
    agreement_add(&self->turn, remainder(course_rad - self->last_course_rad, 2 * M_PI), turned_rad);
  if (isfinite(self->heading_rad) && self->way_m >= 0) {
    self->heading_less[0] += cos(self->heading_rad - course_rad);
    self->heading_less[1] += sin(self->heading_rad - course_rad);
    self->heading_plus[0] += cos(self->heading_rad + course_rad);
    self->heading_plus[1] += sin(self->heading_rad + course_rad);
    self->headings++;
  }
  self->last_course_rad = course_rad;
  self->last_turn_rad = self->turn_rad;
  self->last_way_m = self->way_m;
}

static void take_position(course_data *self, const wm_event *event) {
  const wm_position *p = &event->as.position;
  integrate(self, event->t_ns);
  const double after_s = self->from_ns == WM_TIME_NONE ? HUGE_VAL : wm_seconds_between(self->from_ns, event->t_ns);
  const double step_m[2] = {p->p_m[0] - self->from_m[0], p->p_m[1] - self->from_m[1]};
  const double sigma_m = isfinite(p->sigma_xy_m) ? p->sigma_xy_m : 0;
  const double least_m = fmax(STEP_MIN_M, STEP_SIGMAS * sigma_m);
  self->within++;
  if (after_s > STEP_MAX_S) {
    self->last_course_rad = (double)NAN;
    if (isfinite(after_s) && self->within >= WITHIN_MIN && fabs(self->way_m) > 2 * least_m) {
      self->stood++;
      self->stood_m += fabs(self->way_m);
    }
  } else if (hypot(step_m[0], step_m[1]) < least_m) {
    return;  // the step grows until the next position
  } else {
    take_step(self, step_m);
  }
  self->from_ns = event->t_ns;
  self->from_m[0] = p->p_m[0];
  self->from_m[1] = p->p_m[1];
  self->way_m = self->turn_rad = 0;
  self->within = 0;
}

void course_data_take(course_data *self, const wm_event *event) {
  if (WM_EVENT_BIT(event->kind) & WM_MOTION_EVENTS) take_motion(self, event);
  if (event->kind == WM_EVENT_POSITION) take_position(self, event);
  if (event->kind == WM_EVENT_HEADING) self->heading_rad = event->as.heading.heading_rad;
}

// ── findings ────────────────────────────────────────────────────────────────────────────────────────────────────────

static void judge_heading(const course_data *self, wm_findings *out) {
  if (self->headings < STEPS_MIN) return;
  const double n = (double)self->headings;
  const double less = hypot(self->heading_less[0], self->heading_less[1]) / n;
  const double plus = hypot(self->heading_plus[0], self->heading_plus[1]) / n;
  const double off_rad = atan2(self->heading_less[1], self->heading_less[0]);
  if (plus > FIXED_ANGLE_MIN && plus > less) {
    wm_find(out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, "heading",
            "heading_rad = pi/2 - compass: it is counter-clockwise from the x axis (east), a compass is clockwise from "
            "north",
            "its heading turns left where the way of the positions turns right")
        ->size = -1;
  } else if (less > FIXED_ANGLE_MIN && fabs(off_rad) > HEADING_OFF_RAD) {
    char fix[WM_FINDING_FIX_MAX];
    (void)snprintf(fix, sizeof fix, "add %.4f rad (%.1f degrees) to heading_rad, or correct the sensor's mounting",
                   -off_rad, -off_rad * 180 / M_PI);
    wm_find(out, WM_FOUND_SENSORS_DISAGREE, fabs(off_rad) > 2 * HEADING_OFF_RAD ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE,
            "heading", fix, "its heading is %.0f degrees to the left of the way of the positions", off_rad * 180 / M_PI)
        ->size = off_rad;
  }
}

void course_data_judge(const course_data *self, wm_findings *out) {
  const agreement *w = &self->way, *t = &self->turn;
  const double ratio = w->bb > 0 ? w->ab / w->bb : 1;
  if (w->count >= STEPS_MIN && agreement_correlation(w) > CORRELATION_MIN &&
      (ratio > WAY_RATIO_MAX || ratio < 1 / WAY_RATIO_MAX)) {
    char fix[WM_FINDING_FIX_MAX];
    (void)snprintf(
        fix, sizeof fix,
        "multiply the speed by %.3g, or look at its unit (km/h is 3.6 times m/s) and at that of the positions", ratio);
    wm_find(out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, "speed", fix,
            "the way of the positions is %.2f times the way by the speed", ratio)
        ->size = ratio;
  }
  if (t->count >= STEPS_MIN && sqrt(t->bb / (double)t->count) > TURN_MIN_RAD &&
      agreement_correlation(t) < -CORRELATION_MIN)
    wm_find(out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, "turn rate",
            "`scale: -1` at yaw_rate, or w_radps = -w_radps: positive is to the left; or the positions' x and y are "
            "swapped or mirrored",
            "it turns left where the way of the positions turns right (correlation %.2f)", agreement_correlation(t))
        ->size = agreement_correlation(t);
  if (self->stood >= STOOD_MIN && w->count == 0)
    wm_find(out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, "positions",
            "are they degrees of latitude and longitude? x_m and y_m are metres east and north of the map's origin; or "
            "the receiver repeats a place",
            "no position is a metre, or %.0f of its sigmas, from the one before, while the robot drives %.0f m",
            STEP_SIGMAS, self->stood_m)
        ->size = self->stood_m;
  judge_heading(self, out);
}
