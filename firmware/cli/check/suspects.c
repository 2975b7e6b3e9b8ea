// SPDX-License-Identifier: Apache-2.0
#include "cli/check/suspects.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEG (M_PI / 180)

// ── what there is ───────────────────────────────────────────────────────────────────────────────────────────────────

static void take_identity(source_seen *self, int32_t id, uint16_t sensor) {
  if (sensor < 64) self->sensors |= UINT64_C(1) << sensor;
  if (id < 0) return;
  if (self->most_id < self->least_id) self->least_id = self->most_id = id;
  if (id < self->least_id) self->least_id = id;
  if (id > self->most_id) self->most_id = id;
}

void source_seen_take(source_seen *self, const wm_event *event) {
  if (self->kinds == 0) self->most_id = -1, self->least_id = 0;
  self->kinds |= WM_EVENT_BIT(event->kind);
  if (event->kind == WM_EVENT_SIGHTING) {
    take_identity(self, event->as.sighting.landmark_id, event->as.sighting.sensor);
    self->has_range |= !isnan(event->as.sighting.range_m);
  } else if (event->kind == WM_EVENT_MARKER) {
    take_identity(self, event->as.marker.id, event->as.marker.sensor);
  } else if (event->kind == WM_EVENT_QUANTITIES) {
    for (size_t i = 0; i < event->as.quantities.count; i++)
      self->quantities |= UINT32_C(1) << event->as.quantities.id[i];
  }
}

// ── the list ────────────────────────────────────────────────────────────────────────────────────────────────────────

typedef struct list {
  suspect *at;
  size_t count;
} list;

static void add(list *out, suspect_kind kind, size_t source, size_t sensor, double value) {
  if (out->count < SUSPECTS_MAX) out->at[out->count++] = (suspect){kind, (uint16_t)source, (uint16_t)sensor, value};
}

static void add_values(list *out, suspect_kind kind, size_t source, size_t sensor, const double *values, size_t count) {
  for (size_t i = 0; i < count; i++) add(out, kind, source, sensor, values[i]);
}

#define VALUES(...) (const double[]){__VA_ARGS__}, sizeof((const double[]){__VA_ARGS__}) / sizeof(double)

// mm, cm, inch, foot, dm, and metres that were taken for mm.
#define LENGTHS VALUES(0.001, 0.01, 0.0254, 0.3048, 0.1, 1000)

static void add_identities(list *out, const wm_assembly *assembly, const source_seen *seen, size_t source) {
  const wm_setup *setup = &assembly->setup;
  if (seen->most_id < seen->least_id) return;
  add_values(out, SUSPECT_IDENTITY, source, 0, VALUES(-1, 1));
  if (setup->landmark_count == 0) return;
  int32_t least = INT32_MAX;
  for (size_t i = 0; i < setup->landmark_count; i++)
    if (setup->landmarks[i].id < least) least = setup->landmarks[i].id;
  const double shift = (double)least - seen->least_id;
  if (fabs(shift) > 1) add(out, SUSPECT_IDENTITY, source, 0, shift);
  if (seen->kinds & WM_EVENT_BIT(WM_EVENT_SIGHTING)) add(out, SUSPECT_NO_IDENTITY, source, 0, 0);
}

