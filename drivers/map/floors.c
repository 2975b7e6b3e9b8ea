// SPDX-License-Identifier: Apache-2.0
#include "waymark/floors.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "waymark/yaml.h"

static const char *const kSiteKeys[] = {"format", "name", "origin", "floors", "connections", NULL};
static const char *const kFloorKeys[] = {"name", "landmarks", "map", "points", "origin", NULL};
static const char *const kConnectionKeys[] = {"name", "kind", "radius_m", "ends", NULL};
static const char *const kEndKeys[] = {"floor", "x_m", "y_m", "heading_deg", NULL};
// A cabin of a lift is 1.1 to 2.5 m long; the robot's own size comes to it.
#define RADIUS_DEFAULT_M 1.5
static const char *const kKinds[] = {"lift", "ramp", "door", NULL};  // wm_connection_kind

// "FOLDER/FILE"; `out` "" where FILE is "".
static wm_status join(const char *folder, const char *file, char out[WM_PATH_MAX], wm_error *err) {
  if (snprintf(out, WM_PATH_MAX, "%s/%s", folder, file) < WM_PATH_MAX) return WM_OK;
  return wm_fail(err, WM_BAD_USAGE, "%s/%s: the path is longer than %d bytes", folder, file, WM_PATH_MAX - 1);
}

static int is_there(const char *folder, const char *file) {
  char path[WM_PATH_MAX];
  return join(folder, file, path, NULL) == WM_OK && access(path, F_OK) == 0;
}

// ── site.yaml ───────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status read_name(const wm_yaml_node *map, char out[WM_NAME_MAX], wm_error *err) {
  wm_yaml_node node = wm_yaml_get(map, "name");
  if (!wm_yaml_there(&node)) return wm_yaml_fail(map, err, "name: is missing");
  wm_status status = wm_yaml_string(&node, out, WM_NAME_MAX, err);
  if (status == WM_OK && (!out[0] || strchr(out, '/')))
    return wm_yaml_fail(&node, err, "'%s' is no name: letters, digits, blanks and '-' are, but no '/'", out);
  return status;
}

// A file of the site: a version holds a copy of it, so that it must lie in the site's folder.
static wm_status read_file(const wm_yaml_node *map, const char *key, const char *folder, char out[WM_PATH_MAX],
                           wm_error *err) {
  char name[WM_PATH_MAX];
  wm_yaml_node node = wm_yaml_get(map, key);
  if (!wm_yaml_there(&node)) return WM_OK;
  wm_status status = wm_yaml_string(&node, name, sizeof name, err);
  if (status == WM_OK && (name[0] == '/' || strstr(name, "..")))
    return wm_yaml_fail(&node, err, "'%s' lies outside of the site's folder; put a copy into it", name);
  return status == WM_OK ? join(folder, name, out, err) : status;
}

static wm_status read_origin(const wm_yaml_node *map, double out[3], wm_error *err) {
  wm_yaml_node node = wm_yaml_get(map, "origin");
  if (!wm_yaml_there(&node)) return WM_OK;
  wm_status status = wm_yaml_f64_list(&node, 3, 3, out, NULL, err);
  if (status == WM_OK && !(fabs(out[0]) <= 90 && fabs(out[1]) <= 180 && fabs(out[2]) < 1e4))
    return wm_yaml_fail(&node, err, "[%g, %g, %g]: latitude and longitude in degrees and altitude in m are needed",
                        out[0], out[1], out[2]);
  return status;
}

static int floor_of(const wm_floors *self, const char *name) {
  for (int i = 0; i < self->floor_count; i++)
    if (strcmp(self->floors[i].name, name) == 0) return i;
  return -1;
}

