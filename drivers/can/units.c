// SPDX-License-Identifier: Apache-2.0
#include "names.h"
#include "waymark/can.h"
#include "waymark/event.h"

#define PI 3.14159265358979323846

// Spellings as fold() leaves them: lower case, no blanks, the degree sign as "deg".
static const struct {
  const char *spelling;
  wm_dimension dimension;
  double si;
} kUnits[] = {
    {"m/s", WM_DIM_SPEED, 1.0},
    {"mps", WM_DIM_SPEED, 1.0},
    {"m/sec", WM_DIM_SPEED, 1.0},
    {"meter/s", WM_DIM_SPEED, 1.0},
    {"meters/s", WM_DIM_SPEED, 1.0},
    {"meterpersecond", WM_DIM_SPEED, 1.0},
    {"meterpersecon", WM_DIM_SPEED, 1.0},  // VAG truncates its names
    {"cm/s", WM_DIM_SPEED, 0.01},
    {"mm/s", WM_DIM_SPEED, 0.001},
    {"km/h", WM_DIM_SPEED, 1.0 / 3.6},
    {"kmh", WM_DIM_SPEED, 1.0 / 3.6},
    {"kph", WM_DIM_SPEED, 1.0 / 3.6},
    {"kmph", WM_DIM_SPEED, 1.0 / 3.6},
    {"km/hr", WM_DIM_SPEED, 1.0 / 3.6},
    {"km/hour", WM_DIM_SPEED, 1.0 / 3.6},
    {"kilometerperhour", WM_DIM_SPEED, 1.0 / 3.6},
    {"mph", WM_DIM_SPEED, 0.44704},
    {"mi/h", WM_DIM_SPEED, 0.44704},
    {"mile/h", WM_DIM_SPEED, 0.44704},
    {"miles/h", WM_DIM_SPEED, 0.44704},
    {"mileperhour", WM_DIM_SPEED, 0.44704},
    {"milesperhour", WM_DIM_SPEED, 0.44704},
    {"ft/s", WM_DIM_SPEED, 0.3048},
    {"rad/s", WM_DIM_ANGULAR_RATE, 1.0},
    {"rad/sec", WM_DIM_ANGULAR_RATE, 1.0},
    {"rads", WM_DIM_ANGULAR_RATE, 1.0},
    {"radian/s", WM_DIM_ANGULAR_RATE, 1.0},
    {"radians/s", WM_DIM_ANGULAR_RATE, 1.0},
    {"mrad/s", WM_DIM_ANGULAR_RATE, 0.001},
    {"deg/s", WM_DIM_ANGULAR_RATE, PI / 180.0},
    {"deg/sec", WM_DIM_ANGULAR_RATE, PI / 180.0},
    {"deg/sek", WM_DIM_ANGULAR_RATE, PI / 180.0},
    {"degs", WM_DIM_ANGULAR_RATE, PI / 180.0},
    {"dps", WM_DIM_ANGULAR_RATE, PI / 180.0},
    {"degree/s", WM_DIM_ANGULAR_RATE, PI / 180.0},
    {"degrees/s", WM_DIM_ANGULAR_RATE, PI / 180.0},
    {"degree/sec", WM_DIM_ANGULAR_RATE, PI / 180.0},
    {"degrees/sec", WM_DIM_ANGULAR_RATE, PI / 180.0},
    {"degpersecond", WM_DIM_ANGULAR_RATE, PI / 180.0},
    {"degreespersecond", WM_DIM_ANGULAR_RATE, PI / 180.0},
    {"degreeofarcpersecon", WM_DIM_ANGULAR_RATE, PI / 180.0},
    {"degreeofarcpersecond", WM_DIM_ANGULAR_RATE, PI / 180.0},
    {"deggrad/s", WM_DIM_ANGULAR_RATE, PI / 180.0},  // "°Grad/s"
    {"rpm", WM_DIM_ANGULAR_RATE, PI / 30.0},
    {"1/min", WM_DIM_ANGULAR_RATE, PI / 30.0},
    {"u/min", WM_DIM_ANGULAR_RATE, PI / 30.0},
    {"umin", WM_DIM_ANGULAR_RATE, PI / 30.0},
    {"upm", WM_DIM_ANGULAR_RATE, PI / 30.0},
    {"r/min", WM_DIM_ANGULAR_RATE, PI / 30.0},
    {"rev/min", WM_DIM_ANGULAR_RATE, PI / 30.0},
    {"rad", WM_DIM_ANGLE, 1.0},
    {"radian", WM_DIM_ANGLE, 1.0},
    {"radians", WM_DIM_ANGLE, 1.0},
    {"mrad", WM_DIM_ANGLE, 0.001},
    {"deg", WM_DIM_ANGLE, PI / 180.0},
    {"degree", WM_DIM_ANGLE, PI / 180.0},
    {"degrees", WM_DIM_ANGLE, PI / 180.0},
    {"degreeofarc", WM_DIM_ANGLE, PI / 180.0},
    {"deggrad", WM_DIM_ANGLE, PI / 180.0},
    {"m", WM_DIM_LENGTH, 1.0},
    {"meter", WM_DIM_LENGTH, 1.0},
    {"meters", WM_DIM_LENGTH, 1.0},
    {"cm", WM_DIM_LENGTH, 0.01},
    {"mm", WM_DIM_LENGTH, 0.001},
    {"in", WM_DIM_LENGTH, 0.0254},
    {"inch", WM_DIM_LENGTH, 0.0254},
    {"m/s2", WM_DIM_ACCELERATION, 1.0},
    {"m/s^2", WM_DIM_ACCELERATION, 1.0},
    {"m/s/s", WM_DIM_ACCELERATION, 1.0},
    {"mps2", WM_DIM_ACCELERATION, 1.0},
    {"meterpersecondsquared", WM_DIM_ACCELERATION, 1.0},
    {"g", WM_DIM_ACCELERATION, 9.80665},
    {"mg", WM_DIM_ACCELERATION, 0.00980665},
};