static void add_observations(list *out, const wm_assembly *assembly, const source_seen *seen, size_t source) {
  add_values(out, SUSPECT_TIME, source, 0,
             VALUES(-0.1, 0.1, -0.2, 0.2, -0.35, 0.35, -0.5, 0.5, -0.75, 0.75, -1, 1, -1.5, 1.5, -2, 2, -3, 3, -5, 5));
  if (seen->kinds & WM_EVENT_BIT(WM_EVENT_POSITION)) add(out, SUSPECT_POSITION_SWAP, source, 0, 0);
  if (seen->kinds & WM_EVENT_BIT(WM_EVENT_SIGHTING)) add(out, SUSPECT_BEARING_SIGN, source, 0, 0);
  if (seen->has_range) add_values(out, SUSPECT_RANGE_FACTOR, source, 0, LENGTHS);
  add_identities(out, assembly, seen, source);
  for (size_t s = 0; s < assembly->setup.sensor_count && s < 64; s++) {
    if (!((seen->sensors >> s) & 1u)) continue;
    add_values(out, SUSPECT_MOUNTING_YAW, source, s, VALUES(M_PI, M_PI / 2, -M_PI / 2));
    const double *p = assembly->setup.sensors[s].mounting.xyz_m;
    if (hypot(p[0], p[1]) > 0.5) add_values(out, SUSPECT_MOUNTING_FACTOR, source, s, VALUES(0.01, 0.001));
  }
}

static void add_motion(list *out, const source_seen *seen, size_t source) {
  const uint32_t ticks = (1u << WM_Q_WHEEL_TICKS_LEFT) | (1u << WM_Q_WHEEL_TICKS_RIGHT);
  if ((seen->quantities & ticks) == ticks) {
    add(out, SUSPECT_TICKS_SWAP, source, 0, 0);
    add(out, SUSPECT_TICKS_LEFT_SIGN, source, 0, 0);
    add(out, SUSPECT_TICKS_RIGHT_SIGN, source, 0, 0);
    add(out, SUSPECT_TICKS_SIGN, source, 0, 0);
    add_values(out, SUSPECT_RADIUS_FACTOR, source, 0, VALUES(0.5, 2, 0.25, 4, 0.1, 10, 0.001));
  }
  if ((seen->quantities & (1u << WM_Q_YAW_RATE)) || (seen->kinds & WM_TWIST_EVENTS))
    add_values(out, SUSPECT_YAW_RATE_FACTOR, source, 0, VALUES(-1, DEG, 1 / DEG));
  if (seen->kinds & WM_TWIST_EVENTS) add_values(out, SUSPECT_SPEED_FACTOR, source, 0, VALUES(-1, 0.001, 1 / 3.6, 3.6));
}

size_t suspects_list(const wm_assembly *assembly, const source_seen *seen, suspect *out) {
  list all = {out, 0};
  add(&all, SUSPECT_NONE, 0, 0, 0);
  for (size_t i = 0; i < assembly->source_count; i++) {
    if (seen[i].kinds & WM_MOTION_EVENTS)
      add_motion(&all, &seen[i], i);
    else if (seen[i].kinds)
      add_observations(&all, assembly, &seen[i], i);
  }
  if (assembly->setup.landmark_count > 0) {
    add(&all, SUSPECT_MAP_SWAP, 0, 0, 0);
    add(&all, SUSPECT_MAP_MIRROR_X, 0, 0, 0);
    add(&all, SUSPECT_MAP_MIRROR_Y, 0, 0, 0);
    add_values(&all, SUSPECT_MAP_FACTOR, 0, 0, LENGTHS);
  }
  return all.count;
}

// ── a trial's changes ───────────────────────────────────────────────────────────────────────────────────────────────

static void change_quantity(wm_event *event, wm_quantity q, double factor) {
  wm_quantities *all = &event->as.quantities;
  for (size_t i = 0; event->kind == WM_EVENT_QUANTITIES && i < all->count; i++)
    if (all->id[i] == q) all->value[i] *= factor;
}

static void swap_ticks(wm_event *event) {
  wm_quantities *all = &event->as.quantities;
  for (size_t i = 0; event->kind == WM_EVENT_QUANTITIES && i < all->count; i++)
    if (all->id[i] <= WM_Q_WHEEL_TICKS_RIGHT) all->id[i] = WM_Q_WHEEL_TICKS_RIGHT - all->id[i];
}

