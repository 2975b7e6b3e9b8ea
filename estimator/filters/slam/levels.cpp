// SPDX-License-Identifier: Apache-2.0
// A camera that leans sees a marker higher or lower from afar than from near by, and from one side than from the other.
#include "filters/slam/slam.hpp"

namespace wm {
namespace {

constexpr double kAlike = 10.0;     // so many sightings of a print, a tenth of a second apart, err alike
constexpr double kSaysMuch = 0.01;  // the least that a height is to take off the tilt's variance, as a part of its own
constexpr double kGate = 9.0;

}  // namespace

// The marker's height is no state: nobody knows it, and it is the same in each sighting, so each is held against the
// mean of those before, z - mean z = pitch (x - mean x) - roll (y - mean y), whose noise (1 + 1/n) sigma^2 is
// independent of theirs (F. R. Helmert's transform of a regression with a constant). One row more, O(n^2); none once it
// would say little.
void slam::level_camera(int landmark, int sensor, const marker_reading &r) {
  const int roll = slots_.at(sensor, kRoll), pitch = slots_.at(sensor, kPitch);
  landmark_note &note = notes()[landmark];
  if (roll < 0) return;
  // Another camera sees it elsewhere in its own axes; a print that two see in turn levels the one that saw it first.
  if (note.levelled_by < 0) note.levelled_by = sensor;
  if (note.levelled_by != sensor) return;
  const double *mean = note.levelled_m;
  if (note.levelled > 0.0) {
    const double by_pitch = r.told[0] - mean[0], by_roll = mean[1] - r.told[1];
    joint_row row;
    row.add(pitch, by_pitch);
    row.add(roll, by_roll);
    const double expected = by_pitch * joint_.value(pitch) + by_roll * joint_.value(roll);
    const double innovation = r.told[2] - mean[2] - expected;
    const double noise = kAlike * (1.0 + 1.0 / note.levelled) * r.z_noise, none = 0.0;
    if (joint_.variance_of(row) > kSaysMuch * noise) {
      joint_state::innovation_block block;
      joint_.prepare(&row, &innovation, &noise, 1, &block);
      if (block.nis < kGate) (void)joint_.fuse(block, &none, scope_now());
    }
  }
  note.levelled += 1.0;
  for (int i = 0; i < 3; i++) note.levelled_m[i] += (r.told[i] - mean[i]) / note.levelled;
}

}  // namespace wm
