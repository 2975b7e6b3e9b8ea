// SPDX-License-Identifier: Apache-2.0
// Each suspect in words.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "cli/check/suspects.h"
#include "waymark/detectors.h"

#define DEG (M_PI / 180)

static const char *unit_name(double factor) {
  static const struct {
    double factor;
    const char *name;
  } kNames[] = {{0.001, "mm"}, {0.01, "cm"},     {0.0254, "inches"}, {0.3048, "feet"},  {0.1, "dm"},
                {1000, "km"},  {DEG, "degrees"}, {1 / DEG, "rad"},   {1 / 3.6, "km/h"}, {3.6, "m/s"},
                {1e3, "us"},   {1e6, "ms"},      {1e9, "s"},         {0.44704, "mph"}};
  for (size_t i = 0; i < sizeof kNames / sizeof kNames[0]; i++)
    if (kNames[i].factor == fabs(factor)) return kNames[i].name;
  return "another unit";
}

static const char *layout_words(const suspect *s) {
  return s->layout == LAYOUT_ORDER || s->layout == LAYOUT_ORDER_START
             ? "the byte order (@0 big-endian, @1 little-endian)"
         : s->layout == LAYOUT_SIGN ? "the sign (+ unsigned, - signed)"
         : s->shift != 0            ? "the first bit"
                                    : "the scale";
}

// Turn rates and speeds of twists and bindings.
static void rate_text(const suspect *s, const char *name, int is_angle, char *what, size_t capacity) {
  if (s->value == -1)
    (void)snprintf(what, capacity, "%s has the wrong sign: it is positive to the %s", name,
                   is_angle ? "right" : "rear");
  else if (s->value < 0)
    (void)snprintf(what, capacity, "%s is positive to the right and in degrees", name);
  else if (is_angle && s->value < 0.1)
    (void)snprintf(what, capacity, "%s is in deg/s (or degrees), not in rad (unit: deg/s)", name);
  else if (is_angle && s->value > 50)
    (void)snprintf(what, capacity, "%s is in rad/s (or radians), not in degrees (unit: rad/s)", name);
  else
    (void)snprintf(what, capacity, "%s is %g times the true one (%s?)", name, 1 / s->value, unit_name(s->value));
}

static int is_angle(int quantity) {
  return quantity == WM_Q_YAW_RATE || quantity == WM_Q_STEERING_WHEEL || quantity == WM_Q_ROAD_WHEEL;
}

#define WHAT(...) (void)snprintf(what, capacity, __VA_ARGS__)

