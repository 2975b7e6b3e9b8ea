// SPDX-License-Identifier: Apache-2.0
// Each suspect as changes of files, and in words.
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "cli/check/suspects.h"

#define DEG (M_PI / 180)

typedef struct filling {
  const wm_assembly *assembly;
  const suspect_files *files;
  file_edit *at;
  size_t count;
} filling;

static file_edit *add(filling *out, file_edit_kind kind, const char *file) {
  static file_edit spare;
  file_edit *edit = out->count < SUSPECT_EDITS_MAX ? &out->at[out->count++] : &spare;
  *edit = (file_edit){.kind = kind, .factor = 1};
  (void)snprintf(edit->file, sizeof edit->file, "%s", file);
  return edit;
}

static file_edit *add_column(filling *out, const char *file, const char *column, double factor, double offset) {
  file_edit *edit = add(out, EDIT_COLUMN, file);
  (void)snprintf(edit->name, sizeof edit->name, "%s", column);
  edit->factor = factor;
  edit->offset = offset;
  return edit;
}

static void add_swap(filling *out, const char *file, const char *a, const char *b) {
  file_edit *edit = add(out, EDIT_SWAP, file);
  (void)snprintf(edit->name, sizeof edit->name, "%s", a);
  (void)snprintf(edit->text, sizeof edit->text, "%s", b);
}

__attribute__((format(printf, 4, 5))) static void add_value(filling *out, const char *file, const char *path,
                                                            const char *format, ...) {
  file_edit *edit = add(out, EDIT_VALUE, file);
  va_list arguments;
  (void)snprintf(edit->name, sizeof edit->name, "%s", path);
  va_start(arguments, format);
  (void)vsnprintf(edit->text, sizeof edit->text, format, arguments);
  va_end(arguments);
}

// ── sources and sensors ─────────────────────────────────────────────────────────────────────────────────────────────

static const char *source_name(const suspect *s, const wm_assembly *assembly) {
  return s->source < assembly->source_count ? assembly->sources[s->source].name : "?";
}

// The file with the source's stamps: "sightings.csv", "video/front.csv".
static void file_of(const suspect *s, const wm_assembly *assembly, char *out, size_t capacity) {
  static const char *const kTables[] = {"sightings", "markers", "corners",    "stereo", "points", "gnss",
                                        "motion",    "motion6", "increments", "imu",    NULL};
  const char *name = source_name(s, assembly), *colon = strchr(name, ':');
  const size_t n = colon ? (size_t)(colon - name) : strlen(name);
  for (size_t i = 0; kTables[i]; i++)
    if (strlen(kTables[i]) == n && strncmp(kTables[i], name, n) == 0) {
      (void)snprintf(out, capacity, "%s.csv", strcmp(kTables[i], "corners") == 0 ? "marker-corners" : kTables[i]);
      return;
    }
  (void)snprintf(out, capacity, "video/%s.csv", colon ? colon + 1 : name);
}

static const wm_sensor *sensor_of(const suspect *s, const wm_assembly *assembly) {
  return s->sensor < assembly->setup.sensor_count ? &assembly->setup.sensors[s->sensor] : NULL;
}

static void add_sensor_column(filling *out, const suspect *s, const char *column, double factor, double offset) {
  char file[64];
  file_of(s, out->assembly, file, sizeof file);
  file_edit *edit = add_column(out, file, column, factor, offset);
  const wm_sensor *sensor = sensor_of(s, out->assembly);
  if (sensor) (void)snprintf(edit->only, sizeof edit->only, "%s", sensor->name);
}

static void add_stamps(filling *out, const suspect *s, double factor, double offset_s) {
  char file[64];
  file_of(s, out->assembly, file, sizeof file);
  const char *name = source_name(s, out->assembly), *colon = strchr(name, ':');
  const int has_sensors = colon && strncmp(file, "video/", 6) != 0;
  for (int i = 0; i < 2; i++) {
    file_edit *edit = add_column(out, file, i == 0 ? "t_ns" : "arrival_ns", factor, rint(offset_s * 1e9));
    edit->is_optional = i == 1;
    if (has_sensors) (void)snprintf(edit->only, sizeof edit->only, "%s", colon + 1);
  }
}

