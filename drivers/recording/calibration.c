// SPDX-License-Identifier: Apache-2.0
#include "calibration.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define TRY(call)                               \
  do {                                          \
    wm_status try_status = (call);              \
    if (try_status != WM_OK) return try_status; \
  } while (0)

static const double kDegree = M_PI / 180.0;

void warn_line(const warner *warn, wm_note note, const char *format, ...) {
  if (!warn || !warn->fn) return;
  char text[WM_ERROR_TEXT_MAX];
  va_list args;
  va_start(args, format);
  (void)vsnprintf(text, sizeof text, format, args);
  va_end(args);
  warn->fn(warn->context, note, text);
}

void calibration_init(calibration *self) {
  memset(self, 0, sizeof *self);
  wm_wheels *w = &self->wheels;
  w->radius_m = w->ticks_per_turn = w->track_m = w->wheelbase_m = w->steering_ratio = w->encoder_offset_m = (double)NAN;
  wm_rig_init(&self->rig);
  for (int i = 0; i < 3; i++) self->gnss_origin[i] = (double)NAN;
}

wm_status calibration_keys(const wm_yaml_node *map, const char *const *known, const warner *warn, wm_error *err) {
  wm_error said;
  size_t unknown;
  if (wm_yaml_check_keys(map, known, WM_YAML_NEAR, &unknown, &said) != WM_OK)
    return wm_fail(err, WM_BAD_CONFIG, "%s", said.text);
  if (unknown == 0) return WM_OK;
  for (char *rest = said.text, *line; (line = strsep(&rest, "\n"));) warn_line(warn, WM_NOTE_FILE, "%s", line);
  return WM_OK;
}

// An optional number: unchanged where the key is absent.
static wm_status number(const wm_yaml_node *map, const char *key, double min, double max, double *out, wm_error *err) {
  wm_yaml_node node = wm_yaml_get(map, key);
  return wm_yaml_there(&node) ? wm_yaml_f64(&node, min, max, out, err) : WM_OK;
}

wm_status calibration_angle(const wm_yaml_node *map, const char *name, double min_rad, double max_rad, double *out_rad,
                            wm_error *err) {
  char key[64];
  snprintf(key, sizeof key, "%s_deg", name);
  wm_yaml_node degrees = wm_yaml_get(map, key);
  snprintf(key, sizeof key, "%s_rad", name);
  wm_yaml_node radians = wm_yaml_get(map, key);
  if (wm_yaml_there(&degrees) && wm_yaml_there(&radians))
    return wm_yaml_fail(&degrees, err, "%s_rad is given, too; give one of them", name);
  if (wm_yaml_there(&radians)) return wm_yaml_f64(&radians, min_rad, max_rad, out_rad, err);
  if (!wm_yaml_there(&degrees)) return WM_OK;
  double value;
  TRY(wm_yaml_f64(&degrees, min_rad == DBL_MIN ? DBL_MIN : min_rad / kDegree, max_rad / kDegree, &value, err));
  *out_rad = value * kDegree;
  return WM_OK;
}

static wm_status list_in(const wm_yaml_node *list, size_t min_count, size_t max_count, double min, double max,
                         double *out, size_t *count, wm_error *err) {
  size_t n;
  TRY(wm_yaml_f64_list(list, min_count, max_count, out, &n, err));
  for (size_t i = 0; i < n; i++) {
    wm_yaml_node item = wm_yaml_item(list, i);
    TRY(wm_yaml_f64(&item, min, max, &out[i], err));
  }
  if (count) *count = n;
  return WM_OK;
}

const wm_mounting *calibration_camera_mounting(const calibration *self, const char *name) {
  int camera = wm_rig_find_camera(&self->rig, name);
  return camera < 0 ? NULL : &self->rig.cameras[camera].mounting;
}