static void motion_text(const suspect *s, const wm_assembly *assembly, const suspect_files *files, char *what,
                        size_t capacity) {
  char name[96];
  const int has_item = s->item >= 0 && (size_t)s->item < files->binding_count;
  const binding_seen *b = has_item ? &files->bindings[s->item] : NULL;
  switch (s->kind) {
    case SUSPECT_TICKS_SWAP: WHAT("the wheels' ticks, left and right, are swapped"); break;
    case SUSPECT_QUANTITY_FACTOR:
    case SUSPECT_QUANTITY_FACTORS:
      if (!b || b->quantity < 0) break;
      if (b->quantity <= (int)WM_Q_WHEEL_TICKS_RIGHT) {
        WHAT("%s count%s backwards (scale: -1)",
             s->kind == SUSPECT_QUANTITY_FACTORS ? "both wheels' ticks" : wm_quantity_name((unsigned)b->quantity),
             s->kind == SUSPECT_QUANTITY_FACTORS ? "" : "s");
        break;
      }
      (void)snprintf(name, sizeof name, "%s%s", wm_quantity_name((unsigned)b->quantity),
                     s->kind == SUSPECT_QUANTITY_FACTORS ? " with the other side's" : "");
      rate_text(s, name, is_angle(b->quantity), what, capacity);
      break;
    case SUSPECT_SIGNAL:
      if (b)
        WHAT("the DBC has %s of %s of message %s wrong", layout_words(s),
             s->layout == LAYOUT_SAME ? b->signal : "the signals", b->message);
      else
        WHAT("the DBC has %s of all bound signals wrong", layout_words(s));
      break;
    case SUSPECT_RADIUS_FACTOR:
      WHAT("the wheels' radius is %g times the true one%s", 1 / s->value,
           s->value == 0.5   ? ": radius_m is the diameter"
           : s->value == 2   ? ": half of the radius?"
           : s->value == 0.1 ? ""
                             : ": another unit?");
      break;
    case SUSPECT_TICKS_FACTOR:
      WHAT("wheels.ticks_per_turn is %g times the true number%s", 1 / s->value,
           s->value == 4 || s->value == 2 ? ": quadrature counts 2 or 4 for each line, or a gear is missing" : "");
      break;
    case SUSPECT_TRACK_FACTOR: WHAT("wheels.track_m is %g times the true one", 1 / s->value); break;
    case SUSPECT_WHEELBASE_FACTOR: WHAT("wheels.wheelbase_m is %g times the true one", 1 / s->value); break;
    case SUSPECT_STEERING_FACTOR: WHAT("wheels.steering_ratio is %g times the true one", 1 / s->value); break;
    case SUSPECT_YAW_RATE_FACTOR: rate_text(s, "the turn rate", 1, what, capacity); break;
    case SUSPECT_SPEED_FACTOR: rate_text(s, "the speed", 0, what, capacity); break;
    case SUSPECT_SIDEWAYS_FACTOR: WHAT("the sideways velocity is positive to the right"); break;
    case SUSPECT_TWIST_SWAP: WHAT("speed and turn rate of %s are swapped", suspect_source(s, assembly)); break;
    default: break;
  }
}

static void map_text(const suspect *s, char *what, size_t capacity) {
  switch (s->kind) {
    case SUSPECT_MAP_SWAP: WHAT("x and y of the map are swapped"); break;
    case SUSPECT_MAP_MIRROR_X:
    case SUSPECT_MAP_MIRROR_Y:
      WHAT("the map is mirrored: %c has the wrong sign (x, y and z make a right-handed frame)",
           s->kind == SUSPECT_MAP_MIRROR_X ? 'x' : 'y');
      break;
    case SUSPECT_MAP_TURN: WHAT("the map is turned by half a turn against the start"); break;
    case SUSPECT_MAP_FACTOR: WHAT("the map is in %s", unit_name(s->value)); break;
    case SUSPECT_PLAN_MIRROR:
      WHAT("the floor plan is mirrored: %s are swapped", s->value > 0 ? "left and right" : "top and bottom");
      break;
    case SUSPECT_PLAN_FACTOR: WHAT("the floor plan's resolution is %g times the true one", 1 / s->value); break;
    case SUSPECT_TAG_FACTOR:
      WHAT("the markers' size is %g times the true one%s", 1 / s->value,
           s->value == 0.8 ? " (with its white frame?)" : "");
      break;
    case SUSPECT_BASELINE_FACTOR: WHAT("the stereo pair's baseline is %g times the true one", 1 / s->value); break;
    default: break;
  }
}

static void mounting_text(const suspect *s, const char *sensor, char *what, size_t capacity) {
  switch (s->kind) {
    case SUSPECT_MOUNTING_YAW:
    case SUSPECT_MOUNTING_PITCH:
    case SUSPECT_MOUNTING_ROLL:
      WHAT("the mounting of %s is turned by %.3g degrees (%s)", sensor, remainder(s->value, 2 * M_PI) / DEG,
           s->kind == SUSPECT_MOUNTING_YAW     ? "yaw"
           : s->kind == SUSPECT_MOUNTING_PITCH ? "pitch: positive looks down"
                                               : "roll");
      break;
    case SUSPECT_MOUNTING_RAD: WHAT("the mounting's angles of %s are in radians", sensor); break;
    case SUSPECT_MOUNTING_FACTOR: WHAT("the mounting of %s is in %s", sensor, unit_name(s->value)); break;
    case SUSPECT_MOUNTING_X:
    case SUSPECT_MOUNTING_Y:
      WHAT("%s is %.2f m further to the %s than its mounting", sensor, fabs(s->value),
           s->kind == SUSPECT_MOUNTING_X ? (s->value > 0 ? "front" : "rear") : (s->value > 0 ? "left" : "right"));
      break;
    default: WHAT("the lens of %s is of another resolution: its intrinsics are %g times", sensor, 1 / s->value); break;
  }
}

