// SPDX-License-Identifier: Apache-2.0
// Each suspect as changes of files.
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "cli/check/suspects.h"
#include "waymark/detectors.h"

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

__attribute__((format(printf, 4, 5))) static file_edit *add_value(filling *out, const char *file, const char *path,
                                                                  const char *format, ...) {
  file_edit *edit = add(out, EDIT_VALUE, file);
  va_list arguments;
  (void)snprintf(edit->name, sizeof edit->name, "%s", path);
  va_start(arguments, format);
  (void)vsnprintf(edit->text, sizeof edit->text, format, arguments);
  va_end(arguments);
  return edit;
}

// ── sources and sensors ─────────────────────────────────────────────────────────────────────────────────────────────

// The file with the source's stamps: "sightings.csv", "video/front.csv".
static void file_of(const suspect *s, const wm_assembly *assembly, char *out, size_t capacity) {
  static const char *const kTables[] = {"sightings", "markers", "corners",    "stereo", "points", "gnss",
                                        "motion",    "motion6", "increments", "imu",    NULL};
  const char *name = suspect_source(s, assembly), *colon = strchr(name, ':');
  const size_t n = colon ? (size_t)(colon - name) : strlen(name);
  for (size_t i = 0; kTables[i]; i++)
    if (strlen(kTables[i]) == n && strncmp(kTables[i], name, n) == 0) {
      (void)snprintf(out, capacity, "%s.csv", strcmp(kTables[i], "corners") == 0 ? "marker-corners" : kTables[i]);
      return;
    }
  (void)snprintf(out, capacity, "video/%s.csv", colon ? colon + 1 : name);
}

static void add_sensor_column(filling *out, const suspect *s, const char *column, double factor, double offset) {
  char file[64];
  file_of(s, out->assembly, file, sizeof file);
  file_edit *edit = add_column(out, file, column, factor, offset);
  const wm_sensor *sensor = suspect_sensor(s, out->assembly);
  if (sensor) (void)snprintf(edit->only, sizeof edit->only, "%s", sensor->name);
}

static void add_stamps(filling *out, const suspect *s, double factor, double offset_s) {
  char file[64];
  file_of(s, out->assembly, file, sizeof file);
  const char *name = suspect_source(s, out->assembly), *colon = strchr(name, ':');
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
  const wm_sensor *sensor = suspect_sensor(s, out->assembly);
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
  const wm_sensor *sensor = suspect_sensor(s, out->assembly);
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

static void set_quantity(filling *out, int item, const char *name) {
  char path[96];
  (void)snprintf(path, sizeof path, "[%d].quantity", item);
  add_value(out, "can-signals.yaml", path, "%s", name);
}

static void swap_ticks(filling *out) {
  for (size_t i = 0; i < out->files->binding_count; i++) {
    const binding_seen *b = &out->files->bindings[i];
    if (b->quantity > (int)WM_Q_WHEEL_TICKS_RIGHT || b->quantity < 0) continue;
    set_quantity(out, (int)i, wm_quantity_name(WM_Q_WHEEL_TICKS_RIGHT - (unsigned)b->quantity));
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
  const char *source = suspect_source(s, out->assembly);
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

// The number of calibration.yaml that a suspect multiplies; 0: it is of another kind.
static int add_wheels(filling *out, const suspect *s) {
  const wm_wheels *w = &out->assembly->setup.wheels;
  const struct {
    suspect_kind kind;
    const char *path;
    double value;
  } kNumbers[] = {{SUSPECT_RADIUS_FACTOR, "wheels.radius_m", w->radius_m},
                  {SUSPECT_TICKS_FACTOR, "wheels.ticks_per_turn", w->ticks_per_turn},
                  {SUSPECT_TRACK_FACTOR, "wheels.track_m", w->track_m},
                  {SUSPECT_WHEELBASE_FACTOR, "wheels.wheelbase_m", w->wheelbase_m},
                  {SUSPECT_STEERING_FACTOR, "wheels.steering_ratio", w->steering_ratio}};
  for (size_t i = 0; i < sizeof kNumbers / sizeof kNumbers[0]; i++)
    if (kNumbers[i].kind == s->kind) {
      add_value(out, "calibration.yaml", kNumbers[i].path, "%.9g", kNumbers[i].value * s->value);
      return 1;
    }
  return 0;
}

static void add_motion(filling *out, const suspect *s) {
  if (add_wheels(out, s)) return;
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

static void mirror_plan(filling *out, const suspect *s) {
  for (size_t i = 0; i < out->files->plan_picture_count; i++)
    add(out, EDIT_MIRROR, out->files->plan_pictures[i])->factor = s->value;
}

// ── markers and pairs ───────────────────────────────────────────────────────────────────────────────────────────────

static void add_family(filling *out, const suspect *s) {
  const char *name = wm_marker_family_names[(int)s->value];
  if (out->files->tag_family > 0)
    add_value(out, out->files->config->path, "vision.apriltag.family", "%s", name)->is_config = 1;
  else
    add_value(out, "calibration.yaml", "markers.family", "%s", name);
}

// Of points that were found already, their columns; of pictures, the names of the cameras.
static void swap_stereo(filling *out, const suspect *s) {
  const wm_rig *rig = out->assembly->setup.rig;
  char file[64];
  file_of(s, out->assembly, file, sizeof file);
  if (strcmp(file, "stereo.csv") == 0) {
    add_swap(out, file, "ul_px", "ur_px");
    add_swap(out, file, "vl_px", "vr_px");
  } else if (rig && rig->stereo.left >= 0 && rig->stereo.right >= 0) {
    add_value(out, "calibration.yaml", "stereo.left", "%s", rig->cameras[rig->stereo.right].name);
    add_value(out, "calibration.yaml", "stereo.right", "%s", rig->cameras[rig->stereo.left].name);
  }
}

static void add_observation(filling *out, const suspect *s) {
  char path[96], file[64];
  const wm_sensor *sensor = suspect_sensor(s, out->assembly);
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
  if (suspect_is_map(s->kind)) add_map(&all, s);
  if (suspect_is_mounting(s->kind)) add_mounting(&all, s);
  if (suspect_is_map(s->kind) || suspect_is_mounting(s->kind)) return all.count;
  switch (s->kind) {
    case SUSPECT_FOCAL_FACTOR: add_focal(&all, s); break;
    case SUSPECT_STEREO_SWAP: swap_stereo(&all, s); break;
    case SUSPECT_PLAN_MIRROR: mirror_plan(&all, s); break;
    case SUSPECT_TAG_FAMILY: add_family(&all, s); break;
    case SUSPECT_ORIGIN_SWAP:
      add_value(&all, "calibration.yaml", "gnss.origin", "[%.10g, %.10g, %.6g]", files->origin[1], files->origin[0],
                files->origin[2]);
      break;
    case SUSPECT_LATITUDE_SWAP:
      set_quantity(&all, s->item, "gnss_longitude");
      set_quantity(&all, s->other, "gnss_latitude");
      break;
    case SUSPECT_SETTING:
      add_value(&all, files->config->path, files->settings[s->item].path, "%.9g", s->value)->is_config = 1;
      break;
    case SUSPECT_TAG_FACTOR:
      if (files->tag_size_m > 0)
        add_value(&all, files->config->path, "vision.apriltag.size_m", "%.6g", files->tag_size_m * s->value)
            ->is_config = 1;
      else if (rig && isfinite(rig->marker_size_m))
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
