// SPDX-License-Identifier: Apache-2.0
// The usual mistakes of a first drive, each as a change of the recording's files that would undo it: signs and units of
// angles, ranges and speeds, axes of map and positions, mountings, clocks, identities, wheels, signals, cameras.
#ifndef WAYMARK_CLI_CHECK_SUSPECTS_H
#define WAYMARK_CLI_CHECK_SUSPECTS_H

#include "cli/check/edits.h"
#include "fusion/assembly.h"
#include "waymark/event.h"

typedef enum suspect_kind {
  SUSPECT_NONE = 0,        // nothing is changed
  SUSPECT_TIME,            // value: s added to the stamps of the source
  SUSPECT_TIME_FACTOR,     // value, of the stamps of the source
  SUSPECT_DISORDER,        // rows that are not in the order of their stamps
  SUSPECT_BEARING_FACTOR,  // value, of the sensor's bearings: -1, or another unit
  SUSPECT_RANGE_FACTOR,    // value, of the sensor's ranges
  SUSPECT_RANGE_IS,        // value 1: depth along the sensor's axis, 0: distance
  SUSPECT_IDENTITY,        // value: added to each identity of the sensor
  SUSPECT_IDENTITY_TABLE,  // by `ids`
  SUSPECT_NO_IDENTITY,     // all unknown: sightings are associated by their place, for the table
  SUSPECT_POSITION_SWAP,   // x and y of positions
  SUSPECT_POSITION_X,      // value: factor
  SUSPECT_POSITION_Y,
  SUSPECT_MAP_SWAP,  // x and y of the landmarks
  SUSPECT_MAP_MIRROR_X,
  SUSPECT_MAP_MIRROR_Y,
  SUSPECT_MAP_TURN,         // value: rad, half a turn
  SUSPECT_MAP_FACTOR,       // value
  SUSPECT_MOUNTING_YAW,     // value: rad added to the yaw of the sensor
  SUSPECT_MOUNTING_PITCH,   // value: rad added to its pitch
  SUSPECT_MOUNTING_ROLL,    // value: rad added to its roll
  SUSPECT_MOUNTING_RAD,     // angles that were written in radians
  SUSPECT_MOUNTING_FACTOR,  // value: of the sensor's place
  SUSPECT_MOUNTING_X,       // value: m added to the sensor's x
  SUSPECT_MOUNTING_Y,
  SUSPECT_TICKS_SWAP,
  SUSPECT_QUANTITY_FACTOR,   // value, of the bound quantity `item`: -1, or another unit
  SUSPECT_QUANTITY_FACTORS,  // value, of the bound quantities `item` and `other`
  SUSPECT_SIGNAL,            // factor `value`, `shift`: of the signal of binding `item`; `layout`: of its
                             // message's signals; item -1: of all messages
  SUSPECT_RADIUS_FACTOR,     // value, of the wheels
  SUSPECT_TICKS_FACTOR,
  SUSPECT_TRACK_FACTOR,
  SUSPECT_WHEELBASE_FACTOR,
  SUSPECT_STEERING_FACTOR,
  SUSPECT_YAW_RATE_FACTOR,  // value, of the twist's turn rate
  SUSPECT_SPEED_FACTOR,     // value, of the twist's speed
  SUSPECT_SIDEWAYS_FACTOR,  // value, of the twist's sideways velocity
  SUSPECT_TWIST_SWAP,       // speed and turn rate
  SUSPECT_TAG_FACTOR,       // value, of the markers' size
  SUSPECT_FOCAL_FACTOR,     // value, of the camera's intrinsics
  SUSPECT_PLAN_FACTOR,      // value, of the floor plan's resolution
  SUSPECT_BASELINE_FACTOR,  // value, of the stereo pair's baseline
  SUSPECT_STEREO_SWAP,      // left and right of the pair
  SUSPECT_PLAN_MIRROR,      // value 1: left and right, -1: top and bottom of the floor plan's pictures
  SUSPECT_TAG_FAMILY,       // value: of wm_marker_family_names
  SUSPECT_ORIGIN_SWAP,      // latitude and longitude of the map's origin
  SUSPECT_LATITUDE_SWAP,    // the bindings of latitude and longitude
  SUSPECT_SETTING           // item: of the configuration's settings, which gets its default
} suspect_kind;

typedef struct suspect {
  suspect_kind kind;
  uint16_t source, sensor;
  double value;
  int16_t item, other, shift;  // shift: bits
  uint16_t layout;             // signal_layout
  const id_table *ids;
} suspect;

// Those of a sensor's mounting, and of the landmarks.
static inline int suspect_is_mounting(suspect_kind kind) {
  return kind >= SUSPECT_MOUNTING_YAW && kind <= SUSPECT_MOUNTING_Y;
}
static inline int suspect_is_map(suspect_kind kind) { return kind >= SUSPECT_MAP_SWAP && kind <= SUSPECT_MAP_FACTOR; }

#define SUSPECTS_MAX 400
#define BINDINGS_SEEN_MAX 24
#define SETTINGS_SEEN_MAX 24

// What a drive was seen to have, for the choice of the suspects.
typedef struct source_seen {
  uint32_t kinds, quantities;  // bits
  uint64_t sensors;            // bits, of sightings and markers
  int has_range, is_disordered;
  int32_t least_id, most_id;  // of sightings and markers; most < least: none
  uint64_t ids[4];            // bits of the identities 0 to 255
  wm_time_ns first_ns, last_ns;
} source_seen;
void source_seen_take(source_seen *self, const wm_event *event);

// Bindings of can-signals.yaml, as they are written.
typedef struct binding_seen {
  int quantity;  // wm_quantity; -1: none
  char quantity_name[64], message[64], signal[64];
  double scale;
} binding_seen;
// A number of the configuration, ten times as large or small as its default.
typedef struct setting_seen {
  char path[96];  // "sightings.noise.bearing_default_rad"
  double value, usual;
} setting_seen;
typedef struct suspect_files {
  binding_seen bindings[BINDINGS_SEEN_MAX];
  size_t binding_count;
  const wm_config *config;
  setting_seen settings[SETTINGS_SEEN_MAX];
  size_t setting_count;
  char plan_pictures[3][WM_NAME_MAX + 8];  // of the recording's own map/map.yaml: "map/edges.png"
  size_t plan_picture_count;
  double origin[3];  // calibration.yaml: gnss.origin; NaN: none
  // Of the configuration's detector of square markers, in place of those of calibration.yaml; 0: not given.
  double tag_size_m;
  int tag_family;
} suspect_files;
// `dir`: the recording's. Files that are not there are left out.
void suspect_files_read(suspect_files *self, const wm_config *config, const char *dir);

// All that this assembly has something of, the unchanged one first. `seen`: by source.
size_t suspects_list(const wm_assembly *assembly, const suspect_files *files, const source_seen *seen,
                     suspect out[SUSPECTS_MAX]);

// The changes of the files that undo it; 0 where it can't be undone by any.
#define SUSPECT_EDITS_MAX 8
size_t suspect_edits(const suspect *self, const wm_assembly *assembly, const suspect_files *files,
                     file_edit out[SUSPECT_EDITS_MAX]);
// Of what it is.
const char *suspect_source(const suspect *self, const wm_assembly *assembly);
const wm_sensor *suspect_sensor(const suspect *self, const wm_assembly *assembly);
// What it is: "the bearings of front are positive to the right".
void suspect_text(const suspect *self, const wm_assembly *assembly, const suspect_files *files, char *what,
                  size_t capacity);

#endif