void suspect_text(const suspect *s, const wm_assembly *assembly, const suspect_files *files, char *what,
                  size_t capacity) {
  const char *name = suspect_source(s, assembly);
  const wm_sensor *sensor = suspect_sensor(s, assembly);
  what[0] = '\0';
  if (suspect_is_mounting(s->kind)) mounting_text(s, sensor ? sensor->name : "?", what, capacity);
  if (suspect_is_map(s->kind)) map_text(s, what, capacity);
  if (suspect_is_mounting(s->kind) || suspect_is_map(s->kind)) return;
  switch (s->kind) {
    case SUSPECT_TIME:
      WHAT("the stamps of %s are %.2f s too %s: its clock is off", name, fabs(s->value),
           s->value < 0 ? "late" : "early");
      break;
    case SUSPECT_TIME_FACTOR: WHAT("the stamps of %s are in %s", name, unit_name(s->value)); break;
    case SUSPECT_DISORDER: WHAT("the rows of %s are not in the order of their stamps", name); break;
    case SUSPECT_BEARING_FACTOR:
      WHAT("the bearings of %s are %s%s%s", name, s->value < 0 ? "positive to the right" : "",
           s->value < 0 && s->value != -1 ? " and " : "", fabs(s->value) != 1 ? "in degrees or another unit" : "");
      break;
    case SUSPECT_RANGE_FACTOR: WHAT("the ranges of %s are in %s", name, unit_name(s->value)); break;
    case SUSPECT_RANGE_IS:
      WHAT("the ranges of %s are %s", name,
           s->value > 0 ? "depths along the sensor's x axis" : "distances, not depths along the sensor's x axis");
      break;
    case SUSPECT_IDENTITY: WHAT("the ids of %s are off by %g", name, -s->value); break;
    case SUSPECT_IDENTITY_TABLE: WHAT("the ids of %s are permuted against those of the map", name); break;
    case SUSPECT_POSITION_SWAP: WHAT("x (east) and y (north) of %s are swapped", name); break;
    case SUSPECT_POSITION_X:
    case SUSPECT_POSITION_Y:
      WHAT("%c of %s has the wrong sign: x is east, y is north", s->kind == SUSPECT_POSITION_X ? 'x' : 'y', name);
      break;
    case SUSPECT_FOCAL_FACTOR: mounting_text(s, sensor ? sensor->name : "?", what, capacity); break;
    case SUSPECT_TAG_FACTOR:
    case SUSPECT_PLAN_FACTOR:
    case SUSPECT_PLAN_MIRROR:
    case SUSPECT_BASELINE_FACTOR: map_text(s, what, capacity); break;
    case SUSPECT_STEREO_SWAP: WHAT("left and right of the stereo pair are swapped"); break;
    case SUSPECT_TAG_FAMILY: WHAT("the markers are of the family %s", wm_marker_family_names[(int)s->value]); break;
    case SUSPECT_ORIGIN_SWAP: WHAT("latitude and longitude of gnss.origin are swapped"); break;
    case SUSPECT_LATITUDE_SWAP: WHAT("the signals of latitude and longitude are swapped"); break;
    case SUSPECT_SETTING:
      WHAT("%s is %.4g in the configuration, %.3g times its default: is its unit right?", files->settings[s->item].path,
           files->settings[s->item].value, files->settings[s->item].value / files->settings[s->item].usual);
      break;
    default: motion_text(s, assembly, files, what, capacity); break;
  }
}