wm_status calibration_mounting(const wm_yaml_node *parent, const wm_mounting *otherwise, const warner *warn,
                               wm_mounting *out, wm_error *err) {
  static const char *const kKeys[] = {"xyz_m", "rpy_deg", "rpy_rad", NULL};
  memset(out, 0, sizeof *out);
  wm_yaml_node mounting = wm_yaml_get(parent, "mounting");
  if (!wm_yaml_there(&mounting) && otherwise) {
    *out = *otherwise;
    return WM_OK;
  }
  if (!wm_yaml_there(&mounting)) {
    warn_line(warn, WM_NOTE_FILE, "%s:%d: %s: no mounting given; it is taken to sit at base_link", wm_yaml_file(parent),
              wm_yaml_line(parent), parent->path);
    return WM_OK;
  }
  TRY(calibration_keys(&mounting, kKeys, warn, err));
  wm_yaml_node xyz = wm_yaml_get(&mounting, "xyz_m"), deg = wm_yaml_get(&mounting, "rpy_deg"),
               rad = wm_yaml_get(&mounting, "rpy_rad");
  if (wm_yaml_there(&xyz)) TRY(list_in(&xyz, 3, 3, -1000, 1000, out->xyz_m, NULL, err));
  if (wm_yaml_there(&deg) && wm_yaml_there(&rad))
    return wm_yaml_fail(&rad, err, "rpy_deg is given, too; give one of them");
  if (wm_yaml_there(&rad)) TRY(list_in(&rad, 3, 3, -2 * M_PI, 2 * M_PI, out->rpy_rad, NULL, err));
  if (wm_yaml_there(&deg)) {
    TRY(list_in(&deg, 3, 3, -360, 360, out->rpy_rad, NULL, err));
    for (int i = 0; i < 3; i++) out->rpy_rad[i] *= kDegree;
  }
  return WM_OK;
}

static wm_status read_name(const wm_yaml_node *value, const char *key, int line, char out[WM_NAME_MAX], wm_error *err) {
  if (*key == '\0' || strlen(key) >= WM_NAME_MAX || strpbrk(key, ", \t:"))
    return wm_fail(err, WM_BAD_CONFIG, "%s:%d: %s: a name has 1 to %d letters without blank, comma or colon",
                   wm_yaml_file(value), line, value->path, WM_NAME_MAX - 1);
  snprintf(out, WM_NAME_MAX, "%s", key);
  return WM_OK;
}

static wm_status read_cameras(const wm_yaml_node *cameras, const warner *warn, calibration *out, wm_error *err) {
  if (wm_yaml_there(cameras) && !wm_yaml_is_map(cameras))
    return wm_yaml_fail(cameras, err, "a map of cameras by their names is needed");
  if (wm_yaml_count(cameras) > WM_CAMERAS_MAX)
    return wm_yaml_fail(cameras, err, "more than %d cameras", WM_CAMERAS_MAX);
  for (size_t i = 0; i < wm_yaml_count(cameras); i++) {
    const char *key;
    int line;
    wm_yaml_node node = wm_yaml_value(cameras, i, &key, &line);
    wm_camera *one = &out->rig.cameras[out->rig.camera_count++];
    TRY(read_name(&node, key, line, one->name, err));
    TRY(calibration_camera(&node, warn, one, err));
  }
  return WM_OK;
}

// A sensor with a camera's name has that camera's mounting, unless it has its own.
static wm_status read_sensor(const wm_yaml_node *node, const calibration *known, const warner *warn, wm_sensor *out,
                             wm_error *err) {
  static const char *const kKeys[] = {
      "mounting", "bearing_sigma_rad", "bearing_sigma_deg", "range_sigma_m", "max_range_m", "range_is", NULL};
  static const char *const kRanges[] = {"distance", "depth", NULL};
  if (!wm_yaml_is_map(node)) return wm_yaml_fail(node, err, "a map with mounting, bearing_sigma_rad ... is needed");
  TRY(calibration_keys(node, kKeys, warn, err));
  TRY(calibration_mounting(node, calibration_camera_mounting(known, out->name), warn, &out->mounting, err));
  out->bearing_sigma_rad = out->range_sigma_m = (double)NAN;
  out->max_range_m = HUGE_VAL;
  TRY(calibration_angle(node, "bearing_sigma", DBL_MIN, M_PI, &out->bearing_sigma_rad, err));
  TRY(number(node, "range_sigma_m", DBL_MIN, 1000, &out->range_sigma_m, err));
  TRY(number(node, "max_range_m", DBL_MIN, HUGE_VAL, &out->max_range_m, err));
  wm_yaml_node range_is = wm_yaml_get(node, "range_is");
  return wm_yaml_there(&range_is) ? wm_yaml_choice(&range_is, kRanges, &out->range_is_depth, err) : WM_OK;
}

