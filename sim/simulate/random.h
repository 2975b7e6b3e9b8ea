// SPDX-License-Identifier: Apache-2.0
// Random numbers that depend on (seed, stream, index) alone: what one sensor draws is the same whatever else is there.
#pragma once

#include <cstdint>

#include "waymark/random.h"

namespace wm::sim {

// One stream for each kind of error. The numbers are part of what a seed means: add at the end, never renumber.
enum class Stream : uint64_t {
  wheel_radius = 1,
  track,
  yaw_rate_bias,
  yaw_rate_walk,
  yaw_rate_noise,
  steering_offset,
  landmark_map,
  camera_yaw,
  start_pose,
  encoder_phase,
  can_jitter,
  can_fault,
  bearing_noise,
  bearing_outlier,
  bearing_outlier_value,
  frame_latency,
  frame_fault,
  sighting_fault,
  slip,
  camera_mounting,
  camera_intrinsics,
  frame_jitter,
  frame_lost,
  velocity_scale,
  velocity_noise,
  rate_bias,
  rate_noise,
  landmark_place,
  way,
  feature_noise,
  feature_outlier,
  feature_missed,
  position_wander,
  compass,
  start_place,
  frame_duplicated,
  frame_reordered,
  sighting_misread,
  sighting_false,
  landmark_moved,
  elevation_noise,
  elevation_outlier,
  tilt,
  command_delay,
  wheel_noise,
  twist_scale,
  twist_noise,
  rotation_center,
  gyro_noise,
  accelerometer_noise,
  accelerometer_bias,
  vibration,
  bump,
  appearance,
  appearance_noise,
};

class Random {
 public:
  explicit Random(uint64_t seed) : seed_(seed) {}

  uint64_t seed() const { return seed_; }

  // In [0, 1). `sub` (below 2^32) tells apart several draws of one index.
  double uniform(Stream stream, uint64_t index, uint64_t sub = 0) const {
    return wm_random_uniform(seed_, number(stream, sub), index);
  }
  // Mean 0, standard deviation 1.
  double normal(Stream stream, uint64_t index, uint64_t sub = 0) const {
    return wm_random_normal(seed_, number(stream, sub), index);
  }

 private:
  static uint64_t number(Stream stream, uint64_t sub) { return static_cast<uint64_t>(stream) << 32 | sub; }

  uint64_t seed_;
};

}  // namespace wm::sim
