// SPDX-License-Identifier: Apache-2.0
#include "waymark/map.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "waymark/yaml.h"

struct wm_map {
  wm_raster raster;
  wm_grey edges, drivable;
};

static const char *const kKeys[] = {"image",       "resolution", "origin", "negate", "occupied_thresh",
                                    "free_thresh", "mode",       "layers", NULL};
static const char *const kLayers[] = {"edges", "drivable", NULL};

static wm_status check_keys(const wm_yaml_node *map, const char *const *known, wm_warn_fn warn, void *context,
                            wm_error *err) {
  size_t unknown = 0;
  wm_error said = {0};
  wm_status status = wm_yaml_check_keys(map, known, WM_YAML_NEAR, &unknown, &said);
  if (status != WM_OK) {
    if (err) *err = said;
    return status;
  }
  if (unknown > 0 && warn) warn(context, said.text);
  return WM_OK;
}

static wm_status need(const wm_yaml_node *root, const char *key, const char *about, wm_yaml_node *out, wm_error *err) {
  *out = wm_yaml_get(root, key);
  return wm_yaml_there(out) ? WM_OK : wm_yaml_fail(root, err, "%s: is missing; %s", key, about);
}

static wm_status read_geometry(const wm_yaml_node *root, wm_raster *out, wm_error *err) {
  wm_yaml_node resolution, origin;
  double pose[3];
  size_t count;
  wm_status status = need(root, "resolution", "the metres of a pixel are needed", &resolution, err);
  if (status == WM_OK) status = wm_yaml_f64(&resolution, DBL_MIN, 100.0, &out->resolution_m, err);
  if (status == WM_OK && out->resolution_m < 1e-4)
    return wm_yaml_fail(&resolution, err, "%g m are below 0.0001 m, the finest pixel that is allowed",
                        out->resolution_m);
  if (status == WM_OK)
    status = need(root, "origin", "[x, y, yaw] of the lower left pixel's outer corner is needed", &origin, err);
  if (status == WM_OK) status = wm_yaml_f64_list(&origin, 2, 3, pose, &count, err);
  if (status != WM_OK) return status;
  for (size_t i = 0; i < count; i++)
    if (!isfinite(pose[i]) || fabs(pose[i]) > (i < 2 ? 1e8 : 1e4))
      return wm_yaml_fail(&origin, err, "%g can't be: metres up to 1e8 and radians are allowed", pose[i]);
  out->origin_x_m = pose[0];
  out->origin_y_m = pose[1];
  out->origin_yaw_rad = count > 2 ? pose[2] : 0.0;
  return WM_OK;
}

// A picture of the YAML, relative to the YAML's folder.
static wm_status read_picture(const wm_yaml_node *node, wm_grey *out, wm_error *err) {
  char name[WM_PATH_MAX], path[WM_PATH_MAX];
  wm_status status = wm_yaml_string(node, name, sizeof name, err);
  if (status != WM_OK) return status;
  const char *yaml = wm_yaml_file(node), *slash = strrchr(yaml, '/');
  const int folder = name[0] == '/' || !slash ? 0 : (int)(slash - yaml) + 1;
  if (snprintf(path, sizeof path, "%.*s%s", folder, yaml, name) >= WM_PATH_MAX)
    return wm_yaml_fail(node, err, "the path is longer than %d bytes", WM_PATH_MAX - 1);
  if (access(path, R_OK) != 0) return wm_yaml_fail(node, err, "'%s' can't be read (looked for %s)", name, path);
  status = wm_grey_load(path, out, err);
  return status == WM_OK ? WM_OK : wm_fail_in(err, "%s:%d: %s", yaml, wm_yaml_line(node), node->path);
}

static void to_two_values(wm_grey *grey) {
  const size_t count = (size_t)grey->width_px * grey->height_px;
  for (size_t i = 0; i < count; i++) grey->pixels[i] = grey->pixels[i] >= 128 ? 255 : 0;
}