static int is_camera(const wm_assembly *assembly, const char *name) {
  return assembly->setup.rig && wm_rig_find_camera(assembly->setup.rig, name) >= 0;
}

static void add_mounting(filling *out, const suspect *s) {
  const wm_sensor *sensor = sensor_of(s, out->assembly);
  char path[96];
  if (!sensor) return;
  double xyz[3], rpy[3];
  for (int k = 0; k < 3; k++) {
    xyz[k] = sensor->mounting.xyz_m[k] * (s->kind == SUSPECT_MOUNTING_FACTOR ? s->value : 1);
    rpy[k] = sensor->mounting.rpy_rad[k] * (s->kind == SUSPECT_MOUNTING_RAD ? s->value : 1);
  }
  xyz[0] += s->kind == SUSPECT_MOUNTING_X ? s->value : 0;
  xyz[1] += s->kind == SUSPECT_MOUNTING_Y ? s->value : 0;
  rpy[0] += s->kind == SUSPECT_MOUNTING_ROLL ? s->value : 0;
  rpy[1] += s->kind == SUSPECT_MOUNTING_PITCH ? s->value : 0;
  rpy[2] += s->kind == SUSPECT_MOUNTING_YAW ? s->value : 0;
  const int is_place = s->kind >= SUSPECT_MOUNTING_FACTOR;
  (void)snprintf(path, sizeof path, "%s.%s.mounting.%s", is_camera(out->assembly, sensor->name) ? "cameras" : "sensors",
                 sensor->name, is_place ? "xyz_m" : "rpy_deg");
  if (is_place)
    add_value(out, "calibration.yaml", path, "[%.6g, %.6g, %.6g]", xyz[0], xyz[1], xyz[2]);
  else
    add_value(out, "calibration.yaml", path, "[%.6g, %.6g, %.6g]", remainder(rpy[0], 2 * M_PI) / DEG + 0.0,
              remainder(rpy[1], 2 * M_PI) / DEG + 0.0, remainder(rpy[2], 2 * M_PI) / DEG + 0.0);
}

static void add_focal(filling *out, const suspect *s) {
  const wm_sensor *sensor = sensor_of(s, out->assembly);
  const wm_rig *rig = out->assembly->setup.rig;
  const int c = sensor && rig ? wm_rig_find_camera(rig, sensor->name) : -1;
  if (c < 0) return;
  const wm_camera *camera = &rig->cameras[c];
  // Pixels alone: xi and alpha of the other models have none.
  const uint32_t first = camera->model == WM_CAMERA_OMNI ? 1 : camera->model == WM_CAMERA_DOUBLE_SPHERE ? 2 : 0;
  char path[96], text[96] = "[";
  size_t used = 1;
  if (camera->model == WM_CAMERA_OCAM) return;
  for (uint32_t i = 0; i < camera->intrinsics_count && used < sizeof text; i++)
    used += (size_t)snprintf(text + used, sizeof text - used, "%s%.8g", i ? ", " : "",
                             camera->intrinsics[i] * (i >= first ? s->value : 1));
  (void)snprintf(path, sizeof path, "cameras.%s.intrinsics", sensor->name);
  add_value(out, "calibration.yaml", path, "%s]", text);
}

// ── motion ──────────────────────────────────────────────────────────────────────────────────────────────────────────

static void add_scale(filling *out, int item, double factor) {
  char path[96];
  if (item < 0 || (size_t)item >= out->files->binding_count) return;
  (void)snprintf(path, sizeof path, "[%d].scale", item);
  add_value(out, "can-signals.yaml", path, "%.9g", out->files->bindings[item].scale * factor);
}

static void swap_ticks(filling *out) {
  for (size_t i = 0; i < out->files->binding_count; i++) {
    char path[96];
    const binding_seen *b = &out->files->bindings[i];
    if (b->quantity > (int)WM_Q_WHEEL_TICKS_RIGHT || b->quantity < 0) continue;
    (void)snprintf(path, sizeof path, "[%zu].quantity", i);
    add_value(out, "can-signals.yaml", path, "%s", wm_quantity_name(WM_Q_WHEEL_TICKS_RIGHT - (unsigned)b->quantity));
  }
}

