// SPDX-License-Identifier: Apache-2.0
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "ignore.h"
#include "picture.h"
#include "waymark/yaml.h"

struct wm_map {
  wm_raster raster;
  wm_grey edges, drivable;
};

static const char *const kKeys[] = {"image",       "resolution", "origin", "negate", "occupied_thresh",
                                    "free_thresh", "mode",       "layers", "ignore", NULL};
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
  if (unknown > 0 && warn) warn(context, WM_NOTE_FILE, said.text);
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
static wm_status read_picture(const wm_yaml_node *node, wm_grey *out, uint8_t **opaque, wm_error *err) {
  char name[WM_PATH_MAX], path[WM_PATH_MAX];
  wm_status status = wm_yaml_string(node, name, sizeof name, err);
  if (status != WM_OK) return status;
  const char *yaml = wm_yaml_file(node), *slash = strrchr(yaml, '/');
  const int folder = name[0] == '/' || !slash ? 0 : (int)(slash - yaml) + 1;
  if (snprintf(path, sizeof path, "%.*s%s", folder, yaml, name) >= WM_PATH_MAX)
    return wm_yaml_fail(node, err, "the path is longer than %d bytes", WM_PATH_MAX - 1);
  if (access(path, R_OK) != 0) return wm_yaml_fail(node, err, "'%s' can't be read (looked for %s)", name, path);
  status = picture_load(path, PICTURE_MAP, out, opaque, err);
  return status == WM_OK ? WM_OK : wm_fail_in(err, "%s:%d: %s", yaml, wm_yaml_line(node), node->path);
}

// A layer: white is in it; black, and what is transparent, is not.
static wm_status read_layer(const wm_yaml_node *node, wm_grey *out, wm_error *err) {
  uint8_t *opaque = NULL;
  const wm_status status = read_picture(node, out, &opaque, err);
  const size_t count = status == WM_OK ? (size_t)out->width_px * out->height_px : 0;
  for (size_t i = 0; i < count; i++) out->pixels[i] = out->pixels[i] >= 128 && (!opaque || opaque[i]) ? 255 : 0;
  free(opaque);
  return status;
}

// ── the image's cells, as map_server has them ───────────────────────────────────────────────────────────────────────

// "trinary" and "scale" part free and occupied by the thresholds alike; what scale grades between them is unknown here.
typedef enum map_mode { MODE_TRINARY, MODE_SCALE, MODE_RAW } map_mode;
static const char *const kModes[] = {"trinary", "scale", "raw", NULL};

typedef struct meaning {
  int32_t mode, negate;
  double free_thresh, occupied_thresh;
} meaning;

// 0 or 1, or a truth value.
static wm_status read_negate(const wm_yaml_node *node, int32_t *out, wm_error *err) {
  int64_t number = 0;
  int truth = 0;
  if (wm_yaml_bool(node, &truth, NULL) == WM_OK) {
    *out = truth;
    return WM_OK;
  }
  const wm_status status = wm_yaml_i64(node, 0, 1, &number, err);
  *out = (int32_t)number;
  return status;
}

static wm_status read_meaning(const wm_yaml_node *root, meaning *out, wm_error *err) {
  wm_yaml_node mode = wm_yaml_get(root, "mode"), negate = wm_yaml_get(root, "negate");
  wm_yaml_node free_below = wm_yaml_get(root, "free_thresh"), occupied_above = wm_yaml_get(root, "occupied_thresh");
  *out = (meaning){.free_thresh = 0.196, .occupied_thresh = 0.65};
  wm_status status = WM_OK;
  if (wm_yaml_there(&mode)) status = wm_yaml_choice(&mode, kModes, &out->mode, err);
  if (status == WM_OK && wm_yaml_there(&negate)) status = read_negate(&negate, &out->negate, err);
  if (status == WM_OK && wm_yaml_there(&free_below)) status = wm_yaml_f64(&free_below, 0, 1, &out->free_thresh, err);
  if (status == WM_OK && wm_yaml_there(&occupied_above))
    status = wm_yaml_f64(&occupied_above, 0, 1, &out->occupied_thresh, err);
  if (status == WM_OK && out->free_thresh > out->occupied_thresh)
    return wm_yaml_fail(&free_below, err, "%g is above occupied_thresh (%g); it must be below", out->free_thresh,
                        out->occupied_thresh);
  if (status == WM_OK && out->mode == MODE_RAW && out->negate)
    return wm_yaml_fail(&negate, err, "the map servers of ROS 1 and 2 differ in what it means with mode raw; write 0");
  return status;
}

#define RAW_OCCUPIED 100   // per cent; raw values above are unknown
#define SAVED_UNKNOWN 205  // of map_saver (ROS 1 and 2), whatever thresholds it writes beside
#define SAVED_SHARE 100    // a note where one pixel in so many is of that level: fewer may be noise of a scanned plan