static wm_status read_sensors(const wm_yaml_node *sensors, const warner *warn, calibration *out, wm_error *err) {
  if (wm_yaml_there(sensors) && !wm_yaml_is_map(sensors))
    return wm_yaml_fail(sensors, err, "a map of sensors by their names is needed");
  if (wm_yaml_count(sensors) > WM_SENSORS_MAX)
    return wm_yaml_fail(sensors, err, "more than %d sensors", WM_SENSORS_MAX);
  for (size_t i = 0; i < wm_yaml_count(sensors); i++) {
    const char *key;
    int line;
    wm_yaml_node node = wm_yaml_value(sensors, i, &key, &line);
    wm_sensor *sensor = &out->sensors[out->sensor_count++];
    TRY(read_name(&node, key, line, sensor->name, err));
    TRY(read_sensor(&node, out, warn, sensor, err));
  }
  return WM_OK;
}

// A camera for coded markers is a sensor, whether or not `sensors` names it.
static void add_marker_cameras(calibration *out) {
  for (uint32_t i = 0; i < out->rig.camera_count; i++) {
    const wm_camera *camera = &out->rig.cameras[i];
    int known = 0;
    for (size_t k = 0; k < out->sensor_count; k++) known |= strcmp(out->sensors[k].name, camera->name) == 0;
    if (known || out->sensor_count == WM_SENSORS_MAX) continue;
    wm_sensor *sensor = &out->sensors[out->sensor_count++];
    memset(sensor, 0, sizeof *sensor);
    memcpy(sensor->name, camera->name, sizeof sensor->name);
    sensor->mounting = camera->mounting;
    sensor->bearing_sigma_rad = sensor->range_sigma_m = (double)NAN;
    sensor->max_range_m = HUGE_VAL;
  }
}

// actuator_mm against road_wheel_rad: two lists of one length, with rising positions (falling ones are reversed).
static wm_status read_steering_table(const wm_yaml_node *table, const warner *warn, wm_wheels *out, wm_error *err) {
  static const char *const kKeys[] = {"actuator_mm", "road_wheel_rad", "road_wheel_deg", NULL};
  TRY(calibration_keys(table, kKeys, warn, err));
  wm_yaml_node positions = wm_yaml_get(table, "actuator_mm"), angles = wm_yaml_get(table, "road_wheel_rad");
  double unit = 1.0, mm[WM_STEERING_TABLE_MAX], angle[WM_STEERING_TABLE_MAX];
  if (!wm_yaml_there(&angles)) {
    angles = wm_yaml_get(table, "road_wheel_deg");
    unit = kDegree;
  }
  if (!wm_yaml_there(&positions) || !wm_yaml_there(&angles))
    return wm_yaml_fail(table, err, "actuator_mm and road_wheel_rad are both needed");
  size_t n, m;
  TRY(list_in(&positions, 2, WM_STEERING_TABLE_MAX, -1e5, 1e5, mm, &n, err));
  TRY(list_in(&angles, 2, WM_STEERING_TABLE_MAX, -M_PI_2 / unit, M_PI_2 / unit, angle, &m, err));
  if (n != m)
    return wm_yaml_fail(table, err, "actuator_mm has %zu values, the angles are %zu; one each is needed", n, m);
  int falls = mm[1] < mm[0];
  for (size_t i = 0; i < n; i++) {
    size_t from = falls ? n - 1 - i : i;
    out->actuator_m[i] = mm[from] * 1e-3;
    out->road_wheel_rad[i] = angle[from] * unit;
    if (i > 0 && out->actuator_m[i] <= out->actuator_m[i - 1])
      return wm_yaml_fail(&positions, err, "must rise from value to value (%.6g follows %.6g)",
                          mm[falls ? from + 1 : from], mm[falls ? from : from - 1]);
  }
  out->steering_table_count = (uint32_t)n;
  return WM_OK;
}