static void add_signal(filling *out, const suspect *s, size_t item) {
  const binding_seen *b = &out->files->bindings[item];
  for (size_t k = 0; k < out->count; k++)
    if (strcmp(out->at[k].name, b->signal) == 0 && strcmp(out->at[k].only, b->message) == 0) return;
  if (!b->signal[0] || out->count == SUSPECT_EDITS_MAX) return;
  file_edit *edit = add(out, EDIT_SIGNAL, "vehicle.dbc");
  (void)snprintf(edit->name, sizeof edit->name, "%s", b->signal);
  (void)snprintf(edit->only, sizeof edit->only, "%s", b->message);
  edit->layout = (signal_layout)s->layout;
  edit->factor = s->value;
  edit->offset = s->shift;
}

static void add_twist(filling *out, const suspect *s) {
  const char *source = source_name(s, out->assembly);
  const int is_six = strcmp(source, "motion6") == 0;
  if (strcmp(source, "imu") == 0) return;
  if (s->kind == SUSPECT_TWIST_SWAP) add_swap(out, "motion.csv", "v_mps", "w_radps");
  if (s->kind == SUSPECT_SIDEWAYS_FACTOR) (void)add_column(out, "motion6.csv", "vy_mps", s->value, 0);
  if (s->kind == SUSPECT_YAW_RATE_FACTOR && !is_six) (void)add_column(out, "motion.csv", "w_radps", s->value, 0);
  if (s->kind == SUSPECT_SPEED_FACTOR && !is_six) (void)add_column(out, "motion.csv", "v_mps", s->value, 0);
  if (!is_six) return;
  // Another unit is that of all axes, another sign that of one.
  static const char *const kRates[] = {"wz_radps", "wx_radps", "wy_radps"};
  static const char *const kSpeeds[] = {"vx_mps", "vy_mps", "vz_mps"};
  for (int k = 0; k < (s->value < 0 ? 1 : 3); k++) {
    if (s->kind == SUSPECT_YAW_RATE_FACTOR) (void)add_column(out, "motion6.csv", kRates[k], s->value, 0);
    if (s->kind == SUSPECT_SPEED_FACTOR) (void)add_column(out, "motion6.csv", kSpeeds[k], s->value, 0);
  }
}

static void add_motion(filling *out, const suspect *s) {
  const wm_wheels *w = &out->assembly->setup.wheels;
  static const char kFile[] = "calibration.yaml";
  switch (s->kind) {
    case SUSPECT_TICKS_SWAP: swap_ticks(out); break;
    case SUSPECT_QUANTITY_FACTOR: add_scale(out, s->item, s->value); break;
    case SUSPECT_QUANTITY_FACTORS:
      add_scale(out, s->item, s->value);
      add_scale(out, s->other, s->value);
      break;
    case SUSPECT_SIGNAL:
      for (size_t i = 0; i < out->files->binding_count; i++)
        if (s->item < 0 || s->item == (int)i ||
            (s->layout != LAYOUT_SAME &&
             strcmp(out->files->bindings[i].message, out->files->bindings[s->item].message) == 0))
          add_signal(out, s, i);
      break;
    case SUSPECT_RADIUS_FACTOR: add_value(out, kFile, "wheels.radius_m", "%.6g", w->radius_m * s->value); break;
    case SUSPECT_TICKS_FACTOR:
      add_value(out, kFile, "wheels.ticks_per_turn", "%.9g", w->ticks_per_turn * s->value);
      break;
    case SUSPECT_TRACK_FACTOR: add_value(out, kFile, "wheels.track_m", "%.6g", w->track_m * s->value); break;
    case SUSPECT_WHEELBASE_FACTOR:
      add_value(out, kFile, "wheels.wheelbase_m", "%.6g", w->wheelbase_m * s->value);
      break;
    case SUSPECT_STEERING_FACTOR:
      add_value(out, kFile, "wheels.steering_ratio", "%.6g", w->steering_ratio * s->value);
      break;
    default: add_twist(out, s); break;
  }
}

