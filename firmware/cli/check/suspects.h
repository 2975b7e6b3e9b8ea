// SPDX-License-Identifier: Apache-2.0
// The usual mistakes of a first drive, each as a change of the recording that would undo it: signs and units of angles
// and ranges, axes of the map, mountings, clocks, identities, wheels. A trial drives the changed recording.
#ifndef WAYMARK_CLI_CHECK_SUSPECTS_H
#define WAYMARK_CLI_CHECK_SUSPECTS_H

#include "fusion/assembly.h"
#include "waymark/event.h"

typedef enum suspect_kind {
  SUSPECT_NONE = 0,       // nothing is changed
  SUSPECT_TIME,           // value: s added to the stamps of the source
  SUSPECT_BEARING_SIGN,   // of the source's sightings
  SUSPECT_RANGE_FACTOR,   // value, of the source's sightings
  SUSPECT_IDENTITY,       // value: added to each identity of the source
  SUSPECT_NO_IDENTITY,    // of the source's sightings: associated by their place, for the table of identities
  SUSPECT_POSITION_SWAP,  // x and y of positions
  SUSPECT_MAP_SWAP,       // x and y of the landmarks
  SUSPECT_MAP_MIRROR_X,
  SUSPECT_MAP_MIRROR_Y,
  SUSPECT_MAP_FACTOR,       // value
  SUSPECT_MOUNTING_YAW,     // value: rad added to the yaw of the sensor
  SUSPECT_MOUNTING_FACTOR,  // value: of the sensor's place
  SUSPECT_TICKS_SWAP,
  SUSPECT_TICKS_LEFT_SIGN,
  SUSPECT_TICKS_RIGHT_SIGN,
  SUSPECT_TICKS_SIGN,
  SUSPECT_RADIUS_FACTOR,    // value, of the wheels
  SUSPECT_YAW_RATE_FACTOR,  // value, of CAN's yaw rate or of the twist's turn rate
  SUSPECT_SPEED_FACTOR      // value, of the twist's speed
} suspect_kind;

typedef struct suspect {
  suspect_kind kind;
  uint16_t source, sensor;
  double value;
} suspect;

#define SUSPECTS_MAX 128

// All that this assembly has something of, the unchanged one first. `seen`: kinds of events (bits) of each source, and
// the least and the largest identity that it gave.
typedef struct source_seen {
  uint32_t kinds, quantities;  // bits
  uint64_t sensors;            // bits, of sightings and markers
  int has_range;
  int32_t least_id, most_id;  // of sightings and markers; most < least: none
} source_seen;
void source_seen_take(source_seen *self, const wm_event *event);
size_t suspects_list(const wm_assembly *assembly, const source_seen *seen, suspect *out);

// Changes of one trial: `count` suspects at once.
typedef struct suspects_applied {
  const suspect *of;
  size_t count;
  wm_landmark *landmarks;  // changed copies; freed by suspects_release
  wm_sensor *sensors;
} suspects_applied;
void suspects_change(const suspects_applied *self, wm_event *event);
void suspects_prepare(suspects_applied *self, wm_assembly *assembly);
void suspects_release(suspects_applied *self);

// What it is ("its bearings are positive to the right") and what to write where.
void suspect_text(const suspect *self, const wm_assembly *assembly, char *what, size_t what_capacity, char *fix,
                  size_t fix_capacity);

#endif
