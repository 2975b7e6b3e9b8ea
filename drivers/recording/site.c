// SPDX-License-Identifier: Apache-2.0
#include "waymark/site.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "calibration.h"
#include "csv.h"
#include "waymark/map.h"
#include "waymark/recording.h"
#include "waymark/text.h"
#include "waymark/yaml.h"

#define CALIBRATION_BYTES_MAX (1u << 20)  // usual files are some kB

struct wm_site {
  char dir[WM_PATH_MAX];  // "": no folder
  const char *name;       // for messages
  wm_start start;
  wm_recording_overrides files;
  warner warn;
  char *calibration_text;
  size_t calibration_length;
  calibration calibration;
  wm_landmark *landmarks;
  size_t landmark_count;
  char landmarks_path[WM_PATH_MAX];  // "" where there are none
  wm_appearance *appearances;        // NULL until the first call
  size_t appearance_count;
  char map_path[WM_PATH_MAX];  // "" where there is none
  wm_map *map;                 // NULL until the first call
};

// The named file, else the folder's own; `*there`: whether it exists.
static wm_status choose(const wm_site *self, const char *named, const char *file, char out[WM_PATH_MAX], int *there,
                        wm_error *err) {
  if (*named) {
    *there = 1;
    snprintf(out, WM_PATH_MAX, "%s", named);
    return WM_OK;
  }
  *there = 0;
  if (!self->dir[0]) return WM_OK;
  if (snprintf(out, WM_PATH_MAX, "%s/%s", self->dir, file) >= WM_PATH_MAX)
    return wm_fail(err, WM_BAD_USAGE, "%s/%s: the path is longer than %d bytes", self->dir, file, WM_PATH_MAX - 1);
  *there = access(out, F_OK) == 0;
  return WM_OK;
}

static wm_status read_calibration(wm_site *self, wm_error *err) {
  char path[WM_PATH_MAX];
  int there;
  calibration_init(&self->calibration);
  wm_status status = choose(self, self->files.calibration, "calibration.yaml", path, &there, err);
  if (status != WM_OK || !there) return status;
  status = wm_text_read_file(path, CALIBRATION_BYTES_MAX, &self->calibration_text, &self->calibration_length, err);
  if (status != WM_OK) return status;
  wm_yaml *doc;
  status = wm_yaml_parse(self->calibration_text, self->calibration_length, path, &doc, err);
  if (status != WM_OK) return status;
  status = calibration_read(doc, &self->warn, &self->calibration, err);
  wm_yaml_free(doc);
  return status;
}

// The floor's origin. A robot whose calibration.yaml has another one would mix two frames.
static wm_status take_origin(wm_site *self, wm_error *err) {
  static const double kSame[3] = {1e-6, 1e-6, 0.1};  // degrees (0.1 m), m: below any receiver's error
  double *own = self->calibration.gnss_origin;
  for (int i = 0; i < 3 && self->files.has_origin && isfinite(own[i]); i++)
    if (fabs(own[i] - self->files.origin[i]) > kSame[i])
      return wm_fail(err, WM_BAD_CONFIG,
                     "%s: gnss.origin of calibration.yaml is [%.7f, %.7f, %.2f], the floor's is [%.7f, %.7f, %.2f]; "
                     "leave one of them out",
                     self->name, own[0], own[1], own[2], self->files.origin[0], self->files.origin[1],
                     self->files.origin[2]);
  if (self->files.has_origin) memcpy(own, self->files.origin, sizeof self->files.origin);
  return WM_OK;
}

static wm_status read_landmarks(wm_site *self, wm_error *err) {
  char path[WM_PATH_MAX];
  int there;
  wm_status status = choose(self, self->files.landmarks, "landmarks.csv", path, &there, err);
  if (status != WM_OK || !there) return status;
  memcpy(self->landmarks_path, path, sizeof path);
  return landmarks_read(path, &self->warn, &self->landmarks, &self->landmark_count, err);
}

static wm_status find_map(wm_site *self, wm_error *err) {
  int there;
  wm_status status = choose(self, self->files.map, "map/map.yaml", self->map_path, &there, err);
  if (!there) self->map_path[0] = '\0';
  return status;
}

static void warn_unknown_sensor(wm_site *self, const char *path, const char *name) {
  const char *known[WM_SENSORS_MAX + 1] = {NULL}, *nearest;
  for (size_t i = 0; i < self->calibration.sensor_count; i++) known[i] = self->calibration.sensors[i].name;
  nearest = wm_word_nearest(name, known);
  warn_line(&self->warn, nearest ? WM_NOTE_SENSOR_MISSPELT : WM_NOTE_SENSOR_UNKNOWN,
            "%s: the sensor '%s' is not in calibration.yaml%s%s%s; it is taken to sit at base_link, sigmas unknown",
            path, name, nearest ? "; did you mean '" : "", nearest ? nearest : "", nearest ? "'?" : "");
}