// ── map ─────────────────────────────────────────────────────────────────────────────────────────────────────────────

static int has_yaw(const wm_setup *setup) { return setup->landmark_count > 0 && !isnan(setup->landmarks[0].yaw_rad); }

static void add_map(filling *out, const suspect *s) {
  static const char kFile[] = "landmarks.csv";
  const int has_directions = has_yaw(&out->assembly->setup);
  const int x = s->kind == SUSPECT_MAP_MIRROR_X || s->kind == SUSPECT_MAP_TURN;
  const int y = s->kind == SUSPECT_MAP_MIRROR_Y || s->kind == SUSPECT_MAP_TURN;
  if (s->kind == SUSPECT_MAP_SWAP) add_swap(out, kFile, "x_m", "y_m");
  if (x || s->kind == SUSPECT_MAP_FACTOR) (void)add_column(out, kFile, "x_m", x ? -1 : s->value, 0);
  if (y || s->kind == SUSPECT_MAP_FACTOR) (void)add_column(out, kFile, "y_m", y ? -1 : s->value, 0);
  if (!has_directions || s->kind == SUSPECT_MAP_FACTOR) return;
  // Directions of markers: yaw, pi - yaw, -yaw, pi/2 - yaw.
  const double offset = s->kind == SUSPECT_MAP_SWAP ? M_PI / 2 : x ? M_PI : 0;
  (void)add_column(out, kFile, "yaw_rad", s->kind == SUSPECT_MAP_TURN ? 1 : -1, offset);
}

static void add_observation(filling *out, const suspect *s) {
  char path[96], file[64];
  const wm_sensor *sensor = sensor_of(s, out->assembly);
  file_of(s, out->assembly, file, sizeof file);
  switch (s->kind) {
    case SUSPECT_TIME: add_stamps(out, s, 1, s->value); break;
    case SUSPECT_TIME_FACTOR: add_stamps(out, s, s->value, 0); break;
    case SUSPECT_DISORDER: (void)snprintf(add(out, EDIT_SORT, file)->name, sizeof out->at->name, "t_ns"); break;
    case SUSPECT_BEARING_FACTOR: add_sensor_column(out, s, "bearing_rad", s->value, 0); break;
    case SUSPECT_RANGE_FACTOR: add_sensor_column(out, s, "range_m", s->value, 0); break;
    case SUSPECT_IDENTITY: add_sensor_column(out, s, "id", 1, s->value); break;
    case SUSPECT_NO_IDENTITY: add_sensor_column(out, s, "id", 0, -1); break;
    case SUSPECT_IDENTITY_TABLE:
      add_sensor_column(out, s, "id", 1, 0);
      out->at[out->count - 1].kind = EDIT_IDS;
      out->at[out->count - 1].ids = s->ids;
      break;
    case SUSPECT_RANGE_IS:
      if (!sensor) break;
      (void)snprintf(path, sizeof path, "sensors.%s.range_is", sensor->name);
      add_value(out, "calibration.yaml", path, "%s", s->value > 0 ? "depth" : "distance");
      break;
    case SUSPECT_POSITION_SWAP: add_swap(out, file, "x_m", "y_m"); break;
    case SUSPECT_POSITION_X: (void)add_column(out, file, "x_m", s->value, 0); break;
    case SUSPECT_POSITION_Y: (void)add_column(out, file, "y_m", s->value, 0); break;
    default: break;
  }
}

