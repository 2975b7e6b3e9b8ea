// SPDX-License-Identifier: Apache-2.0
// Expected bearing, range and elevation of a landmark from a mounted sensor, with all derivatives. Source: the
// observation model of [Stepanov2017] with corrected signs; height, pitch and roll of the mounting are respected, and a
// range may be a distance or a depth.
#ifndef WAYMARK_ESTIMATOR_SENSORS_SENSOR_MODEL_HPP
#define WAYMARK_ESTIMATOR_SENSORS_SENSOR_MODEL_HPP

#include "sensors/sensor_states.h"
#include "waymark/frames.h"
#include "waymark/setup.h"

namespace wm {

inline constexpr int kMaxSensors = 16;  // capacity

// A sensor's mounting, ready for use.
struct mounted_sensor {
  double x_m, y_m, z_m, yaw_rad;
  double axis[3][3];  // the sensor's axes in levelled axes along its yaw: (Ry(pitch) Rx(roll))'
  double bearing_sigma_rad, range_sigma_m, max_range_m;
  bool range_is_depth;
  // Its x axis points up or down rather than ahead (a hemispherical camera): bearings are azimuths about the
  // mounting's yaw, as of a level sensor.
  bool is_steep;

  void init(const wm_sensor &sensor);
};

#define WM_SENSOR_STATE_ONE(state, ...) state,
#define WM_SENSOR_STATE_TWO(state, second, ...) state, second,
enum sensor_state { WM_SENSOR_STATES(WM_SENSOR_STATE_ONE, WM_SENSOR_STATE_TWO) kSensorStateEnd };
inline constexpr int kSensorStates = kSensorStateEnd;

struct sensor_state_spec {
  const char *name;  // as calibration() lists it, behind the sensor's name
  int row;           // of wm_sensor_states
  double neutral, low, high;
};
#define WM_SENSOR_SPEC_ONE(state, key, unit, name, neutral, low, high, ...) \
  {name, WM_SENSOR_ROW_##state, neutral, low, high},
#define WM_SENSOR_SPEC_TWO(state, second, key, unit, name, name2, neutral, low, high, ...) \
  {name, WM_SENSOR_ROW_##state, neutral, low, high}, {name2, WM_SENSOR_ROW_##state, neutral, low, high},
inline constexpr sensor_state_spec kSensorStateSpecs[kSensorStates] = {
    WM_SENSOR_STATES(WM_SENSOR_SPEC_ONE, WM_SENSOR_SPEC_TWO)};

// By how much a sensor differs from calibration.yaml; by sensor_state.
struct sensor_errors {
  double value[kSensorStates];
  constexpr sensor_errors() : value{} {
    for (int k = 0; k < kSensorStates; k++) value[k] = kSensorStateSpecs[k].neutral;
  }
  double &operator[](int state) { return value[state]; }
  double operator[](int state) const { return value[state]; }
};

// A sighting depends on the pose (x, y, heading), on the sensor's errors, on the body's own tilt on its suspension
// (roll about its x axis, pitch about y), and on the landmark's height. By the landmark's x, y: minus those by the
// pose's.
enum sighting_cause : int { kByX, kByY, kByHeading, kByBodyRoll, kByBodyPitch, kByHeight };
inline constexpr int kBySensor = kByHeight + 1;  // and those after it, by sensor_state
inline constexpr int kCauses = kBySensor + kSensorStates;

// Which components are wanted; the others stay 0, since each costs an arctangent.
enum sighting_component : unsigned {
  kBearing = 1,
  kRange = 2,
  kElevation = 4,
  kAngleScaled = 8,  // derivatives by the angle scale, even while it is 0
  kAllComponents = 15
};

struct expected_sighting {
  bool possible;  // false: on the sensor itself, or (for a depth) behind it
  double bearing_rad, range_m;
  double elevation_rad;  // NaN where the landmark's or the sensor's height isn't known
  double distance_m;     // on the floor
  // By each sighting_cause, but for the time offset, which depends on the motion (planar/past_pose.hpp).
  double bearing_by[kCauses], range_by[kCauses], elevation_by[kCauses];
};

// A measured ray, turned into levelled axes along the mounting's yaw: its azimuth, and the tangent of its elevation.
struct level_ray {
  double azimuth_rad, tangent;
};
level_ray levelled(const mounted_sensor &sensor, const sensor_errors &errors, double bearing_rad, double elevation_rad);

expected_sighting expect(const mounted_sensor &sensor, const sensor_errors &errors, const wm_pose2 &pose_map_base,
                         const double landmark_m[3], unsigned components = kAllComponents);

}  // namespace wm

#endif