static wm_status read_wheels(const wm_yaml_node *wheels, const warner *warn, wm_wheels *out, wm_error *err) {
  static const char *const kKeys[] = {"radius_m",       "ticks_per_turn",   "track_m",        "wheelbase_m",
                                      "steering_ratio", "encoder_offset_m", "steering_table", NULL};
  TRY(calibration_keys(wheels, kKeys, warn, err));
  TRY(number(wheels, "radius_m", DBL_MIN, 10, &out->radius_m, err));
  TRY(number(wheels, "ticks_per_turn", DBL_MIN, 1e9, &out->ticks_per_turn, err));
  TRY(number(wheels, "track_m", DBL_MIN, 100, &out->track_m, err));
  TRY(number(wheels, "wheelbase_m", DBL_MIN, 100, &out->wheelbase_m, err));
  TRY(number(wheels, "steering_ratio", DBL_MIN, 1000, &out->steering_ratio, err));
  TRY(number(wheels, "encoder_offset_m", -100, 100, &out->encoder_offset_m, err));
  wm_yaml_node table = wm_yaml_get(wheels, "steering_table");
  return wm_yaml_there(&table) ? read_steering_table(&table, warn, out, err) : WM_OK;
}

static wm_status read_camera_of_pair(const wm_yaml_node *stereo, const char *side, const wm_rig *rig, int32_t *out,
                                     wm_error *err) {
  char name[WM_NAME_MAX];
  wm_yaml_node node = wm_yaml_get(stereo, side);
  if (!wm_yaml_there(&node)) return wm_yaml_fail(stereo, err, "%s: the name of a camera is needed", side);
  TRY(wm_yaml_string(&node, name, sizeof name, err));
  *out = wm_rig_find_camera(rig, name);
  return *out >= 0 ? WM_OK : wm_yaml_fail(&node, err, "there is no camera '%s' under cameras", name);
}

static wm_status read_stereo(const wm_yaml_node *stereo, const warner *warn, wm_rig *rig, wm_error *err) {
  static const char *const kKeys[] = {"left", "right", "baseline_m", "rectified", "sigma_px", NULL};
  wm_stereo_pair *pair = &rig->stereo;
  TRY(calibration_keys(stereo, kKeys, warn, err));
  TRY(read_camera_of_pair(stereo, "left", rig, &pair->left, err));
  TRY(read_camera_of_pair(stereo, "right", rig, &pair->right, err));
  TRY(number(stereo, "baseline_m", DBL_MIN, 100, &pair->baseline_m, err));
  wm_yaml_node rectified = wm_yaml_get(stereo, "rectified"), sigma = wm_yaml_get(stereo, "sigma_px");
  if (wm_yaml_there(&rectified)) TRY(list_in(&rectified, 4, 4, -1e5, 1e5, pair->rectified_px, NULL, err));
  return wm_yaml_there(&sigma) ? list_in(&sigma, 4, 4, DBL_MIN, 1e4, pair->sigma_px, NULL, err) : WM_OK;
}