enum { kLongestUnit = 32 };

// Lower case without blanks; "°" (C2 B0 or B0) becomes "deg"; VAG's prefix "Unit_" goes. 0 where it is too long.
static int fold(wm_text unit, char out[kLongestUnit]) {
  size_t n = 0;
  for (size_t i = 0; i < unit.length; i++) {
    unsigned char c = (unsigned char)unit.at[i];
    if (c == ' ' || c == '\t' || c == 0xC2) continue;
    if (n + 4 > kLongestUnit) return 0;
    if (c == 0xB0) {
      memcpy(out + n, "deg", 3);
      n += 3;
    } else {
      out[n++] = (char)(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
    }
  }
  out[n] = '\0';
  if (strncmp(out, "unit_", 5) == 0) memmove(out, out + 5, n - 4);
  return 1;
}

int wm_unit_find(wm_text unit, wm_dimension *dimension, double *si) {
  char folded[kLongestUnit];
  if (!fold(unit, folded)) return 0;
  for (size_t i = 0; i < sizeof kUnits / sizeof *kUnits; i++) {
    if (strcmp(folded, kUnits[i].spelling) != 0) continue;
    *dimension = kUnits[i].dimension;
    *si = kUnits[i].si;
    return 1;
  }
  return 0;
}

const char *wm_dimension_units(wm_dimension dimension) {
  switch (dimension) {
    case WM_DIM_NONE: return "none";
    case WM_DIM_SPEED: return "m/s, km/h, mph, cm/s, mm/s";
    case WM_DIM_ANGULAR_RATE: return "rad/s, deg/s, rpm";
    case WM_DIM_ANGLE: return "rad, deg";
    case WM_DIM_LENGTH: return "m, cm, mm";
    case WM_DIM_ACCELERATION: return "m/s2, g, mg";
  }
  return "";
}

wm_dimension wm_quantity_dimension(int quantity) {
  if (quantity == WM_CAN_LATITUDE || quantity == WM_CAN_LONGITUDE) return WM_DIM_ANGLE;
  if (quantity > WM_CAN_LONGITUDE && quantity < WM_CAN_VALID) return WM_DIM_LENGTH;
  switch ((wm_quantity)quantity) {
    case WM_Q_WHEEL_SPEED_FRONT_LEFT:
    case WM_Q_WHEEL_SPEED_FRONT_RIGHT:
    case WM_Q_WHEEL_SPEED_REAR_LEFT:
    case WM_Q_WHEEL_SPEED_REAR_RIGHT:
    case WM_Q_VEHICLE_SPEED: return WM_DIM_SPEED;
    case WM_Q_ROLL_RATE:
    case WM_Q_PITCH_RATE:
    case WM_Q_YAW_RATE: return WM_DIM_ANGULAR_RATE;
    case WM_Q_ACCELERATION_X:
    case WM_Q_ACCELERATION_Y:
    case WM_Q_ACCELERATION_Z: return WM_DIM_ACCELERATION;
    case WM_Q_STEERING_WHEEL:
    case WM_Q_ROAD_WHEEL: return WM_DIM_ANGLE;
    case WM_Q_STEERING_ACTUATOR: return WM_DIM_LENGTH;
    case WM_Q_WHEEL_TICKS_LEFT:
    case WM_Q_WHEEL_TICKS_RIGHT:
    case WM_Q_GEAR:
    case WM_Q_COUNT: return WM_DIM_NONE;
  }
  return WM_DIM_NONE;
}