// Index of the sensor; one that `sensors` of calibration.yaml lacks is added at the camera of its name, or at
// base_link.
wm_status wm_site_sensor(wm_site *self, const char *path, const char *name, uint16_t *out, wm_error *err) {
  calibration *known = &self->calibration;
  for (size_t i = 0; i < known->sensor_count; i++) {
    *out = (uint16_t)i;
    if (strcmp(known->sensors[i].name, name) == 0) return WM_OK;
  }
  if (known->sensor_count == WM_SENSORS_MAX)
    return wm_fail(err, WM_FULL, "%s: more than %d sensors, with those of calibration.yaml", path, WM_SENSORS_MAX);
  const wm_mounting *mounting = calibration_camera_mounting(known, name);
  wm_sensor *sensor = &known->sensors[known->sensor_count];
  *sensor = (wm_sensor){.bearing_sigma_rad = (double)NAN, .range_sigma_m = (double)NAN, .max_range_m = HUGE_VAL};
  snprintf(sensor->name, sizeof sensor->name, "%s", name);
  if (mounting)
    sensor->mounting = *mounting;
  else
    warn_unknown_sensor(self, path, name);
  *out = (uint16_t)known->sensor_count++;
  return WM_OK;
}

wm_status wm_site_open(const char *dir, const wm_recording_overrides *files, wm_warn_fn warn, void *context,
                       wm_site **out, wm_error *err) {
  *out = NULL;
  wm_site *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for calibration and landmarks");
  if (dir) snprintf(self->dir, sizeof self->dir, "%s", dir);
  self->name = dir ? self->dir : "robot";
  self->warn = (warner){warn, context};
  if (files) self->files = *files;
  wm_start_init(&self->start);
  wm_status status = read_calibration(self, err);
  if (status == WM_OK) status = take_origin(self, err);
  if (status == WM_OK) status = read_landmarks(self, err);
  if (status == WM_OK) status = find_map(self, err);
  if (status != WM_OK) {
    wm_site_close(self);
    return status;
  }
  *out = self;
  return WM_OK;
}

void wm_site_close(wm_site *self) {
  if (!self) return;
  free(self->calibration_text);
  free(self->landmarks);
  wm_appearances_free(self->appearances, self->appearance_count);
  wm_map_free(self->map);
  free(self);
}

void wm_site_set_start(wm_site *self, const wm_start *start) { self->start = *start; }

const wm_wheels *wm_site_wheels(const wm_site *self) { return &self->calibration.wheels; }

const wm_sensor *wm_site_sensors(const wm_site *self, size_t *count) {
  *count = self->calibration.sensor_count;
  return self->calibration.sensors;
}

wm_status wm_site_camera_sensor(wm_site *self, const char *camera, uint16_t *out, wm_error *err) {
  return wm_site_sensor(self, self->name, camera, out, err);
}

const wm_landmark *wm_site_landmarks(const wm_site *self, size_t *count) {
  *count = self->landmark_count;
  return self->landmarks;
}

wm_status wm_site_appearances(wm_site *self, const wm_appearance **out, size_t *count, wm_error *err) {
  char path[WM_PATH_MAX];
  *out = self->appearances;
  *count = self->appearance_count;
  if (self->appearances || !self->landmarks_path[0]) return WM_OK;
  const char *slash = strrchr(self->landmarks_path, '/');
  const int folder = slash ? (int)(slash - self->landmarks_path) + 1 : 0;
  if (snprintf(path, sizeof path, "%.*slandmarks/appearance.csv", folder, self->landmarks_path) >= WM_PATH_MAX)
    return wm_fail(err, WM_BAD_USAGE, "%s: the path of landmarks/appearance.csv beside it is too long",
                   self->landmarks_path);
  if (access(path, F_OK) != 0) return WM_OK;
  wm_status status =
      wm_appearances_load(path, self->warn.fn, self->warn.context, &self->appearances, &self->appearance_count, err);
  *out = self->appearances;
  *count = self->appearance_count;
  return status;
}

const char *wm_site_map_path(const wm_site *self) { return self->map_path; }

wm_status wm_site_map(wm_site *self, const wm_raster **out, wm_error *err) {
  *out = NULL;
  if (!self->map_path[0]) return WM_OK;
  wm_status status =
      self->map ? WM_OK : wm_map_load(self->map_path, self->warn.fn, self->warn.context, &self->map, err);
  if (status == WM_OK) *out = wm_map_raster(self->map);
  return status;
}

const wm_rig *wm_site_rig(const wm_site *self) { return &self->calibration.rig; }
const double *wm_site_gnss_origin(const wm_site *self) { return self->calibration.gnss_origin; }
const wm_row_mountings *wm_site_row_mountings(const wm_site *self) { return &self->calibration.mountings; }
const wm_start *wm_site_start(const wm_site *self) { return &self->start; }
const char *wm_site_calibration_text(const wm_site *self, size_t *length) {
  *length = self->calibration_length;
  return self->calibration_text ? self->calibration_text : "";
}