// Files without the column arrival_ns have stamps alone.
size_t suspect_edits(const suspect *s, const wm_assembly *assembly, const suspect_files *files,
                     file_edit out[SUSPECT_EDITS_MAX]) {
  filling all = {assembly, files, out, 0};
  const wm_rig *rig = assembly->setup.rig;
  switch (s->kind) {
    case SUSPECT_MAP_SWAP:
    case SUSPECT_MAP_MIRROR_X:
    case SUSPECT_MAP_MIRROR_Y:
    case SUSPECT_MAP_TURN:
    case SUSPECT_MAP_FACTOR: add_map(&all, s); break;
    case SUSPECT_MOUNTING_YAW:
    case SUSPECT_MOUNTING_PITCH:
    case SUSPECT_MOUNTING_ROLL:
    case SUSPECT_MOUNTING_RAD:
    case SUSPECT_MOUNTING_FACTOR:
    case SUSPECT_MOUNTING_X:
    case SUSPECT_MOUNTING_Y: add_mounting(&all, s); break;
    case SUSPECT_FOCAL_FACTOR: add_focal(&all, s); break;
    case SUSPECT_TAG_FACTOR:
      if (rig && isfinite(rig->marker_size_m))
        add_value(&all, "calibration.yaml", "markers.size_m", "%.6g", rig->marker_size_m * s->value);
      break;
    case SUSPECT_BASELINE_FACTOR:
      if (rig && isfinite(rig->stereo.baseline_m))
        add_value(&all, "calibration.yaml", "stereo.baseline_m", "%.6g", rig->stereo.baseline_m * s->value);
      break;
    case SUSPECT_PLAN_FACTOR:
      if (assembly->setup.map)
        add_value(&all, "map/map.yaml", "resolution", "%.6g", assembly->setup.map->resolution_m * s->value);
      break;
    default:
      add_observation(&all, s);
      if (all.count == 0) add_motion(&all, s);
      break;
  }
  return all.count;
}

// ── texts ───────────────────────────────────────────────────────────────────────────────────────────────────────────

static const char *unit_name(double factor) {
  static const struct {
    double factor;
    const char *name;
  } kNames[] = {{0.001, "mm"}, {0.01, "cm"},     {0.0254, "inches"}, {0.3048, "feet"},  {0.1, "dm"},
                {1000, "km"},  {DEG, "degrees"}, {1 / DEG, "rad"},   {1 / 3.6, "km/h"}, {3.6, "m/s"},
                {1e3, "us"},   {1e6, "ms"},      {1e9, "s"},         {0.44704, "mph"}};
  for (size_t i = 0; i < sizeof kNames / sizeof kNames[0]; i++)
    if (kNames[i].factor == fabs(factor)) return kNames[i].name;
  return "another unit";
}

static const char *layout_words(const suspect *s) {
  return s->layout == LAYOUT_ORDER || s->layout == LAYOUT_ORDER_START
             ? "the byte order (@0 big-endian, @1 little-endian)"
         : s->layout == LAYOUT_SIGN ? "the sign (+ unsigned, - signed)"
         : s->shift != 0            ? "the first bit"
                                    : "the scale";
}

// Turn rates and speeds of twists and bindings.
static void rate_text(const suspect *s, const char *name, int is_angle, char *what, size_t capacity) {
  if (s->value == -1)
    (void)snprintf(what, capacity, "%s has the wrong sign: it is positive to the %s", name,
                   is_angle ? "right" : "rear");
  else if (s->value < 0)
    (void)snprintf(what, capacity, "%s is positive to the right and in degrees", name);
  else if (is_angle && s->value < 0.1)
    (void)snprintf(what, capacity, "%s is in deg/s (or degrees), not in rad (unit: deg/s)", name);
  else if (is_angle && s->value > 50)
    (void)snprintf(what, capacity, "%s is in rad/s (or radians), not in degrees (unit: rad/s)", name);
  else
    (void)snprintf(what, capacity, "%s is %g times the true one (%s?)", name, 1 / s->value, unit_name(s->value));
}

static int is_angle(int quantity) {
  return quantity == WM_Q_YAW_RATE || quantity == WM_Q_STEERING_WHEEL || quantity == WM_Q_ROAD_WHEEL;
}

#define WHAT(...) (void)snprintf(what, capacity, __VA_ARGS__)