static void change_twist(wm_event *event, double v_factor, double w_factor) {
  if (event->kind == WM_EVENT_TWIST2) {
    event->as.twist2.v_mps *= v_factor;
    event->as.twist2.w_radps *= w_factor;
  } else if (event->kind == WM_EVENT_TWIST6) {
    for (int k = 0; k < 3; k++) {
      event->as.twist6.v_mps[k] *= v_factor;
      event->as.twist6.w_radps[k] *= w_factor;
    }
  }
}

static void swap(double *a, double *b) {
  const double c = *a;
  *a = *b;
  *b = c;
}

static void change_sighting(const suspect *s, wm_event *event) {
  int32_t *id = event->kind == WM_EVENT_SIGHTING ? &event->as.sighting.landmark_id
                : event->kind == WM_EVENT_MARKER ? &event->as.marker.id
                                                 : NULL;
  if (s->kind == SUSPECT_IDENTITY && id && *id >= 0) *id += (int32_t)s->value;
  if (event->kind != WM_EVENT_SIGHTING) return;
  if (s->kind == SUSPECT_BEARING_SIGN) event->as.sighting.bearing_rad *= -1;
  if (s->kind == SUSPECT_RANGE_FACTOR) event->as.sighting.range_m *= s->value;
  if (s->kind == SUSPECT_NO_IDENTITY) event->as.sighting.landmark_id = -1;
}

static void change(const suspect *s, wm_event *event) {
  if (event->source != s->source) return;
  switch (s->kind) {
    case SUSPECT_TIME:
      event->t_ns += wm_ns_from_seconds(s->value);
      event->arrival_ns += wm_ns_from_seconds(s->value);
      break;
    case SUSPECT_BEARING_SIGN:
    case SUSPECT_RANGE_FACTOR:
    case SUSPECT_IDENTITY:
    case SUSPECT_NO_IDENTITY: change_sighting(s, event); break;
    case SUSPECT_POSITION_SWAP:
      if (event->kind == WM_EVENT_POSITION) swap(&event->as.position.p_m[0], &event->as.position.p_m[1]);
      break;
    case SUSPECT_TICKS_SWAP: swap_ticks(event); break;
    case SUSPECT_TICKS_LEFT_SIGN: change_quantity(event, WM_Q_WHEEL_TICKS_LEFT, -1); break;
    case SUSPECT_TICKS_RIGHT_SIGN: change_quantity(event, WM_Q_WHEEL_TICKS_RIGHT, -1); break;
    case SUSPECT_TICKS_SIGN:
      change_quantity(event, WM_Q_WHEEL_TICKS_LEFT, -1);
      change_quantity(event, WM_Q_WHEEL_TICKS_RIGHT, -1);
      break;
    case SUSPECT_YAW_RATE_FACTOR:
      change_quantity(event, WM_Q_YAW_RATE, s->value);
      change_twist(event, 1, s->value);
      break;
    case SUSPECT_SPEED_FACTOR: change_twist(event, s->value, 1); break;
    default: break;
  }
}

void suspects_change(const suspects_applied *self, wm_event *event) {
  for (size_t i = 0; i < self->count; i++) change(&self->of[i], event);
}

static void change_landmark(const suspect *s, wm_landmark *l) {
  switch (s->kind) {
    case SUSPECT_MAP_SWAP:
      swap(&l->p_m[0], &l->p_m[1]);
      l->yaw_rad = M_PI / 2 - l->yaw_rad;
      break;
    case SUSPECT_MAP_MIRROR_X:
      l->p_m[0] *= -1;
      l->yaw_rad = M_PI - l->yaw_rad;
      break;
    case SUSPECT_MAP_MIRROR_Y:
      l->p_m[1] *= -1;
      l->yaw_rad *= -1;
      break;
    case SUSPECT_MAP_FACTOR:
      for (int k = 0; k < 2; k++) l->p_m[k] *= s->value;
      break;
    default: break;
  }
}