static wm_status read_floor(const wm_yaml_node *node, const double origin[3], wm_floors *out, wm_error *err) {
  if (out->floor_count == WM_FLOORS_MAX)
    return wm_yaml_fail(node, err, "more than %d floors; make a site of each building", WM_FLOORS_MAX);
  wm_floor *floor = &out->floors[out->floor_count];
  memcpy(floor->origin, origin, sizeof floor->origin);
  floor->line = wm_yaml_line(node);
  wm_status status = wm_yaml_check_keys(node, kFloorKeys, WM_YAML_STRICT, NULL, err);
  if (status == WM_OK) status = read_name(node, floor->name, err);
  if (status == WM_OK && floor_of(out, floor->name) >= 0)
    return wm_yaml_fail(node, err, "name: a floor '%s' stands above already", floor->name);
  if (status == WM_OK) status = read_file(node, "landmarks", out->folder, floor->landmarks, err);
  if (status == WM_OK) status = read_file(node, "map", out->folder, floor->map, err);
  if (status == WM_OK) status = read_file(node, "points", out->folder, floor->points, err);
  if (status == WM_OK) status = read_origin(node, floor->origin, err);
  out->floor_count++;
  if (status == WM_OK && !floor->landmarks[0] && !floor->map[0] && !floor->points[0])
    return wm_yaml_fail(node, err, "floor '%s' has no map: landmarks, map or points is needed", floor->name);
  return status;
}

static wm_status read_end(const wm_yaml_node *node, const wm_floors *site, wm_connection *out, wm_error *err) {
  char name[WM_NAME_MAX] = "";
  double heading_deg = 0;
  wm_yaml_node floor = wm_yaml_get(node, "floor"), x = wm_yaml_get(node, "x_m"), y = wm_yaml_get(node, "y_m"),
               heading = wm_yaml_get(node, "heading_deg");
  wm_status status = wm_yaml_check_keys(node, kEndKeys, WM_YAML_STRICT, NULL, err);
  if (status != WM_OK) return status;
  if (!wm_yaml_there(&floor) || !wm_yaml_there(&x) || !wm_yaml_there(&y))
    return wm_yaml_fail(node, err, "{floor: NAME, x_m: X, y_m: Y, heading_deg: DEGREES} is needed");
  if (out->end_count == WM_FLOORS_MAX) return wm_yaml_fail(node, err, "more than %d ends", WM_FLOORS_MAX);
  wm_connection_end *end = &out->ends[out->end_count];
  status = wm_yaml_string(&floor, name, sizeof name, err);
  if (status == WM_OK) status = wm_yaml_f64(&x, -1e8, 1e8, &end->x_m, err);
  if (status == WM_OK) status = wm_yaml_f64(&y, -1e8, 1e8, &end->y_m, err);
  if (status == WM_OK && wm_yaml_there(&heading)) status = wm_yaml_f64(&heading, -360, 360, &heading_deg, err);
  if (status != WM_OK) return status;
  end->heading_rad = heading_deg * M_PI / 180;
  end->floor = floor_of(site, name);
  if (end->floor < 0) return wm_yaml_fail(&floor, err, "there is no floor '%s' under floors", name);
  for (int i = 0; i < out->end_count; i++)
    if (out->ends[i].floor == end->floor) return wm_yaml_fail(&floor, err, "'%s' has an end already", name);
  out->end_count++;
  return WM_OK;
}

static wm_status read_connection(const wm_yaml_node *node, wm_floors *out, wm_error *err) {
  if (out->connection_count == WM_CONNECTIONS_MAX)
    return wm_yaml_fail(node, err, "more than %d connections; make a site of each building", WM_CONNECTIONS_MAX);
  wm_connection *connection = &out->connections[out->connection_count++];
  wm_yaml_node kind = wm_yaml_get(node, "kind"), ends = wm_yaml_get(node, "ends"),
               radius = wm_yaml_get(node, "radius_m");
  int32_t chosen = 0;
  connection->radius_m = RADIUS_DEFAULT_M;
  connection->line = wm_yaml_line(node);
  wm_status status = wm_yaml_check_keys(node, kConnectionKeys, WM_YAML_STRICT, NULL, err);
  if (status == WM_OK) status = read_name(node, connection->name, err);
  if (status == WM_OK) status = wm_yaml_choice(&kind, kKinds, &chosen, err);
  if (status == WM_OK && wm_yaml_there(&radius)) status = wm_yaml_f64(&radius, 0.1, 100, &connection->radius_m, err);
  connection->kind = (wm_connection_kind)chosen;
  for (size_t i = 0; status == WM_OK && i < wm_yaml_count(&ends); i++) {
    wm_yaml_node end = wm_yaml_item(&ends, i);
    status = read_end(&end, out, connection, err);
  }
  if (status == WM_OK && connection->end_count < 2)
    return wm_yaml_fail(node, err, "'%s' connects nothing: two ends or more are needed, each on another floor",
                        connection->name);
  return status;
}

