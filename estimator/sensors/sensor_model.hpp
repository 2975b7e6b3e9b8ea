// SPDX-License-Identifier: Apache-2.0
// What a mounted sensor should see of a landmark, with all derivatives. Paper, system 1, observation, with the print's
// signs mended; height, pitch and roll of the mounting are respected, and range may be a distance or a depth.
#ifndef WAYMARK_ESTIMATOR_SENSOR_MODEL_HPP
#define WAYMARK_ESTIMATOR_SENSOR_MODEL_HPP

#include "waymark/frames.h"
#include "waymark/setup.h"

namespace wm {

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

// What differs from calibration.yaml.
struct sensor_errors {
  double yaw_rad = 0.0, x_m = 0.0, y_m = 0.0, range_scale = 1.0, range_bias_m = 0.0;
  double roll_rad = 0.0, pitch_rad = 0.0;  // about the sensor's own x and y axes
  double angle_scale = 0.0;                // angles from the sensor's x axis are told larger by this part of them
};

// What a sighting depends on: x, y, heading of the pose, then the sensor's errors; the robot's own roll and pitch on
// its springs (lean, nod), and the landmark's height.
enum sighting_cause {
  kByX,
  kByY,
  kByHeading,
  kByYaw,
  kByMountX,
  kByMountY,
  kByRoll,
  kByPitch,
  kByAngleScale,
  kByLean,
  kByNod,
  kByUp,
  kCauses
};

struct expected_sighting {
  bool possible;  // false: on the sensor itself, or (for a depth) behind it
  double bearing_rad, range_m;
  double elevation_rad;  // NaN where the landmark's or the sensor's height isn't known
  double distance_m;     // on the floor
  // By each sighting_cause. By the landmark's x, y: minus those by the pose's.
  double bearing_by[kCauses], range_by[kCauses], elevation_by[kCauses];
  double range_by_scale;
};

// A ray as a sensor told it, turned into levelled axes along the mounting's yaw: its azimuth, and the tangent of its
// elevation.
struct level_ray {
  double azimuth_rad, tangent;
};
level_ray levelled(const mounted_sensor &sensor, const sensor_errors &errors, double bearing_rad, double elevation_rad);

expected_sighting expect(const mounted_sensor &sensor, const sensor_errors &errors, const wm_pose2 &pose_map_base,
                         const double landmark_m[3]);

}  // namespace wm

#endif