// map_server: a pixel's occupancy is (255 - grey)/255, or grey/255 with `negate`; below free_thresh it is free.
static wm_status drivable_of_image(const wm_yaml_node *root, wm_grey *out, wm_error *err) {
  wm_yaml_node image = wm_yaml_get(root, "image"), negate = wm_yaml_get(root, "negate");
  wm_yaml_node free_below = wm_yaml_get(root, "free_thresh"), occupied_above = wm_yaml_get(root, "occupied_thresh");
  int64_t negated = 0;
  double free_thresh = 0.196, occupied_thresh = 0.65;
  wm_status status = WM_OK;
  if (wm_yaml_there(&negate)) status = wm_yaml_i64(&negate, 0, 1, &negated, err);
  if (status == WM_OK && wm_yaml_there(&free_below)) status = wm_yaml_f64(&free_below, 0, 1, &free_thresh, err);
  if (status == WM_OK && wm_yaml_there(&occupied_above))
    status = wm_yaml_f64(&occupied_above, 0, 1, &occupied_thresh, err);
  if (status == WM_OK && free_thresh > occupied_thresh)
    return wm_yaml_fail(&free_below, err, "%g is above occupied_thresh (%g); it must be below", free_thresh,
                        occupied_thresh);
  if (status != WM_OK || out->pixels || !wm_yaml_there(&image)) return status;
  status = read_picture(&image, out, err);
  if (status != WM_OK) return status;
  const size_t count = (size_t)out->width_px * out->height_px;
  uint8_t value_of[256];
  for (int grey = 0; grey < 256; grey++) value_of[grey] = (negated ? grey : 255 - grey) / 255.0 < free_thresh ? 255 : 0;
  for (size_t i = 0; i < count; i++) out->pixels[i] = value_of[out->pixels[i]];
  return WM_OK;
}

static wm_status read_layers(const wm_yaml_node *root, wm_warn_fn warn, void *context, wm_map *self, wm_error *err) {
  wm_yaml_node layers = wm_yaml_get(root, "layers");
  if (wm_yaml_there(&layers)) {
    if (!wm_yaml_is_map(&layers)) return wm_yaml_fail(&layers, err, "{edges: FILE, drivable: FILE} is needed");
    wm_status status = check_keys(&layers, kLayers, warn, context, err);
    wm_yaml_node edges = wm_yaml_get(&layers, "edges"), drivable = wm_yaml_get(&layers, "drivable");
    if (status == WM_OK && wm_yaml_there(&edges)) {
      status = read_picture(&edges, &self->edges, err);
      if (status == WM_OK) to_two_values(&self->edges);
    }
    if (status == WM_OK && wm_yaml_there(&drivable)) {
      status = read_picture(&drivable, &self->drivable, err);
      if (status == WM_OK) to_two_values(&self->drivable);
    }
    if (status != WM_OK) return status;
  }
  wm_status status = drivable_of_image(root, &self->drivable, err);
  if (status != WM_OK) return status;
  const wm_grey *e = &self->edges;
  const wm_grey *d = &self->drivable;
  if (!e->pixels && !d->pixels)
    return wm_yaml_fail(root, err, "image: is missing, and so are layers.edges and layers.drivable; a map needs one");
  if (e->pixels && d->pixels && (e->width_px != d->width_px || e->height_px != d->height_px))
    return wm_yaml_fail(&layers, err, "the layers must be of one size; edges has %u x %u pixels, drivable %u x %u",
                        e->width_px, e->height_px, d->width_px, d->height_px);
  self->raster.width_px = e->pixels ? e->width_px : d->width_px;
  self->raster.height_px = e->pixels ? e->height_px : d->height_px;
  self->raster.edges = e->pixels;
  self->raster.drivable = d->pixels;
  return WM_OK;
}

wm_status wm_map_load(const char *path, wm_warn_fn warn, void *context, wm_map **out, wm_error *err) {
  wm_yaml *doc;
  *out = NULL;
  wm_status status = wm_yaml_load(path, &doc, err);
  if (status != WM_OK) return status;
  wm_map *self = calloc(1, sizeof *self);
  if (!self) {
    wm_yaml_free(doc);
    return wm_fail(err, WM_IO, "%s: no memory to read it", path);
  }
  wm_yaml_node root = wm_yaml_root(doc);
  if (!wm_yaml_is_map(&root)) status = wm_yaml_fail(&root, err, "a map with image, resolution and origin is needed");
  if (status == WM_OK) status = check_keys(&root, kKeys, warn, context, err);
  if (status == WM_OK) status = read_geometry(&root, &self->raster, err);
  if (status == WM_OK) status = read_layers(&root, warn, context, self, err);
  wm_yaml_free(doc);
  if (status != WM_OK) {
    wm_map_free(self);
    return status;
  }
  self->raster.hash = wm_raster_hash(&self->raster);
  *out = self;
  return WM_OK;
}

void wm_map_free(wm_map *self) {
  if (!self) return;
  free(self->edges.pixels);
  free(self->drivable.pixels);
  free(self);
}

const wm_raster *wm_map_raster(const wm_map *self) { return &self->raster; }
