// SPDX-License-Identifier: Apache-2.0
// Is a sensor's calibration taken from a false detection? Before a sensor has seen anything, its states are so unsure
// that an outlier of several degrees passes the gate, and at its small noise it decides them. Then the good sightings
// are refused. They agree with each other, with the pose, and with the states' prior; false detections, a moved
// landmark and a misread identity do not. So the last ones are tested jointly, with the prior in place of the states
// [Neira2001]. Once a sensor has more sightings fused than refused, its states are no longer in question.
#ifndef WAYMARK_ESTIMATOR_CORE_FIRST_SIGHTINGS_HPP
#define WAYMARK_ESTIMATOR_CORE_FIRST_SIGHTINGS_HPP

#include <cstdint>
#include <cstring>

#include "sensors/sensor_model.hpp"

namespace wm {

class first_sightings {
 public:
  static constexpr int kPose = 3;

  // One component of a sighting that the gate refused. `by_pose`, `by_own`: derivatives by the pose and the sensor's
  // states; `innovation`: with these states at their prior's mean; `noise`: variance of all else.
  struct row {
    double by_pose[kPose], by_own[kSensorStates], innovation, noise;
  };

  void begin() { std::memset(static_cast<void *>(this), 0, sizeof *this); }
  void fused(int sensor) {
    sensor_[sensor].fused++;
    sensor_[sensor].kept = 0;
  }
  // `count`: of the sighting's components, one or two.
  void refused(int sensor, int landmark, const row *rows, int count);
  // Whether the last ones fit together with the prior's variances of the states and the pose's covariance.
  bool contradict(int sensor, const double pose[kPose][kPose], const double prior[kSensorStates]) const;
  // The states are at their prior again.
  void restarted(int sensor) { sensor_[sensor] = {}; }

 private:
  // Tested jointly, of two landmarks or more; not swept.
  static constexpr int kSightings = 4;
  static constexpr int kRows = 2 * kSightings;

  struct sensor_record {
    row of[kRows];
    int64_t fused, refused;  // since the states began
    int32_t rows[kSightings], landmark[kSightings];
    int64_t kept;  // sightings, without one that was fused between
  };

  sensor_record sensor_[kMaxSensors];
};

}  // namespace wm

#endif
