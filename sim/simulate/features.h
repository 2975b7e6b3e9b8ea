// SPDX-License-Identifier: Apache-2.0
// What a sensor makes of a landmark that is before it: noise, outliers, misses. Used for worlds of features alone and
// for what detectors find in pictures.
#pragma once

#include <Eigen/Core>

#include "simulate/random.h"
#include "simulate/simulate.h"

namespace wm::sim {

// The numbers that a sensor draws for landmark `landmark` (below 2^22) at its k-th look.
class FeatureDice {
 public:
  FeatureDice(uint64_t seed, size_t sensor, uint64_t k, uint64_t landmark)
      : random_(seed), k_(k), base_((sensor % 64) << 26 | (landmark & 0x3fffff) << 4) {}
  double noise(uint64_t channel) const { return random_.normal(Stream::feature_noise, k_, base_ | channel); }
  double outlier() const { return random_.uniform(Stream::feature_outlier, k_, base_ | 15); }
  double anything(uint64_t channel) const { return random_.uniform(Stream::feature_outlier, k_, base_ | channel); }
  double missed() const { return random_.uniform(Stream::feature_missed, k_, base_); }
  double patch(uint64_t bit) const { return random_.uniform(Stream::appearance_noise, k_ << 8 | bit, base_ >> 4); }
  double one_side() const { return random_.uniform(Stream::feature_missed, k_, base_ | 1); }

 private:
  Random random_;
  uint64_t k_, base_;
};

// A landmark at one look of a sensor.
struct Seen {
  uint64_t k;       // the sensor's look
  size_t landmark;  // number in the list, for the dice
  int32_t id;
  wm_time_ns t_ns, arrival_ns;
};

// Index into Recording::sensors of sensor `number` of the scenario, where it is one that calibration.yaml lists.
uint16_t sensor_index(const Scenario &scenario, size_t number);
// The number by which true_mounting() draws for it: that of its camera's, or one of its own.
uint64_t camera_number(const Scenario &scenario, size_t number);
// Whether it speaks at that time: base_link is in one of its areas.
bool is_covered(const Sensor &sensor, const Recording &recording, double t_s);
// Whether it looks at pictures, so that only what is in these is seen.
bool by_pictures(const Scenario &scenario, const Sensor &sensor);

// Each adds a row to the recording, where the sensor's field of view, range, ids and luck allow. `p` is the landmark in
// the sensor's true axes (x along its view), `print` the direction of a marker's yaw in them.
void see_landmark(const Scenario &scenario, size_t number, const Seen &seen, const Eigen::Vector3d &p, Recording &out);
void see_marker(const Scenario &scenario, size_t number, const Seen &seen, const Eigen::Vector3d &p,
                const Eigen::Vector3d &print, Recording &out);
// True pixels; NaN in a picture that doesn't have the point.
void see_stereo(const Scenario &scenario, size_t number, const Seen &seen, const double left_px[2],
                const double right_px[2], Recording &out);

}  // namespace wm::sim