static void motion_text(const suspect *s, const wm_assembly *assembly, const suspect_files *files, char *what,
                        size_t capacity) {
  char name[96];
  const int has_item = s->item >= 0 && (size_t)s->item < files->binding_count;
  const binding_seen *b = has_item ? &files->bindings[s->item] : NULL;
  switch (s->kind) {
    case SUSPECT_TICKS_SWAP: WHAT("the wheels' ticks, left and right, are swapped"); break;
    case SUSPECT_QUANTITY_FACTOR:
    case SUSPECT_QUANTITY_FACTORS:
      if (!b || b->quantity < 0) break;
      if (b->quantity <= (int)WM_Q_WHEEL_TICKS_RIGHT) {
        WHAT("%s count%s backwards (scale: -1)",
             s->kind == SUSPECT_QUANTITY_FACTORS ? "both wheels' ticks" : wm_quantity_name((unsigned)b->quantity),
             s->kind == SUSPECT_QUANTITY_FACTORS ? "" : "s");
        break;
      }
      (void)snprintf(name, sizeof name, "%s%s", wm_quantity_name((unsigned)b->quantity),
                     s->kind == SUSPECT_QUANTITY_FACTORS ? " with the other side's" : "");
      rate_text(s, name, is_angle(b->quantity), what, capacity);
      break;
    case SUSPECT_SIGNAL:
      if (b)
        WHAT("the DBC has %s of %s of message %s wrong", layout_words(s),
             s->layout == LAYOUT_SAME ? b->signal : "the signals", b->message);
      else
        WHAT("the DBC has %s of all bound signals wrong", layout_words(s));
      break;
    case SUSPECT_RADIUS_FACTOR:
      WHAT("the wheels' radius is %g times the true one%s", 1 / s->value,
           s->value == 0.5   ? ": radius_m is the diameter"
           : s->value == 2   ? ": half of the radius?"
           : s->value == 0.1 ? ""
                             : ": another unit?");
      break;
    case SUSPECT_TICKS_FACTOR:
      WHAT("wheels.ticks_per_turn is %g times the true number%s", 1 / s->value,
           s->value == 4 || s->value == 2 ? ": quadrature counts 2 or 4 for each line, or a gear is missing" : "");
      break;
    case SUSPECT_TRACK_FACTOR: WHAT("wheels.track_m is %g times the true one", 1 / s->value); break;
    case SUSPECT_WHEELBASE_FACTOR: WHAT("wheels.wheelbase_m is %g times the true one", 1 / s->value); break;
    case SUSPECT_STEERING_FACTOR: WHAT("wheels.steering_ratio is %g times the true one", 1 / s->value); break;
    case SUSPECT_YAW_RATE_FACTOR: rate_text(s, "the turn rate", 1, what, capacity); break;
    case SUSPECT_SPEED_FACTOR: rate_text(s, "the speed", 0, what, capacity); break;
    case SUSPECT_SIDEWAYS_FACTOR: WHAT("the sideways velocity is positive to the right"); break;
    case SUSPECT_TWIST_SWAP: WHAT("speed and turn rate of %s are swapped", source_name(s, assembly)); break;
    default: break;
  }
}

static void map_text(const suspect *s, char *what, size_t capacity) {
  switch (s->kind) {
    case SUSPECT_MAP_SWAP: WHAT("x and y of the map are swapped"); break;
    case SUSPECT_MAP_MIRROR_X:
    case SUSPECT_MAP_MIRROR_Y:
      WHAT("the map is mirrored: %c has the wrong sign (x, y and z make a right-handed frame)",
           s->kind == SUSPECT_MAP_MIRROR_X ? 'x' : 'y');
      break;
    case SUSPECT_MAP_TURN: WHAT("the map is turned by half a turn against the start"); break;
    case SUSPECT_MAP_FACTOR: WHAT("the map is in %s", unit_name(s->value)); break;
    case SUSPECT_PLAN_FACTOR: WHAT("the floor plan's resolution is %g times the true one", 1 / s->value); break;
    case SUSPECT_TAG_FACTOR:
      WHAT("the markers' size is %g times the true one%s", 1 / s->value,
           s->value == 0.8 ? " (with its white frame?)" : "");
      break;
    case SUSPECT_BASELINE_FACTOR: WHAT("the stereo pair's baseline is %g times the true one", 1 / s->value); break;
    default: break;
  }
}

