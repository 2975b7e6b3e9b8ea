// SPDX-License-Identifier: Apache-2.0
// A building as a folder (docs/building.md): floors with their maps, and the connections between them, in versions.
//
//   site.yaml                          floors and connections; a folder without one is a site of one floor
//   versions/current                   one line: the name of the version that robots take
//   versions/NAME/version.yaml         base, date, author, the hash of each file; the files beside it
//
// Read at start; allocates.
#ifndef WAYMARK_FLOORS_H
#define WAYMARK_FLOORS_H

#include "waymark/setup.h"
#include "waymark/site.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_MAP_VERSION_NAME 17  // bytes: 16 hexadecimal digits, terminated

typedef struct wm_floor {
  char name[WM_NAME_MAX];
  // "" where it has none. Below the site's folder, or below the version's.
  char landmarks[WM_PATH_MAX];  // landmarks.csv, with the tags
  char map[WM_PATH_MAX];        // map.yaml: plan and edges
  char points[WM_PATH_MAX];     // a saved map (start.saved_map)
  double origin[3];             // WGS84 of its zero: latitude and longitude in degrees, altitude in m; NaN: unknown
  int line;                     // of site.yaml; 0 without one
} wm_floor;

// One place, in the axes of a floor.
typedef struct wm_connection_end {
  int floor;  // index
  double x_m, y_m, heading_rad;
} wm_connection_end;

// The same place on two floors or more. Its ends give the transform from one floor's axes to another's.
typedef struct wm_connection {
  char name[WM_NAME_MAX];
  wm_connection_kind kind;
  double radius_m;  // of the area about an end, in which a robot changes floors
  wm_connection_end ends[WM_FLOORS_MAX];
  int end_count;
  int line;
} wm_connection;

typedef struct wm_floors {
  char folder[WM_PATH_MAX];           // with the files: the site, or its version
  char yaml[WM_PATH_MAX];             // site.yaml; "" without one
  char version[WM_MAP_VERSION_NAME];  // "": the files of the site itself
  char name[WM_NAME_MAX];
  wm_floor floors[WM_FLOORS_MAX];
  int floor_count;
  wm_connection connections[WM_CONNECTIONS_MAX];
  int connection_count;
} wm_floors;

// The files of the site itself, which people edit. The caller frees *out by free(). WM_NOT_FOUND where `folder` is no
// site; WM_BAD_CONFIG with file, line and key. Whether the files are there is not looked at.
wm_status wm_floors_read(const char *folder, wm_floors **out, wm_error *err);
// The current version, with the hash of each of its files compared: WM_BAD_DATA where one is damaged. Where there are
// no versions the site itself.
wm_status wm_floors_current(const char *folder, wm_floors **out, wm_error *err);
// Version `name`, likewise.
wm_status wm_floors_of_version(const char *folder, const char *name, wm_floors **out, wm_error *err);

// A floor as a configuration names it: SITE/FLOOR, or SITE alone. Of the current version.
typedef struct wm_chosen_floor {
  wm_floor floor;   // the first one where it is unknown
  wm_floors *site;  // with all floors; NULL: none was chosen. Freed by free()
  int index;        // of the floor; -1: SITE alone, with several floors
  char version[WM_MAP_VERSION_NAME];
} wm_chosen_floor;
wm_status wm_floor_choose(const char *path, wm_chosen_floor *out, wm_error *err);

// A version's record. Files are in the order of their names.
typedef struct wm_map_version_file {
  char path[WM_PATH_MAX];  // below the version's folder
  uint64_t hash;
} wm_map_version_file;
typedef struct wm_map_version {
  char name[WM_MAP_VERSION_NAME], base[WM_MAP_VERSION_NAME];  // base "": the first one
  char date[32];                                              // UTC, ISO 8601
  char author[64], note[256];
  wm_map_version_file *files;
  size_t file_count;
} wm_map_version;

// Name of the current version; "" without versions. WM_BAD_DATA where its file is damaged.
wm_status wm_map_version_current(const char *folder, char out[WM_MAP_VERSION_NAME], wm_error *err);
// Reads version.yaml of `name` and compares the hash of each file. The caller frees out->files, also on failure.
wm_status wm_map_version_read(const char *folder, const char *name, wm_map_version *out, wm_error *err);
// A version's name, by its files: the same files have the same name.
void wm_map_version_name(const wm_map_version *version, char out[WM_MAP_VERSION_NAME]);
// Hash of a record's text, which its last line has.
uint64_t wm_map_version_seal(const char *text, size_t length);
// 64-bit FNV-1a of a file's bytes.
wm_status wm_file_hash(const char *path, uint64_t *out, wm_error *err);

#ifdef __cplusplus
}
#endif

#endif