static wm_status need_list(const wm_yaml_node *root, const char *key, int is_needed, wm_yaml_node *out, wm_error *err) {
  *out = wm_yaml_get(root, key);
  if (wm_yaml_there(out) ? wm_yaml_is_list(out) && wm_yaml_count(out) > 0 : !is_needed) return WM_OK;
  return wm_yaml_fail(wm_yaml_there(out) ? out : root, err, "%s: a list is needed (docs/building.md)", key);
}

static wm_status read_site(const wm_yaml_node *root, wm_floors *out, wm_error *err) {
  static const char *const kFormats[] = {"waymark-site/1", NULL};
  int32_t chosen;
  double origin[3] = {(double)NAN, (double)NAN, (double)NAN};
  wm_yaml_node format = wm_yaml_get(root, "format"), floors, connections;
  if (!wm_yaml_is_map(root) || !wm_yaml_there(&format))
    return wm_yaml_fail(root, err, "a map that begins with 'format: waymark-site/1' is needed");
  wm_status status = wm_yaml_choice(&format, kFormats, &chosen, err);
  if (status == WM_OK) status = wm_yaml_check_keys(root, kSiteKeys, WM_YAML_STRICT, NULL, err);
  if (status == WM_OK) status = read_name(root, out->name, err);
  if (status == WM_OK) status = read_origin(root, origin, err);
  if (status == WM_OK) status = need_list(root, "floors", 1, &floors, err);
  for (size_t i = 0; status == WM_OK && i < wm_yaml_count(&floors); i++) {
    wm_yaml_node node = wm_yaml_item(&floors, i);
    status = read_floor(&node, origin, out, err);
  }
  if (status == WM_OK) status = need_list(root, "connections", 0, &connections, err);
  for (size_t i = 0; status == WM_OK && i < wm_yaml_count(&connections); i++) {
    wm_yaml_node node = wm_yaml_item(&connections, i);
    status = read_connection(&node, out, err);
  }
  return status;
}

// ── a folder ────────────────────────────────────────────────────────────────────────────────────────────────────────

// A recording's folder, or a map's: a site of one floor.
static wm_status read_single(const char *folder, wm_floors *out, wm_error *err) {
  wm_floor *floor = &out->floors[0];
  const char *map = is_there(folder, "map/map.yaml") ? "map/map.yaml" : "map.yaml";
  wm_status status = WM_OK;
  if (is_there(folder, "landmarks.csv")) status = join(folder, "landmarks.csv", floor->landmarks, err);
  if (status == WM_OK && is_there(folder, map)) status = join(folder, map, floor->map, err);
  if (status == WM_OK && !floor->landmarks[0] && !floor->map[0])
    return wm_fail(err, WM_NOT_FOUND,
                   "%s: is no site: there is no site.yaml in it, no landmarks.csv and no map.yaml (docs/building.md)",
                   folder);
  (void)snprintf(floor->name, sizeof floor->name, "ground");
  for (int i = 0; i < 3; i++) floor->origin[i] = (double)NAN;
  out->floor_count = 1;
  return status;
}