static void change_sensor(const suspect *s, wm_sensor *sensor) {
  wm_mounting *m = &sensor->mounting;
  if (s->kind == SUSPECT_MOUNTING_YAW) m->rpy_rad[2] = remainder(m->rpy_rad[2] + s->value, 2 * M_PI);
  for (int k = 0; s->kind == SUSPECT_MOUNTING_FACTOR && k < 3; k++) m->xyz_m[k] *= s->value;
}

void suspects_prepare(suspects_applied *self, wm_assembly *assembly) {
  wm_setup *setup = &assembly->setup;
  const size_t landmarks = setup->landmark_count * sizeof *self->landmarks;
  const size_t sensors = setup->sensor_count * sizeof *self->sensors;
  self->landmarks = landmarks ? malloc(landmarks) : NULL;
  self->sensors = sensors ? malloc(sensors) : NULL;
  if (self->landmarks) setup->landmarks = memcpy(self->landmarks, setup->landmarks, landmarks);
  if (self->sensors) setup->sensors = memcpy(self->sensors, setup->sensors, sensors);
  for (size_t i = 0; i < self->count; i++) {
    const suspect *s = &self->of[i];
    if (s->kind == SUSPECT_RADIUS_FACTOR) setup->wheels.radius_m *= s->value;
    for (size_t k = 0; self->landmarks && k < setup->landmark_count; k++) change_landmark(s, &self->landmarks[k]);
    if (self->sensors && s->sensor < setup->sensor_count) change_sensor(s, &self->sensors[s->sensor]);
  }
}

void suspects_release(suspects_applied *self) {
  free(self->landmarks);
  free(self->sensors);
  self->landmarks = NULL;
  self->sensors = NULL;
}

// ── texts ───────────────────────────────────────────────────────────────────────────────────────────────────────────

static const char *length_name(double factor) {
  static const struct {
    double factor;
    const char *name;
  } kNames[] = {{0.001, "mm"}, {0.01, "cm"}, {0.0254, "inches"}, {0.3048, "feet"}, {0.1, "dm"}, {1000, "km"}};
  for (size_t i = 0; i < sizeof kNames / sizeof kNames[0]; i++)
    if (kNames[i].factor == factor) return kNames[i].name;
  return "another unit";
}