static void mounting_text(const suspect *s, const char *sensor, char *what, size_t capacity) {
  switch (s->kind) {
    case SUSPECT_MOUNTING_YAW:
    case SUSPECT_MOUNTING_PITCH:
    case SUSPECT_MOUNTING_ROLL:
      WHAT("the mounting of %s is turned by %.3g degrees (%s)", sensor, remainder(s->value, 2 * M_PI) / DEG,
           s->kind == SUSPECT_MOUNTING_YAW     ? "yaw"
           : s->kind == SUSPECT_MOUNTING_PITCH ? "pitch: positive looks down"
                                               : "roll");
      break;
    case SUSPECT_MOUNTING_RAD: WHAT("the mounting's angles of %s are in radians", sensor); break;
    case SUSPECT_MOUNTING_FACTOR: WHAT("the mounting of %s is in %s", sensor, unit_name(s->value)); break;
    case SUSPECT_MOUNTING_X:
    case SUSPECT_MOUNTING_Y:
      WHAT("%s is %.2f m further to the %s than its mounting", sensor, fabs(s->value),
           s->kind == SUSPECT_MOUNTING_X ? (s->value > 0 ? "front" : "rear") : (s->value > 0 ? "left" : "right"));
      break;
    default: WHAT("the lens of %s is of another resolution: its intrinsics are %g times", sensor, 1 / s->value); break;
  }
}

void suspect_text(const suspect *s, const wm_assembly *assembly, const suspect_files *files, char *what,
                  size_t capacity) {
  const char *name = source_name(s, assembly);
  const wm_sensor *sensor = sensor_of(s, assembly);
  what[0] = '\0';
  switch (s->kind) {
    case SUSPECT_TIME:
      WHAT("the stamps of %s are %.2f s too %s: its clock is off", name, fabs(s->value),
           s->value < 0 ? "late" : "early");
      break;
    case SUSPECT_TIME_FACTOR: WHAT("the stamps of %s are in %s", name, unit_name(s->value)); break;
    case SUSPECT_DISORDER: WHAT("the rows of %s are not in the order of their stamps", name); break;
    case SUSPECT_BEARING_FACTOR:
      WHAT("the bearings of %s are %s%s%s", name, s->value < 0 ? "positive to the right" : "",
           s->value < 0 && s->value != -1 ? " and " : "", fabs(s->value) != 1 ? "in degrees or another unit" : "");
      break;
    case SUSPECT_RANGE_FACTOR: WHAT("the ranges of %s are in %s", name, unit_name(s->value)); break;
    case SUSPECT_RANGE_IS:
      WHAT("the ranges of %s are %s", name,
           s->value > 0 ? "depths along the sensor's x axis" : "distances, not depths along the sensor's x axis");
      break;
    case SUSPECT_IDENTITY: WHAT("the ids of %s are off by %g", name, -s->value); break;
    case SUSPECT_IDENTITY_TABLE: WHAT("the ids of %s are permuted against those of the map", name); break;
    case SUSPECT_POSITION_SWAP: WHAT("x (east) and y (north) of %s are swapped", name); break;
    case SUSPECT_POSITION_X:
    case SUSPECT_POSITION_Y:
      WHAT("%c of %s has the wrong sign: x is east, y is north", s->kind == SUSPECT_POSITION_X ? 'x' : 'y', name);
      break;
    case SUSPECT_MOUNTING_YAW:
    case SUSPECT_MOUNTING_PITCH:
    case SUSPECT_MOUNTING_ROLL:
    case SUSPECT_MOUNTING_RAD:
    case SUSPECT_MOUNTING_FACTOR:
    case SUSPECT_MOUNTING_X:
    case SUSPECT_MOUNTING_Y:
    case SUSPECT_FOCAL_FACTOR: mounting_text(s, sensor ? sensor->name : "?", what, capacity); break;
    case SUSPECT_MAP_SWAP:
    case SUSPECT_MAP_MIRROR_X:
    case SUSPECT_MAP_MIRROR_Y:
    case SUSPECT_MAP_TURN:
    case SUSPECT_MAP_FACTOR:
    case SUSPECT_TAG_FACTOR:
    case SUSPECT_PLAN_FACTOR:
    case SUSPECT_BASELINE_FACTOR: map_text(s, what, capacity); break;
    default: motion_text(s, assembly, files, what, capacity); break;
  }
}
