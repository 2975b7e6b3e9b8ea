// SPDX-License-Identifier: Apache-2.0
// What each kind of event holds, a row a field, in the order of the event log. From these rows follow the codec
// (codec_event.c), the columns of sightings in a recording (stream_kinds.c, record.c) and their numbers over LCM
// (lcm_sightings.c). A new field is a member in event.h and a row here. Quantities and points have as many entries as
// they count; the codec writes them out.
#ifndef WAYMARK_EVENT_FIELDS_H
#define WAYMARK_EVENT_FIELDS_H

#include <float.h>
#include <stddef.h>
#include <stdint.h>

#include "waymark/event.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// Limits of plausible values: wide enough for all vehicles, tight enough for corrupt data. Estimators have the same.
#define WM_SPEED_MOST_MPS 150.0
#define WM_RATE_MOST_RADPS 50.0
#define WM_ACCELERATION_MOST_MPS2 2000.0  // 200 g: the largest range of accelerometers of vehicles
#define WM_PLACE_MOST_M 1e7               // above it is no coordinate of a map, nor of UTM
#define WM_MARKER_MOST_M 1e4              // from the sensor
#define WM_HEADING_SIGMA_MOST_RAD 10.0    // of a stated pose; pi is an unknown heading
#define WM_UNIT_NORM 0.01                 // a quaternion's squared length may differ from 1 by this
#define WM_SPEED_LIMITS -WM_SPEED_MOST_MPS, WM_SPEED_MOST_MPS
#define WM_RATE_LIMITS -WM_RATE_MOST_RADPS, WM_RATE_MOST_RADPS
#define WM_ACCELERATION_LIMITS -WM_ACCELERATION_MOST_MPS2, WM_ACCELERATION_MOST_MPS2
#define WM_ANGLE_LIMITS -6.2832, 6.2832  // rad
#define WM_PLACE_LIMITS -WM_PLACE_MOST_M, WM_PLACE_MOST_M
#define WM_MARKER_LIMITS -WM_MARKER_MOST_M, WM_MARKER_MOST_M
#define WM_SIGMA_LEAST 1e-6  // of any unit: no sensor of a vehicle knows a micrometre, or 0.2 arc seconds
#define WM_SIGMA_LIMITS WM_SIGMA_LEAST, 1e6
#define WM_PIXEL_LIMITS -1e5, 1e5
#define WM_COVARIANCE_LIMITS -1e12, 1e12  // of any unit

#define WM_EVENT_VERSION 7         // of the codec; the next one where a field comes
#define WM_EVENT_VERSION_OLDEST 3  // that is read

// Numbers of a sighting.
// NUMBER(member, need, least, most, limits in words, codec version it came with, last version whose 0 means absent,
// message) need: ONE_OF (a row has at least one of those) or OPTIONAL; message: IN_MESSAGE or NOT_IN_MESSAGE
// (observations_t.lcm).
#define WM_SIGHTING_NUMBERS(NUMBER)                                                                          \
  NUMBER(bearing_rad, ONE_OF, -6.2832, 6.2832, "within a turn of 0", 0, 0, IN_MESSAGE)                       \
  NUMBER(range_m, ONE_OF, DBL_MIN, 1e5, "above 0, and not above 100000", 0, 0, IN_MESSAGE)                   \
  NUMBER(bearing_sigma_rad, OPTIONAL, WM_SIGMA_LEAST, 1e6, "from 0.000001 to 1000000", 0, 0, NOT_IN_MESSAGE) \
  NUMBER(range_sigma_m, OPTIONAL, WM_SIGMA_LEAST, 1e6, "from 0.000001 to 1000000", 0, 0, NOT_IN_MESSAGE)     \
  NUMBER(elevation_rad, OPTIONAL, -1.5708, 1.5708, "not beyond the vertical", 4, 0, IN_MESSAGE)              \
  NUMBER(elevation_sigma_rad, OPTIONAL, WM_SIGMA_LEAST, 1e6, "from 0.000001 to 1000000", 4, 4, IN_MESSAGE)

typedef enum wm_field_type { WM_FIELD_F64, WM_FIELD_I64, WM_FIELD_U64, WM_FIELD_I32, WM_FIELD_U16 } wm_field_type;

typedef struct wm_event_field {
  const char *name;    // as the member's
  uint16_t offset;     // in wm_event
  uint8_t type;        // wm_field_type
  uint8_t count;       // elements
  uint8_t since;       // codec version it came with; of older logs NaN, or 0 bits, is read. 0: always there
  uint8_t zero_until;  // last codec version in which 0 stands for absent; 0: none
  uint8_t needed;      // the first so many elements are never absent; F64 alone
  double least, most;  // what can be; F64 alone
} wm_event_field;

// Fields of a kind, in the order of the event log. None: the kind holds nothing, or as many entries as it counts. Any
// thread.
const wm_event_field *wm_event_fields(unsigned kind, size_t *count);

// Largest absolute value of a quantity; beyond it is an error of the sender.
double wm_quantity_most(unsigned quantity);

// Checks an event of another program before it goes on: kind, counts and numbers. WM_BAD_DATA, WM_NOT_FINITE or
// WM_OUT_OF_RANGE, with the member's name and what it may be. Not its times and indices of sensors.
wm_status wm_event_check(const wm_event *event, wm_error *err);

#ifdef __cplusplus
}
#endif

#endif