static wm_status read_markers(const wm_yaml_node *markers, const warner *warn, wm_rig *rig, wm_error *err) {
  static const char *const kKeys[] = {"family", "size_m", NULL};
  TRY(calibration_keys(markers, kKeys, warn, err));
  wm_yaml_node node = wm_yaml_get(markers, "family");
  if (wm_yaml_there(&node)) TRY(wm_yaml_string(&node, rig->marker_family, sizeof rig->marker_family, err));
  return number(markers, "size_m", DBL_MIN, 10, &rig->marker_size_m, err);
}

static wm_status read_motion6(const wm_yaml_node *motion6, const warner *warn, calibration *out, wm_error *err) {
  static const char *const kKeys[] = {"sigma_v_mps", "sigma_w_radps", "mounting", NULL};
  double *const outs[] = {out->rig.twist6_sigma_v_mps, out->rig.twist6_sigma_w_radps};
  const wm_mounting at_base_link = {0};
  TRY(calibration_keys(motion6, kKeys, warn, err));
  TRY(calibration_mounting(motion6, &at_base_link, warn, &out->mountings.motion6, err));
  for (int i = 0; i < 2; i++) {
    wm_yaml_node sigma = wm_yaml_get(motion6, kKeys[i]);
    if (wm_yaml_there(&sigma)) TRY(list_in(&sigma, 3, 3, DBL_MIN, 1000, outs[i], NULL, err));
  }
  return WM_OK;
}

static wm_status read_gnss(const wm_yaml_node *gnss, const warner *warn, calibration *out, wm_error *err) {
  static const char *const kKeys[] = {"origin", "mounting", NULL};
  TRY(calibration_keys(gnss, kKeys, warn, err));
  wm_yaml_node origin = wm_yaml_get(gnss, "origin"), mounting = wm_yaml_get(gnss, "mounting");
  if (wm_yaml_there(&mounting)) {
    wm_mounting antenna;
    TRY(calibration_mounting(gnss, NULL, warn, &antenna, err));
    memcpy(out->rig.antenna_m, antenna.xyz_m, sizeof out->rig.antenna_m);
  }
  return wm_yaml_there(&origin) ? list_in(&origin, 3, 3, -1e4, 1e4, out->gnss_origin, NULL, err) : WM_OK;
}

static wm_status read_imu(const wm_yaml_node *imu, const warner *warn, wm_mounting *out, wm_error *err) {
  static const char *const kKeys[] = {"mounting", NULL};
  TRY(calibration_keys(imu, kKeys, warn, err));
  return wm_yaml_there(imu) ? calibration_mounting(imu, NULL, warn, out, err) : WM_OK;
}

wm_status calibration_read(const wm_yaml *doc, const warner *warn, calibration *out, wm_error *err) {
  static const char *const kKeys[] = {"cameras", "sensors", "stereo", "wheels", "markers",
                                      "motion6", "gnss",    "imu",    NULL};
  calibration_init(out);
  wm_yaml_node root = wm_yaml_root(doc);
  TRY(calibration_keys(&root, kKeys, warn, err));
  wm_yaml_node cameras = wm_yaml_get(&root, "cameras"), sensors = wm_yaml_get(&root, "sensors"),
               stereo = wm_yaml_get(&root, "stereo"), wheels = wm_yaml_get(&root, "wheels"),
               markers = wm_yaml_get(&root, "markers"), motion6 = wm_yaml_get(&root, "motion6"),
               gnss = wm_yaml_get(&root, "gnss"), imu = wm_yaml_get(&root, "imu");
  TRY(read_cameras(&cameras, warn, out, err));
  TRY(read_sensors(&sensors, warn, out, err));
  TRY(read_wheels(&wheels, warn, &out->wheels, err));
  if (wm_yaml_there(&stereo)) TRY(read_stereo(&stereo, warn, &out->rig, err));
  TRY(read_markers(&markers, warn, &out->rig, err));
  if (out->rig.marker_family[0]) add_marker_cameras(out);
  TRY(read_motion6(&motion6, warn, out, err));
  TRY(read_imu(&imu, warn, &out->mountings.imu, err));
  return read_gnss(&gnss, warn, out, err);
}