static int8_t cell_of(const meaning *m, int grey) {
  if (m->mode == MODE_RAW && grey > RAW_OCCUPIED) return WM_CELL_UNKNOWN;
  const double occupied = m->mode == MODE_RAW ? grey / (double)RAW_OCCUPIED : (m->negate ? grey : 255 - grey) / 255.0;
  return occupied > m->occupied_thresh ? WM_CELL_OCCUPIED : occupied < m->free_thresh ? WM_CELL_FREE : WM_CELL_UNKNOWN;
}

// Unknown places that the thresholds make free, as those of nav2's map_saver do.
static void warn_of_unknown(const wm_yaml_node *image, const meaning *m, const wm_grey *grey, wm_warn_fn warn,
                            void *context) {
  size_t unknown = 0;
  const size_t count = (size_t)grey->width_px * grey->height_px;
  if (!warn || m->mode == MODE_RAW || cell_of(m, SAVED_UNKNOWN) != WM_CELL_FREE) return;
  for (size_t i = 0; i < count; i++) unknown += grey->pixels[i] == SAVED_UNKNOWN;
  if (unknown * SAVED_SHARE < count || unknown == 0) return;
  char text[320];
  (void)snprintf(text, sizeof text,
                 "%s: %zu of 100 pixels are 205, which map savers write for unknown places, and free_thresh %g makes "
                 "them free; write `free_thresh: 0.196`",
                 wm_yaml_file(image), unknown * 100 / count, m->free_thresh);
  warn(context, WM_NOTE_FILE, text);
}

// Cells of `image`, in the place of its pixels.
static wm_status read_cells(const wm_yaml_node *root, const wm_yaml_node *image, wm_warn_fn warn, void *context,
                            wm_grey *out, wm_error *err) {
  meaning m;
  uint8_t *opaque = NULL;
  wm_status status = read_meaning(root, &m, err);
  if (status == WM_OK) status = read_picture(image, out, &opaque, err);
  if (status != WM_OK) return status;
  warn_of_unknown(image, &m, out, warn, context);
  const size_t count = (size_t)out->width_px * out->height_px;
  uint8_t cell[256];
  for (int grey = 0; grey < 256; grey++) cell[grey] = (uint8_t)cell_of(&m, grey);
  for (size_t i = 0; i < count; i++)
    out->pixels[i] = opaque && !opaque[i] ? (uint8_t)WM_CELL_UNKNOWN : cell[out->pixels[i]];
  free(opaque);
  return WM_OK;
}

static wm_status drivable_of_image(const wm_yaml_node *root, wm_warn_fn warn, void *context, wm_grey *out,
                                   wm_error *err) {
  wm_yaml_node image = wm_yaml_get(root, "image");
  meaning ignored;
  if (out->pixels || !wm_yaml_there(&image)) return read_meaning(root, &ignored, err);
  const wm_status status = read_cells(root, &image, warn, context, out, err);
  const size_t count = status == WM_OK ? (size_t)out->width_px * out->height_px : 0;
  for (size_t i = 0; i < count; i++) out->pixels[i] = (int8_t)out->pixels[i] == WM_CELL_FREE ? 255 : 0;
  return status;
}

static wm_status read_layers(const wm_yaml_node *root, wm_warn_fn warn, void *context, wm_map *self, wm_error *err) {
  wm_yaml_node layers = wm_yaml_get(root, "layers");
  if (wm_yaml_there(&layers)) {
    if (!wm_yaml_is_map(&layers)) return wm_yaml_fail(&layers, err, "{edges: FILE, drivable: FILE} is needed");
    wm_status status = check_keys(&layers, kLayers, warn, context, err);
    wm_yaml_node edges = wm_yaml_get(&layers, "edges"), drivable = wm_yaml_get(&layers, "drivable");
    if (status == WM_OK && wm_yaml_there(&edges)) status = read_layer(&edges, &self->edges, err);
    if (status == WM_OK && wm_yaml_there(&drivable)) status = read_layer(&drivable, &self->drivable, err);
    if (status != WM_OK) return status;
  }
  wm_status status = drivable_of_image(root, warn, context, &self->drivable, err);
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
  return map_ignore(root, &self->raster, &self->edges, err);
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

// ── for the desk ────────────────────────────────────────────────────────────────────────────────────────────────────

wm_status wm_map_cells_load(const char *path, wm_raster *place, int8_t **cells, wm_error *err) {
  wm_yaml *doc;
  wm_grey image = {0};
  *place = (wm_raster){0};
  *cells = NULL;
  wm_status status = wm_yaml_load(path, &doc, err);
  if (status != WM_OK) return status;
  wm_yaml_node root = wm_yaml_root(doc), node;
  if (!wm_yaml_is_map(&root)) status = wm_yaml_fail(&root, err, "a map with image, resolution and origin is needed");
  if (status == WM_OK) status = read_geometry(&root, place, err);
  if (status == WM_OK) status = need(&root, "image", "the picture of the map is needed", &node, err);
  if (status == WM_OK) status = read_cells(&root, &node, NULL, NULL, &image, err);
  wm_yaml_free(doc);
  if (status != WM_OK) return status;
  place->width_px = image.width_px;
  place->height_px = image.height_px;
  *cells = (int8_t *)image.pixels;
  return WM_OK;
}