void suspect_text(const suspect *s, const wm_assembly *assembly, char *what, size_t what_capacity, char *fix,
                  size_t fix_capacity) {
  const wm_setup *setup = &assembly->setup;
  const char *name = s->source < assembly->source_count ? assembly->sources[s->source].name : "?";
  const wm_sensor *sensor = s->sensor < setup->sensor_count ? &setup->sensors[s->sensor] : NULL;
  const wm_mounting *m = sensor ? &sensor->mounting : NULL;
  const char *length = length_name(s->value);
#define WHAT(...) (void)snprintf(what, what_capacity, __VA_ARGS__)
#define FIX(...) (void)snprintf(fix, fix_capacity, __VA_ARGS__)
  switch (s->kind) {
    case SUSPECT_TIME:
      WHAT("the stamps of %s are %.2f s too %s", name, fabs(s->value), s->value < 0 ? "late" : "early");
      FIX("its clock is off: add %.2f s (%.0f ns) to its t_ns and arrival_ns", s->value, s->value * 1e9);
      break;
    case SUSPECT_BEARING_SIGN:
      WHAT("the bearings of %s are positive to the right", name);
      FIX("write bearing_rad = -bearing_rad: bearings are positive to the left of the sensor's x axis");
      break;
    case SUSPECT_RANGE_FACTOR:
      WHAT("the ranges of %s are in %s", name, length);
      FIX("multiply range_m by %g", s->value);
      break;
    case SUSPECT_IDENTITY:
      WHAT("the ids of %s are off by %g", name, -s->value);
      FIX("add %+.0f to each id of its rows, or subtract it from those of landmarks.csv", s->value);
      break;
    case SUSPECT_POSITION_SWAP:
      WHAT("x and y of %s are swapped", name);
      FIX("swap the columns x_m and y_m: x is east, y is north");
      break;
    case SUSPECT_MAP_SWAP:
      WHAT("x and y of the map are swapped");
      FIX("swap the columns x_m and y_m of landmarks.csv");
      break;
    case SUSPECT_MAP_MIRROR_X:
    case SUSPECT_MAP_MIRROR_Y:
      WHAT("the map is mirrored in %c", s->kind == SUSPECT_MAP_MIRROR_X ? 'x' : 'y');
      FIX("change the sign of %c_m in landmarks.csv: x, y and z make a right-handed frame",
          s->kind == SUSPECT_MAP_MIRROR_X ? 'x' : 'y');
      break;
    case SUSPECT_MAP_FACTOR:
      WHAT("the map is in %s", length);
      FIX("multiply x_m, y_m and z_m of landmarks.csv by %g", s->value);
      break;
    case SUSPECT_MOUNTING_YAW:
      if (!m) break;
      WHAT("the mounting of %s is turned by %.0f degrees", sensor->name, s->value / DEG);
      FIX("calibration.yaml, sensors.%s.mounting: rpy_deg: [%.6g, %.6g, %.6g]", sensor->name, m->rpy_rad[0] / DEG,
          m->rpy_rad[1] / DEG, remainder(m->rpy_rad[2] + s->value, 2 * M_PI) / DEG + 0.0);
      break;
    case SUSPECT_MOUNTING_FACTOR:
      if (!m) break;
      WHAT("the mounting of %s is in %s", sensor->name, length);
      FIX("calibration.yaml, sensors.%s.mounting: xyz_m: [%.6g, %.6g, %.6g]", sensor->name, m->xyz_m[0] * s->value,
          m->xyz_m[1] * s->value, m->xyz_m[2] * s->value);
      break;
    case SUSPECT_TICKS_SWAP:
      WHAT("the wheels' ticks are swapped");
      FIX("can-signals.yaml: swap the signals of wheel_ticks_left and wheel_ticks_right");
      break;
    case SUSPECT_TICKS_LEFT_SIGN:
    case SUSPECT_TICKS_RIGHT_SIGN:
      WHAT("wheel_ticks_%s counts backwards", s->kind == SUSPECT_TICKS_LEFT_SIGN ? "left" : "right");
      FIX("can-signals.yaml, wheel_ticks_%s: scale: -1", s->kind == SUSPECT_TICKS_LEFT_SIGN ? "left" : "right");
      break;
    case SUSPECT_TICKS_SIGN:
      WHAT("both wheels' ticks count backwards");
      FIX("can-signals.yaml, wheel_ticks_left and wheel_ticks_right: scale: -1");
      break;
    case SUSPECT_RADIUS_FACTOR:
      WHAT("the wheels' ticks are %g times the way", 1 / s->value);
      FIX("calibration.yaml, wheels: radius_m: %.4g (a diameter or another unit?) or ticks_per_turn: %.6g",
          setup->wheels.radius_m * s->value, setup->wheels.ticks_per_turn / s->value);
      break;
    case SUSPECT_YAW_RATE_FACTOR:
      WHAT("the turn rate of %s is %s", name,
           s->value < 0   ? "positive to the right"
           : s->value < 1 ? "in deg/s"
                          : "in rad/s");
      FIX(s->value < 0
              ? "`scale: -1` for yaw_rate in can-signals.yaml, or w_radps = -w_radps: it is positive to the left"
          : s->value < 1 ? "`unit: deg/s` for yaw_rate in can-signals.yaml, or multiply w_radps by 0.0174533"
                         : "`unit: rad/s` for yaw_rate in can-signals.yaml, or multiply w_radps by 57.2958");
      break;
    case SUSPECT_SPEED_FACTOR:
      WHAT("the speed of %s is %g times the way's", name, 1 / s->value);
      FIX("multiply v_mps by %.6g: another unit, or backwards?", s->value);
      break;
    default: break;
  }
#undef WHAT
#undef FIX
}