static wm_status read_folder(const char *folder, wm_floors *out, wm_error *err) {
  size_t length = strlen(folder);
  while (length > 1 && folder[length - 1] == '/') length--;
  if (snprintf(out->folder, sizeof out->folder, "%.*s", (int)length, folder) >= WM_PATH_MAX)
    return wm_fail(err, WM_BAD_USAGE, "%s: the path is longer than %d bytes", folder, WM_PATH_MAX - 1);
  if (!is_there(out->folder, "site.yaml")) return read_single(out->folder, out, err);
  wm_yaml *doc;
  wm_status status = join(out->folder, "site.yaml", out->yaml, err);
  if (status == WM_OK) status = wm_yaml_load(out->yaml, &doc, err);
  if (status != WM_OK) return status;
  const wm_yaml_node root = wm_yaml_root(doc);
  status = read_site(&root, out, err);
  wm_yaml_free(doc);
  return status;
}

wm_status wm_floors_read(const char *folder, wm_floors **out, wm_error *err) {
  wm_floors *self = calloc(1, sizeof *self);
  *out = NULL;
  if (!self) return wm_fail(err, WM_IO, "%s: no memory to read it", folder);
  const wm_status status = read_folder(folder, self, err);
  if (status == WM_OK)
    *out = self;
  else
    free(self);
  return status;
}

wm_status wm_floors_of_version(const char *folder, const char *name, wm_floors **out, wm_error *err) {
  wm_map_version version;
  char path[WM_PATH_MAX];
  *out = NULL;
  wm_status status = wm_map_version_read(folder, name, &version, err);
  free(version.files);
  if (status == WM_OK && snprintf(path, sizeof path, "%s/versions/%s", folder, name) >= WM_PATH_MAX)
    status =
        wm_fail(err, WM_BAD_USAGE, "%s/versions/%s: the path is longer than %d bytes", folder, name, WM_PATH_MAX - 1);
  if (status == WM_OK) status = wm_floors_read(path, out, err);
  if (status == WM_OK) (void)snprintf((*out)->version, sizeof(*out)->version, "%s", name);
  return status;
}

wm_status wm_floors_current(const char *folder, wm_floors **out, wm_error *err) {
  char name[WM_MAP_VERSION_NAME];
  *out = NULL;
  const wm_status status = wm_map_version_current(folder, name, err);
  if (status != WM_OK) return status;
  return name[0] ? wm_floors_of_version(folder, name, out, err) : wm_floors_read(folder, out, err);
}

// ── a floor ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static int is_site(const char *folder) { return is_there(folder, "site.yaml") || is_there(folder, "versions/current"); }

// The floor's name where `path` is SITE/FLOOR, cut off `folder`; NULL: `path` is the site.
static const char *cut_floor(const char *path, char folder[WM_PATH_MAX]) {
  (void)snprintf(folder, WM_PATH_MAX, "%s", path);
  size_t length = strlen(folder);
  while (length > 1 && folder[length - 1] == '/') folder[--length] = '\0';
  char *slash = strrchr(folder, '/');
  if (is_site(folder)) return NULL;
  if (!slash || slash == folder) return NULL;
  *slash = '\0';
  if (is_site(folder)) return slash + 1;
  *slash = '/';
  return NULL;
}

wm_status wm_floor_choose(const char *path, wm_chosen_floor *out, wm_error *err) {
  char folder[WM_PATH_MAX], names[256] = "";
  wm_floors *site;
  const char *name = cut_floor(path, folder);
  memset(out, 0, sizeof *out);
  wm_status status = wm_floors_current(folder, &site, err);
  if (status != WM_OK) return status;
  out->index = name ? floor_of(site, name) : site->floor_count == 1 ? 0 : -1;
  if (name && out->index < 0) {
    for (int i = 0; i < site->floor_count; i++)
      (void)snprintf(names + strlen(names), sizeof names - strlen(names), "%s%s", i ? ", " : "", site->floors[i].name);
    free(site);
    return wm_fail(err, WM_BAD_CONFIG, "%s has no floor '%s'; its floors are %s", folder, name, names);
  }
  out->floor = site->floors[out->index < 0 ? 0 : out->index];
  memcpy(out->version, site->version, sizeof out->version);
  out->site = site;
  return WM_OK;
}
