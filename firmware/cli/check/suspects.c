// SPDX-License-Identifier: Apache-2.0
#include "cli/check/suspects.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "waymark/detectors.h"

#define DEG (M_PI / 180)

// ── what there is ───────────────────────────────────────────────────────────────────────────────────────────────────

static void take_identity(source_seen *self, int32_t id, uint16_t sensor) {
  if (sensor < 64) self->sensors |= UINT64_C(1) << sensor;
  if (id < 0) return;
  if (self->most_id < self->least_id) self->least_id = self->most_id = id;
  if (id < self->least_id) self->least_id = id;
  if (id > self->most_id) self->most_id = id;
  if (id < 256) self->ids[id / 64] |= UINT64_C(1) << (id % 64);
}

void source_seen_take(source_seen *self, const wm_event *event) {
  if (self->kinds == 0) {
    self->most_id = -1;
    self->least_id = 0;
    self->first_ns = event->t_ns;
    self->last_ns = event->t_ns;
  }
  // No sensor is 30 s late; rows in disorder are.
  self->is_disordered |= event->arrival_ns / 2 - event->t_ns / 2 > 15 * WM_NS_PER_S;
  self->last_ns = event->t_ns > self->last_ns ? event->t_ns : self->last_ns;
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

static suspect *add(list *out, suspect_kind kind, size_t source, size_t sensor, double value) {
  static suspect spare;
  suspect *one = out->count < SUSPECTS_MAX ? &out->at[out->count++] : &spare;
  *one = (suspect){.kind = kind, .source = (uint16_t)source, .sensor = (uint16_t)sensor, .value = value};
  return one;
}

static void add_values(list *out, suspect_kind kind, size_t source, size_t sensor, const double *values, size_t count) {
  for (size_t i = 0; i < count; i++) (void)add(out, kind, source, sensor, values[i]);
}

#define VALUES(...) (const double[]){__VA_ARGS__}, sizeof((const double[]){__VA_ARGS__}) / sizeof(double)

// mm, cm, inch, foot, dm, and metres that were taken for mm.
#define LENGTHS VALUES(0.001, 0.01, 0.0254, 0.3048, 0.1, 1000)

static int is_seen(const source_seen *seen, int64_t id) {
  return id >= 0 && id < 256 && ((seen->ids[id / 64] >> (id % 64)) & 1u);
}

// How many landmarks were seen if `shift` is added to the identities that were given.
static int matches(const wm_setup *setup, const source_seen *seen, int64_t shift) {
  int count = 0;
  for (size_t i = 0; i < setup->landmark_count; i++) count += is_seen(seen, setup->landmarks[i].id - shift);
  return count;
}

// Shifts that give the most known landmarks, and those from the lowest and the highest identity of both.
static void add_shifts(list *out, const wm_setup *setup, const source_seen *seen, size_t source, size_t sensor) {
  int64_t least = INT32_MAX, most = 0, done[8] = {0};
  size_t count = 0;
  for (size_t i = 0; i < setup->landmark_count; i++) {
    least = setup->landmarks[i].id < least ? setup->landmarks[i].id : least;
    most = setup->landmarks[i].id > most ? setup->landmarks[i].id : most;
  }
  const int64_t ends[] = {-1, 1, least - seen->least_id, most - seen->most_id};
  for (size_t i = 0; i < sizeof ends / sizeof ends[0]; i++) {
    int is_new = ends[i] != 0;
    for (size_t k = 0; k < count; k++) is_new &= done[k] != ends[i];
    if (!is_new) continue;
    done[count++] = ends[i];
    (void)add(out, SUSPECT_IDENTITY, source, sensor, (double)ends[i]);
  }
  for (int rounds = 0; rounds < 4 && seen->most_id < 256; rounds++) {
    int64_t best = 0;
    int best_count = 0;
    for (int64_t shift = least - seen->most_id; shift <= most - seen->least_id; shift++) {
      int is_new = shift != 0;
      for (size_t k = 0; k < count; k++) is_new &= done[k] != shift;
      const int n = is_new ? matches(setup, seen, shift) : 0;
      if (n > best_count) {
        best_count = n;
        best = shift;
      }
    }
    if (best_count == 0) break;
    done[count++] = best;
    (void)add(out, SUSPECT_IDENTITY, source, sensor, (double)best);
  }
}

static void add_mounting(list *out, const wm_sensor *sensor, size_t source, size_t s, int is_picture) {
  const double *p = sensor->mounting.xyz_m, *rpy = sensor->mounting.rpy_rad;
  add_values(out, SUSPECT_MOUNTING_YAW, source, s, VALUES(M_PI, M_PI / 2, -M_PI / 2, M_PI / 4, -M_PI / 4));
  if (fabs(rpy[2]) > 0.02) (void)add(out, SUSPECT_MOUNTING_YAW, source, s, -2 * rpy[2]);
  if (fabs(rpy[1]) > 0.02) (void)add(out, SUSPECT_MOUNTING_PITCH, source, s, -2 * rpy[1]);
  if (is_picture || fabs(rpy[0]) > 0.02) (void)add(out, SUSPECT_MOUNTING_ROLL, source, s, M_PI);
  const double largest_deg = fmax(fabs(rpy[0]), fmax(fabs(rpy[1]), fabs(rpy[2]))) / DEG;
  if (largest_deg > 0.02 && largest_deg < 2 * M_PI) (void)add(out, SUSPECT_MOUNTING_RAD, source, s, 1 / DEG);
  if (hypot(p[0], p[1]) > 0.5) add_values(out, SUSPECT_MOUNTING_FACTOR, source, s, VALUES(0.01, 0.001));
  add_values(out, SUSPECT_MOUNTING_X, source, s, VALUES(-0.3, 0.3));
  add_values(out, SUSPECT_MOUNTING_Y, source, s, VALUES(-0.3, 0.3));
  if (fabs(p[0]) > 0.05) (void)add(out, SUSPECT_MOUNTING_X, source, s, -2 * p[0]);
  if (fabs(p[1]) > 0.05) (void)add(out, SUSPECT_MOUNTING_Y, source, s, -2 * p[1]);
}

// s from the source's first stamp to the motion's, where their spans have nothing in common.
static double gap_s(const source_seen *self, const source_seen *motion) {
  if (!motion || (self->first_ns <= motion->last_ns && self->last_ns >= motion->first_ns)) return 0;
  return (double)motion->first_ns * 1e-9 - (double)self->first_ns * 1e-9;
}

static void add_clocks(list *out, const source_seen *seen, const source_seen *motion, size_t source) {
  if (seen->is_disordered) (void)add(out, SUSPECT_DISORDER, source, 0, 0);
  const double apart_s = gap_s(seen, motion);
  if (apart_s != 0) {
    add_values(out, SUSPECT_TIME_FACTOR, source, 0, VALUES(1e3, 1e6, 1e9));
    (void)add(out, SUSPECT_TIME, source, 0, apart_s);
    (void)add(out, SUSPECT_TIME, source, 0, rint(apart_s));
    return;
  }
  // The last ones: leap seconds of GPS, of TAI.
  add_values(out, SUSPECT_TIME, source, 0,
             VALUES(-0.1, 0.1, -0.2, 0.2, -0.35, 0.35, -0.5, 0.5, -0.75, 0.75, -1, 1, -1.5, 1.5, -2, 2, -3, 3, -5, 5,
                    -10, 10, -18, 18, -37, 37));
}

static void add_observations(list *out, const wm_assembly *assembly, const source_seen *seen, const source_seen *motion,
                             size_t source) {
  const wm_setup *setup = &assembly->setup;
  const int is_sighting = (seen->kinds & WM_EVENT_BIT(WM_EVENT_SIGHTING)) != 0;
  const int is_picture = assembly->sources[source].source && !strchr("gsmpi", assembly->sources[source].name[0]);
  add_clocks(out, seen, motion, source);
  if (seen->kinds & WM_EVENT_BIT(WM_EVENT_POSITION)) {
    (void)add(out, SUSPECT_POSITION_SWAP, source, 0, 0);
    add_values(out, SUSPECT_POSITION_X, source, 0, VALUES(-1));
    add_values(out, SUSPECT_POSITION_Y, source, 0, VALUES(-1));
  }
  for (size_t s = 0; s < setup->sensor_count && s < 64; s++) {
    const wm_sensor *sensor = &setup->sensors[s];
    if (!((seen->sensors >> s) & 1u)) continue;
    if (is_sighting) add_values(out, SUSPECT_BEARING_FACTOR, source, s, VALUES(-1, DEG, -DEG, 1 / DEG));
    if (seen->has_range) add_values(out, SUSPECT_RANGE_FACTOR, source, s, LENGTHS);
    if (seen->has_range) (void)add(out, SUSPECT_RANGE_IS, source, s, !sensor->range_is_depth);
    if (seen->most_id >= seen->least_id && setup->landmark_count > 0) {
      add_shifts(out, setup, seen, source, s);
      if (is_sighting) (void)add(out, SUSPECT_NO_IDENTITY, source, s, 0);
    }
    add_mounting(out, sensor, source, s, is_picture);
    if (is_picture) add_values(out, SUSPECT_FOCAL_FACTOR, source, s, VALUES(0.5, 2));
  }
}

static int binding_of(const suspect_files *files, wm_quantity quantity) {
  for (size_t i = 0; i < files->binding_count; i++)
    if (files->bindings[i].quantity == (int)quantity) return (int)i;
  return -1;
}

static void add_quantity(list *out, const suspect_files *files, size_t source, wm_quantity quantity, wm_quantity other,
                         const double *values, size_t count) {
  const int item = binding_of(files, quantity), second = binding_of(files, other);
  for (size_t i = 0; item >= 0 && i < count; i++) {
    const int is_pair = other != quantity && second >= 0;
    suspect *one = add(out, is_pair ? SUSPECT_QUANTITY_FACTORS : SUSPECT_QUANTITY_FACTOR, source, 0, values[i]);
    one->item = (int16_t)item;
    one->other = (int16_t)second;
  }
}

static void add_layout(list *out, size_t source, int item, signal_layout layout, double factor, int shift) {
  suspect *one = add(out, SUSPECT_SIGNAL, source, 0, factor);
  one->item = (int16_t)item;
  one->layout = (uint16_t)layout;
  one->shift = (int16_t)shift;
}

static int is_first_of_message(const suspect_files *files, int item) {
  for (int i = 0; i < item; i++)
    if (strcmp(files->bindings[i].message, files->bindings[item].message) == 0) return 0;
  return 1;
}

// The byte order is that of a message's signals, and of all messages of a maker.
static void add_signals(list *out, const suspect_files *files, size_t source) {
  // All messages last: of two changes with the same effect the first is named.
  for (int i = 0; i <= (int)files->binding_count; i++) {
    const int item = i < (int)files->binding_count ? i : -1;
    if (item < 0 || is_first_of_message(files, item)) {
      add_layout(out, source, item, LAYOUT_ORDER, 1, 0);
      add_layout(out, source, item, LAYOUT_ORDER_START, 1, 0);
      add_layout(out, source, item, LAYOUT_SIGN, 1, 0);
    }
    if (item < 0 || files->bindings[item].quantity < 0 || files->bindings[item].quantity == WM_Q_GEAR) continue;
    add_layout(out, source, item, LAYOUT_SAME, 0.1, 0);
    add_layout(out, source, item, LAYOUT_SAME, 10, 0);
    add_layout(out, source, item, LAYOUT_SAME, 1, 8);
    add_layout(out, source, item, LAYOUT_SAME, 1, -8);
  }
}

static void add_can(list *out, const wm_assembly *assembly, const suspect_files *files, const source_seen *seen,
                    size_t source) {
  const wm_wheels *w = &assembly->setup.wheels;
  const wm_quantity left = WM_Q_WHEEL_TICKS_LEFT, right = WM_Q_WHEEL_TICKS_RIGHT;
  if (binding_of(files, left) >= 0 && binding_of(files, right) >= 0) {
    (void)add(out, SUSPECT_TICKS_SWAP, source, 0, 0);
    add_quantity(out, files, source, left, left, VALUES(-1));
    add_quantity(out, files, source, right, right, VALUES(-1));
    add_quantity(out, files, source, left, right, VALUES(-1));
    add_values(out, SUSPECT_RADIUS_FACTOR, source, 0, VALUES(0.5, 2, 0.1, 10, 0.001, 0.01, 0.0254));
    add_values(out, SUSPECT_TICKS_FACTOR, source, 0, VALUES(4, 0.25, 2, 0.5, 10, 0.1));
    if (isfinite(w->track_m)) add_values(out, SUSPECT_TRACK_FACTOR, source, 0, VALUES(0.5, 2, 0.1, 10, 0.01, 0.001));
  }
  add_quantity(out, files, source, WM_Q_YAW_RATE, WM_Q_YAW_RATE, VALUES(-1, DEG, 1 / DEG, -DEG, 0.1, 10));
  add_quantity(out, files, source, WM_Q_VEHICLE_SPEED, WM_Q_VEHICLE_SPEED, VALUES(-1, 1 / 3.6, 3.6, 0.44704, 0.1, 10));
  for (unsigned q = WM_Q_WHEEL_SPEED_FRONT_LEFT; q <= WM_Q_WHEEL_SPEED_REAR_RIGHT; q += 2)
    add_quantity(out, files, source, (wm_quantity)q, (wm_quantity)(q + 1), VALUES(-1, 1 / 3.6, 3.6, 0.44704));
  for (unsigned q = WM_Q_STEERING_WHEEL; q <= WM_Q_ROAD_WHEEL; q++)
    add_quantity(out, files, source, (wm_quantity)q, (wm_quantity)q, VALUES(-1, DEG, 1 / DEG));
  if (seen->quantities & ((1u << WM_Q_STEERING_WHEEL) | (1u << WM_Q_ROAD_WHEEL))) {
    add_values(out, SUSPECT_WHEELBASE_FACTOR, source, 0, VALUES(0.001, 0.01, 0.5, 2));
    if (isfinite(w->steering_ratio)) add_values(out, SUSPECT_STEERING_FACTOR, source, 0, VALUES(0.5, 2, 0.1, 10));
  }
  add_signals(out, files, source);
}

static void add_motion(list *out, const wm_assembly *assembly, const suspect_files *files, const source_seen *seen,
                       size_t source) {
  if (seen->is_disordered) (void)add(out, SUSPECT_DISORDER, source, 0, 0);
  if (seen->kinds & WM_EVENT_BIT(WM_EVENT_QUANTITIES)) add_can(out, assembly, files, seen, source);
  if (!(seen->kinds & WM_TWIST_EVENTS)) return;
  add_values(out, SUSPECT_YAW_RATE_FACTOR, source, 0, VALUES(-1, DEG, 1 / DEG, -DEG));
  add_values(out, SUSPECT_SPEED_FACTOR, source, 0, VALUES(-1, 0.001, 0.01, 1 / 3.6, 3.6, 0.44704, 2, 0.5));
  if (seen->kinds & WM_EVENT_BIT(WM_EVENT_TWIST2)) (void)add(out, SUSPECT_TWIST_SWAP, source, 0, 0);
  if (seen->kinds & WM_EVENT_BIT(WM_EVENT_TWIST6)) (void)add(out, SUSPECT_SIDEWAYS_FACTOR, source, 0, -1);
}

// A detector of square markers that saw none.
static int is_blind_to_tags(const wm_assembly *assembly, const source_seen *seen) {
  int is_blind = 0;
  for (size_t i = 0; i < assembly->source_count; i++) {
    if (strncmp(assembly->sources[i].name, "apriltag:", 9) != 0) continue;
    if (seen[i].kinds & WM_EVENT_BIT(WM_EVENT_MARKER)) return 0;
    is_blind = 1;
  }
  return is_blind;
}

static void add_files(list *out, const suspect_files *files) {
  int latitude = -1, longitude = -1;
  for (size_t i = 0; i < files->setting_count; i++) {
    suspect *one = add(out, SUSPECT_SETTING, 0, 0, files->settings[i].usual);
    one->item = (int16_t)i;
  }
  for (size_t i = 0; i < files->binding_count; i++) {
    if (strcmp(files->bindings[i].quantity_name, "gnss_latitude") == 0) latitude = (int)i;
    if (strcmp(files->bindings[i].quantity_name, "gnss_longitude") == 0) longitude = (int)i;
  }
  if (latitude < 0 || longitude < 0) return;
  if (isfinite(files->origin[0])) (void)add(out, SUSPECT_ORIGIN_SWAP, 0, 0, 0);
  suspect *both = add(out, SUSPECT_LATITUDE_SWAP, 0, 0, 0);
  both->item = (int16_t)latitude;
  both->other = (int16_t)longitude;
}

static void add_setup(list *out, const wm_setup *setup, uint32_t kinds) {
  if (setup->landmark_count > 0) {
    (void)add(out, SUSPECT_MAP_SWAP, 0, 0, 0);
    (void)add(out, SUSPECT_MAP_MIRROR_X, 0, 0, 0);
    (void)add(out, SUSPECT_MAP_MIRROR_Y, 0, 0, 0);
    (void)add(out, SUSPECT_MAP_TURN, 0, 0, M_PI);
    add_values(out, SUSPECT_MAP_FACTOR, 0, 0, LENGTHS);
  }
  // The white frame taken for the edge or the reverse (8 of 10 cells), half and twice, units.
  if (kinds & WM_EVENT_BIT(WM_EVENT_MARKER))
    add_values(out, SUSPECT_TAG_FACTOR, 0, 0, VALUES(0.8, 1.25, 0.5, 2, 0.1, 10, 0.001, 0.01, 0.0254));
  if (kinds & WM_EVENT_BIT(WM_EVENT_POINTS) && setup->map)
    add_values(out, SUSPECT_PLAN_FACTOR, 0, 0, VALUES(0.5, 2, 0.1, 10, 0.0254));
  if (!(kinds & WM_EVENT_BIT(WM_EVENT_STEREO))) return;
  add_values(out, SUSPECT_BASELINE_FACTOR, 0, 0, VALUES(0.5, 2, 0.1, 0.001));
}

size_t suspects_list(const wm_assembly *assembly, const suspect_files *files, const source_seen *seen,
                     suspect out[SUSPECTS_MAX]) {
  list all = {out, 0};
  const source_seen *motion = NULL;
  uint32_t kinds = 0;
  (void)add(&all, SUSPECT_NONE, 0, 0, 0);
  for (int i = 1; is_blind_to_tags(assembly, seen) && wm_marker_family_names[i]; i++)
    (void)add(&all, SUSPECT_TAG_FAMILY, 0, 0, i);
  for (size_t i = 0; i < assembly->source_count; i++) {
    kinds |= seen[i].kinds;
    if ((seen[i].kinds & WM_MOTION_EVENTS) && !motion) motion = &seen[i];
  }
  if ((kinds & WM_EVENT_BIT(WM_EVENT_POINTS)) && files->plan_picture_count > 0)
    add_values(&all, SUSPECT_PLAN_MIRROR, 0, 0, VALUES(1, -1));
  // First what the setup has few of: where the time ends, the last of the list are not tried.
  add_setup(&all, &assembly->setup, kinds);
  for (size_t i = 0; i < assembly->source_count; i++) {
    if (seen[i].kinds & WM_EVENT_BIT(WM_EVENT_STEREO)) (void)add(&all, SUSPECT_STEREO_SWAP, i, 0, 0);
    if (seen[i].kinds & WM_MOTION_EVENTS)
      add_motion(&all, assembly, files, &seen[i], i);
    else if (seen[i].kinds)
      add_observations(&all, assembly, &seen[i], motion, i);
  }
  add_files(&all, files);
  return all.count;
}

const char *suspect_source(const suspect *self, const wm_assembly *assembly) {
  return self->source < assembly->source_count ? assembly->sources[self->source].name : "?";
}

const wm_sensor *suspect_sensor(const suspect *self, const wm_assembly *assembly) {
  return self->sensor < assembly->setup.sensor_count ? &assembly->setup.sensors[self->sensor] : NULL;
}
